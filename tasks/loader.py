"""Tasks from YAML files: a path, or the name of one that is bundled."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from robosandbox.errors import InputError
from robosandbox.suggestions import did_you_mean_file
from robosandbox.tasks.bundled import ALL_SUITES, bundled_task, bundled_tasks as bundled_tasks
from robosandbox.tasks.judge.checks import AtHome
from robosandbox.tasks.named_files import BUILTIN, YCB, builtin_file, ycb_object
from robosandbox.tasks.task import Task
from robosandbox.types import Scene, SceneArm, SceneObject
from robosandbox.validation import did_you_mean, load_yaml_model

DEFAULT_TASK = "pick_from_three"
_MODEL_SUFFIXES = (".urdf", ".xml")


def load_task(path: Path | str) -> Task:
    """Return the task in a YAML file; paths in it are relative to the file.

    Raises:
        InputError: The file is missing or wrong, or names a file that is missing.
    """
    path = Path(path)
    task = load_yaml_model(path, Task)
    folder = path.absolute().parent
    objects = tuple(_with_mesh(item, index, folder, path.name) for index, item in enumerate(task.scene.objects))
    scene = task.scene.model_copy(update={"objects": objects, **_robot_files(task.scene, folder, path.name)})
    return task.model_copy(update={"scene": scene})


def find_task(name: str) -> Task:
    """Return a bundled task.

    Raises:
        InputError: None has this name, or its file is wrong.
    """
    task = load_task(bundled_task(name))
    if task.name != name:
        raise InputError(f"{name}.yaml: name: {task.name!r} is not the file's; call the file {task.name}.yaml")
    return task


def with_robot(scene: Scene, robot: Path | str) -> Scene:
    """Return a scene with another robot; what was said of the one before is left out."""
    said = {"robot_config": None, "robot_arm": None, "robot_gripper": None}
    return scene.model_copy(update={"robot_urdf": Path(robot), **said})


def resolve_task(task: Task | Scene | Path | str | None) -> Task:
    """Return the task that a value names.

    Raises:
        InputError: There is none of that name, or its file is wrong.
    """
    match task:
        case None:
            return find_task(DEFAULT_TASK)
        case Task():
            return task
        case Scene():
            return Task(
                name="scene" if task.world is None else _task_name(task.world),
                prompt="go home",
                scene=task,
                success=AtHome(kind="at_home"),
            )
        case Path():
            return load_task(task)
        case _:
            return load_task(task) if task.endswith((".yaml", ".yml")) else find_task(task)


def _task_name(world: Path) -> str:
    """Return a name for what is done in a scene's file."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", world.stem).strip("_.-")[:60] or "scene"


def tasks_of_suite(suite: str) -> list[Task]:
    """Return the bundled tasks that name a suite, or all of them for "all".

    Raises:
        InputError: No task names it.
    """
    tasks = [find_task(name) for name in bundled_tasks()]
    suites = sorted({task.suite for task in tasks})
    if suite not in (*suites, ALL_SUITES):
        raise InputError(
            f"no suite {suite[:60]!r}; there is {', '.join(suites)} and {ALL_SUITES}{did_you_mean(suite, suites)}"
        )
    return [task for task in tasks if suite in (task.suite, ALL_SUITES)]


def _robot_files(scene: Scene, folder: Path, source: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if scene.world is not None:
        found["world"] = _existing(scene.world, folder, f"{source}: scene.world")
    found |= _model_files(scene, folder, f"{source}: scene")
    if scene.robot_gripper is not None:
        found["robot_gripper"] = _existing(scene.robot_gripper, folder, f"{source}: scene.robot_gripper")
    if scene.arms:
        found["arms"] = tuple(
            arm.model_copy(update=_model_files(arm, folder, f"{source}: scene.arms[{index}]"))
            for index, arm in enumerate(scene.arms)
        )
    return found


def _model_files(named: Scene | SceneArm, folder: Path, field: str) -> dict[str, Path]:
    found: dict[str, Path] = {}
    robot, config = named.robot_urdf, named.robot_config
    # A name without a suffix is a bundled robot's, one with a colon comes from elsewhere.
    if robot is not None and str(robot).startswith(BUILTIN):
        found["robot_urdf"] = builtin_file(robot, f"{field}.robot_urdf")
    elif robot is not None and robot.suffix.lower() in _MODEL_SUFFIXES and ":" not in str(robot):
        found["robot_urdf"] = _existing(robot, folder, f"{field}.robot_urdf")
    if config is not None:
        bundled = str(config).startswith(BUILTIN)
        found["robot_config"] = (
            builtin_file(config, f"{field}.robot_config")
            if bundled
            else _existing(config, folder, f"{field}.robot_config")
        )
    return found


def _with_mesh(item: SceneObject, index: int, folder: Path, source: str) -> SceneObject:
    if item.mesh is None:
        return item
    field = f"{source}: scene.objects[{index}].mesh"
    if str(item.mesh).startswith(YCB):
        return ycb_object(item, field)
    mesh = _existing(item.mesh, folder, field)
    return item.model_copy(update={"mesh": mesh})


def _existing(path: Path, folder: Path, field: str) -> Path:
    full = folder / path.expanduser()
    if not full.is_file():
        hint = did_you_mean_file(full) or "; a relative path starts at the YAML file's folder"
        raise InputError(f"{field}: {str(path)!r} is not a file{hint}")
    return full
