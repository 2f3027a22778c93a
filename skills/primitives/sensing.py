"""What the arm feels: contact on its way, the load on its hand, fingers that do not go where they are sent."""

from __future__ import annotations

from typing import Literal

from robosandbox.errors import GraspError, Phase
from robosandbox.evidence import GraspEvidence
from robosandbox.protocols import Driver
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import DetectedObject, Grasp, ObservedScene
from robosandbox.world.relations import bottom, moved

# Metres between fingers and where they were sent within which they are there; chosen as what weak finger servos stop
# short of.
_FINGERS_ARRIVED = 0.004
# Simulated seconds that sticking fingers are worked at; chosen so that most that come free do (benchmarks/recovery.py,
# half_closed).
_FREED_WITHIN = 8.0
# Metres on each side of an object that open fingers need, and by which closing ones have moved; chosen as the error of
# a size in pixels (0.8 mm, docs/measured.md) twice over.
_NEEDED_CLEARANCE = 0.002
# N; chosen as the weight of half a kilogram: any grip that slips under less may hold when it is a better one.
_LOAD = 5.0
# Metres; chosen above perception's error: a thing that a pull has moved by less is fixed.
_UNMOVED = 0.003
# Metres by which a thing has to have moved to be planned for anew; chosen above perception's 2.2 mm (p95,
# docs/measured.md).
_CHANGED = 0.003
# Control ticks between two readings of the load; chosen because reading contacts costs as much as a tick, and a lift
# lasts over a hundred.
_EVERY = 20


class LoadMeter:
    """A listener to ticks that keeps the largest upward force of the hand on what it holds.

    Args:
        sim: Whose hand.
        object_id: What it holds.

    Attributes:
        pull: That force, N; None where the driver does not tell it.
    """

    def __init__(self, sim: Driver, object_id: str) -> None:
        self.pull: float | None = 0.0 if sim.capabilities.wrist_wrench else None
        self._sim = sim
        self._object = object_id
        self._ticks = 0

    def __call__(self) -> None:
        """Read the force now and then."""
        self._ticks += 1
        if self.pull is not None and self._ticks % _EVERY == 0:
            self.pull = max(self.pull, float(self._sim.force_on(self._object)[2]))


def changed(before: ObservedScene, now: ObservedScene) -> bool:
    """Tell whether anything stands elsewhere than it did."""
    return any((other := now.find(item.id)) is None or moved(item, other) > _CHANGED for item in before.objects)


def check_open(arm: Manipulator, grasp: Grasp, aperture: float) -> None:
    """Check that the fingers have opened as commanded, or far enough for the object; work them free if they stick.

    Args:
        arm: Whose fingers; they were commanded to open.
        grasp: What is about to be held.
        aperture: The commanded gap, metres.

    Raises:
        GraspError: They stick.
    """
    needed = min(aperture - _FINGERS_ARRIVED, grasp.width + 2.0 * _NEEDED_CLEARANCE)
    if arm.gripper.width >= aperture - _FINGERS_ARRIVED:
        return
    arm.wait_for_fingers()
    deadline = arm.sim.time + _FREED_WITHIN
    while arm.gripper.width < needed:
        if arm.sim.time >= deadline:
            raise _stuck(arm, grasp, aperture)
        arm.close()
        arm.open(aperture)


def check_closed(arm: Manipulator, grasp: Grasp, before: float) -> None:
    """Check that fingers that were commanded to close have moved; give them time if they stick.

    Args:
        arm: Whose fingers.
        grasp: What is to be held.
        before: The gap before, metres.

    Raises:
        GraspError: They stick.
    """
    deadline = arm.sim.time + _FREED_WITHIN
    while abs(arm.gripper.width - before) < _NEEDED_CLEARANCE and before > grasp.width + 2.0 * _NEEDED_CLEARANCE:
        if arm.sim.time >= deadline:
            raise _stuck(arm, grasp, arm.geometry.min_aperture)
        arm.open(before)
        arm.close()


def _stuck(arm: Manipulator, grasp: Grasp, commanded: float) -> GraspError:
    width = arm.gripper.width
    return GraspError(
        f"the fingers were sent to {commanded * 1000:.0f} mm and stay {width * 1000:.0f} mm apart, with {grasp.object} "
        f"{grasp.width * 1000:.0f} mm wide between them to be: the gripper sticks; free it, or take something narrower",
        phase=Phase.GRASP,
        evidence=GraspEvidence(
            object=grasp.object,
            reason="gripper_stuck",
            object_width=grasp.width,
            aperture=width,
            max_aperture=arm.geometry.max_aperture,
            commanded=commanded,
        ),
    )


def lift_error(arm: Manipulator, before: DetectedObject, width: float, pull: float | None) -> GraspError:
    """Return why an object did not come up with the hand.

    Args:
        arm: Whose hand.
        before: The object when the fingers closed.
        width: Its extent between them, metres.
        pull: The largest upward force on it, N; None where the driver does not tell it.
    """
    after = arm.look().find(before.id)
    travelled = moved(before, after) if after else 0.0
    risen = bottom(after) - bottom(before) if after else 0.0
    name, aperture = before.id, arm.gripper.width
    reason: Literal["slipped", "immovable", "too_heavy"]
    if pull is None or pull < _LOAD:
        reason = "slipped"
        said = (
            f"lost {name} while lifting: the fingers are {aperture * 1000:.1f} mm apart and it is "
            f"{width * 1000:.1f} mm wide; look again and try another grasp"
        )
    elif travelled < _UNMOVED:
        reason = "immovable"
        said = (
            f"{name} did not move under a pull of {pull:.0f} N: it is fixed where it is, or heavier than "
            f"{pull / 9.81:.1f} kg; free it, or take something else"
        )
    else:
        reason = "too_heavy"
        said = (
            f"{name} came up {risen * 1000:.0f} mm and slid out of the grip under a load of {pull:.0f} N: "
            f"{pull / 9.81:.1f} kg are more than this grip holds; take something lighter, or push it"
        )
    return GraspError(
        said,
        phase=Phase.LIFT,
        evidence=GraspEvidence(
            object=name,
            reason=reason,
            object_width=width,
            aperture=aperture,
            max_aperture=arm.geometry.max_aperture,
            pull=None if pull is None else round(pull, 2),
            moved=round(travelled, 4),
        ),
    )
