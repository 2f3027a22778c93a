"""Episodes of LIBERO's suites under LIBERO's own judge.

    uv run --project examples/drivers/libero bench_libero.py libero_spatial --states 0-4 --by relations --json rows.json

SUITE is a suite's name, `standard` (the five of LIBERO) or `pro` (the sixteen of LIBERO-PRO).
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")

# Simulated seconds after which an episode ends, and of a look of the judge.
TIMEOUT, LOOK = 180.0, 0.05
# Episodes of a process.
EPISODES = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One episode.

    Attributes:
        suite: Name of the suite.
        task: Number of the task there.
        state: Number of its initial state.
        sentence: What its file asks for.
        goal: What was given to `achieve`; "" where the sentence was given.
        claimed: Whether the agent says that it is done.
        judged_ever: LIBERO's verdict at any moment, 20 times a second, as its own evaluations take it.
        judged: At the end, the hand off.
        simulated_s: Simulated seconds.
        wall_s: Wall seconds of the episode; opening the world takes some more.
        reason: Why it ended, in words.
    """

    suite: str
    task: int
    state: int
    sentence: str
    goal: str
    claimed: bool
    judged_ever: bool
    judged: bool
    simulated_s: float
    wall_s: float
    reason: str


def play(suite: str, number: int, state: int, by: str) -> Row:
    """Return what came of one episode; a failure to open or to begin is a row as well."""
    # Heavy, and loaded by the processes that play alone.
    from robosandbox.errors import RoboSandboxError
    from robosandbox.workcell.session import open_session
    from robosandbox_libero.environment import LiberoEnvironment
    from robosandbox_libero.goals import relations_of
    from robosandbox_libero.tasks import tasks_of

    task = tasks_of(suite)[number]
    begun, simulated, goal, claimed, judged, ever = time.monotonic(), 0.0, "", False, False, False
    with LiberoEnvironment(task, state) as environment:
        try:
            with open_session(
                environment.scene,
                driver="libero",
                driver_options={"environment": environment},
                # Left, right, front and back are those of the person in front of the robot.
                planner_options={"frame": "viewer"},
                dialogue=False,
            ) as cell:
                if by == "relations":
                    goal = ", ".join(map(str, relations_of(environment, cell.observe())))
                looks = round(LOOK / cell.driver.control_timestep)
                ticks = 0

                def look() -> None:
                    nonlocal ticks
                    ticks += 1
                    if ticks % looks == 0:
                        environment.judge()

                cell.driver.subscribe(look)
                begun = time.monotonic()
                episode = cell.run(goal or task.sentence, timeout=TIMEOUT)
                claimed, reason = episode.success, f"{episode.final_reason}: {episode.final_detail}"
                simulated = cell.elapsed()[0]
                judged, ever = environment.judge(), environment.judged_once
        except RoboSandboxError as error:
            reason = f"{type(error).__name__}: {error}"
    return Row(
        suite=suite,
        task=number,
        state=state,
        sentence=task.sentence,
        goal=goal,
        claimed=claimed,
        judged_ever=ever,
        judged=judged,
        simulated_s=round(simulated, 2),
        wall_s=round(time.monotonic() - begun, 2),
        reason=reason,
    )


def scene_of(suite: str, number: int) -> dict[str, object]:
    """Return what the importer makes of a task's scene at state 0."""
    from robosandbox.apps.bench.suites import scene_row
    from robosandbox_libero.environment import LiberoEnvironment
    from robosandbox_libero.tasks import tasks_of

    task = tasks_of(suite)[number]
    with LiberoEnvironment(task, 0) as environment:
        return {
            "suite": suite,
            "task": number,
            "sentence": task.sentence,
            **scene_row(environment.scene),
            "goal": " ".join(" ".join(predicate) for predicate in task.goal),
        }


def _summary(rows: list[Row]) -> Iterator[str]:
    suites: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        suites[row.suite].append(row)
    yield "| suite | episodes | claimed | judged at the end | judged ever | claimed and not judged | wall s |"
    yield "|---|---|---|---|---|---|---|"
    for name, its in suites.items():
        false = sum(row.claimed and not row.judged for row in its)
        counts = [sum(getattr(row, field) for row in its) for field in ("claimed", "judged", "judged_ever")]
        yield f"| {name} | {len(its)} | {' | '.join(map(str, counts))} | {false} | {sum(r.wall_s for r in its):.0f} |"


def main() -> None:
    """Run the bench."""
    # Heavy: what only counts and writes does without it until it runs.
    from robosandbox.apps.bench.suites import numbers

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("suites", nargs="+", metavar="SUITE")
    parser.add_argument("--states", type=numbers, default=[0], help="initial states: 0-4, or 0,2 (default: 0)")
    parser.add_argument("--tasks", type=numbers, help="numbers of tasks (default: all)")
    parser.add_argument("--by", choices=("relations", "sentence"), default="relations", help="what is asked for")
    parser.add_argument("--scenes", action="store_true", help="only tell what the importer makes of each scene")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--json", type=Path, help="where rows go")
    options = parser.parse_args()

    from robosandbox_libero.tasks import PRO, STANDARD, tasks_of

    known = {"standard": STANDARD, "pro": PRO}
    suites = [suite for name in options.suites for suite in known.get(name, (name,))]
    tasks = [(s, k) for s in suites for k in (options.tasks or range(len(tasks_of(s)))) if k < len(tasks_of(s))]
    if options.scenes:
        told: list[dict[str, object]] = []
        for scene in _spread(scene_of, tasks, options.jobs):
            told.append(scene)
            print(json.dumps(scene), flush=True)
            _write(options.json, told)
        return
    episodes = [(suite, number, state, options.by) for suite, number in tasks for state in options.states]
    rows: list[Row] = []
    for row in _spread(play, episodes, options.jobs):
        rows.append(row)
        verdict = "judged" if row.judged else "was judged" if row.judged_ever else "not judged"
        claim = "claimed" if row.claimed else "not claimed"
        print(
            f"{row.suite} {row.task} state {row.state}: {claim}, {verdict}, {row.simulated_s:.1f} s, "
            f"{row.wall_s:.1f} s wall; {row.goal or row.sentence}: {row.reason}",
            flush=True,
        )
        _write(options.json, [asdict(one) for one in rows])
    print("\n".join(_summary(rows)))


def _spread(function: Callable[..., T], arguments: Sequence[tuple[Any, ...]], jobs: int) -> Iterator[T]:
    """Yield what a function answers to each tuple of arguments, in order, from so many processes."""
    # What an episode leaves of its scene in memory, 0.2 GB, goes with the processes; a pool that begins them anew by itself hangs
    # in Python 3.11 (cpython issue 115634).
    context, batch = multiprocessing.get_context("spawn"), EPISODES * jobs
    for begin in range(0, len(arguments), batch):
        with ProcessPoolExecutor(jobs, mp_context=context) as pool:
            yield from pool.map(function, *zip(*arguments[begin : begin + batch], strict=True))


def _write(path: Path | None, rows: list[dict[str, object]]) -> None:
    if path is not None:
        path.write_text(json.dumps(rows, indent=1) + "\n")
