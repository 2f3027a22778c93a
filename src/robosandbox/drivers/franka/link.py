"""One connection to a Franka controller and its hand. What libfranka waits for is waited for in threads, with deadlines."""

from __future__ import annotations

import contextlib
import os
import re
import socket
import stat
import threading
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Generic, TypeVar

import franky  # pyright: ignore[reportMissingImports]
import numpy as np

from robosandbox.drivers.franka.waypoints import Waypoints
from robosandbox.types import Array, frozen_array

T = TypeVar("T")
# An error in a state of franky is a property of this name that is true.
_ERRORS = tuple(name for name in dir(franky.Errors) if not name.startswith("_"))
# libfranka's kMaxCutoffFrequency, with which commands are not filtered, Hz.
_NO_FILTER = 1000.0
# libfranka's research_interface::robot::kCommandPort, to which it connects by TCP.
_COMMANDS = 1337
# libfranka's words where a mode does not allow a command.
_REFUSED_IN = re.compile(r'not possible in the current mode \("([\w ]+)"\)')
# What franky raises: its own, and, of a call after the one that failed, a plain RuntimeError.
_FAILURES = (franky.Exception, RuntimeError)


class LinkError(Exception):
    """The controller refused, ended what it did, or does not answer; the message is for people."""


class InModeError(LinkError):
    """The controller answers, in a mode in which it takes no program: it was left so by another one, or by a person."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """State of an arm as its controller told it.

    Attributes:
        time: Seconds by the robot's clock.
        q: Joint positions, rad, shape (7,).
        qd: Joint speeds, rad/s, shape (7,).
        commanded: Joint positions that the controller was commanded last, rad, shape (7,).
        force: Estimate of what the hand gives to the rest of the world, N in the frame of the arm's base, shape (3,).
        mode: Of the controller: "Idle", "Move", "Guiding", "Reflex", "UserStopped", "AutomaticErrorRecovery" or "Other".
        errors: libfranka's names of what is wrong.
    """

    time: float
    q: Array
    qd: Array
    commanded: Array
    force: Array
    mode: str
    errors: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class HandReading:
    """State of a Franka Hand.

    Attributes:
        time: Seconds by its clock.
        width: Between its fingers, metres.
        max_width: At its widest, metres, as it was homed.
    """

    time: float
    width: float
    max_width: float


class _Reader(Generic[T]):
    """A thread that reads a state again and again, so that nobody else waits for one that does not come.

    Args:
        read: Returns the state and its time by the robot's clock; it may wait.
        period: Seconds between two readings.

    Attributes:
        heard: When a new state came last, by the monotonic clock.
        latest: That state.
        error: Why no more will come; "" while they do.
    """

    def __init__(self, read: Callable[[], tuple[float, T]], period: float) -> None:
        self._read, self._period = read, period
        self._last, self.latest = read()
        self.heard, self.error = time.monotonic(), ""
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self, seconds: float) -> None:
        """End the thread, and wait for that so long at most."""
        self._closed.set()
        self._thread.join(seconds)

    def _run(self) -> None:
        while not self._closed.wait(self._period):
            try:
                told, state = self._read()
            except (*_FAILURES, LinkError) as error:
                self.error = _said(error)
                return
            # In a motion franky returns the state that it had last.
            if told != self._last:
                self._last, self.latest, self.heard = told, state, time.monotonic()


def in_background(function: Callable[[], T]) -> Future[T]:
    """Call a function in a thread of its own, which ends with the program if libfranka waits in it for good."""
    future: Future[T] = Future()

    def call() -> None:
        try:
            future.set_result(function())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=call, daemon=True).start()
    return future


def _said(error: Exception) -> str:
    """Return what libfranka says; figures of the connection follow in lines of their own."""
    return str(error).partition("\n")[0]


def _within(seconds: float, what: str, function: Callable[[], T]) -> T:
    """Return what a function of libfranka's returns; raises LinkError where that fails or takes longer."""
    try:
        return in_background(function).result(seconds)
    except TimeoutError:
        raise LinkError(f"{what}: no answer within {seconds:g} s") from None
    except _FAILURES as error:
        raise LinkError(f"{what}: {_said(error)}") from None


def _cut(host: str) -> None:
    """End this program's connections to a controller, so that what libfranka waits for there fails: it has no call for that."""
    with contextlib.suppress(OSError):
        address = socket.gethostbyname(host)
        for number in os.listdir("/proc/self/fd"):
            # What is gone by now, or listens, has no other end.
            with contextlib.suppress(OSError):
                if not stat.S_ISSOCK(os.stat(int(number)).st_mode):
                    continue
                with socket.socket(fileno=os.dup(int(number))) as end:
                    if end.type == socket.SOCK_STREAM and end.getpeername()[:2] == (address, _COMMANDS):
                        end.shutdown(socket.SHUT_RDWR)


class FrankaLink:
    """A connection to an arm and, where it has one, its hand. A link that failed is done with: make another.

    Args:
        host: Address of the controller (FCI).
        enforce_realtime: Whether to refuse a computer without a realtime kernel.
        hand: Whether there is a Franka Hand.
        period: Seconds between two readings.
        deadline: Seconds in which the controller has to answer.

    Attributes:
        lower: Joint limits that the controller names, rad, shape (7,); infinite where it names none.
        upper: Likewise.
        efforts: Largest torques that it names, N m, shape (7,); likewise.
        acceleration: Limits of the motions that are planned here, rad/s^2, shape (7,).
        jerk: Likewise, rad/s^3.

    Raises:
        InModeError: It was reached, and is in a mode in which it takes no program.
        LinkError: It cannot be reached.
    """

    def __init__(self, host: str, *, enforce_realtime: bool, hand: bool, period: float, deadline: float) -> None:
        self._host, self._deadline, self._period = host, deadline, period
        realtime = franky.RealtimeConfig.Enforce if enforce_realtime else franky.RealtimeConfig.Ignore
        try:
            self._robot: franky.Robot | None = _within(
                deadline, host, lambda: franky.Robot(host, realtime_config=realtime)
            )
        except LinkError as error:
            # One that is answered later would hold the controller, which takes one client.
            _cut(host)
            # franky sets thresholds as soon as it connects, so that it can recover nothing that a program before it has left.
            mode = _REFUSED_IN.search(str(error))
            if mode is None:
                raise
            raise InModeError(f"{host}: the controller is in mode {mode.group(1)} and takes no settings") from None
        self._gripper: franky.Gripper | None = (
            _within(deadline, f"{host}, hand", lambda: franky.Gripper(host)) if hand else None
        )
        self._arm_states = _within(deadline, host, lambda: _Reader(self._read_arm, period))
        self._hand_states = (
            _within(deadline, f"{host}, hand", lambda: _Reader(self._read_hand, period)) if hand else None
        )
        self.lower, self.upper, self.efforts = self._joint_limits()
        self.acceleration: Array = self._controller.joint_acceleration_limit.get()
        self.jerk: Array = self._controller.joint_jerk_limit.get()
        self._is_moving = False
        self._stopping: Future[None] | None = None

    @property
    def heard(self) -> float:
        """When the arm was last heard of, by the monotonic clock; a hand tells less often, and ends in an error when it is lost."""
        return self._arm_states.heard

    @property
    def error(self) -> str:
        """Why the link is lost; "" while it is not."""
        return self._arm_states.error or (self._hand_states.error if self._hand_states is not None else "")

    @property
    def arm(self) -> Reading:
        """The arm's last reading."""
        return self._arm_states.latest

    @property
    def hand(self) -> HandReading:
        """The hand's last reading; raises LinkError where there is none."""
        if self._hand_states is None:
            raise LinkError("there is no hand on this link")
        return self._hand_states.latest

    def close(self) -> None:
        """Let go of the controller, which takes one client at a time."""
        for states in (self._arm_states, self._hand_states):
            if states is not None:
                states.close(self._deadline)
        if self.error or self.is_stopping:
            # What still waits in libfranka for a controller that was gone would wait for good, and keep the connection.
            _cut(self._host)
        # The controller takes another client when these are gone.
        self._robot = self._gripper = None
        self._is_moving = False

    @property
    def _controller(self) -> franky.Robot:
        if self._robot is None:
            raise LinkError("the link was closed")
        return self._robot

    @property
    def _hand_controller(self) -> franky.Gripper:
        if self._gripper is None:
            raise LinkError("there is no hand on this link")
        return self._gripper

    # Settings.

    def limit(self, velocity: Array, acceleration: Array) -> None:
        """Keep the motions that are planned here within these, rad/s and rad/s^2, shape (7,) each."""
        for limit, most in (
            (self._controller.joint_velocity_limit, velocity),
            (self._controller.joint_acceleration_limit, acceleration),
        ):
            limit.set(np.minimum(most, limit.max))
        self.acceleration = self._controller.joint_acceleration_limit.get()

    def set_collision_thresholds(self, contact: float, collision: float, lever: float) -> None:
        """Have the arm's own reflex stop it.

        Args:
            contact: Force at the hand from which it tells of a contact, N.
            collision: Force at the hand from which the reflex stops it, N.
            lever: From a joint to where such a force may act, metres: with it the forces are torques as well, but for joints
                whose motors give less.

        Raises:
            LinkError: The controller did not take them, or does not answer.
        """
        forces = [np.array([force] * 3 + [force * lever] * 3) for force in (contact, collision)]
        torques = [np.minimum(self.efforts, force * lever) for force in (contact, collision)]
        _within(
            self._deadline,
            "collision behaviour",
            lambda: self._controller.set_collision_behavior(torques[0], torques[1], forces[0], forces[1]),
        )

    def recover(self) -> None:
        """Have the controller end its errors; raises LinkError where it does not."""
        if _within(self._deadline, "recovery", self._controller.recover_from_errors):
            return
        # What it was asked may have come before its next state, in which they are over.
        end = time.monotonic() + self._deadline
        while self.arm.errors:
            if time.monotonic() > end:
                raise LinkError("the controller did not end its errors")
            time.sleep(self._period)

    # Motions.

    def move(self, through: Waypoints) -> None:
        """Begin a motion in place of the one that is under way; returns at once.

        Raises:
            LinkError: The controller did not take it.
        """
        milliseconds = [max(1, round(1000.0 * each)) for each in through.seconds.tolist()]
        last = len(milliseconds) - 1
        waypoints = [
            franky.JointWaypoint(
                franky.JointState(q, qd),
                minimum_time=franky.Duration(length),
                # After a lost packet franky plans anew for the same waypoint and takes the whole time again, for which joints
                # turn back: it is to go on with the next one instead.
                max_total_duration=None if index == last else franky.Duration(length + 1),
            )
            for index, (q, qd, length) in enumerate(zip(through.q, through.qd, milliseconds, strict=True))
        ]
        self._is_moving = True
        try:
            # What is planned here is smooth: a filter would only have the next waypoint planned for from a place behind.
            self._controller.move(franky.JointWaypointMotion(waypoints), asynchronous=True, cutoff_frequency=_NO_FILTER)
        except _FAILURES as error:
            raise LinkError(_said(error)) from None

    def has_arrived(self) -> bool:
        """Tell whether what was begun last has ended as it was to.

        Raises:
            LinkError: It ended in another way; libfranka's words.
        """
        if not self._is_moving:
            return True
        try:
            # It is true once the motion has ended, whatever its documentation says.
            ended: bool = self._controller.poll_motion()
        except _FAILURES as error:
            self._is_moving = False
            raise LinkError(_said(error)) from None
        self._is_moving = not ended
        return ended

    def stop(self) -> None:
        """Have the controller brake, if it moves on behalf of this link; returns at once, and `is_stopping` tells when it has heard."""
        if not self._is_moving or self.is_stopping:
            return
        self._is_moving = False
        robot = self._controller

        def stop() -> None:
            robot.stop()
            try:
                robot.join_motion(self._deadline)
            except franky.ControlException:
                # The motion ended because of the stop.
                return

        self._stopping = in_background(stop)

    @property
    def is_stopping(self) -> bool:
        """True until the controller has answered a stop."""
        return self._stopping is not None and not self._stopping.done()

    # The hand.

    def move_hand(self, width: float, speed: float) -> Callable[[], bool]:
        """Send the fingers to a width, metres, at a speed, m/s; returns a function that tells whether it is over.

        That raises LinkError where it failed.
        """
        hand = self._hand_controller
        return _begun(lambda: hand.move(width, speed))

    def grasp(self, width: float, speed: float, force: float) -> Callable[[], bool]:
        """Close the fingers towards a width, metres, until they press with `force`, N; likewise.

        Whatever is between them counts as grasped, since what was to be there is for the caller to judge.
        """
        hand, reach = self._hand_controller, self.hand.max_width
        return _begun(lambda: hand.grasp(width, speed, force, epsilon_inner=reach, epsilon_outer=reach))

    def _read_arm(self) -> tuple[float, Reading]:
        state = self._controller.state
        reading = Reading(
            time=state.time.to_sec(),
            q=frozen_array(np.array(state.q)),
            qd=frozen_array(np.array(state.dq)),
            commanded=frozen_array(np.array(state.q_d)),
            force=frozen_array(np.array(state.O_F_ext_hat_K[:3])),
            mode=state.robot_mode.name,
            errors=tuple(name for name in _ERRORS if getattr(state.current_errors, name)),
        )
        return reading.time, reading

    def _read_hand(self) -> tuple[float, HandReading]:
        state = self._hand_controller.state
        reading = HandReading(time=state.time.to_sec(), width=state.width, max_width=state.max_width)
        return reading.time, reading

    def _joint_limits(self) -> tuple[Array, Array, Array]:
        """Return the lower and upper limits and the efforts of the controller's own model, shape (7,) each."""
        try:
            model = ET.fromstring(_within(self._deadline, "model", lambda: self._controller.model_urdf))
        except LinkError:
            # Controllers before those of Research 3 tell no model.
            infinite = frozen_array(np.full(7, np.inf))
            return frozen_array(-infinite), infinite, infinite
        limits = [joint.find("limit") for joint in model.iter("joint") if joint.get("type") == "revolute"]
        lower, upper, effort = (
            frozen_array(np.array([float(limit.attrib[name]) for limit in limits if limit is not None]))
            for name in ("lower", "upper", "effort")
        )
        return lower, upper, effort


def _begun(command: Callable[[], bool]) -> Callable[[], bool]:
    """Begin a command of the hand, which franky waits for; its thread keeps the connection until it is answered."""
    future = in_background(command)

    def is_over() -> bool:
        if not future.done():
            return False
        try:
            future.result()
        except _FAILURES as error:
            raise LinkError(_said(error)) from None
        return True

    return is_over
