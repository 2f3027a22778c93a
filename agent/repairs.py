"""Repairs: what else would do, tried on a copy of the world before it is offered."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from robosandbox.agent.language.world import World
from robosandbox.errors import (
    CancelledError,
    CollisionEvidence,
    ErrorCode,
    GraspEvidence,
    PlacementEvidence,
    PushEvidence,
    Repair,
    SkillError,
)
from robosandbox.perception.relations import gap
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import DIRECTION_AXES, DetectedObject, ObservedScene, SkillCall

if TYPE_CHECKING:
    from robosandbox.agent.context import AgentContext

_log = logging.getLogger(__name__)
_MOST_TRIED = 12
_ENOUGH = 2
_NEIGHBOUR = 0.06
_ASIDE = 0.06
_CLEAR = 0.10
_NEARER = (0.06, 0.12, 0.18)
_PLACES = ("place_on", "place_in", "place_beside", "place_at")
_CURABLE = frozenset(
    {
        ErrorCode.UNREACHABLE,
        ErrorCode.COLLISION,
        ErrorCode.TRACKING,
        ErrorCode.GRASP,
        ErrorCode.ALREADY_HOLDING,
        ErrorCode.PLACEMENT,
        ErrorCode.PUSH,
    }
)

Calls = tuple[SkillCall, ...]


def find_repairs(ctx: AgentContext, call: SkillCall, error: SkillError) -> tuple[Repair, ...]:
    """Return skill calls that reach the failed call's post-condition on a copy of the world, cheapest first.

    Candidates are made from the evidence, the likeliest first, and rolled out one after another; after a few successes or
    a fixed number of trials the search ends, so that the same failure gets the same answer. The live world is not touched.

    Args:
        ctx: Where it failed; the world as the failure left it.
        call: What failed.
        error: How.

    Raises:
        CancelledError: Somebody cancelled meanwhile.
    """
    if error.code not in _CURABLE:
        return ()
    skills = {skill.name: skill for skill in load_skills()}
    scene = ctx.look()
    found: list[Repair] = []
    tried: list[Calls] = []
    for calls, why in _Candidates(scene, call, error).all():
        if calls in tried or any(item.skill not in skills for item in calls):
            continue
        tried.append(calls)
        copy = ctx.fork()
        begin = copy.sim.time
        try:
            for item in calls:
                copy.permit(item)
                skills[item.skill](copy, item.arguments)
        except CancelledError:
            raise
        except SkillError as failure:
            _log.debug("%s would fail too: %s", ", ".join(map(str, calls)), failure)
        else:
            found.append(Repair(calls=calls, why=why, cost=round(copy.sim.time - begin, 3)))
        if len(found) >= _ENOUGH or len(tried) >= _MOST_TRIED:
            break
    return tuple(sorted(found, key=lambda repair: repair.cost))


class _Candidates:
    """What could be tried in place of a failed call."""

    def __init__(self, scene: ObservedScene, call: SkillCall, error: SkillError) -> None:
        self._scene = scene
        self._call = call
        self._error = error
        self._world = World(scene)

    def all(self) -> Iterator[tuple[Calls, str]]:
        """Yield calls, the likeliest first, and why they may help."""
        match self._call.skill:
            case "pick":
                yield from self._before_grasp(str(self._call.arguments["object"]))
            case "stack":
                yield from self._before_grasp(str(self._call.arguments["object"]))
                yield from self._nearer(str(self._call.arguments["target"]))
            case "push":
                yield from self._push()
            case name if name in _PLACES:
                yield from self._place()
        if self._error.code in (ErrorCode.COLLISION, ErrorCode.TRACKING) and self._call.skill != "home":
            yield (SkillCall(skill="home"), self._call), "from another start"

    def _before_grasp(self, name: str) -> Iterator[tuple[Calls, str]]:
        item = self._scene.find(name)
        if item is None or item.kind == "drawer":
            return
        held = self._scene.held
        if held and held != name:
            if down := self._set_down(held):
                yield (down, self._call), f"{held} is put down first"
            return
        above = self._world.on_top_of(name)
        if len(above) == 1 and (aside := self._carry_aside(above[0], name, self._world)):
            yield (*aside, self._call), f"{above[0]} stands on it and is put aside first"
        if above:
            return
        match self._error.code:
            case ErrorCode.UNREACHABLE:
                yield from self._nearer(name)
            case ErrorCode.COLLISION | ErrorCode.GRASP | ErrorCode.TRACKING:
                evidence = self._error.evidence
                if isinstance(evidence, GraspEvidence) and evidence.reason != "none_found":
                    yield (self._call,), "another try from where it lies now"
                yield from self._free_of_neighbours(item)

    def _nearer(self, name: str) -> Iterator[tuple[Calls, str]]:
        """Push something that is out of reach towards the robot, and far things from its foot."""
        item = self._scene.find(name)
        if item is None or self._error.code is not ErrorCode.UNREACHABLE:
            return
        offset = np.array(self._scene.base_xy) - item.pose.position[:2]
        far = float(np.hypot(*offset)) > 0.5
        wanted = offset if far else -offset
        for distance in _NEARER:
            for direction in self._along(wanted):
                yield (self._pushed(name, direction, distance), self._call), f"{name} is pushed into reach first"

    def _free_of_neighbours(self, item: DetectedObject) -> Iterator[tuple[Calls, str]]:
        evidence = self._error.evidence
        near = [
            other
            for other in self._scene.objects
            if other.id != item.id and self._world.movable(other.id) and gap(item, other) < _NEIGHBOUR
        ]
        if isinstance(evidence, CollisionEvidence):
            near.sort(key=lambda other: (other.id not in (evidence.other, evidence.body), gap(item, other)))
        else:
            near.sort(key=lambda other: gap(item, other))
        for other in near:
            for direction in self._along(item.pose.position[:2] - other.pose.position[:2]):
                yield (self._pushed(item.id, direction, _ASIDE), self._call), f"{item.id} is pushed free of {other.id}"
                break
        for other in near:
            if aside := self._carry_aside(other.id, item.id, self._world):
                yield (*aside, self._call), f"{other.id} is in the way and is put aside first"
        for one, two in itertools.combinations(near, 2):
            sides = [other.pose.position[:2] - item.pose.position[:2] for other in (one, two)]
            if np.dot(*sides) < 0.0 and (both := self._carry_both_aside(one.id, two.id, item.id)):
                yield (*both, self._call), f"{one.id} and {two.id} are in the way and are put aside first"
        for other in near:
            for direction in self._along(other.pose.position[:2] - item.pose.position[:2]):
                yield (self._pushed(other.id, direction, _ASIDE), self._call), f"{other.id} is pushed out of the way"
                break

    def _push(self) -> Iterator[tuple[Calls, str]]:
        arguments = self._call.arguments
        name, evidence = str(arguments["object"]), self._error.evidence
        item = self._scene.find(name)
        if item is None:
            return
        distance = float(arguments["distance"])
        if isinstance(evidence, PushEvidence) and evidence.wanted - evidence.along > 0.005:
            distance = evidence.wanted - evidence.along
            yield (self._pushed(name, str(arguments["direction"]), round(distance, 4)),), "what is left of the way"
        if self._world.movable(name) and not self._world.on_top_of(name):
            axis = np.array(DIRECTION_AXES[str(arguments["direction"])])
            x, y = item.pose.position[:2] + distance * axis
            pick = SkillCall(skill="pick", arguments={"object": name})
            place = SkillCall(skill="place_at", arguments={"x": round(float(x), 4), "y": round(float(y), 4)})
            yield (pick, place), "carried there in place of pushed"

    def _place(self) -> Iterator[tuple[Calls, str]]:
        evidence, held = self._error.evidence, self._scene.held
        if held is None:
            if isinstance(evidence, PlacementEvidence) and self._scene.find(evidence.object):
                pick = SkillCall(skill="pick", arguments={"object": evidence.object})
                yield (pick, self._call), "it is fetched and placed again"
            return
        if isinstance(evidence, PlacementEvidence):
            movable = [name for name in evidence.blocking if name in self._world.at and self._world.movable(name)]
            for name in movable[:2]:
                yield from self._cleared(held, name)
        target = self._call.arguments.get("target")
        if self._error.code is ErrorCode.UNREACHABLE and target is not None and self._world.movable(str(target)):
            down = self._set_down(held)
            pick = SkillCall(skill="pick", arguments={"object": held})
            for calls, why in self._nearer(str(target)):
                if down:
                    yield (down, calls[0], pick, self._call), why

    def _cleared(self, held: str, name: str) -> Iterator[tuple[Calls, str]]:
        down = self._set_down(held)
        if down is None:
            return
        world = World(self._scene)
        world.put(held, (float(down.arguments["x"]), float(down.arguments["y"])))
        if aside := self._carry_aside(name, held, world):
            pick = SkillCall(skill="pick", arguments={"object": held})
            yield (down, *aside, pick, self._call), f"{name} is in the way and is put aside first"

    # Pieces.

    def _carry_both_aside(self, one: str, two: str, item: str) -> Calls | None:
        world = World(self._scene)
        first = self._carry_aside(one, item, world)
        if first is None:
            return None
        to = first[1].arguments
        world.put(one, (float(to["x"]), float(to["y"])))
        second = self._carry_aside(two, item, world)
        return (*first, *second) if second else None

    def _carry_aside(self, name: str, item: str, world: World) -> Calls | None:
        """Return calls that put something down where it is no longer in the way of `item`."""
        if self._world.on_top_of(name):
            return None
        here, other = np.array(world.at[name]), np.array(world.at[item])
        away = here - other
        length = float(np.hypot(*away))
        towards = away / length if length > 0.01 else np.array([0.0, 1.0])
        x, y = here + _CLEAR * towards
        spots = world.free_spots((float(x), float(y)), world.radius(name), (name,))
        if not spots:
            return None
        place = SkillCall(skill="place_at", arguments={"x": spots[0][0], "y": spots[0][1]})
        return SkillCall(skill="pick", arguments={"object": name}), place

    def _set_down(self, held: str) -> SkillCall | None:
        spots = self._world.free_spots(self._world.at[held], self._world.radius(held), (held,))
        return SkillCall(skill="place_at", arguments={"x": spots[0][0], "y": spots[0][1]}) if spots else None

    def _pushed(self, name: str, direction: str, distance: float) -> SkillCall:
        return SkillCall(skill="push", arguments={"object": name, "direction": direction, "distance": distance})

    def _along(self, wanted: np.ndarray) -> list[str]:
        """Return the directions that lead the way, the best first."""
        length = float(np.hypot(*wanted))
        if length < 1e-6:
            return list(DIRECTION_AXES)
        scores = {name: float(np.dot(axis, wanted)) / length for name, axis in DIRECTION_AXES.items()}
        return sorted((name for name in scores if scores[name] > 0.35), key=lambda name: -scores[name])
