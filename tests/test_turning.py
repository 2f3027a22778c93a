"""Things are turned over: onto their sides, back on their bases, upside down, judged on the simulated state."""

from __future__ import annotations

import math

import pytest

from robosandbox.errors import SkillError, UnsupportedError
from robosandbox.tasks.goals import GoalReached
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.workcell.session import open_session
from robosandbox.world.contracts import find
from robosandbox.world.facts import fact
from robosandbox.world.predicate import View

CAN = SceneObject(
    id="can", kind="cylinder", size=(0.022, 0.05), pose=Pose(xyz=(0.12, 0.05, 0.091)), mass=0.12, rgba=(1, 0, 0, 1)
)
BLOCK = SceneObject(
    id="block", kind="box", size=(0.025, 0.014, 0.045), pose=Pose(xyz=(0.1, -0.15, 0.086)), mass=0.1, rgba=(0, 0, 1, 1)
)
CUP = SceneObject(id="cup", kind="cup", size=(0.03, 0.08), pose=Pose(xyz=(0.2, 0.0, 0.041)), mass=0.08)
BALL = SceneObject(id="ball", kind="sphere", size=(0.012,), pose=Pose(xyz=(0.2, 0.0, 0.058)), mass=0.01)


@pytest.mark.parametrize("name", ["can", "block"])
def test_a_thing_is_laid_down_and_set_up_and_turned_upside_down_by_words(name: str) -> None:
    with open_session(Scene(objects=(CAN, BLOCK)), what_if=False) as session:
        other = "block" if name == "can" else "can"
        before = session.simulation.truth().objects[other].pose
        for said, upward in (
            (f"lay the {name} on its side", 0.0),
            (f"set the {name} upright", None),
            (f"turn the {name} upside down", None),
        ):
            was = session.simulation.truth().objects[name].pose.rotation[2, 2]
            episode = session.run(said)
            assert episode.success, episode.final_detail
            now = session.simulation.truth().objects[name].pose.rotation[2, 2]
            assert abs(now - upward) < 0.05 if upward is not None else abs(now) > 0.99
            assert "upside" not in said or now * was < 0.0
            # It stands free of the hand.
            assert session.observe().held is None
        assert math.dist(session.simulation.truth().objects[other].pose.xyz, before.xyz) < 0.002


def test_what_is_so_already_is_told_and_nothing_moves() -> None:
    with open_session(Scene(objects=(CAN,)), what_if=False) as session:
        begun = session.driver.time
        assert session.do("set_upright", object="can").detail["already_upright"] is True
        assert session.driver.time == begun
        session.do("lay_down", object="can")
        begun = session.driver.time
        assert session.do("lay_down", object="can").detail["already_lying"] is True
        with pytest.raises(UnsupportedError, match="lies on its side and has no upper end"):
            session.do("flip", object="can")
        assert session.driver.time == begun


def test_nothing_is_turned_whose_contents_would_fall_out() -> None:
    with open_session(Scene(objects=(CUP, BALL)), what_if=False) as session:
        with pytest.raises(SkillError, match="ball"):
            session.do("flip", object="cup")
        assert session.simulation.truth().objects["cup"].pose.rotation[2, 2] > 0.99


@pytest.mark.parametrize(("goal", "skill"), [("lying(can)", "lay_down"), ("upright(can)", "set_upright")])
def test_a_goal_has_it_turned_over_and_is_judged(goal: str, skill: str) -> None:
    with open_session(Scene(objects=(CAN, BLOCK)), what_if=False) as session:
        if skill == "set_upright":
            session.do("lay_down", object="can")
        assert not find(fact(*_parts(goal)), View.of(session.observe())).holds
        episode = session.achieve(goal)
        assert episode.success, episode.final_detail
        assert skill in {step.call.skill for step in episode.steps}
        truth = session.simulation.truth()
        assert GoalReached(kind="goal", relations=goal).evaluate(truth, truth).holds
        assert find(fact(*_parts(goal)), View.of(session.observe())).holds


def _parts(goal: str) -> tuple[str, str]:
    relation, _, rest = goal.partition("(")
    return relation, rest.rstrip(")")
