"""From what a scene calls its robot to a model file and a sidecar."""

from __future__ import annotations

import logging
import os
from importlib import resources
from pathlib import Path

from robosandbox.errors import InputError
from robosandbox.extras import install_command
from robosandbox.robots.importers.files import is_file
from robosandbox.robots.importers.imported import ImportedModel
from robosandbox.robots.sidecar import GripperAttachment, Sidecar
from robosandbox.suggestions import did_you_mean_file
from robosandbox.validation import did_you_mean, load_yaml_model

DEFAULT_ROBOT = "franka_panda"
MENAGERIE = "menagerie:"
SIDECAR_SUFFIX = ".robosandbox.yaml"


def resolve_robot(robot_urdf: Path | None) -> Path:
    """Return the model file that a scene's `robot_urdf` names.

    Args:
        robot_urdf: A path, a bundled robot's name, or `menagerie:<name>[/<entry>]`; None is the bundled Panda.

    Raises:
        InputError: There is no such file or robot.
    """
    bundled = {path.parent.name: path for path in _folder().glob("*/*.xml")}
    if robot_urdf is None:
        return bundled[DEFAULT_ROBOT]
    name = str(robot_urdf)
    if name in bundled:
        return bundled[name]
    if name.startswith(MENAGERIE):
        return _from_menagerie(name.removeprefix(MENAGERIE))
    if not is_file(robot_urdf):
        hint = did_you_mean(name, bundled) or did_you_mean_file(robot_urdf)
        raise InputError(
            f"robot_urdf: {name!r} is neither a file nor a bundled robot ({', '.join(sorted(bundled))}){hint}"
        )
    return robot_urdf


def _folder() -> Path:
    return Path(str(resources.files("robosandbox.robots")))


def _from_menagerie(name: str) -> Path:
    """Return a model of MuJoCo Menagerie, downloaded on first use by its own package."""
    robot, _, entry = name.partition("/")
    if not robot or ".." in Path(name).parts:
        raise InputError(f"robot_urdf: 'menagerie:{name}' names no robot; write menagerie:<name>[/<entry>]")
    local = os.environ.get("MENAGERIE_ROOT")
    if local is not None:
        return _in_tree(Path(local), robot, entry)
    try:
        import mujoco_menagerie  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError(
            f"robot_urdf: 'menagerie:{name}' needs the package 'mujoco_menagerie'; install it with "
            f"`{install_command('menagerie')}`, or set MENAGERIE_ROOT to a copy of MuJoCo Menagerie"
        ) from None
    there = list(mujoco_menagerie.names())
    if robot not in there:
        raise InputError(f"robot_urdf: 'menagerie:{robot}' is not in MuJoCo Menagerie{did_you_mean(robot, there)}")
    found = mujoco_menagerie.get(robot)
    try:
        return Path(found.xml(entry or found.default_model))
    except Exception as error:  # a download fails in as many ways as networks do
        raise InputError(f"robot_urdf: 'menagerie:{name}': {' '.join(str(error).split())}") from None


def _in_tree(root: Path, robot: str, entry: str) -> Path:
    folder = root / robot
    if not folder.is_dir():
        there = [item.name for item in root.iterdir() if item.is_dir()] if root.is_dir() else []
        raise InputError(f"robot_urdf: 'menagerie:{robot}' is not in {root}{did_you_mean(robot, there)}")
    return _entry(folder, entry, robot)


def _entry(folder: Path, entry: str, robot: str) -> Path:
    models = {item.stem: item for item in sorted(folder.glob("*.xml")) if not item.stem.startswith("scene")}
    if entry:
        chosen = models.get(entry.removesuffix(".xml"))
    else:
        # The robot itself has the shortest name: panda, not panda_nohand.
        chosen = min(models.values(), key=lambda item: (len(item.stem), item.stem), default=None)
    if chosen is None:
        raise InputError(
            f"robot_urdf: 'menagerie:{robot}/{entry}' is not there; it has {', '.join(models) or 'nothing'}"
        )
    return chosen


def is_bundled(sidecar: Path) -> bool:
    """Tell whether a sidecar is one of this package's own."""
    return sidecar.resolve().is_relative_to(_folder().resolve())


def find_sidecar(path: Path, robot_config: Path | None) -> Path | None:
    """Return the sidecar that is given, or lies beside the model; None when there is none.

    Raises:
        InputError: The given one is missing.
    """
    if robot_config is None:
        beside = path.parent / f"{path.stem}{SIDECAR_SUFFIX}"
        return beside.resolve() if is_file(beside) else None
    if not is_file(robot_config):
        raise InputError(f"{robot_config}: no such sidecar; leave it out to have one inferred")
    return robot_config.resolve()


def attached_model(sidecar: Path, attachment: GripperAttachment) -> Path:
    """Return the model of the gripper that a sidecar mounts, a path relative to the sidecar's folder.

    Raises:
        InputError: There is no such file.
    """
    path = sidecar.parent / attachment.model
    if not is_file(path):
        raise InputError(
            f"{sidecar.name}: gripper.attach.model: {str(attachment.model)!r} is no file; a relative path starts at "
            f"{sidecar.parent}{did_you_mean_file(path)}"
        )
    return path.resolve()


def known_sidecar(imported: ImportedModel) -> tuple[Path, Sidecar] | None:
    """Return a shipped sidecar for the robot that a model says it is, if all its names are in the model."""
    joints = {item.name for item in imported.spec.joints}
    bodies = {item.name for item in imported.spec.bodies}
    for path in sorted((_folder() / "known").glob(f"{_plain(imported.name)}*{SIDECAR_SUFFIX}")):
        if path.name.removesuffix(SIDECAR_SUFFIX).partition("--")[0] != _plain(imported.name):
            continue
        sidecar = load_yaml_model(path, Sidecar)
        wanted = {*sidecar.arm.joints, *(sidecar.fingers.joints if sidecar.fingers else ())}
        body = sidecar.ee_site.inject.attach_body if sidecar.ee_site.inject else None
        # Without a gripper it is for the bare arm only: the model may have one.
        fits = wanted <= joints if sidecar.gripper else wanted == joints
        if fits and (body is None or body in bodies):
            return path, sidecar
    return None


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() or c in "_-" else "_" for c in name.lower())


def say(message: str) -> None:
    """Tell the person one line about how their robot is run."""
    logging.getLogger("robosandbox").warning(message)
