"""What a sidecar does not say, measured on the model once: the gripper's travel, pads, closing and approach axes.

The gripper is driven over its control range in a copy of the robot alone, without gravity, and its joints,
actuator lengths and pad distance are sampled on the way. That holds for a pair of slides, for a linkage closed by
equality constraints, for a tendon and for a single moving jaw alike, and no control is taken for a joint value.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from itertools import combinations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.robot import GripperGeometry, Indices
from robosandbox.robots.sidecar import GripperRoles
from robosandbox.types import Array, frozen_array

_SAMPLES = 64
_SETTLE_SECONDS = 0.5
_SWEEP_SECONDS = 1.5
_MAX_DISTANCE = 1.0
_SNAP_RADIANS = np.radians(15.0)


@dataclass(frozen=True, slots=True, kw_only=True)
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


@dataclass(frozen=True, slots=True)
class _Sweep:
    joints: Array  # (k, g)
    lengths: Array  # (k, actuators)
    qpos: Array  # (k, nq)


def servo_map(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """Return (scale, offset): the control that holds actuator length x is `scale * x + offset`.

    Raises:
        ValueError: The actuator is no position servo.
    """
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    if model.actuator_biastype[actuator] != mujoco.mjtBias.mjBIAS_AFFINE.value or gain[0] == 0.0 or bias[1] >= 0.0:
        raise ValueError("is not a position servo")
    return -float(bias[1] / gain[0]), -float(bias[0] / gain[0])


def derive_gripper(
    model: mujoco.MjModel, roles: GripperRoles, tcp_site: int, arm_q: dict[int, float]
) -> DerivedGripper:
    """Measure the gripper of a robot compiled alone.

    Args:
        model: The robot without a world.
        roles: The sidecar's gripper; its names exist in the model.
        tcp_site: Id of the TCP site.
        arm_q: qpos address -> home value of the arm joints.

    Raises:
        InputError: The gripper cannot be driven from open to closed; the message says why.
    """
    data = mujoco.MjData(model)
    for address, value in arm_q.items():
        data.qpos[address] = value
    joint_ids = [model.joint(name).id for name in roles.joints]
    actuator_ids = [model.actuator(name).id for name in roles.actuator_names]
    primary = roles.joints.index(roles.primary_joint)
    sweep = _sweep(model, data, joint_ids, actuator_ids)
    order = _increasing(sweep.joints[:, primary])
    joint = sweep.joints[order, primary]
    _check_travel(roles, joint)

    groups = _moving_groups(model, joint_ids, tcp_site)
    closed_qpos = sweep.qpos[order[int(np.abs(joint - roles.closed_qpos).argmin())]]
    left, right, pads = _find_pads(model, data, groups, closed_qpos)
    aperture = np.empty(len(order))
    for i, k in enumerate(order):
        _place(model, data, sweep.qpos[k])
        aperture[i] = _pad_gap(model, data, pads)[0]

    middle = roles.open_qpos + 0.6 * (roles.closed_qpos - roles.open_qpos)
    _place(model, data, sweep.qpos[order[int(np.abs(joint - middle).argmin())]])
    R_site_tcp = _tcp_frame(model, data, tcp_site, groups, pads)

    open_gap = float(np.interp(roles.open_qpos, joint, aperture))
    closed_gap = float(np.interp(roles.closed_qpos, joint, aperture))
    _place(model, data, sweep.qpos[order[int(np.abs(joint - roles.open_qpos).argmin())]])
    extents = _finger_extents(model, data, tcp_site, R_site_tcp, (left, right), pads, open_gap)
    controls = np.empty((len(order), len(actuator_ids)))
    for column, actuator in enumerate(actuator_ids):
        scale, offset = servo_map(model, actuator)
        controls[:, column] = sweep.lengths[order, column] * scale + offset
        if model.actuator_ctrllimited[actuator]:
            controls[:, column] = np.clip(controls[:, column], *model.actuator_ctrlrange[actuator])
    geometry = GripperGeometry(
        joint_samples=frozen_array(joint),
        aperture_samples=frozen_array(aperture),
        control_samples=frozen_array(_extend_to_ends(controls, joint, roles, model, actuator_ids)),
        open_joint=roles.open_qpos,
        closed_joint=roles.closed_qpos,
        max_aperture=max(0.0, open_gap),
        min_aperture=max(0.0, closed_gap),
        pads=(_geom_label(model, pads[0]), _geom_label(model, pads[1])),
        **extents,
    )
    return DerivedGripper(
        geometry=geometry,
        coupled_samples=frozen_array(sweep.joints[order]),
        fingers=(_names(model, left), _names(model, right)),
        R_site_tcp=frozen_array(R_site_tcp),
    )


def _sweep(model: mujoco.MjModel, data: mujoco.MjData, joint_ids: list[int], actuator_ids: list[int]) -> _Sweep:
    """Drive the gripper from one end of its control range to the other and sample it on the way."""
    still = _without_gravity(model)
    ranges = np.array([_control_range(model, actuator) for actuator in actuator_ids])
    addresses = model.jnt_qposadr[joint_ids]
    for actuator in range(model.nu):
        if actuator not in actuator_ids:
            _hold(model, data, actuator)
    frozen = data.qpos.copy()
    driven = _driven_addresses(model, joint_ids)
    settle = int(_SETTLE_SECONDS / model.opt.timestep)
    steps = max(1, int(_SWEEP_SECONDS / model.opt.timestep / _SAMPLES))

    def advance(fraction: float, count: int) -> None:
        data.ctrl[actuator_ids] = ranges[:, 0] + fraction * (ranges[:, 1] - ranges[:, 0])
        for _ in range(max(1, count // 10)):
            mujoco.mj_step(still, data, 10)
            # The arm is no part of the sweep: it is put back, however its own servos pull.
            arm = frozen.copy()
            arm[driven] = data.qpos[driven]
            data.qpos[:] = arm

    advance(0.0, settle)
    joints, lengths, qpos = [], [], []
    for k in range(_SAMPLES + 1):
        advance(k / _SAMPLES, steps if k else 0)
        if k == _SAMPLES:
            advance(1.0, settle)
        _place(model, data, data.qpos)
        joints.append(data.qpos[addresses].copy())
        lengths.append(data.actuator_length[actuator_ids].copy())
        qpos.append(data.qpos.copy())
    return _Sweep(np.array(joints), np.array(lengths), np.array(qpos))


def _without_gravity(model: mujoco.MjModel) -> mujoco.MjModel:
    still = copy.copy(model)
    still.opt.gravity[:] = 0.0
    still.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    return still


def _control_range(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    if model.actuator_ctrllimited[actuator]:
        low, high = model.actuator_ctrlrange[actuator]
        return float(low), float(high)
    joint = int(model.actuator_trnid[actuator, 0])
    if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT.value and model.jnt_limited[joint]:
        scale, offset = servo_map(model, actuator)
        gear = model.actuator_gear[actuator, 0]
        low, high = model.jnt_range[joint] * gear * scale + offset
        return float(low), float(high)
    raise ValueError("has neither a control range nor a limited joint")


def _hold(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> None:
    joint = int(model.actuator_trnid[actuator, 0])
    if model.actuator_trntype[actuator] != mujoco.mjtTrn.mjTRN_JOINT.value:
        return
    try:
        scale, offset = servo_map(model, actuator)
    except ValueError:
        return
    length = data.qpos[model.jnt_qposadr[joint]] * model.actuator_gear[actuator, 0]
    data.ctrl[actuator] = scale * length + offset


def _driven_addresses(model: mujoco.MjModel, joint_ids: list[int]) -> list[int]:
    """Return the qpos addresses of all joints at or below the gripper joints' common parent."""
    root = _palm(model, joint_ids)
    inside = {body for body in range(model.nbody) if _is_below(model, body, root)} - {root}
    return [int(model.jnt_qposadr[j]) for j in range(model.njnt) if int(model.jnt_bodyid[j]) in inside]


def _is_below(model: mujoco.MjModel, body: int, root: int) -> bool:
    while body and body != root:
        body = int(model.body_parentid[body])
    return body == root


def _palm(model: mujoco.MjModel, joint_ids: list[int]) -> int:
    """Return the body that carries all gripper joints."""
    chains = []
    for joint in joint_ids:
        body, chain = int(model.body_parentid[model.jnt_bodyid[joint]]), []
        while True:
            chain.append(body)
            if body == 0:
                break
            body = int(model.body_parentid[body])
        chains.append(chain)
    return next(body for body in chains[0] if all(body in chain for chain in chains))


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


def _extend_to_ends(
    controls: Array, joint: Array, roles: GripperRoles, model: mujoco.MjModel, actuator_ids: list[int]
) -> Array:
    """Return controls whose end samples reach the ends of the control range.

    Pads that meet stop the joint just short of the sidecar's closed value; the control must still press.
    """
    extended = controls.copy()
    ends = {0: min(roles.open_qpos, roles.closed_qpos), -1: max(roles.open_qpos, roles.closed_qpos)}
    for end, value in ends.items():
        if (end == 0 and value <= joint[0]) or (end == -1 and value >= joint[-1]):
            for column, actuator in enumerate(actuator_ids):
                low, high = _control_range(model, actuator)
                rising = controls[-1, column] > controls[0, column]
                extended[end, column] = (low if rising else high) if end == 0 else (high if rising else low)
    return extended


def _moving_groups(model: mujoco.MjModel, joint_ids: list[int], tcp_site: int) -> list[frozenset[int]]:
    """Return the gripper's sides: bodies below each child of the palm that moves, and the palm for a lone jaw."""
    palm = _palm(model, joint_ids)
    roots: dict[int, set[int]] = {}
    moved = {int(model.jnt_bodyid[j]) for j in joint_ids}
    for body in range(1, model.nbody):
        path = []
        walk = body
        while walk != palm and walk != 0:
            path.append(walk)
            walk = int(model.body_parentid[walk])
        if walk == palm and path and any(b in moved for b in path):
            roots.setdefault(path[-1], set()).add(body)
    groups = [frozenset(bodies) for bodies in roots.values()]
    if len(groups) == 1:
        fixed = {palm, int(model.site_bodyid[tcp_site])}
        fixed |= {
            b
            for b in range(1, model.nbody)
            if int(model.body_weldid[b]) == int(model.body_weldid[palm]) and b not in groups[0]
        }
        groups.append(frozenset(fixed - groups[0]))
    return groups


def _collision_geoms(model: mujoco.MjModel, bodies: frozenset[int]) -> list[int]:
    geoms = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in bodies]
    solid = [g for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]
    return solid or geoms


def _find_pads(
    model: mujoco.MjModel, data: mujoco.MjData, groups: list[frozenset[int]], closed_qpos: Array
) -> tuple[frozenset[int], frozenset[int], tuple[int, int]]:
    """Return the two sides and the pair of geoms that come closest when closed."""
    _place(model, data, closed_qpos)
    best: tuple[float, frozenset[int], frozenset[int], tuple[int, int]] | None = None
    for left, right in combinations(groups, 2):
        for a in _collision_geoms(model, left):
            for b in _collision_geoms(model, right):
                gap = max(-1e-3, mujoco.mj_geomDistance(model, data, a, b, _MAX_DISTANCE, None))
                if best is None or gap < best[0] - 1e-6:
                    best = (gap, left, right, (a, b))
    if best is None:
        raise InputError("gripper.joints: no two sides with collision geometry move against each other")
    return best[1:]


def _pad_gap(model: mujoco.MjModel, data: mujoco.MjData, pads: tuple[int, int]) -> tuple[float, Array]:
    fromto = np.zeros(6)
    gap = mujoco.mj_geomDistance(model, data, pads[0], pads[1], _MAX_DISTANCE, fromto)
    return float(gap), fromto[3:] - fromto[:3]


def _tcp_frame(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    tcp_site: int,
    groups: list[frozenset[int]],
    pads: tuple[int, int],
) -> Array:
    """Return R_site_tcp at a half-closed posture: y across the pads, z from the fingers' roots to the TCP."""
    site_rotation = data.site_xmat[tcp_site].reshape(3, 3)
    gap, across = _pad_gap(model, data, pads)
    if gap <= 1e-6:
        across = data.geom_xpos[pads[1]] - data.geom_xpos[pads[0]]
    closing = _snap(site_rotation.T @ (across / np.linalg.norm(across)))
    moving = groups[:2] if len(groups) > 1 else groups
    roots = [data.xpos[min(group)] for group in moving]
    towards = site_rotation.T @ (data.site_xpos[tcp_site] - np.mean(roots, axis=0))
    towards -= closing * (closing @ towards)
    approach = _snap(towards / np.linalg.norm(towards))
    approach -= closing * (closing @ approach)
    approach /= np.linalg.norm(approach)
    return np.column_stack([np.cross(closing, approach), closing, approach])


def _snap(direction: Array) -> Array:
    """Return the nearest axis when it is within 15 degrees: what a designer meant by a small tilt."""
    axis = int(np.abs(direction).argmax())
    if abs(direction[axis]) < np.cos(_SNAP_RADIANS):
        return direction
    snapped = np.zeros(3)
    snapped[axis] = np.sign(direction[axis])
    return snapped


def _corners(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Array:
    """Return the 8 corners of a geom's bounding box in the world, shape (8, 3)."""
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners: Array = data.geom_xpos[geom] + (centre + signs * half) @ data.geom_xmat[geom].reshape(3, 3).T
    return corners


def _finger_extents(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    tcp_site: int,
    R_site_tcp: Array,
    sides: tuple[frozenset[int], frozenset[int]],
    pads: tuple[int, int],
    open_gap: float,
) -> dict[str, float]:
    """Measure the open fingers in the TCP frame."""
    origin = data.site_xpos[tcp_site]
    rotation = data.site_xmat[tcp_site].reshape(3, 3) @ R_site_tcp

    def local(geoms: list[int]) -> Array:
        return np.concatenate([(_corners(model, data, g) - origin) @ rotation for g in geoms])

    fingers = [local(_collision_geoms(model, side)) for side in sides]
    pad_corners = local(list(pads))
    tip_depth = float(max(points[:, 2].max() for points in fingers))
    middle = float(pad_corners[:, 1].mean())
    outer = max(float(np.abs(pad_corners[:, 1] - middle).max()), open_gap / 2.0)
    near = np.concatenate(fingers)
    near = near[near[:, 2] > tip_depth - 0.02]
    outer = max(outer, float(np.abs(near[:, 1] - middle).max())) if len(near) else outer
    palm_body = int(model.site_bodyid[tcp_site])
    palm = [
        g
        for g in _collision_geoms(model, frozenset({palm_body}))
        if int(model.geom_bodyid[g]) not in sides[0] | sides[1]
    ]
    palm_top = float(local(palm)[:, 2].max()) if palm else float(np.concatenate(fingers)[:, 2].min())
    return {
        "tip_depth": max(0.0, tip_depth),
        "palm_depth": max(0.0, -palm_top),
        "finger_thickness": max(0.002, outer - open_gap / 2.0),
        "finger_width": float(pad_corners[:, 0].max() - pad_corners[:, 0].min()),
    }


def _place(model: mujoco.MjModel, data: mujoco.MjData, qpos: Array) -> None:
    data.qpos[:] = qpos
    mujoco.mj_fwdPosition(model, data)


def _names(model: mujoco.MjModel, bodies: frozenset[int]) -> tuple[str, ...]:
    return tuple(model.body(b).name for b in sorted(bodies))


def _geom_label(model: mujoco.MjModel, geom: int) -> str:
    return str(model.geom(geom).name or model.body(model.geom_bodyid[geom]).name)
