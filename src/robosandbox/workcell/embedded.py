"""A workcell of this process: the driver is called, nothing is sent."""

from __future__ import annotations

from collections import ChainMap

import numpy as np

from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.driver import Driver, Simulated, robot_name, simulated
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import require_mujoco
from robosandbox.skills.manual import MANUAL
from robosandbox.tasks.evaluate import aside, evaluate, true_state
from robosandbox.tasks.layouts import Layouts
from robosandbox.tasks.task import Task
from robosandbox.types import Array, Checkpoint, Observation, Truth, Verdict
from robosandbox.workcell.workcell import Workcell, nobody_judges
from robosandbox.world.episode_cache import clear_episode_caches


class EmbeddedWorkcell(Workcell[AgentContext]):
    """A robot at a task in this process.

    Args:
        task: What is loaded.
        driver: Opened on the task's scene.
        agent: With a context made of that driver.
        layouts: The task's.
        seed: The layout that it was opened on.
        undoes: Whether a way back is kept from what moves something.

    Attributes:
        driver: What moves the robot.
    """

    def __init__(
        self,
        task: Task,
        driver: Driver,
        agent: Agent[AgentContext],
        *,
        layouts: Layouts,
        seed: int,
        undoes: bool = False,
    ) -> None:
        super().__init__(task, agent, seed=seed, undoes=undoes)
        agent.calls = ChainMap(agent.skills, {move.name: move for move in MANUAL})
        self.driver = driver
        self._layouts = layouts
        self._start_state: Array | None = None
        self._begin(seed)

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

    def picture(self, camera: str, format: str = "png") -> bytes:
        """Return a camera's picture as a file's bytes."""
        from robosandbox.workcell.zenoh.server.pictures import encode

        return encode(self.driver.state((camera,)).images[camera], "jpeg" if format == "jpeg" else "png")

    def reset(self, seed: int = 0) -> None:
        """Start over with this seed's layout."""
        world = simulated(self.driver, "a layout is laid out by it; open the session with the seed")
        clear_episode_caches()
        self._layouts.lay_out(seed, lambda scene, q: world.reset(scene, q=q))
        self.agent.begin_anew()
        self._begin(seed)

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
