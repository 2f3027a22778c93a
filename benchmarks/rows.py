"""Send synthetic rows through robo-sandbox-bench and see how its memory grows.

uv run benchmarks/rows.py --rows 100000

An engine of this file takes the place of the episodes; everything after it is the command's own: the table, the JSON document on stdout,
the summary, and with --resume the file of rows. `growth_mb` is by how much the largest resident set rises from row 1,000 to the end
(read in /proc: Linux only).
"""

from __future__ import annotations

import argparse
import atexit
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from robosandbox.apps.bench.engines import Chunk
from robosandbox.apps.bench.results import BenchSettings, Row
from robosandbox.versions import versions

_TASK = "home"
_WARM_ROWS = 1000
_REPORT = "ROBOSANDBOX_ROWS_REPORT"
_ORDER = "ROBOSANDBOX_ROWS_ORDER"
_KIB_PER_MB = 1024.0
_WAYS = {
    "in order": ("in order", False),
    "in order, --resume": ("in order", True),
    "last first": ("last first", False),
    "last first, --resume": ("last first", True),
}


class SyntheticEngine:
    """Answers chunks with made-up rows, and notes the process's largest resident set.

    Args:
        jobs: Not used: nothing runs.
        address: Not used.
    """

    def __init__(self, jobs: int, address: str | None = None) -> None:
        del jobs, address
        atexit.register(self._note, "end")

    def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
        """Yield a row per episode, in order or the last first."""
        if os.environ[_ORDER] == "last first":
            chunks = reversed(list(chunks))
        count = 0
        for chunk in chunks:
            for seed in chunk.seeds:
                yield _row(chunk.task.name, seed, chunk.settings)
                count += 1
                if count == _WARM_ROWS:
                    self._note("warm")

    def _note(self, moment: str) -> None:
        # Not `ru_maxrss`: a process inherits the one of its parent.
        status = Path("/proc/self/status").read_text(encoding="ascii")
        peak = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) / _KIB_PER_MB
        with open(os.environ[_REPORT], "a", encoding="utf-8") as file:
            file.write(json.dumps({"moment": moment, "peak_mb": peak}) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=100_000)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.rows <= _WARM_ROWS:
        parser.error(f"--rows: {options.rows}; give more than {_WARM_ROWS}")
    report = {name: measured(options.rows, order, resume=resume) for name, (order, resume) in _WAYS.items()}
    lines = [f"{name:22} {', '.join(f'{k} {v}' for k, v in found.items())}" for name, found in report.items()]
    print(json.dumps(report, indent=1) if options.json else "\n".join(lines))


def measured(rows: int, order: str, *, resume: bool) -> dict[str, float]:
    """Run the command once; return what came out and by how much its memory grew.

    Args:
        rows: How many.
        order: In which order the engine's rows come.
        resume: Whether they go to a file of rows, too.
    """
    with tempfile.TemporaryDirectory() as folder:
        _install(Path(folder))
        report = Path(folder) / "report.jsonl"
        document = Path(folder) / "rows.json"
        path = os.pathsep.join([folder, str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
        command = [sys.executable, "-c", "from robosandbox.apps.cli import bench_main; bench_main()", "--json", "-"]
        command += ["--tasks", _TASK, "--engine", "synthetic", "--seeds", str(rows)]
        command += ["--resume", str(Path(folder) / "rows.jsonl")] if resume else []
        with document.open("wb") as stdout:
            done = subprocess.run(
                command,
                stdout=stdout,
                stderr=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": path, _REPORT: str(report), _ORDER: order},
                check=False,
            )
        told = done.stderr.decode().splitlines()
        if done.returncode or f"SUMMARY: {rows}/{rows} successful" not in told:
            sys.exit("\n".join(told[-3:]))
        written = [row["seed"] for row in json.loads(document.read_text(encoding="utf-8"))]
        warm, end = (json.loads(line)["peak_mb"] for line in report.read_text(encoding="utf-8").splitlines())
        return {
            "rows": len(written),
            "in_order": float(written == list(range(rows))),
            "warm_mb": round(warm, 1),
            "growth_mb": round(end - warm, 1),
        }


def _install(folder: Path) -> None:
    """Register the engine as a package on the path does."""
    info = folder / "synthetic_rows-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: synthetic-rows\nVersion: 1\n")
    (info / "entry_points.txt").write_text("[robosandbox.engines]\nsynthetic = rows:SyntheticEngine\n")


def _row(task: str, seed: int, settings: BenchSettings) -> Row:
    return Row(
        task=task,
        seed=seed,
        success=True,
        claimed=True,
        steps=1,
        replans=0,
        secs=0.1,
        sim_secs=4.0 + seed * 1e-6,
        physics_steps=2000,
        reason="plan_complete",
        detail={"home_error": 0.001},
        settings=settings.record(),
        versions=versions(),
        worst_force_n=0.0,
    )


if __name__ == "__main__":
    main()
