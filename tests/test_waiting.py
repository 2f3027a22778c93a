"""On a terminal, what takes over a second says what it is doing; what is quick says nothing, and nothing goes to pipes."""

from __future__ import annotations

import io
import logging
import sys
import threading
from collections.abc import Iterator

import pexpect
import pytest
from rich.console import Console
from rich.progress import Progress

from robosandbox.apps.cli import app
from robosandbox.apps.commands import waiting
from robosandbox.apps.commands.console import run_app
from robosandbox.progress import LOGGER, doing, nothing_done


class AtTerminal(waiting.SlowWork):
    """Tells when its line is there."""

    def __init__(self) -> None:
        super().__init__()
        self.shown = threading.Event()

    def _show(self) -> None:
        super()._show()
        self.shown.set()


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """Return what stderr's terminal is sent."""
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, color_system=None, width=80)
    monkeypatch.setattr(waiting, "stderr_console", lambda: console)
    return text


@pytest.fixture
def work(monkeypatch: pytest.MonkeyPatch) -> Iterator[AtTerminal]:
    handler = AtTerminal()
    monkeypatch.setattr(LOGGER, "handlers", [handler])
    level = LOGGER.level
    # Set by its method, which forgets what loggers remember of levels.
    LOGGER.setLevel(logging.INFO)
    yield handler
    handler.tell("")
    LOGGER.setLevel(level)


def described(work: waiting.SlowWork) -> list[str]:
    return [task.description for task in work._line.tasks] if work._line is not None else []


def test_what_takes_long_is_told_with_what_comes_after_it(
    work: AtTerminal, screen: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting, "_PATIENCE_SECONDS", 0.0)
    with doing("measuring the gripper"):
        assert work.shown.wait(10.0)
        assert described(work) == ["measuring the gripper"]
        with doing("finding where it closes"):
            assert described(work) == ["finding where it closes"]
    assert work._line is None and "measuring the gripper" in screen.getvalue()


def test_what_is_quick_is_not_told(work: AtTerminal, screen: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waiting, "_PATIENCE_SECONDS", 600.0)
    with doing("loading"):
        waited = work._timer
        with doing("measuring"):
            # Two short works in a row may be long together.
            assert work._timer is waited is not None
    assert work._timer is None and screen.getvalue() == ""


def test_nothing_moves_while_a_person_is_asked(
    work: AtTerminal, screen: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting, "_PATIENCE_SECONDS", 0.0)
    with doing("starting"):
        assert work.shown.wait(10.0)
        nothing_done()
        assert described(work) == []


def test_what_is_printed_to_a_pipe_meanwhile_goes_to_the_pipe(
    work: AtTerminal, screen: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipe = io.StringIO()
    monkeypatch.setattr(sys, "stdout", pipe)
    monkeypatch.setattr(waiting, "_PATIENCE_SECONDS", 0.0)
    with doing("checking"):
        assert work.shown.wait(10.0)
        print("ok")
    assert pipe.getvalue() == "ok\n" and "ok" not in screen.getvalue()


def test_two_lines_of_one_console_move_at_once(
    work: AtTerminal, screen: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting, "_PATIENCE_SECONDS", 0.0)
    with Progress(console=waiting.stderr_console(), transient=True) as bar, doing("loading panda.xml"):
        bar.add_task("episodes", total=2)
        assert work.shown.wait(10.0)
    assert work._line is None


def test_a_pipe_is_told_nothing(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waiting, "_PATIENCE_SECONDS", 0.0)
    assert run_app(app, "robo-sandbox", ["tasks", "list"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run", "--task", "home"], ["opening the world", "loading panda.xml"]),
        (["robot", "infer", "franka_panda"], ["inferring the sidecar of panda.xml"]),
        (["robot", "check", "franka_panda"], ["comparing the sidecar with panda.xml", "trying a pick"]),
        (["look"], ["opening the world", "looking"]),
    ],
    ids=lambda value: " ".join(value),
)
def test_a_command_tells_what_it_does(arguments: list[str], told: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    handler = logging.Handler()
    monkeypatch.setattr(handler, "emit", lambda record: done.append(record.getMessage()))
    monkeypatch.setattr(LOGGER, "handlers", [handler])
    level = LOGGER.level
    LOGGER.setLevel(logging.INFO)
    try:
        assert run_app(app, "robo-sandbox", arguments) == 0
    finally:
        LOGGER.setLevel(level)
    assert [part for part in told if part not in done] == [] and done[-1] == ""


_IMPATIENT = """\
import sys
from robosandbox.apps.commands import waiting
from robosandbox.apps.cli import main
waiting._PATIENCE_SECONDS = 0.0
sys.argv = ["robo-sandbox", "tasks", "show", "home"]
main()
"""


def test_a_terminal_is_shown_that_a_command_starts_and_then_its_answer() -> None:
    child = pexpect.spawn(sys.executable, ["-c", _IMPATIENT], timeout=120, dimensions=(24, 120))
    child.expect("starting.*prompt: go home.*")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 0


def test_a_bench_on_a_terminal_counts_its_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    code = _IMPATIENT.replace("import main", "import bench_main as main").replace(
        '"robo-sandbox", "tasks", "show"', '"b"'
    )
    code = code.replace('"home"]', '"home", "--seeds", "2"]')
    child = pexpect.spawn(sys.executable, ["-c", code], timeout=120, dimensions=(24, 120))
    child.expect("starting.*/2.*2/2 successful")
    child.expect(pexpect.EOF)
    child.close()
    assert child.exitstatus == 0
