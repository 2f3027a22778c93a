"""`mcp`: the skills as tools for clients that speak the Model Context Protocol."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Annotated

import typer

from robosandbox.apps.commands.console import EXIT_DONE
from robosandbox.apps.commands.world import Connection, check_remote, open_here, takes_world
from robosandbox.errors import InputError
from robosandbox.extras import missing_extra
from robosandbox.progress import nothing_done
from robosandbox.workcell.options import WorkcellOptions

_AT_A_TERMINAL = """\
waiting for an MCP client on stdin; clients start this command themselves (docs/mcp.md). --http PORT serves over HTTP; \
to talk to the robot here: `robo-sandbox repl`. Ctrl-C ends."""


@takes_world(without=("camera", "sensor", "calibration", "max_replans"))
def mcp(
    connection: Connection,
    world: WorkcellOptions,
    http: Annotated[
        int | None, typer.Option("--http", help="Serve on this port of 127.0.0.1; stdin and stdout if left out.")
    ] = None,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Move at the speed of the clock, not as fast as can be computed.")
    ] = False,
    timeout: Annotated[float, typer.Option("--timeout", help="Simulated seconds that a skill may take.")] = 120.0,
) -> int:
    """Serve a robot's skills to an MCP client: of an embedded world, or with --connect of a sim process."""
    _check(http, timeout, realtime and bool(connection))
    if connection:
        check_remote(world)
    _check_planner(world)
    if find_spec("mcp") is None:
        raise missing_extra(ModuleNotFoundError("mcp", name="mcp"), "mcp", "mcp")
    first = None
    if http is None:
        from robosandbox.apps.mcp.greeting import greet, take_stdout

        nothing_done()
        if sys.stdin.isatty():
            print(_AT_A_TERMINAL, file=sys.stderr)
        # A client waits for the first answer, and all that follows takes longer than some wait.
        first = greet(sys.stdin.fileno(), take_stdout())
        if first is None:
            return EXIT_DONE
    try:
        from robosandbox.apps.mcp.serve import serve
    except ModuleNotFoundError as error:
        raise missing_extra(error, "mcp", "mcp") from None
    from robosandbox.apps.mcp.robot import McpRobot
    from robosandbox.workcell.host import WorkcellHost

    @contextmanager
    def opened() -> Iterator[McpRobot]:
        with connection.workcell(world) if connection else open_here(world) as cell:
            host = WorkcellHost(cell, pace="watched" if realtime else "fast")
            host.start()
            yield McpRobot(host, robot=world.robot, timeout=timeout)

    serve(opened, port=http, first=first)
    return EXIT_DONE


def _check_planner(world: WorkcellOptions) -> None:
    """Raise InputError where the planner, which alone knows, does not take its options; the default one needs none."""
    if world.planner != "stub" or any(value is not None for value in (world.planner_options or {}).values()):
        from robosandbox.agent.planners import make_planner

        make_planner(world.planner, (), world.planner_options)


def _check(http: int | None, timeout: float, paces_other: bool) -> None:
    if http is not None and not 0 <= http < 65536:
        raise InputError(f"--http: {http} is no port; give 1 to 65535, or 0 for a free one")
    if not timeout > 0.0:
        raise InputError(f"--timeout: {timeout:g}; give seconds above 0")
    if paces_other:
        raise InputError("--realtime: a sim process has its own pace; leave it or --connect out")
