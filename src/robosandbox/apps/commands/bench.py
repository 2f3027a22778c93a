"""`robo-sandbox-bench`: tasks over seeds, as a table and as JSON rows."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robosandbox.apps.commands.bench_report import RULE, TASK_WIDTH, RowArray, header, line, open_rows, summary
from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED
from robosandbox.apps.commands.lazy import plain_app
from robosandbox.apps.commands.recording import Record, Video, VideoFps, record_settings
from robosandbox.apps.commands.world import Connection, takes_world
from robosandbox.errors import InputError
from robosandbox.progress import doing
from robosandbox.ranges import LAYOUTS
from robosandbox.values import frozen
from robosandbox.workcell.options import WorkcellOptions

if TYPE_CHECKING:
    from collections.abc import Callable

    from robosandbox.apps.bench.bench import BenchSettings, BrokenTask, Tally
    from robosandbox.tasks.task import Task
    from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

app: typer.Typer = plain_app()
_LISTS = ("--tasks", "--task-file")
_TASK_SUFFIXES = (".yaml", ".yml")


@frozen(kw_only=True)
class BenchRun:
    """Run of a bench: its tasks, its engine, and the file for its rows.

    Attributes:
        names: Names of bundled tasks and task files.
        tasks: Likewise.
        suite: A suite's name.
        task_file: Task files.
        seeds: Layouts per task.
        jobs: Processes.
        engine: What runs the episodes, in place of processes of this machine.
        ray_address: A running cluster.
        resume: The file that rows are appended to, and whose rows are not run again.
        json: Where the rows are written.
    """

    names: Annotated[list[str] | None, typer.Argument(metavar="TASKS", help="Names of tasks, or YAML files.")] = None
    tasks: Annotated[list[str] | None, typer.Option("--tasks", help="Likewise, by comma or space.")] = None
    suite: Annotated[
        str | None, typer.Option("--suite", help="The tasks of a suite, or 'all'; standard if no task is named.")
    ] = None
    task_file: Annotated[list[Path] | None, typer.Option("--task-file", help="Task YAML files.")] = None
    seeds: Annotated[int, typer.Option("--seeds", help="Layouts per task, from seed 0.")] = 1
    jobs: Annotated[int, typer.Option("--jobs", help="Processes.")] = 1
    engine: Annotated[
        str | None, typer.Option("--engine", help="What runs the episodes: ray; processes of this machine if left out.")
    ] = None
    ray_address: Annotated[
        str | None, typer.Option("--ray-address", help="A running cluster; one on this machine if left out.")
    ] = None
    resume: Annotated[
        Path | None, typer.Option("--resume", help="Append each row to this JSON Lines file; run what it lacks.")
    ] = None
    json: Annotated[str | None, typer.Option("--json", help="Write the rows here; '-' is stdout.")] = None

    def check(self, connection: Connection, record: Path | None) -> None:
        """Refuse what does not go together, before anything is loaded.

        Raises:
            InputError: The message names the option.
        """
        for option, value in (("--seeds", self.seeds), ("--jobs", self.jobs)):
            if value < 1:
                raise InputError(f"{option}: {value}; give 1 or more")
        if self.seeds > LAYOUTS:
            raise InputError(f"--seeds: {self.seeds}; a task has {LAYOUTS} layouts, so give 1 to {LAYOUTS}")
        if self.json is not None and self.json != "-":
            _check_writable(Path(self.json))
            if self.resume is not None and Path(self.json).resolve() == self.resume.resolve():
                raise InputError(f"--json: {self.json!r} is the file of --resume, which is kept; name another file")
        if connection.connect and self.jobs > 1:
            raise InputError(f"--jobs: {self.jobs}; with --connect there is one world, so give 1 or leave it out")
        if connection.connect and record:
            raise InputError("--record: the world is the sim's; give it to `robo-sandbox sim`, or leave --connect out")
        if connection.connect and self.engine:
            raise InputError(f"--engine: {self.engine}; with --connect there is one world, so leave it out")
        if self.ray_address and self.engine != "ray":
            raise InputError("--ray-address: goes with --engine ray")

    def show(self, *lines: str) -> None:
        """Print lines for people, out of the way of rows that go to stdout."""
        # Looked up now, not earlier: a progress bar puts its own streams in place.
        print(*lines, sep="\n", file=sys.stderr if self.json == "-" else sys.stdout, flush=True)


@app.command()
@takes_world(without=("task", "cassette", "camera", "calibration", "seed", "confirm"))
def bench(
    world: WorkcellOptions,
    connection: Connection,
    run: BenchRun,
    record: Record = None,
    video: Video = None,
    video_fps: VideoFps = 20.0,
    only_success: Annotated[bool, typer.Option("--only-success", help="With --record: keep successes only.")] = False,
) -> int:
    """Run tasks over seeds and judge each episode on the simulated state."""
    run.check(connection, record)
    from robosandbox.agent.planners import make_planner
    from robosandbox.apps.bench.bench import BenchSettings
    from robosandbox.plugins import load_plugin
    from robosandbox.sim.sensors import find_sensor
    from robosandbox.skills.catalogue import load_skills

    chosen = _choose([*(run.names or ()), *(run.tasks or ())], run.task_file or [], run.suite)
    # A wrong option is told before the first world is built.
    make_planner(world.planner, load_skills(), world.planner_options)
    load_plugin("perceptions", world.perception)
    find_sensor(world.sensor)
    # Workers elsewhere have another working directory.
    folder = record.absolute() if record else None
    settings = BenchSettings.of(world, record_settings(folder, video, video_fps, only_success=only_success))
    with _sim_process(connection, world) as remote:
        tally = _carry_out(run, chosen, settings, remote)
    run.show("", *summary(tally))
    return EXIT_DONE if tally.successes == tally.episodes else EXIT_FAILED


def _carry_out(
    run: BenchRun, chosen: Sequence[Task | BrokenTask], settings: BenchSettings, remote: RemoteWorkcell | None
) -> Tally:
    """Run all episodes, showing and keeping each row as it comes; return the counts."""
    from robosandbox.apps.bench.bench import Tally, run_bench
    from robosandbox.apps.bench.results_file import ResultsFile
    from robosandbox.plugins import load_plugin

    width = max(TASK_WIDTH, *(len(task.name) for task in chosen))
    tally = Tally()
    with ExitStack() as opened:
        earlier = opened.enter_context(closing(ResultsFile.resume(run.resume, settings))) if run.resume else None
        done = opened.enter_context(_progress(len(chosen) * run.seeds))
        written: RowArray | None = None
        for row in run_bench(
            chosen,
            run.seeds,
            jobs=run.jobs,
            settings=settings,
            on_row=lambda _: done(1),
            earlier=earlier,
            engine=load_plugin("engines", run.engine)(run.jobs, run.ray_address) if run.engine else None,
            remote=remote,
        ):
            if tally.episodes == 0:
                run.show(header(width), RULE)
                # Not before: a bench that runs nothing leaves an older file alone.
                written = opened.enter_context(closing(open_rows(run.json))) if run.json is not None else None
            tally.add(row)
            # First into the file: what a person has read is there.
            if written is not None:
                written.add(row)
            run.show(line(row, width))
    return tally


def split_lists(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with `--tasks a b` written as `--tasks a --tasks b`, which the parser takes."""
    result: list[str] = []
    option = ""
    for position, argument in enumerate(arguments):
        previous = arguments[position - 1] if position else ""
        if argument.startswith("-"):
            option = argument if argument in _LISTS else ""
        elif option and previous != option:
            result.append(option)
        result.append(argument)
    return result


def _check_writable(file: Path) -> None:
    if str(file).startswith("-"):
        raise InputError(f"--json: takes a file, or '-' for stdout, and {str(file)!r} is an option")
    folder = file.absolute().parent
    if not folder.is_dir():
        raise InputError(f"--json: the folder of {str(file)!r} does not exist; make it first")
    if file.is_dir():
        raise InputError(f"--json: {str(file)!r} is a folder; name a file in it")
    if not os.access(file if file.exists() else folder, os.W_OK):
        raise InputError(f"--json: {str(file)!r} may not be written; name another file")


def _choose(names: Sequence[str], files: Sequence[Path], suite: str | None) -> list[Task | BrokenTask]:
    from robosandbox.tasks.bundled import STANDARD_SUITE
    from robosandbox.tasks.loader import find_task, tasks_of_suite

    wanted = _split_names(names)
    files = [*(Path(name) for name in wanted if name.endswith(_TASK_SUFFIXES)), *files]
    if not names and not files and suite is None:
        suite = STANDARD_SUITE
    chosen: list[Task | BrokenTask] = [*tasks_of_suite(suite)] if suite is not None else []
    there = {task.name for task in chosen}
    chosen += [find_task(name) for name in wanted if name not in there and not name.endswith(_TASK_SUFFIXES)]
    chosen += [_from_file(file) for file in files]
    seen: set[str] = set()
    for task in chosen:
        if task.name in seen:
            raise InputError(f"--task-file: a task {task.name!r} is there already; give it another name")
        seen.add(task.name)
    return chosen


def _split_names(names: Sequence[str]) -> list[str]:
    """Return the names that were given by comma or space, each once."""
    wanted = list(dict.fromkeys(name for item in names for name in item.split(",") if name))
    if names and not wanted:
        raise InputError("--tasks: names no task; give names by comma, or leave it out for all")
    return wanted


def _from_file(file: Path) -> Task | BrokenTask:
    """Return a file's task, broken where the file is no task; a file that is not there is a wrong argument."""
    from robosandbox.apps.bench.bench import BrokenTask
    from robosandbox.tasks.loader import load_task

    try:
        return load_task(file)
    except InputError as error:
        if not file.is_file():
            raise
        return BrokenTask(file.stem, str(error))


@contextmanager
def _sim_process(connection: Connection, world: WorkcellOptions) -> Iterator[RemoteWorkcell | None]:
    """Yield the sim process to run in, its clock tied to the work; None for worlds of our own."""
    if not connection.connect:
        yield None
        return
    with connection.workcell(world) as session:
        session.robot.set_pace("fast")
        yield session


@contextmanager
def _progress(total: int) -> Iterator[Callable[[int], None]]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    from robosandbox.apps.commands.waiting import stderr_console
    from robosandbox.progress import nothing_done

    # While a line moves, stderr and stdout are stand-ins that are no terminals.
    nothing_done()
    if not sys.stderr.isatty() or total < 2:
        with doing("running the episode"):
            yield lambda _: None
        return
    # Rows that go to the same terminal have to pass through the bar; rows that go elsewhere must not.
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=stderr_console(), transient=True, redirect_stdout=sys.stdout.isatty()) as progress:
        bar = progress.add_task("", total=total)
        yield lambda count: progress.advance(bar, count)
