"""The robot as its sidecar has it: TCP frame and closing axis, base, reach, home; for what is drawn and what is edited."""

from __future__ import annotations

from abc import ABC, abstractmethod

import mujoco
import numpy as np

from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.preview import PreviewRobot
from robosandbox.apps.viewer.scene import BodyScene
from robosandbox.apps.viewer.source import Blueprint, Frame
from robosandbox.types import Array, Pose

_AXES, _RADIUS = 0.07, 0.0022
_CLOSING = (20, 165, 60)  # Channels of 255 levels. Chosen green, as of the y axis.
REACH_COLOUR = (235, 150, 25)  # Channels of 255 levels. Chosen.
_ABOVE = 0.002  # Metres over the table, so that it does not hide the line. Chosen.
_RING = 72  # Number of pieces of a circle. Chosen.


class TcpFrame(Layer):
    """Draws the TCP's axes, red x, green y, blue z; z is the approach and the long green line the closing axis."""

    title = "TCP and closing axis"
    hint = "Red x, green y (the fingers close along it), blue z (the approach)"
    shown = False

    def draw(self, frame: Frame, data: mujoco.MjData) -> None:
        """Follow the TCP."""
        self.place(frame.seen.arms[self.blueprint.arm].tcp_pose)

    def place(self, pose: Pose) -> None:
        """Draw the frame at a pose in the world."""
        x, y, z, w = pose.quat_xyzw
        held = self._kept.get("frame")
        if held is not None:
            held.position, held.wxyz = pose.position, np.array([w, x, y, z])
            return
        node = self.node("frame")
        axes = self.scene.add_frame(
            node, axes_length=_AXES, axes_radius=_RADIUS, origin_radius=0.004, wxyz=(w, x, y, z), position=pose.xyz
        )
        self.scene.add_line_segments(
            f"{node}/closing",
            np.array([[[0.0, -1.4 * _AXES, 0.0], [0.0, 1.4 * _AXES, 0.0]]]),
            _CLOSING,
            thickness=3.0,
            thickness_units="screen",
        )
        self.keep("frame", axes)


class OfRobot(Layer, ABC):
    """Drawings that depend on the robot alone: made once when it is shown, and again over another world."""

    shown = False

    def adopt(self, blueprint: Blueprint, body_scene: BodyScene) -> None:
        """Draw over another world."""
        super().adopt(blueprint, body_scene)
        if self.shown:
            self._show()

    def switch(self, shown: bool) -> None:
        """Show or hide it."""
        super().switch(shown)
        if shown:
            self._show()

    @abstractmethod
    def _show(self) -> None:
        """Draw it."""


class BaseAndReach(OfRobot):
    """Draws the robot's base frame and the ring on the table in which it works."""

    title = "Base and reach"
    hint = "The base frame, and between the rings where the tool points down at the table"

    def _show(self) -> None:
        robot = self.blueprint.robot
        base = robot.base_position
        self.keep("base", self.scene.add_frame(self.node("base"), axes_length=0.15, axes_radius=0.004, position=base))
        height = self.blueprint.scene.table_height + _ABOVE
        segments = np.concatenate([ring(base, radius, height) for radius in robot.reach])
        self.keep(
            "reach",
            self.scene.add_line_segments(
                self.node("reach"), segments, REACH_COLOUR, thickness=3.0, thickness_units="screen"
            ),
        )


class HomePreview(OfRobot):
    """Draws the arm a second time, transparent, at the sidecar's home."""

    title = "Home"
    hint = "The arm at its home configuration, transparent"
    _preview: PreviewRobot | None = None

    def clear(self) -> None:
        """Remove the transparent robot."""
        super().clear()
        if self._preview is not None:
            self._preview.remove()
        self._preview = None

    def _show(self) -> None:
        self._preview = PreviewRobot(self.server, self.blueprint, self.body_scene, self.node("robot"))
        self._preview.pose(self.blueprint.robot.home_q)


def ring(centre: Array, radius: float, height: float) -> Array:
    """Return a horizontal circle as line segments, shape (k, 2, 3)."""
    angles = np.linspace(0.0, 2.0 * np.pi, _RING + 1)
    points = np.column_stack(
        [centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles), np.full(_RING + 1, height)]
    )
    return np.stack([points[:-1], points[1:]], axis=1)
