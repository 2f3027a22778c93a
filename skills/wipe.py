"""Wipe: press what is held on what is below it, and rub to and fro over a square of that."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.driver import require
from robosandbox.errors import Phase, TrackingError
from robosandbox.skills.primitives.force import Following
from robosandbox.skills.primitives.gripping import Grip
from robosandbox.skills.primitives.guarded import follow_until
from robosandbox.skills.primitives.hand_move import LIGHT, HandMove, Mover
from robosandbox.skills.primitives.pressing import StraightPath
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.words import ROUNDS, Slot, Words
from robosandbox.types import DetectedObject, Pose, SkillResult, Trajectory
from robosandbox.world.relations import bounds, top

# Metres below where the hand is down to which it looks for something to wipe.
_DEEPEST = 0.5
# m/s along: of a thing that is dragged by its top.
_SPEED = 0.02
# Seconds for each metre of a stroke until it is given up: five times what it takes.
_SECONDS_PER_METRE = 5.0 / _SPEED
# Metres by which what is wiped may be lower than where it was met.
_UNEVEN = 0.005
# Times the force asked for from where on it is not dragged on.
_CATCHES = 1.5
# Share of the way on which it has to be felt to have been wiped.
_MOST_OF_IT = 0.8

_RUBS = ("wipe", "sweep", "scrub", "rub", "polish", "clean", "dust", "brush", "swab", "mop")
_TABLE = ("the table", "the tabletop", "the table top", "the surface", "a patch of the table", "a spot of the table")
_SIZE = Slot(
    argument="size",
    kind="length",
    prepositions=(
        "over",
        "over a square of",
        "an area of",
        "a square of",
        "a patch of",
        "over an area of",
        "about",
        "",
    ),
    endings=tuple((said, 1.0) for said in ("square", "wide", "across", "in size", "each way")),
)
_SLOTS = (
    _SIZE,
    Slot(argument="force", kind="force", prepositions=("with", "at", "pressing with")),
    Slot(
        argument="times",
        kind="number",
        prepositions=("", "back and forth", "to and fro"),
        endings=(("times", 1.0),),
        bare=False,
        phrases=ROUNDS,
    ),
)


class Wipe(HandMove):
    """Wipe what is below the hand."""

    name = "wipe"
    words = (
        Words(
            verbs=(
                *(f"{rub} {table} with {{}}" for rub in _RUBS for table in _TABLE),
                *(f"use {{}} to {rub} {table}" for rub in _RUBS for table in _TABLE),
            ),
            object="held",
            slots=_SLOTS,
            hand="holding",
            holds=True,
        ),
        Words(verbs=tuple(f"{rub} {table}" for rub in _RUBS for table in _TABLE), slots=_SLOTS, hand="holding"),
    )

    def run(
        self,
        ctx: SkillContext,
        *,
        held: str,
        size: Annotated[float, Field(gt=0.0, le=0.5)] = 0.1,
        force: Annotated[float, Field(ge=LIGHT, le=20.0)] = 4.0,
        times: Annotated[int, Field(ge=1, le=20)] = 1,
    ) -> SkillResult:
        """Come down on what is below, and go to and fro over a square of it; then rise to where the hand was.

        Args:
            held: Id of what is held.
            size: Side of the square that the middle of what is held goes over, metres; the hand is over its middle at first.
            force: With which it presses, N.
            times: How often it goes over the square.

        Raises:
            UnsupportedError: The driver feels no force at the wrist.
            UnreachableError: The hand cannot be there.
            CollisionError: Something stands in the square.
            LimitError: The robot pressed too hard.
            TrackingError: Nothing was met, it gave way, or was no longer felt on the way.
        """
        arm = Mover(ctx)
        require(ctx.driver, "wrist_wrench", "what the hand rubs with is felt")
        above = arm.state.tcp_pose
        low, high = bounds(arm.find(held))
        # As broad as what rubs is, the less of both ways.
        first, *corners = _corners(above, size, float((high - low)[:2].min()))
        below = _under(arm)
        arm.motion.allow("table", *(item.id for item in below))
        _check_free(arm, [first, *corners], max([arm.start.table_height, *(top(item) for item in below)]))
        arm.arrive(arm.kept_level(arm.motion.plan_line(arm.q, first, speed=arm.speed)), first)
        arm.come_down_near()
        before = float(arm.pressed()[2])
        here = arm.state.tcp_pose
        deepest = Pose(xyz=(*here.xyz[:2], here.xyz[2] - _DEEPEST), quat_xyzw=here.quat_xyzw)

        def felt() -> float:
            return before - float(arm.pressed()[2])

        if not follow_until(arm, arm.as_far_as_it_goes(here, deepest), Phase.TOUCH, lambda: felt() > LIGHT / 2.0):
            raise TrackingError("the hand went down and met nothing to wipe", phase=Phase.TOUCH)
        arm.ctx.enter(Phase.PUSH)
        # As light as what is held hangs in the grip, it would slide up between the fingers until they meet the table themselves.
        rub, forces = _Rub(arm, felt, force, Grip(arm, arm.find(held))), list[float]()
        for time in range(times):
            for corner in corners if time % 2 == 0 else [*corners[-2::-1], first]:
                forces += rub.stroke(corner)
        arm.rise(above.xyz[2] - arm.state.tcp_pose.xyz[2], Phase.RETREAT)
        arm.arrive(arm.motion.plan_line(arm.q, above, speed=arm.tempo.leave), above)
        rub.grip.settle()
        touched = float(np.mean(np.array(forces) > 0.0))
        if touched < _MOST_OF_IT:
            raise TrackingError(f"it was felt on {100.0 * touched:.0f} % of the way alone", phase=Phase.PUSH)
        return SkillResult(
            skill=self.name,
            detail={"force_n": float(np.mean(forces)), "most_n": max(forces), "felt": touched, "size_m": size},
        )


def _corners(middle: Pose, size: float, breadth: float) -> list[Pose]:
    """Return where strokes from side to side over a square begin and end, one behind the other."""
    rows = math.ceil(size / breadth) + 1
    ends = [
        (x, side * size / 2.0)
        for k, x in enumerate(np.linspace(-size / 2.0, size / 2.0, rows))
        for side in ((-1.0, 1.0) if k % 2 == 0 else (1.0, -1.0))
    ]
    return [Pose(xyz=tuple(middle.position + [x, y, 0.0]), quat_xyzw=middle.quat_xyzw) for x, y in ends]


def _check_free(arm: Mover, corners: list[Pose], height: float) -> None:
    """Check that the hand can rub along corners at a height, metres in the world, before anything is touched.

    Raises:
        UnreachableError: It cannot be there.
        CollisionError: Something stands in its way.
    """
    z = height + arm.hangs
    low = [Pose(xyz=(*corner.xyz[:2], z), quat_xyzw=corner.quat_xyzw) for corner in corners]
    q = arm.motion.plan_line(arm.q, corners[0]).q[-1]
    for corner in low:
        q = arm.motion.plan_line(q, corner).q[-1]


def _under(arm: Mover) -> list[DetectedObject]:
    """Return what lies below the hand, and may be wiped."""
    here = arm.state.tcp_pose.position
    found = []
    for item in arm.start.objects:
        low, high = bounds(item)
        if item.id != arm.start.held and np.all(low[:2] < here[:2]) and np.all(here[:2] < high[:2]):
            found.append(item)
    return found


class _Rub:
    """Strokes of what is held over what it was pressed on.

    Args:
        arm: Whose hand; it has met what is to be rubbed.
        felt: Tells what it presses down with, N.
        force: What it is to press with, N.
        grip: On what is held.
    """

    def __init__(self, arm: Mover, felt: Callable[[], float], force: float, grip: Grip) -> None:
        self.grip = grip
        self._arm, self._felt, self._force = arm, felt, force
        self._height, self._pressing = arm.state.tcp_pose.xyz[2], Following()

    def stroke(self, corner: Pose) -> list[float]:
        """Rub in a straight line to above or below a corner; return what was felt at each control tick, N.

        Raises:
            TrackingError: The hand caught on something and did not come free, or what is rubbed gave way.
        """
        arm, tick = self._arm, self._arm.driver.control_timestep
        goal = Pose(xyz=(*corner.xyz[:2], self._height), quat_xyzw=corner.quat_xyzw)
        path = StraightPath.of(arm, arm.motion.plan_line(arm.q, goal, speed=arm.tempo.lower))
        place, forces, row = 0.0, list[float](), path.at(0.0, -self._pressing.beyond)
        deadline = arm.driver.time + _SECONDS_PER_METRE * path.length
        while place < path.length:
            if arm.driver.time > deadline:
                raise TrackingError(f"the hand is caught {1000.0 * place:.0f} mm along a stroke", phase=Phase.PUSH)
            now, deeper = self._felt(), self._height - arm.state.tcp_pose.xyz[2]
            if deeper > _UNEVEN:
                raise TrackingError(
                    f"the hand went {1000.0 * deeper:.0f} mm deeper while it rubbed: what it holds slides in the grip, or "
                    "what it rubs gives way",
                    phase=Phase.PUSH,
                )
            forces.append(now)
            self.grip()
            if now < _CATCHES * self._force:
                # What catches is not dragged on before the hand has given way.
                place = min(place + _SPEED * tick, path.length)
            before, row = row, path.at(place, -self._pressing.follow(now, self._force, tick))
            arm.send(Trajectory(q=np.array([before, row]), dt=tick))
        return forces
