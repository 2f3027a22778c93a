"""Promises of the driver's link to the graph, each tried with a neighbour that publishes single messages."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import rclpy
import rclpy.duration
from geometry_msgs.msg import TransformStamped, WrenchStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, Image, JointState
from tf2_msgs.msg import TFMessage

from robosandbox.drivers.ros2.link import RosLink

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Neighbour:
    """A node that publishes to a link, in this process.

    Args:
        options: Of the link, besides those that a test of it needs not say.

    Attributes:
        sent: How often the last message was published.
    """

    def __init__(self, **options: Any) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node("neighbour", context=self._context)
        given = {
            "joint_states": "/joint_states",
            "controller": "/arm",
            "gripper": None,
            "wrench": None,
            "cameras": (),
            "oldest": 0.3,
        }
        self.link = RosLink("link", stamped=True, world="world", **{**given, **options})
        self._publishers: dict[str, Any] = {}
        self.sent = 0

    def tell(self, topic: str, message: Any, heard: Callable[[], object], qos: Any = 10) -> None:
        """Publish a message again and again until the link has taken it in."""
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(type(message), topic, qos)
        end, self.sent = time.monotonic() + 10.0, 0
        while not heard():
            assert time.monotonic() < end, f"it does not hear {topic}"
            self._publishers[topic].publish(message)
            self.sent += 1
            time.sleep(0.02)

    def lacks(self, joints: Sequence[str] = ()) -> str:
        """Return what the link says is not there."""
        return self.link.missing(joints, 1.0, 0.0)

    def stamp(self, ago: float = 0.0) -> Any:
        """Return a moment as messages have it, so many seconds ago."""
        return (self.node.get_clock().now() - rclpy.duration.Duration(seconds=ago)).to_msg()

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


def a_broken_picture_is_none_and_the_link_goes_on() -> str:
    broken = (
        Image(height=2, width=2, step=0, encoding="rgb8", data=array("B", bytes(12))),
        Image(height=2, width=2, step=6, encoding="rgb8", data=array("B", bytes(11))),
        Image(height=2, width=2, step=3, encoding="rgb8", data=array("B", bytes(6))),
        Image(height=0, width=0, step=0, encoding="rgb8"),
    )
    # With rows that are padded.
    whole = Image(height=2, width=2, step=8, encoding="bgr8", data=array("B", range(16)))
    short = Image(height=480, width=640, step=1280, encoding="16UC1", data=array("B", bytes(100)))
    with neighbour(cameras=("/cam",)) as here:
        heard = 0
        for number, message in enumerate(broken):
            here.tell("/cam/image_raw", message, lambda: here.sent > 5)
            here.tell("/cam/depth/image_raw", short, lambda: here.sent > 5)
            here.tell(
                "/joint_states", JointState(name=[f"j{number}"], position=[0.0]), lambda n=number: _hears(here, n)
            )
            heard += 1
            assert here.link.shot("/cam", "rgb") is None and here.link.shot("/cam", "depth") is None
        here.tell("/cam/image_raw", whole, lambda: here.link.shot("/cam", "rgb"))
        shot = here.link.shot("/cam", "rgb")
        assert shot is not None and shot.pixels.tolist() == [[[2, 1, 0], [5, 4, 3]], [[10, 9, 8], [13, 12, 11]]]
    return f"{heard} broken pictures, then one that is seen"


def _hears(here: Neighbour, number: int) -> bool:
    return here.lacks([f"j{number}"]).startswith("no controller")


def a_link_whose_thread_has_ended_says_so_and_is_revived() -> str:
    with neighbour() as here:

        def fails() -> None:
            raise ValueError("no such number")

        here.link._executor.create_task(fails)
        end = time.monotonic() + 10.0
        while not here.link.ended:
            assert time.monotonic() < end
            time.sleep(0.01)
        said = here.lacks()
        assert "ValueError: no such number" in said, said
        here.link.revive()
        here.tell("/joint_states", JointState(name=["j1"], position=[0.0]), lambda: _hears(here, 1))
    return said


def _placed(parent: str, child: str, x: float, z: float, stamp: Any = None) -> TFMessage:
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id = parent
    if stamp is not None:
        made.header.stamp = stamp
    made.transform.translation.x, made.transform.translation.z = x, z
    return TFMessage(transforms=[made])


def a_frame_that_is_fixed_at_two_places_is_refused() -> str:
    ours, theirs = _placed("world", "base_link", -0.35, 0.04), _placed("world", "base_link", 0.0, 0.0)
    said = []
    for first, second in ((ours, theirs), (theirs, ours)):
        with neighbour(wrench="/wrench") as here:
            here.tell("/tf_static", first, lambda: here.link.frame("base_link"), LATCHED)
            # Of the same place it may be told twice.
            here.tell("/tf_static", first, lambda: here.sent > 5, LATCHED)
            assert here.link.frame("base_link") is not None
            here.tell("/tf_static", second, lambda: here.link.frame("base_link") is None, LATCHED)
            said.append(here.link.astray("base_link"))
    assert all("has base_link twice" in each and "(-0.35, 0, 0.04) in world" in each for each in said), said
    return said[0]


def a_transform_that_moves_grows_old() -> str:
    with neighbour(wrench="/wrench") as here:
        here.tell("/tf", _placed("world", "tool", 0.4, 0.3, here.stamp()), lambda: here.link.frame("tool"))
        time.sleep(0.4)
        assert here.link.frame("tool") is None
        said = here.link.astray("tool")
        here.tell("/tf", _placed("world", "tool", 0.4, 0.3, here.stamp(60.0)), lambda: here.sent > 10)
        assert here.link.frame("tool") is None, "one of a minute ago"
        broken = _placed("world", "tool", float("nan"), 0.3, here.stamp())
        here.tell("/tf", broken, lambda: here.sent > 10)
        here.tell("/tf_static", _placed("world", "fixed", 0.1, 0.0), lambda: here.link.frame("fixed"), LATCHED)
        time.sleep(0.4)
        assert here.link.frame("fixed") is not None and not here.link.ended
    assert "/tf told 0." in said and "0.3 are allowed" in said, said
    return said


def a_wrench_is_as_old_as_its_stamp() -> str:
    with neighbour(wrench="/wrench") as here:
        here.tell("/tf_static", _placed("world", "tool", 0.4, 0.3), lambda: here.link.frame("tool"), LATCHED)
        wrench = WrenchStamped()
        wrench.header.frame_id, wrench.header.stamp = "tool", here.stamp(60.0)
        wrench.wrench.force.z = -1.0
        here.tell("/wrench", wrench, here.link.force)
        told = here.link.force()
        assert told is not None
        age = time.monotonic() - told[0]
        assert 60.0 <= age < 65.0 and told[1].tolist() == [0.0, 0.0, -1.0], (age, told)
        return f"stamped 60 s ago it is {age:.1f} s old"


def a_lens_that_is_not_known_is_told_in_place_of_a_wrong_one() -> str:
    k = [600.0, 0.0, 320.0, 0.0, 600.0, 240.0, 0.0, 0.0, 1.0]
    size = {"width": 640, "height": 480}
    wide = [0.45, -2.6, 7e-4, -2e-4, 1.5, 0.33, -2.4, 1.43]
    said = []
    with neighbour(cameras=("/cam",)) as here:
        for info, words in (
            (CameraInfo(distortion_model="rational_polynomial", d=wide, k=k, **size), "the model rational_polynomial"),
            (CameraInfo(distortion_model="equidistant", d=[0.1, 0.02, -0.03, 0.01], k=k, **size), "equidistant"),
            (CameraInfo(**size), "fx is 0"),
        ):
            here.tell("/cam/camera_info", info, lambda words=words: words in here.link._not_seen("/cam"))
            assert here.link.lens("/cam") is None
            said.append(here.link._not_seen("/cam"))
        for info, k1 in (
            (CameraInfo(distortion_model="plumb_bob", d=[0.1, 0.0, 0.0, 0.0, 0.0], k=k, **size), 0.1),
            (CameraInfo(distortion_model="rational_polynomial", d=[0.0] * 8, k=k, **size), 0.0),
            (CameraInfo(k=k, **size), 0.0),
        ):
            here.tell("/cam/camera_info", info, lambda k1=k1: _k1(here) == k1)
    return said[0]


def _k1(here: Neighbour) -> float | None:
    lens = here.link.lens("/cam")
    return None if lens is None else lens.distortion[0]


CLAIMS = (
    a_joint_that_is_told_of_as_nan_has_no_position_and_no_speed,
    a_broken_picture_is_none_and_the_link_goes_on,
    a_link_whose_thread_has_ended_says_so_and_is_revived,
    a_frame_that_is_fixed_at_two_places_is_refused,
    a_transform_that_moves_grows_old,
    a_wrench_is_as_old_as_its_stamp,
    a_lens_that_is_not_known_is_told_in_place_of_a_wrong_one,
)
