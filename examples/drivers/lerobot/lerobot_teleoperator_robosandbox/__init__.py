"""LeRobot's teleoperator `robosandbox_skills`."""

from lerobot_teleoperator_robosandbox.config_robosandbox_skills import RobosandboxSkillsConfig
from lerobot_teleoperator_robosandbox.robosandbox_skills import RobosandboxSkills

__all__ = ["RobosandboxSkills", "RobosandboxSkillsConfig"]
