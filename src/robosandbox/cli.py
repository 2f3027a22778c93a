"""The two programs: `robo-sandbox` and `robo-sandbox-bench`."""

from __future__ import annotations

import sys

import typer

from robosandbox.commands import bench, calibrate, export, look, mcp, repl, robot, run, runs, sim, tasks, viewer
from robosandbox.commands.console import run_app

app = typer.Typer(
    add_completion=False,
    help="Say what the robot should do; the arm does it in MuJoCo, or says exactly why it cannot.",
)
app.command("run")(run.run)
app.command("plan")(run.plan)
app.command("calibrate")(calibrate.calibrate)
app.command("look")(look.look)
app.command("repl")(repl.repl)
app.command("sim")(sim.sim)
app.command("agent")(run.agent)
app.command("mcp")(mcp.mcp)
app.command("viewer")(viewer.viewer)
app.command("replay")(runs.replay)
app.add_typer(runs.app, name="runs")
app.add_typer(export.app, name="export")
app.add_typer(tasks.app, name="tasks")
app.add_typer(robot.app, name="robot")


def main() -> None:
    """Run `robo-sandbox`."""
    sys.exit(run_app(app, "robo-sandbox", sys.argv[1:] or ["--help"]))


def bench_main() -> None:
    """Run `robo-sandbox-bench`; without arguments it runs every bundled task once."""
    sys.exit(run_app(bench.app, "robo-sandbox-bench", bench.split_lists(sys.argv[1:])))
