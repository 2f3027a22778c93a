"""A robot's sidecar as a file: read, changed in places, checked, and written back with its comments."""

from __future__ import annotations

import io
import math
import os
import tempfile
from importlib import resources
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from robosandbox.errors import InputError
from robosandbox.robots.loader import load_robot, robot_of
from robosandbox.robots.locate import SIDECAR_SUFFIX, find_sidecar, resolve_robot
from robosandbox.robots.sidecar import Sidecar
from robosandbox.types import Pose, Scene, Vec3
from robosandbox.values import frozen

_DIGITS = 5  # Number of decimals that are written: hundredths of a millimetre. Chosen.


@frozen(kw_only=True)
class Changes:
    """Values of a sidecar that the viewer edits; SI units.

    Attributes:
        home_qpos: One value per arm joint.
        tcp_xyz: The TCP in the frame of the body that it rides on; None where the sidecar names a site of the model.
        base_xyz: The base in the world.
        base_yaw: The base's heading, radians; None leaves its orientation alone.
    """

    home_qpos: tuple[float, ...]
    tcp_xyz: Vec3 | None
    base_xyz: Vec3
    base_yaw: float | None = None


@frozen
class SidecarFile:
    """The sidecar that a scene's robot runs on.

    Attributes:
        model: The model file.
        sidecar: Its roles, complete.
        source: The file that they were read from; None if they were inferred or shipped for models of this name.
        beside: Where one is found without being named: beside the model.
        target: Where changes are written: the file itself, or beside the model; in the working directory for a robot that is
            bundled.
    """

    model: Path
    sidecar: Sidecar
    source: Path | None
    beside: Path
    target: Path

    @classmethod
    def of(cls, scene: Scene) -> SidecarFile:
        """Return that of a scene's robot.

        Raises:
            InputError: The robot cannot be loaded.
        """
        robot = robot_of(scene)
        model = resolve_robot(scene.robot_urdf).resolve()
        inferred = scene.robot_arm is not None or scene.robot_gripper is not None
        source = None if inferred else find_sidecar(model, scene.robot_config)
        beside = model.parent / f"{model.stem}{SIDECAR_SUFFIX}"
        target = source or beside
        if _is_installed(target):
            target = Path.cwd() / target.name
        return cls(model, robot.sidecar, source, beside, target)

    def write(self, changes: Changes, target: Path) -> None:
        """Write the sidecar with changes; the file is replaced only if the robot can be loaded with the new one.

        Args:
            changes: What is to be otherwise.
            target: Ends in .robosandbox.yaml.

        Raises:
            InputError: The robot cannot be loaded with it, or the file cannot be written.
        """
        if not target.name.endswith(SIDECAR_SUFFIX):
            raise InputError(f"sidecar: {target.name!r} is no name for one; end it in {SIDECAR_SUFFIX}")
        text = self.text(changes)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(suffix=SIDECAR_SUFFIX, dir=target.parent)
            trial = Path(name)
            try:
                with os.fdopen(handle, "w", encoding="utf-8") as file:
                    file.write(text)
                load_robot(self.model, trial)
                trial.replace(target)
            except InputError as error:
                raise InputError(str(error).replace(trial.name, target.name)) from None
            finally:
                trial.unlink(missing_ok=True)
        except OSError as error:
            raise InputError(f"sidecar: {target}: {error.strerror}") from None

    def text(self, changes: Changes) -> str:
        """Return the sidecar's YAML with changes; comments and what is not changed stay as they are."""
        yaml = YAML()
        yaml.width = 120
        yaml.preserve_quotes = True
        yaml.indent(mapping=2, sequence=4, offset=2)
        if self.source is not None:
            tree: Any = yaml.load(self.source.read_text(encoding="utf-8"))
        else:
            tree = _in_flow(CommentedMap(self.sidecar.model_dump(mode="json", exclude_none=True)))
        _put(tree, ("arm", "home_qpos"), list(changes.home_qpos))
        if changes.tcp_xyz is not None:
            _put(tree, ("ee_site", "inject", "xyz"), list(changes.tcp_xyz))
        _put(tree, ("base_pose", "xyz"), list(changes.base_xyz))
        base = self.sidecar.base_pose
        if (
            changes.base_yaw is not None
            and abs(changes.base_yaw - Pose(xyz=base.xyz, quat_xyzw=base.quat_xyzw).yaw) > 1e-9
        ):
            half = changes.base_yaw / 2.0
            _put(tree, ("base_pose", "quat_xyzw"), [0.0, 0.0, math.sin(half), math.cos(half)])
        out = io.StringIO()
        yaml.dump(tree, out)
        return out.getvalue()


def _is_installed(path: Path) -> bool:
    """Tell whether a file belongs to this package, where it is not the user's to change."""
    return path.resolve().is_relative_to(Path(str(resources.files("robosandbox.robots"))).resolve())


def _put(tree: Any, keys: tuple[str, ...], values: list[float]) -> None:
    """Set a list of numbers, unless it is the same already: what nobody changed keeps its digits and comments."""
    for key in keys[:-1]:
        if key not in tree:
            tree[key] = CommentedMap()
        tree = tree[key]
    rounded = [round(value, _DIGITS) + 0.0 for value in values]
    held = tree.get(keys[-1])
    if held is not None and len(held) == len(rounded):
        for index, value in enumerate(rounded):
            if abs(float(held[index]) - value) > 0.5 * 10**-_DIGITS:
                held[index] = value
        return
    fresh = CommentedSeq(rounded)
    fresh.fa.set_flow_style()
    tree[keys[-1]] = fresh


def _in_flow(tree: Any) -> Any:
    """Return maps and lists with the lists on one line each."""
    if isinstance(tree, dict):
        return CommentedMap({key: _in_flow(value) for key, value in tree.items()})
    if isinstance(tree, list):
        fresh = CommentedSeq(tree)
        fresh.fa.set_flow_style()
        return fresh
    return tree
