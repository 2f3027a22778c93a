"""Where a gripper's two sides meet: the pads, the gap between them, the closing axis, the grasp point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.surfaces import world_points
from robosandbox.robots.sweep import collision_geoms, place
from robosandbox.types import Array

_MAX_DISTANCE = 1.0
# Sides that come closer by less than this between open and closed do not close, metres.
_LEAST_TRAVEL = 1e-3
_TRAVEL_SHARE = 0.6
_CELL = 0.002
_CONTACT = 0.0015
_TIP_MARGIN = 0.007
_LONG_PAD = 0.042
_TYPICAL_OBJECT = 0.025
# A finger beside another closes as far as it does: by this much less, metres, and reaches as far, as a share.
_ALLY_GAP = 0.01
_ALLY_REACH = 0.9
# Three fingers around a circle close at 120 degrees to each other, the cosine of which this is below.
_ALLY_COSINE = -0.6
# Fingers that go back behind a frame by this share of what they go beyond it have it between them.
_BETWEEN = 0.5


@dataclass(frozen=True, slots=True)
class Pads:
    """The two sides of a gripper, and the geoms on them that close on an object."""

    left: frozenset[int]
    right: frozenset[int]
    geoms: tuple[int, int]
    travel: float


def find_pads(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    groups: list[frozenset[int]],
    closed_qpos: Array,
    open_qpos: Array,
    tcp: tuple[int, Array] | None = None,
) -> Pads:
    """Return the pair of geoms that comes from far apart to closest.

    Args:
        model: The robot.
        data: Scratch.
        groups: Its gripper's sides.
        closed_qpos: Configuration with the gripper closed, shape (nq,).
        open_qpos: And open.
        tcp: Body and position in it of a known grasp point: among pads that all close, the ones around it are taken.

    Raises:
        InputError: No two sides move against each other.
    """
    pairs = [
        (left, right, a, b)
        for left, right in combinations(groups, 2)
        for a in collision_geoms(model, left)
        for b in collision_geoms(model, right)
    ]
    if not pairs:
        raise InputError("gripper.joints: no two sides with collision geometry move against each other")
    place(model, data, open_qpos)
    opened = [max(-1e-3, _distance(model, data, a, b)) for _, _, a, b in pairs]
    place(model, data, closed_qpos)
    closed = [max(-1e-3, _distance(model, data, a, b)) for _, _, a, b in pairs]
    near = [0.0] * len(pairs)
    if tcp is not None:
        body, offset = tcp
        point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ offset
        near = [_box_distance(model, data, a, point) + _box_distance(model, data, b, point) for _, _, a, b in pairs]
    travels = [o - c for o, c in zip(opened, closed, strict=True)]
    most = max(travels)
    if most < _LEAST_TRAVEL:
        if min(travels) < -_LEAST_TRAVEL:
            raise InputError(
                "gripper.open_qpos: the wrong way round: the two sides are farther apart at closed_qpos than at open_qpos; "
                "swap the two values, or give them the other sign"
            )
        raise InputError(
            "gripper.joints: its two sides come no closer when the actuator is driven over its range; "
            "name the joints that move the fingers"
        )
    best = min(
        (k for k in range(len(pairs)) if travels[k] >= _TRAVEL_SHARE * most),
        key=lambda k: (round(closed[k] + 0.5 * near[k] - 0.3 * travels[k], 5), k),
    )
    left, right, a, b = pairs[best]
    return Pads(left, right, (a, b), travels[best])


def opposed_pads(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    groups: list[frozenset[int]],
    pads: Pads,
    closed_qpos: Array,
    open_qpos: Array,
) -> list[Pads]:
    """Return the pads with those of further fingers that close on one of them: of three fingers two stand against one.

    The side that stands alone is on the same side of each.

    Args:
        model: The robot.
        data: Scratch.
        groups: Its gripper's sides.
        pads: The pair found among them.
        closed_qpos: Configuration with the gripper closed, shape (nq,).
        open_qpos: And open.
    """
    motions, reaches = {}, {}
    palm = int(model.body_parentid[min(pads.left)])
    for group in groups:
        points = []
        for qpos in (open_qpos, closed_qpos):
            place(model, data, qpos)
            there = world_points(model, data, collision_geoms(model, group), 0.005)
            far = np.linalg.norm(there - data.xpos[palm], axis=1)
            points.append(there[far.argsort()[-50:]].mean(axis=0))
            reaches[group] = float(far.max())
        motions[group] = (points[1] - points[0]) / max(float(np.linalg.norm(points[1] - points[0])), 1e-9)
    closed = _distance(model, data, *pads.geoms)
    found = [pads]
    for group in groups:
        if group in (pads.left, pads.right):
            continue
        mate = max((pads.left, pads.right), key=lambda side: float(motions[side] @ motions[group]))
        if motions[mate] @ motions[group] < _ALLY_COSINE or reaches[group] < _ALLY_REACH * reaches[mate]:
            continue
        try:
            pair = [group, pads.right] if mate is pads.left else [pads.left, group]
            ally = find_pads(model, data, pair, closed_qpos, open_qpos)
        except InputError:
            continue
        place(model, data, closed_qpos)
        if (
            ally.travel >= _TRAVEL_SHARE * pads.travel
            and _distance(model, data, *ally.geoms) < max(closed, 0.0) + _ALLY_GAP
            and all((one.left is pads.left) == (mate is not pads.left) for one in (ally, *found[1:]))
        ):
            found.append(ally)
    return found


def openness(model: mujoco.MjModel, data: mujoco.MjData, groups: list[frozenset[int]], qpos: Array) -> float:
    """Return a number that grows as a gripper opens, metres.

    On hinges it is the distance between the outer parts, since parts beside the hinge stay close; on slides the mean
    distance over all pairs of geoms.
    """
    place(model, data, qpos)
    hinged = any(
        model.jnt_type[int(model.body_jntadr[b])] == mujoco.mjtJoint.mjJNT_HINGE.value
        for group in groups
        for b in group
        if model.body_jntnum[b] and not any(int(model.body_parentid[min(other)]) in group for other in groups)
    )
    if hinged:
        return far_gap(model, data, groups, qpos)
    distances = [
        _distance(model, data, a, b)
        for left, right in combinations(groups, 2)
        for a in collision_geoms(model, left)
        for b in collision_geoms(model, right)
    ]
    return float(np.mean(distances)) if distances else 0.0


def far_gap(model: mujoco.MjModel, data: mujoco.MjData, groups: list[frozenset[int]], qpos: Array) -> float:
    """Return the least distance between the outer parts of two sides, metres: small when closed, large when open."""
    place(model, data, qpos)
    least = np.inf
    for left, right in combinations(groups, 2):
        first, second = (
            _outer_points(model, data, side, other, 0.75) for side, other in ((left, right), (right, left))
        )
        first, second = first[:: max(1, len(first) // 600)], second[:: max(1, len(second) // 600)]
        least = min(least, float(np.linalg.norm(first[:, None] - second[None], axis=2).min()))
    return least


def pad_gap(model: mujoco.MjModel, data: mujoco.MjData, pads: tuple[int, int]) -> tuple[float, Array]:
    """Return the distance between two geoms, and the vector from the first to the second, shape (3,)."""
    fromto = np.zeros(6)
    gap = mujoco.mj_geomDistance(model, data, pads[0], pads[1], _MAX_DISTANCE, fromto)
    return float(gap), fromto[3:] - fromto[:3]


def _distance(model: mujoco.MjModel, data: mujoco.MjData, a: int, b: int) -> float:
    return float(mujoco.mj_geomDistance(model, data, a, b, _MAX_DISTANCE, None))


def _box_distance(model: mujoco.MjModel, data: mujoco.MjData, geom: int, point: Array) -> float:
    """Return a point's distance from a geom's bounding box, metres."""
    local = (point - data.geom_xpos[geom]) @ data.geom_xmat[geom].reshape(3, 3)
    outside = np.abs(local - model.geom_aabb[geom, :3]) - model.geom_aabb[geom, 3:]
    return float(np.linalg.norm(np.maximum(outside, 0.0)))


@dataclass(frozen=True, slots=True)
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
    left, right = (_outer_points(model, data, side, other) for side, other in _sides(pads))
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


def _sides(pads: Pads) -> tuple[tuple[frozenset[int], frozenset[int]], tuple[frozenset[int], frozenset[int]]]:
    return (pads.left, pads.right), (pads.right, pads.left)


def _outer_points(
    model: mujoco.MjModel, data: mujoco.MjData, side: frozenset[int], other: frozenset[int], inner: float = 0.45
) -> Array:
    """Return surface points of one side; on a hinge those alone beyond a share of the reach, of a fixed jaw as well."""
    points = world_points(model, data, collision_geoms(model, side))
    # A fixed jaw hangs on the arm's last joint; what counts is the hinge of the jaw that moves against it.
    is_fixed = int(model.body_parentid[min(other)]) in side
    moving = other if is_fixed else side
    hinge = next((int(model.body_jntadr[b]) for b in sorted(moving) if model.body_jntnum[b]), -1)
    reach_of = world_points(model, data, collision_geoms(model, other)) if is_fixed else points
    if hinge < 0 or model.jnt_type[hinge] != mujoco.mjtJoint.mjJNT_HINGE.value:
        return points
    anchor, axis = data.xanchor[hinge], data.xaxis[hinge]
    reach = float(_lever(reach_of, anchor, axis).max())
    lever = _lever(points, anchor, axis)
    kept = points[(lever > inner * reach) & (lever < 1.15 * reach)]
    return kept if len(kept) > 50 else points


def _lever(points: Array, anchor: Array, axis: Array) -> Array:
    offset = points - anchor
    return np.asarray(np.linalg.norm(offset - np.outer(offset @ axis, axis), axis=1))


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
