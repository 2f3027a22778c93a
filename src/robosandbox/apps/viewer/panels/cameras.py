"""Camera pictures with what perception sees drawn into them; rendered while the panel is switched on, and not otherwise."""

from __future__ import annotations

import itertools
import threading
import time
from concurrent.futures import Future
from functools import partial
from typing import Any

import cv2
import numpy as np
import viser
from numpy.typing import NDArray

from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.news import Loaded, News
from robosandbox.apps.viewer.source import Frame, WorldSource
from robosandbox.apps.viewer.theme import assign
from robosandbox.types import Array, DetectedObject, ObservedScene
from robosandbox.workcell.zenoh.messages import Picture

_SECONDS = 0.35  # Seconds between frames of a live camera. Chosen: a frame costs about 50 ms of CPU to draw.
_INK, _PAPER = (40, 220, 90), (20, 40, 25)


class CamerasPanel:
    """Shows one camera while it is switched on.

    Args:
        server: Where.
        source: Has the cameras.
    """

    def __init__(self, server: viser.ViserServer, source: WorldSource) -> None:
        self._source = source
        gui = server.gui
        self._live = gui.add_checkbox("Live picture", False, hint="Pictures are rendered only while this is on")
        self._name = gui.add_dropdown("Camera", tuple(source.host.cell.cameras))
        self._marks = gui.add_checkbox("Perception", True, hint="Draw what perception sees into the picture")
        self._picture = gui.add_image(np.full((12, 16, 3), 235, np.uint8), visible=False)
        self._words = gui.add_html("")
        self._asked = 0.0
        self._waiting = threading.Lock()
        for handle in (self._live, self._marks):
            handle.on_update(lambda _: self._changed())
        self._name.on_update(lambda _: self._changed())

    def hear(self, news: News) -> None:
        """Take news."""
        if isinstance(news, Loaded):
            cameras = tuple(self._source.host.cell.cameras)
            self._name.options = cameras
            if self._name.value not in cameras:
                assign(self._name, cameras[0])

    def draw(self, frame: Frame) -> None:
        """Ask for a picture of a world that moves, a few times a second."""
        del frame
        if self._live.value and time.monotonic() - self._asked > _SECONDS:
            self._ask()

    def _changed(self) -> None:
        self._picture.visible = self._live.value
        self._words.content = ""
        if self._live.value:
            self._ask()

    def _ask(self) -> None:
        # One at a time: rendering on a CPU takes longer than asking.
        if not self._waiting.acquire(blocking=False):
            return
        self._asked = time.monotonic()
        host = self._source.host
        host.reading(host.cell.observe).add_done_callback(self._photograph)

    def _photograph(self, seen: Future[ObservedScene]) -> None:
        if error := seen.exception():
            self._refuse(error)
            return
        taken = self._source.host.picture(self._name.value, "jpeg")
        taken.add_done_callback(partial(self._show, seen.result()))

    def _show(self, scene: ObservedScene, taken: Future[tuple[bytes, Picture]]) -> None:
        if error := taken.exception():
            self._refuse(error)
            return
        jpeg, about = taken.result()
        try:
            decoded: Any = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
            # OpenCV's order of channels is blue, green, red.
            picture: NDArray[np.uint8] = decoded[:, :, ::-1].copy()
            if self._marks.value:
                for item in scene.objects:
                    mark(picture, item, about)
            self._picture.image = picture
            self._words.content = html.block(html.rows(map(_said, scene.objects)))
        finally:
            self._waiting.release()

    def _refuse(self, error: BaseException) -> None:
        self._words.content = html.block(html.line(" ".join(str(error).split()), "red"))
        self._waiting.release()


def mark(picture: NDArray[np.uint8], item: DetectedObject, camera: Picture) -> None:
    """Draw an object's box and name into a picture (height, width, 3), RGB, in place."""
    corners = project(box_corners(item), camera)
    if corners is None:
        return
    for first, second in itertools.combinations(range(8), 2):
        if (first ^ second).bit_count() == 1:
            ends = [tuple(int(c) for c in corners[index]) for index in (first, second)]
            cv2.line(picture, ends[0], ends[1], _INK, 1, cv2.LINE_AA)
    text = f"{item.id} {item.confidence:.2f}" if item.confidence < 1.0 else item.id
    place = (int(corners[:, 0].min()), max(10, int(corners[:, 1].min()) - 4))
    for colour, width in ((_PAPER, 3), (_INK, 1)):
        cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.38, colour, width, cv2.LINE_AA)


def box_corners(item: DetectedObject) -> Array:
    """Return the corners (8, 3) in the world of the box around an object; bits of the index are signs of x, y, z."""
    from robosandbox.world.relations import support

    axes = item.pose.rotation.T
    ahead = support(item, axes)
    behind = -support(item, -axes)
    signs = np.array([[index >> axis & 1 for axis in range(3)] for index in range(8)], dtype=bool)
    # Supports are measured from the world's origin along each axis of the object.
    return np.where(signs, ahead, behind) @ axes


def project(points: Array, camera: Picture) -> Array | None:
    """Return where points (k, 3) of the world are in a picture, pixels (k, 2); None if one is behind the camera."""
    local = (points - camera.pose_camera_in_world.position) @ camera.pose_camera_in_world.rotation
    if (local[:, 2] < 1e-3).any():
        return None
    lens = camera.intrinsics
    pixels: Array = local[:, :2] / local[:, 2:] * [lens.fx, lens.fy] + [lens.cx, lens.cy]
    return pixels


def _said(item: DetectedObject) -> tuple[str, str]:
    place = ", ".join(html.number(1000 * c, 0) for c in item.pose.xyz)
    sure = "" if item.confidence >= 1.0 else f", {100 * item.confidence:.0f} % sure"
    return item.id, f"{item.colour} {item.kind} at {place} mm{sure}"
