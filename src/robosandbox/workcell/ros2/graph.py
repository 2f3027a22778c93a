"""The ROS 2 graph as the node uses it, whoever carries it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

# Calls that may be open at once: one that is carried out, and those that are refused, stopped or looked at beside it.
OPEN_CALLS = 8
# Seconds for which a result can be asked for, as rcl's action servers keep theirs; rclpy of Jazzy has 900 where nothing is said.
RESULT_SECONDS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Qos:
    """Delivery of a topic.

    Attributes:
        depth: Messages that are kept for one who is slow.
        latched: Those that come later get the last ones as well (`TRANSIENT_LOCAL`).
    """

    depth: int = 10
    latched: bool = False


# As ROS 2 has it where nothing is said; and for pictures, of which a few are kept. Both are sent again where they are lost
# (`RELIABLE`): that is what RViz asks for, and those hear it as well who do not ask.
DEFAULT, PICTURES = Qos(), Qos(depth=5)


class Publisher(Protocol):
    """A topic that is published on."""

    def publish(self, message: Any, /) -> None:
        """Send a message."""

    def get_subscription_count(self) -> int:
        """Return how many listen, or 1 for any number."""
        ...


class Graph(Protocol):
    """A node in a graph. A name that begins with `~/` is below the node's."""

    def kind(self, name: str) -> Any:
        """Return the class of an interface, as `sensor_msgs/msg/Image`."""

    def publisher(self, kind: str, topic: str, qos: Qos = DEFAULT) -> Publisher:
        """Advertise a topic."""
        ...

    def serve(self, kind: str, name: str, answer: Callable[[Any, Any], Any]) -> None:
        """Serve a service: the function is given request and response, and returns the response."""

    def serve_action(self, kind: str, name: str, act: Callable[[Any], Any]) -> None:
        """Serve an action: the function is given a goal's handle, as rclpy has it, and returns the result."""

    def start(self) -> None:
        """Begin to answer."""

    def close(self) -> None:
        """Leave the graph."""
