"""How well the verifier tells plans that can be carried out from those that cannot.

    uv run benchmarks/plans.py [--plans FILE...] [--json]

A file lists plans over the bundled tasks, as `tests/plans/unseen.yaml` does: `impossible` ones with the step that fails and a
pattern of its cause, and `possible` ones. Right is a refusal whose first problem is at that step and says that cause; and that
nothing is said of a possible plan. Exit 1 where a plan is judged wrong.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from robosandbox.skills.primitives.abilities import RobotAbilities
from robosandbox.types import Plan, SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.verifier import Verification, verify

UNSEEN = tuple(sorted((Path(__file__).parents[1] / "tests" / "plans").glob("*.yaml")))


@cache
def world(task: str) -> EmbeddedWorkcell:
    """Return a world that nobody moves."""
    return open_session(task, what_if=False)


def parse(text: str) -> Plan:
    """Return the plan that "pick(object=can); place_at(x=0.1, y=0.2)" stands for."""
    steps = []
    for call in text.split(";"):
        name, _, inner = call.strip().rstrip(")").partition("(")
        pairs = (part.partition("=") for part in inner.split(",") if part.strip())
        steps.append(SkillCall(skill=name, arguments={key.strip(): yaml.safe_load(value) for key, _, value in pairs}))
    return Plan(steps=tuple(steps))


def check(task: str, text: str) -> Verification:
    """Return what the verifier says of a plan at a task's start."""
    cell = world(task)
    robot = RobotAbilities(cell.ctx, cell.task.limits)
    return verify(parse(text), cell.observe(), cell.skills, robot=robot)


def judge(row: dict[str, Any]) -> tuple[bool, str]:
    """Return whether the verifier is right about a row, and what it said."""
    problems = check(row["task"], row["plan"]).problems
    if "cause" not in row:
        return not problems, "; ".join(map(str, problems))
    if not problems:
        return False, "nothing"
    first = problems[0]
    said = json.dumps(first.record())
    return first.step == row["step"] and bool(re.search(row["cause"], said)), said


def main() -> int:
    """Judge every plan; print those that are judged wrong and the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--plans", nargs="+", type=Path, default=UNSEEN, metavar="FILE", help="sets of plans")
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    given = parser.parse_args()
    wrong: list[dict[str, Any]] = []
    counts = {"impossible": [0, 0], "possible": [0, 0]}
    for path in given.plans:
        for kind, rows in yaml.safe_load(path.read_text(encoding="utf-8")).items():
            for row in rows:
                right, said = judge(row)
                counts[kind][0] += right
                counts[kind][1] += 1
                if not right:
                    wrong.append({**row, "said": said})
    figures = {kind: f"{right}/{count}" for kind, (right, count) in counts.items()}
    if given.json:
        print(json.dumps({"right": figures, "wrong": wrong}, indent=2))
    else:
        for row in wrong:
            print(f"wrong: {row['task']}: {row['plan']}: said {row['said']}")
        print(*(f"{kind} {figure}" for kind, figure in figures.items()), sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
