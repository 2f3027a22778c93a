"""Scenes, skills and calls as lines to read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from robosandbox.types import DetectedObject, ObservedScene


def scene_table(scene: ObservedScene) -> str:
    """Return a line per object: id, colour, shape, size in millimetres, position in metres, and which one is held."""
    if not scene.objects:
        return "nothing is seen"
    rows = [("id", "colour", "shape", "size (mm)", "x (m)", "y (m)", "z (m)", "")]
    for item in scene.objects:
        x, y, z = (_metres(value) for value in item.pose.xyz)
        held = "held" if item.id in scene.in_hands else ""
        rows.append((item.id, item.colour, item.kind, item.shape.describe(item), x, y, z, held))
    return aligned(rows)


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Return rows with their columns under one another."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def signature(name: str, schema: Mapping[str, Any]) -> str:
    """Return a skill as one would call it; what may be left out is in brackets."""
    required = schema.get("required", ())
    arguments = (field if field in required else f"[{field}]" for field in schema.get("properties", {}))
    return f"{name}({', '.join(arguments)})"


def object_names(objects: Iterable[DetectedObject]) -> list[str]:
    """Return what one may call the objects: "red cube", and their ids."""
    items = list(objects)
    spoken = [f"{item.colour} {item.shape.noun(item.size)}" for item in items]
    return list(dict.fromkeys([*spoken, *(item.id for item in items)]))


def _metres(value: float) -> str:
    # Adding 0 takes the sign off a zero.
    return f"{round(value, 3) + 0.0:+.3f}"
