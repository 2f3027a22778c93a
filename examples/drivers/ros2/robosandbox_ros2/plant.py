"""A robot for tests: MuJoCo behind a trajectory controller and a gripper controller of rclpy's own, in real time.

    python -m robosandbox_ros2.plant FOLDER [--gripper-action parallel|plain] [--path-tolerance RAD] ...

FOLDER has `scene.pickle` (a `Scene`, what to feel, and where the arm begins) and gets `referee`, a socket over which the true state
is told and faults are made: never anything that the driver under test could hear. The controller does what ros2_control's
JointTrajectoryController does as it comes: a goal begins at the next tick where the arm is measured to be, with its measured speed,
and goes by cubics through points with speeds and by lines through others; a new goal replaces the one before it; after a cancel the
arm is held where it is measured to be, at once (`decelerate_on_cancel` is off); tolerances abort with a code, and what is no
trajectory of its joints is rejected. Its clock counts ticks, so that a process which comes late moves nothing faster.
"""

from __future__ import annotations

import argparse
import os
import pickle
import threading
import time
from array import array
from collections.abc import Callable
from itertools import count, pairwise
from multiprocessing.connection import Listener
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time as Stamp
from control_msgs.action import FollowJointTrajectory, GripperCommand, ParallelGripperCommand
from geometry_msgs.msg import TransformStamped, WrenchStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image, JointState
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectoryPoint

from robosandbox.sim.opening import open_mujoco
from robosandbox.types import Pose
from robosandbox.workcell.pictures import photographer

# Seconds of a tick of the controllers, as controller managers have them.
TICK = 0.01
# (height, width) of pictures, pixels, as depth cameras have them.
PICTURE = (480, 640)
# Ticks between two feedbacks.
_FEEDBACK_TICKS = 5
# Ticks that are made up for at once where the process was late.
_MAKE_UP = 5
# Pictures a second, as far as they can be drawn.
_PICTURES_HZ = 5.0
_RESULT = FollowJointTrajectory.Result


class Follower:
    """A trajectory that is followed: rows, when each is due, and what tells its client of the end.

    Args:
        handle: The goal's.
        joints: Of the arm.
        start: Where the arm is measured to be, rad or m, shape (n,).
        speed: How fast, likewise.
        began: Seconds of the controller's clock.
        number: How many goals there were, with this one.
    """

    def __init__(
        self, handle: Any, joints: list[str], start: np.ndarray, speed: np.ndarray, began: float, number: int
    ) -> None:
        points = handle.request.trajectory.points
        order = [handle.request.trajectory.joint_names.index(joint) for joint in joints]
        seconds = [point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in points]
        rows = [np.array(point.positions)[order] for point in points]
        speeds = [np.array(point.velocities)[order] for point in points if len(point.velocities)]
        by_cubics = len(speeds) == len(rows)
        if seconds[0] > 0.0:
            seconds, rows, speeds = [0.0, *seconds], [start, *rows], [speed, *speeds]
        self.handle, self.began, self.number = handle, began, number
        self.seconds, self.rows = np.array(seconds), np.array(rows)
        self.speeds = np.array(speeds) if by_cubics else None
        self.ended = threading.Event()
        self.code, self.said, self.cancelled = _RESULT.SUCCESSFUL, "", False

    def at(self, now: float) -> tuple[np.ndarray, np.ndarray]:
        """Return where the joints are to be, and how fast."""
        due = max(0.0, now - self.began)
        if due >= self.seconds[-1]:
            return self.rows[-1], np.zeros(self.rows.shape[1])
        k = int(np.searchsorted(self.seconds, due, side="right")) - 1
        span, way = self.seconds[k + 1] - self.seconds[k], self.rows[k + 1] - self.rows[k]
        share = (due - self.seconds[k]) / span
        if self.speeds is None:
            return self.rows[k] + share * way, way / span
        first, last = span * self.speeds[k : k + 2]
        second, third = 3.0 * way - 2.0 * first - last, first + last - 2.0 * way
        row = self.rows[k] + share * (first + share * (second + share * third))
        return row, (first + share * (2.0 * second + 3.0 * share * third)) / span

    def feedback(self, now: float) -> Any:
        """Return where it is by the controller's clock."""
        row, speed = self.at(now)
        told, due = FollowJointTrajectory.Feedback(), min(now - self.began, float(self.seconds[-1]))
        told.desired = JointTrajectoryPoint(
            positions=row.tolist(), velocities=np.broadcast_to(speed, row.shape).tolist()
        )
        told.desired.time_from_start = Duration(seconds=max(0.0, due)).to_msg()
        return told

    def end(self, code: int = _RESULT.SUCCESSFUL, said: str = "", *, cancelled: bool = False) -> None:
        """Take note that it is over, and tell its client."""
        self.code, self.said, self.cancelled = code, said, cancelled
        self.ended.set()


class Plant:
    """The simulated robot, its controllers, and the node in which they are.

    Args:
        folder: Where the scene is, and the socket is made.
        gripper_action: "parallel" or "plain".
        path_tolerance: How far a joint may be off its path, rad or m; 0 does not look.
    """

    def __init__(self, folder: Path, *, gripper_action: str, path_tolerance: float) -> None:
        scene, felt, start_q = pickle.loads((folder / "scene.pickle").read_bytes())
        self.sim = open_mujoco(scene, control_timestep=TICK, render_size=PICTURE, felt=felt, start_q=start_q)
        self.world = self.sim.world
        self.robot = self.world.robot
        self.joints = [*self.robot.joints]
        self.path_tolerance = path_tolerance
        self.lock = threading.RLock()
        self.controls = np.array(self.sim.controls)
        self.hold = self.sim.arm_state("arm").q.copy()
        self.following: Follower | None = None
        self.ticks = 0
        self.order: dict[int, int] = {}
        self.newest = 0
        self.grip: tuple[float, Any] | None = None
        self.active, self.silent, self.late, self.extra = True, False, 0.0, ""
        self.nan_speeds = self.nan_positions = False
        self.speed, self.feedback = 1.0, True
        self.speeds: list[tuple[float, float]] = []
        self.commands: list[np.ndarray] = []
        self.stopping = False
        self.waiting: list[tuple[float, Any]] = []

        rclpy.init()
        self.node = node = rclpy.create_node("plant")
        group = ReentrantCallbackGroup()
        self.states = node.create_publisher(JointState, "/joint_states", 10)
        self.transforms = node.create_publisher(TFMessage, "/tf", 10)
        self.wrench = node.create_publisher(WrenchStamped, "/wrench", 10)
        self.server = ActionServer(
            node,
            FollowJointTrajectory,
            "/joint_trajectory_controller/follow_joint_trajectory",
            self.follow,
            goal_callback=self.take,
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
            callback_group=group,
        )
        self.hand = self.world.grippers.get("hand")
        if self.hand is not None:
            (gripper_joint,) = (
                self.world.model.joint(j).name
                for j in range(self.world.model.njnt)
                if self.world.model.jnt_qposadr[j] == self.hand.qpos_index
            )
            self.gripper_joint = gripper_joint.rpartition("/")[2]
            kind = ParallelGripperCommand if gripper_action == "parallel" else GripperCommand
            self.fingers = ActionServer(
                node,
                kind,
                "/gripper_controller/gripper_cmd",
                self.close_fingers,
                cancel_callback=lambda handle: CancelResponse.ACCEPT,
                callback_group=group,
            )
        self.cameras = {
            name: (
                node.create_publisher(Image, f"/{name}/image_raw", qos_profile_sensor_data),
                node.create_publisher(Image, f"/{name}/depth/image_raw", qos_profile_sensor_data),
                node.create_publisher(CameraInfo, f"/{name}/camera_info", qos_profile_sensor_data),
            )
            for name in self.sim.cameras
        }
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.mounts = node.create_publisher(TFMessage, "/tf_static", kept)
        stamp = node.get_clock().now().to_msg()
        mounted = [
            _transform("world" if spec.arm is None else "tool0", f"{name}_optical", spec.pose, stamp)
            for name, spec in self.sim.camera_specs().items()
        ]
        self.mounts.publish(TFMessage(transforms=mounted))
        self.executor = MultiThreadedExecutor(num_threads=6)
        self.executor.add_node(node)
        self.listener = Listener(str(folder / "referee"), "AF_UNIX")

    # The controllers.

    def take(self, goal: Any) -> GoalResponse:
        """Accept a trajectory of these joints, or reject it."""
        points = goal.trajectory.points
        seconds = [point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in points]
        whole = (
            self.active
            and points
            and sorted(goal.trajectory.joint_names) == sorted(self.joints)
            and all(len(point.positions) == len(self.joints) for point in points)
            and all(np.isfinite(point.positions).all() for point in points)
            and all(later > earlier for earlier, later in pairwise(seconds))
        )
        if not whole:
            return GoalResponse.REJECT
        # Its threads may take goals up in another order than they came in.
        self.order[id(goal)] = self.newest = self.newest + 1
        return GoalResponse.ACCEPT

    def follow(self, handle: Any) -> Any:
        """Follow a trajectory until it is over, replaced or cancelled."""
        with self.lock:
            if self.order.pop(id(handle.request)) < self.newest:
                handle.abort()
                return _RESULT(error_code=_RESULT.INVALID_GOAL, error_string="preempted by a new goal")
            if self.following is not None:
                self.following.end(_RESULT.INVALID_GOAL, "preempted by a new goal")
            state = self.sim.arm_state("arm")
            mine = self.following = Follower(
                handle, self.joints, state.q.copy(), state.qd.copy(), TICK * self.ticks, self.newest
            )
        for turn in count():
            if mine.ended.wait(TICK):
                break
            if self.feedback and not turn % _FEEDBACK_TICKS:
                handle.publish_feedback(mine.feedback(TICK * self.ticks))
            if handle.is_cancel_requested:
                with self.lock:
                    if self.following is mine:
                        # It brakes with what its servos have.
                        self.hold, self.following = self.sim.arm_state("arm").q.copy(), None
                        mine.end(cancelled=True)
        result = _RESULT(error_code=mine.code, error_string=mine.said)
        if mine.cancelled:
            handle.canceled()
        elif mine.code == _RESULT.SUCCESSFUL:
            handle.succeed()
        else:
            handle.abort()
        return result

    def close_fingers(self, handle: Any) -> Any:
        """Send the fingers somewhere; it is over when they stand."""
        plain = isinstance(handle.request, GripperCommand.Goal)
        command = handle.request.command
        position = command.position if plain else command.position[0]
        with self.lock:
            self.grip = position, handle
        stood, last = 0, None
        while stood < 20 and rclpy.ok():
            time.sleep(TICK)
            if handle.is_cancel_requested or self.grip is None or self.grip[1] is not handle:
                break
            now = self.sim.arm_state("arm").gripper.joint
            stood = stood + 1 if last is not None and abs(now - last) < 1e-5 else 0
            last = now
        now = self.sim.arm_state("arm").gripper.joint
        reached = abs(now - position) < 0.1 * abs(self.hand.geometry.closed_joint - self.hand.geometry.open_joint)
        if plain:
            result = GripperCommand.Result(position=now, stalled=not reached, reached_goal=reached)
        else:
            state = JointState(name=[self.gripper_joint], position=[now])
            result = ParallelGripperCommand.Result(state=state, stalled=not reached, reached_goal=reached)
        if handle.is_cancel_requested:
            handle.canceled()
        elif self.grip is not None and self.grip[1] is handle:
            handle.succeed()
        else:
            handle.abort()
        return result

    # The loop.

    def run(self) -> None:
        """Let time pass until somebody asks for the end."""
        for work in (self.executor.spin, self.serve, self.photograph):
            threading.Thread(target=work, daemon=True).start()
        began, ticks, parent = time.monotonic(), 0, os.getppid()
        # A plant whose starter was killed ends as well.
        while not self.stopping and os.getppid() == parent:
            began += max(0.0, time.monotonic() - (began + (ticks + _MAKE_UP) * TICK))
            if (early := began + (ticks + 1) * TICK - time.monotonic()) > 0.0:
                time.sleep(early)
            self.tick()
            ticks += 1
        # Its threads are amid calls of rclpy's, which has no quiet end for them.
        os._exit(0)

    def tick(self) -> None:
        """Pass a control tick: commands, physics, tolerances, and what is told of it."""
        with self.lock:
            now, following = TICK * self.ticks, self.following
            if following is not None:
                # A speed slider below 100 % lets a trajectory's time pass more slowly.
                following.began += (1.0 - self.speed) * TICK
            row, speed = (self.hold, 0.0) if following is None else following.at(now)
            ahead = row + self.sim.servo_lag("arm") * speed
            number = 0 if following is None else following.number
            self.commands.append(np.array([number, *row, *self.sim.arm_state("arm").q]))
            self.ticks += 1
            self.controls[np.asarray(self.robot.actuator_ids, dtype=int)] = self.robot.control(ahead)
            if self.hand is not None and self.grip is not None:
                geometry = self.hand.geometry
                closed = (self.grip[0] - geometry.open_joint) / (geometry.closed_joint - geometry.open_joint)
                self.controls[np.asarray(self.hand.actuator_ids, dtype=int)] = geometry.control(
                    min(max(closed, 0.0), 1.0)
                )
            self.sim.replay(self.controls)
            state = self.sim.arm_state("arm")
            self.speeds.append((time.monotonic(), float(np.abs(state.qd).max())))
            if following is not None:
                off = np.abs(state.q - row)
                if 0.0 < self.path_tolerance < off.max():
                    joint, most = self.joints[int(off.argmax())], float(off.max())
                    self.hold, self.following = state.q.copy(), None
                    following.end(
                        _RESULT.PATH_TOLERANCE_VIOLATED,
                        f"{joint} is {most:.4f} off its path, and {self.path_tolerance:g} are allowed",
                    )
                elif now - following.began >= following.seconds[-1]:
                    self.hold, self.following = following.rows[-1], None
                    following.end()
            self.tell(state)

    def tell(self, state: Any) -> None:
        """Publish the joint states, the transforms and the wrench of this moment."""
        stamp = self.node.get_clock().now().to_msg()
        names, positions, speeds = [*self.joints], state.q.tolist(), state.qd.tolist()
        if self.hand is not None:
            names, positions, speeds = [*names, self.gripper_joint], [*positions, state.gripper.joint], [*speeds, 0.0]
        # As a joint_state_broadcaster tells of interfaces that are not there.
        nothing = [float("nan")] * len(names)
        message = JointState(
            name=names,
            position=nothing if self.nan_positions else positions,
            velocity=nothing if self.nan_speeds else speeds,
        )
        message.header.stamp = stamp
        self.waiting.append((time.monotonic() + self.late, message))
        while self.waiting and self.waiting[0][0] <= time.monotonic():
            _, due = self.waiting.pop(0)
            if not self.silent:
                self.states.publish(due)
        self.transforms.publish(TFMessage(transforms=[_transform("world", "tool0", state.tcp_pose, stamp)]))
        force = state.tcp_pose.rotation.T @ sum(self.sim.forces().values(), np.zeros(3))
        wrench = WrenchStamped()
        wrench.header.stamp, wrench.header.frame_id = stamp, "tool0"
        wrench.wrench.force.x, wrench.wrench.force.y, wrench.wrench.force.z = force.tolist()
        self.wrench.publish(wrench)

    def photograph(self) -> None:
        """Publish pictures of cameras that somebody listens to."""
        taker = photographer(self.sim)
        while not self.stopping:
            time.sleep(1.0 / _PICTURES_HZ)
            wanted = [name for name, (rgb, *_) in self.cameras.items() if rgb.get_subscription_count()]
            if not wanted:
                continue
            with self.lock:
                develop, stamp = taker.expose(wanted), self.node.get_clock().now().to_msg()
            for name in wanted:
                for kind, publisher in zip(("rgb", "depth"), self.cameras[name], strict=False):
                    pixels, lens, _ = develop(name, kind)
                    publisher.publish(_image(pixels, f"{name}_optical", stamp))
                info = CameraInfo(
                    width=lens.width, height=lens.height, distortion_model="plumb_bob", d=[*lens.distortion]
                )
                info.k = [lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0]
                info.header.stamp, info.header.frame_id = stamp, f"{name}_optical"
                self.cameras[name][2].publish(info)

    # The referee's socket.

    def serve(self) -> None:
        """Answer what the referee asks, one connection each."""
        while not self.stopping:
            connection = self.listener.accept()
            threading.Thread(target=self.answer, args=(connection,), daemon=True).start()

    def answer(self, connection: Any) -> None:
        """Answer one referee until it leaves."""
        while True:
            try:
                name, arguments = connection.recv()
            except EOFError:
                return
            asked: Callable[..., Any] = getattr(self, f"do_{name}")
            with self.lock:
                connection.send(asked(*arguments))

    def do_truth(self) -> Any:
        """Return the true state."""
        return self.sim.truth()

    def do_cameras(self) -> list[str]:
        """Return the names of the cameras."""
        return [*self.cameras]

    def do_speeds(self, since: float) -> list[tuple[float, float]]:
        """(seconds, largest speed of a joint) since a moment of the monotonic clock."""
        return [each for each in self.speeds if each[0] >= since]

    def do_commands(self) -> np.ndarray:
        """Return the number of the goal that was followed, 0 for none, what the servos were commanded, and where the arm was, shape (ticks, 1 + 2 n)."""
        return np.array(self.commands)

    def do_inject(self, fault: str, value: float = 1.0) -> float:
        """Spoil something, and return when: silent, nan_speeds, nan_positions, late (seconds), active, path_tolerance (rad), speed (share), feedback."""
        setattr(self, fault, value if fault in ("late", "path_tolerance", "speed") else bool(value))
        return time.monotonic()

    def do_end(self) -> None:
        """End the process."""
        self.stopping = True


def _transform(parent: str, child: str, pose: Pose, stamp: Stamp) -> TransformStamped:
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id, made.header.stamp = parent, stamp
    where, turn = made.transform.translation, made.transform.rotation
    where.x, where.y, where.z = pose.xyz
    turn.x, turn.y, turn.z, turn.w = pose.quat_xyzw
    return made


def _image(pixels: np.ndarray, frame: str, stamp: Stamp) -> Image:
    height, width = pixels.shape[:2]
    made = Image(height=height, width=width, encoding="rgb8" if pixels.ndim == 3 else "32FC1")
    made.header.frame_id, made.header.stamp = frame, stamp
    made.step = pixels.nbytes // height
    # Of an array rclpy does not look at every byte.
    made.data = array("B", np.ascontiguousarray(pixels).tobytes())
    return made


def main() -> None:
    """Run a plant."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--gripper-action", choices=("parallel", "plain"), default="parallel")
    parser.add_argument("--path-tolerance", type=float, default=0.0)
    options = vars(parser.parse_args())
    plant = Plant(options.pop("folder"), **options)
    plant.run()


if __name__ == "__main__":
    main()
