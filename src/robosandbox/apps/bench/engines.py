"""Engines that run a bench's episodes: this process, several of this machine, or a Ray cluster's."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from typing import Any, Protocol

from robosandbox.apps.bench.episodes import Chunk, EpisodeRunner
from robosandbox.apps.bench.results import Row
from robosandbox.errors import RoboSandboxError, ServiceUnavailableError
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
    """Runs chunks on processes of this machine; what a process that dies has not done is run again.

    Args:
        jobs: How many.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs

    def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
        """Yield each row as its episode ends."""
        pending, retries = iter(chunks), list[Chunk]()
        workers = [_Worker() for _ in range(self._jobs)]
        deaths = 0
        try:
            while True:
                for worker in workers:
                    while len(worker.chunks) < _AHEAD and (chunk := retries.pop() if retries else next(pending, None)):
                        worker.give(chunk)
                busy: dict[Any, _Worker] = {worker.pipe: worker for worker in workers if worker.chunks}
                if not busy:
                    return
                for pipe in wait(list(busy)):
                    worker = busy[pipe]
                    try:
                        row = worker.row()
                    except (EOFError, OSError):
                        deaths += 1
                        _log.warning("a process of the bench died; what it ran is run again")
                        retries.extend(reversed(worker.chunks))
                        workers[workers.index(worker)] = _Worker()
                        worker.end()
                        _check_deaths(deaths)
                    else:
                        deaths = 0
                        yield row
        finally:
            for worker in workers:
                worker.end()


class _Worker:
    """A process that runs chunks.

    Attributes:
        pipe: Chunks go there, rows come from there.
        chunks: What it was given, without the episodes whose rows have come.
    """

    def __init__(self) -> None:
        # Forking a process with threads (a progress bar, a renderer) can deadlock; spawning cannot.
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.chunks: list[Chunk] = []
        self._process = context.Process(target=_work, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def give(self, chunk: Chunk) -> None:
        """Have it run a chunk after those that it has."""
        self.chunks.append(chunk)
        # Of one that has died the next row that is asked for tells.
        with suppress(BrokenPipeError, ConnectionResetError):
            self.pipe.send(chunk)

    def row(self) -> Row:
        """Return its next row.

        Raises:
            EOFError: It has died.
            OSError: Likewise.
            Exception: What ends the bench.
        """
        came: Row | Exception = self.pipe.recv()
        if isinstance(came, Exception):
            raise came
        first = self.chunks[0]
        left = replace(first, seeds=first.seeds[1:])
        self.chunks[:1] = [left] if left.seeds else []
        return came

    def end(self) -> None:
        """End it, whatever it does."""
        self._process.terminate()
        self._process.join()
        self.pipe.close()


def _work(pipe: Connection[Row | Exception, Chunk]) -> None:
    """Run the chunks that come and send each row as its episode ends."""
    # Ctrl-C goes to all processes of a terminal; the bench's own ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    runner = EpisodeRunner()
    while True:
        chunk = pipe.recv()
        try:
            for row in runner.rows(chunk):
                pipe.send(row)
        except RoboSandboxError as error:
            pipe.send(error)


def _end_with_parent() -> None:
    """End this process when the bench is gone: however it died, its end of a pipe is closed then."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _check_deaths(deaths: int) -> None:
    if deaths == _MOST_DEATHS:
        raise ServiceUnavailableError(
            f"--jobs: processes of the bench died {deaths} times in a row; --jobs 1 shows where, and fewer jobs need "
            "less memory"
        )
