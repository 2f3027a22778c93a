"""An episode's folder, read back."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa

from robosandbox.errors import InputError
from robosandbox.sim.step_recorder import Ragged, column_of
from robosandbox.types import Array
from robosandbox.validation import validate
from robosandbox.workcell.recording.columns import to_numpy, to_ragged
from robosandbox.workcell.recording.files import EVENTS, META, RESULT, VIDEOS, Meta, Result, find_episodes
from robosandbox.workcell.recording.writer import read_steps


@dataclass(frozen=True)
class RecordedEpisode:
    """Recording of an episode; of a process that died, what it had flushed.

    Attributes:
        folder: Where it lies.
        meta: What it is.
        result: How it ended; None where its process died or it still runs.
    """

    folder: Path
    meta: Meta
    result: Result | None

    @classmethod
    def load(cls, folder: Path | str) -> Self:
        """Read a folder; its steps are read when they are asked for.

        Raises:
            InputError: It holds no episode, or a damaged one.
        """
        folder = Path(folder)
        if not (folder / META).is_file():
            inside = ", ".join(episode.name for _, episode in zip(range(3), find_episodes(folder), strict=False))
            hint = f"; it holds the episodes {inside}" if inside else f"; an episode's folder has a {META}"
            raise InputError(f"{str(folder)!r} is no recorded episode{hint}")
        meta = validate(_json(folder / META), Meta, source=f"{folder.name}/{META}")
        result = None
        if (folder / RESULT).is_file():
            result = validate(_json(folder / RESULT), Result, source=f"{folder.name}/{RESULT}")
        return cls(folder, meta, result)

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.absolute().name

    @cached_property
    def table(self) -> pa.Table:
        """The steps as an Arrow table.

        Raises:
            InputError: Nothing was flushed before the process died, or the file is damaged.
        """
        try:
            table = read_steps(self.folder)
        except (pa.ArrowInvalid, OSError) as error:
            raise InputError(f"{self.name}: its steps cannot be read: {' '.join(str(error).split())[:200]}") from None
        if table is None or not len(table):
            raise InputError(f"{self.name}: holds no steps; its process died before the first were written")
        return table

    def __len__(self) -> int:
        return len(self.table)

    def __getitem__(self, column: str) -> Array:
        """Return a column of numbers, float64 of shape (rows,) or (rows, width), or of texts, shape (rows,).

        Raises:
            KeyError: There is no such column.
        """
        if column not in self.table.column_names:
            raise KeyError(f"{column!r} is not one of {', '.join(self.table.column_names)}")
        values = to_numpy(self.table, column)
        return values if values.dtype == object else values.astype(np.float64)

    def get(self, column: str) -> Array | None:
        """Return a column, None where there is none: an arm without a gripper has none of its columns."""
        return self[column] if column in self.table.column_names else None

    def of_arm(self, arm: str, column: str) -> Array | None:
        """Return an arm's column of numbers, None where there is none."""
        return self.get(column_of(arm, column))

    def __contains__(self, column: object) -> bool:
        return column in self.table.column_names

    def ragged(self, column: str) -> Ragged:
        """Return a column whose rows differ in length."""
        return to_ragged(self.table, column)

    @cached_property
    def seconds(self) -> Array:
        """Simulated seconds since the episode began, shape (rows,)."""
        time: Array = self["time"]
        since: Array = time - time[0]
        return since

    @cached_property
    def object_poses(self) -> Array:
        """Poses of the objects, shape (rows, objects, 7): x, y, z, quaternion x, y, z, w."""
        if not self.meta.objects:
            return np.zeros((len(self), 0, 7))
        return self["objects"].reshape(len(self), len(self.meta.objects), 7)

    def events(self) -> list[dict[str, Any]]:
        """Return the events, oldest first; a line cut short by the end of its process is left out."""
        found: list[dict[str, Any]] = []
        path = self.folder / EVENTS
        if not path.is_file():
            return found
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                found.append(json.loads(line))
            except ValueError:
                break
        return found

    def video(self, camera: str) -> Path | None:
        """Return the film of a camera that was written along; None where there is none."""
        path = self.folder / VIDEOS / f"{camera}.mp4"
        return path if path.is_file() else None

    def spans(self) -> Iterator[tuple[str, str, int, int]]:
        """Yield skill, phase, first row and row after the last of each stretch in which neither changes."""
        skills, phases = self["skill"], self["phase"]
        changes = np.flatnonzero((skills[1:] != skills[:-1]) | (phases[1:] != phases[:-1])) + 1
        edges = [0, *changes.tolist(), len(skills)]
        for begin, end in itertools.pairwise(edges):
            yield str(skills[begin]), str(phases[begin]), begin, end


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path.parent.name}/{path.name}: cannot be read: {error}") from None
