"""What a sentence binds a model to, of sentences that the grammar does not understand: nothing forbidden is let through, nothing else is bound."""

import sys
from pathlib import Path
from typing import Any

import pytest

from robosandbox.agent.language.bounds import Bounds, bounds_of
from robosandbox.types import ObservedScene

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
bounds, sentences = __import__("bounds"), __import__("sentences")
LEARNED, load_prompts = sentences.LEARNED, sentences.load_prompts

FILES = {file.stem: file for file in bounds.BOUNDS}
SCENE = load_prompts(FILES["workshop"])[0].scene
# Of 92 sentences that forbid something. "Until I come back" and a bare "not the red one" are not read.
_MISSED = 3
_WRONG = 0
# How many sentences of a file bind a model more than they should.
_OVER_STRICT = {
    **dict.fromkeys(("band_room", "blocks", "everyday", "fresh_65_3", "fresh_68_3", "fresh_70_1", "games"), 1),
    **dict.fromkeys(("household", "market_stall", "pharmacy_trial", "stacks_strict", "trade_fair"), 1),
    # "Should that not be there, take ...".
    "more_talk_clutter_pick": 1,
    "kitchen_and_depot": 2,
}


@pytest.fixture(scope="module")
def rows() -> list[Any]:
    return [row for file in bounds.BOUNDS for row in bounds.of_bounds(file)]


def test_nothing_is_bound_that_is_not_forbidden(rows: list[Any]) -> None:
    wrong = [row.text for row in rows if row.wrong]
    assert len(wrong) <= _WRONG, wrong


def test_what_is_forbidden_is_bound(rows: list[Any]) -> None:
    missed = [row.text for row in rows if row.missed]
    assert len(missed) <= _MISSED, missed


@pytest.mark.sample(every=12)
@pytest.mark.parametrize("file", LEARNED, ids=[file.stem for file in LEARNED])
def test_what_binds_lets_a_right_plan_pass(file: Path) -> None:
    wrong = [row for row in bounds.of_prompts(file) if row.wrong]
    assert len(wrong) <= _OVER_STRICT.get(file.stem, 0), wrong


def said(prompt: str, scene: ObservedScene = SCENE) -> Bounds:
    return bounds_of(prompt, scene, ["pick", "place_in", "place_on"])


@pytest.mark.parametrize(
    ("prompt", "never"),
    [
        ("jazz it up, don't touch the red cube", {"red_cube"}),
        ("the red cube is fragile, so don't touch it; jazz up the rest", {"red_cube"}),
        ("jazz up the red cube, the other cubes stay where they are", {"green_cube", "blue_cube"}),
        # What may not hold, was only told of, or is taken back, binds nobody.
        ("if it is hot, don't touch the red cube and jazz up the rest", set()),
        ("don't touch the red cube unless you must, and jazz it up", set()),
        ("jazz it up, and do not touch the red cube. Sorry, I was joking", set()),
        ("mother says not to touch the red cube, jazz it up", set()),
        ("leave the red cube to the left of the bin and jazz it up", set()),
        ("jazz up everything but the red cube, which goes in the bin and jazz that up", set()),
    ],
)
def test_bounds_of_a_sentence(prompt: str, never: set[str]) -> None:
    assert said(prompt) == Bounds(never=frozenset(never))


def test_only_allows_what_it_names() -> None:
    assert said("you may only move the red cube and the ball; jazz it up").only == {"red_cube", "yellow_ball"}
    assert said("touch the red cube only gently and jazz it up") == Bounds()
