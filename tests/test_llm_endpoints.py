"""What is learnt of an endpoint and kept for the next process, and answers that arrive piece by piece."""

import json
import re
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pydantic_ai.messages import ModelResponse, TextPart, ToolCallPart

from robosandbox.agent.episode import Planned, Writing
from robosandbox.agent.llm import endpoint_capabilities
from robosandbox.agent.llm.draft import AnswerStream
from robosandbox.agent.llm.endpoint_capabilities import EndpointCache
from robosandbox.agent.llm.modes import Mode
from robosandbox.agent.overheard import overheard
from robosandbox.agent.planners import make_planner
from robosandbox.agent.usage import Exchange, Usage
from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import EXIT_DONE, run_app
from robosandbox.apps.commands.live import LiveView
from robosandbox.apps.conformance.openai_server import HttpAnswer, ScriptedServer, fails, plan, says
from robosandbox.apps.conformance.openai_stream import chat_events
from robosandbox.errors import PlannerUnavailableError
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose, SkillCall
from robosandbox.workcell.session import open_session

SKILLS = load_skills()
PICK = plan(("pick", {"object": "red_cube"}))
WRITTEN = '{"answer": {"steps": [{"skill": "pick", "arguments": {"object": "red_cube"}}]}}'
CUBE = DetectedObject(
    id="red_cube",
    kind="box",
    size=(0.02, 0.02, 0.02),
    colour="red",
    rgba=(0.8, 0.1, 0.1, 1.0),
    pose=Pose(xyz=(0.1, 0.0, 0.06)),
)
SCENE = ObservedScene(time=1.0, objects=(CUBE,), table_height=0.04, base_xy=(-0.3, 0.0))


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give every test a file of its own, as of a process that begins."""
    begin(monkeypatch, tmp_path / "endpoints.json")
    return tmp_path / "endpoints.json"


def begin(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    monkeypatch.setattr(endpoint_capabilities, "_PROCESS_CACHE", EndpointCache(file))


def stalling(whole: HttpAnswer) -> HttpAnswer:
    """Return an answer of which the last tenth does not come."""
    return replace(whole, send=len(chat_events(json.loads(whole.body))) * 9 // 10, then="stall")


def ask(server: ScriptedServer, service: str = "openai", **options: Any) -> Plan:
    asking = make_planner(service, SKILLS, {"model": "scripted", "base_url": server.url, **options})
    answer = asking.plan("pick up the red cube", SCENE)
    assert isinstance(answer, Plan)
    return answer


# What is remembered.


def test_the_next_process_begins_with_what_this_one_has_learnt(monkeypatch: pytest.MonkeyPatch, state: Path) -> None:
    with ScriptedServer(fails(400, "no schema"), PICK, PICK) as server:
        ask(server)
        begin(monkeypatch, state)
        ask(server)
        assert server.requests[2]["tool_choice"] == "required"
    (entry,) = json.loads(state.read_text())
    assert entry["where"] == ["openai", server.url, "scripted"] and entry["mode"] == "tools"
    assert (state.stat().st_mode & 0o077) == 0


def test_a_refusal_of_what_worked_before_is_forgotten_and_probed_anew(
    monkeypatch: pytest.MonkeyPatch, state: Path
) -> None:
    with ScriptedServer(fails(400, "no schema"), PICK, fails(400, "no tools any more"), says(WRITTEN)) as server:
        ask(server)
        begin(monkeypatch, state)
        ask(server)
        assert "response_format" in server.requests[3]
    assert json.loads(state.read_text())[0]["mode"] == "schema"


def test_an_answer_that_contradicts_what_is_known_is_asked_for_in_the_next_way(state: Path) -> None:
    with ScriptedServer(says(WRITTEN), says("I will pick it up."), PICK) as server:
        ask(server)
        ask(server)
    assert server.requests[2]["tool_choice"] == "required" and json.loads(state.read_text())[0]["mode"] == "tools"


def test_what_is_known_of_one_model_is_not_said_of_another() -> None:
    with ScriptedServer(fails(400, "no schema"), PICK, says(WRITTEN)) as server:
        ask(server)
        ask(server, model="other")
        assert "response_format" in server.requests[2]


def test_a_month_later_a_server_is_probed_anew(monkeypatch: pytest.MonkeyPatch, state: Path) -> None:
    learnt = EndpointCache(state)
    learnt.learn(("openai", "http://127.0.0.1:1/v1", "m"), mode=Mode.TEXT)
    rows = json.loads(state.read_text())
    assert EndpointCache(state).of(("openai", "http://127.0.0.1:1/v1", "m")).mode is Mode.TEXT
    state.write_text(json.dumps([{**rows[0], "since": time.time() - 40 * 86_400}]))
    assert EndpointCache(state).of(("openai", "http://127.0.0.1:1/v1", "m")).mode is None


@pytest.mark.parametrize(
    "text",
    ["", "no json", "{}", "[1]", '[{"where": ["a"], "mode": "text", "streams": null, "since": 1}]', "[" * 90_000]
    + [
        json.dumps([{"where": ["a", "b", "c"], "mode": mode, "streams": 1, "since": 1}]) for mode in ("best", "text", 7)
    ],
)
def test_a_damaged_file_costs_requests_and_nothing_else(state: Path, text: str) -> None:
    state.write_text(text)
    with ScriptedServer(PICK) as server:
        ask(server)
    assert [row["mode"] for row in json.loads(state.read_text())] == ["schema"]


def test_a_disk_that_cannot_be_written_is_no_hindrance(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "a file").write_text("")
    begin(monkeypatch, tmp_path / "a file" / "endpoints.json")
    with ScriptedServer(PICK, PICK) as server:
        ask(server)
        ask(server)
    assert len(server.requests) == 2


def test_two_processes_keep_what_each_has_learnt(state: Path) -> None:
    first, second = EndpointCache(state), EndpointCache(state)
    first.of(("openai", "a", "m")), second.of(("openai", "a", "m"))
    first.learn(("openai", "a", "m"), mode=Mode.TEXT)
    second.learn(("openai", "b", "m"), streams=True)
    third = EndpointCache(state)
    assert third.of(("openai", "a", "m")).mode is Mode.TEXT and third.of(("openai", "b", "m")).streams is True


# What is told while it is written.


TWO = {"steps": [{"skill": "pick", "arguments": {"object": "red_cube"}}, {"skill": "home", "arguments": {}}]}


@pytest.mark.parametrize("service", ["openai", "responses"])
@pytest.mark.parametrize(
    ("script", "thought"),
    [
        ([says(json.dumps({"answer": TWO}))], ""),
        ([fails(400, "no schema"), fails(400, "no schema"), plan(("pick", {"object": "red_cube"}), ("home", {}))], ""),
        ([says("<think>The cube is there.</think>" + json.dumps({"answer": TWO}))], "The cube is there."),
    ],
)
def test_thought_and_calls_are_told_and_the_plan_is_the_same(
    monkeypatch: pytest.MonkeyPatch, service: str, script: list[HttpAnswer], thought: str
) -> None:
    monkeypatch.setattr("robosandbox.agent.llm.draft._PAUSE", 0.0)
    heard: list[Writing] = []
    with ScriptedServer(*script) as server, overheard(heard.append):
        answer = ask(server, service)
    assert server.requests[0]["stream"] is True
    assert "".join(event.thought for event in heard) == thought
    assert [str(call) for event in heard for call in event.calls] == [str(call) for call in answer.steps]


def test_a_call_is_told_before_the_answer_ends_and_the_deadline_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosandbox.agent.llm.draft._PAUSE", 0.0)
    heard: list[Writing] = []
    whole = says(json.dumps({"answer": TWO}))
    with ScriptedServer(stalling(whole)) as server, overheard(heard.append):
        begun = time.monotonic()
        with pytest.raises(PlannerUnavailableError, match="no complete answer within"):
            ask(server, time_limit=1.0)
        assert time.monotonic() - begun < 10.0
    assert [str(call) for event in heard for call in event.calls] == ["pick(object=red_cube)"]


def test_nobody_listening_nothing_is_streamed() -> None:
    with ScriptedServer(PICK) as server:
        ask(server)
    assert not server.requests[0].get("stream")


def test_a_server_that_does_not_stream_is_asked_once(state: Path) -> None:
    heard: list[Writing] = []
    with ScriptedServer(PICK, PICK, PICK, streams=False) as server, overheard(heard.append):
        assert ask(server) == ask(server)
    assert [bool(body.get("stream")) for body in server.requests] == [True, False, False]
    assert json.loads(state.read_text())[0]["streams"] is False and not heard


@pytest.mark.parametrize(
    "broken",
    [
        lambda whole: replace(whole, send=1500, then="drop"),
        lambda whole: HttpAnswer(body=b'{"choices": 3}'),
        lambda whole: HttpAnswer(body=b"no json"),
        lambda whole: fails(503, "busy", retry_after="0"),
    ],
)
def test_a_stream_that_breaks_is_asked_for_again(broken: Callable[[HttpAnswer], HttpAnswer]) -> None:
    whole = says(json.dumps({"answer": TWO}))
    with ScriptedServer(broken(whole), whole, whole) as server, overheard(lambda event: None):
        assert len(ask(server).steps) == 2
    assert len(server.requests) <= 3


def test_a_stream_without_end_is_not_read_to_its_end() -> None:
    # Each of its events has eight of these characters, and over a hundred bytes besides.
    endless = says("x" * 60_000)
    with ScriptedServer(endless) as server, overheard(lambda event: None), pytest.raises(Exception, match="more than"):
        ask(server)


@pytest.fixture
def plain_ctrl_c() -> Iterator[None]:
    """Ctrl-C as Python has it at its start: commands that ran in this process before leave handlers of their own."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("plain_ctrl_c")
@pytest.mark.parametrize("mode", ["plan", "act"])
def test_ctrl_c_while_a_model_writes_ends_run_at_once(monkeypatch: pytest.MonkeyPatch, mode: str) -> None:
    monkeypatch.setattr("robosandbox.agent.llm.draft._PAUSE", 0.0)
    whole = says(json.dumps({"answer": TWO}))
    with ScriptedServer(stalling(whole)) as server:
        told = {"model": "scripted", "base_url": server.url, "mode": mode}
        with open_session("pick_cube_franka", planner="openai", planner_options=told, what_if=False) as session:

            def interrupt(event: object) -> None:
                if isinstance(event, Writing):
                    session.agent.left = True
                    signal.raise_signal(signal.SIGINT)

            session.agent.streams = True
            session.ctx.events.subscribe(interrupt)
            episode = session.run("pick up the red cube")
    assert episode.final_reason == "cancelled" and not episode.steps


def test_an_agent_tells_what_is_written_before_what_is_planned() -> None:
    heard: list[object] = []
    with ScriptedServer(plan(("home", {}))) as server:
        told = {"model": "scripted", "base_url": server.url}
        with open_session("pick_cube_franka", planner="openai", planner_options=told, what_if=False) as session:
            session.agent.streams = True
            session.ctx.events.subscribe(heard.append)
            assert session.run("frobnicate").success
    kinds = [type(event) for event in heard]
    assert kinds.index(Writing) < kinds.index(Planned)


def test_only_calls_that_are_complete_are_told() -> None:
    heard: list[Writing] = []
    draft = AnswerStream(heard.append)
    text = json.dumps({"thought": "Both of them.", "call": {"name": "pick", "arguments": {"object": "red_cube"}}})
    for end in range(0, len(text) + 1, 3):
        draft.show(ModelResponse(parts=[TextPart(text[:end])]), whole=False)
    assert "".join(event.thought for event in heard) == "Both of them." and not any(event.calls for event in heard)
    draft.show(ModelResponse(parts=[TextPart(text)]), whole=True)
    assert [str(call) for event in heard for call in event.calls] == ["pick(object=red_cube)"]


def test_a_native_call_is_told_when_the_next_one_begins() -> None:
    heard: list[Writing] = []
    draft = AnswerStream(heard.append)
    first = ToolCallPart("pick", '{"object": "red_cube"}', tool_call_id="a")
    draft.show(ModelResponse(parts=[first]), whole=False)
    draft.show(ModelResponse(parts=[first, ToolCallPart("home", "", tool_call_id="b")]), whole=False)
    assert [str(call) for event in heard for call in event.calls] == ["pick(object=red_cube)"]


def test_a_record_holds_what_was_written_as_it_came(tmp_path: Path) -> None:
    with ScriptedServer(fails(400, "no schema"), fails(400, "no schema"), plan(("home", {}))) as server:
        world = ["--planner", "openai", "--model", "m", "--base-url", server.url, "--record", str(tmp_path / "r")]
        assert run_app(app, "robo-sandbox", ["run", "frobnicate", *world]) == EXIT_DONE
    (events,) = tmp_path.rglob("events.jsonl")
    told = [json.loads(line) for line in events.read_text().splitlines()]
    names = [line["event"] for line in told]
    assert names.index("writing") < names.index("planned")
    assert told[names.index("writing")]["calls"] == [{"skill": "home", "arguments": {}}]


def test_a_terminal_shows_what_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    live = LiveView()
    live(Writing(thought="The cube is "))
    live(Writing(thought="there.", calls=(SkillCall(skill="home", arguments={}),)))
    assert live._being_written() == "drafts: home()"
    live(Planned(Plan(steps=(SkillCall(skill="home", arguments={}),)), 0))
    assert "thinks  The cube is there." in capsys.readouterr().err


def test_what_a_prompt_took_is_said_in_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    usage = Usage(exchanges=[Exchange(input_tokens=1200, output_tokens=38, seconds=1.5)] * 2, sent_back=["no JSON"])
    assert str(usage) == "2 requests, 2,400 tokens in, 76 out, 3.0 s; 1 answer sent back"
    live = LiveView(plain=True)
    with ScriptedServer(plan(("pick", {"object": "red_cube"}))) as server:
        told = {"model": "m", "base_url": server.url}
        with open_session("pick_from_three", planner="openai", planner_options=told, what_if=False) as session:
            live.watch(session.agent)
            session.run("make it dance")
    assert re.search(r"asked  1 request, \d+ tokens in, \d+ out, [\d.]+ s$", capsys.readouterr().err, re.MULTILINE)
