"""The two programs: `robo-sandbox` and `robo-sandbox-bench`."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from robosandbox.apps.commands.console import run_app
from robosandbox.apps.commands.lazy import LazyCommand, lazy_group, plain_app

COMMANDS = {
    "run": LazyCommand("robosandbox.apps.commands.run:run", "Carry out a prompt and check what came of it."),
    "plan": LazyCommand(
        "robosandbox.apps.commands.run:plan", "Print the plan for a prompt, or check somebody else's; nothing moves."
    ),
    "calibrate": LazyCommand(
        "robosandbox.apps.commands.calibrate:calibrate",
        "Find each camera's pose from a board of tags, and how far it is off.",
    ),
    "look": LazyCommand(
        "robosandbox.apps.commands.look:look", "Print what is seen: names, shapes, places, sizes, and how sure that is."
    ),
    "repl": LazyCommand(
        "robosandbox.apps.commands.repl:repl",
        "Talk to a robot, line by line; without --connect in a world of this process.",
    ),
    "sim": LazyCommand("robosandbox.apps.commands.sim:sim", "Serve a world over Zenoh until SIGINT or SIGTERM."),
    "ros2": LazyCommand(
        "robosandbox.apps.commands.ros2:ros2",
        "Serve a world as a ROS 2 node until SIGINT or SIGTERM: state, pictures, things, actions and services.",
    ),
    "agent": LazyCommand("robosandbox.apps.commands.run:agent", "Carry out a prompt in a sim process."),
    "mcp": LazyCommand(
        "robosandbox.apps.commands.mcp:mcp",
        "Serve a robot's skills to an MCP client: of an embedded world, or with --connect of a sim process.",
    ),
    "viewer": LazyCommand(
        "robosandbox.apps.commands.viewer:viewer",
        "Show the world in a browser on this machine, until SIGINT or SIGTERM.",
    ),
    "replay": LazyCommand(
        "robosandbox.apps.commands.runs:replay", "Run a recorded episode's actions again through physics, and compare."
    ),
    "runs": LazyCommand("robosandbox.apps.commands.runs:app", "Recorded episodes."),
    "export": LazyCommand("robosandbox.apps.commands.export:app", "Recorded episodes as datasets and logs."),
    "tasks": LazyCommand("robosandbox.apps.commands.tasks:app", "The tasks that a bench runs."),
    "grammar": LazyCommand(
        "robosandbox.apps.commands.grammar:grammar",
        "List the languages that are pairs of files, or print the rules and words of one; nothing moves.",
    ),
    "scene": LazyCommand("robosandbox.apps.commands.scene:app", "Bring your own scene: infer its sidecar, check it."),
    "robot": LazyCommand("robosandbox.apps.commands.robot:app", "Bring your own robot: infer its sidecar, check it."),
}

# Number of objects that are made between two looks for cycles; chosen because Python's own 700 suits programs of a few
# modules (benchmarks/startup.py measures a plan).
_GC_THRESHOLD = 50_000

app: typer.Typer = plain_app(cls=lazy_group(COMMANDS))


def _say_version(wanted: bool) -> None:
    if wanted:
        from robosandbox.versions import versions

        own, *others = versions().items()
        print(f"robo-sandbox {own[1]} ({', '.join(f'{name} {version}' for name, version in others)})")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def program(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Print the versions and end.")
    ] = False,
) -> None:
    """Say what the robot should do; the arm does it in MuJoCo, or says exactly why it cannot."""
    if context.invoked_subcommand is None:
        print(context.get_help())


def main() -> None:
    """Run `robo-sandbox`."""
    sys.exit(_as_process(app, "robo-sandbox", sys.argv[1:]))


def bench_main() -> None:
    """Run `robo-sandbox-bench`; without arguments it runs every bundled task once."""
    from robosandbox.apps.commands import bench

    # As Ctrl-C: what is done is kept, and nothing runs on.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(_as_process(bench.app, "robo-sandbox-bench", bench.split_lists(sys.argv[1:])))


def _as_process(application: typer.Typer, program: str, arguments: Sequence[str]) -> int:
    """Run a command line that the process is there for alone, and return its exit code."""
    # Modules, tables and models are many objects that live as long as the process: looking through them for cycles took a
    # tenth of the time of a plan, and once more at the end, where the system takes everything back anyway.
    gc.set_threshold(_GC_THRESHOLD)
    # Pydantic looks for its plugins in every installed package; none has anything to do with these commands.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # MuJoCo loads GLFW with a parser of C, and GLFW asks a second process for its version; windows need a display.
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        os.environ.setdefault("MUJOCO_GL", "disable")
    try:
        return run_app(application, program, arguments)
    finally:
        gc.freeze()
