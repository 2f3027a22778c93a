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
        found = _FILE.validate_python(json.loads(path.read_text(encoding="utf-8")))
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
    servos: Mapping[str, ServoCalibration] | None,
    names: Sequence[str],
    limits: Sequence[tuple[float, float]],
    counts: int,
) -> list[ServoJoint]:
    """Return the joints of an arm with their servos.

    The ends of a servo's range are the ends of the joint's limits, so that their middles are one. A range of a whole turn says
    nothing of the ends: its middle, where LeRobot homes the servo, is the model's zero.

    Args:
        servos: As calibrated; without them ids count up from 1, from the base to the gripper, with the middle of the encoder in
            the middle of each joint's limits.
        names: Joints from base to gripper, in the same order.
        limits: Of each joint, rad.
        counts: Of a turn.

    Raises:
        InputError: The file has other joints, and not as many.
    """
    if servos is None:
        servos = {
            name: ServoCalibration(id=index + 1, range_min=max(0, counts // 2 - reach), range_max=counts // 2 + reach)
            for index, (name, (lower, upper)) in enumerate(zip(names, limits, strict=True))
            for reach in (min(round((upper - lower) / (4.0 * math.pi) * counts), counts // 2 - 1),)
        }
    if not {*names} <= {*servos}:
        if len(servos) != len(names):
            raise InputError(f"calibration: has {', '.join(servos)}, and the joints are {', '.join(names)}")
        # Other names for the same chain: ids count up from the base.
        servos = dict(zip(names, sorted(servos.values(), key=lambda servo: servo.id), strict=True))
    joints = []
    for name, (lower, upper) in zip(names, limits, strict=True):
        servo = servos[name]
        whole = servo.range_max - servo.range_min >= counts - 2
        middle = 0.0 if whole else 0.5 * (lower + upper)
        joints.append(ServoJoint(name=name, calibration=servo, lower=lower, upper=upper, middle=middle, counts=counts))
    return joints


def _middle(servo: ServoCalibration) -> float:
    return 0.5 * (servo.range_min + servo.range_max)
