"""Faults at random moments of real episodes: recovered, or refused at once with the cause."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest
from support.cases import HOPELESS, RECOVERABLE, draw_perturbation

# Enough of them to notice when one breaks; rates are the bench's.
SEEDS = {"toppled": 1, "occupied": 1, "just_too_far": 1}


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    path = Path(__file__).parent.parent / "benchmarks" / "recovery.py"
    spec = importlib.util.spec_from_file_location("recovery_bench", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", [case.name for case in RECOVERABLE])
@pytest.mark.sample(every=3)
def test_what_can_be_recovered_from_is(bench: ModuleType, name: str) -> None:
    row = bench.run(name, SEEDS.get(name, 2), what_if=True)
    assert row.done and row.claimed, row.detail
    assert row.contacts.get("table", (0.0,))[0] < 5.0 and row.contacts.get("itself", (0.0,))[0] < 5.0


@pytest.mark.parametrize("name", [case.name for case in HOPELESS])
def test_what_cannot_be_helped_is_refused_at_once_with_its_cause(bench: ModuleType, name: str) -> None:
    row = bench.run(name, 1, what_if=True)
    assert row.hopeless and not row.done
    assert row.refused_rightly, f"{row.errors}: {row.detail}"


def test_a_hand_that_touches_the_object_from_the_start_plans_to_an_end(bench: ModuleType) -> None:
    row = bench.run("mislocated", 49, what_if=True)
    assert row.done and row.claimed and row.cpu_secs < 30.0, row.detail


@pytest.mark.slow
def test_same_seed_gives_the_same_episode(bench: ModuleType) -> None:
    one, other = (bench.run("crowded", 2, what_if=True) for _ in range(2))
    assert (one.about, one.errors, one.detail, one.sim_secs) == (
        other.about,
        other.errors,
        other.detail,
        other.sim_secs,
    )


def test_faults_are_drawn_with_a_range_of_magnitudes_and_moments() -> None:
    drawn = [draw_perturbation(RECOVERABLE[0], seed)[1] for seed in range(3)]
    assert (
        len({perturbation.about for perturbation in drawn}) == 3
        and len({perturbation.at for perturbation in drawn}) == 3
    )
