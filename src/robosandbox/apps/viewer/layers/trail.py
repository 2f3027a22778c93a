"""The way that the TCP has come."""

from __future__ import annotations

import time
from collections import deque

import mujoco
import numpy as np
import viser

from robosandbox.apps.viewer.layers.layer import Layer
from robosandbox.apps.viewer.news import Began, Doing, Loaded, News, Went
from robosandbox.apps.viewer.source import Frame
from robosandbox.types import Array

_STEP = 0.004  # Metres between points. Chosen.
_JUMP = 0.1  # Metres from which the tool was put elsewhere, and the trail begins anew. Chosen.
_LONGEST = 600  # Number of points. Chosen: 2.4 m.
_SECONDS = 0.1  # Seconds between drawings. Chosen.
_OLD, _NEW = np.array([178, 205, 236]), np.array([24, 92, 190])


class TcpTrail(Layer):
    """Draws where the TCP was since something was begun."""

    title = "TCP trail"
    hint = "The way that the tool centre point has come"

    _points: deque[Array]
    _sent = 0.0

    def hear(self, news: News) -> None:
        """Begin anew with each prompt."""
        match news:
            case Began(Doing.RUNNING, _) | Went() | Loaded():
                self.clear()
            case _:
                pass

    def clear(self) -> None:
        """Forget the way."""
        super().clear()
        self._points = deque(maxlen=_LONGEST)

    def draw(self, frame: Frame, data: mujoco.MjData) -> None:
        """Take the TCP's place."""
        here = frame.seen.arms[self.blueprint.arm].tcp_pose.position
        far = float(np.linalg.norm(here - self._points[-1])) if self._points else np.inf
        if self._points and far > _JUMP:
            self._points.clear()
        if far > _STEP:
            self._points.append(here)
        if len(self._points) < 2 or time.monotonic() - self._sent < _SECONDS or far <= _STEP:
            return
        self._sent = time.monotonic()
        self.keep("line", polyline(self, "line", np.array(self._points), _OLD, _NEW, 3.0))


def polyline(
    layer: Layer, name: str, points: Array, first: Array, last: Array, thickness: float
) -> viser.LineSegmentsHandle:
    """Add a line through points (k, 3), its colour going from one to the other; return its handle."""
    share = np.linspace(0.0, 1.0, len(points))[:, None]
    colours = ((1.0 - share) * first + share * last).astype(np.uint8)
    return layer.scene.add_line_segments(
        layer.node(name),
        np.stack([points[:-1], points[1:]], axis=1),
        np.stack([colours[:-1], colours[1:]], axis=1),
        thickness=thickness,
        thickness_units="screen",
    )
