"""LIBERO's environment as a driver: its model and state, seen and moved as any simulated cell is."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.driver import Guard
from robosandbox.sim.borrowed import BorrowedBackend
from robosandbox.types import Trajectory
from robosandbox_libero.environment import LiberoEnvironment


class LiberoDriver(BorrowedBackend):
    """LIBERO's Panda in LIBERO's world, commanded in joints."""

    def follow(self, arm: str, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Have the arm follow a trajectory, as fast as the motors allow; return when the last configuration is commanded."""
        assert isinstance(self._environment, LiberoEnvironment)
        super().follow(arm, self._environment.servo.paced(self._live, trajectory), guards)
