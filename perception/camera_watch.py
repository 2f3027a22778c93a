"""Cameras that are told to stand still and have been moved: their background is elsewhere in the picture."""

from __future__ import annotations

import itertools
import math

import cv2
import numpy as np

from robosandbox.perception.frame import Image, Mask, PointCloudFrame, TablePrior, as_image
from robosandbox.types import Pose
from robosandbox.values import frozen

# Edges are compared at half of a picture's size: there is less noise, and what is looked for is centimetres.
_SCALE = 0.5
# Grey levels from a pixel to the next up to which there is no edge: noise, and the shadows of a soft light.
_FLAT = 12.0
# Metres over the table's top from which something stands on it, and pixels around that and the robot that may be theirs.
_STANDS, _AROUND = 0.01, 9
# Blocks of a picture, across and down, and edge pixels from which one tells something.
_ACROSS, _DOWN, _LEAST_EDGES = 4, 4, 40
# How alike edges are, 0..1: where all stand where they stood; where a block of them is found again; and how much less alike it is at
# its old place then. A camera that stands still has 1.00 with a sensor's noise and an arm that moved, one moved by 1.5 cm 0.1 to 0.93.
_SAME, _FOUND, _LESS = 0.95, 0.75, 0.25
# Pixels, at half size, around its place within which a block is as like itself anywhere.
_SPOT = 4.0
# Metres on the table by which blocks are looked for elsewhere.
_REACH = 0.08
# Metres, and of a rotation matrix's entries, by which a camera that stands still may be told to be elsewhere.
_TOLD = 1e-4


@frozen(eq=False)
class _Background:
    """Background of a frame: all that stands still in it, at half size.

    Attributes:
        pose: Where the camera is told to be.
        still: Where neither the robot nor anything on the table is, 1 or 0, (height, width).
        edges: How much the grey level changes there, (height, width).
    """

    pose: Pose
    still: Image
    edges: Image


class CameraWatch:
    """Remembers the background of each camera's first frame, and compares later ones with it.

    A camera that is told to be elsewhere, as one on a hand, begins anew. Nothing is told of a picture without edges, nor where a
    camera went along what it looks at and no block is found again.
    """

    def __init__(self) -> None:
        self._first: dict[str, _Background] = {}

    def has_moved(self, frame: PointCloudFrame, robot: Mask, table: TablePrior) -> bool:
        """Return whether a camera has been moved since its first frame.

        Args:
            frame: What it shows now.
            robot: Where the robot is in it, (height, width).
            table: Where the table is known to be.
        """
        now, first = _background(frame, robot, table), self._first.get(frame.camera)
        if first is None or first.edges.shape != now.edges.shape or not _told_alike(first.pose, now.pose):
            self._first[frame.camera] = now
            return False
        both = first.still * now.still
        before, after = first.edges * both, now.edges * both
        product, norm = float((before * after).sum()), float(np.sqrt((before**2).sum() * (after**2).sum()))
        if product >= _SAME * norm:
            return False
        distance = float(np.linalg.norm(frame.position - table.corners().mean(axis=0)))
        reach = math.ceil(_REACH * frame.focal * _SCALE / distance)
        stayed = _stayed(first, now, reach)
        gone = stayed.count(0.0)
        # What somebody covers or carries off is not found again, and a thing beside the table may be moved.
        return gone > max(1.0, sum(stayed))


def _told_alike(one: Pose, other: Pose) -> bool:
    shift, turn = np.abs(one.position - other.position), np.abs(one.rotation - other.rotation)
    return bool(max(shift.max(), turn.max()) < _TOLD)


def _background(frame: PointCloudFrame, robot: Mask, table: TablePrior) -> _Background:
    grey = as_image(cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY))
    grey = as_image(cv2.resize(grey, None, fx=_SCALE, fy=_SCALE, interpolation=cv2.INTER_AREA))
    edges = np.hypot(cv2.Sobel(grey, cv2.CV_32F, 1, 0, scale=0.25), cv2.Sobel(grey, cv2.CV_32F, 0, 1, scale=0.25))
    x, y, z = frame.xyz
    moves = robot | (frame.valid & (z > table.height + _STANDS) & table.within(x, y))
    height, width = edges.shape
    still = 1 - cv2.resize(moves.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    still = as_image(cv2.erode(still, np.ones((_AROUND, _AROUND), np.uint8)))
    return _Background(
        pose=frame.rgbd.pose_camera_in_world, still=still, edges=as_image(np.maximum(edges - _FLAT, 0.0)) * still
    )


def _stayed(first: _Background, now: _Background, reach: int) -> list[float]:
    """Return of each block of edges that is found within `reach` pixels whether it is where it was, 0 or 1; a half where it may be.

    A straight edge that runs on may have moved along itself.
    """
    height, width = first.edges.shape
    down, across = height // _DOWN, width // _ACROSS
    around = [(reach, reach)] * 2
    edges, still = np.pad(now.edges, around), np.pad(now.still, around)
    found = list[float]()
    for top, left in itertools.product(range(0, down * _DOWN, down), range(0, across * _ACROSS, across)):
        block = slice(top, top + down), slice(left, left + across)
        window = slice(top, top + down + 2 * reach), slice(left, left + across + 2 * reach)
        alike = _likeness(first.edges[block], first.still[block], edges[window], still[window])
        best = float(alike.max())
        if best < _FOUND:
            continue
        rows, columns = np.nonzero(alike > best - _LESS)
        off = np.hypot(rows - reach, columns - reach)
        found.append(0.0 if off.min() > 0.0 else 0.5 if off.max() > _SPOT else 1.0)
    return found


def _likeness(edges: Image, still: Image, later: Image, later_still: Image) -> Image:
    """Return how alike a block's edges and later ones are, 0..1, at each place in a larger window; 0 where few tell."""

    def summed(window: Image, block: Image) -> Image:
        return as_image(cv2.matchTemplate(window, block, cv2.TM_CCORR))

    norms = summed(later_still, edges**2) * summed(later**2, still)
    alike = summed(later, edges) / np.sqrt(np.maximum(norms, np.float32(1e-3)))
    return np.where(summed(later_still, as_image(edges > 0.0)) < _LEAST_EDGES, np.float32(0.0), alike)
