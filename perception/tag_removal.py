"""Tags removed from pictures: the black and white of a tag gets the colour of the face that it is on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robosandbox.perception.albedo import SIDE_LIGHT
from robosandbox.perception.frame import Mask, PointCloudFrame, TablePrior
from robosandbox.perception.quantiles import median
from robosandbox.perception.tags import Tag, filled
from robosandbox.tags import BORDERED
from robosandbox.types import Array

_LEVEL = 0.004  # Metres from a tag's height within which a point is on its face. Chosen.
# Metres by which depth under a tag may be off before it is taken from the tag's plane. Chosen: stereo errs on black and
# white.
_DEPTH_OFF = 0.008
_FACE = 1.7  # Edge of the face around a tag as a multiple of the tag's, within which its rim is looked for. Chosen.
_SIDES = 2.2  # The same multiple within which the sides below it are looked for. Chosen.
_PIXEL = 0.75  # Pixels that a tag's outline is grown by, because its border is blurred. Chosen.
_LEAST = 5  # Number of pixels that tell a colour. Chosen.
_SAME_HUE = 0.06  # Difference of shares of the channels up to which rim and sides have one colour. Chosen.


def tags_removed(
    sound: Mapping[str, PointCloudFrame], tags: Iterable[Tag], found: Sequence[Tag], table: TablePrior
) -> dict[str, PointCloudFrame]:
    """Return the views with each tag painted over, wherever it was read.

    Args:
        sound: The frames by camera.
        tags: One for each that there is.
        found: All that the views showed by themselves: where a view shows a tag is not left to how cameras are calibrated.
        table: That they are over.
    """
    pictures = {camera: frame.rgb.copy() for camera, frame in sound.items()}
    for tag in tags:
        shown = {camera: _shown_by(camera, tag, found) for camera in sound}
        parts = {camera: part for camera, frame in sound.items() if (part := _part(shown[camera], frame)) is not None}
        covers = {camera: _border(shown[camera], sound[camera], part) for camera, part in parts.items()}
        colours = _face_colours(shown, sound, parts, covers, table)
        for camera, part in parts.items():
            if colours is not None:
                pictures[camera][part][covers[camera]] = colours.get(camera, next(iter(colours.values())))
    return {camera: replace(frame, rgb=pictures[camera]) for camera, frame in sound.items()}


def _shown_by(camera: str, tag: Tag, found: Sequence[Tag]) -> Tag:
    """Return a tag as a camera shows it by itself; as another does where it shows none there."""
    near = [
        other
        for other in found
        if other.camera == camera
        and other.number in (None, tag.number)
        and float(np.linalg.norm(other.centre - tag.centre)) < 0.5 * tag.edge
    ]
    return min(near, key=lambda other: other.number is None, default=tag)


def _border(tag: Tag, frame: PointCloudFrame, part: tuple[slice, slice]) -> Mask:
    """Return the pixels in a part of a view that show a tag or its white border, and nothing before it."""
    pixels, _ = frame.project(tag.scaled(BORDERED))
    # A pixel that the border's edge runs through is of both.
    middle = pixels.mean(axis=0)
    out = pixels - middle
    pixels = middle + out * (1.0 + _PIXEL / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1.0))
    valid = frame.valid[part]
    mask = filled(pixels - [part[1].start, part[0].start], valid.shape) > 0
    off = np.abs(frame.xyz[2, part[0], part[1]] - np.float32(tag.centre[2])) > max(_DEPTH_OFF, 4.0 * frame.noise)
    return np.asarray(mask & ~(off & valid))


def _face_colours(
    shown: Mapping[str, Tag],
    sound: Mapping[str, PointCloudFrame],
    parts: Mapping[str, tuple[slice, slice]],
    covers: Mapping[str, Mask],
    table: TablePrior,
) -> dict[str, Array] | None:
    """Return the colour (3,) of the face around a tag in each camera's light; of the nearest guess where it shows too little."""
    rims: dict[str, NDArray[np.uint8]] = {}
    sides: list[NDArray[np.uint8]] = []
    for camera, crop in parts.items():
        frame, tag = sound[camera], shown[camera]
        x, y, z = frame.xyz[:, crop[0], crop[1]]
        colours = frame.rgb[crop]
        far = np.hypot(x - np.float32(tag.centre[0]), y - np.float32(tag.centre[1])) / tag.edge
        usable = frame.valid[crop] & ~covers[camera]
        level = np.abs(z - np.float32(tag.centre[2])) < max(_LEVEL, 2.0 * frame.noise)
        rims[camera] = colours[usable & level & (far < _FACE / np.sqrt(2.0))]
        below = (z < tag.centre[2] - 2.0 * _LEVEL) & (z > table.height + 2.0 * _LEVEL)
        sides.append(colours[usable & below & (far < _SIDES / np.sqrt(2.0))])
    whole = np.vstack([np.zeros((0, 3), dtype=np.uint8), *sides]).astype(np.float64)
    if len(whole) >= _LEAST:
        hue = _shares(median(whole)[None])[0]
        rims = {camera: rim[np.abs(_shares(rim) - hue).max(axis=1) < _SAME_HUE] for camera, rim in rims.items()}
    seen = {camera: _brighter_half(rim.astype(np.float64)) for camera, rim in rims.items() if len(rim) >= _LEAST}
    if seen:
        most = max(seen, key=lambda camera: len(rims[camera]))
        return {most: seen[most], **seen}
    if len(whole) < _LEAST:
        return None
    return {next(iter(parts)): np.clip(median(whole) / SIDE_LIGHT, 0.0, 255.0)}


def _brighter_half(colours: Array) -> Array:
    """Return the median colour (3,) of the brighter half of colours (n, 3): at a face's edge pixels show a darker side too."""
    total = colours.sum(axis=1)
    return np.asarray(median(colours[total >= np.median(total)]))


def _part(tag: Tag, frame: PointCloudFrame) -> tuple[slice, slice] | None:
    """Return the part of a picture around a tag that shows the thing it is on; None where it is not in the picture."""
    pixels, depths = frame.project(tag.scaled(_SIDES))
    height, width = frame.depth.shape
    if (depths < 0.02).any():
        return None
    reach = float(np.linalg.norm(pixels - pixels.mean(axis=0), axis=1).max())
    low = np.maximum(np.floor(pixels.mean(axis=0) - 1.5 * reach).astype(int), 0)
    high = np.minimum(np.ceil(pixels.mean(axis=0) + 1.5 * reach).astype(int), [width, height])
    return None if (high <= low).any() else (slice(low[1], high[1]), slice(low[0], high[0]))


def _shares(colours: NDArray[np.generic]) -> Array:
    """Return the shares of red and green (n, 2) of colours (n, 3)."""
    known = np.asarray(colours, dtype=np.float64)
    return np.asarray(known[:, :2] / np.maximum(known.sum(axis=1, keepdims=True), 1.0))
