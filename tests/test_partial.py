"""`auto` as a hybrid: what the grammar is sure of bounds what a model may do with the rest; what it finds ambiguous is asked."""

import json
from collections.abc import Iterator
from typing import Any

import pytest

from robosandbox.agent.llm import endpoint_capabilities
from robosandbox.agent.partial import PartialReading, partial_reading
from robosandbox.agent.planner import StubPlanner
from robosandbox.agent.planners import make_planner
from robosandbox.apps.conformance.openai_server import HttpAnswer, ScriptedServer, fails, plan, refuse, tool_calls
from robosandbox.types import Plan, Refusal
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.verifier import Constraints


@pytest.fixture(scope="module")
def _world() -> Iterator[EmbeddedWorkcell]:
    with open_session("pick_from_three", what_if=False) as session:
        yield session


@pytest.fixture
def world(_world: EmbeddedWorkcell, monkeypatch: pytest.MonkeyPatch) -> EmbeddedWorkcell:
    monkeypatch.setattr(endpoint_capabilities, "_PROCESS_CACHE", endpoint_capabilities.EndpointCache())
    _world.reset()
    return _world


def reading(world: EmbeddedWorkcell, prompt: str) -> PartialReading:
    skills: list[Any] = list(world.skills)
    return partial_reading(StubPlanner(skills), prompt, world.observe(), skills)


ALL = frozenset({"red_cube", "green_cube", "blue_cube"})


@pytest.mark.parametrize(
    ("prompt", "certain"),
    [
        ("pick up the red cube and frobnicate it", Constraints(moved=frozenset({"red_cube"}), fewest=1)),
        ("frobnicate, then pick up a cube", Constraints(fewest=1)),
        ("frobnicate the table without touching the red cube", Constraints(never=frozenset({"red_cube"}))),
        ("make it pretty, but move only the red cube", Constraints(only=frozenset({"red_cube"}))),
        (
            "make it pretty, but use nothing but the red cube and the blue cube",
            Constraints(only=frozenset({"red_cube", "blue_cube"})),
        ),
        # What may not hold, or is taken back, is not certain.
        ("if it frobnicates, pick up the red cube", Constraints()),
        ("pick up the red cube, no wait, frobnicate the blue one", Constraints()),
        ("pick up the red cube or frobnicate it", Constraints()),
        ("frobnicate, and tell me how to pick up the red cube", Constraints()),
        ("make it pretty, but move only the crimson hexahedron", Constraints()),
        ("frobnicate", Constraints()),
    ],
)
def test_what_is_certain_of_a_sentence(world: EmbeddedWorkcell, prompt: str, certain: Constraints) -> None:
    assert reading(world, prompt) == PartialReading(constraints=certain)


def test_an_ambiguous_part_is_a_question_to_the_person_and_not_to_the_model(world: EmbeddedWorkcell) -> None:
    for mode in ("plan", "act"):
        with ScriptedServer() as server:
            told = {"model": "scripted", "base_url": server.url, "mode": mode}
            world.agent.planner = make_planner("auto", list(world.skills), told)
            episode = world.run("pick up the cube and make it dance")
        assert episode.refusal is not None and episode.refusal.code == "ambiguous" and not server.requests
        assert {*episode.refusal.candidates} == ALL and not episode.steps


GREEN, RED = plan(("pick", {"object": "green_cube"})), plan(("pick", {"object": "red_cube"}))


@pytest.mark.parametrize(
    ("prompt", "cause"),
    [
        ("pick up the red cube and frobnicate it", "red_cube was asked for and is not moved"),
        ("make it pretty, but move only the red cube", "green_cube is not to be touched"),
        ("frobnicate it without touching the green cube", "green_cube is not to be touched"),
    ],
)
def test_a_plan_against_what_is_certain_is_sent_back(world: EmbeddedWorkcell, prompt: str, cause: str) -> None:
    with ScriptedServer(GREEN, RED) as server:
        told = {"model": "scripted", "base_url": server.url}
        answer = make_planner("auto", list(world.skills), told).plan(prompt, world.observe())
        said = json.dumps(server.requests[1]["messages"])
    assert isinstance(answer, Plan) and str(answer) == "pick(object=red_cube)"
    assert cause in said and "<certain>" in said


def test_without_auto_and_for_what_the_grammar_plans_nothing_changes(world: EmbeddedWorkcell) -> None:
    with ScriptedServer(GREEN) as server:
        told = {"model": "scripted", "base_url": server.url}
        answer = make_planner("openai", list(world.skills), told).plan("pick it up and frobnicate", world.observe())
        assert isinstance(answer, Plan) and "<certain>" not in str(server.requests[0]["messages"][-1])
        auto = make_planner("auto", list(world.skills), told)
        assert str(auto.plan("pick up the green cube", world.observe())) == "pick(object=green_cube)"
    assert len(server.requests) == 1


def call(name: str, **arguments: Any) -> HttpAnswer:
    return tool_calls((name, json.dumps(arguments)))


def test_a_model_that_acts_cannot_finish_before_what_was_named_is_moved(world: EmbeddedWorkcell) -> None:
    early = call("finish", summary="Done.", holds=["at_home()"])
    script = [fails(400, "no schema"), early, call("pick", object="red_cube"), call("finish", summary="Done.")]
    with ScriptedServer(*script) as server:
        told = {"model": "scripted", "base_url": server.url, "mode": "act"}
        world.agent.planner = make_planner("auto", list(world.skills), told)
        episode = world.run("pick up the red cube and frobnicate it")
        assert "asks to move red_cube" in server.requests[2]["messages"][-1]["content"]
    assert episode.success and world.observe().held == "red_cube"


def test_a_refusal_of_the_model_stands(world: EmbeddedWorkcell) -> None:
    with ScriptedServer(refuse("unsupported", "I cannot frobnicate.")) as server:
        told = {"model": "scripted", "base_url": server.url}
        answer = make_planner("auto", list(world.skills), told).plan(
            "pick up the red cube and frobnicate it", world.observe()
        )
    assert isinstance(answer, Refusal) and answer.message == "I cannot frobnicate."
