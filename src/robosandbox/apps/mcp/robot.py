"""Robot behind the MCP server, provided by a workcell of this process or of another one.

A world in this process lives on one worker thread, physics and pictures alike; looks asked for while something is under way are
answered between its control ticks. A world in another process answers looks by itself at any time.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

import anyio

from robosandbox.agent.agent import Agent
from robosandbox.agent.episode import AgentEvent, Consulted, PhaseEntered, Planned, SkillFailed, Thought
from robosandbox.errors import BusyError, CancelledError, Failure, Phase
from robosandbox.evidence import BusyEvidence
from robosandbox.types import Observation, ObservedScene, Plan, Refusal, SkillCall, SkillResult
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.orders import Answer, BoundOrder
from robosandbox.workcell.workcell import Workcell
from robosandbox.world.operators import Operator

ValueT = TypeVar("ValueT")
Tell = Callable[[str], None]
Reopen = Callable[[str], Workcell]


class McpRobot:
    """A workcell's robot for an asynchronous server.

    Args:
        cell: Whose.
        reopen: Opens the same robot at another bundled task; None where that cannot be done.
        timeout: Simulated seconds that a call may take.

    Attributes:
        cell: The workcell, which another takes the place of when a task is loaded; the one before is closed then.
        last_failure: The last skill error here; None before one.
    """

    def __init__(self, cell: Workcell, *, reopen: Reopen | None = None, timeout: float = 120.0) -> None:
        self._reopen = reopen
        self._timeout = timeout
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="robot")
        self._looks: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._running: str | None = None
        self.last_failure: Failure | None = None
        self._adopt(cell)

    def _adopt(self, cell: Workcell) -> None:
        self.cell: Workcell = cell
        self._here = isinstance(cell, EmbeddedWorkcell)
        if isinstance(cell, EmbeddedWorkcell):
            cell.driver.subscribe(self._answer_looks)

    @property
    def skills(self) -> tuple[Operator, ...]:
        """Skills that plans may call."""
        return self.cell.skills

    @property
    def calls(self) -> tuple[Operator, ...]:
        """Calls that clients may make: the skills, and the hand by itself."""
        return tuple(self.cell.calls.values())

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""
        return tuple(self.cell.cameras)

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
        return self._running

    async def perform(self, call: SkillCall, tell: Tell) -> SkillResult:
        """Carry out a call, telling its phases in the caller's loop; cancelling the task stops the arm first.

        Raises:
            BusyError: Something else is under way.
            SkillError: The post-condition was not reached.
        """
        agent = self.cell.agent
        return await self._under_way(str(call), lambda: agent.perform(call), tell, agent)

    async def order(self, order: BoundOrder, tell: Tell) -> Answer:
        """Carry out an order with the planner that the server was started with.

        Raises:
            BusyError: Something else is under way.
            SkillError: It cannot be done.
        """
        cell = self.cell
        return await self._under_way(order.name, lambda: order.carry_out(cell), tell, cell.agent)

    async def undo(self) -> str:
        """Go back to before what was done last; return what that was.

        Raises:
            BusyError: Something else is under way.
            InputError: There is nothing to go back to.
        """
        return await self._under_way("undo", self.cell.undo, _nobody)

    async def reset(self, seed: int) -> None:
        """Start over with a layout.

        Raises:
            BusyError: Something else is under way.
            RoboSandboxError: It cannot start over, or has no such layout.
        """

        def work() -> None:
            self.cell.remember(f"reset to seed {seed}")
            self.cell.reset(seed)

        await self._under_way("reset", work, _nobody)

    async def load(self, task: str) -> None:
        """Put the robot at another bundled task.

        Raises:
            BusyError: Something else is under way.
            InputError: There is no such task.
        """
        reopen = self._reopen
        assert reopen is not None

        def work() -> None:
            before, cell = self.cell, reopen(task)
            self._adopt(cell)
            if cell is not before:
                before.close()

        await self._under_way(f"load {task}", work, _nobody)

    @property
    def loads(self) -> bool:
        """True where another task can be loaded."""
        return self._reopen is not None

    async def plan(self, prompt: str) -> Plan | Refusal:
        """Return the planner's answer; nothing moves.

        Raises:
            PlannerError: The planner has none.
        """
        # A planner may think for a minute; the worker stays free meanwhile.
        return await asyncio.to_thread(self.cell.agent.answer, prompt, await self.scene())

    async def scene(self) -> ObservedScene:
        """Return what perception sees."""
        return await self._look(lambda: self.cell.observe())

    async def state(self) -> Observation:
        """Return joints, TCP and gripper."""
        return await self._look(lambda: self.cell.state())

    async def picture(self, camera: str) -> bytes:
        """Return what a camera sees as a PNG file.

        Raises:
            RenderingError: This machine cannot make pictures.
        """
        return await self._look(lambda: self.cell.picture(camera))

    def close(self) -> None:
        """Let the worker end; what runs is stopped."""
        self.cell.ctx.cancel()
        self._worker.shutdown(wait=True, cancel_futures=True)

    async def _under_way(
        self, what: str, work: Callable[[], ValueT], tell: Tell, agent: Agent[Any] | None = None
    ) -> ValueT:
        """Do one thing on the worker; cancelling the task stops the arm first."""
        if self._running is not None:
            raise BusyError(
                f"{self._running} is under way; wait for it or cancel it", evidence=BusyEvidence(doing=self._running)
            )
        self._running = what
        stop = threading.Event()
        loop = asyncio.get_running_loop()

        def hear(event: AgentEvent) -> None:
            if isinstance(event, SkillFailed):
                self.last_failure = event.error
            text = _said(event)
            if text:
                loop.call_soon_threadsafe(tell, text)

        try:
            done = asyncio.wrap_future(self._worker.submit(self._goal, work, hear, stop, agent))
            try:
                return await asyncio.shield(done)
            except asyncio.CancelledError:
                stop.set()
                self.cell.ctx.cancel()
                with anyio.CancelScope(shield=True):
                    await asyncio.wait([done])
                # Whatever it ended in is nobody's to hear: the caller has gone.
                done.exception()
                raise
        finally:
            self._running = None

    def _goal(
        self,
        work: Callable[[], ValueT],
        hear: Callable[[AgentEvent], None],
        stop: threading.Event,
        agent: Agent[Any] | None,
    ) -> ValueT:
        if agent is None:
            return work()
        leave = agent.ctx.events.subscribe(hear)
        try:
            with agent.ctx.goal(self._timeout):
                # A goal forgets what was cancelled before it began; this one may have been while it waited its turn.
                if stop.is_set():
                    raise CancelledError("cancelled before it began", phase=Phase.CHECK)
                return work()
        finally:
            leave()

    async def _look(self, look: Callable[[], ValueT]) -> ValueT:
        if not self._here:
            return await asyncio.to_thread(look)
        answer: Future[ValueT] = Future()
        self._looks.append((look, answer))
        # Between ticks if a goal runs, else now; a look that the ticks have answered is no longer in the queue.
        self._worker.submit(self._answer_looks)
        return await asyncio.wrap_future(answer)

    def _answer_looks(self) -> None:
        while self._looks:
            look, answer = self._looks.popleft()
            if not answer.set_running_or_notify_cancel():
                continue
            try:
                answer.set_result(look())
            except BaseException as error:
                answer.set_exception(error)


def _nobody(text: str) -> None:
    """Tell nobody."""


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
