"""Whether an error names its cause: which code and which figures of its evidence say what was wrong."""

from __future__ import annotations

from robosandbox.errors import Failure
from robosandbox.evidence import DrawerEvidence, GraspEvidence, UnreachableEvidence


def out_of_reach(error: Failure) -> bool:
    """It says how close the arm comes."""
    return isinstance(error.evidence, UnreachableEvidence)


def too_wide(error: Failure) -> bool:
    """It gives a width that is more than the gripper opens."""
    evidence = error.evidence
    return (
        isinstance(evidence, GraspEvidence)
        and evidence.object_width is not None
        and evidence.object_width > evidence.max_aperture
    )


def immovable(error: Failure) -> bool:
    """It gives the pull under which the object did not move."""
    evidence = error.evidence
    return (
        isinstance(evidence, GraspEvidence)
        and evidence.reason == "immovable"
        and evidence.pull is not None
        and evidence.pull > 0.0
    )


def too_heavy(error: Failure) -> bool:
    """It gives the pull under which the object did not move, or slid out of the grip."""
    evidence = error.evidence
    return (
        isinstance(evidence, GraspEvidence)
        and evidence.reason in ("immovable", "too_heavy")
        and evidence.pull is not None
        and evidence.pull > 0.0
    )


def locked(error: Failure) -> bool:
    """It gives the force under which the drawer did not slide."""
    evidence = error.evidence
    return isinstance(evidence, DrawerEvidence) and evidence.reason == "locked" and evidence.force > 0.0


def stuck_fingers(error: Failure) -> bool:
    """It gives the gap that was commanded and the one that the fingers keep."""
    evidence = error.evidence
    return (
        isinstance(evidence, GraspEvidence)
        and evidence.reason == "gripper_stuck"
        and evidence.commanded is not None
        and abs(evidence.commanded - evidence.aperture) > 0.002
    )
