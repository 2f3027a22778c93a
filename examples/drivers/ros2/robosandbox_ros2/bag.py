"""A bag of a workcell's topics: written as rclpy hears them, read back by rosbags, which is no part of ROS.

uv run --project examples/drivers/ros2 robo-sandbox ros2 --task pick_from_three &
uv run --project examples/drivers/ros2 python -m robosandbox_ros2.bag /tmp/cell 5
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from robosandbox.workcell.ros2.interfaces import definitions
from robosandbox.workcell.ros2.rclpy_graph import RclpyGraph
from robosandbox_ros2.visitor import Visitor

SENSORS = ("image_raw", "camera_info")


def typestore() -> Any:
    """Return what rosbags knows of Kilted, with this package's messages."""
    known = get_typestore(Stores.ROS2_KILTED)
    for name, text in definitions().items():
        if name.startswith("robosandbox_msgs/msg/"):
            known.register(get_types_from_msg(text, name))
    return known


def record(visitor: Visitor, topics: dict[str, str], folder: Path, wait: Callable[[], None]) -> Counter[str]:
    """Write all that comes on topics while something is waited for.

    Args:
        visitor: Hears them.
        topics: Each with its type, as `sensor_msgs/msg/JointState`.
        folder: Of the bag; it must not be there.
        wait: Spins until enough has come.

    Returns:
        How many messages of each topic were written.
    """
    known, count = typestore(), Counter[str]()
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        listening = []
        for topic, name in topics.items():
            connection = writer.add_connection(topic, name, typestore=known)

            def write(data: bytes, connection: Any = connection) -> None:
                writer.write(connection, time.time_ns(), data)
                count[connection.topic] += 1

            qos = qos_profile_sensor_data if topic.endswith(SENSORS) else QoSProfile(depth=100)
            listening.append(visitor.node.create_subscription(RclpyGraph.kind(name), topic, write, qos, raw=True))
        wait()
        for one in listening:
            visitor.node.destroy_subscription(one)
    return count


def read(folder: Path) -> dict[str, list[Any]]:
    """Return the messages of a bag, by topic."""
    known, found = typestore(), dict[str, list[Any]]()
    with Reader(folder) as reader:
        for connection, _, data in reader.messages():
            found.setdefault(connection.topic, []).append(known.deserialize_cdr(data, connection.msgtype))
    return found


def topics(camera: str = "scene", node: str = "robosandbox") -> dict[str, str]:
    """Return the topics of a workcell with one of its cameras."""
    return {
        "/joint_states": "sensor_msgs/msg/JointState",
        "/tf": "tf2_msgs/msg/TFMessage",
        f"/{node}/things": "robosandbox_msgs/msg/Things",
        f"/{node}/markers": "visualization_msgs/msg/MarkerArray",
        f"/{node}/{camera}/image_raw": "sensor_msgs/msg/Image",
        f"/{node}/{camera}/depth/image_raw": "sensor_msgs/msg/Image",
        f"/{node}/{camera}/camera_info": "sensor_msgs/msg/CameraInfo",
    }


def main() -> None:
    """Record for some seconds, and say what a reader finds."""
    visitor = Visitor()
    visitor.wait()
    folder, seconds = Path(sys.argv[1]), float(sys.argv[2])
    print(dict(record(visitor, topics(), folder, lambda: visitor.spin(seconds))))
    print({topic: len(messages) for topic, messages in read(folder).items()})
    visitor.close()


if __name__ == "__main__":
    main()
