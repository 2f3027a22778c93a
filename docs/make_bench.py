"""Write docs/bench.md, what the bundled tasks reach, from a bench's rows.

uv run robo-sandbox-bench --suite all --seeds 20 --resume rows.jsonl; uv run docs/make_bench.py rows.jsonl
"""

from __future__ import annotations

import argparse
import json
import statistics
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from robosandbox.apps.bench.interval import beta_interval

TARGET = Path(__file__).with_name("bench.md")
HEAD = """# Tasks

<!-- Written by docs/make_bench.py; run the bench. -->

What the bundled tasks reach with the bundled Panda: seed 0 is the task as it is written, the others are drawn. Success is judged on the
simulated state; *claimed otherwise* counts episodes in which the agent said something else; *touched* those in which the arm, or what it held,
touched what it was not to touch. Simulated seconds and replans are medians. 95% intervals.

| task | success | claimed otherwise | touched | simulated s | replans | worst force N | on what it moved N |
|---|---|---|---|---|---|---|---|
"""


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", type=Path, help="written by robo-sandbox-bench --resume, a row a line, or --json")
    text = parser.parse_args().rows.read_text(encoding="utf-8")
    rows = json.loads(text) if text.startswith("[") else [json.loads(line) for line in text.splitlines()]
    TARGET.write_text(page(rows), encoding="utf-8")


def page(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the page."""
    tasks: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        tasks.setdefault(row["task"], []).append(row)
    first = rows[0]
    versions = ", ".join(f"{name} {value}" for name, value in first["versions"].items())
    told = "\n".join(missed(rows)) or "None."
    return (
        HEAD
        + "".join(f"{line(name, found)}\n" for name, found in tasks.items())
        + f"\nMeasured with {versions}; planner `{first['settings']['planner']}`, perception `{first['settings']['perception']}`.\n\n"
        + f"Episodes without success:\n\n{told}\n"
    )


def line(name: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a task's line of the table."""
    good, count = sum(row["success"] for row in rows), len(rows)
    low, high = beta_interval(good, count)
    fields = (
        name,
        f"{good}/{count} ({100 * low:.0f}..{100 * high:.0f}%)",
        sum(row["claimed"] != row["success"] for row in rows),
        sum(bool(row["touched"]) for row in rows),
        f"{statistics.median(row['sim_secs'] for row in rows):.1f}",
        f"{statistics.median(row['replans'] for row in rows):g}",
        f"{max(row['worst_force_n'] or 0.0 for row in rows):.1f}",
        f"{max(row.get('worst_intended_force_n') or 0.0 for row in rows):.1f}",
    )
    return f"| {' | '.join(map(str, fields))} |"


def missed(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a line for each episode without success."""
    for row in rows:
        if not row["success"]:
            said = row["detail"].get("agent") or row["reason"]
            yield f"- {row['task']}, seed {row['seed']}: {' '.join(str(said).split())}"


if __name__ == "__main__":
    main()
