"""The first view of a world: from in front of the robot, as near as what is to be seen allows."""

from __future__ import annotations

import math
from collections.abc import Iterable

import mujoco
import numpy as np

from robosandbox.apps.viewer.source import Blueprint
from robosandbox.types import Array
from robosandbox.values import frozen

# Vertical field of view, radians. Chosen about that of a 35 mm lens, which shows depth without bending what stands at the
# edge.
FOV = 0.7
# From the scene to the eye, in units of its distance: in front of the robot, to its right, above the table. Chosen.
_TO_EYE = np.array([0.72, -0.56, 0.42])
_UP = np.array([0.0, 0.0, 1.0])
_MARGIN = 0.08  # Share of the half view that stays free at each edge. Chosen.
_LEAST_SHARE = 0.05  # Share of the view that an object takes at the least. Chosen: 32 pixels of 640.
# Number of halvings of the interval that the middle of a picture is sought in. Chosen: a thousandth of a millimetre.
_HALVINGS = 20
# Interpolation between the view of everything and the nearest one is tried in this many steps.
_STEPS = 20


@frozen(kw_only=True)
class Viewpoint:
    """A camera pose that orbits about what it looks at; metres in the world.

    Attributes:
        position: Of the eye, shape (3,).
        look_at: Shape (3,).
    """

    position: Array
    look_at: Array


@frozen(kw_only=True)
class Window:
    """The part of a picture that nothing covers.

    Attributes:
        aspect: Width over height of the whole picture.
        bottom: Share of its height, from below, that a panel covers.
    """

    aspect: float
    bottom: float = 0.0


def first_view(blueprint: Blueprint, window: Window) -> Viewpoint:
    """Return the view of the arms at home with all objects, moved nearer until the smallest object can be made out.

    Args:
        blueprint: The world, whose objects stand where its task puts them.
        window: What the picture is seen through.
    """
    model, robots = blueprint.model, blueprint.robots.values()
    data = mujoco.MjData(model)
    tools, links = set[int](), set[int]()
    for robot in robots:
        data.qpos[robot.qpos_indices] = robot.home_q
        if robot.gripper is not None:
            data.qpos[robot.gripper.joint_indices] = robot.gripper.joints_at(robot.gripper.geometry.open_joint)
        tools |= robot.gripper.bodies if robot.gripper is not None else {int(model.site_bodyid[robot.tcp_site])}
        links |= robot.bodies
    mujoco.mj_kinematics(model, data)
    objects = [_corners(model, data, _with_children(model, body)) for body in blueprint.object_bodies.values()]
    objects = [corners for corners in objects if len(corners)]
    needed = np.concatenate(
        [*objects, _corners(model, data, tools), data.site_xpos[[robot.tcp_site for robot in robots]]]
    )
    everything = np.concatenate([needed, _corners(model, data, links)])
    far, near = _eye(everything, window), _eye(needed, window)
    eye = far
    for step in range(_STEPS + 1):
        eye = far + step / _STEPS * (near - far)
        if not objects or min(_share(corners, eye) for corners in objects) >= _LEAST_SHARE:
            break
    forward = _axes()[2]
    depth = float(((needed.max(axis=0) + needed.min(axis=0)) / 2.0 - eye) @ forward)
    return Viewpoint(position=eye, look_at=eye + depth * forward)


def _axes() -> Array:
    """Return the camera's right, up and forward as rows, shape (3, 3)."""
    forward = -_TO_EYE / np.linalg.norm(_TO_EYE)
    right = np.cross(forward, _UP)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, forward), forward])


def _eye(points: Array, window: Window) -> Array:
    """Return the nearest eye, shape (3,), from which all points (k, 3) lie inside the window's free part.

    A point at (r, u, f) along the camera's axes is inside if low <= (r - r_eye) / (f - f_eye) <= high, and likewise for u: four
    linear bounds on the eye, so the nearest one follows from the extremes of the points.
    """
    tall = math.tan(FOV / 2.0)
    wide = tall * window.aspect
    along = points @ _axes().T
    spans = []
    for across, low, high in (
        (along[:, 0], -wide * (1.0 - _MARGIN), wide * (1.0 - _MARGIN)),
        (along[:, 1], tall * (2.0 * window.bottom - 1.0 + _MARGIN), tall * (1.0 - _MARGIN)),
    ):
        least, most = (across - high * along[:, 2]).max(), (across - low * along[:, 2]).min()
        spans.append((least, most, low, high))
    forward = min((most - least) / (high - low) for least, most, low, high in spans)
    depth = along[:, 2] - forward
    right, up = (
        _centre(along[:, axis], depth, (least + high * forward, most + low * forward), low + high)
        for axis, (least, most, low, high) in enumerate(spans)
    )
    eye: Array = np.array([right, up, forward]) @ _axes()
    return eye


def _centre(across: Array, depth: Array, bounds: tuple[float, float], both: float) -> float:
    """Return the eye's place across, within bounds, at which the picture's ends lie evenly in the free part.

    Args:
        across: Of each point, shape (k,).
        depth: Of each point before the eye, shape (k,).
        bounds: Between which all points are inside.
        both: Sum of the free part's ends, as tangents.
    """
    least, most = bounds
    for _ in range(_HALVINGS):
        middle = (least + most) / 2.0
        seen = (across - middle) / depth
        least, most = (middle, most) if seen.max() + seen.min() > both else (least, middle)
    return (least + most) / 2.0


def _share(corners: Array, eye: Array) -> float:
    """Return the share of the view's height that a box (8, 3) takes."""
    along = (corners - eye) @ _axes().T
    if along[:, 2].min() <= 0.0:
        return 1.0
    seen = along[:, :2] / along[:, 2:] / (2.0 * math.tan(FOV / 2.0))
    return float((seen.max(axis=0) - seen.min(axis=0)).max())


def _with_children(model: mujoco.MjModel, body: int) -> list[int]:
    """Return a body and those that hang on it, such as a cabinet's drawer."""
    kin = {body}
    for other in range(body + 1, model.nbody):
        if int(model.body_parentid[other]) in kin:
            kin.add(other)
    return sorted(kin)


def _corners(model: mujoco.MjModel, data: mujoco.MjData, bodies: Iterable[int]) -> Array:
    """Return the corners in the world of the boxes around all shapes of some bodies, shape (k, 3)."""
    signs = np.array([[index >> axis & 1 for axis in range(3)] for index in range(8)]) * 2.0 - 1.0
    found = [np.zeros((0, 3))]
    for body in bodies:
        position, rotation = data.xpos[body], data.xmat[body].reshape(3, 3)
        first = int(model.body_geomadr[body])
        for geom in range(first, first + int(model.body_geomnum[body])):
            if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
                continue
            turned = np.zeros(9)
            mujoco.mju_quat2Mat(turned, model.geom_quat[geom])
            centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
            local = (centre + signs * half) @ turned.reshape(3, 3).T + model.geom_pos[geom]
            found.append(local @ rotation.T + position)
    return np.concatenate(found)
