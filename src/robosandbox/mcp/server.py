"""The server: tools that call skills with progress and cancelling, resources that show scene, state and cameras."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Sequence
from typing import Any
from urllib.parse import quote, unquote

import anyio
import mcp_types as types
from mcp.server import Server
from mcp.server.context import ServerRequestContext
from mcp.shared.exceptions import MCPError

from robosandbox import __version__
from robosandbox.errors import (
    InputError,
    PlannerError,
    PlannerUnavailableError,
    RenderingError,
    RoboSandboxError,
    SkillError,
)
from robosandbox.mcp import tools
from robosandbox.mcp.greeting import INSTRUCTIONS, NAME
from robosandbox.mcp.robot import Robot
from robosandbox.protocols import Skill
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import Refusal, SkillCall
from robosandbox.validation import did_you_mean

SCHEME = "robosandbox://"
SCENE, STATE, CAMERA = f"{SCHEME}scene", f"{SCHEME}state", f"{SCHEME}camera/"

Context = ServerRequestContext[Any, Any]


Ready = Callable[[], Awaitable[Robot]]


def build_server(ready: Ready) -> Server[Any]:
    """Return a server for a robot.

    Args:
        ready: Returns the robot as soon as it is there, or raises what kept it from being there: each tool call then says so.
    """

    async def list_tools(ctx: Context, params: types.PaginatedRequestParams | None) -> types.ListToolsResult:
        del ctx, params
        try:
            skills: Sequence[Skill[Any]] = (await ready()).skills
        except RoboSandboxError:
            skills = load_skills()
        return types.ListToolsResult(tools=tools.catalogue(skills))

    async def call_tool(ctx: Context, params: types.CallToolRequestParams) -> types.CallToolResult:
        arguments = params.arguments or {}
        try:
            robot = await ready()
        except RoboSandboxError as error:
            return tools.failed("no_world", f"the world could not be opened: {error}")
        if params.name in {skill.name for skill in robot.skills}:
            return await _perform(robot, ctx, SkillCall(skill=params.name, arguments=arguments))
        own = tools.own_arguments(params.name, arguments)
        match own:
            case None:
                names = [tool.name for tool in tools.catalogue(robot.skills)]
                hint = did_you_mean(params.name, names)
                raise MCPError(types.INVALID_PARAMS, f"no tool {params.name[:60]!r}; there is {', '.join(names)}{hint}")
            case types.CallToolResult():
                return own
            case tools.LookArguments():
                return await _look(robot, own)
            case tools.PlanArguments():
                return await _plan(robot, own)
            case tools.CheckArguments():
                return tools.answer(tools.checked(own, await robot.scene(), robot.skills))
            case tools.RefuseArguments():
                refusal = Refusal(code=own.code, message=own.message, candidates=own.candidates)
                return tools.answer(tools.planned(refusal))
            case _:
                raise MCPError(types.INTERNAL_ERROR, f"{params.name} has no handler")

    async def list_resources(ctx: Context, params: types.PaginatedRequestParams | None) -> types.ListResourcesResult:
        del ctx, params
        return types.ListResourcesResult(resources=_resources(await _there(ready)))

    async def read_resource(ctx: Context, params: types.ReadResourceRequestParams) -> types.ReadResourceResult:
        del ctx
        return types.ReadResourceResult(contents=[await _read(await _there(ready), str(params.uri))])

    return Server(
        NAME,
        version=__version__,
        instructions=INSTRUCTIONS,
        on_list_tools=list_tools,
        on_call_tool=call_tool,
        on_list_resources=list_resources,
        on_read_resource=read_resource,
    )


async def _there(ready: Ready) -> Robot:
    try:
        return await ready()
    except RoboSandboxError as error:
        raise MCPError(types.INTERNAL_ERROR, f"the world could not be opened: {error}") from None


async def _perform(robot: Robot, ctx: Context, call: SkillCall) -> types.CallToolResult:
    """Carry out a skill call, reporting each phase; when the client cancels, the arm stops before this ends."""
    phases: asyncio.Queue[str | None] = asyncio.Queue()
    work = asyncio.ensure_future(robot.perform(call, phases.put_nowait))
    work.add_done_callback(lambda _: phases.put_nowait(None))
    try:
        count = 0
        while (phase := await phases.get()) is not None:
            count += 1
            await ctx.session.report_progress(float(count), message=f"{call}: {phase}")
        return tools.done(await work)
    except asyncio.CancelledError:
        work.cancel()
        await _ended(work)
        raise
    except SkillError as error:
        return tools.skill_failed(error)


async def _ended(work: asyncio.Future[Any]) -> None:
    """Wait for a cancelled call to have stopped the arm."""
    with anyio.CancelScope(shield=True):
        await asyncio.wait([work])


async def _look(robot: Robot, arguments: tools.LookArguments) -> types.CallToolResult:
    if arguments.camera is not None and arguments.camera not in robot.cameras:
        return tools.failed("invalid_argument", _no_camera(robot, arguments.camera))
    data = {"scene": tools.seen(await robot.scene()), "state": tools.state_data(await robot.state())}
    result = tools.answer({**data, "doing": robot.doing, "cameras": list(robot.cameras)})
    if arguments.camera is not None:
        try:
            picture = tools.base64_text(await robot.picture(arguments.camera))
        except RenderingError as error:
            return tools.failed("rendering", str(error))
        result.content.append(types.ImageContent(type="image", data=picture, mime_type="image/png"))
    return result


async def _plan(robot: Robot, arguments: tools.PlanArguments) -> types.CallToolResult:
    try:
        return tools.answer(tools.planned(await robot.plan(arguments.prompt)))
    except (InputError, PlannerError) as error:
        code = "planner_unavailable" if isinstance(error, PlannerUnavailableError) else "planner_failed"
        return tools.failed(code, str(error))


def _resources(robot: Robot) -> list[types.Resource]:
    data = "application/json"
    return [
        types.Resource(uri=SCENE, name="scene", description="What perception sees, and what is held.", mime_type=data),
        types.Resource(uri=STATE, name="state", description="Joints, tool centre point and gripper.", mime_type=data),
        *(
            types.Resource(
                uri=f"{CAMERA}{quote(name, safe='')}",
                name=f"camera {name}",
                description="A picture taken when it is read.",
                mime_type="image/png",
            )
            for name in robot.cameras
        ),
    ]


async def _read(robot: Robot, uri: str) -> types.TextResourceContents | types.BlobResourceContents:
    if uri in (SCENE, STATE):
        data = tools.seen(await robot.scene()) if uri == SCENE else tools.state_data(await robot.state())
        return types.TextResourceContents(uri=uri, mime_type="application/json", text=json.dumps(data))
    name = unquote(uri.removeprefix(CAMERA))
    if not uri.startswith(CAMERA):
        known = ", ".join(item.uri for item in _resources(robot))
        raise MCPError(types.INVALID_PARAMS, f"no resource {uri[:100]!r}; there is {known}")
    if name not in robot.cameras:
        raise MCPError(types.INVALID_PARAMS, _no_camera(robot, name))
    try:
        picture = tools.base64_text(await robot.picture(name))
    except RenderingError as error:
        raise MCPError(types.INTERNAL_ERROR, str(error)) from None
    return types.BlobResourceContents(uri=uri, mime_type="image/png", blob=picture)


def _no_camera(robot: Robot, name: str) -> str:
    return f"no camera {name[:60]!r}; there is {', '.join(robot.cameras)}{did_you_mean(name, robot.cameras)}"
