"""Rooms of the package, lowest first, and the arrows between them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from house_sources import Source

# A room imports from those before it and from no other.
ROOMS = {
    "core": "values, errors, shapes, driver contract, plug-ins",
    "world": "relations, contracts, verifier, search",
    "robots": "model and sidecar → robot",
    "sim": "the MuJoCo driver",
    "grasp": "grasp candidates from surfaces",
    "motion": "kinematics, collision, timing, twin",
    "perception": "what is where",
    "skills": "one verb a file",
    "tasks": "task files, layouts, judge",
    "agent": "prompt → plan → result",
    "workcell": "the running cell, recording, Zenoh",
    "drivers": "drivers beside the simulation",
    "apps": "commands, viewer, MCP, envs, bench",
}
RANK = {room: rank for rank, room in enumerate(ROOMS)}
# `python -c "import robosandbox"` hands out names of every room on first use.
FRONT = "robosandbox"


@dataclass(frozen=True)
class Arrow:
    """An import of one room by a file of another.

    Attributes:
        at: The importing file's room.
        to: The imported room.
        where: File and line.
        when: At the file's loading, in a function, or for type checkers alone.
    """

    at: str
    to: str
    where: str
    when: Literal["loading", "in a function", "for types"]

    @property
    def upwards(self) -> bool:
        """True where it points at a room above."""
        return RANK[self.to] > RANK[self.at]


def room_of(module: str) -> str:
    """Return the room of a module by its full name; what is in no other room's folder is core."""
    name = module.split(".")[1] if "." in module else ""
    return name if name in ROOMS else "core"


def arrows(files: list[Source]) -> list[Arrow]:
    """Return every import that crosses from one room into another."""
    return [
        Arrow(room_of(source.module), room_of(module), f"{source.name}:{line}", when)
        for source in files
        if source.module != FRONT
        for line, module, when in _imported(source.tree, "loading")
        if room_of(source.module) != room_of(module)
    ]


def floors(found: list[Arrow]) -> dict[str, int]:
    """Return each room's floor: 0 imports no other room, else one above the highest that it imports."""
    below = {room: {arrow.to for arrow in found if arrow.at == room and not arrow.upwards} for room in ROOMS}
    level: dict[str, int] = {}
    for room in ROOMS:
        level[room] = max((level[other] + 1 for other in below[room]), default=0)
    return level


def _imported(
    node: ast.AST, when: Literal["loading", "in a function", "for types"]
) -> Iterator[tuple[int, str, Literal["loading", "in a function", "for types"]]]:
    for child in ast.iter_child_nodes(node):
        inside = when
        match child:
            case ast.If(test=ast.Name(id="TYPE_CHECKING")):
                inside = "for types"
            case ast.FunctionDef() | ast.AsyncFunctionDef() if when == "loading":
                inside = "in a function"
            case ast.Import(names=names):
                yield from ((child.lineno, item.name, when) for item in names if item.name.startswith("robosandbox."))
            case ast.ImportFrom(module="robosandbox", level=0, names=names):
                # The version is in __init__.py, below every room.
                yield from (
                    (child.lineno, f"robosandbox.{item.name}", when) for item in names if item.name != "__version__"
                )
            case ast.ImportFrom(module=str(module), level=0) if module.startswith("robosandbox."):
                yield child.lineno, module, when
            case _:
                pass
        yield from _imported(child, inside)
