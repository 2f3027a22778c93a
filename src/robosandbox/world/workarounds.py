"""Workarounds of a failed call, from its evidence, its contract, and the alternatives of its skill."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from robosandbox.errors import ErrorCode
from robosandbox.evidence import CollisionEvidence
from robosandbox.types import DIRECTION_AXES, Array, DetectedObject, SkillCall
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.facts import Fact, fact
from robosandbox.world.means_ends import MeansEndsPlan
from robosandbox.world.nearness import nearer
from robosandbox.world.operators import Operator
from robosandbox.world.predicate import View, predicates
from robosandbox.world.relations import bottom, centre, gap, lies_in, on_top, support, top
from robosandbox.world.search import NoWayError
from robosandbox.world.standing import TIPPED, standing_on, tilt

# How many others a thing counts for that stays where it is unless somebody names it; chosen above the number of others that
# are ever in the way, so that it is moved after all of them.
_LEFT_ALONE = 10
# Distances by which a thing out of reach is brought nearer, the shortest first, metres; chosen as thirds of the band between what
# a gripper and what a fingertip of an arm reaches.
_NEARER = (0.06, 0.12, 0.18)
# Distance from the robot from which on a thing counts as too far, not too near, metres: half of what arms here reach.
_FAR = 0.5
# Nearer than this another thing may be in the way of a hand, metres; chosen as a finger, and as far as it is opened.
_NEIGHBOUR = 0.06
# What is left between two things of which one was pushed away, metres; chosen as a finger and what a push may fall short by.
_APART = 0.03
# Farther nothing is pushed out of the way, metres; chosen as two lengths of a hand.
_FARTHEST = 0.2
# Cosine between two directions from which on one leads the way of the other; chosen so that two of four lead along a diagonal,
# and only one along an axis.
_LEADS = 0.35

Calls = tuple[SkillCall, ...]


def cheapest(failed: FailedCall, skills: Mapping[str, Operator]) -> Iterator[tuple[Calls, str]]:
    """Yield calls in place of a failed one and why they may help: those that move the fewest others first, then the shortest.

    For who tries them before they are done.

    Args:
        failed: The call and how it failed.
        skills: What may be called, by name.
    """
    ways = _Workarounds(failed, skills)
    return ways.planned(sorted(ways.all(), key=ways.cost))


def likeliest(failed: FailedCall, skills: Mapping[str, Operator]) -> Iterator[tuple[Calls, str]]:
    """Yield calls in place of a failed one and why they may help, the likeliest first: where nothing is tried before it is done."""
    ways = _Workarounds(failed, skills)
    return ways.planned(ways.all())


class _Workarounds:
    def __init__(self, failed: FailedCall, skills: Mapping[str, Operator]) -> None:
        self._failed = failed
        self._skills = skills
        self._view = View.of(failed.scene)
        about = (failed.scene.find(name) for name in failed.contract.objects)
        self._about = [item for item in about if item is not None and item.id not in failed.scene.in_hands]
        skill = skills.get(failed.call.skill)
        self._declared = (
            () if skill is None else tuple(skill.alternatives(failed, **skill.check(failed.call.arguments)))
        )
        # Of a change that has been brought about in part, the skill says what is left.
        rest = (way.call for way in self._declared if way.call and not way.first and not way.cleared)
        self._call = next(rest, failed.call) if failed.promises_a_change else failed.call

    def planned(self, ways: Iterable[Alternative]) -> Iterator[tuple[Calls, str]]:
        if self._failed.is_hopeless:
            return
        # A call that failed before anything moved would fail in the same way again.
        seen: list[Calls] = [] if self._failed.had_begun else [(self._failed.call,)]
        for way in ways:
            calls = self._planned(way)
            if calls and calls not in seen:
                seen.append(calls)
                yield calls, way.why

    def cost(self, way: Alternative) -> tuple[int, int]:
        """Return how many others a way sets out to move, and about how many calls it takes."""
        ours, moved = {item.id for item in self._about}, _changed(way.first) | {*way.cleared}
        others = [item for name in moved - ours if (item := self._failed.scene.find(name)) is not None]
        # Things that stay where they are unless somebody names them are moved only where nothing else helps.
        weight = sum(1 + _LEFT_ALONE * item.shape.stays_put for item in others)
        return weight, len(way.first) + 2 * len(way.cleared) + way.elsewhere + (way.call is not None)

    def _planned(self, way: Alternative) -> Calls | None:
        """Return the calls of a way with all that they need first; None where contracts show no way."""
        failed = self._failed
        making = MeansEndsPlan(
            failed.scene, self._skills, about=[item.id for item in self._about], held=failed.before.held
        )
        try:
            for one in way.first:
                making.bring_about(one)
            for name in way.cleared:
                making.put_aside(name, elsewhere=way.elsewhere)
            if way.call is not None:
                making.call(way.call)
        except NoWayError:
            return None
        return tuple(making.calls)

    def all(self) -> Iterator[Alternative]:
        failed, call = self._failed, self._call
        if not failed.had_begun:
            yield Alternative(why=self._lacking(), call=call)
        elif not failed.met and not failed.promises_a_change:
            yield Alternative(why="another try from where things are now", call=call)
        yield from self._declared
        changed = _changed(failed.contract.gives)
        if self._may_be_of_the_way():
            yield Alternative(why="from another start", first=(fact("at_home"),), call=call)
        for item in self._about:
            if tilt(item) >= TIPPED:
                yield Alternative(why=f"{item.id} is set upright first", first=(fact("upright", item.id),), call=call)
            if failed.error.code == ErrorCode.UNREACHABLE and item.id in changed:
                yield from self._nearer(item)
        yield from self._cleared()

    def _lacking(self) -> str:
        """Return why what the call needs may help, when that is brought about first."""
        if self._failed.met:
            return f"{', '.join(self._failed.met)} is in the way and is put aside first"
        held = self._failed.scene.held
        return f"{held} is put down first" if held else "what it needs is brought about first"

    def _may_be_of_the_way(self) -> bool:
        """Tell whether another start may help: not where the hand would touch something at its very goal."""
        evidence = self._failed.error.evidence
        if isinstance(evidence, CollisionEvidence) and evidence.waypoints <= 1:
            return False
        return self._failed.error.code in (ErrorCode.COLLISION, ErrorCode.TRACKING)

    def _nearer(self, item: DetectedObject) -> Iterator[Alternative]:
        """Yield pushes of something that is out of reach towards the robot, and of far too near things away from it; not out of a tower."""
        if any(on_top(item, other).holds for other in self._view.others(item.id) if not other.is_fixed):
            return
        offset = np.array(self._failed.scene.base_xy) - centre(item)[:2]
        wanted = offset if float(np.hypot(*offset)) > _FAR else -offset
        for distance in _NEARER:
            for direction in _along(wanted):
                pushed = fact("displaced", item.id, direction, distance)
                yield Alternative(why=f"{item.id} is pushed into reach first", first=(pushed,), call=self._call)

    def _cleared(self) -> Iterator[Alternative]:
        """Yield ways to free what the call is about from what is on it, touches it or stands too close for a hand."""
        call, crowd = self._call, self._in_the_way()
        for other, item in crowd:
            if other.shape.opens:
                yield Alternative(why=f"{other.id} is closed first", first=(fact("closed", other.id),), call=call)
                continue
            why = f"{other.id} is in the way and is put aside first"
            yield Alternative(why=why, cleared=(other.id,), call=call)
            # What lies over the thing may come off on any side; what stands beside it goes straight away from it.
            pushes = self._pushed_away(other, item)
            for away in pushes if nearer(item, other, 0.0) else pushes[:1]:
                yield Alternative(why=f"{other.id} is pushed out of the way first", first=(away,), call=call)
            if other.id in self._failed.met:
                yield Alternative(why=why, cleared=(other.id,), elsewhere=True, call=call)
            for free in self._pushed_away(item, other)[:1]:
                yield Alternative(why=f"{item.id} is pushed free of {other.id} first", first=(free,), call=call)
        for (one, item), (two, same) in itertools.combinations(crowd, 2):
            if item is same and (centre(one) - centre(item))[:2] @ (centre(two) - centre(item))[:2] < 0.0:
                why = f"{one.id} and {two.id} are in the way and are put aside first"
                yield Alternative(why=why, cleared=(one.id, two.id), call=call)

    def _in_the_way(self) -> list[tuple[DetectedObject, DetectedObject]]:
        """Return what may be in the way, each with what it is in the way of: what was met first, then the nearest."""
        met, hand = self._failed.met, self._failed.error.code in _OF_THE_HAND
        found = dict[str, tuple[DetectedObject, DetectedObject]]()
        for item in sorted(self._about, key=lambda one: one.shape.stays_put):
            on_it = {one.id for one in standing_on(self._view, item.id)}
            for other in self._view.others(*self._failed.contract.objects):
                if _lies_in(item, other):
                    # A thing that moves together with it does not get out of its way.
                    continue
                near = hand and not (item.shape.stays_put or other.shape.stays_put) and nearer(item, other, _NEIGHBOUR)
                if other.id in met or other.id in on_it or near:
                    found.setdefault(other.id, (other, item))
        whole = [pair for pair in found.values() if not pair[0].shape.is_granular]
        return sorted(whole, key=lambda pair: (pair[0].id not in met, gap(pair[1], pair[0])))

    def _pushed_away(self, item: DetectedObject, other: DetectedObject) -> list[Fact]:
        """Return pushes of an object away from another, far enough and to where there is room, the shortest first."""
        if item.shape.opens or item.id in self._failed.scene.in_hands:
            return []
        found: list[tuple[float, str]] = []
        for direction in DIRECTION_AXES:
            axis = np.array([[*DIRECTION_AXES[direction], 0.0]])
            reach, begin = float(support(other, axis)[0]), -float(support(item, -axis)[0])
            distance = round(max(reach - begin + _APART, _NEIGHBOUR), 3)
            if distance <= _FARTHEST and self._is_free(item, distance * axis[0], other.id):
                found.append((distance, direction))
        return [fact("displaced", item.id, direction, distance) for distance, direction in sorted(found)]

    def _is_free(self, item: DetectedObject, offset: Array, but: str) -> bool:
        """Tell whether an object that is moved by an offset (3,) comes to lie in nothing else that stands as high."""
        effect = predicates()["at"].effect
        end = centre(item) + offset
        moved = effect and effect(self._failed.scene, item.id, float(end[0]), float(end[1])).find(item.id)
        others = (one for one in self._view.others(item.id, but) if not one.shape.is_granular)
        return moved is not None and not any(nearer(moved, one, 0.0) and top(one) > bottom(item) for one in others)


# Errors that a hand ends in that finds no room beside what it is to handle.
_OF_THE_HAND = frozenset({ErrorCode.COLLISION, ErrorCode.GRASP, ErrorCode.TRACKING, ErrorCode.TAP})


def _changed(facts: Iterable[Fact]) -> set[str]:
    """Return the ids of what facts are brought about on, not of what that goes to."""
    known = predicates()
    return {name for one in facts for name in known[one.relation].objects(one.arguments)[:1]}


def _lies_in(item: DetectedObject, other: DetectedObject) -> bool:
    """Tell whether an object lies in another that takes it along; what is turned over leaves behind what is under it."""
    carries = other.shape.holds_things and not other.shape.opens and bool(other.pose.rotation[2, 2] > 0.0)
    return carries and lies_in(item, other)


def _along(wanted: Array) -> Iterable[str]:
    """Return the directions that lead the way (2,), the best first; all where none is wanted more than another."""
    length = float(np.hypot(*wanted))
    if length < 1e-6:
        return list(DIRECTION_AXES)
    scores = {name: float(np.dot(axis, wanted)) / length for name, axis in DIRECTION_AXES.items()}
    return sorted((name for name in scores if scores[name] > _LEADS), key=lambda name: -scores[name])
