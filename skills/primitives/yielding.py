"""A hand that yields: it is sent on by velocities, and gives way to what it feels."""

from __future__ import annotations

import numpy as np

from robosandbox.skills.primitives.hand_move import Mover
from robosandbox.types import Array, Trajectory

# m/s for each newton that is missing of a force: a stiff arm of 20 N/mm does not swing with what is told 40 ms late. And m/s at most:
# a servo that is stopped at once presses with some newtons for each mm/s.
_FOLLOWING, _FASTEST = 0.001, 0.005

# Damping of the inverse of a Jacobian, dimensionless beside rows of metres and radians; chosen for arms near a singularity.
_DAMPING = 1e-4


class YieldingHand:
    """A hand led by velocities in the world, tick by tick; what it presses with is reckoned from when it was made.

    Args:
        arm: Whose hand; it feels forces.

    Attributes:
        q: The configuration that was commanded last, shape (n,).
        place: The TCP there, shape (3,).
    """

    def __init__(self, arm: Mover) -> None:
        self._arm, self._kinematics = arm, arm.planning.kinematics()
        self._before = arm.pressed()
        self.tick = arm.driver.control_timestep
        self.q, self.place = arm.q, np.zeros(3)
        self.take_up()

    def take_up(self) -> None:
        """Go on from where the arm is, after somebody else has moved it."""
        self.q = self._arm.q.copy()
        self.place = self._kinematics.forward(self.q)[0].copy()

    @property
    def felt(self) -> Array:
        """Force with which the hand presses, N in the world, shape (3,)."""
        return self._arm.pressed() - self._before

    @property
    def pressed(self) -> float:
        """Force with which it presses down, N."""
        return -float(self.felt[2])

    @property
    def height(self) -> float:
        """Height of the TCP as it is measured, metres."""
        return self._arm.state.tcp_pose.xyz[2]

    def go(self, velocity: Array, turn: float = 0.0) -> None:
        """Let one control tick pass with the hand sent on.

        Args:
            velocity: Of the TCP in the world, m/s, shape (3,).
            turn: About the vertical, rad/s.
        """
        before, self.q = self.q, self._stepped(np.array([*velocity, 0.0, 0.0, turn]) * self.tick)
        self.place = self._kinematics.forward(self.q)[0].copy()
        self._arm.send(Trajectory(q=np.array([before, self.q]), dt=self.tick))

    def _stepped(self, twist: Array) -> Array:
        """Return the configuration (n,) in which the hand has gone and turned by so much (6,): joints at their limits leave it to others."""
        robot = self._arm.spec
        jacobian = self._kinematics.jacobian(self._kinematics.forward(self.q)[0])
        least, most = robot.lower - self.q, robot.upper - self.q
        step, free = np.zeros(robot.n), np.ones(robot.n, dtype=bool)
        while free.any():
            led = jacobian[:, free]
            left = twist - jacobian[:, ~free] @ step[~free]
            step[free] = led.T @ np.linalg.solve(led @ led.T + _DAMPING * np.eye(6), left)
            over = free & ((step < least) | (step > most))
            if not over.any():
                break
            step = np.where(over, np.clip(step, least, most), step)
            free &= ~over
        found: Array = self.q + step
        return found

    def press(self, force: float, sideways: Array | None = None, turn: float = 0.0) -> None:
        """Let one control tick pass in which it comes nearer to pressing down with a force.

        Args:
            force: N.
            sideways: How it goes meanwhile, m/s in the world, shape (2,); not at all when left out.
            turn: About the vertical, rad/s.
        """
        down = min(max(_FOLLOWING * (force - self.pressed), -_FASTEST), _FASTEST)
        x, y = (0.0, 0.0) if sideways is None else sideways
        self.go(np.array([x, y, -down]), turn)
