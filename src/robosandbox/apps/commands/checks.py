"""Checks of a command's options, made before anything heavy is imported."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from robosandbox.errors import InputError
from robosandbox.plugins import check_plugin
from robosandbox.suggestions import did_you_mean, did_you_mean_file, no_file

_TASK_SUFFIXES = (".yaml", ".yml")


def known_task(task: str | None) -> str | None:
    """Return a bundled task's name or a YAML file; raises InputError where there is none."""
    if task is None:
        return None
    from robosandbox.tasks.bundled import bundled_task

    if not task.endswith(_TASK_SUFFIXES):
        bundled_task(task)
        return task
    path = Path(task)
    if not path.is_file():
        raise InputError(no_file(path))
    return task


def known(group: str) -> Callable[[str | None], str | None]:
    """Return a check that a name is installed under an entry point group."""

    def check(name: str | None) -> str | None:
        if name is not None:
            check_plugin(group, name)
        return name

    return check


def known_driver(text: str) -> str:
    """Return a driver's name with its options; raises InputError where there is none of that name."""
    name, colon, _ = text.partition(":")
    check_plugin("drivers", name)
    if colon:
        from robosandbox.driver import split_name

        split_name(text)
    return text


def known_tempo(tempo: str) -> str:
    """Return the name of a tempo; raises InputError where there is none."""
    # The usual one is there; looking for another takes NumPy.
    if tempo != "fast":
        from robosandbox.types import find_tempo

        find_tempo(tempo)
    return tempo


def known_sensor(sensor: str | None) -> str | None:
    """Return the name of a kind of sensor; raises InputError where there is none."""
    # The usual one is there; looking for another takes NumPy.
    if sensor not in (None, "ideal"):
        from robosandbox.sim.sensors import find_sensor

        find_sensor(sensor)
    return sensor


def known_robot(robot: str | None) -> str | None:
    """Return a model file, a bundled robot, or `menagerie:<name>`, which is looked up later.

    Raises:
        InputError: It is none of these.
    """
    if robot is not None:
        _check_robot(robot)
    return robot


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
            f"{did_you_mean(robot, bundled) or did_you_mean_file(Path(robot))}"
        )
