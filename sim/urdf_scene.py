"""A URDF of an articulated thing as a scene: its root stands fixed on the floor of a room of the house."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from robosandbox.robots.importers.imported import compile_spec, get_scalar, put_scalar
from robosandbox.robots.importers.importing import let_overlaps_touch
from robosandbox.robots.importers.urdf import import_urdf
from robosandbox.sim.room import add_floor, set_options

# 1/s at which what moves on a joint slows down whose file gives it neither damping nor friction: no hinge or runner of furniture
# goes on for a second when it is let go.
_SLOWS = 5.0


def urdf_scene(path: Path) -> tuple[mujoco.MjSpec, list[str]]:
    """Return the room that a URDF stands in, and what was repaired or left out of it, in sentences.

    A URDF has no ground, no light and no solver: those are the house's own, and so is the damping of joints that have none. Its
    lowest point is put on the ground, its root is called by the file's name. Links that overlap wherever they are may touch, as
    the frame and the door of a cabinet do.

    Args:
        path: The file. Its meshes are looked up beside it and in ROS_PACKAGE_PATH.

    Raises:
        InputError: The file is wrong, or names one that is not there.
    """
    imported = import_urdf(path)
    spec = imported.spec
    tops = [body for body in spec.bodies if body.parent is not None and body.parent.name == "world"]
    if len(tops) == 1 and all(body.name != imported.name for body in spec.bodies):
        # A root is a base_link to all; what people call the thing is what the file is called by.
        tops[0].name = imported.name
    let_overlaps_touch(imported)
    model = compile_spec(spec, path.name)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    lowest = min((_lowest(model, data, geom) for geom in range(model.ngeom)), default=0.0)
    for body in tops:
        body.pos = body.pos - np.array([0.0, 0.0, lowest])
    for joint in spec.joints:
        if get_scalar(joint, "damping") == 0.0 and joint.frictionloss == 0.0:
            inertia = float(model.dof_M0[model.joint(joint.name).dofadr[0]])
            put_scalar(joint, "damping", _SLOWS * inertia)
            imported.notes.append(f"joint {joint.name!r} has neither damping nor friction: it is damped")
    set_options(spec)
    add_floor(spec)
    return spec, imported.notes


def _lowest(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Return the height of the lowest point of a geom's box, metres."""
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    turn = data.geom_xmat[geom].reshape(3, 3)
    return float(data.geom_xpos[geom, 2] + turn[2] @ centre - np.abs(turn[2]) @ half)
