"""Processes that cannot do their work any more end, with a code and a line, and leave nothing behind."""

import json
import os
import select
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from support.processes import SimProcess

from robosandbox.errors import ServiceUnavailableError
from robosandbox.workcell.zenoh.client import connect

# What Zenoh's binding raises where its Rust code panics: no Exception.
PANIC = """
from robosandbox.workcell.zenoh.server.publishing import GoalNews
class PanicException(BaseException): pass
def panic(*_): raise PanicException("called `Result::unwrap()` on an `Err` value")
GoalNews.feedback = panic
"""
SILENCE = """
import threading
from robosandbox.apps.commands import sim
from robosandbox.workcell.host import WorkcellHost
sim._MOST_SILENT_SECONDS = 1.0
WorkcellHost.perform = lambda *_, **__: threading.Event().wait()
"""


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (PANIC, "the thread 'world' died of PanicException: called `Result::unwrap()` on an `Err` value"),
        (SILENCE, "the world has not looked at its queue for 1 s, at home"),
    ],
)
def test_a_sim_whose_world_is_stuck_ends_with_a_line_and_code_3(fault: str, said: str, tmp_path: Path) -> None:
    log = tmp_path / "log"
    with SimProcess(log=log, first=fault) as sim, connect(sim.endpoint, reconnect=1.0) as client:
        with pytest.raises(ServiceUnavailableError):
            client.robot().send("home").wait(30.0)
        assert sim.ended() == 3
    assert said in log.read_text()


def test_a_sim_at_rest_is_not_taken_to_be_stuck() -> None:
    with SimProcess("--pace", "fast", first=SILENCE) as sim, connect(sim.endpoint) as client:
        with pytest.raises(subprocess.TimeoutExpired):
            sim.ended(timeout=2.0)
        assert client.robot().state()


@contextmanager
def bench(*options: str) -> Iterator[subprocess.Popen[str]]:
    """A bench of two processes that has its first row."""
    command = [sys.executable, "-c", "from robosandbox.apps.cli import bench_main; bench_main()", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            next(line for line in process.stdout if line.startswith("home"))
            yield process
        finally:
            process.kill()


def descendants(pid: int) -> list[int]:
    try:
        found = [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except FileNotFoundError:
        return []
    return found + [below for child in found for below in descendants(child)]


def wait_until_gone(pids: list[int], seconds: float = 20.0) -> None:
    """Wait for processes, some of which are nobody's children any more; pidfds tell of their ends."""
    for pid in pids:
        try:
            ended = os.pidfd_open(pid)
        except ProcessLookupError:
            continue
        assert select.select([ended], [], [], seconds)[0], f"{pid} runs on"
        os.close(ended)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_bench_that_is_ended_leaves_whole_rows_and_no_process(number: signal.Signals, tmp_path: Path) -> None:
    rows, kept = tmp_path / "rows.json", tmp_path / "rows.jsonl"
    with bench("home", "--seeds", "1000", "--jobs", "2", "--json", str(rows), "--resume", str(kept)) as process:
        workers = descendants(process.pid)
        process.send_signal(number)
        wait_until_gone(workers)
        assert process.wait(20.0) == (-9 if number == signal.SIGKILL else 130)
    assert len(workers) >= 2
    assert json.loads(rows.read_text())
    lines = kept.read_text().splitlines(keepends=True)
    assert lines and all(line.endswith("\n") for line in lines)
