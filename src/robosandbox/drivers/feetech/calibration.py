"""Calibration of an arm's servos, in LeRobot's files: from encoder counts to joint values and back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from robosandbox.errors import InputError
from robosandbox.values import frozen

Count = Annotated[int, Field(strict=True, ge=-32767, le=32767)]

# How much less, and how much more than from limit to limit a joint may be calibrated for, rad. Half of the difference is how far
# its zero may be off. Published calibrations of five SO-101 and SO-100 by LeRobot tell what whole ways are: 2 degrees less, where a
# hand did not press on to the stop, to 20 more, where the model's limits lie within the stops; each with a quarter of 20 to spare.
_LEAST_LESS, _MOST_MORE = math.radians(7.0), math.radians(25.0)
# A joint of this range may be calibrated for a whole turn, rad: LeRobot gives one to each wrist_roll (320 degrees) unseen, while the
# joint that turns farthest else has 220.
_NEARLY_WHOLE = 1.5 * math.pi
_AGAIN = "python -m robosandbox.drivers.feetech range --port PORT --out FILE"
_REMEDY = f"put it into its middle, call `middle`, and calibrate it again: `{_AGAIN}`"

NO_CALIBRATION = (
    "calibration: none is given, and the encoders alone do not tell where the arm stands: it is off by as much as each horn was put on; "
    f"calibration=FILE gives LeRobot's file, or one of `{_AGAIN}`"
)
"""Why an arm without a calibration is not opened."""


def torque_is_on(port: str) -> str:
    """Return why an arm cannot be led by hand, and what to do."""
    return (
        "the torque is on, and nobody can lead it: hold the arm, and call "
        f"`python -m robosandbox.drivers.feetech release --port {port}`"
    )


class ServoCalibration(BaseModel):
    """Entry of one servo in a file of LeRobot's (`calibration/robots/so_follower/<id>.json`).

    Attributes:
        id: Of the servo on the bus.
        drive_mode: 1 where the joint turns against the model's.
        homing_offset: Counts that the servo itself takes off what its encoder reads.
        range_min: Least count that the joint reaches.
        range_max: Largest.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: Annotated[int, Field(strict=True, ge=0, le=252)]
    drive_mode: Literal[0, 1] = 0
    homing_offset: Count = 0
    range_min: Count
    range_max: Count


_FILE = TypeAdapter(dict[str, ServoCalibration])


@frozen(kw_only=True)
class ServoJoint:
    """A joint and its servo.

    Attributes:
        name: Of the joint.
        calibration: Of the servo.
        lower: Least value that is commanded, rad.
        upper: Largest.
        middle: Joint value in the middle of the servo's range.
        counts: Encoder counts of a turn.
    """

    name: str
    calibration: ServoCalibration
    lower: float
    upper: float
    middle: float
    counts: int

    @property
    def id(self) -> int:
        """Of the servo on the bus."""
        return self.calibration.id

    @property
    def said(self) -> str:
        """Joint and servo, for people."""
        return f"{self.name} (servo {self.id})"

    @property
    def radians(self) -> float:
        """Turn of the joint with one count, rad."""
        return (-1.0 if self.calibration.drive_mode else 1.0) * 2.0 * math.pi / self.counts

    def value(self, counts: float) -> float:
        """Return the joint value at a count."""
        return self.middle + self.radians * (counts - _middle(self.calibration))

    def count(self, value: float) -> int:
        """Return the count nearest to a joint value, within the joint's limits and the servo's range."""
        inside = min(max(value, self.lower), self.upper)
        nearest = round(_middle(self.calibration) + (inside - self.middle) / self.radians)
        return min(max(nearest, self.calibration.range_min), self.calibration.range_max)


def read_calibration(path: Path) -> dict[str, ServoCalibration]:
    """Return the servos of a file by the names of their joints.

    Raises:
        InputError: There is no such file, it is no calibration, or two servos have one id.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(data, dict) and isinstance(data.get("motor_names"), list):
            # Its numbers were applied by the computer; now the servos themselves keep offsets.
            raise InputError(
                f"calibration: {path}: is of an older LeRobot (lists of motor_names, homing_offset, drive_mode), whose numbers "
                f"the servos do not keep; calibrate anew, by `lerobot-calibrate` or `{_AGAIN}`"
            )
        found = _FILE.validate_python(data)
    except OSError as error:
        raise InputError(f"calibration: {path}: {error.strerror}") from None
    except (ValidationError, ValueError) as error:
        first = error.errors()[0] if isinstance(error, ValidationError) else {"loc": (), "msg": str(error)}
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        raise InputError(f"calibration: {path}: {where}: {first['msg']}; it is to be a file of LeRobot's") from None
    ids = [servo.id for servo in found.values()]
    twice = next((id for id in ids if ids.count(id) > 1), None)
    if twice is not None:
        raise InputError(f"calibration: {path}: two servos have the id {twice}")
    for name, servo in found.items():
        if servo.range_max - servo.range_min < 2:
            raise InputError(f"calibration: {path}: {name}: range_min..range_max is empty; calibrate it again")
    return found


def write_calibration(path: Path, servos: Mapping[str, ServoCalibration]) -> None:
    """Write a file that LeRobot reads as well."""
    path.write_text(json.dumps(_FILE.dump_python(dict(servos)), indent=4) + "\n", encoding="utf-8")


def servo_joints(
    servos: Mapping[str, ServoCalibration],
    names: Sequence[str],
    limits: Sequence[tuple[float, float]],
    counts: int,
    *,
    closed: float | None = None,
) -> list[ServoJoint]:
    """Return the joints of an arm with their servos.

    The middle of a servo's range is the middle of the joint's limits. A range of a whole turn says nothing of the ends: its middle,
    where LeRobot homes the servo, is the model's zero. A gripper's jaws meet at one end, whatever the other is.

    Args:
        servos: As calibrated.
        names: Joints from base to gripper, in the same order.
        limits: Of each joint, rad.
        counts: Of a turn.
        closed: Value of the last joint, the gripper's, in which its jaws meet; without it its middles are one as well.

    Raises:
        InputError: The file has other joints, and not as many.
    """
    servos = _of_arm(servos, names)
    joints = []
    for name, (lower, upper) in zip(names, limits, strict=True):
        servo = servos[name]
        span = servo.range_max - servo.range_min
        middle = 0.5 * (lower + upper)
        if span >= counts - 2:
            middle = 0.0
        elif closed is not None and name == names[-1]:
            middle = closed + math.copysign(span * math.pi / counts, middle - closed)
        joints.append(ServoJoint(name=name, calibration=servo, lower=lower, upper=upper, middle=middle, counts=counts))
    return joints


def _of_arm(servos: Mapping[str, ServoCalibration], names: Sequence[str]) -> Mapping[str, ServoCalibration]:
    """Return the servos of an arm's joints by these names; a robot may have more, as LeKiwi its wheels, and names before theirs.

    Raises:
        InputError: They cannot be told.
    """
    found = {name: [each for each in servos if each == name or each.endswith(f"_{name}")] for name in names}
    if all(len(each) == 1 for each in found.values()):
        return {name: servos[each] for name, (each,) in found.items()}
    if all(name in servos for name in names):
        return servos
    # Other names for the same chain, whose ids count up from the base: what is named like the gripper.
    grippers = found[names[-1]]
    start = grippers[0].removesuffix(names[-1]) if len(grippers) == 1 else ""
    arms = [each for each in servos if each.startswith(start)]
    if len(arms) != len(names):
        raise InputError(f"calibration: has {', '.join(servos)}, and the joints are {', '.join(names)}")
    return dict(zip(names, sorted((servos[each] for each in arms), key=lambda servo: servo.id), strict=True))


def check_ranges(joints: Sequence[ServoJoint], *, gripper: bool, remedy: str = _REMEDY) -> None:
    """See whether every joint was calibrated for the way that it has in the model, so that its zero is the model's.

    Args:
        joints: Of an arm, from base to gripper.
        gripper: Whether the last one is a gripper, whose jaws meet at one end: it may open wider than the model's by any angle.
        remedy: What to do, for the error.

    Raises:
        InputError: One was led through a part of its way, or counted over its encoder's end; it says which.
    """
    for joint in joints:
        servo, turn = joint.calibration, 2.0 * math.pi
        span, wanted = (servo.range_max - servo.range_min) * abs(joint.radians), joint.upper - joint.lower
        is_whole = span >= turn - 2.0 * abs(joint.radians)
        # Limits a whole turn apart are no stops.
        if wanted >= turn - 2.0 * abs(joint.radians) or (is_whole and wanted >= _NEARLY_WHOLE):
            continue
        if span < wanted - _LEAST_LESS:
            why = "it was not led to both of its ends"
        elif span > wanted + _MOST_MORE and not (gripper and joint is joints[-1] and not is_whole):
            why = "it is another arm's, or its count ran over the encoder's end"
        else:
            continue
        raise InputError(
            f"calibration: {joint.said} goes through {math.degrees(span):.0f} degrees, and {math.degrees(wanted):.0f} in the model: "
            f"{why}, and its zero may be {math.degrees(abs(span - wanted) / 2.0):.0f} degrees off; {remedy}"
        )


def _middle(servo: ServoCalibration) -> float:
    return 0.5 * (servo.range_min + servo.range_max)
