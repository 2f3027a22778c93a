"""The one object that a command opens: a robot at its task, and an agent that acts there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, Self

from typing_extensions import TypeVar

from robosandbox.agent.agent import Agent
from robosandbox.agent.episode import Ended, Episode, SkillStarted, Started
from robosandbox.agent.goal import GoalContext
from robosandbox.agent.goal_planner import read_goals
from robosandbox.agent.tools import simulated
from robosandbox.errors import InputError, UnsupportedError
from robosandbox.tasks.evaluate import evaluate
from robosandbox.tasks.task import Task
from robosandbox.types import (
    Observation,
    ObservedScene,
    Plan,
    Refusal,
    Scene,
    SkillCall,
    SkillResult,
    Truth,
    Verdict,
)
from robosandbox.workcell.zenoh.messages import Picture
from robosandbox.world.operators import Operator, bind
from robosandbox.world.verifier import Constraints, Problem, verify

# Number of states that `undo` can go back to; a sim process keeps as many checkpoints.
WAYS_BACK = 64

ContextT = TypeVar("ContextT", bound=GoalContext, default=Any)


class Workcell(ABC, Generic[ContextT]):
    """A robot at a task, in this process or in a sim process, with the same methods and the same values.

    Args:
        task: What is loaded.
        agent: Carries out prompts.
        seed: The layout.
        undoes: Whether a way back is kept from each prompt or call that moves something.

    Attributes:
        task: What is loaded.
        agent: Carries out prompts; it has the skills, and the context that they are called with.
        seed: The layout of the last reset.
    """

    def __init__(self, task: Task, agent: Agent[ContextT], *, seed: int = 0, undoes: bool = False) -> None:
        self._undoes = undoes
        self._hold(task, agent, seed)

    def _hold(self, task: Task, agent: Agent[ContextT], seed: int) -> None:
        """Take over a task and its agent, in which nothing has been done."""
        self.task = task
        self.agent = agent
        self.seed = seed
        self._start: Truth | None = None
        self._ways: deque[tuple[str, Any]] = deque(maxlen=WAYS_BACK)
        self._prompt: str | None = None
        self._has_moved = False
        self._leave: Callable[[], None] = agent.ctx.events.subscribe(self._keep_way_back) if self._undoes else _nothing

    @property
    def ctx(self) -> ContextT:
        """Context in which skills are called: it looks, tells phases, starts and stops goals."""
        return self.agent.ctx

    @property
    def skills(self) -> tuple[Operator, ...]:
        """Skills of the robot."""
        return tuple(self.agent.skills.values())

    @property
    def start(self) -> Truth:
        """The state after the last reset, which success is judged against.

        Raises:
            UnsupportedError: Nobody can judge.
        """
        if self._start is None:
            raise nobody_judges()
        return self._start

    @property
    def judgeable(self) -> bool:
        """True where somebody can tell how the episode began, and so whether it succeeds."""
        return self._start is not None

    @property
    @abstractmethod
    def robot_name(self) -> str:
        """The robot's model."""

    @property
    @abstractmethod
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""

    @property
    def calls(self) -> Mapping[str, Operator]:
        """Calls of a program by name: the skills, and the moves of the hand alone, which no planner plans with."""
        return self.agent.calls

    def run(self, prompt: str | None = None, *, timeout: float | None = None) -> Episode:
        """Carry out a prompt, or the task's own; see `say`."""
        return self.say(self.task.prompt if prompt is None else prompt, timeout=timeout)

    def say(self, sentence: str, *, timeout: float | None = None) -> Episode:
        """Carry out a sentence: an order, a question, or where the last one was answered with a question, its answer.

        Args:
            sentence: What is said.
            timeout: Simulated seconds after which the running skill is stopped.
        """
        with self.ctx.goal(timeout):
            return self.agent.run(sentence)

    def follow(self, plan: Plan, *, timeout: float | None = None) -> Episode:
        """Carry out a plan as it is; a failure ends it."""
        with self.ctx.goal(timeout):
            return self.agent.follow(plan)

    def achieve(self, *goals: str, timeout: float | None = None) -> Episode:
        """Bring relations about, planning for them: `achieve("on(red_cube, blue_cube)")`.

        Raises:
            InputError: One of them is no relation.
        """
        read_goals(", ".join(goals))
        return self.run(", ".join(goals), timeout=timeout)

    def do(self, name: str, *, timeout: float | None = None, **arguments: Any) -> SkillResult:
        """Carry out one call: `do("push", object="red_cube", direction="left", distance=0.1)`.

        Args:
            name: A skill, or a move of the hand; `calls` has them all.
            timeout: Simulated seconds after which it is stopped.
            arguments: As its schema says.

        Raises:
            SkillError: It takes other arguments, or did not reach its post-condition.
        """
        with self.ctx.goal(timeout):
            return self.agent.perform_bound(bind(SkillCall(skill=name, arguments=arguments), self.calls))

    # Types are checked without it: any misspelt attribute would pass for a skill.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Callable[..., SkillResult]:
            """Return what carries out the calls of a skill: `pick("red_cube")` is `do("pick", object="red_cube")`."""
            if name.startswith("_") or "agent" not in self.__dict__ or name not in self.calls:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            fields = tuple(self.calls[name].schema.get("properties", {}))

            def call(*values: Any, timeout: float | None = None, **arguments: Any) -> SkillResult:
                if len(values) > len(fields):
                    raise TypeError(f"{name} takes {', '.join(fields) or 'no arguments'}; {len(values)} were given")
                named = dict(zip(fields, values, strict=False))
                if twice := named.keys() & arguments.keys():
                    raise TypeError(f"{name} got {', '.join(sorted(twice))} twice")
                return self.do(name, timeout=timeout, **named, **arguments)

            return call

    def plan(self, prompt: str) -> Plan | Refusal:
        """Return what the planner makes of a sentence; nothing moves.

        Raises:
            PlannerError: It has no answer.
        """
        return self.agent.plan(prompt)

    def check(self, plan: Plan, *, constraints: Constraints | None = None) -> tuple[Problem, ...]:
        """Return what keeps a plan from being right, by contracts alone; nothing moves."""
        return verify(plan, self.observe(), list(self.calls.values()), constraints=constraints).problems

    def simulate(self, plan: Plan) -> dict[str, Any]:
        """Return what would come of a plan on the twin, a simulation of what is believed; this world is left alone."""
        return simulated(self.ctx, plan, self.calls)

    def stop(self) -> None:
        """Stop what runs, from any thread: it ends in a CancelledError, with the arm holding."""
        self.ctx.cancel()

    @abstractmethod
    def recover(self) -> str:
        """End a fault of the driver, somebody having looked after it; return what it was, "" where there was none.

        Raises:
            FaultError: What was the matter still is.
        """

    def remember(self, what: str) -> None:
        """Keep a way back to how the world is now, for `undo`; none where this world cannot be copied.

        Args:
            what: What is done next, for people.
        """
        try:
            self._ways.append((what, self.checkpoint()))
        except UnsupportedError:
            return

    def _keep_way_back(self, event: object) -> None:
        """Remember how the world is before a prompt, or a call that belongs to none, moves something."""
        match event:
            case Started(prompt):
                self._prompt, self._has_moved = prompt, False
            case SkillStarted(call) if not self._has_moved:
                self._has_moved = self._prompt is not None
                self.remember(self._prompt or str(call))
            case Ended():
                self._prompt, self._has_moved = None, False
            case _:
                pass

    @property
    def ways_back(self) -> int:
        """Number of times that `undo` can be called."""
        return len(self._ways)

    def undo(self) -> str:
        """Go back to before what was remembered last; return what that was.

        Raises:
            InputError: There is nothing to go back to, or the sim does not have that state any more.
        """
        if not self._ways:
            raise InputError("nothing to undo")
        what, way = self._ways[-1]
        try:
            self.restore(way)
        except InputError:
            # What lies further back is older still.
            self._ways.clear()
            raise InputError(
                f"cannot undo {what!r}: the sim does not have the state before it any more; reset starts over"
            ) from None
        self._ways.pop()
        return what

    def observe(self) -> ObservedScene:
        """Return what perception sees now."""
        return self.ctx.look()

    def judge(self) -> Verdict:
        """Tell whether the task has succeeded since the last reset; waits as long as it asks success to hold.

        Raises:
            UnsupportedError: Nobody can judge: the driver knows no truth and has no referee, or the sim does not tell it.
        """
        return evaluate(self.task.success, self.start, self.truth, self.wait)

    @abstractmethod
    def state(self) -> Observation:
        """Return joints, TCP and gripper."""

    @abstractmethod
    def truth(self) -> Truth:
        """Return the state to judge on; raises a SkillError where nobody knows or tells it."""

    @abstractmethod
    def wait(self, seconds: float) -> None:
        """Let time pass, the arm holding."""

    @abstractmethod
    def elapsed(self) -> tuple[float, int | None]:
        """Return seconds since the last reset, and physics steps, where they are simulated."""

    def picture(self, camera: str, format: Literal["png", "jpeg"] = "png") -> bytes:
        """Return a camera's picture as a file's bytes.

        Raises:
            InputError: No such camera.
            RenderingError: No OpenGL on this machine.
        """
        return self.photograph(camera, format)[0]

    @abstractmethod
    def photograph(self, camera: str, format: Literal["png", "jpeg"] = "png") -> tuple[bytes, Picture]:
        """Return a camera's picture as a file's bytes, with its time, its pinhole and where the camera is."""

    def reset(self, seed: int = 0) -> None:
        """Start over with this seed's layout; `undo` goes back to before.

        Raises:
            InputError: The seed is negative or has no layout.
            UnsupportedError: The driver does not start over.
            BusyError: The robot is at work.
        """
        before = len(self._ways)
        if self._undoes:
            self.remember(f"reset to seed {seed}")
        try:
            self._lay_out(seed)
        except BaseException:
            while len(self._ways) > before:
                self._ways.pop()
            raise

    @abstractmethod
    def _lay_out(self, seed: int) -> None:
        """Start over with this seed's layout."""

    @abstractmethod
    def load(self, task: Task | Scene | Path | str, robot: Path | str | None = None) -> None:
        """Put another task in the place of this one, as written; there is another agent then, and no way back.

        Args:
            task: A task, a bundled one's name, a YAML file, or a bare scene.
            robot: In place of the task's.

        Raises:
            InputError: One of them is wrong; this task stays.
            UnsupportedError: The driver does not start over.
            BusyError: The robot is at work.
        """

    @abstractmethod
    def checkpoint(self) -> Any:
        """Return the world as it is, for `restore`; raises an UnsupportedError where it cannot be taken down."""

    @abstractmethod
    def restore(self, checkpoint: Any) -> None:
        """Go back to a checkpoint of this task; the arm holds.

        Raises:
            InputError: The checkpoint is of another task, or is not kept any more.
        """

    def close(self) -> None:
        """Free what it holds."""
        self._leave()
        # What ends listening holds the listener.
        self._leave = _nothing

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _nothing() -> None:
    pass


def nobody_judges() -> UnsupportedError:
    """Return the error of a workcell in which nothing can be judged."""
    return UnsupportedError(
        "truth: nothing can be judged here: a sim with --no-ground-truth keeps its truth to itself, and a driver without "
        "truth needs a referee"
    )
