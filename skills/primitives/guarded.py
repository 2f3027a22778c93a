"""Motion that stops at what is felt."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robosandbox.errors import CollisionError, LimitError, Phase, SkillError, TrackingError, UnreachableError
from robosandbox.evidence import LimitEvidence, TrackingEvidence
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT, Manipulator
from robosandbox.types import Array, Pose, Trajectory

# Impacts last a tick; pressing lasts.
_TICKS = 2
# Looked at every second tick, twice in a row: a bump is over by then.
_LOOK_EVERY, _PRESSED_LOOKS = 2, 2
# N that a hand which is to touch nothing may press with; chosen below the 16 to 30 N that impacts were measured to have
# for one tick, which two looks in a row leave out (halved and doubled no episode of six tasks changes).
_PRESSING = 15.0
# Share of the joints' speed limits; chosen so that joints far from singular are slower than the next number asks
# (halved 10 % longer episodes, doubled 2 % shorter).
_TOUCH_SPEED = 0.02
# Chosen so that a tick moves the hand 0.1 mm: what is felt at 0.5 N is then pressed no deeper (halved 12 % longer
# episodes, doubled as before).
_TOUCH_METRES_PER_SECOND = 0.01


class MetError(TrackingError):
    """The arm was stopped by something that it met where it was to touch nothing.

    Attributes:
        body: The part of the robot.
        other: What it met.
    """

    def __init__(self, body: str, other: str, force: float, *, phase: str, joint: str) -> None:
        super().__init__(
            f"{body} met {other} on its way and was stopped at {force:.0f} N: it is not where, or not as large as, it was "
            "seen to be, or came into the way; look again",
            phase=phase,
            evidence=TrackingEvidence(
                joint=joint, error=0.0, contacts=(f"{body} on {other}",), contact_force=round(force, 2)
            ),
        )
        self.body = body
        self.other = other


class _Stopped(Exception):
    """The awaited contact has been felt; the driver holds the arm."""


def touching_line(arm: Manipulator, q: Array, target: Pose) -> Trajectory:
    """Return a straight way of the TCP from `q` (n,), no faster than what is felt at once allows; raises as `plan_line`."""
    trajectory = arm.motion.plan_line(q, target, speed=_TOUCH_SPEED)
    length = float(np.linalg.norm(target.position - arm.motion.forward(q).position))
    factor = max(1.0, length / _TOUCH_METRES_PER_SECOND / max(trajectory.duration, 1e-6))
    return Trajectory(q=trajectory.q, dt=factor * trajectory.dt)


def nowhere_faster(arm: Manipulator, trajectory: Trajectory, speed: float) -> Trajectory:
    """Return a way of the TCP that is nowhere faster than so many m/s; a long one is uneven where joints are slow."""
    points = np.array([arm.motion.forward(q).position for q in trajectory.q])
    fastest = float(np.linalg.norm(np.diff(points, axis=0), axis=1).max(initial=0.0)) / trajectory.dt
    return Trajectory(q=trajectory.q, dt=max(1.0, fastest / speed) * trajectory.dt)


def follow_until(arm: Manipulator, trajectory: Trajectory, phase: str, felt: Callable[[], bool]) -> bool:
    """Follow a trajectory until something is felt; the arm then holds.

    Args:
        arm: Whose arm.
        trajectory: From where the arm is; contact may keep it off its goal.
        phase: For listeners and errors.
        felt: Asked after each control tick; it has to be true for two in a row.

    Returns:
        Whether it was felt.
    """
    ticks = 0

    def check() -> Exception | None:
        nonlocal ticks
        ticks = ticks + 1 if felt() else 0
        return _Stopped() if ticks >= _TICKS else None

    try:
        arm.follow(trajectory, phase, yielding=True, guards=(check,))
    except _Stopped:
        return True
    return False


def follow_free(arm: Manipulator, trajectory: Trajectory, phase: str) -> None:
    """Follow a trajectory on which nothing is to be touched; where something is, the arm stops and holds.

    A driver without contact follows it to the end.

    Args:
        arm: Whose arm.
        trajectory: From where the arm is.
        phase: For listeners and errors.

    Raises:
        MetError: It pressed on something for longer than a bump lasts.
        TrackingError: A joint stayed off its goal.
    """
    if arm.driver.capabilities.contact is None:
        # Nothing can be felt on the way; what keeps the arm off its goal is noticed at the end.
        arm.follow(trajectory, phase)
        return
    ticks = pressed = 0

    def check() -> Exception | None:
        nonlocal ticks, pressed
        ticks += 1
        if ticks % _LOOK_EVERY:
            return None
        force, body, other = arm.strongest_contact()
        pressed = pressed + 1 if force > _PRESSING else 0
        if pressed < _PRESSED_LOOKS:
            return None
        return MetError(body, other, force, phase=phase, joint=arm.spec.joints[-1])

    try:
        arm.follow(trajectory, phase, guards=(check,))
    except LimitError as error:
        # Where nothing is to be touched, a passed limit of force is a contact as well, met faster.
        evidence = error.evidence
        if not isinstance(evidence, LimitEvidence) or not evidence.touching:
            raise
        _, body, _ = arm.strongest_contact()
        joint = arm.spec.joints[-1]
        raise MetError(body or "the robot", evidence.touching[0], evidence.value, phase=phase, joint=joint) from None


def back_off(arm: Manipulator, error: SkillError) -> None:
    """Rise out of what was met, or fail with `error`, so that the next try starts from free space."""
    arm.use(arm.look())
    try:
        arm.rise_out(HOVER_HEIGHT, Phase.RETREAT)
    except (UnreachableError, CollisionError):
        raise error from None
