"""The agent loop on scripted skills and planners: no physics."""

import logging
import threading
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from robosandbox.agent import episode as events
from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.agent.episode import Episode, FinalReason
from robosandbox.agent.protocols import Attempt
from robosandbox.driver import Capabilities, ControlLoop, Driver, Guard
from robosandbox.errors import (
    CancelledError,
    ErrorCode,
    Failure,
    GoalTimeoutError,
    GraspError,
    InputError,
    SensorError,
)
from robosandbox.skills.base import Skill
from robosandbox.skills.protocols import SkillContext
from robosandbox.skills.push import PushError
from robosandbox.types import (
    ObservedScene,
    Plan,
    Pose,
    Refusal,
    RefusalCode,
    Scene,
    SceneObject,
    SkillCall,
    SkillResult,
)
from robosandbox.workcell.session import open_session
from robosandbox.world.contracts import Contract, find
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.monitor import Monitor
from robosandbox.world.predicate import View


class ClockArm:
    """An arm that stands still."""

    name = "arm"
    one = np.ones(1)
    spec = SimpleNamespace(
        limits=None, name="nothing", files=None, lower=-one, upper=one, velocity_limits=one, acceleration_limits=one
    )

    def __init__(self, cell: "Clock") -> None:
        self.cell = cell

    def state(self) -> SimpleNamespace:
        return SimpleNamespace(time=self.cell.time, q=np.zeros(1), qd=np.zeros(1))

    def stop(self) -> None:
        pass


class Clock:
    """The part of a driver that the context needs: time that passes in ticks."""

    simulation = None
    senses = None
    fault = ""
    control_timestep = 0.01

    def __init__(self) -> None:
        self.time = 0.0
        self.loop = ControlLoop()
        self.guards = self.loop.guards
        self.subscribe = self.loop.subscribe
        self.capabilities = Capabilities(clock="simulated")
        self.arms = {"arm": ClockArm(self)}
        self.hands: dict[str, object] = {}

    def stop(self) -> None:
        pass

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        for _ in range(round(seconds / self.control_timestep)):
            self.time += self.control_timestep
            self.loop.ticked(self.stop, guards)


class Eyes:
    looks = 0

    def perceive(self, sim: Driver) -> ObservedScene:
        self.looks += 1
        return ObservedScene(time=sim.time, objects=(), table_height=0.04, base_xy=(0.0, 0.0))


class Act(Skill):
    """A skill that does what its list of outcomes says."""

    def __init__(self, name: str, *outcomes: Exception | None) -> None:
        self.name = name
        self.outcomes = list(outcomes)

    def run(self, ctx: SkillContext) -> SkillResult:
        """Act."""
        ctx.enter("approach")
        ctx.driver.wait(1.0)
        outcome = self.outcomes.pop(0) if self.outcomes else None
        if outcome:
            raise outcome
        return SkillResult(skill=self.name)


class Script:
    """A planner that answers from a list and remembers what it was told."""

    def __init__(self, *answers: Plan | Refusal) -> None:
        self.answers = list(answers)
        self.histories: list[Sequence[Attempt]] = []
        self.scenes: list[ObservedScene] = []

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        self.histories.append(history)
        self.scenes.append(scene)
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]


def calls(*names: str) -> Plan:
    return Plan(steps=tuple(SkillCall(skill=name) for name in names))


def make(planner: Script, *skills: Act, max_replans: int = 3) -> tuple[Agent, AgentContext, list[events.AgentEvent]]:
    unused = cast(Any, SimpleNamespace())
    ctx = AgentContext(sim=cast(Driver, Clock()), perception=Eyes(), grasp=unused, motion=unused, what_if=False)
    agent = Agent(ctx=ctx, skills=skills, planner=planner, max_replans=max_replans)
    seen: list[events.AgentEvent] = []
    agent.ctx.events.subscribe(seen.append)
    return agent, ctx, seen


MISSED = GraspError("closed on nothing")
NO = Refusal(code=RefusalCode.IMPOSSIBLE, message="out of reach")


def test_complete_plan_prints_as_in_the_tutorial() -> None:
    agent, _, _ = make(Script(calls("pick")), Act("pick"))
    ep = agent.run("pick up the red cube")
    line = f"success={ep.success}  steps={len(ep.steps)}  reason={ep.final_reason}"
    assert line == "success=True  steps=1  reason=plan_complete"


def test_failure_is_told_to_the_planner_which_sees_a_fresh_scene() -> None:
    planner = Script(calls("home", "pick"), calls("pick"))
    agent, _, _ = make(planner, Act("home"), Act("pick", MISSED, None))
    ep = agent.run("go")
    assert ep.success and ep.replans == 1 and [step.call.skill for step in ep.steps] == ["home", "pick"]
    (attempt,) = planner.histories[1]
    assert [call.skill for call in attempt.completed] == ["home"]
    assert (attempt.failed.skill, attempt.error) == ("pick", MISSED.failure)
    before_replan, after = planner.scenes
    assert after.time > before_replan.time


JAMMED = PushError("pushed against the arm's own elbow")


@pytest.mark.parametrize(
    ("answers", "outcomes", "said"),
    [
        # A push fails, and the plan after it by what the robot lacks: the push is told of.
        ([calls("push"), calls("pick")], {"push": [JAMMED], "pick": [MISSED]}, "push(): pushed against"),
        ([calls("push"), calls("pick"), NO], {"push": [JAMMED], "pick": [MISSED]}, "push(): pushed against"),
        ([calls("push"), NO], {"push": [JAMMED]}, "push(): pushed against"),
        # The push is made good by another push, so that what failed afterwards is the cause.
        ([calls("push", "pick"), calls("push", "pick")], {"push": [JAMMED], "pick": [MISSED]}, "pick(): closed on"),
        ([calls("push"), calls("push", "pick"), NO], {"push": [JAMMED], "pick": [MISSED]}, "pick(): closed on"),
        ([calls("pick"), calls("pick")], {"pick": [MISSED, JAMMED]}, "pick(): closed on nothing"),
    ],
)
def test_the_first_cause_that_nothing_mended_is_the_closing_line(
    answers: list[Plan | Refusal], outcomes: dict[str, list[Exception]], said: str
) -> None:
    planner = Script(*answers, NO)
    agent, _, _ = make(planner, *(Act(name, *errors) for name, errors in outcomes.items()), max_replans=len(answers))
    ep = agent.run("go")
    assert not ep.success and ep.final_detail.startswith(said), ep.final_detail
    assert ep.error is not None and ep.error.message in ep.final_detail


def test_a_question_that_is_left_open_stands_behind_the_cause() -> None:
    asks = Refusal(code=RefusalCode.AMBIGUOUS, message="Which one do you mean?")
    agent, _, _ = make(Script(calls("pick"), asks), Act("pick", MISSED))
    assert agent.run("go").final_detail == "pick(): closed on nothing; Which one do you mean?"


def test_replanning_stops_after_max_replans() -> None:
    agent, _, _ = make(Script(calls("pick")), Act("pick", *[MISSED] * 9), max_replans=2)
    ep = agent.run("go")
    assert (ep.final_reason, ep.replans, len(ep.attempts)) == (FinalReason.REPLANS_EXHAUSTED, 2, 3)
    assert ep.error and ep.error.message == "closed on nothing"


@pytest.mark.parametrize("replans", [0, 1])
def test_refusal_ends_at_once(replans: int) -> None:
    answers = [calls("pick")] * replans + [NO]
    agent, _, _ = make(Script(*answers), Act("pick", MISSED))
    ep = agent.run("go")
    assert not ep.success and ep.refusal == NO and ep.replans == replans
    assert ep.final_detail == ("pick(): closed on nothing" if replans else "out of reach")
    assert ep.final_reason is (FinalReason.GAVE_UP if replans else FinalReason.REFUSED)


def test_events_tell_the_whole_story() -> None:
    agent, _, seen = make(Script(calls("pick")), Act("pick", MISSED, None))
    agent.run("go")
    assert [type(event).__name__ for event in seen] == [
        *("Started", "Planned", "SkillStarted", "PhaseEntered", "SkillFailed", "Replanning"),
        *("Planned", "SkillStarted", "PhaseEntered", "SkillEnded", "Ended"),
    ]


def test_unexpected_exception_becomes_an_internal_error_whose_id_is_in_the_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    agent, _, _ = make(Script(calls("pick")), Act("pick", ZeroDivisionError("boom")))
    with caplog.at_level(logging.ERROR):
        ep = agent.run("go")
    assert ep.final_reason is FinalReason.INTERNAL_ERROR and ep.error
    fault_id = ep.error.message.split()[-1]
    assert fault_id in caplog.text and "boom" in caplog.text


def test_unknown_skill_in_a_plan_is_an_invalid_argument() -> None:
    agent, _, _ = make(Script(calls("pik"), NO), Act("pick"))
    ep = agent.run("go")
    assert "did you mean 'pick'" in ep.attempts[0].error.message


def test_cancel_from_another_thread_stops_between_ticks_and_is_not_replanned() -> None:
    agent, ctx, _ = make(Script(calls("pick")), Act("pick"))
    sim = cast(Clock, ctx.driver)

    def cancel_at_half_time() -> None:
        if abs(sim.time - 0.5) < 1e-6:
            thread = threading.Thread(target=ctx.cancel)
            thread.start()
            thread.join()

    sim.subscribe(cancel_at_half_time)
    ep = agent.run("go")
    assert ep.final_reason is FinalReason.CANCELLED and sim.time == pytest.approx(0.5)
    assert agent.run("go").success, "a cancel holds for one goal"


def test_listeners_are_told_of_a_call_that_a_camera_ended() -> None:
    agent, _, seen = make(Script(calls("pick")), Act("pick", SensorError("camera 'top': depth of another size")))
    with pytest.raises(SensorError):
        agent.run("go")
    (told,) = (event.error for event in seen if isinstance(event, events.SkillFailed))
    assert (told.code, told.phase) == (ErrorCode.UNAVAILABLE, "approach") and "depth of another size" in told.message


def test_deadline_stops_a_skill_with_the_time_it_took() -> None:
    agent, ctx, _ = make(Script(calls("pick", "pick")), Act("pick"))
    with ctx.goal(timeout=1.5):
        ep = agent.run("go")
    assert ep.final_reason is FinalReason.TIMED_OUT and len(ep.steps) == 1
    error = ep.attempts[0].error
    assert isinstance(error.exception(), GoalTimeoutError) and error.evidence
    ctx.driver.wait(5.0)


def test_what_a_planner_makes_of_ctrl_c_ends_the_episode_as_cancelled() -> None:
    class Interrupted(Script):
        def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
            agent.left = True
            raise RuntimeError("event loop is closed")

    agent, _, _ = make(Interrupted(NO), Act("pick"))
    ep = agent.run("go")
    assert ep.final_reason is FinalReason.CANCELLED and not ep.steps


def test_cancel_before_a_goal_does_not_reach_it() -> None:
    _, ctx, _ = make(Script(calls("pick")))
    ctx.cancel()
    with ctx.goal():
        ctx.enter("approach")
    ctx.cancel()
    with pytest.raises(CancelledError):
        ctx.enter("approach")


def test_prompt_of_ten_megabytes_is_refused_in_one_line() -> None:
    agent, _, _ = make(Script(calls("pick")), Act("pick"))
    with pytest.raises(InputError) as caught:
        agent.run("x" * 10_000_000)
    assert len(str(caught.value)) < 200


def test_episode_record_is_json_and_keeps_the_error() -> None:
    agent, _, _ = make(Script(calls("pick"), NO), Act("pick", MISSED))
    ep: Episode = agent.run("go")
    record = ep.record()
    assert record["error"]["code"] == "grasp" and record["refusal"]["code"] == "impossible"
    assert isinstance(ep.attempts[0].error, Failure)


def test_a_way_around_one_failure_is_not_asked_for_after_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    told = list[tuple[str, bool]]()
    add = Monitor.add

    def heard(monitor: Monitor, call: SkillCall, contract: Contract, *, is_detour: bool = False) -> None:
        told.append((call.skill, is_detour))
        add(monitor, call, contract, is_detour=is_detour)

    monkeypatch.setattr(Monitor, "add", heard)
    plans = calls("pick", "stack"), calls("push", "stack"), calls("push", "stack")
    agent, _, _ = make(Script(*plans), Act("pick"), Act("push"), Act("stack", MISSED, MISSED))
    assert agent.run("go").success
    assert told == [("pick", False), ("push", True), ("push", True), ("stack", False)]


def test_a_way_around_one_failure_is_left_out_where_what_was_done_was_undone(monkeypatch: pytest.MonkeyPatch) -> None:
    (pick,) = calls("pick").steps
    fallen = iter([None, Attempt(completed=(), failed=pick, error=MISSED.failure)])
    monkeypatch.setattr(Monitor, "undone", lambda *args, **options: next(fallen, None))
    plans = calls("pick", "stack"), calls("push", "tap", "stack"), calls("pick", "stack")
    agent, _, _ = make(Script(*plans), Act("pick"), Act("push"), Act("tap"), Act("stack", MISSED))
    ep = agent.run("go")
    assert ep.success and [step.call.skill for step in ep.steps] == ["pick", "push", "pick", "stack"]
    assert [call.skill for call in ep.attempts[1].remaining] == ["stack"], (
        "and not the tap, a way around the first failure"
    )


@pytest.mark.parametrize("is_detour", [True, False])
def test_what_a_way_around_a_failure_took_out_again_is_owed_at_the_end(is_detour: bool) -> None:
    """Without a failure before it, whoever asked for the thing to be taken out has asked for that."""
    put = SkillCall(skill="place_in", arguments={"container": "grey_bin"})
    take = SkillCall(skill="pick", arguments={"object": "red_cube"})
    stand = SkillCall(skill="place_at", arguments={"x": 0.1, "y": -0.2})
    with open_session("put_in_bin") as session:
        outside = session.observe()
    monitor = Monitor()
    monitor.begin(outside)
    monitor.add(put, Contract(gives=(fact("inside", "red_cube", "grey_bin"),)))
    monitor.add(take, Contract(gives=(fact("holding", "red_cube"),)), is_detour=is_detour)
    monitor.add(stand, Contract(gives=(fact("on", "red_cube", TABLE), fact("hand_empty"))), is_detour=is_detour)
    assert monitor.undone(lambda: outside, at_the_end=False) is None
    undone = monitor.undone(lambda: outside, at_the_end=True)
    assert (undone.failed if undone else None) == (put if is_detour else None)
    assert monitor.undone(lambda: outside, at_the_end=True) is None


def test_with_what_is_owed_comes_what_was_put_on_it_meanwhile() -> None:
    """A way around a failure pushed the lower cube off its base, and the upper one went onto it there: both have to be done anew."""
    lower, upper = (SkillCall(skill="stack", arguments={"object": a, "target": b}) for a, b in (("g", "b"), ("r", "g")))
    aside = SkillCall(skill="push", arguments={"object": "g", "direction": "left"})
    with open_session("stack_three") as session:
        apart = session.observe()
    monitor = Monitor()
    monitor.begin(apart)
    monitor.add(lower, Contract(gives=(fact("on", "green_cube", "blue_cube"),)))
    monitor.add(aside, Contract(gives=(fact("displaced", "green_cube", "left", 0.06),)), is_detour=True)
    monitor.add(upper, Contract(gives=(fact("on", "red_cube", "green_cube"),)))
    undone = monitor.undone(lambda: apart, at_the_end=True)
    assert undone is not None and undone.failed == lower and undone.remaining == (upper,)


def test_what_was_asked_for_and_taken_out_again_to_make_room_is_not_claimed() -> None:
    """The call that takes it out is one that the order has as well: it was claimed that both are in."""
    where = Pose(xyz=(0.15, 0.2, 0.07)), Pose(xyz=(0.1, -0.15, 0.0805)), Pose(xyz=(0.2, -0.05, 0.0805))
    bin_ = SceneObject(id="white_bin", kind="bin", size=(0.035, 0.035, 0.03), pose=where[0])
    blocks = [
        SceneObject(id=name, kind="box", size=(0.015, 0.015, 0.04), pose=pose, mass=0.05)
        for name, pose in (("red_block", where[1]), ("blue_block", where[2]))
    ]
    with open_session(task=Scene(objects=(bin_, *blocks))) as session:
        ep = session.run("put the red block and the blue block in the bin")
        scene = session.observe()
        both = all(find(fact("inside", block.id, "white_bin"), View.of(scene)).holds for block in blocks)
    assert not both and not ep.success, ep.final_detail
