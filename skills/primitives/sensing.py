"""Sensing by fingers or cup: whether they go where they are sent, whether it seals, and what has moved meanwhile."""

from __future__ import annotations

from robosandbox.errors import GraspError, Phase
from robosandbox.evidence import GraspEvidence
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import DetectedObject, Grasp, GripperState, ObservedScene
from robosandbox.world.nearness import nearer
from robosandbox.world.relations import moved

# Metres between fingers and where they were sent within which they are there; chosen as what weak finger servos stop
# short of.
_FINGERS_ARRIVED = 0.004
# Simulated seconds that sticking fingers are worked at; chosen so that most that come free do (benchmarks/recovery.py,
# half_closed).
_FREED_WITHIN = 8.0
# Metres on each side of an object that open fingers need, and by which closing ones have moved; chosen as the error of
# a size in pixels (0.8 mm, docs/measured.md) twice over.
_NEEDED_CLEARANCE = 0.002
# Share of its range by which the joint of fingers has moved that do not stick: on a hand that opens by 8 cm, those 2 mm.
_MOVED = 0.025
# Metres by which a thing has to have moved to be planned for anew; chosen above perception's 2.2 mm (p95,
# docs/measured.md).
_CHANGED = 0.003

# Metres from an object within which things are looked at along with it; chosen as what a hand around it covers.
_AROUND = 0.06


def around(target: DetectedObject, scene: ObservedScene) -> tuple[str, ...]:
    """Return the ids of an object and of all that a hand which takes it may touch or take along."""
    others = (item for item in scene.objects if item.id != target.id)
    return (target.id, *(item.id for item in others if nearer(target, item, _AROUND)))


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
    deadline = arm.driver.time + _FREED_WITHIN
    while arm.gripper.width < needed:
        if arm.driver.time >= deadline:
            raise _stuck(arm, grasp, aperture)
        arm.close()
        arm.open(aperture)


def check_closed(arm: Manipulator, grasp: Grasp, before: GripperState) -> None:
    """Check that fingers that were commanded to close have moved; give them time if they stick.

    The gap of a jaw that swung far open does not tell: it grows no more there, so that the joint is asked.

    Args:
        arm: Whose fingers.
        grasp: What is to be held.
        before: The gripper before.

    Raises:
        GraspError: They stick.
    """
    deadline = arm.driver.time + _FREED_WITHIN
    while _stands(arm.gripper, before) and before.width > grasp.width + 2.0 * _NEEDED_CLEARANCE:
        if arm.driver.time >= deadline:
            raise _stuck(arm, grasp, arm.geometry.min_aperture)
        arm.open(before.width)
        arm.close()


def _stands(now: GripperState, before: GripperState) -> bool:
    """Tell whether fingers are where they were before, by their gap and by their joint."""
    return abs(now.width - before.width) < _NEEDED_CLEARANCE and abs(now.closed - before.closed) < _MOVED


def check_sealed(arm: Manipulator, grasp: Grasp) -> None:
    """Check that a suction cup that was told to suck lies on the object; fingers are not asked.

    Raises:
        GraspError: It leaks.
    """
    sealed, needed = arm.gripper.seal, arm.geometry.seal
    if sealed is None or sealed >= needed:
        return
    raise GraspError(
        f"no seal on {grasp.object}: the cup lies on it for {sealed * 1000:.0f} of {needed * 1000:.0f} mm about its axis; "
        "look again and try another face",
        phase=Phase.GRASP,
        evidence=GraspEvidence(
            object=grasp.object,
            reason="no_seal",
            aperture=0.0,
            max_aperture=0.0,
            seal=round(sealed, 5),
            needed_seal=round(needed, 5),
        ),
    )


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
