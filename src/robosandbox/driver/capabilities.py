"""Capabilities that a driver declares, and the error where it is asked for one that it lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from robosandbox.driver.clamps import TOLERANCES
from robosandbox.errors import Phase, UnsupportedError
from robosandbox.values import frozen

if TYPE_CHECKING:
    from robosandbox.driver.protocols import Driver, Simulated
    from robosandbox.types import Intrinsics, Pose
    from robosandbox.types.robot import RobotSpec

# Predicates of "the driver of <robot> ..." for a driver that lacks each capability.
_LACKS = {
    "gripper_force": "does not tell the force of its gripper",
    "grip_limit": "takes no limit of its gripper's force",
    "joint_torque": "does not tell the torques of its joints",
    "wrist_wrench": "does not tell the force at its wrist",
    "contact": "does not tell contact of the arm",
    "cameras": "has no cameras",
    "fork": "cannot copy its world",
    "reset": "cannot start its world over",
    "truth": "does not know the true state of its world",
}


@frozen(kw_only=True)
class CameraSpec:
    """A camera as it is built in; each frame tells its own pose and intrinsics, as calibrated.

    Attributes:
        intrinsics: Size and pinhole of its frames.
        pose: Of its optical frame (z forward, y down), in the world, or in the TCP's frame of the arm that carries it.
        arm: Name of the arm on whose hand it rides; None where it stands.
        windows: Whether `capture` can be asked for a part of the picture alone, and it costs less.
    """

    intrinsics: Intrinsics
    pose: Pose
    arm: str | None = None
    windows: bool = False


@frozen(kw_only=True)
class Capabilities:
    """Capabilities of a driver. One that it lacks is None in its values, and an UnsupportedError where it is asked for.

    Attributes:
        gripper_force: Whether the gripper tells with how much force it holds.
        grip_limit: Whether the gripper can be told with how much force to close at most.
        joint_torque: Whether the joints tell what their servos give.
        wrist_wrench: Whether it tells with how much force the hand presses and pulls.
        contact: Whether it tells that the arm touches something: "named" with what, "felt" without; None not at all.
        cameras: By the names that `capture` takes.
        fork: Whether its world can be copied.
        reset: Whether its world can start over.
        truth: Whether it knows the true state of its world.
        clock: Whether time passes by itself ("wall") or only while the driver is asked to let it pass ("simulated").
        link_timeout: Seconds without news of the robot after which it is lost: `state().time` is when it last told. None where
            the driver does not tell, or there is no link.
        speed: Share of the speed of every trajectory that the driver follows it with, above 0 to 1.
    """

    gripper_force: bool = False
    grip_limit: bool = False
    joint_torque: bool = False
    wrist_wrench: bool = False
    contact: Literal["named", "felt"] | None = None
    cameras: Mapping[str, CameraSpec] = field(default_factory=dict)
    fork: bool = False
    reset: bool = False
    truth: bool = False
    clock: Literal["simulated", "wall"] = "wall"
    link_timeout: float | None = None
    speed: float = 1.0


class Specified(Protocol):
    """Whatever has a robot's specification."""

    @property
    def spec(self) -> RobotSpec:
        """Specification."""
        ...


class Declares(Protocol):
    """Whatever says what it can do."""

    @property
    def arms(self) -> Mapping[str, Specified]:
        """The arms by name."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities of the driver."""
        ...


CAPABILITIES: tuple[str, ...] = tuple(
    item.name for item in fields(Capabilities) if item.name not in ("clock", "link_timeout", "speed")
)


def require(driver: Declares, capability: str, purpose: str) -> None:
    """Check that a driver has a capability.

    Args:
        driver: Who has to have it.
        capability: A field of `Capabilities`.
        purpose: What it is needed for, as "a touch is felt with it".

    Raises:
        UnsupportedError: The driver does not have it.
    """
    if not getattr(driver.capabilities, capability):
        raise refusal(driver, capability, purpose)


def refusal(driver: Declares, capability: str, purpose: str) -> UnsupportedError:
    """Return the error of a driver that does not have a capability; arguments as those of `require`."""
    return UnsupportedError(
        f"{capability}: the driver of {robot_name(driver)} {_LACKS[capability]}, and {purpose}; "
        "use a driver that declares it",
        phase=Phase.CHECK,
    )


def robot_name(driver: Declares) -> str:
    """Return the name of a driver's robot for people; of several arms the names of each model."""
    return " and ".join(dict.fromkeys(arm.spec.name for arm in driver.arms.values()))


def simulated(driver: Driver, purpose: str) -> Simulated:
    """Return the simulated world that a driver drives.

    Args:
        driver: Whose world.
        purpose: What it is needed for, as "a checkpoint is taken of it".

    Raises:
        UnsupportedError: There is none.
    """
    world = driver.simulation
    require(driver, "truth", purpose)
    require(driver, "reset", purpose)
    if world is None:
        raise TypeError(f"{type(driver).__name__} declares truth and reset and has no simulation; see check_driver")
    return world


def come_to_rest(driver: Driver, seconds: float = 0.5) -> None:
    """Hold the arms and let time pass until they are still, `seconds` at most."""
    driver.stop()
    for _ in range(round(seconds / driver.control_timestep)):
        if all(float(np.abs(arm.state().qd).max()) < TOLERANCES.still for arm in driver.arms.values()):
            return
        driver.wait(driver.control_timestep)
