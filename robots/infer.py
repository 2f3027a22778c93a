"""A sidecar from the model alone: arm, gripper, open and closed, TCP, home and base, each with its evidence."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.chain import Chain, actuator_joints, find_chains
from robosandbox.robots.fingers import refine_fingers
from robosandbox.robots.imported import ImportedModel, compile_spec
from robosandbox.robots.importing import import_model
from robosandbox.robots.kinematics import Kinematics, Tool
from robosandbox.robots.mount import mount
from robosandbox.robots.pads import find_pads, grasp_sample, measure_tcp, openness, pad_gap
from robosandbox.robots.placement import Workspace, base_bottom, base_pose, find_home, find_workspace
from robosandbox.robots.sidecar import (
    ArmRoles,
    BasePose,
    EeSite,
    GripperAttachment,
    GripperRoles,
    InjectedSite,
    Sidecar,
)
from robosandbox.robots.surfaces import world_points
from robosandbox.robots.sweep import moving_groups, palm_of, place, sweep_gripper
from robosandbox.types import TABLE_HEIGHT, Array, quat_xyzw_from_matrix
from robosandbox.validation import did_you_mean

_TOOL = re.compile(
    r"tcp|tool|pinch|grasp|gripper_?frame|end_?effector|\bee\b|ee_|_ee|eef|flange|attachment|grip_?(site|point)", re.I
)
_NO_TOOL = re.compile(r"cam|light|imu|focus|cali", re.I)
_SNAP = 0.015
_SNAP_ALONG = 0.02
_BENT = 1.5


@dataclass(frozen=True, slots=True)
class Finding:
    """Why a field has its value: how sure (0..1), and the evidence in words."""

    confidence: float
    evidence: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Inference:
    """What was found out about a robot.

    Attributes:
        model: The model as imported, gripper mounted.
        sidecar: Its roles.
        findings: Per field of the sidecar, the evidence.
        choices: The arms that were there to choose from, the chosen one first.
        workspace: What it reaches.
        open_joints: All gripper joints with the gripper open.
        notes: What the import changed.
    """

    model: ImportedModel
    sidecar: Sidecar
    findings: dict[str, Finding] = field(default_factory=dict)
    choices: tuple[str, ...] = ()
    workspace: Workspace
    open_joints: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(slots=True)
class _Hand:
    """What was measured of a gripper, by names."""

    roles: GripperRoles
    palm: str
    tool: Array
    rotation: Array
    open_qpos: Array
    findings: dict[str, Finding]


def infer(
    path: Path,
    *,
    gripper: Path | None = None,
    arm: str | None = None,
    package_paths: Iterable[Path] = (),
    table_height: float = TABLE_HEIGHT,
) -> Inference:
    """Work out a robot's sidecar.

    Args:
        path: URDF or MJCF.
        gripper: A gripper's model to mount on its flange.
        arm: Which arm, where there are several: the name of its last body, or a part of it.
        package_paths: Where package:// names are looked up.
        table_height: Of the table that it is to stand on, metres.

    Raises:
        InputError: A file is wrong, or no arm is found in it.
    """
    package_paths = tuple(package_paths)
    imported = import_model(path, package_paths)
    attachment: GripperAttachment | None = None
    if gripper is not None:
        attachment = _flange(imported, gripper, arm)
        mount(imported, attachment, gripper, package_paths)
    return infer_imported(imported, attachment=attachment, arm=arm, table_height=table_height)


def infer_imported(
    imported: ImportedModel,
    *,
    attachment: GripperAttachment | None = None,
    arm: str | None = None,
    table_height: float = TABLE_HEIGHT,
) -> Inference:
    """Work out the sidecar of an imported model; it is changed to fit: other arms go, fingers are refined.

    Raises:
        InputError: No arm is found in it.
    """
    model = compile_spec(imported.spec, imported.path.name)
    chain, choices = choose_chain(model, imported.path.name, arm)
    keep_tree(imported, model, chain.joints[0])
    names = tuple(str(model.joint(j).name) for j in chain.joints)
    gripper_names = tuple(str(model.joint(j).name) for j in chain.gripper_joints)
    findings = {"arm.joints": Finding(0.95, f"the actuated chain from the base to {chain.name(model)!r}")}
    palm = str(model.body(chain.palm).name)
    hand: _Hand | None = None
    if gripper_names:
        hand, findings["gripper"] = _measure_hand(imported, gripper_names, names, chain)
        if hand is not None:
            findings |= hand.findings
    else:
        findings["gripper"] = Finding(chain.confidence, chain.evidence)
    model = compile_spec(imported.spec, imported.path.name)
    joints = tuple(model.joint(name).id for name in names)
    if hand is not None:
        palm, position, rotation, start = hand.palm, hand.tool, hand.rotation, hand.open_qpos
    else:
        palm, position, rotation, findings["ee_site.inject.xyz"] = flange_tool(model, joints, palm)
        start = model.qpos0.copy()
    tool = Tool(model.body(palm).id, position, rotation)
    kinematics = Kinematics(model, joints, tool, start)
    floor = base_bottom(model, joints)
    space = find_workspace(kinematics, floor, collision_test(imported, kinematics, None))
    down = "straight down" if space.tilt < 0.1 else f"within {np.degrees(space.tilt):.0f} deg of down"
    findings["reach"] = Finding(0.9, f"the tool points {down} at the table {space.near:.2f}..{space.far:.2f} m ahead")
    home = find_home(kinematics, space, names, imported.keyframes, collision_test(imported, kinematics, space.floor))
    findings["arm.home_qpos"] = Finding(home.confidence, home.evidence)
    xyz, yaw = base_pose(space, table_height)
    turned = f", turned by {np.degrees(yaw):.0f} deg so that its workspace lies ahead" if abs(yaw) > 1e-3 else ""
    findings["base_pose.xyz"] = Finding(
        0.9 if space.tilt < 0.5 else 0.5,
        f"stands on the table; the middle of its reach, {space.middle:.2f} m ahead, comes to x = {xyz[0] + space.middle:.2f}{turned}",
    )
    actuators = _actuators(model, joints)
    findings["arm.actuators"] = Finding(
        1.0, "made by the import, one per joint" if set(actuators) <= imported.made_actuators else "drive these joints"
    )
    sidecar = Sidecar(
        arm=ArmRoles(joints=names, actuators=actuators, home_qpos=tuple(float(v) for v in home.q)),
        gripper=_with_attachment(hand.roles, attachment) if hand else None,
        ee_site=EeSite(
            inject=InjectedSite(
                attach_body=palm,
                xyz=(round(float(position[0]), 4), round(float(position[1]), 4), round(float(position[2]), 4)),
                quat_xyzw=_rounded(quat_xyzw_from_matrix(rotation)),
            )
        ),
        base_pose=BasePose(xyz=xyz, quat_xyzw=_rounded((0.0, 0.0, float(np.sin(yaw / 2.0)), float(np.cos(yaw / 2.0))))),
    )
    return Inference(
        model=imported,
        sidecar=sidecar,
        findings=findings,
        choices=choices,
        workspace=space,
        open_joints={name: float(start[model.joint(name).qposadr[0]]) for name in gripper_names} if hand else {},
        notes=tuple(imported.notes),
    )


def choose_chain(model: mujoco.MjModel, source: str, arm: str | None) -> tuple[Chain, tuple[str, ...]]:
    """Return the wanted arm, or the likeliest, and the names of all, that one first.

    Raises:
        InputError: There is none, or none of that name.
    """
    chains = find_chains(model)
    if not chains:
        raise InputError(f"{source}: no arm found: nothing has three actuated joints in a row")
    labels = [chain.name(model) for chain in chains]
    if arm is None:
        return chains[0], tuple(labels)
    for chain, label in zip(chains, labels, strict=True):
        members = {label, *(str(model.joint(j).name) for j in chain.joints)}
        if arm in members or any(arm.lower() in member.lower() for member in members):
            return chain, (label, *(other for other in labels if other != label))
    raise InputError(f"--arm: {arm!r} is no arm of {source}; there is {', '.join(labels)}{did_you_mean(arm, labels)}")


def keep_tree(imported: ImportedModel, model: mujoco.MjModel, joint: int) -> None:
    """Remove the trees of a model that the arm does not belong to."""
    root = int(model.body_rootid[model.jnt_bodyid[joint]])
    wanted = str(model.body(root).name)
    others = [tree for tree in imported.spec.worldbody.bodies if tree.name != wanted]
    moving = [tree.name for tree in others if tree.find_all(mujoco.mjtObj.mjOBJ_JOINT) or tree.joints]
    for tree in others:
        if tree.name in moving:
            imported.spec.delete(tree)
    if moving:
        imported.notes.append(f"left out beside {wanted!r}: {', '.join(moving)}")


def collision_test(
    imported: ImportedModel, kinematics: Kinematics, floor: float | None
) -> Callable[[Array], str | None]:
    """Return a function that says what the arm touches at a configuration: itself, or a table at `floor`."""
    spec = imported.spec.copy()
    if floor is not None:
        spec.worldbody.add_geom(
            name="robosandbox_table",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            pos=[0.0, 0.0, floor - 0.001],
            size=[2.0, 2.0, 0.1],
        )
    model = compile_spec(spec, imported.path.name)
    data = mujoco.MjData(model)
    start = kinematics.data.qpos.copy()

    def touching(q: Array) -> str | None:
        data.qpos[:] = start
        data.qpos[kinematics.addresses] = q
        mujoco.mj_fwdPosition(model, data)
        for contact in data.contact[: data.ncon]:
            if contact.dist < -5e-4:
                pair = [str(model.body(int(model.geom_bodyid[g])).name) for g in contact.geom]
                pair.sort(key=lambda name: name == "world")
                return f"{pair[0]!r} touching {'the table' if pair[1] == 'world' else repr(pair[1])}"
        return None

    return touching


def _measure_hand(
    imported: ImportedModel, gripper: tuple[str, ...], arm: tuple[str, ...], chain: Chain
) -> tuple[_Hand | None, Finding]:
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
    frame = measure_tcp(model, data, pads, closed, grasp, axes)
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
    hand = _Hand(roles, str(model.body(palm).name), local, rotation, opened.copy(), findings)
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
        if int(model.body_weldid[model.site_bodyid[s]]) == weld and _is_tool(model.site(s).name)
    ]
    named += [
        (f"frame {model.body(b).name!r}", data.xpos[b].copy())
        for b in range(1, model.nbody)
        if int(model.body_weldid[b]) == weld and not model.body_geomnum[b] and _is_tool(model.body(b).name)
    ]
    best: tuple[float, str, Array] | None = None
    for label, place_of in named:
        offset = place_of - position
        along, across = abs(float(offset @ approach)), float(np.linalg.norm(offset - approach * (offset @ approach)))
        if across < _SNAP and along < _SNAP_ALONG and (best is None or along + across < best[0]):
            best = (along + across, label, place_of)
    if best is None:
        return position, "the middle of the area where the closed pads meet", 0.85
    distance = float(np.linalg.norm(best[2] - position))
    return best[2], f"the model's own {best[1]}, {distance * 1000:.0f} mm from where the closed pads meet", 0.97


def _is_tool(name: str) -> bool:
    return bool(_TOOL.search(name)) and not _NO_TOOL.search(name)


def flange_tool(model: mujoco.MjModel, joints: tuple[int, ...], palm: str) -> tuple[str, Array, Array, Finding]:
    """Return body, position and rotation of the tool of an arm without a gripper: the end of its last link."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    last = joints[-1]
    link = int(model.jnt_bodyid[last])
    bodies = _welded(model, link)
    points = _points_of(model, data, bodies)
    frames = [data.xpos[b] for b in bodies if _is_tool(model.body(b).name)]
    frames += [
        data.site_xpos[s]
        for s in range(model.nsite)
        if int(model.site_bodyid[s]) in bodies and _is_tool(model.site(s).name)
    ]
    anchor = data.xanchor[last].copy()
    before = _points_of(model, data, _welded(model, int(model.body_parentid[model.body_weldid[link]])))
    axis, why = _outward(model, data, last, (np.array(frames) if frames else points) - anchor, before - anchor)
    # Where nothing of the last link has a shape, its tool is the end of the one before it.
    solid = points if _has_shape(model, bodies) else before
    tip = anchor + axis * float(((solid - anchor) @ axis).max())
    body = _flange_body(model, bodies, link)
    R_body = data.xmat[body].reshape(3, 3)
    side = R_body[:, int(np.abs(R_body.T @ axis).argmin())]
    closing = side - axis * (axis @ side)
    closing /= np.linalg.norm(closing)
    rotation = R_body.T @ np.column_stack([np.cross(closing, axis), closing, axis])
    position = R_body.T @ (tip - data.xpos[body])
    return str(model.body(body).name), position, rotation, Finding(0.8, f"the end of the last link, {why}")


def _outward(model: mujoco.MjModel, data: mujoco.MjData, joint: int, points: Array, before: Array) -> tuple[Array, str]:
    """Return the direction, shape (3,), in which the last link points, and which one that is.

    Args:
        model: The robot.
        data: Where it is.
        joint: The last joint.
        points: On the last link or its tool frames, from the joint's anchor, shape (k, 3).
        before: On the link that carries it, shape (k, 3).
    """
    axis = data.xaxis[joint].copy()
    along, behind = points @ axis, before @ axis
    flat = points - np.outer(along, axis)
    aside = flat.mean(axis=0)
    reach = float(np.linalg.norm(flat, axis=1).max())
    # A wrist that ends in a bend, not in a roll, points the way its link reaches from the joint.
    if np.linalg.norm(aside) > max(_BENT * abs(float(along.mean())), 0.5 * reach, 0.01):
        direction = aside / np.linalg.norm(aside)
        return _nearest_axis(data.xmat[model.jnt_bodyid[joint]].reshape(3, 3), direction), "across its joint's axis"
    # A flange may be so thin that it lies on neither side of its origin: it is on the far side of what carries it.
    tip, root = float(along[np.abs(along).argmax()]), float(behind.mean())
    outward = tip if abs(tip) > abs(root) else float(along.mean()) - root
    return (axis if outward >= 0.0 else -axis), "along its joint's axis"


def _nearest_axis(R: Array, direction: Array) -> Array:
    """Return the frame's own axis within 15 degrees of a direction, else the direction; shape (3,)."""
    cosines = R.T @ direction
    best = int(np.abs(cosines).argmax())
    axis: Array = R[:, best] * np.sign(cosines[best])
    return axis if abs(cosines[best]) > np.cos(np.radians(15.0)) else direction


def _welded(model: mujoco.MjModel, body: int) -> frozenset[int]:
    weld = int(model.body_weldid[body])
    return frozenset(b for b in range(1, model.nbody) if int(model.body_weldid[b]) == weld)


def _has_shape(model: mujoco.MjModel, bodies: frozenset[int]) -> bool:
    return any(int(b) in bodies for b in model.geom_bodyid)


def _points_of(model: mujoco.MjModel, data: mujoco.MjData, bodies: frozenset[int]) -> Array:
    """Return points on bodies, their origins where they have no shape; shape (k, 3)."""
    geoms = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in bodies]
    points = world_points(model, data, geoms, 0.005) if geoms else data.xpos[sorted(bodies)]
    return points if len(points) else np.zeros((1, 3))


def _flange_body(model: mujoco.MjModel, bodies: frozenset[int], link: int) -> int:
    named = [b for b in sorted(bodies) if _is_tool(model.body(b).name)]
    return named[-1] if named else link


def _flange(imported: ImportedModel, gripper: Path, arm: str | None) -> GripperAttachment:
    """Return where a separate gripper goes: the model's own attachment site or tool frame, else the last link's end."""
    model = compile_spec(imported.spec, imported.path.name)
    chain, _ = choose_chain(model, imported.path.name, arm)
    last = chain.joints[-1]
    weld = int(model.body_weldid[model.jnt_bodyid[last]])
    for s in range(model.nsite):
        if int(model.body_weldid[model.site_bodyid[s]]) == weld and _is_tool(model.site(s).name):
            return GripperAttachment(model=gripper, to_site=str(model.site(s).name))
    palm, position, rotation, _ = flange_tool(model, chain.joints, chain.name(model))
    return GripperAttachment(
        model=gripper,
        to_body=palm,
        xyz=(float(position[0]), float(position[1]), float(position[2])),
        quat_xyzw=quat_xyzw_from_matrix(rotation),
    )


def _with_attachment(roles: GripperRoles, attachment: GripperAttachment | None) -> GripperRoles:
    return roles.model_copy(update={"attach": attachment}) if attachment else roles


def _actuators(model: mujoco.MjModel, joints: tuple[int, ...]) -> tuple[str, ...]:
    names = []
    for joint in joints:
        found = [a for a in range(model.nu) if actuator_joints(model, a) == [joint]]
        if not found:
            raise InputError(f"arm joint {model.joint(joint).name!r} has no actuator of its own")
        names.append(str(model.actuator(found[0]).name))
    return tuple(names)


def _rounded(quat: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    x, y, z, w = (round(float(c), 6) + 0.0 for c in quat)
    return (x, y, z, w)
