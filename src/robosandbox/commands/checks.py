"""What can be wrong with a command's options, told before anything heavy is imported."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from robosandbox.errors import InputError
from robosandbox.plugins import check_plugin
from robosandbox.suggestions import did_you_mean

_TASK_SUFFIXES = (".yaml", ".yml")


def check_names(
    task: str | None = None,
    robot: Path | str | None = None,
    *,
    planner: str | None = None,
    perception: str | None = None,
) -> None:
    """Find out whether what a command names is there.

    Args:
        task: A bundled task or a YAML file.
        robot: A model file, a bundled robot, or `menagerie:<name>`, which is looked up later.
        planner: The name of an installed one.
        perception: Likewise.

    Raises:
        InputError: It is not; the message names the option, the value and what there is.
    """
    if planner is not None:
        check_plugin("planners", planner)
    if perception is not None:
        check_plugin("perceptions", perception)
    if task is not None:
        _check_task(task)
    if robot is not None:
        _check_robot(str(robot))


def _check_task(task: str) -> None:
    from robosandbox.tasks.bundled import bundled_task

    if not task.endswith(_TASK_SUFFIXES):
        bundled_task(task)
        return
    path = Path(task)
    if not path.is_file():
        there = [item.name for item in path.parent.glob("*.y*ml")] if path.parent.is_dir() else []
        raise InputError(f"{path}: no such file{did_you_mean(path.name, there)}")


def _check_robot(robot: str) -> None:
    # The package itself imports MuJoCo.
    package = find_spec("robosandbox.robots")
    folders = package.submodule_search_locations if package else None
    bundled = {path.parent.name for folder in folders or () for path in Path(folder).glob("*/*.xml")}
    if robot in bundled or robot.startswith("menagerie:"):
        return
    try:
        is_file = Path(robot).is_file()
    except (OSError, ValueError):
        is_file = False
    if not is_file:
        raise InputError(
            f"robot_urdf: {robot!r} is neither a file nor a bundled robot ({', '.join(sorted(bundled))})"
            f"{did_you_mean(robot, bundled)}"
        )
