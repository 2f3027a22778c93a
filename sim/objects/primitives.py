"""Boxes, balls, cylinders and capsules: sizes as MuJoCo has them, and what follows from them."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.types import Array, SceneObject

PRIMITIVES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}


def padded(size: tuple[float, ...]) -> Array:
    """Return a size with zeros behind, shape (3,), as a geom takes it."""
    padded = np.zeros(3)
    padded[: len(size)] = size
    return padded


def half_extents(item: SceneObject) -> Array:
    """Return the half-extents (3,) of the primitive's box in its own frame, metres."""
    if item.kind == "box":
        return np.array(item.size)
    radius = item.size[0]
    height = {"sphere": radius, "cylinder": item.size[-1], "capsule": radius + item.size[-1]}[item.kind]
    return np.array([radius, radius, height])


def bounding_radius(item: SceneObject) -> float:
    """Return the radius of the ball around the primitive, metres."""
    if item.kind == "box":
        return float(np.linalg.norm(item.size))
    if item.kind == "cylinder":
        return float(np.hypot(item.size[0], item.size[1]))
    return float(sum(item.size))


def inertia(item: SceneObject) -> Array:
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
