"""robosuite's environment as a driver: its model and state, moved by its own step and controllers."""

from __future__ import annotations

from robosandbox.sim.borrowed import BorrowedBackend


class RobosuiteDriver(BorrowedBackend):
    """robosuite's Panda in robosuite's world, commanded in joints."""
