"""CPU time of whole processes over that of importing what any such program imports, measured alternately in one run.

uv run benchmarks/startup.py --runs 7 --json startup.json

Each row is a command of its own process, user plus system time, children included. "warm" finds this package's cache filled,
"cold" gets an empty cache folder each time. Compiled bytecode is there in both; `--no-bytecode` measures without it.
`initialize` is the time that the MCP server's process has used when its first answer arrives.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

REFERENCE = [sys.executable, "-c", "import mujoco, numpy, pydantic"]
PROGRAM = [str(Path(sys.executable).with_name("robo-sandbox"))]
PROMPT = "pick up the red cube"
# Largest ratio that is acceptable, by row: a command warm, then cold.
ROWS = {
    "--help": (["--help"], (0.5, 0.5)),
    "tasks list": (["tasks", "list"], (0.8, 0.8)),
    "plan": (["plan", PROMPT], (2.0, 4.0)),
    "run": (["run", PROMPT], (2.5, 5.0)),
}
INITIALIZE = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {
        "protocolVersion": "2025-06-18",
        "capabilities": {},
        "clientInfo": {"name": "startup", "version": "1"},
    },
}


def seconds_of(command: list[str], env: Mapping[str, str]) -> float:
    """Run a command to its end and return its CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: ended with {done.returncode}: {done.stderr.strip()[-300:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def seconds_to_initialize(env: Mapping[str, str]) -> float:
    """Return the CPU seconds that the MCP server has used when it has answered `initialize`; Linux alone tells."""
    server = subprocess.Popen(
        [*PROGRAM, "mcp"], env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert server.stdin is not None and server.stdout is not None
    server.stdin.write(json.dumps(INITIALIZE).encode() + b"\n")
    server.stdin.flush()
    answer = json.loads(server.stdout.readline())
    # The kernel counts nanoseconds here, and hundredths of a second in /proc/PID/stat.
    used = (
        sum(float(file.read_text().split()[0]) for file in Path(f"/proc/{server.pid}/task").glob("*/schedstat")) / 1e9
    )
    server.stdin.close()
    server.stdout.read()
    server.wait()
    if "result" not in answer:
        raise SystemExit(f"initialize was not answered: {answer}")
    return used


def measure(runs: int, env: dict[str, str], scratch: Path) -> dict[str, dict[str, list[float]]]:
    """Return CPU seconds by row, `warm` and `cold`, the rows measured in turn."""
    found: dict[str, dict[str, list[float]]] = {"reference": {"warm": []}}
    warm = {**env, "XDG_CACHE_HOME": str(scratch / "warm")}
    measured: dict[str, Callable[[Mapping[str, str]], float]] = {
        name: (lambda each, command=command: seconds_of([*PROGRAM, *command], each))  # type: ignore[misc]
        for name, (command, _) in ROWS.items()
    }
    if Path("/proc/self/schedstat").exists():
        measured["initialize"] = seconds_to_initialize
    for number in range(-1, runs):
        # The first round writes the bytecode and fills the warm cache.
        reference = seconds_of(REFERENCE, env)
        if number >= 0:
            found["reference"]["warm"].append(reference)
        for name, take in measured.items():
            empty = {**env, "XDG_CACHE_HOME": str(scratch / f"cold-{name.replace(' ', '-')}-{number}")}
            for state, each in (("warm", warm), ("cold", empty)):
                seconds = take(each)
                if number >= 0:
                    found.setdefault(name, {}).setdefault(state, []).append(seconds)
    return found


def main() -> int:
    """Measure, print a table, and end with 1 if a ratio is too large."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--json", type=Path, help="write all times and ratios here")
    parser.add_argument("--no-bytecode", action="store_true", help="neither write nor find compiled bytecode")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        env = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        env["PYTHONPYCACHEPREFIX"] = str(scratch / "bytecode")
        if options.no_bytecode:
            env["PYTHONDONTWRITEBYTECODE"] = "1"
        found = measure(options.runs, env, scratch)
    base = statistics.median(found["reference"]["warm"])
    limits = {name: limit for name, (_, limit) in ROWS.items()} | {"initialize": (1.0, 1.0)}
    rows = []
    for name, states in found.items():
        for state, times in states.items():
            middle = statistics.median(times)
            limit = limits.get(name, (None, None))[state == "cold"]
            rows.append(
                {"row": name, "cache": state, "cpu_s": middle, "ratio": middle / base, "limit": limit, "all_s": times}
            )
    print(f"{'row':<12} {'cache':<5} {'CPU s':>7} {'ratio':>6} {'limit':>6}")
    for row in rows:
        limit = "" if row["limit"] is None else f"{row['limit']:.1f}"
        print(f"{row['row']:<12} {row['cache']:<5} {row['cpu_s']:7.3f} {row['ratio']:6.2f} {limit:>6}")
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return int(any(row["limit"] is not None and row["ratio"] > row["limit"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
