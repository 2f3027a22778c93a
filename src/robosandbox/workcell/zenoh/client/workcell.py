"""A workcell that is another process's: the same prompts, resets and verdicts as in an embedded one."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from robosandbox.agent.agent import Agent
from robosandbox.agent.gate import Gate
from robosandbox.agent.planners import make_planner
from robosandbox.errors import InputError
from robosandbox.tasks.loader import resolve_task, with_robot
from robosandbox.tasks.task import Task
from robosandbox.types import Observation, ObservedScene, Scene, Truth
from robosandbox.validation import validate
from robosandbox.values import frozen
from robosandbox.workcell.options import USUAL, WorkcellOptions
from robosandbox.workcell.workcell import Workcell
from robosandbox.workcell.zenoh.client.context import RemoteContext
from robosandbox.workcell.zenoh.client.robot import RemoteRobot
from robosandbox.workcell.zenoh.messages import Picture


@frozen(kw_only=True)
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


class RemoteWorkcell(Workcell[RemoteContext]):
    """The task that a sim process has loaded, and an agent here that acts in it.

    Args:
        robot: The connection.
        options: Who plans: `planner`, `planner_options`, `camera`, `dialogue` and `max_replans` count; the rest is the sim's.

    Attributes:
        robot: The connection.

    Raises:
        InputError: No such planner is installed, it takes no such option, or there is no such camera.
    """

    def __init__(self, robot: RemoteRobot, options: WorkcellOptions = USUAL) -> None:
        self.robot = robot
        self._options = options
        camera = options.camera
        self._planner_options = dict(options.planner_options or {})
        if camera is not None:
            if camera not in robot.cameras:
                raise InputError(f"camera {camera!r} is not one of {', '.join(robot.cameras)}")
            self._planner_options["picture"] = lambda: self._pixels(camera)
        self._loaded: dict[str, Any] = {}
        self._begin()

    def adopt(self) -> None:
        """Take over what the sim has loaded, whoever did; there is another agent then."""
        self._leave()
        before = self.agent
        self._begin()
        self.agent.take_over(before)

    def _begin(self) -> None:
        info, options, robot = self.robot.survey(), self._options, self.robot
        moves = [call for name, call in robot.calls.items() if name not in {skill.name for skill in robot.skills}]
        mind = make_planner(
            options.planner, robot.skills, self._planner_options, dialogue=options.dialogue, moves=moves
        )
        agent = Agent(ctx=robot.ctx, skills=robot.skills, planner=mind, max_replans=options.max_replans)
        agent.calls = robot.calls
        if info.confirms:
            agent.approve = Gate(agent, refuses=False)
        super().__init__(
            validate(info.task, Task, source="the sim's task"), agent, seed=info.seed, undoes=options.dialogue
        )
        self._loaded = info.task
        self._start = robot.truth() if info.truth else None

    @property
    def robot_name(self) -> str:
        """The robot's model."""
        return self.robot.info().robot

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""
        return self.robot.cameras

    def load(self, task: Task | Scene | Path | str, robot: Path | str | None = None) -> None:
        """Have the sim load another task."""
        chosen = resolve_task(task)
        if robot is not None:
            chosen = chosen.model_copy(update={"scene": with_robot(chosen.scene, robot)})
        self.robot.load(document=chosen.model_dump(mode="json"))
        self.adopt()

    def catch_up(self) -> bool:
        """Take over the seed of a reset by another client; return whether the same task is loaded still."""
        info = self.robot.info()
        if info.task != self._loaded:
            return False
        if info.seed != self.seed:
            self.seed = info.seed
            self._start = self.robot.truth() if self._start is not None else None
        return True

    def observe(self) -> ObservedScene:
        """Return what perception sees now; unlike the agent's own look it is no base of a plan."""
        return self.robot.observe()

    def state(self) -> Observation:
        """Return joints, TCP and gripper."""
        return self.robot.state().robot

    def truth(self) -> Truth:
        """Return the simulated state; raises a ForbiddenError where the sim keeps it to itself."""
        return self.robot.truth()

    def wait(self, seconds: float) -> None:
        """Let simulated time pass, the arm holding."""
        self.robot.step(seconds)

    def elapsed(self) -> tuple[float, int | None]:
        """Return simulated seconds and physics steps since the last reset."""
        state = self.robot.state()
        return state.robot.time, state.physics_steps

    def photograph(self, camera: str, format: Literal["png", "jpeg"] = "png") -> tuple[bytes, Picture]:
        """Return a camera's picture as a file's bytes, with what the sim says of it."""
        return self.robot.picture(camera, format=format)

    def recover(self) -> str:
        """End a fault of the sim's driver."""
        return str(self.robot.order("recover")["fault"])

    def _lay_out(self, seed: int) -> None:
        truth = self.robot.reset(seed)
        self.agent.begin_anew()
        self._start = truth if self._start is not None else None
        self.seed = seed

    def checkpoint(self) -> RemoteCheckpoint:
        """Return the world as it is; the sim keeps the last 64."""
        return RemoteCheckpoint(name=self.robot.checkpoint(), seed=self.seed, start=self._start)

    def restore(self, checkpoint: RemoteCheckpoint) -> None:
        """Go back to a checkpoint; the arm holds."""
        self.robot.reset(checkpoint=checkpoint.name)
        self.seed, self._start = checkpoint.seed, checkpoint.start

    def close(self) -> None:
        """Nothing to free: the connection is the client's."""

    def _pixels(self, camera: str) -> NDArray[Any]:
        import cv2

        # OpenCV's order of channels is blue, green, red.
        decoded = cv2.imdecode(np.frombuffer(self.picture(camera), np.uint8), cv2.IMREAD_COLOR)
        return np.asarray(decoded)[:, :, ::-1]
