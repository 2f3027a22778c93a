"""Drawers: a cabinet, a box that slides in it, and a grip to pull it by."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from robosandbox.shapes import DrawerShape
from robosandbox.sim.objects.geoms import PREFIX, add_geom
from robosandbox.types import CONTAINER_WALL, SceneObject

BOX = "/box"

# A wooden drawer on waxed runners: a pull of two newtons, and no gliding on.
_FRICTION_LOSS = 2.0
_DAMPING = 8.0
_LOCK_PLAY = 0.0003
_BOX_SHARE = 0.35
_GRIP_COLOUR = (0.32, 0.32, 0.34, 1.0)
_BOX_SHADE = 0.82


def add_drawer(body: mujoco.MjsBody, item: SceneObject) -> None:
    """Add the cabinet's panels to the body, and the sliding box as its child `object/<id>/box`."""
    shape = DrawerShape.of(item.size)
    _add_panels(body, item, shape)
    box = body.add_body(name=PREFIX + item.id + BOX)
    low, high = (item.open, item.open + _LOCK_PLAY) if item.locked else (0.0, shape.max_open)
    box.add_joint(
        name=PREFIX + item.id + BOX,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[-1.0, 0.0, 0.0],
        limited=True,
        range=[low, high],
        frictionloss=_FRICTION_LOSS,
        damping=_DAMPING,
    )
    _add_box(box, item, shape)


def _add_panels(body: mujoco.MjsBody, item: SceneObject, shape: DrawerShape) -> None:
    x, y, z = shape.cabinet
    wall = CONTAINER_WALL / 2.0
    panels = [
        ((x, y, wall), (0.0, 0.0, wall)),
        ((x, y, wall), (0.0, 0.0, 2.0 * z - wall)),
        ((x, wall, z - 2.0 * wall), (0.0, y - wall, z)),
        ((x, wall, z - 2.0 * wall), (0.0, -y + wall, z)),
        ((wall, y - 2.0 * wall, z - 2.0 * wall), (x - wall, 0.0, z)),
    ]
    _add_boxes(body, item, panels, (1.0 - _BOX_SHARE) * item.mass, item.rgba)


def _add_box(box: mujoco.MjsBody, item: SceneObject, shape: DrawerShape) -> None:
    x, y, z = shape.box
    cx, _, cz = shape.box_centre
    wall = CONTAINER_WALL / 2.0
    level = cz + wall
    panels = [
        ((x, y, wall), (cx, 0.0, cz - z + wall)),
        ((wall, y, z - wall), (cx - x + wall, 0.0, level)),
        ((wall, y, z - wall), (cx + x - wall, 0.0, level)),
        ((x - 2.0 * wall, wall, z - wall), (cx, y - wall, level)),
        ((x - 2.0 * wall, wall, z - wall), (cx, -y + wall, level)),
    ]
    share = _BOX_SHARE * item.mass
    red, green, blue = (_BOX_SHADE * channel for channel in item.rgba[:3])
    _add_boxes(box, item, panels, 0.95 * share, (red, green, blue, item.rgba[3]))
    grip, centre = shape.grip, shape.grip_centre
    front = cx - x
    arm = (front - centre[0] - grip[0]) / 2.0
    handle = [
        (tuple(grip), tuple(centre)),
        ((arm, grip[1] / 2.0, grip[2] / 2.0), (front - arm, 0.0, float(centre[2] - grip[2] / 2.0))),
    ]
    _add_boxes(box, item, handle, 0.05 * share, _GRIP_COLOUR)


def _add_boxes(
    body: mujoco.MjsBody,
    item: SceneObject,
    boxes: Sequence[tuple[tuple[float, ...], tuple[float, ...]]],
    mass: float,
    rgba: tuple[float, float, float, float],
) -> None:
    volume = sum(float(np.prod(half)) for half, _ in boxes)
    for half, centre in boxes:
        share = mass * float(np.prod(half)) / volume
        add_geom(body, item, share, type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=centre, rgba=rgba)
