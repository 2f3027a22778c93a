"""Options that open a workcell, as one value, the same for every command, the bench and `open_session`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosandbox.values import frozen

if TYPE_CHECKING:
    from robosandbox.tasks.task import Task
    from robosandbox.types import Scene


@frozen
class WorkcellOptions:
    """A robot with its world, and who plans there; options of plugins that are None count as not given.

    Attributes:
        task: A task, the name of a bundled one, a YAML file, or a bare scene (whose task is to be at home); a table with
            three cubes when left out.
        scene: Somebody's MJCF file in place of the task's scene; without a task, its prompt comes from the person.
        robot_base: Where the robot's base stands in that scene: x, y and z, metres, and the turn about z, radians; None takes its
            sidecar's, or a place from which most things are in reach.
        robot: A model file or a bundled robot's name, in place of the task's robot.
        sidecar: The robot's; the one beside its model, a shipped or an inferred one if left out.
        arm: Which arm, where a model has several: the rest of the sidecar is inferred; of a task with several arms, the one that
            calls are made with at first.
        gripper: A gripper's model to mount on an arm that has none: the sidecar is inferred.
        driver: Name of an installed driver, with options behind it: "hardware:latency=0.02". One that does not start over
            is opened on the seed's layout.
        driver_options: More of what it takes.
        planner: Name of an installed planner.
        planner_options: What it takes besides the skills, such as `model`.
        camera: The camera whose picture the planner is to see.
        dialogue: Whether a prompt may answer the question that came of the one before, correct it, or refer to it, and
            what it did can be undone.
        perception: Name of an installed perception.
        perception_options: What it takes besides.
        grasp: Name of an installed grasp planner.
        grasp_options: What it takes.
        motion: Name of an installed motion planner.
        motion_options: What it takes, such as `clearance`.
        tempo: How fast the arm goes: careful, brisk or fast.
        sensor: What its cameras are like: ideal, realsense, rough or webcam.
        seed: The layout; 0 is the task as written.
        max_replans: How often a failure may be answered with a new plan.
        what_if: Whether skills may try repairs on the twin, a simulation of what is believed.
        confirm: Whether each plan is tried on the twin before anything moves, shown, and confirmed, or refused where nobody can
            be asked; None where the driver's clock is the wall's.
        stop_switch: A file that stops the arms while it exists, or a device any button of which does, as `/dev/input/js0`.
        render_size: (height, width) of camera pictures, pixels.
    """

    task: Task | Scene | Path | str | None = None
    _: KW_ONLY
    scene: Path | str | None = None
    robot_base: tuple[float, float, float, float] | None = None
    robot: Path | str | None = None
    sidecar: Path | str | None = None
    arm: str | None = None
    gripper: Path | str | None = None
    driver: str = "mujoco"
    driver_options: Mapping[str, Any] | None = None
    planner: str = "stub"
    planner_options: Mapping[str, Any] | None = None
    camera: str | None = None
    dialogue: bool = True
    perception: str = "ground_truth"
    perception_options: Mapping[str, Any] | None = None
    grasp: str = "analytic"
    grasp_options: Mapping[str, Any] | None = None
    motion: str = "dls"
    motion_options: Mapping[str, Any] | None = None
    tempo: str = "fast"
    sensor: str = "ideal"
    seed: int = 0
    max_replans: int = 3
    what_if: bool = True
    confirm: bool | None = None
    stop_switch: Path | str | None = None
    render_size: tuple[int, int] = (240, 320)


# A table with three cubes, the bundled arm, perfect eyes, the offline planner.
USUAL = WorkcellOptions()
