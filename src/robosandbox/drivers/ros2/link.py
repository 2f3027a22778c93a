# pyright: reportMissingImports=false
"""The link to a ROS 2 graph: joint states, trajectories, the gripper, pictures, transforms. The only module with rclpy in it."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, Literal

import numpy as np
import rclpy
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory, GripperCommand, ParallelGripperCommand
from geometry_msgs.msg import WrenchStamped
from rclpy.action import ActionClient, get_action_names_and_types
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.time import Time
from sensor_msgs.msg import CameraInfo, Image, JointState
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectoryPoint

from robosandbox.types import Array, Intrinsics, Pose, frozen_array
from robosandbox.values import frozen

_log = logging.getLogger(__name__)
# Publications that wait to be taken: of a topic on which several tell, as /tf, one each.
_DEPTH = 100
# Seconds between two looks at the graph while something is waited for.
_LOOK_SECONDS = 0.05
# Layouts of pixels: sensor_msgs' name, type and channels, and the order in which the channels are red, green, blue.
_COLOURS: Mapping[str, tuple[int, tuple[int, int, int]]] = {
    "rgb8": (3, (0, 1, 2)),
    "bgr8": (3, (2, 1, 0)),
    "rgba8": (4, (0, 1, 2)),
    "bgra8": (4, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
}
# Depth: type, and metres of one unit.
_DEPTHS: Mapping[str, tuple[str, float]] = {"32FC1": ("f4", 1.0), "16UC1": ("u2", 1e-3), "mono16": ("u2", 1e-3)}
# How far the length of a quaternion may be off 1 (tf2's own), and transforms may differ that are the same, metres and of a matrix.
_UNIT, _SAME = 1e-2, 1e-6
_ERROR_NAMES = {
    value: name
    for name, value in vars(FollowJointTrajectory.Result).items()
    if name.isupper() and isinstance(value, int)
}

Outcome = Literal["succeeded", "rejected", "cancelled", "aborted"]


@frozen(kw_only=True)
class Reading:
    """A joint as /joint_states told it.

    Attributes:
        time: When it was so, seconds of `time.monotonic`.
        position: rad or m.
        velocity: rad/s or m/s; None where it is not told, or told as NaN.
    """

    time: float
    position: float
    velocity: float | None


@frozen(kw_only=True)
class Shot:
    """A picture as it came.

    Attributes:
        time: When it was taken, seconds of `time.monotonic`.
        frame: The transform frame of its optical centre.
        pixels: (height, width, 3) uint8, or depth in metres (height, width) float32.
    """

    time: float
    frame: str
    pixels: Any


@frozen(kw_only=True)
class _Step:
    """A transform from a frame into its parent.

    Attributes:
        parent: Name of the frame that it leads to.
        pose: Of the frame in that one.
        told: When it was so, seconds of `time.monotonic`; infinity where it does not move.
    """

    parent: str
    pose: Pose
    told: float

    @property
    def moves(self) -> bool:
        """True of one that holds for a moment alone."""
        return self.told < math.inf

    def is_as(self, other: _Step) -> bool:
        """Tell whether it leads to the same place."""
        turn = np.abs(self.pose.rotation - other.pose.rotation).max()
        way = np.abs(self.pose.position - other.pose.position).max()
        return self.parent == other.parent and bool(max(turn, way) < _SAME)


class Sent:
    """A goal that was sent to an action.

    Attributes:
        accepted: Whether it was taken; None as long as there is no answer.
        outcome: How it ended; None before that.
        said: What the controller says of its end: the error's name and its own words.
        replaced: Whether another goal was sent after it, which ends it.
        took: How long the answer took, seconds; None as long as there is none.
        advanced: When its feedback last told of progress, seconds of `time.monotonic`; None where none does.

    Args:
        seconds: How long a trajectory is; its end is no progress.
    """

    def __init__(self, seconds: float = 0.0) -> None:
        self._sent, self._seconds = time.monotonic(), seconds
        self._came = 0.0  # how far it is by its feedback, seconds of the trajectory
        self.advanced: float | None = None
        self.took: float | None = None
        self.accepted: bool | None = None
        self.outcome: Outcome | None = None
        self.said: str = ""
        self.replaced: bool = False
        self._handle: Any = None
        self._unwanted = False

    def follow_up(self, asked: Any) -> Sent:
        """Take note of what comes of the request that was sent; return itself."""
        asked.add_done_callback(self._answered)
        return self

    def on_feedback(self, message: Any) -> None:
        """Take note of how far a controller is."""
        told = message.feedback.desired.time_from_start
        came = min(told.sec + 1e-9 * told.nanosec, self._seconds)
        if came > self._came:
            self._came, self.advanced = came, time.monotonic()

    def cancel(self) -> None:
        """Have it end, also when it is taken after this."""
        self._unwanted = True
        if self._handle is not None and self.outcome is None:
            self._handle.cancel_goal_async()

    def _answered(self, asked: Any) -> None:
        handle = asked.result()
        self.took = time.monotonic() - self._sent
        self._handle, self.accepted = handle, handle.accepted
        if not handle.accepted:
            self.outcome = "rejected"
            return
        handle.get_result_async().add_done_callback(self._ended)
        if self._unwanted:
            handle.cancel_goal_async()

    def _ended(self, asked: Any) -> None:
        came = asked.result()
        code = getattr(came.result, "error_code", 0)
        words = (_ERROR_NAMES.get(code, str(code)) if code else "", getattr(came.result, "error_string", ""))
        self.said = ": ".join(word for word in words if word)
        ends: dict[int, Outcome] = {GoalStatus.STATUS_SUCCEEDED: "succeeded", GoalStatus.STATUS_CANCELED: "cancelled"}
        self.outcome = ends.get(came.status, "aborted")


class RosLink:
    """A node in the user's graph, spun by a thread of its own; every value that it hands out is a plain one.

    Args:
        name: Of the node.
        joint_states: The topic.
        controller: Its action is `<controller>/follow_joint_trajectory`.
        gripper: The gripper's action; None without one.
        wrench: A topic of WrenchStamped; None without one.
        stamped: Whether stamps are by this computer's clock; else what is told is as old as its arrival.
        oldest: Seconds after which a transform that moves is not one any more.
        world: The transform frame that is the world of this package.
        cameras: Names before `/image_raw`, `/depth/image_raw` and `/camera_info`.

    Attributes:
        ended: Why nothing is heard any more, until `revive`; "" while its thread goes on.
    """

    def __init__(
        self,
        name: str,
        *,
        joint_states: str,
        controller: str,
        gripper: str | None,
        wrench: str | None,
        stamped: bool,
        oldest: float,
        world: str,
        cameras: Sequence[str],
    ) -> None:
        self._lock = threading.Lock()
        self._readings: dict[str, Reading] = {}
        # Joints that are told of without a position.
        self._unread: set[str] = set()
        self._steps: dict[str, _Step] = {}
        # Frames that are told of as fixed at two places, and why a camera's lens is not known, in words.
        self._disputed: dict[str, str] = {}
        self._lenses: dict[str, Intrinsics] = {}
        self._unknown_lenses: dict[str, str] = {}
        self._shots: dict[tuple[str, str], Shot] = {}
        self._force: tuple[float, str, Array] | None = None
        self._stamped, self._oldest, self._world, self._skew = stamped, oldest, world, 0.0  # of the last joint state
        self._wrench, self._cameras = wrench, cameras
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node(name, context=self._context)
        self._action = f"{controller}/follow_joint_trajectory"
        self._trajectories = ActionClient(self._node, FollowJointTrajectory, self._action)
        # With no goal named it ends every one, whoever sent it.
        self._stopping = self._node.create_client(CancelGoal, f"{self._action}/_action/cancel_goal")
        self._cancels: list[Any] = []
        self._gripper, self._fingers = gripper, None
        self._fingers_take: type[Any] | None = None
        listen = self._node.create_subscription
        listen(JointState, joint_states, self._on_joints, qos_profile_sensor_data)
        if wrench is not None:
            listen(WrenchStamped, wrench, self._on_wrench, qos_profile_sensor_data)
        if wrench is not None or cameras:
            kept = QoSProfile(depth=_DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            listen(TFMessage, "/tf", lambda message: self._on_transforms(message, moves=True), _DEPTH)
            listen(TFMessage, "/tf_static", lambda message: self._on_transforms(message, moves=False), kept)
        for camera in cameras:
            listen(CameraInfo, f"{camera}/camera_info", self._lens_of(camera), qos_profile_sensor_data)
            for kind, topic in (("rgb", "image_raw"), ("depth", "depth/image_raw")):
                listen(Image, f"{camera}/{topic}", self._shot_of(camera, kind), qos_profile_sensor_data)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self.ended: str = ""
        self._thread = self._begun()

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)

    def revive(self) -> None:
        """Listen again where its thread has ended."""
        if not self._thread.is_alive():
            self.ended = ""
            self._thread = self._begun()

    def _begun(self) -> threading.Thread:
        thread = threading.Thread(target=self._spin, name="ros2", daemon=True)
        thread.start()
        return thread

    # What is there.

    def missing(self, joints: Sequence[str], oldest: float, seconds: float) -> str:
        """Wait for all that is needed to be there; return what is not after so many seconds, in words, or "".

        Args:
            joints: Those that have to be told of.
            oldest: How old what is told of them may be, seconds.
            seconds: How long to wait.
        """
        end = time.monotonic() + seconds
        while missing := self._missing(joints, oldest):
            if time.monotonic() > end:
                return missing
            time.sleep(_LOOK_SECONDS)
        return ""

    def _missing(self, joints: Sequence[str], oldest: float) -> str:
        if self.ended:
            return self.ended
        with self._lock:
            told, unread = dict(self._readings), self._unread.intersection(joints)
        silent = [joint for joint in joints if joint not in told]
        if unread:
            return f"the position of {', '.join(sorted(unread))} is told as NaN: its state interface is not there"
        if silent:
            return f"nobody tells of {', '.join(silent)}; joint states come of {', '.join(told) or 'nothing'}"
        if abs(self._skew) > oldest:
            return (
                f"joint states are stamped {self._skew:.3f} s before they come, and {oldest:g} are allowed: set both computers' "
                "clocks by the same time; stamped=false where the stamps are of a simulation's clock"
            )
        newest = max((told[joint].time for joint in joints), default=math.inf)
        if (age := time.monotonic() - newest) > oldest:
            return f"the robot was last heard of {age:.3f} s ago, and {oldest:g} are allowed"
        if not self._trajectories.server_is_ready():
            return f"no controller serves {self._action}; {self._actions('control_msgs/action/FollowJointTrajectory')}"
        if self._gripper is not None and not self._fingers_ready(self._gripper):
            return f"nobody serves the gripper's action {self._gripper}; {self._actions('control_msgs/action/')}"
        if self._wrench is not None and self.force() is None:
            return self.numb()
        for camera in self._cameras:
            if missing := self._not_seen(camera):
                return missing
        return ""

    def _not_seen(self, camera: str) -> str:
        if self.lens(camera) is None:
            if camera in self._unknown_lenses:
                return self._unknown_lenses[camera]
            return f"nobody tells of {camera}/camera_info"
        for kind, topic in (("rgb", "image_raw"), ("depth", "depth/image_raw")):
            shot = self._shots.get((camera, kind))
            if shot is None:
                known = ", ".join(_COLOURS if kind == "rgb" else _DEPTHS)
                return f"no pictures of {known} come on {camera}/{topic}"
            if self.frame(shot.frame) is None:
                return self.astray(shot.frame)
        return ""

    def astray(self, frame: str) -> str:
        """Return why it is not known where a frame is."""
        way = self._way(frame)
        return way if isinstance(way, str) else f"{frame} was not known a moment ago"

    def _actions(self, kind: str) -> str:
        found = [name for name, types in get_action_names_and_types(self._node) if types[0].startswith(kind)]
        return f"there is {', '.join(found)}" if found else "nobody serves one of its kind"

    def _fingers_ready(self, gripper: str) -> bool:
        """Find out which of the two gripper actions is served."""
        if self._fingers is None:
            served = dict(get_action_names_and_types(self._node)).get(self._node.resolve_service_name(gripper), [])
            kinds = {f"control_msgs/action/{kind.__name__}": kind for kind in (ParallelGripperCommand, GripperCommand)}
            for kind in served:
                if kind in kinds:
                    self._fingers_take = kinds[kind]
                    self._fingers = ActionClient(self._node, kinds[kind], gripper)
                    break
        return self._fingers is not None and self._fingers.server_is_ready()

    # What is told.

    def readings(self, joints: Sequence[str]) -> tuple[Reading, ...]:
        """Return what was last told of joints, in their order; all of them have been told of."""
        with self._lock:
            return tuple(self._readings[joint] for joint in joints)

    def force(self) -> tuple[float, Array] | None:
        """Return when the last wrench was told and its force in the world, N, shape (3,); None before one came."""
        if self._force is None:
            return None
        told, frame, force = self._force
        pose = self.frame(frame)
        return None if pose is None else (told, frozen_array(pose[0].rotation @ force))

    def numb(self) -> str:
        """Return why the force in the world is not known."""
        return f"no wrench comes on {self._wrench}" if self._force is None else self.astray(self._force[1])

    def lens(self, camera: str) -> Intrinsics | None:
        """Return a camera's pinhole and lens; None before it was told."""
        return self._lenses.get(camera)

    def shot(self, camera: str, kind: Literal["rgb", "depth"]) -> Shot | None:
        """Return the last picture of a camera; None before one came."""
        return self._shots.get((camera, kind))

    def frame(self, name: str) -> tuple[Pose, bool] | None:
        """Return where a frame is in the world, and whether it moves; None where that is not known, as `astray` tells."""
        way = self._way(name)
        return None if isinstance(way, str) else way

    def _way(self, frame: str) -> tuple[Pose, bool] | str:
        """Return where a frame is in the world, and whether it moves, or why that is not known."""
        pose, moves, name = Pose(xyz=(0.0, 0.0, 0.0), quat_xyzw=(0.0, 0.0, 0.0, 1.0)), False, frame
        with self._lock:
            for _ in range(len(self._steps) + 1):
                if name == self._world:
                    return pose, moves
                if name in self._disputed:
                    return self._disputed[name]
                if (step := self._steps.get(name)) is None:
                    break
                if (age := time.monotonic() - step.told) > self._oldest:
                    return f"/tf told {age:.3f} s ago where {name} is, and {self._oldest:g} are allowed"
                name, pose, moves = step.parent, step.pose @ pose, moves or step.moves
        return f"/tf leads from {frame or 'a message without a frame'} to no {self._world}; publish where that is"

    # What is sent.

    def follow(self, joints: Sequence[str], rows: Array, velocities: Array | None, seconds: Array) -> Sent:
        """Send a trajectory, which begins when it comes.

        Args:
            joints: Names.
            rows: Configurations, shape (t, n).
            velocities: Likewise, or None where the controller is to find them.
            seconds: From the beginning to each row, shape (t,).
        """
        goal = FollowJointTrajectory.Goal()
        goal.trajectory.joint_names = [*joints]
        for number, (row, at) in enumerate(zip(rows.tolist(), seconds.tolist(), strict=True)):
            point = JointTrajectoryPoint(positions=row, time_from_start=_duration(at))
            if velocities is not None:
                point.velocities = velocities[number].tolist()
            goal.trajectory.points.append(point)
        sent = Sent(float(seconds[-1]))
        return sent.follow_up(self._trajectories.send_goal_async(goal, feedback_callback=sent.on_feedback))

    def grip(self, joint: str, position: float, effort: float | None) -> Sent:
        """Send the gripper to a position, rad or m, with an effort at most, N or N m, or as much as its controller likes."""
        assert self._fingers is not None and self._fingers_take is not None, "opened without a gripper"
        goal = self._fingers_take.Goal()
        if self._fingers_take is ParallelGripperCommand:
            goal.command = JointState(name=[joint], position=[position], effort=[] if effort is None else [effort])
        else:
            goal.command.position, goal.command.max_effort = position, effort or 0.0
        return Sent().follow_up(self._fingers.send_goal_async(goal))

    def cancel_all(self) -> None:
        """End every trajectory of the controller, whoever sent it; it holds then."""
        if self._stopping.service_is_ready():
            self._cancels = [one for one in self._cancels if not one.done()]
            self._cancels.append(self._stopping.call_async(CancelGoal.Request()))

    @property
    def is_cancelling(self) -> bool:
        """True until every cancel is answered: one would end what is sent meanwhile."""
        return any(not one.done() for one in self._cancels)

    def forget_cancels(self) -> None:
        """Wait for no answer to a cancel any more: the controller that was asked is gone."""
        self._cancels = []

    # In the node's thread.

    def _spin(self) -> None:
        try:
            with suppress(ExternalShutdownException):
                self._executor.spin()
        except Exception as error:
            _log.exception("fault in the thread that listens to ROS 2")
            self.ended = (
                f"nothing is heard of ROS 2 any more: a message could not be taken in ({type(error).__name__}: {error})"
            )

    def _on_joints(self, message: Any) -> None:
        told, self._skew = self._told(message.header)
        speeds = message.velocity if len(message.velocity) == len(message.name) else [None] * len(message.name)
        with self._lock:
            for name, position, speed in zip(message.name, message.position, speeds, strict=False):
                # A joint_state_broadcaster tells of an interface that is not there as NaN. Without a position there is no
                # reading, so that the last one grows old.
                if not math.isfinite(position):
                    self._unread.add(name)
                    continue
                self._unread.discard(name)
                known = speed is not None and math.isfinite(speed)
                self._readings[name] = Reading(time=told, position=position, velocity=speed if known else None)

    def _told(self, header: Any) -> tuple[float, float]:
        """Return when a message was true, by `time.monotonic`, where the future is now, and how long ago its stamp says, seconds."""
        now = time.monotonic()
        if not self._stamped or not (header.stamp.sec or header.stamp.nanosec):
            return now, 0.0
        skew = (self._node.get_clock().now() - Time.from_msg(header.stamp)).nanoseconds * 1e-9
        return now - max(0.0, skew), skew

    def _on_wrench(self, message: Any) -> None:
        force, (told, _) = message.wrench.force, self._told(message.header)
        self._force = told, message.header.frame_id, np.array([force.x, force.y, force.z])

    def _on_transforms(self, message: Any, *, moves: bool) -> None:
        with self._lock:
            for one in message.transforms:
                child, pose = one.child_frame_id, _pose(one.transform)
                if pose is None:
                    continue
                step = _Step(
                    parent=one.header.frame_id, pose=pose, told=self._told(one.header)[0] if moves else math.inf
                )
                before = self._steps.get(child)
                if before is not None and not moves and not before.moves and not step.is_as(before):
                    self._disputed[child] = (
                        f"/tf_static has {child} twice: {_xyz(before.pose)} in {before.parent} and {_xyz(pose)} in "
                        f"{step.parent}; have it published once, or name another frame"
                    )
                self._steps[child] = step

    def _lens_of(self, camera: str) -> Callable[[Any], None]:
        def on_info(message: Any) -> None:
            lens = _lens(message)
            if isinstance(lens, str):
                self._lenses.pop(camera, None)
                self._unknown_lenses[camera] = f"{camera}/camera_info {lens}"
            else:
                self._lenses[camera] = lens

        return on_info

    def _shot_of(self, camera: str, kind: str) -> Callable[[Any], None]:
        def on_image(message: Any) -> None:
            pixels = _pixels(message, kind)
            if pixels is not None:
                told, _ = self._told(message.header)
                self._shots[camera, kind] = Shot(time=told, frame=message.header.frame_id, pixels=pixels)

        return on_image


def _pose(transform: Any) -> Pose | None:
    """Return a transform as a pose; None where it is none, as tf2 has it."""
    where, turn = transform.translation, transform.rotation
    xyz, quat = (where.x, where.y, where.z), (turn.x, turn.y, turn.z, turn.w)
    if not np.isfinite([*xyz, *quat]).all() or abs(math.hypot(*quat) - 1.0) > _UNIT:
        return None
    return Pose(xyz=xyz, quat_xyzw=quat)


def _xyz(pose: Pose) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in pose.xyz) + ")"


def _lens(message: Any) -> Intrinsics | str:
    """Return the pinhole and lens that a camera info tells of, or why none is known from it."""
    k, d = [*message.k], [*message.d]
    if not np.isfinite([*k, *d]).all() or min(k[0], k[4]) <= 0.0 or not message.width or not message.height:
        return f"tells of no calibrated camera: fx is {k[0]:g}, fy {k[4]:g}, and both are above 0 pixels"
    if any(d) and (message.distortion_model != "plumb_bob" or any(d[5:])):
        return (
            f"tells of a lens of the model {message.distortion_model or 'without a name'}, and only plumb_bob is known here: "
            "publish rectified pictures, with a d of zeros"
        )
    d += [0.0] * 5
    return Intrinsics(
        width=message.width,
        height=message.height,
        fx=k[0],
        fy=k[4],
        cx=k[2],
        cy=k[5],
        distortion=(d[0], d[1], d[2], d[3], d[4]),
    )


def _pixels(message: Any, kind: str) -> Any:
    """Return an image's pixels as `Shot` has them; None where they are of another layout, or not all there."""
    if kind == "rgb" and message.encoding in _COLOURS:
        channels, order = _COLOURS[message.encoding]
        rows = _rows(message, channels)
        if rows is not None:
            return np.ascontiguousarray(rows.reshape(message.height, message.width, channels)[..., list(order)])
    elif kind == "depth" and message.encoding in _DEPTHS:
        number, unit = _DEPTHS[message.encoding]
        rows = _rows(message, np.dtype(number).itemsize)
        if rows is not None:
            endian = ">" if message.is_bigendian else "<"
            metres = np.frombuffer(rows.tobytes(), dtype=endian + number).reshape(message.height, message.width)
            # What it does not see is 0 here, and is not a number there.
            return np.nan_to_num(metres * unit, nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)
    return None


def _rows(message: Any, size: int) -> Any:
    """Return an image's bytes (height, width * size) without what pads its rows; None where its fields contradict one another.

    Args:
        message: The image.
        size: Bytes of a pixel.
    """
    width = message.width * size
    if not width or not message.height or message.step < width or len(message.data) != message.height * message.step:
        return None
    return np.frombuffer(message.data, dtype=np.uint8).reshape(message.height, message.step)[:, :width]


def _duration(seconds: float) -> Any:
    whole = int(seconds)
    return Duration(sec=whole, nanosec=round((seconds - whole) * 1e9) % 1_000_000_000)
