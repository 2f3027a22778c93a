"""A gripper measured by driving it: what moves, open and closed, where its pads meet and which way it points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.findings import FieldEvidence
from robosandbox.robots.fitting import fit_roles
from robosandbox.robots.gripper.calibrate import JAWS, moving_groups, palm_of, place, sweep_gripper
from robosandbox.robots.gripper.collision import refine_fingers
from robosandbox.robots.gripper.geometry import samples_gap, sweep_roles
from robosandbox.robots.gripper.grasp_frame import grasp_sample, mean_frame, measure_tcp
from robosandbox.robots.gripper.pads import Pads, find_pads, openness, opposed_pads
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.infer.kinematic_tree import Chain, actuator_joints
from robosandbox.robots.infer.placement import TableWorkspace
from robosandbox.robots.infer.tcp import is_tool
from robosandbox.robots.measurements import home_by_address, measurements
from robosandbox.robots.sidecar import GripperRoles, Sidecar
from robosandbox.types import Array
from robosandbox.values import frozen

# Metres beside the measured grasp point at which a frame of the model's own may lie to be meant by it. Chosen.
_SNAP = 0.015
_SNAP_ALONG = 0.02  # Metres along the approach at which it may lie. Chosen.
# Metres beyond the point, because a frame at the very tips says how long the fingers are, not where they hold. Chosen.
_SNAP_BEYOND = 0.01


@dataclass(slots=True)
class InferredGripper:
    """Gripper measured, by names: TCP position and rotation are in the palm's frame.

    `tip` is how far the closed fingers go on beyond the TCP, metres.
    """

    roles: GripperRoles
    palm: str
    tool: Array
    rotation: Array
    open_qpos: Array
    tip: float
    findings: dict[str, FieldEvidence]


@frozen
class _Travel:
    """A gripper driven over its range: its sides, both ends, where it holds things, and its pads."""

    groups: list[frozenset[int]]
    closed: Array
    opened: Array
    grasp: Array
    pads: Pads


def _travel(model: mujoco.MjModel, data: mujoco.MjData, joints: list[int], actuators: list[int]) -> _Travel:
    """Return what driving a gripper shows.

    Raises:
        ValueError: It cannot be driven.
        InputError: Its sides do not meet.
    """
    single = np.isin(model.jnt_type, (mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE))
    for j in np.flatnonzero(single & model.jnt_limited.astype(bool)):
        address = model.jnt_qposadr[j]
        data.qpos[address] = np.clip(data.qpos[address], *model.jnt_range[j])
    sweep = sweep_gripper(model, data, joints, actuators)
    groups = moving_groups(model, joints)
    closed, opened = sorted((sweep.qpos[0], sweep.qpos[-1]), key=lambda qpos: openness(model, data, groups, qpos))
    pads = find_pads(model, data, groups, closed, opened)
    gaps = np.maximum(samples_gap(model, data, sweep.qpos, pads.geoms), 0.0)
    return _Travel(groups, closed, opened, sweep.qpos[grasp_sample(gaps)], pads)


def infer_gripper(
    imported: ImportedModel, gripper: tuple[str, ...], arm: tuple[str, ...], chain: Chain
) -> tuple[InferredGripper | None, FieldEvidence]:
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
    try:
        travel = _travel(model, data, joints, actuators)
    except (ValueError, InputError) as error:
        return None, FieldEvidence(0.5, f"{', '.join(gripper)} is no gripper that could be measured: {error}")
    place(model, data, travel.closed)
    palm = palm_of(model, joints)
    axes = np.vstack([data.xmat[palm].reshape(3, 3).T, data.xaxis[model.joint(arm[-1]).id][None]])
    every = opposed_pads(model, data, travel.groups, travel.pads, travel.closed, travel.opened)
    # Fingers that curl meet elsewhere, closed, than where they have a thing between them.
    held = travel.grasp if len(travel.groups) > JAWS else travel.closed
    frame = mean_frame([measure_tcp(model, data, pair, held, travel.grasp, axes) for pair in every], axes)
    place(model, data, travel.closed)
    position, why, sure = _snap_to_frame(model, data, palm, frame.position, frame.approach, frame.closing)
    R_palm = data.xmat[palm].reshape(3, 3)
    rotation = R_palm.T @ np.column_stack([np.cross(frame.closing, frame.approach), frame.closing, frame.approach])
    local = R_palm.T @ (position - data.xpos[palm])
    roles = _roles(model, gripper, _primary(model, joints, actuators), actuators, travel)
    if abs(roles.open_qpos - roles.closed_qpos) < 1e-4:
        return None, FieldEvidence(0.5, f"{roles.primary_joint} does not move under its actuator")
    findings = {
        "gripper.joints": FieldEvidence(chain.confidence, chain.evidence),
        "gripper.primary_joint": FieldEvidence(0.95, f"driven by {', '.join(map(repr, roles.actuator_names))}"),
        "ee_site.inject.xyz": FieldEvidence(sure, why),
        "ee_site.inject.quat_xyzw": FieldEvidence(0.9, "z out of the gripper, y along the closing of its pads"),
    }
    tip = max(0.0, frame.tip - float((position - frame.position) @ frame.approach))
    hand = InferredGripper(roles, str(model.body(palm).name), local, rotation, travel.opened.copy(), tip, findings)
    return hand, FieldEvidence(0.95, f"{len(joints)} joints")


def measured_as_loaded(
    imported: ImportedModel, sidecar: Sidecar, table_height: float, workspace: TableWorkspace
) -> tuple[Sidecar, dict[str, FieldEvidence]]:
    """Return a sidecar whose gripper opens and closes as it will when it is loaded, and how far.

    It is the measurement that loading makes, at the arm's home and with the servos that loading gives it; before, the grip
    point alone was known, and not how hard the fingers press.

    Args:
        imported: The model, its fingers refined; it is left as it is.
        sidecar: Its roles, with a gripper.
        table_height: Of the table that it stands on, metres.
        workspace: What it reaches.

    Raises:
        InputError: The gripper cannot be driven from open to closed.
    """
    roles = sidecar.fingers
    assert roles is not None
    copy = replace(imported, spec=imported.spec.copy(), notes=[])
    tcp_site = fit_roles(copy, sidecar)
    model = compile_spec(copy.spec, imported.path.name)
    joint = sweep_roles(model, roles, home_by_address(model, sidecar)).joints[
        :, roles.joints.index(roles.primary_joint)
    ]
    ends = round(float(joint.min()), 4), round(float(joint.max()), 4)
    closed, opened = ends if roles.open_qpos > roles.closed_qpos else ends[::-1]
    sidecar = sidecar.model_copy(
        update={"gripper": roles.model_copy(update={"open_qpos": opened, "closed_qpos": closed})}
    )
    found = measurements(model, sidecar, tcp_site, table_height=table_height, workspace=workspace).gripper
    assert found is not None
    widest, narrowest = 1000 * found.geometry.max_aperture, 1000 * found.geometry.min_aperture
    kind = "one jaw moves" if len(roles.joints) == 1 else f"{len(roles.joints)} joints"
    return sidecar, {
        "gripper": FieldEvidence(0.95, f"{kind}; opens to {widest:.0f} mm"),
        "gripper.open_qpos": FieldEvidence(0.95, f"driven over its range, its pads are {widest:.0f} mm apart there"),
        "gripper.closed_qpos": FieldEvidence(0.95, f"its pads are {narrowest:.1f} mm apart there"),
    }


def _roles(
    model: mujoco.MjModel, gripper: tuple[str, ...], primary: int, actuators: list[int], travel: _Travel
) -> GripperRoles:
    """Return a measured gripper's part of a sidecar."""
    names = tuple(str(model.actuator(a).name) for a in actuators)
    address = int(model.jnt_qposadr[primary])
    return GripperRoles(
        joints=gripper,
        primary_joint=str(model.joint(primary).name),
        actuator=names[0] if len(names) == 1 else None,
        actuators=names if len(names) > 1 else (),
        open_qpos=round(float(travel.opened[address]), 4),
        closed_qpos=round(float(travel.closed[address]), 4),
    )


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
