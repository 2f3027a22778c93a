"""Gripper geometry measured on the model once: travel, pads, closing and approach axes.

The gripper is driven over its control range in a copy of the robot alone, without gravity, and its joints,
actuator lengths and pad distance are sampled on the way. That holds for a pair of slides, for a linkage closed by
equality constraints, for a tendon and for a single moving jaw alike, and no control is taken for a joint value.
"""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.gripper.calibrate import (
    Sweep,
    collision_geoms,
    control_range,
    moving_groups,
    place,
    servo_map,
    sweep_gripper,
)
from robosandbox.robots.gripper.extents import finger_extents, fingertip_depth
from robosandbox.robots.gripper.grasp_frame import behind_fingers, grasp_sample
from robosandbox.robots.gripper.pads import find_pads, opposed_pads, pad_gap
from robosandbox.robots.robot import Indices
from robosandbox.robots.sidecar import GripperRoles
from robosandbox.robots.surfaces import points_on, world_points
from robosandbox.types import Array, frozen_array
from robosandbox.types.robot import GripperGeometry
from robosandbox.values import frozen

# Share of the gap's travel from which its middle moves because one jaw stands still: it would move by half. Chosen half of that.
_FIXED_JAW = 0.25
# Number of configurations on the way to a grasp at which the fingertips' depth is measured. Chosen.
_TIP_SAMPLES = 7
# Half-width of the closing line along which swinging jaws are measured, metres: as of a small pad. Chosen.
_LINE_WIDTH = 0.004
# How far beyond the TCP a jaw's own inner face may lie, metres; what lies farther is its back. Chosen.
_LINE_BEYOND = 0.02
# Share of samples at which the closing line must meet both jaws, and the gap in metres that it must find. Chosen.
_LEAST_ON_LINE, _LEAST_GAP = 0.15, 0.005
# Factor by which the gap at the TCP must exceed the one between the pads to be taken for the jaws' opening. Chosen.
_FAR_WIDER = 1.3
# Angle within which the closing direction is taken for an axis of the tool's frame. Chosen: pads are often drawn a little
# askew.
_SNAP_CLOSING = np.radians(15.0)
# The same angle, radians, of the approach. Chosen larger, because fingers lean by more than pads.
_SNAP_APPROACH = np.radians(30.0)


@frozen(kw_only=True)
class DerivedGripper:
    """A gripper in names, not indices, so that it outlives the model it was measured on.

    Attributes:
        geometry: The measured figures.
        coupled_samples: Joint values of all gripper joints at each sample, shape (k, g).
        fingers: Body names of the two sides.
        R_site_tcp: Rotation from the TCP site's frame to the TCP frame.
    """

    geometry: GripperGeometry
    coupled_samples: Array
    fingers: tuple[tuple[str, ...], tuple[str, ...]]
    R_site_tcp: Array


def derive_gripper(
    model: mujoco.MjModel, roles: GripperRoles, tcp_site: int, arm_q: dict[int, float], *, oriented: bool = False
) -> DerivedGripper:
    """Measure the gripper of a robot compiled alone.

    Args:
        model: The robot without a world.
        roles: The sidecar's gripper; its names exist in the model.
        tcp_site: Id of the TCP site.
        arm_q: qpos address -> home value of the arm joints.
        oriented: The site's z is the approach, as its sidecar says; else it is measured.

    Raises:
        InputError: The gripper cannot be driven from open to closed; the message says why.
    """
    data, sweep = mujoco.MjData(model), sweep_roles(model, roles, arm_q)
    joint_ids = [model.joint(name).id for name in roles.joints]
    actuator_ids = [model.actuator(name).id for name in roles.actuator_names]
    primary = sweep.joints[:, roles.joints.index(roles.primary_joint)]
    order = _increasing(primary)
    joint, samples = primary[order], sweep.qpos[order]
    _check_travel(roles, joint)
    opened, closed = (int(np.abs(joint - end).argmin()) for end in (roles.open_qpos, roles.closed_qpos))
    groups = moving_groups(model, joint_ids)
    tcp = (int(model.site_bodyid[tcp_site]), model.site_pos[tcp_site].copy())
    found = find_pads(model, data, groups, samples[closed], samples[opened], tcp)
    every = opposed_pads(model, data, groups, found, samples[closed], samples[opened])
    sides = (found.left.union(*(pair.left for pair in every)), found.right.union(*(pair.right for pair in every)))
    aperture = samples_gap(model, data, samples, found.geoms)
    place(model, data, samples[grasp_sample(aperture)])
    R_site_tcp = _tcp_frame(model, data, tcp_site, sides, [pair.geoms for pair in every], oriented)
    aperture, centre = _gaps(model, data, samples, (tcp_site, R_site_tcp), sides, (found.geoms, aperture))
    grasp = grasp_sample(aperture)
    place(model, data, samples[grasp])
    extents = finger_extents(model, data, tcp_site, R_site_tcp, sides, found.geoms)
    on_the_way = _between(sweep.qpos, int(order[opened]), int(order[grasp]))
    depths = [fingertip_depth(model, data, qpos, tcp_site, R_site_tcp, sides[0] | sides[1]) for qpos in on_the_way]
    geometry = GripperGeometry(
        joint_samples=frozen_array(joint),
        aperture_samples=frozen_array(aperture),
        centre_samples=frozen_array(centre),
        control_samples=frozen_array(_controls(model, sweep.lengths[order], joint, roles, actuator_ids)),
        open_joint=roles.open_qpos,
        closed_joint=roles.closed_qpos,
        max_aperture=max(0.0, float(np.interp(roles.open_qpos, joint, aperture))),
        min_aperture=max(0.0, float(np.interp(roles.closed_qpos, joint, aperture))),
        pads=(_geom_label(model, found.geoms[0]), _geom_label(model, found.geoms[1])),
        **extents | {"tip_depth": max(depths)},
    )
    return DerivedGripper(
        geometry=geometry,
        coupled_samples=frozen_array(sweep.joints[order]),
        fingers=(_names(model, sides[0]), _names(model, sides[1])),
        R_site_tcp=frozen_array(R_site_tcp),
    )


def sweep_roles(model: mujoco.MjModel, roles: GripperRoles, arm_q: dict[int, float]) -> Sweep:
    """Drive a gripper over its range, the arm at these values by qpos address; raises an InputError where that cannot be."""
    data = mujoco.MjData(model)
    data.qpos[list(arm_q)] = list(arm_q.values())
    joints = [model.joint(name).id for name in roles.joints]
    actuators = [model.actuator(name).id for name in roles.actuator_names]
    try:
        return sweep_gripper(model, data, joints, actuators)
    except ValueError as error:
        raise InputError(f"gripper.actuator: {list(roles.actuator_names)} {error}") from None


def _between(qpos: Array, opened: int, grasp: int) -> Array:
    """Return configurations from open to closed on something: fingers that swing reach farther out somewhere on the way."""
    first, last = sorted((opened, grasp))
    some: Array = qpos[np.unique(np.linspace(first, last, _TIP_SAMPLES).round().astype(int))]
    return some


def _increasing(values: Array) -> Indices:
    """Return indices that put the samples in strictly increasing order, plateaus at the ends dropped."""
    order = np.argsort(values, kind="stable")
    span = values[order[-1]] - values[order[0]]
    keep = [int(order[0])]
    for k in order[1:]:
        if values[k] - values[keep[-1]] > 1e-4 * max(span, 1e-9):
            keep.append(int(k))
    return np.array(keep)


def _check_travel(roles: GripperRoles, joint: Array) -> None:
    low, high = float(joint[0]), float(joint[-1])
    wanted = abs(roles.open_qpos - roles.closed_qpos)
    slack = 0.1 * wanted
    if high - low < 0.1 * wanted:
        raise InputError(
            f"gripper.primary_joint: {roles.primary_joint!r} does not move when {list(roles.actuator_names)} is driven "
            f"over its range ({low:.4g}..{high:.4g}); name the joint that this actuator drives"
        )
    for field in ("open_qpos", "closed_qpos"):
        value = getattr(roles, field)
        if not low - slack <= value <= high + slack:
            raise InputError(
                f"gripper.{field}: {value:g} is outside what {roles.primary_joint!r} reaches under its actuator "
                f"({low:.4g}..{high:.4g}); give a joint value, not a width or a control"
            )


def _controls(
    model: mujoco.MjModel, lengths: Array, joint: Array, roles: GripperRoles, actuator_ids: list[int]
) -> Array:
    """Return the controls that hold each sample, shape (k, actuators); the end samples reach the ends of the control range.

    Pads that meet stop the joint just short of the sidecar's closed value; the control must still press.
    """
    controls = np.empty((len(joint), len(actuator_ids)))
    for column, actuator in enumerate(actuator_ids):
        scale, offset = servo_map(model, actuator)
        controls[:, column] = lengths[:, column] * scale + offset
        if model.actuator_ctrllimited[actuator]:
            controls[:, column] = np.clip(controls[:, column], *model.actuator_ctrlrange[actuator])
    # The controls at the joint's least value and at its largest, for each actuator.
    rising = controls[-1] > controls[0]
    ranges = np.array([control_range(model, actuator) for actuator in actuator_ids])
    low, high = np.where(rising, ranges.T, ranges.T[::-1])
    least, most = sorted((roles.open_qpos, roles.closed_qpos))
    if least <= joint[0]:
        controls[0] = low
    if most >= joint[-1]:
        controls[-1] = high
    return controls


def _tcp_frame(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    tcp_site: int,
    sides: tuple[frozenset[int], frozenset[int]],
    pads: list[tuple[int, int]],
    oriented: bool,
) -> Array:
    """Return R_site_tcp around an object: y across the pads, z the site's or from the fingers' roots to the TCP."""
    site_rotation = data.site_xmat[tcp_site].reshape(3, 3)
    directions = []
    for pair in pads:
        gap, across = pad_gap(model, data, pair)
        if gap <= 1e-6:
            across = data.geom_xpos[pair[1]] - data.geom_xpos[pair[0]]
        directions.append(across / np.linalg.norm(across))
    across = np.mean(directions, axis=0)
    closing = _snap(site_rotation.T @ (across / np.linalg.norm(across)), _SNAP_CLOSING)
    if oriented:
        approach = np.array([0.0, 0.0, 1.0])
        closing -= approach * (approach @ closing)
        if float(np.linalg.norm(closing)) > 0.3:
            closing /= np.linalg.norm(closing)
            return np.column_stack([np.cross(closing, approach), closing, approach])
    root = np.mean([data.xpos[min(side)] for side in sides], axis=0)
    points = np.concatenate([world_points(model, data, collision_geoms(model, side)) for side in sides])
    root = behind_fingers(model, data, sides, points, root, site_rotation @ closing)
    towards = site_rotation.T @ (data.site_xpos[tcp_site] - root)
    towards -= closing * (closing @ towards)
    approach = _snap(towards / np.linalg.norm(towards), _SNAP_APPROACH)
    approach -= closing * (closing @ approach)
    approach /= np.linalg.norm(approach)
    return np.column_stack([np.cross(closing, approach), closing, approach])


def _gaps(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    samples: Array,
    tcp: tuple[int, Array],
    sides: tuple[frozenset[int], frozenset[int]],
    measured: tuple[tuple[int, int], Array],
) -> tuple[Array, Array]:
    """Return the gap and where its middle lies along the closing direction, each (k,), metres.

    Args:
        model: The robot.
        data: Its state; it is changed.
        samples: Configurations, shape (k, nq).
        tcp: Id of the TCP site, and the rotation from it to the TCP frame.
        sides: Bodies of both fingers.
        measured: The pads' geoms, and the gap between them at each sample.
    """
    pads, aperture = measured
    centre = _gap_centres(model, data, samples, *tcp, pads)
    along = _gaps_at_tcp(model, data, samples, tcp, sides)
    if along is None:
        return aperture, centre
    if _fixed_jaw(model, sides) is not None:
        return along
    # Parts beside the hinges of two jaws stay close too, however wide their tips are apart.
    return (along[0], centre) if along[0].max() > _FAR_WIDER * aperture.max() else (aperture, centre)


def _gaps_at_tcp(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    samples: Array,
    tcp: tuple[int, Array],
    sides: tuple[frozenset[int], frozenset[int]],
) -> tuple[Array, Array] | None:
    """Return gap and its middle along the closing line through the TCP, each (k,), of jaws that swing.

    Parts of them near the hinge stay close however wide they are open. None for jaws that slide, and where the line misses
    them.
    """
    fixed = _fixed_jaw(model, sides)
    hinges = [int(model.body_jntadr[min(side)]) for side in sides if side is not fixed]
    if any(hinge < 0 or model.jnt_type[hinge] != mujoco.mjtJoint.mjJNT_HINGE.value for hinge in hinges):
        return None
    site, R_site_tcp = tcp
    jaws = [{g: points_on(model, g, _LINE_WIDTH / 2.0) for g in collision_geoms(model, side)} for side in sides]
    ends = np.full((len(samples), 2), np.nan)
    for k, qpos in enumerate(samples):
        place(model, data, qpos)
        rotation = data.site_xmat[site].reshape(3, 3) @ R_site_tcp
        for j, (jaw, sign) in enumerate(zip(jaws, (1.0, -1.0), strict=True)):
            there = [data.geom_xpos[g] + local @ data.geom_xmat[g].reshape(3, 3).T for g, local in jaw.items()]
            points = (np.concatenate(there) - data.site_xpos[site]) @ rotation
            reach = np.inf if sides[j] is fixed else _LINE_BEYOND
            # The first side lies at negative y: what faces the other is its greatest.
            on_line = (np.abs(points[:, [0, 2]]) < _LINE_WIDTH).all(axis=1) & (sign * points[:, 1] < reach)
            ends[k, j] = sign * (sign * points[on_line, 1]).max(initial=-np.inf)
    ends[~np.isfinite(ends).all(axis=1)] = np.nan
    gaps, middles = ends[:, 1] - ends[:, 0], ends.sum(axis=1) / 2.0
    known = np.flatnonzero(np.isfinite(gaps))
    if len(known) < _LEAST_ON_LINE * len(samples) or np.nanmax(gaps) < _LEAST_GAP:
        return None
    # A jaw that has swung off the line leaves a gap at least as wide as the last one measured.
    steps = np.arange(len(samples))
    return np.maximum(np.interp(steps, known, gaps[known]), 0.0), np.interp(steps, known, middles[known])


def _fixed_jaw(model: mujoco.MjModel, sides: tuple[frozenset[int], frozenset[int]]) -> frozenset[int] | None:
    """Return the side that the other one hangs on, of a gripper with one moving jaw."""
    return next((b for a, b in (sides, sides[::-1]) if int(model.body_parentid[min(a)]) in b), None)


def _gap_centres(
    model: mujoco.MjModel, data: mujoco.MjData, samples: Array, tcp_site: int, R_site_tcp: Array, pads: tuple[int, int]
) -> Array:
    """Return where the middle between the pads lies along the closing direction, at each sample, shape (k,)."""
    centres = np.empty(len(samples))
    fromto = np.zeros(6)
    for k, qpos in enumerate(samples):
        place(model, data, qpos)
        closing = data.site_xmat[tcp_site].reshape(3, 3) @ R_site_tcp[:, 1]
        mujoco.mj_geomDistance(model, data, pads[0], pads[1], 1.0, fromto)
        centres[k] = closing @ ((fromto[:3] + fromto[3:]) / 2.0 - data.site_xpos[tcp_site])
    # The shape of pads moves the middle by a millimetre or two as well; only more tells of a jaw that stands still.
    return centres if np.ptp(centres) > _FIXED_JAW * np.ptp(samples_gap(model, data, samples, pads)) else 0.0 * centres


def samples_gap(model: mujoco.MjModel, data: mujoco.MjData, samples: Array, pads: tuple[int, int]) -> Array:
    """Return the gap between two geoms at each configuration, shape (k,)."""
    gaps = np.empty(len(samples))
    for k, qpos in enumerate(samples):
        place(model, data, qpos)
        gaps[k] = pad_gap(model, data, pads)[0]
    return gaps


def _snap(direction: Array, radians: float) -> Array:
    """Return the nearest axis when it is within an angle: what a designer meant by a small tilt."""
    axis = int(np.abs(direction).argmax())
    if abs(direction[axis]) < np.cos(radians):
        return direction
    snapped = np.zeros(3)
    snapped[axis] = np.sign(direction[axis])
    return snapped


def _names(model: mujoco.MjModel, bodies: frozenset[int]) -> tuple[str, ...]:
    return tuple(model.body(b).name for b in sorted(bodies))


def _geom_label(model: mujoco.MjModel, geom: int) -> str:
    return str(model.geom(geom).name or model.body(model.geom_bodyid[geom]).name)
