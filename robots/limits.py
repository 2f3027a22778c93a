"""Joint limits: range by model and servo, speed by what the servos can do."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from robosandbox.robots.gripper.calibrate import servo_map
from robosandbox.robots.sidecar import Sidecar
from robosandbox.types import Array, frozen_array

_JOINT = mujoco.mjtTrn.mjTRN_JOINT.value
# A control range that leaves less of a joint's travel than this share is meant in other units; chosen far below the 57 of
# degrees for radians.
_LEAST_SHARE = 0.1
# How far a slide without limits is taken to go either way, metres; chosen as the length of an arm.
_FREE_SLIDE = 0.5
# Least and largest speed, rad/s, and acceleration, rad/s^2, that a joint gets whose file gives none, and the share of its
# servo's torque that accelerates it. Chosen: the Panda's own limits are 2.2 rad/s and 7.5 rad/s^2 at the least; the rest of the
# torque holds the arm against gravity.
_SPEEDS, _ACCELERATIONS, _TORQUE_SHARE = (0.5, 2.0), (0.25, 8.0), 0.4


def joint_limits(model: mujoco.MjModel, joints: Sequence[int]) -> tuple[Array, Array]:
    """Return the least and largest values that joints can be commanded to, each (k,); infinite where there is no end.

    Args:
        model: The robot.
        joints: Ids of hinges and slides.
    """
    lower, upper = np.full(len(joints), -np.inf), np.full(len(joints), np.inf)
    for k, joint in enumerate(joints):
        if model.jnt_limited[joint]:
            lower[k], upper[k] = model.jnt_range[joint]
        for low, high in _commanded(model, joint):
            left, right = max(lower[k], low), min(upper[k], high)
            if right - left > _LEAST_SHARE * min(upper[k] - lower[k], 2.0 * np.pi):
                lower[k], upper[k] = left, right
    return lower, upper


def commandable(model: mujoco.MjModel, joints: Sequence[int]) -> tuple[Array, Array]:
    """Return what joints can be commanded to, as `joint_limits`, but half a turn either way where there is no end."""
    ids = list(joints)
    free = np.where(model.jnt_type[ids] == mujoco.mjtJoint.mjJNT_SLIDE.value, _FREE_SLIDE, np.pi)
    limited = model.jnt_limited[ids].astype(bool)
    lower, upper = joint_limits(model, joints)
    return np.where(limited, lower, np.maximum(lower, -free)), np.where(limited, upper, np.minimum(upper, free))


def _commanded(model: mujoco.MjModel, joint: int) -> list[tuple[float, float]]:
    """Return the ranges of joint values that each position servo of a joint can be told."""
    found = []
    for actuator in range(model.nu):
        mine = model.actuator_trntype[actuator] == _JOINT and int(model.actuator_trnid[actuator, 0]) == joint
        gear = float(model.actuator_gear[actuator, 0])
        if not mine or not model.actuator_ctrllimited[actuator] or gear == 0.0:
            continue
        try:
            scale, offset = servo_map(model, actuator)
        except ValueError:
            continue
        low, high = np.sort((model.actuator_ctrlrange[actuator] - offset) / (scale * gear))
        found.append((float(low), float(high)))
    return found


def motion_limits(
    sidecar: Sidecar,
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    arm_q: dict[int, float],
    rated: dict[str, float],
) -> tuple[Array, Array]:
    """Return velocity and acceleration limits: the sidecar's, the model's custom numerics, or from torque and inertia."""
    n = len(sidecar.arm.joints)
    given = {
        "velocity_limits": sidecar.arm.velocity_limits,
        "acceleration_limits": sidecar.arm.acceleration_limits,
    }
    custom = {item.name: np.array(item.data, dtype=float) for item in spec.numerics}
    known = {name: np.array(limits or custom.get(name, ())) for name, limits in given.items()}
    acceleration, velocity = known["acceleration_limits"], known["velocity_limits"]
    if len(acceleration) != n:
        acceleration = _accelerations(sidecar, model, arm_q)
    if len(velocity) != n:
        # Half a radian to reach full speed: fast enough to work, slow enough for servos nobody has tuned.
        velocity = np.clip(np.sqrt(acceleration), *_SPEEDS)
        velocity = np.minimum(velocity, [rated.get(name, np.inf) for name in sidecar.arm.joints])
    return frozen_array(velocity), frozen_array(acceleration)


def _accelerations(sidecar: Sidecar, model: mujoco.MjModel, arm_q: dict[int, float]) -> Array:
    """Return what each servo's torque gives the inertia that its joint moves at home, shape (n,)."""
    data = mujoco.MjData(model)
    for address, value in arm_q.items():
        data.qpos[address] = value
    mujoco.mj_fwdPosition(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    found = []
    for joint, name in zip(sidecar.arm.joints, sidecar.arm.actuators, strict=True):
        dof, actuator = int(model.joint(joint).dofadr[0]), model.actuator(name).id
        force = abs(model.actuator_forcerange[actuator]).max() if model.actuator_forcelimited[actuator] else np.inf
        torque = force * abs(model.actuator_gear[actuator, 0])
        found.append(np.clip(_TORQUE_SHARE * torque / max(inertia[dof, dof], 1e-6), *_ACCELERATIONS))
    return np.array(found)
