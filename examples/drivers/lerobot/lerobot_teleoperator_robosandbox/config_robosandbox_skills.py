"""Configuration of LeRobot's teleoperator `robosandbox_skills`."""

from __future__ import annotations

from dataclasses import dataclass

from lerobot.teleoperators import TeleoperatorConfig


@TeleoperatorConfig.register_subclass("robosandbox_skills")
@dataclass(kw_only=True)
class RobosandboxSkillsConfig(TeleoperatorConfig):
    """A sentence, carried out by the skills in a twin of a robot's world.

    Attributes:
        robot_id: The `id` of the robot `robosandbox` whose world it is.
        sentence: Which; the task's own if left out.
        episode_time_s: That of `lerobot-record`: after it, and half of `reset_time_s`, the world starts over with the next seed.
            None where nothing starts over, as with `lerobot-teleoperate`.
        reset_time_s: That of `lerobot-record`.
    """

    robot_id: str | None = None
    sentence: str | None = None
    episode_time_s: float | None = None
    reset_time_s: float = 1.0
