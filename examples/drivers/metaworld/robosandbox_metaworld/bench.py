"""Episodes of MetaWorld's tasks under MetaWorld's own judge.

    uv run --project examples/drivers/metaworld bench_metaworld.py drawer-open-v3 --seeds 0-9 --json rows.json

TASK is a task's name, or `all`.
"""

from __future__ import annotations

import argparse
import ast
import json
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from robosandbox.errors import RoboSandboxError
from robosandbox.sim.scene_file import read_scene_file
from robosandbox.workcell.session import open_session
from robosandbox.workcell.workcell import Workcell
from robosandbox_metaworld.environment import MetaWorldEnvironment, MetaWorldProcess
from robosandbox_metaworld.tasks import TASKS

# Simulated seconds after which an episode ends: far more than MetaWorld's own limit of 500 steps, which is judged apart.
TIMEOUT = 60.0
# Metres by which `{over}` is over a goal: what MetaWorld's fingers reach below their TCP, and what they hold.
OVER = 0.07
# Metres before a goal in a net at which a hand from above still pushes; MetaWorld asks for 70 mm.
NEAR = 0.045


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One episode.

    Attributes:
        suite: "metaworld".
        task: Name of the task.
        seed: Number of its start.
        goal: Goals and calls that were given.
        claimed: Whether all of it was done, as the skills and the agent say.
        judged_ever: MetaWorld's verdict at any step, as its own evaluations take it but for their limit.
        judged_in_time: At any of the first 500 steps, as they do.
        judged: At the last step.
        simulated_s: Simulated seconds.
        wall_s: Wall seconds of the episode; opening the world takes some more.
        reason: Why it ended, in words.
    """

    suite: str = "metaworld"
    task: str
    seed: int
    goal: str
    claimed: bool
    judged_ever: bool
    judged_in_time: bool
    judged: bool
    simulated_s: float
    wall_s: float
    reason: str


def play(process: MetaWorldProcess, task: str, seed: int) -> Row:
    """Return what came of one episode; a failure to open or to begin is a row as well."""
    begun, simulated, claimed, reason = time.monotonic(), 0.0, False, ""
    with MetaWorldEnvironment(process, seed) as environment:
        x, y, z = (round(float(value), 4) for value in environment.goal)
        told = {"x": x, "y": y, "z": z, "over": round(z + OVER, 4), "before_y": y - NEAR, "beyond_x": x + NEAR}
        lines = [line.format(**told) for line in TASKS[task]]
        try:
            with open_session(
                environment.scene, driver="metaworld", driver_options={"environment": environment}, dialogue=False
            ) as cell:
                begun = time.monotonic()
                try:
                    for line in lines:
                        claimed, reason = _done(cell, line)
                        if not claimed:
                            break
                finally:
                    simulated = cell.elapsed()[0]
        except RoboSandboxError as error:
            claimed, reason = False, f"{type(error).__name__}: {error}"
        return Row(
            task=task,
            seed=seed,
            goal="; ".join(lines),
            claimed=claimed,
            judged_ever=environment.judged_once,
            judged_in_time=environment.judged_in_time,
            judged=environment.judged,
            simulated_s=round(simulated, 2),
            wall_s=round(time.monotonic() - begun, 2),
            reason=reason,
        )


def _done(cell: Workcell[Any], line: str) -> tuple[bool, str]:
    """Bring a goal about, or make a call; tell whether it is done, and why not."""
    if "=" not in line:
        episode = cell.achieve(line, timeout=TIMEOUT)
        return episode.success, f"{episode.final_reason}: {episode.final_detail}"
    name, _, rest = line.partition("(")
    arguments = {key.strip(): _value(text) for key, _, text in (one.partition("=") for one in rest[:-1].split(","))}
    cell.do(name, timeout=TIMEOUT, **arguments)
    return True, "done"


def _value(text: str) -> object:
    """Return a number as one, and anything else as it is."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text


def scene_of(task: str) -> dict[str, object]:
    """Return what the importer makes of a task's scene at start 0."""
    row: dict[str, object] = {"task": task}
    with MetaWorldProcess(task) as process, MetaWorldEnvironment(process, 0) as environment:
        try:
            assert environment.scene.world is not None
            file = read_scene_file(environment.scene.world)
            row["objects"] = {item.id: item.kind for item in file.objects}
            row["table"] = f"{file.table.body} at {file.table.height:.3f} m"
        except RoboSandboxError as error:
            row["error"] = f"{type(error).__name__}: {error}"
    return row


def _numbers(text: str) -> list[int]:
    """Return the numbers of "0-4" or "0,3,7"."""
    found: list[int] = []
    for piece in text.split(","):
        first, _, last = piece.partition("-")
        found += range(int(first), int(last or first) + 1)
    return found


def _summary(rows: list[Row]) -> Iterator[str]:
    tasks: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        tasks[row.task].append(row)
    yield "| task | episodes | claimed | judged at the end | judged ever | in 500 steps | claimed and not judged | wall s |"
    yield "|---|---|---|---|---|---|---|---|"
    for name, its in (*tasks.items(), ("all", rows)):
        false = sum(row.claimed and not row.judged_ever for row in its)
        fields = ("claimed", "judged", "judged_ever", "judged_in_time")
        counts = [sum(getattr(row, field) for row in its) for field in fields]
        yield f"| {name} | {len(its)} | {' | '.join(map(str, counts))} | {false} | {sum(r.wall_s for r in its):.0f} |"


def main() -> None:
    """Run the bench."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tasks", nargs="+", metavar="TASK", help="a task's name, or all")
    parser.add_argument("--seeds", type=_numbers, default=[0], help="starts: 0-9, or 0,2 (default: 0)")
    parser.add_argument("--scenes", action="store_true", help="only tell what the importer makes of each scene")
    parser.add_argument("--json", type=Path, help="where rows go")
    options = parser.parse_args()
    tasks = [task for name in options.tasks for task in (TASKS if name == "all" else (name,))]
    if unknown := [task for task in tasks if task not in TASKS]:
        parser.error(f"{', '.join(unknown)}: there is {', '.join(TASKS)}, and all")
    if options.scenes:
        for task in tasks:
            print(json.dumps(scene_of(task)), flush=True)
        return
    rows: list[Row] = []
    for task in tasks:
        with MetaWorldProcess(task) as process:
            for seed in options.seeds:
                rows.append(row := play(process, task, seed))
                print(_said(row), flush=True)
                if options.json is not None:
                    options.json.write_text(json.dumps([asdict(one) for one in rows], indent=1) + "\n")
    print("\n".join(_summary(rows)))


def _said(row: Row) -> str:
    verdict = "judged" if row.judged else "was judged" if row.judged_ever else "not judged"
    claim = "claimed" if row.claimed else "not claimed"
    return f"{row.task} {row.seed}: {claim}, {verdict}, {row.simulated_s:.1f} s, {row.wall_s:.1f} s wall; {row.goal}: {row.reason}"
