"""Counts over the source text: who names a simulator, who compares kinds, how long and how branched the code is.

uv run benchmarks/house.py --json house.json
uv run benchmarks/house.py --list constants_without_source
uv run benchmarks/house.py --rooms
uv run benchmarks/house.py --picture docs/house.svg

Read are the Python files of `src/robosandbox` and of the six folders beside it; tests, examples, benchmarks and documents are
not. "language" is what is under `agent/language`, "rest" is everything else. `house_counts.py` says by which rules is counted.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

from house_constants import constants
from house_counts import COUNTS, import_circles
from house_picture import house, picture
from house_rooms import ROOMS, arrows, floors
from house_sources import Source, sources

# What the figures are to be at most, without the grammar.
AIMS = {name: 0 for name in COUNTS} | {
    "kind_comparisons": 10,
    "complex_functions": 5,
    "import_circles": 0,
    "lines": 42_999,
}


def survey(files: list[Source]) -> dict[str, dict[str, list[str]]]:
    """Return what each count found, "rest" and "language" apart."""
    found = {
        name: {
            part: [hit for source in files if source.is_language == (part == "language") for hit in count(source)]
            for part in ("rest", "language")
        }
        for name, count in COUNTS.items()
    }
    return found | {"import_circles": {"rest": import_circles(files), "language": []}}


def figures(files: list[Source], found: dict[str, dict[str, list[str]]]) -> dict[str, dict[str, int]]:
    """Return the counts, with lines, files and constants beside them."""
    sizes: dict[str, Counter[str]] = {
        "lines": Counter(),
        "files": Counter(),
        "largest_file": Counter(),
        "constants": Counter(),
    }
    for source in files:
        part = "language" if source.is_language else "rest"
        sizes["lines"][part] += source.lines
        sizes["files"][part] += 1
        sizes["largest_file"][part] = max(sizes["largest_file"][part], source.lines)
        sizes["constants"][part] += len(list(constants(source)))
    counted = {name: {part: len(hits) for part, hits in parts.items()} for name, parts in found.items()}
    return counted | {name: dict(size) for name, size in sizes.items()}


def rooms(files: list[Source]) -> str:
    """Return a table of the rooms, highest first, and the arrows between them."""
    drawn, found = house(files), arrows(files)
    level = floors(found)
    rows = [
        f"{room:12}{level[room]:6}{drawn.files[room]:7}{drawn.lines[room]:9,}  {ROOMS[room]}"
        for room in reversed(ROOMS)
    ]
    pairs = {(arrow.at, arrow.to) for arrow in found}
    up = [f"  {arrow.where} -> {arrow.to}, {arrow.when}" for arrow in found if arrow.upwards]
    return "\n".join(
        [
            f"{'room':12}{'floor':>6}{'files':>7}{'lines':>9}",
            *rows,
            f"{len(ROOMS)} rooms on {max(level.values()) + 1} floors, {len(pairs)} arrows, {len(up)} imports upwards, "
            f"{len(import_circles(files))} circles at run time",
            *up,
        ]
    )


def main() -> None:
    """Print the counts, or what one of them found."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--json", nargs="?", const="-", metavar="FILE", help="the counts as JSON, to standard output or a file"
    )
    parser.add_argument(
        "--list", choices=[*COUNTS, "import_circles"], metavar="COUNT", help="what a count found: %(choices)s"
    )
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw the rooms and who imports whom, as SVG")
    parser.add_argument("--rooms", action="store_true", help="the rooms with their lines, floors and arrows")
    given = parser.parse_args()
    files = sources()
    if given.rooms:
        print(rooms(files))
        return
    if given.picture:
        given.picture.write_text(picture(house(files)), encoding="utf-8")
        return
    found = survey(files)
    counted = figures(files, found)
    if given.list:
        for part, hits in found[given.list].items():
            print(f"{part}: {len(hits)}")
            print(*(f"  {hit}" for hit in hits), sep="\n")
    elif given.json:
        text = json.dumps(counted, indent=2) + "\n"
        sys.stdout.write(text) if given.json == "-" else Path(given.json).write_text(text, encoding="utf-8")
    else:
        print(f"{'':28}{'language':>10}{'rest':>10}{'at most':>10}")
        for name, parts in counted.items():
            print(f"{name:28}{parts['language']:10}{parts['rest']:10}{AIMS.get(name, ''):>10}")


if __name__ == "__main__":
    main()
