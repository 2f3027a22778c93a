"""What could be tried in place of a failed skill call, from its evidence and the scene as it is now, the likeliest first."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator

import numpy as np

from robosandbox.agent.language.aside import carried_aside, pile_on, set_down
from robosandbox.agent.language.world import World
from robosandbox.errors import ErrorCode, SkillError
from robosandbox.evidence import (
    CollisionEvidence,
    DrawerEvidence,
    GraspEvidence,
    PlacementEvidence,
    PourEvidence,
    PushEvidence,
)
from robosandbox.types import DIRECTION_AXES, DetectedObject, ObservedScene, SkillCall
from robosandbox.world.relations import gap

_NEIGHBOUR = 0.06
_ASIDE = 0.06
_NEARER = (0.06, 0.12, 0.18)
_PILE = 3
_PLACES = ("place_on", "place_in", "place_beside", "place_at")

Calls = tuple[SkillCall, ...]


class Candidates:
    """What could be tried in place of a failed call."""

    def __init__(self, scene: ObservedScene, call: SkillCall, error: SkillError) -> None:
        self._scene = scene
        self._call = call
        self._error = error
        self._world = World(scene)

    def all(self) -> Iterator[tuple[Calls, str]]:
        """Yield calls, the likeliest first but what moves nothing else before that, and why they may help."""
        if self._error.code in (ErrorCode.COLLISION, ErrorCode.TRACKING) and self._call.skill != "home":
            yield (SkillCall(skill="home"), self._call), "from another start"
        match self._call.skill:
            case "pick" | "tap":
                yield from self._before_grasp(str(self._call.arguments["object"]))
            case "stack":
                yield from self._before_grasp(str(self._call.arguments["object"]))
                yield from self._nearer(str(self._call.arguments["target"]))
            case "push":
                yield from self._push()
            case "open_drawer" | "close_drawer":
                yield from self._drawer(str(self._call.arguments["drawer"]))
            case "pour":
                yield from self._pour(str(self._call.arguments["target"]))
            case name if name in _PLACES:
                yield from self._place()

    def _before_grasp(self, name: str) -> Iterator[tuple[Calls, str]]:
        item = self._scene.find(name)
        if item is None or item.shape.opens:
            return
        held = self._scene.held
        if held and held != name:
            if down := self._set_down(held):
                yield (down, self._call), f"{held} is put down first"
            return
        if self._world.on_top_of(name):
            if pile := self._pile_aside(name):
                names = ", ".join(str(call.arguments["object"]) for call in pile[::2])
                yield (*pile, self._call), f"{names} on top of it is put aside first"
            return
        match self._error.code:
            case ErrorCode.UNREACHABLE:
                yield from self._nearer(name)
            case ErrorCode.COLLISION | ErrorCode.GRASP | ErrorCode.TRACKING | ErrorCode.TAP:
                evidence = self._error.evidence
                reason = evidence.reason if isinstance(evidence, GraspEvidence) else None
                if reason in ("immovable", "gripper_stuck"):
                    return
                if self._error.code is not ErrorCode.COLLISION and reason != "none_found":
                    yield (self._call,), "another try from where it lies now"
                if reason != "too_heavy":
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
            if aside := carried_aside(self._world, other.id, item.id):
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
            for name in self._movable(evidence.blocking)[:2]:
                yield from self._cleared(held, name)
        arguments = self._call.arguments
        if (target := arguments.get("target", arguments.get("container"))) is not None:
            yield from self._target_nearer(held, str(target))

    def _pour(self, target: str) -> Iterator[tuple[Calls, str]]:
        held, evidence = self._scene.held, self._error.evidence
        if held is None:
            return
        if isinstance(evidence, PourEvidence) and evidence.poured + evidence.spilled < evidence.count:
            yield (self._call,), "what is left is poured"
        for name in self._blockers(held, target):
            yield from self._cleared(held, name)
        yield from self._target_nearer(held, target)

    def _drawer(self, drawer: str) -> Iterator[tuple[Calls, str]]:
        held, evidence = self._scene.held, self._error.evidence
        if held:
            if down := self._set_down(held):
                yield (down, self._call), f"{held} is put down first"
            return
        if isinstance(evidence, DrawerEvidence) and evidence.reason == "slipped":
            yield (self._call,), "another try from where it stands now"
        back = "close_drawer" if self._call.skill == "open_drawer" else "open_drawer"
        for name in self._blockers(drawer):
            if aside := carried_aside(self._world, name, drawer):
                yield (*aside, self._call), f"{name} is in the way and is put aside first"
                if isinstance(evidence, DrawerEvidence):
                    # What the drawer presses on is free once the drawer has gone back.
                    freed = (SkillCall(skill=back, arguments={"drawer": drawer}), *aside, self._call)
                    yield freed, f"{name} jams {drawer} and is put aside first"

    def _blockers(self, *ours: str) -> list[str]:
        """Return what the evidence says is in the way, but for these objects."""
        evidence = self._error.evidence
        names: tuple[str, ...] = ()
        if isinstance(evidence, CollisionEvidence):
            names = (evidence.other, evidence.body)
        elif isinstance(evidence, DrawerEvidence):
            names = evidence.blocking
        return [name for name in self._movable(names) if name not in ours]

    def _movable(self, names: Iterable[str]) -> list[str]:
        return [name for name in names if name in self._world.at and self._world.movable(name)]

    def _target_nearer(self, held: str, target: str) -> Iterator[tuple[Calls, str]]:
        """Put down what is held, push what it was meant for into reach, and fetch it again."""
        item = self._scene.find(target)
        if self._error.code is not ErrorCode.UNREACHABLE or item is None or item.shape.opens:
            return
        down = self._set_down(held)
        pick = SkillCall(skill="pick", arguments={"object": held})
        for calls, why in self._nearer(target):
            if down:
                yield (down, calls[0], pick, self._call), why

    def _cleared(self, held: str, name: str) -> Iterator[tuple[Calls, str]]:
        down = self._set_down(held)
        if down is None:
            return
        world = World(self._scene)
        world.put(held, _spot(down))
        if aside := carried_aside(world, name, held):
            pick = SkillCall(skill="pick", arguments={"object": held})
            yield (down, *aside, pick, self._call), f"{name} is in the way and is put aside first"

    # Pieces.

    def _pile_aside(self, name: str) -> Calls:
        """Return calls that carry off what stands on an object, the topmost first."""
        world, calls = World(self._scene), list[SkillCall]()
        while (pile := pile_on(world, name)) and len(calls) < 2 * _PILE:
            aside = carried_aside(world, pile[-1], name)
            if aside is None:
                return ()
            calls += aside
            world.put(pile[-1], _spot(aside[1]))
        return tuple(calls)

    def _carry_both_aside(self, one: str, two: str, item: str) -> Calls | None:
        world = World(self._scene)
        first = carried_aside(world, one, item)
        if first is None:
            return None
        world.put(one, _spot(first[1]))
        second = carried_aside(world, two, item)
        return (*first, *second) if second else None

    def _set_down(self, held: str) -> SkillCall | None:
        return set_down(self._world, held)

    def _pushed(self, name: str, direction: str, distance: float) -> SkillCall:
        return SkillCall(skill="push", arguments={"object": name, "direction": direction, "distance": distance})

    def _along(self, wanted: np.ndarray) -> list[str]:
        """Return the directions that lead the way, the best first."""
        length = float(np.hypot(*wanted))
        if length < 1e-6:
            return list(DIRECTION_AXES)
        scores = {name: float(np.dot(axis, wanted)) / length for name, axis in DIRECTION_AXES.items()}
        return sorted((name for name in scores if scores[name] > 0.35), key=lambda name: -scores[name])


def _spot(call: SkillCall) -> tuple[float, float]:
    return float(call.arguments["x"]), float(call.arguments["y"])
