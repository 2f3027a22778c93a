"""Promises of the driver's link to the graph, each tried with a neighbour that publishes single messages."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState

from robosandbox.drivers.ros2.link import RosLink

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Neighbour:
    """A node that publishes to a link, in this process.

    Args:
        options: Of the link, besides those that a test of it needs not say.
    """

    def __init__(self, **options: Any) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node("neighbour", context=self._context)
        given = {"joint_states": "/joint_states", "controller": "/arm", "gripper": None, "wrench": None, "cameras": ()}
        self.link = RosLink("link", stamped=True, world="world", **{**given, **options})
        self._publishers: dict[str, Any] = {}

    def tell(self, topic: str, message: Any, heard: Callable[[], object], qos: Any = 10) -> None:
        """Publish a message again and again until the link has taken it in."""
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(type(message), topic, qos)
        end = time.monotonic() + 10.0
        while not heard():
            assert time.monotonic() < end, f"it does not hear {topic}"
            self._publishers[topic].publish(message)
            time.sleep(0.02)

    def lacks(self, joints: Sequence[str] = ()) -> str:
        """Return what the link says is not there."""
        return self.link.missing(joints, 1.0, 0.0)

    def stamp(self, ago: float = 0.0) -> Any:
        """Return a moment as messages have it, so many seconds ago."""
        return (self.node.get_clock().now() - rclpy.time.Duration(seconds=ago)).to_msg()

    def close(self) -> None:
        """Leave the graph, and the link as well."""
        self.link.close()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)


@contextmanager
def neighbour(**options: Any) -> Iterator[Neighbour]:
    """Open a link, and a neighbour of it."""
    opened = Neighbour(**options)
    try:
        yield opened
    finally:
        opened.close()


def a_joint_that_is_told_of_as_nan_has_no_position_and_no_speed() -> str:
    nan = float("nan")
    with neighbour() as here:

        def tell(positions: tuple[float, ...], speeds: tuple[float, ...], heard: Callable[[], object]) -> None:
            message = JointState(name=["a", "b"], position=[*positions], velocity=[*speeds])
            here.tell("/joint_states", message, heard)

        tell((0.1, nan), (nan, nan), lambda: here.lacks(["a"]).startswith("no controller"))
        (reading,) = here.link.readings(["a"])
        assert (reading.position, reading.velocity) == (0.1, None), reading
        missing = here.lacks(["a", "b"])
        assert missing.startswith("the position of b is told as NaN"), missing
        tell((0.2, 0.3), (0.0, 0.0), lambda: here.lacks(["a", "b"]).startswith("no controller"))
        before = here.link.readings(["b"])
        tell((nan, nan), (0.0, 0.0), lambda: here.lacks(["b"]).startswith("the position of b"))
        assert here.link.readings(["b"]) == before, "it counts as new"
    return missing


CLAIMS = (a_joint_that_is_told_of_as_nan_has_no_position_and_no_speed,)
