"""A bench's episodes on a Ray cluster (extra `scale`)."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import islice
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from robosandbox.apps.bench.episodes import Chunk, run_chunk
from robosandbox.apps.bench.results import Row
from robosandbox.errors import ServiceUnavailableError
from robosandbox.extras import missing_extra

_LOOPBACK = "127.0.0.1"
# Times that a chunk whose worker died is sent again; as of Ray's own default for tasks.
_RETRIES = 3
# Seconds that a cluster's address may take to answer; chosen because Ray itself waits for minutes.
_CONNECT_SECONDS = 5.0
# Seconds between two questions whether the head is there: tasks go on without it, and end, for the sixty seconds after which Ray
# ends this process too. Chosen: far fewer than those, and it costs one connection.
_HEAD_SECONDS = 5.0
# Tasks that wait on each core, so that none runs dry while the next is sent.
_AHEAD = 2


class HeadLostError(ServiceUnavailableError):
    """The head of a Ray cluster is gone: no call of Ray comes back that asks it, cancelling among them."""


class RayEngine:
    """Runs chunks as Ray tasks on one core each; those of a worker or node that dies are run again elsewhere.

    Ray keeps worker processes between tasks, and each keeps its last world: a model is built once per worker and task.
    Every node has the same RoboSandbox installed and sees robot and task files under the same paths.

    Args:
        jobs: Cores to use where a cluster is started on this machine.
        address: Of a running cluster, `host:port` or `auto`; None starts one on this machine for the time of the bench.

    Raises:
        InputError: Ray is not installed.
    """

    def __init__(self, jobs: int, address: str | None = None) -> None:
        if address is None or address.startswith(_LOOPBACK):
            # Read when Ray is imported: with it off, nodes meet on the loopback address and on no other.
            os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
        # Every node has this package. Ray would pack the working folder of `uv run` and install from it for each worker.
        os.environ.setdefault("RAY_ENABLE_UV_RUN_RUNTIME_ENV", "0")
        try:
            import ray  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise missing_extra(error, "--engine ray", "scale") from None
        self._ray = ray
        self._jobs = jobs
        self._address = address
        self._asked = monotonic()

    def run(self, chunks: Iterable[Chunk]) -> Iterator[Row]:
        """Yield each chunk's rows as it ends."""
        ours = not self._ray.is_initialized()
        if ours:
            self._connect()
        pending: dict[Any, Chunk] = {}
        # Each task tells of its end: asking Ray which of all tasks have ended takes the longer the more cores there are.
        ended: SimpleQueue[Any] = SimpleQueue()
        try:
            task = self._ray.remote(num_cpus=1, max_retries=_RETRIES)(run_chunk)
            left = iter(chunks)
            room = _AHEAD * max(1, int(self._ray.cluster_resources().get("CPU", 1)))
            while True:
                # Nodes may come and go meanwhile; a million episodes are not queued at once.
                for chunk in islice(left, room - len(pending)):
                    reference = task.remote(chunk)
                    pending[reference] = chunk
                    reference.future().add_done_callback(lambda _, of=reference: ended.put(of))
                if not pending:
                    return
                reference = self._ended(ended)
                yield from self._rows(reference, pending.pop(reference))
        except HeadLostError:
            pending.clear()
            raise
        finally:
            for reference in pending:
                self._ray.cancel(reference, force=True)
            if ours:
                self._ray.shutdown()

    def _ended(self, ended: SimpleQueue[Any]) -> Any:
        """Return the next task that has ended.

        Raises:
            HeadLostError: The head is gone.
        """
        while True:
            if monotonic() - self._asked >= _HEAD_SECONDS:
                self._ask_head()
                self._asked = monotonic()
            with suppress(Empty):
                return ended.get(timeout=_HEAD_SECONDS)

    def _ask_head(self) -> None:
        host, _, port = str(self._ray.get_runtime_context().gcs_address).rpartition(":")
        try:
            socket.create_connection((host, int(port)), _CONNECT_SECONDS).close()
        except OSError as error:
            raise HeadLostError(
                f"--engine: the head of the Ray cluster at {host}:{port} is gone: {error}; --resume goes on with the rows"
            ) from None

    def _rows(self, reference: Any, chunk: Chunk) -> list[Row]:
        try:
            rows: list[Row] = self._ray.get(reference)
        except (self._ray.exceptions.WorkerCrashedError, self._ray.exceptions.NodeDiedError):
            seeds = ", ".join(str(seed) for seed in chunk.seeds)
            raise ServiceUnavailableError(
                f"--engine: workers died {_RETRIES + 1} times on {chunk.task.name}, seeds {seeds}; --jobs 1 shows where"
            ) from None
        return rows

    def _connect(self) -> None:
        # What Ray prints goes to stderr, and its dashboard is a server that nobody asked for.
        options: dict[str, Any] = {"log_to_driver": False, "logging_level": "ERROR"}
        if self._address is None:
            options |= {"num_cpus": self._jobs, "include_dashboard": False}
        try:
            if self._address is not None and ":" in self._address:
                # Ray itself asks for minutes whether somebody is there.
                host, _, port = self._address.removeprefix("ray://").rpartition(":")
                socket.create_connection((host, int(port)), _CONNECT_SECONDS).close()
            self._ray.init(address=self._address, **options)
        except (OSError, ValueError, RuntimeError) as error:
            first = str(error).strip().splitlines()[0]
            raise ServiceUnavailableError(f"--ray-address: no Ray cluster at {self._address}: {first}") from None
