"""Scene objects as MuJoCo bodies: shapes, contact parameters, and new numbers without a new model."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.objects.beads import Start, add_beads
from robosandbox.sim.objects.containers import add_container
from robosandbox.sim.objects.drawer import BOX, add_drawer
from robosandbox.sim.objects.geoms import PREFIX, add_geom
from robosandbox.sim.objects.meshes import add_mesh, mesh_bounds
from robosandbox.sim.objects.primitives import PRIMITIVES, bounding_radius, half_extents, inertia, padded
from robosandbox.sim.objects.tags import add_tag
from robosandbox.types import Array, Scene, SceneObject

__all__ = [
    "BOX",
    "PREFIX",
    "add_objects",
    "can_rewrite",
    "count_bodies",
    "count_geoms",
    "mesh_bounds",
    "place",
    "rewrite",
]

_SHAPE_FIELDS = ("id", "kind", "mesh", "scale", "collision", "locked", "count", "inside", "tag", "tag_size")


def add_objects(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add a free body `object/<id>` for each object, and one for each bead.

    Raises:
        InputError: A mesh cannot be read, or beads do not fit into their container.
    """
    for item in scene.objects:
        if item.kind == "beads":
            add_beads(spec, item, _vessel(scene, item))
            continue
        x, y, z, w = item.pose.quat_xyzw
        body = spec.worldbody.add_body(name=PREFIX + item.id, pos=item.pose.xyz, quat=[w, x, y, z])
        body.add_freejoint(name=PREFIX + item.id)
        match item.kind:
            case "mesh":
                add_mesh(spec, body, item)
            case "bin" | "bowl" | "cup":
                add_container(body, item)
            case "drawer":
                add_drawer(body, item)
            case "box" | "sphere" | "cylinder" | "capsule":
                add_geom(body, item, item.mass, type=PRIMITIVES[item.kind], size=padded(item.size))
                # Behind the shape: `rewrite` takes a body's first geom for it.
                add_tag(spec, body, item)


def count_bodies(scene: Scene) -> int:
    """Return of how many bodies a scene's objects are made."""
    return sum(item.count or (2 if item.kind == "drawer" else 1) for item in scene.objects)


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
    if item.kind == "beads":
        for k, position in enumerate(Start(item, _vessel(scene, item)).positions(item)):
            data.joint(f"{PREFIX}{item.id}/{k}").qpos = [*position, 1.0, 0.0, 0.0, 0.0]
        return
    x, y, z, w = item.pose.quat_xyzw
    data.joint(PREFIX + item.id).qpos = [*item.pose.xyz, w, x, y, z]
    if item.kind == "drawer":
        data.joint(PREFIX + item.id + BOX).qpos = item.open


def _vessel(scene: Scene, beads: SceneObject) -> SceneObject:
    return next(item for item in scene.objects if item.id == beads.inside)


def can_rewrite(old: SceneObject, new: SceneObject) -> bool:
    """Say whether `rewrite` can turn one into the other without a new model."""
    same = all(getattr(old, name) == getattr(new, name) for name in _SHAPE_FIELDS)
    same = same and not (new.locked and old.open != new.open)
    # The parts of a drawer have shades of its colour.
    same = same and (new.kind != "drawer" or old.rgba == new.rgba)
    # A tag's place is compiled.
    return same and (old.size == new.size or (new.kind in PRIMITIVES and new.tag is None))


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
    if new.kind != "drawer":
        # What has a material is a tag.
        model.geom_rgba[np.isin(model.geom_bodyid, bodies) & (model.geom_matid < 0)] = new.rgba
    if (old.size, old.mass) == (new.size, new.mass):
        return False
    model.body_mass[bodies] = share * new.mass
    if old.size == new.size:
        # From the compiled figures each time: a product of ratios would depend on the seeds that came before.
        model.body_inertia[bodies] = inertia_per_mass * model.body_mass[bodies][:, None]
        return True
    body = int(bodies[0])
    first = int(model.body_geomadr[body])
    half = half_extents(new)
    model.geom_size[first] = padded(new.size)
    model.geom_aabb[first, 3:] = half
    model.geom_rbound[first] = bounding_radius(new)
    model.bvh_aabb[model.body_bvhadr[body], 3:] = half
    model.body_inertia[body] = inertia(new)
    return True
