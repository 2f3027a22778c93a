"""Motion that stops at what is felt."""

from __future__ import annotations

from collections.abc import Callable

from robosandbox.errors import Phase
from robosandbox.skills.manipulator import Manipulator
from robosandbox.types import Trajectory

# Impacts last a tick; pressing lasts.
_TICKS = 2


class _Stopped(Exception):
    """What was waited for has been felt; the sim holds the arm as this passes through it."""


def follow_until(arm: Manipulator, trajectory: Trajectory, phase: Phase, felt: Callable[[], bool]) -> bool:
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

    def check() -> None:
        nonlocal ticks
        ticks = ticks + 1 if felt() else 0
        if ticks >= _TICKS:
            raise _Stopped

    arm.sim.tick_hooks.append(check)
    try:
        arm.follow(trajectory, phase, yielding=True)
    except _Stopped:
        arm.sim.hold()
        return True
    finally:
        arm.sim.tick_hooks.remove(check)
    return False
