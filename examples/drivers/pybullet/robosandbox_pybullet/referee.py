"""What really is in Bullet's world, for judging: poses, speeds and contacts that no skill and no perception reads."""

from __future__ import annotations

import numpy as np

from robosandbox.types import Array, ObjectTruth, Pose, SceneObject, Truth, frozen_array
from robosandbox_pybullet.world import BulletWorld

# Fields of Bullet's contact points: the other body, and the normal force, N.
_OTHER, _FORCE = 2, 9


def measured(world: BulletWorld, *, time: float, home_q: Array) -> Truth:
    """Return the state of a world.

    Args:
        world: Whose.
        time: Seconds since its beginning.
        home_q: The arm's home, shape (n,).
    """
    objects = {item.id: _object(world, item) for item in world.scene.objects}
    held = set.intersection(*(_touched(world, world.robot, finger) for finger in world.fingers)) & objects.keys()
    return Truth(
        time=time,
        q=frozen_array(world.joint_states(world.arm)[:, 0]),
        home_q=home_q,
        table_height=world.scene.table_height,
        objects=objects,
        held=min(held, default=None),
    )


def _object(world: BulletWorld, item: SceneObject) -> ObjectTruth:
    bodies = world.bodies[item.id]
    poses = [world.object_pose(body) for body in bodies]
    speeds = np.array([world.call("getBaseVelocity", body) for body in bodies])
    many = item.shape.is_granular
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
        opening=world.call("getJointState", bodies[0], 0)[0] if item.shape.opens else None,
        grains=tuple(pose.xyz for pose in poses) if many else (),
    )


def _touched(world: BulletWorld, body: int, link: int | None = None) -> set[str]:
    """Return what a body, or one of its links, presses on; points at which bodies are near and no more do not count."""
    which = {} if link is None else {"linkIndexA": link}
    points = world.call("getContactPoints", bodyA=body, **which)
    return {world.names[point[_OTHER]] for point in points if point[_FORCE] > 0.0}
