from dataclasses import replace

import numpy as np
import pytest
from support.performing import perform

from robosandbox.agent.context import AgentContext
from robosandbox.agent.planner import StubPlanner
from robosandbox.apps.conformance import check_planner, check_skill
from robosandbox.driver import Driver
from robosandbox.errors import (
    AlreadyHoldingError,
    FaultError,
    GraspError,
    InvalidArgumentError,
    LimitError,
    NotHoldingError,
    ObjectNotFoundError,
    Phase,
    PlacementError,
    SkillError,
    UnreachableError,
)
from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.skills.base import Skill
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.primitives.abilities import RobotAbilities
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import ObservedScene, Plan, Pose, Scene, SceneObject, SkillResult
from robosandbox.workcell.session import open_session
from robosandbox.world.abilities import LateAbilities
from robosandbox.world.facts import parse_facts
from robosandbox.world.goal_plan import plan_for
from robosandbox.world.relations import beside, inside, on_top

SKILLS = {skill.name: skill for skill in load_skills()}
OBJECTS = (
    SceneObject(
        id="red_cube", kind="box", size=(0.015,) * 3, pose=Pose(xyz=(0.15, -0.15, 0.06)), rgba=(0.85, 0.2, 0.2, 1)
    ),
    SceneObject(id="block", kind="box", size=(0.03, 0.03, 0.02), pose=Pose(xyz=(0.2, 0.05, 0.062)), mass=0.3),
    SceneObject(id="bin", kind="bin", size=(0.06, 0.06, 0.05), pose=Pose(xyz=(0.1, 0.25, 0.042)), mass=0.4),
    SceneObject(id="far", kind="box", size=(0.015,) * 3, pose=Pose(xyz=(0.5, 0.5, 0.06))),
    SceneObject(id="wide", kind="box", size=(0.06, 0.06, 0.02), pose=Pose(xyz=(0.3, -0.2, 0.062)), mass=0.2),
)


@pytest.fixture
def ctx():
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=OBJECTS))
        yield AgentContext(
            sim=sim, perception=GroundTruthPerception(), grasp=AnalyticTopDown(), motion=DLSMotionPlanner()
        )


def truth(ctx, name):
    return ctx.driver.simulation.truth().objects[name].detected()


def test_lift_raises_cube_by_over_50_mm(ctx):
    before = truth(ctx, "red_cube").pose.xyz[2]
    result = perform(ctx, SKILLS["pick"], {"object": "red_cube"})
    assert truth(ctx, "red_cube").pose.xyz[2] - before > 0.05
    assert result.detail["dz_mm"] == pytest.approx(1000 * (truth(ctx, "red_cube").pose.xyz[2] - before), abs=1.0)


def test_what_no_hand_that_points_down_reaches_is_picked_leaning():
    cube = SceneObject(id="cube", kind="box", size=(0.015,) * 3, pose=Pose(xyz=(0.48, 0.48, 0.06)))
    with MuJoCoBackend() as sim:
        sim.load(Scene(objects=(cube,)))
        ctx = AgentContext(
            sim=sim, perception=GroundTruthPerception(), grasp=AnalyticTopDown(), motion=DLSMotionPlanner()
        )
        perform(ctx, SKILLS["pick"], {"object": "cube"})
        assert truth(ctx, "cube").pose.xyz[2] > 0.055 + 0.05
        assert ctx.arm.state().tcp_pose.rotation[2, 2] > -0.97


@pytest.mark.parametrize(
    "skill, arguments, holds",
    [
        ("place_on", {"target": "block"}, lambda ctx: on_top(truth(ctx, "red_cube"), truth(ctx, "block"))),
        ("place_in", {"container": "bin"}, lambda ctx: inside(truth(ctx, "red_cube"), truth(ctx, "bin"))),
        *[
            (
                "place_beside",
                {"target": "block", "side": side},
                lambda ctx, side=side: beside(truth(ctx, "red_cube"), truth(ctx, "block"), side),
            )
            for side in ("left", "right", "front", "back")
        ],
    ],
)
def test_placing_reaches_what_it_names(ctx, skill, arguments, holds):
    perform(ctx, SKILLS["pick"], {"object": "red_cube"})
    perform(ctx, SKILLS[skill], arguments)
    assert holds(ctx).holds
    assert "robot" not in ctx.driver.simulation.truth().objects["red_cube"].contacts


def test_place_at_reaches_the_point(ctx):
    perform(ctx, SKILLS["pick"], {"object": "red_cube"})
    perform(ctx, SKILLS["place_at"], {"x": 0.05, "y": -0.3})
    assert np.linalg.norm(truth(ctx, "red_cube").pose.position[:2] - [0.05, -0.3]) < 0.015


@pytest.mark.parametrize(
    "direction, axis", [("forward", (1, 0)), ("back", (-1, 0)), ("left", (0, 1)), ("right", (0, -1))]
)
def test_push_slides_the_cube_that_way(ctx, direction, axis):
    before = truth(ctx, "red_cube").pose.position[:2]
    perform(ctx, SKILLS["push"], {"object": "red_cube", "direction": direction, "distance": 0.06})
    moved = truth(ctx, "red_cube").pose.position[:2] - before
    assert moved @ np.array(axis) == pytest.approx(0.06, abs=0.015)


def test_nothing_is_claimed_of_a_robot_that_fails_as_a_skill_without_promises_ends(ctx, monkeypatch):
    class Nod(Skill):
        """Nod."""

        name = "nod"

        def run(self, ctx):
            """Nod."""
            monkeypatch.setattr(MuJoCoBackend, "fault", "elbow_flex (servo 3) has not answered for 0.11 s")
            return SkillResult(skill=self.name)

    with pytest.raises(FaultError, match="whether it is done is not known"):
        perform(ctx, Nod(), {})


def test_nothing_is_claimed_of_a_robot_that_fails_as_a_skill_ends(ctx, monkeypatch):
    class FailingPick(type(SKILLS["pick"])):
        def run(self, ctx, *, object: str):
            done = super().run(ctx, object=object)
            monkeypatch.setattr(MuJoCoBackend, "fault", "elbow_flex (servo 3) has not answered for 0.11 s")
            return done

    with pytest.raises(FaultError, match=r"has not answered for 0\.11 s; whether it is done is not known"):
        perform(ctx, FailingPick(), {"object": "red_cube"})


@pytest.mark.parametrize(
    "name, point",
    [
        ("red_cube", (0.25, -0.05)),
        # Straight, it would push the block along.
        ("red_cube", (0.28, 0.2)),
        ("wide", (0.2, -0.3)),
        # Nearer to the robot, by its wall from within.
        ("bin", (0.0, 0.25)),
    ],
)
def test_push_to_slides_a_thing_to_a_point_and_nothing_else(ctx, name, point):
    others = {item.id: truth(ctx, item.id).pose.position for item in OBJECTS if item.id != name}
    perform(ctx, SKILLS["push_to"], {"object": name, "x": point[0], "y": point[1]})
    assert np.linalg.norm(truth(ctx, name).pose.position[:2] - point) < 0.015
    for other, before in others.items():
        assert np.linalg.norm(truth(ctx, other).pose.position - before) < 0.002, other


def test_what_no_hand_can_carry_is_pushed_to_where_it_is_to_stand(ctx):
    answer = plan_for(
        parse_facts("at(wide, 0.2, -0.3)"), ctx.look(), load_skills(), robot=LateAbilities(RobotAbilities(ctx))
    )
    assert isinstance(answer, Plan) and [str(call) for call in answer.steps] == ["push_to(object=wide, x=0.2, y=-0.3)"]
    small = plan_for(parse_facts("at(red_cube, 0.2, -0.3)"), ctx.look(), load_skills())
    assert isinstance(small, Plan) and [call.skill for call in small.steps] == ["pick", "place_at"]


@pytest.mark.parametrize(
    "skill, arguments, error",
    [
        ("pick", {"object": "nothing"}, ObjectNotFoundError),
        ("pick", {"object": "wide"}, GraspError),
        ("pick", {"object": "far"}, UnreachableError),
        ("place_on", {"target": "block"}, NotHoldingError),
        ("pick", {}, InvalidArgumentError),
        ("pick", {"object": 3}, InvalidArgumentError),
        ("push", {"object": "red_cube", "direction": "up"}, InvalidArgumentError),
        ("push", {"object": "red_cube", "direction": "left", "distance": float("nan")}, InvalidArgumentError),
        ("place_at", {"x": float("inf"), "y": 0.0}, InvalidArgumentError),
    ],
)
def test_what_cannot_be_done_is_said_without_moving(ctx, skill, arguments, error):
    before = ctx.driver.simulation.snapshot()
    with pytest.raises(error) as caught:
        perform(ctx, SKILLS[skill], arguments)
    assert caught.value.message
    assert (ctx.driver.simulation.snapshot() == before).all()


def test_what_a_stop_has_put_down_is_let_go(ctx, monkeypatch):
    """Leaning on a finger it was claimed to stand where it was to stand."""
    perform(ctx, SKILLS["pick"], {"object": "red_cube"})
    follow = Manipulator.follow

    def stopped(arm, way, phase, **given):
        follow(arm, way, phase, **given)
        if phase == Phase.LOWER:
            # The fingers have lost it, and are still around it.
            arm.open(arm.gripper.width + 0.001)
            raise LimitError("pressed too hard", phase=phase)

    monkeypatch.setattr(Manipulator, "follow", stopped)
    with pytest.raises(LimitError):
        perform(ctx, SKILLS["place_at"], {"x": 0.05, "y": -0.3})
    hand = next(iter(ctx.driver.hands.values())).state()
    assert hand.width > 0.03 + 0.01
    assert truth(ctx, "red_cube").pose.xyz[:2] == pytest.approx((0.05, -0.3), abs=0.005)


def test_full_hand_and_taken_places_are_refused(ctx):
    perform(ctx, SKILLS["pick"], {"object": "red_cube"})
    with pytest.raises(AlreadyHoldingError):
        perform(ctx, SKILLS["pick"], {"object": "block"})
    with pytest.raises(PlacementError) as caught:
        perform(ctx, SKILLS["place_at"], {"x": 0.2, "y": 0.05})
    assert caught.value.evidence.blocking == ("block",)


@pytest.mark.parametrize(
    "name, arguments",
    [
        ("pick", {"object": "red_cube"}),
        ("home", {}),
        ("push", {"object": "red_cube", "direction": "left", "distance": 0.05}),
        ("stack", {"object": "red_cube", "target": "block"}),
    ],
)
def test_skills_conform(ctx, name, arguments):
    assert isinstance(check_skill(SKILLS[name], ctx, arguments), SkillResult)


def test_stub_planner_conforms(ctx):
    scene = ctx.perception.perceive(ctx.driver)
    prompts = ["pick up the red cube", "put the red cube in the bin", "sing a song", "", "pick up the giraffe"]
    check_planner(StubPlanner(load_skills()), scene, load_skills(), prompts)


def test_a_weak_gripper_is_not_called_a_success(ctx):
    """The fingers cannot hold two kilograms: whatever happens, pick must not claim a lift."""
    heavy = OBJECTS[0].model_copy(update={"mass": 30.0})
    ctx.driver.simulation.reset(Scene(objects=(heavy, *OBJECTS[1:])))
    with pytest.raises(SkillError):
        perform(ctx, SKILLS["pick"], {"object": "red_cube"})


class TakesEmptyHandedBinsForCans(GroundTruthPerception):
    """A perception that, once the hand has let go of something, takes the bin for a can."""

    let_go = False

    def perceive(self, sim: Driver) -> ObservedScene:
        seen = super().perceive(sim)
        self.let_go |= seen.held is not None
        if not self.let_go or seen.held is not None:
            return seen
        objects = [
            replace(item, kind="cylinder", size=(0.05, 0.05)) if item.kind == "bin" else item for item in seen.objects
        ]
        return replace(seen, objects=tuple(objects))


def test_a_bin_that_the_last_look_takes_for_a_can_shows_nothing_of_what_is_in_it() -> None:
    with open_session("put_in_bin", what_if=False) as session:
        session.ctx.perception = TakesEmptyHandedBinsForCans()
        calls = session.agent.planner.plan(session.task.prompt, session.observe())
        assert isinstance(calls, Plan)
        with pytest.raises(PlacementError):
            for call in calls.steps:
                session.agent.perform(call)


class SeesNothingUnderTheHand(GroundTruthPerception):
    """A perception that does not see what the hand is over, as cameras from above do not."""

    def perceive(self, sim: Driver) -> ObservedScene:
        seen, hand = super().perceive(sim), sim.state().tcp_pose.position[:2]
        kept = [
            item
            for item in seen.objects
            if item.id == seen.held or item.kind == "bin" or np.hypot(*(item.pose.position[:2] - hand)) > 0.1
        ]
        return replace(seen, objects=tuple(kept))


def test_what_the_hand_hides_in_the_bin_is_looked_for_from_aside() -> None:
    with open_session("put_in_bin", what_if=False) as session:
        calls = session.agent.planner.plan(session.task.prompt, session.observe())
        assert isinstance(calls, Plan)
        for call in calls.steps:
            if call.skill == "place_in":
                session.ctx.perception = SeesNothingUnderTheHand()
            result = session.agent.perform(call)
        home = session.mujoco.robot.home_q
        assert result.skill == "place_in" and np.abs(session.driver.state().q - home).max() < 0.02
        assert session.judge().success
