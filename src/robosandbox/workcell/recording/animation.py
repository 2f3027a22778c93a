"""Animated GIFs of an episode, small enough for a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

# Number of colours of the palette; chosen because a scene with a still background needs few, and one palette for all
# frames lets a frame hold only the pixels that changed.
_COLOURS = 96
# Number of frames that the palette is made of; chosen so that what comes into view late has its colours, too.
_SAMPLES = 8


def write_gif(pictures: Sequence[NDArray[np.uint8]], path: Path, seconds: float) -> None:
    """Write pictures as a GIF that repeats without end.

    Args:
        pictures: At least one, RGB (height, width, 3) uint8, all of one size.
        path: The file; one that exists is replaced.
        seconds: How long each picture is shown; the format keeps hundredths.
    """
    from PIL import Image

    chosen = np.linspace(0, len(pictures) - 1, min(_SAMPLES, len(pictures))).astype(int)
    palette = Image.fromarray(np.concatenate([pictures[index] for index in chosen])).quantize(_COLOURS)
    # Dithering would change pixels of the still background from frame to frame.
    frames = [Image.fromarray(item).quantize(palette=palette, dither=Image.Dither.NONE) for item in pictures]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=round(1000.0 * seconds), loop=0)
