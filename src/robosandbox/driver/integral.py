"""Integral action against what keeps an arm off its goal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from robosandbox.types import Array

# As in the drivers `mujoco` and `hardware`: share of the error that is taken up in 10 ms, and the most of it, rad.
_SHARE, _PER_SECONDS, LARGEST_SHIFT = 0.08, 0.01, 0.3


class IntegralAction:
    """Shift of joint commands beyond the goal, against what a controller gives way to.

    Args:
        joints: The number of joints, n.
        tick: Seconds between commands.

    Attributes:
        shift: What commands are shifted by now, rad, shape (n,).
    """

    def __init__(self, joints: int, tick: float) -> None:
        self.shift: Array = np.zeros(joints)
        self._share = min(1.0, _SHARE * tick / _PER_SECONDS)

    def take_up(self, off: Array) -> None:
        """Shift commands further by a share of what the arm is off its goal, rad, shape (n,)."""
        self.begin_at(self.shift + self._share * off)

    def begin_at(self, shift: Array) -> None:
        """Shift commands by this from now on, rad, shape (n,), as far as is allowed."""
        self.shift = np.clip(shift, -LARGEST_SHIFT, LARGEST_SHIFT)
