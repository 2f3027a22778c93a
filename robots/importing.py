"""One way in for every model file: URDF, MJCF, with servos, and its links allowed to touch where they always do."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.files import read_xml
from robosandbox.robots.imported import ImportedModel, compile_spec
from robosandbox.robots.mjcf import import_mjcf
from robosandbox.robots.servos import ensure_servos, joint_bounds
from robosandbox.robots.urdf import import_urdf

_SAMPLES = 60
_ALWAYS = 0.9


def import_model(path: Path, package_paths: Iterable[Path] = ()) -> ImportedModel:
    """Read a URDF or MJCF into a robot that moves.

    Args:
        path: The file; its root element says which of the two it is.
        package_paths: Where package:// names are looked up, before ROS_PACKAGE_PATH.

    Raises:
        InputError: The file is wrong or names one that is not there; the message says which element.
    """
    is_urdf = _is_urdf(read_xml(path))
    imported = import_urdf(path, package_paths) if is_urdf else import_mjcf(path, package_paths)
    if not len(imported.spec.joints):
        raise InputError(f"{path.name}: has no joint that moves; a robot needs one")
    ensure_servos(imported)
    compensate_gravity(imported.spec)
    let_overlaps_touch(imported)
    return imported


def _is_urdf(content: bytes) -> bool:
    head = content[content.find(b"<") :]
    robot, mjcf = head.find(b"<robot"), head.find(b"<mujoco")
    return robot >= 0 and (mjcf < 0 or robot < mjcf)


def compensate_gravity(spec: mujoco.MjSpec) -> None:
    """Let the arm carry its own weight, as the controllers of real arms do; a load it still has to carry by its servos.

    Without that a servo of finite stiffness sags by its share of the arm's weight. A body that the file gives a value
    of its own keeps it.
    """
    for body in spec.bodies:
        if body.name != "world" and body.gravcomp == 0.0:
            body.gravcomp = 1.0


def let_overlaps_touch(imported: ImportedModel) -> None:
    """Exclude contacts of links that overlap in nearly every posture: neighbours whose hulls are larger than they."""
    spec = imported.spec
    names = {body.name for body in spec.bodies}
    excluded = {frozenset((item.bodyname1, item.bodyname2)) for item in spec.excludes}
    pairs = [frozenset(pair) for pair in imported.disabled_pairs if set(pair) <= names and pair[0] != pair[1]]
    model = compile_spec(spec, imported.path.name)
    always = _always_touching(model)
    for pair in [*pairs, *always]:
        if pair in excluded or len(pair) != 2:
            continue
        excluded.add(pair)
        first, second = sorted(pair)
        spec.add_exclude(bodyname1=first, bodyname2=second)
    if always:
        shown = ", ".join("-".join(sorted(pair)) for pair in always[:4])
        imported.notes.append(f"{len(always)} pairs of links overlap wherever they are and may touch: {shown}")


def _always_touching(model: mujoco.MjModel) -> list[frozenset[str]]:
    """Return pairs of bodies in contact in nearly all of a sample of postures."""
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    low, high = joint_bounds(model)
    counts: dict[tuple[int, int], int] = {}
    for _ in range(_SAMPLES):
        data.qpos[:] = model.qpos0
        for j in range(model.njnt):
            if model.jnt_type[j] in (2, 3):
                data.qpos[model.jnt_qposadr[j]] = rng.uniform(low[j], high[j])
        mujoco.mj_fwdPosition(model, data)
        bodies = model.geom_bodyid[data.contact.geom[data.contact.dist < 0.0]]
        for a, b in {(int(min(pair)), int(max(pair))) for pair in bodies}:
            counts[a, b] = counts.get((a, b), 0) + 1
    return [
        frozenset((model.body(a).name, model.body(b).name))
        for (a, b), count in sorted(counts.items())
        if count >= _ALWAYS * _SAMPLES and a != b
    ]
