"""Many episodes on several processes: throughput beside one process, the CPU of an episode in both, idle workers, memory.

    uv run benchmarks/worlds.py [--episodes 400] [--alone 400] [--jobs 2] [--tasks pick_cube_franka,...] [--json]
    uv run benchmarks/worlds.py --episodes 10000 --alone 1000

The bar is 90 % of `jobs` times the episodes a second of one process, which means something on a machine without other work
only. What a busy machine tells as well: `cpu_over_one`, an episode's CPU on several processes over that on one, without
what it takes to start them; and `worker_idle`, the share of their time that workers that could run waited for episodes. Both read /proc: Linux only.
Memory is of the largest worker and of this process, after a tenth of the episodes and at the end.
"""

from __future__ import annotations

import argparse
import json
import os
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from robosandbox.apps.bench.bench import Row, run_bench
from robosandbox.tasks.loader import bundled_tasks, find_task
from robosandbox.tasks.task import Task

# Seconds between looks at the workers.
_LOOK = 0.05
_TICK = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")


@dataclass
class Watch:
    """Looks at this process and its workers while a bench runs."""

    cpu_s: dict[int, float] = field(default_factory=dict)
    looks: int = 0
    sleeping: int = 0
    worker_mb: list[float] = field(default_factory=list)
    own_mb: list[float] = field(default_factory=list)
    stopping: threading.Event = field(default_factory=threading.Event)

    def run(self) -> None:
        """Look until told to stop."""
        while not self.stopping.wait(_LOOK):
            own, workers = os.getpid(), _workers()
            for pid in (own, *workers):
                seen = _stat(pid)
                if seen is None:
                    continue
                state, cpu, resident = seen
                self.cpu_s[pid] = cpu
                if pid == own:
                    self.own_mb.append(resident)
                else:
                    self.looks += 1
                    # Waits for something, and would not run if there were a core.
                    self.sleeping += state == "S"
                    self.worker_mb.append(resident)


def measure(tasks: Sequence[Task], seeds: int, jobs: int) -> tuple[list[Row], dict[str, float]]:
    """Run a bench; return its rows without their times, and what it took."""
    rows: list[Row] = []
    watch = Watch()
    thread = threading.Thread(target=watch.run, daemon=True)
    cpu_began, begin = _stat_cpu(os.getpid()), time.perf_counter()
    first: tuple[int, float, float] | None = None
    thread.start()
    try:
        for row in run_bench(tasks, seeds, jobs=jobs):
            rows.append(replace(row, secs=0.0))
            if first is None and len(rows) >= max(1, len(tasks) * seeds // 10):
                # Workers have started and have their first worlds.
                first = len(rows), sum(watch.cpu_s.values()), time.perf_counter()
    finally:
        watch.stopping.set()
        thread.join()
    assert first is not None
    wall, episodes = time.perf_counter() - begin, len(rows)
    whole = sum(watch.cpu_s.values()) - cpu_began
    tenth = max(1, len(watch.own_mb) // 10)
    kept = watch.worker_mb or watch.own_mb
    return rows, {
        "episodes_per_s": round(episodes / wall, 3),
        "cpu_ms_per_episode": round(1e3 * whole / episodes, 1),
        "cpu_ms_per_episode_later": round(
            1e3 * (sum(watch.cpu_s.values()) - first[1]) / max(1, episodes - first[0]), 1
        ),
        "worker_idle": round(watch.sleeping / max(1, watch.looks), 4),
        "own_cpu_share": round((watch.cpu_s[os.getpid()] - cpu_began) / whole, 4),
        "worker_mb_early": round(max(kept[: max(1, len(kept) // 10)]), 1),
        "worker_mb_late": round(max(kept[-max(1, len(kept) // 10) :]), 1),
        "own_mb_early": round(max(watch.own_mb[:tenth]), 1),
        "own_mb_late": round(max(watch.own_mb[-tenth:]), 1),
    }


def _workers() -> list[int]:
    """Return the bench's processes; what else Python starts beside them is left out."""
    found: list[int] = []
    for thread in Path("/proc/self/task").iterdir():
        try:
            for child in (thread / "children").read_text().split():
                if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                    found.append(int(child))
        except OSError:
            continue
    return found


def _stat(pid: int) -> tuple[str, float, float] | None:
    """Return a process's state, CPU seconds and resident megabytes; None when it is gone."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    if fields[0] == "Z":
        return None
    return fields[0], (int(fields[11]) + int(fields[12])) / _TICK, int(fields[21]) * _PAGE / 1e6


def _stat_cpu(pid: int) -> float:
    seen = _stat(pid)
    assert seen is not None
    return seen[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=400)
    parser.add_argument("--alone", type=int, help="episodes of them in one process; all where it is not given")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--tasks", default="pick_cube_franka,put_in_bin,stack_two,push_left", help="names, by comma")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    names = [name for name in options.tasks.split(",") if name]
    if missing := set(names) - set(bundled_tasks()):
        parser.error(f"--tasks: no task {', '.join(sorted(missing))}")
    tasks = [find_task(name) for name in names]
    seeds = -(-options.episodes // len(tasks))
    one, alone = measure(tasks, min(seeds, -(-(options.alone or options.episodes) // len(tasks))), 1)
    many, beside = measure(tasks, seeds, options.jobs)
    both = {(row.task, row.seed) for row in one}
    equal = one == [row for row in many if (row.task, row.seed) in both]
    report: dict[str, object] = {"episodes": len(many), "alone": len(one), "jobs": options.jobs, "rows_equal": equal}
    report |= {f"one_{key}": value for key, value in alone.items() if key != "worker_idle"}
    report |= {f"jobs_{key}": value for key, value in beside.items()}
    report["share_of_jobs_times_one"] = round(beside["episodes_per_s"] / (options.jobs * alone["episodes_per_s"]), 3)
    report["cpu_over_one"] = round(beside["cpu_ms_per_episode_later"] / alone["cpu_ms_per_episode_later"], 3)
    print(json.dumps(report, indent=1) if options.json else "\n".join(f"{k:32} {v}" for k, v in report.items()))


if __name__ == "__main__":
    main()
