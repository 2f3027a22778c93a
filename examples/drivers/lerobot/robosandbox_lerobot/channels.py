"""From LeRobot's numbers to joint values and back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Literal, Protocol

from lerobot.motors import MotorNormMode
from lerobot.motors.motors_bus import SerialMotorsBus
from lerobot.robots import Robot

from robosandbox.drivers.feetech.calibration import ServoCalibration, ServoJoint, check_ranges, servo_joints
from robosandbox.errors import InputError

Units = Literal["degrees", "radians", "normalized"]
POSITION = ".pos"
GRIPPER = "gripper"


class Channel(Protocol):
    """A number of a robot's actions and observations, and the joint value that it means."""

    @property
    def key(self) -> str:
        """In LeRobot's dicts, as `shoulder_pan.pos`."""
        ...

    def value(self, number: float) -> float:
        """Return the joint value of a number, rad or m."""
        ...

    def number(self, value: float) -> float:
        """Return the number of a joint value, kept within the joint's limits."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoChannel:
    """A joint whose servo LeRobot normalizes by its calibration.

    Attributes:
        key: In LeRobot's dicts.
        servo: The joint and its servo's calibration.
        mode: What LeRobot makes of counts.
        flips: Whether it counts from the other end in the modes that are of a range.
    """

    key: str
    servo: ServoJoint
    mode: MotorNormMode
    flips: bool

    @property
    def _numbers(self) -> tuple[float, float]:
        """Numbers at the ends of the servo's range."""
        servo = self.servo.calibration
        if self.mode is MotorNormMode.DEGREES:
            # LeRobot has a count less to a turn than the servo has.
            half = 0.5 * (servo.range_max - servo.range_min) * 360.0 / (self.servo.counts - 1)
            return -half, half
        ends = (-100.0, 100.0) if self.mode is MotorNormMode.RANGE_M100_100 else (0.0, 100.0)
        return ends[::-1] if self.flips else ends

    def value(self, number: float) -> float:
        """Return the joint value of a number, rad."""
        low, high = self._numbers
        servo = self.servo.calibration
        return self.servo.value(servo.range_min + (number - low) / (high - low) * (servo.range_max - servo.range_min))

    def number(self, value: float) -> float:
        """Return the number that LeRobot sends as the count nearest to a joint value."""
        low, high = self._numbers
        servo = self.servo.calibration
        count = self.servo.count(value)
        # LeRobot cuts off what is behind the point: a count's middle comes out as that count, its edge may as the one below.
        middle = count + 0.5
        if self.mode is not MotorNormMode.DEGREES:
            middle = min(middle, servo.range_max)
        return low + (middle - servo.range_min) / (servo.range_max - servo.range_min) * (high - low)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearChannel:
    """A joint whose number is a multiple of its value, and an offset.

    Attributes:
        key: In LeRobot's dicts.
        lower: Least joint value that is commanded, rad or m.
        upper: Largest.
        unit: Joint value of one.
        zero: Joint value of zero.
    """

    key: str
    lower: float
    upper: float
    unit: float
    zero: float = 0.0

    def value(self, number: float) -> float:
        """Return the joint value of a number, rad or m."""
        return self.zero + self.unit * number

    def number(self, value: float) -> float:
        """Return the number of a joint value."""
        return (min(max(value, self.lower), self.upper) - self.zero) / self.unit


def channels(
    robot: Robot,
    joints: Sequence[str],
    limits: Sequence[tuple[float, float]],
    gripper: tuple[float, float] | None,
    units: Units | None,
    prefix: str,
) -> list[Channel]:
    """Return what each joint is called and means in a robot's dicts, the gripper last.

    Args:
        robot: Whose dicts.
        joints: The arm's joints from base to gripper.
        limits: Of each, rad.
        gripper: Joint value where open and where closed; None without a gripper.
        units: Of a robot that is no chain of calibrated serial servos.
        prefix: Before the names of this arm's joints in the dicts.

    Raises:
        InputError: The robot has other joints, or nothing says in which units they are.
    """
    names = [*joints, *([GRIPPER] if gripper else [])]
    said = [key.removesuffix(POSITION) for key in robot.action_features if key.endswith(POSITION)]
    own = [name.removeprefix(prefix) for name in said if name.startswith(prefix)]
    if not {*names} <= {*own}:
        if len(own) != len(names):
            raise InputError(
                f"{type(robot).__name__} has {', '.join(said) or 'no positions'}, and the model's joints are {', '.join(names)}; "
                "`prefix` says which arm's are meant"
            )
        # Other names for the same chain.
        called = dict(zip(names, own, strict=True))
    else:
        called = {name: name for name in names}
    keys = [prefix + called[name] for name in names]
    ends = [*limits, *([(min(gripper), max(gripper))] if gripper else [])]
    # A robot of two arms has each as a robot of its own, `left_arm`, without the prefix.
    bus = getattr(getattr(robot, f"{prefix}arm", robot), "bus", None)
    if isinstance(bus, SerialMotorsBus):
        closed = gripper[1] if gripper else None
        return _of_servos(bus, keys, [called[name] for name in names], names, ends, closed)
    if units is None:
        raise InputError(
            f"nothing says in which units {type(robot).__name__} tells its joints: give units=degrees, radians or normalized "
            "(-100 to 100 over the joint's limits)"
        )
    return positions(keys, limits, gripper, units)


def positions(
    names: Sequence[str], limits: Sequence[tuple[float, float]], gripper: tuple[float, float] | None, units: Units
) -> list[Channel]:
    """Return joints in units of the model's, a gripper from 0 where it is closed to 100 where it is open.

    Args:
        names: In the dicts, the gripper's last.
        limits: Of each joint of the arm, rad.
        gripper: Joint value where open and where closed; None without a gripper.
        units: Of the arm's joints.
    """
    found: list[Channel] = []
    for name, (low, high) in zip(names, limits, strict=False):
        unit, zero = math.radians(1.0) if units == "degrees" else 1.0, 0.0
        if units == "normalized":
            unit, zero = (high - low) / 200.0, (low + high) / 2.0
        found.append(LinearChannel(key=name + POSITION, lower=low, upper=high, unit=unit, zero=zero))
    if gripper:
        opened, closed = gripper
        unit = (opened - closed) / 100.0
        key = names[-1] + POSITION
        found.append(LinearChannel(key=key, lower=min(gripper), upper=max(gripper), unit=unit, zero=closed))
    return found


def _of_servos(
    bus: SerialMotorsBus,
    keys: Sequence[str],
    motors: Sequence[str],
    names: Sequence[str],
    ends: Sequence[tuple[float, float]],
    closed: float | None,
) -> list[Channel]:
    """Return the joints of a calibrated bus, their ranges held against the model's; `closed` is where its jaws meet."""
    missing = [motor for motor in motors if motor not in bus.calibration]
    if missing:
        raise InputError(f"{', '.join(missing)} of {bus.port} have no calibration: run lerobot-calibrate")
    counts = {bus.model_resolution_table[bus.motors[motor].model] for motor in motors}
    if len(counts) > 1:
        raise InputError(f"the servos of {bus.port} have {', '.join(map(str, sorted(counts)))} counts to a turn")
    files: Mapping[str, ServoCalibration] = {
        name: ServoCalibration(**asdict(bus.calibration[motor])) for name, motor in zip(names, motors, strict=True)
    }
    found = servo_joints(files, names, ends, counts.pop(), closed=closed)
    check_ranges(
        found,
        gripper=closed is not None,
        remedy="run lerobot-calibrate again, each joint from its middle to both its ends",
    )
    return [
        ServoChannel(
            key=key + POSITION,
            servo=joint,
            mode=bus.motors[motor].norm_mode,
            flips=bool(bus.apply_drive_mode and joint.calibration.drive_mode),
        )
        for key, motor, joint in zip(keys, motors, found, strict=True)
    ]
