"""A saved state vector is checked against the model that is to continue from it."""

from __future__ import annotations

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.ranges import MOST_DISTANCE
from robosandbox.sim.saved_state import integrated_size, put_state
from robosandbox.sim.sleep_timer import moving_count
from robosandbox.types import Array

# Metres: a ball that left the table at 1 m/s and rolls for half an hour.
_FARTHEST = 20.0 * MOST_DISTANCE
# m/s and rad/s; chosen because a joint or body that is faster has diverged: what falls from the top of a hall reaches
# 45 m/s.
_FASTEST = 1e3
# Simulated seconds; chosen as thirty years, which no process lives.
_LONGEST = 1e9
# How far from 1 the length of a quaternion may be that MuJoCo has normalized at each step.
_NORM_SLACK = 1e-3
# By how much of its range, or how many radians or metres, a joint may be beyond its limits; chosen because MuJoCo's
# limits are soft.
_RANGE_SLACK = 0.2
_NEVER = (mujoco.mjtSleepPolicy.mjSLEEP_NEVER.value, mujoco.mjtSleepPolicy.mjSLEEP_AUTO_NEVER.value)
_FREE, _BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)


def check_state(model: mujoco.MjModel, state: Array, *, robot: str) -> None:
    """Refuse a state that is not one of this model's.

    Args:
        model: The scene's.
        state: As `take_state` returns it; one of before bodies slept ends where MuJoCo's numbers do.
        robot: Its name, for messages.

    Raises:
        InputError: It has another length, or a time, position, orientation, speed or sleeper that no world here gets into.
    """
    awake = integrated_size(model)
    if len(state) not in (awake, awake + model.ntree):
        raise InputError(
            f"the saved state has {len(state)} numbers and does not fit {robot} in this scene, which has "
            f"{awake + model.ntree}"
        )
    _check_sleepers(model, np.asarray(state[awake:], dtype=float))
    data = mujoco.MjData(model)
    put_state(model, data, state)
    _within("time", float(data.time), 0.0, _LONGEST, "s")
    _within("a speed", float(np.abs(data.qvel).max(initial=0.0)), 0.0, _FASTEST, "m/s or rad/s")
    for joint in range(model.njnt):
        _check_joint(model, data.qpos[int(model.jnt_qposadr[joint]) :], joint)


def _check_sleepers(model: mujoco.MjModel, asleep: Array) -> None:
    """Refuse sleepers that are in no ring: MuJoCo ends the process when it is to wake one.

    Args:
        model: The scene's.
        asleep: Of each tree the next in its ring of sleepers, or below zero where it is awake, shape (trees,); or nothing.
    """
    (sleeping,) = np.nonzero(asleep >= 0)
    whole = np.array_equal(asleep, np.round(asleep)) and asleep.min(initial=-1) >= moving_count(model)
    ringed = whole and np.array_equal(np.sort(asleep[sleeping]), sleeping)
    if not ringed or np.isin(model.tree_sleep_policy[sleeping], _NEVER).any():
        raise InputError("the saved state is no world's: what it says of which bodies sleep does not fit together")


def _check_joint(model: mujoco.MjModel, qpos: Array, joint: int) -> None:
    name, kind = model.joint(joint).name, int(model.jnt_type[joint])
    if kind == _FREE:
        for value in qpos[:3]:
            _within(f"{name!r}", float(value), -_FARTHEST, _FARTHEST, "m")
    if kind in (_FREE, _BALL):
        norm = float(np.linalg.norm(qpos[3:7] if kind == _FREE else qpos[:4]))
        _within(f"the quaternion of {name!r} has a length, which", norm, 1.0 - _NORM_SLACK, 1.0 + _NORM_SLACK, "")
    elif model.jnt_limited[joint]:
        low, high = (float(bound) for bound in model.jnt_range[joint])
        slack = _RANGE_SLACK * max(1.0, high - low)
        _within(f"joint {name!r}", float(qpos[0]), low - slack, high + slack, "m or rad")
    else:
        _within(f"joint {name!r}", float(qpos[0]), -_FARTHEST, _FARTHEST, "m or rad")


def _within(what: str, value: float, low: float, high: float, unit: str) -> None:
    if not low <= value <= high:
        raise InputError(
            f"the saved state is no world's: {what} is {value:g}, outside {low:g} to {high:g} {unit}".rstrip()
        )
