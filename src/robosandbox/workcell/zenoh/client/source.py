"""Trust in the sources of messages: one Zenoh session's are believed, the sim that answered `info`."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import zenoh

from robosandbox.errors import ServiceUnavailableError
from robosandbox.workcell.zenoh.messages import key

if TYPE_CHECKING:
    from robosandbox.workcell.zenoh.client.client import Client

_log = logging.getLogger(__name__)
# Between two warnings of what is not believed, seconds; chosen so that a forger cannot flood a terminal.
_WARN_SECONDS = 10.0
# What a Zenoh listener puts into an error reply in the name of one that did not answer.
TIMED_OUT = b"Timeout"


class Source:
    """The sim of one robot, known by the id of its Zenoh session.

    Access control keeps others from answering. Where a listener has none, this is what is left: the session that answered
    `info` first is believed until its liveliness token goes, and none is where several answer. Ids of sessions are not
    secret, so this does not stop a forger with a Zenoh of its own making.

    Args:
        client: Has the Zenoh session.
        robot_id: In keys.
    """

    def __init__(self, client: Client, robot_id: str) -> None:
        self._client = client
        self._robot_id = robot_id
        self._id: str | None = None
        self._lock = threading.Lock()
        self._warned = 0.0

    @property
    def known(self) -> bool:
        """True once there is a session to believe."""
        return self._id is not None

    def find(self, timeout: float) -> bool:
        """Ask who answers for the robot, unless that is known; return whether somebody does.

        Raises:
            ServiceUnavailableError: Several do.
        """
        with self._lock:
            if self._id is None:
                ids = self._answering(timeout)
                if len(ids) > 1:
                    raise ServiceUnavailableError(
                        f"{len(ids)} Zenoh sessions answer for robot {self._robot_id!r}: {', '.join(sorted(ids))}; one sim "
                        "at most is true and none is believed; see who is let in where they listen, and docs/deployment.md"
                    )
                self._id = next(iter(ids), None)
            return self._id is not None

    def forget(self) -> None:
        """Take note that the sim is gone: its successor is another session."""
        self._id = None

    def answers(self, suffix: str, payload: bytes | None, timeout: float) -> Iterator[zenoh.Reply]:
        """Ask everybody and yield the sim's replies and whatever says that it did not answer in time."""
        # A best-matching or merged query would have one answer only, and that might be another's.
        for reply in self._ask(suffix, payload, timeout):
            if _timed_out(reply) or self.believes(reply.replier_id, suffix):
                yield reply

    def believes(self, speaker: zenoh.EntityGlobalId | None, suffix: str) -> bool:
        """Tell whether something was said by the sim; what was not is logged.

        Args:
            speaker: A reply's `replier_id` or the id in a sample's `source_info`.
            suffix: The key, for the log.
        """
        said_by = None if speaker is None else str(speaker.zid)
        if said_by is not None and said_by == self._id:
            return True
        now = time.monotonic()
        if self._id is not None and now - self._warned > _WARN_SECONDS:
            self._warned = now
            _log.warning(
                "%s of robot %s was said by Zenoh session %s and is not believed: its sim is session %s",
                suffix,
                self._robot_id,
                said_by,
                self._id,
            )
        return False

    def _answering(self, timeout: float) -> set[str]:
        found = {
            str(reply.replier_id.zid)
            for reply in self._ask("info", None, timeout)
            if reply.replier_id is not None and not _timed_out(reply)
        }
        session = self._client.session
        if any(session.info.routers_zid()):
            return found
        # Without a router a sim is at the other end of a link that this session has made itself.
        linked = {str(zid) for zid in (*session.info.peers_zid(), session.zid())}
        for stranger in found - linked:
            _log.warning("session %s answers for robot %s through another's link", stranger, self._robot_id)
        return found & linked

    def _ask(self, suffix: str, payload: bytes | None, timeout: float) -> Iterator[zenoh.Reply]:
        yield from self._client.session.get(
            key(self._robot_id, suffix),
            payload=payload,
            timeout=timeout,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )


def _timed_out(reply: zenoh.Reply) -> bool:
    return reply.err is not None and reply.err.payload.to_bytes() == TIMED_OUT
