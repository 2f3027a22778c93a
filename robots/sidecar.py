"""The sidecar: what a robot's URDF or MJCF does not say. One page of YAML beside the model."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from robosandbox.types import Finite, Positive, QuatXyzw, StrictModel, Vec3

Name = Annotated[str, Field(min_length=1)]


def _refuse_duplicates(field: str, names: tuple[str, ...]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{field}: {name!r} is listed twice; each name stands once")


class ArmRoles(StrictModel):
    """The arm's chain.

    Attributes:
        joints: Proximal to distal.
        actuators: One per joint, same order.
        home_qpos: One value per joint.
        velocity_limits: Per joint, rad/s or m/s; derived from the model when left out.
        acceleration_limits: Per joint, rad/s^2 or m/s^2; derived from the model when left out.
    """

    joints: Annotated[tuple[Name, ...], Field(min_length=1)]
    actuators: Annotated[tuple[Name, ...], Field(min_length=1)]
    home_qpos: tuple[Finite, ...]
    velocity_limits: tuple[Positive, ...] | None = None
    acceleration_limits: tuple[Positive, ...] | None = None

    @model_validator(mode="after")
    def _lists_match(self) -> Self:
        _refuse_duplicates("joints", self.joints)
        _refuse_duplicates("actuators", self.actuators)
        for field in ("actuators", "home_qpos", "velocity_limits", "acceleration_limits"):
            values = getattr(self, field)
            if values is not None and len(values) != len(self.joints):
                raise ValueError(
                    f"{field}: has {len(values)} entries for {len(self.joints)} joints; give one per joint"
                )
        return self


class GripperRoles(StrictModel):
    """The gripper's joints and what open and closed are.

    Attributes:
        joints: All joints that move with the gripper.
        primary_joint: The one whose value `open_qpos` and `closed_qpos` are.
        actuator: What drives it; or `actuators`, when several do.
        open_qpos: Joint value, not width.
        closed_qpos: Joint value; may be the larger or the smaller one.
    """

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
        if bool(self.actuator) == bool(self.actuators):
            raise ValueError("actuator: give one `actuator`, or a list `actuators`")
        if abs(self.open_qpos - self.closed_qpos) < 1e-6:
            raise ValueError(f"closed_qpos: {self.closed_qpos} equals open_qpos; the two must differ")
        return self

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """The actuators, however they were given."""
        return (self.actuator,) if self.actuator else self.actuators


class InjectedSite(StrictModel):
    """A TCP site that the model does not have.

    Attributes:
        attach_body: The body that it rides on.
        xyz: The TCP in that body's frame, metres.
        quat_xyzw: The TCP frame's orientation there; z is the approach direction.
    """

    attach_body: Name
    xyz: Vec3
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
    """Where the robot's base stands in the world."""

    xyz: Vec3 = (0.0, 0.0, 0.0)
    quat_xyzw: QuatXyzw = (0.0, 0.0, 0.0, 1.0)


class Sidecar(StrictModel):
    """Roles of a robot's elements: arm, gripper, TCP, base."""

    arm: ArmRoles
    gripper: GripperRoles | None = None
    ee_site: EeSite
    base_pose: BasePose = BasePose()
