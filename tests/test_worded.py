"""Skills that say themselves how people ask for them: `turn`, and one of an outside package."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from types import ModuleType

import pytest
from support.performing import perform

from robosandbox.agent.agent import Agent
from robosandbox.agent.planner import StubPlanner
from robosandbox.apps.conformance import check_skill
from robosandbox.errors import CollisionError, SkillError
from robosandbox.skills.turn import Turn
from robosandbox.types import Plan, Pose, Refusal, RefusalCode, Scene, SceneObject, SkillCall, SkillResult
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.changes import turn_between
from robosandbox.world.verifier import verify

NUDGE = Path(__file__).parents[1] / "examples" / "skills" / "nudge_upright" / "src" / "nudge_upright" / "__init__.py"
FALLEN = SceneObject(
    id="can",
    kind="cylinder",
    size=(0.025, 0.05),
    pose=Pose(xyz=(0.15, 0.0, 0.066), quat_xyzw=(0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))),
    mass=0.1,
)
BLOCK = SceneObject(id="block", kind="box", size=(0.03, 0.018, 0.02), pose=Pose(xyz=(0.1, -0.2, 0.06)), mass=0.1)
BALL = SceneObject(id="ball", kind="sphere", size=(0.02,), pose=Pose(xyz=(0.15, 0.2, 0.06)), mass=0.05)


def outside() -> ModuleType:
    """Return the example package, as if it were installed."""
    spec = importlib.util.spec_from_file_location("nudge_upright", NUDGE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def still() -> EmbeddedWorkcell:
    """A world that no test moves."""
    return open_session(Scene(objects=(FALLEN, BLOCK, BALL)), what_if=False)


@pytest.mark.parametrize(
    ("said", "planned"),
    [
        ("turn the block by 45 degrees", [("turn", {"object": "block", "angle": 0.785398})]),
        ("please rotate the block 90° clockwise", [("turn", {"object": "block", "angle": -1.570796})]),
        ("spin the block a quarter turn to the left", [("turn", {"object": "block", "angle": 1.570796})]),
        ("turn the block parallel to the can", [("turn", {"object": "block", "align_with": "can"})]),
        ("align the block with the can and tap it", [("turn", {"object": "block", "align_with": "can"}), ("tap", {"object": "block"})]),
        ("nudge the can upright, then rotate the block by 0.5 radians", [("nudge_upright", {"object": "can"}), ("turn", {"object": "block", "angle": 0.5})]),
        ("tip the can up", [("nudge_upright", {"object": "can"})]),
    ],
)  # fmt: skip
def test_words_make_a_skill_sayable(
    still: EmbeddedWorkcell, said: str, planned: list[tuple[str, dict[str, object]]]
) -> None:
    planner = StubPlanner([*still.skills, outside().NudgeUpright()])
    answer = planner.plan(said, still.observe())
    assert isinstance(answer, Plan), answer
    assert [(call.skill, call.arguments) for call in answer.steps] == planned


def test_what_was_not_said_is_asked_for_and_what_is_not_there_is_not_planned(still: EmbeddedWorkcell) -> None:
    asked = StubPlanner(still.skills).plan("turn the block", still.observe())
    assert isinstance(asked, Refusal) and asked.code is RefusalCode.AMBIGUOUS and "angle" in asked.message
    without = [skill for skill in still.skills if skill.name != "turn"]
    refused = StubPlanner(without).plan("turn the block by 45 degrees", still.observe())
    assert isinstance(refused, Refusal) and refused.code is RefusalCode.UNSUPPORTED


def test_verifier_and_agent_hold_them_to_their_contracts(still: EmbeddedWorkcell) -> None:
    nudge = outside().NudgeUpright()
    skills = [*still.skills, nudge]
    agent = Agent(still.ctx, skills, StubPlanner(skills))
    refused = agent.plan("turn the ball by 90 degrees")
    assert isinstance(refused, Refusal) and "looks the same" in refused.message
    steps = [("nudge_upright", {"object": "can"}), ("stack", {"object": "block", "target": "can"})]
    plan = Plan(steps=tuple(SkillCall(skill=name, arguments=arguments) for name, arguments in steps))
    assert not verify(plan, still.observe(), skills).problems
    # Without it the can lies: nothing stays on its round side.
    (problem,) = verify(Plan(steps=plan.steps[1:]), still.observe(), skills).problems
    assert problem.relation.relation == "supports"


@pytest.mark.parametrize("angle", [2.0, math.pi])
def test_turn_turns_by_an_angle_where_the_object_stands(angle: float) -> None:
    with open_session(Scene(objects=(BLOCK,)), what_if=False) as session:
        before = session.observe().objects[0]
        assert isinstance(check_skill(Turn(), session.ctx, {"object": "block", "angle": angle}), SkillResult)
        after = session.observe().objects[0]
        assert abs(math.remainder(turn_between(before, after) - angle, math.tau)) < math.radians(3.0)
        assert math.dist(before.pose.xyz, after.pose.xyz) < 0.01


def test_turn_refuses_before_anything_moves() -> None:
    above = SceneObject(id="above", kind="box", size=(0.01,) * 3, pose=Pose(xyz=(0.1, -0.2, 0.0915)), mass=0.02)
    with open_session(Scene(objects=(BLOCK, above)), what_if=False) as session:
        before = session.driver.time
        with pytest.raises(CollisionError, match="above stands on block"):
            perform(session.ctx, Turn(), {"object": "block", "angle": 1.0})
        assert session.driver.time == before


def test_outside_skill_rights_a_fallen_can_by_its_sentence() -> None:
    with open_session(Scene(objects=(FALLEN,)), what_if=False) as session:
        skills = [*session.skills, outside().NudgeUpright()]
        episode = Agent(session.ctx, skills, StubPlanner(skills)).run("nudge the can upright")
        assert episode.success, episode.final_detail
        rotation = session.observe().objects[0].pose.rotation
        assert abs(rotation[2, 2]) > math.cos(math.radians(5.0))


ABOVE = SceneObject(id="above", kind="box", size=(0.012,) * 3, pose=Pose(xyz=(0.1, -0.2, 0.0935)), mass=0.02)
SIDES = tuple(
    SceneObject(id=f"side_{k}", kind="box", size=(0.06, 0.02, 0.04), pose=Pose(xyz=(0.15, y, 0.081)), mass=0.05)
    for k, y in enumerate((-0.048, 0.048))
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("call", "objects", "aside"),
    [
        (SkillCall(skill="turn", arguments={"object": "block", "angle": 1.0}), (BLOCK, ABOVE), {"above"}),
        (SkillCall(skill="nudge_upright", arguments={"object": "can"}), (FALLEN, *SIDES), {"side_0", "side_1"}),
    ],
)
def test_they_have_repairs_that_bring_about_what_they_promise(
    call: SkillCall, objects: tuple[SceneObject, ...], aside: set[str]
) -> None:
    with open_session(Scene(objects=objects)) as session:
        nudge = outside().NudgeUpright()
        session.agent.skills[nudge.name] = nudge
        with pytest.raises(SkillError) as failed:
            session.agent.perform(call)
        repair = failed.value.repairs[0]
        assert repair.calls[-1].skill == call.skill
        assert {one.arguments["object"] for one in repair.calls if "object" in one.arguments} & aside
        for one in repair.calls:
            session.agent.perform(one)
