"""The files of a LeRobotDataset: where they lie, how large they get, and the small ones that describe the whole."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

# Files a folder; as in the standard layout of LeRobotDataset 3.0.
CHUNK_FILES = 1000
# Megabytes after which a table goes on in another file; as in LeRobotDataset 3.0.
DATA_MB = 100
# Megabytes after which a film goes on in another file; as in LeRobotDataset 3.0.
VIDEO_MB = 200
# Bytes; as in LeRobotDataset 3.0, which counts binary ones.
_MEGABYTE = 1024 * 1024
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
DATA_PATH = "data/" + _FILE + ".parquet"
VIDEO_PATH = "videos/{video_key}/" + _FILE + ".mp4"
EPISODES_PATH = "meta/episodes/" + _FILE + ".parquet"


class FileRoll:
    """Files one after another, each begun when the one before has reached its size.

    Args:
        root: The dataset's folder.
        pattern: Path in it, with a chunk's and a file's number.
        megabytes: That size.
    """

    def __init__(self, root: Path, pattern: str, megabytes: int) -> None:
        self.chunk: int = 0
        self.file: int = -1
        self._root, self._pattern, self._bytes = root, pattern, megabytes * _MEGABYTE

    @property
    def path(self) -> Path:
        """The file that is written to."""
        return self._root / self._pattern.format(chunk_index=self.chunk, file_index=self.file)

    @property
    def full(self) -> bool:
        """True when the next file is due."""
        return self.path.stat().st_size >= self._bytes

    def next(self) -> Path:
        """Begin the next file, and return it."""
        self.file += 1
        if self.file == CHUNK_FILES:
            self.chunk, self.file = self.chunk + 1, 0
        self.path.parent.mkdir(parents=True, exist_ok=True)
        return self.path


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Write a JSON file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document, indent=4, ensure_ascii=False), encoding="utf-8")


def write_index(path: Path, number: str, text: str, entries: dict[str, int]) -> None:
    """Write a table of texts and their numbers; readers take the texts as the index of a pandas frame."""
    table = pa.table({number: pa.array(list(entries.values()), pa.int64()), text: pa.array(list(entries))})
    columns = [
        {"name": column, "field_name": column, "pandas_type": kind, "numpy_type": stored, "metadata": None}
        for column, kind, stored in ((number, "int64", "int64"), (text, "unicode", "object"))
    ]
    about = {"index_columns": [text], "column_indexes": [], "columns": columns, "pandas_version": "2.0.0"}
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(about)}), path)
