"""The MuJoCo world behind a driver, for tests that read or set what no program may."""

from __future__ import annotations

from robosandbox.agent.context import AgentContext
from robosandbox.driver import Driver
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import require_mujoco


def backend(driver: Driver) -> MuJoCoBackend:
    """Return the MuJoCo world behind a driver."""
    return require_mujoco(driver, "a test looks into it")


def work_with(ctx: AgentContext, driver: Driver) -> AgentContext:
    """Have a context work with another driver of the same robot, and return it."""
    ctx.driver, ctx.arm, ctx.hand = driver, driver.arms["arm"], driver.hands.get("hand")
    return ctx
