"""Episodes over tasks and seeds, judged on simulated truth; the same rows whatever runs them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from robosandbox.tasks.engines import Engine, InProcess, ProcessPool
from robosandbox.tasks.episodes import Chunk
from robosandbox.tasks.remote import RemoteSession
from robosandbox.tasks.rows import BenchSettings, Rate, Row, rates
from robosandbox.tasks.task import Task
from robosandbox.versions import versions

__all__ = ["BenchSettings", "Rate", "Row", "rates", "run_bench", "versions"]

_CHUNK = 10


def run_bench(
    tasks: Sequence[Task],
    seeds: int,
    *,
    jobs: int = 1,
    settings: BenchSettings | None = None,
    on_row: Callable[[Row], None] | None = None,
    known: Iterable[Row] = (),
    engine: Engine | None = None,
    remote: RemoteSession | None = None,
) -> Iterator[Row]:
    """Yield a row per task and seed, tasks in the given order, seeds from 0.

    Args:
        tasks: What to run.
        seeds: How many layouts of each.
        jobs: Processes; 1 stays in this one.
        settings: What all episodes share.
        on_row: Told each row as its episode ends, in whatever order they end.
        known: Rows of an earlier bench with the same settings and versions, which are not run again.
        engine: What runs the episodes, in place of `jobs` processes.
        remote: Run in this sim process, with the planner that it was made with, in place of worlds of our own.

    Raises:
        InputError: A task cannot be loaded.
        ServiceUnavailableError: The processes or nodes that run the episodes keep dying.
    """
    settings = settings or BenchSettings()
    wanted = [(task.name, seed) for task in tasks for seed in range(seeds)]
    ready = {(row.task, row.seed): row for row in known}
    size = max(1, min(_CHUNK, -(-seeds // jobs)))
    chunks: list[Chunk] = []
    for task in tasks:
        left = [seed for seed in range(seeds) if (task.name, seed) not in ready]
        chunks += [Chunk(task, tuple(left[at : at + size]), settings) for at in range(0, len(left), size)]
    jobs = min(jobs, len(chunks))
    if engine is None:
        engine = InProcess(remote) if jobs <= 1 or remote is not None else ProcessPool(jobs)
    coming = engine.run(chunks) if chunks else iter(())
    # Rows end in any order and are told in the one that was asked for.
    for name in wanted:
        while name not in ready:
            row = next(coming)
            ready[row.task, row.seed] = row
            if on_row is not None:
                on_row(row)
        yield ready.pop(name)
