"""Liveliness tokens of clients: which clients are connected, and what follows when one goes."""

from __future__ import annotations

import threading
from collections.abc import Callable

import zenoh

from robosandbox.workcell.zenoh.messages import key

_GRACE_SECONDS = 1.0


class ConnectedClients:
    """The clients of one robot.

    Args:
        session: A Zenoh session.
        robot_id: In keys.
        gone: Called with the id of a client that went away, or that did not come though it sent a goal; from any thread.
    """

    def __init__(self, session: zenoh.Session, robot_id: str, gone: Callable[[str], None]) -> None:
        self._session = session
        self._key = key(robot_id, "client", "*")
        self._gone = gone
        self._present: set[str] = set()
        self._timers: set[threading.Timer] = set()
        self._watch: zenoh.Subscriber[None] | None = None

    def start(self) -> None:
        """Begin to watch."""
        self._watch = self._session.liveliness().declare_subscriber(self._key, self._hear, history=True)

    def stop(self) -> None:
        """End."""
        if self._watch is not None:
            self._watch.undeclare()
        for timer in tuple(self._timers):
            timer.cancel()

    def expect(self, client_id: str) -> None:
        """Take note that a client sent a goal: the token of one that has died meanwhile never comes."""
        if client_id in self._present:
            return

        def look() -> None:
            self._timers.discard(timer)
            if client_id not in self._present:
                self._gone(client_id)

        timer = threading.Timer(_GRACE_SECONDS, look)
        timer.daemon = True
        self._timers.add(timer)
        timer.start()

    def _hear(self, sample: zenoh.Sample) -> None:
        client_id = str(sample.key_expr).rpartition("/")[2]
        if sample.kind == zenoh.SampleKind.PUT:
            self._present.add(client_id)
            return
        self._present.discard(client_id)
        self._gone(client_id)
