"""Opening of installed drivers: their names, options and robots."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import signature
from typing import TYPE_CHECKING, Any

from robosandbox.driver.safe import SafeDriver, made_safe
from robosandbox.errors import InputError
from robosandbox.plugins import bind_plugin, load_plugin

if TYPE_CHECKING:
    from robosandbox.driver.protocols import Driver
    from robosandbox.types import Scene

# Parameters that a driver's factory may have and no person gives: (height, width) of pictures in pixels; the objects of which
# the truth is to tell how hard they were pressed; what is called while it loads, and raises to end that; where the arm is to
# begin, shape (n,).
SUPPLIED = ("render_size", "felt", "wait_hook", "start_q")


def load_driver(
    name: str, scene: Scene, options: Mapping[str, Any] | None = None, *, supplied: Mapping[str, Any] | None = None
) -> SafeDriver:
    """Return an installed driver behind its robot's limits, connected to a robot that stands before a scene; see `driver_factory`.

    Raises:
        InputError: There is none of that name, it takes no such option, a value is of another type, or it cannot be opened.
    """
    return driver_factory(name, options)(scene, **(supplied or {}))


def driver_factory(name: str, options: Mapping[str, Any] | None = None) -> Callable[..., SafeDriver]:
    """Return what opens an installed driver behind its robot's limits, its options checked and given.

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

    def connect(scene: Scene, **supplied: Any) -> SafeDriver:
        driver: Driver = bound(scene, **{key: value for key, value in supplied.items() if key in takes})
        try:
            return made_safe(driver)
        except BaseException:
            driver.close()
            raise

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
