"""The MuJoCo world behind its safe face, for tests that read or set what no program may."""

from __future__ import annotations

from robosandbox.driver import Driver, SafeDriver
from robosandbox.sim.mujoco_backend import MuJoCoBackend


def backend(sim: Driver) -> MuJoCoBackend:
    """Return the backend that a driver is, or that it is the safe face of."""
    inner = sim._inner if isinstance(sim, SafeDriver) else sim
    assert isinstance(inner, MuJoCoBackend)
    return inner
