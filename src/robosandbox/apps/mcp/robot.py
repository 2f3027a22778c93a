"""A running workcell for an asynchronous server: what it does is awaited, told about and stopped when nobody waits any more."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, TypeVar

import anyio

from robosandbox.agent.episode import AgentEvent, Consulted, PhaseEntered, Planned, SkillFailed, Thought
from robosandbox.errors import Failure
from robosandbox.tasks.loader import find_task
from robosandbox.types import Observation, ObservedScene, SkillResult
from robosandbox.workcell.host import Activity, WorkcellHost
from robosandbox.workcell.orders import BoundOrder, OrderResult
from robosandbox.workcell.workcell import Workcell
from robosandbox.world.operators import BoundCall, Operator

ValueT = TypeVar("ValueT")
Tell = Callable[[str], None]


class McpRobot:
    """The robot of a running workcell.

    Args:
        host: Owns it; it has been started.
        robot: The robot that other tasks are loaded with; each task's own if left out.
        timeout: Simulated seconds that a call may take.

    Attributes:
        last_failure: The last skill error here; None before one.
    """

    def __init__(self, host: WorkcellHost, *, robot: Path | str | None = None, timeout: float = 120.0) -> None:
        self._host = host
        self._robot = robot
        self._timeout = timeout
        self.last_failure: Failure | None = None
        host.events.subscribe(self._note)

    @property
    def cell(self) -> Workcell:
        """The workcell."""
        return self._host.cell

    @property
    def calls(self) -> tuple[Operator, ...]:
        """Calls that clients may make: the skills, and the hand by itself."""
        return tuple(self.cell.calls.values())

    @property
    def task(self) -> dict[str, Any]:
        """Name of the loaded task, its prompt, and the layout's seed."""
        return {"task": self.cell.task.name, "prompt": self.cell.task.prompt, "seed": self.cell.seed}

    async def ready(self) -> McpRobot:
        """Return the robot itself, which is there."""
        return self

    @property
    def doing(self) -> str | None:
        """Activity that is under way here."""
        return self._host.doing

    async def carry_out(self, call: BoundCall | BoundOrder, tell: Tell) -> SkillResult | OrderResult:
        """Carry out a call or an order, telling its phases in the caller's loop; cancelling the task stops the arm first.

        Raises:
            BusyError: Something else is under way.
            SkillError: It cannot be done, or its post-condition was not reached.
        """
        loop = asyncio.get_running_loop()

        def hear(event: AgentEvent) -> None:
            if text := _said(event):
                loop.call_soon_threadsafe(tell, text)

        leave = self._host.events.subscribe(hear)
        try:
            return await self._ended(self._host.carry_out(call, timeout=self._timeout))
        finally:
            leave()

    async def reset(self, seed: int) -> None:
        """Start over with a layout.

        Raises:
            BusyError: Something else is under way.
            RoboSandboxError: It cannot start over, or has no such layout.
        """
        await self._ended(self._host.reset(seed))

    async def load(self, task: str) -> None:
        """Put the robot at another bundled task.

        Raises:
            BusyError: Something else is under way.
            InputError: There is no such task.
        """
        await self._ended(self._host.load(find_task(task), self._robot))

    def stop(self) -> str | None:
        """Stop what is under way, whoever asked for it; return what that was."""
        return self._host.stop()

    async def scene(self) -> ObservedScene:
        """Return what perception sees."""
        return await self._seen(self._host.reading(self.cell.observe))

    async def state(self) -> Observation:
        """Return joints, TCP and gripper."""
        return await self._seen(self._host.reading(self.cell.state))

    async def picture(self, camera: str) -> bytes:
        """Return what a camera sees as a PNG file.

        Raises:
            RenderingError: This machine cannot make pictures.
        """
        return (await self._seen(self._host.picture(camera)))[0]

    def close(self) -> None:
        """Stop what is under way, and free the workcell."""
        self._host.close()

    def _note(self, event: object) -> None:
        if isinstance(event, SkillFailed):
            self.last_failure = event.error

    async def _seen(self, look: Future[ValueT]) -> ValueT:
        return await asyncio.wrap_future(look)

    async def _ended(self, activity: Activity[ValueT]) -> ValueT:
        """Return what comes of an activity; cancelling the task stops the arm first."""
        done = asyncio.wrap_future(activity.done)
        try:
            return await asyncio.shield(done)
        except asyncio.CancelledError:
            self._host.stop(activity)
            with anyio.CancelScope(shield=True):
                await asyncio.wait([done])
            # Whatever it ended in is nobody's to hear: the caller has gone.
            done.exception()
            raise


def _said(event: AgentEvent) -> str:
    """Return what a client is told of an event; nothing of most."""
    match event:
        case PhaseEntered(call, phase):
            return f"{call}: {phase}"
        case Planned(plan, _):
            return f"plan: {plan}"
        case Consulted():
            return f"{event.tool}"
        case Thought(text):
            return text
        case _:
            return ""
