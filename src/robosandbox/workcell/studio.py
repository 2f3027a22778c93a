"""Camera pictures on a thread of their own, and only while somebody looks."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping

from robosandbox.driver import Driver
from robosandbox.errors import BusyError, RenderingError, UnsupportedError
from robosandbox.evidence import BusyEvidence
from robosandbox.values import frozen
from robosandbox.workcell.loop import Loop
from robosandbox.workcell.pictures import Develop, Format, Kind, Photographer, encode, photographer
from robosandbox.workcell.zenoh.messages import Picture

_log = logging.getLogger(__name__)


@frozen
class Shot:
    """One picture to be drawn."""

    camera: str
    kind: Kind
    format: Format


@frozen
class _Moment:
    photographer: Photographer
    develop: Develop
    time: float
    stamp: float


Deliver = Callable[[bytes, Picture], None]
Refuse = Callable[[Exception], None]
# Hands over a job that may read the world; it is run between two control ticks.
Read = Callable[[Callable[[], None]], None]


class Studio:
    """Makes pictures of a driver's cameras for streams and single requests.

    Args:
        driver: Whose cameras.
        read: Runs a job in the thread that owns the driver.
        boot_id: For the attachments.

    Attributes:
        lock: Held while the model is drawn; hold it to write into the model.
        frames: How many were drawn.
    """

    def __init__(self, driver: Driver, read: Read, boot_id: str) -> None:
        self.lock = threading.Lock()
        self.frames: int = 0
        self._driver = driver
        self._photographer = photographer(driver)
        # Of drivers that are gone, to be closed in the studio's thread.
        self._retired: list[Photographer] = []
        self._read = read
        self._boot_id = boot_id
        self._streams: dict[Shot, Deliver] = {}
        self._requests: deque[tuple[Shot, Deliver, Refuse]] = deque()
        self._due = 0.0
        self._loop = Loop("cameras", self._act, end=self._leave)

    def start(self) -> None:
        """Begin."""
        self._loop.start()

    def stop(self) -> None:
        """End after the picture in the making."""
        self._loop.stop()

    def exchange(self, driver: Driver) -> None:
        """Look through another driver's cameras from now on; call it with `lock` held."""
        self._driver = driver
        self._retired.append(self._photographer)
        self._photographer = photographer(driver)
        self._loop.wake()

    @property
    def sizes(self) -> Mapping[str, tuple[int, int]]:
        """(height, width) of pictures in pixels, by camera."""
        return self._photographer.sizes()

    def stream(self, shot: Shot, deliver: Deliver | None) -> None:
        """Draw a shot over and over, or no longer."""
        if deliver is None:
            self._streams.pop(shot, None)
        else:
            self._streams[shot] = deliver
        self._loop.wake()

    def request(self, shot: Shot, deliver: Deliver, refuse: Refuse) -> None:
        """Draw a shot once."""
        self._requests.append((shot, deliver, refuse))
        self._loop.wake()

    # In the thread.

    def _act(self) -> float | None:
        """Draw what was asked for, and what is streamed when it is due; return in how many seconds the streams are again."""
        self._dismiss()
        asked = [self._requests.popleft() for _ in range(len(self._requests))]
        streamed = self._streams.copy() if time.monotonic() >= self._due else {}
        if streamed:
            self._due = time.monotonic() + 1.0 / self._photographer.hz
        if asked or streamed:
            self._draw_all(asked, streamed)
        return max(0.0, self._due - time.monotonic()) if self._streams else None

    def _draw_all(self, asked: list[tuple[Shot, Deliver, Refuse]], streamed: dict[Shot, Deliver]) -> None:
        moment = self._moment({shot.camera for shot in (*(shot for shot, _, _ in asked), *streamed)})
        if moment is None:
            return
        for shot, deliver, refuse in asked:
            try:
                deliver(*self._draw(shot, moment))
            except Exception as error:
                refuse(UnsupportedError(str(error)) if isinstance(error, RenderingError) else error)
        for shot, deliver in streamed.items():
            try:
                deliver(*self._draw(shot, moment))
            except BusyError:
                continue
            except Exception as error:
                # Without OpenGL every further picture would fail likewise.
                _log.warning("no pictures of %s: %s", shot.camera, error)
                self.stream(shot, None)

    def _moment(self, cameras: set[str]) -> _Moment | None:
        """Return the world between two ticks; None when the studio is stopping."""
        found: list[_Moment] = []
        ready = threading.Event()

        def take() -> None:
            taken = self._photographer
            found.append(_Moment(taken, taken.expose(cameras), self._driver.time, time.time()))
            ready.set()

        self._read(take)
        while not ready.wait(0.1):
            if self._loop.stopping:
                return None
        return found[0]

    def _draw(self, shot: Shot, moment: _Moment) -> tuple[bytes, Picture]:
        with self.lock:
            if moment.photographer is not self._photographer:
                raise BusyError("another task was loaded meanwhile; ask again", evidence=BusyEvidence(doing="load"))
            pixels, lens, pose = moment.develop(shot.camera, shot.kind)
            self.frames += 1
        return encode(pixels, shot.format), Picture(
            camera=shot.camera,
            boot_id=self._boot_id,
            stamp=moment.stamp,
            time=moment.time,
            intrinsics=lens,
            format=shot.format,
            pose_camera_in_world=pose,
        )

    def _leave(self) -> None:
        self._retired.append(self._photographer)
        self._dismiss()

    def _dismiss(self) -> None:
        while self._retired:
            self._retired.pop().close()
