"""A session whose world is a sim process: the same prompts, resets and verdicts as in an embedded one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from robosandbox.agent.agent import Agent
from robosandbox.agent.episode import Episode
from robosandbox.agent.planners import make_planner
from robosandbox.errors import InputError
from robosandbox.service.client.context import RemoteContext
from robosandbox.service.client.robot import RemoteRobot
from robosandbox.tasks.evaluate import Verdict, evaluate
from robosandbox.tasks.task import Task
from robosandbox.types import ObservedScene, Truth
from robosandbox.validation import validate


@dataclass(frozen=True, slots=True, kw_only=True)
class RemoteCheckpoint:
    """A world that a sim keeps.

    Attributes:
        name: What the sim calls it.
        seed: The last reset's.
        start: The state after that reset, which success is judged against.
    """

    name: str
    seed: int
    start: Truth | None


class RemoteSession:
    """The task that a sim process has loaded, and an agent here that acts in it.

    Attributes:
        robot: The connection.
        task: What is loaded.
        seed: The last reset's.
        agent: Carries out prompts.
        start: The state after the last reset, which success is judged against.
    """

    def __init__(
        self,
        robot: RemoteRobot,
        *,
        planner: str = "stub",
        planner_options: Mapping[str, Any] | None = None,
        camera: str | None = None,
        dialogue: bool = False,
        max_replans: int = 3,
    ) -> None:
        """Act on a robot.

        Args:
            robot: The connection.
            planner: Name of an installed planner.
            planner_options: What it takes besides the skills, such as `model`; None counts as not given.
            camera: The camera whose picture the planner is to see.
            dialogue: Whether prompts may refer to those before them, where the planner can do that.
            max_replans: How often a failure may be answered with a new plan.

        Raises:
            InputError: No such planner is installed, or it takes no such option.
        """
        self.robot = robot
        self._planner = planner
        self._dialogue = dialogue
        self._options = dict(planner_options or {})
        if camera is not None:
            if camera not in robot.cameras:
                raise InputError(f"camera {camera!r} is not one of {', '.join(robot.cameras)}")
            self._options["picture"] = lambda: self._pixels(camera)
        self._max_replans = max_replans
        self.adopt()

    def adopt(self) -> None:
        """Take over what the sim has loaded, whoever did; there is another agent then."""
        info = self.robot.survey()
        self._loaded = info.task
        self.task = validate(info.task, Task, source="the sim's task")
        self.seed = info.seed
        mind = make_planner(self._planner, self.robot.skills, self._options, dialogue=self._dialogue)
        self.agent: Agent[RemoteContext] = Agent(
            ctx=self.robot.ctx,
            skills=self.robot.skills,
            planner=mind,
            max_replans=self._max_replans,
        )
        self.start = self.robot.truth() if info.truth else None

    @property
    def ctx(self) -> RemoteContext:
        """What the agent uses."""
        return self.robot.ctx

    @property
    def robot_name(self) -> str:
        """The robot's model."""
        return self.robot.info().robot

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""
        return self.robot.cameras

    def elapsed(self) -> tuple[float, int | None]:
        """Return simulated seconds and physics steps since the last reset."""
        state = self.robot.state()
        return state.robot.time, state.physics_steps

    def load(self, task: Task) -> None:
        """Have the sim load another task.

        Raises:
            InputError: The sim refuses it.
            BusyError: The robot is at work.
        """
        self.robot.load(document=task.model_dump(mode="json"))
        self.adopt()

    def catch_up(self) -> bool:
        """Take over the seed of a reset by another client; return whether the same task is loaded still."""
        info = self.robot.info()
        if info.task != self._loaded:
            return False
        if info.seed != self.seed:
            self.seed = info.seed
            self.start = self.robot.truth() if self.start is not None else None
        return True

    def run(self, prompt: str | None = None, *, timeout: float | None = None) -> Episode:
        """Carry out a prompt, or the task's own, within `timeout` simulated seconds."""
        with self.ctx.goal(timeout):
            return self.agent.run(self.task.prompt if prompt is None else prompt)

    def reset(self, seed: int = 0) -> None:
        """Start over with this seed's layout.

        Raises:
            InputError: The seed has no layout.
            BusyError: The robot is at work.
        """
        truth = self.robot.reset(seed)
        self.start = truth if self.start is not None else None
        self.seed = seed

    def checkpoint(self) -> RemoteCheckpoint:
        """Return the world as it is, for `restore`; the sim keeps the last 64."""
        return RemoteCheckpoint(name=self.robot.checkpoint(), seed=self.seed, start=self.start)

    def restore(self, checkpoint: RemoteCheckpoint) -> None:
        """Go back to a checkpoint; the arm holds.

        Raises:
            InputError: The sim does not have it any more.
        """
        self.robot.reset(checkpoint=checkpoint.name)
        self.seed, self.start = checkpoint.seed, checkpoint.start

    def observe(self) -> ObservedScene:
        """Return what perception sees now."""
        return self.robot.observe()

    def picture(self, camera: str, format: str = "png") -> bytes:
        """Return a camera's picture as a PNG or JPEG file's bytes."""
        return self.robot.picture(camera, format=format)[0]

    def _pixels(self, camera: str) -> NDArray[Any]:
        import cv2

        # OpenCV's order of channels is blue, green, red.
        decoded = cv2.imdecode(np.frombuffer(self.picture(camera), np.uint8), cv2.IMREAD_COLOR)
        return np.asarray(decoded)[:, :, ::-1]

    def judge(self) -> Verdict | None:
        """Tell whether the task has succeeded since the last reset; None where the sim keeps its truth to itself."""
        if self.start is None:
            return None
        return evaluate(self.task.success, self.start, self.robot.truth, self.robot.step)

    def close(self) -> None:
        """Nothing to free: the connection is the client's."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
