"""Pictures for models that see."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray


def png(picture: NDArray[Any]) -> bytes:
    """Return an RGB picture (height, width, 3) uint8 as a PNG file's bytes."""
    import cv2

    # OpenCV's order of channels is blue, green, red.
    _, data = cv2.imencode(".png", picture[:, :, ::-1])
    return data.tobytes()
