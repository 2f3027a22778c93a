# pyright: reportMissingImports=false
"""A ROS 2 graph through rclpy, and so through whichever middleware it is set to."""

from __future__ import annotations

import threading
from collections.abc import Callable
from importlib import import_module
from typing import Any

import rclpy
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from robosandbox.workcell.ros2.graph import DEFAULT, OPEN_CALLS, RESULT_SECONDS, Publisher, Qos


class RclpyGraph:
    """A node of rclpy's.

    Args:
        name: Of the node.
    """

    def __init__(self, name: str) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node(name, context=self._context)
        self._group = ReentrantCallbackGroup()
        self._actions: list[ActionServer] = []
        self._executor = MultiThreadedExecutor(num_threads=OPEN_CALLS, context=self._context)
        self._executor.add_node(self._node)
        self._spinning = threading.Thread(target=self._executor.spin, name="ros2", daemon=True)

    @staticmethod
    def kind(name: str) -> Any:
        """Return the class of an interface.

        Raises:
            ImportError: This ROS has no such package.
        """
        module, _, short = name.rpartition("/")
        return getattr(import_module(module.replace("/", ".")), short)

    def publisher(self, kind: str, topic: str, qos: Qos = DEFAULT) -> Publisher:
        """Advertise a topic."""
        profile = QoSProfile(
            depth=qos.depth,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if qos.latched else DurabilityPolicy.VOLATILE,
            reliability=ReliabilityPolicy.RELIABLE,
        )
        publisher: Publisher = self._node.create_publisher(self.kind(kind), topic, profile)
        return publisher

    def serve(self, kind: str, name: str, answer: Callable[[Any, Any], Any]) -> None:
        """Serve a service."""
        self._node.create_service(self.kind(kind), name, answer, callback_group=self._group)

    def serve_action(self, kind: str, name: str, act: Callable[[Any], Any]) -> None:
        """Serve an action."""
        self._actions.append(
            ActionServer(
                self._node,
                self.kind(kind),
                name,
                act,
                cancel_callback=lambda goal: CancelResponse.ACCEPT,
                callback_group=self._group,
                result_timeout=RESULT_SECONDS,
            )
        )

    def start(self) -> None:
        """Begin to answer."""
        self._spinning.start()

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._spinning.join()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)
