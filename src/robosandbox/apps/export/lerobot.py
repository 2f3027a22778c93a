"""LeRobotDataset, version 3.0: Parquet tables, MP4 films and JSON under `data/`, `videos/` and `meta/`.

The layout is that of https://huggingface.co/docs/lerobot/lerobot-dataset-v3: many episodes in a file, and
`meta/episodes` telling where in the files each one lies.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from robosandbox.apps.export.lerobot_files import (
    CHUNK_FILES,
    DATA_MB,
    DATA_PATH,
    EPISODES_PATH,
    VIDEO_MB,
    VIDEO_PATH,
    FileRoll,
    write_index,
    write_json,
)
from robosandbox.apps.export.pictures import pictures
from robosandbox.apps.export.stats import PictureStats, Stats, of_values
from robosandbox.errors import InputError
from robosandbox.sim.step_recorder import column_of
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.files import Meta
from robosandbox.workcell.recording.settings import rows_per_frame
from robosandbox.workcell.recording.video import Film

CODEBASE_VERSION = "v3.0"
_INDICES = ("timestamp", "frame_index", "episode_index", "index", "task_index", "subtask_index")


class LeRobotExport:
    """Writes episodes of one robot as a dataset.

    Args:
        target: The dataset's folder; it must not exist.
        fps: Frames per simulated second.
        cameras: Whose pictures go in.
        size: (height, width) of the pictures, pixels; both even.
        with_objects: Whether poses of the objects go in; all episodes must have the same ones.

    Raises:
        InputError: The folder exists.
    """

    def __init__(
        self, target: Path, *, fps: int, cameras: Sequence[str], size: tuple[int, int], with_objects: bool
    ) -> None:
        if target.exists():
            raise InputError(f"{str(target)!r} exists already; name another folder, or remove it")
        self._target = target
        # What is cut short must not look like a dataset.
        self._root = target.with_name(f".{target.name}.unfinished")
        shutil.rmtree(self._root, ignore_errors=True)
        self._fps = fps
        self._cameras = {f"observation.images.{camera}": camera for camera in cameras}
        self._size = size
        self._with_objects = with_objects
        self._tasks: dict[str, int] = {}
        self._subtasks: dict[str, int] = {"": 0}
        self._episodes: list[dict[str, Any]] = []
        self._values: dict[str, list[NDArray[Any]]] = {}
        self._picture_stats = {key: PictureStats() for key in self._cameras}
        self._data = FileRoll(self._root, DATA_PATH, DATA_MB)
        self._table: pq.ParquetWriter | None = None
        self._videos = {
            key: FileRoll(self._root, VIDEO_PATH.replace("{video_key}", key), VIDEO_MB) for key in self._cameras
        }
        self._films: dict[str, Film] = {}
        self._first: RecordedEpisode | None = None
        self._frames = 0

    def add(self, episode: RecordedEpisode) -> int:
        """Append an episode; return its number of frames.

        Raises:
            InputError: It is of another robot than those before, too short, or at another control rate than fits.
        """
        self._check(episode)
        every = rows_per_frame(self._fps, episode.meta.control_timestep, "--fps")
        last = episode.result.ended if episode.result else len(episode) - 1
        count = last // every
        if count < 1:
            raise InputError(f"{episode.name}: is shorter than a frame; leave it out")
        columns = self._columns(episode, every, count)
        index = len(self._episodes)
        record: dict[str, Any] = {"episode_index": index, "tasks": [episode.meta.prompt], "length": count}
        record |= self._write_data(columns, count)
        stats = {key: of_values(values.reshape(count, -1)) for key, values in columns.items()}
        record |= self._write_videos(episode, every, count, stats)
        for key, values in columns.items():
            self._values.setdefault(key, []).append(values)
        record |= {f"stats/{key}/{name}": value for key, found in stats.items() for name, value in found.items()}
        self._episodes.append(record)
        self._frames += count
        return count

    def finish(self) -> None:
        """Write what describes the whole, and put the dataset in its place.

        Raises:
            InputError: No episode was added.
        """
        if self._first is None:
            raise InputError("no episode to export; name folders that `runs list` shows")
        if self._table is not None:
            self._table.close()
        for film in self._films.values():
            film.close()
        stats = {key: of_values(np.concatenate(rows).reshape(self._frames, -1)) for key, rows in self._values.items()}
        stats |= {key: found.stats() for key, found in self._picture_stats.items()}
        write_json(self._root / "meta/stats.json", stats)
        write_json(self._root / "meta/info.json", self._info(self._first))
        write_index(self._root / "meta/tasks.parquet", "task_index", "task", self._tasks)
        write_index(self._root / "meta/subtasks.parquet", "subtask_index", "subtask", self._subtasks)
        for record in self._episodes:
            record |= {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        path = self._root / EPISODES_PATH.format(chunk_index=0, file_index=0)
        path.parent.mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist(self._episodes), path)
        self._root.replace(self._target)

    def abandon(self) -> None:
        """Remove what was written."""
        shutil.rmtree(self._root, ignore_errors=True)

    def _check(self, episode: RecordedEpisode) -> None:
        if self._first is None:
            self._first = episode
        first, meta = self._first.meta, episode.meta
        if any(column_of(arm, "action_q") not in episode for arm in meta.arms):
            raise InputError(
                f"{episode.name}: has no commands, because its driver tells none, and a dataset is of states and actions"
            )
        if _joints(meta) != _joints(first):
            raise InputError(
                f"{episode.name}: is of {meta.robot_name}, the first episode of {first.robot_name}; a dataset is of one robot"
            )

    def _columns(self, episode: RecordedEpisode, every: int, count: int) -> dict[str, NDArray[Any]]:
        """Return what goes into the table: the state at each frame, and what was commanded until the next."""
        at = np.arange(count) * every
        then = at + every
        state, action = list[NDArray[Any]](), list[NDArray[Any]]()
        for arm in episode.meta.arms:
            state.append(episode[column_of(arm, "q")][at])
            action.append(episode[column_of(arm, "action_q")][then])
            if column_of(arm, "gripper") in episode:
                state.append(episode[column_of(arm, "gripper")][at, 2:3])
                action.append(episode[column_of(arm, "action_gripper")][then, None])
        tcps = [episode[column_of(arm, "tcp_pose")][at] for arm in episode.meta.arms]
        skills, phases = episode["skill"][then], episode["phase"][then]
        names = [f"{skill}: {phase}" if phase else str(skill) for skill, phase in zip(skills, phases, strict=True)]
        judged = episode.result is not None and episode.result.judged is not None and episode.result.judged.success
        done = np.arange(count) == count - 1
        task = self._tasks.setdefault(episode.meta.prompt, len(self._tasks))
        found: dict[str, NDArray[Any]] = {
            "observation.state": np.concatenate(state, axis=1).astype(np.float32),
            "observation.tcp_pose": np.concatenate(tcps, axis=1).astype(np.float32),
            "action": np.concatenate(action, axis=1).astype(np.float32),
            "next.reward": (done & judged).astype(np.float32),
            "next.done": done,
            "next.success": done & judged,
            "timestamp": (np.arange(count) / self._fps).astype(np.float32),
            "frame_index": np.arange(count),
            "episode_index": np.full(count, len(self._episodes)),
            "index": self._frames + np.arange(count),
            "task_index": np.full(count, task),
            "subtask_index": np.array([self._subtasks.setdefault(name, len(self._subtasks)) for name in names]),
        }
        if self._with_objects:
            found["observation.environment_state"] = episode["objects"][at].astype(np.float32)
        return found

    def _write_data(self, columns: dict[str, NDArray[Any]], count: int) -> dict[str, Any]:
        arrays = [
            pa.FixedSizeListArray.from_arrays(pa.array(values.reshape(-1)), values.shape[1])
            if values.ndim == 2
            else pa.array(values)
            for values in columns.values()
        ]
        table = pa.Table.from_arrays(arrays, names=list(columns))
        if self._table is None or self._data.full:
            if self._table is not None:
                self._table.close()
            self._table = pq.ParquetWriter(self._data.next(), table.schema, compression="snappy")
        self._table.write_table(table)
        return {
            "data/chunk_index": self._data.chunk,
            "data/file_index": self._data.file,
            "dataset_from_index": self._frames,
            "dataset_to_index": self._frames + count,
        }

    def _write_videos(
        self, episode: RecordedEpisode, every: int, count: int, stats: dict[str, Stats]
    ) -> dict[str, Any]:
        if not self._cameras:
            return {}
        found: dict[str, Any] = {}
        own = {key: PictureStats() for key in self._cameras}
        for key, roll in self._videos.items():
            if key not in self._films or roll.full:
                if key in self._films:
                    self._films[key].close()
                self._films[key] = Film(roll.next(), float(self._fps), self._size)
            begin = self._films[key].frames
            found |= {
                f"videos/{key}/chunk_index": roll.chunk,
                f"videos/{key}/file_index": roll.file,
                f"videos/{key}/from_timestamp": begin / self._fps,
                f"videos/{key}/to_timestamp": (begin + count) / self._fps,
            }
        seen = pictures(episode, tuple(self._cameras.values()), every, self._size)
        for number, shown in enumerate(seen):
            if number == count:
                break
            for key, camera in self._cameras.items():
                self._films[key].add(shown[camera])
                own[key].add(shown[camera])
        for key, counted in own.items():
            if counted.count != count:
                raise InputError(f"{episode.name}: its film of {self._cameras[key]} is cut short; leave --cameras out")
            stats[key] = counted.stats()
            self._picture_stats[key].merge(counted)
        return found

    def _info(self, episode: RecordedEpisode) -> dict[str, Any]:
        return {
            "codebase_version": CODEBASE_VERSION,
            "robot_type": episode.meta.robot_name,
            "total_episodes": len(self._episodes),
            "total_frames": self._frames,
            "total_tasks": len(self._tasks),
            "chunks_size": CHUNK_FILES,
            "data_files_size_in_mb": DATA_MB,
            "video_files_size_in_mb": VIDEO_MB,
            "fps": self._fps,
            "splits": {"train": f"0:{len(self._episodes)}"},
            "data_path": DATA_PATH,
            "video_path": VIDEO_PATH if self._cameras else None,
            "features": self._features(episode),
            "robosandbox": {"skills": list(episode.meta.skills), "versions": episode.meta.versions},
        }

    def _features(self, episode: RecordedEpisode) -> dict[str, Any]:
        joints = list[str]()
        for arm, robot in episode.meta.arms.items():
            joints += [f"{column_of(arm, name)}.pos" for name in robot.joints]
            # 0 is open, 1 closed.
            joints += [column_of(arm, "gripper.closed")] if column_of(arm, "gripper") in episode else []
        pose = ["x", "y", "z", "qx", "qy", "qz", "qw"]
        names = {
            "observation.state": joints,
            "action": joints,
            "observation.tcp_pose": [column_of(arm, part) for arm in episode.meta.arms for part in pose],
            "observation.environment_state": [f"{name}.{part}" for name in episode.meta.objects for part in pose],
        }
        features: dict[str, Any] = {}
        for key, rows in self._values.items():
            shape = list(rows[0].shape[1:]) or [1]
            features[key] = {"dtype": str(rows[0].dtype), "shape": shape, "names": names.get(key)}
        height, width = self._size
        for key in self._cameras:
            video = {
                "video.height": height,
                "video.width": width,
                "video.codec": "h264",
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": self._fps,
                "video.channels": 3,
                "has_audio": False,
            }
            shape = [height, width, 3]
            names_of = ["height", "width", "channels"]
            features[key] = {"dtype": "video", "shape": shape, "names": names_of, "info": video}
        # The indices last, as readers list them.
        return {key: features[key] for key in sorted(features, key=lambda key: key in _INDICES)}


def _joints(meta: Meta) -> list[tuple[str, str, tuple[str, ...]]]:
    """Return the name of each arm, its robot's, and its joints."""
    return [(arm, robot.name, robot.joints) for arm, robot in meta.arms.items()]


def export_lerobot(
    episodes: Sequence[RecordedEpisode],
    target: Path,
    *,
    fps: int,
    cameras: Sequence[str],
    size: tuple[int, int],
    on_done: Callable[[RecordedEpisode, int], None] | None = None,
) -> None:
    """Write episodes as a LeRobotDataset.

    Args:
        episodes: Of one robot.
        target: The dataset's folder; it must not exist.
        fps: Frames per simulated second.
        cameras: Whose pictures go in.
        size: (height, width) of the pictures, pixels.
        on_done: Told of each episode and its number of frames.

    Raises:
        InputError: The folder exists, or an episode does not fit with the others.
    """
    # A column has one width: where scenes differ, the objects are left to the pictures.
    scenes = {episode.meta.objects for episode in episodes}
    with_objects = len(scenes) == 1 and scenes != {()}
    export = LeRobotExport(target, fps=fps, cameras=cameras, size=size, with_objects=with_objects)
    try:
        for episode in episodes:
            count = export.add(episode)
            if on_done is not None:
                on_done(episode, count)
        export.finish()
    except BaseException:
        export.abandon()
        raise
