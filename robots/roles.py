"""A sidecar's names on a model: checked, and completed with what the model itself says."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.gripper.calibrate import palm_of, servo_map
from robosandbox.robots.gripper.cup import suctions
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.infer.kinematic_tree import actuator_joints
from robosandbox.robots.sidecar import Sidecar, SuctionRoles
from robosandbox.validation import did_you_mean

_ARM_JOINTS = (mujoco.mjtJoint.mjJNT_HINGE.value, mujoco.mjtJoint.mjJNT_SLIDE.value)
_JOINT_TRANSMISSION = mujoco.mjtTrn.mjTRN_JOINT.value


def apply_roles(sidecar: Sidecar, imported: ImportedModel) -> Sidecar:
    """Check a sidecar's names against the model and fill in the actuators that it leaves out.

    Servos that the import made take the names that the sidecar has for them.

    Raises:
        InputError: A name is not in the model; the message says the field and the nearest name.
    """
    spec, path = imported.spec, imported.path
    _check_joints(sidecar, spec, path)
    model = compile_spec(spec, path.name)
    by_joint: dict[str, list[str]] = {}
    for a in range(model.nu):
        for j in actuator_joints(model, a):
            by_joint.setdefault(str(model.joint(j).name), []).append(str(model.actuator(a).name))
    arm = sidecar.arm
    actuators = []
    for i, joint in enumerate(arm.joints):
        there = by_joint.get(joint, [])
        wanted = arm.actuators[i] if arm.actuators else (there[0] if there else None)
        if wanted is None:
            raise InputError(f"arm.joints[{i}] {joint!r} has no actuator in {path.name}; give it a position servo")
        actuators.append(_adopt(imported, there, wanted))
    update: dict[str, object] = {"arm": arm.model_copy(update={"actuators": tuple(actuators)})}
    if sidecar.suction:
        update["gripper"] = _sucking(sidecar.suction, model, path)
    elif roles := sidecar.fingers:
        named = roles.actuator_names
        moved = [name for joint in (roles.primary_joint, *roles.joints) for name in by_joint.get(joint, ())]
        if not named:
            named = tuple(dict.fromkeys(moved))
            if not named:
                raise InputError(
                    f"gripper.actuator: nothing in {path.name} drives {list(roles.joints)}; name what does"
                )
        else:
            named = tuple(_adopt(imported, [name for name in moved if name not in named], name) for name in named)
            named += _mirrors(compile_spec(spec, path.name), [j for j in roles.joints if j not in arm.joints], named)
        every = (*roles.joints, *_linked_joints(model, roles.joints, arm.joints))
        update["gripper"] = roles.model_copy(update={"joints": every, "actuator": None, "actuators": named})
    completed = sidecar.model_copy(update=update)
    _check_actuator_names(completed, spec, path)
    return completed


def _mirrors(model: mujoco.MjModel, joints: list[str], named: tuple[str, ...]) -> tuple[str, ...]:
    """Return what drives those of a gripper's joints that the named actuators do not move: a second finger's servo."""
    drives = {str(model.actuator(a).name): actuator_joints(model, a) for a in range(model.nu)}
    moved = {j for name in named for j in drives.get(name, ())}
    tied = np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT.value)
    coupled = {frozenset((int(model.eq_obj1id[e]), int(model.eq_obj2id[e]))) for e in tied}
    own = [model.joint(name).id for name in joints]
    if not moved & set(own):
        # The named actuator drives something else; the user is told, and nothing is replaced.
        return ()
    left = [j for j in own if j not in moved and not any(frozenset((j, other)) in coupled for other in moved)]
    return tuple(name for name, driven in drives.items() if name not in named and set(driven) & set(left))


def _linked_joints(model: mujoco.MjModel, listed: tuple[str, ...], arm: tuple[str, ...]) -> list[str]:
    """Return the other joints of the gripper's mechanism: what a linkage or a mimic moves along, listed or not."""
    root = palm_of(model, [model.joint(name).id for name in listed])
    found = []
    for j in range(model.njnt):
        name, body = str(model.joint(j).name), int(model.jnt_bodyid[j])
        while body and body != root:
            body = int(model.body_parentid[body])
        if root and body == root and int(model.jnt_bodyid[j]) != root and name not in (*listed, *arm):
            found.append(name)
    return found


def _adopt(imported: ImportedModel, there: list[str], wanted: str) -> str:
    """Give a servo that the import made the name that the sidecar has for it."""
    names = {actuator.name for actuator in imported.spec.actuators}
    made = [name for name in there if name in imported.made_actuators]
    if wanted not in names and made:
        imported.spec.actuator(made[0]).name = wanted
        imported.made_actuators = (imported.made_actuators - {made[0]}) | {wanted}
    return wanted


def _sucking(roles: SuctionRoles, model: mujoco.MjModel, path: Path) -> SuctionRoles:
    """Return a cup's roles with what sucks.

    Raises:
        InputError: Nothing of the model does, several do, or the named one does not.
    """
    there = suctions(model)
    if roles.actuator is None:
        if len(there) != 1:
            found = f"{', '.join(there)} of {path.name} do; name one" if there else f"nothing in {path.name} does"
            raise InputError(f"gripper.actuator: a cup sucks by an adhesion actuator, and {found}")
        return roles.model_copy(update={"actuator": there[0]})
    if roles.actuator not in there:
        names = [str(model.actuator(a).name) for a in range(model.nu)]
        hint = did_you_mean(roles.actuator, there or names)
        raise InputError(f"gripper.actuator {roles.actuator!r} is not an adhesion actuator of {path.name}{hint}")
    return roles


def _check_joints(sidecar: Sidecar, spec: mujoco.MjSpec, path: Path) -> None:
    names: dict[str, Iterable[str]] = {
        "joint": [item.name for item in spec.joints],
        "body": [item.name for item in spec.bodies],
        "site": [item.name for item in spec.sites],
    }
    wanted = [(f"arm.joints[{i}]", "joint", name) for i, name in enumerate(sidecar.arm.joints)]
    if sidecar.fingers:
        wanted += [(f"gripper.joints[{i}]", "joint", name) for i, name in enumerate(sidecar.fingers.joints)]
    if sidecar.ee_site.inject:
        wanted.append(("ee_site.inject.attach_body", "body", sidecar.ee_site.inject.attach_body))
    if sidecar.ee_site.name:
        wanted.append(("ee_site.name", "site", sidecar.ee_site.name))
    for field, kind, name in wanted:
        if name not in names[kind]:
            hint = did_you_mean(name, [n for n in names[kind] if n and n != "world"])
            raise InputError(f"{field} {name!r} is not a {kind} of {path.name}{hint}")


def _check_actuator_names(sidecar: Sidecar, spec: mujoco.MjSpec, path: Path) -> None:
    names = [item.name for item in spec.actuators]
    wanted = [(f"arm.actuators[{i}]", name) for i, name in enumerate(sidecar.arm.actuators)]
    if sidecar.gripper:
        wanted += [("gripper.actuator", name) for name in sidecar.gripper.actuator_names]
    for field, name in wanted:
        if name not in names:
            raise InputError(f"{field} {name!r} is not an actuator of {path.name}{did_you_mean(name, names)}")


def check_home(sidecar: Sidecar, model: mujoco.MjModel) -> None:
    """Refuse arm joints of other kinds, and a home outside their limits.

    Raises:
        InputError: Field, value and limits.
    """
    for i, (name, value) in enumerate(zip(sidecar.arm.joints, sidecar.arm.home_qpos, strict=True)):
        joint = model.joint(name).id
        if int(model.jnt_type[joint]) not in _ARM_JOINTS:
            raise InputError(f"arm.joints[{i}] {name!r} is a ball or free joint; the arm takes hinges and slides")
        low, high = model.jnt_range[joint]
        if model.jnt_limited[joint] and not low - 1e-6 <= value <= high + 1e-6:
            hinge = int(model.jnt_type[joint]) == mujoco.mjtJoint.mjJNT_HINGE.value
            degrees = hinge and abs(value) > math.tau and low <= math.radians(value) <= high
            raise InputError(
                f"arm.home_qpos[{i}]: {value:g} is outside the limits of {name!r}, {low:.4g}..{high:.4g}"
                f"{' rad: are these degrees?' if degrees else ''}"
            )


def check_actuators(sidecar: Sidecar, model: mujoco.MjModel) -> None:
    """Refuse arm actuators that drive another joint or are no servos.

    Raises:
        InputError: Field, name and what it drives.
    """
    for i, (joint, actuator) in enumerate(zip(sidecar.arm.joints, sidecar.arm.actuators, strict=True)):
        driven = int(model.actuator_trnid[model.actuator(actuator).id, 0])
        kind = model.actuator_trntype[model.actuator(actuator).id]
        if kind != _JOINT_TRANSMISSION or driven != model.joint(joint).id:
            other = model.joint(driven).name if kind == _JOINT_TRANSMISSION else "no single joint"
            raise InputError(f"arm.actuators[{i}] {actuator!r} drives {other!r}, not {joint!r}; keep the joints' order")
        try:
            servo_map(model, model.actuator(actuator).id)
        except ValueError as error:
            raise InputError(f"arm.actuators[{i}] {actuator!r} {error}; give it kp, or a position actuator") from None
