"""Episodes of MetaWorld's tasks under MetaWorld's own judge.

    uv run --project examples/drivers/metaworld bench_metaworld.py drawer-open-v3 --seeds 0-9 --json rows.json

TASK is a task's name, or `all`. What is judged in time is judged within 500 steps.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

from robosandbox.apps.bench.suites import SuiteRow, perform, run_suite, scene_row
from robosandbox.errors import RoboSandboxError
from robosandbox.workcell.session import open_session
from robosandbox_metaworld.environment import MetaWorldEnvironment, MetaWorldProcess
from robosandbox_metaworld.tasks import TASKS

# Simulated seconds after which an episode ends: far more than MetaWorld's own limit of 500 steps, which is judged apart.
TIMEOUT = 60.0
# Metres by which `{over}` is over a goal: what MetaWorld's fingers reach below their TCP, and what they hold.
OVER = 0.07
# Metres before a goal in a net at which a hand from above still pushes; MetaWorld asks for 70 mm.
NEAR = 0.045


def play(task: str, seeds: Sequence[int]) -> Iterator[SuiteRow]:
    """Yield what came of an episode at each start; a failure to open or to begin is a row as well."""
    with MetaWorldProcess(task) as process:
        for seed in seeds:
            yield _episode(process, task, seed)


def _episode(process: MetaWorldProcess, task: str, seed: int) -> SuiteRow:
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
                    claimed, reason = perform(cell, lines, TIMEOUT)
                finally:
                    simulated = cell.elapsed()[0]
        except RoboSandboxError as error:
            claimed, reason = False, f"{type(error).__name__}: {error}"
        return SuiteRow(
            suite="metaworld",
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
    with MetaWorldProcess(task) as process, MetaWorldEnvironment(process, 0) as environment:
        return {"task": task, **scene_row(environment.scene)}


def main() -> None:
    """Run the bench."""
    assert __doc__ is not None
    run_suite(__doc__, TASKS, play, scene_of)
