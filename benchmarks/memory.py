"""Growth of a long-lived process's memory with the calls that it answers, a row a call.

    uv run benchmarks/memory.py [--calls 300] [--only "service load" "mcp simulate"] [--json]
    uv run benchmarks/memory.py --minutes 20 [--only "service all in turn"]

With `--minutes` each row calls for so long and prints what it has each minute. Each row has a process of its own: its resident set after the first calls and after the last (read in /proc: Linux only).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from support.processes import McpProcess, SimProcess

from robosandbox.errors import SkillError
from robosandbox.types import SkillCall
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.robot import RemoteRobot

# Calls before the first reading: each task, skill and sentence of a row comes up in them.
_FIRST_CALLS = 10
_TASKS = ("stack_three", "put_in_bin", "pick_from_three")
_PICK = SkillCall(skill="pick", arguments={"object": "red_cube"})
_HOME = SkillCall(skill="home")

# A call of a process, by its number.
Call = Callable[[int], object]
# The service's, by name.
_SERVICE: Mapping[str, Callable[[RemoteRobot, int], object]] = {
    "load": lambda robot, number: robot.load(_TASKS[number % 3]),
    "reset": lambda robot, number: robot.reset(seed=number % 20),
    "simulate": lambda robot, _: robot.order("simulate", steps=[_PICK.model_dump(mode="json")]),
    "look": lambda robot, _: robot.look(),
    "skill": lambda robot, number: _skill(robot, (_PICK, _HOME)[number % 2]),
    "picture": lambda robot, _: robot.picture(robot.cameras[0]),
    "checkpoint": lambda robot, _: robot.reset(checkpoint=robot.checkpoint()),
    "failure with repairs": lambda robot, _: _failure(robot),
    "picture of each load": lambda robot, number: (robot.load(_TASKS[number % 3]), robot.picture(robot.cameras[0])),
    "all in turn": lambda robot, number: _SERVICE[list(_SERVICE)[number % 7]](robot, number),
}
# The MCP server's, by name: a tool and its arguments.
_MCP: Mapping[str, Callable[[int], tuple[str, Mapping[str, Any]]]] = {
    "load": lambda number: ("load", {"task": _TASKS[number % 3]}),
    "reset": lambda number: ("reset", {"seed": number % 20}),
    "simulate": lambda _: ("simulate", {"steps": [_PICK.model_dump()]}),
    "look": lambda _: ("look", {}),
    "skill": lambda number: (("pick", {"object": "red_cube"}), ("home", {}))[number % 2],
    "run": lambda number: ("run", {"prompt": ("pick up the red cube", "go home")[number % 2]}),
    "judge": lambda _: ("judge", {}),
    "picture": lambda _: ("look", {"camera": "scene"}),
}


def _skill(robot: RemoteRobot, call: SkillCall) -> None:
    robot.send(call.skill, call.arguments).wait(60.0)
    if call == _HOME:
        robot.reset(seed=0)


def _failure(robot: RemoteRobot) -> None:
    with suppress(SkillError):
        robot.send("place_on", {"target": "blue_cube"}).wait(60.0)


@contextmanager
def service(name: str) -> Iterator[tuple[int, Call]]:
    """Yield a sim's process id and a call of it."""
    with SimProcess("--task", _TASKS[-1], "--pace", "fast") as sim, connect(sim.endpoint) as client:
        robot = client.robot()
        yield sim.pid, lambda number: _SERVICE[name](robot, number)


@contextmanager
def mcp(name: str) -> Iterator[tuple[int, Call]]:
    """Yield the process id of an MCP server on stdin and stdout, and a call of it."""
    with McpProcess("--task", _TASKS[-1]) as server:

        def call(number: int) -> None:
            tool, arguments = _MCP[name](number)
            answer = server.call(number + 1, tool, **arguments)
            if "result" not in answer or answer["result"].get("isError"):
                raise SystemExit(f"mcp {name}: {json.dumps(answer)[:300]}")
            if tool == "home" or arguments.get("prompt") == "go home":
                server.call(number + 1, "reset", seed=0)

        yield server.process.pid, call


def resident_mb(pid: int) -> float:
    """Return a process's resident set, MB."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS")) / 1024.0


def measured(row: str, calls: int) -> dict[str, Any]:
    """Return how a process's memory grows over so many calls of a row, as "mcp load"."""
    face, _, name = row.partition(" ")
    with (service if face == "service" else mcp)(name) as (pid, call):
        for number in range(_FIRST_CALLS):
            call(number)
        before = resident_mb(pid)
        for number in range(_FIRST_CALLS, calls):
            call(number)
        after = resident_mb(pid)
    return {
        "call": row,
        "calls": calls,
        "first_mb": round(before),
        "last_mb": round(after),
        "growth_mb": round(after - before),
    }


def soak(row: str, minutes: int) -> None:
    """Call for so many minutes, and print the resident set at the end of each."""
    face, _, name = row.partition(" ")
    with (service if face == "service" else mcp)(name) as (pid, call):
        number, began = 0, time.monotonic()
        for minute in range(1, minutes + 1):
            while time.monotonic() - began < 60.0 * minute:
                call(number)
                number += 1
            print(f"{row}: {minute:3} min {number:6} calls {resident_mb(pid):6.0f} MB", flush=True)


def main() -> None:
    rows = [f"service {name}" for name in _SERVICE] + [f"mcp {name}" for name in _MCP]
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--calls", type=int, default=300)
    parser.add_argument("--only", nargs="+", choices=rows, default=rows)
    parser.add_argument("--minutes", type=int, help="call for so long and print each minute")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.minutes:
        for row in options.only:
            soak(row, options.minutes)
        return
    found = []
    for row in options.only:
        found.append(measured(row, options.calls))
        if not options.json:
            print(
                "{call:20} {calls:4} calls: {first_mb:5} MB, {last_mb:5} MB, {growth_mb:+5} MB".format(**found[-1]),
                flush=True,
            )
    if options.json:
        print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
