"""Compare a bench on a Ray cluster of two local nodes with the same bench in this process and on processes.

uv run --extra scale benchmarks/scale.py --json

Rows have to be equal, with a worker killed midway too; throughput is episodes per wall second.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace

from support.cluster import dying_worker, local_cluster

from robosandbox.apps.bench.bench import Row, run_bench
from robosandbox.apps.bench.engines import Engine
from robosandbox.apps.bench.ray_engine import RayEngine
from robosandbox.tasks.loader import bundled_tasks, find_task
from robosandbox.tasks.task import Task


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=200)
    parser.add_argument("--tasks", default="pick_cube_franka,put_in_bin,stack_two,push_left", help="names, by comma")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    names = [name for name in options.tasks.split(",") if name]
    if missing := set(names) - set(bundled_tasks()):
        parser.error(f"--tasks: no task {', '.join(sorted(missing))}")
    tasks = [find_task(name) for name in names]
    seeds = -(-options.episodes // len(tasks))
    one, secs_one = timed(tasks, seeds, 1)
    two, secs_two = timed(tasks, seeds, 2)
    with local_cluster() as address:
        # Imports and models of the workers, which a bench of any length pays once.
        timed(tasks, 2, 2, RayEngine(2, address))
        ray, secs_ray = timed(tasks, seeds, 2, RayEngine(2, address))
        with dying_worker(secs_ray / 2.0) as killed:
            survived, _ = timed(tasks, seeds, 2, RayEngine(2, address))
    report = {
        "episodes": len(one),
        "jobs_2_equal": two == one,
        "ray_equal": ray == one,
        "killed_workers": len(killed),
        "ray_equal_after_kill": survived == one,
        "jobs_1_per_s": round(len(one) / secs_one, 2),
        "jobs_2_per_s": round(len(one) / secs_two, 2),
        "ray_per_s": round(len(one) / secs_ray, 2),
        "ray_over_jobs_2": round(secs_two / secs_ray, 3),
    }
    print(json.dumps(report, indent=1) if options.json else "\n".join(f"{k:22} {v}" for k, v in report.items()))


def timed(tasks: Sequence[Task], seeds: int, jobs: int, engine: Engine | None = None) -> tuple[list[Row], float]:
    """Return the rows without their wall times, and the wall seconds of all."""
    begin = time.perf_counter()
    rows = [replace(row, secs=0.0) for row in run_bench(tasks, seeds, jobs=jobs, engine=engine)]
    return rows, time.perf_counter() - begin


if __name__ == "__main__":
    main()
