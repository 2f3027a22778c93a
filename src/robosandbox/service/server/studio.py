"""Camera pictures on a thread of their own: drawn from a copy of the state, and only while somebody looks."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import BusyError, RenderingError, UnsupportedError
from robosandbox.evidence import BusyEvidence
from robosandbox.service.messages import Picture
from robosandbox.sim.modelled import Modelled
from robosandbox.sim.state_renderer import StateRenderer
from robosandbox.types import Array

_log = logging.getLogger(__name__)
# Pictures a second of a stream; chosen as cameras deliver them.
_MOST_HZ = 30.0
# Of 100, as OpenCV counts; chosen where edges of objects show no blocks.
_JPEG_QUALITY = 85

Kind = Literal["rgb", "depth"]
Format = Literal["jpeg", "png", "raw"]
ENCODINGS: dict[Format, str] = {"jpeg": "image/jpeg", "png": "image/png", "raw": "application/octet-stream"}


@dataclass(frozen=True, slots=True)
class View:
    """One thing to draw."""

    camera: str
    kind: Kind
    format: Format


@dataclass(frozen=True, slots=True)
class _Moment:
    sim: Modelled
    state: Array
    time: float
    stamp: float


Deliver = Callable[[bytes, Picture], None]
Refuse = Callable[[Exception], None]
# Hands over a job that may read the world; it is run between two control ticks.
Read = Callable[[Callable[[], None]], None]


class Studio:
    """Draws cameras of a sim for streams and single requests.

    Args:
        sim: Whose state is drawn.
        read: Runs a job in the thread that owns the sim.
        boot_id: For the attachments.

    Attributes:
        lock: Held while the model is drawn; hold it to write into the model.
        frames: How many were drawn.
    """

    def __init__(self, sim: Modelled, read: Read, boot_id: str) -> None:
        self.lock = threading.Lock()
        self.frames: int = 0
        self._sim = sim
        self._read = read
        self._boot_id = boot_id
        self._streams: dict[View, Deliver] = {}
        self._requests: list[tuple[View, Deliver, Refuse]] = []
        self._changed = threading.Condition()
        self._stopping = False
        self._renderer: StateRenderer | None = None
        self._thread = threading.Thread(target=self._loop, name="cameras", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End after the picture in the making."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        self._thread.join()

    def exchange(self, sim: Modelled) -> None:
        """Draw another sim from now on; call it with `lock` held."""
        self._sim = sim

    def stream(self, view: View, deliver: Deliver | None) -> None:
        """Draw a view over and over, or no longer."""
        with self._changed:
            if deliver is None:
                self._streams.pop(view, None)
            else:
                self._streams[view] = deliver
            self._changed.notify_all()

    def request(self, view: View, deliver: Deliver, refuse: Refuse) -> None:
        """Draw a view once."""
        with self._changed:
            self._requests.append((view, deliver, refuse))
            self._changed.notify_all()

    # In the thread.

    def _loop(self) -> None:
        due = 0.0
        while True:
            with self._changed:
                while not self._stopping and not self._requests:
                    wait = due - time.monotonic() if self._streams else None
                    if wait is not None and wait <= 0.0:
                        break
                    self._changed.wait(wait)
                if self._stopping:
                    break
                asked, self._requests = self._requests, []
                streamed = dict(self._streams) if time.monotonic() >= due else {}
            if streamed:
                due = time.monotonic() + 1.0 / _MOST_HZ
            self._draw_all(asked, streamed)
        self._release()

    def _draw_all(self, asked: list[tuple[View, Deliver, Refuse]], streamed: dict[View, Deliver]) -> None:
        moment = self._moment()
        if moment is None:
            return
        for view, deliver, refuse in asked:
            try:
                deliver(*self._draw(view, moment))
            except Exception as error:
                refuse(UnsupportedError(str(error)) if isinstance(error, RenderingError) else error)
        for view, deliver in streamed.items():
            try:
                deliver(*self._draw(view, moment))
            except BusyError:
                continue
            except Exception as error:
                # Without OpenGL every further picture would fail likewise.
                _log.warning("no pictures of %s: %s", view.camera, error)
                self.stream(view, None)

    def _moment(self) -> _Moment | None:
        """Return the state between two ticks; None when the studio is stopping."""
        found: list[_Moment] = []
        ready = threading.Event()

        def take() -> None:
            found.append(_Moment(self._sim, self._sim.snapshot(), self._sim.time, time.time()))
            ready.set()

        self._read(take)
        while not ready.wait(0.1):
            if self._stopping:
                return None
        return found[0]

    def _draw(self, view: View, moment: _Moment) -> tuple[bytes, Picture]:
        with self.lock:
            sim = self._sim
            if moment.sim is not sim:
                raise BusyError("another task was loaded meanwhile; ask again", evidence=BusyEvidence(doing="load"))
            name = sim.camera_in_model(view.camera)
            drawn, lens, pose = self._prepared(sim).draw(moment.state, name, depth=view.kind == "depth")
            self.frames += 1
        return encode(drawn, view.format), Picture(
            camera=view.camera,
            boot_id=self._boot_id,
            stamp=moment.stamp,
            time=moment.time,
            intrinsics=lens,
            format=view.format,
            pose_camera_in_world=pose,
        )

    def _prepared(self, sim: Modelled) -> StateRenderer:
        if self._renderer is None or not self._renderer.draws(sim):
            self._release()
            self._renderer = StateRenderer(sim)
        return self._renderer

    def _release(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None


def encode(picture: NDArray[np.uint8] | NDArray[np.float32], format: Format) -> bytes:
    """Return a picture as bytes.

    Args:
        picture: RGB (height, width, 3) uint8, or depth in metres (height, width) float32.
        format: `jpeg` (RGB only), `png` (depth as 16-bit millimetres), or `raw` (the array's bytes).

    Raises:
        ValueError: Depth as JPEG.
    """
    if format == "raw":
        return picture.tobytes()
    import cv2

    if picture.ndim == 3:
        flags = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY] if format == "jpeg" else [cv2.IMWRITE_PNG_COMPRESSION, 1]
        _, encoded = cv2.imencode(".jpg" if format == "jpeg" else ".png", picture[..., ::-1], flags)
    elif format == "png":
        millimetres = np.clip(np.round(1000.0 * picture), 0, 65535).astype(np.uint16)
        _, encoded = cv2.imencode(".png", millimetres, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    else:
        raise ValueError("depth has no JPEG form; ask for png or raw")
    return bytes(encoded)
