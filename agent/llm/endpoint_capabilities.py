"""Capabilities of LLM endpoints, cached on disk: the output mode that works there, and whether answers are streamed.

The first requests to an endpoint find them out. The file lies beside the history of the REPL, for the next process to begin
with. An entry is dropped as soon as an answer contradicts it, or after a month, since servers are updated.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from robosandbox.agent.llm.modes import Mode
from robosandbox.agent.llm.settings import LLMSettings
from robosandbox.cache import state_file
from robosandbox.values import frozen

# Seconds for which an entry is believed. Chosen: 30 days; probing anew costs two or three requests.
_BELIEVED = 30 * 86_400.0
_MOST_ENTRIES = 200  # Number of endpoints. Chosen: servers on random ports must not let the file grow for ever.
_MOST_BYTES = 200_000  # Bytes of the file. Chosen far above what that many entries take.

EndpointKey = tuple[str, str, str]
"""Service, address and model."""


@frozen(kw_only=True)
class EndpointCapabilities:
    """Capabilities of a model at an endpoint.

    Attributes:
        mode: The most binding way that gave an answer which could be read; None where none has yet.
        streams: Whether answers arrive piece by piece when asked for so; None where nobody has asked.
        since: When something was learnt last, seconds since 1970.
    """

    mode: Mode | None = None
    streams: bool | None = None
    since: float = 0.0


@dataclass
class EndpointCache:
    """Capabilities by endpoint; read from a file when they are first asked for, and kept there.

    Args:
        file: Where it is kept; None keeps it in memory.
    """

    file: Path | None = None
    _entries: dict[EndpointKey, EndpointCapabilities] = field(default_factory=dict)
    _is_read: bool = False

    def of(self, key: EndpointKey) -> EndpointCapabilities:
        """Return the capabilities of an endpoint."""
        if not self._is_read:
            self._entries, self._is_read = _read(self.file) | self._entries, True
        return self._entries.get(key, EndpointCapabilities())

    def learn(self, key: EndpointKey, *, mode: Mode | None = None, streams: bool | None = None) -> None:
        """Note what an endpoint has shown; None leaves the entry as it was."""
        before = self.of(key)
        now = replace(
            before,
            mode=before.mode if mode is None else mode,
            streams=before.streams if streams is None else streams,
            since=time.time(),
        )
        if replace(now, since=before.since) != before:
            self._entries[key] = now
            self._write(key)

    def forget_mode(self, key: EndpointKey) -> None:
        """Take back how a model is held to a form: an answer contradicts it."""
        if self.of(key).mode is not None:
            self._entries[key] = replace(self._entries[key], mode=None)
            self._write(key)

    def _write(self, changed: EndpointKey) -> None:
        """Write the cache; a disk that does not allow it costs the next process some requests."""
        if self.file is None:
            return
        # What other processes have learnt meanwhile stays.
        entries = _read(self.file) | {changed: self._entries[changed]}
        newest = sorted(entries.items(), key=lambda entry: entry[1].since)[-_MOST_ENTRIES:]
        rows = [{"where": list(key), **asdict(known)} for key, known in newest]
        temporary = ""
        try:
            self.file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            handle, temporary = tempfile.mkstemp(prefix=".new-", dir=self.file.parent)
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                json.dump(rows, file, indent=1)
            os.replace(temporary, self.file)
        except OSError:
            if temporary:
                Path(temporary).unlink(missing_ok=True)


def _read(file: Path | None) -> dict[EndpointKey, EndpointCapabilities]:
    """Return the entries of a file that are not too old; nothing where it cannot be read."""
    if file is None:
        return {}
    try:
        if file.stat().st_size > _MOST_BYTES:
            return {}
        rows = json.loads(file.read_text(encoding="utf-8"))
        entries = dict(map(_entry, rows))
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return {}
    return {key: known for key, known in entries.items() if 0.0 <= time.time() - known.since < _BELIEVED}


def _entry(row: Mapping[str, object]) -> tuple[EndpointKey, EndpointCapabilities]:
    """Return an entry of the file; raises ValueError, TypeError or KeyError where it is none."""
    service, address, model = map(str, row["where"])  # type: ignore[call-overload]
    mode, streams, since = row["mode"], row["streams"], row["since"]
    if mode is not None and not isinstance(mode, str):
        raise ValueError(f"mode: {mode!r}")
    if streams is not None and not isinstance(streams, bool):
        raise ValueError(f"streams: {streams!r}")
    if not isinstance(since, int | float):
        raise ValueError(f"since: {since!r}")
    return (service, address, model), EndpointCapabilities(
        mode=None if mode is None else Mode(mode), streams=streams, since=since
    )


_PROCESS_CACHE = EndpointCache(state_file("endpoints.json"))


def endpoint_cache(settings: LLMSettings) -> EndpointCache:
    """Return the cache of this process; an empty one for a cassette, which must replay what was recorded from the start."""
    return EndpointCache() if settings.cassette is not None else _PROCESS_CACHE
