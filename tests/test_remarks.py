"""Orders of the hand with remarks beside them."""

from __future__ import annotations

import pytest

from robosandbox.agent.language.remarks import without_remarks

IDS = ("red_cube", "green_cube", "blue_cube")


@pytest.mark.parametrize(
    ("said", "left"),
    [
        ("My pen rolled under you, wait ten seconds, then go up 5 cm.", "wait ten seconds, then go up 5 cm."),
        ("go up 10 cm, the camera crew is filming", "go up 10 cm."),
        ("Go down 5 cm so I can see the difference", "Go down 5 cm"),
        ("open your hand three times, like when you wave bye-bye to a baby!", "open your hand three times!"),
        ("I want to hear if the bearing squeaks: turn joint 7 by 10 degrees", "turn joint 7 by 10 degrees"),
    ],
)
def test_a_remark_is_left_out(said: str, left: str) -> None:
    plain, remarks = without_remarks(said, IDS)
    assert plain == left
    assert remarks


@pytest.mark.parametrize(
    "said",
    [
        "go up 5 cm, I changed my mind",
        "tap the red cube, while I hold it",
        "pick up a cube, mine is the blue one",
        "go up 5 cm, but my wife said not to",
        "wait, I need a circle of 5 cm",
        "put it there, it is not the red one",
        "go up, it has to be 10 cm",
        "when I clap my hands, start moving upwards",
        "I'll do it myself, go home",
        "the moment my tea is ready, go up 5 cm",
    ],
)
def test_what_may_be_meant_is_no_remark(said: str) -> None:
    assert without_remarks(said, IDS) == (said, ())
