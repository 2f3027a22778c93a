"""The one object that a command opens: a robot at its task, and an agent that acts there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Generic, Self

from typing_extensions import TypeVar

from robosandbox.agent.agent import Agent
from robosandbox.agent.episode import Episode
from robosandbox.agent.goal import GoalContext
from robosandbox.errors import UnsupportedError
from robosandbox.tasks.evaluate import evaluate
from robosandbox.tasks.task import Task
from robosandbox.types import Observation, ObservedScene, Truth, Verdict
from robosandbox.world.operators import Operator

ContextT = TypeVar("ContextT", bound=GoalContext, default=Any)


class Workcell(ABC, Generic[ContextT]):
    """A robot at a task, in this process or in a sim process, with the same methods and the same values.

    Attributes:
        task: What is loaded.
        agent: Carries out prompts; it has the skills, and the context that they are called with.
        seed: The layout of the last reset.
    """

    def __init__(self, task: Task, agent: Agent[ContextT], *, seed: int = 0) -> None:
        self.task = task
        self.agent = agent
        self.seed = seed
        self._start: Truth | None = None

    @property
    def ctx(self) -> ContextT:
        """Where skills are called: it looks, tells phases, starts and stops goals."""
        return self.agent.ctx

    @property
    def skills(self) -> tuple[Operator, ...]:
        """What the robot can do."""
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
        """Whether somebody can tell how the episode began, and so whether it succeeds."""
        return self._start is not None

    @property
    @abstractmethod
    def robot_name(self) -> str:
        """The robot's model."""

    @property
    @abstractmethod
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""

    def run(self, prompt: str | None = None, *, timeout: float | None = None) -> Episode:
        """Carry out a prompt, or the task's own.

        Args:
            prompt: A sentence.
            timeout: Simulated seconds after which the running skill is stopped.
        """
        with self.ctx.goal(timeout):
            return self.agent.run(self.task.prompt if prompt is None else prompt)

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

    @abstractmethod
    def picture(self, camera: str, format: str = "png") -> bytes:
        """Return a camera's picture as a PNG or JPEG file's bytes.

        Raises:
            InputError: No such camera.
            RenderingError: No OpenGL on this machine.
        """

    @abstractmethod
    def reset(self, seed: int = 0) -> None:
        """Start over with this seed's layout.

        Raises:
            InputError: The seed is negative or has no layout.
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

    @abstractmethod
    def close(self) -> None:
        """Free what it holds."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def nobody_judges() -> UnsupportedError:
    """Return the error of a workcell in which nothing can be judged."""
    return UnsupportedError(
        "truth: nothing can be judged here: a sim with --no-ground-truth keeps its truth to itself, and a driver without "
        "truth needs a referee"
    )
