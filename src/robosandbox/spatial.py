"""Poses and rotations: SI units and radians, quaternions in x, y, z, w order, world frame +z up, +x ahead of the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticOmit, core_schema


class _Numbers:
    """Writes an array as lists of numbers, and reads it back from them as a read-only array."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        write = core_schema.plain_serializer_function_ser_schema(np.ndarray.tolist, when_used="json")
        return core_schema.no_info_plain_validator_function(_finite_array, serialization=write)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        number = {"type": "number"}
        return {"type": "array", "items": {"anyOf": [number, {"type": "array", "items": number}]}}


class Unsent:
    """Marks a value's field that stays in this process: it is neither written nor in a schema."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.any_schema()

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        raise PydanticOmit


Array = Annotated[NDArray[np.float64], _Numbers()]

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
Vec3 = tuple[Finite, Finite, Finite]
Side = Literal["left", "right", "front", "back"]
Direction = Literal["forward", "back", "left", "right"]

# Unit vectors in the world's xy plane. The words are the robot's: forward is away from it, and the front of a thing
# is the side that it sees, so "back" as a way to go and "back" as a side of a thing are opposite.
DIRECTION_AXES: Mapping[str, tuple[float, float]] = {
    "forward": (1.0, 0.0),
    "back": (-1.0, 0.0),
    "left": (0.0, 1.0),
    "right": (0.0, -1.0),
}
SIDE_AXES: Mapping[str, tuple[float, float]] = {
    "front": (-1.0, 0.0),
    "back": (1.0, 0.0),
    "left": (0.0, 1.0),
    "right": (0.0, -1.0),
}


class StrictModel(BaseModel):
    """A frozen pydantic model that refuses unknown fields."""

    # A schema is built when its class is first used: a process needs a few of the hundred, and each takes part of a millisecond.
    model_config: ClassVar[ConfigDict] = ConfigDict(extra="forbid", frozen=True, defer_build=True)


def _unit_quaternion(quat_xyzw: tuple[float, ...]) -> tuple[float, ...]:
    norm = math.sqrt(sum(c * c for c in quat_xyzw))
    if norm < 1e-6:
        raise ValueError("a quaternion of length zero is no rotation; [0, 0, 0, 1] is the identity")
    if abs(norm - 1.0) < 1e-9:
        return quat_xyzw
    return tuple(c / norm for c in quat_xyzw)


QuatXyzw = Annotated[tuple[Finite, Finite, Finite, Finite], AfterValidator(_unit_quaternion)]


class Pose(StrictModel):
    """A position and an orientation.

    Attributes:
        xyz: Metres.
        quat_xyzw: A unit quaternion in x, y, z, w order.
    """

    xyz: Vec3
    quat_xyzw: QuatXyzw = (0.0, 0.0, 0.0, 1.0)

    @classmethod
    def from_matrix(cls, position: Array, rotation: Array) -> Self:
        """Return the pose with `position` (3,) and `rotation` (3, 3)."""
        return cls.model_construct(
            xyz=(float(position[0]), float(position[1]), float(position[2])),
            quat_xyzw=quat_xyzw_from_matrix(rotation),
        )

    @property
    def position(self) -> Array:
        """The position as an array, shape (3,)."""
        return np.array(self.xyz)

    @property
    def rotation(self) -> Array:
        """The rotation matrix, shape (3, 3)."""
        return matrix_from_quat_xyzw(self.quat_xyzw)

    @property
    def yaw(self) -> float:
        """The heading of the pose's x axis about world z, radians."""
        x, y, z, w = self.quat_xyzw
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    def __matmul__(self, other: Pose) -> Pose:
        """Compose: `T_a_b @ T_b_c` is `T_a_c`."""
        rotation = self.rotation
        return Pose.from_matrix(self.position + rotation @ other.position, rotation @ other.rotation)

    def angle_to(self, other: Pose) -> float:
        """Return the angle between two attitudes, radians."""
        return 2.0 * float(np.arccos(min(1.0, abs(float(np.dot(self.quat_xyzw, other.quat_xyzw))))))

    def inverse(self) -> Pose:
        """Return the inverse transform."""
        rotation = self.rotation.T
        return Pose.from_matrix(-rotation @ self.position, rotation)


def matrix_from_quat_xyzw(quat_xyzw: tuple[float, float, float, float]) -> Array:
    """Return the rotation matrix (3, 3) of a unit quaternion in x, y, z, w order."""
    x, y, z, w = quat_xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def cross(a: Array, b: Array) -> Array:
    """Return a x b, both (3,); numpy's own takes ten times as long on single vectors."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def matrix_about_axis(axis: Array, angle: float) -> Array:
    """Return the rotation matrix, shape (3, 3), about a unit axis by an angle, radians (Rodrigues' formula)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return rotation


def matrix_from_rotation_vector(vector: Array) -> Array:
    """Return the rotation matrix, shape (3, 3), about a vector by its length, radians."""
    angle = float(np.linalg.norm(vector))
    return np.eye(3) if angle < 1e-12 else matrix_about_axis(vector / angle, angle)


def quat_xyzw_from_matrix(rotation: Array) -> tuple[float, float, float, float]:
    """Return the unit quaternion, x, y, z, w order, of a rotation matrix (3, 3) (Shepperd's method)."""
    (m00, m01, m02), (m10, m11, m12), (m20, m21, m22) = rotation.tolist()
    trace = m00 + m11 + m22
    if trace > 0.0:
        s = 2.0 * math.sqrt(trace + 1.0)
        quat = ((m21 - m12) / s, (m02 - m20) / s, (m10 - m01) / s, 0.25 * s)
    elif m00 >= m11 and m00 >= m22:
        s = 2.0 * math.sqrt(max(1.0 + m00 - m11 - m22, 1e-16))
        quat = (0.25 * s, (m01 + m10) / s, (m02 + m20) / s, (m21 - m12) / s)
    elif m11 >= m22:
        s = 2.0 * math.sqrt(max(1.0 + m11 - m00 - m22, 1e-16))
        quat = ((m01 + m10) / s, 0.25 * s, (m12 + m21) / s, (m02 - m20) / s)
    else:
        s = 2.0 * math.sqrt(max(1.0 + m22 - m00 - m11, 1e-16))
        quat = ((m02 + m20) / s, (m12 + m21) / s, 0.25 * s, (m10 - m01) / s)
    norm = math.sqrt(sum(c * c for c in quat))
    return (quat[0] / norm, quat[1] / norm, quat[2] / norm, quat[3] / norm)


def _finite_array(values: Any) -> Array:
    array = frozen_array(values)
    if not np.isfinite(array).all():
        raise ValueError("has a number that is not finite")
    return array


def frozen_array(values: Any) -> Array:
    """Return a read-only float copy of `values`."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
