"""Planners by name, with the options that a person gave."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

from robosandbox.errors import InputError
from robosandbox.plugins import load_plugin
from robosandbox.protocols import Planner, Skill


def make_planner(
    name: str, skills: Sequence[Skill[Any]], options: Mapping[str, Any] | None = None, *, dialogue: bool = False
) -> Planner:
    """Return an installed planner.

    Args:
        name: As registered under `robosandbox.planners`.
        skills: What it may call.
        options: Keyword arguments of its own, such as `model`; those that are None count as not given.
        dialogue: Let each prompt refer to the ones before it, with a planner that takes `dialogue`; others plan each
            prompt by itself.

    Raises:
        InputError: There is no such planner, or it does not take such an option.
    """
    factory = load_plugin("planners", name)
    given = {key: value for key, value in (options or {}).items() if value is not None}
    parameters = inspect.signature(factory).parameters.values()
    takes = [item.name for item in parameters if item.kind is inspect.Parameter.KEYWORD_ONLY]
    spelt = [f"--{_spelt(item)}" for item in takes if item != "dialogue"]
    for key in given:
        if key not in takes:
            raise InputError(
                f"--{_spelt(key)}: the planner {name!r} takes no such option; "
                f"{'it takes ' + ', '.join(spelt) if spelt else 'it takes none'}; "
                "--planner openai takes a model"
            )
    if dialogue and "dialogue" in takes:
        given["dialogue"] = True
    planner: Planner = factory(skills, **given)
    return planner


def _spelt(option: str) -> str:
    # Whoever opens the session makes a picture of a camera.
    return "camera" if option == "picture" else option.replace("_", "-")
