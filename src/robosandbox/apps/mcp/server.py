"""The server: tools that call skills with progress and cancelling, resources that show scene, state and cameras."""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable
from typing import Any
from urllib.parse import quote, unquote

import mcp_types as types
from mcp.server import Server
from mcp.shared.exceptions import MCPError

from robosandbox import __version__
from robosandbox.agent.tools import error_data, rounded
from robosandbox.apps.mcp import prompts, tools
from robosandbox.apps.mcp.greeting import INSTRUCTIONS, NAME
from robosandbox.apps.mcp.leaving import while_there
from robosandbox.apps.mcp.own import Context, answer_own, failed, no_camera, reported
from robosandbox.apps.mcp.robot import McpRobot
from robosandbox.errors import RoboSandboxError, SkillError
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import SkillCall
from robosandbox.validation import did_you_mean
from robosandbox.world.operators import bind

SCHEME = "robosandbox://"
SCENE, STATE, FAILURE, CAMERA = (f"{SCHEME}{name}" for name in ("scene", "state", "last_failure", "camera/"))

Ready = Callable[[], Awaitable[McpRobot]]


def build_server(ready: Ready) -> Server[Any]:
    """Return a server for a robot.

    Args:
        ready: Returns the robot as soon as it is there, or raises what kept it from being there: each tool call then says so.
    """

    async def list_tools(ctx: Context, params: types.PaginatedRequestParams | None) -> types.ListToolsResult:
        del ctx, params
        try:
            robot = await ready()
        except RoboSandboxError:
            return types.ListToolsResult(tools=tools.catalogue(load_skills()))
        return types.ListToolsResult(tools=tools.catalogue(robot.calls))

    async def call_tool(ctx: Context, params: types.CallToolRequestParams) -> types.CallToolResult:
        arguments = params.arguments or {}
        try:
            robot = await ready()
        except RoboSandboxError as error:
            return tools.failed("no_world", f"the world could not be opened: {error}")
        if params.name in robot.cell.calls:
            return await while_there(ctx, _perform(robot, ctx, SkillCall(skill=params.name, arguments=arguments)))
        own = tools.own_arguments(params.name, arguments)
        if own is None:
            names = [tool.name for tool in tools.catalogue(robot.calls)]
            hint = did_you_mean(params.name, names)
            raise MCPError(types.INVALID_PARAMS, f"no tool {params.name[:60]!r}; there is {', '.join(names)}{hint}")
        return own if isinstance(own, types.CallToolResult) else await while_there(ctx, answer_own(robot, ctx, own))

    async def list_resources(ctx: Context, params: types.PaginatedRequestParams | None) -> types.ListResourcesResult:
        del ctx, params
        return types.ListResourcesResult(resources=_resources(await _opened(ready)))

    async def read_resource(ctx: Context, params: types.ReadResourceRequestParams) -> types.ReadResourceResult:
        del ctx
        robot = await _opened(ready)
        try:
            return types.ReadResourceResult(contents=[await _read(robot, str(params.uri))])
        except RoboSandboxError as error:
            raise MCPError(types.INTERNAL_ERROR, str(error)) from None

    async def list_prompts(ctx: Context, params: types.PaginatedRequestParams | None) -> types.ListPromptsResult:
        del ctx, params
        return prompts.listed()

    async def get_prompt(ctx: Context, params: types.GetPromptRequestParams) -> types.GetPromptResult:
        del ctx
        return prompts.written(params)

    return Server(
        NAME,
        version=__version__,
        instructions=INSTRUCTIONS,
        on_list_tools=list_tools,
        on_call_tool=call_tool,
        on_list_resources=list_resources,
        on_read_resource=read_resource,
        on_list_prompts=list_prompts,
        on_get_prompt=get_prompt,
    )


async def _opened(ready: Ready) -> McpRobot:
    try:
        return await ready()
    except RoboSandboxError as error:
        raise MCPError(types.INTERNAL_ERROR, f"the world could not be opened: {error}") from None


async def _perform(robot: McpRobot, ctx: Context, call: SkillCall) -> types.CallToolResult:
    """Carry out a skill call, reporting each phase; when the client cancels, the arm stops before this ends."""
    try:
        bound = bind(call, robot.cell.calls)
        return tools.ended(await reported(ctx, lambda tell: robot.carry_out(bound, tell)))
    except SkillError as error:
        robot.last_failure = error.failure
        return tools.skill_failed(error)
    except RoboSandboxError as error:
        return failed(error)


def _resources(robot: McpRobot) -> list[types.Resource]:
    data = "application/json"
    return [
        types.Resource(uri=SCENE, name="scene", description="What perception sees, and what is held.", mime_type=data),
        types.Resource(uri=STATE, name="state", description="Joints, tool centre point and gripper.", mime_type=data),
        types.Resource(
            uri=FAILURE, name="last failure", description="The last error of a skill, with evidence.", mime_type=data
        ),
        *(
            types.Resource(
                uri=f"{CAMERA}{quote(name, safe='')}",
                name=f"camera {name}",
                description="A picture taken when it is read.",
                mime_type="image/png",
            )
            for name in robot.cell.cameras
        ),
    ]


async def _read(robot: McpRobot, uri: str) -> types.TextResourceContents | types.BlobResourceContents:
    if uri in (SCENE, STATE, FAILURE):
        data = await _data(robot, uri)
        return types.TextResourceContents(uri=uri, mime_type="application/json", text=json.dumps(data))
    name = unquote(uri.removeprefix(CAMERA))
    if not uri.startswith(CAMERA):
        known = ", ".join(item.uri for item in _resources(robot))
        raise MCPError(types.INVALID_PARAMS, f"no resource {uri[:100]!r}; there is {known}")
    if name not in robot.cell.cameras:
        raise MCPError(types.INVALID_PARAMS, no_camera(robot, name))
    picture = tools.base64_text(await robot.picture(name))
    return types.BlobResourceContents(uri=uri, mime_type="image/png", blob=picture)


async def _data(robot: McpRobot, uri: str) -> dict[str, Any]:
    """Return what a resource with data holds."""
    if uri == SCENE:
        return tools.seen(await robot.scene())
    if uri == STATE:
        return rounded(tools.state_data(await robot.state()))
    return {"error": error_data(robot.last_failure) if robot.last_failure else None}
