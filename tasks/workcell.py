"""What commands ask of a session, whether its world is in this process or in another."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol

from robosandbox.agent.agent import Agent
from robosandbox.agent.episode import Episode
from robosandbox.errors import UnsupportedError
from robosandbox.tasks.evaluate import Verdict
from robosandbox.tasks.task import Task
from robosandbox.types import ObservedScene


class PromptContext(Protocol):
    """The part of an agent's context that starts and stops prompts."""

    def cancel(self) -> None:
        """Stop what runs, from any thread."""
        ...

    def goal(self, timeout: float | None = None) -> AbstractContextManager[None]:
        """Run one prompt, within `timeout` simulated seconds."""
        ...


class Workcell(Protocol):
    """A loaded task with an agent: `Session` and `RemoteSession`."""

    @property
    def task(self) -> Task:
        """What is loaded."""
        ...

    @property
    def seed(self) -> int:
        """The layout."""
        ...

    @property
    def agent(self) -> Agent[Any]:
        """Carries out prompts."""
        ...

    @property
    def ctx(self) -> PromptContext:
        """Starts and stops prompts."""
        ...

    @property
    def robot_name(self) -> str:
        """The robot's model."""
        ...

    @property
    def cameras(self) -> Sequence[str]:
        """Names that `picture` takes."""
        ...

    def run(self, prompt: str | None = None, *, timeout: float | None = None) -> Episode:
        """Carry out a prompt, or the task's own."""
        ...

    def reset(self, seed: int = 0) -> None:
        """Start over with a seed's layout."""
        ...

    def checkpoint(self) -> Any:
        """Return something for `restore`."""
        ...

    def restore(self, checkpoint: Any) -> None:
        """Go back to a checkpoint."""
        ...

    def observe(self) -> ObservedScene:
        """Return what perception sees now."""
        ...

    def picture(self, camera: str, format: str = "png") -> bytes:
        """Return a camera's picture as a file's bytes."""
        ...

    def judge(self) -> Verdict | None:
        """Tell whether the task has succeeded since the last reset; None where that is not known."""
        ...

    def elapsed(self) -> tuple[float, int | None]:
        """Return seconds since the last reset, and physics steps, where they are simulated."""
        ...

    def close(self) -> None:
        """Free what it holds."""
        ...


def verdict_of(workcell: Workcell) -> Verdict:
    """Return whether the task has succeeded since the last reset.

    Raises:
        UnsupportedError: Nobody can judge.
    """
    verdict = workcell.judge()
    if verdict is None:
        raise nobody_judges()
    return verdict


def nobody_judges() -> UnsupportedError:
    """Return the error of a workcell in which nothing can be judged."""
    return UnsupportedError(
        "truth: nothing can be judged here: a sim with --no-ground-truth keeps its truth to itself, and a driver without "
        "truth needs a referee"
    )
