"""What the server needs of a robot, and a world in this process that provides it.

Physics and pictures live on one worker thread. Looks asked for while a goal runs are answered between its control ticks.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol, TypeVar

import anyio
from numpy.typing import NDArray

from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.agent.episode import AgentEvent, PhaseEntered
from robosandbox.errors import BusyError, BusyEvidence, CancelledError, Phase
from robosandbox.protocols import Skill
from robosandbox.types import Observation, ObservedScene, Plan, Refusal, SkillCall, SkillResult

ValueT = TypeVar("ValueT")
Tell = Callable[[str], None]


class Robot(Protocol):
    """What the server needs of a robot, near or remote."""

    @property
    def skills(self) -> Sequence[Skill]:
        """What it can do."""
        ...

    @property
    def cameras(self) -> Sequence[str]:
        """Names that `picture` takes."""
        ...

    async def perform(self, call: SkillCall, tell: Tell) -> SkillResult:
        """Carry out a call, telling its phases in the caller's loop; cancelling the task stops the arm first.

        Raises:
            BusyError: Another call is under way.
            SkillError: The post-condition was not reached.
        """
        ...

    async def plan(self, prompt: str) -> Plan | Refusal:
        """Return the planner's answer; nothing moves. Raises PlannerError."""
        ...

    async def scene(self) -> ObservedScene:
        """Return what perception sees."""
        ...

    async def state(self) -> Observation:
        """Return joints, TCP and gripper."""
        ...

    async def picture(self, camera: str) -> NDArray[Any]:
        """Return an RGB picture, (height, width, 3) uint8; raises RenderingError."""
        ...


class LocalRobot:
    """A world in this process.

    Args:
        agent: Carries out calls.
        ctx: The agent's context.
        cameras: Names that the world's cameras have.
        timeout: Simulated seconds that a call may take.
    """

    def __init__(
        self, agent: Agent[AgentContext], ctx: AgentContext, cameras: Sequence[str], timeout: float = 120.0
    ) -> None:
        self.cameras = tuple(cameras)
        self.skills = tuple(agent.skills.values())
        self._agent = agent
        self._ctx = ctx
        self._timeout = timeout
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="robot")
        self._looks: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._running: SkillCall | None = None
        ctx.sim.tick_hooks.append(self._answer_looks)

    async def perform(self, call: SkillCall, tell: Tell) -> SkillResult:
        """Carry out a call."""
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
                self._ctx.cancel()
                with anyio.CancelScope(shield=True):
                    await asyncio.wait([work])
                # Whatever it ended in is nobody's to hear: the caller has gone.
                work.exception()
                raise
        finally:
            self._running = None

    async def plan(self, prompt: str) -> Plan | Refusal:
        """Return the planner's answer; nothing moves."""
        return await asyncio.wrap_future(self._worker.submit(self._agent.plan, prompt))

    async def scene(self) -> ObservedScene:
        """Return what perception sees."""
        return await self._look(lambda: self._ctx.perception.perceive(self._ctx.sim))

    async def state(self) -> Observation:
        """Return joints, TCP and gripper."""
        return await self._look(self._ctx.sim.observe)

    async def picture(self, camera: str) -> NDArray[Any]:
        """Return what a camera sees."""
        return await self._look(lambda: self._ctx.sim.observe([camera]).images[camera])

    def close(self) -> None:
        """Let the worker end; what runs is stopped."""
        self._ctx.cancel()
        self._worker.shutdown(wait=True, cancel_futures=True)

    def _perform(self, call: SkillCall, hear: Callable[[AgentEvent], None], stop: threading.Event) -> SkillResult:
        self._agent.listeners.append(hear)
        try:
            with self._ctx.goal(self._timeout):
                # A goal forgets what was cancelled before it began; this one may have been while it waited its turn.
                if stop.is_set():
                    raise CancelledError("cancelled before it began", phase=Phase.CHECK)
                return self._agent.perform(call)
        finally:
            self._agent.listeners.remove(hear)

    async def _look(self, look: Callable[[], ValueT]) -> ValueT:
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
