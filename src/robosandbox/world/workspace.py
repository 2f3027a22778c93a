"""Calls that lead out of the workspace: refused before anything moves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robosandbox.driver.workspace import AXES, violation
from robosandbox.errors import Phase
from robosandbox.types import DIRECTION_AXES, ObservedScene, SkillCall, Workspace
from robosandbox.world.relations import centre


def check_call(call: SkillCall, scene: ObservedScene, workspace: Workspace) -> None:
    """Refuse a call whose place or object is outside before anything moves.

    Raises:
        LimitError: It is.
    """
    for what, point in _places(call.arguments, scene):
        for axis, value in zip(AXES, point, strict=False):
            error = violation(what, axis, value, workspace, 0.0, Phase.CHECK)
            if error is not None:
                raise error


def _places(arguments: Mapping[str, Any], scene: ObservedScene) -> list[tuple[str, tuple[float, ...]]]:
    """Return the points that a call is about: coordinates, objects, and where a push ends."""
    places: list[tuple[str, tuple[float, ...]]] = []
    if "x" in arguments and "y" in arguments:
        places.append(("the place", (float(arguments["x"]), float(arguments["y"]))))
    for key in ("object", "target", "container", "drawer"):
        thing = scene.find(str(arguments.get(key)))
        if thing is not None:
            places.append((thing.id, tuple(float(c) for c in centre(thing)[:2])))
    pushed = scene.find(str(arguments.get("object")))
    axis = DIRECTION_AXES.get(str(arguments.get("direction")))
    if pushed is not None and axis is not None:
        distance = float(arguments.get("distance", 0.1))
        at = centre(pushed)
        end = (float(at[0]) + axis[0] * distance, float(at[1]) + axis[1] * distance)
        places.append((f"where {pushed.id} would be pushed", end))
    return places
