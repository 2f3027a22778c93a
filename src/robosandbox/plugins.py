"""What is installed under an entry point group: planners, perceptions, skills."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any

from robosandbox.errors import InputError
from robosandbox.validation import did_you_mean


def plugin_names(group: str) -> tuple[str, ...]:
    """Return the names registered under `robosandbox.<group>`, sorted."""
    return tuple(sorted({point.name for point in entry_points(group=f"robosandbox.{group}")}))


def load_plugin(group: str, name: str) -> Any:
    """Return what is registered under `robosandbox.<group>` as `name`.

    Raises:
        InputError: Nothing is.
    """
    for point in entry_points(group=f"robosandbox.{group}"):
        if point.name == name:
            return point.load()
    names = plugin_names(group)
    singular = group.removesuffix("s")
    raise InputError(
        f"--{singular}: no {singular} {name[:60]!r}; there is {', '.join(names)}{did_you_mean(name, names)}"
    )
