"""A task as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from robosandbox.apps.envs.control import ActionKind, Controller
from robosandbox.apps.envs.progress import potential
from robosandbox.errors import InputError, SkillError
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import require_mujoco
from robosandbox.tasks.evaluate import longest_hold
from robosandbox.tasks.task import Task
from robosandbox.types import Array
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

ObservationKind = Literal["state", "pixels"]
RewardKind = Literal["sparse", "dense"]
Observation = dict[str, Any]
# Number of layouts that an environment's own seed draws from; chosen as the largest signed 32-bit number.
_LAYOUTS = 2**31 - 1
# Number of layouts that are tried; chosen because none of 200 seeds of the bundled tasks was refused (docs/bench.md):
# twenty in a row are the task's fault.
_DRAWS = 20
# Number of values of a pose as of `Pose`: x, y, z, quaternion x, y, z, w.
_POSE = 7


class ManipulationEnv(gymnasium.Env[Observation, Array]):
    """A task that a policy is to fulfil, judged on the simulated state as by the bench.

    Observations are flat dicts under the names that LeRobot's environments use; Stable-Baselines3 takes them as they are.
    Both kinds have `agent_pos`, the arm's joints and, with a gripper, how far it is closed (0 to 1), shape (n,) or (n + 1,);
    `agent_vel` (n,), the joints' rates; and `tcp_pose` (7,) as x, y, z, quaternion x, y, z, w in the world. `state` adds
    `environment_state` (7 k,): such a pose of each object in the order of the task's scene, zeros for one that this layout
    leaves out. `pixels` adds `pixels`, an RGB picture (height, width, 3) uint8; with more than one camera a dict of them by
    camera, which LeRobot takes and Stable-Baselines3 does not. `task_description` is the sentence.

    With `reward="sparse"` it is 1 in the step in which the task succeeds, which ends the episode, and 0 before.
    `info["is_success"]` says the same; what has to hold for a while has held by then. `reward="dense"` adds by how much
    the step brought the world closer to success, in metres: `robosandbox.apps.envs.progress.potential`. The step in which a
    limit of robot or task is passed, as by pressing on the table, ends the episode and costs `penalty`.

    `reset(seed=s)` is the layout that the bench calls seed `s`, without a seed one is drawn;
    `reset(options={"layout": 0})` is the scene as written.

    Args:
        task: A bundled task's name, a YAML file, a task, or an open session, which stays the caller's.
        robot: A model file or a bundled robot's name, in place of the task's robot.
        arm: The arm that acts and whose joints are observed, of a task with several; the others hold still.
        driver: An installed driver of a simulated world, with its options behind its name.
        observation: `state` or `pixels`.
        action: `ee`: translation (3) and rotation (3) of the TCP in world axes, 1 being 0.4 m/s and 2 rad/s; `joint`:
            where each joint is to be, -1 and 1 its limits. The gripper comes last, -1 open and 1 closed.
        control_hz: Actions per simulated second, up to the control rate; each begins at the control tick nearest to its time.
        cameras: Those of `pixels`.
        reward: `sparse` or `dense`.
        penalty: What passing a limit of robot or task costs, 0 or more; 1 is as much as success earns.
        render_mode: `rgb_array`, or None.
        render_size: (height, width) of pictures.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012 - Gymnasium's own form

    def __init__(
        self,
        task: EmbeddedWorkcell | Task | Path | str,
        *,
        robot: Path | str | None = None,
        arm: str | None = None,
        driver: str = "mujoco",
        observation: ObservationKind = "state",
        action: ActionKind = "ee",
        control_hz: float = 20.0,
        cameras: Sequence[str] = ("scene",),
        reward: RewardKind = "sparse",
        penalty: float = 1.0,
        render_mode: str | None = None,
        render_size: tuple[int, int] = (240, 320),
    ) -> None:
        for name, value, known in (
            ("observation", observation, ("state", "pixels")),
            ("action", action, ("ee", "joint")),
            ("reward", reward, ("sparse", "dense")),
        ):
            if value not in known:
                raise InputError(f"{name}: {value!r} is not one of {', '.join(known)}")
        if not 0.0 <= penalty < np.inf:
            raise InputError(f"penalty: {penalty:g}; give 0 or more: it is taken from the reward")
        self._penalty = float(penalty)
        self._owned = not isinstance(task, EmbeddedWorkcell)
        self.session: EmbeddedWorkcell = (
            task
            if isinstance(task, EmbeddedWorkcell)
            else open_session(task, robot=robot, arm=arm, driver=driver, render_size=render_size)
        )
        if not self._owned and arm is not None:
            self.session.ctx.work_with(arm)
        self._world: MuJoCoBackend = require_mujoco(
            self.session.driver, "an environment starts it over and judges its state"
        )
        world = self._world
        self._arm = self.session.ctx.arm.name
        self.render_mode = render_mode
        self._cameras = tuple(cameras) if observation == "pixels" else ()
        if observation == "pixels" and not self._cameras:
            raise InputError(f"cameras: pixels need one; the world has {', '.join(world.cameras)}")
        for camera in self._cameras:
            world.camera_in_model(camera)
        self._controller = Controller(self.session.driver, world, action, control_hz, self._arm)
        self._begun = False
        self._held_since: float | None = None
        self._dense = reward == "dense"
        self._potential = 0.0
        self.action_space: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (self._controller.size,), np.float32)
        named = tuple(item.id for item in self.session.task.scene.objects)
        self._objects = named if observation == "state" else ()
        self.observation_space = self._space()

    @property
    def task_description(self) -> str:
        """Prompt of the task, a sentence."""
        return self.session.task.prompt

    @property
    def controller(self) -> Controller:
        """Controller that carries out actions."""
        return self._controller

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start over; `options["layout"]` is the bench's seed.

        Raises:
            InputError: There is no such layout.
        """
        super().reset(seed=seed)
        if not isinstance(options, Mapping | None):
            raise InputError(f"options: {options!r} is no dict; give {{'layout': 0}}")
        layout = (options or {}).get("layout", seed)
        if layout is not None:
            self.session.reset(layout)
        else:
            self._draw()
        self._controller.reset()
        self._begun = True
        self._held_since = None
        self._potential = self._closeness() if self._dense else 0.0
        return self._observe(), self._info(False)

    def step(self, action: Array) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Carry out one action.

        Returns:
            Observation, reward, whether the episode has ended, False (a wrapper ends it for its length), and info with
            `is_success`, `layout` and, where a limit of robot or task ended the episode, `stopped`.

        Raises:
            InputError: The action has another shape, or is not finite.
            ResetNeeded: No episode has begun.
        """
        if not self._begun:
            raise ResetNeeded("step: no episode has begun; call reset() first")
        stopped = ""
        try:
            self._controller.apply(action)
        except SkillError as error:
            stopped = error.message
        success = self._succeeded()
        info = self._info(success) | ({"stopped": stopped} if stopped else {})
        reward = self._reward(success) - (self._penalty if stopped else 0.0)
        return self._observe(), reward, success or bool(stopped), False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return the scene camera's picture, RGB (height, width, 3) uint8; None without a render mode."""
        if self.render_mode is None:
            return None
        return self._world.state(("scene",)).images["scene"]

    def close(self) -> None:
        """Free the world."""
        if self._owned:
            self.session.close()

    def _draw(self) -> None:
        for attempt in range(_DRAWS):
            try:
                self.session.reset(int(self.np_random.integers(1, _LAYOUTS)))
                return
            except InputError:
                # A layout in which things do not fit; the next one is as good.
                if attempt == _DRAWS - 1:
                    raise

    def _succeeded(self) -> bool:
        """Return whether the task's criterion holds and has held for as long as it asks."""
        criterion, now = self.session.task.success, self._world.truth()
        if not criterion.evaluate(self.session.start, now).holds:
            self._held_since = None
            return False
        if self._held_since is None:
            self._held_since = now.time
        return now.time - self._held_since >= longest_hold(criterion) - 1e-9

    def _reward(self, success: bool) -> float:
        if not self._dense:
            return float(success)
        before, self._potential = self._potential, self._closeness()
        return float(success) + self._potential - before

    def _closeness(self) -> float:
        world = self._world
        return potential(
            self.session.task.success, self.session.start, world.truth(), world.arm_state(self._arm).tcp_pose.position
        )

    def _info(self, success: bool) -> dict[str, Any]:
        return {"is_success": success, "layout": self.session.seed, "task_description": self.task_description}

    def _observe(self) -> Observation:
        seen, images = self._world.arm_state(self._arm), self._world.state(self._cameras).images
        closed = [] if seen.gripper is None else [seen.gripper.closed]
        found: Observation = {
            "agent_pos": np.array([*seen.q, *closed], dtype=np.float32),
            "agent_vel": seen.qd.astype(np.float32),
            "tcp_pose": np.array([*seen.tcp_pose.xyz, *seen.tcp_pose.quat_xyzw], dtype=np.float32),
        }
        if self._objects:
            there = self._world.truth(for_judging=False).objects
            poses = [there[item].pose if item in there else None for item in self._objects]
            rows = [[*pose.xyz, *pose.quat_xyzw] if pose else [0.0] * _POSE for pose in poses]
            found["environment_state"] = np.array(rows, dtype=np.float32).ravel()
        if self._cameras:
            pictures = {name: images[name] for name in self._cameras}
            found["pixels"] = pictures if len(pictures) > 1 else pictures[self._cameras[0]]
        return found

    def _space(self) -> spaces.Dict:
        robot = self._world.robots[self._arm]
        count, grips = robot.n, robot.gripper is not None
        lengths = {"agent_pos": count + grips, "agent_vel": count, "tcp_pose": _POSE}
        if self._objects:
            lengths["environment_state"] = _POSE * len(self._objects)
        found: dict[str, spaces.Space[Any]] = {
            name: spaces.Box(-np.inf, np.inf, (length,), np.float32) for name, length in lengths.items()
        }
        if self._cameras:
            picture = spaces.Box(0, 255, (*self._world.render_size, 3), np.uint8)
            several = len(self._cameras) > 1
            found["pixels"] = spaces.Dict(dict.fromkeys(self._cameras, picture)) if several else picture
        return spaces.Dict(found)
