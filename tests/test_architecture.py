"""docs/architecture.md: every file and function on the way exists, and its picture can be drawn."""

import ast
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))

from house_rooms import ROOMS

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "architecture.md"
HOP = re.compile(r"^\| [^|]+ \| `([\w/.]+\.py)` \| `([\w.]+)` \|$")


def hops() -> list[tuple[str, str]]:
    """Return the page's rows: a file and a function in it."""
    return [(row[1], row[2]) for line in PAGE.read_text(encoding="utf-8").splitlines() if (row := HOP.match(line))]


def test_the_page_walks_four_ways() -> None:
    ways = PAGE.read_text(encoding="utf-8").split("\n## ")[1:]
    assert [way.splitlines()[0] for way in ways] == [
        "From a sentence to a motor",
        "From a sidecar's field to a motor",
        "From a goal to its result",
        "From a pixel to an object",
    ]
    for way in ways:
        # Each row of a table is a hop: none is lost to a slip of the pen.
        rows = [line for line in way.splitlines() if line.startswith("|")][2:]
        assert len(rows) >= 10 and all(HOP.match(line) for line in rows), way.splitlines()[0]


@pytest.mark.parametrize(("file", "function"), hops(), ids=[function for _, function in hops()])
def test_each_hop_is_a_function_of_its_file(file: str, function: str) -> None:
    inside: list[ast.stmt] = ast.parse((ROOT / file).read_text(encoding="utf-8")).body
    for name in function.split("."):
        found = [
            node
            for node in inside
            if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.name == name
        ]
        assert found, f"{file} has no {function}"
        inside = found[0].body


def test_the_picture_has_a_box_for_each_room_above_what_it_imports(tmp_path: Path) -> None:
    drawing = tmp_path / "house.svg"
    command = [sys.executable, str(ROOT / "benchmarks" / "house.py"), "--picture", str(drawing)]
    subprocess.run(command, check=True, capture_output=True)
    for svg in (drawing, ROOT / "docs" / "house.svg"):
        heights = {
            node.text: float(node.attrib["y"])
            for node in ElementTree.parse(svg).iter("{http://www.w3.org/2000/svg}text")
            if node.attrib.get("font-weight") == "bold"
        }
        assert set(heights) == {*ROOMS}, svg
        assert (
            heights["apps"]
            < heights["workcell"]
            < heights["agent"]
            < heights["skills"]
            < heights["sim"]
            < heights["core"]
        )
