"""Rows in a JSON Lines file, a line as each episode ends, to be gone on with."""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from robosandbox.errors import InputError
from robosandbox.tasks.rows import BenchSettings, Row
from robosandbox.versions import versions

_ROWS = TypeAdapter(Row)


class RowFile:
    """A file that rows are appended to.

    A process that dies in the middle of a line leaves the lines before it; what is left of that line is cut off.

    Args:
        path: Where; made if it is missing.
        settings: Those of the bench that goes on with it.

    Attributes:
        rows: What was there.

    Raises:
        InputError: It cannot be written, holds something else, or rows of other settings or versions.
    """

    def __init__(self, path: Path, settings: BenchSettings) -> None:
        self._path = path
        try:
            held = path.read_bytes() if path.exists() else b""
            whole = held[: held.rfind(b"\n") + 1]
            self.rows = [self._read(number, line) for number, line in enumerate(whole.splitlines(), 1)]
            self._check(settings)
            self._file = path.open("ab")
            self._file.truncate(len(whole))
        except OSError as error:
            raise InputError(f"--resume: {str(path)!r} cannot be used: {error.strerror}") from None

    def add(self, row: Row) -> None:
        """Append a row; it outlives the process from here on."""
        self._file.write(json.dumps(row.record()).encode() + b"\n")
        self._file.flush()

    def close(self) -> None:
        """Free the file."""
        self._file.close()

    def _read(self, number: int, line: bytes) -> Row:
        try:
            return _ROWS.validate_json(line)
        except ValidationError as error:
            problem = error.errors(include_url=False)[0]
            where = ".".join(str(part) for part in problem["loc"]) or "line"
            raise InputError(
                f"--resume: {self._path.name}, line {number}: {where}: {problem['msg']}; it is no row of a bench"
            ) from None

    def _check(self, settings: BenchSettings) -> None:
        """Refuse rows whose outcome may differ from what this bench would find."""
        here = {"settings": json.loads(json.dumps(settings.record())), "versions": versions()}
        for row in self.rows:
            for part, ours in here.items():
                theirs = getattr(row, part)
                for name in ours:
                    if theirs.get(name) != ours[name]:
                        raise InputError(
                            f"--resume: {self._path.name}: {row.task}, seed {row.seed}: {name} was {theirs.get(name)!r} "
                            f"and is {ours[name]!r}; use the same, or another file"
                        )
