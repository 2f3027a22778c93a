"""Suction cups in a simulated world: how far one lies on something, and how hard it pulls where it touches."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.robots.robot import Gripper, Robot
from robosandbox.sim.world import World
from robosandbox.types import Array

# Number of points of a lip that are looked at, and the share of its radius at which they lie. Chosen: the circle inside
# twelve points on 0.9 of the radius has 0.87 of it.
_POINTS, _RIM = 12, 0.9
_BEHIND = 0.003  # Metres behind the lip from which is looked along the approach. Chosen above what contacts yield.
_GAP = 0.001  # Metres between the lip and a thing that it lies on. Chosen: what a soft lip bridges.


def seal(world: World, robot: Robot, data: mujoco.MjData) -> float | None:
    """Return the radius about the axis of a robot's cup within which it lies on something, metres; None for fingers.

    It is that of the largest circle about the axis inside the points of the lip that lie on something; 0 where the axis is
    outside of them, as over an edge.
    """
    gripper = robot.gripper
    if gripper is None or gripper.geometry.cup is None:
        return None
    position, rotation = robot.tcp(data)
    (body,) = gripper.finger_bodies[0]
    angles = np.arange(_POINTS) * 2.0 * np.pi / _POINTS
    rim = _RIM * gripper.geometry.cup / 2.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    geom = np.zeros(1, np.int32)
    on = []
    for x, y in rim:
        start = position + rotation @ np.array([x, y, -_BEHIND])
        far = mujoco.mj_ray(world.model, data, start, rotation[:, 2].copy(), None, True, body, geom)
        if 0.0 <= far < _BEHIND + _GAP and not world.robot_geoms[geom[0]]:
            on.append((x, y))
    return _inner_radius(np.array(on).reshape(-1, 2))


def _inner_radius(points: Array) -> float:
    """Return the radius of the largest circle about the origin inside points on a circle about it, (k, 2), in their order."""
    if len(points) < 3:
        return 0.0
    after = np.roll(points, -1, axis=0)
    edges = after - points
    # How far the origin lies to the left of each edge; the points go round against the clock.
    crossed = edges[:, 1] * points[:, 0] - edges[:, 0] * points[:, 1]
    return max(0.0, float((crossed / np.linalg.norm(edges, axis=1)).min()))


def is_sucking(gripper: Gripper, data: mujoco.MjData) -> bool:
    """Tell whether a cup is told to suck."""
    return gripper.state(data).closed > 0.0


def pulls(world: World, data: mujoco.MjData) -> Array | None:
    """Return how hard cups pull along the normal of each contact, N, shape (contacts,); None where none does.

    MuJoCo applies adhesion as a force of the actuator, spread evenly over the contacts of its body; what a contact is said
    to press with holds it as well.
    """
    spread: Array | None = None
    for gripper in world.grippers.values():
        if gripper.geometry.cup is None or not data.ncon:
            continue
        force = float(data.actuator_force[gripper.actuator_ids].sum())
        (body,) = gripper.finger_bodies[0]
        mine = (world.model.geom_bodyid[data.contact.geom] == body).any(axis=1)
        if force > 0.0 and mine.any():
            pulled: Array = np.where(mine, force / int(mine.sum()), 0.0)
            spread = pulled if spread is None else spread + pulled
    return spread
