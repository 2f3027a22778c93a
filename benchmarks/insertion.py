"""Pegs put into holes that are not quite where they are believed to be: in, or given up with a cause; forces of every control tick.

    uv run benchmarks/insertion.py --times 50 [--shapes square round] [--clearances 2 1 0.5] [--driver hardware:wrist_wrench=true] [--misses]

A peg of 20 mm across and 70 mm long stands on the table beside a block with a hole 30 mm deep, wider by the clearance. The block is then
moved, unseen, by up to 3 mm and turned by up to 3 degrees about the vertical. Judged by the simulated state: the peg's lower end is within
3 mm of the hole's floor, within its walls, and let go. Sizes are those of the scene's file; the forces are those of the peg and the
hand on the block. Ends with 1 where something was claimed that is not so.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import tempfile
from pathlib import Path

import numpy as np
from support.pegs import SHAPES, insert, scene


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--shapes", nargs="+", default=[*SHAPES], choices=(*SHAPES,))
    parser.add_argument("--clearances", nargs="+", type=float, default=[2.0, 1.0, 0.5], help="mm")
    parser.add_argument("--driver", default="mujoco")
    parser.add_argument("--misses", action="store_true", help="print what did not go in")
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    false = 0
    for shape in given.shapes:
        for clearance in given.clearances:
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "pegs.xml"
                file.write_text(scene(shape, clearance / 1e3))
                rows = [insert(file, given.driver, seed) for seed in range(given.first, given.first + given.times)]
            wrong = sum(row["claimed"] and not row["in"] for row in rows)
            false += wrong
            print(
                f"{shape} {clearance:g} mm: in {sum(row['in'] for row in rows)} of {len(rows)}, claimed {sum(row['claimed'] for row in rows)}, "
                f"false claims {wrong}, median {np.median([row['seconds'] for row in rows]):.0f} s, at most {max(row['force_n'] for row in rows):.0f} N",
                flush=True,
            )
            for row in rows if given.misses else ():
                if not (row["in"] and row["claimed"]):
                    print("  ", json.dumps(row), flush=True)
    return 1 if false else 0


if __name__ == "__main__":
    sys.exit(main())
