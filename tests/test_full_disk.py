"""Disks that are full, folders that cannot be written to, files that are none, numbers that are too large: a line each."""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from robosandbox.apps.bench.bench import run_bench
from robosandbox.apps.cli import app
from robosandbox.apps.commands import bench as bench_command
from robosandbox.apps.commands.console import EXIT_USAGE, run_app
from robosandbox.tasks.loader import find_task

_MAIN = "from robosandbox.apps.cli import {0}; {0}()"


def with_room(most: int, main: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command none of whose files may have more bytes, as on a disk with so much room."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

    command = [sys.executable, "-B", "-c", _MAIN.format(main), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, preexec_fn=limit, check=False)


@pytest.mark.parametrize("option", ["--json", "--resume"])
def test_rows_that_no_longer_fit_are_told_and_those_before_them_are_whole(option: str, tmp_path: Path) -> None:
    file = tmp_path / "rows"
    done = with_room(2500, "bench_main", "home", "--seeds", "20", option, str(file))
    assert done.returncode == EXIT_USAGE
    assert "File too large; make room" in done.stderr and "Traceback" not in done.stderr
    text = file.read_text()
    rows = json.loads(text) if option == "--json" else [json.loads(line) for line in text.splitlines()[:-1]]
    assert len(rows) >= 1


def test_a_recording_that_is_cut_short_is_no_recording(tmp_path: Path) -> None:
    done = with_room(20_000, "main", "run", "pick up the red cube", "--record", str(tmp_path), "--json")
    assert done.returncode == 1
    assert "the recording is cut short: " in done.stderr and "File too large" in done.stderr
    assert "recorded:" not in done.stderr
    told = json.loads(done.stdout)
    assert told["success"] and "cut short" in told["recording_error"]


def test_a_bench_whose_recordings_are_cut_short_ends(tmp_path: Path) -> None:
    done = with_room(20_000, "bench_main", "pick_from_three", "--seeds", "3", "--record", str(tmp_path))
    assert done.returncode == 3
    assert "--record: " in done.stderr and "Traceback" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
@pytest.mark.parametrize(
    ("main", "arguments"), [("main", ("run", "go home")), ("bench_main", ("home", "--seeds", "2"))]
)
def test_a_full_stdout_is_a_line_and_exit_code_3(main: str, arguments: tuple[str, ...]) -> None:
    with open("/dev/full", "w", encoding="utf-8") as full:
        command = [sys.executable, "-c", _MAIN.format(main), *arguments]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
    assert done.returncode == 3
    assert "No space left on device; make room" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr


@pytest.mark.parametrize("command", [("sim",), ("run", "go home")])
def test_a_folder_that_cannot_be_written_to_is_told_before_anything_moves(
    command: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_app(app, "robo-sandbox", [*command, "--record", "/proc/runs"]) == EXIT_USAGE
    assert "--record: '/proc' cannot be written to" in capsys.readouterr().err


def test_a_pipe_is_told_to_be_none_of_the_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pipe = tmp_path / "task.yaml"
    os.mkfifo(pipe)
    assert run_app(app, "robo-sandbox", ["run", "go home", "--task", str(pipe)]) == EXIT_USAGE
    assert f"{pipe}: is a pipe or device; name a file" in capsys.readouterr().err


@pytest.mark.parametrize("command", [("sim",), ("run", "go home"), ("plan", "go home")])
def test_a_seed_beyond_the_last_layout_is_told(command: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert run_app(app, "robo-sandbox", [*command, "--seed", str(10**20)]) == EXIT_USAGE
    assert f"seed: {10**20} is beyond a task's last layout; give 0 to 2147483647" in capsys.readouterr().err


def test_more_seeds_than_layouts_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_app(bench_command.app, "robo-sandbox-bench", ["home", "--seeds", str(10**12)]) == EXIT_USAGE
    assert f"--seeds: {10**12}; a task has 2147483648 layouts" in capsys.readouterr().err


def test_the_first_of_two_thousand_million_rows_comes_at_once() -> None:
    assert next(run_bench([find_task("home")], 2**31)).seed == 0
