"""Random problems of blocks, bins, drawers and swaps for `achieve.py`, said in symbols and as scenes."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from robosandbox.types import DetectedObject, ObservedScene, Pose, SkillCall
from robosandbox.world.facts import TABLE, Fact, fact

FAMILIES = ("blocks", "bins", "drawers", "swaps")
TABLE_HEIGHT = 0.04
BASE_XY = (-0.3, 0.0)
# Edges of things are twice these, metres: what stands in towers and trays, and what goes into bins and drawers.
BLOCK, SMALL = 0.02, 0.015
# Inner half-extents and height, metres: four small things fit into a bin side by side, one block into a tray.
BIN, TRAY = (0.09, 0.09, 0.06), (0.03, 0.03, 0.012)
# Width, depth, height and how far it opens, metres: so shallow that a Panda's hand, wider than it, gets things out again.
DRAWER = (0.26, 0.18, 0.06, 0.14)
# Share of its way by which an open drawer is open.
PULLED = 0.9
# Things that fit into each at most.
CAPACITY = {"bin": 4, "tray": 1, "drawer": 3}
# Blocks in a tower at most: higher ones are out of the arm's easy reach.
HIGHEST = 5
# Where things may stand, metres: 10 cm apart, in easy reach, and where no drawer opens.
SPOTS = tuple((round(0.02 + 0.1 * i, 3), round(-0.15 + 0.1 * j, 3)) for i in range(4) for j in range(4))
BESIDES = {"bin": ((0.05, 0.32), (0.05, -0.32)), "drawer": ((0.28, 0.34), (0.28, -0.34))}
# A spot counts as taken within this distance, metres: as `at` does.
AT = 0.015


@dataclass(frozen=True, slots=True)
class Place:
    """Where a thing is: "on" another, "in" a container, "at" a spot, or somewhere on the "table".

    Attributes:
        kind: Which of these.
        name: Of the other thing or the container.
        spot: Number of the spot.
    """

    kind: str
    name: str = ""
    spot: int = -1


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem.

    Attributes:
        family: What it is of.
        things: Half an edge of each thing that can be moved, metres, by name.
        holders: Kind of each container, by name.
        start: Where each thing is.
        goals: What is to hold.
        spots_of: Where each tray stands.
    """

    family: str
    things: Mapping[str, float]
    holders: Mapping[str, str]
    start: Mapping[str, Place]
    goals: tuple[Fact, ...]
    spots_of: Mapping[str, int] = field(default_factory=dict)


def drawn(family: str, count: int, draw: random.Random) -> Problem:
    """Return a random problem of a family with so many things."""
    half = SMALL if family in ("bins", "drawers") else BLOCK
    things = {f"{'abcdefghijkl'[k]}_block": half for k in range(count)}
    if family == "swaps":
        return _swaps(things, draw)
    kind = {"blocks": "", "bins": "bin", "drawers": "drawer"}[family]
    holders = {f"{kind}_{k}": kind for k in range(draw.randint(1, 2))} if kind else {}
    start, end = (_arranged(things, holders, draw) for _ in range(2))
    spots = iter(draw.sample(range(len(SPOTS)), len(SPOTS)))
    start = {name: Place("at", spot=next(spots)) if place.kind == "table" else place for name, place in start.items()}
    asked = list(end)
    if draw.random() < 0.5:
        asked = draw.sample(asked, draw.randint(1, count))
    goals = [_fact(name, end[name]) for name in asked]
    if draw.random() < 0.25:
        goals += [fact("open", name) for name, what in holders.items() if what == "drawer"][:1]
    return Problem(family, things, holders, start, tuple(goals))


def _swaps(things: Mapping[str, float], draw: random.Random) -> Problem:
    """Return a problem in which things change places: spots of the table, or trays that hold one thing each."""
    names = list(things)
    count = len(names)
    spots = draw.sample(range(len(SPOTS)), min(len(SPOTS), count + draw.randint(0, 2)))
    if draw.random() < 0.5 and count <= 8:
        holders = {f"tray_{k}": "tray" for k in range(len(spots))}
        start = {name: Place("in", f"tray_{k}") for k, name in enumerate(names)}
        to = draw.sample(list(holders), count)
        goals = [fact("inside", name, tray) for name, tray in zip(names, to, strict=True)]
        goals = draw.sample(goals, draw.randint(2, count))
        return Problem("swaps", things, holders, start, tuple(goals), dict(zip(holders, spots, strict=True)))
    start = {name: Place("at", spot=spot) for name, spot in zip(names, spots, strict=False)}
    to = draw.sample(spots, count)
    goals = [fact("at", name, *SPOTS[spot]) for name, spot in zip(names, to, strict=True)]
    return Problem("swaps", things, {}, start, tuple(draw.sample(goals, draw.randint(2, count))))


def _arranged(things: Mapping[str, float], holders: Mapping[str, str], draw: random.Random) -> dict[str, Place]:
    """Return random places: in containers, and in towers on the table."""
    found: dict[str, Place] = {}
    room = {name: CAPACITY[kind] for name, kind in holders.items()}
    heights: dict[str, int] = {}
    for name in draw.sample(list(things), len(things)):
        free = [holder for holder, left in room.items() if left]
        tops = [top for top, height in heights.items() if height < HIGHEST]
        choice = draw.choice([*free, None, *tops])
        if choice in room:
            room[choice] -= 1
            found[name] = Place("in", choice)
        elif choice is None:
            heights[name] = 1
            found[name] = Place("table")
        else:
            heights[name] = heights.pop(choice) + 1
            found[name] = Place("on", choice)
    return found


def _fact(name: str, place: Place) -> Fact:
    if place.kind == "table":
        return fact("on", name, TABLE)
    return fact("inside" if place.kind == "in" else "on", name, place.name)


def left_shut(problem: Problem) -> list[str]:
    """Return the drawers that a plan has to leave shut, as they are."""
    opened = {goal.arguments[0] for goal in problem.goals if goal.relation == "open"}
    return [name for name, kind in problem.holders.items() if kind == "drawer" and name not in opened]


def objects_of(problem: Problem) -> list[DetectedObject]:
    """Return all that is in a problem's scene, containers first, drawers shut."""
    found: dict[str, DetectedObject] = {}
    corners = {kind: iter(points) for kind, points in BESIDES.items()}
    for name, kind in problem.holders.items():
        size = {"bin": BIN, "tray": TRAY, "drawer": DRAWER}[kind]
        xy = SPOTS[problem.spots_of[name]] if kind == "tray" else next(corners[kind])
        found[name] = _thing(name, kind, size, (*xy, TABLE_HEIGHT), opening=0.0 if kind == "drawer" else None)
    within: dict[str, int] = {}
    left = dict(problem.start)
    while left:
        for name, place in list(left.items()):
            if place.kind == "on" and place.name not in found:
                continue
            del left[name]
            half = problem.things[name]
            found[name] = _thing(name, "box", (half,) * 3, _point(place, half, found, problem, within))
    return list(found.values())


def _point(
    place: Place, half: float, found: Mapping[str, DetectedObject], problem: Problem, within: dict[str, int]
) -> tuple[float, float, float]:
    """Return the middle of a thing at a place."""
    if place.kind == "at":
        return (*SPOTS[place.spot], TABLE_HEIGHT + half)
    x, y, z = found[place.name].pose.xyz
    if place.kind == "on":
        return (x, y, z + 2.0 * half)
    number = within.get(place.name, 0)
    within[place.name] = number + 1
    match problem.holders[place.name]:
        case "tray":
            return (x, y, z + 0.004 + half)
        case "bin":
            return (x + 0.045 * (1 - 2 * (number % 2)), y + 0.045 * (1 - 2 * (number // 2)), z + 0.004 + half)
        case _:
            return (x - 0.04, y + 0.07 * (number - 1), z + 0.009 + half)


def _thing(
    name: str, kind: str, size: tuple[float, ...], xyz: tuple[float, float, float], opening: float | None = None
) -> DetectedObject:
    grey = (0.5, 0.5, 0.5, 1.0)
    return DetectedObject(id=name, kind=kind, size=size, colour="grey", rgba=grey, pose=Pose(xyz=xyz), opening=opening)


def scene_of(objects: Sequence[DetectedObject]) -> ObservedScene:
    """Return the scene with these objects."""
    return ObservedScene(time=0.0, objects=tuple(objects), table_height=TABLE_HEIGHT, base_xy=BASE_XY)


class Replay:
    """Plans run over a problem's symbols, by rules of their own: no geometry, nothing of the contracts.

    Args:
        problem: Which one.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self.at: dict[str, Place] = dict(problem.start)
        self.open: set[str] = set()
        self.held = ""

    def run(self, calls: Sequence[SkillCall]) -> str:
        """Carry out calls; return what is wrong with the first that cannot be, or which goal does not hold in the end."""
        for call in calls:
            wrong = self._step(call.skill, call.arguments)
            if wrong:
                return f"{call}: {wrong}"
        ajar = next((name for name in left_shut(self._problem) if name in self.open), None)
        if ajar is not None:
            return f"{ajar} is left open"
        return next((f"{goal} does not hold" for goal in self._problem.goals if not self._holds(goal)), "")

    def _step(self, skill: str, given: Mapping[str, object]) -> str:
        name = str(given.get("object", self.held))
        match skill:
            case "pick":
                return self._picked(name)
            case "stack":
                return self._picked(name) or self._put(Place("on", str(given["target"])))
            case "place_on":
                return self._put(Place("on", str(given["target"])))
            case "place_in":
                return self._put(Place("in", str(given["container"])))
            case "place_at":
                x, y = float(str(given["x"])), float(str(given["y"]))
                near = next((k for k, point in enumerate(SPOTS) if math.dist(point, (x, y)) < AT), None)
                return self._put(Place("table") if near is None else Place("at", spot=near))
            case "open_drawer" | "close_drawer":
                change = self.open.add if skill == "open_drawer" else self.open.discard
                change(str(given["drawer"]))
                return f"{self.held} is held" if self.held else ""
        return "no rule for it"

    def _picked(self, name: str) -> str:
        if self.held:
            return f"{self.held} is held"
        if self._upon(name):
            return f"{name} is not clear"
        place = self.at.pop(name)
        self.held = name
        return "" if self._lets_in(place) else f"{place.name} is shut"

    def _put(self, place: Place) -> str:
        if not self.held:
            return "nothing is held"
        is_full = place.kind in ("on", "at") or self._problem.holders.get(place.name) == "tray"
        if is_full and place in self.at.values():
            return "something is there"
        self.at[self.held], self.held = place, ""
        return "" if self._lets_in(place) else f"{place.name} is shut"

    def _lets_in(self, place: Place) -> bool:
        return place.kind != "in" or self._problem.holders[place.name] != "drawer" or place.name in self.open

    def _upon(self, name: str) -> bool:
        return Place("on", name) in self.at.values()

    def _holds(self, goal: Fact) -> bool:
        name = str(goal.arguments[0])
        if goal.relation in ("open", "closed"):
            return (name in self.open) == (goal.relation == "open")
        place = self.at.get(name, Place("held"))
        if goal.relation == "at":
            return place.kind == "at" and math.dist(SPOTS[place.spot], [float(v) for v in goal.arguments[1:]]) < AT
        if goal.relation == "on" and goal.arguments[1] == TABLE:
            return place.kind in ("at", "table")
        return (place.kind, place.name) == ("in" if goal.relation == "inside" else "on", goal.arguments[1])
