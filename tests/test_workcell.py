"""A workcell in Python, in this process and over Zenoh: sentences and their answers, single calls, goals, the way back."""

from collections.abc import Iterator

import numpy as np
import pytest
from support.processes import SimProcess

from robosandbox.errors import InputError, InvalidArgumentError, UnreachableError
from robosandbox.types import Plan, Refusal, SkillCall
from robosandbox.workcell.session import open_session
from robosandbox.workcell.workcell import Workcell
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell


@pytest.fixture(scope="module", params=["local", "remote"])
def opened(request: pytest.FixtureRequest) -> Iterator[Workcell]:
    if request.param == "local":
        with open_session("pick_from_three") as cell:
            yield cell
        return
    with SimProcess("--task", "pick_from_three", "--pace", "fast") as sim, connect(sim.endpoint) as client:
        yield RemoteWorkcell(client.robot())


@pytest.fixture
def cell(opened: Workcell) -> Workcell:
    opened.reset()
    return opened


def test_a_question_is_answered_by_the_next_sentence(cell: Workcell) -> None:
    asked = cell.run("pick up the cube")
    assert asked.refusal is not None and asked.refusal.candidates == ("red_cube", "green_cube", "blue_cube")
    assert str(cell.run("the left one").plan) == "pick(object=blue_cube)"
    assert "green_cube" in str(cell.run("no, the green one").plan)


def test_a_skill_is_called_like_a_method(cell: Workcell) -> None:
    assert cell.pick("red_cube").skill == "pick"  # type: ignore[attr-defined]
    assert cell.do("place_at", x=0.2, y=-0.2).skill == "place_at"
    with pytest.raises(TypeError, match=r"pick takes object, to, on; 4 were given"):
        cell.pick("red_cube", "any", False, "blue_cube")  # type: ignore[attr-defined]
    with pytest.raises(InvalidArgumentError, match=r"no skill 'juggle'; there is .*pick"):
        cell.do("juggle")
    with pytest.raises(AttributeError, match="juggle"):
        cell.juggle()  # type: ignore[attr-defined]


def test_the_hand_is_moved_by_itself(cell: Workcell) -> None:
    cell.do("move_to", x=0.2, y=0.1, z=0.3)
    assert np.allclose(cell.state().tcp_pose.xyz, (0.2, 0.1, 0.3), atol=0.003)
    cell.do("close_gripper")
    assert cell.state().gripper.width < 0.01  # type: ignore[union-attr]
    with pytest.raises(UnreachableError):
        cell.do("move_to", x=2.0, y=0.0, z=0.3)
    assert "move_to" not in {skill.name for skill in cell.skills}, "planners do not plan with it"


def test_calls_as_they_are_printed_can_be_said(cell: Workcell) -> None:
    episode = cell.run("pick(red_cube), place_on(target=blue_cube); move_to(x=0.1, y=0.0, z=0.4)")
    assert episode.success and len(episode.steps) == 3
    assert not cell.run("pick(moon)").success


def test_goals_are_planned_for_and_carried_out(cell: Workcell) -> None:
    assert cell.achieve("on(red_cube, blue_cube)").success
    with pytest.raises(InputError, match="no relation"):
        cell.achieve("beyond(red_cube, blue_cube)")


def test_plans_are_made_checked_and_tried_without_a_motion(cell: Workcell) -> None:
    before = cell.state().q
    plan = cell.plan("put the red cube on the blue one")
    assert isinstance(plan, Plan) and not cell.check(plan)
    assert isinstance(cell.plan("pick up the banana"), Refusal)
    (problem,) = cell.check(Plan(steps=(SkillCall(skill="place_on", arguments={"target": "blue_cube"}),)))
    assert "the gripper is empty" in str(problem)
    assert cell.simulate(plan)["ok"]
    np.testing.assert_array_equal(cell.state().q, before)


def test_what_was_done_is_undone_one_by_one(cell: Workcell) -> None:
    ways = cell.ways_back
    at = {item.id: item.pose.xyz for item in cell.observe().objects}
    cell.run("where is the red cube?")
    assert cell.ways_back == ways, "a question moves nothing"
    cell.run("put the red cube on the blue cube")
    cell.do("push", object="green_cube", direction="forward", distance=0.05)
    assert cell.undo().startswith("push(") and cell.undo() == "put the red cube on the blue cube"
    for item in cell.observe().objects:
        np.testing.assert_allclose(item.pose.xyz, at[item.id], atol=1e-3)
    assert cell.undo() == "reset to seed 0"
    while cell.ways_back:
        cell.undo()
    with pytest.raises(InputError, match="nothing to undo"):
        cell.undo()
