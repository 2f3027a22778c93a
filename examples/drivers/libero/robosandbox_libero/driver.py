"""LIBERO's environment as a driver: its model and state, seen and moved as any simulated cell is."""

from __future__ import annotations

from robosandbox.sim.borrowed import BorrowedBackend


class LiberoDriver(BorrowedBackend):
    """LIBERO's Panda in LIBERO's world, commanded in joints."""
