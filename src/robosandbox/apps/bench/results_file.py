"""Rows in a JSON Lines file, found again by task and seed: memory holds where they are, not what they say."""

from __future__ import annotations

import json
import tempfile
from array import array
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import IO, Self

from pydantic import TypeAdapter, ValidationError

from robosandbox.apps.bench.results import ERROR, BenchSettings, Row
from robosandbox.errors import InputError
from robosandbox.versions import versions

_ROWS = TypeAdapter(Row)
# Seeds whose offsets in the file share one array of 8 bytes each.
_PAGE = 1024
_ABSENT = -1


class ResultsFile:
    """A file that rows are appended to and read back from.

    Args:
        file: Where the rows go; open for appending and reading. Closed by `close`.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._full = False
        self._pages: dict[tuple[str, int], array[int]] = {}

    @classmethod
    def temporary(cls) -> Self:
        """Return a file that nobody else sees and that is gone when it is closed."""
        return cls(tempfile.TemporaryFile("a+b"))

    @classmethod
    def resume(cls, path: Path, settings: BenchSettings) -> Self:
        """Return a file with the rows of an earlier bench.

        A process that dies in the middle of a line leaves the lines before it; what is left of that line is cut off.
        Rows of episodes that could not be run are left out, so that they are tried again; of two rows of one episode the later counts.

        Args:
            path: Where; made if it is missing.
            settings: Those of the bench that goes on with it.

        Raises:
            InputError: It cannot be written, holds something else, or rows of other settings or versions.
        """
        try:
            rows = cls(path.open("a+b"))
            try:
                rows._index(path.name, settings)
            except BaseException:
                rows.close()
                raise
        except OSError as error:
            raise InputError(f"--resume: {str(path)!r} cannot be used: {error.strerror}") from None
        return rows

    def add(self, row: Row) -> None:
        """Append a row; it outlives the process from here on.

        Raises:
            InputError: The disk is full.
        """
        end = self._file.seek(0, 2)
        try:
            self._file.write(json.dumps(row.record()).encode() + b"\n")
            self._file.flush()
        except OSError as error:
            self._full = True
            raise InputError(
                f"the rows cannot be kept: {error.strerror}; make room where --resume says, or else in TMPDIR, and go on"
            ) from None
        self._note(row, end)

    def find(self, task: str, seed: int) -> Row | None:
        """Return the row of an episode, or None if it is not there."""
        offset = self._offset(task, seed)
        if offset == _ABSENT:
            return None
        self._file.seek(offset)
        return _ROWS.validate_json(self._file.readline())

    def holds(self, task: str, seed: int) -> bool:
        """Return whether the row of an episode is there."""
        return self._offset(task, seed) != _ABSENT

    def count(self, task: str, seeds: int) -> int:
        """Return how many rows of a task's first seeds are there."""
        pages = (range(at * _PAGE, (at + 1) * _PAGE) for name, at in self._pages if name == task)
        return sum(self.holds(task, seed) for page in pages for seed in page if seed < seeds)

    def close(self) -> None:
        """Free the file; of a row that could not be written a part may be left, which the next bench cuts off."""
        # Closing would write it once more.
        with suppress(OSError) if self._full else nullcontext():
            self._file.close()

    def _offset(self, task: str, seed: int) -> int:
        page = self._pages.get((task, seed // _PAGE))
        return _ABSENT if page is None else page[seed % _PAGE]

    def _note(self, row: Row, offset: int) -> None:
        key = (row.task, row.seed // _PAGE)
        if key not in self._pages:
            self._pages[key] = array("q", [_ABSENT]) * _PAGE
        self._pages[key][row.seed % _PAGE] = offset

    def _index(self, name: str, settings: BenchSettings) -> None:
        here = {"settings": json.loads(json.dumps(settings.record())), "versions": versions()}
        self._file.seek(0)
        offset = 0
        for number, line in enumerate(self._file, 1):
            if not line.endswith(b"\n"):
                break
            row = _read(name, number, line)
            _check(name, row, here)
            if row.reason != ERROR:
                self._note(row, offset)
            offset += len(line)
        self._file.truncate(offset)


def _read(name: str, number: int, line: bytes) -> Row:
    try:
        return _ROWS.validate_json(line)
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in problem["loc"]) or "line"
        raise InputError(
            f"--resume: {name}, line {number}: {where}: {problem['msg']}; it is no row of a bench"
        ) from None


def _check(name: str, row: Row, here: dict[str, dict[str, object]]) -> None:
    """Refuse a row whose outcome may differ from what this bench would find."""
    for part, ours in here.items():
        theirs = getattr(row, part)
        for key in ours:
            if theirs.get(key) != ours[key]:
                raise InputError(
                    f"--resume: {name}: {row.task}, seed {row.seed}: {key} was {theirs.get(key)!r} "
                    f"and is {ours[key]!r}; use the same, or another file"
                )
