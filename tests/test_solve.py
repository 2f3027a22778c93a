"""One solve for goals, for calls, and for what is left after failures; nobody plans what the robot cannot do."""

from __future__ import annotations

from dataclasses import replace

import pytest

from robosandbox.agent.protocols import Attempt
from robosandbox.errors import (
    CancelledError,
    CollisionError,
    ConnectionLostError,
    GraspError,
    NotHoldingError,
    ObjectNotFoundError,
    Phase,
    Repair,
    SkillError,
)
from robosandbox.evidence import CollisionEvidence, GraspEvidence
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.push import PushError
from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose, Refusal, SkillCall
from robosandbox.world.facts import parse_facts
from robosandbox.world.operators import Operator
from robosandbox.world.solve import solve

SKILLS: tuple[Operator, ...] = tuple(load_skills())


def thing(name: str, kind: str, size: tuple[float, ...], xyz: tuple[float, float, float]) -> DetectedObject:
    colour = (0.5, 0.5, 0.5, 1.0)
    return DetectedObject(id=name, kind=kind, size=size, colour="grey", rgba=colour, pose=Pose(xyz=xyz))


CUBE = thing("cube", "box", (0.02, 0.02, 0.02), (0.1, 0.1, 0.06))
CAN = thing("can", "cylinder", (0.02, 0.03), (0.15, 0.1, 0.07))
BIN = thing("bin", "bin", (0.08, 0.08, 0.06), (0.1, -0.2, 0.04))
SCENE = ObservedScene(time=0.0, table_height=0.04, base_xy=(-0.3, 0.0), objects=(CUBE, CAN, BIN), hands={"hand": None})
PICK = SkillCall(skill="pick", arguments={"object": "cube"})
PLACE = SkillCall(skill="place_in", arguments={"container": "bin"})
HOME = SkillCall(skill="home")
PUSH = SkillCall(skill="push", arguments={"object": "cube", "direction": "left", "distance": 0.1})


def failed(error: SkillError, call: SkillCall, *remaining: SkillCall, completed: tuple[SkillCall, ...] = ()) -> Attempt:
    return Attempt(completed=completed, failed=call, error=error.failure, remaining=remaining)


def told(answer: Plan | Refusal) -> list[str] | str:
    return [str(call) for call in answer.steps] if isinstance(answer, Plan) else answer.message


def met(other: str) -> CollisionError:
    evidence = CollisionEvidence(body="hand", other=other, depth=0.002, waypoint=0, waypoints=1)
    return CollisionError(f"the hand would touch {other}", phase=Phase.PLAN, evidence=evidence)


def test_what_calls_lack_comes_before_them() -> None:
    holding = SCENE.holding("can")
    assert told(solve((PICK,), holding, SKILLS))[-1] == str(PICK)  # type: ignore[index]
    assert told(solve((PICK, PLACE), SCENE, SKILLS)) == [str(PICK), str(PLACE)]


@pytest.mark.parametrize("goals", [(PICK, PLACE), parse_facts("inside(cube, bin)")])
def test_an_untried_repair_comes_first_for_calls_as_for_relations(goals: tuple[SkillCall, ...]) -> None:
    away = SkillCall(skill="push", arguments={"object": "can", "direction": "forward", "distance": 0.1})
    repair = Repair(calls=(away, PICK), why="can is pushed out of the way first", cost=2.0)
    answer = solve(goals, SCENE, SKILLS, tried=[failed(met("can").with_(repairs=(repair,)), PICK, PLACE)])
    assert told(answer) == [str(away), str(PICK), str(PLACE)]


@pytest.mark.parametrize("goals", [(PICK, PLACE), parse_facts("inside(cube, bin)")])
def test_what_was_met_is_put_aside_for_calls_as_for_relations(goals: tuple[SkillCall, ...]) -> None:
    answer = told(solve(goals, SCENE, SKILLS, tried=[failed(met("can"), PICK, PLACE)]))
    assert answer[0] == "pick(object=can)" and answer[-2:] == [str(PICK), str(PLACE)]


def test_what_slipped_is_fetched_again_twice_and_then_not() -> None:
    slipped = failed(NotHoldingError("the gripper is empty"), PLACE, completed=(PICK,))
    for times in (1, 2):
        assert told(solve((PLACE,), SCENE, SKILLS, tried=[slipped] * times)) == [str(PICK), str(PLACE)]
    assert isinstance(solve((PLACE,), SCENE, SKILLS, tried=[slipped] * 4), Refusal)


def test_what_holds_by_now_is_not_done_again() -> None:
    arrived = replace(CUBE, pose=Pose(xyz=(0.1, -0.2, 0.065)))
    scene = replace(SCENE, objects=(arrived, CAN, BIN))
    lost = failed(ObjectNotFoundError("cube is not seen", phase=Phase.VERIFY), PLACE, HOME, completed=(PICK,))
    assert told(solve((PLACE, HOME), scene, SKILLS, tried=[lost])) == [str(HOME)]
    assert told(solve((PLACE, HOME), SCENE, SKILLS, tried=[lost])) == [str(PICK), str(PLACE), str(HOME)]


def test_what_the_hand_has_closed_on_and_not_lifted_is_picked_on_and_what_it_carries_is_not() -> None:
    lost = failed(ConnectionLostError("the sim went away"), PICK, HOME)
    assert told(solve((PICK, HOME), SCENE.holding("cube"), SKILLS, tried=[lost])) == [str(PICK), str(HOME)]
    lifted = replace(CUBE, pose=Pose(xyz=(0.1, 0.1, 0.16)))
    carried = replace(SCENE, objects=(lifted, CAN, BIN)).holding("cube")
    assert told(solve((PICK, HOME), carried, SKILLS, tried=[lost])) == [str(HOME)]


@pytest.mark.parametrize(
    "error",
    [
        CancelledError("cancelled"),
        GraspError(
            "bolted",
            phase=Phase.LIFT,
            evidence=GraspEvidence(object="cube", reason="immovable", aperture=0.04, max_aperture=0.08),
        ),
    ],
)
def test_nothing_helps_where_the_cause_is_not_in_the_way(error: SkillError) -> None:
    answer = solve((PICK,), SCENE, SKILLS, tried=[failed(error, PICK)])
    assert isinstance(answer, Refusal) and error.message in answer.message


def test_nobody_plans_to_hold_things_without_a_gripper() -> None:
    """A push that fails is not answered with a pick by an arm that has nothing to pick with."""
    bare = replace(SCENE, grips=False)
    stuck = failed(PushError("the arm would touch itself", phase=Phase.PLAN), PUSH)
    assert told(solve((PUSH,), SCENE, SKILLS, tried=[stuck]))[0] == str(PICK)
    assert told(solve((PUSH,), bare, SKILLS, tried=[stuck])) == ["push_to(object=cube, x=0.1, y=0.2)"]
    straight = [skill for skill in SKILLS if skill.name != "push_to"]
    answer = solve((PUSH,), bare, straight, tried=[stuck])
    assert isinstance(answer, Refusal) and "the arm would touch itself" in answer.message
    refused = solve(parse_facts("inside(cube, bin)"), bare, SKILLS)
    assert isinstance(refused, Refusal) and "no gripper" in refused.message
    assert isinstance(solve(parse_facts("inside(cube, bin)"), SCENE, SKILLS), Plan)
