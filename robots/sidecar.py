"""The sidecar: what a robot's URDF or MJCF does not say. One page of YAML beside the model."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, field_validator, model_validator

from robosandbox.types import Finite, Limits, Positive, QuatXyzw, StrictModel, Vec3

Name = Annotated[str, Field(min_length=1)]
_FARTHEST = 10.0  # Metres of an offset in a sidecar. Chosen so that millimetres are told.
_FARTHEST_BASE = 100.0  # Metres from the world's origin to a base. Chosen likewise.


def _no_farther(most: float) -> AfterValidator:
    def check(xyz: Vec3) -> Vec3:
        if math.hypot(*xyz) > most:
            raise ValueError(f"{math.hypot(*xyz):g} m away; it is in metres, at most {most:g}: are these millimetres?")
        return xyz

    return AfterValidator(check)


Offset = Annotated[Vec3, _no_farther(_FARTHEST)]


def _refuse_duplicates(field: str, names: tuple[str, ...]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{field}: {name!r} is listed twice; each name stands once")


class ArmRoles(StrictModel):
    """The arm's chain.

    Attributes:
        joints: Proximal to distal.
        actuators: One per joint, same order; found in the model when left out, as a URDF has none.
        home_qpos: One value per joint.
        velocity_limits: Per joint, rad/s or m/s; derived from the model when left out.
        acceleration_limits: Per joint, rad/s^2 or m/s^2; derived from the model when left out.
    """

    joints: Annotated[tuple[Name, ...], Field(min_length=1)]
    actuators: tuple[Name, ...] = ()
    home_qpos: tuple[Finite, ...]
    velocity_limits: tuple[Positive, ...] | None = None
    acceleration_limits: tuple[Positive, ...] | None = None

    @model_validator(mode="after")
    def _lists_match(self) -> Self:
        _refuse_duplicates("joints", self.joints)
        _refuse_duplicates("actuators", self.actuators)
        for field in ("actuators", "home_qpos", "velocity_limits", "acceleration_limits"):
            values = getattr(self, field)
            if (values and len(values) != len(self.joints)) or (field == "home_qpos" and not values):
                raise ValueError(
                    f"{field}: has {len(values)} entries for {len(self.joints)} joints; give one per joint"
                )
        return self


class GripperAttachment(StrictModel):
    """A gripper with a model of its own, mounted on the arm; its elements are then called `gripper/<name>`.

    Attributes:
        model: The gripper's URDF or MJCF, relative to the sidecar.
        to_body: The body of the arm that it is mounted on; or
        to_site: the site.
        xyz: Where on it, metres.
        quat_xyzw: And how it is turned there.
    """

    model: Path
    to_body: Name | None = None
    to_site: Name | None = None
    xyz: Offset = (0.0, 0.0, 0.0)
    quat_xyzw: QuatXyzw = (0.0, 0.0, 0.0, 1.0)

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.to_body is None) == (self.to_site is None):
            raise ValueError("to_body: give `to_body` or `to_site`, and not both")
        return self


class GripperRoles(StrictModel):
    """The gripper's joints and what open and closed are.

    Attributes:
        kind: "fingers", which need not be said.
        attach: A gripper from a file of its own, mounted on the arm.
        joints: All joints that move with the gripper.
        primary_joint: The one whose value `open_qpos` and `closed_qpos` are.
        actuator: What drives it; found in the model when left out, as a URDF has none.
        actuators: In place of `actuator`, when several do.
        open_qpos: Joint value, not width.
        closed_qpos: Joint value; may be the larger or the smaller one.
    """

    kind: Literal["fingers"] = "fingers"
    attach: GripperAttachment | None = None
    joints: Annotated[tuple[Name, ...], Field(min_length=1)]
    primary_joint: Name
    actuator: Name | None = None
    actuators: tuple[Name, ...] = ()
    open_qpos: Finite
    closed_qpos: Finite

    @model_validator(mode="after")
    def _roles_agree(self) -> Self:
        _refuse_duplicates("joints", self.joints)
        _refuse_duplicates("actuators", self.actuators)
        if self.primary_joint not in self.joints:
            raise ValueError(f"primary_joint: {self.primary_joint!r} is not in joints {list(self.joints)}")
        if self.actuator and self.actuators:
            raise ValueError("actuator: give one `actuator`, or a list `actuators`, and not both")
        if abs(self.open_qpos - self.closed_qpos) < 1e-6:
            raise ValueError(f"closed_qpos: {self.closed_qpos} equals open_qpos; the two must differ")
        return self

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """The actuators, however they were given."""
        return (self.actuator,) if self.actuator else self.actuators


class SuctionRoles(StrictModel):
    """A suction cup: no joints, and what sucks.

    Attributes:
        kind: "suction".
        attach: A cup from a file of its own, mounted on the arm.
        actuator: MuJoCo's adhesion on the cup's body; found in the model when left out.
    """

    kind: Literal["suction"]
    attach: GripperAttachment | None = None
    actuator: Name | None = None

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """The actuator, as of a gripper with fingers."""
        return (self.actuator,) if self.actuator else ()


class InjectedSite(StrictModel):
    """A TCP site that the model does not have.

    Attributes:
        attach_body: The body that it rides on.
        xyz: The TCP in that body's frame, metres.
        quat_xyzw: The TCP frame's orientation there; z is the approach direction.
    """

    attach_body: Name
    xyz: Offset
    quat_xyzw: QuatXyzw | None = None


class EeSite(StrictModel):
    """The tool centre point: a site of the model by name, or an injected one."""

    name: Name | None = None
    inject: InjectedSite | None = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.name is None) == (self.inject is None):
            raise ValueError("inject: give `name` (a site of the model) or `inject`, and not both")
        return self


class BasePose(StrictModel):
    """Pose of the robot's base in the world."""

    xyz: Annotated[Vec3, _no_farther(_FARTHEST_BASE)] = (0.0, 0.0, 0.0)
    quat_xyzw: QuatXyzw = (0.0, 0.0, 0.0, 1.0)


class Sidecar(StrictModel):
    """Roles of a robot's elements: arm, gripper, TCP, base; what this robot may never do; and whose its physics are.

    Attributes:
        physics: "fitted" lets loading make servos, hold the arm's own weight and fit fingers and solver to grasping;
            "as_in_file" keeps every value of the model's file but the time step.
    """

    arm: ArmRoles
    gripper: Annotated[GripperRoles | SuctionRoles, Field(discriminator="kind")] | None = None
    ee_site: EeSite
    base_pose: BasePose = BasePose()
    limits: Limits | None = None
    physics: Literal["fitted", "as_in_file"] = "fitted"

    @field_validator("gripper", mode="before")
    @classmethod
    def _fingers_by_default(cls, value: object) -> object:
        return {"kind": "fingers", **value} if isinstance(value, dict) else value

    @property
    def fingers(self) -> GripperRoles | None:
        """The gripper, where it is one with fingers."""
        return self.gripper if isinstance(self.gripper, GripperRoles) else None

    @property
    def suction(self) -> SuctionRoles | None:
        """The gripper, where it is a suction cup."""
        return self.gripper if isinstance(self.gripper, SuctionRoles) else None
