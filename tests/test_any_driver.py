"""Every part of the product over a driver that hides its simulator: served, driven, watched and recorded."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="the extra `viewer` is not installed")
pytest.importorskip("av", reason="the extra `record` is not installed")
pytest.importorskip("gymnasium", reason="the extra `gym` is not installed")

from support.processes import SimProcess, free_port

from robosandbox.apps.envs.env import ManipulationEnv
from robosandbox.apps.export.lerobot import export_lerobot
from robosandbox.apps.viewer.app import Viewer
from robosandbox.apps.viewer.connected import ConnectedSource
from robosandbox.apps.viewer.embedded import EmbeddedSource
from robosandbox.apps.viewer.news import Came, Complaint, News
from robosandbox.apps.viewer.replay import recorded_frames
from robosandbox.apps.viewer.source import Frame
from robosandbox.errors import InputError, UnsupportedError
from robosandbox.types import Pose
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.workcell.recording.drawing import contact_force, frames, plot, world_of
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.files import find_episodes
from robosandbox.workcell.recording.replay import open_replay
from robosandbox.workcell.recording.settings import RecordSettings, VideoSettings, open_recorder
from robosandbox.workcell.session import open_session
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell
from robosandbox.workcell.zenoh.server.loader import TaskLoader
from robosandbox.workcell.zenoh.server.server import SimServer
from robosandbox.workcell.zenoh.transport import open_listener

_TASK = "pick_cube_franka"
_HARDWARE = ("--task", _TASK, "--driver", "hardware:seed=3", "--perception", "rgbd")


def cli(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from robosandbox.apps.cli import main; main()", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@pytest.fixture(scope="module")
def sim() -> Iterator[SimProcess]:
    with SimProcess(*_HARDWARE, "--pace", "fast") as process:
        yield process


@pytest.mark.gl
def test_hardware_is_served_and_an_agent_in_another_process_does_the_task(sim: SimProcess) -> None:
    done = cli("agent", "--connect", sim.endpoint, "pick up the red cube")
    assert done.returncode == 0, done.stdout + done.stderr
    with connect(sim.endpoint) as client:
        robot = client.robot()
        # What the fingers hold is what perception believed when it last looked.
        assert robot.state().hands == {"hand": "red_cube"}
        assert robot.state().physics_steps is None
        assert robot.observe().held == "red_cube"
        cell = RemoteWorkcell(robot)
        assert not cell.judgeable
        assert cell.run("go home").success
        assert cell.elapsed()[1] is None


@pytest.mark.gl
def test_pictures_of_hardware_are_what_its_cameras_deliver(sim: SimProcess) -> None:
    with connect(sim.endpoint) as client:
        robot = client.robot()
        assert robot.cameras == ("scene", "top", "wrist")
        payload, about = robot.picture("top", depth=True)
        depth = np.frombuffer(payload, np.float32)
        assert len(depth) == about.intrinsics.width * about.intrinsics.height
        assert 1.0 < np.median(depth) < 1.5


@pytest.mark.parametrize(
    ("ask", "lacks"),
    [
        ("truth", "truth: the driver of panda does not know the true state of its world"),
        ("reset", "reset: the driver of panda cannot start its world over"),
        ("load", "reset: the driver of panda cannot start its world over, and loading another task does that"),
        ("checkpoint", "fork: the driver of panda cannot copy its world"),
    ],
)
def test_what_hardware_lacks_is_answered_in_one_line(sim: SimProcess, ask: str, lacks: str) -> None:
    with connect(sim.endpoint) as client:
        robot = client.robot()
        calls = {"reset": lambda: robot.reset(0), "load": lambda: robot.load(_TASK)}
        with pytest.raises(UnsupportedError, match=re.escape(lacks)) as refused:
            calls.get(ask, getattr(robot, ask))()
        assert "\n" not in refused.value.message
        # Time passes all the same; what is read is 30 ms late, as much as the driver is.
        began = robot.state().robot.time
        assert robot.step(0.1).time == pytest.approx(began + 0.1, abs=0.05)


def test_a_picture_of_a_driver_without_cameras_is_refused_by_name() -> None:
    loader = TaskLoader(WorkcellOptions(task=_TASK, driver="hardware", perception="rgbd"))
    host = loader.first()
    host.driver._inner._capabilities = replace(host.driver.capabilities, cameras={})  # type: ignore[attr-defined]
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session, _ = open_listener(endpoint)
    with session, SimServer(host, session, robot_id="arm-1", load=loader.load), connect(endpoint) as client:
        robot = client.robot("arm-1")
        assert robot.cameras == ()
        for ask in (lambda: robot.picture("scene"), robot.observe):
            with pytest.raises(UnsupportedError, match="cameras: the driver of panda has no cameras, and"):
                ask()


@pytest.mark.slow
def test_a_state_file_of_hardware_is_refused_before_it_is_served(tmp_path: Path) -> None:
    done = cli("sim", *_HARDWARE, "--listen", "tcp/127.0.0.1:0", "--state-file", str(tmp_path / "state"))
    assert done.returncode == 2
    *warned, told = done.stderr.splitlines()
    assert [line.split(": ")[1] for line in warned] == ["force", "sliding", "workspace"] and "state" in told
    assert "truth: the driver of panda does not know the true state of its world, and --state-file" in done.stderr


# Watching.


@pytest.fixture(scope="module")
def watched() -> Iterator[tuple[Viewer, list[Frame], list[News]]]:
    session = open_session(_TASK, driver="hardware", driver_options={"seed": 3}, perception="rgbd")
    viewer = Viewer(EmbeddedSource(WorkcellHost(session, pace="watched")), 0)
    frames: list[Frame] = []
    news: list[News] = []
    viewer.control.listeners.append(news.append)
    viewer.stream.start()
    viewer.source.host.start()
    viewer.source.start(frames.append, lambda loaded: None)
    yield viewer, frames, news
    viewer.stop()


def finish(viewer: Viewer) -> None:
    """Wait until nothing is under way."""
    assert viewer.source.host.wait_idle(60.0)


@pytest.mark.slow
@pytest.mark.gl
def test_the_viewer_draws_what_is_believed_of_hardware(watched: tuple[Viewer, list[Frame], list[News]]) -> None:
    viewer, frames, news = watched
    viewer.control.run("pick up the red cube")
    finish(viewer)
    came, verdict = (item.result for item in news if isinstance(item, Came))
    assert came.failure is None and verdict.data["success"]
    last = frames[-1]
    assert viewer.source.blueprint.model is last.model
    assert last.hands == {"hand": "red_cube"} and last.state is None
    # The cube rides along between looks, where the hand has it.
    viewer.control.by_hand("jog", lambda: viewer.source.teleop.jog(Pose(xyz=(0.0, 0.0, 0.03))))
    finish(viewer)
    before, after = (drawn_cube(frame) for frame in (last, frames[-1]))
    assert after[2] - before[2] == pytest.approx(0.03, abs=0.004)
    assert np.abs(after - frames[-1].seen.tcp_pose.position).max() < 0.02


def drawn_cube(frame: Frame) -> np.ndarray:
    address = frame.model.joint("object/red_cube").qposadr[0]
    return frame.qpos[address : address + 3]


@pytest.mark.gl
def test_the_viewer_says_what_dragging_and_resetting_need(watched: tuple[Viewer, list[Frame], list[News]]) -> None:
    viewer, _, news = watched
    news.clear()
    viewer.control.by_hand("move", lambda: viewer.source.teleop.place("red_cube", Pose(xyz=(0.0, 0.0, 0.1))))
    finish(viewer)
    viewer.control.reset(1)
    finish(viewer)
    said = [item.message for item in news if isinstance(item, Complaint)]
    assert said[0].startswith("model: the driver of panda has no simulated model, and things are put elsewhere")
    assert said[1].startswith("truth: the driver of panda does not know the true state of its world, and a layout")
    assert len(said) == 2


@pytest.mark.gl
def test_a_viewer_of_a_sim_process_draws_what_is_believed_of_hardware(sim: SimProcess) -> None:
    with connect(sim.endpoint) as client:
        source = ConnectedSource(WorkcellHost(RemoteWorkcell(client.robot())))
        came = threading.Event()
        frames: list[Frame] = []

        def take(frame: Frame) -> None:
            frames.append(frame)
            came.set()

        source.host.start()
        source.start(take, lambda loaded: None)
        try:
            assert came.wait(20.0)
            assert "red_cube" in source.blueprint.object_bodies
            assert frames[0].model is source.blueprint.model
        finally:
            source.stop()
            source.host.close()


# Recording.


@pytest.mark.slow
@pytest.mark.gl
def test_an_episode_on_hardware_is_recorded_and_drawn_as_believed(tmp_path: Path) -> None:
    with open_session(_TASK, driver="hardware", driver_options={"seed": 3}, perception="rgbd") as session:
        settings = RecordSettings(folder=tmp_path, video=VideoSettings(cameras=("top",), fps=5.0))
        recorder = open_recorder(settings, session)
        recorder.follow()
        assert session.run().success
        truly = session.driver.referee().objects["red_cube"].pose.position  # type: ignore[attr-defined]
        folder = recorder.finish()
        recorder.close()
        assert folder is not None
        episode = RecordedEpisode.load(folder)
        assert "action" not in episode and "contact_bodies" not in episode
        assert np.isnan(episode["gripper"][:, 3]).all(), "a force that nobody measures is no zero"
        # Nothing is known of the cube before the first look; at the end it is believed where the plant has it.
        assert np.isnan(episode.object_poses[0]).all()
        assert np.abs(episode.object_poses[-1, 0, :3] - truly).max() < 0.01
        seen = [line["scene"] for line in episode.events() if line["event"] == "seen" and line["scene"]]
        assert [item["id"] for item in seen[0]["objects"]] == ["red_cube"]
        assert len(list(frames(episode, world_of(episode), ("top",), 200, (48, 64)))) == len(episode) // 200 + 1
        assert contact_force(episode).shape == (len(episode),) and np.isnan(contact_force(episode)).all()
        plot(episode, tmp_path / "plot.png")
        with pytest.raises(InputError, match="has no actions to run again, because its driver simulates no model"):
            open_replay(episode)
        with pytest.raises(InputError, match="has no commands, because its driver tells none"):
            export_lerobot([episode], tmp_path / "dataset", fps=20, cameras=(), size=(48, 64))
    with open_session(_TASK) as simulated:
        played = recorded_frames(episode, simulated).frame(len(episode) - 1)
        assert played.seen.gripper is not None and played.seen.gripper.force is None
        assert np.allclose(played.seen.q, episode["q"][-1])


@pytest.mark.slow
@pytest.mark.gl
def test_goals_that_pixels_are_used_for_are_recorded_too(tmp_path: Path) -> None:
    with SimProcess("--task", _TASK, "--perception", "rgbd", "--pace", "fast", "--record", str(tmp_path)) as process:
        with connect(process.endpoint) as client:
            client.robot().send("home").wait()
        process.stop()
    assert len(list(find_episodes(tmp_path))) == 1


def test_an_environment_says_that_it_needs_a_simulated_world() -> None:
    with pytest.raises(UnsupportedError, match="truth: the driver of panda does not know the true state of its world"):
        ManipulationEnv(_TASK, driver="hardware")


@pytest.mark.gl
def test_fingers_that_are_where_they_were_sent_hold_nothing_however_near_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    with open_session(_TASK, driver="hardware", driver_options={"seed": 3}, perception="rgbd") as session:
        assert session.run().success
        assert session.observe().held == "red_cube"
        hand = session.driver.hands["hand"]
        now = hand.state()
        assert now.commanded is not None and now.commanded > now.closed
        # As after a loss of power: the fingers are sent to where they are, as far apart as before.
        limp = replace(now, commanded=now.closed)
        monkeypatch.setattr("robosandbox.drivers.hardware._HardwareHand.state", lambda _: limp)
        session.driver.wait(0.1)
        assert session.observe().held is None
