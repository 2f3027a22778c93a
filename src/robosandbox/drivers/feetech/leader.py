"""An arm of serial bus servos that somebody leads by hand: a robot goes where it stands, by a policy or by its driver."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from robosandbox.driver import Driver
from robosandbox.driver.joint_steps import JointSteps
from robosandbox.drivers.feetech.bus import Bus, BusError, check_calibrated
from robosandbox.drivers.feetech.calibration import (
    NO_CALIBRATION,
    ServoJoint,
    check_ranges,
    read_calibration,
    servo_joints,
    torque_is_on,
)
from robosandbox.drivers.feetech.servos import STS, ServoFamily
from robosandbox.errors import FaultError, InputError, Phase
from robosandbox.types import Array, Trajectory
from robosandbox.types.robot import RobotSpec

# Seconds without an answer of a servo after which it leads nothing.
_SILENT = 0.1
# Seconds of a step of an arm that is led: half of what a hand's motion is looked at in (some 20 Hz).
_STEP = 0.02
# Speed at which an arm comes to where its leader stands, rad/s or m/s, and how near, rad or m, it is there.
_COMING, _THERE = 0.25, 0.05
# Share of its way that the handle of a leader's gripper is moved before the gripper is sent: an encoder's noise is less.
_HANDLE = 0.005


class Leads(Protocol):
    """The controller of an environment whose actions are joints, as a policy is led by a leader."""

    @property
    def period(self) -> float:
        """Seconds of an action."""
        ...

    def joint_action(self, q: Array, closed: float = 0.0) -> Array:
        """Return the action that asks for joints (n,) and a gripper from 0, open, to 1."""
        ...


class _Pace:
    """The wall clock's pace of steps of some seconds; what is late is not made up for."""

    def __init__(self, period: float) -> None:
        self._period, self._due = period, 0.0

    def wait(self) -> None:
        """Return when the next step is due."""
        now = time.monotonic()
        self._due = max(self._due + self._period, now)
        time.sleep(self._due - now)


class Leader:
    """Joints of an arm that somebody leads, its torque off.

    It has the joints of the robot that it leads, as an SO-101 leader has those of an SO-101; its gripper's range is that of the robot's.

    Args:
        spec: The robot that it leads.
        port: Device of its bus, as /dev/ttyACM1.
        calibration: File of LeRobot's, or of `python -m robosandbox.drivers.feetech range`.
        baud: Bits a second.
        family: Its servos.

    Raises:
        InputError: The port, a servo or the calibration is not as it is to be, or the torque is on; it says which.
    """

    def __init__(
        self, spec: RobotSpec, *, port: str, calibration: Path | None, baud: int = 1_000_000, family: ServoFamily = STS
    ) -> None:
        if calibration is None:
            raise InputError(NO_CALIBRATION)
        self._spec, self._family = spec, family
        self._joints, self._handle = _joints_of(spec, calibration, family.counts)
        self._counts: dict[int, int] = {}
        try:
            self._bus = Bus(port, baud, family)
        except BusError as error:
            raise InputError(f"leader: {error}") from None
        try:
            self._check()
        except BaseException:
            self._bus.close()
            raise

    def policy(self, leads: Leads) -> Callable[[Mapping[str, Any]], Array]:
        """Return a policy of an environment of joint actions, as `--policy` takes it: it asks for where the leader stands, at the wall's pace.

        Args:
            leads: The environment's controller.
        """
        pace = _Pace(leads.period)

        def act(observation: Mapping[str, Any]) -> Array:
            del observation
            pace.wait()
            q, closed = self.read()
            return leads.joint_action(q, closed)

        return act

    def lead(self, driver: Driver, seconds: float, arm_name: str | None = None) -> None:
        """Have an arm go where the leader stands, for some seconds by the driver's clock; slowly until it is there for the first time.

        Args:
            driver: Of the arm, within whose limits all commands stay.
            seconds: How long.
            arm_name: The arm; needless where there is one.

        Raises:
            FaultError: A servo of the leader does not answer; the arm holds.
            SkillError: A limit was passed; the arm holds.
        """
        arm = driver.arms[arm_name or next(iter(driver.arms))]
        hands = [hand for hand in driver.hands.values() if hand.arm == arm.name]
        ticks = max(1, round(_STEP / driver.control_timestep))
        period = ticks * driver.control_timestep
        steps, comes, pressed = JointSteps(arm.spec, (period,)), True, -1.0
        steps.begin(arm.state().q)
        end, pace = driver.time + seconds, _Pace(period)
        try:
            while driver.time < end:
                if driver.capabilities.clock == "simulated":
                    pace.wait()
                q, closed = self.read()
                wanted, change = steps.wanted(q, period, period)
                if comes:
                    comes = bool(np.abs(np.clip(q, arm.spec.lower, arm.spec.upper) - steps.q).max() > _THERE)
                    wanted = np.clip(wanted, -_COMING, _COMING)
                velocity = np.clip(wanted, steps.velocity - change, steps.velocity + change)
                arm.follow(Trajectory(q=steps.go(velocity, period), dt=period, goes_on=True))
                if abs(closed - pressed) > _HANDLE:
                    for hand in hands:
                        hand.set_gripper(closed)
                    pressed = closed
        finally:
            arm.stop()

    def read(self) -> tuple[Array, float]:
        """Return its joints (n,), rad, and how far its gripper is closed, 0 to 1; 0 without one.

        Raises:
            FaultError: A servo does not answer, or the port is gone.
        """
        ids = [joint.id for joint in (*self._joints, *self._handle)]
        end, missing = time.monotonic() + _SILENT, set(ids)
        try:
            while missing and time.monotonic() < end:
                for servo, reply in self._bus.read_all(sorted(missing), self._family.position).items():
                    self._counts[servo] = self._family.position.decode(reply.data)
                    missing.discard(servo)
        except BusError as error:
            raise FaultError(f"leader: {error}; the robot holds", phase=Phase.CHECK) from None
        if missing:
            silent = ", ".join(joint.said for joint in (*self._joints, *self._handle) if joint.id in missing)
            raise FaultError(f"leader: {silent} does not answer; the robot holds", phase=Phase.CHECK)
        q = np.array([joint.value(self._counts[joint.id]) for joint in self._joints])
        return q, float(np.clip([self._closed(joint) for joint in self._handle], 0.0, 1.0).sum())

    def close(self) -> None:
        """Let go of the port."""
        self._bus.close()

    def _closed(self, handle: ServoJoint) -> float:
        gripper = self._spec.gripper
        assert gripper is not None
        servo = handle.calibration
        share = (self._counts[handle.id] - servo.range_min) / (servo.range_max - servo.range_min)
        # Where its value is largest it is open, or closed, as the robot's gripper is.
        is_low = (gripper.geometry.closed_joint < gripper.geometry.open_joint) != bool(servo.drive_mode)
        return 1.0 - share if is_low else share

    def _check(self) -> None:
        joints = (*self._joints, *self._handle)
        try:
            check_calibrated(self._bus, joints)
            if any(self._bus.read(joint.id, self._family.torque) for joint in joints):
                raise InputError(torque_is_on(self._bus.port))
        except (BusError, InputError) as error:
            raise InputError(f"leader: {error}") from None


def _joints_of(spec: RobotSpec, path: Path, counts: int) -> tuple[list[ServoJoint], list[ServoJoint]]:
    """Return the servos of a robot's joints, and that of its gripper, if it has one; raises InputError."""
    names = [*spec.joints]
    limits = [*zip(spec.lower.tolist(), spec.upper.tolist(), strict=True)]
    if spec.gripper is not None:
        ends = spec.gripper.geometry.open_joint, spec.gripper.geometry.closed_joint
        names.append("gripper")
        limits.append((min(ends), max(ends)))
    joints = servo_joints(read_calibration(path), names, limits, counts)
    arm, hand = joints[: spec.n], joints[spec.n :]
    check_ranges(arm, gripper=False)
    return arm, hand
