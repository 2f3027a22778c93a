"""Causes why a gripped thing did not come up: the load is weighed, contacts are read, before one is named."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from robosandbox.errors import GraspError, Phase
from robosandbox.evidence import GraspEvidence
from robosandbox.skills.primitives.gripping import GRAVITY
from robosandbox.skills.primitives.manipulator import LIFT_HEIGHT, Manipulator
from robosandbox.types import Array, DetectedObject, ObservedScene
from robosandbox.values import frozen
from robosandbox.world.containers import walls
from robosandbox.world.nearness import nearer
from robosandbox.world.relations import bottom, centre, contents, moved, on_top, top

# N; chosen as the weight of half a kilogram: any grip that slips under less may hold when it is a better one.
_LOAD = 5.0
# Metres; chosen above perception's error: a thing that a pull has moved by less is fixed.
_UNMOVED = 0.003
# Metres between two things that count as touching, and by which things on one level overlap; chosen above perception's error.
_TOUCHES = 0.003
# Readings in a row, one for each control tick, metres of the hand's rise over them, and the share of the largest by which they may differ, for the
# load to be a weight: what hangs free, or slides out of a grip at its friction, pulls alike at every height, what is held back pulls
# harder the higher the hand is. Chosen: over 0.15 s the bundled arm's lift accelerates by 3 % of a weight.
_READINGS, _RISE, _STEADY = 15, 0.004, 0.12
# Share of a cup's largest pull from which what comes off it is more than it holds. Chosen below 0.89, which was read of a box of
# 4.6 kg a tick before it came off (tests/test_suction.py).
_AT_LIMIT = 0.8
# Cosine of the angle between two directions that are opposite; chosen as 120 degrees.
_OPPOSITE = -0.5


class LoadMeter:
    """A listener to ticks that keeps the upward force of the hand on what it holds, by the height of the hand.

    Args:
        arm: Whose hand.
        object_id: What it holds.

    Attributes:
        readings: The height of the hand, metres, and the force, N, of each control tick; the height is NaN under what may be a
            weight.
    """

    def __init__(self, arm: Manipulator, object_id: str) -> None:
        self._arm = arm
        self._object = object_id
        self._feels = arm.driver.capabilities.wrist_wrench
        self.readings: list[tuple[float, float]] = []

    def __call__(self) -> None:
        """Read height and force."""
        if self._feels:
            force = float(self._arm.force_on(self._object)[2])
            # At every tick of a lift, and most things weigh less.
            height = self._arm.state.tcp_pose.xyz[2] if force >= _LOAD else math.nan
            self.readings.append((height, force))

    @property
    def pull(self) -> float | None:
        """The largest upward force, N; None where the driver does not tell it."""
        return max((force for _, force in self.readings), default=0.0) if self._feels else None

    @property
    def weight(self) -> float | None:
        """The largest force that stayed while the hand rose, N; None where none did."""
        steady = []
        for k in range(len(self.readings) - _READINGS + 1):
            heights, forces = np.array(self.readings[k : k + _READINGS]).T
            if heights[-1] - heights[0] > _RISE and np.ptp(forces) < _STEADY * forces.max():
                steady.append(float(np.median(forces)))
        return max(steady, default=None)


@frozen
class Held:
    """Cause, besides its weight, that holds a thing back.

    Attributes:
        how: Something lies over it; things on two sides of it; something on one side; nothing.
        names: Of those things.
        said: The same in words.
    """

    how: Literal["caught", "wedged", "braced"] | None
    names: tuple[str, ...] = ()
    said: str = ""


def lift_error(arm: Manipulator, before: DetectedObject, width: float, load: LoadMeter) -> GraspError:
    """Return why an object did not come up with the hand.

    Args:
        arm: Whose hand.
        before: The object when the fingers closed.
        width: Its extent between them, metres.
        load: What the hand felt.
    """
    scene = arm.look()
    after = scene.find(before.id)
    travelled = moved(before, after) if after else 0.0
    pull, aperture = load.pull, arm.gripper.width
    reason, said = _cause(before, after, scene, load, travelled, arm.ctx.max_force_n)
    back = held_back(before, scene) if reason in ("caught", "wedged", "braced") else Held(None)
    holds = _cup_force(arm)
    if holds is not None and pull is not None and pull >= _AT_LIMIT * holds and reason in ("slipped", "immovable"):
        reason = "immovable" if travelled < _UNMOVED else "too_heavy"
        said = (
            f"{before.id} came off the cup under a pull of {pull:.0f} N, and the cup holds {holds:.0f} N: it is heavier than "
            f"{holds / GRAVITY:.1f} kg or fixed; take something lighter, or push it"
        )
    elif holds is not None and reason == "slipped":
        said = f"{before.id} came off the cup while it was lifted; look again and try another face"
    elif reason == "slipped":
        said = (
            f"{before.id} slipped out while it was lifted: the fingers are {aperture * 1000:.1f} mm apart, it measures "
            f"{width * 1000:.1f} mm between them; look again and try another grasp"
        )
    return GraspError(
        said,
        phase=Phase.LIFT,
        evidence=GraspEvidence(
            object=before.id,
            reason=reason,
            object_width=width,
            aperture=aperture,
            max_aperture=arm.geometry.max_aperture,
            pull=None if pull is None else round(pull, 2),
            moved=round(travelled, 4),
            touching=back.names,
        ),
    )


def _cup_force(arm: Manipulator) -> float | None:
    """Return how hard a suction cup pulls at the most, N; None of fingers."""
    gripper = arm.spec.gripper
    return None if gripper is None or gripper.geometry.cup is None else float(gripper.force_limits.sum())


_Reason = Literal["slipped", "immovable", "too_heavy", "caught", "wedged", "braced"]


def _cause(
    before: DetectedObject,
    after: DetectedObject | None,
    scene: ObservedScene,
    load: LoadMeter,
    travelled: float,
    most: float,
) -> tuple[_Reason, str]:
    """Return the cause and its sentence; that of "slipped" is the caller's."""
    pull, weight, name = load.pull, load.weight, before.id
    if pull is None or pull < _LOAD:
        return "slipped", ""
    back = held_back(before, scene)
    if back.how is not None:
        return back.how, f"{name} did not come up under a pull of {pull:.0f} N: it is {back.said}"
    if travelled < _UNMOVED:
        return "immovable", (
            f"{name} did not move under a pull of {pull:.0f} N, and nothing that is seen holds it: it is fixed where it is, or "
            f"heavier than {pull / GRAVITY:.1f} kg; limits.max_force_n allows {most:g} N: free it, or take something else"
        )
    if weight is None or weight < _LOAD:
        return "slipped", ""
    risen = bottom(after) - bottom(before) if after else 0.0
    return "too_heavy", (
        f"{name} came up {risen * 1000:.0f} mm and slid out of the grip under a steady load of {weight:.0f} N, with nothing "
        f"else touching it: {weight / GRAVITY:.1f} kg are more than this grip holds; take something lighter, or push it"
    )


def held_back(target: DetectedObject, scene: ObservedScene) -> Held:
    """Return what holds a thing back from above or from its sides, as it is seen."""
    others = [item for item in scene.objects if item.id not in {target.id, *scene.in_hands}]
    over = tuple(item.id for item in others if is_over(item, target))
    if over:
        said = ", ".join(over)
        return Held("caught", over, f"caught under {said}; clear {said} away first, or take it out sideways")
    sides: list[tuple[str, Array]] = []
    for item in others:
        if target.id in {name for name, _ in contents([target], item)}:
            sides += [(item.id, direction[:2]) for direction, room in walls(target, item) if room < _TOUCHES]
        elif _is_beside(target, item):
            direction = (centre(item) - centre(target))[:2]
            sides.append((item.id, direction / max(float(np.linalg.norm(direction)), 1e-9)))
    names = tuple(dict.fromkeys(name for name, _ in sides))
    if any(float(a @ b) < _OPPOSITE for _, a in sides for _, b in sides):
        between = f"the walls of {names[0]}" if len(names) == 1 else " and ".join(names)
        return Held("wedged", names, f"wedged between {between}; try another grasp, or clear one of them away")
    if sides:
        about = ", ".join(names)
        return Held("braced", names, f"held against {about}; try another grasp, or move it away from there first")
    return Held(None)


def is_over(item: DetectedObject, target: DetectedObject) -> bool:
    """Tell whether a thing hangs or lies over another, within the height of a lift."""
    clearance = bottom(item) - top(target)
    return -_TOUCHES < clearance < LIFT_HEIGHT and nearer(item, target, 0.0)


def _is_beside(target: DetectedObject, item: DetectedObject) -> bool:
    level = bottom(item) < top(target) - _TOUCHES and top(item) > bottom(target) + _TOUCHES
    return level and nearer(target, item, _TOUCHES) and not on_top(target, item).holds
