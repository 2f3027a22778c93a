"""One way in for every model file: URDF, MJCF, with servos, and its links allowed to touch where they always do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.importers.files import read_xml
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.mjcf import import_mjcf
from robosandbox.robots.importers.servos import ensure_servos, joint_bounds
from robosandbox.robots.importers.urdf import import_urdf

_SAMPLES = 60  # Number of postures in which is looked what touches. Chosen.
_ALWAYS = 0.9  # Share of them in which links touch that always do: their shapes overlap by design. Chosen.
# Number of joints between two links up to which they are neighbours.
_NEAR = 2
# The next link but one overlaps over half of its travel only where its shape is drawn too large.
_OFTEN = 0.5
_FREE = 0.25  # Share of them that must be free of contact, so that the arm can work. Chosen.


def import_model(path: Path, package_paths: Iterable[Path] = (), *, as_in_file: bool = False) -> ImportedModel:
    """Read a URDF or MJCF into a robot that moves.

    Args:
        path: The file; its root element says which of the two it is.
        package_paths: Where package:// names are looked up, before ROS_PACKAGE_PATH.
        as_in_file: Whether its physics stay what the file says: its servos, contacts, gravity and solver.

    Raises:
        InputError: The file is wrong or names one that is not there; the message says which element. Or its physics are to
            stay as they are, and nothing in it drives a joint.
    """
    urdf = is_urdf(read_xml(path))
    imported = import_urdf(path, package_paths) if urdf else import_mjcf(path, package_paths, as_in_file=as_in_file)
    if not len(imported.spec.joints):
        raise InputError(f"{path.name}: has no joint that moves; a robot needs one")
    if as_in_file:
        if not len(imported.spec.actuators):
            raise InputError(
                f"physics: as_in_file keeps {path.name} as it is, and it has no actuator; leave the field out, and loading "
                "makes servos"
            )
        return imported
    ensure_solid(imported)
    ensure_servos(imported)
    compensate_gravity(imported.spec)
    let_overlaps_touch(imported)
    return imported


def is_urdf(content: bytes) -> bool:
    """Tell whether a model's file is a URDF: whether its first element is a robot."""
    head = content[content.find(b"<") :]
    robot, mjcf = head.find(b"<robot"), head.find(b"<mujoco")
    return robot >= 0 and (mjcf < 0 or robot < mjcf)


def ensure_solid(imported: ImportedModel) -> None:
    """Let visual shapes collide where a file has no collision shape on any link that moves."""
    moving = [body for body in imported.spec.bodies if body.name != "world" and _moves(body)]
    geoms = [geom for body in moving for geom in body.geoms]
    if not geoms or any(geom.contype or geom.conaffinity for geom in geoms):
        return
    for geom in geoms:
        geom.contype = geom.conaffinity = 1
    imported.notes.append("no link has a collision shape: the visual ones are taken")


def _moves(body: mujoco.MjsBody) -> bool:
    while body is not None and body.name != "world":
        if body.joints:
            return True
        body = body.parent
    return False


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
    pairs = [frozenset(pair) for pair in imported.disabled_pairs if set(pair) <= names and pair[0] != pair[1]]
    model = compile_spec(spec, imported.path.name)
    always = _always_touching(model)
    _exclude(spec, [*pairs, *always])
    let_neighbours_touch(spec, model)
    if always:
        shown = ", ".join("-".join(sorted(pair)) for pair in always[:4])
        imported.notes.append(f"{len(always)} pairs of links overlap wherever they are and may touch: {shown}")


def let_mounted_touch(imported: ImportedModel, prefix: str) -> None:
    """Exclude contacts of a mounted gripper's parts, named with a prefix, with the links that they are drawn into."""
    model = compile_spec(imported.spec, imported.path.name)
    pairs = [
        pair
        for pair in _always_touching(model)
        if sum(name.startswith(prefix) for name in pair) == 1
        and _joints_between(model, *(model.body(name).id for name in pair)) <= _NEAR
    ]
    _exclude(imported.spec, pairs)
    if pairs:
        shown = ", ".join("-".join(sorted(pair)) for pair in pairs[:4])
        imported.notes.append(f"the gripper is mounted into its arm: {shown} overlap and may touch")


def let_neighbours_touch(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Exclude contacts of a fixed base with the links that turn on it: other neighbours MuJoCo leaves out by itself."""
    fixed = [b for b in range(1, model.nbody) if int(model.body_weldid[b]) == 0 and model.body_geomnum[b]]
    turning = [
        b
        for b in range(1, model.nbody)
        if int(model.body_weldid[b]) != 0
        and int(model.body_weldid[model.body_parentid[int(model.body_weldid[b])]]) == 0
        and model.body_geomnum[b]
    ]
    _exclude(spec, [frozenset((str(model.body(a).name), str(model.body(b).name))) for a in fixed for b in turning])


def _exclude(spec: mujoco.MjSpec, pairs: Iterable[frozenset[str]]) -> None:
    excluded = {frozenset((item.bodyname1, item.bodyname2)) for item in spec.excludes}
    for pair in pairs:
        if pair in excluded or len(pair) != 2:
            continue
        excluded.add(pair)
        first, second = sorted(pair)
        spec.add_exclude(bodyname1=first, bodyname2=second)


def _always_touching(model: mujoco.MjModel) -> list[frozenset[str]]:
    """Return pairs of bodies that are in contact in so many postures that their shapes must be drawn too large."""
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    low, high = joint_bounds(model)
    samples: list[set[tuple[int, int]]] = []
    for _ in range(_SAMPLES):
        data.qpos[:] = model.qpos0
        for j in range(model.njnt):
            if model.jnt_type[j] in (2, 3):
                data.qpos[model.jnt_qposadr[j]] = rng.uniform(low[j], high[j])
        mujoco.mj_fwdPosition(model, data)
        bodies = model.geom_bodyid[data.contact.geom[data.contact.dist < 0.0]]
        samples.append({(int(min(pair)), int(max(pair))) for pair in bodies if pair[0] != pair[1]})
    counts = Counter(pair for sample in samples for pair in sample)
    allowed = {
        (a, b)
        for (a, b), count in counts.items()
        if count >= (_OFTEN if _joints_between(model, a, b) <= _NEAR else _ALWAYS) * _SAMPLES
    }
    # An arm that touches itself nearly wherever it is could not move at all: its worst pairs go first.
    for pair, _ in counts.most_common():
        if sum(not sample - allowed for sample in samples) >= _FREE * _SAMPLES:
            break
        allowed.add(pair)
    return [frozenset((model.body(a).name, model.body(b).name)) for a, b in sorted(allowed)]


def _joints_between(model: mujoco.MjModel, first: int, second: int) -> int:
    """Return the number of joints on the way from one body to another."""
    above: dict[int, int] = {}
    count, body = 0, first
    while True:
        above[body] = count
        if body == 0:
            break
        count += int(model.body_jntnum[body])
        body = int(model.body_parentid[body])
    count, body = 0, second
    while body not in above:
        count += int(model.body_jntnum[body])
        body = int(model.body_parentid[body])
    return count + above[body]
