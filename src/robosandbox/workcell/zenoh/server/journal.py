"""Accepted goals on disk before they are answered: a file beside the state file that is only appended to.

A record is one line: the CRC-32 of its text, then the text, the goal with its arguments as JSON. Each is written before its
goal is answered, so that the death of the process loses none: what was written is the kernel's. It is flushed to the disk
(fdatasync) before its goal begins to move anything, many goals with one flush, so that after a power cut too no goal has
moved the robot that is not known.
"""

from __future__ import annotations

import errno
import logging
import os
import threading
import zlib
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from pydantic import Field, ValidationError

from robosandbox.errors import InputError
from robosandbox.types import StrictModel
from robosandbox.workcell.zenoh.messages import KEPT_RESULTS, MAX_REQUEST_BYTES, Count, Goal

_log = logging.getLogger(__name__)

# Bytes at which records that a saved state holds are dropped; chosen as about a thousand short goals.
COMPACT_BYTES = 256_000
# The ledger has forgotten all goals but so many.
_KEPT_RECORDS = 2 * KEPT_RESULTS
# A request with its goal in one record, and a file that has doubled since it was compacted last.
_MOST_BYTES = COMPACT_BYTES + 2 * _KEPT_RECORDS * 2 * MAX_REQUEST_BYTES
# Hexadecimal digits of a CRC-32, as of zlib.crc32.
_CRC_DIGITS = 8
# Apple's systems have no fdatasync; elsewhere it spares what only the file's times would need.
_flush_data = getattr(os, "fdatasync", os.fsync)


class KeptGoal(StrictModel):
    """A goal as it is kept across restarts.

    Attributes:
        goal: How far it was.
        arguments: As they came.
    """

    goal: Goal
    arguments: dict[str, Any] = Field(default_factory=dict)


class Acceptance(KeptGoal):
    """A record of the journal.

    Attributes:
        number: Counts the goals that the process has accepted, from 1.
    """

    number: Count


class Journal:
    """Keeps accepted goals in a file.

    Args:
        path: The file; what it holds is replaced by `start`.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: IO[bytes] | None = None
        self._size = 0
        self._limit = COMPACT_BYTES
        self._lock = threading.Condition()
        self._unsaved: OrderedDict[int, bytes] = OrderedDict()
        self._waiting: list[Callable[[], None]] = []
        self._stopping = False
        self._thread = threading.Thread(target=self._loop, name="journal", daemon=True)

    def start(self) -> None:
        """Begin a new journal; call it when a saved state holds all goals of the process before.

        Raises:
            OSError: It cannot be written.
        """
        self._rewrite()
        self._thread.start()

    def stop(self) -> None:
        """Flush what was kept, begin what waits for that, and close the file."""
        with self._lock:
            self._stopping = True
            self._lock.notify_all()
        if self._thread.is_alive():
            self._thread.join()
        if self._file is not None:
            self._file.close()
            self._file = None

    def keep(self, acceptance: Acceptance) -> None:
        """Write a record; when this returns, the death of the process does not lose it.

        Raises:
            OSError: It was not written, for want of room for example.
        """
        record = _record(acceptance)
        with self._lock:
            # At a known place: what a failed write left there is written over.
            _write_at(self._open, self._size, record)
            self._size += len(record)
            self._unsaved[acceptance.number] = record

    def when_flushed(self, act: Callable[[], None]) -> None:
        """Call something, in order and from the journal's thread, when all that was kept until now is on the disk."""
        with self._lock:
            self._waiting.append(act)
            self._lock.notify_all()

    def forget(self, number: int) -> None:
        """Take note that a saved state holds all goals up to this number."""
        with self._lock:
            while self._unsaved and next(iter(self._unsaved)) <= number:
                self._unsaved.popitem(last=False)

    def _loop(self) -> None:
        while True:
            with self._lock:
                while not self._waiting and not self._stopping:
                    self._lock.wait()
                ready, self._waiting = self._waiting, []
                if not ready:
                    return
            self._flush()
            for act in ready:
                act()

    def _flush(self) -> None:
        try:
            _flush_data(self._open.fileno())
            if self._size > self._limit:
                with self._lock:
                    self._rewrite()
        except OSError as error:
            # The goals were accepted and are written; only a power cut could lose them.
            _log.error("the accepted goals were not flushed to %s: %s", self.path, error.strerror)

    def _rewrite(self) -> None:
        """Replace the file by one with what no saved state holds; the ledger has forgotten all but the newest."""
        while len(self._unsaved) > _KEPT_RECORDS:
            self._unsaved.popitem(last=False)
        content = b"".join(self._unsaved.values())
        new = self.path.with_name(f".{self.path.name}.new")
        file = open(new, "wb", buffering=0)  # noqa: SIM115 -- it stays open for what comes.
        try:
            _write_at(file, 0, content)
            os.fsync(file.fileno())
            os.replace(new, self.path)
            flush_folder(self.path.parent)
        except OSError:
            file.close()
            raise
        if self._file is not None:
            self._file.close()
        self._file, self._size = file, len(content)
        self._limit = max(COMPACT_BYTES, 2 * self._size)

    @property
    def _open(self) -> IO[bytes]:
        if self._file is None:
            raise OSError(errno.EBADF, "the journal is closed")
        return self._file


def _write_at(file: IO[bytes], place: int, content: bytes) -> None:
    file.seek(place)
    if file.write(content) != len(content):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def read_journal(path: Path, boot_id: str, after: int) -> list[KeptGoal]:
    """Return the goals that a process accepted after it last saved its state.

    Args:
        path: The journal; none is an empty one.
        boot_id: Of the process that saved the state: records of another are of another world.
        after: Number of the last goal that the state holds.

    Raises:
        InputError: It is no readable file. A damaged or torn record is left out and the others are read.
    """
    found: OrderedDict[int, KeptGoal] = OrderedDict()
    damaged = 0
    for line in read_file(path, _MOST_BYTES).split(b"\n"):
        if not line:
            continue
        acceptance = _acceptance(line)
        if acceptance is None:
            damaged += 1
        elif acceptance.goal.boot_id == boot_id and acceptance.number > after:
            found[acceptance.number] = KeptGoal(goal=acceptance.goal, arguments=acceptance.arguments)
    if damaged:
        _log.warning("%s: %d damaged records are left out", path.name, damaged)
    return [found[number] for number in sorted(found)]


def read_file(path: Path, most_bytes: int) -> bytes:
    """Return what a file of the state holds, nothing where there is none.

    Raises:
        InputError: It is no file, larger than such a file gets, or cannot be read.
    """
    if not os.path.lexists(path):
        return b""
    if not path.is_file():
        raise InputError(f"--state-file: {str(path)!r} is no file; name another")
    try:
        with open(path, "rb") as file:
            content = file.read(most_bytes + 1)
    except OSError as error:
        raise InputError(f"--state-file: {path.name} cannot be read: {error.strerror}") from None
    if len(content) > most_bytes:
        raise InputError(
            f"--state-file: {path.name} is larger than {most_bytes / 1e6:.0f} MB, the most that a sim writes; "
            "name another or remove it"
        )
    return content


def flush_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, after a file in it was replaced."""
    number = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def _record(acceptance: Acceptance) -> bytes:
    text = acceptance.model_dump_json().encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _acceptance(line: bytes) -> Acceptance | None:
    crc, text = line[:_CRC_DIGITS], line[_CRC_DIGITS + 1 :]
    if crc != b"%08x" % zlib.crc32(text):
        return None
    try:
        return Acceptance.model_validate_json(text)
    except ValidationError:
        return None
