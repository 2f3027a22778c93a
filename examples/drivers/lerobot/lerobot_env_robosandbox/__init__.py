"""LeRobot's environment `robosandbox`: a task's world, in the numbers of its robot `robosandbox`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE
from robosandbox_lerobot.cell import CELL_ID, Numbers, arm_of


@EnvConfig.register_subclass("robosandbox")
@dataclass
class RobosandboxEnv(EnvConfig):
    """A task, judged on its simulated state.

    Attributes:
        task: A bundled task's name, or a file.
        robot: A model file or a bundled robot's name, in place of the task's.
        fps: Actions a second, up to the control rate.
        cameras: Whose pictures are observed.
        height: Of pictures, pixels.
        width: Likewise.
        episode_length: Most actions of an episode.
    """

    task: str | None = "pick_cube_franka"
    robot: str | None = None
    fps: int = 30
    cameras: list[str] = field(default_factory=lambda: ["scene"])
    height: int = 120
    width: int = 160
    episode_length: int = 300

    def __post_init__(self) -> None:
        assert self.task is not None
        count = len(Numbers(arm_of(self.task, self.robot)).keys)
        self.features = {
            ACTION: PolicyFeature(type=FeatureType.ACTION, shape=(count,)),
            "agent_pos": PolicyFeature(type=FeatureType.STATE, shape=(count,)),
        }
        self.features_map = {ACTION: ACTION, "agent_pos": OBS_STATE, "environment_state": OBS_ENV_STATE}
        for camera in self.cameras:
            key = f"pixels/{camera}"
            self.features[key] = PolicyFeature(type=FeatureType.VISUAL, shape=(self.height, self.width, 3))
            self.features_map[key] = f"{OBS_IMAGES}.{camera}"

    @property
    def package_name(self) -> str:
        """Module that registers the environment."""
        return "robosandbox_lerobot.cell"

    @property
    def gym_id(self) -> str:
        """Id in Gymnasium's registry."""
        return CELL_ID

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Arguments of `Cell`."""
        return {
            "task": self.task,
            "robot": self.robot,
            "fps": self.fps,
            "cameras": tuple(self.cameras),
            "height": self.height,
            "width": self.width,
            "render_mode": "rgb_array",
            "max_episode_steps": self.episode_length,
        }
