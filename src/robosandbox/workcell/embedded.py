"""A workcell of this process: the driver is called, nothing is sent."""

from __future__ import annotations

import time
from collections import ChainMap
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np

from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.driver import SafeDriver, Simulated, require, robot_name, simulated
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import require_mujoco
from robosandbox.skills.manual import MANUAL
from robosandbox.skills.use_arm import UseArm
from robosandbox.tasks.evaluate import aside, evaluate, true_state
from robosandbox.tasks.layouts import Layouts
from robosandbox.tasks.task import Task
from robosandbox.types import Array, Checkpoint, Observation, Scene, Truth, Verdict
from robosandbox.values import frozen
from robosandbox.workcell.pictures import encode
from robosandbox.workcell.workcell import Workcell, nobody_judges
from robosandbox.workcell.zenoh.messages import Picture
from robosandbox.world.episode_cache import clear_episode_caches


@frozen(kw_only=True)
class OpenedTask:
    """A task in a world of this process, and an agent that acts there.

    Attributes:
        task: What is loaded.
        driver: Opened on the task's scene.
        agent: With a context made of that driver.
        layouts: The task's.
        seed: The layout that it was opened on.
    """

    task: Task
    driver: SafeDriver
    agent: Agent[AgentContext]
    layouts: Layouts
    seed: int


# Opens a task, by name, file or value, with a robot in place of its own; calls the last argument on the way.
OpenTask = Callable[[Task | Scene | Path | str, Path | str | None, Callable[[], None] | None], OpenedTask]


class EmbeddedWorkcell(Workcell[AgentContext]):
    """A robot at a task in this process.

    Args:
        opened: The task, the driver and the agent.
        open_task: Opens others.
        undoes: Whether a way back is kept from what moves something.

    Attributes:
        driver: What moves the robot.
    """

    def __init__(self, opened: OpenedTask, *, open_task: OpenTask, undoes: bool = False) -> None:
        super().__init__(opened.task, opened.agent, seed=opened.seed, undoes=undoes)
        self._open_task = open_task
        self._take(opened)

    def _take(self, opened: OpenedTask) -> None:
        moves = MANUAL if len(opened.driver.arms) == 1 else (*MANUAL, UseArm())
        opened.agent.calls = ChainMap(opened.agent.skills, {move.name: move for move in moves})
        self.driver: SafeDriver = opened.driver
        self._layouts = opened.layouts
        self._start_state: Array | None = None
        self._begin(opened.seed)

    @property
    def robot_name(self) -> str:
        """The robot's model."""
        return robot_name(self.driver)

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""
        return tuple(self.driver.capabilities.cameras)

    @property
    def simulation(self) -> Simulated:
        """The simulated world; raises UnsupportedError where there is none."""
        return simulated(self.driver, "its state is asked for")

    @property
    def mujoco(self) -> MuJoCoBackend:
        """The MuJoCo world, to be read; raises UnsupportedError where there is none."""
        return require_mujoco(self.driver, "its model is asked for")

    def state(self) -> Observation:
        """Return joints, TCP and gripper of each arm."""
        return self.driver.state()

    def truth(self) -> Truth:
        """Return the state to judge on.

        Raises:
            UnsupportedError: The driver knows no truth and has no referee.
        """
        look = true_state(self.driver)
        if look is None:
            raise nobody_judges()
        return look()

    def judge(self) -> Verdict:
        """Tell whether the task has succeeded; in a copy of the world where there is one, so that this one stays as it is.

        Raises:
            UnsupportedError: The driver knows no truth and has no referee.
        """
        copy = aside(self.driver)
        look = true_state(copy)
        if look is None:
            raise nobody_judges()
        return evaluate(self.task.success, self.start, look, copy.wait)

    def wait(self, seconds: float) -> None:
        """Let time pass, the arm holding."""
        self.driver.wait(seconds)

    def elapsed(self) -> tuple[float, int | None]:
        """Return the driver's seconds since the last reset, and physics steps, where it simulates."""
        world = self.driver.simulation
        return self.driver.time, None if world is None else world.physics_steps

    def photograph(self, camera: str, format: Literal["png", "jpeg"] = "png") -> tuple[bytes, Picture]:
        """Return a camera's picture as a file's bytes, with what there is to know of it."""
        frame = self.driver.senses.capture(camera)
        return encode(frame.rgb, format), Picture(
            camera=camera,
            boot_id="",
            stamp=time.time(),
            time=self.driver.time,
            intrinsics=frame.intrinsics,
            format=format,
            pose_camera_in_world=frame.pose_camera_in_world,
        )

    def recover(self) -> str:
        """End a fault of the driver."""
        fault = self.driver.fault
        self.driver.recover()
        return fault

    def _lay_out(self, seed: int) -> None:
        lay_out(self.driver, self._layouts, seed)
        self.agent.begin_anew()
        self._begin(seed)

    def load(
        self,
        task: Task | Scene | Path | str,
        robot: Path | str | None = None,
        *,
        wait_hook: Callable[[], None] | None = None,
        accept: Callable[[OpenedTask], None] = lambda opened: None,
    ) -> None:
        """Put another task in the place of this one.

        Args:
            task: As of `Workcell.load`.
            robot: Likewise.
            wait_hook: Called again and again on the way; what it raises ends that, and this task stays.
            accept: Raises where what was opened is not to be had.
        """
        require(self.driver, "reset", "loading another task does that")
        opened = self._open_task(task, robot, wait_hook)
        try:
            accept(opened)
        except BaseException:
            opened.driver.close()
            raise
        agent = self.agent
        self.close()
        opened.agent.take_over(agent)
        self._hold(opened.task, opened.agent, opened.seed)
        self._take(opened)

    def checkpoint(self) -> Checkpoint:
        """Return the world as it is."""
        world = simulated(self.driver, "a checkpoint is taken of it")
        assert self._start_state is not None
        return Checkpoint(
            seed=self.seed,
            scene=world.scene,
            start=tuple(self._start_state.tolist()),
            state=tuple(world.snapshot().tolist()),
            physics_steps=world.physics_steps,
        )

    def restore(self, checkpoint: Checkpoint) -> None:
        """Go back to a checkpoint of this task; the arm holds."""
        world = simulated(self.driver, "a checkpoint is put back into it")
        world.resume(checkpoint.scene, np.array(checkpoint.start), 0)
        self._begin(checkpoint.seed)
        world.resume(checkpoint.scene, np.array(checkpoint.state), checkpoint.physics_steps)
        self.driver.stop()

    def close(self) -> None:
        """Free the world."""
        super().close()
        self.driver.close()

    def _begin(self, seed: int) -> None:
        look = true_state(self.driver)
        self._start = None if look is None else look()
        world = self.driver.simulation
        self._start_state = None if world is None else world.snapshot()
        self.seed = seed


def lay_out(driver: SafeDriver, layouts: Layouts, seed: int) -> None:
    """Reset a simulation to a seed's layout.

    Raises:
        InputError: The seed is negative or has no layout.
        UnsupportedError: The driver does not start over.
    """
    world = simulated(driver, "a layout is laid out by it; open the session with the seed")
    clear_episode_caches()
    layouts.lay_out(seed, lambda scene, q: world.reset(scene, q=q))
