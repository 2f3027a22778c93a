"""MJCF to a spec of the robot alone: no scene, no options, no keyframes, no compiler settings that could leak."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.importers import inertia
from robosandbox.robots.importers.files import MissingFileError, ModelFiles
from robosandbox.robots.importers.imported import ImportedModel, compile_spec, copy_options, copy_physics, one_line
from robosandbox.robots.importers.mjcf_files import check_files, elements

_SPECK = 1e-6  # Kilograms and kg m^2 that bodies without mass get, so that MuJoCo compiles them.
# A turn and a little, radians. Chosen because a robot whose joints all stay below so many degrees could not work.
_MOST_RADIANS = 6.4
_SINGLE = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


def import_mjcf(path: Path, package_paths: Iterable[Path] = (), *, as_in_file: bool = False) -> ImportedModel:
    """Read an MJCF's robot.

    Args:
        path: The file.
        package_paths: Folders outside the model's own that it may read from.
        as_in_file: Whether what it says of the solver is kept.

    Raises:
        InputError: The file is wrong, names a file that is not there, or holds no robot.
    """
    files = ModelFiles.of(path, package_paths)
    missing = check_files(files)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{path.name}: {one_line(error)}") from None
    named = spec.modelname if spec.modelname not in ("", "MuJoCo Model") else path.stem
    model = ImportedModel(name=str(named), path=path, spec=spec)
    _leave_undrawn(model, missing)
    spec.compiler.discardvisual = False
    spec.compiler.fusestatic = False
    _settle_angles(model, files)
    _name_all(spec)
    try:
        compiled = compile_spec(spec, path.name)
    except InputError as error:
        if "mjMINVAL" not in str(error):
            raise
        # A moving body without mass or shape: a little of both, replaced below by what fits its shape.
        spec.compiler.boundmass = spec.compiler.boundinertia = _SPECK
        compiled = compile_spec(spec, path.name)
    _read_keyframes(model, compiled)
    _bake_inertias(model, compiled)
    _drop_scene(model)
    if as_in_file:
        model.options = mujoco.MjSpec()
        copy_physics(model.options, spec)
    _isolate(spec)
    return model


def _settle_angles(model: ImportedModel, files: ModelFiles) -> None:
    """Read angles as radians in a file that names no unit and whose joints would hardly move in degrees.

    A file that is meant to be merged into another leaves the unit to that one.
    """
    spec, path = model.spec, model.path
    limits = [np.abs(joint.range).max() for joint in spec.joints if joint.type == _SINGLE[0]]
    most = float(max(limits, default=0.0))
    if not spec.compiler.degree or not 0.0 < most <= _MOST_RADIANS:
        return
    if any(item.tag == "compiler" and item.get("angle") for item, _ in elements(files, path, set(), path)):
        return
    spec.compiler.degree = False
    model.notes.append(f"no <compiler angle>, and no hinge goes beyond {most:.3g}: taken as radians, not degrees")


def _leave_undrawn(model: ImportedModel, missing: dict[str, MissingFileError]) -> None:
    """Leave out meshes that are not there where they are only drawn.

    Raises:
        MissingFileError: One is collided with.
    """
    spec = model.spec
    for mesh in [mesh for mesh in spec.meshes if mesh.file in missing]:
        users = [geom for geom in spec.geoms if geom.meshname == mesh.name]
        if any(geom.contype or geom.conaffinity for geom in users):
            raise missing[mesh.file]
        for geom in users:
            spec.delete(geom)
        model.notes.append(f"the visual mesh {mesh.file!r} is not there: not drawn")
        spec.delete(mesh)


def _name_all(spec: mujoco.MjSpec) -> None:
    """Give every body, joint and actuator a name, so that a sidecar can say it."""
    _name(spec.bodies, "body", lambda body: f"{body.parent.name if body.parent else 'world'}_body")
    _name(spec.joints, "joint", lambda joint: f"{joint.parent.name}_joint")
    _name(spec.actuators, "actuator", lambda actuator: str(actuator.target))


def _name(elements: Iterable[object], kind: str, stem: object) -> None:
    items = list(elements)
    taken = {item.name for item in items}  # type: ignore[attr-defined]
    for item in items:
        if item.name:  # type: ignore[attr-defined]
            continue
        base = stem(item) or kind  # type: ignore[operator]
        name, number = base, 2
        while name in taken:
            name, number = f"{base}_{number}", number + 1
        item.name = name  # type: ignore[attr-defined]
        taken.add(name)


def _read_keyframes(model: ImportedModel, compiled: mujoco.MjModel) -> None:
    for k in range(compiled.nkey):
        values = {}
        for j in range(compiled.njnt):
            if compiled.jnt_type[j] in (_SINGLE[0].value, _SINGLE[1].value):
                values[compiled.joint(j).name] = float(compiled.key_qpos[k, compiled.jnt_qposadr[j]])
        if np.isfinite(list(values.values())).all():
            model.keyframes[compiled.key(k).name or f"key{k}"] = values
    for key in list(model.spec.keys):
        model.spec.delete(key)


def _bake_inertias(model: ImportedModel, compiled: mujoco.MjModel) -> None:
    """Write into each body what the file's compiler settings made of it, so that the settings can go."""
    moves = {body: bool(compiled.body_dofnum[body]) for body in range(compiled.nbody)}
    for body in model.spec.bodies:
        if body.name == "world":
            continue
        b = compiled.body(body.name).id
        mass, moments = float(compiled.body_mass[b]), compiled.body_inertia[b].copy()
        wrong = inertia.fault(mass, np.diag(moments)) if moves[b] else None
        if moves[b] and mass <= 2.0 * _SPECK:
            wrong = "is missing"
        if wrong is not None:
            low, high = _bounds(compiled, b)
            made = inertia.of_box(low, high, mass if mass > 1e-4 else None)
            model.notes.append(f"body {body.name!r}: inertia {wrong}; replaced by that of its shape")
            inertia.write(body, made)
            continue
        body.explicitinertial = True
        body.fullinertia = np.full(6, np.nan)
        body.mass = mass
        body.ipos, body.iquat, body.inertia = compiled.body_ipos[b], compiled.body_iquat[b], moments


def _bounds(compiled: mujoco.MjModel, body: int) -> tuple[np.ndarray, np.ndarray]:
    geoms = np.flatnonzero(compiled.geom_bodyid == body)
    if not len(geoms):
        return np.full(3, -0.01), np.full(3, 0.01)
    radius = compiled.geom_rbound[geoms][:, None]
    return (compiled.geom_pos[geoms] - radius).min(axis=0), (compiled.geom_pos[geoms] + radius).max(axis=0)


def _drop_scene(model: ImportedModel) -> None:
    """Remove what is no robot: lights, cameras, sensors, the floor, furniture and loose objects."""
    spec = model.spec
    for element in [*spec.lights, *spec.cameras, *spec.sensors, *spec.worldbody.geoms]:
        spec.delete(element)
    trees = list(spec.worldbody.bodies)
    joints = {tree.name: _robot_joints(tree) for tree in trees}
    most = max(joints.values(), default=0)
    if most == 0:
        raise InputError(f"{model.path.name}: has no hinge or slide joint; a robot needs one")
    # Articulated furniture has a joint or two; an arm in the same scene has more.
    keep = [tree for tree in trees if joints[tree.name] >= max(1, most // 2)]
    dropped = [tree.name for tree in trees if tree not in keep]
    for tree in trees:
        if tree in keep:
            for joint in list(tree.joints):
                if joint.type not in _SINGLE:
                    model.notes.append(f"joint {joint.name!r} lets the whole robot float: held fixed")
                    spec.delete(joint)
        else:
            spec.delete(tree)
    if dropped or len(keep) > 1:
        # A scene file places the robot's root; that place belongs to the scene.
        for tree in keep:
            tree.pos = [0.0, 0.0, 0.0]
            if len(keep) > 1:
                tree.quat = [1.0, 0.0, 0.0, 0.0]
    if dropped:
        model.notes.append(f"left out of the scene: {', '.join(dropped)}")


def _robot_joints(tree: mujoco.MjsBody) -> int:
    count = len([joint for joint in tree.joints if joint.type in _SINGLE])
    return count + len([j for j in tree.find_all(mujoco.mjtObj.mjOBJ_JOINT) if j.type in _SINGLE])


def _isolate(spec: mujoco.MjSpec) -> None:
    """Put back compiler settings that act on bodies, now that their effect is written down."""
    compiler = spec.compiler
    compiler.boundmass = compiler.boundinertia = 0.0
    compiler.balanceinertia = False
    compiler.settotalmass = -1.0
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    compiler.inertiagrouprange = [0, 5]
    # Measured alone, a robot obeys the options that it will have in every scene, not those of its file.
    copy_options(spec, mujoco.MjSpec())
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
