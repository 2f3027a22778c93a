"""Episodes over tasks and seeds, judged on simulated truth; the same rows whatever runs them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, nullcontext
from itertools import groupby, islice
from operator import itemgetter

from robosandbox.apps.bench.engines import Engine, InProcess, ProcessPool
from robosandbox.apps.bench.episodes import Chunk, try_world
from robosandbox.apps.bench.results import BenchSettings, Rate, Row, Tally
from robosandbox.apps.bench.results_file import ResultsFile
from robosandbox.errors import InputError, ServiceUnavailableError
from robosandbox.tasks.task import Task
from robosandbox.values import frozen
from robosandbox.versions import versions
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

__all__ = ["BenchSettings", "BrokenTask", "Rate", "Row", "Tally", "run_bench", "versions"]

_log = logging.getLogger(__name__)
# Seeds that a process runs at a stretch; chosen so that building a world is a small part of them. Towards the end fewer, so
# that no process waits long for the last: half of an even share of what is left (Hummel, Schonberg and Flynn, "Factoring: A
# Method for Scheduling Parallel Loops", 1992).
_CHUNK, _SHARE = 10, 2


@frozen
class BrokenTask:
    """A task that no episode of can be run.

    Attributes:
        name: What its rows are called.
        error: Why, in one line.
    """

    name: str
    error: str

    def rows(self, seed: int, settings: BenchSettings) -> Iterator[Row]:
        """Yield the row of a seed."""
        yield Row.of_error(self.name, seed, error=self.error, settings=settings)


def run_bench(
    tasks: Sequence[Task | BrokenTask],
    seeds: int,
    *,
    jobs: int = 1,
    settings: BenchSettings | None = None,
    on_row: Callable[[Row], None] | None = None,
    earlier: ResultsFile | None = None,
    engine: Engine | None = None,
    remote: RemoteWorkcell | None = None,
) -> Iterator[Row]:
    """Yield a row per task and seed, tasks in the given order, seeds from 0.

    The world of each task is tried before the first episode; the rows of a task without one are errors, and so is that
    of a seed that has no layout. Memory does not grow with the rows: those that come before their turn wait in a file.

    Args:
        tasks: What to run; a broken one gives a row per seed.
        seeds: How many layouts of each.
        jobs: Processes; 1 stays in this one.
        settings: What all episodes share.
        on_row: Told each row as its episode ends, in whatever order they end.
        earlier: Rows of an earlier bench with the same settings and versions, which are not run again; new ones are added.
        engine: What runs the episodes, in place of `jobs` processes.
        remote: Run in this sim process, with the planner that it was made with, in place of worlds of our own.

    Raises:
        InputError: No task can be run.
        ServiceUnavailableError: The sim is gone, or the processes or nodes that run the episodes keep dying.
    """
    settings = settings or BenchSettings()
    if remote is not None and not remote.judgeable:
        raise InputError("--connect: the sim was started with --no-ground-truth, so nothing can be judged there")
    # A sim tries a task's world when it is told to load it.
    tasks = tasks if remote else _tried(tasks, seeds, settings, earlier)
    _check_some_can_run(tasks)
    waiting = sum(
        seeds - (earlier.count(task.name, seeds) if earlier else 0) for task in tasks if isinstance(task, Task)
    )
    if engine is None:
        engine = InProcess(remote) if min(jobs, waiting) <= 1 or remote is not None else ProcessPool(min(jobs, waiting))
    rows = engine.run(_chunks(tasks, seeds, waiting=waiting, jobs=jobs, settings=settings, earlier=earlier))
    with closing(ResultsFile.temporary()) if earlier is None else nullcontext(earlier) as store:
        for task, seed in ((task, seed) for task in tasks for seed in range(seeds)):
            row = store.find(task.name, seed)
            if row is None:
                source = task.rows(seed, settings) if isinstance(task, BrokenTask) else rows
                row = _until(task.name, seed, source=source, store=store, keep_all=earlier is not None, on_row=on_row)
            yield row


def _check_some_can_run(tasks: Sequence[Task | BrokenTask]) -> None:
    """Warn of broken tasks.

    Raises:
        InputError: All are broken.
    """
    broken = [task for task in tasks if isinstance(task, BrokenTask)]
    if len(broken) == len(tasks):
        # What all tasks have in common, a camera that no world has, is said once.
        raise InputError("; ".join(dict.fromkeys(task.error for task in broken)))
    for task in broken:
        _log.warning("%s; the other tasks are run", task.error)


def _until(
    task: str,
    seed: int,
    *,
    source: Iterator[Row],
    store: ResultsFile,
    keep_all: bool,
    on_row: Callable[[Row], None] | None,
) -> Row:
    """Return the row of an episode; those that end before it go into the store.

    Raises:
        ServiceUnavailableError: The source has ended without it.
    """
    for row in source:
        due = (row.task, row.seed) == (task, seed)
        if keep_all or not due:
            store.add(row)
        if on_row is not None:
            on_row(row)
        if due:
            return row
    raise ServiceUnavailableError(f"the engine ended without {task}, seed {seed}; run it again, or with --jobs 1")


def _tried(
    tasks: Sequence[Task | BrokenTask], seeds: int, settings: BenchSettings, earlier: ResultsFile | None
) -> list[Task | BrokenTask]:
    """Return the tasks, with those broken whose world cannot be built; what has its rows already is not tried."""
    found: list[Task | BrokenTask] = []
    for task in tasks:
        whole = earlier is not None and all(earlier.holds(task.name, seed) for seed in range(seeds))
        if isinstance(task, Task) and not whole and (error := try_world(task, settings)) is not None:
            task = BrokenTask(task.name, error)
        found.append(task)
    return found


def _waiting(tasks: Sequence[Task | BrokenTask], seeds: int, earlier: ResultsFile | None) -> Iterator[tuple[Task, int]]:
    """Yield the episodes that have no row yet."""
    for task in tasks:
        if isinstance(task, Task):
            yield from ((task, seed) for seed in range(seeds) if earlier is None or not earlier.holds(task.name, seed))


def _chunks(
    tasks: Sequence[Task | BrokenTask],
    seeds: int,
    *,
    waiting: int,
    jobs: int,
    settings: BenchSettings,
    earlier: ResultsFile | None,
) -> Iterator[Chunk]:
    """Yield what is to be run, each chunk made when it is asked for."""
    for task, left in groupby(_waiting(tasks, seeds, earlier), key=itemgetter(0)):
        while chunk := tuple(seed for _, seed in islice(left, max(1, min(_CHUNK, waiting // (_SHARE * jobs))))):
            waiting -= len(chunk)
            yield Chunk(task, chunk, settings)
