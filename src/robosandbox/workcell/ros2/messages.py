"""Values of a workcell as ROS 2 messages, of whichever classes speak them."""

from __future__ import annotations

import json
from array import array
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from robosandbox.agent.episode import PhaseEntered, Planned, SkillFailed, Thought
from robosandbox.agent.tools import error_data
from robosandbox.errors import InternalError, InvalidArgumentError, RoboSandboxError, SkillError
from robosandbox.types import Array, ObservedScene, Pose, SkillResult
from robosandbox.workcell.orders import OrderResult
from robosandbox.workcell.ros2.description import WORLD
from robosandbox.workcell.zenoh.messages import Picture

# Height of a thing's name above it, and of its letters, metres.
_LETTERS = 0.02


class Messages:
    """Makes messages.

    Args:
        kind: Returns the class of a message of that name, as `sensor_msgs/msg/Image`.
        world: Name of the frame that is this package's world.
        frames: Before the names of the cameras' frames.
    """

    def __init__(self, kind: Callable[[str], Any], *, world: str = WORLD, frames: str = "") -> None:
        self._kind, self._world, self._frames = kind, world, frames

    def _new(self, name: str, **values: Any) -> Any:
        return self._kind(name)(**values)

    def stamp(self, seconds: float) -> Any:
        """Return seconds since 1970 as a message."""
        whole = int(seconds)
        return self._new("builtin_interfaces/msg/Time", sec=whole, nanosec=int((seconds - whole) * 1e9))

    def header(self, seconds: float, frame: str | None = None) -> Any:
        """Return a header, in the world where no frame is named."""
        frame_id = self._world if frame is None else frame
        return self._new("std_msgs/msg/Header", stamp=self.stamp(seconds), frame_id=frame_id)

    def optical(self, camera: str) -> str:
        """Return the name of a camera's optical frame."""
        return f"{self._frames}{camera}_optical"

    def pose(self, value: Pose) -> Any:
        """Return a pose."""
        x, y, z, w = value.quat_xyzw
        return self._new(
            "geometry_msgs/msg/Pose",
            position=self._new("geometry_msgs/msg/Point", **dict(zip("xyz", value.xyz, strict=True))),
            orientation=self._new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w),
        )

    def transform(self, parent: str, child: str, xyz: Array, wxyz: Array, seconds: float) -> Any:
        """Return a transform from the child's frame into the parent's; metres, quaternion w, x, y, z."""
        made = self._new(
            "geometry_msgs/msg/TransformStamped", header=self.header(seconds, parent), child_frame_id=child
        )
        w, x, y, z = (float(value) for value in wxyz)
        made.transform.rotation = self._new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
        made.transform.translation = self._new(
            "geometry_msgs/msg/Vector3", **{axis: float(value) for axis, value in zip("xyz", xyz, strict=True)}
        )
        return made

    def mounted(self, parent: str, camera: str, place: Pose, seconds: float) -> Any:
        """Return the transform of a camera's optical frame from where it is mounted."""
        x, y, z, w = place.quat_xyzw
        return self.transform(parent, self.optical(camera), place.position, np.array([w, x, y, z]), seconds)

    def image(self, data: bytes, picture: Picture, kind: str) -> Any:
        """Return the bytes of a picture, RGB or depth in metres, as an image."""
        lens = picture.intrinsics
        encoding, size = ("rgb8", 3) if kind == "rgb" else ("32FC1", 4)
        made = self._new(
            "sensor_msgs/msg/Image", height=lens.height, width=lens.width, encoding=encoding, step=lens.width * size
        )
        made.header = self.header(picture.stamp, self.optical(picture.camera))
        # Of an array rclpy does not look at every byte.
        made.data = array("B", data)
        return made

    def camera_info(self, picture: Picture) -> Any:
        """Return the pinhole and lens that a picture was taken through."""
        lens = picture.intrinsics
        made = self._new(
            "sensor_msgs/msg/CameraInfo",
            height=lens.height,
            width=lens.width,
            distortion_model="plumb_bob",
            d=[*lens.distortion],
        )
        made.header = self.header(picture.stamp, self.optical(picture.camera))
        made.k = [lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0]
        made.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        made.p = [lens.fx, 0.0, lens.cx, 0.0, 0.0, lens.fy, lens.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
        return made

    def things(self, scene: ObservedScene, seconds: float) -> Any:
        """Return what is seen, and what is held."""
        made = self._new(
            "robosandbox_msgs/msg/Things",
            header=self.header(seconds),
            held=[name for name in scene.hands.values() if name],
        )
        for item in scene.objects:
            made.things.append(
                self._new(
                    "robosandbox_msgs/msg/Thing",
                    id=item.id,
                    kind=item.kind,
                    colour=item.colour,
                    pose=self.pose(item.pose),
                    size=[*item.size],
                    confidence=item.confidence,
                )
            )
        return made

    def markers(self, scene: ObservedScene, seconds: float) -> Any:
        """Return what is seen as shapes of RViz: boxes, balls and tubes, the box around it of all else, and its name above it."""
        marker = self._kind("visualization_msgs/msg/Marker")
        kinds = {"sphere": marker.SPHERE, "cylinder": marker.CYLINDER}
        cleared = marker(header=self.header(seconds), action=marker.DELETEALL)
        made = self._new("visualization_msgs/msg/MarkerArray", markers=[cleared])
        for number, item in enumerate(scene.objects):
            halves = item.shape.hull(item.size).half_extents
            body = marker(header=self.header(seconds), ns="things", id=number, type=kinds.get(item.kind, marker.CUBE))
            body.pose = self.pose(item.pose)
            body.scale = self._new(
                "geometry_msgs/msg/Vector3",
                **{axis: float(2.0 * value) for axis, value in zip("xyz", halves, strict=True)},
            )
            body.color = self._new("std_msgs/msg/ColorRGBA", **dict(zip("rgba", item.rgba, strict=True)))
            name = marker(
                header=self.header(seconds), ns="names", id=number, type=marker.TEXT_VIEW_FACING, text=item.id
            )
            name.pose = self.pose(item.pose)
            name.pose.position.z += float(halves[2]) + _LETTERS
            name.scale.z, name.color = _LETTERS, self._new("std_msgs/msg/ColorRGBA", r=1.0, g=1.0, b=1.0, a=1.0)
            made.markers += [body, name]
        return made


def said(event: object) -> str:
    """Return what a client is told of an event; nothing of most."""
    match event:
        case PhaseEntered(call, phase):
            return f"{call}: {phase}"
        case Planned(plan, _):
            return f"plan: {plan}"
        case SkillFailed(call, error):
            return f"{call}: {error.message}"
        case Thought(text):
            return text
        case _:
            return ""


def outcome(result: Any, came: SkillResult | OrderResult | RoboSandboxError) -> Any:
    """Fill in the result of an action with what came of it; one without a `code` leaves that out."""
    code, data = "", dict[str, Any]()
    match came:
        case SkillResult():
            result.success, result.message, data = True, "done", came.model_dump(mode="json")
        case OrderResult():
            result.success, data = came.failure is None, dict(came.data)
            words: Iterable[Any] = (data.get("answer"), came.failure and came.failure.message, data.get("detail"))
            result.message = next((word for word in words if isinstance(word, str) and word), "done")
            code = "" if came.failure is None else str(came.failure.code)
        case _:
            error = came if isinstance(came, SkillError | InternalError) else InvalidArgumentError(str(came))
            result.success, result.message, code = False, error.failure.message, str(error.failure.code)
            data = error_data(error.failure)
    result.data = json.dumps(data)
    if hasattr(result, "code"):
        result.code = code
    return result
