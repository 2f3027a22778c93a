"""Sides as a person sees them who faces the robot: the scene is turned by half a turn before it is read, and the calls back after.

What is near to or far from the robot stays so, since the turn is about where it stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, cast

from robosandbox.agent.protocols import Attempt
from robosandbox.shapes.body import PartJoint
from robosandbox.skill_errors import Failure
from robosandbox.types import DetectedObject, ObservedScene, Pose, SkillCall, Vec3

Frame = Literal["robot", "viewer"]
_ACROSS = {"left": "right", "right": "left", "front": "back", "back": "front", "forward": "back"}
# "back" is the side behind a thing, and the direction towards the robot.
_DIRECTIONS = {**_ACROSS, "back": "forward"}
# Arguments of skills of the hand that are positive to the left.
_TO_THE_LEFT = frozenset({"dy", "sideways"})


def turned_scene(scene: ObservedScene) -> ObservedScene:
    """Return a scene turned by half a turn about where the arm stands."""
    bx, by = scene.base_xy
    (x0, x1), (y0, y1) = scene.table_area
    area = ((2.0 * bx - x1, 2.0 * bx - x0), (2.0 * by - y1, 2.0 * by - y0))
    objects = tuple(_turned(item, scene) for item in scene.objects)
    return replace(scene, objects=objects, table_area=area, is_turned=not scene.is_turned)


def turned_calls(calls: Sequence[SkillCall], scene: ObservedScene) -> tuple[SkillCall, ...]:
    """Return calls for a scene that is turned by half a turn as those for the scene itself, or the other way round."""
    return tuple(_turned_call(call, scene) for call in calls)


def turned_attempts(history: Sequence[Attempt], scene: ObservedScene) -> tuple[Attempt, ...]:
    """Return attempts as they would have been in the turned scene."""
    return tuple(
        Attempt(
            completed=turned_calls(one.completed, scene),
            failed=_turned_call(one.failed, scene),
            error=_turned_error(one.error, scene),
            remaining=turned_calls(one.remaining, scene),
        )
        for one in history
    )


def _turned_error(error: Failure, scene: ObservedScene) -> Failure:
    repairs = (way.model_copy(update={"calls": turned_calls(way.calls, scene)}) for way in error.repairs)
    return error.model_copy(update={"repairs": tuple(repairs)})


def _turned(item: DetectedObject, scene: ObservedScene) -> DetectedObject:
    x, y, z, w = item.pose.quat_xyzw
    # Half a turn about z is the quaternion (0, 0, 1, 0).
    pose = Pose(xyz=_point(item.pose.xyz, scene), quat_xyzw=(-y, x, w, -z))
    geometry, joint = item.geometry, None if item.geometry is None else item.geometry.joint
    if geometry is not None and joint is not None:
        geometry = replace(geometry, joint=_turned_joint(joint, scene))
    return replace(item, pose=pose, geometry=geometry, grains=tuple(_point(grain, scene) for grain in item.grains))


def _turned_joint(joint: PartJoint, scene: ObservedScene) -> PartJoint:
    x, y, z = joint.axis
    return replace(joint, axis=(-x, -y, z), anchor=_point(joint.anchor, scene))


def _point(point: Vec3, scene: ObservedScene) -> Vec3:
    return 2.0 * scene.base_xy[0] - point[0], 2.0 * scene.base_xy[1] - point[1], point[2]


def _turned_call(call: SkillCall, scene: ObservedScene) -> SkillCall:
    arguments = dict(call.arguments)
    for name, table in (("side", _ACROSS), ("direction", _DIRECTIONS)):
        if name in arguments:
            arguments[name] = table.get(str(arguments[name]), arguments[name])
    for name in _TO_THE_LEFT & arguments.keys():
        arguments[name] = -cast(float, arguments[name])
    if "x" in arguments and "y" in arguments:
        x, y, _ = _point((cast(float, arguments["x"]), cast(float, arguments["y"]), 0.0), scene)
        arguments |= {"x": round(x, 4), "y": round(y, 4)}
    return SkillCall(skill=call.skill, arguments=arguments)
