"""After a failure every new plan changes something, covers what remains, or stops with the evidence."""

from __future__ import annotations

from dataclasses import replace

from robosandbox.agent.planner import StubPlanner
from robosandbox.agent.protocols import Attempt
from robosandbox.errors import (
    CancelledError,
    CollisionError,
    GraspError,
    NotHoldingError,
    ObjectNotFoundError,
    Phase,
    PlacementError,
    Repair,
    SkillError,
    UnreachableError,
)
from robosandbox.evidence import GraspEvidence, HoldingEvidence, PlacementEvidence
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.push import PushError, PushEvidence
from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose, Refusal, SkillCall

SKILLS = ["pick", "place_on", "place_in", "place_beside", "place_at", "stack", "push", "tap", "home"]


def block(name: str, x: float, y: float, colour: str = "red") -> DetectedObject:
    pose = Pose(xyz=(x, y, 0.06))
    return DetectedObject(id=name, kind="box", size=(0.02,) * 3, colour=colour, rgba=(0.5, 0.5, 0.5, 1.0), pose=pose)


BIN = DetectedObject(
    id="bin_a",
    kind="bin",
    size=(0.08, 0.08, 0.06),
    colour="grey",
    rgba=(0.5, 0.5, 0.5, 1.0),
    pose=Pose(xyz=(0.1, -0.3, 0.04)),
)
SCENE = ObservedScene(
    time=0.0,
    table_height=0.04,
    base_xy=(-0.3, 0.0),
    objects=(block("red_1", 0.1, 0.1), block("red_2", 0.2, 0.2), block("green", 0.2, -0.1, "green"), BIN),
)


def stub() -> StubPlanner:
    return StubPlanner([skill for skill in load_skills() if skill.name in SKILLS])


def failed_at(steps: tuple[SkillCall, ...], step: int, error: SkillError) -> Attempt:
    return Attempt(completed=steps[:step], failed=steps[step], error=error.failure, remaining=steps[step + 1 :])


class Talk:
    """One prompt, run until something fails, as the agent runs it."""

    def __init__(self, prompt: str, scene: ObservedScene = SCENE) -> None:
        self.planner, self.prompt, self.history = stub(), prompt, list[Attempt]()
        self.answer = self.planner.plan(prompt, scene)

    def fail(self, error: SkillError, step: int = 0, scene: ObservedScene = SCENE) -> list[str] | Refusal:
        assert isinstance(self.answer, Plan)
        steps = self.answer.steps
        attempt = Attempt(completed=steps[:step], failed=steps[step], error=error.failure, remaining=steps[step + 1 :])
        self.history.append(attempt)
        self.answer = self.planner.plan(self.prompt, scene, tuple(self.history))
        return [str(call) for call in self.answer.steps] if isinstance(self.answer, Plan) else self.answer


def grasp(reason: str = "missed", width: float | None = 0.04) -> GraspError:
    evidence = GraspEvidence(object="red_1", reason=reason, object_width=width, aperture=0.0, max_aperture=0.08)  # type: ignore[arg-type]
    phase = Phase.PLAN if reason == "none_found" else Phase.GRASP
    return GraspError("the fingers closed on nothing", phase=phase, evidence=evidence)


def test_indefinite_object_out_of_reach_gives_the_next_one() -> None:
    talk = Talk("put a red block in the bin")
    assert talk.fail(UnreachableError("0.9 m away")) == ["pick(object=red_2)", "place_in(container=bin_a)"]


def test_after_the_last_candidate_it_stops() -> None:
    talk = Talk("put a red block in the bin")
    talk.fail(UnreachableError("0.9 m away"))
    answer = talk.fail(UnreachableError("0.8 m away"))
    assert isinstance(answer, Refusal) and answer.code == "impossible"


def test_definite_object_out_of_reach_stops_with_the_evidence() -> None:
    answer = Talk("pick up the green block").fail(UnreachableError("position error 0.21 m"))
    assert isinstance(answer, Refusal) and answer.code == "impossible"
    assert "position error 0.21 m" in answer.message


def test_missed_grasp_is_tried_again_twice_and_then_given_up() -> None:
    talk = Talk("pick up the green block and put it in the bin")
    again = ["pick(object=green)", "place_in(container=bin_a)"]
    assert talk.fail(grasp()) == again
    assert talk.fail(grasp()) == again
    assert isinstance(talk.fail(grasp()), Refusal)


def test_too_wide_an_object_stops_at_once() -> None:
    error = grasp("none_found", 0.12).with_(message="it is 120 mm wide and the gripper opens to 80 mm")
    answer = Talk("pick up the green block").fail(error)
    assert isinstance(answer, Refusal) and "120 mm wide" in answer.message and "80 mm" in answer.message


def test_object_that_slipped_is_picked_again_before_the_place() -> None:
    talk = Talk("put the green block in the bin and go home")
    error = NotHoldingError("the gripper is empty", evidence=HoldingEvidence(held=None, aperture=0.0))
    assert talk.fail(error, step=1) == ["pick(object=green)", "place_in(container=bin_a)", "home()"]


def test_completed_steps_are_not_repeated() -> None:
    talk = Talk("push the green block 5 cm forward, then tap it and go home")
    assert talk.fail(CollisionError("elbow and table"), step=1) == ["home()", "tap(object=green)", "home()"]


def test_a_planner_that_did_not_make_the_plan_goes_on_from_the_history() -> None:
    prompt = "push the green block 5 cm forward, then tap it and go home"
    first = stub().plan(prompt, SCENE)
    assert isinstance(first, Plan)
    history = (failed_at(first.steps, 1, CollisionError("elbow and table")),)
    answer = stub().plan(prompt, SCENE, history)
    assert isinstance(answer, Plan) and [c.skill for c in answer.steps] == ["home", "tap", "home"]


def test_what_was_not_begun_is_not_looked_up_anew() -> None:
    """The leftmost block is another one when the first has gone into the bin."""
    prompt = "put the leftmost block in the bin, then tap the green block"
    first = stub().plan(prompt, SCENE)
    assert isinstance(first, Plan) and str(first.steps[0]) == "pick(object=red_2)"
    moved = replace(BIN, id="red_2", kind="box", size=(0.02,) * 3, colour="red")
    after = replace(SCENE, objects=tuple(moved if item.id == "red_2" else item for item in SCENE.objects))
    history = (failed_at(first.steps, 2, CollisionError("elbow and table")),)
    answer = stub().plan(prompt, after, history)
    assert isinstance(answer, Plan) and [str(c) for c in answer.steps] == ["home()", "tap(object=green)"]


def test_first_repair_replaces_the_failed_call() -> None:
    closer = SkillCall(skill="push", arguments={"object": "green", "direction": "back", "distance": 0.1})
    pick = SkillCall(skill="pick", arguments={"object": "green"})
    error = UnreachableError("too far", repairs=(Repair(calls=(closer, pick), why="closer", cost=3.0),))
    assert Talk("put the green block in the bin").fail(error) == [str(closer), str(pick), "place_in(container=bin_a)"]


def test_push_goes_on_for_what_is_left() -> None:
    evidence = PushEvidence(object="green", wanted=0.10, along=0.06, across=0.0)
    assert Talk("push the green block 10 cm forward").fail(
        PushError("short", phase=Phase.VERIFY, evidence=evidence)
    ) == ["push(object=green, direction=forward, distance=0.04)"]


def short(wanted: float, along: float, across: float = 0.0) -> PushError:
    return PushError(
        "short", phase=Phase.VERIFY, evidence=PushEvidence(object="green", wanted=wanted, along=along, across=across)
    )


def test_strokes_that_have_done_a_push_together_are_enough() -> None:
    """10 cm may fall short by 12 mm; 11 mm of the rest were left, which alone would be too many of 30 mm."""
    talk = Talk("push the green block 10 cm forward, then go home")
    assert talk.fail(short(0.10, 0.07)) == ["push(object=green, direction=forward, distance=0.03)", "home()"]
    assert talk.fail(short(0.03, 0.019)) == ["home()"]


def test_what_strokes_leave_together_or_push_past_is_not_enough() -> None:
    for along, across in ((0.017, 0.0), (0.06, 0.0), (0.019, 0.02)):
        talk = Talk("push the green block 10 cm forward, then go home")
        talk.fail(short(0.10, 0.07))
        answer = talk.fail(short(0.03, along, across))
        assert answer != ["home()"], (along, across)


def test_a_longer_push_before_lends_a_shorter_one_no_allowance() -> None:
    """4 cm may fall short by 8 mm, whatever 20 cm may that were pushed before."""
    talk = Talk("push the green block 20 cm forward, then push the green block 4 cm forward")
    assert talk.fail(short(0.20, 0.15))[:1] == ["push(object=green, direction=forward, distance=0.05)"]
    answer = talk.fail(short(0.04, 0.025), step=1)
    assert isinstance(answer, Refusal) or answer[0] == "push(object=green, direction=forward, distance=0.015)"


def test_free_side_gives_another_side() -> None:
    talk = Talk("put the green block next to the bin")
    assert isinstance(talk.answer, Plan)
    side = talk.answer.steps[1].arguments["side"]
    held = SCENE.holding("green")
    answer = talk.fail(UnreachableError("there"), step=1, scene=held)
    assert isinstance(answer, list) and len(answer) == 1 and f"side={side}" not in answer[0]


def test_occupied_target_is_cleared_once() -> None:
    talk = Talk("put the green block on the left side of the table")
    evidence = PlacementEvidence(object="green", target="table", reason="occupied", blocking=("red_2",))
    held = SCENE.holding("green")
    answers = [talk.fail(PlacementError("occupied", evidence=evidence), step=1, scene=held)]
    assert isinstance(answers[0], list) and answers[0][0].startswith("place_at(")


def test_cancelled_stops() -> None:
    assert isinstance(Talk("pick up the green block").fail(CancelledError("cancelled")), Refusal)


def test_object_that_vanished_is_named() -> None:
    gone = replace(SCENE, objects=tuple(item for item in SCENE.objects if item.id != "bin_a"), hands={"hand": "green"})
    answer = Talk("put the green block in the bin").fail(PlacementError("missed"), step=1, scene=gone)
    assert isinstance(answer, Refusal) and answer.code == "object_not_found" and "bin_a" in answer.message


def test_what_was_let_go_of_and_lost_from_sight_is_not_placed_with_an_empty_hand() -> None:
    prompt, lost = "put the green block in the bin and go home", ObjectNotFoundError("no object 'green' is seen")
    hidden = replace(SCENE, objects=tuple(item for item in SCENE.objects if item.id != "green"))
    refusal = Talk(prompt).fail(lost, step=1, scene=hidden)
    assert isinstance(refusal, Refusal) and refusal.code == "object_not_found"
    dropped = block("green", 0.1, -0.3, "green")
    arrived = replace(SCENE, objects=(*hidden.objects, replace(dropped, pose=Pose(xyz=(0.1, -0.3, 0.065)))))
    assert Talk(prompt).fail(lost, step=1, scene=arrived) == ["home()"]
    assert Talk(prompt).fail(lost, step=1) == ["pick(object=green)", "place_in(container=bin_a)", "home()"]


def test_every_failure_ends_within_ten_replans() -> None:
    errors = [
        ObjectNotFoundError("x"),
        UnreachableError("x"),
        grasp(),
        CollisionError("x"),
        NotHoldingError("x"),
        PlacementError("x"),
        PushError("x"),
    ]
    for prompt in (
        "put a red block in the bin",
        "push the green block forward",
        "stack a red block on the green block",
    ):
        for error in errors:
            talk = Talk(prompt)
            for _ in range(10):
                if isinstance(talk.answer, Refusal):
                    break
                talk.fail(error)
            assert isinstance(talk.answer, Refusal), (prompt, error)
