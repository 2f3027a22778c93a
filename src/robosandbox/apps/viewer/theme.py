"""Theme and small helpers around viser's handles."""

from __future__ import annotations

from typing import TypeVar

import viser

BRAND = (32, 92, 158)  # Channels of 255 levels. Chosen: white letters on it have a contrast of 6.9.

ValueT = TypeVar("ValueT")


def assign(handle: viser.GuiInputHandle[ValueT], value: ValueT) -> None:
    """Set what an input shows, in all browsers."""
    # Viser's setter stands apart from its getter, where mypy does not find it.
    handle.value = value  # type: ignore[misc]
