"""Results that are slow to compute and always the same, kept as files in the user's cache folder.

An entry is named by a hash of everything that its content depends on, so it is never out of date: what changed has another
name. An entry that is damaged, or a folder that cannot be read or written, costs time and nothing else. Entries are JSON with a
checksum; numbers come back bit by bit as they were.
"""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import os
import tempfile
import typing
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

ValueT = TypeVar("ValueT")

OFF_VARIABLE = "ROBOSANDBOX_NO_CACHE"
# Number of entries. Chosen only to keep a folder that nobody looks at from growing for ever; one of the bundled arm takes 10
# kB.
MAX_ENTRIES = 512
MAX_ENTRY_BYTES = 4_000_000  # Bytes of an entry. Chosen likewise.
_SUFFIX = ".json"


class DamagedEntryError(ValueError):
    """An entry's content is not what was written there."""


def is_on() -> bool:
    """Return whether the cache is read and written."""
    return os.environ.get(OFF_VARIABLE, "") in ("", "0")


def cache_folder() -> Path | None:
    """Return the folder of the entries, which need not exist; None where the user has no home."""
    # The XDG base directory specification tells to ignore a relative path.
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    try:
        base = given if given.is_absolute() else Path.home() / ".cache"
    except RuntimeError:
        return None
    return base / "robosandbox"


def state_file(name: str, environment: Mapping[str, str] = os.environ) -> Path | None:
    """Return where a file is kept that is no cache but what a person said or a program learnt; None without a home."""
    given = Path(environment.get("XDG_STATE_HOME", ""))
    try:
        base = given if given.is_absolute() else Path.home() / ".local" / "state"
    except RuntimeError:
        return None
    return base / "robosandbox" / name


def content_key(parts: Iterable[bytes | str]) -> str:
    """Return the hash of a sequence of texts and bytes, in which the borders between the parts count."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()


def cached(name: str, kind: type[ValueT], key: Callable[[], str], compute: Callable[[], ValueT]) -> ValueT:
    """Return a value from the cache; where it is not there, compute it and keep it.

    Args:
        name: What the value is, the beginning of the file's name.
        kind: Its class, a dataclass of numbers, texts, tuples, arrays and further dataclasses.
        key: Returns the hash of everything that it depends on, see `content_key`; not called where the cache is off.
        compute: Returns it.
    """
    folder = cache_folder() if is_on() else None
    if folder is None:
        return compute()
    path = folder / f"{name}-{key()}{_SUFFIX}"
    try:
        return cast("ValueT", _decoded(kind, _read(path)))
    except (OSError, ValueError):
        value = compute()
    _write(path, as_data(value))
    return value


def _read(path: Path) -> Any:
    """Return an entry's content.

    Raises:
        OSError: It cannot be read.
        ValueError: It is damaged.
    """
    if path.stat().st_size > MAX_ENTRY_BYTES:
        raise DamagedEntryError(f"{path.name} is larger than any entry")
    checksum, _, text = path.read_text(encoding="utf-8").partition("\n")
    if hashlib.sha256(text.encode()).hexdigest() != checksum:
        raise DamagedEntryError(f"{path.name} does not have its checksum")
    return json.loads(text)


def _write(path: Path, data: Any) -> None:
    """Keep an entry; where that fails, the next process computes it again."""
    text = json.dumps(data)
    content = f"{hashlib.sha256(text.encode()).hexdigest()}\n{text}"
    if len(content) > MAX_ENTRY_BYTES:
        return
    temporary = ""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        # Two processes that write one entry each rename a file of their own; the later one stays, and both are whole.
        handle, temporary = tempfile.mkstemp(prefix=".new-", dir=path.parent)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(content)
        os.replace(temporary, path)
        _drop_oldest(path.parent)
    except OSError:
        if temporary:
            Path(temporary).unlink(missing_ok=True)


def _drop_oldest(folder: Path) -> None:
    """Keep the newest entries, and none of the half-written files that killed processes have left."""
    files = [(item.stat().st_mtime, item.path) for item in os.scandir(folder) if item.is_file(follow_symlinks=False)]
    for _, path in sorted(files)[:-MAX_ENTRIES]:
        Path(path).unlink(missing_ok=True)


def as_data(value: Any) -> Any:
    """Return a value as JSON data.

    Raises:
        TypeError: It is of a class that the cache does not keep.
    """
    if isinstance(value, np.ndarray):
        data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode()
        return {"dtype": value.dtype.str, "shape": list(value.shape), "data": data}
    if dataclasses.is_dataclass(value):
        return {field.name: as_data(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, tuple):
        return [as_data(item) for item in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a {type(value).__name__} cannot be kept in the cache")


def _decoded(kind: Any, data: Any) -> Any:
    """Return the value of a type that JSON data stands for.

    Raises:
        ValueError: The data is not of this type.
    """
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, type(int | None)):
        inner = next(item for item in arguments if item is not type(None))
        return None if data is None and type(None) in arguments else _decoded(inner, data)
    if (origin or kind) is np.ndarray:
        return _array(data)
    if origin is tuple:
        return _tuple(arguments, data)
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        return _dataclass(kind, data)
    if not (isinstance(kind, type) and isinstance(data, kind)) and not (kind is float and type(data) is int):
        raise DamagedEntryError(f"{data!r} is no {kind}")
    return data


def _tuple(arguments: tuple[Any, ...], data: Any) -> tuple[Any, ...]:
    if not isinstance(data, list):
        raise DamagedEntryError(f"{data!r} is no list")
    inner = [arguments[0]] * len(data) if arguments[-1:] == (...,) else list(arguments)
    return tuple(_decoded(item, each) for item, each in zip(inner, data, strict=True))


def _dataclass(kind: type, data: Any) -> Any:
    hints = typing.get_type_hints(kind)
    names = [field.name for field in dataclasses.fields(kind)]
    if not isinstance(data, dict) or sorted(data) != sorted(names):
        raise DamagedEntryError(f"{kind.__name__} has other fields")
    return kind(**{name: _decoded(hints[name], data[name]) for name in names})


def _array(data: Any) -> np.ndarray[Any, Any]:
    """Return the array that JSON data stands for, read-only."""
    try:
        raw = base64.b64decode(data["data"], validate=True)
        array = np.frombuffer(raw, dtype=np.dtype(str(data["dtype"]))).reshape([int(size) for size in data["shape"]])
    except (KeyError, TypeError) as error:
        raise DamagedEntryError(f"no array: {error}") from None
    if array.dtype.hasobject:
        raise DamagedEntryError("an array of objects")
    return array
