"""Stillness of things: over a while, or for good by what forces and speeds say of one moment."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from robosandbox.shapes import shape_of
from robosandbox.tasks.judge.polygons import depth, outline
from robosandbox.tasks.judge.support import ROBOT
from robosandbox.types import Array, ObjectTruth, Truth

# Seconds after which a thing that the robot holds, and how far it may have crept by then, metres and radians: a tenth of what
# it may creep in the whole time, so that it stays within that also if a push that stays the same speeds it up.
_GRIP_SECONDS, _GRIP_CREEP, _GRIP_TURN = 0.3, 0.0001, math.radians(0.1)
# How far a thing may creep within the two seconds in which it has to lie still, metres and radians. Chosen: held things creep
# by 0.0001 m a second at the most under this simulation's solver settings (docs/measured.md), what topples or rolls passes it.
_CREEP = 0.002
_TURN = math.radians(2.0)
# Speed below which a thing may be at rest for good, m/s, of any of its points; chosen above what contacts leave of a cube that
# stands (measured: 0.0002).
_SPEED = 0.005
# Share of the weight by which the forces on a thing may fail to add up to it; chosen: contacts at rest were measured to
# balance to 0.1 %, a thing that begins to fall lacks all of it.
_IMBALANCE = 0.05
# Least way of the middle of mass from the edge of what carries it, metres; chosen above what contact points jump by.
_FOOTING = 0.001
# m/s^2, as in every world here.
_GRAVITY = 9.81


def any_moved(before: Truth, now: Truth, names: Iterable[str]) -> bool:
    """Tell whether one of some objects moved or turned by more than things creep."""
    return any(_moved(before.objects[name], now.objects[name], _CREEP, _TURN) for name in names)


def rests_for_good(still: Truth, now: Truth) -> bool:
    """Tell whether nothing will move by itself: then nothing is learned by waiting longer.

    Of each object the forces add up to its weight, its middle of mass lies well within what carries it, and its energy of
    motion is below what it would have to rise by to topple over the nearest edge; or the robot holds it, and it has hardly
    crept. What rolls, beads, and what stands on an edge never pass; nor does a world that tells no forces.

    Args:
        still: The world at an earlier moment.
        now: The world.
    """
    long_enough = now.time - still.time >= _GRIP_SECONDS - 1e-6
    return all(
        _is_footed(item)
        or (
            long_enough
            and ROBOT in item.contacts
            and not item.grains
            and not _moved(still.objects[name], item, _GRIP_CREEP, _GRIP_TURN)
        )
        for name, item in now.objects.items()
    )


def _moved(before: ObjectTruth, after: ObjectTruth, far: float, turn: float) -> bool:
    if (
        max(np.abs(after.pose.position - before.pose.position).max(), abs((after.opening or 0) - (before.opening or 0)))
        > far
    ):
        return True
    if shape_of(before.kind).turns_on_the_spot:
        # A ball that turns on the spot, as between two flat pads, takes no other place; one that rolls does.
        return False
    # Of a rotation by an angle, the matrix differs from one by 2 sqrt(2) sin(angle / 2): exact also for tiny ones.
    off = float(np.linalg.norm(after.pose.rotation - before.pose.rotation))
    return off > 2.0 * math.sqrt(2.0) * math.sin(turn / 2.0)


def _is_footed(item: ObjectTruth) -> bool:
    if not item.touches or item.weight is None or item.mass_centre is None or item.grains:
        return False
    if any(one.other == ROBOT for one in item.touches):
        return False
    points = np.array([one.point for one in item.touches])
    forces = np.array([one.force for one in item.touches])
    middle = np.array(item.mass_centre)
    carrying = points[forces[:, 2] > 0.0]
    # Beyond the balance on top of it: what lies on it presses it down, and the sum is its own weight all the same.
    lacks = float(np.linalg.norm(forces.sum(axis=0) - [0.0, 0.0, item.weight]))
    if lacks > _IMBALANCE * item.weight or not len(carrying):
        return False
    speed = _speed(item, middle)
    footing = depth(outline(carrying[:, :2]), middle[:2])
    height = max(float(middle[2] - carrying[:, 2].min()), 1e-3)
    if footing < _FOOTING or speed > _SPEED:
        return False
    rise = math.hypot(footing, height) - height
    return 0.5 * speed**2 < _GRAVITY * rise


def _speed(item: ObjectTruth, middle: Array) -> float:
    """Return a bound on the speed of any point of an object, m/s."""
    reach = max(
        (float(np.linalg.norm(one.points - middle, axis=1).max()) + one.radius for one in item.solids), default=0.0
    )
    return float(np.linalg.norm(item.linear_velocity)) + reach * float(np.linalg.norm(item.angular_velocity))
