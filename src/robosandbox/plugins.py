"""Plug-ins by entry point group and name: planners, perceptions, grasp and motion planners, skills."""

from __future__ import annotations

import inspect
import logging
from collections.abc import Callable, Collection, Mapping
from functools import cache, partial
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from robosandbox.errors import InputError
from robosandbox.suggestions import did_you_mean

_log = logging.getLogger(__name__)
_LONGEST_CAUSE = 200  # Characters of somebody else's exception, so that a message stays a line.
_MOST_MISSING = 5  # Names of what a plugin lacks, for the same.


def plugins(group: str) -> tuple[EntryPoint, ...]:
    """Return what is registered under `robosandbox.<group>`, by name; of two of one name the first that was found."""
    found = {point.name: point for point in reversed(_all()) if point.group == f"robosandbox.{group}"}
    return tuple(found[name] for name in sorted(found))


def plugin_names(group: str) -> tuple[str, ...]:
    """Return the names registered under `robosandbox.<group>`, sorted."""
    return tuple(point.name for point in plugins(group))


def load_plugin(group: str, name: str) -> Any:
    """Return what is registered under `robosandbox.<group>` as `name`.

    Raises:
        InputError: Nothing is, or its package does not import.
    """
    check_plugin(group, name)
    point = _point(group, name)
    try:
        return _load(point)
    except _BrokenError as error:
        if isinstance(error.__cause__, InputError):
            # Its module says itself what it needs: a package, or an environment.
            raise error.__cause__ from None
        raise _unusable(group, point, error) from error.__cause__


def make_installed(group: str, part: type[Any]) -> dict[str, Any]:
    """Return what each factory registered under `robosandbox.<group>` makes, by name.

    What does not load, or lacks what the others have, is left out with a warning: nobody has asked for it.

    Args:
        group: One whose members are used without being named, such as `skills`.
        part: What each is: a protocol or a class.
    """
    made: dict[str, Any] = {}
    for point in plugins(group):
        try:
            made[point.name] = _make(point, _load(point), part)
        except _BrokenError as error:
            _left_out(point, error)
    return made


@cache
def import_installed(group: str) -> None:
    """Import all that is registered under `robosandbox.<group>`; what does not load is left out with a warning."""
    for point in plugins(group):
        try:
            _load(point)
        except _BrokenError as error:
            _left_out(point, error)


def check_plugin(group: str, name: str) -> None:
    """Find out whether there is something of this name under `robosandbox.<group>`, without importing it.

    Raises:
        InputError: There is nothing.
    """
    names = plugin_names(group)
    if name in names:
        return
    noun = _noun(group)
    raise InputError(
        f"--{noun.split()[0]}: no {noun} {name[:60]!r}; there is {', '.join(names)}{did_you_mean(name, names)}"
    )


def make_plugin(
    group: str,
    part: type[Any],
    name: str,
    *arguments: Any,
    options: Mapping[str, Any] | None = None,
    supplied: Mapping[str, Any] | None = None,
    flags: Mapping[str, str] | None = None,
) -> Any:
    """Return what the factory registered under `robosandbox.<group>` as `name` makes.

    The factory's parameters that may be given by keyword, behind the positional ones, are its options.

    Args:
        group: Such as `grasp_planners`.
        part: The protocol of what is made.
        name: As registered there.
        arguments: What every factory of the group is called with.
        options: What a person gives; None counts as not given.
        supplied: What the caller gives to those factories that have a parameter of that name. No person gives it.
        flags: Command-line options whose name is not the parameter's, by parameter.

    Raises:
        InputError: There is no such plugin, it does not load or lacks a part of the protocol, it takes no such option, or it
            needs one that is missing.
    """
    supplied = supplied or {}
    bound = bind_plugin(group, name, positional=len(arguments), options=options, supplied=supplied, flags=flags)
    takes = _options_of(bound.func, len(arguments))
    made = bound(*arguments, **{key: value for key, value in supplied.items() if key in takes})
    point = _point(group, name)
    try:
        return _checked(point, made, part)
    except _BrokenError as error:
        raise _unusable(group, point, error) from None


def bind_plugin(
    group: str,
    name: str,
    *,
    positional: int,
    options: Mapping[str, Any] | None = None,
    supplied: Collection[str] = (),
    flags: Mapping[str, str] | None = None,
) -> partial[Any]:
    """Return the factory registered under `robosandbox.<group>` as `name` with its options given; see `make_plugin`.

    Args:
        group: Such as `drivers`.
        name: As registered there.
        positional: How many positional arguments every factory of the group is called with.
        options: What a person gives; None counts as not given.
        supplied: Names of what the caller will give, so that no person does.
        flags: Command-line options whose name is not the parameter's, by parameter.

    Raises:
        InputError: There is no such plugin, it does not load, it takes no such option, or it needs one that is missing.
    """
    factory = load_plugin(group, name)
    takes = _options_of(factory, positional)
    given = {key: value for key, value in (options or {}).items() if value is not None}
    noun = _noun(group)

    def flag(option: str) -> str:
        return f"--{(flags or {}).get(option, option.replace('_', '-'))}"

    valid = [option for option in takes if option not in supplied]
    for option in given:
        if option not in valid:
            offered = ", ".join(map(flag, valid))
            others = "" if option in supplied else _who_takes(group, option, positional)
            raise InputError(
                f"{flag(option)}: the {noun} {name!r} takes no such option; it takes {offered or 'none'}{others}"
            )
    for option, parameter in takes.items():
        if parameter.default is parameter.empty and option not in given and option not in supplied:
            raise InputError(f"{flag(option)}: is missing; the {noun} {name!r} needs it")
    return partial(factory, **given)


def _noun(group: str) -> str:
    """Return what people call one of a group; its first word is the command-line option that names one."""
    return group.removesuffix("s").replace("_", " ")


@cache
def _options_of(factory: Callable[..., Any], positional: int) -> Mapping[str, inspect.Parameter]:
    """Return the parameters of a factory that may be given by keyword, without the first `positional` ones.

    Looked up once: of a class without a constructor of its own Python makes a copy of `sys.modules` each time, in a cycle.
    """
    by_keyword = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    parameters = list(inspect.signature(factory).parameters.values())[positional:]
    return {item.name: item for item in parameters if item.kind in by_keyword}


def _who_takes(group: str, option: str, positional: int) -> str:
    """Return which plugins of a group take an option, to be put behind an error's message; often nothing."""
    names = []
    for point in plugins(group):
        try:
            factory = _load(point)
        except _BrokenError:
            # A plugin that does not load cannot be recommended.
            continue
        if option in _options_of(factory, positional):
            names.append(f"--{_noun(group).split()[0]} {point.name}")
    return f"; {' and '.join(names)} {'takes' if len(names) == 1 else 'take'} it" if names else ""


class _BrokenError(Exception):
    """A plugin cannot be used; the message names package and entry point."""


def _point(group: str, name: str) -> EntryPoint:
    return next(point for point in plugins(group) if point.name == name)


def _load(point: EntryPoint) -> Any:
    """Return what an entry point leads to; raises _BrokenError where its package does not import."""
    try:
        return point.load()
    except Exception as error:
        raise _broken(point, "does not import", error) from error


def _make(point: EntryPoint, factory: Callable[[], Any], part: type[Any]) -> Any:
    """Return what a factory without arguments makes; raises _BrokenError where it makes nothing, or something else."""
    try:
        return _checked(point, factory(), part)
    except _BrokenError:
        raise
    except Exception as error:
        raise _broken(point, "cannot be made", error) from error


def _checked(point: EntryPoint, made: Any, part: type[Any]) -> Any:
    """Return what a factory made; raises _BrokenError where it lacks what the part has."""
    has = {name for cls in part.__mro__ for name in (*vars(cls), *inspect.get_annotations(cls)) if name[0] != "_"}
    # What a property of our own gives is known to be there, and may take its time.
    ours = type(made) if type(made).__module__.startswith(f"{__name__.partition('.')[0]}.") else None
    missing = sorted(name for name in has if not hasattr(ours, name) and not hasattr(made, name))
    if missing:
        more = f" and {len(missing) - _MOST_MISSING} more" if len(missing) > _MOST_MISSING else ""
        lacks = f"{', '.join(missing[:_MOST_MISSING])}{more}"
        raise _broken(point, f"makes no {part.__name__}: {type(made).__name__} lacks {lacks}")
    return made


def _broken(point: EntryPoint, how: str, cause: Exception | None = None) -> _BrokenError:
    package = f"the package {point.dist.name} {point.dist.version}" if point.dist else "a package"
    why = f" ({type(cause).__name__}: {' '.join(str(cause).split())[:_LONGEST_CAUSE]})" if cause else ""
    return _BrokenError(f"{package} has the entry point {point.group}: {point.name} = {point.value}, which {how}{why}")


def _left_out(point: EntryPoint, error: _BrokenError) -> None:
    noun = _noun(point.group.removeprefix("robosandbox."))
    _warn_once(f"the {noun} {point.name!r} is left out: {error}; mend or uninstall that package")


def _unusable(group: str, point: EntryPoint, error: _BrokenError) -> InputError:
    """Return what to tell a person who named a plugin that cannot be used."""
    noun = _noun(group)
    others = ", ".join(name for name in plugin_names(group) if name != point.name)
    return InputError(
        f"--{noun.split()[0]} {point.name}: {error}; mend it, or take another {noun}: {others or 'there is none'}"
    )


@cache
def _warn_once(text: str) -> None:
    # Loads for ten milliseconds, for a warning alone.
    from multiprocessing import parent_process

    # Whoever started a worker process has said it.
    if parent_process() is None:
        _log.warning(text)


@cache
def _all() -> tuple[EntryPoint, ...]:
    """Return the entry points of everything that is installed; reading them takes as long as a plan."""
    groups = entry_points()
    return tuple(
        point for group in groups.groups if group.startswith("robosandbox.") for point in groups.select(group=group)
    )
