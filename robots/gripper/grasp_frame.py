"""Grasp frame of a gripper: the middle of where its closed pads meet, with closing and approach axes."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from robosandbox.robots.gripper.calibrate import place
from robosandbox.robots.gripper.pads import Pads, outer_points, pad_gap
from robosandbox.robots.surfaces import world_points
from robosandbox.types import Array
from robosandbox.values import frozen

_CELL = 0.002  # Metres a side of the cells in which facing pads are compared. Chosen: a tenth of a narrow pad.
_CONTACT = 0.0015  # Metres over the least gap within which pads meet. Chosen below `_CELL`.
_TIP_MARGIN = 0.007  # Metres that the grasp point stays behind the fingertips. Chosen: half of a small pad.
# Length, metres, from which a pad holds things near its tip and not at its middle. Chosen: longer than a cube is high.
_LONG_PAD = 0.042
_TYPICAL_OBJECT = 0.025  # Width of a typical object, metres. Chosen: the cubes of docs/arms.md have 24 mm.
# Fingers that go back behind a frame by this share of what they go beyond it have it between them.
_BETWEEN = 0.5


@frozen
class GraspFrame:
    """A measured TCP in the world of the closed gripper.

    Attributes:
        position: Shape (3,).
        closing: Unit vector from the first side to the second, shape (3,).
        across: The same as it was measured, not snapped to an axis.
        approach: Unit vector out of the gripper, shape (3,).
        spread: Size of the area over which the pads meet, along the approach, metres.
        tip: How far along the approach the fingers go on beyond the position, metres.
    """

    position: Array
    closing: Array
    across: Array
    approach: Array
    spread: float
    tip: float


def measure_tcp(
    model: mujoco.MjModel, data: mujoco.MjData, pads: Pads, closed_qpos: Array, grasp_qpos: Array, axes: Array
) -> GraspFrame:
    """Find the middle of the area where the closed pads meet.

    Args:
        model: The robot.
        data: Scratch.
        pads: Its pads.
        closed_qpos: Configuration with the gripper closed, shape (nq,).
        grasp_qpos: With it around an object; the closing axis is measured there.
        axes: Directions in the closed world that a designer would have meant, unit rows (k, 3); snapped to.
    """
    place(model, data, grasp_qpos)
    gap, across = pad_gap(model, data, pads.geoms)
    if gap < 1e-5:
        across = data.geom_xpos[pads.geoms[1]] - data.geom_xpos[pads.geoms[0]]
    across = across / np.linalg.norm(across)
    closing = _snap(across, axes, 15.0)
    place(model, data, closed_qpos)
    left, right = (
        outer_points(model, data, side, other) for side, other in ((pads.left, pads.right), (pads.right, pads.left))
    )
    near = (data.geom_xpos[pads.geoms[0]] + data.geom_xpos[pads.geoms[1]]) / 2.0
    palm = data.xpos[int(model.body_parentid[min(pads.left)])]
    if int(model.body_weldid[min(pads.right)]) == int(model.body_weldid[model.body_parentid[min(pads.left)]]):
        palm = (palm + data.xpos[min(pads.left)]) / 2.0
    tips = np.concatenate([left, right])
    palm = behind_fingers(model, data, (pads.left, pads.right), tips, palm, closing)
    outward = _farthest(tips, palm) - palm
    outward = outward - closing * (closing @ outward)
    approach = _snap(outward / np.linalg.norm(outward), axes, 30.0)
    approach = approach - closing * (closing @ approach)
    approach /= np.linalg.norm(approach)
    position, spread = _meeting(left, right, closing, approach, near)
    tip = max(0.0, float(((tips - position) @ approach).max()))
    return GraspFrame(position, closing, across, approach, spread, tip)


def mean_frame(frames: list[GraspFrame], axes: Array) -> GraspFrame:
    """Return the grasp frame between several pairs of fingers: as far out as that of the first, in the middle of all.

    Args:
        frames: One per pair.
        axes: Directions that a designer would have meant, unit rows (k, 3); snapped to.
    """
    first = frames[0]
    if len(frames) == 1:
        return first
    across = np.mean([frame.across for frame in frames], axis=0)
    closing = _snap(across / np.linalg.norm(across), axes, 15.0)
    approach = first.approach - closing * (closing @ first.approach)
    approach /= np.linalg.norm(approach)
    position = np.mean([frame.position for frame in frames], axis=0)
    position = position + approach * (approach @ (first.position - position))
    return replace(first, position=position, closing=closing, approach=approach)


def behind_fingers(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    sides: tuple[frozenset[int], frozenset[int]],
    points: Array,
    root: Array,
    closing: Array,
) -> Array:
    """Return a point from which the fingers point outward, shape (3,).

    That is `root`, unless it lies between them, as a frame does that says where a gripper holds things: then the middle of
    what carries the fingers.

    Args:
        model: The robot.
        data: Its posture.
        sides: Bodies of the two sides.
        points: On the fingers, shape (k, 3).
        root: Where they hang by their frames, shape (3,).
        closing: Unit vector across them, shape (3,).
    """
    outward = _farthest(points, root) - root
    outward = outward - closing * (closing @ outward)
    length = float(np.linalg.norm(outward))
    along = (points - root) @ (outward / max(length, 1e-9))
    if length > 1e-4 and along.min() > -_BETWEEN * along.max():
        return root
    above = int(model.body_weldid[model.body_parentid[min(sides[0] | sides[1])]])
    carriers = [b for b in range(1, model.nbody) if int(model.body_weldid[b]) == above and b not in sides[0] | sides[1]]
    geoms = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in carriers]
    if not geoms:
        return root
    middle: Array = world_points(model, data, geoms, 0.005).mean(axis=0)
    return middle


def _farthest(points: Array, root: Array) -> Array:
    """Return the middle of the 50 points farthest from one, shape (3,)."""
    middle: Array = points[np.linalg.norm(points - root, axis=1).argsort()[-50:]].mean(axis=0)
    return middle


def _meeting(left: Array, right: Array, closing: Array, approach: Array, near: Array) -> tuple[Array, float]:
    """Return the centre of the area where two facing surfaces are closest, and its length along the approach."""
    side = np.cross(closing, approach)
    frame = np.column_stack([side, closing, approach])
    a, b = (left - near) @ frame, (right - near) @ frame
    low = np.minimum(a.min(axis=0), b.min(axis=0))
    cell_a, cell_b = (np.floor((p[:, [0, 2]] - low[[0, 2]]) / _CELL).astype(int) for p in (a, b))
    shape = np.maximum(cell_a.max(axis=0), cell_b.max(axis=0)) + 1
    front_a = np.full(shape, -np.inf)
    front_b = np.full(shape, np.inf)
    # A surface faces the other side where it is nearest to it; what lies beyond the other's middle wraps around it.
    middle_a, middle_b = float(np.median(a[:, 1])), float(np.median(b[:, 1]))
    facing_a, facing_b = a[:, 1] < max(middle_b, 0.0) + 0.003, b[:, 1] > min(middle_a, 0.0) - 0.003
    np.maximum.at(front_a, (cell_a[facing_a, 0], cell_a[facing_a, 1]), a[facing_a, 1])
    np.minimum.at(front_b, (cell_b[facing_b, 0], cell_b[facing_b, 1]), b[facing_b, 1])
    gap = front_b - front_a
    both = np.isfinite(gap)
    if not both.any():
        return near, 0.0
    least = float(np.percentile(gap[both], 5))
    meets = both & (gap <= least + _CONTACT)
    x, z = np.nonzero(meets)
    weight = np.ones(len(x))
    centre_x = float(np.average(x, weights=weight) + 0.5) * _CELL + low[0]
    heights = (z + 0.5) * _CELL + low[2]
    tip = float(max(a[:, 2].max(), b[:, 2].max()))
    # Fingers that touch all along hold things near their tips.
    length = float(heights.max() - heights.min())
    held_at = float(np.median(heights)) if length < _LONG_PAD else float(heights.max()) - _LONG_PAD / 2.0
    centre_z = min(held_at, tip - _TIP_MARGIN)
    centre_y = float(np.median((front_a[meets] + front_b[meets]) / 2.0))
    return near + frame @ np.array([centre_x, centre_y, centre_z]), float(heights.max() - heights.min() + _CELL)


def _snap(direction: Array, axes: Array, degrees: float) -> Array:
    """Return the axis nearest to a direction when it is within so many degrees, signed."""
    if len(axes):
        cosines = axes @ direction
        best = int(np.abs(cosines).argmax())
        if abs(cosines[best]) > np.cos(np.radians(degrees)):
            return np.asarray(axes[best] * np.sign(cosines[best]))
    return direction


def grasp_sample(aperture: Array) -> int:
    """Return the sample at which a gripper would hold a common object: 25 mm, or 40% of what it opens to."""
    wanted = min(_TYPICAL_OBJECT, 0.4 * float(aperture.max()))
    return int(np.abs(aperture - wanted).argmin())
