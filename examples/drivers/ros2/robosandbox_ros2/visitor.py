"""A node of somebody else's: plain rclpy, nothing of RoboSandbox but its messages.

uv run --project examples/drivers/ros2 robo-sandbox ros2 --task pick_from_three
uv run --project examples/drivers/ros2 python -m robosandbox_ros2.visitor "pick up the red cube"
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
# As for `robo-sandbox ros2`: pictures are larger than Fast DDS's shared memory takes as it comes.
os.environ.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "LARGE_DATA")

import rclpy
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from robosandbox_msgs.action import Perform, Say
from robosandbox_msgs.msg import Things
from robosandbox_msgs.srv import Look
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray


class Visitor:
    """A client of a workcell's node.

    Args:
        node: Name of that node.
    """

    def __init__(self, node: str = "robosandbox") -> None:
        rclpy.init()
        self.node, self._name = rclpy.create_node("visitor"), node
        self.heard: list[str] = []
        self._say = ActionClient(self.node, Say, f"/{node}/say")
        self._perform = ActionClient(self.node, Perform, f"/{node}/perform")

    def wait(self, seconds: float = 30.0) -> None:
        """Wait for the workcell."""
        assert self._say.wait_for_server(seconds) and self._perform.wait_for_server(seconds), "no workcell is there"

    def say(self, sentence: str, *, cancel_after: float | None = None) -> Any:
        """Say a sentence; return the action's result."""
        return self._goal(self._say, Say.Goal(sentence=sentence), cancel_after)

    def perform(self, name: str, *, cancel_after: float | None = None, **arguments: Any) -> Any:
        """Have a skill or an order carried out; return the action's result."""
        return self._goal(self._perform, Perform.Goal(name=name, arguments=json.dumps(arguments)), cancel_after)

    def _goal(self, client: ActionClient, goal: Any, cancel_after: float | None) -> Any:
        self.heard = []
        asked = client.send_goal_async(goal, feedback_callback=lambda news: self.heard.append(news.feedback.said))
        handle = self._await(asked)
        if cancel_after is not None:
            self.spin(cancel_after)
            handle.cancel_goal_async()
        return self._await(handle.get_result_async()).result

    def spin(self, seconds: float) -> None:
        """Listen for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.01)

    def call(self, kind: Any, name: str, **fields: Any) -> Any:
        """Call a service; return its answer."""
        client = self.node.create_client(kind, f"/{self._name}/{name}")
        assert client.wait_for_service(10.0), f"no service {name}"
        answer = self._await(client.call_async(kind.Request(**fields)))
        self.node.destroy_client(client)
        return answer

    def next(self, kind: Any, topic: str, qos: Any = 10, seconds: float = 20.0) -> Any:
        """Return the next message of a topic."""
        came: list[Any] = []
        subscription = self.node.create_subscription(kind, topic, came.append, qos)
        end = time.monotonic() + seconds
        while not came and time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.05)
        self.node.destroy_subscription(subscription)
        assert came, f"nothing on {topic} for {seconds:g} s"
        return came[0]

    def _await(self, asked: Any, seconds: float = 120.0) -> Any:
        rclpy.spin_until_future_complete(self.node, asked, timeout_sec=seconds)
        assert asked.done(), "no answer"
        return asked.result()

    def close(self) -> None:
        """Leave."""
        self.node.destroy_node()
        rclpy.shutdown()


def look_round(visitor: Visitor) -> str:
    """See what a workcell tells of itself; return it in a line."""
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    described = visitor.next(String, "/robot_description", latched).data
    joints = visitor.next(JointState, "/joint_states")
    frames = {one.child_frame_id: one.header.frame_id for one in visitor.next(TFMessage, "/tf", 100).transforms}
    assert all(f'<joint name="{name}"' in described for name in joints.name), "a joint is not described"
    assert all(f'<link name="{child}"' in described for child in frames if child != "tcp" and "optical" not in child)
    things = visitor.next(Things, "/robosandbox/things")
    markers = visitor.next(MarkerArray, "/robosandbox/markers")
    assert len(markers.markers) == 1 + 2 * len(things.things)
    looked = visitor.call(Look, "look")
    assert {one.id for one in looked.things.things} == {one.id for one in things.things}
    return f"{len(joints.name)} joints, {len(frames)} frames, {', '.join(one.id for one in things.things)}"


def see(visitor: Visitor, camera: str = "scene") -> str:
    """Look through a camera; return what came in a line."""
    place = f"/robosandbox/{camera}"
    # Its info alone is asked for, and pictures as RViz does (RELIABLE) and as drivers do (BEST_EFFORT).
    info = visitor.next(CameraInfo, f"{place}/camera_info")
    picture = visitor.next(Image, f"{place}/image_raw")
    assert visitor.next(CameraInfo, f"{place}/depth/camera_info", qos_profile_sensor_data).k.tolist() == info.k.tolist()
    depth = visitor.next(Image, f"{place}/depth/image_raw", qos_profile_sensor_data)
    assert (info.width, info.height) == (picture.width, picture.height) == (depth.width, depth.height)
    assert picture.encoding == "rgb8" and len(set(picture.data)) > 20, "it is black"
    assert picture.header.frame_id == f"{camera}_optical"
    return f"{picture.width} x {picture.height}"


def main() -> None:
    """Say the sentences of the command line, one after the other."""
    visitor = Visitor()
    visitor.wait()
    print(look_round(visitor))
    for sentence in sys.argv[1:]:
        result = visitor.say(sentence)
        for line in visitor.heard:
            print(f"    {line}")
        print(f"{sentence}: {'done' if result.success else 'not done'}: {result.message}")
    visitor.close()


if __name__ == "__main__":
    main()
