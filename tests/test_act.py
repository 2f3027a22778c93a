"""A model that acts call by call, against a real HTTP server: what moves, what is turned down, and when it ends."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from support.listening import on_calls

from robosandbox.agent.episode import AgentEvent, Consulted, Episode, FinalReason, Planned, Thought
from robosandbox.agent.llm import endpoint_capabilities
from robosandbox.apps.conformance.openai_server import HttpAnswer, Script, ScriptedServer, fails, says, tool_calls
from robosandbox.errors import InputError, UnreachableError
from robosandbox.types import Plan, SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

NO_SCHEMA = fails(400, "response_format is not supported")
PICK = ("pick", '{"object": "red_cube"}')
PLACE = ("place_in", '{"container": "grey_bin"}')
FINISH = ("finish", '{"summary": "It is in the bin.", "holds": ["inside(red_cube, grey_bin)"]}')


@pytest.fixture(autouse=True)
def _nothing_is_known_of_servers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endpoint_capabilities, "_PROCESS_CACHE", endpoint_capabilities.EndpointCache())
    for name in ("OPENAI_BASE_URL", "HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(scope="module")
def world() -> Iterator[EmbeddedWorkcell]:
    with open_session("put_in_bin") as session:
        yield session


def call(name: str, **arguments: Any) -> tuple[str, str]:
    return name, json.dumps(arguments)


def steps(*calls: tuple[str, str]) -> list[dict[str, Any]]:
    return [{"skill": name, "arguments": json.loads(arguments)} for name, arguments in calls]


def act(world: EmbeddedWorkcell, server: ScriptedServer, prompt: str | None = None, **options: Any) -> Episode:
    """Run a prompt in the world as it was written, with a scripted model that acts."""
    from robosandbox.agent.planners import make_planner

    world.reset()
    told = {"model": "scripted", "base_url": server.url, "mode": "act", **options}
    world.agent.planner = make_planner("openai", [*world.skills], told)
    return world.run(prompt)


def results(body: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return what a request tells of the calls of the turn before it."""
    told: list[dict[str, Any]] = []
    for message in reversed(body["messages"]):
        if message["role"] != "tool":
            break
        told.insert(0, json.loads(message["content"]))
    return told


def test_calls_are_carried_out_one_by_one_and_the_end_is_checked(world: EmbeddedWorkcell) -> None:
    heard: list[AgentEvent] = []
    leave = world.ctx.events.subscribe(heard.append)
    with ScriptedServer(NO_SCHEMA, tool_calls(PICK), tool_calls(PLACE), tool_calls(FINISH)) as server:
        episode = act(world, server)
    leave()
    assert episode.success and episode.claim == "It is in the bin." and world.judge().success
    assert (
        [str(one) for one in episode.plan.steps] == ["pick(object=red_cube)", "place_in(container=grey_bin)"]
        if episode.plan
        else False
    )
    assert [len(event.plan.steps) for event in heard if isinstance(event, Planned)] == [1, 1]
    (told,) = results(server.requests[2])
    assert told["ok"] and told["done"][0]["detail"]["dz_mm"] > 50 and told["changes"]["held"] == "red_cube"
    assert [thing["id"] for thing in told["changes"]["objects"]] == ["red_cube"]


def test_every_tool_says_what_it_needs_and_gives(world: EmbeddedWorkcell) -> None:
    with ScriptedServer(NO_SCHEMA, tool_calls(call("refuse", code="unsupported", message="No."))) as server:
        act(world, server)
    tools = {tool["function"]["name"]: tool["function"] for tool in server.requests[1]["tools"]}
    assert {"look", "check", "simulate", "achieve", "finish", "refuse", *world.agent.skills} == set(tools)
    assert (
        "Needs has_gripper()" in tools["pick"]["description"]
        and "brings about holding(object)" in tools["pick"]["description"]
    )
    assert server.requests[1]["tool_choice"] == "required"


def test_looking_checking_and_trying_out_move_nothing(world: EmbeddedWorkcell) -> None:
    script = [
        tool_calls(call("look"), call("check", steps=steps(PLACE)), call("simulate", steps=steps(PICK))),
        tool_calls(call("check", steps=steps(PICK, PLACE)), call("simulate", steps=steps(PICK, PLACE))),
        tool_calls(call("refuse", code="impossible", message="I would rather not.")),
    ]
    with ScriptedServer(NO_SCHEMA, *script) as server:
        world.reset()
        before = world.simulation.truth()
        episode = act(world, server)
        after = world.simulation.truth()
    assert episode.final_reason is FinalReason.REFUSED and not episode.steps
    assert all(after.objects[name].pose == item.pose for name, item in before.objects.items())
    looked, wrong, left = results(server.requests[2])
    assert {thing["id"] for thing in looked["scene"]["objects"]} >= {"red_cube", "grey_bin"}
    assert (
        not wrong["ok"]
        and wrong["problems"][0]["error"]["message"].endswith("pick something first")
        and "not_begun" in left
    )
    checked, tried = results(server.requests[3])
    assert checked == {"ok": True, "problems": []}
    assert tried["ok"] and tried["would_work"] == ["pick(object=red_cube)", "place_in(container=grey_bin)"]
    assert [one.tool for one in episode.consulted] == ["look", "check", "check", "simulate"]


def test_a_call_that_lacks_something_is_turned_down_with_the_cause_and_nothing_moves(world: EmbeddedWorkcell) -> None:
    refuse = tool_calls(call("refuse", code="impossible", message="No."))
    with ScriptedServer(NO_SCHEMA, tool_calls(PLACE, PICK), refuse) as server:
        episode = act(world, server)
    place, pick = results(server.requests[2])
    assert (
        place["turned_down"][0]["error"]["message"].startswith("the gripper is empty")
        and place["error"]["code"] == "not_holding"
    )
    assert pick["not_begun"] == "place_in before it did not work"
    assert not episode.steps and not episode.attempts and world.observe().held is None


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (call("pick", object="elephant"), "no object 'elephant'"),
        (call("pick", thing="red_cube"), "object: Field required"),
        (call("achieve", goals=["in(red_cube, grey_bin)"]), "in"),
        (call("achieve", goals=["inside(grey_bin, red_cube)"]), "There is no plan"),
        (call("check", steps=[]), "steps: List should have at least 1 item"),
        (call("refuse", code="because", message="x"), "(it is 'because')"),
        (call("finish", summary="Done."), "nothing was done"),
        (call("finish", summary="Done.", holds=["inside(red_cube, grey_bin)"]), "not_holding"),
        (call("finish", summary="Done.", holds=["inside(elephant, grey_bin)"]), "no object 'elephant'"),
    ],
)
def test_what_cannot_be_used_is_told_with_the_field_and_nothing_moves(
    world: EmbeddedWorkcell, wrong: tuple[str, str], told: str
) -> None:
    with ScriptedServer(
        NO_SCHEMA, tool_calls(wrong), tool_calls(call("refuse", code="impossible", message="No."))
    ) as server:
        episode = act(world, server)
    assert told in json.dumps(results(server.requests[2])), results(server.requests[2])
    assert not episode.steps and episode.refusal is not None


def test_goals_are_reached_by_calls_that_are_searched_for(world: EmbeddedWorkcell) -> None:
    achieve = tool_calls(call("achieve", goals=["inside(red_cube, grey_bin)"]))
    with ScriptedServer(NO_SCHEMA, achieve, tool_calls(FINISH)) as server:
        episode = act(world, server)
    assert episode.success and [step.call.skill for step in episode.steps] == ["pick", "place_in"]


def test_a_model_cannot_finish_after_a_failure_and_obeys_a_repair(world: EmbeddedWorkcell) -> None:
    def spoil(body: dict[str, Any]) -> HttpAnswer:
        # The cube is taken out of the gripper's way once, before the pick begins.
        del body
        _fail_once(world)
        return tool_calls(PICK)

    script: list[Script] = [
        NO_SCHEMA,
        spoil,
        tool_calls(call("finish", summary="x")),
        tool_calls(PICK),
        tool_calls(PLACE),
        tool_calls(FINISH),
    ]
    with ScriptedServer(*script) as server:
        episode = act(world, server)
    assert episode.success and episode.replans == 1 and len(episode.attempts) == 1
    (failed,) = results(server.requests[2])
    assert not failed["ok"] and failed["failed"] == "pick(object=red_cube)" and failed["error"]["code"] == "unreachable"
    assert "failed and nothing has succeeded since" in results(server.requests[3])[0]["error"]


def _fail_once(world: EmbeddedWorkcell) -> None:
    def refuse(one: SkillCall) -> None:
        leave()
        raise UnreachableError(f"{one}: out of reach")

    leave = on_calls(world.ctx.events, refuse)


FORMS: dict[str, HttpAnswer] = {
    "JSON by the schema": says(
        '{"thought": "It is red.", "call": {"name": "pick", "arguments": {"object": "red_cube"}}}'
    ),
    "bare JSON": says('{"name": "pick", "arguments": {"object": "red_cube"}}'),
    "fenced JSON": says('```json\n{"name": "pick", "arguments": {"object": "red_cube"}}\n```'),
    "prose around it": says('I pick it up: {"name": "pick", "arguments": {"object": "red_cube"}} Good?'),
    "a thought before it": says(
        '<think>Perhaps {"name": "home"}?</think>{"tool": "pick", "parameters": {"object": "red_cube"}}'
    ),
    "the skill as a key": says('{"pick": {"object": "red_cube"}}'),
    "a tagged call": says('<tool_call>{"name": "pick", "arguments": "{\\"object\\": \\"red_cube\\"}"}</tool_call>'),
    "tool calls as text": says('{"tool_calls": [{"function": {"name": "pick", "arguments": {"object": "red_cube"}}}]}'),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_usual_form_of_a_call_is_understood(world: EmbeddedWorkcell, form: str) -> None:
    finish = says(json.dumps({"name": "finish", "arguments": {"summary": "Held."}}))
    asked: list[Plan] = []

    def no(plan: Plan) -> bool:
        asked.append(plan)
        return False

    world.agent.approve = no
    with ScriptedServer(FORMS[form], finish) as server:
        episode = act(world, server, "pick up the red cube")
    world.agent.approve = None
    assert [str(plan.steps[0]) for plan in asked] == ["pick(object=red_cube)"], server.requests
    assert episode.final_reason is FinalReason.DECLINED and len(server.requests) == 1


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (tool_calls(("pick", '{"object": '), finish="length"), "cut off"),
        (tool_calls(("pick", '{"object": "red_')), "not valid JSON"),
        (tool_calls(("grasp", '{"object": "red_cube"}')), "no tool 'grasp'"),
        (says('{"object": "red_cube"}'), "calls nothing"),
        (
            says('{"name": "pick", "arguments": {"object": "red_cube"}} or {"name": "home", "arguments": {}}'),
            "2 different answers",
        ),
    ],
)
def test_a_form_that_cannot_be_read_is_corrected_and_the_model_obeys(
    world: EmbeddedWorkcell, answer: HttpAnswer, told: str
) -> None:
    refuse = tool_calls(call("refuse", code="unsupported", message="No."))
    with ScriptedServer(NO_SCHEMA, answer, refuse) as server:
        episode = act(world, server)
    assert episode.refusal is not None and episode.refusal.message == "No."
    assert told in json.dumps(server.requests[2]["messages"])


def test_a_server_without_tools_is_told_results_as_text(world: EmbeddedWorkcell) -> None:
    script = [
        NO_SCHEMA,
        fails(400, "no tools"),
        fails(400, "no tools"),
        says('{"name": "look", "arguments": {}}'),
        says('{"refuse": {"code": "unsupported", "message": "No."}}'),
    ]
    with ScriptedServer(*script) as server:
        episode = act(world, server)
    assert episode.refusal is not None
    newest = server.requests[4]["messages"][-1]
    assert (
        newest["role"] == "user" and "<result>" in json.dumps(newest["content"]) and "tools" not in server.requests[4]
    )


# Limits.


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"max_turns": 3}, "3 answers spent"),
        ({"max_tokens": 500}, "tokens spent"),
        ({"session_turns": 2}, "for a session"),
    ],
)
def test_what_a_prompt_may_cost_is_limited(world: EmbeddedWorkcell, options: dict[str, Any], told: str) -> None:
    with ScriptedServer(rest=tool_calls(call("look"))) as server:
        episode = act(world, server, **options)
    assert episode.final_reason is FinalReason.PLANNER_FAILED and told in episode.final_detail
    assert len(server.requests) <= 4


def test_calls_are_limited_and_the_model_is_told(world: EmbeddedWorkcell) -> None:
    refuse = tool_calls(call("refuse", code="impossible", message="No."))
    with ScriptedServer(NO_SCHEMA, tool_calls(("home", "{}")), tool_calls(PICK), refuse) as server:
        episode = act(world, server, max_steps=1)
    assert [step.call.skill for step in episode.steps] == ["home"] and episode.final_reason is FinalReason.GAVE_UP
    assert "at most 1 calls" in results(server.requests[3])[0]["error"]


def test_limits_come_from_options_then_the_environment_then_a_file(
    world: EmbeddedWorkcell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "limits.yaml"
    file.write_text("max_turns: 1\n")
    with ScriptedServer(rest=tool_calls(call("look"))) as server:
        assert "1 answers" in act(world, server, model_limits=file).final_detail
        monkeypatch.setenv("ROBOSANDBOX_MODEL_MAX_TURNS", "2")
        assert "2 answers" in act(world, server, model_limits=file).final_detail
        assert "3 answers" in act(world, server, model_limits=file, max_turns=3).final_detail
        monkeypatch.setenv("ROBOSANDBOX_MODEL_MAX_TURNS", "few")
        with pytest.raises(InputError, match="ROBOSANDBOX_MODEL_MAX_TURNS: 'few'"):
            act(world, server)
        file.write_text("max_turn: 1\n")
        with pytest.raises(InputError, match="'max_turn' is no limit"):
            act(world, server, model_limits=file, max_turns=3)


# People.


def test_a_question_is_put_to_the_person_where_one_is_there(world: EmbeddedWorkcell) -> None:
    asked: list[str] = []
    world.agent.ask = lambda question: asked.append(question) or "the red one"
    script = [
        tool_calls(call("ask_person", message="Which one?")),
        tool_calls(call("refuse", code="unsupported", message="No.")),
    ]
    with ScriptedServer(NO_SCHEMA, *script) as server:
        act(world, server)
    world.agent.ask = None
    assert asked == ["Which one?"] and results(server.requests[2]) == [{"answer": "the red one"}]


def test_a_call_that_is_not_confirmed_moves_nothing(world: EmbeddedWorkcell) -> None:
    world.agent.approve = lambda plan: plan.steps[0].skill != "pick"
    with ScriptedServer(NO_SCHEMA, tool_calls(("home", "{}")), tool_calls(PICK)) as server:
        episode = act(world, server)
    world.agent.approve = None
    assert episode.final_reason is FinalReason.DECLINED and [step.call.skill for step in episode.steps] == ["home"]


def test_earlier_requests_are_remembered(world: EmbeddedWorkcell) -> None:
    home = tool_calls(("home", "{}"), ("finish", '{"summary": "Home."}'))
    with ScriptedServer(NO_SCHEMA, home, tool_calls(call("refuse", code="unsupported", message="No."))) as server:
        act(world, server, "go home")
        world.run("and again")
    said = json.dumps(server.requests[2]["messages"])
    assert "<earlier>" in said and "go home" in said and "home()" in said


def test_auto_lets_the_model_act_only_where_the_grammar_is_not_sure(world: EmbeddedWorkcell) -> None:
    from robosandbox.agent.planners import make_planner

    with ScriptedServer(NO_SCHEMA, tool_calls(("home", "{}"), ("finish", '{"summary": "Home."}'))) as server:
        world.reset()
        world.agent.planner = make_planner(
            "auto", [*world.skills], {"model": "m", "base_url": server.url, "mode": "act"}
        )
        assert world.run("put the red cube in the bin").success and not server.requests
        assert world.run("frobnicate the gizmo").success and len(server.requests) == 2


def test_consulted_tools_are_in_the_record(world: EmbeddedWorkcell) -> None:
    with ScriptedServer(
        NO_SCHEMA, tool_calls(call("look")), tool_calls(call("refuse", code="unsupported", message="No."))
    ) as server:
        record = act(world, server).record()
    assert record["consulted"][0]["tool"] == "look" and isinstance(Consulted(**record["consulted"][0]), Consulted)


@pytest.mark.parametrize(
    "said",
    [
        '{"thought": "It is unclear.", "call": {"name": "refuse", "arguments": {"code": "ambiguous", "message": "?"}}}',
        '<think>It is unclear.</think>{"name": "refuse", "arguments": {"code": "ambiguous", "message": "?"}}',
    ],
)
def test_what_a_model_thinks_is_told_to_listeners(world: EmbeddedWorkcell, said: str) -> None:
    heard: list[AgentEvent] = []
    leave = world.ctx.events.subscribe(heard.append)
    with ScriptedServer(says(said)) as server:
        act(world, server)
    leave()
    assert [event.text for event in heard if isinstance(event, Thought)] == ["It is unclear."]


# What it is told.


def test_a_model_is_told_of_the_robot_and_what_it_can_never_pick_up(world: EmbeddedWorkcell) -> None:
    with ScriptedServer(NO_SCHEMA, tool_calls(call("refuse", code="unsupported", message="No."))) as server:
        act(world, server)
    said = server.requests[1]["messages"][-1]["content"]
    text = said if isinstance(said, str) else said[0]["text"]
    about = json.loads(text.split("<robot>\n")[1].split("\n</robot>")[0])
    assert about["gripper_opens"] == [0.0, 0.08] and "top" in about["cameras"] and "max_force" not in about


@pytest.mark.gl
def test_a_picture_has_the_ids_on_it_and_the_cameras_calibration_beside(world: EmbeddedWorkcell) -> None:
    refuse = tool_calls(call("refuse", code="unsupported", message="No."))
    with ScriptedServer(
        NO_SCHEMA, tool_calls(call("look", camera="moon")), tool_calls(call("look", camera="top")), refuse
    ) as server:
        act(world, server)
    assert "'moon' is not there; there is" in results(server.requests[2])[0]["error"]
    tool, picture = server.requests[3]["messages"][-2:]
    told = json.loads(tool["content"])["picture"]
    column, row = told["pixels"]["red_cube"]
    assert 0 <= column < told["size"][0] and 0 <= row < told["size"][1] and len(told["focal_length"]) == 2
    assert picture["role"] == "user" and picture["content"][0]["image_url"]["url"].startswith("data:image/png;base64,")
