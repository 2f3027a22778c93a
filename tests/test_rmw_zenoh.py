"""ROS 2 over Zenoh's own middleware: hashes and bytes as real wheels of ROS 2 Kilted made them, and a node as a plain session of Zenoh meets it.

`tests/data/ros2_kilted.json` is written by `robosandbox_ros2.wire` in examples/drivers/ros2, which compares far more where those wheels are.
"""

from __future__ import annotations

import json
import struct
import threading
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import zenoh
from support.processes import free_port
from zenoh import ext

from robosandbox.errors import InputError, ServiceUnavailableError
from robosandbox.workcell.ros2.graph import PICTURES, Qos
from robosandbox.workcell.ros2.interfaces import Message, from_bytes, kind, to_bytes, type_hash
from robosandbox.workcell.ros2.rmw_zenoh import RmwZenohGraph
from robosandbox.workcell.zenoh.transport import open_connector

KILTED = json.loads((Path(__file__).parent / "data" / "ros2_kilted.json").read_text())
SAY = kind("robosandbox_msgs/action/Say")
CANCEL = kind("action_msgs/srv/CancelGoal")
ATTACHMENT = struct.Struct("<qqB16s")
SECONDS = 10.0


def interface(name: str) -> Any:
    """Return a message or a service, parts of services and actions among them."""
    home, _, short = name.rpartition("/")
    base, *parts = short.split("_")
    found = kind(f"{home}/{base}")
    for part in parts:
        found = getattr(found, part)
    return found


def filled(made: Any, values: dict[str, Any]) -> Message:
    def one(kind: Any, value: Any) -> Any:
        return filled(kind, value) if isinstance(kind, type) else value

    return made(
        **{
            field.name: [one(field.type, part) for part in values[field.name]]
            if field.many
            else one(field.type, values[field.name])
            for field in made.ros_fields
        }
    )


def test_type_hashes_are_those_of_the_wheels() -> None:
    assert {name: type_hash(interface(name)) for name in KILTED["hashes"]} == KILTED["hashes"]


@pytest.mark.parametrize("golden", KILTED["messages"], ids=lambda golden: golden["type"])
def test_bytes_are_those_of_the_wheels_where_the_wheels_read_them(golden: dict[str, Any]) -> None:
    made, theirs = interface(golden["type"]), bytes.fromhex(golden["bytes"])
    ours = to_bytes(filled(made, golden["values"]))
    differ = {place for place, pair in enumerate(zip(ours, theirs, strict=False)) if pair[0] != pair[1]}
    assert differ | {*range(len(ours), len(theirs))} <= {*golden["unread"]} and len(ours) <= len(theirs)
    assert to_bytes(from_bytes(made, theirs)) == ours


@pytest.mark.parametrize(
    "data",
    [b"", b"\x00\x01\x00\x00", b"\x00\x01\x00\x00\xff\xff\xff\xff", b"\x00\x09\x00\x00" + bytes(40)],
    ids=["nothing", "a header", "a long string", "another encoding"],
)
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="std_msgs/msg/String"):
        from_bytes(kind("std_msgs/msg/String"), data)


def test_a_field_that_is_not_there_cannot_be_set() -> None:
    with pytest.raises(AttributeError):
        kind("sensor_msgs/msg/Image")(depth=1)
    with pytest.raises(AttributeError):
        kind("sensor_msgs/msg/Image")().depth = 1


@pytest.fixture
def router() -> Iterator[str]:
    """Return the endpoint of a router, as rmw_zenohd is one."""
    where = f"tcp/127.0.0.1:{free_port()}"
    config = zenoh.Config()
    for key, value in (("mode", "router"), ("listen/endpoints", [where]), ("scouting/multicast/enabled", False)):
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config):
        yield where


@pytest.fixture
def visitor(router: str) -> Iterator[zenoh.Session]:
    with open_connector((router,), mode="client") as session:
        yield session


@pytest.fixture
def graph(router: str) -> Iterator[RmwZenohGraph]:
    made = RmwZenohGraph("robot", router=router, domain=7)
    yield made
    made.close()


def key(name: str, made: Any) -> str:
    package, group, short = made.ros_name.split("/")
    return f"7/{name}/{package}::{group}::dds_::{short}_/{type_hash(made)}"


def served(session: zenoh.Session, key_expr: str) -> str:
    """Return a service's key once a session has heard of who answers under it: declarations come through the router."""
    heard = threading.Event()
    querier = session.declare_querier(key_expr)
    listener = querier.declare_matching_listener(lambda status: heard.set() if status.matching else None)
    assert querier.matching_status.matching or heard.wait(SECONDS), f"nobody answers under {key_expr}"
    listener.undeclare()
    querier.undeclare()
    return key_expr


def call(session: zenoh.Session, name: str, service: Any, request: Message, number: int = 1) -> Any:
    """Call a service as rmw_zenoh does; return its response."""
    attachment = ATTACHMENT.pack(number, 0, 16, b"0123456789abcdef")
    replies = session.get(
        served(session, key(name, service)),
        payload=to_bytes(request),
        attachment=attachment,
        timeout=SECONDS,
        target=zenoh.QueryTarget.ALL_COMPLETE,
    )
    (reply,) = replies
    assert reply.ok is not None, reply.err
    told = ATTACHMENT.unpack(reply.ok.attachment.to_bytes())
    assert (told[0], *told[2:]) == (number, 16, b"0123456789abcdef")
    return from_bytes(service.Response, reply.ok.payload.to_bytes())


def test_messages_arrive_under_rmw_zenohs_keys_with_number_time_and_sender(
    graph: RmwZenohGraph, visitor: zenoh.Session
) -> None:
    came, two = list[zenoh.Sample](), threading.Event()

    def take(sample: zenoh.Sample) -> None:
        came.append(sample)
        if len(came) == 2:
            two.set()

    states = kind("sensor_msgs/msg/JointState")
    publisher = graph.publisher("sensor_msgs/msg/JointState", "/joint_states")
    assert publisher.get_subscription_count() == 0
    listening = visitor.declare_subscriber(key("joint_states", states), take)
    while not publisher.get_subscription_count():
        assert not two.wait(0.01)
    for angle in (0.5, 0.6):
        publisher.publish(states(name=["joint1"], position=[angle]))
    assert two.wait(SECONDS)
    assert [from_bytes(states, sample.payload.to_bytes()).position for sample in came] == [[0.5], [0.6]]
    first, second = (ATTACHMENT.unpack(sample.attachment.to_bytes()) for sample in came)
    assert (first[0], second[0], first[2]) == (1, 2, 16) and 0 < first[1] <= second[1] and first[3] == second[3]
    listening.undeclare()


def test_who_comes_later_gets_what_is_latched(graph: RmwZenohGraph, visitor: zenoh.Session) -> None:
    text, came = kind("std_msgs/msg/String"), list[str]()
    there = threading.Event()

    def take(sample: zenoh.Sample) -> None:
        came.append(from_bytes(text, sample.payload.to_bytes()).data)
        if came[-1] == "new":
            there.set()

    publisher = graph.publisher("std_msgs/msg/String", "/robot_description", Qos(depth=1, latched=True))
    for data in ("old", "new"):
        publisher.publish(text(data=data))
    # As rmw_zenoh subscribes to what is transient local.
    history = ext.HistoryConfig(detect_late_publishers=True)
    listening = ext.declare_advanced_subscriber(visitor, key("robot_description", text), take, history=history)
    # What is on its way while somebody comes is heard before what is latched.
    assert there.wait(SECONDS) and came[-1] == "new"
    listening.undeclare()


def test_liveliness_tokens_name_node_topics_and_services(graph: RmwZenohGraph, visitor: zenoh.Session) -> None:
    graph.publisher("sensor_msgs/msg/Image", "~/scene/image_raw", PICTURES)
    graph.serve("std_srvs/srv/Trigger", "~/stop", lambda asked, given: given)
    # A token travels on its own; who is there learns of each as it comes.
    came, all_there = set[str](), threading.Event()

    def hear(token: zenoh.Sample) -> None:
        came.add(str(token.key_expr))
        if len(came) == 3:
            all_there.set()

    listening = visitor.liveliness().declare_subscriber("@ros2_lv/7/**", hear, history=True)
    assert all_there.wait(SECONDS), came
    listening.undeclare()
    tokens = sorted(came)
    session = tokens[0].split("/")[2]
    image, trigger = kind("sensor_msgs/msg/Image"), kind("std_srvs/srv/Trigger")
    head = f"@ros2_lv/7/{session}/0"
    assert tokens == [
        f"{head}/0/NN/%/%/robot",
        f"{head}/1/MP/%/%/robot/%robot%scene%image_raw/sensor_msgs::msg::dds_::Image_/{type_hash(image)}/::,5:,:,:,,",
        f"{head}/2/SS/%/%/robot/%robot%stop/std_srvs::srv::dds_::Trigger_/{type_hash(trigger)}/::,10:,:,:,,",
    ]


def test_a_service_answers_and_refuses_what_is_no_request(graph: RmwZenohGraph, visitor: zenoh.Session) -> None:
    reset = kind("robosandbox_msgs/srv/Reset")

    def answer(asked: Any, given: Any) -> Any:
        given.success, given.message = True, f"seed {asked.seed}"
        return given

    graph.serve("robosandbox_msgs/srv/Reset", "~/reset", answer)
    graph.start()
    for payload, attachment in ((None, None), (b"\x00\x01\x00\x00\x01", ATTACHMENT.pack(1, 0, 16, bytes(16)))):
        where = served(visitor, key("robot/reset", reset))
        (refused,) = visitor.get(where, payload=payload, attachment=attachment, timeout=SECONDS)
        assert refused.err is not None
    assert call(visitor, "robot/reset", reset, reset.Request(seed=-3), number=9).message == "seed -3"


def test_an_action_is_accepted_reports_ends_and_is_cancelled(graph: RmwZenohGraph, visitor: zenoh.Session) -> None:
    news, both, pause = list[str](), threading.Event(), threading.Event()

    def act(goal: Any) -> Any:
        goal.publish_feedback(SAY.Feedback(said=goal.request.sentence))
        if goal.request.sentence == "wait":
            while not goal.is_cancel_requested:
                pause.wait(0.001)
            goal.canceled()
            return SAY.Result(message="cancelled")
        goal.succeed()
        return SAY.Result(success=True, message="done")

    def take(sample: zenoh.Sample) -> None:
        news.append(from_bytes(SAY.FeedbackMessage, sample.payload.to_bytes()).feedback.said)
        if len(news) == 2:
            both.set()

    listening = visitor.declare_subscriber(key("robot/say/_action/feedback", SAY.FeedbackMessage), take)
    graph.serve_action("robosandbox_msgs/action/Say", "~/say", act)
    graph.start()
    for sentence, cancelled in (("go home", False), ("wait", True)):
        goal_id = kind("unique_identifier_msgs/msg/UUID")(uuid=[*uuid.uuid4().bytes])
        asked = SAY.SendGoal.Request(goal_id=goal_id, goal=SAY.Goal(sentence=sentence))
        assert call(visitor, "robot/say/_action/send_goal", SAY.SendGoal, asked).accepted
        assert not call(visitor, "robot/say/_action/send_goal", SAY.SendGoal, asked).accepted
        info = kind("action_msgs/msg/GoalInfo")(goal_id=goal_id)
        if cancelled:
            answer = call(visitor, "robot/say/_action/cancel_goal", CANCEL, CANCEL.Request(goal_info=info))
            assert [one.goal_id.uuid for one in answer.goals_canceling] == [goal_id.uuid]
        asked = SAY.GetResult.Request(goal_id=goal_id)
        ended = call(visitor, "robot/say/_action/get_result", SAY.GetResult, asked)
        assert (ended.status, ended.result.success) == ((5, False) if cancelled else (4, True))
        answer = call(visitor, "robot/say/_action/cancel_goal", CANCEL, CANCEL.Request(goal_info=info))
        assert (answer.return_code, answer.goals_canceling) == (CANCEL.Response.ERROR_GOAL_TERMINATED, [])
    asked = SAY.GetResult.Request(goal_id=kind("unique_identifier_msgs/msg/UUID")(uuid=[1] * 16))
    assert call(visitor, "robot/say/_action/get_result", SAY.GetResult, asked).status == 0
    assert both.wait(SECONDS) and news == ["go home", "wait"]
    listening.undeclare()


def test_without_a_router_of_this_machine_it_is_told_at_once() -> None:
    with pytest.raises(ServiceUnavailableError, match="nobody listens"):
        RmwZenohGraph("robot", router=f"tcp/127.0.0.1:{free_port()}")
    for elsewhere in ("localhost", "tcp/192.168.1.5:7447"):
        with pytest.raises(InputError, match="no endpoint of this machine"):
            RmwZenohGraph("robot", router=elsewhere)
