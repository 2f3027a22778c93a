"""Diagnosis of a robot's own sidecar without simulation, as the end of an error message."""

from __future__ import annotations

import re
import shlex
from functools import lru_cache
from pathlib import Path
from typing import Any

from robosandbox.errors import InputError
from robosandbox.robots.check.compare import compare
from robosandbox.robots.findings import CheckResult
from robosandbox.robots.importers.imported import ImportedModel
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.importers.mount import mount
from robosandbox.robots.infer.sidecar import Inference, infer_imported
from robosandbox.robots.locate import attached_model, find_sidecar, is_bundled, resolve_robot
from robosandbox.robots.sidecar import ArmRoles, BasePose, EeSite, GripperRoles, Sidecar, SuctionRoles
from robosandbox.types import TABLE_HEIGHT, Scene
from robosandbox.types.robot import RobotFiles
from robosandbox.validation import load_yaml_model, parse_yaml, read_text

# The names of a sidecar's parts are words that files are called as well: "arm.xml" is no field.
_PARTS = {
    "arm": (ArmRoles,),
    "gripper": (GripperRoles, SuctionRoles),
    "ee_site": (EeSite,),
    "base_pose": (BasePose,),
}
_FIELD = re.compile(
    "|".join(
        rf"\b{part}\.(?:{'|'.join(dict.fromkeys(name for role in roles for name in role.model_fields))})\b"
        r"(?:\.[a-z_]+|\[\d+\])*"
        for part, roles in _PARTS.items()
    )
)
_JOINTS, _SKIPS = "arm.joints", "shorter than the lists beside it, so it skips a joint"
_STEP = re.compile(r"[a-z_]+|\[\d+\]")


def own_files(scene: Scene) -> RobotFiles | None:
    """Return the model and the sidecar that a scene names; None where the sidecar is bundled or there is none."""
    if scene.robot_arm is not None or scene.robot_gripper is not None:
        return None
    try:
        model = resolve_robot(scene.robot_urdf).resolve()
        sidecar = find_sidecar(model, scene.robot_config)
    except InputError:
        return None
    if sidecar is None or is_bundled(sidecar):
        return None
    return RobotFiles(model=model, sidecar=sidecar, table_height=scene.table_height)


def examine(
    imported: ImportedModel,
    given: Sidecar,
    sidecar: Path,
    package_paths: tuple[Path, ...] = (),
    *,
    table_height: float = TABLE_HEIGHT,
) -> tuple[Inference, list[CheckResult]]:
    """Return what the model itself shows of the arm that a sidecar is about, and the sidecar's checks against that.

    Args:
        imported: The model; the sidecar's gripper is mounted on it.
        given: The sidecar.
        sidecar: Its file, to which a gripper's model is relative.
        package_paths: Where package:// names are looked up.
        table_height: Of the table that it works on, metres.

    Raises:
        InputError: The model has no such arm, or the gripper cannot be mounted.
    """
    if given.gripper is not None and given.gripper.attach is not None:
        mount(imported, given.gripper.attach, attached_model(sidecar, given.gripper.attach), package_paths)
    names = {item.name for item in imported.spec.joints}
    anchor = next((name for name in reversed(given.arm.joints) if name in names), None)
    try:
        found = infer_imported(imported, arm=anchor, listed=given.arm.joints, table_height=table_height)
    except InputError:
        found = infer_imported(imported, listed=given.arm.joints, table_height=table_height)
    return found, compare(found, given, table_height=table_height)


def refuse_unsound(found: Inference) -> None:
    """Refuse what was inferred of a model where checking it would, for the same cause.

    Raises:
        InputError: The first check that it fails, and what was found there.
    """
    fault = next((item for item in compare(found, found.sidecar) if not item.ok and item.counts), None)
    if fault is not None:
        raise InputError(
            f"{found.model.path.name}: no usable sidecar can be inferred: {fault.name}: {fault.detail}; write one by hand, or "
            "name another arm (--arm)"
        )


def static_checks(files: RobotFiles) -> tuple[CheckResult, ...]:
    """Return the checks of a sidecar that need no simulation; made once as long as the files stay the same."""
    return _static_checks(files, files.model.stat().st_mtime_ns, files.sidecar.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _static_checks(files: RobotFiles, model_stamp: int, sidecar_stamp: int) -> tuple[CheckResult, ...]:
    del model_stamp, sidecar_stamp  # part of the cache key: edited files are read again
    try:
        given = load_yaml_model(files.sidecar, Sidecar)
        imported = import_model(files.model, files.package_paths)
        height = files.table_height
        return tuple(examine(imported, given, files.sidecar, files.package_paths, table_height=height)[1])
    except InputError as error:
        field = blamed_field(files.sidecar, str(error))
        return (CheckResult("load", False, _SKIPS if field == _JOINTS else str(error), field),)


def blamed_field(sidecar: Path | None, message: str) -> str | None:
    """Return the sidecar field that a loader's error is about; None where it names none."""
    # Two lists of one length and a shorter joint list: a joint was skipped, not the rest made up.
    arm = _at(_raw(sidecar), "arm")
    counts = {
        key: len(values) for key in ("joints", "actuators", "home_qpos") if isinstance(values := _at(arm, key), list)
    }
    if counts.get("joints", 99) < max(counts.values(), default=0):
        return _JOINTS
    found = _FIELD.search(message)
    return found.group(0) if found else None


def advice(files: RobotFiles, message: str, *, doubtful: bool = False) -> str:
    """Return what static checks find wrong with a sidecar, to be put behind the message of a failure.

    Args:
        files: The robot's model and sidecar.
        message: Of the failure; what it says already is not said again.
        doubtful: Whether to name a field as well that may do and is the first to be doubted after such a failure.

    Returns:
        "; FIELD is VALUE: what is wrong with it; COMMAND shows more", or nothing where the checks find nothing.
    """
    try:
        checks = static_checks(files)
    except OSError:
        return ""
    wrong = next((item for item in checks if item.field and item.counts and not item.ok), None)
    found = wrong or (next((item for item in checks if item.field), None) if doubtful else None)
    if found is None or found.field is None:
        return ""
    value = _value(files.sidecar, found.field)
    told = found.detail in message or f"{found.field}:" in message
    why = "" if told else f": {found.detail}"
    return (
        f"; {files.sidecar.name}: {found.field}{f' is {value}' if value else ''}{why}; `{_command(files)}` shows more"
    )


def _command(files: RobotFiles) -> str:
    words = ["robo-sandbox", "robot", "check", _short(files.model)]
    if find_sidecar(files.model, None) != files.sidecar:
        words += ["--sidecar", _short(files.sidecar)]
    return shlex.join(words)


def _short(path: Path) -> str:
    """Return a path as it can be typed in the working directory."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


def _value(sidecar: Path, field: str) -> str:
    """Return a field's value as the sidecar has it; nothing for one that it leaves out or that has fields of its own."""
    value = _raw(sidecar)
    for step in _STEP.findall(field):
        value = _at(value, int(step[1:-1]) if step.startswith("[") else step)
    if isinstance(value, list):
        return f"[{', '.join(map(_plain, value))}]"
    return "" if value is None or isinstance(value, dict) else _plain(value)


def _raw(sidecar: Path | None) -> Any:
    try:
        return None if sidecar is None else parse_yaml(read_text(sidecar), sidecar.name)
    except InputError:
        return None


def _at(data: Any, step: str | int) -> Any:
    try:
        return data[step]
    except (TypeError, KeyError, IndexError):
        return None


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)
