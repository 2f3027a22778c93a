"""What the server needs of a robot, provided by a workcell: in this process or in another one.

A world in this process lives on one worker thread, physics and pictures alike; looks asked for while a goal runs are answered
between its control ticks. A world in another process answers looks by itself at any time.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

import anyio

from robosandbox.agent.episode import AgentEvent, PhaseEntered
from robosandbox.errors import BusyError, CancelledError, Phase
from robosandbox.evidence import BusyEvidence
from robosandbox.protocols import Skill
from robosandbox.tasks.workcell import Workcell
from robosandbox.types import Observation, ObservedScene, Plan, Refusal, SkillCall, SkillResult

ValueT = TypeVar("ValueT")
Tell = Callable[[str], None]
Subscribe = Callable[[Callable[[], None]], object]


class Robot:
    """A workcell's robot for an asynchronous server.

    Args:
        cell: Whose.
        subscribe: Has a listener called after every control tick of a world in this process; None for one that answers looks
            by itself.
        timeout: Simulated seconds that a call may take.

    Attributes:
        skills: What it can do.
        cameras: Names that `picture` takes.
    """

    def __init__(
        self,
        cell: Workcell,
        *,
        subscribe: Subscribe | None,
        timeout: float = 120.0,
    ) -> None:
        self.skills: tuple[Skill[Any], ...] = tuple(cell.agent.skills.values())
        self.cameras = tuple(cell.cameras)
        self._cell = cell
        self._timeout = timeout
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="robot")
        self._here = subscribe is not None
        self._looks: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._running: SkillCall | None = None
        if subscribe is not None:
            subscribe(self._answer_looks)

    async def ready(self) -> Robot:
        """Return the robot itself, which is there."""
        return self

    @property
    def doing(self) -> str | None:
        """The call that is under way here."""
        return str(self._running) if self._running else None

    async def perform(self, call: SkillCall, tell: Tell) -> SkillResult:
        """Carry out a call, telling its phases in the caller's loop; cancelling the task stops the arm first.

        Raises:
            BusyError: Another call is under way.
            SkillError: The post-condition was not reached.
        """
        if self._running is not None:
            raise BusyError(
                f"{self._running} is under way; wait for it or cancel it",
                evidence=BusyEvidence(doing=self._running.skill),
            )
        self._running = call
        stop = threading.Event()
        loop = asyncio.get_running_loop()

        def hear(event: AgentEvent) -> None:
            if isinstance(event, PhaseEntered):
                loop.call_soon_threadsafe(tell, event.phase)

        try:
            work = asyncio.wrap_future(self._worker.submit(self._perform, call, hear, stop))
            try:
                return await asyncio.shield(work)
            except asyncio.CancelledError:
                stop.set()
                self._cell.ctx.cancel()
                with anyio.CancelScope(shield=True):
                    await asyncio.wait([work])
                # Whatever it ended in is nobody's to hear: the caller has gone.
                work.exception()
                raise
        finally:
            self._running = None

    async def plan(self, prompt: str) -> Plan | Refusal:
        """Return the planner's answer; nothing moves.

        Raises:
            PlannerError: The planner has none.
        """
        # A planner may think for a minute; the worker stays free meanwhile.
        return await asyncio.to_thread(self._cell.agent.answer, prompt, await self.scene())

    async def scene(self) -> ObservedScene:
        """Return what perception sees."""
        return await self._look(self._cell.observe)

    async def state(self) -> Observation:
        """Return joints, TCP and gripper."""
        return await self._look(self._cell.state)

    async def picture(self, camera: str) -> bytes:
        """Return what a camera sees as a PNG file.

        Raises:
            RenderingError: This machine cannot make pictures.
        """
        return await self._look(lambda: self._cell.picture(camera))

    def close(self) -> None:
        """Let the worker end; what runs is stopped."""
        self._cell.ctx.cancel()
        self._worker.shutdown(wait=True, cancel_futures=True)

    def _perform(self, call: SkillCall, hear: Callable[[AgentEvent], None], stop: threading.Event) -> SkillResult:
        agent = self._cell.agent
        agent.listeners.append(hear)
        try:
            with self._cell.ctx.goal(self._timeout):
                # A goal forgets what was cancelled before it began; this one may have been while it waited its turn.
                if stop.is_set():
                    raise CancelledError("cancelled before it began", phase=Phase.CHECK)
                return agent.perform(call)
        finally:
            agent.listeners.remove(hear)

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
