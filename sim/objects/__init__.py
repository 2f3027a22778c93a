"""Scene objects as MuJoCo bodies: built from their shapes' pieces, and given new numbers without a new model."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import InputError
from robosandbox.shapes.beads import stacked
from robosandbox.shapes.body import Free, Slide
from robosandbox.shapes.shape import Primitive
from robosandbox.sim.objects.geoms import GRAIN_BIT, PREFIX, add_body, geom_size
from robosandbox.sim.objects.meshes import add_drawing
from robosandbox.sim.objects.standing import stand
from robosandbox.sim.objects.tags import add_tag
from robosandbox.types import Array, Pose, Scene, SceneObject

__all__ = [
    "GRAIN_BIT",
    "PREFIX",
    "add_objects",
    "body_names",
    "can_rewrite",
    "count_bodies",
    "count_geoms",
    "place",
    "rewrite",
]

_COMPILED_FIELDS = (
    "body",
    "geometry",
    "id",
    "kind",
    "mesh",
    "scale",
    "collision",
    "locked",
    "count",
    "inside",
    "tag",
    "tag_size",
)


def add_objects(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add the bodies of each object, the first of them `object/<id>`.

    Raises:
        InputError: A mesh cannot be read, or grains do not fit into their container.
    """
    for item in scene.objects:
        if item.body is not None:
            # The scene's file has it.
            continue
        starts = iter(_starts(scene, item))
        first: mujoco.MjsBody | None = None
        for body in item.shape.bodies(item):
            pose = next(starts) if isinstance(body.joint, Free) else item.pose
            made = add_body(spec, first, item, body, pose)
            first = first or made
        if first is not None:
            # Behind the shape: `rewrite` takes a body's first geom for it.
            add_tag(spec, first, item)
            add_drawing(spec, first, item)


def body_names(item: SceneObject) -> list[str]:
    """Return the names in the model of an object's bodies."""
    return [PREFIX + item.id + body.suffix for body in item.shape.bodies(item)]


def count_bodies(scene: Scene) -> int:
    """Return of how many bodies a scene's objects are made."""
    return sum(1 if item.body is not None else len(item.shape.bodies(item)) for item in scene.objects)


def count_geoms(scene: Scene) -> int:
    """Return of how many geoms a scene's objects are made.

    Raises:
        InputError: As `add_objects` does.
    """
    spec = mujoco.MjSpec()
    add_objects(spec, scene)
    return len(spec.geoms)


def place(scene: Scene, item: SceneObject, data: mujoco.MjData) -> None:
    """Put an object where its scene has it at the start."""
    if item.body is not None:
        joint = None if item.geometry is None else item.geometry.joint
        if joint is not None:
            data.qpos[data.model.jnt_qposadr[data.model.body(item.body).jntadr[0]]] = joint.start
        elif not item.is_fixed:
            stand(data.model, data.qpos, data.model.body(item.body).id, item.pose)
        return
    starts = iter(_starts(scene, item))
    for body in item.shape.bodies(item):
        joint = data.joint(PREFIX + item.id + body.suffix)
        if isinstance(body.joint, Slide):
            joint.qpos = item.open
        else:
            pose = next(starts)
            x, y, z, w = pose.quat_xyzw
            joint.qpos = [*pose.xyz, w, x, y, z]


def _starts(scene: Scene, item: SceneObject) -> list[Pose]:
    """Return where an object's free bodies start.

    Raises:
        InputError: Grains do not fit into their container.
    """
    if item.inside is None:
        return [item.pose]
    vessel = next(other for other in scene.objects if other.id == item.inside)
    room = vessel.shape.room(vessel.size)
    local = stacked(item.size[0], item.count, room) if room else np.zeros((0, 3))
    if len(local) < item.count:
        raise InputError(
            f"objects[{item.id}].count: {item.count} {item.kind} of radius {item.size[0] * 1000:g} mm do not fit into "
            f"{vessel.id!r}, which holds {len(local)}; give fewer, smaller ones or a larger container"
        )
    world = item.pose.position + local @ item.pose.rotation.T
    return [Pose.from_matrix(position, np.eye(3)) for position in world]


def can_rewrite(old: SceneObject, new: SceneObject) -> bool:
    """Say whether `rewrite` can turn one into the other without a new model."""
    same = all(getattr(old, name) == getattr(new, name) for name in _COMPILED_FIELDS)
    same = same and not (new.locked and old.open != new.open)
    # Parts of an object may have shades of its colour.
    same = same and (_has_one_colour(new) or old.rgba == new.rgba)
    # A tag's place is compiled.
    sizable = isinstance(new.shape, Primitive) and new.tag is None and new.body is None
    return same and (old.size == new.size or sizable)


def _has_one_colour(item: SceneObject) -> bool:
    if item.body is not None:
        return False
    return all(piece.rgba is None for body in item.shape.bodies(item) for piece in body.pieces)


def rewrite(
    model: mujoco.MjModel,
    old: SceneObject,
    new: SceneObject,
    bodies: NDArray[np.intp],
    share: Array,
    inertia_per_mass: Array,
) -> bool:
    """Write an object's new size, mass and colour into the model; say whether derived constants are now stale.

    The caller then runs `mj_setConst`. Sizes change in place for primitives only.

    Args:
        model: To be changed.
        old: What the object is in it.
        new: What it is to be.
        bodies: Ids of its bodies, shape (k,).
        share: Of its mass, that each has, shape (k,).
        inertia_per_mass: Of each as compiled, m^2, shape (k, 3).
    """
    if _has_one_colour(new):
        # What has a material is a tag.
        model.geom_rgba[np.isin(model.geom_bodyid, bodies) & (model.geom_matid < 0)] = new.rgba
    if (old.size, old.mass) == (new.size, new.mass):
        return False
    model.body_mass[bodies] = share * new.mass
    if old.size == new.size:
        # From the compiled figures each time: a product of ratios would depend on the seeds that came before.
        model.body_inertia[bodies] = inertia_per_mass * model.body_mass[bodies][:, None]
        return True
    body, hull = int(bodies[0]), new.shape.hull(new.size)
    first = int(model.body_geomadr[body])
    model.geom_size[first] = geom_size(hull)
    model.geom_aabb[first, 3:] = hull.half_extents
    model.geom_rbound[first] = hull.radius
    model.bvh_aabb[model.body_bvhadr[body], 3:] = hull.half_extents
    model.body_inertia[body] = hull.inertia(new.mass)
    return True
