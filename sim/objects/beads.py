"""Beads: many small balls that start in a container, cheap enough to be poured by the dozen."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.sim.objects.geoms import PREFIX
from robosandbox.types import CONTAINER_WALL, ROUND_CONTAINERS, Array, SceneObject

# A contact type that beads carry besides the common one, so that a planner can tell what gives way.
BEAD_BIT = 1 << 29

_SPACING = 1.02
_WALL_CLEARANCE = 0.0005
# A bead that falls a hand's breadth must not sink through a thin floor: contacts yield for two physics steps only.
_STIFF = [0.004, 1.0]
# Glides stop within about half a second; falling is hardly slowed.
_DRAG_SECONDS = 0.5


def add_beads(spec: mujoco.MjSpec, item: SceneObject, vessel: SceneObject) -> None:
    """Add a free body `object/<id>/<k>` for each bead, in layers in the container.

    Their contacts carry no friction: one row of the solver each in place of four. What keeps them from gliding on for
    ever is the air's drag.

    Raises:
        InputError: They would stand over the container's rim.
    """
    radius = item.size[0]
    start = Start(item, vessel)
    mass = item.mass / item.count
    for k, position in enumerate(start.positions(item)):
        body = spec.worldbody.add_body(name=f"{PREFIX}{item.id}/{k}", pos=position)
        joint = body.add_freejoint(name=f"{PREFIX}{item.id}/{k}")
        joint.damping = np.full_like(joint.damping, mass / _DRAG_SECONDS)
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0.0, 0.0],
            mass=mass,
            rgba=item.rgba,
            condim=1,
            priority=1,
            solref=_STIFF,
            contype=1 | BEAD_BIT,
            conaffinity=1,
        )


class Start:
    """Where beads start: square layers, each shifted by a radius against the one below.

    Args:
        item: The beads.
        vessel: Their container.

    Raises:
        InputError: They do not fit into it.
    """

    def __init__(self, item: SceneObject, vessel: SceneObject) -> None:
        radius = item.size[0]
        pitch = 2.0 * radius * _SPACING
        room = np.array(vessel.size[:1] * 2 if vessel.kind in ROUND_CONTAINERS else vessel.size[:2])
        room = room - radius - _WALL_CLEARANCE
        height = vessel.size[-1]
        steps = pitch * np.arange(-math.ceil(room.max() / pitch) - 1, math.ceil(room.max() / pitch) + 2)
        points: list[tuple[float, float, float]] = []
        z, layer = CONTAINER_WALL + radius, 0
        while len(points) < item.count and z + radius <= height:
            level = steps + (layer % 2) * radius
            for x in level:
                for y in level:
                    fits = math.hypot(x, y) <= room[0] if vessel.kind in ROUND_CONTAINERS else abs(x) <= room[0]
                    if fits and abs(y) <= room[1]:
                        points.append((float(x), float(y), z))
            z, layer = z + pitch, layer + 1
        if len(points) < item.count:
            raise InputError(
                f"objects[{item.id}].count: {item.count} beads of radius {radius * 1000:g} mm do not fit into "
                f"{vessel.id!r}, which holds {len(points)}; give fewer, smaller ones or a larger container"
            )
        self._local = np.array(points[: item.count])

    def positions(self, item: SceneObject) -> Array:
        """Return where the beads start in the world, their container standing at their pose, shape (count, 3)."""
        world: Array = item.pose.position + self._local @ item.pose.rotation.T
        return world
