"""Goals planned for: random problems of blocks, bins, drawers and swaps, beside the plans of a reference planner.

    uv run --group reference benchmarks/achieve.py [--problems 300] [--seed 0] [--seconds 10] [--execute 0] [--typical 100] [--json]

A problem has 3 to 12 things in towers, bins, trays and drawers, and goals for some or all of them. Each plan is run over the
symbols by rules of their own; the reference knows the same problem in STRIPS and nothing of the contracts. `--execute` carries so
many of the solved ones out in MuJoCo and asks the task's judge. `--typical` times goals of one to three things among twenty.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from achieve_problems import FAMILIES, SPOTS, Place, Problem, Replay, drawn, objects_of, scene_of

from robosandbox.skills.catalogue import load_skills
from robosandbox.tasks.task import Task
from robosandbox.types import Plan, Refusal
from robosandbox.workcell.session import open_session
from robosandbox.world.facts import fact
from robosandbox.world.solve import solve

FEWEST, MOST = 3, 12
TWENTY = 20
# Weights of a small and a large block, kg, by half an edge in metres: as of the cubes in the bundled tasks.
MASS = 0.05


@dataclass(frozen=True)
class Row:
    """What came of a problem.

    Attributes:
        number: Its number.
        family: What it is of.
        things: How many things there are.
        goals: How many goals.
        calls: Of the plan; None where none was found.
        reference: Calls of the reference's plan; None where it found none, or was not asked.
        is_least: Whether the reference's is proved to be the shortest.
        wrong: What was wrong with the plan by the symbols' own rules, or why there is none.
        cpu_ms: CPU time of planning.
        judged: What the task's judge said of it being carried out; None where it was not.
        told: How the episode ended.
    """

    number: int
    family: str
    things: int
    goals: int
    calls: int | None
    reference: int | None
    is_least: bool
    wrong: str
    cpu_ms: float
    judged: bool | None = None
    told: str = ""


def problems(count: int, seed: int) -> list[Problem]:
    """Return random problems that take something to solve, of all families and sizes in turn."""
    found: list[Problem] = []
    draw = random.Random(seed)
    while len(found) < count:
        number = len(found)
        size = FEWEST + number // len(FAMILIES) % (MOST - FEWEST + 1)
        problem = drawn(FAMILIES[number % len(FAMILIES)], size, draw)
        if Replay(problem).run(()):
            found.append(problem)
    return found


def plan(problem: Problem, skills: Sequence[Any]) -> tuple[Plan | Refusal, float]:
    """Return the plan for a problem, and the CPU time that it took, ms."""
    scene = scene_of(objects_of(problem))
    begin = time.process_time()
    answer = solve(problem.goals, scene, skills)
    return answer, 1e3 * (time.process_time() - begin)


def row(number: int, problem: Problem, skills: Sequence[Any], seconds: float) -> Row:
    """Plan for a problem, by the search and by the reference where it has time."""
    answer, cpu = plan(problem, skills)
    reference, is_least = None, False
    if seconds:
        from achieve_reference import shortest

        reference, is_least = shortest(problem, seconds)
    calls = len(answer.steps) if isinstance(answer, Plan) else None
    wrong = Replay(problem).run(answer.steps) if isinstance(answer, Plan) else answer.message
    counts = (len(problem.things), len(problem.goals))
    return Row(number, problem.family, *counts, calls, reference, is_least, wrong, round(cpu, 2))


def task_of(problem: Problem) -> Task:
    """Return a problem as a task with its goal, a little over the places so that nothing starts inside another."""
    objects = [
        {
            "id": item.id,
            "kind": item.kind,
            "size": list(item.size),
            "pose": {"xyz": [*item.pose.xyz[:2], item.pose.xyz[2] + (0.001 if item.kind == "box" else 0.0)]},
            "mass": MASS if item.kind == "box" else 3.0 if item.kind == "drawer" else 0.5,
        }
        for item in objects_of(problem)
    ]
    goal = ", ".join(map(str, problem.goals))
    return Task.model_validate({"name": "goals", "goal": goal, "scene": {"objects": objects}})


def executed(one: Row, problem: Problem) -> Row:
    """Carry a problem out and return its row with the judge's word."""
    with open_session(task_of(problem)) as session:
        episode = session.run()
        verdict = session.judge()
    return replace(one, judged=bool(verdict.success), told=f"{episode.final_reason}: {episode.final_detail}"[:300])


def typical(count: int, seed: int, skills: Sequence[Any]) -> list[float]:
    """Return the CPU times, ms, of plans for goals about one to three of twenty things."""
    draw = random.Random(seed)
    times = []
    while len(times) < count:
        names = [f"block_{k}" for k in range(TWENTY - 2)]
        spots = draw.sample(range(len(SPOTS)), 12)
        start = {name: Place("at", spot=spot) for name, spot in zip(names, spots, strict=False)}
        for name in names[12:]:
            taken = {place.name for place in start.values()}
            start[name] = Place("on", draw.choice([other for other in start if other not in taken]))
        holders = {"bin_0": "bin", "drawer_0": "drawer"}
        goals = []
        for name in draw.sample(names, draw.randint(1, 3)):
            target = draw.choice([*holders, *(other for other in names if other != name)])
            goals.append(fact("inside" if target in holders else "on", name, target))
        problem = Problem("typical", dict.fromkeys(names, 0.015), holders, start, tuple(goals))
        answer, cpu = plan(problem, skills)
        if isinstance(answer, Plan) and answer.steps:
            times.append(cpu)
    return times


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of some rows."""
    solved = [one for one in rows if not one.wrong]
    both = [one for one in solved if one.reference]
    times = [one.cpu_ms for one in rows]
    judged = [one.judged for one in rows if one.judged is not None]
    ours, theirs = sum(one.calls or 0 for one in both), sum(one.reference or 0 for one in both)
    return {
        "problems": len(rows),
        "solved": len(solved),
        "reference_solved": sum(one.reference is not None for one in rows),
        "only_reference_solved": sum(one.reference is not None and bool(one.wrong) for one in rows),
        "reference_proved_least": sum(one.is_least for one in rows),
        "length_ratio": round(ours / theirs, 4) if theirs else None,
        "within_1.1": sum((one.calls or 0) <= 1.1 * (one.reference or 0) for one in both),
        "worst_ratio": round(max(((one.calls or 0) / (one.reference or 1) for one in both), default=0.0), 3),
        "cpu_median_ms": round(float(np.median(times)), 1),
        "cpu_p99_ms": round(float(np.percentile(times, 99)), 1),
        "executed": len(judged),
        "judged_successes": sum(judged),
    }


def main(argv: list[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--problems", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=10.0, help="for each search of the reference; 0 leaves it out")
    parser.add_argument("--execute", type=int, default=0)
    parser.add_argument("--typical", type=int, default=100)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args(argv)
    skills = load_skills()
    drawn_ones = problems(asked.problems, asked.seed)
    # What is built once, such as schemas, is not a plan's cost.
    if drawn_ones:
        plan(drawn_ones[0], skills)
    rows = []
    left = asked.execute
    for number, problem in enumerate(drawn_ones):
        one = row(number, problem, skills, asked.seconds)
        if left and not one.wrong:
            one = executed(one, problem)
            left -= 1
        rows.append(one)
        told = f"{one.calls} calls, reference {one.reference}{'' if one.is_least else '?'}, {one.cpu_ms:.0f} ms {one.wrong}"
        judged = "" if one.judged is None else f"; judged {one.judged}: {one.told}"
        print(f"{number} {one.family} {one.things} things: {told}{judged}", file=sys.stderr, flush=True)
    groups = {"all": rows} | {name: [one for one in rows if one.family == name] for name in FAMILIES}
    figures: dict[str, Any] = {name: summary(group) for name, group in groups.items() if group}
    times = typical(asked.typical, asked.seed, skills)
    if times:
        figures["typical"] = {
            "objects": TWENTY,
            "cpu_median_ms": round(float(np.median(times)), 1),
            "cpu_p99_ms": round(float(np.percentile(times, 99)), 1),
        }
    if asked.json:
        print(json.dumps({"figures": figures, "rows": [asdict(one) for one in rows]}, indent=1))
    else:
        for name, told in figures.items():
            print(name, told)
    return 0 if all(not one.wrong for one in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
