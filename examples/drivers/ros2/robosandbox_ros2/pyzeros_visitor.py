"""A node on rmw_zenoh's layout of somebody else's making (pyzeros): nothing of ROS, and nothing of RoboSandbox but its fields.

uv run --project examples/drivers/ros2 robo-sandbox ros2 --rmw-zenoh tcp/localhost:7447 --task pick_from_three &
uv run --project examples/drivers/ros2 python -m robosandbox_ros2.pyzeros_visitor tcp/localhost:7447 "pick up the red cube"
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import time
import uuid
from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

# Where the reader of CDR keeps what it compiles for each class at its first message; else that is the folder one stands in.
os.environ.setdefault("CYDR_CACHE_DIR", str(Path(sys.prefix) / "cydr"))

import msgspec
import numpy as np
import pyzeros
import zenoh
from ros2_pyterfaces.cydr import all_msgs, all_srvs, idl

types = idl.types
_SECONDS = 60.0


class SayGoal(idl.IdlStruct):
    """The sentence."""

    __idl_typename__ = "robosandbox_msgs/action/Say_Goal"
    sentence: types.string = b""
    timeout: types.float64 = types.float64(0)


class SayResult(idl.IdlStruct):
    """The outcome."""

    __idl_typename__ = "robosandbox_msgs/action/Say_Result"
    success: types.boolean = False
    message: types.string = b""
    data: types.string = b""


class SayFeedback(idl.IdlStruct):
    """A line of progress."""

    __idl_typename__ = "robosandbox_msgs/action/Say_Feedback"
    said: types.string = b""


class SaySendGoalRequest(idl.IdlStruct):
    """A goal and its number."""

    __idl_typename__ = "robosandbox_msgs/action/Say_SendGoal_Request"
    goal_id: all_msgs.UUID = msgspec.field(default_factory=all_msgs.UUID)
    goal: SayGoal = msgspec.field(default_factory=SayGoal)


class SaySendGoalResponse(idl.IdlStruct):
    """The answer to a goal."""

    __idl_typename__ = "robosandbox_msgs/action/Say_SendGoal_Response"
    accepted: types.boolean = False
    stamp: all_msgs.Time = msgspec.field(default_factory=all_msgs.Time)


class SayGetResultRequest(idl.IdlStruct):
    """Whose result is asked for."""

    __idl_typename__ = "robosandbox_msgs/action/Say_GetResult_Request"
    goal_id: all_msgs.UUID = msgspec.field(default_factory=all_msgs.UUID)


class SayGetResultResponse(idl.IdlStruct):
    """The end of a goal."""

    __idl_typename__ = "robosandbox_msgs/action/Say_GetResult_Response"
    status: types.int8 = types.int8(0)
    result: SayResult = msgspec.field(default_factory=SayResult)


class SayFeedbackMessage(idl.IdlStruct):
    """Of which goal that is told."""

    __idl_typename__ = "robosandbox_msgs/action/Say_FeedbackMessage"
    goal_id: all_msgs.UUID = msgspec.field(default_factory=all_msgs.UUID)
    feedback: SayFeedback = msgspec.field(default_factory=SayFeedback)


SEND = idl.make_idl_service(
    SaySendGoalRequest, SaySendGoalResponse, typename="robosandbox_msgs/action/Say_SendGoal", _module_name=__name__
)
GET = idl.make_idl_service(
    SayGetResultRequest, SayGetResultResponse, typename="robosandbox_msgs/action/Say_GetResult", _module_name=__name__
)


@dataclass
class Seen:
    """Outcome of a visit."""

    joints: int
    picture: str
    joint_age: float
    results: list[tuple[int, bool, str]] = field(default_factory=list)
    feedback: list[str] = field(default_factory=list)
    judged: bool = False
    tokens: int = 0


async def visit(sentences: list[str], node: str = "robosandbox") -> Seen:
    """See, have sentences carried out, and have the judge asked."""

    async def within(what: Awaitable[Any]) -> Any:
        return await asyncio.wait_for(what, _SECONDS)

    def service(kind: Any, name: str) -> Any:
        return pyzeros.Client(kind, f"/{node}/{name}")

    send, get = service(SEND, "say/_action/send_goal"), service(GET, "say/_action/get_result")
    await within(send.wait_for_service())
    states = pyzeros.Sub(all_msgs.JointState, "/joint_states")
    # What is learnt of a class at its first message is no age of one.
    await within(states.wait_for_next())
    joints = await within(states.wait_for_next())
    age = time.time() - joints.header.stamp.sec - 1e-9 * joints.header.stamp.nanosec
    pictures = pyzeros.Sub(all_msgs.Image, f"/{node}/scene/image_raw")
    image = await within(pictures.wait_for_next())
    pictures.close()
    assert len(image.data) == image.height * image.step and len(np.unique(image.data)) > 20, "it is black"
    seen = Seen(len(joints.name), f"{image.width} x {image.height} {image.encoding.decode()}", age)
    async with heard(node, seen.feedback):
        for sentence in sentences:
            goal_id = all_msgs.UUID(uuid=np.frombuffer(uuid.uuid4().bytes, dtype=np.uint8))
            goal = SayGoal(sentence=sentence.encode())
            assert (await within(send.call_async(SEND.Request(goal_id=goal_id, goal=goal)))).accepted
            ended = await within(get.call_async(GET.Request(goal_id=goal_id)))
            seen.results.append((int(ended.status), bool(ended.result.success), ended.result.message.decode()))
    judge = service(all_srvs.Trigger, "judge")
    seen.judged = bool((await within(judge.call_async(all_srvs.Trigger.Request()))).success)
    return seen


@asynccontextmanager
async def heard(node: str, said: list[str]) -> AsyncIterator[None]:
    """Keep the feedback that comes meanwhile."""
    news = pyzeros.Sub(SayFeedbackMessage, f"/{node}/say/_action/feedback")

    async def listen() -> None:
        async for message in news.listen_reliable():
            said.append(message.feedback.said.decode())

    listening = asyncio.create_task(listen())
    yield
    listening.cancel()


def visited(router: str, sentences: list[str]) -> Seen:
    """Visit a workcell through a router, as a peer, which rmw_zenoh's nodes are."""
    config = zenoh.Config()
    for key, value in {
        "mode": "peer",
        "connect/endpoints": [router],
        "listen/endpoints": ["tcp/127.0.0.1:0"],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session, pyzeros.auto_context(node="visitor", zenoh_session=session):
        seen = asyncio.run(visit(sentences))
        tokens = [str(reply.ok.key_expr) for reply in session.liveliness().get("@ros2_lv/**") if reply.ok]
        # The node's name stands behind domain, session, two numbers, what it is, enclave and namespace.
        seen.tokens = sum(token.split("/")[8] == "robosandbox" for token in tokens)
        return seen


if __name__ == "__main__":
    print(visited(sys.argv[1], sys.argv[2:]))
