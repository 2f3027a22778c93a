"""What takes over a second says what it is doing; what is quick says nothing."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator

import pytest

from robosandbox.commands import waiting
from robosandbox.progress import LOGGER, doing


class Told(waiting.SlowWork):
    """Keeps what it would print."""

    def __init__(self) -> None:
        super().__init__("test")
        self.lines: list[str] = []
        self.told = threading.Event()

    def _print(self, what: str) -> None:
        self.lines.append(what)
        self.told.set()


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> Iterator[Told]:
    handler = Told()
    monkeypatch.setattr(LOGGER, "handlers", [handler])
    level = LOGGER.level
    # Set by its method, which forgets what loggers remember of levels.
    LOGGER.setLevel(logging.INFO)
    yield handler
    LOGGER.setLevel(level)


def test_what_takes_long_is_told(told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waiting, "_PATIENCE_SECONDS", 0.0)
    with doing("measuring the gripper"):
        assert told.told.wait(10.0)
    assert told.lines == ["measuring the gripper"]


def test_what_is_quick_is_not_told(told: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waiting, "_PATIENCE_SECONDS", 600.0)
    with doing("loading"), doing("measuring"):
        assert told._timer is not None and told._timer.args == ["measuring"]
    assert told._timer is None and told.lines == []
