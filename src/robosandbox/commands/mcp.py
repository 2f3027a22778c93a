"""`mcp`: the skills as tools for clients that speak the Model Context Protocol."""

from __future__ import annotations

import asyncio
from typing import Annotated

import typer

from robosandbox.commands import run as options
from robosandbox.commands.console import EXIT_DONE
from robosandbox.errors import InputError


def mcp(
    task: options.TaskName = None,
    robot: options.RobotName = None,
    planner: options.PlannerName = "stub",
    base_url: options.BaseUrl = None,
    model: options.Model = None,
    perception: options.PerceptionName = "ground_truth",
    seed: options.Seed = 0,
    what_if: options.WhatIf = True,
    http: Annotated[
        int | None, typer.Option("--http", help="Serve on this port of 127.0.0.1; stdin and stdout if left out.")
    ] = None,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Move at the speed of the clock, not as fast as can be computed.")
    ] = False,
    timeout: Annotated[float, typer.Option("--timeout", help="Simulated seconds that a skill may take.")] = 120.0,
) -> int:
    """Serve the skills of an embedded world to an MCP client."""
    if seed < 0:
        raise InputError(f"--seed: {seed} is negative; give 0 or more")
    if http is not None and not 0 <= http < 65536:
        raise InputError(f"--http: {http} is no port; give 1 to 65535, or 0 for a free one")
    if not timeout > 0.0:
        raise InputError(f"--timeout: {timeout:g}; give seconds above 0")
    try:
        from robosandbox.agent.mcp.robot import LocalRobot
        from robosandbox.agent.mcp.serve import serve_http, serve_stdio
        from robosandbox.agent.mcp.server import build_server
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("robosandbox"):
            raise
        raise InputError(f"mcp: needs the package {error.name!r}; install robosandbox[mcp]") from None
    from robosandbox.agent.pace import Pace
    from robosandbox.tasks.session import open_session

    with open_session(
        task,
        robot=robot,
        planner=planner,
        planner_options={"base_url": base_url, "model": model},
        perception=perception,
        seed=seed,
        what_if=what_if,
    ) as session:
        if realtime:
            session.sim.tick_hooks.append(Pace(session.sim))
        body = LocalRobot(session.agent, session.ctx, session.sim.cameras, timeout)
        try:
            server = build_server(body)
            asyncio.run(serve_stdio(server) if http is None else serve_http(server, http))
        finally:
            body.close()
    return EXIT_DONE
