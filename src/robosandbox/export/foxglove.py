"""MCAP files that Foxglove and its like show: transforms, pictures, joint states and the log, as JSON messages.

The schemas are Foxglove's well-known ones (https://docs.foxglove.dev/docs/sdk/schemas), by name and field.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from robosandbox.errors import InputError
from robosandbox.export.pictures import pictures
from robosandbox.recording.drawing import contact_force
from robosandbox.recording.episode import RecordedEpisode
from robosandbox.recording.settings import rows_per_frame
from robosandbox.sim.cameras import encode
from robosandbox.types import Array

_TEXT: dict[str, Any] = {"type": "string"}
_NUMBER: dict[str, Any] = {"type": "number"}
_INTEGER: dict[str, Any] = {"type": "integer"}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


_TIME = _object(sec=_INTEGER, nsec=_INTEGER)
_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object(position=_VECTOR, orientation=_QUATERNION)
_TRANSFORM = _object(
    timestamp=_TIME, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_VECTOR, rotation=_QUATERNION
)
_COLOR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_CUBE = _object(pose=_POSE, size=_VECTOR, color=_COLOR)
_SPHERE = _object(pose=_POSE, size=_VECTOR, color=_COLOR)
_CYLINDER = _object(pose=_POSE, size=_VECTOR, bottom_scale=_NUMBER, top_scale=_NUMBER, color=_COLOR)
_NUMBERS = {"type": "array", "items": _NUMBER}
_ENTITY = _object(
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_object(sec=_INTEGER, nsec=_INTEGER),
    frame_locked={"type": "boolean"},
    metadata={"type": "array", "items": _object(key=_TEXT, value=_TEXT)},
    **{
        f"{name}": {"type": "array", "items": item}
        for name, item in {
            "arrows": _object(),
            "cubes": _CUBE,
            "spheres": _SPHERE,
            "cylinders": _CYLINDER,
            "lines": _object(),
            "triangles": _object(),
            "texts": _object(),
            "models": _object(),
        }.items()
    },
)
SCHEMAS: dict[str, dict[str, Any]] = {
    "foxglove.FrameTransforms": _object(transforms={"type": "array", "items": _TRANSFORM}),
    "foxglove.PoseInFrame": _object(timestamp=_TIME, frame_id=_TEXT, pose=_POSE),
    "foxglove.SceneUpdate": _object(
        deletions={"type": "array", "items": _object(timestamp=_TIME, type=_INTEGER, id=_TEXT)},
        entities={"type": "array", "items": _ENTITY},
    ),
    "foxglove.CompressedImage": _object(
        timestamp=_TIME, frame_id=_TEXT, data={"type": "string", "contentEncoding": "base64"}, format=_TEXT
    ),
    "foxglove.Log": _object(timestamp=_TIME, level=_INTEGER, message=_TEXT, name=_TEXT, file=_TEXT, line=_INTEGER),
    # Not Foxglove's: what its plots draw by path, such as /state.q[3].
    "robosandbox.State": _object(
        timestamp=_TIME,
        names={"type": "array", "items": _TEXT},
        q=_NUMBERS,
        qd=_NUMBERS,
        action=_NUMBERS,
        gripper=_NUMBERS,
        action_gripper=_NUMBER,
        contact_force=_NUMBER,
        skill=_TEXT,
        phase=_TEXT,
    ),
}
_INFO, _ERROR = 2, 4
_NANO = 1_000_000_000


def export_mcap(
    episode: RecordedEpisode, target: Path, *, fps: float, cameras: Sequence[str], size: tuple[int, int]
) -> None:
    """Write an episode as an MCAP file: state at the control rate, pictures at `fps`.

    Args:
        episode: What was recorded.
        target: The file; it must not exist.
        fps: Pictures per simulated second.
        cameras: Whose pictures go in.
        size: (height, width) of the pictures, pixels.

    Raises:
        InputError: The file exists, or no such camera.
    """
    from mcap.writer import Writer

    if target.exists():
        raise InputError(f"{str(target)!r} exists already; name another file, or remove it")
    every = rows_per_frame(fps, episode.meta.control_timestep, "--fps")
    new = target.with_name(f".{target.name}.new")
    try:
        with new.open("wb") as stream:
            writer = Writer(stream)
            writer.start(library="robosandbox")
            _Log(writer, episode).write(cameras, every, size)
            writer.finish()
        new.replace(target)
    finally:
        new.unlink(missing_ok=True)


class _Log:
    """The messages of an episode, stamped with the time at which it began plus simulated time."""

    def __init__(self, writer: Any, episode: RecordedEpisode) -> None:
        self._writer = writer
        self._episode = episode
        self._begun = int(episode.meta.started.timestamp() * _NANO)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: dict[str, int] = {}

    def write(self, cameras: Sequence[str], every: int, size: tuple[int, int]) -> None:
        episode = self._episode
        episode_meta = episode.meta.model_dump(mode="json", exclude={"checkpoint", "task", "skills", "robot"})
        self._writer.add_metadata("robosandbox", {key: json.dumps(value) for key, value in episode_meta.items()})
        shown = iter(pictures(episode, cameras, every, size)) if cameras else iter(())
        events = episode.events()
        forces = contact_force(episode)
        q, qd, action, tcp = episode["q"], episode["qd"], episode["action_q"], episode["tcp_pose"]
        gripper = episode.get("gripper")
        closing = episode.get("action_gripper")
        skills, phases, poses = episode["skill"], episode["phase"], episode.object_poses
        self._scene()
        for row in range(len(episode)):
            at = self._at(row)
            while events and events[0]["row"] <= row:
                self._event(events.pop(0), at)
            self._send(
                "/state",
                "robosandbox.State",
                at,
                {
                    "names": list(episode.meta.robot.joints),
                    "q": q[row].tolist(),
                    "qd": qd[row].tolist(),
                    "action": action[row].tolist(),
                    "gripper": gripper[row].tolist() if gripper is not None else [],
                    "action_gripper": float(closing[row]) if closing is not None else 0.0,
                    "contact_force": float(forces[row]),
                    "skill": str(skills[row]),
                    "phase": str(phases[row]),
                },
            )
            named = [("tcp", tcp[row]), *zip(episode.meta.objects, poses[row], strict=True)]
            self._send("/tf", "foxglove.FrameTransforms", at, {"transforms": [_transform(n, p, at) for n, p in named]})
            self._send("/tcp", "foxglove.PoseInFrame", at, {"frame_id": "world", "pose": _pose(tcp[row])})
            if cameras and row % every == 0:
                for camera, picture in next(shown, {}).items():
                    data = base64.b64encode(encode(picture, "jpeg")).decode()
                    message = {"frame_id": camera, "data": data, "format": "jpeg"}
                    self._send(f"/camera/{camera}", "foxglove.CompressedImage", at, message)
        for event in events:
            self._event(event, self._at(len(episode) - 1))

    def _at(self, row: int) -> int:
        return self._begun + round(float(self._episode.seconds[row]) * _NANO)

    def _scene(self) -> None:
        """Draw the objects, each in its own moving frame."""
        at = self._at(0)
        entities = [_entity(item, at) for item in self._episode.meta.task["scene"]["objects"]]
        self._send("/scene", "foxglove.SceneUpdate", at, {"deletions": [], "entities": entities}, stamped=False)

    def _event(self, event: dict[str, Any], at: int) -> None:
        level = _ERROR if event["event"] == "skill_failed" else _INFO
        content = {key: value for key, value in event.items() if key not in ("event", "time", "row", "stamp")}
        message = f"{event['event']} {json.dumps(content)}" if content else event["event"]
        self._send(
            "/log", "foxglove.Log", at, {"level": level, "message": message, "name": "agent", "file": "", "line": 0}
        )

    def _send(self, topic: str, schema: str, at: int, message: dict[str, Any], *, stamped: bool = True) -> None:
        if topic not in self._channels:
            if schema not in self._schemas:
                document = {"title": schema, **SCHEMAS[schema]}
                self._schemas[schema] = self._writer.register_schema(
                    name=schema, encoding="jsonschema", data=json.dumps(document).encode()
                )
            self._channels[topic] = self._writer.register_channel(
                topic=topic, message_encoding="json", schema_id=self._schemas[schema]
            )
        if stamped:
            message = {"timestamp": _stamp(at), **message}
        if schema == "foxglove.FrameTransforms":
            message.pop("timestamp")
        number = self._counts[topic] = self._counts.get(topic, -1) + 1
        self._writer.add_message(
            channel_id=self._channels[topic],
            log_time=at,
            publish_time=at,
            sequence=number,
            data=json.dumps(message).encode(),
        )


def _stamp(at: int) -> dict[str, int]:
    return {"sec": at // _NANO, "nsec": at % _NANO}


def _vector(values: Sequence[float] | Array) -> dict[str, float]:
    return dict(zip("xyz", (float(value) for value in values), strict=True))


def _quaternion(values: Sequence[float] | Array) -> dict[str, float]:
    return dict(zip("xyzw", (float(value) for value in values), strict=True))


def _pose(values: Array) -> dict[str, Any]:
    return {"position": _vector(values[:3]), "orientation": _quaternion(values[3:])}


def _transform(name: str, pose: Array, at: int) -> dict[str, Any]:
    return {
        "timestamp": _stamp(at),
        "parent_frame_id": "world",
        "child_frame_id": name,
        "translation": _vector(pose[:3]),
        "rotation": _quaternion(pose[3:]),
    }


def _entity(item: dict[str, Any], at: int) -> dict[str, Any]:
    """Return an object of the scene as primitives in its own frame; a mesh or container has a frame and no body."""
    size = item["size"]
    colour = dict(zip("rgba", item["rgba"], strict=True))
    middle = {"position": _vector((0.0, 0.0, 0.0)), "orientation": _quaternion((0.0, 0.0, 0.0, 1.0))}
    cubes, spheres, cylinders = [], [], []
    match item["kind"]:
        case "box":
            cubes.append({"pose": middle, "size": _vector([2.0 * half for half in size]), "color": colour})
        case "sphere":
            spheres.append({"pose": middle, "size": _vector([2.0 * size[0]] * 3), "color": colour})
        case "cylinder" | "capsule":
            extent = [2.0 * size[0], 2.0 * size[0], 2.0 * size[1]]
            scales = {"bottom_scale": 1.0, "top_scale": 1.0}
            cylinders.append({"pose": middle, "size": _vector(extent), **scales, "color": colour})
        case _:
            pass
    return {
        "timestamp": _stamp(at),
        "frame_id": item["id"],
        "id": item["id"],
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [{"key": "kind", "value": item["kind"]}],
        "arrows": [],
        "cubes": cubes,
        "spheres": spheres,
        "cylinders": cylinders,
        "lines": [],
        "triangles": [],
        "texts": [],
        "models": [],
    }
