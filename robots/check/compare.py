"""A sidecar held against what the model itself shows: joints, gripper, TCP, home and base."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.robots.chains import Tool
from robosandbox.robots.findings import CheckResult
from robosandbox.robots.importers.imported import compile_spec
from robosandbox.robots.infer.kinematic_tree import actuator_joints
from robosandbox.robots.infer.placement import find_workspace
from robosandbox.robots.infer.reach import collision_test
from robosandbox.robots.infer.sidecar import Inference
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.sidecar import EeSite, GripperRoles, Sidecar, SuctionRoles
from robosandbox.robots.singularity import conditioning, singularity
from robosandbox.robots.tolerances import ROBOT_TOLERANCES
from robosandbox.types import TABLE_HEIGHT, Array, matrix_from_quat_xyzw
from robosandbox.values import frozen

_DOWN = np.array([0.0, 0.0, -1.0])
_TABLE_HALF = 0.5
_GRID = 0.1  # Spacing in metres of the points of the table that are tried. Chosen: 100 points.
_LEAST_REACHED = 3  # Number of them to be reached. Chosen: with three of them an arm can be given a task.


def compare(found: Inference, given: Sidecar, *, table_height: float = TABLE_HEIGHT) -> list[CheckResult]:
    """Return the checks that need no simulation.

    Args:
        found: What was inferred from the same model.
        given: The sidecar in question.
        table_height: Of the table that the robot works on, metres.
    """
    model = compile_spec(found.model.spec, found.model.path.name)
    checks = [_joints(model, found, given)]
    if given.gripper is not None:
        checks += _gripper(model, found, given)
    checks.append(_tcp(model, found, given))
    if all(_has(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in given.arm.joints) and checks[0].ok:
        checks += _placement(model, found, given, table_height)
    return checks


def _has(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> bool:
    return bool(mujoco.mj_name2id(model, kind.value, name) >= 0)


def _joints(model: mujoco.MjModel, found: Inference, given: Sidecar) -> CheckResult:
    listed, chain = given.arm.joints, found.sidecar.arm.joints
    missing = [name for name in chain if name not in listed]
    unknown = [name for name in listed if not _has(model, mujoco.mjtObj.mjOBJ_JOINT, name)]
    if unknown:
        return CheckResult(
            "joints", False, f"{unknown[0]!r} is not a joint of the model", f"arm.joints[{listed.index(unknown[0])}]"
        )
    if missing:
        shown = ", ".join(repr(name) for name in missing)
        return CheckResult(
            "joints",
            False,
            f"the list skips {shown}: the arm has {len(chain)} joints, so IK solves for another arm",
            "arm.joints",
        )
    places = [listed.index(name) for name in chain]
    if places != sorted(places):
        return CheckResult("joints", False, f"not from base to wrist; the order is {', '.join(chain)}", "arm.joints")
    grip = set(found.sidecar.fingers.joints) if found.sidecar.fingers else set()
    if given.gripper is not None and grip & set(listed):
        return CheckResult(
            "joints", False, f"{sorted(grip & set(listed))[0]!r} moves the gripper, not the arm", "arm.joints"
        )
    return CheckResult("joints", True, f"all {len(listed)} joints from the base to the tool, in order")


def _gripper(model: mujoco.MjModel, found: Inference, given: Sidecar) -> list[CheckResult]:
    if given.suction is not None:
        return [_cup(found, given.suction)]
    roles, measured = given.fingers, found.sidecar.fingers
    if roles is None or measured is None:
        why = found.findings["gripper"].evidence
        return [CheckResult("gripper", False, f"the model has no gripper that could be measured: {why}", "gripper")]
    strangers = _of_the_arm(model, found, roles)
    if strangers:
        detail = f"{strangers[0]!r} drives {strangers[1]!r} of the arm, not the fingers"
        return [CheckResult("gripper_actuator", False, detail, "gripper.actuator")]
    checks = []
    if _has(model, mujoco.mjtObj.mjOBJ_JOINT, roles.primary_joint):
        checks.append(_primary(model, roles, measured))
        if not checks[0].ok:
            return checks
    return [*checks, _open_closed(roles, found, measured)] if roles.primary_joint == measured.primary_joint else checks


def _cup(found: Inference, roles: SuctionRoles) -> CheckResult:
    """Check that the model has the cup, and no other one at the arm's end."""
    there, why = found.sidecar.suction, found.findings["gripper"].evidence
    if there is None:
        return CheckResult("gripper", False, f"nothing at the arm's end sucks; {why}", "gripper.kind")
    if roles.actuator not in (None, there.actuator):
        detail = f"{roles.actuator!r} is not what sucks at the arm's end; that is {there.actuator!r}"
        return CheckResult("gripper_actuator", False, detail, "gripper.actuator")
    return CheckResult("gripper", True, why)


def _primary(model: mujoco.MjModel, roles: GripperRoles, measured: GripperRoles) -> CheckResult:
    """Check that the primary joint, which is in the model, is one of the fingers' that an actuator drives."""
    name = roles.primary_joint
    joint = model.joint(name).id
    ours = name in measured.joints
    if not ours or not any(joint in actuator_joints(model, a) for a in range(model.nu)):
        lacks = "has no actuator" if ours else "does not move the fingers"
        detail = f"{name!r} {lacks}; the one that has is {measured.primary_joint!r}"
        return CheckResult("primary_joint", False, detail, "gripper.primary_joint")
    if name != measured.primary_joint and _fit_the_other(model, roles, measured):
        detail = (
            f"open_qpos {roles.open_qpos:g} and closed_qpos {roles.closed_qpos:g} are values of "
            f"{measured.primary_joint!r}, not of {name!r}"
        )
        return CheckResult("primary_joint", False, detail, "gripper.primary_joint")
    return CheckResult("primary_joint", True, f"{name!r} has an actuator")


def _open_closed(roles: GripperRoles, found: Inference, measured: GripperRoles) -> CheckResult:
    """Check open and closed of the joint that was measured as well; what was measured there is said."""
    saw = {name: found.findings[f"gripper.{name}"].evidence for name in ("open_qpos", "closed_qpos")}
    low, high = sorted((measured.open_qpos, measured.closed_qpos))
    travel = high - low
    for name, value in (("open_qpos", roles.open_qpos), ("closed_qpos", roles.closed_qpos)):
        if not low - ROBOT_TOLERANCES.outside * travel <= value <= high + ROBOT_TOLERANCES.outside * travel:
            reached = f"is outside what the joint reaches ({low:g}..{high:g}); give a joint value"
            detail = f"{name} {value:g} {reached}: at {getattr(measured, name):g}, {saw[name]}"
            return CheckResult("open_closed", False, detail, f"gripper.{name}")
    fault, field = "", "gripper.open_qpos"
    if (roles.open_qpos - roles.closed_qpos) * (measured.open_qpos - measured.closed_qpos) < 0.0:
        fault = f"the wrong way round: the fingers are apart at {measured.open_qpos:g} and together at {measured.closed_qpos:g}"
    elif abs(roles.closed_qpos - measured.closed_qpos) > ROBOT_TOLERANCES.not_closed * travel:
        fault, field = (
            f"does not close: it would at {measured.closed_qpos:g} ({saw['closed_qpos']})",
            "gripper.closed_qpos",
        )
    elif abs(roles.open_qpos - measured.open_qpos) > ROBOT_TOLERANCES.not_open * travel:
        fault = f"hardly opens; it would to {measured.open_qpos:g} ({saw['open_qpos']})"
    if fault:
        return CheckResult("open_closed", False, fault, field)
    return CheckResult("open_closed", True, f"apart at {roles.open_qpos:g}, together at {roles.closed_qpos:g}")


def _of_the_arm(model: mujoco.MjModel, found: Inference, roles: GripperRoles) -> tuple[str, str] | None:
    """Return the first of a gripper's actuators that drives an arm joint, and that joint; not where it is the primary."""
    for name in roles.actuator_names:
        if _has(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name):
            driven = [str(model.joint(j).name) for j in actuator_joints(model, model.actuator(name).id)]
            for joint in driven:
                if joint in found.sidecar.arm.joints and joint not in (roles.primary_joint, *roles.joints):
                    return name, joint
    return None


def _fit_the_other(model: mujoco.MjModel, roles: GripperRoles, measured: GripperRoles) -> bool:
    """Tell whether open and closed lie outside the named joint's limits, and inside what the measured one goes through."""
    joint = model.joint(roles.primary_joint).id
    if not model.jnt_limited[joint]:
        return False
    slack = 0.1 * abs(measured.open_qpos - measured.closed_qpos)

    def inside(ends: Array) -> bool:
        low, high = np.sort(ends)
        return all(low - slack <= value <= high + slack for value in (roles.open_qpos, roles.closed_qpos))

    return inside(np.array([measured.open_qpos, measured.closed_qpos])) and not inside(model.jnt_range[joint])


@frozen
class _GivenTcp:
    """A sidecar's TCP in the world: its point, its rotation where the sidecar gives one, and the field that says where."""

    point: Array
    rotation: Array | None
    field: str


def _given_tcp(model: mujoco.MjModel, data: mujoco.MjData, site: EeSite, palm: str) -> _GivenTcp | CheckResult:
    """Return the TCP that a sidecar gives, or what is wrong with its names."""
    inject = site.inject
    if inject is None:
        name = str(site.name)
        if not _has(model, mujoco.mjtObj.mjOBJ_SITE, name):
            return CheckResult("tcp", False, f"{site.name!r} is not a site of the model", "ee_site.name")
        return _GivenTcp(data.site_xpos[model.site(name).id].copy(), None, "ee_site.name")
    body, field = inject.attach_body, "ee_site.inject.attach_body"
    if not _has(model, mujoco.mjtObj.mjOBJ_BODY, body):
        return CheckResult("tcp", False, f"{body!r} is not a body of the model", field)
    if model.body_weldid[model.body(body).id] != model.body_weldid[model.body(palm).id]:
        return CheckResult("tcp", False, f"{body!r} does not move with the palm, {palm!r}", field)
    point, rotation = _world(model, data, body, inject.xyz, inject.quat_xyzw or (0.0, 0.0, 0.0, 1.0))
    return _GivenTcp(point, rotation if inject.quat_xyzw else None, "ee_site.inject.xyz")


def _tcp(model: mujoco.MjModel, found: Inference, given: Sidecar) -> CheckResult:
    """Hold the TCP against where the pads meet, in the frame of the inferred one."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    truth = found.sidecar.ee_site.inject
    assert truth is not None and truth.quat_xyzw is not None
    origin, R = _world(model, data, truth.attach_body, truth.xyz, truth.quat_xyzw)
    tcp = _given_tcp(model, data, given.ee_site, truth.attach_body)
    if isinstance(tcp, CheckResult):
        return tcp
    x, y, along = R.T @ (tcp.point - origin)
    aside = float(np.hypot(x, y))
    where = f"{aside * 1000:.0f} mm beside and {along * 1000:+.0f} mm along the approach from"
    cup = given.suction is not None
    what = "the cup's lip" if cup else "where the pads meet" if given.gripper else "the end of the last link"
    if given.gripper is None or found.sidecar.gripper is None:
        far = float(np.linalg.norm(tcp.point - origin)) > ROBOT_TOLERANCES.tcp_of_link
        return CheckResult("tcp", not far, f"{where} {what}", tcp.field if far else None)
    # Long pads hold things all the way to their tips, which is where some makers put the TCP.
    behind, beyond = (
        (ROBOT_TOLERANCES.tcp_of_lip, ROBOT_TOLERANCES.tcp_of_lip)
        if cup
        else (ROBOT_TOLERANCES.tcp_behind, max(ROBOT_TOLERANCES.tcp_beyond, found.tip + ROBOT_TOLERANCES.tip_slack))
    )
    if aside > ROBOT_TOLERANCES.tcp_aside or not -behind <= along <= beyond:
        aims = "beside the cup" if cup else "beside the fingers, not between them"
        return CheckResult("tcp", False, f"{where} {what}: IK aims {aims}", tcp.field)
    if tcp.rotation is not None:
        angle = float(np.degrees(np.arccos(np.clip(tcp.rotation[:, 2] @ R[:, 2], -1.0, 1.0))))
        if angle > ROBOT_TOLERANCES.approach_deg:
            return CheckResult(
                "tcp", False, f"its z points {angle:.0f} deg off the approach", "ee_site.inject.quat_xyzw"
            )
    return CheckResult("tcp", True, f"{where} {what}", tcp.field if along < -ROBOT_TOLERANCES.tcp_doubted else None)


def _world(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    body: str,
    xyz: tuple[float, float, float],
    quat: tuple[float, float, float, float],
) -> tuple[Array, Array]:
    b = model.body(body).id
    R = data.xmat[b].reshape(3, 3)
    return data.xpos[b] + R @ np.array(xyz), R @ matrix_from_quat_xyzw(quat)


def _placement(model: mujoco.MjModel, found: Inference, given: Sidecar, table_height: float) -> list[CheckResult]:
    """Check home and base with the inferred TCP, so that a wrong one is not blamed twice."""
    truth = found.sidecar.ee_site.inject
    assert truth is not None and truth.quat_xyzw is not None
    tool = Tool(model.body(truth.attach_body).id, np.array(truth.xyz), matrix_from_quat_xyzw(truth.quat_xyzw))
    joints = tuple(model.joint(name).id for name in given.arm.joints)
    start = model.qpos0.copy()
    for name, value in found.open_joints.items():
        start[model.joint(name).qposadr[0]] = value
    kinematics = Kinematics(model, joints, tool, qpos=start)
    q = np.array(given.arm.home_qpos)
    base = np.array(given.base_pose.xyz)
    table = table_height - base[2]
    natural = max(found.workspace.floor, 0.0) if found.workspace.floor > -0.15 else found.workspace.floor
    sunk = table - natural
    checks = [
        CheckResult(
            "base_height",
            False,
            f"the mounting plane is {sunk * 1000:.0f} mm below the table: the arm goes through it",
            "base_pose.xyz",
        )
        if sunk > ROBOT_TOLERANCES.sunk
        else CheckResult("base_height", True, f"the mounting plane is {round(-sunk * 1000):+d} mm from the table top")
    ]
    outside = [
        name
        for name, value, low, high in zip(given.arm.joints, q, kinematics.lower, kinematics.upper, strict=True)
        if not low - 1e-6 <= value <= high + 1e-6
    ]
    if outside:
        checks.append(CheckResult("home", False, f"{outside[0]!r} is outside its limits there", "arm.home_qpos"))
    else:
        checks.append(_home(found, kinematics, q, table, sunk > ROBOT_TOLERANCES.sunk))
    if sunk <= ROBOT_TOLERANCES.sunk:
        checks.append(_reach(kinematics, given, table_height))
    return checks


def _home(found: Inference, kinematics: Kinematics, q: Array, table: float, sunk: bool) -> CheckResult:
    itself = collision_test(kinematics.model, kinematics)(q)
    if itself is not None:
        return CheckResult("home", False, f"touches itself: {itself}", "arm.home_qpos")
    singular = singularity(kinematics, q, found.workspace.far)
    if singular is not None:
        return CheckResult("home", False, f"singular: {singular}; bend the elbow", "arm.home_qpos")
    position, _ = kinematics.forward(q)
    if position[2] < table - 0.002 and not sunk:
        return CheckResult(
            "home", False, f"has the tool {1000 * (table - position[2]):.0f} mm under the table", "arm.home_qpos"
        )
    ratio = conditioning(kinematics, q) / max(found.workspace.far, 1e-6)
    return CheckResult("home", True, f"clear of itself, {ratio:.2f} m/rad per metre from a singularity")


def _reach(kinematics: Kinematics, given: Sidecar, table_height: float) -> CheckResult:
    """Count points of the table at which the tool can be held down."""
    R = matrix_from_quat_xyzw(given.base_pose.quat_xyzw)
    base = np.array(given.base_pose.xyz)
    space = find_workspace(kinematics, table_height - base[2])
    reached = tried = 0
    axis = base[:2] + (R @ np.array([*space.axis, 0.0]))[:2]
    steps = np.arange(-_TABLE_HALF + _GRID / 2, _TABLE_HALF, _GRID)
    for x in steps:
        for y in steps:
            if not space.near <= float(np.hypot(x - axis[0], y - axis[1])) <= space.far:
                continue
            tried += 1
            local = R.T @ (np.array([x, y, table_height + 0.03]) - base)
            if kinematics.find(local, _DOWN, tilt=max(0.05, space.tilt), restarts=4) is not None:
                reached += 1
    share = reached / len(steps) ** 2
    if (reached < _LEAST_REACHED and space.far - space.near > 2 * _GRID) or reached == 0:
        return CheckResult(
            "reach",
            False,
            f"reaches {reached} of {len(steps) ** 2} points of the table; move the base so that its workspace "
            f"({space.near:.2f}..{space.far:.2f} m from its axis) overlaps it",
            "base_pose.xyz",
        )
    return CheckResult("reach", True, f"points the tool down over {share * 100:.0f}% of the table")
