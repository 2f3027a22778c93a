"""Picking meshes: random objects and household things out of package wheels, on truth or on pixels.

    python benchmarks/meshes.py [--random 200] [--household-seeds 3] [--perception ground_truth] [--jobs 2] [--json] [--misses]

Each thing lies on a face on which it rests, drawn by its seed, and collides as the convex pieces that it is cut into. The arm is
told to pick it up. The judge is that of `odd.py`: raw contacts, two seconds long; of what was not held the oracle,
`mesh_oracle.py`, tries grasps on copies of the true world. What no grasp of it holds counts neither for nor against.
"""

from __future__ import annotations

import argparse
import json
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from mesh_oracle import can_hold
from mesh_things import HOUSEHOLD, RANDOM_OBJECTS, household, laid, random_object
from odd import Row, episode, parsed, report, rows_of


def run(name: str, seed: int, perception: str, oracle: bool) -> Row | None:
    """Pick one thing; None where its scene cannot be built."""
    thing = household(name) if name in HOUSEHOLD else random_object(int(name))
    # What is tried on the twin mends nothing here: there is one thing, and one grasp after the other is tried anyway.
    return episode(laid(thing, seed), can_hold if oracle else None, perception=perception, what_if=False)


def chosen(number: int) -> list[str]:
    """Return the numbers of so many random objects: evenly spread over all."""
    return [f"{int(k):03d}" for k in np.linspace(0, RANDOM_OBJECTS, number, endpoint=False)]


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of some episodes."""
    can = [row for row in rows if row.possible is not False]
    refused = Counter(_refusal(row) for row in rows if not row.claimed)
    return {
        "things": len(rows),
        "can_be_held": len(can),
        "picked": sum(row.done and row.claimed for row in can),
        "picked_share": round(sum(row.done and row.claimed for row in can) / max(len(can), 1), 3),
        "false_claims": sum(row.claimed and not row.done for row in rows),
        "judges_differ": sum(row.judged != row.done for row in rows),
        "unnamed_over_60_n": sum(row.unnamed_n > 60.0 for row in rows),
        "stuck": sum(row.stuck for row in rows),
        "refused": dict(refused.most_common()),
        "refused_though_possible": dict(Counter(_refusal(row) for row in can if not row.claimed).most_common()),
        "cpu_s": round(sum(row.cpu_secs for row in rows), 1),
    }


def _refusal(row: Row) -> str:
    """Return the cause of a refusal: its last code with its reason, or how the episode ended."""
    return row.errors[-1] if row.errors else re.sub(r"\d+(\.\d+)?", "N", f"{row.why}: {row.said.split(';')[0]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--random", type=int, default=200, help="so many of the random objects, evenly spread")
    parser.add_argument("--household-seeds", type=int, default=3, help="ways in which each household thing lies")
    parser.add_argument("--only", nargs="*", default=[], help="names or numbers of things")
    parser.add_argument("--perception", default="ground_truth")
    options = parsed(parser)
    names = options.only or [*chosen(options.random), *HOUSEHOLD]
    seeds = {name: options.household_seeds if name in HOUSEHOLD else 1 for name in names}
    jobs = [(name, k, options.perception, not options.no_oracle) for name in names for k in range(seeds[name])]
    found = rows_of(run, jobs, options.jobs, _told)
    rows = [row for row in found if row is not None]
    house = [row for row in rows if "object_" not in row.prompt]
    table = {"household": summary(house), "random": summary([row for row in rows if row not in house])}
    table["all"] = {**summary(rows), "not_built": len(found) - len(rows)}
    report(options, "groups", table, rows, _wrong)


def _told(row: Row) -> str:
    end = f"possible: {row.possible}; {json.dumps(asdict(row))}" if _wrong(row) else "picked"
    return f"{row.prompt} ({row.seed}): {end}"


def _wrong(row: Row) -> bool:
    return not (row.done and row.claimed and row.judged)


if __name__ == "__main__":
    main()
