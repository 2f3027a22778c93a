"""Draw what the fingers hold out level from under what would keep it from rising: a plug in a wall, a mug under a spout."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from robosandbox.driver import Guard
from robosandbox.errors import CollisionError, Phase, SkillError, UnreachableError
from robosandbox.evidence import CollisionEvidence
from robosandbox.skills.primitives.manipulator import LIFT_HEIGHT, Manipulator, moved, raised
from robosandbox.types import CAREFUL, Array, DetectedObject, ObservedScene, Pose, Trajectory
from robosandbox.world.nearness import nearer
from robosandbox.world.placement_sampling import CARRIED_OVER

# Metres between two places that are looked at: a hand rises past nothing that is thinner unseen, as its own parts are thicker.
_STEP = 0.01
# Metres by which a thing has to go deeper into another to be kept by it, and not only to be seen a little too near: perception's error.
_DEEPER = 0.004
# Metres over what it stands on at which a thing is carried out, tried in this order: the least is above what a descent errs by.
_CARRIED_OVER = (CARRIED_OVER, 0.3 * CARRIED_OVER)


def draw_out(
    arm: Manipulator,
    held: DetectedObject,
    scene: ObservedScene,
    guards: Sequence[Guard] = (),
    out: Array | None = None,
) -> ObservedScene:
    """Move level, the shortest way, to where the hand can rise with what it holds, if it has to and can; return the scene then.

    Only what is fixed counts: what lies on the held thing is somebody else's to clear away.

    Args:
        arm: Whose hand; its motion planner knows what it holds.
        held: That.
        scene: As it is.
        guards: As in `Manipulator.follow`.
        out: The way (3,), metres, where it is known; it is carried over what it stands on, where there is room.

    Raises:
        UnreachableError: The way that is known is out of reach.
        CollisionError: Something is in that way.
        LimitError: It pulled as hard as the robot may.
        TrackingError: The arm did not arrive.
    """
    if not any(item.is_fixed for item in scene.objects):
        return scene
    loose = [item.id for item in scene.objects if not item.is_fixed]
    arm.motion.allow("table", *loose)
    here, q = arm.state.tcp_pose, arm.q
    most = max(0.0, _depth(arm, q)) + _DEEPER
    met = _met_rising(arm, here, q, most)
    if met is None:
        return scene
    if out is not None:
        way = carried_out(arm, held, scene, q, out)
    else:
        goal = _way_out(arm, here, q, most, _axes(met, scene))
        if goal is None:
            return scene
        # What it is drawn out of it rubs on.
        arm.motion.allow("table", *(item.id for item in scene.objects))
        way = arm.motion.plan_line(q, goal, speed=CAREFUL.lower)
    arm.follow(way, Phase.LIFT, guards=guards)
    scene = arm.look(held.id)
    arm.use(scene, held=held.id)
    return scene


def carried_out(arm: Manipulator, held: DetectedObject, scene: ObservedScene, q: Array, out: Array) -> Trajectory:
    """Return the way on which a thing is lifted a little and carried out level, nothing but what it stands on touched, and that as it rises.

    Args:
        arm: Whose hand; its motion planner knows what it holds.
        held: That.
        scene: As it is.
        q: Where the arm is then, shape (n,).
        out: The level way (3,), metres.

    Raises:
        UnreachableError: It is out of reach.
        CollisionError: Something is in the way.
    """
    motion, here = arm.motion, arm.motion.forward(q)
    stands_on = [item.id for item in scene.objects if item.id != held.id and nearer(held, item, CARRIED_OVER)]
    failure: SkillError | None = None
    for height in _CARRIED_OVER:
        over = [raised(here, height), raised(moved(here, out), height)]
        try:
            motion.allow("table", *stands_on)
            up = motion.plan_line(q, over[0], speed=CAREFUL.lower)
            motion.allow()
            motion.plan_line(up.q[-1], over[1], speed=CAREFUL.lower)
            motion.allow("table", *stands_on)
            return motion.plan_through(q, over, speed=CAREFUL.lower)
        except (UnreachableError, CollisionError) as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _way_out(arm: Manipulator, here: Pose, q: Array, most: float, axes: Sequence[Array]) -> Pose | None:
    """Return the nearest level place from which the hand can rise, nothing on the way there met deeper than `most`; None without one."""
    ways = {number: (axis, q) for number, axis in enumerate(axes)}
    for step in range(1, round(LIFT_HEIGHT / _STEP) + 1):
        for number, (axis, near) in list(ways.items()):
            there = moved(here, step * _STEP * axis)
            try:
                found = arm.motion.ik(there, near, restarts=0)
            except UnreachableError:
                del ways[number]
                continue
            if _depth(arm, found) > most:
                del ways[number]
                continue
            ways[number] = axis, found
            if _met_rising(arm, there, found, 0.0) is None:
                return there
    return None


def _met_rising(arm: Manipulator, here: Pose, q: Array, most: float) -> str | None:
    """Return what the hand meets deeper than `most` metres as it rises from a place with what it holds, as far as it reaches."""
    for height in _heights():
        try:
            q = arm.motion.ik(raised(here, height), q, restarts=0)
        except UnreachableError:
            return None
        met = arm.motion.touch(q)
        if met is not None and isinstance(met.evidence, CollisionEvidence) and met.evidence.depth > most:
            return met.evidence.other
    return None


def _heights() -> Iterator[float]:
    yield from np.arange(_STEP, LIFT_HEIGHT + _STEP / 2.0, _STEP).tolist()


def _depth(arm: Manipulator, q: Array) -> float:
    """Return how deep the robot, or what it holds, is in something at `q` (n,), metres; negative where it only comes near."""
    met = arm.motion.touch(q)
    return met.evidence.depth if met is not None and isinstance(met.evidence, CollisionEvidence) else -math.inf


def _axes(met: str, scene: ObservedScene) -> list[Array]:
    """Return the four level directions along the sides of what is met, each (3,)."""
    item = scene.find(met.partition("/")[0])
    yaw = 0.0 if item is None else item.pose.yaw
    turns = yaw + np.arange(4) * math.pi / 2.0
    return [np.array([math.cos(turn), math.sin(turn), 0.0]) for turn in turns]
