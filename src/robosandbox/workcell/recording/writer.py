"""The steps of an episode on their way to disk: a stream while it runs, one Parquet file when it has ended."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Protocol

import pyarrow as pa
import pyarrow.parquet as pq

from robosandbox.sim.step_recorder import StepColumns
from robosandbox.workcell.recording.columns import to_batch
from robosandbox.workcell.recording.files import STEPS, STREAM

_FLUSH_SECONDS = 1.0
# Rows of a Parquet row group (20 s of control ticks); chosen so that a reader of a short stretch reads little, while
# columns still compress.
_ROW_GROUP = 2000


class StepLog(Protocol):
    """Takes down rows of a world."""

    @property
    def rows(self) -> int:
        """Number of rows held."""
        ...

    @property
    def capacity(self) -> int:
        """Number of rows that there is room for."""
        ...

    def enter(self, skill: str, phase: str) -> None:
        """Have the rows that follow name a skill and its phase."""
        ...

    def add(self) -> None:
        """Take down the state as it is now."""
        ...

    def take(self) -> StepColumns:
        """Return the rows as columns and start over."""
        ...

    def clear(self) -> None:
        """Forget all rows."""
        ...


class StepWriter:
    """Writes what a log takes down.

    At least once a second the rows so far are appended to an Arrow stream, whose whole record batches stay readable
    when the process dies; `finish` makes a Parquet file of it, whose footer comes last. Memory holds what came since.

    Args:
        folder: The episode's.
        log: Takes the rows; emptied here.

    Attributes:
        rows: Taken so far.
    """

    def __init__(self, folder: Path, log: StepLog) -> None:
        self.rows: int = 0
        self._folder = folder
        self._log = log
        self._stream: pa.ipc.RecordBatchStreamWriter | None = None
        self._file: pa.OSFile | None = None
        self._flushed = time.monotonic()

    def add(self) -> None:
        """Take down the state as it is now."""
        log = self._log
        log.add()
        self.rows += 1
        if log.rows == log.capacity or time.monotonic() - self._flushed > _FLUSH_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Append the rows that memory holds to the stream."""
        self._flushed = time.monotonic()
        if not self._log.rows:
            return
        batch = to_batch(self._log.take())
        if self._stream is None:
            self._file = pa.OSFile(str(self._folder / STREAM), "wb")
            self._stream = pa.ipc.new_stream(self._file, batch.schema)
        self._stream.write_batch(batch)

    def finish(self) -> None:
        """Write the Parquet file and take the stream away."""
        stream = self._folder / STREAM
        target = self._folder / STEPS
        if self._stream is None:
            batch = to_batch(self._log.take())
            _write(target, batch.schema, [batch])
            return
        self.flush()
        self._close()
        with pa.memory_map(str(stream)) as source:
            reader = pa.ipc.open_stream(source)
            _write(target, reader.schema, reader)
        stream.unlink()

    def abandon(self) -> None:
        """Drop what memory holds and leave the stream as it is."""
        with contextlib.suppress(pa.ArrowException, OSError):
            self._close()

    def _close(self) -> None:
        if self._stream is not None and self._file is not None:
            self._stream.close()
            self._file.close()
        self._stream = self._file = None


def read_steps(folder: Path) -> pa.Table | None:
    """Return the steps of an episode, also of one whose process died; None where nothing was flushed.

    Raises:
        pa.ArrowInvalid: The Parquet file is damaged.
    """
    if (folder / STEPS).exists():
        return pq.read_table(folder / STEPS)
    if not (folder / STREAM).exists():
        return None
    batches: list[pa.RecordBatch] = []
    with pa.OSFile(str(folder / STREAM)) as source:
        try:
            reader = pa.ipc.open_stream(source)
            while True:
                batches.append(reader.read_next_batch())
        except (StopIteration, pa.ArrowInvalid, OSError):
            # The end, or the batch that was being written when the process died.
            pass
    return pa.Table.from_batches(batches) if batches else None


def _write(target: Path, schema: pa.Schema, batches: Iterable[pa.RecordBatch]) -> None:
    """Write batches as a Parquet file that is there whole or not at all."""
    new = target.with_name(f".{target.name}.new")
    # Simulated numbers hardly repeat: dictionaries and statistics would cost time and save nothing.
    options: dict[str, Any] = {"use_dictionary": ["skill", "phase"], "write_statistics": False}
    # A file that is open already spares the writer its search for file systems.
    with (
        pa.OSFile(str(new), "wb") as file,
        pq.ParquetWriter(file, schema, compression="snappy", **options) as writer,
    ):
        for group in _groups(batches):
            writer.write_table(pa.Table.from_batches(group))
    new.replace(target)


def _groups(batches: Iterable[pa.RecordBatch]) -> Iterator[list[pa.RecordBatch]]:
    """Yield batches in groups of enough rows."""
    waiting: list[pa.RecordBatch] = []
    for batch in batches:
        waiting.append(batch)
        if sum(map(len, waiting)) >= _ROW_GROUP:
            yield waiting
            waiting = []
    if waiting:
        yield waiting
