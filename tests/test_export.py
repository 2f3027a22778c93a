"""Exports: LeRobot's layout field by field, MCAP by the format's own reader."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from jsonschema import Draft202012Validator
from mcap.decoder import DecoderFactory as AnyDecoderFactory
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.apps.export.foxglove import STATE_SCHEMA
from robosandbox.apps.export.lerobot import export_lerobot
from robosandbox.apps.export.stats import PictureStats, of_values
from robosandbox.types import Array
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.recorder import Recorder
from robosandbox.workcell.session import open_session

FPS = 20
EVERY = 5


@pytest.fixture(scope="module")
def episodes(tmp_path_factory: pytest.TempPathFactory) -> list[RecordedEpisode]:
    folder = tmp_path_factory.mktemp("episodes")
    found = []
    with open_session("pick_cube_franka") as session:
        recorder = Recorder(folder, session)
        recorder.follow()
        for seed, prompt in ((1, None), (2, "push the red cube 10 cm to the left")):
            session.reset(seed)
            session.run(prompt)
            verdict = session.judge()
            path = recorder.finish(judged=verdict)
            assert path is not None
            found.append(RecordedEpisode.load(path))
        recorder.close()
    return found


@pytest.fixture(scope="module")
def dataset(episodes: list[RecordedEpisode], tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("dataset") / "picks"
    export_lerobot(episodes, root, fps=FPS, cameras=(), size=(120, 160))
    return root


def load(path: Path) -> Any:
    return json.loads(path.read_text())


def test_info_says_what_the_tables_hold(dataset: Path, episodes: list[RecordedEpisode]) -> None:
    info = load(dataset / "meta/info.json")
    table = pq.read_table(dataset / info["data_path"].format(chunk_index=0, file_index=0))
    lengths = [(item.result.ended if item.result else 0) // EVERY for item in episodes]
    assert (info["codebase_version"], info["fps"], info["robot_type"]) == ("v3.0", FPS, "panda")
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, sum(lengths), 2)
    assert info["splits"] == {"train": "0:2"} and info["video_path"] is None
    assert len(table) == sum(lengths) and set(info["features"]) == set(table.column_names)
    for name, feature in info["features"].items():
        kind = table.schema.field(name).type
        if feature["shape"] == [1]:
            assert {"float": "float32", "bool": "bool"}.get(str(kind), str(kind)) == feature["dtype"]
        else:
            assert kind.list_size == feature["shape"][0] == len(feature["names"]) and feature["dtype"] == "float32"
    assert "home" in [skill["name"] for skill in info["robosandbox"]["skills"]]
    assert all("properties" in skill["arguments"] for skill in info["robosandbox"]["skills"])


def test_frames_hold_the_recorded_state_and_the_command_until_the_next(
    dataset: Path, episodes: list[RecordedEpisode]
) -> None:
    table = pq.read_table(dataset / "data/chunk-000/file-000.parquet")
    state = np.array(table["observation.state"].to_pylist())
    action = np.array(table["action"].to_pylist())
    begin = 0
    for number, episode in enumerate(episodes):
        assert episode.result is not None
        count = episode.result.ended // EVERY
        rows = slice(begin, begin + count)
        at = np.arange(count) * EVERY
        assert np.allclose(state[rows, :7], episode["q"][at], atol=1e-6)
        assert np.allclose(state[rows, 7], episode["gripper"][at, 2], atol=1e-6)
        assert np.allclose(action[rows, :7], episode["action_q"][at + EVERY], atol=1e-6)
        assert np.allclose(action[rows, 7], episode["action_gripper"][at + EVERY], atol=1e-6)
        assert table["episode_index"].to_pylist()[rows] == [number] * count
        assert table["frame_index"].to_pylist()[rows] == list(range(count))
        assert np.allclose(table["timestamp"].to_numpy()[rows], np.arange(count) / FPS)
        assert table["next.done"].to_pylist()[rows] == [False] * (count - 1) + [True]
        begin += count
    assert table["index"].to_pylist() == list(range(begin))
    assert np.abs(state - action).max() > 0.05
    # The first was asked for what its task wants, the second pushed: only one is a success of the task.
    assert [value for value in table["next.success"].to_pylist() if value] == [True]


def test_episodes_table_leads_to_the_rows(dataset: Path, episodes: list[RecordedEpisode]) -> None:
    rows = pq.read_table(dataset / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    table = pq.read_table(dataset / "data/chunk-000/file-000.parquet")
    for number, (row, episode) in enumerate(zip(rows, episodes, strict=True)):
        assert row["episode_index"] == number and row["tasks"] == [episode.meta.prompt]
        assert row["dataset_to_index"] - row["dataset_from_index"] == row["length"]
        inside = table.slice(row["dataset_from_index"], row["length"])
        assert set(inside["episode_index"].to_pylist()) == {number}
        assert (row["data/chunk_index"], row["data/file_index"]) == (0, 0)
        assert np.allclose(row["stats/action/mean"], np.array(inside["action"].to_pylist()).mean(axis=0), atol=1e-6)
        assert row["stats/action/count"] == [row["length"]]


def test_tasks_are_found_by_number_and_by_text(dataset: Path) -> None:
    for name, number in (("task", "task_index"), ("subtask", "subtask_index")):
        table = pq.read_table(dataset / f"meta/{name}s.parquet")
        assert table[number].to_pylist() == list(range(len(table)))
        assert json.loads(table.schema.metadata[b"pandas"])["index_columns"] == [name]
    assert table["subtask"].to_pylist()[1] == "pick: approach"


def test_stats_are_those_of_all_frames(dataset: Path) -> None:
    stats = load(dataset / "meta/stats.json")
    table = pq.read_table(dataset / "data/chunk-000/file-000.parquet")
    assert set(stats) == set(table.column_names)
    values = np.array(table["observation.state"].to_pylist())
    for name, expected in (
        ("min", values.min(axis=0)),
        ("max", values.max(axis=0)),
        ("mean", values.mean(axis=0)),
        ("std", values.std(axis=0)),
        ("q50", np.median(values, axis=0)),
    ):
        assert np.allclose(stats["observation.state"][name], expected, atol=1e-6)
    assert stats["observation.state"]["count"] == [len(table)] == stats["timestamp"]["count"]
    assert np.shape(stats["timestamp"]["mean"]) == (1,)


def test_picture_stats_are_exact() -> None:
    pictures = np.random.default_rng(0).integers(0, 256, (4, 6, 8, 3), dtype=np.uint8)
    counted = PictureStats()
    for picture in pictures:
        counted.add(picture)
    stats = counted.stats()
    flat = pictures.reshape(-1, 3) / 255.0
    assert np.shape(stats["mean"]) == (3, 1, 1) and stats["count"] == [4]
    for name in ("min", "max", "mean", "std"):
        assert np.allclose(np.ravel(stats[name]), of_values(flat)[name])
    assert np.allclose(np.ravel(stats["q90"]), np.quantile(flat, 0.9, axis=0), atol=1.0 / 255.0)


@pytest.mark.gl
def test_films_have_a_frame_per_row_of_the_table(episodes: list[RecordedEpisode], tmp_path: Path) -> None:
    import av

    root = tmp_path / "filmed"
    export_lerobot(episodes[:1] * 2, root, fps=FPS, cameras=("top",), size=(120, 160))
    info = load(root / "meta/info.json")
    film = root / info["video_path"].format(video_key="observation.images.top", chunk_index=0, file_index=0)
    with av.open(str(film)) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == info["total_frames"] and frames[0].shape == (120, 160, 3)
    first, second = pq.read_table(root / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    key = "videos/observation.images.top"
    assert second[f"{key}/from_timestamp"] == first[f"{key}/to_timestamp"] == first["length"] / FPS
    again = frames[round(second[f"{key}/from_timestamp"] * FPS)]
    assert np.abs(again.astype(float) - frames[0]).mean() < 3.0
    mean = np.ravel(load(root / "meta/stats.json")["observation.images.top"]["mean"])
    assert np.allclose(mean, np.mean(frames, axis=(0, 1, 2)) / 255.0, atol=0.02)
    assert info["features"]["observation.images.top"]["shape"] == [120, 160, 3]


class JsonDecoderFactory(AnyDecoderFactory):
    def decoder_for(self, message_encoding: str, schema: Any) -> Any:
        return json.loads if message_encoding == "json" else None


def exported(episode: RecordedEpisode, target: Path, *options: str) -> dict[str, list[Any]]:
    """Export an episode as MCAP and return the decoded messages by topic, as an independent reader has them."""
    assert run_app(app, "robo-sandbox", ["export", "mcap", str(episode.folder), str(target), *options]) == 0
    found: dict[str, list[Any]] = {}
    with target.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory(), JsonDecoderFactory()])
        for schema, channel, message, content in reader.iter_decoded_messages():
            assert schema is not None and message.log_time == message.publish_time
            assert message.sequence == len(found.setdefault(channel.topic, []))
            found[channel.topic].append(content)
    return found


def matrix(translation: Any, rotation: Any) -> Array:
    """Return a transform (4, 4)."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_quat([rotation.x, rotation.y, rotation.z, rotation.w]).as_matrix()
    found[:3, 3] = translation.x, translation.y, translation.z
    return found


def in_world(transforms: Any, name: str) -> Array:
    """Return a frame's transform into the world, composed along its parents, (4, 4)."""
    by_child = {item.child_frame_id: item for item in transforms}
    found = np.eye(4)
    while name != "world":
        item = by_child[name]
        found, name = matrix(item.translation, item.rotation) @ found, item.parent_frame_id
    return found


def recorded(pose: Array) -> Array:
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]
    return found


@pytest.fixture(scope="module")
def log(episodes: list[RecordedEpisode], tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    return exported(episodes[0], tmp_path_factory.mktemp("mcap") / "pick.mcap")


def test_mcap_holds_every_row_and_event(log: dict[str, list[Any]], episodes: list[RecordedEpisode]) -> None:
    for topic in ("/tf", "/joint_states", "/tcp", "/state"):
        assert len(log[topic]) == len(episodes[0])
    assert len(log["/scene"]) == 1 and len(log["/log"]) == len(episodes[0].events())
    states = [Draft202012Validator(STATE_SCHEMA).is_valid(item) for item in log["/state"]]
    assert all(states) and {item["skill"] for item in log["/state"]} == set(episodes[0]["skill"])


def test_mcap_carries_the_arm_link_by_link(log: dict[str, list[Any]], episodes: list[RecordedEpisode]) -> None:
    # The tool centre point rides on the hand at the sidecar's offset; the links are composed from world to hand.
    offset = [*episodes[0].meta.robot.sidecar["ee_site"]["inject"]["xyz"], 1.0]
    turns = []
    for row in range(0, len(episodes[0]), 40):
        hand, tcp = in_world(log["/tf"][row].transforms, "hand"), recorded(episodes[0]["tcp_pose"][row])
        assert np.allclose(hand @ offset, tcp[:, 3], atol=1e-6)
        assert np.allclose(in_world(log["/tf"][row].transforms, "tcp"), tcp, atol=1e-9)
        turns.append(hand[:3, :3].T @ tcp[:3, :3])
    assert np.ptp(turns, axis=0).max() < 1e-6
    parents = {item.child_frame_id: item.parent_frame_id for item in log["/tf"][0].transforms}
    assert [parents[f"link{number}"] for number in range(8)] == ["world", *(f"link{number}" for number in range(7))]
    moved = in_world(log["/tf"][0].transforms, "link4") - in_world(log["/tf"][-1].transforms, "link4")
    assert np.abs(moved).max() > 0.01


def test_mcap_frames_of_objects_are_their_recorded_poses(
    log: dict[str, list[Any]], episodes: list[RecordedEpisode]
) -> None:
    poses = episodes[0].object_poses
    for row in range(0, len(episodes[0]), 40):
        for index, name in enumerate(episodes[0].meta.objects):
            there = in_world(log["/tf"][row].transforms, name)
            assert np.allclose(there, recorded(poses[row, index]), atol=1e-6)


def test_mcap_joint_states_are_the_recorded_ones(log: dict[str, list[Any]], episodes: list[RecordedEpisode]) -> None:
    count = len(episodes[0].meta.robot.joints)
    for row in range(0, len(episodes[0]), 40):
        arm = log["/joint_states"][row].joints[:count]
        assert [joint.name for joint in arm] == list(episodes[0].meta.robot.joints)
        assert np.allclose([joint.position for joint in arm], episodes[0]["q"][row])
        assert np.allclose([joint.velocity for joint in arm], episodes[0]["qd"][row])
    (finger,) = log["/joint_states"][-1].joints[count:]
    assert finger.name == "finger_joint1" and finger.position == pytest.approx(episodes[0]["gripper"][-1, 0])


def test_mcap_draws_arm_bins_and_drawers_as_bodies_in_their_frames(tmp_path: Path) -> None:
    with open_session("put_in_drawer") as session:
        recorder = Recorder(tmp_path, session)
        recorder.follow()
        session.run("open the drawer")
        folder = recorder.finish(judged=None)
        recorder.close()
    assert folder is not None
    episode = RecordedEpisode.load(folder)
    found = exported(episode, tmp_path / "drawer.mcap")
    bodies = {entity.id: entity for entity in found["/scene"][0].entities}
    frames = {item.child_frame_id for item in found["/tf"][0].transforms}
    assert {"link0", "hand", "left_finger", "table", "drawer", "drawer/box", "red_cube", "can"} <= set(bodies) & frames
    assert all(entity.frame_locked and entity.frame_id == entity.id for entity in bodies.values())
    assert len(bodies["drawer"].cubes) >= 4 and len(bodies["drawer/box"].cubes) >= 5
    assert bodies["can"].cylinders and bodies["drawer"].metadata[0].value == "drawer"
    (cube,) = bodies["red_cube"].cubes
    assert (cube.size.x, cube.size.y, cube.size.z) == pytest.approx((0.03, 0.03, 0.03))
    # The box of the drawer comes out by what the sentence asked for, and its frame with it.
    first, last = (in_world(found["/tf"][row].transforms, "drawer/box") for row in (0, -1))
    carcass = in_world(found["/tf"][-1].transforms, "drawer") - in_world(found["/tf"][0].transforms, "drawer")
    assert np.linalg.norm((last - first)[:3, 3]) > 0.05 and np.abs(carcass).max() < 0.01


@pytest.mark.gl
def test_mcap_carries_pictures_with_the_cameras_calibration(episodes: list[RecordedEpisode], tmp_path: Path) -> None:
    import cv2

    found = exported(episodes[0], tmp_path / "pick.mcap", "--cameras", "scene,wrist", "--fps", "5")
    pictures = found["/camera/scene/image"]
    assert len(pictures) == len(range(0, len(episodes[0]), 20)) == len(found["/camera/wrist/calibration"])
    picture = cv2.imdecode(np.frombuffer(pictures[0].data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None and picture.shape == (240, 320, 3) and picture.std() > 10.0
    # The cube's middle, through frames and calibration, falls on red pixels.
    lens = found["/camera/scene/calibration"][0]
    camera = in_world(found["/tf"][0].transforms, lens.frame_id)
    seen = np.linalg.inv(camera) @ np.array([*episodes[0].object_poses[0, 0, :3], 1.0])
    column, row, depth = np.reshape(lens.K, (3, 3)) @ seen[:3]
    blue, green, red = picture[round(row / depth), round(column / depth)].astype(int)
    assert depth > 0.2 and red > 80 and red > 2 * max(green, blue)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["lerobot", "{one}"], "name at least one episode and the target"),
        (["lerobot", "{one}", "{there}"], "exists already"),
        (["lerobot", "{one}", "{new}", "--fps", "30"], "--fps: 30 does not divide the control rate of 100 Hz"),
        (["lerobot", "{there}", "{new}"], "no episode to export"),
        (["mcap", "{one}", "{other}", "{new}.mcap"], "is one file for 2 episodes; name a folder"),
        (["mcap", "{one}", "{new}.mcap", "--size", "333x2"], "--size"),
    ],
)
def test_wrong_use_is_told_and_leaves_nothing(
    arguments: list[str],
    complaint: str,
    episodes: list[RecordedEpisode],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "there").mkdir()
    names = {"one": episodes[0].folder, "other": episodes[1].folder, "there": tmp_path / "there"}
    given = [item.format(**names, new=tmp_path / "new") for item in arguments]
    assert run_app(app, "robo-sandbox", ["export", *given]) == 2
    assert complaint in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["there"]


def test_lerobot_ends_with_a_sum_and_the_target_is_all_of_stdout(
    episodes: list[RecordedEpisode], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "picks"
    assert (
        run_app(app, "robo-sandbox", ["export", "lerobot", *(str(item.folder) for item in episodes), str(target)]) == 0
    )
    said = capsys.readouterr()
    frames = load(target / "meta/info.json")["total_frames"]
    assert re.fullmatch(rf"exported 2 episodes, {frames} frames, \d+\.\d MB, to {target}", said.err.splitlines()[-1])
    assert said.out == f"{target}\n"


def test_robots_are_not_mixed(episodes: list[RecordedEpisode], tmp_path: Path) -> None:
    robot = episodes[1].meta.robot.model_copy(update={"name": "other"})
    other = RecordedEpisode(
        episodes[1].folder, episodes[1].meta.model_copy(update={"arms": {"arm": robot}}), episodes[1].result
    )
    with pytest.raises(Exception, match="a dataset is of one robot"):
        export_lerobot([episodes[0], other], tmp_path / "mixed", fps=FPS, cameras=(), size=(120, 160))
    assert not list(tmp_path.iterdir())
