"""A Ray cluster of two nodes on this machine, and workers and heads of it that die (extra `scale`)."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def local_cluster() -> Iterator[str]:
    """Yield the address of two nodes of one core each on this machine."""
    # Before Ray is imported: nodes then listen on the loopback address only.
    os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
    os.environ.setdefault("RAY_ENABLE_UV_RUN_RUNTIME_ENV", "0")
    from ray.cluster_utils import Cluster  # pyright: ignore[reportMissingImports]

    head: dict[str, Any] = {"num_cpus": 1, "node_ip_address": "127.0.0.1", "include_dashboard": False}
    cluster = Cluster(initialize_head=True, head_node_args=head)
    cluster.add_node(num_cpus=1)
    try:
        yield cluster.address
    finally:
        cluster.shutdown()


@contextmanager
def dying_worker(after: float = 0.0) -> Iterator[list[int]]:
    """Kill one worker that runs episodes, some seconds from now; yield the list of those killed."""
    killed: list[int] = []
    stopping = threading.Event()

    def kill() -> None:
        stopping.wait(after)
        while not killed and not stopping.is_set():
            for file in Path("/proc").glob("[0-9]*/cmdline"):
                try:
                    busy = file.read_bytes().startswith(b"ray::run_chunk")
                    # A node's own process starts its workers, and this process the nodes.
                    ours = _parent(_parent(int(file.parent.name))) == os.getpid()
                except OSError:
                    continue
                if busy and ours:
                    killed.append(int(file.parent.name))
                    os.kill(killed[0], signal.SIGKILL)
                    return
            stopping.wait(0.01)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    try:
        yield killed
    finally:
        stopping.set()
        thread.join()


def kill_head() -> int:
    """Kill the head's control store of the cluster that this process has started; return its process id."""
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            program = file.read_bytes().split(b"\0")[0]
            ours = _parent(int(file.parent.name)) == os.getpid()
        except OSError:
            continue
        if program.endswith(b"/gcs_server") and ours:
            os.kill(int(file.parent.name), signal.SIGKILL)
            return int(file.parent.name)
    raise RuntimeError("this process has started no cluster")


def _parent(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
