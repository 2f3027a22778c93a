"""Joints that are sent on and on, one short way after the other, within their limits of speed and acceleration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robosandbox.types import Array
from robosandbox.types.robot import RobotSpec


class JointSteps:
    """An arm's joints as they were sent last, and go on from there.

    Args:
        spec: The robot.
        lasts: Seconds for which a joint may keep one speed: of steps that are not all as long, each length.

    Attributes:
        q: Where they were sent, shape (n,).
        velocity: At which speed, shape (n,).
    """

    def __init__(self, spec: RobotSpec, lasts: Sequence[float]) -> None:
        self._spec = spec
        self._shortest, self._longest = min(lasts), max(lasts)
        self.q: Array = spec.home_q.copy()
        self.velocity: Array = np.zeros(spec.n)
        # Seconds for which they have kept that speed.
        self._lasted: float = np.inf

    def begin(self, q: Array) -> None:
        """Take a configuration (n,) for where they stand."""
        self.q, self.velocity, self._lasted = q.copy(), np.zeros(len(q)), np.inf

    def wanted(self, goal: Array, period: float, left: float) -> tuple[Array, Array]:
        """Return the speed (n,) to keep for some seconds on the way to a goal (n,), and by how much it may differ from now, (n,).

        A joint changes its speed by what it can in that period, or in the one before if that was shorter, and is never quicker than it can
        brake from before its goal.

        Args:
            goal: Where they are to be.
            period: Seconds of this step.
            left: Seconds after which they are to be there.
        """
        spec = self._spec
        lasted, self._lasted = min(period, self._lasted), period
        away = np.clip(goal, spec.lower, spec.upper) - self.q
        # The most at which whole periods of braking, this one included, end at the goal.
        slower = spec.acceleration_limits * self._shortest
        periods = np.abs(away) / (slower * self._longest)
        whole = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * periods) - 1.0))
        braking = slower * (whole + (periods - 0.5 * whole * (whole + 1.0)) / (whole + 1.0))
        speed = np.minimum.reduce([np.abs(away) / left, braking, spec.velocity_limits])
        return np.sign(away) * speed, spec.acceleration_limits * lasted

    def go(self, velocity: Array, period: float) -> Array:
        """Send them on at a speed (n,) for some seconds; return the way, two rows, shape (2, n)."""
        start = self.q
        self.q = np.clip(start + velocity * period, self._spec.lower, self._spec.upper)
        self.velocity = (self.q - start) / period
        return np.stack([start, self.q])
