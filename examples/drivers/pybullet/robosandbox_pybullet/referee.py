"""What really is in Bullet's world, for judging: poses, speeds and contacts that no skill and no perception reads."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robosandbox.driver import ARM, HAND
from robosandbox.types import ArmTruth, Array, ObjectTruth, Pose, SceneObject, Truth, frozen_array
from robosandbox.types.solids import solids_as_written
from robosandbox_pybullet.world import BulletWorld

# Fields of Bullet's contact points: the other body, its normal, and the normal force, N.
_OTHER, _NORMAL, _FORCE = 2, 7, 9


def pressed(world: BulletWorld, object_id: str) -> float:
    """Return how hard the robot presses on an object now, N, friction left out."""
    total = np.zeros(3)
    for body in world.bodies[object_id]:
        for point in world.call("getContactPoints", bodyA=world.robot, bodyB=body):
            total += point[_FORCE] * np.array(point[_NORMAL])
    return float(np.linalg.norm(total))


def measured(world: BulletWorld, *, time: float, home_q: Array, felt: Mapping[str, float]) -> Truth:
    """Return the state of a world.

    Args:
        world: Whose.
        time: Seconds since its beginning.
        home_q: The arm's home, shape (n,).
        felt: How hard objects were pressed at the most, N, by id; those that nobody asked of are left out.
    """
    objects = {item.id: _object(world, item, felt.get(item.id, 0.0)) for item in world.scene.objects}
    held = set.intersection(*(_touched(world, world.robot, finger) for finger in world.fingers)) & objects.keys()
    return Truth(
        time=time,
        arms={ARM: ArmTruth(q=frozen_array(world.joint_states(world.arm)[:, 0]), home_q=home_q)},
        table_height=world.scene.table_height,
        objects=objects,
        hands={HAND: min(held, default=None)},
    )


def _object(world: BulletWorld, item: SceneObject, felt: float) -> ObjectTruth:
    bodies = world.bodies[item.id]
    poses = [world.object_pose(body) for body in bodies]
    speeds = np.array([world.call("getBaseVelocity", body) for body in bodies])
    many = item.shape.is_granular
    opening = world.call("getJointState", bodies[0], 0)[0] if item.shape.opens else None
    middle = Pose.from_matrix(np.mean([pose.position for pose in poses], axis=0), np.eye(3))
    return ObjectTruth(
        id=item.id,
        kind=item.kind,
        size=item.size,
        rgba=item.rgba,
        pose=middle if many else poses[0],
        linear_velocity=frozen_array(speeds[:, 0].mean(axis=0)),
        angular_velocity=frozen_array(np.zeros(3) if many else speeds[0, 1]),
        contacts=tuple(sorted(set().union(*(_touched(world, body) for body in bodies)) - {item.id})),
        felt=felt,
        opening=opening,
        grains=tuple(pose.xyz for pose in poses) if many else (),
        solids=solids_as_written(item, poses[0], opening),
    )


def _touched(world: BulletWorld, body: int, link: int | None = None) -> set[str]:
    """Return what a body, or one of its links, presses on; points at which bodies are near and no more do not count."""
    which = {} if link is None else {"linkIndexA": link}
    points = world.call("getContactPoints", bodyA=body, **which)
    return {world.names[point[_OTHER]] for point in points if point[_FORCE] > 0.0}
