"""The counts over the source text: what is 0 stays 0, and each count finds what it is for."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
# Counts that are 0 outside the grammar and stay so.
STAY_ZERO = ("import_circles", "kind_comparisons")


@pytest.mark.slow
def test_the_program_prints_every_count() -> None:
    command = [sys.executable, str(BENCHMARKS / "house.py"), "--json"]
    counted = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    assert set(counted) >= {*PLANTED, "import_circles", "lines", "files"}
    assert all(counted[name]["rest"] == 0 for name in STAY_ZERO), "uv run benchmarks/house.py --list NAME"


def test_counts_that_are_zero_stay_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from house_counts import import_circles, kind_comparisons
    from house_sources import sources

    files = [source for source in sources() if not source.is_language]
    assert len(files) > 100
    assert not import_circles(files)
    assert not [hit for source in files for hit in kind_comparisons(source)]


PLANTED = {
    "mujoco_backend_outside_sim": ("def f(sim: 'MuJoCoBackend'): ...", '"""A MuJoCoBackend."""'),
    "mujoco_imports_elsewhere": ("def f():\n    from mujoco import viewer", "import mujoco_menagerie"),
    "kind_comparisons": ("AB = ('box', 'bin')\nx = item.kind in AB", "x = joint.kind == 'slide'"),
    "long_files": ("\n" * 351, "\n" * 350),
    "long_functions": ("def f():\n" + "    a\n" * 60, "def f():\n" + "    a\n" * 59),
    "complex_functions": ("def f():\n" + "    if a: b\n" * 15, "def f():\n" + "    if a: b\n" * 14),
    "constants_without_source": (
        "# How far.\nA = 0.3",
        "# Metres, measured with benchmarks/ik.py.\nA = 0.3\nB = 2 * A\nUP = (0, 0, -1)",
    ),
}


@pytest.mark.parametrize("name", PLANTED)
def test_each_count_finds_what_it_is_for(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from house_counts import COUNTS
    from house_sources import Source

    assert set(COUNTS) == set(PLANTED)
    hit, miss = (Source("skills/planted.py", text) for text in PLANTED[name])
    assert len(list(COUNTS[name](hit))) == 1
    assert not list(COUNTS[name](miss))


def test_modules_that_load_each_other_are_a_circle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from house_counts import import_circles
    from house_sources import Source

    first = Source("skills/a.py", "from robosandbox.skills import b")
    lazy = Source("skills/b.py", "def f():\n    import robosandbox.skills.a")
    assert not import_circles([first, lazy])
    assert import_circles([first, Source("skills/b.py", "import robosandbox.skills.a")]) == [
        "robosandbox.skills.a <-> robosandbox.skills.b"
    ]
