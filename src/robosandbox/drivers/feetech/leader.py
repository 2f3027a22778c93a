"""An arm of serial bus servos that somebody leads by hand, as a policy: the robot goes where it stands."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from robosandbox.drivers.feetech.bus import Bus, BusError
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
from robosandbox.types import Array
from robosandbox.types.robot import RobotSpec

# Seconds without an answer of a servo after which it leads nothing.
_SILENT = 0.1


class Leads(Protocol):
    """What the leader leads: the controller of an environment whose actions are joints."""

    @property
    def spec(self) -> RobotSpec:
        """The robot."""
        ...

    @property
    def period(self) -> float:
        """Seconds of an action."""
        ...

    def joint_action(self, q: Array, closed: float = 0.0) -> Array:
        """Return the action that asks for joints (n,) and a gripper from 0, open, to 1."""
        ...


class Leader:
    """Joints of an arm that somebody leads, told once an action, at the pace of the clock on the wall.

    It has the joints of the robot that it leads, as an SO-101 leader has those of an SO-101; its gripper's range is that of the robot's.

    Args:
        leads: The controller of what it leads (`env.controller`).
        port: Device of its bus, as /dev/ttyACM1.
        calibration: File of LeRobot's, or of `python -m robosandbox.drivers.feetech range`.
        baud: Bits a second.
        family: Its servos.

    Raises:
        InputError: The port, a servo or the calibration is not as it is to be, or the torque is on; it says which.
    """

    def __init__(
        self, leads: Leads, *, port: str, calibration: Path | None, baud: int = 1_000_000, family: ServoFamily = STS
    ) -> None:
        if calibration is None:
            raise InputError(NO_CALIBRATION)
        self._leads, self._family = leads, family
        self._joints, self._handle = _joints_of(leads.spec, calibration, family.counts)
        self._counts: dict[int, int] = {}
        self._next = 0.0
        try:
            self._bus = Bus(port, baud, family)
        except BusError as error:
            raise InputError(f"leader: {error}") from None
        try:
            self._check()
        except BaseException:
            self._bus.close()
            raise

    def __call__(self, observation: Mapping[str, Any]) -> Array:
        """Return the action that asks for where it stands now, when it is due.

        Raises:
            FaultError: A servo does not answer, or the port is gone.
        """
        del observation
        now = time.monotonic()
        # What is late is not made up for.
        self._next = max(self._next + self._leads.period, now) if self._next else now
        time.sleep(self._next - now)
        q, closed = self.read()
        return self._leads.joint_action(q, closed)

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
        gripper = self._leads.spec.gripper
        assert gripper is not None
        servo = handle.calibration
        share = (self._counts[handle.id] - servo.range_min) / (servo.range_max - servo.range_min)
        # Where its value is largest it is open, or closed, as the robot's gripper is.
        is_low = (gripper.geometry.closed_joint < gripper.geometry.open_joint) != bool(servo.drive_mode)
        return 1.0 - share if is_low else share

    def _check(self) -> None:
        bus, family, joints = self._bus, self._family, (*self._joints, *self._handle)
        try:
            silent = [joint.said for joint in joints if not bus.ping(joint.id, expected=True)]
            if silent:
                raise InputError(
                    f"leader: {bus.port}: {', '.join(silent)}: no answer; look after power, cables and ids"
                )
            for joint in joints:
                offset, wanted = bus.read(joint.id, family.offset), joint.calibration.homing_offset
                if offset != wanted:
                    raise InputError(
                        f"leader: {joint.said} has the homing offset {offset}, and the calibration says {wanted}: it is another arm's"
                    )
            if any(bus.read(joint.id, family.torque) for joint in joints):
                raise InputError(f"leader: {torque_is_on(bus.port)}")
        except BusError as error:
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
