"""Processes that cannot do their work any more end, with a code and a line, and leave nothing behind."""

import subprocess
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
from robosandbox.workcell.zenoh.server.execution import Executor
sim._MOST_SILENT_SECONDS = 1.0
Executor.execute = lambda *_: threading.Event().wait()
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
        goal = client.robot().send("home")
        assert sim.ended() == 3
        with pytest.raises(ServiceUnavailableError):
            goal.wait(30.0)
    assert said in log.read_text()


def test_a_sim_at_rest_is_not_taken_to_be_stuck() -> None:
    with SimProcess("--pace", "fast", first=SILENCE) as sim, connect(sim.endpoint) as client:
        with pytest.raises(subprocess.TimeoutExpired):
            sim.ended(timeout=2.0)
        assert client.robot().state()
