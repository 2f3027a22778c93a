"""Zenoh queries as requests: every one is answered, with a message or with a typed error."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future

import zenoh

from robosandbox.errors import InputError, InternalError, InvalidArgumentError, InvalidMessageError, SkillError
from robosandbox.evidence import MessageEvidence
from robosandbox.workcell.zenoh.messages import JSON, Ask, Message, MessageT, decode

_log = logging.getLogger(__name__)


class Request:
    """A query that waits for its answer; answer or refuse it once, from any thread.

    Args:
        query: What came.
        reply_key: The key to answer on.
    """

    def __init__(self, query: zenoh.Query, reply_key: str) -> None:
        self._query = query
        self.key = reply_key
        self.parameters = query.parameters

    def message(self, model: type[MessageT]) -> MessageT:
        """Return what was asked.

        Raises:
            InvalidMessageError: The payload is no such message.
        """
        payload = self._query.payload
        if payload is None:
            if model is Ask:
                return model()
            problem = f"the query has no payload; it takes a JSON object with {', '.join(model.model_fields)}"
            raise InvalidMessageError(problem, evidence=MessageEvidence(field="", problem=problem))
        return decode(payload.to_bytes(), model)

    def answer(self, message: Message) -> None:
        """Send a message."""
        self._send(lambda query: query.reply(self.key, message.encode(), encoding=JSON))

    def deliver(self, payload: bytes, encoding: str, attachment: Message) -> None:
        """Send bytes with a message about them."""
        self._send(lambda query: query.reply(self.key, payload, encoding=encoding, attachment=attachment.encode()))

    def refuse(self, error: Exception) -> None:
        """Send an error; anything but a SkillError or InputError is logged under an id and sent as internal."""
        match error:
            case SkillError():
                known: SkillError = error
            case InputError():
                known = InvalidArgumentError(str(error))
            case _:
                known = InternalError.log(self.key, error, _log)
        payload = known.failure.model_dump_json().encode()
        self._send(lambda query: query.reply_err(payload, encoding=JSON))

    def settle(self, came: Future[MessageT]) -> None:
        """Answer with what something came to: a message or an error."""
        error = came.exception()
        if isinstance(error, Exception):
            self.refuse(error)
        else:
            self.answer(came.result())

    def _send(self, send: Callable[[zenoh.Query], None]) -> None:
        try:
            send(self._query)
        except zenoh.ZError as error:
            # Whoever asked has gone; there is nobody to tell.
            _log.debug("no answer on %s: %s", self.key, error)
        finally:
            self._query.drop()


def serve(
    session: zenoh.Session, key: str, handle: Callable[[Request], None], *, any_robot: bool = False
) -> zenoh.Queryable[None]:
    """Declare a queryable whose every query is answered.

    Args:
        session: Where.
        key: A key, in which `*` stands for one part that the query must name.
        handle: Answers, refuses, or hands the request on; what it raises is sent as an error.
        any_robot: Answer queries that ask every robot at once, too.
    """

    def receive(query: zenoh.Query) -> None:
        asked = str(query.key_expr)
        wild = "*" in asked
        request = Request(query, key if wild and "*" not in key else asked)
        try:
            if wild and not any_robot:
                problem = f"{asked!r} names no single robot and key; `*` works for info and observations only"
                raise InvalidMessageError(problem, evidence=MessageEvidence(field="key", problem=problem))
            handle(request)
        except Exception as error:
            request.refuse(error)

    return session.declare_queryable(key, receive)
