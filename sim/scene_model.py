"""A scene's file as a spec: an MJCF as it is; a URDF, or one thing without ground, on the floor of a room of the house."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.importers.files import read_xml
from robosandbox.robots.importers.imported import compile_spec, get_scalar, has_default_options, one_line, put_scalar
from robosandbox.robots.importers.importing import is_urdf, let_overlaps_touch
from robosandbox.robots.importers.urdf import import_urdf
from robosandbox.sim.room import add_floor, set_options
from robosandbox.values import frozen

# 1/s at which what moves on a joint slows down whose file gives it neither damping nor friction: no hinge or runner of furniture
# goes on for a second when it is let go.
_SLOWS = 5.0
_GROUND = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)


@frozen(kw_only=True)
class SceneModel:
    """A scene's file as a spec.

    Attributes:
        spec: All its bodies and joints have names.
        notes: What was repaired or left out of it, in sentences.
        is_alone: Whether the file is of one thing without ground, and stands on the house's floor.
    """

    spec: mujoco.MjSpec
    notes: tuple[str, ...] = ()
    is_alone: bool = False


def read_scene_model(path: Path) -> SceneModel:
    """Return a scene's file: an MJCF as it is, one thing alone on a floor.

    Raises:
        InputError: It is no model, or does not compile.
    """
    try:
        read = _urdf(path) if is_urdf(read_xml(path)) else _mjcf(path)
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{path.name}: {one_line(error)}") from None
    _name_all(read.spec)
    return read


def _mjcf(path: Path) -> SceneModel:
    spec = mujoco.MjSpec.from_file(str(path))
    if not _is_alone(spec):
        return SceneModel(spec=spec)
    notes: tuple[str, ...] = ()
    low, high = spec.compiler.inertiagrouprange
    groups = [int(geom.group) for geom in spec.geoms if geom.contype or geom.conaffinity]
    if not any(low <= group <= high for group in groups):
        # Its compiler settings are for the whole scene of its suite: bodies that move would weigh nothing.
        spec.compiler.inertiagrouprange = [min(groups, default=low), max(groups, default=high)]
        notes = (
            "by its compiler settings nothing that collides would weigh anything: bodies weigh what of them collides",
        )
    _call(spec, path.stem)
    _stand_on_floor(spec, compile_spec(spec, path.name))
    return SceneModel(spec=spec, notes=notes, is_alone=True)


def _is_alone(spec: mujoco.MjSpec) -> bool:
    """Tell whether all that a model has hangs on one body, without ground, and nothing in it is loose."""
    top, loose = spec.worldbody, any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in spec.joints)
    return len(top.bodies) == 1 and not top.geoms and not loose and all(geom.type not in _GROUND for geom in spec.geoms)


def _urdf(path: Path) -> SceneModel:
    imported = import_urdf(path)
    spec = imported.spec
    _call(spec, imported.name)
    # A frame and its door may touch, as the shapes of others' simulators do.
    let_overlaps_touch(imported)
    model = compile_spec(spec, path.name)
    for joint in spec.joints:
        if get_scalar(joint, "damping") == 0.0 and joint.frictionloss == 0.0:
            inertia = float(model.dof_M0[model.joint(joint.name).dofadr[0]])
            put_scalar(joint, "damping", _SLOWS * inertia)
            imported.notes.append(f"joint {joint.name!r} has neither damping nor friction: it is damped")
    _stand_on_floor(spec, model)
    return SceneModel(spec=spec, notes=tuple(imported.notes), is_alone=True)


def _call(spec: mujoco.MjSpec, name: str) -> None:
    """Call the one root of a model by a name: it is a base to all."""
    tops = list(spec.worldbody.bodies)
    if len(tops) == 1 and all(body.name != name for body in spec.bodies):
        tops[0].name = name


def _stand_on_floor(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Put a model on a floor; the solver is the house's own where its file gives no options."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    lowest = min((_lowest(model, data, geom) for geom in range(model.ngeom)), default=0.0)
    for body in spec.worldbody.bodies:
        body.pos = body.pos - np.array([0.0, 0.0, lowest])
    if has_default_options(spec):
        set_options(spec)
    add_floor(spec)


def _name_all(spec: mujoco.MjSpec) -> None:
    """Give bodies and joints names that have none."""
    taken = {body.name for body in spec.bodies}
    number = 0
    for body in spec.bodies:
        if not body.name:
            number += 1
            while f"body_{number}" in taken:
                number += 1
            body.name = f"body_{number}"
    for body in spec.bodies:
        for index, joint in enumerate(body.joints):
            if not joint.name:
                joint.name = f"{body.name}/joint" + (f"_{index}" if index else "")


def _lowest(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Return the height of the lowest point of a geom's box, metres."""
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    turn = data.geom_xmat[geom].reshape(3, 3)
    return float(data.geom_xpos[geom, 2] + turn[2] @ centre - np.abs(turn[2]) @ half)
