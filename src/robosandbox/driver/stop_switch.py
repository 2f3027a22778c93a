"""A stop from outside of any program: a file that somebody makes, or a button of a gamepad or of another input device."""

from __future__ import annotations

import os
import stat
import struct
from pathlib import Path
from select import PIPE_BUF

from robosandbox.errors import InputError

# Events as Linux has them: of joysticks (linux/joystick.h) time, value, type and number; of all input devices (linux/input.h)
# seconds, microseconds, type, code and value.
_JOYSTICK, _INPUT = struct.Struct("=IhBB"), struct.Struct("@llHHi")
_JOYSTICK_BUTTON, _INPUT_KEY = 1, 1


class StopSwitch:
    """Tells at every control tick whether somebody asks from outside that nothing moves.

    Args:
        path: A file, which asks while it exists; or a device, as `/dev/input/js0` or `/dev/input/event5`, which asks from when
            one of its buttons is pressed, or it is gone, until `reset`.

    Raises:
        InputError: There is no such device, or it cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._why, self._rest = "", b""
        self._event = _JOYSTICK if path.resolve().name.startswith("js") else _INPUT
        self._device: int | None = None
        self._is_device = path.parts[:2] == ("/", "dev") or (path.exists() and _is_read_on(path.stat().st_mode))
        if self._is_device:
            self._open()

    def pressed(self) -> str:
        """Return why nothing is to move, in words; "" where nobody asks for it."""
        if not self._is_device:
            return f"{self.path} is there, which asks for a stop; remove it" if self.path.exists() else ""
        if self._device is None:
            return self._why
        try:
            self._rest += os.read(self._device, PIPE_BUF)
        except BlockingIOError:
            pass
        except OSError as error:
            self._why = self._why or f"the stop switch {self.path} is gone ({error.strerror}); plug it in"
        whole = len(self._rest) // self._event.size * self._event.size
        for event in self._event.iter_unpack(self._rest[:whole]):
            number = self._button(event)
            if number is not None:
                self._why = self._why or f"button {number} of {self.path} was pressed"
        self._rest = self._rest[whole:]
        return self._why

    def reset(self) -> None:
        """Forget what was pressed; a device is opened anew, and asks on where it is gone."""
        if not self._is_device:
            return
        self.close()
        self._why = ""
        try:
            self._open()
        except InputError as error:
            self._why = str(error)

    def close(self) -> None:
        """Let go of a device."""
        if self._device is not None:
            os.close(self._device)
        self._device, self._rest = None, b""

    def _open(self) -> None:
        try:
            self._device = os.open(self.path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise InputError(f"stop switch {self.path}: {error.strerror}; plug it in, or give a file") from None

    def _button(self, event: tuple[int, ...]) -> int | None:
        """Return which button an event says is pressed; None of others, as of sticks and of what a device tells as it is opened."""
        if self._event is _JOYSTICK:
            _, value, kind, number = event
            return number if kind == _JOYSTICK_BUTTON and value == 1 else None
        _, _, kind, number, value = event
        return number if kind == _INPUT_KEY and value == 1 else None


def _is_read_on(mode: int) -> bool:
    """Tell whether a file of a mode is a device or a pipe, of which one reads what comes."""
    return stat.S_ISCHR(mode) or stat.S_ISFIFO(mode)
