"""What a command imports, what it checks first, and the cache that makes the second start short."""

import json
import multiprocessing
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from robosandbox import cache
from robosandbox.apps.cli import COMMANDS
from robosandbox.apps.mcp import greeting
from robosandbox.robots import loader
from robosandbox.robots.loader import RobotModel, load_robot
from robosandbox.types import Array

HEAVY = {"scipy", "trimesh", "cv2", "zenoh", "pydantic_ai", "openai", "mcp", "yourdfpy", "rich", "viser"}


def modules_after(*arguments: str) -> set[str]:
    """Return the modules that a command has loaded when it ends."""
    code = (
        "import sys\n"
        f"sys.argv = ['robo-sandbox', *{list(arguments)!r}]\n"
        "from robosandbox.apps.cli import main\n"
        "try:\n    main()\nexcept SystemExit as end:\n    print(end.code, file=sys.stderr)\n"
        "print(*sorted(sys.modules), file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stderr.splitlines()[-1].split())


# Typer itself imports pydantic where it is installed, as soon as a command has parameters.
@pytest.mark.parametrize(
    ("arguments", "absent"),
    [
        (["--help"], {*HEAVY, "mujoco", "numpy", "pydantic.main", "yaml"}),
        (["--version"], {*HEAVY, "mujoco", "numpy", "pydantic.main", "yaml"}),
        (["tasks", "list"], {*HEAVY, "mujoco", "numpy"}),
        (["plan", "pick up the red cube"], {*HEAVY, "rapidfuzz"}),
        (["run", "home", "--robot", "nothing.xml"], {*HEAVY, "mujoco"}),
        (["run", "home", "--task", "pick_cube_frnka"], {*HEAVY, "mujoco"}),
        (["run", "home", "--task", "nothing.yaml"], {*HEAVY, "mujoco"}),
        (["plan", "home", "--planner", "sbut"], {*HEAVY, "mujoco"}),
        (["plan", "home", "--seed", "-1"], {*HEAVY, "mujoco", "numpy"}),
        (["mcp", "--http", "70000"], {*HEAVY, "mujoco", "numpy"}),
        (["viewer", "--port", "70000"], {*HEAVY, "mujoco", "numpy"}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "lean",
)
def test_a_command_loads_no_more_than_it_needs(arguments: list[str], absent: set[str]) -> None:
    assert not modules_after(*arguments) & absent


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "home", "--robot", "nothing.xml"],
        ["run", "home", "--task", "nothing.yaml"],
        ["plan", "home", "--perception", "eyes"],
        ["sim", "--task", "nothing"],
        ["mcp", "--task", "nothing"],
    ],
    ids=" ".join,
)
def test_what_is_not_there_is_one_line_and_wrong_usage(arguments: list[str]) -> None:
    code = "from robosandbox.apps.cli import main; main()"
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and not done.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_the_line_of_help_is_the_commands_own(name: str) -> None:
    command = COMMANDS[name].load(name)
    assert COMMANDS[name].help == (command.help or "").strip().splitlines()[0]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv(cache.OFF_VARIABLE, raising=False)
    return tmp_path / "robosandbox"


def measured() -> RobotModel:
    """Return the bundled arm, read from its files and not from this process's memory."""
    loader._load.cache_clear()
    return load_robot()


def figures(robot: RobotModel) -> str:
    """Return what was measured, to the last bit."""
    return json.dumps(
        [cache.as_data(item) for item in (robot.gripper, robot.workspace, robot.tool_bounds, robot.R_site_tcp)]
    )


def test_measurements_from_the_cache_are_bit_equal(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.OFF_VARIABLE, "1")
    without = figures(measured())
    assert not folder.exists()
    monkeypatch.delenv(cache.OFF_VARIABLE)
    written = figures(measured())
    assert len(list(folder.iterdir())) == 1
    monkeypatch.setattr("robosandbox.robots.measurements._measure", None)
    assert without == written == figures(measured())


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: "",
        lambda text: text[: len(text) // 2],
        lambda text: text.replace("tilt", "tlit"),
        lambda text: text.replace("0.0", "0.1", 1),
        lambda text: "null",
        lambda text: "\x00" * 5_000_000,
    ],
    ids=["empty", "cut off", "another field", "another digit", "no entry", "too large"],
)
def test_a_damaged_entry_is_measured_anew_and_mended(folder: Path, damage: object) -> None:
    whole = figures(measured())
    (entry,) = folder.iterdir()
    text = entry.read_text()
    entry.write_text(damage(text))  # type: ignore[operator]
    assert figures(measured()) == whole and entry.read_text() == text


def test_a_folder_that_cannot_be_written_costs_only_time(folder: Path) -> None:
    folder.parent.mkdir(exist_ok=True)
    folder.write_text("a file where the folder should be")
    assert figures(measured()) == figures(measured())


@dataclass(frozen=True)
class Sample:
    """A value that the cache keeps."""

    name: str
    values: Array


def _value() -> Sample:
    return Sample(name="x", values=np.arange(2000.0))


def _rewrite(key: str) -> None:
    for _ in range(200):
        cache._write((cache.cache_folder() or Path()) / f"race-{key}.json", cache.as_data(_value()))


def test_entries_written_by_two_processes_at_once_are_whole(folder: Path) -> None:
    context = multiprocessing.get_context("fork")
    writers = [context.Process(target=_rewrite, args=("k",)) for _ in range(2)]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        found = cache.cached("race", Sample, lambda: "k", _value)
        assert found.name == "x" and (found.values == np.arange(2000.0)).all()
        for path in folder.glob("race-*"):
            cache._read(path)
    for writer in writers:
        writer.join()
        assert writer.exitcode == 0
    assert [path.name for path in folder.iterdir()] == ["race-k.json"]


def test_the_folder_is_bounded(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "MAX_ENTRIES", 5)
    for number in range(8):
        cache.cached("many", Sample, lambda number=number: f"{number}", _value)  # type: ignore[misc]
        os.utime(folder / f"many-{number}.json", (number, number))
    assert len(list(folder.iterdir())) == 5 and (folder / "many-7.json").exists()


def test_another_sidecar_is_another_entry(folder: Path, tmp_path: Path) -> None:
    source = load_robot().path.parent
    for file in source.iterdir():
        if file.is_file():
            (tmp_path / file.name).write_bytes(file.read_bytes())
    load_robot(tmp_path / "panda.xml")
    before = set(folder.iterdir())
    sidecar = tmp_path / "panda.robosandbox.yaml"
    sidecar.write_text(sidecar.read_text().replace("open_qpos: 0.04", "open_qpos: 0.035"))
    load_robot(tmp_path / "panda.xml")
    assert len(set(folder.iterdir()) - before) == 1


@pytest.mark.parametrize("version", [*greeting.PROTOCOL_VERSIONS, "1999-01-01"])
def test_the_first_answer_is_the_librarys_own(version: str) -> None:
    asked = {
        "jsonrpc": "2.0",
        "id": "a",
        "method": "initialize",
        "params": {"protocolVersion": version, "capabilities": {}, "clientInfo": {"name": "t", "version": "1"}},
    }
    answer = greeting._answer(json.dumps(asked))
    if version == "1999-01-01":
        assert answer is None
        return
    code = (
        "import asyncio\n"
        "from robosandbox.apps.mcp.serve import serve_stdio\n"
        "from robosandbox.apps.mcp.server import build_server\n"
        "asyncio.run(serve_stdio(build_server(None)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], input=json.dumps(asked) + "\n", capture_output=True, text=True, check=True
    )
    assert answer == json.loads(done.stdout)


def test_a_world_that_does_not_open_is_the_error_of_the_first_call(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text("<mujoco><worldbody/></mujoco>")
    lines = [
        {
            "jsonrpc": "2.0",
            "id": 1,
            "method": "initialize",
            "params": {
                "protocolVersion": "2025-06-18",
                "capabilities": {},
                "clientInfo": {"name": "t", "version": "1"},
            },
        },
        {"jsonrpc": "2.0", "method": "notifications/initialized"},
        {"jsonrpc": "2.0", "id": 2, "method": "tools/call", "params": {"name": "look", "arguments": {}}},
    ]
    code = "from robosandbox.apps.cli import main; main()"
    with subprocess.Popen(
        [sys.executable, "-c", code, "mcp", "--robot", str(tmp_path / "arm.xml")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as server:
        assert server.stdin is not None and server.stdout is not None
        for line in lines:
            server.stdin.write(json.dumps(line) + "\n")
        server.stdin.flush()
        first, second = json.loads(server.stdout.readline()), json.loads(server.stdout.readline())
        server.stdin.close()
    assert first["id"] == 1 and first["result"]["serverInfo"]["name"] == "robosandbox"
    assert second["result"]["isError"] and "arm.xml" in second["result"]["content"][0]["text"]
    assert server.returncode == 0
