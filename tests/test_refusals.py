"""Refusals: true, with what was understood, and with a sentence that would work."""

from __future__ import annotations

import re
from functools import cache

import pytest

from robosandbox.agent.planner import StubPlanner
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import ObservedScene, Plan, Refusal
from robosandbox.workcell.session import open_session


@cache
def scene(task: str) -> ObservedScene:
    with open_session(task) as session:
        return session.agent.ctx.look()


def refused(task: str, sentence: str) -> str:
    answer = StubPlanner(load_skills()).plan(sentence, scene(task))
    assert isinstance(answer, Refusal), answer
    return answer.message


@pytest.mark.parametrize(
    ("task", "sentence", "offered"),
    [
        ("clear_to_bin", "paint the red cube green", "pick up the red cube"),
        ("clear_to_bin", "pick up the red cube and juggle it", "pick up the red cube"),
        ("clear_to_bin", "if it rains, put the ball in the bin", "put the ball in the bin"),
        ("put_in_drawer", "put the can in the drawer and lock it", "put the can in the drawer"),
        ("put_in_drawer", "look in the drawer", "open the drawer"),
    ],
)
def test_what_is_offered_works(task: str, sentence: str, offered: str) -> None:
    message = refused(task, sentence)
    assert re.findall("“([^”]*)”", message)[-1] == offered, message
    answer = StubPlanner(load_skills()).plan(offered, scene(task))
    assert isinstance(answer, Plan) and answer.steps


@pytest.mark.parametrize(
    ("task", "sentence", "told"),
    [
        ("clear_to_bin", "don't", "nothing that I could leave|had not begun anything"),
        ("clear_to_bin", "put the cube", "Where should “the cube” go"),
        ("clear_to_bin", "put the ball in the bin when I say so", "what follows “when”"),
        ("clear_to_bin", "turn around", "say which and how far"),
        ("pour_beads", "pour half of the beads into the bowl", "cannot measure a part"),
        ("stack_two", "stack the red cube on itself", "itself"),
        ("put_in_drawer", "if the drawer is open, put the cube in it", "“the drawer is open”: that is not so"),
        ("put_in_drawer", "unless the drawer is closed, tap the can", "“the drawer is closed”: that is so"),
        ("sort_by_colour", "put all the cubes except the red and the blue one in the red bin", "none of red_cube and blue_cube"),
    ],
)  # fmt: skip
def test_refusal_says_what_is_wrong(task: str, sentence: str, told: str) -> None:
    assert re.search(told, refused(task, sentence))


def test_nothing_is_offered_out_of_what_binds() -> None:
    assert "understood" not in refused("clear_to_bin", "never touch the ball, and frobnicate it")
