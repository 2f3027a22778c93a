"""Carrying without spilling: the way on which what is held stays level."""

from __future__ import annotations

import numpy as np

from robosandbox.errors import UnreachableError
from robosandbox.motion.timing import join
from robosandbox.skills.primitives.gripping import bearable
from robosandbox.skills.primitives.manipulator import Manipulator, raised
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, Speed, Timing, Trajectory
from robosandbox.world.relations import contents

# Rad by which what holds things may lean on its way; chosen as a third of the slope on which boxes begin to slide at a
# friction of 0.5 (halved and doubled five placing tasks end alike).
MOST_TILT = np.radians(8.0)
# Rows of a trajectory between two that are looked at; chosen as 50 ms, in which a hand turns by less than MOST_TILT.
_EVERY = 10
_UP = np.array([0.0, 0.0, 1.0])
# Metres over the higher end at which it is carried across; chosen so that the lowest that is free is taken.
_RISES = (0.0, 0.05, 0.1, 0.2)


def carried_along(held: DetectedObject, scene: ObservedScene) -> tuple[str, ...]:
    """Return the ids of what lies in the held object, and would fall out if it were tilted."""
    if not held.shape.holds_things:
        return ()
    return tuple(dict.fromkeys(name for name, _ in contents(scene.objects, held)))


def carry_speed(arm: Manipulator, held: DetectedObject, scene: ObservedScene, speed: Speed) -> Speed:
    """Return at what speed something held is carried: as full, heavy and hard to hold as it is, at most at `speed`.

    A speed of the careful tempo is returned as it is.
    """
    if not isinstance(speed, Timing):
        return speed
    return arm.tempo.full if carried_along(held, scene) else bearable(arm, held, speed)


def transfer(arm: Manipulator, q_goal: Array, *, level: bool, speed: Speed) -> Trajectory:
    """Return a free way from where the arm is.

    Args:
        arm: Its motion planner knows what is held.
        q_goal: Where to, shape (n,).
        level: Whether what is held is to keep its attitude, but for a turn about the vertical.
        speed: At which it is carried.

    Raises:
        CollisionError: There is no free way.
        UnreachableError: There is none on which it stays level.
    """
    motion, q = arm.motion, arm.q
    direct = motion.plan_joints(q, q_goal, speed=speed)
    if not level or tilt(arm, direct) <= MOST_TILT:
        return direct
    start, goal = motion.forward(q), motion.forward(q_goal)
    failure: UnreachableError | None = None
    for rise in _RISES:
        height = max(start.xyz[2], goal.xyz[2]) + rise
        try:
            up = motion.plan_line(q, _at(start, height), speed=speed)
            across = motion.plan_line(up.q[-1], _at(goal, height), speed=speed)
            down = motion.plan_line(across.q[-1], goal, speed=speed)
        except UnreachableError as error:
            failure = error
            continue
        return join([up, across, down])
    assert failure is not None
    raise failure


def tilt(arm: Manipulator, trajectory: Trajectory) -> float:
    """Return by how much what is held leans over the most on the way, against how it is held at its start, radians."""
    upward = arm.motion.forward(trajectory.q[0]).rotation.T @ _UP
    rows = trajectory.q[::_EVERY]
    least = min(float((arm.motion.forward(q).rotation @ upward)[2]) for q in rows)
    return float(np.arccos(np.clip(least, -1.0, 1.0)))


def _at(pose: Pose, height: float) -> Pose:
    return raised(pose, height - pose.xyz[2])
