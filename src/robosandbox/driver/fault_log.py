"""The last seconds before a fault, written where a person finds them."""

from __future__ import annotations

import json
import logging
from collections import deque
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosandbox.cache import state_file
from robosandbox.driver.capabilities import robot_name

if TYPE_CHECKING:
    from robosandbox.driver.protocols import Driver, Mode

_log = logging.getLogger(__name__)

# Seconds that are kept, and files, the newest of them.
_SECONDS, _FILES = 10.0, 20


class FaultLog:
    """Record of the last ten seconds, tick by tick, of the arms of a machine that goes by the wall's clock.

    At a fault it is written as a file of JSON lines: `time` in seconds of the driver, `mode`, and of each arm its joints `q` (rad or
    m), their speeds `qd`, and how far its gripper is `closed` and was `commanded`, 0 to 1; the last line is the `fault`.

    Args:
        driver: Whose arms.

    Attributes:
        path: File of the last fault; None where there was none, or it could not be written.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._rows: deque[dict[str, Any]] = deque()
        self._told = ""
        self.path: Path | None = None

    def ticked(self, mode: Mode, fault: str) -> None:
        """Take down a tick; where there is a new fault, write what is kept."""
        now = self._driver.time
        self._rows.append({"time": now, "mode": mode, "states": {n: a.state() for n, a in self._driver.arms.items()}})
        while now - self._rows[0]["time"] > _SECONDS:
            self._rows.popleft()
        if fault and not self._told:
            self._write(fault)
        self._told = fault

    def _write(self, fault: str) -> None:
        name = f"{robot_name(self._driver)}-{datetime.now(UTC):%Y%m%dT%H%M%S.%f}.jsonl"
        path = state_file(f"faults/{name}")
        if path is None:
            return
        lines = [{**row, "states": {n: _plain(state) for n, state in row["states"].items()}} for row in self._rows]
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("".join(f"{json.dumps(line)}\n" for line in (*lines, {"fault": fault})), encoding="utf-8")
            for old in sorted(path.parent.glob("*.jsonl"), key=lambda each: each.stat().st_mtime_ns)[:-_FILES]:
                old.unlink(missing_ok=True)
        except OSError as error:
            _log.warning("the last seconds before the fault are not kept: %s", error)
            return
        self.path = path
        _log.error("the last %g s before it are in %s", _SECONDS, path)


def _plain(state: Any) -> dict[str, Any]:
    told = {"q": state.q.round(5).tolist(), "qd": state.qd.round(5).tolist()}
    return (
        told if state.gripper is None else told | {"closed": state.gripper.closed, "commanded": state.gripper.commanded}
    )
