"""A state file is checked against its schema and its robot before it is served: each damage is one line, exit code 2."""

import json
import os
import random
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import pytest
from support.processes import free_port

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import EXIT_USAGE, run_app
from robosandbox.errors import InputError
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.workcell.zenoh.server.checkpoint import SavedWorld, StateFile
from robosandbox.workcell.zenoh.server.loader import TaskLoader

Data = dict[str, Any]
NOBODY = 65534


@pytest.fixture(scope="module")
def saved() -> SavedWorld:
    """Return a world as a sim saves it."""
    with TaskLoader(WorkcellOptions(what_if=False)).open("pick_cube_franka") as session:
        return SavedWorld(
            boot_id="a boot",
            mujoco=mujoco.__version__,
            task=session.task.model_dump(mode="json"),
            checkpoint=session.checkpoint(),
        )


@pytest.fixture
def file(saved: SavedWorld, tmp_path: Path) -> Path:
    StateFile(tmp_path / "world.json").save(saved)
    return tmp_path / "world.json"


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Leave the signal handlers of the test process as they were; end a sim that serves though it should not."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    interval = sys.getswitchinterval()
    guard = threading.Timer(120.0, os.kill, (os.getpid(), signal.SIGTERM))
    guard.daemon = True
    guard.start()
    yield
    guard.cancel()
    sys.setswitchinterval(interval)
    for number, handler in before.items():
        signal.signal(number, handler)


def start(file: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    arguments = ["sim", "--state-file", str(file), "--listen", f"tcp/127.0.0.1:{free_port()}"]
    code = run_app(app, "robo-sandbox", arguments)
    return code, capsys.readouterr().err


def changed(change: Callable[[Data], None]) -> Callable[[Path], None]:
    """Return a damage that changes the file's data."""

    def damage(file: Path) -> None:
        data = json.loads(file.read_text())
        change(data)
        file.write_text(json.dumps(data))

    return damage


def put_bytes(content: bytes) -> Callable[[Path], None]:
    """Return a damage that replaces the whole file's content."""

    def damage(file: Path) -> None:
        file.write_bytes(content)

    return damage


def put(*path: str | int, value: Any) -> Callable[[Path], None]:
    """Return a damage that sets one place in the file's data."""

    def change(data: Any) -> None:
        for step in path[:-1]:
            data = data[step]
        data[path[-1]] = value

    return changed(change)


def folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


def pipe(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


def loop(file: Path) -> None:
    file.unlink()
    file.symlink_to(file)


GOAL = {"goal_id": "00000000-0000-4000-8000-000000000000", "boot_id": "b", "skill": "pick", "status": "accepted"}
# The first numbers of the state are the time and the position of the arm; the cube's position follows its joints.
DAMAGES: dict[str, Callable[[Path], None]] = {
    "empty": put_bytes(b""),
    "truncated": lambda file: os.truncate(file, file.stat().st_size // 2),
    "no JSON": put_bytes(b"version: 2\n"),
    "binary junk": put_bytes(random.Random(0).randbytes(5000)),
    "a list": put_bytes(b"[1, 2]"),
    "deeply nested": put_bytes(b"[" * 100_000),
    "an old version": put("version", value=1),
    "a version in words": put("version", value={"a": []}),
    "a missing field": changed(lambda data: data["checkpoint"].pop("state")),
    "an unknown field": put("checkpoint", "speed", value=1),
    "a wrong type": put("checkpoint", "start", value="x"),
    "a goal without fields": put("goals", value=[{}]),
    "a goal of a wrong status": put("goals", value=[{"goal": {**GOAL, "status": "half"}, "arguments": {}}]),
    "arguments that are no mapping": put("goals", value=[{"goal": GOAL, "arguments": 7}]),
    "NaN": put("checkpoint", "state", 3, value=float("nan")),
    "infinity": put("checkpoint", "state", 3, value=float("inf")),
    "1e308": put("checkpoint", "state", 10, value=1e308),
    "a cube a million metres away": put("checkpoint", "state", 10, value=1e6),
    "a joint beyond its limits": put("checkpoint", "state", 2, value=9.0),
    "a negative time": put("checkpoint", "state", 0, value=-5.0),
    "a quaternion of zeros": changed(lambda data: data["checkpoint"]["state"].__setitem__(slice(13, 17), [0.0] * 4)),
    "a scene's pose of 1e308": put("checkpoint", "scene", "objects", 0, "pose", "xyz", 0, value=1e308),
    "a state too short": changed(lambda data: data["checkpoint"]["state"].pop()),
    "another robot's": put("checkpoint", "scene", "robot_urdf", value="some_other_arm.xml"),
    "a negative count": put("checkpoint", "physics_steps", value=-1),
    "a seed with a fraction": put("checkpoint", "seed", value=0.5),
    "a task of another kind": put("task", value={"name": "x"}),
    "a folder": folder,
    "a pipe": pipe,
    "a link to itself": loop,
    "a journal that is a folder": lambda file: StateFile(file).journal.mkdir(),
}


@pytest.mark.parametrize("kind", DAMAGES)
def test_damaged_state_file_is_one_line_and_exit_code_2(
    file: Path, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    DAMAGES[kind](file)
    code, said = start(file, capsys)
    assert code == EXIT_USAGE, said
    assert said.count("\n") == 1 and "state" in said and "Traceback" not in said and len(said) < 500, said


def test_state_file_that_may_not_be_read_is_one_line(saved: SavedWorld) -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o777)
        file = StateFile(Path(folder, "world.json"))
        file.save(saved)
        file.path.chmod(0)
        # The superuser reads every file; anybody else is asked as they are.
        user = os.geteuid()
        os.seteuid(NOBODY if user == 0 else user)
        try:
            with pytest.raises(InputError, match="cannot be read: Permission denied"):
                file.load()
        finally:
            os.seteuid(user)


def test_whole_state_file_is_gone_on_from(file: Path, saved: SavedWorld) -> None:
    found = StateFile(file).load()
    assert found == saved
    with TaskLoader(WorkcellOptions(what_if=False)).resume(saved) as session:
        assert session.checkpoint().state == pytest.approx(saved.checkpoint.state, abs=1e-6)


def test_any_byte_of_a_state_file_that_is_overwritten_is_a_line_or_a_world(file: Path) -> None:
    content = file.read_bytes()
    rng = random.Random(1)
    for _ in range(300):
        place = rng.randrange(len(content))
        file.write_bytes(content[:place] + rng.randbytes(1) + content[place + 1 :])
        try:
            StateFile(file).load()
        except InputError as error:
            assert "\n" not in str(error)
