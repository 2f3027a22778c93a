"""Cameras that a driver of a real machine is given by name: senses of somebody's own."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from robosandbox.driver.passing import PassingSenses
from robosandbox.driver.protocols import Senses
from robosandbox.errors import InputError, RoboSandboxError, SensorError

if TYPE_CHECKING:
    from robosandbox.driver.capabilities import CameraSpec
    from robosandbox.driver.wall_clock import WallClockDriver
    from robosandbox.types import PictureWindow, RgbdFrame


class Eyes(Senses, Protocol):
    """Senses with cameras, made of a driver by what its option `cameras` names."""

    @property
    def cameras(self) -> Mapping[str, CameraSpec]:
        """By the names that `capture` takes."""
        ...


def open_eyes(named: str, driver: WallClockDriver) -> Eyes:
    """Return a driver's cameras: those of a file of webcams (`NAME.yaml`), or what `module:function` makes of the driver.

    Raises:
        InputError: There is no such file, module or function, or its cameras cannot be opened.
    """
    if Path(named).suffix in (".yaml", ".yml"):
        # OpenCV takes half a second to import and is needed only where there are webcams.
        from robosandbox.driver.webcams import Webcams

        return Webcams(driver, Path(named))
    module, _, function = named.partition(":")
    try:
        eyes: Eyes = getattr(import_module(module), function)(driver)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(
            f"cameras={named}: {error}; give a file of webcams, or module:function, which Python can import here"
        ) from None
    return _OwnEyes(eyes)


class _OwnEyes(PassingSenses):
    """Senses of somebody's own: what goes wrong in them is a camera's fault, not one of a skill."""

    def __init__(self, eyes: Eyes) -> None:
        super().__init__(eyes)
        self.cameras: Mapping[str, CameraSpec] = eyes.cameras

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what a camera's sensor delivers.

        Raises:
            SensorError: It raised something, which is told.
        """
        try:
            return super().capture(camera, window)
        except RoboSandboxError:
            raise
        except Exception as fault:
            raise SensorError(f"camera {camera!r}: {type(fault).__name__}: {fault}") from fault
