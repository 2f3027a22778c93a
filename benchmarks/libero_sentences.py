"""LIBERO's sentences without LIBERO: for how many does the plan bring about the goal of the task, and for how many another.

    uv run benchmarks/libero_sentences.py [--show wrong|refused|right] [--suite NAME]

Sentences, goals and scenes are the facts of `tests/data/libero_sentences.json`, which `examples/drivers/libero` writes; things are
boxes there. A plan is right that brings about each relation of the goal and moves nothing else; wrong that does anything else;
short what does a part of it,
as of a goal that has more than its sentence; anything but a plan is refused. Sides are those of a person who faces the robot, as LIBERO's are.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from robosandbox.agent.planner import StubPlanner
from robosandbox.shapes.body import PartJoint, Piece
from robosandbox.shapes.compound import FILE_KINDS, Geometry
from robosandbox.shapes.hull import BoxHull
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import SIDE_AXES, DetectedObject, ObservedScene, Plan, Pose, Refusal
from robosandbox.world.contracts import find
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.operators import bind
from robosandbox.world.predicate import View, predicates
from robosandbox.world.relations import BESIDE_GAP, centre, gap

FACTS = Path(__file__).parent.parent / "tests" / "data" / "libero_sentences.json"
# Thickness of walls and boards where the facts leave them none, metres.
_BOARD = 0.002
# Relations that say where a thing is: the last of each thing counts.
_PLACES = ("on", "inside", "beside", "at")
_PARTS = ("open", "closed", "turned_to")


@dataclass(frozen=True, slots=True)
class Case:
    """A sentence, its scene, and the relations of its goal."""

    suite: str
    task: int
    sentence: str
    scene: ObservedScene
    goal: tuple[Fact, ...]


@cache
def cases() -> tuple[Case, ...]:
    """Return the sentences of all suites."""
    facts = json.loads(FACTS.read_text(encoding="utf-8"))
    scenes = [_scene(scene) for scene in facts["scenes"]]
    return tuple(
        Case(
            one["suite"], one["task"], one["sentence"], scenes[one["scene"]], tuple(fact(*goal) for goal in one["goal"])
        )
        for one in facts["tasks"]
    )


def _scene(told: dict[str, Any]) -> ObservedScene:
    height, x0, x1, y0, y1 = (1e-3 * value for value in told["table"])
    x, y = _metres(told["base"])
    near, far = _metres(told["reach"])
    return ObservedScene(
        time=0.0,
        objects=tuple(_object(name, item) for name, item in told["objects"].items()),
        table_height=height,
        table_area=((x0, x1), (y0, y1)),
        base_xy=(x, y),
        reach=(near, far),
        hands={"hand": None},
    )


def _object(name: str, told: dict[str, Any]) -> DetectedObject:
    half_yaw = np.radians(told.get("yaw", 0)) / 2.0
    quat = told.get("quat") or (0.0, 0.0, float(np.sin(half_yaw)), float(np.cos(half_yaw)))
    geometry, opening = None, None
    size = tuple(_metres(told.get("size") or told["half"]))
    if told["kind"] in FILE_KINDS:
        joint = None
        if "joint" in told:
            kind, *numbers = told["joint"]
            low, high, opening = told["range"]
            joint = PartJoint(
                kind=kind,
                axis=tuple(numbers[:3]),
                anchor=tuple(_metres(numbers[3:])),
                low=low,
                high=high,
                stiffness=0.0,
            )
        geometry = _kept(Geometry(tuple(_boxes(told)), told["kind"], joint))
    return DetectedObject(
        id=name,
        kind=told["kind"],
        size=size,
        colour=told["colour"],
        rgba=(0.5, 0.5, 0.5, 1.0),
        pose=Pose(xyz=tuple(_metres(told["at"])), quat_xyzw=tuple(quat)),
        opening=opening,
        geometry=geometry,
    )


@cache
def _kept(geometry: Geometry) -> Geometry:
    """Return the first that is equal: one bowl stands in many scenes, and what is worked out of it is kept with it."""
    return geometry


def _boxes(told: dict[str, Any]) -> Iterator[Piece]:
    """Yield the box of an object, or the floor and the walls around its room, or a cupboard's boards."""
    middle, half = np.array(_metres(told["middle"])), np.maximum(_metres(told["half"]), _BOARD)
    low, high = middle - half, middle + half
    if "room" not in told:
        yield _box(low, high)
        return
    x, y, wide, deep, floor, rim = _metres(told["room"])
    inner_low = np.maximum(low[:2] + _BOARD, (x - wide, y - deep))
    inner_high = np.minimum(high[:2] - _BOARD, (x + wide, y + deep))
    yield _box(low, np.array([*high[:2], max(floor, low[2] + _BOARD)]))
    top = high[2] if told["kind"] == "cupboard" else rim
    if told["kind"] == "cupboard":
        yield _box(np.array([*low[:2], min(rim, high[2] - _BOARD)]), high)
    for axis in (0, 1):
        for outer, inner in ((low[axis], inner_low[axis]), (high[axis], inner_high[axis])):
            # A cupboard is open towards the robot.
            if told["kind"] == "cupboard" and axis == 0 and outer == low[0]:
                continue
            begin, end = low.copy(), np.array([*high[:2], top])
            begin[axis], end[axis] = min(outer, inner), max(outer, inner)
            yield _box(begin, end)


def _box(low: np.ndarray, high: np.ndarray) -> Piece:
    return Piece(
        hull=BoxHull(tuple(float(v) for v in (high - low) / 2.0)), centre=tuple(float(v) for v in (low + high) / 2.0)
    )


def _metres(values: Sequence[float]) -> list[float]:
    return [1e-3 * value for value in values]


@dataclass(frozen=True, slots=True)
class Verdict:
    """Outcome of a sentence: right, wrong, short or refused, and the calls or the refusal."""

    case: Case
    verdict: str
    answer: str


def judged(case: Case, planner: StubPlanner) -> Verdict:
    """Return what a planner makes of a sentence."""
    answer = planner.plan(case.sentence, case.scene)
    if isinstance(answer, Refusal):
        return Verdict(case, "refused", answer.message)
    if answer.answer and not answer.steps:
        return Verdict(case, "refused", answer.answer)
    brought, parts = _brought_about(answer)
    brought = [_beside(one, case) for one in brought]
    # What holds from the start is not asked for, and some goals have it all the same.
    now = View.of(case.scene)
    asked = {_loosened(one, case.scene) for one in case.goal}
    wanted = {_loosened(one, case.scene) for one in case.goal if not find(one, now).holds}
    got = {_loosened(one, case.scene) for one in (*brought, *parts)}
    into = {str(one.arguments[-1]) for one in case.goal if one.relation in ("on", "inside")}
    # What a thing goes into may be opened for it.
    extra = {one for one in got - asked if not (one[0] == "open" and one[1] in into)}
    verdict = "wrong" if extra else "right" if wanted <= got else "short"
    return Verdict(case, verdict, "; ".join(map(str, answer.steps)))


def _brought_about(plan: Plan) -> tuple[list[Fact], list[Fact]]:
    """Return where a plan's calls leave things, and how they leave parts."""
    skills = {skill.name: skill for skill in load_skills()}
    places: dict[str, Fact] = {}
    parts: dict[str, Fact] = {}
    held = ""
    for call in plan.steps:
        for gift in bind(call, skills).contract.gives:
            name = held if gift.arguments[:1] == ("*held",) else str(gift.arguments[0]) if gift.arguments else ""
            gift = Fact(gift.relation, (name, *gift.arguments[1:])) if gift.arguments else gift
            if gift.relation == "holding":
                held = name
                places.pop(name, None)
            elif gift.relation in _PLACES and not (gift.relation == "on" and gift.arguments[1:] == (TABLE,)):
                places[name] = gift
            elif gift.relation in _PARTS:
                parts[name] = gift
    return list(places.values()), list(parts.values())


def _beside(one: Fact, case: Case) -> Fact:
    """Return the side of the goal that a thing stands on which was brought to a point, where it does; else the fact as it is."""
    effect = predicates()["at"].effect
    if one.relation != "at" or effect is None:
        return one
    there = effect(case.scene, *one.arguments).find(str(one.arguments[0]))
    for goal in case.goal:
        target = case.scene.find(str(goal.arguments[1])) if goal.relation == "beside" else None
        if there is None or target is None or goal.arguments[0] != one.arguments[0]:
            continue
        away = (centre(there) - centre(target))[:2]
        side = max(SIDE_AXES, key=lambda name: float(away @ SIDE_AXES[name]))
        if side == goal.arguments[2] and gap(there, target) < BESIDE_GAP:
            return goal
    return one


def _loosened(one: Fact, scene: ObservedScene) -> tuple[object, ...]:
    """Return a relation so that two which leave the same world are the same: a thing on a plate is in it."""
    if one.relation == "turned_to":
        return (one.relation, one.arguments[0], round(float(one.arguments[1])))
    base = scene.find(str(one.arguments[-1]))
    either = one.relation in ("on", "inside") and base is not None and not base.is_fixed
    return ("in" if either else one.relation, *one.arguments)


def run(suite: str = "") -> list[Verdict]:
    """Return what is made of all sentences, or of a suite's."""
    planner = StubPlanner(load_skills(), frame="viewer")
    return [judged(case, planner) for case in cases() if case.suite.startswith(suite)]


def main() -> None:
    """Print a table by suite."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--show", choices=("wrong", "short", "refused", "right"), nargs="*", default=[], help="print these"
    )
    parser.add_argument("--suite", default="", help="beginning of a suite's name")
    options = parser.parse_args()
    begun = time.perf_counter()
    found = run(options.suite)
    for one in found:
        if one.verdict in options.show:
            print(f"{one.verdict} {one.case.suite} {one.case.task}: {one.case.sentence}\n    {one.answer}")
            if one.verdict != "right":
                print(f"    wanted: {', '.join(map(str, one.case.goal))}")
    by_suite: dict[str, Counter[str]] = defaultdict(Counter)
    for one in found:
        for name in (one.case.suite, "PRO" if one.case.suite.count("_") > 1 else "LIBERO", "all"):
            by_suite[name][one.verdict] += 1
    print("| suite | sentences | right | wrong | short | refused |\n|---|---|---|---|---|---|")
    for name, counts in by_suite.items():
        told = " | ".join(str(counts[verdict]) for verdict in ("right", "wrong", "short", "refused"))
        print(f"| {name} | {counts.total()} | {told} |")
    print(f"{time.perf_counter() - begun:.1f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
