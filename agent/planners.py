"""Planners by name, with the options that a person gave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from robosandbox.agent.protocols import Planner
from robosandbox.plugins import make_plugin
from robosandbox.world.operators import Operator


def make_planner(
    name: str,
    skills: Sequence[Operator],
    options: Mapping[str, Any] | None = None,
    *,
    dialogue: bool = False,
    moves: Sequence[Operator] = (),
) -> Planner:
    """Return an installed planner.

    Args:
        name: As registered under `robosandbox.planners`.
        skills: What it may call.
        options: Keyword arguments of its own, such as `model`; those that are None count as not given.
        dialogue: Let each prompt refer to the ones before it, with a planner that takes `dialogue`; others plan each
            prompt by itself.
        moves: What moves the hand by itself, for a planner that takes `moves`.

    Raises:
        InputError: There is no such planner, or it does not take such an option.
    """
    planner: Planner = make_plugin(
        "planners",
        Planner,
        name,
        skills,
        options=options,
        supplied={"dialogue": dialogue, "moves": moves},
        # Whoever opens the session makes a picture of a camera.
        flags={"picture": "camera"},
    )
    return planner
