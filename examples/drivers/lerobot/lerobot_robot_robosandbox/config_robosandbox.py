"""Configuration of LeRobot's robot `robosandbox`."""

from __future__ import annotations

from dataclasses import dataclass, field

from lerobot.robots import RobotConfig


@RobotConfig.register_subclass("robosandbox")
@dataclass(kw_only=True)
class RobosandboxConfig(RobotConfig):
    """A simulated arm at a task.

    Attributes:
        task: A bundled task's name, or a file.
        robot: A model file or a bundled robot's name, in place of the task's.
        seed: The layout that it begins with.
        fps: Actions a second, as of LeRobot's command.
        views: Cameras whose pictures are observed.
        height: Of pictures, pixels.
        width: Likewise.
    """

    task: str = "pick_cube_franka"
    robot: str | None = None
    seed: int = 0
    fps: int = 30
    views: list[str] = field(default_factory=lambda: ["scene"])
    height: int = 120
    width: int = 160
