"""LeRobot's robot `robosandbox`, and by the same import its teleoperator and its environment.

LeRobot imports a module for each distribution whose name begins with `lerobot_robot_` and the like; this project is one
distribution, and so one module brings all three.
"""

# isort: skip_file
from lerobot_robot_robosandbox.config_robosandbox import RobosandboxConfig
from lerobot_robot_robosandbox.robosandbox import Robosandbox
import lerobot_env_robosandbox  # noqa: F401
import lerobot_teleoperator_robosandbox  # noqa: F401

__all__ = ["Robosandbox", "RobosandboxConfig"]
