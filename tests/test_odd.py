"""The benchmark of odd scenes: drawn alike from a seed, measured from raw contacts, one of each family now and then."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"


@pytest.fixture(scope="module")
def odd() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    yield import_module("odd")
    sys.path.remove(str(BENCHMARKS))


def test_a_scene_is_the_same_for_a_seed_and_another_for_the_next(odd: ModuleType) -> None:
    for name in odd.FAMILIES:
        assert odd.drawn(name, 3) == odd.drawn(name, 3) != odd.drawn(name, 4)
        assert odd.drawn(name, 3).subject in {item.id for item in odd.drawn(name, 3).objects}


def test_an_episode_is_measured_from_raw_contacts(odd: ModuleType) -> None:
    row = odd.run("sizes", 1)
    assert row.claimed and row.done and row.judged and row.possible and not row.stuck
    assert 0.0 < row.named_n < odd.LIMIT_N and row.unnamed_n == row.bin_mm == 0.0
    figures = odd.summary([row])
    assert figures["done"] == figures["can_be_done"] == 1 and figures["false_claims"] == figures["judges_differ"] == 0


@pytest.mark.parametrize(
    ("family", "seed"),
    [
        pytest.param("touching", 61, id="a hand that leans beside neighbours"),
        pytest.param("push", 94, id="7.6 kg that stick and slide"),
        pytest.param("drawers", 167, id="a grip between two fingers"),
    ],
)
def test_the_robot_keeps_its_limit_at_every_moment(odd: ModuleType, family: str, seed: int) -> None:
    row = odd.run(family, seed, oracle=False)
    assert row is not None and row.claimed and row.done
    assert 0.0 < row.named_n <= odd.OVER * odd.LIMIT_N


def test_no_grasp_is_tried_whose_fingers_reach_into_what_they_are_to_hold(odd: ModuleType) -> None:
    # Straight down the drawer is in the hand's way; at a slant the open fingers would come down on the box.
    row = odd.run("drawers", 236, oracle=False)
    assert row is not None and row.unnamed_n < odd.UNNAMED_N


@pytest.mark.slow
def test_one_of_each_family_runs_and_its_figures_add_up(odd: ModuleType) -> None:
    rows = [row for name in sorted(odd.FAMILIES) if (row := odd.run(name, 0)) is not None]
    figures = odd.summary(rows)
    assert figures["episodes"] == len(rows) >= 10
    assert figures["done"] <= figures["can_be_done"] <= len(rows)
    assert figures["refusals_right"][0] <= figures["refusals_right"][1] <= len(rows)


@pytest.mark.slow
def test_the_oracle_holds_what_can_be_held_and_not_what_cannot(odd: ModuleType) -> None:
    scenes, task = import_module("odd_scenes"), odd._task
    can_hold = import_module("odd_oracle").can_hold
    for size, holds in ((0.02, True), (0.05, False)):
        red = scenes.thing("red_box", "box", (size, size, size), (0.15, 0.0))
        case = scenes.Odd(family="x", seed=0, prompt="go home", objects=(red,), subject="red_box", goal="held")
        with odd.open_session(task(case)) as session:
            assert can_hold(session.mujoco, case, session.ctx.planning(session.observe())) is holds
