"""Cameras that a driver of a real machine is given by name: senses of somebody's own."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Protocol

from robosandbox.driver.protocols import Senses
from robosandbox.errors import InputError

if TYPE_CHECKING:
    from robosandbox.driver.capabilities import CameraSpec, Declares


class Eyes(Senses, Protocol):
    """Senses with cameras, made of a driver by what its option `cameras` names."""

    @property
    def cameras(self) -> Mapping[str, CameraSpec]:
        """By the names that `capture` takes."""
        ...


def open_eyes(named: str, driver: Declares) -> Eyes:
    """Return the senses that `module:function` makes of a driver.

    Raises:
        InputError: There is no such module or function, or its cameras cannot be opened.
    """
    module, _, function = named.partition(":")
    try:
        eyes: Eyes = getattr(import_module(module), function)(driver)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(f"cameras={named}: {error}; give module:function, which Python can import here") from None
    return eyes
