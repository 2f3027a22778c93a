"""A scene with what its world's file has in it, and a place for the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.loader import RobotModel, load_robot
from robosandbox.robots.locate import say
from robosandbox.sim.scene_file import SceneFile, read_scene_file
from robosandbox.types import TABLE_HEIGHT, Array, Scene, SceneObject

# Metres between the places along a table's edge at which a robot's base is tried, and from the edge to its middle, on the table.
_STEP = 0.05
_FROM_EDGE = 0.12
# Radius of the ground that a base takes, metres: a hand's width more than an arm's foot.
_FOOT = 0.15
# Metres between the robot at home and what stands there.
_ROOM = 0.02
# Turns of the base, radians: as it looks along +x its left is +y, which is what sentences mean by it.
_TURNS = (0.0, math.pi / 2.0, -math.pi / 2.0, math.pi)


def populated(scene: Scene) -> Scene:
    """Return a scene with the objects, table and robot's base of its world's file; one without a file, or that has them, as it is.

    Raises:
        InputError: The file is missing or wrong.
    """
    if scene.world is None or any(item.body is not None for item in scene.objects):
        return scene
    file = read_scene_file(scene.world)
    names = {item.id for item in scene.objects}
    for item in file.objects:
        if item.id in names:
            raise InputError(f"scene.objects: {item.id!r} is in {file.path.name} already; give the object another id")
    told = scene.model_copy(
        update={
            "world": file.path,
            "objects": (*file.objects, *scene.objects),
            "table_height": file.table.height,
            "table_area": file.table.area,
        }
    )
    if scene.arms:
        return told
    base, why = robot_base_of(scene, file)
    if scene.robot_base is None and file.sidecar.robot_base is None:
        say(f"{file.path.name}: the robot stands at {', '.join(f'{v:.3g}' for v in base)} ({why})")
    return told.model_copy(update={"robot_base": base})


def robot_base_of(scene: Scene, file: SceneFile) -> tuple[tuple[float, float, float, float], str]:
    """Return where the robot's base stands in a scene, as said or as found, and why there, in words."""
    if scene.robot_base is not None:
        return scene.robot_base, "as it was asked for"
    if file.sidecar.robot_base is not None:
        return file.sidecar.robot_base, "as the sidecar says"
    if file.robot_base is not None:
        return file.robot_base, "where the file's own robot stood"
    return robot_place(file, _robot(scene))


def left_out(scene: Scene) -> tuple[str, ...]:
    """Return what of a world's file is not in the scene, and why, in sentences."""
    if scene.world is None:
        return ()
    file = read_scene_file(scene.world)
    gone = [f"{file.path.name}: {name} is left out: {why}" for name, why in file.left_out.items()]
    return (*gone, *(f"{file.path.name}: {note}" for note in file.notes))


def _robot(scene: Scene) -> RobotModel:
    return load_robot(scene.robot_urdf, scene.robot_config, arm=scene.robot_arm, gripper=scene.robot_gripper)


def robot_place(file: SceneFile, robot: RobotModel) -> tuple[tuple[float, float, float, float], str]:
    """Return where a robot's base should stand, x, y, z and turn, and why, in words.

    The base stands on the table's edge, or anywhere on the ground, and of all places from which most things and parts are in
    reach at the one where they are nearest to the middle of it; a base that looks along +x is preferred.

    Args:
        file: The scene.
        robot: What reaches them.
    """
    near, far = robot.workspace.near, robot.workspace.far
    (x0, x1), (y0, y1) = file.table.area
    height = file.table.height + max(0.0, robot.base_pose.xyz[2] - TABLE_HEIGHT)
    wanted = np.array([_middle(item) for item in file.objects if not item.is_fixed or item.kind == "part"])
    wanted = wanted if len(wanted) else np.array([[(x0 + x1) / 2.0, (y0 + y1) / 2.0]])
    solid = [_box(item) for item in file.objects]
    places: list[tuple[tuple[float, ...], tuple[float, float, float, float]]] = []
    for turn in _TURNS:
        ahead = np.array([math.cos(turn), math.sin(turn)])
        feet = _around(wanted, far) if file.table.is_ground else np.array(_edge(x0, x1, y0, y1, ahead))
        for low, high in solid:
            feet = feet[_apart(feet, low[:2], high[:2]) >= _FOOT]
        away = wanted - feet[:, None]
        distances = np.linalg.norm(away, axis=2)
        reached = ((near < distances) & (distances < far) & (away @ ahead > 0.0)).sum(axis=1)
        off = np.abs(distances - (near + far) / 2.0).mean(axis=1)
        for (x, y), count, apart in zip(feet.tolist(), reached.tolist(), off.tolist(), strict=True):
            score = (-float(count), 0.0 if turn == 0.0 else 1.0, round(apart, 2), abs(y - (y0 + y1) / 2.0))
            places.append((score, (round(x, 3), round(y, 3), round(height, 4), turn)))
    at_home = _home_boxes(robot)
    best = next((place for place in sorted(places) if not _meets(at_home, place[1], solid)), None)
    if best is None:
        raise InputError(
            f"{file.path.name}: there is no free place for a robot on {file.table.body!r}; give --robot-base x,y,z,yaw"
        )
    return best[1], f"{-best[0][0]:.0f} of {len(wanted)} things and parts within {near:.2f} to {far:.2f} m"


def _edge(x0: float, x1: float, y0: float, y1: float, ahead: Array) -> Sequence[tuple[float, float]]:
    """Return places along the edge that a robot which looks ahead has at its back."""
    if abs(ahead[0]) > 0.5:
        x = min(x0 + _FROM_EDGE, (x0 + x1) / 2.0) if ahead[0] > 0.0 else max(x1 - _FROM_EDGE, (x0 + x1) / 2.0)
        return [(x, y) for y in _along(y0, y1)]
    y = min(y0 + _FROM_EDGE, (y0 + y1) / 2.0) if ahead[1] > 0.0 else max(y1 - _FROM_EDGE, (y0 + y1) / 2.0)
    return [(x, y) for x in _along(x0, x1)]


def _around(wanted: Array, far: float) -> Array:
    """Return places, shape (m, 2), from which some of the points (n, 2) may be in reach."""
    low, high = wanted.min(axis=0) - far, wanted.max(axis=0) + far
    x, y = np.meshgrid(*(np.arange(a, b, _STEP) for a, b in zip(low, high, strict=True)), indexing="ij")
    return np.column_stack([x.ravel(), y.ravel()])


def _along(low: float, high: float) -> list[float]:
    middle, half = (low + high) / 2.0, max(0.0, (high - low) / 2.0 - _FROM_EDGE)
    count = int(half / _STEP)
    return [middle + k * _STEP for k in range(-count, count + 1)]


def _middle(item: SceneObject) -> Array:
    if item.geometry is None:
        return item.pose.position[:2]
    middle: Array = (item.pose.position + item.pose.rotation @ item.geometry.box[0])[:2]
    return middle


def _box(item: SceneObject) -> tuple[Array, Array]:
    """Return the least and the greatest corner of an object's box in the world, each of shape (3,), metres."""
    if item.geometry is None:
        half = item.shape.hull(item.size).radius
        return item.pose.position - half, item.pose.position + half
    points = item.geometry.outer @ item.pose.rotation.T + item.pose.position
    return points.min(axis=0), points.max(axis=0)


def _home_boxes(robot: RobotModel) -> tuple[Array, Array]:
    """Return least and greatest corners of the boxes of a robot's colliding shapes at home, about its base, each (k, 3), metres."""
    model = robot.spec.copy().compile()
    data = mujoco.MjData(model)
    for name, value in zip(robot.sidecar.arm.joints, robot.sidecar.arm.home_qpos, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    solid = (model.geom_contype | model.geom_conaffinity) != 0
    turns = data.geom_xmat[solid].reshape(-1, 3, 3)
    middle = data.geom_xpos[solid] + np.einsum("kij,kj->ki", turns, model.geom_aabb[solid, :3])
    half = np.einsum("kij,kj->ki", np.abs(turns), model.geom_aabb[solid, 3:])
    return middle - half, middle + half


def _meets(
    boxes: tuple[Array, Array], base: tuple[float, float, float, float], solid: Sequence[tuple[Array, Array]]
) -> bool:
    """Tell whether boxes about a base that stands at x, y, z with a quarter turn overlap others, or nearly."""
    x, y, z, yaw = base
    turn = np.round(
        np.array([[math.cos(yaw), -math.sin(yaw), 0.0], [math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    )
    corners = np.stack([box @ turn.T for box in boxes]) + [x, y, z]
    lows, highs = corners.min(axis=0) - _ROOM, corners.max(axis=0) + _ROOM
    return any(bool(((lows < high) & (highs > low)).all(axis=1).any()) for low, high in solid)


def _apart(points: Array, low: Array, high: Array) -> Array:
    """Return how far points (m, 2) are from a rectangle, shape (m,), metres."""
    distances: Array = np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1)
    return distances
