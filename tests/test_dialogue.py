"""Replies: what answers a question or follows an order, and is no sentence of its own."""

from __future__ import annotations

from functools import cache

import pytest

from robosandbox import open_session
from robosandbox.agent.planner import StubPlanner
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import ObservedScene, Plan, Refusal

AFTER_AN_ORDER = {
    ("tap the red cube", "again"): ["tap(object=red_cube)"],
    ("tap the red cube", "do it once more, please"): ["tap(object=red_cube)"],
    ("tap the red cube", "three times"): ["tap(object=red_cube)"] * 3,
    ("tap the red cube", "two more times"): ["tap(object=red_cube)"] * 2,
    ("tap the red cube", "the same with the cyan one"): ["tap(object=cyan_cube)"],
    ("tap the red cube", "sorry, I meant the cyan one"): ["tap(object=cyan_cube)"],
    ("tap the red cube", "not that one, the cyan one"): ["tap(object=cyan_cube)"],
    ("tap the cube", "it's the cyan one"): ["tap(object=cyan_cube)"],
    ("tap the cube", "never mind"): [],
    ("push the red cube to the left", "no, to the right"): ["push(object=red_cube, direction=right, distance=0.1)"],
    ("put the red cube in the bin", "no, on the white block"): [
        "pick(object=red_cube)",
        "place_on(target=white_block)",
    ],
    ("put the red cube in the bin", "the yellow ball too"): [
        "pick(object=yellow_ball)",
        "place_in(container=grey_bin)",
    ],
    ("Tipp den roten Würfel an.", "Noch einmal."): ["tap(object=red_cube)"],
    ("Tipp den roten Würfel an.", "Dreimal."): ["tap(object=red_cube)"] * 3,
    ("Tipp den roten Würfel an.", "Nein, den blauen."): ["tap(object=blue_cube)"],
    ("tap the red cube", "take the yellow ball"): ["pick(object=yellow_ball)"],
    # What would be done by itself is no answer to a question that is open.
    ("open and close the gripper again and again", "tap the red cube three times"): ["tap(object=red_cube)"] * 3,
    ("tap the red cube over and over", "twice"): ["tap(object=red_cube)"] * 2,
    ("put the ball", "in the bin"): ["pick(object=yellow_ball)", "place_in(container=grey_bin)"],
}


@cache
def scene() -> ObservedScene:
    with open_session("clear_to_bin") as session:
        return session.agent.ctx.look()


@pytest.mark.parametrize(("order", "reply"), AFTER_AN_ORDER)
def test_reply_is_about_what_was_said_before(order: str, reply: str) -> None:
    planner = StubPlanner(load_skills(), dialogue=True)
    planner.plan(order, scene())
    plan = planner.plan(reply, scene())
    assert isinstance(plan, Plan), plan
    assert [str(call) for call in plan.steps] == AFTER_AN_ORDER[order, reply]


@pytest.mark.parametrize("reply", ["slower", "continue", "not the red one", "the other one"])
def test_what_is_no_reply_is_not_guessed_at(reply: str) -> None:
    planner = StubPlanner(load_skills(), dialogue=True)
    planner.plan("tap the red cube", scene())
    assert isinstance(planner.plan(reply, scene()), Refusal)


@pytest.mark.parametrize(
    "reply", ["again", "three times", "no, to the right", "never mind", "the same with the red cube"]
)
def test_a_reply_to_nothing_is_refused(reply: str) -> None:
    assert isinstance(StubPlanner(load_skills(), dialogue=True).plan(reply, scene()), Refusal)
