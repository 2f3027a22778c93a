"""An arm alone: what the model holds besides it is taken away, or stands still."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import mujoco
import numpy as np

from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.importing import let_neighbours_touch
from robosandbox.robots.infer.kinematic_tree import tendon_joints


def keep_arm(imported: ImportedModel, model: mujoco.MjModel, joints: Iterable[str]) -> None:
    """Remove the trees of a model that the arm does not belong to, and the joints that are neither its nor beyond it.

    A torso, wheels or another arm stay where the file draws them, as firm as the base.

    Args:
        imported: The model; it is changed.
        model: The same, compiled.
        joints: The arm's.
    """
    spec = imported.spec
    arm = [model.joint(name).id for name in joints]
    root = str(model.body(int(model.body_rootid[model.jnt_bodyid[arm[0]]])).name)
    others = [tree for tree in spec.worldbody.bodies if tree.name != root]
    moving = [tree for tree in others if tree.find_all(mujoco.mjtObj.mjOBJ_JOINT) or tree.joints]
    for tree in moving:
        spec.delete(tree)
    if moving:
        imported.notes.append(f"left out beside {root!r}: {', '.join(tree.name for tree in moving)}")
    carried = {int(model.jnt_bodyid[joint]) for joint in arm}
    for body in range(1, model.nbody):
        if int(model.body_parentid[body]) in carried:
            carried.add(body)
    held = {str(model.joint(j).name) for j in range(model.njnt) if int(model.jnt_bodyid[j]) not in carried}
    held = {joint.name for joint in spec.joints if joint.name in held}
    if held:
        weld(spec, model, dict.fromkeys(held))
        let_neighbours_touch(spec, compile_spec(spec, imported.path.name))
        imported.made_actuators &= {actuator.name for actuator in spec.actuators}
        imported.notes.append(f"held still: {', '.join(sorted(held))}")


def weld(spec: mujoco.MjSpec, model: mujoco.MjModel, joints: Mapping[str, float | None]) -> None:
    """Weld joints, and take away what drives or couples them.

    Args:
        spec: The model; it is changed.
        model: The same, compiled.
        joints: Joint -> its value, radians or metres; None is where the file draws it.
    """
    for name, value in joints.items():
        if value is not None:
            _turn(spec, model, model.joint(name).id, value)
    tendons = {
        str(model.tendon(t).name)
        for t in range(model.ntendon)
        if any(str(model.joint(j).name) in joints for j in tendon_joints(model, t))
    }
    for actuator in list(spec.actuators):
        if actuator.target in joints or actuator.target in tendons:
            spec.delete(actuator)
    for equality in list(spec.equalities):
        if {equality.name1, equality.name2} & (joints.keys() | tendons):
            spec.delete(equality)
    for tendon in list(spec.tendons):
        if tendon.name in tendons:
            spec.delete(tendon)
    for joint in list(spec.joints):
        if joint.name in joints:
            spec.delete(joint)


def _turn(spec: mujoco.MjSpec, model: mujoco.MjModel, joint: int, value: float) -> None:
    """Put a body to where its one joint has a value."""
    b = int(model.jnt_bodyid[joint])
    body = spec.body(model.body(b).name)
    away = value - float(model.qpos0[model.jnt_qposadr[joint]])
    axis, anchor = model.jnt_axis[joint], model.jnt_pos[joint]
    turn, rotation, moved = np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(9), np.zeros(3)
    if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE.value:
        mujoco.mju_axisAngle2Quat(turn, axis, away)
        mujoco.mju_quat2Mat(rotation, turn)
        shift = anchor - rotation.reshape(3, 3) @ anchor
    else:
        shift = away * axis
    mujoco.mju_rotVecQuat(moved, shift, model.body_quat[b])
    quat = np.zeros(4)
    mujoco.mju_mulQuat(quat, model.body_quat[b], turn)
    body.pos, body.quat = model.body_pos[b] + moved, quat
    body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
