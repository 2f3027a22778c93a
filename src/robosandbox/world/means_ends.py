"""Means-ends analysis of one call: calls that bring about what it lacks, and then the call itself, by contracts of skills."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from robosandbox.types import DetectedObject, ObservedScene, Plan, SkillCall
from robosandbox.world.contracts import find, first_refuted, lookup
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.goal_plan import plan_for
from robosandbox.world.operators import Operator, bind
from robosandbox.world.predicate import View, predicates
from robosandbox.world.relations import centre, gap
from robosandbox.world.search import NoWayError
from robosandbox.world.verifier import verify

# Needs of a call that are looked after one by one; chosen above what any contract here can lack at once.
_MOST_LACKING = 8
# Space that is left between what is put aside and what is to be handled then, or the arm that reaches there, metres; chosen as half
# of what a Panda's hand is wide.
_HAND_ROOM = 0.10
# How far another place to put a thing aside is from the nearest one, metres; chosen as two hands' breadths.
_ELSEWHERE = 0.2
_OF_THE_HAND = ("holding", "hand_empty", "hand_ready")


class MeansEndsPlan:
    """Plan that grows call by call, and the scene as it would leave it.

    Args:
        scene: What is seen now.
        skills: What may be called, by name.
        about: Ids of what the call in question is about: what is put aside leaves room for a hand beside it.
        held: What the gripper holds, or held when the call in question began.

    Attributes:
        calls: Those found so far.
        scene: As they would leave it.
    """

    def __init__(
        self,
        scene: ObservedScene,
        skills: Mapping[str, Operator],
        *,
        about: Iterable[str] = (),
        held: str | None = None,
    ) -> None:
        self.calls: list[SkillCall] = []
        self.scene: ObservedScene = scene
        self._skills = skills
        self._about = tuple(about)
        self._held = held if scene.held is None else scene.held

    def bring_about(self, goal: Fact) -> None:
        """Add the calls after which a fact holds.

        Raises:
            NoWayError: There are none.
        """
        answer = plan_for((goal,), self.scene, tuple(self._skills.values()))
        steps = answer.steps if isinstance(answer, Plan) else None
        if steps is None:
            raise NoWayError(str(goal))
        if not steps and not find(goal, View.of(self.scene)).is_sure:
            raise NoWayError(str(goal))
        self._add(steps)

    def put_aside(self, name: str, *, elsewhere: bool = False) -> None:
        """Add the calls that put an object down near by where it leaves room for a hand, or the most that there is.

        Raises:
            NoWayError: It does not move, or there is no such place.
        """
        view = View.of(self.scene)
        item, choices = self.scene.find(name), predicates()["room_at"].choices
        if item is None or item.shape.opens or item.shape.is_granular or choices is None:
            raise NoWayError(f"{name} stays where it is")
        around = [other for other in view.others(name) if other.id in self._about]
        places = iter(choices(view, name))
        best, room = self._roomiest(item, places, around)
        if best is not None and elsewhere and room >= _HAND_ROOM:
            first = best
            best, _ = self._roomiest(item, (place for place in places if math.dist(first, place) >= _ELSEWHERE), around)
        if best is None:
            raise NoWayError(f"there is no place for {name}")
        self.bring_about(fact("at", name, *best))

    def call(self, call: SkillCall) -> None:
        """Add a call, and before it what brings about what it needs and does not have.

        Raises:
            NoWayError: That cannot be brought about.
        """
        if call.skill not in self._skills:
            raise NoWayError(f"there is no skill {call.skill}")
        contract = bind(call, self._skills).contract
        for _ in range(_MOST_LACKING):
            scene = self.scene.holding(self._held) if self._held else self.scene
            needs = contract.resolved(scene).needs
            lacking = first_refuted(sorted(needs, key=_is_of_the_hand), View.of(self.scene))
            if lacking is None:
                break
            need, finding = lacking
            remedies = [one for one in finding.remedies if not find(one, View.of(self.scene)).holds]
            if lookup(need).is_fixed or not (remedies or finding.blocking):
                raise NoWayError(finding.cause)
            if remedies and remedies[0].arguments[1:] != (TABLE,):
                self.bring_about(remedies[0])
            else:
                self.put_aside(str(remedies[0].arguments[0]) if remedies else finding.blocking[0])
        else:
            raise NoWayError(f"what {call} needs cannot be had at once")
        self._add((call,))

    def _roomiest(
        self, item: DetectedObject, places: Iterable[tuple[float, ...]], around: Sequence[DetectedObject]
    ) -> tuple[tuple[float, float] | None, float]:
        """Return the first place that leaves room for a hand beside other things, or the one with most, and how much, metres."""
        best, most = None, 0.0
        for x, y in places:
            there = _at(self.scene, item.id, x, y).find(item.id) or item
            room = min((_room(there, other, self.scene.base_xy) for other in around), default=_HAND_ROOM)
            if room > most:
                best, most = (x, y), room
            if room >= _HAND_ROOM:
                break
        return best, most

    def _add(self, calls: tuple[SkillCall, ...]) -> None:
        self.calls += calls
        self.scene = verify(Plan(steps=calls), self.scene, tuple(self._skills.values())).end


def _at(scene: ObservedScene, name: str, x: float, y: float) -> ObservedScene:
    effect = predicates()["at"].effect
    return scene if effect is None else effect(scene, name, x, y)


def _room(item: DetectedObject, other: DetectedObject, base: tuple[float, float]) -> float:
    """Return how far an object stands from another and from the arm that reaches there from its base, metres."""
    begin, end, point = np.array(base), centre(other)[:2], centre(item)[:2]
    share = float(np.clip((point - begin) @ (end - begin) / max(float((end - begin) @ (end - begin)), 1e-9), 0.0, 1.0))
    return min(gap(item, other), float(np.linalg.norm(begin + share * (end - begin) - point)))


def _is_of_the_hand(need: Fact) -> bool:
    return need.relation in _OF_THE_HAND
