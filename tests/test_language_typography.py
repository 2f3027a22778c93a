"""Plain text: what is passed over for want of a cue has nothing to rewrite."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from robosandbox.agent.language.typography import _CUED, plain_text

PROMPTS = sorted((Path(__file__).parent / "prompts").glob("*.yaml"))[::8]


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("Don't touch it", "do not touch it"),
        ("dont", "do not"),
        ("that's gonna do", "that is going to do"),
        ("put it infront of the café", "put it in front of the cafe"),
        ("can't, cannot", "can not, can not"),
        ("gimme da cube n the ball", "give me the cube and the ball"),
        ("w/o the cup, w/ the can", "without the cup, with  the can"),
        ("the ball 5 cm bwd, cos i said so", "the ball 5 cm backward, because i said so"),
        ("the red cube left and the blue one right of the bowl",
         "the red cube to the left of the bowl and the blue one to the right of the bowl"),
    ],
)  # fmt: skip
def test_text_is_in_full_words(text: str, plain: str) -> None:
    assert plain_text(text) == plain


def test_every_contraction_has_its_cue_where_it_is_found() -> None:
    sentences = [
        str(text).lower()
        for path in PROMPTS
        for texts in yaml.safe_load(path.read_text(encoding="utf-8"))["prompts"].values()
        for text in texts
    ]
    assert len(sentences) > 500
    missed = [
        (pattern.pattern, text)
        for text in sentences
        for cues, pattern, _ in _CUED
        if not any(cue in text for cue in cues) and pattern.search(text)
    ]
    assert not missed


def test_most_contractions_are_passed_over_in_a_plain_sentence() -> None:
    tried = [pattern for cues, pattern, _ in _CUED if any(cue in "put the red cube in the bowl" for cue in cues)]
    assert len(tried) < len(_CUED) / 3
