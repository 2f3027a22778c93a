"""The MCP server, driven by the SDK's own client: over stdin and stdout of a real process, and over HTTP."""

import asyncio
import base64
import contextlib
import importlib.util
import json
import os
import socket
import subprocess
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import anyio
import mcp_types as types
import pytest
from mcp import Client
from mcp.client.stdio import StdioServerParameters
from mcp.shared.exceptions import MCPError
from support.flatness import unflat
from support.processes import mcp_command, mcp_over_http

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import EXIT_USAGE, run_app
from robosandbox.apps.mcp import tools
from robosandbox.apps.mcp.robot import McpRobot
from robosandbox.apps.mcp.server import build_server
from robosandbox.skills.catalogue import load_skills
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.session import open_session

PROGRAM = mcp_command()
BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
Visit = Callable[[Client], Awaitable[None]]


@contextlib.asynccontextmanager
async def over_stdio(*arguments: str) -> AsyncIterator[Client]:
    server = StdioServerParameters(command=PROGRAM[0], args=[*PROGRAM[1:], *arguments])
    async with Client(server) as client:
        yield client


@contextlib.asynccontextmanager
async def over_http(*arguments: str) -> AsyncIterator[Client]:
    with mcp_over_http(*arguments) as url:
        async with Client(url) as client:
            yield client


def here(session: EmbeddedWorkcell, timeout: float = 120.0) -> McpRobot:
    host = WorkcellHost(session)
    host.start()
    return McpRobot(host, timeout=timeout)


@contextlib.asynccontextmanager
async def in_process(session: EmbeddedWorkcell) -> AsyncIterator[Client]:
    robot = here(session)
    try:
        async with Client(build_server(robot.ready)) as client:
            yield client
    finally:
        robot.close()


WAYS = {"stdio": over_stdio, "http": over_http}


def structured(result: types.CallToolResult) -> dict[str, Any]:
    """Return a result's data, which its text repeats."""
    (text, *_) = result.content
    assert isinstance(text, types.TextContent)
    data: dict[str, Any] = result.structured_content
    assert json.loads(text.text.splitlines()[-1]) == data
    return data


async def resource(client: Client, uri: str) -> types.TextResourceContents | types.BlobResourceContents:
    return (await client.read_resource(uri)).contents[0]


async def scene(client: Client) -> dict[str, Any]:
    content = await resource(client, "robosandbox://scene")
    assert isinstance(content, types.TextResourceContents)
    data: dict[str, Any] = json.loads(content.text)
    return data


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.sample(every=2)
def test_a_client_lists_tools_picks_places_cancels_and_sees_typed_errors(way: str) -> None:
    async def visit() -> None:
        async with WAYS[way]("--task", "put_in_bin") as client:
            await _lists_tools(client)
            await _picks_and_places(client)
            await _sees_errors(client)
            await _plans_and_refuses(client)
            await _simulates_runs_resets_and_judges(client)
            await _moves_the_hand(client)
            await _loads(client)

    asyncio.run(visit())


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.sample(every=2)
def test_a_client_cancels_a_running_goal_and_the_arm_stands_still(way: str) -> None:
    async def visit() -> None:
        # At the speed of the clock a pick takes seconds, so that there is something to cancel.
        async with WAYS[way]("--task", "put_in_bin", "--realtime") as client:
            await _cancels(client)
            assert not (await client.call_tool("home")).is_error

    asyncio.run(visit())


async def _lists_tools(client: Client) -> None:
    listed = {tool.name: tool for tool in (await client.list_tools()).tools}
    skills = load_skills()
    assert {*(skill.name for skill in skills), *tools.OWN} <= set(listed)
    assert all(tool.output_schema and tool.annotations for tool in listed.values())
    assert not [(name, found) for name, tool in listed.items() for found in unflat(tool.input_schema)]
    assert not any("anyOf" in tool.output_schema for tool in listed.values())
    assert listed["look"].annotations.read_only_hint and listed["reset"].annotations.destructive_hint
    for skill in skills:
        assert set(listed[skill.name].input_schema.get("properties", {})) == set(skill.schema["properties"])
        assert listed[skill.name].description.startswith(skill.description)


def _keeps_to_its_schema(tool: types.Tool, result: types.CallToolResult) -> bool:
    from jsonschema import Draft202012Validator

    assert tool.output_schema is not None
    return bool(Draft202012Validator(tool.output_schema).is_valid(result.structured_content))


async def _picks_and_places(client: Client) -> None:
    phases: list[str] = []

    async def hear(progress: float, total: float | None, message: str | None) -> None:
        phases.append(message or "")

    before = await scene(client)
    assert before["held"] is None
    picked = await client.call_tool("pick", {"object": "red_cube"}, progress_callback=hear)
    assert not picked.is_error and structured(picked)["detail"]["dz_mm"] > 50.0
    assert any(phase.endswith(": lift") for phase in phases) and len(phases) >= 4
    assert (await scene(client))["held"] == "red_cube"
    placed = await client.call_tool("place_in", {"container": "grey_bin"})
    assert not placed.is_error, placed
    assert (await scene(client))["held"] is None


async def _cancels(client: Client) -> None:
    """Stop a pick once it moves; the arm then stands still and takes the next goal."""
    moving = anyio.Event()

    async def hear(progress: float, total: float | None, message: str | None) -> None:
        if message and message.endswith(": approach"):
            moving.set()

    async with anyio.create_task_group() as group:

        async def pick() -> None:
            await client.call_tool("pick", {"object": "red_cube"}, progress_callback=hear)
            raise AssertionError("the pick was not cancelled")

        group.start_soon(pick)
        await moving.wait()
        group.cancel_scope.cancel()
    # The cancel travels by itself; until it has arrived the pick goes on.
    while structured(await client.call_tool("look"))["doing"] is not None:
        pass
    first = structured(await client.call_tool("look"))["state"]
    second = structured(await client.call_tool("look"))["state"]
    assert first["q"] == pytest.approx(second["q"], abs=2e-3)
    assert (await scene(client))["held"] is None


async def _sees_errors(client: Client) -> None:
    listed = {tool.name: tool for tool in (await client.list_tools()).tools}
    gone = await client.call_tool("pick", {"object": "elephant"})
    assert gone.is_error and _keeps_to_its_schema(listed["pick"], gone)
    unread = await client.call_tool("check", {"steps": []})
    assert unread.is_error and _keeps_to_its_schema(listed["check"], unread)
    for steps, told in (
        ([], "List should have at least 1 item"),
        (["pick"], "steps.0: Input should be a valid object"),
    ):
        message = structured(await client.call_tool("check", {"steps": steps}))["error"]["message"]
        assert told in message and '{"skill": "pick", "arguments": {"object": "red_cube"}}' in message
    assert _keeps_to_its_schema(listed["look"], await client.call_tool("look"))
    error = structured(gone)["error"]
    assert error["code"] == "object_not_found" and "red_cube" in error["evidence"]["seen"]
    wrong = structured(await client.call_tool("push", {"object": "red_cube", "direction": "up"}))["error"]
    assert wrong["code"] == "invalid_argument" and "direction" in wrong["message"]
    empty = structured(await client.call_tool("place_in", {"container": "grey_bin"}))["error"]
    assert empty["code"] == "not_holding"
    with pytest.raises(MCPError, match="did you mean 'pick'"):
        await client.call_tool("pik", {"object": "red_cube"})
    with pytest.raises(MCPError, match="no resource"):
        await client.read_resource("robosandbox://secrets")
    with pytest.raises(MCPError, match="no camera 'moon'"):
        await client.read_resource("robosandbox://camera/moon")


async def _plans_and_refuses(client: Client) -> None:
    before = structured(await client.call_tool("look"))["state"]
    planned = structured(await client.call_tool("plan", {"prompt": "pick up the cube"}))
    assert planned == {"plan": [{"skill": "pick", "arguments": {"object": "red_cube"}}], "refusal": None}
    refused = structured(await client.call_tool("plan", {"prompt": "pick up the elephant"}))
    assert refused["plan"] is None and refused["refusal"]["code"] == "object_not_found"
    steps = [{"skill": "place_in", "arguments": {"container": "grey_bin"}}]
    checked = structured(await client.call_tool("check", {"steps": steps}))
    assert not checked["ok"] and checked["problems"][0]["error"]["code"] == "not_holding"
    said = structured(await client.call_tool("refuse", {"code": "unsupported", "message": "I have no wings."}))
    assert said == {
        "plan": None,
        "refusal": {"code": "unsupported", "message": "I have no wings.", "candidates": [], "sure": True},
    }
    wrong = await client.call_tool("refuse", {"code": "because", "message": "no"})
    assert wrong.is_error and structured(wrong)["error"]["code"] == "invalid_argument"
    assert structured(await client.call_tool("look"))["state"]["q"] == before["q"]


async def _simulates_runs_resets_and_judges(client: Client) -> None:
    told: list[str] = []

    async def hear(progress: float, total: float | None, message: str | None) -> None:
        told.append(message or "")

    assert structured(await client.call_tool("reset", {"seed": 0}))["seed"] == 0
    assert not structured(await client.call_tool("judge"))["success"]
    begin = (await scene(client))["objects"]
    steps = [
        {"skill": "pick", "arguments": {"object": "red_cube"}},
        {"skill": "place_in", "arguments": {"container": "grey_bin"}},
    ]
    assert structured(await client.call_tool("check", {"steps": steps})) == {"ok": True, "problems": []}
    tried = structured(await client.call_tool("simulate", {"steps": steps}))
    assert tried["ok"] and len(tried["would_work"]) == 2 and (await scene(client))["objects"] == begin
    ran = await client.call_tool("run", {"prompt": "put the red cube in the bin"}, progress_callback=hear)
    assert not ran.is_error and [one["call"] for one in structured(ran)["done"]] == [
        "pick(object=red_cube)",
        "place_in(container=grey_bin)",
    ]
    assert told[0].startswith("plan: pick(object=red_cube)") and any(text.endswith(": lift") for text in told)
    assert structured(await client.call_tool("judge"))["success"]
    assert structured(await client.call_tool("reset"))["task"] == "put_in_bin"
    assert (await scene(client))["objects"] == begin
    reached = await client.call_tool("achieve", {"goals": ["inside(red_cube, grey_bin)"]})
    assert not reached.is_error and structured(await client.call_tool("judge"))["success"]
    wrong = await client.call_tool("achieve", {"goals": ["in(red_cube, grey_bin)"]})
    assert wrong.is_error and structured(wrong)["error"]["code"] == "invalid_argument"
    refused = await client.call_tool("run", {"prompt": "pick up the elephant"})
    assert refused.is_error and structured(refused)["refusal"]["code"] == "object_not_found"


async def _moves_the_hand(client: Client) -> None:
    """The hand goes where it is sent, and nowhere else."""
    there = structured(await client.call_tool("move_to", {"x": 0.2, "y": 0.1, "z": 0.3}))["detail"]
    assert there["off_mm"] < 5.0
    narrow = structured(await client.call_tool("close_gripper"))["detail"]["width_mm"]
    assert structured(await client.call_tool("open_gripper"))["detail"]["width_mm"] > narrow + 50.0
    before = structured(await client.call_tool("look"))["state"]["q"]
    far = await client.call_tool("move_to", {"x": 2.0, "y": 0.0, "z": 0.3})
    below = await client.call_tool("move_to", {"x": 0.2, "y": 0.1, "z": 0.02})
    endless = await client.call_tool("move_to", {"x": 1e400, "y": 0.1, "z": 0.3})
    codes = [structured(one)["error"]["code"] for one in (far, below, endless)]
    assert codes == ["unreachable", "collision", "invalid_argument"]
    assert structured(await client.call_tool("look"))["state"]["q"] == before
    content = await resource(client, "robosandbox://last_failure")
    assert isinstance(content, types.TextResourceContents)
    assert json.loads(content.text)["error"]["code"] == "invalid_argument"


async def _loads(client: Client) -> None:
    loaded = structured(await client.call_tool("load", {"task": "pick_cube_franka"}))
    assert loaded == {"task": "pick_cube_franka", "prompt": loaded["prompt"], "seed": 0}
    assert structured(await client.call_tool("load", {"task": "no_such"}))["error"]["code"] == "invalid_argument"
    assert not (await client.call_tool("run", {"prompt": loaded["prompt"]})).is_error
    assert structured(await client.call_tool("judge"))["success"]
    prompts = [prompt.name for prompt in (await client.list_prompts()).prompts]
    assert prompts == ["do", "explain_failure"]
    written = await client.get_prompt("do", {"request": "go home"})
    assert "go home" in written.messages[0].content.text


def test_a_client_that_dies_leaves_no_traceback() -> None:
    server = subprocess.Popen(
        [*PROGRAM, "--task", "put_in_bin", "--realtime"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert server.stdin and server.stdout

    def say(**message: Any) -> None:
        server.stdin.write(json.dumps({"jsonrpc": "2.0", **message}) + "\n")
        server.stdin.flush()

    about = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}}
    say(id=1, method="initialize", params=about)
    server.stdout.readline()
    say(method="notifications/initialized")
    call = {"name": "pick", "arguments": {"object": "red_cube"}, "_meta": {"progressToken": 1}}
    say(id=2, method="tools/call", params=call)
    assert "progress" in server.stdout.readline()
    server.stdout.close()
    server.stdin.close()
    assert server.wait(timeout=60) == 0
    assert server.stderr is not None and "Traceback" not in server.stderr.read()


PRINTING = """
from robosandbox.skills.base import Skill
from robosandbox.types import SkillResult
class Chat(Skill):
    name = "chat"
    def run(self, ctx) -> SkillResult:
        print("a line that a skill prints")
        return SkillResult(skill="chat")
"""


def test_what_a_skill_prints_goes_to_stderr_and_stdout_holds_messages_alone(tmp_path: Path) -> None:
    package = tmp_path / "chat-1.0.dist-info"
    package.mkdir()
    (tmp_path / "chat.py").write_text(PRINTING)
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: chat\nVersion: 1.0\n")
    (package / "entry_points.txt").write_text("[robosandbox.skills]\nchat = chat:Chat\n")
    about = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}}
    server = subprocess.Popen(
        PROGRAM,
        env={**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONUNBUFFERED": ""},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert server.stdin and server.stdout
    for message in (
        {"id": 1, "method": "initialize", "params": about},
        {"method": "notifications/initialized"},
        {"id": 2, "method": "tools/call", "params": {"name": "chat", "arguments": {}}},
    ):
        server.stdin.write(json.dumps({"jsonrpc": "2.0", **message}) + "\n")
        server.stdin.flush()
    answers = [json.loads(server.stdout.readline()) for _ in range(2)]
    assert answers[1]["result"]["structuredContent"]["skill"] == "chat"
    rest, told = server.communicate(timeout=60)
    assert rest == "" and "a line that a skill prints" in told and "Traceback" not in told


@pytest.mark.slow
def test_a_client_works_in_a_sim_process_through_the_server() -> None:
    """With --connect the same tools move the robot of another process."""

    async def visit() -> None:
        with sim_process("--task", "put_in_bin", "--pace", "realtime") as endpoint:
            async with over_stdio("--connect", endpoint) as client:
                await _lists_tools(client)
                await _cancels(client)
        with sim_process("--task", "put_in_bin", "--pace", "fast") as endpoint:
            async with over_stdio("--connect", endpoint) as client:
                await _picks_and_places(client)
                await _sees_errors(client)
                await _plans_and_refuses(client)
                await _simulates_runs_resets_and_judges(client)

    asyncio.run(visit())


async def _converses_reaches_goals_and_goes_back(client: Client) -> None:
    """What every other mouth can do, too: answers, calls, goals, hand moves, the way back."""
    asked = await client.call_tool("run", {"prompt": "pick up the cube"})
    assert asked.is_error and structured(asked)["refusal"]["candidates"] == ["red_cube", "green_cube", "blue_cube"]
    answered = structured(await client.call_tool("run", {"prompt": "the left one"}))
    assert [step["call"] for step in answered["done"]] == ["pick(object=blue_cube)"]
    assert structured(await client.call_tool("undo"))["undone"] == "the left one"
    steps = [{"skill": "move_to", "arguments": {"x": 0.2, "y": 0.1, "z": 0.3}}]
    assert structured(await client.call_tool("check", {"steps": steps}))["ok"]
    assert structured(await client.call_tool("follow", {"steps": steps}))["success"]
    assert structured(await client.call_tool("achieve", {"goals": ["holding(green_cube)"]}))["success"]
    assert structured(await client.call_tool("judge"))["success"]
    assert structured(await client.call_tool("run", {"prompt": "holding(green_cube)"}))["answer"].startswith("It is so")
    assert structured(await client.call_tool("reset", {"seed": 0}))["seed"] == 0
    assert structured(await client.call_tool("run", {"prompt": "open_gripper(), home()"}))["success"]


@pytest.mark.parametrize("way", ["stdio", "http", "connect"])
def test_a_client_converses_reaches_goals_moves_the_hand_and_goes_back(way: str) -> None:
    async def visit() -> None:
        if way != "connect":
            async with WAYS[way]("--task", "pick_from_three") as client:
                await _converses_reaches_goals_and_goes_back(client)
            return
        with sim_process("--task", "pick_from_three", "--pace", "fast") as endpoint:
            async with over_stdio("--connect", endpoint) as client:
                await _converses_reaches_goals_and_goes_back(client)

    asyncio.run(visit())


@contextlib.contextmanager
def sim_process(*arguments: str) -> Iterator[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    sim = [*PROGRAM[:-1], "sim", "--listen", endpoint, *arguments]
    process = subprocess.Popen(sim, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    try:
        yield endpoint
    finally:
        process.terminate()
        process.wait(timeout=20)


@pytest.mark.gl
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.sample(every=2)
def test_a_client_reads_the_cameras(way: str) -> None:
    import cv2
    import numpy as np

    async def visit() -> None:
        async with WAYS[way]() as client:
            uris = [item.uri for item in (await client.list_resources()).resources]
            assert {"robosandbox://scene", "robosandbox://state", "robosandbox://camera/top"} <= {*uris}
            content = await resource(client, "robosandbox://camera/top")
            assert isinstance(content, types.BlobResourceContents) and content.mime_type == "image/png"
            picture = cv2.imdecode(np.frombuffer(base64.b64decode(content.blob), np.uint8), cv2.IMREAD_COLOR)
            assert picture is not None and picture.shape == (240, 320, 3) and picture.std() > 5.0
            look = await client.call_tool("look", {"camera": "top"})
            assert isinstance(look.content[1], types.ImageContent)

    asyncio.run(visit())


def test_the_scene_can_be_read_while_a_goal_runs_and_a_second_goal_is_refused() -> None:
    async def visit() -> None:
        with open_session("pick_cube_franka") as session:
            async with in_process(session) as client:
                moving = anyio.Event()

                async def hear(progress: float, total: float | None, message: str | None) -> None:
                    moving.set()

                async with anyio.create_task_group() as group:

                    async def pick() -> None:
                        result = await client.call_tool("pick", {"object": "red_cube"}, progress_callback=hear)
                        assert not result.is_error

                    group.start_soon(pick)
                    await moving.wait()
                    look = structured(await client.call_tool("look"))
                    early = look["state"]["time"]
                    assert look["doing"] == "pick(object=red_cube)"
                    busy = structured(await client.call_tool("home"))["error"]
                    assert busy["code"] == "busy" and "pick(object=red_cube)" in busy["message"]
                late = structured(await client.call_tool("look"))["state"]["time"]
                assert early < late

    asyncio.run(visit())


def test_a_goal_that_takes_too_long_ends_in_a_typed_error() -> None:
    async def visit() -> None:
        with open_session("pick_cube_franka") as session:
            robot = here(session, timeout=0.5)
            async with Client(build_server(robot.ready)) as client:
                error = structured(await client.call_tool("pick", {"object": "red_cube"}))["error"]
            robot.close()
        assert error["code"] == "goal_timeout" and error["evidence"]["deadline"] == 0.5

    asyncio.run(visit())


def test_a_page_of_another_host_is_turned_away() -> None:
    import httpx2

    async def visit() -> None:
        async with over_http() as client:
            url = str(client.server)
            body = {"jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {}}
            accept = {"accept": "application/json, text/event-stream"}
            async with httpx2.AsyncClient() as browser:
                evil = await browser.post(url, json=body, headers={**accept, "origin": "http://evil.example"})
                rebound = await browser.post(url, json=body, headers={**accept, "host": "evil.example"})
        assert evil.status_code == 403 and rebound.status_code == 421

    asyncio.run(visit())


def test_a_skill_may_not_take_the_name_of_an_own_tool() -> None:
    from robosandbox.errors import InputError

    class Look:
        name = "look"

    with pytest.raises(InputError, match="'look'"):
        tools.catalogue([Look()])  # type: ignore[list-item]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--http", "70000"], "--http: 70000"),
        (["--timeout", "0"], "--timeout: 0"),
        (["--task", "pick_cube_frank"], "did you mean 'pick_cube_franka'"),
        (["--planner", "openai"], "--model"),
    ],
)
def test_wrong_options_are_one_line_and_exit_2(
    arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_app(app, "robo-sandbox", ["mcp", *arguments]) == EXIT_USAGE
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and named in err


@pytest.fixture(scope="module")
def clients() -> ModuleType:
    spec = importlib.util.spec_from_file_location("mcp_clients", BENCHMARKS / "mcp_clients.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module", params=["python", "javascript"])
def visitor(request: pytest.FixtureRequest, clients: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return the command of an official client, the JavaScript one installed from npm."""
    try:
        return list(clients.install(request.param, tmp_path_factory.mktemp("visitor")))
    except FileNotFoundError as error:
        pytest.skip(str(error))


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_an_official_client_looks_checks_simulates_runs_cancels_resets_and_judges(
    clients: ModuleType, visitor: list[str], way: str
) -> None:
    found = clients.visit(visitor, way)
    assert not found["failed"] and {*clients.STEPS} <= {*found["shown"]}
