"""Sentences over the bundled tasks, carried out in simulation and judged on its state: conditions, counts, loops.

    uv run benchmarks/executed.py [--sentences FILE] [--tasks NAME ...] [--json]

A file holds sentences by task, each with what is true afterwards, checks of `robosandbox.tasks` and two of its own:

    inside(a/b, bin)      each of a and b
    times(tap, a, 2)      `tap` was called on `a` exactly twice
    nothing()             nothing was called

`;` joins checks, `|` separates outcomes of equal right. What no check is about has to stay where it was, within 10 mm, and
nothing is tapped that is not said to be. Exit 1 where fewer than nine tenths come out right.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from pydantic import TypeAdapter

from robosandbox.agent.episode import Episode
from robosandbox.apps.bench.interval import wilson_interval
from robosandbox.tasks.evaluate import evaluate
from robosandbox.tasks.loader import find_task
from robosandbox.tasks.success import Criterion
from robosandbox.tasks.task import Task
from robosandbox.workcell.session import open_session
from robosandbox.workcell.workcell import Workcell

CONDITIONS = Path(__file__).parents[1] / "tests" / "executed" / "conditions.yaml"
# What each check's arguments are called, and what else it needs; thresholds are those of the bundled tasks.
FIELDS: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "inside": (("object", "target"), {}),
    "on": (("object", "target"), {}),
    "lifted": (("object",), {}),
    "displaced": (("object", "direction", "min_mm"), {}),
    "opened": (("object",), {"min_mm": 80.0}),
    "closed": (("object",), {}),
    "poured": (("object", "target"), {"min_fraction": 0.9}),
    "at_home": ((), {}),
}
# The share of sentences that have to come out right, by the issue that asked for conditions.
GOOD = 0.9


def _checks(outcome: str) -> Iterator[tuple[str, list[str]]]:
    """Yield name and arguments of each check; `a/b` in the first object is a check of each."""
    for part in outcome.split(";"):
        match = re.fullmatch(r"(\w+)\((.*)\)", part.strip())
        if match is None:
            raise SystemExit(f"{part.strip()!r} is no check; write name(argument, ...)")
        arguments = [value.strip() for value in match[2].split(",") if value.strip()]
        place = 1 if match[1] == "times" else 0
        if not arguments:
            yield match[1], []
        for name in arguments[place].split("/") if arguments else ():
            yield match[1], [*arguments[:place], name, *arguments[place + 1 :]]


def _criterion(outcome: str, task: Task) -> Any:
    """Return what the state has to fulfil: the checks, and that all else stayed where it was."""
    kinds = {item.id: item.kind for item in task.scene.objects}
    made, moved = [], set()
    for name, arguments in _checks(outcome):
        if name in FIELDS:
            names, rest = FIELDS[name]
            made.append({"kind": name, **dict(zip(names, arguments, strict=True)), **rest})
            moved |= {value for value in arguments[:1] + [a for a in arguments if kinds.get(a) == "drawer"]}
        elif name == "times" and arguments[0] == "tap":
            made.append({"kind": "tapped", "object": arguments[1]})
        elif name == "times":
            moved.add(arguments[1])
    moved |= {item.id for item in task.scene.objects if item.inside in moved}
    made.append({"kind": "undisturbed", "except": sorted(moved)})
    return TypeAdapter(Criterion).validate_python({"kind": "all", "checks": made})


def _called(outcome: str, episode: Episode) -> str:
    """Say which calls were made too often or too rarely; nothing where none were."""
    calls = [(step.call.skill, str(next(iter(step.call.arguments.values()), ""))) for step in episode.steps]
    wanted = {(a[0], a[1]): int(a[2]) for name, a in _checks(outcome) if name == "times"}
    if outcome.strip() == "nothing()" and calls:
        return f"called {calls[0][0]}"
    for call in {*wanted, *(call for call in calls if call[0] == "tap")}:
        if calls.count(call) != wanted.get(call, 0):
            return f"{call[0]}({call[1]}) {calls.count(call)} times, not {wanted.get(call, 0)}"
    return ""


def judge(outcomes: str, episode: Episode, cell: Workcell) -> str:
    """Return why none of the outcomes came about; nothing where one did."""
    reasons = []
    for outcome in outcomes.split("|"):
        reason = _called(outcome, episode)
        if not reason:
            verdict = evaluate(_criterion(outcome, cell.task), cell.start, cell.truth, cell.wait)
            if verdict.success:
                return ""
            reason = "the state: " + ", ".join(f"{key} {value:.3g}" for key, value in verdict.detail.items())
        reasons.append(reason)
    said = episode.refusal.message if episode.refusal else episode.final_detail
    return f"{reasons[0]} [{episode.final_reason.value}] {said}"


def _feeling(name: str) -> Task:
    """Return a bundled task whose world measures a touch of every object; worlds measure what their criterion asks for."""
    task = find_task(name)
    solid = [item.id for item in task.scene.objects if item.inside is None]
    checks = [{"kind": "tapped", "object": item} for item in solid]
    return task.model_copy(
        update={"success": TypeAdapter(Criterion).validate_python({"kind": "any", "checks": checks})}
    )


def rows(sentences: dict[str, dict[str, str]]) -> Iterator[dict[str, Any]]:
    """Carry out each sentence from the start of its task, and yield what came of it."""
    for task, expected in sentences.items():
        with open_session(_feeling(task)) as cell:
            for sentence, outcomes in expected.items():
                cell.reset(0)
                try:
                    episode = cell.run(sentence)
                except Exception as fault:
                    # A fault of the planner is a failed row; the others are still worth knowing.
                    calls, why = [], f"{type(fault).__name__}: {fault}"
                else:
                    calls, why = [str(step.call) for step in episode.steps], judge(outcomes, episode, cell)
                told = {"task": task, "sentence": sentence, "calls": calls, "why": why}
                yield {**told, "right": not why, "moved": bool(calls)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sentences", type=Path, default=CONDITIONS, help="another file of sentences by task")
    parser.add_argument("--tasks", nargs="*", help="of these tasks alone")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    sentences = yaml.safe_load(options.sentences.read_text(encoding="utf-8"))
    chosen = {task: told for task, told in sentences.items() if not options.tasks or task in options.tasks}
    found = []
    for row in rows(chosen):
        found.append(row)
        if not options.json and not row["right"]:
            print(f"{row['task']}: {row['sentence']!r}\n    {row['why']}\n    {'; '.join(row['calls'])}", flush=True)
    right, wrong = sum(row["right"] for row in found), sum(row["moved"] and not row["right"] for row in found)
    low, high = wilson_interval(right, len(found))
    report = {"sentences": len(found), "right": right, "right_95": (low, high), "wrong_motion": wrong}
    if options.json:
        json.dump({**report, "rows": found}, sys.stdout, indent=2)
        print()
    else:
        print(
            f"{right} of {len(found)} right [{100 * low:.1f}, {100 * high:.1f}] %; {wrong} moved something and came out wrong"
        )
    return 0 if right >= GOOD * len(found) else 1


if __name__ == "__main__":
    sys.exit(main())
