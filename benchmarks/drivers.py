"""What the tasks reach through each driver: said by the agent, judged beside it, false claims, and what is refused.

    python benchmarks/drivers.py [--drivers mujoco,hardware,pybullet] [--seeds 20] [--tasks pick_ball ...] [--json]

`mujoco` sees and is judged by simulated truth. `hardware` (a hidden plant with 30 ms of latency, noisy encoders, lost frames and no
contact) and `pybullet` (another engine: `pip install examples/drivers/pybullet`) see pixels and are judged by a referee of their own,
which skills have no way to. A false claim is an agent's "done" that the judge contradicts. Of every bundled task it is tried which
ones a driver refuses because it lacks a capability; the first sentence of the refusal is given.

It ends with 1 where a driver stays below its bar: mujoco 100 %, hardware 95 %, pybullet 90 %, no false claim in any.
"""

from __future__ import annotations

import argparse
import json
import logging
import resource
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from robosandbox.apps.bench.bench import BenchSettings, Row, run_bench
from robosandbox.apps.bench.interval import wilson_interval
from robosandbox.errors import ErrorCode, InputError
from robosandbox.tasks.bundled import STANDARD_SUITE, task_entries
from robosandbox.tasks.loader import find_task
from robosandbox.workcell.session import open_session

# Share of episodes that have to succeed, as the issue tracker asks.
BARS = {"mujoco": 1.0, "hardware": 0.95, "pybullet": 0.9}
PERCEPTIONS = {"mujoco": "ground_truth"}
# Simulated seconds after which a task that only shows whether it is refused is given up: a refusal comes before the arm moves.
_REFUSAL_SECONDS = 0.5


def refusals(driver: str, tasks: Iterable[str]) -> dict[str, str]:
    """Return the tasks that a driver refuses for lack of a capability, or of something to build, with what it says."""
    found = {}
    for name in tasks:
        try:
            with open_session(
                name, driver=driver, perception=_perception(driver), what_if=False, max_replans=0
            ) as session:
                error = session.run(timeout=_REFUSAL_SECONDS).error
        except InputError as refused:
            found[name] = str(refused)
            continue
        if error is not None and error.code == ErrorCode.UNSUPPORTED:
            found[name] = error.message
    return found


def summary(rows: Sequence[Row], bar: float | None) -> dict[str, Any]:
    """Return the figures of a driver's episodes."""
    done, said = sum(row.success for row in rows), sum(row.claimed for row in rows)
    false = sum(row.claimed and not row.success for row in rows)
    low, high = wilson_interval(done, len(rows))
    return {
        "episodes": len(rows),
        "judged": done,
        "said": said,
        "false_claims": false,
        "rate": round(done / len(rows), 4),
        "low": round(low, 3),
        "high": round(high, 3),
        "bar": bar,
        "passed": false == 0 and (bar is None or done >= bar * len(rows)),
    }


def _perception(driver: str) -> str:
    return PERCEPTIONS.get(driver.partition(":")[0], "rgbd")


def _cpu() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def measure(driver: str, names: Sequence[str], seeds: int, *, all_names: Sequence[str]) -> dict[str, Any]:
    """Return a driver's rows and figures."""
    begin = _cpu()
    settings = BenchSettings(driver=driver, perception=_perception(driver))
    rows = list(run_bench([find_task(name) for name in names], seeds, settings=settings, on_row=_tell))
    cpu = _cpu() - begin
    bar = BARS.get(driver.partition(":")[0])
    return {
        **summary(rows, bar),
        "cpu_s_per_episode": round(cpu / len(rows), 2),
        "tasks": {name: summary([row for row in rows if row.task == name], None) for name in names},
        "refused": refusals(driver, all_names),
        "failed": [asdict(row) for row in rows if not (row.success and row.claimed)],
    }


def _tell(row: Row) -> None:
    print(
        f"{row.settings['driver']} {row.task} {row.seed}: said {row.claimed}, judged {row.success}",
        file=sys.stderr,
        flush=True,
    )


def report(found: dict[str, dict[str, Any]]) -> str:
    """Return the figures as people read them."""
    lines = [f"{'driver':12}{'judged':>12}{'said':>7}{'false':>7}{'bar':>7}{'cpu s':>8}  interval"]
    for driver, figures in found.items():
        bar = "" if figures["bar"] is None else f"{100.0 * figures['bar']:.0f} %"
        judged = f"{figures['judged']}/{figures['episodes']}"
        lines.append(
            f"{driver:12}{judged:>12}{figures['said']:>7}{figures['false_claims']:>7}{bar:>7}"
            f"{figures['cpu_s_per_episode']:>8.1f}  {figures['low']:.3f}..{figures['high']:.3f}"
        )
    for driver, figures in found.items():
        lines.append(f"{driver} refuses {', '.join(figures['refused']) or 'nothing'}")
        lines += [f"  {name}: {said}" for name, said in figures["refused"].items()]
        for row in figures["failed"]:
            lines.append(
                f"  {row['task']}, seed {row['seed']}: said {row['claimed']}, judged {row['success']}: {row['detail']}"
            )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drivers", default=",".join(BARS), help="names, with commas between them")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--tasks", nargs="+", help="in place of the standard suite")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    logging.disable(logging.WARNING)
    entries = task_entries()
    names = arguments.tasks or [entry.name for entry in entries if entry.suite == STANDARD_SUITE]
    every = arguments.tasks or [entry.name for entry in entries]
    found = {
        driver: measure(driver, names, arguments.seeds, all_names=every) for driver in arguments.drivers.split(",")
    }
    print(json.dumps(found) if arguments.json else report(found))
    return 0 if all(figures["passed"] for figures in found.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
