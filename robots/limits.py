"""How far joints go: as far as their limits let them, and as far as their servos can be told to."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from robosandbox.robots.gripper.calibrate import servo_map
from robosandbox.types import Array

_JOINT = mujoco.mjtTrn.mjTRN_JOINT.value
# A control range that leaves less of a joint's travel than this share is meant in other units; chosen far below the 57 of
# degrees for radians.
_LEAST_SHARE = 0.1
# How far a slide without limits is taken to go either way, metres; chosen as the length of an arm.
_FREE_SLIDE = 0.5


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
