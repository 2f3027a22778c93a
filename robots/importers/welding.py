"""Joints of a model made firm, where they are or at a value."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from robosandbox.robots.infer.kinematic_tree import tendon_joints


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
