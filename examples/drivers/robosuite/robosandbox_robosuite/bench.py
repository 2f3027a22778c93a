"""Episodes of robosuite's one-arm tasks under robosuite's own judge.

    uv run --project examples/drivers/robosuite bench_robosuite.py Lift --seeds 0-9 --json rows.json

TASK is a task's name, or `all`. What is judged in time is judged within 50 s, robosuite's 1000 actions.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

from robosandbox.apps.bench.suites import SuiteRow, perform, run_suite, scene_row
from robosandbox.errors import RoboSandboxError
from robosandbox.workcell.session import open_session
from robosandbox_robosuite.environment import RobosuiteEnvironment
from robosandbox_robosuite.tasks import PLACES, TASKS

# Simulated seconds that a goal or a call may take.
TIMEOUT = 120.0


def play(task: str, seeds: Sequence[int]) -> Iterator[SuiteRow]:
    """Yield what came of an episode at each start; a failure to begin is a row as well."""
    for seed in seeds:
        with RobosuiteEnvironment(task, seed) as environment:
            yield _episode(environment, task, seed)


def _episode(environment: RobosuiteEnvironment, task: str, seed: int) -> SuiteRow:
    begun, simulated, claimed, reason = time.monotonic(), 0.0, False, "no goal or call says it"
    chosen = environment.chosen
    lines = [line.format(object=chosen, place=PLACES.get(chosen, "")) for line in TASKS[task]]
    try:
        with open_session(
            environment.scene, driver="robosuite", driver_options={"environment": environment}, dialogue=False
        ) as cell:
            begun = time.monotonic()
            try:
                if lines:
                    claimed, reason = perform(cell, lines, TIMEOUT)
            finally:
                simulated = cell.elapsed()[0]
    except RoboSandboxError as error:
        claimed, reason = False, f"{type(error).__name__}: {error}"
    return SuiteRow(
        suite="robosuite",
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


def scene_of(task: str) -> dict[str, object]:
    """Return what the importer makes of a task's scene at start 0."""
    with RobosuiteEnvironment(task, 0) as environment:
        return {"task": task, **scene_row(environment.scene)}


def main() -> None:
    """Run the bench."""
    assert __doc__ is not None
    run_suite(__doc__, TASKS, play, scene_of)
