"""The pads of a gripper: the two geoms that close on an object, and the gap between them."""

from __future__ import annotations

from itertools import combinations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.gripper.calibrate import collision_geoms, place
from robosandbox.robots.surfaces import world_points
from robosandbox.types import Array
from robosandbox.values import frozen

_MAX_DISTANCE = 1.0
_LEAST_TRAVEL = 1e-3  # Metres. Sides that come closer by less than this between open and closed do not close. Chosen.
# Share of the largest travel that pads must have, because parts near the hinge come closer too. Chosen.
_TRAVEL_SHARE = 0.6
_ALLY_GAP = 0.01  # Metres by which a finger beside another may close less far. Chosen.
_ALLY_REACH = 0.9  # Share of the other's reach that it has at least. Chosen.
# Cosine of the motions of two fingers below which they close on each other. Chosen: three around a circle close at 120
# degrees, the cosine of which is -0.5.
_ALLY_COSINE = -0.6


@frozen
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
        first, second = (outer_points(model, data, side, other, 0.75) for side, other in ((left, right), (right, left)))
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


def outer_points(
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
