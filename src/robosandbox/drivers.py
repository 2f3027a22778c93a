"""What a driver declares that it can do, and the error where something is asked of it that it cannot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal, Protocol

from robosandbox.errors import Phase, UnsupportedError
from robosandbox.plugins import load_plugin

if TYPE_CHECKING:
    from robosandbox.protocols import Driver

# What people read of each capability in an error.
_SAID = {
    "gripper_force": "the force of its gripper",
    "joint_torque": "the torques of its joints",
    "wrist_wrench": "the force at its wrist",
    "contact": "contact of the arm",
    "cameras": "camera pictures",
    "fork": "copies of its world",
    "reset": "a reset of its world",
    "truth": "the true state of its world",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Capabilities:
    """What a driver has. What it does not have is None in its values, and an UnsupportedError where it is asked for.

    Attributes:
        gripper_force: Whether the gripper tells with how much force it holds.
        joint_torque: Whether the joints tell what their servos give.
        wrist_wrench: Whether it tells with how much force the hand presses and pulls.
        contact: Whether it tells that the arm touches something: "named" with what, "felt" without; None not at all.
        cameras: Names that `capture` takes.
        fork: Whether its world can be copied.
        reset: Whether its world can start over.
        truth: Whether it knows the true state of its world.
        clock: Whether time passes by itself ("wall") or only while the driver is asked to let it pass ("simulated").
    """

    gripper_force: bool = False
    joint_torque: bool = False
    wrist_wrench: bool = False
    contact: Literal["named", "felt"] | None = None
    cameras: tuple[str, ...] = ()
    fork: bool = False
    reset: bool = False
    truth: bool = False
    clock: Literal["simulated", "wall"] = "wall"


class Named(Protocol):
    """Whatever has a name."""

    @property
    def name(self) -> str:
        """What people call it."""
        ...


class Declares(Protocol):
    """Whatever says what it can do."""

    @property
    def robot(self) -> Named:
        """Whose it is."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """What it has."""
        ...


CAPABILITIES: tuple[str, ...] = tuple(field.name for field in fields(Capabilities) if field.name != "clock")


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
        raise UnsupportedError(
            f"{capability}: the driver of {driver.robot.name} does not tell {_SAID[capability]}, and {purpose}; "
            "use a driver that declares it",
            phase=Phase.CHECK,
        )


def load_driver(name: str, options: Mapping[str, Any] | None = None) -> Driver:
    """Return an installed driver.

    Args:
        name: As registered under `robosandbox.drivers`.
        options: Its keyword arguments.

    Raises:
        InputError: There is none of that name.
    """
    driver: Driver = load_plugin("drivers", name)(**(options or {}))
    return driver
