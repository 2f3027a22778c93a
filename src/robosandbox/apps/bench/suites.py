"""Benches of other people's suites: tasks said as lines of goals and calls, a row an episode, a table."""

from __future__ import annotations

import argparse
import ast
import json
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from robosandbox.errors import RoboSandboxError
from robosandbox.sim.scene_file import read_scene_file
from robosandbox.types import Scene
from robosandbox.workcell.workcell import Workcell


@dataclass(frozen=True, slots=True, kw_only=True)
class SuiteRow:
    """One episode.

    Attributes:
        suite: Name of the suite.
        task: Name of the task.
        seed: Number of its start.
        goal: Goals and calls that were given.
        claimed: Whether all of it was done, as the skills and the agent say.
        judged_ever: The suite's verdict at any step, as its own evaluations take it but for their limit.
        judged_in_time: At any step within the suite's own limit, as they do.
        judged: At the last step.
        simulated_s: Simulated seconds.
        wall_s: Wall seconds of the episode; opening the world takes some more.
        reason: Why it ended, in words.
    """

    suite: str
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


def perform(cell: Workcell[Any], lines: Iterable[str], timeout: float) -> tuple[bool, str]:
    """Bring goals about and make calls, one after the other until one fails.

    Args:
        cell: Where.
        lines: Each a goal in relations, or a call, which has "=" in it.
        timeout: Simulated seconds that each may take.

    Returns:
        Whether all is done, and how the last one ended, in words.

    Raises:
        RoboSandboxError: A call failed.
    """
    claimed, reason = False, ""
    for line in lines:
        if "=" not in line:
            episode = cell.achieve(line, timeout=timeout)
            claimed, reason = episode.success, f"{episode.final_reason}: {episode.final_detail}"
            if not claimed:
                break
        else:
            name, _, rest = line.partition("(")
            pairs = (one.partition("=") for one in rest[:-1].split(","))
            cell.do(name, timeout=timeout, **{key.strip(): _value(text) for key, _, text in pairs})
            claimed, reason = True, "done"
    return claimed, reason


def numbers(text: str) -> list[int]:
    """Return the numbers of "0-4" or "0,3,7"."""
    found: list[int] = []
    for piece in text.split(","):
        first, _, last = piece.partition("-")
        found += range(int(first), int(last or first) + 1)
    return found


def scene_row(scene: Scene) -> dict[str, object]:
    """Return what the importer makes of a scene's file: kinds of its objects by id, and its table; or why it makes nothing of it.

    Raises:
        ValueError: The scene has no file.
    """
    if scene.world is None:
        raise ValueError("the scene is of no file")
    try:
        file = read_scene_file(scene.world)
    except RoboSandboxError as error:
        return {"error": f"{type(error).__name__}: {error}"}
    return {
        "objects": {item.id: item.kind for item in file.objects},
        "table": f"{file.table.body} at {file.table.height:.3f} m",
    }


def run_suite(
    description: str,
    tasks: Mapping[str, Sequence[str]],
    play: Callable[[str, Sequence[int]], Iterator[SuiteRow]],
    scene_of: Callable[[str], Mapping[str, object]],
) -> None:
    """Run a suite's bench as its command line asks.

    Args:
        description: What its help says.
        tasks: What is said of each task, by its name.
        play: Plays a task at starts, a row an episode.
        scene_of: Tells what the importer makes of a task's scene.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tasks", nargs="+", metavar="TASK", help="a task's name, or all")
    parser.add_argument("--seeds", type=numbers, default=[0], help="starts: 0-9, or 0,2 (default: 0)")
    parser.add_argument("--scenes", action="store_true", help="only tell what the importer makes of each scene")
    parser.add_argument("--json", type=Path, help="where rows go")
    options = parser.parse_args()
    names = [task for name in options.tasks for task in (tasks if name == "all" else (name,))]
    if unknown := [task for task in names if task not in tasks]:
        parser.error(f"{', '.join(unknown)}: there is {', '.join(tasks)}, and all")
    if options.scenes:
        for task in names:
            print(json.dumps(scene_of(task)), flush=True)
        return
    rows: list[SuiteRow] = []
    for task in names:
        for row in play(task, options.seeds):
            rows.append(row)
            print(_said(row), flush=True)
            if options.json is not None:
                options.json.write_text(json.dumps([asdict(one) for one in rows], indent=1) + "\n")
    print("\n".join(_summary(rows)))


def _value(text: str) -> object:
    """Return a number as one, and anything else as it is."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text


def _summary(rows: list[SuiteRow]) -> Iterator[str]:
    tasks: dict[str, list[SuiteRow]] = defaultdict(list)
    for row in rows:
        tasks[row.task].append(row)
    yield "| task | episodes | claimed | judged at the end | judged ever | in time | claimed and not judged | wall s |"
    yield "|---|---|---|---|---|---|---|---|"
    for name, its in (*tasks.items(), ("all", rows)):
        false = sum(row.claimed and not row.judged_ever for row in its)
        fields = ("claimed", "judged", "judged_ever", "judged_in_time")
        counts = [sum(getattr(row, field) for row in its) for field in fields]
        yield f"| {name} | {len(its)} | {' | '.join(map(str, counts))} | {false} | {sum(r.wall_s for r in its):.0f} |"


def _said(row: SuiteRow) -> str:
    verdict = "judged" if row.judged else "was judged" if row.judged_ever else "not judged"
    claim = "claimed" if row.claimed else "not claimed"
    return f"{row.task} {row.seed}: {claim}, {verdict}, {row.simulated_s:.1f} s, {row.wall_s:.1f} s wall; {row.goal}: {row.reason}"
