"""Faults put into judge, skills, limits and collision one at a time, and whether the tests notice each.

    python benchmarks/mutants.py [--only WORD ...] [--seconds 300]

Each mutant of `mutants.txt` is written into a copy of the tree, and the tests that its row names run there; what stays
green there survives. The same tests are run on the copy as it is first: a mutant counts only where these pass.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
_LEFT_OUT = shutil.ignore_patterns(".git", ".venv", "__pycache__", ".*_cache", "site", "runs")


class Mutant(NamedTuple):
    """One fault: where, in words, the source that is replaced, once, by what, and the test files that are asked."""

    file: str
    fault: str
    old: str
    new: str
    tests: str


def mutants() -> Iterator[Mutant]:
    """Yield the faults of the table."""
    file = tests = fault = ""
    sides: dict[str, list[str]] = {}
    for line in [*(ROOT / "benchmarks" / "mutants.txt").read_text(encoding="utf-8").splitlines()[1:], ""]:
        change = line[4:5] if line.startswith("    ") else ""
        if not change and sides:
            yield Mutant(file, fault, "\n".join(sides["-"]), "\n".join(sides["+"]), tests)
            sides = {}
        if change:
            sides[change].append(line[6:])
        elif line.startswith("  "):
            fault, sides = line.strip(), {"-": [], "+": []}
        elif line:
            file, _, tests = line.partition(": ")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[], help="mutants whose file or fault holds one of these")
    parser.add_argument(
        "--seconds", type=float, default=300.0, help="for one run of tests; one that takes longer is noticed"
    )
    options = parser.parse_args()
    chosen = [m for m in mutants() if not options.only or any(word in f"{m.file} {m.fault}" for word in options.only)]
    killed = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, symlinks=True, ignore=_LEFT_OUT)
        sound = {tests: run(tree, tests, options.seconds) for tests in dict.fromkeys(m.tests for m in chosen)}
        for mutant in chosen:
            outcome = f"not tried: its tests fail without it: {sound[mutant.tests]}"
            if sound[mutant.tests] is None:
                said = mutated(tree, mutant, options.seconds)
                killed += said is not None
                outcome = "SURVIVED" if said is None else f"killed: {said}"
            print(f"{mutant.file}: {mutant.fault}: {outcome}", flush=True)
    print(f"killed {killed} of {len(chosen)}")
    sys.exit(killed < len(chosen))


def mutated(tree: Path, mutant: Mutant, seconds: float) -> str | None:
    """Return which test noticed a mutant; None where all passed.

    Raises:
        ValueError: What it replaces is not there, or more than once.
    """
    path = tree / mutant.file
    source = path.read_text(encoding="utf-8")
    if source.count(mutant.old) != 1:
        raise ValueError(f"{mutant.file}: {mutant.old!r} is there {source.count(mutant.old)} times; it has to be once")
    path.write_text(source.replace(mutant.old, mutant.new), encoding="utf-8")
    try:
        return run(tree, mutant.tests, seconds)
    finally:
        path.write_text(source, encoding="utf-8")


def run(tree: Path, tests: str, seconds: float) -> str | None:
    """Run tests in a tree; return the first that failed, None where all passed.

    Raises:
        RuntimeError: No test ran.
    """
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", "-rfE", *tests.split()]
    environment = os.environ | {"PYTHONPATH": str(tree / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return f"no end within {seconds:.0f} s"
    if done.returncode == 0:
        return None
    failed = [
        line.split()[1] for line in done.stdout.splitlines() if line.startswith(("FAILED tests/", "ERROR tests/"))
    ]
    if not failed:
        raise RuntimeError(f"{tests}: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    return failed[0].rpartition("::")[2]


if __name__ == "__main__":
    main()
