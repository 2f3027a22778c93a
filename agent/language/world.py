"""The world on paper: what is where, on what, in what, as a plan would leave it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robosandbox.shapes import CONTAINER_WALL
from robosandbox.shapes.hull import BoxHull
from robosandbox.types import (
    Array,
    DetectedObject,
    ObservedScene,
    Pose,
)
from robosandbox.types.objects import TABLE_AREA, Area
from robosandbox.world.achievers import subject_of
from robosandbox.world.contracts import find
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.locations import location_of
from robosandbox.world.predicate import View
from robosandbox.world.relations import bottom, bounds

MARGIN = 0.02  # Metres between things that are put down. Chosen: a finger.
LIFTED = 0.08  # Metres over the table from which a held thing is carried. Chosen.
Parent = tuple[str, str]
# How the grammar calls what relations say of where a thing is.
_PLACES = {"on": "on", "inside": "in"}
# Where a grid of places begins on the table in the seeds, and how far from its edge on others, metres.
_SEEDS_GRID = ((-0.08, 0.36), (-0.38, 0.38))
_FROM_EDGE = 0.12


@lru_cache(maxsize=512)
def half_extents(item: DetectedObject) -> tuple[float, float, float]:
    """Return the half-extents of the object along the world's axes, as it lies or stands; metres."""
    low, high = bounds(item)
    x, y, z = ((high - low) / 2.0).tolist()
    return x, y, z


@lru_cache(maxsize=512)
def volume(item: DetectedObject) -> float:
    """Return the volume of the box around the object's hull in its own frame, cubic metres: the same however it lies."""
    x, y, z = half_extents(replace(item, pose=Pose(xyz=item.pose.xyz)))
    return 8 * x * y * z


@lru_cache(maxsize=8)
def _grid(area: Area) -> Array:
    """Return the places of a table, shape (n, 2), metres."""
    inner = _SEEDS_GRID if area == TABLE_AREA else [(low + _FROM_EDGE, high - _FROM_EDGE) for low, high in area]
    (i0, i1), (j0, j1) = (tuple(round(end / 0.02) for end in span) for span in inner)
    return np.array(
        [(round(0.02 * i, 3), round(0.02 * j, 3)) for i in range(i0, i1 + 1) for j in range(j0, j1 + 1)]
    ).reshape(-1, 2)


@lru_cache(maxsize=8)
def _in_reach(area: Area, base_xy: tuple[float, float], near: float, far: float) -> NDArray[np.bool_]:
    """Say of the points of the grid which an arm there reaches easily."""
    reach = np.hypot(*(_grid(area) - base_xy).T)
    return np.asarray((near <= reach) & (reach <= far))


@lru_cache(maxsize=8)
def _seen(scene: ObservedScene) -> tuple[dict[str, tuple[float, float, float]], dict[str, Parent]]:
    """Return the half-extents of all that is seen and what each is on or in: the same for every reading of a sentence."""
    extents = {item.id: half_extents(item) for item in scene.objects}
    return extents, dict(_parents(scene))


def _parents(scene: ObservedScene) -> Iterator[tuple[str, Parent]]:
    for item in scene.objects:
        place = location_of(scene, item)
        if place is not None and place.relation in _PLACES and place.arguments[1] != TABLE:
            yield item.id, (_PLACES[place.relation], str(place.arguments[1]))


class World:
    """The scene, changed step by step by the plan in the making.

    Attributes:
        objects: By id, as perceived.
        at: Where each is now, xy.
        parent: What each is on or in: ("on" | "in", id); absent for the table.
        held: What the gripper holds.
        opened: The drawers that are open.
        base_xy: Where the robot stands.
    """

    def __init__(self, scene: ObservedScene) -> None:
        self._scene = scene
        self.base_xy: tuple[float, float] = scene.base_xy
        self._near, self._far = scene.reach
        self.area: Area = scene.table_area
        self._grid = _grid(self.area)
        self.poses = scene.poses
        self.objects: dict[str, DetectedObject] = {item.id: item for item in scene.objects}
        self.at: dict[str, tuple[float, float]] = {
            item.id: (item.pose.xyz[0], item.pose.xyz[1]) for item in scene.objects
        }
        self.is_turned = scene.is_turned
        self.start_at: dict[str, tuple[float, float]] = dict(self.at)
        self.held = scene.held
        self.table_height = scene.table_height
        self._extents, parents = _seen(scene)
        self.put_in: set[str] = set()
        self.parent: dict[str, Parent] = dict(parents)
        self.opened: set[str] = {
            item.id for item in scene.objects if item.shape.opens and find(fact("open", item.id), View.of(scene)).holds
        }

    def doors_before(self, name: str, cupboard: str) -> list[str]:
        """Return the doors that are to be opened for an object to come into a cupboard."""
        found = find(fact("lets_in", name, cupboard), View.of(self._scene))
        return [door for door in map(subject_of, found.remedies) if door not in self.opened]

    def extents(self, name: str) -> tuple[float, float, float]:
        """Return an object's half-extents along the world's axes."""
        return self._extents[name]

    def fits_in(self, name: str, target: str) -> bool:
        """Say whether an object, as it stands, is smaller than the opening of a container, and no taller than a drawer."""
        (x, y, z), (tx, ty, tz) = self._extents[name], self._extents[target]
        vessel = self.objects[target]
        room = vessel.shape.room(vessel.size)
        if vessel.shape.opens and (z > tz - CONTAINER_WALL or 2 * min(x, y) > vessel.shape.max_open(vessel.size)):
            # Too tall to close, or wider than it opens.
            return False
        if room is not None and room.is_round:
            return self.radius(name) < float(room.half[0])
        return max(x, y) < max(tx, ty) - CONTAINER_WALL and min(x, y) < min(tx, ty) - CONTAINER_WALL

    def radius(self, name: str) -> float:
        """Return the radius of the circle around an object seen from above."""
        x, y, _ = self._extents[name]
        return (
            math.hypot(x, y)
            if isinstance(self.objects[name].shape.hull(self.objects[name].size), BoxHull)
            else max(x, y)
        )

    def on_top_of(self, name: str) -> list[str]:
        """Return what rests on an object."""
        return [child for child, parent in self.parent.items() if parent == ("on", name)]

    def inside(self, name: str) -> list[str]:
        """Return what lies in a container, however deep."""
        found = [child for child, parent in self.parent.items() if parent == ("in", name)]
        return found + [above for child in found for above in self.on_top_of(child)]

    def beads_in(self, name: str) -> list[str]:
        """Return the beads that a container holds."""
        return [item for item in self.inside(name) if self.objects[item].shape.is_granular]

    def level(self, name: str) -> int:
        """Return how many objects lie below one."""
        return len(self.column(name)) - 1

    def column(self, name: str) -> list[str]:
        """Return an object and what lies below it, downwards."""
        found = [name]
        while name in self.parent and self.parent[name][0] == "on" and len(found) <= 20:
            name = self.parent[name][1]
            found.append(name)
        return found

    def is_carried(self, name: str) -> bool:
        """Say whether a held object has been lifted; one that is merely gripped may still be picked up."""
        return bottom(self.objects[name]) - self.table_height > LIFTED

    def movable(self, name: str) -> bool:
        """Say whether an object is one of those that get carried about."""
        return not self.objects[name].shape.stays_put

    # What steps change.

    def take(self, name: str) -> None:
        """Take an object into the gripper."""
        self.parent.pop(name, None)
        self.held = name

    def put(self, name: str, xy: tuple[float, float], parent: Parent | None = None) -> None:
        """Leave the held object somewhere."""
        self.at[name] = xy
        self.parent.pop(name, None)
        if parent:
            self.parent[name] = parent
        if parent and parent[0] == "in":
            self.put_in.add(name)
        if self.held == name:
            self.held = None

    def shift(self, name: str, dx: float, dy: float) -> None:
        """Move an object along the table."""
        x, y = self.at[name]
        self.at[name] = (x + dx, y + dy)
        self.parent.pop(name, None)

    # Space on the table.

    def is_free(self, xy: tuple[float, float], radius: float, ignore: Iterable[str] = ()) -> bool:
        """Say whether a circle on the table is clear of every object but `ignore`."""
        skipped = {*ignore, self.held}
        for name, (x, y) in self.at.items():
            if name not in skipped and name not in self.parent:
                ex, ey, _ = self._extents[name]
                gap = math.hypot(max(abs(xy[0] - x) - ex, 0.0), max(abs(xy[1] - y) - ey, 0.0))
                if gap < radius + MARGIN:
                    return False
        return True

    def _free(self, radius: float, ignore: Iterable[str] = ()) -> NDArray[np.bool_]:
        """Say of the points of the grid which are clear of every object but `ignore`, and of where drawers open."""
        skipped = {*ignore, self.held}
        free = np.ones(len(self._grid), dtype=np.bool_)
        for name, (x, y) in self.at.items():
            if name in skipped or name in self.parent:
                continue
            ex, ey, _ = self._extents[name]
            # A drawer opens towards the robot: what stands there would be in its way.
            opens = self.objects[name].shape.max_open(self.objects[name].size) / 2
            x, ex = x - opens, ex + opens
            gap = np.maximum(np.abs(self._grid - (x, y)) - (ex, ey), 0.0)
            free &= np.hypot(gap[:, 0], gap[:, 1]) >= radius + MARGIN
        return free

    def in_reach(self, xy: tuple[float, float]) -> bool:
        """Say whether a point lies on the table and about where an arm reaches."""
        distance = math.dist(xy, self.base_xy)
        return self.on_table(xy) and self._near <= distance <= self._far

    def on_table(self, xy: tuple[float, float], margin: float = 0.0) -> bool:
        """Say whether a point is on the table, so far from its edge, metres."""
        return all(low + margin <= value <= high - margin for value, (low, high) in zip(xy, self.area, strict=True))

    def placed(self, xy: tuple[float, float]) -> tuple[float, float]:
        """Return where a place of the seeds' table is on this one."""
        if self.area == TABLE_AREA:
            return xy
        (x0, x1), (y0, y1) = self.area
        return x0 + (xy[0] + 0.5) * (x1 - x0), y0 + (xy[1] + 0.5) * (y1 - y0)

    def on_seeds_table(self, xy: tuple[float, float]) -> tuple[float, float]:
        """Return where a place of this table is on the seeds' one."""
        if self.area == TABLE_AREA:
            return xy
        (x0, x1), (y0, y1) = self.area
        return (xy[0] - x0) / (x1 - x0) - 0.5, (xy[1] - y0) / (y1 - y0) - 0.5

    @property
    def table_ends(self) -> str:
        """Where the table ends, in words."""
        (x0, x1), (y0, y1) = self.area
        if self.area == TABLE_AREA:
            return f"which ends at ±{x1:g} m"
        return f"which is from ({x0:.2f}, {y0:.2f}) to ({x1:.2f}, {y1:.2f}) m"

    def free_spots(
        self,
        near: tuple[float, float],
        radius: float,
        ignore: Iterable[str] = (),
        *,
        low: tuple[float, float] = (-math.inf, -math.inf),
        high: tuple[float, float] = (math.inf, math.inf),
    ) -> list[tuple[float, float]]:
        """Return free places on the table in easy reach, from `low` to `high`, the nearest to `near` first."""
        grid = self._grid
        part = ((np.array(low) <= grid) & (np.array(high) >= grid)).all(axis=1)
        spots = grid[_in_reach(self.area, self.base_xy, self._near, self._far) & self._free(radius, ignore) & part]
        distance = np.round(np.hypot(*(spots - near).T), 6)
        order = np.lexsort((spots[:, 1], spots[:, 0], distance))
        return [(float(x), float(y)) for x, y in spots[order[:4]]]
