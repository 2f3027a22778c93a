"""Report of a bench while its rows come: a line each, a JSON document, the summary."""

from __future__ import annotations

import json
import os
import stat
import sys
from io import FileIO
from typing import TYPE_CHECKING

from robosandbox.errors import InputError

if TYPE_CHECKING:
    from robosandbox.apps.bench.bench import Row, Tally

RULE = "-" * 72
TASK_WIDTH = 18  # Characters of the column of tasks at the least. Chosen.


def header(width: int = TASK_WIDTH) -> str:
    """Return the table's first line."""
    return f"{'TASK':<{width}} {'SEED':<5} {'RESULT':<6} {'SECS':>6} {'REPLANS':>8} DETAIL"


def line(row: Row, width: int = TASK_WIDTH) -> str:
    """Return an episode's line."""
    detail = ", ".join(
        f"{key}={value:.3f}" if isinstance(value, float) else f"{key}={value}" for key, value in row.detail.items()
    )
    if row.claimed and not row.success:
        detail += ", claimed=true"
    return f"{row.task:<{width}} {row.seed:<5} {row.result:<6} {row.secs:>6.1f} {row.replans:>8} {detail}"


def summary(tally: Tally) -> list[str]:
    """Return the last lines: the count, and with several seeds each task's rate."""
    count = f"SUMMARY: {tally.successes}/{tally.episodes} successful"
    lines = [f"{count}, {tally.errors} not run" if tally.errors else count]
    found = [rate for rate in tally.rates() if rate.episodes > 1]
    width = max((len(rate.task) for rate in found), default=0)
    for rate in found:
        percent = 100.0 * rate.successes / rate.episodes
        lines.append(
            f"  {rate.task:<{width}}  {rate.successes}/{rate.episodes}  {percent:.1f}%  "
            f"95% Beta interval {100.0 * rate.low:.1f}..{100.0 * rate.high:.1f}%"
        )
    return lines


class RowArray:
    """Writes rows as one JSON array, each as it comes.

    A file is a whole array after each row: the next one is written over the closing bracket. Whatever cannot be gone back
    in, as a pipe, gets its bracket at the end, also where the bench is broken off.

    Args:
        file: Where to, unbuffered; stdout if it is None.
    """

    def __init__(self, file: FileIO | None = None) -> None:
        self._file = file
        self._goes_back = file is not None and stat.S_ISREG(os.fstat(file.fileno()).st_mode)
        # Bytes up to the end of the last whole row.
        self._end = 0

    def add(self, row: Row) -> None:
        """Write a row.

        Raises:
            InputError: The disk is full, or the file cannot be written any more.
        """
        # The text of an array of one, less its brackets.
        text = (("[\n", ",\n")[self._end > 0] + json.dumps([row.record()], indent=1)[2:-2]).encode()
        self._write(text, closed=self._goes_back)
        self._end += len(text)

    def close(self) -> None:
        """Write the closing bracket; nothing where there was no row."""
        if self._end:
            self._write(b"", closed=True)
        if self._file is not None:
            self._file.close()

    def _write(self, data: bytes, *, closed: bool) -> None:
        """Write behind the last whole row; what cannot be written whole is taken back."""
        data += b"\n]\n" if closed else b""
        try:
            if self._file is None:
                sys.stdout.write(data.decode())
                sys.stdout.flush()
                return
            if self._goes_back:
                self._file.seek(self._end)
            while data:
                data = data[self._file.write(data) :]
            if self._goes_back:
                self._file.truncate()
        except BrokenPipeError:
            # A reader that has gone is for the caller to hear of.
            raise
        except OSError as error:
            name = "stdout" if self._file is None else repr(self._file.name)
            if self._goes_back:
                self._take_back()
            raise InputError(
                f"--json: {name} cannot be written: {error.strerror}; make room, or name another"
            ) from None

    def _take_back(self) -> None:
        assert self._file is not None
        self._file.seek(self._end)
        self._file.truncate()
        if self._end:
            # Where the bracket was before.
            self._file.write(b"\n]\n")


def open_rows(target: str) -> RowArray:
    """Return the array for a file, or for stdout under "-".

    Raises:
        InputError: The file cannot be written.
    """
    if target == "-":
        return RowArray()
    try:
        return RowArray(FileIO(target, "w"))
    except OSError as error:
        raise InputError(f"--json: {target!r} cannot be written: {error.strerror}") from None
