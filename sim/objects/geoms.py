"""A shape's bodies as MuJoCo has them: geoms for pieces, joints, contact parameters."""

from __future__ import annotations

from typing import assert_never

import mujoco
import numpy as np

from robosandbox.shapes.body import Body, Contact, Free, Piece, Slide
from robosandbox.shapes.hull import BoxHull, CapsuleHull, CylinderHull, Hull, SphereHull
from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.types import Array, Pose, SceneObject

PREFIX = "object/"

# A contact type that grains carry besides the common one, so that a planner can tell what gives way.
GRAIN_BIT = 1 << 29

# Group of geoms that collide and are not drawn; MuJoCo draws the groups 0 to 2.
HIDDEN_GROUP = 3

# MuJoCo's own rolling friction, metres; with condim 4 it is not used.
_NO_ROLLING = 0.0001
# Damping ratio of a contact that yields in a given time.
_CRITICAL = 1.0


def add_body(
    spec: mujoco.MjSpec, first: mujoco.MjsBody | None, item: SceneObject, body: Body, pose: Pose
) -> mujoco.MjsBody:
    """Add one of an object's bodies, `object/<id><suffix>`, with its joint and geoms.

    Args:
        spec: Where a free body goes.
        first: The object's first body, which one that slides rides on; None for the first itself.
        item: The object.
        body: The body.
        pose: Where a free body starts, in the world.
    """
    name = PREFIX + item.id + body.suffix
    match body.joint:
        case Free(drag=drag):
            x, y, z, w = pose.quat_xyzw
            made = spec.worldbody.add_body(name=name, pos=pose.xyz, quat=[w, x, y, z])
            joint = made.add_freejoint(name=name)
            if drag:
                joint.damping = np.full_like(joint.damping, drag)
        case Slide() as slide:
            if first is None:
                raise ValueError(f"{name}: the first body of an object moves freely")
            made = first.add_body(name=name)
            made.add_joint(
                name=name,
                type=mujoco.mjtJoint.mjJNT_SLIDE,
                axis=slide.axis,
                limited=True,
                range=[slide.low, slide.high],
                frictionloss=slide.friction,
                damping=slide.damping,
            )
        case _:
            assert_never(body.joint)
    # What is in none of these groups weighs nothing.
    least, most = spec.compiler.inertiagrouprange
    for number, piece in enumerate(body.pieces):
        form = _form(spec, f"{name}/{number}", piece)
        # The file's own triangles are drawn in the place of points.
        group = HIDDEN_GROUP if isinstance(piece.hull, PolyhedronHull) else 0
        form["group"] = min(max(group, int(least)), int(most))
        _add_geom(made, item, body.contact, piece.mass, rgba=piece.rgba or item.rgba, **form)
    return made


def _add_geom(body: mujoco.MjsBody, item: SceneObject, contact: Contact, mass: float, **form: object) -> None:
    """Add one of an object's geoms: `form` is what MuJoCo calls it, `mass` its share, kg."""
    if contact.frictionless:
        form |= {"condim": 1, "priority": 1, "contype": 1 | GRAIN_BIT, "conaffinity": 1}
        if contact.stiffness_seconds is not None:
            form["solref"] = [contact.stiffness_seconds, _CRITICAL]
    else:
        form["condim"] = 6 if contact.rolling else 4
        form["friction"] = [contact.sliding, contact.torsional, contact.rolling or _NO_ROLLING]
    # Said, because a scene's file may have other defaults.
    form = {"contype": 1, "conaffinity": 1} | form
    body.add_geom(mass=mass, rgba=form.pop("rgba", item.rgba), **form)


def geom_size(hull: Hull) -> Array:
    """Return a hull's size with zeros behind, shape (3,), as a geom takes it; zeros where points say it."""
    padded = np.zeros(3)
    if not isinstance(hull, PolyhedronHull):
        padded[: len(hull.size)] = hull.size
    return padded


def _form(spec: mujoco.MjSpec, name: str, piece: Piece) -> dict[str, object]:
    """Return a geom's form; `name` is that of the mesh which points are put into."""
    x, y, z, w = piece.quat_xyzw
    form: dict[str, object] = {"type": _geom_type(piece.hull), "pos": piece.centre, "quat": [w, x, y, z]}
    if not isinstance(piece.hull, PolyhedronHull):
        return form | {"size": geom_size(piece.hull)}
    spec.add_mesh(name=name, uservert=piece.hull.corners.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    return form | {"meshname": name}


def _geom_type(hull: Hull) -> mujoco.mjtGeom:
    match hull:
        case BoxHull():
            return mujoco.mjtGeom.mjGEOM_BOX
        case SphereHull():
            return mujoco.mjtGeom.mjGEOM_SPHERE
        case CylinderHull():
            return mujoco.mjtGeom.mjGEOM_CYLINDER
        case CapsuleHull():
            return mujoco.mjtGeom.mjGEOM_CAPSULE
        case PolyhedronHull():
            return mujoco.mjtGeom.mjGEOM_MESH
        case _:
            assert_never(hull)
