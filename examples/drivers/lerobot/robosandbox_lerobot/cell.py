"""A task's world with its arm's joints in LeRobot's numbers: what its robot, its teleoperator and its environment stand on."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from robosandbox.apps.envs.env import ManipulationEnv
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.tasks.loader import resolve_task, with_robot
from robosandbox.types import ObservedScene
from robosandbox.types.robot import GripperSpec, RobotSpec
from robosandbox_lerobot.channels import GRIPPER, Channel, positions

CELL_ID = "robosandbox_lerobot/Cell-v0"


class Numbers:
    """Joints of an arm, and how far its gripper is open, as LeRobot's numbers: degrees, and 0 closed to 100 open.

    Args:
        spec: The arm, with its gripper.

    Attributes:
        keys: Names of the numbers, as `shoulder_pan.pos`, the gripper's last.
    """

    def __init__(self, spec: RobotSpec) -> None:
        self._spec, self._gripper = spec, spec.gripper
        ends = _ends(spec.gripper)
        names = [*spec.joints, *([GRIPPER] if ends else [])]
        limits = [*zip(spec.lower.tolist(), spec.upper.tolist(), strict=True)]
        self._channels: list[Channel] = positions(names, limits, ends, "degrees")
        self.keys = tuple(channel.key for channel in self._channels)

    def told(self, q: Sequence[float], closed: float | None) -> NDArray[np.float32]:
        """Return the numbers of joints (n,), rad, and of how far the gripper is closed, 0 to 1."""
        values = [*q]
        if self._gripper is not None and closed is not None:
            geometry = self._gripper.geometry
            values.append(geometry.open_joint + closed * (geometry.closed_joint - geometry.open_joint))
        return np.array(
            [channel.number(value) for channel, value in zip(self._channels, values, strict=True)], dtype=np.float32
        )

    def meant(self, numbers: Sequence[float]) -> tuple[NDArray[np.float64], float]:
        """Return the joints (n,), rad, and how far the gripper is to be closed, 0 where there is none."""
        values = np.array(
            [channel.value(float(number)) for channel, number in zip(self._channels, numbers, strict=True)]
        )
        if self._gripper is None:
            return values, 0.0
        return values[:-1], float(np.clip(self._gripper.geometry.closed_fraction(values[-1]), 0.0, 1.0))


class Cell(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A task as a Gymnasium environment whose actions and `agent_pos` are LeRobot's numbers, pictures in a dict by camera.

    Args:
        task: A bundled task's name, or a file.
        robot: A model file or a bundled robot's name, in place of the task's.
        cameras: Whose pictures are observed.
        fps: Actions a second, up to the control rate.
        height: Of pictures, pixels.
        width: Likewise.
        render_mode: As of `ManipulationEnv`.
    """

    def __init__(
        self,
        task: str,
        *,
        robot: str | None = None,
        cameras: Sequence[str] = ("scene",),
        fps: int = 30,
        height: int = 120,
        width: int = 160,
        render_mode: str | None = None,
    ) -> None:
        self.inner = ManipulationEnv(
            task,
            robot=robot,
            observation="pixels" if cameras else "state",
            action="joint",
            control_hz=fps,
            cameras=cameras,
            render_mode=render_mode,
            render_size=(height, width),
        )
        super().__init__(self.inner)
        self._cameras = tuple(cameras)
        self.numbers = Numbers(self.inner.session.ctx.arm.spec)
        known = self.inner.observation_space
        assert isinstance(known, spaces.Dict)
        count = len(self.numbers.keys)
        found = dict(known.spaces)
        found["agent_pos"] = spaces.Box(-np.inf, np.inf, (count,), np.float32)
        if self._cameras:
            picture = spaces.Box(0, 255, (height, width, 3), np.uint8)
            found["pixels"] = spaces.Dict(dict.fromkeys(self._cameras, picture))
        self.observation_space = spaces.Dict(found)
        self.action_space = spaces.Box(-np.inf, np.inf, (count,), np.float32)

    @property
    def task_description(self) -> str:
        """Prompt of the task."""
        return self.inner.task_description

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start over, as `ManipulationEnv` does."""
        seen, info = self.inner.reset(seed=seed, options=options)
        return self._said(seen), info

    def commanded(self) -> NDArray[np.float32]:
        """Return the numbers of where the arm was sent last: as far as its limits let it on the way to where an action has it."""
        q, closed = self.inner.controller.commanded
        return self.numbers.told(q.tolist(), closed)

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Send the joints on to where an action has them, as far as they get within their limits in a period."""
        q, closed = self.numbers.meant(action)
        seen, reward, ended, cut, info = self.inner.step(self.inner.controller.joint_action(q, closed))
        return self._said(seen), reward, ended, cut, info

    def _said(self, seen: dict[str, Any]) -> dict[str, Any]:
        said = dict(seen)
        joints = [float(value) for value in seen["agent_pos"]]
        grips = self.inner.session.ctx.arm.spec.gripper is not None
        said["agent_pos"] = self.numbers.told(joints[:-1] if grips else joints, joints[-1] if grips else None)
        if len(self._cameras) == 1:
            said["pixels"] = {self._cameras[0]: seen["pixels"]}
        return said


@lru_cache(maxsize=16)
def arm_of(task: str, robot: str | None) -> RobotSpec:
    """Return the arm of a task, without opening its world."""
    scene = resolve_task(task).scene if robot is None else with_robot(resolve_task(task).scene, Path(robot))
    nothing = ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
    return PlanningScenes(scene).of(nothing).robot.spec


def _ends(gripper: GripperSpec | None) -> tuple[float, float] | None:
    return None if gripper is None else (gripper.geometry.open_joint, gripper.geometry.closed_joint)


if CELL_ID not in gymnasium.registry:
    gymnasium.register(id=CELL_ID, entry_point="robosandbox_lerobot.cell:Cell")
