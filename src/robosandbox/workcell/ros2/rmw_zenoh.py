"""A ROS 2 graph as Zenoh's own middleware for it (rmw_zenoh) lays it out: keys, liveliness tokens, attachments, CDR.

The layout is that of https://github.com/ros2/rmw_zenoh since Kilted and Jazzy's 0.2.4.
"""

from __future__ import annotations

import hashlib
import itertools
import logging
import struct
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import zenoh
from zenoh import ext

from robosandbox.errors import InputError
from robosandbox.workcell.ros2.graph import DEFAULT, OPEN_CALLS, RESULT_SECONDS, Publisher, Qos
from robosandbox.workcell.ros2.interfaces import Message, from_bytes, kind, to_bytes, type_hash
from robosandbox.workcell.zenoh.transport import is_loopback, open_connector

_LOG = logging.getLogger(__name__)
# Depth that a token leaves out, and the numbers of the policies that differ from what it leaves out.
_DEFAULT_DEPTH, _TRANSIENT_LOCAL = 42, 1
_STATUS = Qos(depth=1, latched=True)
# A sequence number and nanoseconds since 1970; then the 16 bytes of the sender's id behind their number.
_ATTACHMENT = struct.Struct("<qq17s")


class RmwZenohGraph:
    """A node that ROS 2 nodes on rmw_zenoh see as one of theirs.

    Args:
        name: Of the node.
        router: Zenoh endpoint of the router that they use, on this machine.
        domain: `ROS_DOMAIN_ID` of theirs.

    Raises:
        InputError: The endpoint is wrong, or of another machine.
        ServiceUnavailableError: No router is there.
    """

    def __init__(self, name: str, *, router: str, domain: int = 0) -> None:
        if not is_loopback(router):
            raise InputError(
                f"--rmw-zenoh: {router[:60]!r} is no endpoint of this machine, as tcp/localhost:7447 is; rmw_zenoh asks "
                "nobody who they are, so have a router here that connects to others"
            )
        self._name, self._domain = name, domain
        # As a client, since a router passes on to its clients whatever it is set to.
        self._session = open_connector((router,), mode="client")
        self._ids = itertools.count()
        self._tokens: list[Any] = []
        self._waiting: list[Callable[[], Any]] = []
        self._served: list[Any] = []
        self._pool = ThreadPoolExecutor(OPEN_CALLS, thread_name_prefix="rmw-zenoh")
        self._declare("NN")

    def kind(self, name: str) -> Any:
        """Return the class of an interface.

        Raises:
            KeyError: Its definition is not here.
        """
        return kind(name)

    def publisher(self, kind: str, topic: str, qos: Qos = DEFAULT) -> Publisher:
        """Advertise a topic."""
        return self.advertise(self.kind(kind), topic, qos)

    def serve(self, kind: str, name: str, answer: Callable[[Any, Any], Any]) -> None:
        """Serve a service."""
        service = self.kind(kind)

        def reply(call: _Call) -> None:
            call.reply(answer(call.request, service.Response()))

        self.answer(service, name, reply)

    def serve_action(self, kind: str, name: str, act: Callable[[Any], Any]) -> None:
        """Serve an action."""
        _ActionServer(self, self.kind(kind), name, act)

    def start(self) -> None:
        """Begin to answer."""
        self._served = [declare() for declare in self._waiting]

    def close(self) -> None:
        """Leave the graph."""
        for queryable in self._served:
            queryable.undeclare()
        self._pool.shutdown()
        self._session.close()

    def advertise(self, interface: type[Message], topic: str, qos: Qos) -> _Publisher:
        """Advertise a topic of a class of messages."""
        key, gid = self._key(interface, topic), self._declare("MP", interface, topic, qos)
        reliability = zenoh.Reliability.RELIABLE
        if not qos.latched:
            return _Publisher(self._session.declare_publisher(key, reliability=reliability), gid)
        cache = ext.CacheConfig(qos.depth)
        return _Publisher(
            ext.declare_advanced_publisher(
                self._session, key, reliability=reliability, cache=cache, publisher_detection=True
            ),
            gid,
        )

    def answer(self, service: Any, name: str, reply: Callable[[_Call], None]) -> None:
        """Have each call of a service answered in a thread; the answer may come later."""
        key = self._key(service, name)

        def called(query: zenoh.Query) -> None:
            try:
                call = _Call(query, service.Request)
            except ValueError as error:
                query.reply_err(str(error))
                query.drop()
            else:
                self._pool.submit(call.answered, reply)

        self._declare("SS", service, name, DEFAULT)
        self._waiting.append(lambda: self._session.declare_queryable(key, called, complete=True))

    def _absolute(self, name: str) -> str:
        return f"/{self._name}{name[1:]}" if name.startswith("~") else name

    def _key(self, interface: type[Message], name: str) -> str:
        return f"{self._domain}{self._absolute(name)}/{_dds(interface)}/{type_hash(interface)}"

    def _declare(
        self, entity: str, interface: type[Message] | None = None, name: str = "", qos: Qos = DEFAULT
    ) -> bytes:
        """Tell the graph of a node, a publisher or a service; return the id that goes with what it sends."""
        # The enclave and the namespace are "/", and a slash is written "%".
        parts = [self._domain, self._session.zid(), 0, next(self._ids), entity, "%", "%", self._name]
        if interface is not None:
            parts += [self._absolute(name).replace("/", "%"), _dds(interface), type_hash(interface), _qos(qos)]
        token = "/".join(map(str, ["@ros2_lv", *parts]))
        self._tokens.append(self._session.liveliness().declare_token(token))
        # rmw_zenoh hashes a token otherwise (XXH3); to whoever receives, an id is a name.
        return hashlib.md5(token.encode(), usedforsecurity=False).digest()


def _dds(interface: type[Message]) -> str:
    package, group, name = interface.ros_name.split("/")
    return f"{package}::{group}::dds_::{name}_"


def _qos(qos: Qos) -> str:
    """Return how a token writes QoS: what differs from the default, of reliability (none does), durability, history and three durations."""
    depth = "" if qos.depth == _DEFAULT_DEPTH else qos.depth
    return f":{_TRANSIENT_LOCAL if qos.latched else ''}:,{depth}:,:,:,,"


class _Publisher:
    def __init__(self, publisher: Any, gid: bytes) -> None:
        self._publisher, self._gid, self._numbers = publisher, gid, itertools.count(1)

    def publish(self, message: Any) -> None:
        attachment = _ATTACHMENT.pack(next(self._numbers), time.time_ns(), bytes([len(self._gid)]) + self._gid)
        self._publisher.put(to_bytes(message), attachment=attachment)

    def get_subscription_count(self) -> int:
        return int(self._publisher.matching_status.matching)


class _Call:
    """A call of a service.

    Raises:
        ValueError: It is none.
    """

    def __init__(self, query: zenoh.Query, request: type[Message]) -> None:
        if query.payload is None or query.attachment is None or len(query.attachment) != _ATTACHMENT.size:
            raise ValueError("a request has a payload, and an attachment of 33 bytes")
        self.request = from_bytes(request, query.payload.to_bytes())
        self._query = query
        self._number, _, self._gid = _ATTACHMENT.unpack(query.attachment.to_bytes())

    def answered(self, reply: Callable[[_Call], None]) -> None:
        """Have the call answered; an error that nobody expected is told and is an answer as well."""
        try:
            reply(self)
        except Exception as error:
            _LOG.exception("a call failed: %s", self._query.key_expr)
            self._query.reply_err(f"{type(error).__name__}: {error}")
            self._query.drop()

    def reply(self, response: Message) -> None:
        """Answer, once."""
        attachment = _ATTACHMENT.pack(self._number, time.time_ns(), self._gid)
        self._query.reply(self._query.key_expr, to_bytes(response), attachment=attachment)
        self._query.drop()


@dataclass(eq=False, slots=True)
class _Goal:
    """A goal, as rclpy's handle of one is used."""

    request: Any
    info: Any
    server: _ActionServer
    status: int
    ended: float | None = None
    result: Future[Any] = field(default_factory=Future)

    @property
    def is_cancel_requested(self) -> bool:
        return bool(self.status == self.server.statuses.STATUS_CANCELING)

    def publish_feedback(self, feedback: Any) -> None:
        self.server.tell(self, feedback)

    def succeed(self) -> None:
        self.server.turn(self, self.server.statuses.STATUS_SUCCEEDED)

    def canceled(self) -> None:
        self.server.turn(self, self.server.statuses.STATUS_CANCELED)

    def abort(self) -> None:
        self.server.turn(self, self.server.statuses.STATUS_ABORTED)


class _ActionServer:
    """Three services and two topics, as ROS 2 makes an action of them."""

    def __init__(self, graph: RmwZenohGraph, action: Any, name: str, act: Callable[[Any], Any]) -> None:
        self.statuses = kind("action_msgs/msg/GoalStatus")
        self._action, self._act, self._graph = action, act, graph
        self._goals, self._lock = dict[bytes, _Goal](), threading.Lock()
        below, cancel = f"{name}/_action", kind("action_msgs/srv/CancelGoal")
        self._feedback = graph.advertise(action.FeedbackMessage, f"{below}/feedback", DEFAULT)
        self._status = graph.advertise(kind("action_msgs/msg/GoalStatusArray"), f"{below}/status", _STATUS)
        graph.answer(action.SendGoal, f"{below}/send_goal", self._accept)
        graph.answer(action.GetResult, f"{below}/get_result", self._give)
        graph.answer(cancel, f"{below}/cancel_goal", self._cancel)
        self._cancelled = cancel.Response

    def tell(self, goal: _Goal, feedback: Any) -> None:
        """Publish feedback on a goal."""
        self._feedback.publish(self._action.FeedbackMessage(goal_id=goal.info.goal_id, feedback=feedback))

    def turn(self, goal: _Goal, status: int) -> bool:
        """Give a goal that has not ended another status, and publish all; return whether that came to be."""
        with self._lock:
            if goal.status not in (self.statuses.STATUS_EXECUTING, self.statuses.STATUS_CANCELING):
                return False
            goal.status = status
            listed = [self.statuses(goal_info=one.info, status=one.status) for one in self._goals.values()]
            self._status.publish(kind("action_msgs/msg/GoalStatusArray")(status_list=listed))
            return True

    def _accept(self, call: _Call) -> None:
        now = time.time_ns()
        stamp = kind("builtin_interfaces/msg/Time")(sec=now // 10**9, nanosec=now % 10**9)
        goal_id = call.request.goal_id
        info = kind("action_msgs/msg/GoalInfo")(goal_id=goal_id, stamp=stamp)
        goal = _Goal(request=call.request.goal, info=info, server=self, status=self.statuses.STATUS_EXECUTING)
        with self._lock:
            for key, one in [*self._goals.items()]:
                if one.ended is not None and time.monotonic() - one.ended > RESULT_SECONDS:
                    del self._goals[key]
            known = self._goals.setdefault(bytes(goal_id.uuid), goal)
        call.reply(self._action.SendGoal.Response(accepted=known is goal, stamp=stamp))
        if known is not goal:
            return
        self.turn(goal, goal.status)
        result = self._action.Result()
        try:
            result = self._act(goal)
        finally:
            # Where it has ended otherwise, this changes nothing.
            goal.abort()
            goal.ended = time.monotonic()
            goal.result.set_result(self._action.GetResult.Response(status=goal.status, result=result))

    def _give(self, call: _Call) -> None:
        goal = self._goals.get(bytes(call.request.goal_id.uuid))
        if goal is None:
            call.reply(self._action.GetResult.Response())
        else:
            goal.result.add_done_callback(lambda done: call.reply(done.result()))

    def _cancel(self, call: _Call) -> None:
        """Ask goals to end: the one that is named, those until a time, both, or with neither all."""
        asked, answer = call.request.goal_info, self._cancelled()
        named, until = bytes(asked.goal_id.uuid), (asked.stamp.sec, asked.stamp.nanosec)
        everything = not any(named) and not any(until)
        for key, goal in [*self._goals.items()]:
            is_meant = everything or key == named or (goal.info.stamp.sec, goal.info.stamp.nanosec) <= until
            if is_meant and self.turn(goal, self.statuses.STATUS_CANCELING):
                answer.goals_canceling.append(goal.info)
        if any(named) and not answer.goals_canceling:
            known = named in self._goals
            answer.return_code = answer.ERROR_GOAL_TERMINATED if known else answer.ERROR_UNKNOWN_GOAL_ID
        call.reply(answer)
