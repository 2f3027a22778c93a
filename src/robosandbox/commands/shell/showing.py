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
        held = "held" if item.id == scene.held else ""
        rows.append((item.id, item.colour, item.kind, _size(item), x, y, z, held))
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
    spoken = [f"{item.colour} {_noun(item)}" for item in items]
    return list(dict.fromkeys([*spoken, *(item.id for item in items)]))


def _metres(value: float) -> str:
    # Adding 0 takes the sign off a zero.
    return f"{round(value, 3) + 0.0:+.3f}"


def _noun(item: DetectedObject) -> str:
    match item.kind:
        case "box":
            return "cube" if max(item.size) <= 1.15 * min(item.size) else "block"
        case "sphere":
            return "ball"
        case "mesh":
            return "object"
        case _:
            return item.kind


def _size(item: DetectedObject) -> str:
    """Return full extents, outer or inner as `OBJECT_SIZES` has them."""
    size = [1000.0 * value for value in item.size]
    match item.kind:
        case "box" | "mesh":
            extents = [2.0 * value for value in size]
        case "sphere":
            return f"diameter {2.0 * size[0]:.0f}"
        case "cylinder":
            return f"diameter {2.0 * size[0]:.0f}, height {2.0 * size[1]:.0f}"
        case "capsule":
            return f"diameter {2.0 * size[0]:.0f}, length {2.0 * (size[0] + size[1]):.0f}"
        case "bin":
            extents = [2.0 * size[0], 2.0 * size[1], size[2]]
        case "bowl" | "cup":
            return f"diameter {2.0 * size[0]:.0f}, height {size[1]:.0f}"
        case "drawer":
            extents = [size[1], size[0], size[2]]
            opened = "" if item.opening is None else f", open {1000.0 * item.opening:.0f}"
            return " x ".join(f"{value:.0f}" for value in extents) + opened
        case "beads":
            return f"{len(item.grains)} of diameter {2.0 * size[0]:.0f}"
    return " x ".join(f"{value:.0f}" for value in extents)
