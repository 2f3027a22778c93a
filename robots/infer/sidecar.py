"""A sidecar from the model alone: arm, gripper, open and closed, TCP, home and base, each with its evidence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.progress import doing
from robosandbox.robots.chains import Tool
from robosandbox.robots.findings import FieldEvidence
from robosandbox.robots.gripper.collision import ensure_solid_tool
from robosandbox.robots.gripper.hand import settle_hand, why_no_gripper
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.importers.isolate import keep_arm
from robosandbox.robots.importers.mount import mount
from robosandbox.robots.infer.cup import InferredCup, infer_cup
from robosandbox.robots.infer.gripper import InferredGripper, infer_gripper, measured_as_loaded
from robosandbox.robots.infer.kinematic_tree import Chain, actuator_joints, find_chains
from robosandbox.robots.infer.placement import TableWorkspace, base_bottom, base_pose, find_home, find_workspace
from robosandbox.robots.infer.reach import collision_test, with_table
from robosandbox.robots.infer.tcp import flange_tool, is_tool
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.sidecar import (
    ArmRoles,
    BasePose,
    EeSite,
    GripperAttachment,
    InjectedSite,
    Sidecar,
)
from robosandbox.robots.tolerances import ROBOT_TOLERANCES
from robosandbox.types import TABLE_HEIGHT, Array, quat_xyzw_from_matrix
from robosandbox.validation import did_you_mean
from robosandbox.values import frozen


@frozen(kw_only=True)
class Inference:
    """Inferred sidecar of a robot, with the evidence.

    Attributes:
        model: The model as imported, gripper mounted.
        sidecar: Its roles.
        findings: Per field of the sidecar, the evidence.
        choices: The arms that were there to choose from, the chosen one first.
        workspace: What it reaches.
        open_joints: All gripper joints with the gripper open.
        tip: How far the closed fingers go on beyond the TCP, metres.
        notes: What the import changed.
    """

    model: ImportedModel
    sidecar: Sidecar
    findings: dict[str, FieldEvidence] = field(default_factory=dict)
    choices: tuple[str, ...] = ()
    workspace: TableWorkspace
    open_joints: dict[str, float] = field(default_factory=dict)
    tip: float = 0.0
    notes: tuple[str, ...] = ()


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
    with doing(f"inferring the sidecar of {path.name}"):
        imported = import_model(path, package_paths)
        attachment: GripperAttachment | None = None
        if gripper is not None:
            attachment = _flange(imported, gripper, arm)
            mount(imported, attachment, gripper, package_paths)
        found = infer_imported(imported, attachment=attachment, arm=arm, table_height=table_height)
    if gripper is not None and found.sidecar.gripper is None:
        raise InputError(f"{gripper.name}: {found.findings['gripper'].evidence}")
    return found


def infer_imported(
    imported: ImportedModel,
    *,
    attachment: GripperAttachment | None = None,
    arm: str | None = None,
    listed: Iterable[str] = (),
    table_height: float = TABLE_HEIGHT,
) -> Inference:
    """Work out the sidecar of an imported model; it is changed to fit: other arms go, fingers are refined.

    Args:
        imported: The model.
        attachment: How a gripper of its own file was mounted on it.
        arm: Which arm, where there are several.
        listed: Joints that stay movable whatever the arm is: those that somebody's sidecar names.
        table_height: Of the table that it is to stand on, metres.

    Raises:
        InputError: No arm is found in it.
    """
    model = compile_spec(imported.spec, imported.path.name)
    chain, choices = choose_chain(model, imported.path.name, arm)
    names, gripper_names = (tuple(str(model.joint(j).name) for j in js) for js in (chain.joints, chain.gripper_joints))
    findings = {"arm.joints": FieldEvidence(0.95, f"the actuated chain from the base to {chain.name(model)!r}")}
    palm = chain.name(model)
    keep_arm(imported, model, {*names, *listed} & {str(model.joint(j).name) for j in range(model.njnt)})
    why_not = why_no_gripper(imported, gripper_names) if gripper_names else chain.evidence
    if gripper_names and not why_not:
        gripper_names = settle_hand(imported, gripper_names, listed)
    hand, findings["gripper"] = _hand(imported, chain, names, gripper_names, why_not)
    model = compile_spec(imported.spec, imported.path.name)
    joints = tuple(model.joint(name).id for name in names)
    palm, position, rotation, start = _tool(hand, model, joints, palm, findings)
    kinematics = Kinematics(model, joints, Tool(model.body(palm).id, position, rotation), qpos=start)
    place = _place(imported, kinematics, base_bottom(model, joints), names, table_height)
    actuators = _actuators(model, joints)
    sidecar = Sidecar(
        arm=ArmRoles(joints=names, actuators=actuators, home_qpos=tuple(float(v) for v in place.home)),
        gripper=hand.roles.model_copy(update={"attach": attachment}) if hand else None,
        ee_site=_site(palm, position, rotation),
        base_pose=place.base,
    )
    fingers = hand if isinstance(hand, InferredGripper) else None
    if fingers is not None:
        sidecar, measured = measured_as_loaded(imported, sidecar, table_height, place.space)
        findings |= measured
    made = set(actuators) <= imported.made_actuators
    driven = FieldEvidence(1.0, "made by the import, one per joint" if made else "drive these joints")
    return Inference(
        model=imported,
        sidecar=sidecar,
        findings={**findings, **place.findings, "arm.actuators": driven},
        choices=choices,
        workspace=place.space,
        open_joints={name: float(start[model.joint(name).qposadr[0]]) for name in gripper_names} if fingers else {},
        tip=fingers.tip if fingers else 0.0,
        notes=tuple(imported.notes),
    )


def _hand(
    imported: ImportedModel, chain: Chain, names: tuple[str, ...], gripper_names: tuple[str, ...], why_not: str
) -> tuple[InferredGripper | InferredCup | None, FieldEvidence]:
    """Return the gripper or the cup at an arm's end, and the evidence; without either the end is made solid.

    Args:
        imported: The model; it is changed.
        chain: Where they were found.
        names: The arm's joints.
        gripper_names: The gripper's, settled.
        why_not: Why there is no gripper; "" where there may be one.
    """
    finding = FieldEvidence(chain.confidence, why_not)
    if not why_not:
        gripper, finding = infer_gripper(imported, gripper_names, names, chain)
        if gripper is not None:
            return gripper, finding
    model = compile_spec(imported.spec, imported.path.name)
    cup = infer_cup(model, tuple(model.joint(name).id for name in names))
    if cup is None:
        ensure_solid_tool(imported, names[-1])
    return cup, finding


def _tool(
    hand: InferredGripper | InferredCup | None,
    model: mujoco.MjModel,
    joints: tuple[int, ...],
    palm: str,
    findings: dict[str, FieldEvidence],
) -> tuple[str, Array, Array, Array]:
    """Return the TCP's body, its place and rotation there, and the configuration in which the hand is open; add what tells them."""
    if isinstance(hand, InferredCup):
        findings |= hand.findings
        return hand.body, hand.tool, hand.rotation, model.qpos0.copy()
    if hand is not None:
        findings |= hand.findings
        return hand.palm, hand.tool, hand.rotation, hand.open_qpos
    palm, position, rotation, findings["ee_site.inject.xyz"] = flange_tool(model, joints, palm)
    return palm, position, rotation, model.qpos0.copy()


def _site(palm: str, position: Array, rotation: Array) -> EeSite:
    """Return the TCP as a site on the palm, to a tenth of a millimetre."""
    x, y, z = (round(float(value), 4) for value in position)
    return EeSite(
        inject=InjectedSite(attach_body=palm, xyz=(x, y, z), quat_xyzw=_rounded(quat_xyzw_from_matrix(rotation)))
    )


@frozen
class _Place:
    """Placement and start of an arm: what it reaches, its home (n,), its base, and the evidence."""

    space: TableWorkspace
    home: Array
    base: BasePose
    findings: dict[str, FieldEvidence]


def _place(
    imported: ImportedModel, kinematics: Kinematics, floor: float, names: tuple[str, ...], table_height: float
) -> _Place:
    """Return where an arm stands on a table so that it works there; `floor` is its foot's height in its own frame, metres."""
    space = find_workspace(kinematics, floor, collision_test(kinematics.model, kinematics))
    # Planning starts at home, and takes no overlap for clear.
    table = with_table(imported.spec, imported.path.name, space.floor)
    home = find_home(kinematics, space, names, imported.keyframes, collision_test(table, kinematics, deepest=0.0))
    xyz, yaw = base_pose(space, table_height)
    down = "straight down" if space.tilt < 0.1 else f"within {np.degrees(space.tilt):.0f} deg of down"
    turned = f", turned by {np.degrees(yaw):.0f} deg so that its workspace lies ahead" if abs(yaw) > 1e-3 else ""
    ahead = f"the middle of its reach, {space.middle:.2f} m ahead, comes to x = {xyz[0] + space.middle:.2f}{turned}"
    findings = {
        "reach": FieldEvidence(0.9, f"the tool points {down} at the table {space.near:.2f}..{space.far:.2f} m ahead"),
        "arm.home_qpos": FieldEvidence(home.confidence, home.evidence),
        "base_pose.xyz": FieldEvidence(0.9 if space.tilt < 0.5 else 0.5, f"stands on the table; {ahead}"),
    }
    turn = (0.0, 0.0, float(np.sin(yaw / 2.0)), float(np.cos(yaw / 2.0)))
    return _Place(space, home.q, BasePose(xyz=xyz, quat_xyzw=_rounded(turn)), findings)


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


def _flange(imported: ImportedModel, gripper: Path, arm: str | None) -> GripperAttachment:
    """Return where a separate gripper goes: the model's own attachment site or tool frame, else the last link's end."""
    model = compile_spec(imported.spec, imported.path.name)
    chain, _ = choose_chain(model, imported.path.name, arm)
    palm, position, rotation, _ = flange_tool(model, chain.joints, chain.name(model))
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    outward = data.xmat[model.body(palm).id].reshape(3, 3) @ rotation[:, 2]
    weld = int(model.body_weldid[model.jnt_bodyid[chain.joints[-1]]])
    for s in range(model.nsite):
        if int(model.body_weldid[model.site_bodyid[s]]) != weld or not is_tool(model.site(s).name):
            continue
        # A site without a rotation of its own says little about where a gripper would point.
        if float(data.site_xmat[s].reshape(3, 3)[:, 2] @ outward) > ROBOT_TOLERANCES.along:
            return GripperAttachment(model=gripper, to_site=str(model.site(s).name))
    return GripperAttachment(
        model=gripper,
        to_body=palm,
        xyz=(float(position[0]), float(position[1]), float(position[2])),
        quat_xyzw=quat_xyzw_from_matrix(rotation),
    )


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
