"""Recordings: what is in them, that they run again to the same end, and what is left of a killed process."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from robosandbox.apps.bench.bench import BenchSettings, run_bench
from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.errors import InputError, SkillError
from robosandbox.skills.events import SkillStarted
from robosandbox.tasks.judge.checks import Lifted
from robosandbox.tasks.loader import find_task
from robosandbox.types import SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.recording.columns import COLUMNS
from robosandbox.workcell.recording.drawing import contact_force, plot
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.files import find_episodes
from robosandbox.workcell.recording.recorder import Recorder
from robosandbox.workcell.recording.replay import Replay, open_replay
from robosandbox.workcell.recording.settings import RecordSettings, VideoSettings, open_recorder
from robosandbox.workcell.session import open_session


def record(session: EmbeddedWorkcell, folder: Path, prompt: str | None = None) -> RecordedEpisode:
    """Return a recorded and judged run of the session's task."""
    recorder = Recorder(folder, session)
    recorder.follow()
    session.run(prompt)
    verdict = session.judge()
    recorder.finish(judged=verdict)
    recorder.close()
    assert recorder.last is not None
    return RecordedEpisode.load(recorder.last)


@pytest.fixture(scope="module")
def picked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[EmbeddedWorkcell, RecordedEpisode]]:
    with open_session("pick_cube_scrambled", seed=3) as session:
        yield session, record(session, tmp_path_factory.mktemp("picked"))


def test_every_column_is_there_and_described(picked: tuple[EmbeddedWorkcell, RecordedEpisode]) -> None:
    _, episode = picked
    assert set(episode.table.column_names) == set(COLUMNS) == set(episode.meta.columns)
    assert episode.result is not None and episode.result.steps == len(episode)


def test_rows_come_at_the_control_rate_and_end_where_the_world_stands(
    picked: tuple[EmbeddedWorkcell, RecordedEpisode],
) -> None:
    session, episode = picked
    assert np.allclose(np.diff(episode["time"]), session.driver.control_timestep)
    assert episode["time"][-1] == session.driver.time
    seen, truth = session.driver.state(), session.simulation.truth()
    assert np.array_equal(episode["q"][-1], seen.q)
    assert np.allclose(episode["qd"][-1], seen.qd, atol=1e-6)
    assert np.allclose(episode["tcp_pose"][-1, :3], seen.tcp_pose.xyz, atol=1e-6)
    assert abs(float(episode["tcp_pose"][-1, 3:] @ np.array(seen.tcp_pose.quat_xyzw))) == pytest.approx(1.0, abs=1e-6)
    assert seen.gripper is not None
    state = [seen.gripper.joint, seen.gripper.width, seen.gripper.closed, seen.gripper.force]
    assert np.allclose(episode["gripper"][-1], state, rtol=1e-5, atol=1e-6)
    cube = truth.objects["red_cube"].pose
    assert np.allclose(episode.object_poses[-1, 0, :3], cube.xyz, atol=1e-6)
    assert abs(float(episode.object_poses[-1, 0, 3:] @ np.array(cube.quat_xyzw))) == pytest.approx(1.0, abs=1e-6)


def test_actions_are_the_commands_and_not_the_state(picked: tuple[EmbeddedWorkcell, RecordedEpisode]) -> None:
    session, episode = picked
    assert np.array_equal(episode["action"][-1], session.mujoco.controls)
    moving = np.abs(episode["qd"]).max(axis=1) > 0.1
    assert np.abs(episode["action_q"] - episode["q"])[moving].max() > 1e-3
    closed = episode["action_gripper"]
    # Open on the way there; from the grasp on the fingers press against the cube and stay behind what is commanded.
    assert closed[1] < 0.5 and closed[-1] > episode["gripper"][-1, 2] + 0.005


def test_phases_of_the_skill_follow_one_another(picked: tuple[EmbeddedWorkcell, RecordedEpisode]) -> None:
    _, episode = picked
    spans = [(skill, phase) for skill, phase, _, _ in episode.spans() if skill]
    assert spans[:4] == [("pick", "approach"), ("pick", "descend"), ("pick", "grasp"), ("pick", "lift")]
    told = [line["event"] for line in episode.events()]
    assert told[:3] == ["started", "planned", "skill_started"] and told[-2:] == ["skill_ended", "ended"]


def test_contacts_are_those_that_the_world_reports(picked: tuple[EmbeddedWorkcell, RecordedEpisode]) -> None:
    session, episode = picked
    force, _, other = session.driver.senses.strongest_contact()
    assert other == "red_cube"
    assert contact_force(episode)[-1] == pytest.approx(force, rel=1e-4)


def test_recording_changes_nothing(picked: tuple[EmbeddedWorkcell, RecordedEpisode]) -> None:
    session, _ = picked
    with open_session("pick_cube_scrambled", seed=3) as other:
        other.run()
        other.judge()
        assert np.array_equal(other.simulation.snapshot(), session.simulation.snapshot())


@pytest.mark.parametrize("task", ["put_in_bin", "home"])
def test_replay_comes_to_the_same_end_to_the_last_digit(task: str, tmp_path: Path) -> None:
    with open_session(task, seed=2) as session:
        episode = record(session, tmp_path)
        run = open_replay(episode)
        replayed = run.run()
        assert replayed.same and replayed.recorded is True
        assert max([0.0, *replayed.object_error_mm.values()]) < 1e-3 and replayed.joint_error == 0.0
        assert run.session.driver.time == session.driver.time
        run.session.close()


def test_replay_tells_when_the_outcome_is_another(
    picked: tuple[EmbeddedWorkcell, RecordedEpisode], tmp_path: Path
) -> None:
    _, episode = picked
    other = RecordedEpisode.load(shutil.copytree(episode.folder, tmp_path / "copy"))
    run = open_replay(other)
    # A gripper that never closes: the cube stays where it is.
    run._actions[:, -1] = run._actions[0, -1]
    replayed = run.run()
    assert not replayed.same and replayed.object_error_mm["red_cube"] > 50.0
    assert replayed.judged is not None and not replayed.judged.success
    run.session.close()


def test_pushes_from_outside_are_recorded_and_replayed(tmp_path: Path) -> None:
    with open_session("pick_cube_franka") as session:
        recorder = Recorder(tmp_path, session)
        recorder.begin("stand there")
        body = session.mujoco.object_bodies["red_cube"]
        push = np.zeros((session.mujoco.model.nbody, 6))
        push[body, 1] = 1.0
        for _ in range(30):
            session.mujoco.replay(session.mujoco.controls, push)
        for _ in range(30):
            session.mujoco.replay(session.mujoco.controls)
        folder = recorder.finish(outcome=(True, "pushed", ""))
        recorder.close()
        assert folder is not None
        replayed = Replay(RecordedEpisode.load(folder), session).run()
        assert replayed.object_error_mm["red_cube"] < 1e-3
        moved = RecordedEpisode.load(folder).object_poses
        assert moved[-1, 0, 1] - moved[0, 0, 1] > 0.01


def test_a_reset_ends_the_episode_and_discarded_ones_leave_nothing(tmp_path: Path) -> None:
    with open_session("home") as session:
        recorder = open_recorder(RecordSettings(folder=tmp_path), session)
        recorder.begin("first")
        session.driver.wait(0.1)
        session.reset(1)
        assert recorder.folder is None and recorder.last is not None
        result = RecordedEpisode.load(recorder.last).result
        assert result is not None and result.reason == "interrupted" and result.steps == 11
        recorder.begin("second")
        recorder.finish(keep=False)
        recorder.close()
        assert [path.name for path in find_episodes(tmp_path)] == ["home-seed0000"]
        begun = recorder.last
        session.driver.wait(0.1)
        assert recorder.folder is None and recorder.last == begun


def test_goals_of_a_sim_process_are_recorded_one_by_one(tmp_path: Path) -> None:
    with open_session("pick_cube_franka") as session:
        recorder = Recorder(tmp_path, session)
        recorder.follow()
        session.agent.perform(SkillCall(skill="pick", arguments={"object": "red_cube"}))
        with pytest.raises(SkillError):
            session.agent.perform(SkillCall(skill="pick", arguments={"object": "moon"}))
        recorder.close()
    first, second = (RecordedEpisode.load(path) for path in find_episodes(tmp_path))
    assert first.meta.prompt == "pick(object=red_cube)" and first.result is not None and first.result.success
    assert second.result is not None and second.result.reason == "object_not_found"
    assert "skill_failed" in [line["event"] for line in second.events()]


def test_a_call_whose_end_nobody_told_does_not_take_in_the_next_one(tmp_path: Path) -> None:
    first, second = (SkillCall(skill="pick", arguments={"object": name}) for name in ("red_cube", "moon"))
    with open_session("pick_cube_franka") as session:
        recorder = Recorder(tmp_path, session)
        recorder.on_event(SkillStarted(first))
        recorder.on_event(SkillStarted(second))
        recorder.close()
    assert [RecordedEpisode.load(path).meta.prompt for path in find_episodes(tmp_path)] == [str(first), str(second)]


def test_bench_keeps_successes_only_where_asked_to(tmp_path: Path) -> None:
    criterion = Lifted(kind="lifted", object="red_cube", min_mm=5000.0)
    too_high = find_task("pick_cube_franka").model_copy(update={"success": criterion})
    for only_success, kept in ((False, 2), (True, 0)):
        settings = BenchSettings(recording=RecordSettings(folder=tmp_path / str(kept), only_success=only_success))
        rows = list(run_bench([too_high], 2, settings=settings))
        assert [row.success for row in rows] == [False, False]
        assert len(list(find_episodes(tmp_path / str(kept)))) == kept


def test_a_killed_process_leaves_what_it_had_flushed(tmp_path: Path) -> None:
    bench = Path(__file__).resolve().parents[1] / "benchmarks" / "recording.py"
    child = subprocess.Popen([sys.executable, bench, "--child", tmp_path], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    simulated = 0.0
    while simulated < 2.5:
        line = child.stdout.readline().strip()
        simulated = float(line) if line not in ("", "begun") else simulated
    child.send_signal(signal.SIGKILL)
    told = child.stdout.read().split()
    child.wait()
    child.stdout.close()
    (path,) = find_episodes(tmp_path)
    episode = RecordedEpisode.load(path)
    assert episode.result is None
    assert float((told or [simulated])[-1]) - episode["time"][-1] < 1.2
    assert np.allclose(np.diff(episode["time"]), 0.01) and len(episode) > 50
    assert episode.events()[0]["event"] == "started"
    # The torn end of a batch in the making hides no whole one.
    whole = len(episode)
    with (path / "steps.arrows").open("ab") as stream:
        stream.write(b"\xff\xff\xff\xff\x10\x00")
    (path / "events.jsonl").open("a").write('{"event": "ph')
    again = RecordedEpisode.load(path)
    assert len(again) == whole and len(again.events()) == len(episode.events())


def test_long_episodes_go_through_the_stream_into_one_file(tmp_path: Path) -> None:
    with open_session("home") as session:
        recorder = Recorder(tmp_path, session)
        recorder.begin("wait")
        session.driver.wait(25.0)
        folder = recorder.finish()
        recorder.close()
    assert folder is not None and not (folder / "steps.arrows").exists()
    episode = RecordedEpisode.load(folder)
    assert len(episode) == 2501 and np.allclose(np.diff(episode["time"]), 0.01)
    assert episode.ragged("contact_force").offsets.shape == (2502,)


def test_plot_is_a_picture(picked: tuple[EmbeddedWorkcell, RecordedEpisode], tmp_path: Path) -> None:
    plot(picked[1], tmp_path / "plot.png")
    assert (tmp_path / "plot.png").read_bytes()[:4] == b"\x89PNG"


def command(*arguments: str) -> int:
    return run_app(app, "robo-sandbox", arguments)


def test_commands_record_list_show_and_replay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("run", "--task", "push_left", "--record", str(tmp_path), "--json") == 0
    document = json.loads(capsys.readouterr().out)
    folder = document["recorded"]
    assert command("runs", "list", str(tmp_path)) == 0
    assert capsys.readouterr().out.startswith("push_left-seed0000  success ")
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut" / "meta.json").write_text("{")
    assert command("runs", "list", str(tmp_path)) == 0
    listed = capsys.readouterr()
    assert listed.out.count("\n") == 1 and "note: left out: cut/meta.json: cannot be read" in listed.err
    assert command("runs", "show", folder) == 0
    assert "judged: success (along_mm=" in capsys.readouterr().out
    assert command("replay", folder, "--check", "--json") == 0
    replayed = json.loads(capsys.readouterr().out)
    assert replayed["same"] and replayed["object_error_mm"]["red_cube"] < 1.0


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["run", "go home", "--video", "scene"], "--video: is about what is recorded; give --record FOLDER with it"),
        (["run", "go home", "--record", "{file}"], "is a file; name a folder"),
        (
            ["run", "go home", "--record", "{folder}", "--video", "nose"],
            "camera 'nose' is not one of scene, top, wrist",
        ),
        (["run", "go home", "--record", "{folder}", "--video", "top", "--video-fps", "30"], "--video-fps: 30 does not"),
        (["replay", "{folder}"], "is no recorded episode"),
        (["runs", "list", "{folder}"], "no episode lies in"),
    ],
)
def test_wrong_use_is_told_in_a_line(
    arguments: list[str], complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    given = [item.format(file=tmp_path / "file", folder=tmp_path / "folder") for item in arguments]
    assert command(*given) == 2
    assert complaint in capsys.readouterr().err
    assert not list((tmp_path / "folder").iterdir())


def test_damaged_recordings_are_told(picked: tuple[EmbeddedWorkcell, RecordedEpisode], tmp_path: Path) -> None:
    copy = shutil.copytree(picked[1].folder, tmp_path / "copy")
    (copy / "steps.parquet").write_bytes(b"PAR1 nonsense")
    with pytest.raises(InputError, match="its steps cannot be read"):
        len(RecordedEpisode.load(copy))
    (copy / "meta.json").write_text('{"format": "robosandbox.episode", "version": 2}')
    with pytest.raises(InputError, match="version"):
        RecordedEpisode.load(copy)


@pytest.mark.gl
def test_videos_are_written_along_and_show_every_fifth_row(tmp_path: Path) -> None:
    import av

    with open_session("pick_cube_franka", render_size=(120, 160)) as session:
        settings = RecordSettings(folder=tmp_path, video=VideoSettings(cameras=("scene", "wrist"), fps=20.0))
        recorder = open_recorder(settings, session)
        recorder.begin("look")
        before = session.driver.state(("scene",)).images["scene"]
        session.driver.wait(1.0)
        folder = recorder.finish()
        recorder.close()
    assert folder is not None
    episode = RecordedEpisode.load(folder)
    for video in episode.meta.videos:
        path = episode.video(video.camera)
        assert path is not None
        with av.open(str(path)) as container:
            pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        assert len(pictures) == len(range(0, len(episode), video.every)) == 21
        assert pictures[0].shape == (video.height, video.width, 3)
        if video.camera == "scene":
            assert np.abs(pictures[0].astype(float) - before).mean() < 6.0


@pytest.mark.gl
def test_states_are_drawn_as_the_world_was(picked: tuple[EmbeddedWorkcell, RecordedEpisode]) -> None:
    from robosandbox.workcell.recording.drawing import frames, world_of

    session, episode = picked
    now = session.driver.state(("scene",)).images["scene"]
    last = list(frames(episode, world_of(episode), ("scene",), len(episode) - 1, now.shape[:2]))[-1]["scene"]
    assert np.abs(last.astype(float) - now).mean() < 0.5
