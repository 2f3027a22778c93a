"""Tools of the server itself: look, orders, start over, load, stop, refuse."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

import anyio
import mcp_types as types
from mcp.server.context import ServerRequestContext

from robosandbox.agent.tools import RefuseArguments
from robosandbox.apps.mcp import tools
from robosandbox.apps.mcp.robot import McpRobot, Tell
from robosandbox.errors import (
    PlannerError,
    PlannerUnavailableError,
    RenderingError,
    RoboSandboxError,
    SensorError,
    ServiceUnavailableError,
    SkillError,
)
from robosandbox.types import Refusal, StrictModel
from robosandbox.validation import did_you_mean
from robosandbox.workcell.orders import ORDERS, BoundOrder, planned

Context = ServerRequestContext[Any, Any]
ValueT = TypeVar("ValueT")
# What a call ends in that is no skill's error, the narrower kinds first.
_CODES: dict[type[RoboSandboxError], str] = {
    ServiceUnavailableError: "service_unavailable",
    PlannerUnavailableError: "planner_unavailable",
    PlannerError: "planner_failed",
    RenderingError: "rendering",
    SensorError: "sensor",
}


async def answer_own(robot: McpRobot, ctx: Context, own: StrictModel) -> types.CallToolResult:
    """Return what a tool of the server's own answers; what goes wrong is an answer, too."""
    try:
        return await _answered(robot, ctx, own)
    except SkillError as error:
        return tools.skill_failed(error)
    except RoboSandboxError as error:
        return failed(error)


async def _answered(robot: McpRobot, ctx: Context, own: StrictModel) -> types.CallToolResult:
    match own:
        case tools.LookArguments():
            return await _look(robot, own)
        case tools.ResetArguments():
            await robot.reset(own.seed)
            return tools.answer(robot.task)
        case tools.LoadArguments():
            await robot.load(own.task)
            return tools.answer(robot.task)
        case tools.StopArguments():
            return tools.answer({"stopped": robot.stop()})
        case RefuseArguments():
            refusal = Refusal(code=own.code, message=own.message, candidates=own.candidates)
            return tools.answer(planned(refusal))
        case _:
            order = BoundOrder(next(name for name, kind in ORDERS.items() if kind.arguments is type(own)), own)
            return tools.ended(await reported(ctx, lambda tell: robot.carry_out(order, tell)))


async def reported(ctx: Context, work: Callable[[Tell], Awaitable[ValueT]]) -> ValueT:
    """Do what takes time, telling the client how it goes; when the client cancels, the arm stops before this ends."""
    told: asyncio.Queue[str | None] = asyncio.Queue()
    doing = asyncio.ensure_future(work(told.put_nowait))
    doing.add_done_callback(lambda _: told.put_nowait(None))
    try:
        count = 0
        while (text := await told.get()) is not None:
            count += 1
            await ctx.session.report_progress(float(count), message=text)
        return await doing
    except asyncio.CancelledError:
        doing.cancel()
        with anyio.CancelScope(shield=True):
            await asyncio.wait([doing])
        raise


async def _look(robot: McpRobot, arguments: tools.LookArguments) -> types.CallToolResult:
    if arguments.camera is not None and arguments.camera not in robot.cell.cameras:
        return tools.failed("invalid_argument", no_camera(robot, arguments.camera))
    data = {"scene": tools.seen(await robot.scene()), "state": tools.state_data(await robot.state())}
    result = tools.answer({**data, "doing": robot.doing, "cameras": list(robot.cell.cameras)})
    if arguments.camera is not None:
        picture = tools.base64_text(await robot.picture(arguments.camera))
        result.content.append(types.ImageContent(type="image", data=picture, mime_type="image/png"))
    return result


def no_camera(robot: McpRobot, name: str) -> str:
    """Return what to say of a camera that is not there."""
    return f"no camera {name[:60]!r}; there is {', '.join(robot.cell.cameras)}{did_you_mean(name, robot.cell.cameras)}"


def failed(error: RoboSandboxError) -> types.CallToolResult:
    """Return a failure that is no skill's, under the code of its kind."""
    code = next((code for kind, code in _CODES.items() if isinstance(error, kind)), "invalid_argument")
    return tools.failed(code, str(error))
