"""Positions among things: on, in, left of, beside, between, as they lie in the world."""

from __future__ import annotations

import math
from abc import ABC

from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.orders import Orders
from robosandbox.types import RefusalCode


class Vicinity(Orders, ABC):
    """Tells which of some things stand in a relation to another."""

    def _touches(self, kind: str, name: str, anchor: str) -> bool:
        parent = self.world.parent.get(name)
        if kind == "on":
            return parent == ("on", anchor) or (parent == ("in", anchor))
        if kind == "under":
            return self.world.parent.get(anchor) == ("on", name)
        return name in self.world.inside(anchor) or (kind == "from" and parent == ("on", anchor))

    def _is_straight(self, side: str, name: str, anchor: str) -> bool:
        """Say whether one thing is at most as far across a side of another as along it."""
        dx, dy = (a - b for a, b in zip(self.world.at[name], self.world.at[anchor], strict=True))
        along, across = (abs(dy), abs(dx)) if side in ("left", "right") else (abs(dx), abs(dy))
        return across <= along

    def _around(self, kind: str, names: list[str], anchor: str, *, narrow: bool = False) -> list[str]:
        kind = "back" if kind == "opposite" else kind
        ax, ay = self.world.at[anchor]
        offsets = {name: (self.world.at[name][0] - ax, self.world.at[name][1] - ay) for name in names}
        axes = {"left": (0.0, 1.0), "right": (0.0, -1.0), "front": (-1.0, 0.0), "back": (1.0, 0.0)}
        if kind in axes:
            ex, ey = axes[kind]
            along = {name: dx * ex + dy * ey for name, (dx, dy) in offsets.items()}
            across = {name: abs(dx * ey - dy * ex) for name, (dx, dy) in offsets.items()}
            found = [name for name in names if along[name] > 0.015]
            cone = [name for name in found if along[name] >= (3.0 if narrow else 1.0) * across[name]]
            return cone if narrow else cone or found
        if narrow:
            return []
        gaps = {name: self._gap(name, anchor) for name in names}
        near = sorted((name for name in names if gaps[name] < 0.15), key=lambda name: gaps[name])
        if not near and names:
            near = sorted(names, key=lambda name: gaps[name])
            near = near if gaps[near[0]] < 0.25 else []
        if len(near) > 1 and gaps[near[0]] < 0.6 * gaps[near[1]] - 0.01:
            near = near[:1]
        return near

    def _gap(self, name: str, anchor: str) -> float:
        ex, ey, _ = self.world.extents(anchor)
        fx, fy, _ = self.world.extents(name)
        (x, y), (ax, ay) = self.world.at[name], self.world.at[anchor]
        return math.hypot(max(abs(x - ax) - ex - fx, 0.0), max(abs(y - ay) - ey - fy, 0.0))

    def _between(self, names: list[str], ends: list[str]) -> list[str]:
        if len(ends) != 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"“Between” needs two things; {listed(ends)} fit.", ends)
        (ax, ay), (bx, by) = self.world.at[ends[0]], self.world.at[ends[1]]
        length = math.dist((ax, ay), (bx, by)) or 1e-9
        found = []
        for name in names:
            x, y = self.world.at[name]
            along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length**2
            across = abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length
            if name not in ends and 0.1 < along < 0.9 and across < max(0.06, 0.35 * length):
                found.append(name)
        return found
