"""Scene objects as MuJoCo bodies: shapes, contact parameters, and new numbers without a new model."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.types import CONTAINER_WALL, Array, SceneObject

PREFIX = "object/"


_FRICTION = [1.0, 0.005, 0.0001]
# A ball or a lying can meets resistance to rolling, as on a real table top: about half a millimetre of lever arm.
_ROLLING_FRICTION = [1.0, 0.005, 0.0005]
_ROLLS = frozenset({"sphere", "cylinder", "capsule"})

_PRIMITIVES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}


def add_object(spec: mujoco.MjSpec, item: SceneObject) -> None:
    """Add a free body for `item`, named `object/<id>`.

    Raises:
        InputError: Its mesh cannot be read, or the world cannot make its kind.
    """
    x, y, z, w = item.pose.quat_xyzw
    body = spec.worldbody.add_body(name=PREFIX + item.id, pos=item.pose.xyz, quat=[w, x, y, z])
    body.add_freejoint(name=PREFIX + item.id)
    if item.kind in _PRIMITIVES:
        _add_geom(body, item, item.mass, type=_PRIMITIVES[item.kind], size=_padded(item.size))
    elif item.kind == "bin":
        boxes = bin_boxes(item.size)
        volume = sum(float(np.prod(half)) for half, _ in boxes)
        for half, centre in boxes:
            share = item.mass * float(np.prod(half)) / volume
            _add_geom(body, item, share, type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=centre)
    elif item.kind == "mesh":
        _add_mesh(spec, body, item)
    else:
        raise InputError(f"objects[{item.id}].kind: this world cannot make a {item.kind!r} yet")


def bin_boxes(size: tuple[float, ...]) -> list[tuple[Array, Array]]:
    """Return (half-extents, centre) of the floor and four walls of a bin whose origin is its bottom's centre."""
    half_x, half_y, height = size
    wall = CONTAINER_WALL / 2.0
    outer_x, middle = half_x + 2.0 * wall, height / 2.0
    return [
        (np.array([outer_x, half_y + 2.0 * wall, wall]), np.array([0.0, 0.0, wall])),
        (np.array([wall, half_y, middle - wall]), np.array([half_x + wall, 0.0, middle + wall])),
        (np.array([wall, half_y, middle - wall]), np.array([-half_x - wall, 0.0, middle + wall])),
        (np.array([outer_x, wall, middle - wall]), np.array([0.0, half_y + wall, middle + wall])),
        (np.array([outer_x, wall, middle - wall]), np.array([0.0, -half_y - wall, middle + wall])),
    ]


def _padded(size: tuple[float, ...]) -> Array:
    padded = np.zeros(3)
    padded[: len(size)] = size
    return padded


def _add_geom(body: mujoco.MjsBody, item: SceneObject, mass: float, **shape: object) -> None:
    rolls = item.kind in _ROLLS
    body.add_geom(
        mass=mass,
        rgba=item.rgba,
        condim=6 if rolls else 4,
        friction=_ROLLING_FRICTION if rolls else _FRICTION,
        **shape,
    )


def _add_mesh(spec: mujoco.MjSpec, body: mujoco.MjsBody, item: SceneObject) -> None:
    name = PREFIX + item.id
    if item.mesh is None or not item.mesh.is_file():
        raise InputError(f"objects[{item.id}].mesh: {str(item.mesh)!r} is not a file")
    if item.collision == "coacd":
        raise InputError(f"objects[{item.id}].collision: 'coacd' is not available yet; use 'hull'")
    low, high = mesh_bounds(item)
    spec.add_mesh(name=name, file=str(item.mesh.resolve()), scale=[item.scale] * 3)
    _add_geom(body, item, item.mass, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, pos=-(low + high) / 2.0)


def mesh_bounds(item: SceneObject) -> tuple[Array, Array]:
    """Return the corners (3,), (3,) of a mesh object's box in its file's frame, metres.

    Raises:
        InputError: The file holds no mesh that MuJoCo can read.
    """
    spec = mujoco.MjSpec()
    spec.add_mesh(name="mesh", file=str(item.mesh and item.mesh.resolve()), scale=[item.scale] * 3)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"objects[{item.id}].mesh: {str(item.mesh)!r}: {' '.join(str(error).split())}") from None
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[0])
    points = model.mesh_vert[: model.mesh_vertnum[0]] @ rotation.reshape(3, 3).T + model.geom_pos[0]
    return points.min(axis=0), points.max(axis=0)


def can_rewrite(old: SceneObject, new: SceneObject) -> bool:
    """Say whether `rewrite` can turn one into the other without a new model."""
    same = (old.id, old.kind, old.mesh, old.scale, old.collision) == (
        new.id,
        new.kind,
        new.mesh,
        new.scale,
        new.collision,
    )
    return same and (old.size == new.size or new.kind in _PRIMITIVES)


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
        model.geom_size[first] = _padded(new.size)
        half = _half_extents(new)
        model.geom_aabb[first, 3:] = half
        model.geom_rbound[first] = _bounding_radius(new)
        model.bvh_aabb[model.body_bvhadr[body], 3:] = half
        model.body_inertia[body] = _inertia(new)
    else:
        # From the compiled figures each time: a product of ratios would depend on the seeds that came before.
        model.body_inertia[body] = inertia_per_mass * new.mass
    model.body_mass[body] = new.mass
    return True


def _half_extents(item: SceneObject) -> Array:
    if item.kind == "box":
        return np.array(item.size)
    radius = item.size[0]
    height = {"sphere": radius, "cylinder": item.size[-1], "capsule": radius + item.size[-1]}[item.kind]
    return np.array([radius, radius, height])


def _bounding_radius(item: SceneObject) -> float:
    if item.kind == "box":
        return float(np.linalg.norm(item.size))
    if item.kind == "cylinder":
        return float(np.hypot(item.size[0], item.size[1]))
    return float(sum(item.size))


def _inertia(item: SceneObject) -> Array:
    """Return the principal inertia (3,) of a solid primitive, kg m^2."""
    mass = item.mass
    if item.kind == "box":
        xx, yy, zz = np.square(item.size)
        return mass / 3.0 * np.array([yy + zz, xx + zz, xx + yy])
    radius = item.size[0]
    if item.kind == "sphere":
        return np.full(3, 0.4 * mass * radius**2)
    half = item.size[1]
    if item.kind == "cylinder":
        side = mass * (3.0 * radius**2 + 4.0 * half**2) / 12.0
        return np.array([side, side, 0.5 * mass * radius**2])
    # A capsule is a cylinder and two half balls, by volume.
    cylinder, ball = 2.0 * half * radius**2, 4.0 / 3.0 * radius**3
    cylinder, ball = mass * cylinder / (cylinder + ball), mass * ball / (cylinder + ball)
    side = cylinder * (3.0 * radius**2 + 4.0 * half**2) / 12.0
    side += ball * (0.4 * radius**2 + half**2 + 0.75 * radius * half)
    return np.array([side, side, 0.5 * cylinder * radius**2 + 0.4 * ball * radius**2])
