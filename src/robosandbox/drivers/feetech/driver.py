"""Drivers of arms of serial bus servos: commands and readings at every tick, faults by the joint's name, no fall."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Final

import numpy as np

from robosandbox.driver import (
    ARM,
    BareArm,
    BareHand,
    CameraSpec,
    Capabilities,
    Guard,
    IntegralAction,
    WallClockDriver,
    open_eyes,
    per_tick,
    refusal,
)
from robosandbox.driver.integral import LARGEST_SHIFT
from robosandbox.drivers.feetech.calibration import (
    NO_CALIBRATION,
    ServoJoint,
    check_ranges,
    read_calibration,
    servo_joints,
    torque_is_on,
)
from robosandbox.drivers.feetech.protocol import Reply
from robosandbox.drivers.feetech.servos import STS, X_SERIES, Reading, ServoFamily
from robosandbox.errors import FaultError, InputError, LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.extras import missing_extra
from robosandbox.motion.fixed_surroundings import meetings
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.robot import Robot
from robosandbox.types import (
    ArmState,
    Array,
    GripperState,
    ObservedScene,
    Pose,
    Posture,
    Scene,
    Trajectory,
    frozen_array,
)
from robosandbox.types.robot import GripperSpec, RobotSpec

try:
    from robosandbox.drivers.feetech.bus import Bus, BusError, check_calibrated
except ImportError as error:
    raise missing_extra(error, "--driver feetech", "so101") from None

_log = logging.getLogger(__name__)

# Seconds over which a speed is taken: one count in it is 0.015 rad/s, near what counts as standing.
_SPEED_SECONDS = 0.1
# Seconds in which an arm that is switched on comes to lie in its servos.
_SETTLE_SECONDS = 0.5
# A joint is kept from its way that is farther than `_GIVES`, rad, from everywhere it was sent in the last `_TRAILS` seconds, for
# longer than `_KEPT` seconds: servos that are sent at a speed trail by less than 0.1 s, and what they give way to changes on the way
# (0.018 rad in picks by SO-101, SO-100 and Koch, as measured over the emulated bus; eight times that for worn gears).
_GIVES, _TRAILS, _KEPT = 0.15, 0.2, 0.1
# Seconds between two looks whether the torque is still on.
_WATCH_SECONDS = 0.1
# How far below the temperature at which it lets go by itself a servo is stopped, degrees Celsius: it tells whole degrees, and
# takes on some more while somebody looks after it.
_COOLER = 5
# Seconds for which an adapter may hold back a reply, as FTDI's do: by so much the moment of a reading is uncertain.
_HELD_BACK = 0.016


class SerialServos(WallClockDriver):
    """An arm whose joints, and gripper, are servos on one serial bus.

    Args:
        scene: The robot, and the table that it stands at.
        port: Device of the bus, as /dev/ttyACM0.
        calibration: File of LeRobot's, or of `python -m robosandbox.drivers.feetech range`; without one the arm is not
            opened.
        baud: Bits a second.
        tick: Seconds between commands.
        speed: Share of the speed of every trajectory that the arm follows it with, above 0 to 1.
        grip: Share of its torque that the gripper's servo may give.
        link_timeout: Seconds without an answer of a servo after which the arm is lost.
        release: Whether `close` takes the torque off, and the arm falls.
        limp: Whether its servos stay without torque, so that somebody can lead it: it tells how it stands, and moves nothing.
        cameras: File of webcams (`robosandbox.driver.webcams`), or `module:function` that is called with this driver and
            returns its senses, with `cameras`.

    Raises:
        InputError: The port, a servo or the calibration is not as it is to be; it says which, and nothing moves.
    """

    episode: Final = 0
    family: ClassVar[ServoFamily]

    def __init__(
        self,
        scene: Scene,
        *,
        port: str,
        calibration: Path | None = None,
        baud: int = 1_000_000,
        tick: float = 0.01,
        speed: float = 1.0,
        grip: float = 0.5,
        link_timeout: float = 0.1,
        release: bool = False,
        limp: bool = False,
        cameras: str | None = None,
    ) -> None:
        super().__init__(tick)
        for name, share in (("speed", speed), ("grip", grip)):
            if not 0.0 < share <= 1.0:
                raise InputError(f"{name} is {share:g}; give a share above 0, to 1")
        nothing = ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
        planning = PlanningScenes(scene).of(nothing)
        spec, self._gripper = planning.robot.spec, planning.robot.gripper
        if calibration is None:
            raise InputError(NO_CALIBRATION)
        # Beside the calibration: which joint was seen to slip since, over the end of the program.
        self._doubt = calibration.with_name(f"{calibration.name}.doubt")
        if doubted := _doubted(calibration, self._doubt):
            raise InputError(f"--driver {type(self).__name__.lower()}: {doubted}")
        self.joints = _calibrated(planning.robot, calibration, self.family.counts)
        self._ids = [joint.id for joint in self.joints]
        self.port, self.speed = port, speed
        self._baud, self._grip, self._release = baud, grip, release
        self._link_timeout = link_timeout
        self._past: dict[int, deque[Reading]] = {}
        self._silent_since: dict[int, float] = {}
        self._goals: dict[int, int] = {}
        self._limits_celsius: dict[int, int] = {}
        self._full_load: dict[int, int] = {}
        self._quickest: dict[int, float] = {}
        self._watched_at = self._polled_at = 0.0
        self._slipped = ""
        # Whether it has put the torque on; and of which servos it was off before.
        self._holds = False
        self._limp: list[int] = []
        hand = None if spec.gripper is None else _ServoHand(self, spec.gripper, self.joints[-1])
        self._hand = hand
        self.hands = {} if hand is None else {hand.name: hand}
        self._arm = _ServoArm(self, spec, self.joints[: spec.n], planning.kinematics(), hand)
        self._arm.meets = meetings(planning, None if hand is None else hand.last_joint)
        self.arms = {ARM: self._arm}
        self._cameras: Mapping[str, CameraSpec] = {}
        try:
            self._bus = Bus(port, baud, self.family)
        except BusError as error:
            raise InputError(f"--driver {type(self).__name__.lower()}: {error}") from None
        try:
            self._check_servos()
            if cameras is not None:
                eyes = open_eyes(cameras, self)
                self.senses, self._cameras = eyes, eyes.cameras
            if limp:
                self._be_led()
            else:
                self._hold()
        except (BusError, ValueError) as error:
            self._leave_as_found()
            raise InputError(f"--driver {type(self).__name__.lower()}: {error}") from None
        except BaseException:
            self._leave_as_found()
            raise

    @property
    def capabilities(self) -> Capabilities:
        """Encoders, and cameras where there are some."""
        return Capabilities(cameras=self._cameras, clock="wall", link_timeout=self._link_timeout, speed=self.speed)

    def close(self) -> None:
        """Let go of the port; the servos hold where they are, unless they are to be released."""
        self._loop.close()
        try:
            if self._release and not self.fault:
                self._bus.write_all(self.family.torque, dict.fromkeys(self._ids, 0))
        except BusError as error:
            _log.warning("the torque is still on: %s", error)
        self._bus.close()

    def _leave_as_found(self) -> None:
        """Take the torque off again where it was off, and let go of the port: nothing has moved."""
        try:
            if self._limp:
                self._bus.write_all(self.family.torque, dict.fromkeys(self._limp, 0))
        except BusError as error:
            _log.warning("the torque is on, where it was off: %s", error)
        self._bus.close()

    def recover(self) -> None:
        """Open the port again, have every servo hold where it is, and end a fault.

        Raises:
            FaultError: It is not over.
        """
        if self._slipped:
            # Where it stands is no longer known, whatever somebody has looked after.
            raise FaultError(
                f"{self._slipped} has slipped, and where it stands is not known; it is not over: calibrate it again, and open the "
                "driver anew",
                phase=Phase.CHECK,
            )
        self._bus.close()
        self.fault, self._holds = "", False
        self._silent_since.clear()
        if self._hand is not None:
            self._hand.forget()
        try:
            self._bus = Bus(self.port, self._baud, self.family)
            self._check_servos()
            self._hold()
        except (BusError, InputError) as error:
            self.fault = str(error)
        if self.fault:
            raise FaultError(f"{self.fault}; it is not over", phase=Phase.CHECK)

    # Between the parts of this driver and the bus.

    @property
    def heard(self) -> float:
        """When the servo that has been silent for longest last told."""
        return min((past[-1].time for past in self._past.values()), default=0.0)

    def past(self, joint: ServoJoint) -> deque[Reading]:
        """Return what a servo has told of late, the last one last; of silent ones it is asked no more than once a tick."""
        # What is too old for anybody to go by is not told: it is asked for until it comes or the servo is named as silent.
        too_old = self.time - self.heard > self._link_timeout and not self.fault
        if too_old or self.time - max(self.heard, self._polled_at) > self.control_timestep:
            while not self.poll() and not self.fault:
                pass
        return self._past[joint.id]

    def last(self, joint: ServoJoint) -> float:
        """Return where a servo was when it was last heard of, as a joint value."""
        return joint.value(self._past[joint.id][-1].counts)

    def quickest(self, joint: ServoJoint) -> float:
        """Return how fast a servo turns without a load, rad/s."""
        return self._quickest[joint.id] * abs(joint.radians)

    def goal(self, joint: ServoJoint) -> float:
        """Return where a servo was sent last, as a joint value."""
        return joint.value(self._goals[joint.id])

    def send(self, joints: Sequence[ServoJoint], values: Array) -> None:
        """Send servos to joint values; nothing is sent while the port is gone."""
        goals = {joint.id: joint.count(float(value)) for joint, value in zip(joints, values, strict=True)}
        try:
            self._bus.write_all(self.family.goal, goals)
        except BusError as error:
            self.fail(f"{error}; the servos hold where they were sent last")
        else:
            self._goals |= goals

    def look(self) -> None:
        """Read every servo once, and see whether the arm goes where it is sent."""
        if self._hand is not None and not self.fault:
            self._hand.go_on()
        if self.poll() and not self.fault:
            self._arm.check_followed()

    def posture(self) -> dict[str, Posture]:
        """Return how the arm stands, as a frame of a camera tells it."""
        gripper, joints = self._gripper, self.joints[self._arm.spec.n :]
        values = [gripper.joints_at(joint.value(self.past(joint)[-1].counts)) for joint in joints] if gripper else []
        return {ARM: Posture(q=self._arm.measured_q(), gripper_q=frozen_array(np.array(values).reshape(-1)))}

    def poll(self) -> bool:
        """Read every servo once, and see what is the matter; return whether all have answered."""
        asked = self.time
        try:
            replies = self._bus.read_all(self._ids, self.family.state)
            if self._holds:
                self._watch_torque(asked)
        except BusError as error:
            self.fail(f"{error}; the servos hold where they were sent last")
            return False
        finally:
            self._polled_at = self.time
        now = self.time
        for joint in self.joints:
            past = self._past.setdefault(joint.id, deque())
            if joint.id in replies:
                self._silent_since.pop(joint.id, None)
                # It may be as old as the request, where this computer was away meanwhile.
                reading = Reading.of(replies[joint.id], asked, self.family, self._full_load[joint.id])
                self._check_reading(joint, reading, past[-1] if past else None, now)
                self._check_errors(joint, reading, replies[joint.id])
                past.append(reading)
                while now - past[0].time > _SPEED_SECONDS and len(past) > 1:
                    past.popleft()
            elif (silent := now - self._silent_since.setdefault(joint.id, asked)) > self._link_timeout:
                self.fail(f"{joint.said} has not answered for {silent:.2f} s: look after its cable and its power")
        return len(replies) == len(self.joints)

    def load(self, joint: ServoJoint) -> float:
        """Return what share of its full drive a servo last told that it gives, 0..1."""
        return abs(self._past[joint.id][-1].load)

    def _check_reading(self, joint: ServoJoint, reading: Reading, before: Reading | None, now: float) -> None:
        hottest = self._limits_celsius[joint.id] - _COOLER
        if reading.celsius >= hottest:
            self.fail(
                f"{joint.said} is at {reading.celsius} C, and {hottest} are allowed: let it cool, with less load on it"
            )
        if before is not None:
            gone, gap = abs(reading.counts - before.counts), now - before.time
            if gone > self._quickest[joint.id] * (gap + _HELD_BACK):
                self._slipped = joint.said
                try:
                    self._doubt.write_text(joint.said)
                except OSError as error:
                    _log.warning("the next program will not know of it: %s", error)
                self.fail(
                    f"{joint.said} read {before.counts}, and {gap:.3f} s later {reading.counts} counts: farther than it can go; "
                    "look whether its horn slips or its encoder fails, and calibrate it again"
                )

    def _check_errors(self, joint: ServoJoint, reading: Reading, reply: Reply) -> None:
        try:
            errors = self._bus.errors(joint.id, reply)
        except BusError:
            errors = ["reports an error, and does not say which"]
        for said in errors:
            self.fail(
                f"{joint.said} {said}: {reading.celsius} C, {reading.volts:.1f} V, {100 * abs(reading.load):.0f} % load"
            )

    def _watch_torque(self, now: float) -> None:
        """See whether every servo still holds: one that was without power has let go, and says nothing of it."""
        if now - self._watched_at < _WATCH_SECONDS:
            return
        self._watched_at = now
        replies = self._bus.read_all(self._ids, self.family.torque)
        for joint in self.joints:
            if joint.id in replies and self.family.torque.decode(replies[joint.id].data) == 0:
                if self._hand is not None:
                    # What it held it has dropped, and it is sent nowhere.
                    self._hand.forget()
                    self._goals[self.joints[-1].id] = self._past[self.joints[-1].id][-1].counts
                self.fail(
                    f"{joint.said} has let go, though nothing told it to: it was without power, or somebody took its torque off; "
                    "hold the arm, and look after its power"
                )
                return

    def _check_servos(self) -> None:
        """See whether the servos are those of the calibration; raises InputError or BusError."""
        check_calibrated(self._bus, self.joints)
        family = self.family
        for joint in self.joints:
            number, mode = self._bus.read(joint.id, family.model), self._bus.read(joint.id, family.mode)
            model = family.models.get(number)
            if model is None:
                known = ", ".join(f"{each.name} ({number})" for number, each in family.models.items())
                raise InputError(f"{self.port}: {joint.said} is of model {number}; this driver knows {known}")
            if mode not in family.modes:
                by_position = " or ".join(f"{number}, {name}" for number, name in family.modes.items())
                raise InputError(f"{self.port}: {joint.said} is in mode {mode}; it is to be in {by_position}")
            self._quickest[joint.id] = model.no_load_speed * family.counts / 60.0
            if model.full_load is not None or family.most_current is None:
                self._full_load[joint.id] = model.full_load or 1
            else:
                self._full_load[joint.id] = max(1, self._bus.read(joint.id, family.most_current))
            self._limits_celsius[joint.id] = self._bus.read(joint.id, family.max_temperature)

    def _be_led(self) -> None:
        """Read every servo once, and have nothing command one."""
        if any(self._bus.read(joint.id, self.family.torque) for joint in self.joints):
            raise InputError(f"{self.port}: {torque_is_on(self.port)}")
        self._goals = {joint.id: self._bus.read(joint.id, self.family.goal) for joint in self.joints}
        while not self.poll() and not self.fault:
            pass
        self.fault = self.fault or "it was opened limp, to be led by hand"

    def _hold(self) -> None:
        """Have every servo hold where it is; one that holds already goes on doing so, and the gripper what it grips.

        Nothing is written where something is the matter.
        """
        self._goals = {joint.id: self._bus.read(joint.id, self.family.goal) for joint in self.joints}
        while not self.poll() and not self.fault:
            pass
        if self.fault:
            return
        for joint in self.joints:
            counts = self._past[joint.id][-1].counts
            gives_way = joint.name not in self._arm.spec.joints or (
                abs((self._goals[joint.id] - counts) * joint.radians) <= LARGEST_SHIFT
            )
            is_limp = self._bus.read(joint.id, self.family.torque) != 1
            if is_limp and not self._holds:
                self._limp.append(joint.id)
            if not gives_way or is_limp:
                self._bus.write(joint.id, self.family.goal, counts)
                self._bus.write(joint.id, self.family.torque, 1)
                self._goals[joint.id] = counts
        if self.hands:
            # After the torque, with which some servos forget it.
            grip = round(self.family.full_torque * self._grip)
            self._bus.write(self.joints[-1].id, self.family.torque_limit, grip)
        self._holds = True
        end = self.time + _SETTLE_SECONDS
        while self.time < end and not self.fault:
            time.sleep(self.control_timestep)
            self.poll()
        if not self.fault:
            self._arm.settle()


def _calibrated(robot: Robot, calibration: Path, counts: int) -> list[ServoJoint]:
    """Return a robot's joints from base to gripper with their servos, as a file tells them and fits the robot; raises InputError."""
    spec, gripper = robot.spec, robot.gripper
    names, limits = [*spec.joints], [*zip(spec.lower.tolist(), spec.upper.tolist(), strict=True)]
    closed = None
    if gripper is not None:
        opened, closed = gripper.geometry.open_joint, gripper.geometry.closed_joint
        names.append("gripper")
        limits.append((min(opened, closed), max(opened, closed)))
    joints = servo_joints(read_calibration(calibration), names, limits, counts, closed=closed)
    check_ranges(joints, gripper=gripper is not None)
    return joints


def _doubted(calibration: Path, doubt: Path) -> str:
    """Return what was seen to slip since a calibration was written, and what to do; "" where nothing was."""
    if not doubt.exists() or doubt.stat().st_mtime_ns <= calibration.stat().st_mtime_ns:
        return ""
    return (
        f"{doubt.read_text()} has slipped since {calibration} was written, and where it stands is not known: calibrate it again; or, "
        f"where its encoder alone was wrong and you have seen that it stands as the model says, remove {doubt}"
    )


class Feetech(SerialServos):
    """An arm of Feetech's STS servos, as SO-100 and SO-101."""

    family = STS


class Dynamixel(SerialServos):
    """An arm of Dynamixel's X servos, as Koch; its gripper is a servo that turns a finger."""

    family = X_SERIES


class _ServoArm(BareArm):
    """The arm as its encoders know it."""

    def __init__(
        self,
        cell: SerialServos,
        spec: RobotSpec,
        joints: Sequence[ServoJoint],
        kinematics: Kinematics,
        hand: _ServoHand | None,
    ) -> None:
        super().__init__(cell, spec)
        self._cell, self._joints, self._kinematics, self._hand = cell, joints, kinematics, hand
        self._integral = IntegralAction(spec.n, cell.control_timestep)
        # Where it was sent of late, and when, the last one last; since when each joint is kept from there.
        self._rows: deque[tuple[float, Array]] = deque()
        self._kept_since: dict[str, float] = {}

    def state(self) -> ArmState:
        """Return what the encoders read; of one that is silent what it read last, and of that time."""
        q = self.measured_q()
        return ArmState(
            time=self._cell.heard,
            q=q,
            qd=frozen_array(np.array([self._speed(joint) for joint in self._joints])),
            tcp_pose=Pose.from_matrix(*self._kinematics.forward(q)),
            gripper=None if self._hand is None else self._hand.state(),
        )

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory, commands interpolated to the control ticks.

        Raises:
            LimitError: A row is outside of what a servo was calibrated for, and nothing has moved.
        """
        tick = self._cell.control_timestep
        rows = per_tick(replace(trajectory, dt=trajectory.dt / self._cell.speed), tick)
        self._check_range(rows)
        try:
            for row in rows:
                self._send(row)
                self._cell.tick(guards)
        except BaseException:
            self.stop()
            raise

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,).

        Raises:
            LimitError: It is outside of what a servo was calibrated for.
        """
        self._check_range(goal[None])
        self._integral.take_up(goal - self.measured_q())
        self._send(goal)
        self._cell.tick(guards)

    def stop(self) -> None:
        """Command the arm to stay where its encoders say it is, held against what its servos give way to."""
        q = self.measured_q()
        self._begin_at(q)
        self._cell.send(self._joints, q + self._integral.shift)

    def settle(self) -> None:
        """Take note of what the servos give way to while they hold."""
        goals, q = np.array([self._cell.goal(joint) for joint in self._joints]), self.measured_q()
        self._integral.begin_at(goals - q)
        self._begin_at(q)

    def check_followed(self) -> None:
        """See whether each joint is where it was sent, as far as servos trail and give way; it fails where one is kept from there."""
        now, sent = self._cell.time, self._rows
        while len(sent) > 1 and now - sent[1][0] > _TRAILS:
            sent.popleft()
        if not sent:
            return
        rows, q = np.array([row for _, row in sent]), self.measured_q()
        off = np.maximum(rows.min(axis=0) - q, q - rows.max(axis=0))
        for joint, value in zip(self._joints, off.tolist(), strict=True):
            if value <= _GIVES:
                self._kept_since.pop(joint.name, None)
            elif now - self._kept_since.setdefault(joint.name, now) > _KEPT:
                self._cell.fail(
                    f"{joint.said} is {value:.2f} rad from where it was sent: something is in its way or pushes it, or it is stuck "
                    f"({100 * self._cell.load(joint):.0f} % load)"
                )

    def _begin_at(self, q: Array) -> None:
        """Take note that the arm is to be at `q` (n,) from now on, whatever it was sent before."""
        self._rows.clear()
        self._rows.append((self._cell.time, q))
        self._kept_since.clear()

    def _send(self, row: Array) -> None:
        self._rows.append((self._cell.time, row))
        self._cell.send(self._joints, row + self._integral.shift)

    def measured_q(self) -> Array:
        """Return what the encoders read, shape (n,)."""
        return frozen_array(np.array([joint.value(self._cell.past(joint)[-1].counts) for joint in self._joints]))

    def _speed(self, joint: ServoJoint) -> float:
        """Return a joint's speed, rad/s; one count is none."""
        past = self._cell.past(joint)
        last = past[-1]
        first = next((one for one in past if last.time - one.time <= _SPEED_SECONDS), last)
        gone = last.counts - first.counts
        return 0.0 if abs(gone) <= 1 else joint.radians * gone / (last.time - first.time)

    def _check_range(self, rows: Array) -> None:
        for column, joint, q in zip(rows.T, self._joints, self.measured_q().tolist(), strict=True):
            ends = sorted(joint.value(count) for count in (joint.calibration.range_min, joint.calibration.range_max))
            worst = float(column[np.abs(column - sum(ends) / 2.0).argmax()])
            # One count is what rounding leaves; a joint that stands outside may come in.
            if not min(ends[0], q) - abs(joint.radians) <= worst <= max(ends[1], q) + abs(joint.radians):
                raise LimitError(
                    f"{joint.said} would be at {worst:.4g} rad, and was calibrated for {ends[0]:.4g}..{ends[1]:.4g}; nothing has "
                    "moved: send another, or calibrate it again over its whole range",
                    phase=Phase.CHECK,
                    evidence=LimitEvidence(
                        quantity=f"position of {joint.name}, rad", value=worst, low=ends[0], high=ends[1]
                    ),
                )


class _ServoHand(BareHand):
    """The gripper as its servo knows it."""

    def __init__(self, cell: SerialServos, spec: GripperSpec, joint: ServoJoint) -> None:
        super().__init__(cell, spec)
        self._cell, self._joint = cell, joint
        self._closed: float | None = None
        # Where it is to go, and where it was sent on the way there, as joint values.
        self._target: float | None = None
        self._reached = 0.0

    def state(self) -> GripperState:
        """Return what the encoder reads; what is held keeps it from where it was sent."""
        geometry = self.spec.geometry
        joint = self._joint.value(self._cell.past(self._joint)[-1].counts)
        closed = geometry.closed_fraction(joint)
        return GripperState(
            joint=joint,
            width=max(0.0, geometry.aperture(joint)),
            closed=closed,
            force=None,
            commanded=self._sent if self._closed is None else self._closed,
        )

    def last_joint(self) -> float:
        """Return what its encoder read last, as a joint value."""
        return self._cell.last(self._joint)

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed. Returns at once.

        Raises:
            ValueError: `closed` is outside 0..1.
            UnsupportedError: A force is given: the option `grip` says how hard it closes.
        """
        if force is not None:
            raise refusal(self._cell, "grip_limit", f"a grip of {force:g} N was asked for")
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; a gripper takes 0 (open) to 1 (closed)")
        self._closed = closed
        geometry = self.spec.geometry
        self._target = geometry.open_joint + closed * (geometry.closed_joint - geometry.open_joint)
        self._reached = self.last_joint()
        self.go_on()

    def go_on(self) -> None:
        """Send it on to where it is to go, as far as its share of the servo's speed takes it in a tick."""
        if self._target is None:
            return
        if self._cell.speed < 1.0:
            step = self._cell.speed * self._cell.quickest(self._joint) * self._cell.control_timestep
            self._reached += min(max(self._target - self._reached, -step), step)
        else:
            self._reached = self._target
        self._cell.send([self._joint], np.array([self._reached]))
        if self._reached == self._target:
            self._target = None

    def forget(self) -> None:
        """Go by the goal that the servo has: without power it has let go of what it was told to grip."""
        self._closed = self._target = None

    @property
    def _sent(self) -> float:
        """Goal that the servo had before anybody commanded it here, 0 open to 1 closed."""
        return min(max(self.spec.geometry.closed_fraction(self._cell.goal(self._joint)), 0.0), 1.0)
