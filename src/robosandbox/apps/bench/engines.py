"""What runs the episodes of a bench: this process, several of this machine, or a Ray cluster's."""

from __future__ import annotations

import logging
import multiprocessing
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import Protocol

from robosandbox.apps.bench.episodes import Chunk, EpisodeRunner, run_chunk
from robosandbox.apps.bench.results import Row
from robosandbox.errors import ServiceUnavailableError
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

_log = logging.getLogger(__name__)
# Deaths of processes in a row after which a bench gives up; chosen because one may be the memory's, three are the code's.
_MOST_DEATHS = 3
# Chunks that wait for each process, so that none runs dry while the next is sent.
_AHEAD = 2


class Engine(Protocol):
    """Runs chunks of episodes. Registered under the entry point group `robosandbox.engines`, it is made by `Name(jobs, address)`."""

    def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
        """Yield the rows of all chunks as they end, in any order; what has not begun when the caller stops is left out.

        A million episodes come as chunks that are made when they are asked for: take no more than are run soon.

        Raises:
            ServiceUnavailableError: What runs the episodes is not there, or keeps dying.
        """
        ...


class InProcess:
    """Runs chunks one after another in this process.

    Args:
        remote: In the world of this sim process, in place of one of our own.
    """

    def __init__(self, remote: RemoteWorkcell | None = None) -> None:
        self._remote = remote

    def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
        """Yield each row as its episode ends."""
        runner = EpisodeRunner(self._remote)
        try:
            for chunk in chunks:
                yield from runner.rows(chunk)
        finally:
            runner.close()


class ProcessPool:
    """Runs chunks on processes of this machine; those of a process that dies are run again.

    Args:
        jobs: How many.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs

    def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
        """Yield each chunk's rows as it ends."""
        coming = iter(chunks)
        begun: list[Chunk] = []
        deaths = 0
        while True:
            try:
                for chunk, rows in self._run_once(coming, begun):
                    begun.remove(chunk)
                    deaths = 0
                    yield from rows
            except BrokenProcessPool:
                deaths += 1
                _log.warning("a process of the bench died; what it ran is run again")
                if deaths == _MOST_DEATHS:
                    raise ServiceUnavailableError(
                        f"--jobs: processes of the bench died {deaths} times in a row; --jobs 1 shows where, and fewer "
                        "jobs need less memory"
                    ) from None
            else:
                return

    def _run_once(self, coming: Iterator[Chunk], begun: list[Chunk]) -> Iterator[tuple[Chunk, list[Row]]]:
        """Run what was begun and what comes, until all is done or a process dies.

        Args:
            coming: Chunks that nobody has begun; some are taken from it and added to `begun`.
            begun: Chunks without rows; those that have theirs are for the caller to take out.
        """
        # Forking a process with threads (a progress bar, a renderer) can deadlock; spawning cannot.
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(max_workers=self._jobs, mp_context=context) as pool:
            pending = {pool.submit(run_chunk, chunk): chunk for chunk in begun}
            try:
                while True:
                    for chunk in islice(coming, self._jobs * _AHEAD - len(pending)):
                        begun.append(chunk)
                        pending[pool.submit(run_chunk, chunk)] = chunk
                    if not pending:
                        return
                    done, _ = wait(pending, return_when=FIRST_COMPLETED)
                    for future in done:
                        yield pending.pop(future), future.result()
            finally:
                pool.shutdown(wait=True, cancel_futures=True)
