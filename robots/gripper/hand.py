"""A hand of three and more fingers made a gripper: one way to close, everything else of it held."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

from robosandbox.robots.gripper.calibrate import IN_STEP, joints_below, moving_groups, servo_map
from robosandbox.robots.gripper.couplings import fit_couplings, hold_stopped
from robosandbox.robots.gripper.opposition import MOST_SERVOS, Opposition, find_opposition
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.servos import ROTOR_PER_EFFORT, get_armature
from robosandbox.robots.importers.welding import weld
from robosandbox.robots.infer.kinematic_tree import actuator_joints

# Number of fingers from which a gripper is a hand; chosen as the least that need not close on each other: two jaws are left as
# their files have them.
LEAST_FINGERS = 3


def settle_hand(imported: ImportedModel, joints: Iterable[str], listed: Iterable[str] = ()) -> tuple[str, ...]:
    """Hold what does not close a hand, and let the rest follow what drives it; return the joints that are left to move.

    Args:
        imported: The model; it is changed where the hand has three fingers or more, and what is changed is noted.
        joints: The hand's.
        listed: Those that a sidecar names; they are not held.
    """
    joints, listed = tuple(joints), tuple(listed)
    model = compile_spec(imported.spec, imported.path.name)
    if _driven_fingers(model, joints) < LEAST_FINGERS:
        return joints
    hold_stopped(imported, joints, listed)
    joints = _left(imported, joints)
    fit_couplings(imported, joints)
    model = compile_spec(imported.spec, imported.path.name)
    found = find_opposition(model, [model.joint(name).id for name in joints])
    if found is not None:
        _hold_spread(imported, model, found, listed)
        _keep_in_step(imported, model, found)
    return _left(imported, joints)


def why_no_gripper(imported: ImportedModel, joints: Iterable[str]) -> str:
    """Return why a hand is not driven as a gripper, which has one way to close; "" where it is.

    Args:
        imported: The model.
        joints: The hand's.
    """
    model = compile_spec(imported.spec, imported.path.name)
    servos = [count for count in _servos(model, tuple(joints)) if count]
    if len(servos) < LEAST_FINGERS or max(servos) <= MOST_SERVOS:
        return ""
    return (
        f"this hand has {len(servos)} fingers with up to {max(servos)} servos each; a hand is driven as a gripper where no finger "
        f"has more than {MOST_SERVOS}, one that closes it and one that spreads it"
    )


def _servos(model: mujoco.MjModel, joints: tuple[str, ...]) -> list[int]:
    """Return how many actuators drive each of a hand's sides."""
    groups = moving_groups(model, [model.joint(name).id for name in joints])
    driven = [{int(model.jnt_bodyid[j]) for j in actuator_joints(model, a)} for a in range(model.nu)]
    return [sum(bool(bodies & group) for bodies in driven) for group in groups]


def _driven_fingers(model: mujoco.MjModel, joints: tuple[str, ...]) -> int:
    """Return how many of a hand's sides something drives: the far bars of a jaw's linkage are no fingers."""
    return sum(count > 0 for count in _servos(model, joints))


def _hold_spread(imported: ImportedModel, model: mujoco.MjModel, found: Opposition, listed: tuple[str, ...]) -> None:
    """Weld what only spreads the fingers where they oppose each other best."""
    held: dict[str, float | None] = {str(model.joint(j).name): value for j, value in found.held.items()}
    held = {name: value for name, value in held.items() if name not in listed}
    if held:
        weld(imported.spec, model, held)
        told = ", ".join(f"{name} at {value:.3g}" for name, value in held.items())
        imported.notes.append(f"joints that spread the fingers are held where these oppose each other best: {told}")


def _keep_in_step(imported: ImportedModel, model: mujoco.MjModel, found: Opposition) -> None:
    """Let fingers with a servo each close together: all of them meet what lies in their middle at the same time.

    Servos at their force limits do not hold a place: two fingers would push the one against them back.
    """
    spec, first = imported.spec, found.fingers[0]
    for one in found.fingers:
        actuator = spec.actuator(model.actuator(one.actuator).name)
        scale, offset = servo_map(model, one.actuator)
        ends = np.array([one.open, one.closed]) * float(model.actuator_gear[one.actuator, 0]) * scale + offset
        actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.ctrlrange = np.sort(ends)
        _weigh(spec.joint(model.joint(one.joint).name), actuator)
        if one is first:
            continue
        ratio = (one.open - one.meets) / (first.open - first.meets)
        mine, its = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (one.joint, first.joint))
        equality = spec.add_equality(
            name=f"{IN_STEP}{model.joint(one.joint).name}",
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=model.joint(one.joint).name,
            name2=model.joint(first.joint).name,
        )
        data = np.zeros(len(equality.data))
        data[:2] = (one.meets - mine) - ratio * (first.meets - its), ratio
        equality.data = data
    names = ", ".join(str(model.joint(one.joint).name) for one in found.fingers)
    imported.notes.append(f"fingers with a servo each are kept in step, to meet what is between them together: {names}")


def _weigh(joint: mujoco.MjsJoint, actuator: mujoco.MjsActuator) -> None:
    """Give a finger's joint the rotor that its servo's force comes from.

    Fingers without inertia, kept in step by a constraint, tremble against what they hold until it slips out of their grip
    (measured: Kinova's Jaco leaves a cube of 50 g twenty times a second).
    """
    low, high = actuator.forcerange
    if high > low:
        effort = float(max(abs(low), abs(high))) * abs(float(actuator.gear[0]))
        joint.armature = max(get_armature(joint), ROTOR_PER_EFFORT * effort)


def settle_listed(imported: ImportedModel, listed: tuple[str, ...]) -> None:
    """Settle the hand whose joints a sidecar names; of names that are not there somebody else complains."""
    there = {joint.name for joint in imported.spec.joints}
    if not there.issuperset(listed):
        return
    model = compile_spec(imported.spec, imported.path.name)
    joints = joints_below(model, [model.joint(name).id for name in listed])
    settle_hand(imported, [str(model.joint(j).name) for j in joints], listed)


def _left(imported: ImportedModel, joints: tuple[str, ...]) -> tuple[str, ...]:
    there = {joint.name for joint in imported.spec.joints}
    return tuple(name for name in joints if name in there)
