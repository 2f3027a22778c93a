"""Conditions, counts and loops carried out in simulation: the outcomes are of their scenes, and the judge tells right from wrong."""

from __future__ import annotations

import pytest
import yaml
from support.scored import executed

from robosandbox.tasks.loader import find_task

SENTENCES = yaml.safe_load(executed.CONDITIONS.read_text(encoding="utf-8"))


def test_there_are_a_hundred() -> None:
    assert sum(map(len, SENTENCES.values())) == 100


@pytest.mark.parametrize("name", SENTENCES)
def test_outcomes_are_about_what_is_there(name: str) -> None:
    task = find_task(name)
    ids = {item.id for item in task.scene.objects}
    for outcome in "|".join(SENTENCES[name].values()).split("|"):
        assert {check for check, _ in executed._checks(outcome)} <= {*executed.FIELDS, "times", "nothing"}
        named = {value for check, arguments in executed._checks(outcome) for value in arguments[check == "times" :]}
        assert {value for value in named if value.isidentifier()} - {"left", "right", "forward", "back"} <= ids, outcome
        executed._criterion(outcome, task)


def test_what_came_out_otherwise_is_wrong() -> None:
    told = {
        "tap the can": "times(tap, can, 1)",
        "tap the red cube": "times(tap, can, 1)",
        "put the red cube on the blue cube": "on(blue_cube, red_cube) | on(red_cube, blue_cube)",
        "put the red cube on the can": "nothing()",
    }
    assert [row["right"] for row in executed.rows({"tap_cube": told})] == [True, False, True, False]
