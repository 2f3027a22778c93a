"""A gripper measured by driving it: what moves, open and closed, where its pads meet and which way it points."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.check.finding import Finding
from robosandbox.robots.gripper.calibrate import moving_groups, palm_of, place, sweep_gripper
from robosandbox.robots.gripper.collision import refine_fingers
from robosandbox.robots.gripper.grasp_frame import grasp_sample, mean_frame, measure_tcp
from robosandbox.robots.gripper.pads import find_pads, openness, opposed_pads, pad_gap
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.infer.kinematic_tree import Chain, actuator_joints
from robosandbox.robots.infer.tcp import is_tool
from robosandbox.robots.sidecar import GripperRoles
from robosandbox.types import Array

# How far from the measured grasp point a frame of the model's own may lie to be meant by it, metres.
_SNAP = 0.015
_SNAP_ALONG = 0.02
_SNAP_BEYOND = 0.01


@dataclass(slots=True)
class InferredGripper:
    """What was measured of a gripper, by names: TCP position and rotation are in the palm's frame.

    `tip` is how far the closed fingers go on beyond the TCP, metres.
    """

    roles: GripperRoles
    palm: str
    tool: Array
    rotation: Array
    open_qpos: Array
    tip: float
    findings: dict[str, Finding]


def infer_gripper(
    imported: ImportedModel, gripper: tuple[str, ...], arm: tuple[str, ...], chain: Chain
) -> tuple[InferredGripper | None, Finding]:
    """Return what a gripper is, or None, and why.

    Args:
        imported: The model; its fingers are made fit to hold things.
        gripper: The gripper's joints.
        arm: The arm's, base to wrist.
        chain: Where they were found.
    """
    refine_fingers(imported, gripper)
    model = compile_spec(imported.spec, imported.path.name)
    data = mujoco.MjData(model)
    joints = [model.joint(name).id for name in gripper]
    actuators = [a for a in range(model.nu) if set(actuator_joints(model, a)) & set(joints)]
    low, high = model.jnt_range[:, 0], model.jnt_range[:, 1]
    limited = model.jnt_limited.astype(bool)
    for j in range(model.njnt):
        if limited[j] and model.jnt_type[j] in (2, 3):
            address = model.jnt_qposadr[j]
            data.qpos[address] = np.clip(data.qpos[address], low[j], high[j])
    try:
        sweep = sweep_gripper(model, data, joints, actuators)
        groups = moving_groups(model, joints)
        first, last = sweep.qpos[0], sweep.qpos[-1]
        if openness(model, data, groups, first) <= openness(model, data, groups, last):
            closed, opened = first, last
        else:
            closed, opened = last, first
        pads = find_pads(model, data, groups, closed, opened)
    except (ValueError, InputError) as error:
        return None, Finding(0.5, f"{', '.join(gripper)} is no gripper that could be measured: {error}")
    gaps = np.empty(len(sweep.qpos))
    for k, qpos in enumerate(sweep.qpos):
        place(model, data, qpos)
        gaps[k] = max(0.0, pad_gap(model, data, pads.geoms)[0])
    grasp = sweep.qpos[grasp_sample(gaps)]
    primary = _primary(model, joints, actuators)
    address = int(model.jnt_qposadr[primary])
    place(model, data, closed)
    palm = palm_of(model, joints)
    last_joint = model.joint(arm[-1]).id
    axes = np.vstack([data.xmat[palm].reshape(3, 3).T, data.xaxis[last_joint][None]])
    every = opposed_pads(model, data, groups, pads, closed, opened)
    frame = mean_frame([measure_tcp(model, data, pair, closed, grasp, axes) for pair in every], axes)
    place(model, data, closed)
    position, why, sure = _snap_to_frame(model, data, palm, frame.position, frame.approach, frame.closing)
    R_palm = data.xmat[palm].reshape(3, 3)
    rotation = R_palm.T @ np.column_stack([np.cross(frame.closing, frame.approach), frame.closing, frame.approach])
    local = R_palm.T @ (position - data.xpos[palm])
    open_value, closed_value = (round(float(qpos[address]), 4) for qpos in (opened, closed))
    widest, narrowest = float(gaps.max()), float(gaps.min())
    if abs(open_value - closed_value) < 1e-4:
        return None, Finding(0.5, f"{model.joint(primary).name} does not move under its actuator")
    names = [str(model.actuator(a).name) for a in actuators]
    roles = GripperRoles(
        joints=gripper,
        primary_joint=str(model.joint(primary).name),
        actuator=next(iter(names)) if len(names) == 1 else None,
        actuators=tuple(names) if len(names) > 1 else (),
        open_qpos=open_value,
        closed_qpos=closed_value,
    )
    findings = {
        "gripper.joints": Finding(chain.confidence, chain.evidence),
        "gripper.primary_joint": Finding(0.95, f"driven by {', '.join(repr(name) for name in names)}"),
        "gripper.open_qpos": Finding(0.95, f"driven over its range, its pads are {widest * 1000:.0f} mm apart there"),
        "gripper.closed_qpos": Finding(0.95, f"its pads are {narrowest * 1000:.1f} mm apart there"),
        "ee_site.inject.xyz": Finding(sure, why),
        "ee_site.inject.quat_xyzw": Finding(0.9, "z out of the gripper, y along the closing of its pads"),
    }
    tip = max(0.0, frame.tip - float((position - frame.position) @ frame.approach))
    hand = InferredGripper(roles, str(model.body(palm).name), local, rotation, opened.copy(), tip, findings)
    kind = "one jaw moves" if len(moving_groups(model, joints)) == 2 and len(joints) == 1 else f"{len(joints)} joints"
    return hand, Finding(0.95, f"{kind}; opens to {widest * 1000:.0f} mm")


def _primary(model: mujoco.MjModel, joints: list[int], actuators: list[int]) -> int:
    """Return the joint that the gripper's first actuator drives."""
    for actuator in actuators:
        driven = [j for j in actuator_joints(model, actuator) if j in joints]
        if driven:
            return driven[0]
    return joints[0]


def _snap_to_frame(
    model: mujoco.MjModel, data: mujoco.MjData, palm: int, position: Array, approach: Array, closing: Array
) -> tuple[Array, str, float]:
    """Return the tool frame that the model names near the measured TCP, else the measurement."""
    weld = int(model.body_weldid[palm])
    named: list[tuple[str, Array]] = [
        (f"site {model.site(s).name!r}", data.site_xpos[s].copy())
        for s in range(model.nsite)
        if int(model.body_weldid[model.site_bodyid[s]]) == weld and is_tool(model.site(s).name)
    ]
    named += [
        (f"frame {model.body(b).name!r}", data.xpos[b].copy())
        for b in range(1, model.nbody)
        if int(model.body_weldid[b]) == weld and not model.body_geomnum[b] and is_tool(model.body(b).name)
    ]
    best: tuple[float, str, Array] | None = None
    for label, place_of in named:
        offset = place_of - position
        along, across = abs(float(offset @ approach)), float(np.linalg.norm(offset - approach * (offset @ approach)))
        # A frame at the very tips says how long the fingers are, not where they hold.
        beyond = float(offset @ approach) > _SNAP_BEYOND
        if across < _SNAP and along < _SNAP_ALONG and not beyond and (best is None or along + across < best[0]):
            best = (along + across, label, place_of)
    if best is None:
        return position, "the middle of the area where the closed pads meet", 0.85
    distance = float(np.linalg.norm(best[2] - position))
    return best[2], f"the model's own {best[1]}, {distance * 1000:.0f} mm from where the closed pads meet", 0.97
