"""What a bench prints and writes as its rows come: a line each, a JSON document, the summary."""

from __future__ import annotations

import json
import sys
from typing import IO, TYPE_CHECKING

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
    """Writes rows as one JSON array, each as it comes; the array is whole also where the bench is broken off.

    Args:
        file: Where to, stdout if it is None.
    """

    def __init__(self, file: IO[str] | None = None) -> None:
        self._file = file
        self._rows = 0

    def add(self, row: Row) -> None:
        """Write a row."""
        # The text of an array of one, less its brackets.
        self._write(("[\n", ",\n")[self._rows > 0] + json.dumps([row.record()], indent=1)[2:-2])
        self._rows += 1

    def close(self) -> None:
        """Write the closing bracket; nothing where there was no row."""
        if self._rows:
            self._write("\n]\n")
        if self._file is not None:
            self._file.close()

    def _write(self, text: str) -> None:
        # A reader of stdout that has gone is for the caller to hear of; a full disk is about the option.
        if self._file is None:
            sys.stdout.write(text)
            return
        try:
            self._file.write(text)
        except OSError as error:
            raise InputError(f"--json: {self._file.name!r} cannot be written: {error.strerror}") from None


def open_rows(target: str) -> RowArray:
    """Return the array for a file, or for stdout under "-".

    Raises:
        InputError: The file cannot be written.
    """
    if target == "-":
        return RowArray()
    try:
        return RowArray(open(target, "w", encoding="utf-8"))
    except OSError as error:
        raise InputError(f"--json: {target!r} cannot be written: {error.strerror}") from None
