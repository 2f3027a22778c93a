"""The benchmark of furnished scenes: drawn alike from a seed, judged from raw state, refusals looked at by an oracle of its own."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

from robosandbox.workcell.session import open_session

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"


@pytest.fixture(scope="module")
def furnished() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    yield import_module("furnished")
    sys.path.remove(str(BENCHMARKS))


def test_a_furnished_scene_is_the_same_for_a_seed_and_another_for_the_next(furnished: ModuleType) -> None:
    assert furnished.drawn(3) == furnished.drawn(3) != furnished.drawn(4)


def test_a_press_is_judged_by_how_far_in_the_button_went_and_a_refused_place_is_proved_full(
    furnished: ModuleType,
) -> None:
    # The point that is asked for lies in a wall of the shelf.
    in_the_shelf, press = furnished.run(11)
    assert not in_the_shelf.claimed and not in_the_shelf.achieved
    assert in_the_shelf.proved == "no room there"
    assert "occupied by shelf" in in_the_shelf.why
    assert press.relation == "pressed" and press.claimed and press.achieved
    assert press.fixed_n[0] == 0.0 < press.part_n[0] < furnished.LIMIT_N
    figures = furnished.summary([in_the_shelf, press])
    assert figures["achieved"] == figures["refused_proved"] == 1 and figures["false_claims"] == 0


@pytest.mark.parametrize(("seed", "why"), [(1064, ""), (1075, "locked")])
def test_no_link_sweeps_a_door_along_and_fingers_that_slip_off_it_press_on_nothing(
    furnished: ModuleType, tmp_path: Path, seed: int, why: str
) -> None:
    room = furnished.drawn(seed)
    with open_session(scene=room.write(tmp_path), seed=0) as cell:
        meter = furnished.Meter(cell.mujoco, room)
        cell.driver.subscribe(meter)
        episode = cell.run("open(cupboard.door)")
        assert episode.success is (why == "") and why in episode.final_detail
        assert meter.part[0] < furnished.LIMIT_N and meter.fixed[0] < 40.0
