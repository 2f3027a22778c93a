"""Camera pictures on a thread of their own, and only while somebody looks."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from robosandbox.driver import Driver
from robosandbox.errors import BusyError, RenderingError, UnsupportedError
from robosandbox.evidence import BusyEvidence
from robosandbox.workcell.zenoh.messages import Picture
from robosandbox.workcell.zenoh.server.pictures import Develop, Format, Kind, Photographer, encode, photographer

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class View:
    """One thing to draw."""

    camera: str
    kind: Kind
    format: Format


@dataclass(frozen=True, slots=True)
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
        self._streams: dict[View, Deliver] = {}
        self._requests: list[tuple[View, Deliver, Refuse]] = []
        self._changed = threading.Condition()
        self._stopping = False
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

    def exchange(self, driver: Driver) -> None:
        """Look through another driver's cameras from now on; call it with `lock` held."""
        self._driver = driver
        with self._changed:
            self._retired.append(self._photographer)
            self._photographer = photographer(driver)
            self._changed.notify_all()

    @property
    def sizes(self) -> Mapping[str, tuple[int, int]]:
        """(height, width) of pictures in pixels, by camera."""
        return self._photographer.sizes()

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
                while not self._stopping and not self._requests and not self._retired:
                    wait = due - time.monotonic() if self._streams else None
                    if wait is not None and wait <= 0.0:
                        break
                    self._changed.wait(wait)
                if self._stopping:
                    break
                asked, self._requests = self._requests, []
                streamed = dict(self._streams) if time.monotonic() >= due else {}
            self._dismiss()
            if streamed:
                due = time.monotonic() + 1.0 / self._photographer.hz
            if asked or streamed:
                self._draw_all(asked, streamed)
        self._retired.append(self._photographer)
        self._dismiss()

    def _draw_all(self, asked: list[tuple[View, Deliver, Refuse]], streamed: dict[View, Deliver]) -> None:
        moment = self._moment({view.camera for view in (*(view for view, _, _ in asked), *streamed)})
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
            if self._stopping:
                return None
        return found[0]

    def _draw(self, view: View, moment: _Moment) -> tuple[bytes, Picture]:
        with self.lock:
            if moment.photographer is not self._photographer:
                raise BusyError("another task was loaded meanwhile; ask again", evidence=BusyEvidence(doing="load"))
            pixels, lens, pose = moment.develop(view.camera, view.kind)
            self.frames += 1
        return encode(pixels, view.format), Picture(
            camera=view.camera,
            boot_id=self._boot_id,
            stamp=moment.stamp,
            time=moment.time,
            intrinsics=lens,
            format=view.format,
            pose_camera_in_world=pose,
        )

    def _dismiss(self) -> None:
        while self._retired:
            self._retired.pop().close()
