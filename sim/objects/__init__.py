"""Scene objects as MuJoCo bodies: shapes, contact parameters, and new numbers without a new model."""

from __future__ import annotations

import mujoco

from robosandbox.errors import InputError
from robosandbox.sim.objects.containers import add_container
from robosandbox.sim.objects.geoms import PREFIX, add_geom
from robosandbox.sim.objects.meshes import add_mesh, mesh_bounds
from robosandbox.sim.objects.primitives import PRIMITIVES, bounding_radius, half_extents, inertia, padded
from robosandbox.types import ROUND_CONTAINERS, Array, SceneObject

__all__ = ["PREFIX", "add_object", "can_rewrite", "mesh_bounds", "rewrite"]


def add_object(spec: mujoco.MjSpec, item: SceneObject) -> None:
    """Add a free body for `item`, named `object/<id>`.

    Raises:
        InputError: Its mesh cannot be read, or the world cannot make its kind.
    """
    x, y, z, w = item.pose.quat_xyzw
    body = spec.worldbody.add_body(name=PREFIX + item.id, pos=item.pose.xyz, quat=[w, x, y, z])
    body.add_freejoint(name=PREFIX + item.id)
    if item.kind in PRIMITIVES:
        add_geom(body, item, item.mass, type=PRIMITIVES[item.kind], size=padded(item.size))
    elif item.kind == "bin" or item.kind in ROUND_CONTAINERS:
        add_container(body, item)
    elif item.kind == "mesh":
        add_mesh(spec, body, item)
    else:
        raise InputError(f"objects[{item.id}].kind: this world cannot make a {item.kind!r} yet")


def can_rewrite(old: SceneObject, new: SceneObject) -> bool:
    """Say whether `rewrite` can turn one into the other without a new model."""
    same = (old.id, old.kind, old.mesh, old.scale, old.collision) == (
        new.id,
        new.kind,
        new.mesh,
        new.scale,
        new.collision,
    )
    return same and (old.size == new.size or new.kind in PRIMITIVES)


def rewrite(model: mujoco.MjModel, old: SceneObject, new: SceneObject, inertia_per_mass: Array) -> bool:
    """Write an object's new size, mass and colour into the model; say whether derived constants are now stale.

    The caller then runs `mj_setConst`. Sizes change in place for primitives only. `inertia_per_mass` (3,) is the body's
    as compiled.
    """
    body = model.body(PREFIX + new.id).id
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    model.geom_rgba[first : first + count] = new.rgba
    if (old.size, old.mass) == (new.size, new.mass):
        return False
    if old.size != new.size:
        model.geom_size[first] = padded(new.size)
        half = half_extents(new)
        model.geom_aabb[first, 3:] = half
        model.geom_rbound[first] = bounding_radius(new)
        model.bvh_aabb[model.body_bvhadr[body], 3:] = half
        model.body_inertia[body] = inertia(new)
    else:
        # From the compiled figures each time: a product of ratios would depend on the seeds that came before.
        model.body_inertia[body] = inertia_per_mass * new.mass
    model.body_mass[body] = new.mass
    return True
