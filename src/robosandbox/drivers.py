"""What a driver declares that it can do, how one is opened, and the error where something is asked of it that it cannot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from inspect import signature
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

from robosandbox.errors import InputError, Phase, UnsupportedError
from robosandbox.plugins import bind_plugin, load_plugin

if TYPE_CHECKING:
    from robosandbox.protocols import Driver, Simulated
    from robosandbox.types import Intrinsics, Pose, Scene

# Joint speed below which an arm counts as still, rad/s or m/s: chosen so that it moves by 0.1 mm in a tick at a metre's reach.
_STILL_SPEED = 0.01

# What people read of a driver without each capability.
_SAID = {
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


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSpec:
    """A camera as it is built in; each frame tells its own pose and intrinsics, as calibrated.

    Attributes:
        intrinsics: Size and pinhole of its frames.
        pose: Of its optical frame (z forward, y down), in the world, or in the TCP's frame where it rides on the hand.
        on_hand: Whether it rides on the hand.
        windows: Whether `capture` can be asked for a part of the picture alone, and it costs less.
    """

    intrinsics: Intrinsics
    pose: Pose
    on_hand: bool = False
    windows: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Capabilities:
    """What a driver has. What it does not have is None in its values, and an UnsupportedError where it is asked for.

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


class Named(Protocol):
    """Whatever has a name."""

    @property
    def name(self) -> str:
        """What people call it."""
        ...


class Declares(Protocol):
    """Whatever says what it can do."""

    @property
    def spec(self) -> Named:
        """Whose it is."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """What it has."""
        ...


# Parameters that a driver's factory may have and no person gives: (height, width) of pictures in pixels; the objects of which
# the truth is to tell how hard they were pressed; what is called while it loads, and raises to end that; where the arm is to
# begin, shape (n,).
SUPPLIED = ("render_size", "felt", "wait_hook", "start_q")
CAPABILITIES: tuple[str, ...] = tuple(item.name for item in fields(Capabilities) if item.name != "clock")


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
        f"{capability}: the driver of {driver.spec.name} {_SAID[capability]}, and {purpose}; "
        "use a driver that declares it",
        phase=Phase.CHECK,
    )


def simulated(driver: Driver, purpose: str) -> Simulated:
    """Return the driver as the simulated world that it is.

    Args:
        driver: Whose world.
        purpose: What it is needed for, as "a checkpoint is taken of it".

    Raises:
        UnsupportedError: It is none.
    """
    from robosandbox.protocols import Simulated

    require(driver, "truth", purpose)
    require(driver, "reset", purpose)
    if not isinstance(driver, Simulated):
        raise TypeError(f"{type(driver).__name__} declares truth and reset and is not Simulated; see check_driver")
    return driver


def come_to_rest(driver: Driver, seconds: float = 0.5) -> None:
    """Hold the arm and let time pass until it is still, `seconds` at most."""
    driver.stop()
    for _ in range(round(seconds / driver.control_timestep)):
        if float(np.abs(driver.state().qd).max()) < _STILL_SPEED:
            return
        driver.wait(driver.control_timestep)


def load_driver(
    name: str, scene: Scene, options: Mapping[str, Any] | None = None, *, supplied: Mapping[str, Any] | None = None
) -> Driver:
    """Return an installed driver, connected to a robot that stands before a scene; see `driver_factory`.

    Raises:
        InputError: There is none of that name, it takes no such option, a value is of another type, or it cannot be opened.
    """
    return driver_factory(name, options)(scene, **(supplied or {}))


def driver_factory(name: str, options: Mapping[str, Any] | None = None) -> Callable[..., Driver]:
    """Return what opens an installed driver, its options checked and given.

    Args:
        name: As registered under `robosandbox.drivers`, often with options behind it: "hardware:latency=0.02,seed=3". The
            annotations of the registered factory say of which type they are.
        options: More of its keyword arguments; None counts as not given.

    Returns:
        A function of the scene, and of keywords that the caller supplies to those drivers that have a parameter of that
        name (`SUPPLIED`) and keeps from the others.

    Raises:
        InputError: There is none of that name, it takes no such option, or a value is of another type.
    """
    name, said = split_name(name)
    factory = load_plugin("drivers", name)
    given = {**_typed(factory, name, said), **(options or {})}
    flags = {
        key: f"driver {name}:{key}" for key in (*said, *signature(factory).parameters) if key not in (options or {})
    }
    bound = bind_plugin("drivers", name, positional=1, options=given, supplied=SUPPLIED, flags=flags)
    takes = signature(factory).parameters

    def connect(scene: Scene, **supplied: Any) -> Driver:
        driver: Driver = bound(scene, **{key: value for key, value in supplied.items() if key in takes})
        return driver

    return connect


def fitted(name: str, scene: Scene) -> Scene:
    """Return the scene as a driver stands before it: with the driver's own robot, where it brings one.

    What plans, sees and lays out reads the robot from the scene. The factory of a driver that has one robot only has a function
    `fit(scene)`, which puts that robot in, or refuses a scene that names another.

    Args:
        name: As `driver_factory` takes it.
        scene: As a task has it.

    Raises:
        InputError: The scene names another robot, or there is no such driver.
    """
    fit: Callable[[Scene], Scene] | None = getattr(load_plugin("drivers", split_name(name)[0]), "fit", None)
    return scene if fit is None else fit(scene)


def split_name(text: str) -> tuple[str, dict[str, str]]:
    """Return the name and the options of "NAME" or "NAME:key=value,key=value".

    Raises:
        InputError: What is behind the name is no such list.
    """
    name, colon, rest = text.partition(":")
    options: dict[str, str] = {}
    for item in rest.split(",") if colon else ():
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals or not key or key in options:
            raise InputError(
                f"--driver {name}: {item[:60]!r} is no option; write key=value, each once, as in hardware:latency=0.02,seed=3"
            )
        options[key.replace("-", "_")] = value
    return name, options


def _typed(factory: Callable[..., Any], name: str, said: Mapping[str, str]) -> dict[str, Any]:
    """Return options as the factory's annotations have them; what it does not take stays text."""
    from pydantic import PydanticUserError, TypeAdapter, ValidationError

    parameters = signature(factory, eval_str=True).parameters if said else {}
    found: dict[str, Any] = {}
    for key, text in said.items():
        try:
            found[key] = TypeAdapter(parameters[key].annotation).validate_python(text) if key in parameters else text
        except ValidationError as error:
            problem = error.errors()[0]["msg"]
            raise InputError(f"--driver {name}:{key}={text[:60]}: {problem[0].lower()}{problem[1:]}") from None
        except PydanticUserError:
            raise InputError(f"--driver {name}:{key}: cannot be said in a word; give it in Python") from None
    return found
