"""The robot as an edited sidecar would have it: transparent, at the new home and base, with the new TCP and reach."""

from __future__ import annotations

import threading

import numpy as np
import viser

from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.layers.tool import REACH_COLOUR, ring
from robosandbox.apps.viewer.preview import PreviewRobot
from robosandbox.apps.viewer.sidecar_file import Changes
from robosandbox.types import Pose

_AXES = 0.08  # Metres of the axes at the TCP. Chosen.


class SidecarPreview(Layer):
    """Draws what a changed sidecar says, before it is written."""

    title = "Preview"
    shown = False
    _preview: PreviewRobot | None = None

    def __init__(self, server: viser.ViserServer) -> None:
        super().__init__(server)
        # Sliders call from several threads.
        self._lock = threading.RLock()

    def clear(self) -> None:
        """Take it away."""
        with self._lock:
            super().clear()
            if self._preview is not None:
                self._preview.remove()
            self._preview = None

    def show(self, changes: Changes, now: Changes) -> None:
        """Draw changes.

        Args:
            changes: To be drawn.
            now: What the robot has that is in the world.
        """
        with self._lock:
            self._show(changes, now)

    def _show(self, changes: Changes, now: Changes) -> None:
        if self._preview is None:
            self._preview = PreviewRobot(self.server, self.blueprint, self.body_scene, self.node("robot"))
        moved = _base(changes) @ _base(now).inverse()
        tcp = self._preview.pose(np.array(changes.home_qpos), moved)
        if changes.tcp_xyz is not None and now.tcp_xyz is not None:
            body = moved @ self._preview.tool_body()
            shift = body.rotation @ (np.array(changes.tcp_xyz) - np.array(now.tcp_xyz))
            tcp = Pose.from_matrix(tcp.position + shift, tcp.rotation)
        x, y, z, w = tcp.quat_xyzw
        base = _base(changes)
        bx, by, bz, bw = base.quat_xyzw
        frame = self.scene.add_frame(
            self.node("tcp"), axes_length=_AXES, axes_radius=0.0025, position=tcp.xyz, wxyz=(w, x, y, z)
        )
        self.keep("tcp", frame)
        self.keep(
            "base",
            self.scene.add_frame(
                self.node("base"), axes_length=0.15, axes_radius=0.004, position=base.xyz, wxyz=(bw, bx, by, bz)
            ),
        )
        height = self.blueprint.scene.table_height + 0.003
        segments = np.concatenate([ring(base.position, radius, height) for radius in self.blueprint.robot.reach])
        self.keep(
            "reach",
            self.scene.add_line_segments(
                self.node("reach"), segments, REACH_COLOUR, thickness=3.0, thickness_units="screen"
            ),
        )


def _base(changes: Changes) -> Pose:
    half = (changes.base_yaw or 0.0) / 2.0
    return Pose(xyz=changes.base_xyz, quat_xyzw=(0.0, 0.0, float(np.sin(half)), float(np.cos(half))))
