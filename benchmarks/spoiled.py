"""Plans of a model spoiled at random: what the check lets move of them. Nothing may.

    uv run benchmarks/spoiled.py [--plans 200] [--seed 0] [--mode plan act] [--json]

A scripted model over real HTTP answers with the grammar's plan for a bundled task, spoiled in one of five ways drawn from the seed: a
wrong id, an object of the wrong kind, steps in the wrong order, a drawer left closed, or a thing moved that the sentence forbids to
touch. Told why not, it refuses. Where the whole plan comes at once nothing may move; where the model acts, no call from the spoiled one
on may be begun.
"""

from __future__ import annotations

import argparse
import json
import logging
import math
import random
import sys
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

from support.listening import on_calls

from robosandbox.agent.planner import StubPlanner
from robosandbox.agent.planners import make_planner
from robosandbox.apps.conformance.openai_server import ScriptedServer, fails, plan as whole, refuse, tool_calls
from robosandbox.types import Plan, SkillCall, Truth
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.operators import Operator

TASKS = (
    "put_in_bin",
    "place_on_block",
    "place_beside",
    "put_in_drawer",
    "pour_beads",
    "sort_by_colour",
    "rearrange_swap",
)
# A thing that lies keeps its place to less, metres.
_STILL = 1e-3
Call = tuple[str, dict[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One spoiled plan.

    Attributes:
        task: Whose plan it was.
        how: In which way it was spoiled.
        mode: How the model worked.
        sent: The calls that it answered with.
        bad: Index of the first spoiled call.
        begun: How many calls were begun.
        moved: Whether something moved that should not have: a call from the spoiled one on, or anything without a call.
        told: What the model was told.
    """

    task: str
    how: str
    mode: str
    sent: tuple[str, ...]
    bad: int
    begun: int
    moved: bool
    told: str


@cache
def world(task: str) -> EmbeddedWorkcell:
    """Return a world that is started over for each plan that moves something."""
    return open_session(task, what_if=False)


@cache
def good(task: str) -> Plan:
    """Return the grammar's plan for a task."""
    cell = world(task)
    skills: list[Operator] = [*cell.skills]
    answer = StubPlanner(skills).plan(cell.task.prompt, cell.observe())
    assert isinstance(answer, Plan)
    return answer


def spoiled(task: str, draw: random.Random) -> tuple[str, str, list[SkillCall], int]:
    """Return in which way, the prompt, the calls, and the index of the first that cannot be right."""
    calls = list(good(task).steps)
    prompt = world(task).task.prompt
    ways = ["wrong id", "wrong kind", "wrong order", "forbidden"]
    if any(call.skill == "open_drawer" for call in calls):
        ways += ["closed drawer"] * 3
    how = draw.choice(ways)
    named = [
        (index, name)
        for index, call in enumerate(calls)
        for name, value in call.arguments.items()
        if isinstance(value, str) and any(item.id == value for item in world(task).observe().objects)
    ]
    match how:
        case "wrong id":
            index, name = draw.choice(named)
            calls[index] = _with(
                calls[index], name, draw.choice(["elephant", "Red Cube", "cube_99", "red_cub", "", "*held"])
            )
        case "wrong kind":
            index = draw.randrange(len(calls) + 1)
            thing = next(item.id for item in world(task).observe().objects if not item.shape.opens)
            calls.insert(index, SkillCall(skill="open_drawer", arguments={"drawer": thing}))
        case "wrong order":
            # A place before its pick, or a pour before it: the hand is empty then.
            index = next(index for index, call in enumerate(calls) if call.skill == "pick")
            calls[index], calls[index + 1] = calls[index + 1], calls[index]
        case "closed drawer":
            index = next(index for index, call in enumerate(calls) if call.skill == "place_in")
            calls = [call for call in calls if call.skill != "open_drawer"]
            index = next(index for index, call in enumerate(calls) if call.skill == "place_in")
        case _:
            index = next(index for index, call in enumerate(calls) if call.skill == "pick")
            thing = calls[index].arguments["object"]
            prompt = draw.choice([f"{prompt}, but do not touch {thing}", f"frobnicate it without touching {thing}"])
    return how, prompt, calls, index


def _with(call: SkillCall, name: str, value: str) -> SkillCall:
    return SkillCall(skill=call.skill, arguments={**call.arguments, name: value})


def try_out(task: str, mode: str, draw: random.Random) -> Row:
    """Have a model answer with a spoiled plan and return what came of it."""
    how, prompt, calls, bad = spoiled(task, draw)
    cell = world(task)
    begun: list[SkillCall] = []
    no = refuse("impossible", "Then I will not.")
    pairs = [(call.skill, dict(call.arguments)) for call in calls]
    answers = (
        [whole(*pairs)]
        if mode == "plan"
        else [tool_calls((name, json.dumps(given))) for name, given in pairs[: bad + 1]]
    )
    with ScriptedServer(fails(400, "no schema"), *answers, rest=no) as server:
        told = {"model": "spoiler", "base_url": server.url, "mode": mode}
        skills: list[Operator] = [*cell.skills]
        cell.agent.planner = make_planner("openai", skills, told)
        leave = on_calls(cell.ctx.events, begun.append)
        before = cell.simulation.truth()
        cell.run(prompt)
        after = cell.simulation.truth()
        leave()
        said = json.dumps(server.requests[-1]["messages"][-1]["content"])
    if begun:
        cell.reset()
    return Row(
        task=task,
        how=how,
        mode=mode,
        sent=tuple(map(str, calls)),
        bad=bad,
        begun=len(begun),
        moved=len(begun) > (bad if mode == "act" else 0) or (not begun and _moved(before, after)),
        told=said[:300],
    )


def _moved(before: Truth, after: Truth) -> bool:
    arm = max(float(abs(after.arms[name].q - arm.q).max()) for name, arm in before.arms.items())
    return arm > _STILL or any(
        math.dist(after.objects[name].pose.xyz, item.pose.xyz) > _STILL for name, item in before.objects.items()
    )


def main() -> int:
    """Print what moved, by the way in which plans were spoiled."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plans", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mode", nargs="+", default=["plan"], choices=("plan", "act"))
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    draw = random.Random(arguments.seed)
    rows = [try_out(draw.choice(TASKS), mode, draw) for mode in arguments.mode for _ in range(arguments.plans)]
    sums: dict[str, Any] = {}
    for row in rows:
        of = sums.setdefault(f"{row.mode}: {row.how}", {"plans": 0, "moved": 0})
        of["plans"] += 1
        of["moved"] += row.moved
    if arguments.json:
        print(json.dumps({"sums": sums, "rows": [asdict(row) for row in rows]}, indent=1))
    else:
        print("\n".join(f"{name:<24} {of['plans']:>4} plans, {of['moved']} moved" for name, of in sorted(sums.items())))
        for row in rows:
            if row.moved:
                print(row, file=sys.stderr)
    print(f"{sum(row.moved for row in rows)} of {len(rows)} moved", file=sys.stderr)
    return 1 if any(row.moved for row in rows) else 0


if __name__ == "__main__":
    logging.disable(logging.WARNING)
    raise SystemExit(main())
