"""Benches that go on: with files of rows, processes that die, and a Ray cluster of two nodes."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from support.cluster import dying_worker, local_cluster

from robosandbox.apps.bench.bench import BenchSettings, Row, run_bench
from robosandbox.apps.bench.engines import ProcessPool
from robosandbox.apps.bench.episodes import Chunk
from robosandbox.apps.bench.results_file import ResultsFile
from robosandbox.errors import InputError, ServiceUnavailableError
from robosandbox.tasks.loader import find_task

TASKS = ("pick_cube_scrambled", "home")
SEEDS = 4


def untimed(rows: list[Row]) -> list[Row]:
    return [replace(row, secs=0.0) for row in rows]


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return untimed(list(run_bench([find_task(name) for name in TASKS], SEEDS)))


def bench(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from robosandbox.apps.cli import bench_main; bench_main()", *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


# Files of rows.


@pytest.mark.slow
def test_what_a_file_holds_is_not_run_again_and_the_rows_are_the_same(rows: list[Row], tmp_path: Path) -> None:
    file = tmp_path / "rows.jsonl"
    ours = ("--tasks", *TASKS, "--seeds", str(SEEDS), "--resume", str(file), "--json", "-")
    first = bench(*ours)
    assert first.returncode == 0, first.stderr
    lines = file.read_bytes().splitlines(keepends=True)
    assert len(lines) == len(rows)
    # As a process that was killed leaves it: some rows, and half of one.
    file.write_bytes(b"".join(lines[:3]) + lines[3][:40])
    again = bench(*ours)
    told = file.read_bytes().splitlines(keepends=True)
    assert told[:3] == lines[:3] and len(told) == len(rows)
    earlier = [{**row, "secs": 0.0} for row in json.loads(again.stdout)]
    assert earlier == [{**row, "secs": 0.0} for row in json.loads(first.stdout)]
    assert [row["secs"] for row in json.loads(again.stdout)][:3] == [row["secs"] for row in json.loads(first.stdout)][
        :3
    ]


def test_rows_of_other_settings_or_versions_and_other_files_are_refused(rows: list[Row], tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    path.write_text(json.dumps(rows[0].record()) + "\n")
    with pytest.raises(InputError, match="what_if was True and is False"):
        ResultsFile.resume(path, BenchSettings(what_if=False))
    path.write_text(json.dumps({**rows[0].record(), "versions": {**rows[0].versions, "mujoco": "2.0"}}) + "\n")
    with pytest.raises(InputError, match=r"mujoco was '2\.0'"):
        ResultsFile.resume(path, BenchSettings())
    for text in ('{"task": "home"}\n', "[]\n", "nonsense\n"):
        path.write_text(text)
        with pytest.raises(InputError, match=r"rows\.jsonl, line 1"):
            ResultsFile.resume(path, BenchSettings())
    with pytest.raises(InputError, match="cannot be used"):
        ResultsFile.resume(tmp_path, BenchSettings())


# Processes.


@pytest.mark.slow
def test_episodes_of_a_killed_process_are_run_again(rows: list[Row], caplog: pytest.LogCaptureFixture) -> None:
    killed: list[int] = []

    def kill_one(_: Row) -> None:
        if not killed:
            (child, *_rest) = children(os.getpid())
            killed.append(child)
            os.kill(child, signal.SIGKILL)

    tasks = [find_task(name) for name in TASKS]
    assert untimed(list(run_bench(tasks, SEEDS, jobs=2, on_row=kill_one))) == rows
    assert killed and "run again" in caplog.text


@pytest.mark.slow
def test_processes_that_die_each_time_end_the_bench() -> None:
    chunk = Chunk(find_task("home"), (0,), replace(BenchSettings(), planner_options=_Deadly()))  # type: ignore[arg-type]
    with pytest.raises(ServiceUnavailableError, match="3 times"):
        list(ProcessPool(1).run([chunk]))


class _Deadly(dict[str, Any]):
    """Ends the process that unpacks it."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os._exit, (9,)


def children(pid: int) -> list[int]:
    """Return the bench's worker processes, oldest first."""
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in listed if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


# A cluster.


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    # Not imported here: Ray reads on import where its nodes may listen.
    if find_spec("ray") is None:
        pytest.skip("needs the extra `scale`")
    with local_cluster() as address:
        yield address


def test_a_cluster_gives_the_same_rows(rows: list[Row], cluster: str) -> None:
    from robosandbox.apps.bench.ray_engine import RayEngine

    tasks = [find_task(name) for name in TASKS]
    assert untimed(list(run_bench(tasks, SEEDS, engine=RayEngine(2, cluster)))) == rows


def test_episodes_of_a_killed_ray_worker_are_run_again(rows: list[Row], cluster: str) -> None:
    from robosandbox.apps.bench.ray_engine import RayEngine

    tasks = [find_task(name) for name in TASKS]
    with dying_worker() as killed:
        assert untimed(list(run_bench(tasks, SEEDS, engine=RayEngine(2, cluster)))) == rows
    assert killed


_LOST_HEAD = """
import sys
from pathlib import Path
from robosandbox.errors import ServiceUnavailableError
from robosandbox.apps.bench.bench import BenchSettings, run_bench
from robosandbox.tasks.loader import find_task
from robosandbox.apps.bench.ray_engine import RayEngine
from robosandbox.apps.bench.results_file import ResultsFile
from support.cluster import kill_head, local_cluster

with local_cluster() as address:
    earlier, killed = ResultsFile.resume(Path(sys.argv[1]), BenchSettings()), []
    try:
        for row in run_bench([find_task("home")], 400, jobs=2, earlier=earlier, engine=RayEngine(2, address)):
            killed = killed or [kill_head()]
    except ServiceUnavailableError as error:
        print(error, flush=True)
"""


@pytest.mark.slow
def test_a_head_that_dies_is_said_and_the_bench_goes_on_from_its_rows(tmp_path: Path) -> None:
    if find_spec("ray") is None:
        pytest.skip("needs the extra `scale`")
    # In a process of its own: Ray ends, a minute later, the process whose head is gone.
    file = tmp_path / "rows.jsonl"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    command = [sys.executable, "-c", _LOST_HEAD, str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180, env=environment)
    assert "the head of the Ray cluster" in done.stdout and "--resume" in done.stdout, done.stderr
    found = file.read_bytes().splitlines(keepends=True)
    assert 1 <= len(found) < 400
    earlier = ResultsFile.resume(file, BenchSettings())
    ran: list[Row] = []
    rows = list(run_bench([find_task("home")], len(found) + 3, earlier=earlier, on_row=ran.append))
    earlier.close()
    # Chunks end in any order; what is in the file is not run again.
    assert len(rows) == len(found) + 3 and not {row.seed for row in ran} & {json.loads(line)["seed"] for line in found}
    assert [replace(row, secs=0.0) for row in rows[:2]] == untimed(list(run_bench([find_task("home")], 2)))


def test_no_cluster_at_an_address_is_said_in_one_line() -> None:
    if find_spec("ray") is None:
        pytest.skip("needs the extra `scale`")
    done = bench("--tasks", "home", "--engine", "ray", "--ray-address", "127.0.0.1:1")
    assert done.returncode == 3 and "--ray-address" in done.stderr and "Traceback" not in done.stderr


def test_wrong_engines_are_refused_in_one_line() -> None:
    for options, said in (
        (("--engine", "rey"), "there is ray"),
        (("--ray-address", "auto"), "--engine ray"),
        (("--engine", "ray", "--connect", "tcp/127.0.0.1:1"), "--connect"),
    ):
        done = bench("--tasks", "home", *options)
        assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1
