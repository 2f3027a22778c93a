"""Questions to a sim: asked again while it is away, and answered by nobody else."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import zenoh
from pydantic import ValidationError
from pydantic_core import from_json

from robosandbox.errors import ServiceUnavailableError
from robosandbox.skill_errors import Failure, ForbiddenError
from robosandbox.workcell.zenoh.client.source import TIMED_OUT, Source

if TYPE_CHECKING:
    from robosandbox.workcell.zenoh.client.client import Client

# How long an answer is waited for, seconds; chosen far above what benchmarks/service.py measures on a busy machine.
ANSWER_SECONDS = 10.0
# Between looks for an answer, seconds; chosen so that Ctrl-C is heard meanwhile.
_POLL_SECONDS = 0.02
# How long a sim that answers `info` may be silent until access control is blamed, seconds; chosen above a resent query.
_DENIED_SECONDS = 1.5


class Asker:
    """Asks one robot's sim.

    Args:
        client: Knows whether the sim is there.
        robot_id: In keys.

    Attributes:
        source: Whom it believes.
    """

    def __init__(self, client: Client, robot_id: str) -> None:
        self.source: Source = Source(client, robot_id)
        self._client = client
        self._robot_id = robot_id

    def get(self, suffix: str, payload: bytes | None, timeout: float) -> zenoh.Sample:
        """Return the sim's answer; waits for a sim that is away.

        Args:
            suffix: The key and its parameters.
            payload: A message.
            timeout: Seconds for the answer of a sim that is there.

        Raises:
            SkillError: The sim refuses; a ForbiddenError when access control keeps the question from it.
            ServiceUnavailableError: No sim answers, or several sessions say that they are it.
        """
        give_up = time.monotonic() + self._client.reconnect
        denied_since: float | None = None
        while True:
            answer = self._ask(suffix, payload, timeout)
            if answer is not None:
                return answer
            # No answer at all: nobody is there, a connection in the making has not brought the key yet, or access
            # control hides it, which a sim that goes on answering `info` tells.
            now = time.monotonic()
            denied_since = (denied_since or now) if self._answers_info() else None
            if denied_since is not None and now - denied_since > _DENIED_SECONDS:
                raise ForbiddenError(
                    f"{suffix.partition('?')[0]}: the sim of {self._robot_id!r} is there and does not let this client ask "
                    "it; its access control wants other credentials, such as an operator's"
                )
            left = give_up - now
            if left <= 0.0:
                raise ServiceUnavailableError(f"the sim of {self._robot_id!r} does not answer on {suffix}")
            self._client.wait_for(self._robot_id, left)
            time.sleep(_POLL_SECONDS)

    def _ask(self, suffix: str, payload: bytes | None, timeout: float) -> zenoh.Sample | None:
        if not self.source.find(ANSWER_SECONDS):
            return None
        for reply in self.source.answers(suffix, payload, timeout):
            if reply.ok is not None:
                return reply.ok
            raise _error(reply.err.payload.to_bytes() if reply.err else b"", self._robot_id)
        return None

    def _answers_info(self) -> bool:
        return any(reply.ok is not None for reply in self.source.answers("info", None, ANSWER_SECONDS))


def _error(payload: bytes, robot_id: str) -> Exception:
    """Return the exception that an error reply stands for."""
    if payload == TIMED_OUT:
        return ServiceUnavailableError(f"the sim of {robot_id!r} did not answer in time")
    try:
        return Failure.model_validate(from_json(payload)).exception()
    except (ValueError, ValidationError):
        return ServiceUnavailableError(f"the sim of {robot_id!r} answered {payload[:80]!r}, which is no message")
