"""What is installed under an entry point group: planners, perceptions, skills."""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from robosandbox.errors import InputError
from robosandbox.suggestions import did_you_mean


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
        InputError: Nothing is.
    """
    check_plugin(group, name)
    return next(point for point in plugins(group) if point.name == name).load()


def check_plugin(group: str, name: str) -> None:
    """Find out whether there is something of this name under `robosandbox.<group>`, without importing it.

    Raises:
        InputError: There is nothing.
    """
    names = plugin_names(group)
    if name in names:
        return
    singular = group.removesuffix("s")
    raise InputError(
        f"--{singular}: no {singular} {name[:60]!r}; there is {', '.join(names)}{did_you_mean(name, names)}"
    )


@cache
def _all() -> tuple[EntryPoint, ...]:
    """Return the entry points of everything that is installed; reading them takes as long as a plan."""
    groups = entry_points()
    return tuple(
        point for group in groups.groups if group.startswith("robosandbox.") for point in groups.select(group=group)
    )
