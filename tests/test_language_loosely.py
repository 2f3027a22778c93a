"""Loose reading: what a verb has around it counts, not its order; what may bind or is not known is never left out."""

from __future__ import annotations

import pytest

from robosandbox.agent.language.loosely import loosely
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.tokens import scene_words, tokenize

_WORDS = scene_words(("red_cube", "blue_cube", "can", "glass_ball", "bin", "drawer", "mat"))


def _read(prompt: str) -> str:
    return " ".join(loosely(Said(tokenize(prompt, _WORDS), _WORDS)).texts).replace(" .", ".")


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("can bin inside put", "put can in bin"),
        ("could you the can to the bin bring?", "put the can in the bin"),
        ("the can you must putting in the bin", "put the can in the bin"),
        ("make that the can comes in the bin", "put the can in the bin"),
        ("take the ball of glass", "pick up glass_ball"),
        ("the cube who is red, take it", "pick up the red cube"),
        ("make touch on the can", "touch the can"),
        ("the can at the mat put", "put the can on the mat"),
        ("drawer must be open", "open drawer"),
        ("not touch the can, take the ball", "not touch the can , take the ball"),
    ],
)
def test_a_verb_takes_what_is_around_it_by_what_it_is(said: str, plain: str) -> None:
    assert _read(said).replace("the glass_ball", "glass_ball") == plain


@pytest.mark.parametrize(
    "said",
    [
        "can bin inside put only if it is red",
        "the can maybe in the bin put",
        "I put the can in the bin",
        "the can is in the bin",
        "has the can been put in the bin",
        "the can must not be touched",
        "throw the can at the cube",
        "the can must stay closed",
        "the can frobnicate in the bin put",
        "can ball bin put",
        "ball touch, then can not touch",
        "ball touch, then can bin inside",
        "ball touch, then can bin inside put",
        "can bin inside put, ball touch first",
    ],
)
def test_what_may_bind_or_is_not_known_leaves_a_sentence_as_it_is(said: str) -> None:
    assert loosely(sentence := Said(tokenize(said, _WORDS), _WORDS)) is sentence
