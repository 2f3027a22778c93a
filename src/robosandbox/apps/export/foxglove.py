"""MCAP files that Foxglove and its like show: the arm and the things moving, pictures, joint states and the log.

The messages are Foxglove's own (https://docs.foxglove.dev/docs/sdk/schemas), as the package foxglove-schemas-protobuf has
them; what they have no message for is on /state, as JSON.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from robosandbox.apps.export.bodies import entities
from robosandbox.apps.export.frames import WORLD, Frames, camera_frame, pose, transform
from robosandbox.apps.export.pictures import pictures
from robosandbox.errors import InputError
from robosandbox.sim.sensors import perfect_intrinsics
from robosandbox.sim.step_recorder import column_of
from robosandbox.sim.world import World
from robosandbox.types import Array
from robosandbox.workcell.pictures import encode
from robosandbox.workcell.recording.drawing import contact_force, world_of
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.settings import rows_per_frame

_TEXT, _NUMBER = {"type": "string"}, {"type": "number"}
_NUMBERS = {"type": "array", "items": _NUMBER}
# What Foxglove's plots draw by path, such as /state.action[3], and what no message of Foxglove's holds.
STATE_SCHEMA: dict[str, Any] = {
    "title": "robosandbox.State",
    "type": "object",
    "properties": {
        "action": _NUMBERS,
        "action_gripper": _NUMBER,
        "contact_force": {"type": ["number", "null"]},
        "skill": _TEXT,
        "phase": _TEXT,
    },
}
# Nanoseconds per second, as in MCAP's time stamps.
_NANO = 1_000_000_000
# Columns of a recorded pose (x, y, z, quaternion xyzw) in the order w, x, y, z, as of MuJoCo's quaternions.
_WXYZ = [6, 3, 4, 5]


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
        InputError: The file exists, there is no such camera, or the episode's task cannot be loaded any more.
    """
    if target.exists():
        raise InputError(f"{str(target)!r} exists already; name another file, or remove it")
    every = rows_per_frame(fps, episode.meta.control_timestep, "--fps")
    world = world_of(episode)
    for camera in cameras:
        if camera not in world.cameras:
            raise InputError(f"camera {camera!r} is not one of {', '.join(world.cameras)}")
    with _file(target) as writer:
        _EpisodeLog(writer, episode, world).write(cameras, every, size)


@contextmanager
def _file(target: Path) -> Iterator[Writer]:
    """Open an MCAP file that appears under its name when it is whole."""
    new = target.with_name(f".{target.name}.new")
    try:
        with new.open("wb") as stream:
            writer = Writer(stream)
            writer.start(library="robosandbox")
            yield writer
            writer.finish()
        new.replace(target)
    finally:
        new.unlink(missing_ok=True)


class _EpisodeLog:
    """The messages of an episode, stamped with the time at which it began plus simulated time."""

    def __init__(self, writer: Writer, episode: RecordedEpisode, world: World) -> None:
        self._writer = writer
        self._episode = episode
        self._world = world
        self._begun = int(episode.meta.started.timestamp() * _NANO)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._counts: dict[str, int] = {}

    def write(self, cameras: Sequence[str], every: int, size: tuple[int, int]) -> None:
        episode = self._episode
        meta = episode.meta.model_dump(mode="json", exclude={"checkpoint", "task", "skills", "arms"})
        self._writer.add_metadata("robosandbox", {key: json.dumps(value) for key, value in meta.items()})
        shown = iter(pictures(episode, cameras, every, size)) if cameras else iter(())
        events = episode.events()
        frames = Frames(self._world, cameras)
        qpos, arms = episode["qpos"], [_RecordedArm(episode, arm) for arm in episode.meta.arms]
        forces, skills, phases = contact_force(episode), episode["skill"], episode["phase"]
        self._scene()
        for row in range(len(episode)):
            at = self._at(row)
            stamp = _stamp(at)
            while events and events[0]["row"] <= row:
                self._event(events.pop(0), at)
            hands = [transform(WORLD, arm.topic("tcp"), *arm.tcp(row), stamp) for arm in arms]
            self._send("/tf", FrameTransforms(transforms=[*frames.at(qpos[row], stamp), *hands]), at)
            joints = [joint for arm in arms for joint in arm.joints(row)]
            self._send("/joint_states", JointStates(timestamp=stamp, joints=joints), at)
            force = float(forces[row])
            said = {
                "contact_force": force if np.isfinite(force) else None,
                "skill": str(skills[row]),
                "phase": str(phases[row]),
            }
            for arm in arms:
                here = PoseInFrame(timestamp=stamp, frame_id=WORLD, pose=pose(*arm.tcp(row)))
                self._send(f"/{arm.topic('tcp')}", here, at)
                self._send(f"/{arm.topic('state')}", {**arm.commands(row), **said}, at)
            if cameras and row % every == 0:
                for camera, picture in next(shown, {}).items():
                    self._picture(camera, picture, at)
        for event in events:
            self._event(event, self._at(len(episode) - 1))

    def _at(self, row: int) -> int:
        return self._begun + round(float(self._episode.seconds[row]) * _NANO)

    def _scene(self) -> None:
        """Draw every body once; the frames carry them from then on."""
        at = self._at(0)
        kinds = {item["id"]: item["kind"] for item in self._episode.meta.task["scene"]["objects"]}
        self._send("/scene", SceneUpdate(entities=list(entities(self._world, kinds, _stamp(at)))), at)

    def _picture(self, camera: str, picture: np.ndarray[Any, np.dtype[np.uint8]], at: int) -> None:
        frame, stamp = camera_frame(camera), _stamp(at)
        data = encode(picture, "jpeg")
        image = CompressedImage(timestamp=stamp, frame_id=frame, data=data, format="jpeg")
        self._send(f"/camera/{camera}/image", image, at)
        model = self._world.model
        fovy = np.radians(model.cam_fovy[model.camera(self._world.cameras[camera]).id])
        lens = perfect_intrinsics((picture.shape[0], picture.shape[1]), float(fovy))
        matrix = [lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0]
        calibration = CameraCalibration(
            timestamp=stamp,
            frame_id=frame,
            width=lens.width,
            height=lens.height,
            distortion_model="plumb_bob",
            D=lens.distortion,
            K=matrix,
            R=np.eye(3).ravel().tolist(),
            P=[*matrix[:3], 0.0, *matrix[3:6], 0.0, *matrix[6:], 0.0],
        )
        self._send(f"/camera/{camera}/calibration", calibration, at)

    def _event(self, event: dict[str, Any], at: int) -> None:
        level = Log.ERROR if event["event"] == "skill_failed" else Log.INFO
        content = {key: value for key, value in event.items() if key not in ("event", "time", "row", "stamp")}
        message = f"{event['event']} {json.dumps(content)}" if content else event["event"]
        self._send("/log", Log(timestamp=_stamp(at), level=level, message=message, name="agent"), at)

    def _send(self, topic: str, message: Message | dict[str, Any], at: int) -> None:
        if topic not in self._channels:
            self._channels[topic] = self._open(topic, message)
        number = self._counts[topic] = self._counts.get(topic, -1) + 1
        self._writer.add_message(
            channel_id=self._channels[topic],
            log_time=at,
            publish_time=at,
            sequence=number,
            data=json.dumps(message).encode() if isinstance(message, dict) else message.SerializeToString(),
        )

    def _open(self, topic: str, message: Message | dict[str, Any]) -> int:
        name = STATE_SCHEMA["title"] if isinstance(message, dict) else type(message).DESCRIPTOR.full_name
        if name not in self._schemas:
            if isinstance(message, dict):
                data = json.dumps(STATE_SCHEMA).encode()
                self._schemas[name] = self._writer.register_schema(name=name, encoding="jsonschema", data=data)
            else:
                self._schemas[name] = register_schema(self._writer, type(message))
        encoding = "json" if isinstance(message, dict) else "protobuf"
        channel: int = self._writer.register_channel(
            topic=topic, message_encoding=encoding, schema_id=self._schemas[name]
        )
        return channel


class _RecordedArm:
    """State and commands of one arm by row; of several arms, topics and joints have the arm's name before theirs."""

    def __init__(self, episode: RecordedEpisode, arm: str) -> None:
        robot = episode.meta.arms[arm]
        self._arm = arm
        self._q, self._qd, self._tcp = (episode[column_of(arm, name)] for name in ("q", "qd", "tcp_pose"))
        # Of the gripper the value of its primary joint comes first.
        self._gripper = episode.of_arm(arm, "gripper")
        self._action, self._closing = episode.of_arm(arm, "action_q"), episode.of_arm(arm, "action_gripper")
        self._names = [self.topic(name) for name in robot.joints]
        self._finger = self.topic((robot.sidecar.get("gripper") or {}).get("primary_joint") or "gripper")

    def topic(self, name: str) -> str:
        """Return a name as it is told of this arm."""
        return column_of(self._arm, name)

    def tcp(self, row: int) -> tuple[Array, Array]:
        """Return the TCP's place, metres, and its quaternion w, x, y, z."""
        return self._tcp[row][:3], self._tcp[row][_WXYZ]

    def joints(self, row: int) -> Iterator[JointState]:
        """Yield the states of the arm's joints, and of the primary joint of its gripper."""
        for name, q, qd in zip(self._names, self._q[row].tolist(), self._qd[row].tolist(), strict=True):
            yield JointState(name=name, position=q, velocity=qd)
        if self._gripper is not None:
            yield JointState(name=self._finger, position=float(self._gripper[row][0]))

    def commands(self, row: int) -> dict[str, Any]:
        """Return what the arm and its gripper were sent."""
        return {
            "action": self._action[row].tolist() if self._action is not None else [],
            "action_gripper": float(self._closing[row]) if self._closing is not None else 0.0,
        }


def _stamp(at: int) -> Timestamp:
    return Timestamp(seconds=at // _NANO, nanos=at % _NANO)
