"""What each named number of skills and world decides: the same episodes with the number halved and doubled.

    uv run benchmarks/sensitivity_tasks.py skills.tap skills.primitives.guarded --tasks tap_cube tap_ball --seeds 3

A row says how many episodes succeed, judged and claimed, how long they take in simulated time and what they touched, as it is
and with one number changed; numbers that change no episode are named at the end. The planner is the grammar, perception is
exact. What only an episode in trouble decides (repairs, noisy pictures) does not show here.
"""

from __future__ import annotations

import argparse
import importlib
import logging
import sys

# The benchmark of perception's numbers, beside this file.
from sensitivity import measure

from robosandbox.apps.bench.episodes import Chunk, EpisodeRunner
from robosandbox.apps.bench.results import BenchSettings, Row
from robosandbox.tasks.loader import find_task
from robosandbox.tasks.task import Task


class Suite:
    """Some episodes, in worlds that are built once.

    Args:
        tasks: Which.
        seeds: Layouts of each.
    """

    def __init__(self, tasks: list[Task], seeds: int) -> None:
        self._chunks = [Chunk(task, tuple(range(seeds)), BenchSettings(task=task)) for task in tasks]
        self._runners = [EpisodeRunner() for _ in tasks]

    def run(self) -> list[Row]:
        """Return a row per episode."""
        return [row for chunk, runner in zip(self._chunks, self._runners, strict=True) for row in runner.rows(chunk)]


def summary(rows: list[Row]) -> str:
    """Return how episodes ended, in a line."""
    failed = ", ".join(f"{row.task}/{row.seed} {row.reason}" for row in rows if not row.success)
    lied = sum(row.claimed and not row.success for row in rows)
    return (
        f"{sum(row.success for row in rows)}/{len(rows)} done, {lied} false claims, {sum(row.replans for row in rows)} replans, "
        f"{sum(row.sim_secs for row in rows):.1f} s simulated, {sum(bool(row.touched) for row in rows)} touched"
        + (f"; failed: {failed}" if failed else "")
    )


def main() -> int:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="+", help="of robosandbox, such as skills.tap or world.placement_sampling")
    parser.add_argument("--tasks", nargs="+", required=True, help="bundled tasks, or files")
    parser.add_argument("--seeds", type=int, default=2, help="layouts of each")
    options = parser.parse_args()
    logging.disable(logging.CRITICAL)
    suite = Suite([find_task(name) for name in options.tasks], options.seeds)
    before = summary(suite.run())
    print(f"as it is: {before}", flush=True)
    for name in options.modules:
        module = importlib.import_module(f"robosandbox.{name}")
        measure(module, lambda: summary(suite.run()), before, lambda row: print(row, flush=True))
    return 0


if __name__ == "__main__":
    sys.exit(main())
