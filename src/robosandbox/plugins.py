"""What is installed under an entry point group: planners, perceptions, skills."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from functools import partial
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from robosandbox.errors import InputError
from robosandbox.validation import did_you_mean

if TYPE_CHECKING:
    from robosandbox.protocols import Planner

PlannerMaker = Callable[[Sequence[Any]], "Planner"]


def plugin_names(group: str) -> tuple[str, ...]:
    """Return the names registered under `robosandbox.<group>`, sorted."""
    return tuple(sorted({point.name for point in entry_points(group=f"robosandbox.{group}")}))


def load_planner(name: str, *, dialogue: bool = False) -> PlannerMaker:
    """Return what makes a planner from skills.

    Args:
        name: Of an installed planner.
        dialogue: Let each prompt refer to the ones before it, with a planner that takes `dialogue`; others plan each
            prompt by itself.

    Raises:
        InputError: There is none of that name.
    """
    make = load_plugin("planners", name)
    return partial(make, dialogue=True) if dialogue and "dialogue" in inspect.signature(make).parameters else make


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
