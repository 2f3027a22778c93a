"""The workcell as a node, over a graph in memory: what is published where, when and with which stamps."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import pytest

from robosandbox import open_session
from robosandbox.errors import InputError
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.ros2 import interfaces
from robosandbox.workcell.ros2.graph import DEFAULT, Qos
from robosandbox.workcell.ros2.node import WorkcellNode

SECONDS = 20.0


class MemoryPublisher:
    """A topic of which every message is kept."""

    def __init__(self) -> None:
        self.messages: list[Any] = []
        self.listeners = 0

    def publish(self, message: Any, /) -> None:
        self.messages.append(message)

    def get_subscription_count(self) -> int:
        return self.listeners

    def next(self) -> Any:
        """Return a message that is published after this."""
        count, end = len(self.messages), time.monotonic() + SECONDS
        while len(self.messages) == count:
            assert time.monotonic() < end, "nothing is published"
            time.sleep(0.005)
        return self.messages[-1]


class MemoryGraph:
    """A graph of one node; actions and services are functions by their names."""

    def __init__(self) -> None:
        self.topics: dict[str, MemoryPublisher] = {}
        self.qos: dict[str, Qos] = {}
        self.actions: dict[str, Callable[[Any], Any]] = {}

    def kind(self, name: str) -> Any:
        return interfaces.kind(name)

    def publisher(self, kind: str, topic: str, qos: Qos = DEFAULT) -> MemoryPublisher:
        self.topics[topic], self.qos[topic] = MemoryPublisher(), qos
        return self.topics[topic]

    def serve(self, kind: str, name: str, answer: Callable[[Any, Any], Any]) -> None: ...

    def serve_action(self, kind: str, name: str, act: Callable[[Any], Any]) -> None:
        self.actions[name] = act

    def start(self) -> None: ...

    def close(self) -> None: ...


@contextmanager
def serving(
    driver: str = "mujoco", *, world: str = "world", **options: Any
) -> Iterator[tuple[WorkcellHost, MemoryGraph]]:
    with open_session("pick_cube_franka", driver=driver, **options) as cell:
        host, graph = WorkcellHost(cell, pace="realtime"), MemoryGraph()
        host.start()
        try:
            node = WorkcellNode(host, graph, world=world)
            node.start()
            try:
                yield host, graph
            finally:
                node.close()
        finally:
            host.close()


def seconds(message: Any) -> float:
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


def test_joints_are_told_of_with_their_own_stamp_while_the_worlds_thread_is_busy() -> None:
    with serving() as (host, graph):
        joints = graph.topics["/joint_states"]
        joints.next()
        busy, go_on = threading.Event(), threading.Event()

        def think() -> None:
            busy.set()
            assert go_on.wait(SECONDS)

        activity = host.change("think", think)
        assert busy.wait(SECONDS)
        began = time.time()
        told = [joints.next() for _ in range(10)]
        go_on.set()
        activity.done.result(SECONDS)
        assert len({seconds(one) for one in told[1:]}) == 1 and seconds(told[-1]) <= began
        end = time.monotonic() + SECONDS
        while seconds(joints.next()) <= began:
            assert time.monotonic() < end
        stamps = [seconds(one) for one in joints.messages]
        assert stamps == sorted(stamps)


@pytest.mark.gl
def test_a_machine_keeps_the_topics_that_are_its_own() -> None:
    with serving("hardware:clock=wall", world="table", perception="rgbd") as (host, graph):
        assert {topic for topic in graph.topics if not topic.startswith("~/")} == {"/tf"}
        told = graph.topics["~/joint_states"].next()
        assert "joint1" in told.name
        frames = {one.child_frame_id: one.header.frame_id for one in graph.topics["/tf"].next().transforms}
        assert frames == {
            f"robosandbox/{camera}_optical": "table" for camera in host.embedded.driver.capabilities.cameras
        }
        assert "<robot" in graph.topics["~/robot_description"].messages[0].data


def test_the_world_of_a_simulated_robot_has_the_name_of_its_description() -> None:
    with pytest.raises(InputError, match="--world-frame table"), serving(world="table"):
        pass


@pytest.mark.gl
def test_joints_have_the_stamp_of_their_reading_however_old_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    with serving("hardware:clock=wall", perception="rgbd") as (host, graph):
        arm = type(next(iter(host.embedded.driver.behind.arms.values())))
        state = arm.state
        monkeypatch.setattr(arm, "state", lambda self: replace(state(self), time=-5.0))
        joints = graph.topics["~/joint_states"]
        joints.next()
        stamps = [seconds(joints.next()) for _ in range(3)]
        assert max(stamps) - min(stamps) < 0.02 and time.time() - max(stamps) > 5.0


class Goal:
    """A goal's handle as rclpy has it, with what came of it."""

    is_cancel_requested = False
    ended = ""

    def __init__(self, request: Any) -> None:
        self.request = request

    def publish_feedback(self, feedback: Any) -> None: ...

    def succeed(self) -> None:
        self.ended = "succeeded"

    def abort(self) -> None:
        self.ended = "aborted"


def test_a_timeout_that_is_none_is_an_invalid_argument_and_nothing_is_begun() -> None:
    with serving() as (host, graph):
        perform = interfaces.kind("robosandbox_msgs/action/Perform").Goal
        before = host.embedded.driver.state().q
        for timeout in (-1.0, float("nan"), float("inf"), 1e9):
            goal = Goal(perform(name="move_by", arguments='{"dz": -0.1}', timeout=timeout))
            result = graph.actions["~/perform"](goal)
            assert (goal.ended, result.success, result.code) == ("aborted", False, "invalid_argument"), timeout
            assert result.message.startswith(f"timeout is {timeout:g}; give simulated seconds above 0"), result.message
        assert host.doing is None
        # An arm that holds sags by some nanoradians.
        assert host.embedded.driver.state().q == pytest.approx(before, abs=1e-4)
        goal = Goal(perform(name="open_gripper", arguments="{}", timeout=5.0))
        assert graph.actions["~/perform"](goal).success and goal.ended == "succeeded"


@pytest.mark.gl
@pytest.mark.parametrize(("kind", "place"), [("rgb", "~/scene"), ("depth", "~/scene/depth")])
def test_a_camera_is_drawn_where_somebody_hears_its_info_alone(kind: str, place: str) -> None:
    with serving() as (_, graph):
        pictures, info = graph.topics[f"{place}/image_raw"], graph.topics[f"{place}/camera_info"]
        info.listeners = 1
        told = info.next()
        image = pictures.messages[-1]
        assert (told.width, told.height, seconds(told)) == (image.width, image.height, seconds(image))
        others = {"~/scene/image_raw", "~/scene/depth/image_raw"} - {f"{place}/image_raw"}
        assert not any(graph.topics[other].messages for other in others), f"{kind} alone is asked for"
