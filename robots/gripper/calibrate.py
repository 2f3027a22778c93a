"""Driving a gripper over its whole control range and recording what moves."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import mujoco
import numpy as np

from robosandbox.robots.surfaces import world_points
from robosandbox.robots.tolerances import ROBOT_TOLERANCES
from robosandbox.types import Array
from robosandbox.values import frozen

# Number of samples from one end to the other, so that the gap between two of them is 1 to 2 mm of a wide gripper. Chosen.
_SAMPLES = 64
_SETTLE_SECONDS = 0.5  # Simulated seconds of one wait for rest. Chosen.
_MOST_SETTLES = 8  # Number of waits after which the gripper is taken to rest. Chosen.
_STILL = 0.003  # Speed at rest, rad/s or m/s. Chosen.
# Half the depth at which fingers are taken to be locked into one another, metres. Chosen above what contacts yield.
_LOCKED = 0.0005
IN_STEP = "in_step/"  # In the names of equalities that keep a hand's fingers in step.
JAWS = 2  # Number of sides of a gripper up to which each closes on the other.
_JOINT = mujoco.mjtTrn.mjTRN_JOINT.value


@frozen
class Sweep:
    """A gripper's samples on the way from one end of its controls to the other.

    Attributes:
        joints: Values of its joints, shape (k, g).
        lengths: Lengths of its actuators, shape (k, actuators).
        qpos: The whole configuration, shape (k, nq).
    """

    joints: Array
    lengths: Array
    qpos: Array


def servo_map(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """Return (scale, offset): the control that holds actuator length x is `scale * x + offset`.

    Raises:
        ValueError: The actuator is no position servo.
    """
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    if model.actuator_biastype[actuator] != mujoco.mjtBias.mjBIAS_AFFINE.value or gain[0] == 0.0 or bias[1] >= 0.0:
        raise ValueError("is not a position servo")
    return -float(bias[1] / gain[0]), -float(bias[0] / gain[0])


def control_range(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """Return the least and largest control of an actuator, from its range or its joint's.

    Raises:
        ValueError: Neither is limited.
    """
    if model.actuator_ctrllimited[actuator]:
        low, high = model.actuator_ctrlrange[actuator]
        return float(low), float(high)
    joint = int(model.actuator_trnid[actuator, 0])
    if model.actuator_trntype[actuator] == _JOINT and model.jnt_limited[joint]:
        scale, offset = servo_map(model, actuator)
        gear = model.actuator_gear[actuator, 0]
        low, high = np.sort(model.jnt_range[joint] * gear * scale + offset)
        return float(low), float(high)
    raise ValueError("has neither a control range nor a limited joint")


def palm_of(model: mujoco.MjModel, joint_ids: Sequence[int]) -> int:
    """Return the body that carries all these joints."""
    chains = []
    for joint in joint_ids:
        body, chain = int(model.body_parentid[model.jnt_bodyid[joint]]), []
        while True:
            chain.append(body)
            if body == 0:
                break
            body = int(model.body_parentid[body])
        chains.append(chain)
    return next(body for body in chains[0] if all(body in chain for chain in chains))


def moving_groups(model: mujoco.MjModel, joint_ids: Sequence[int]) -> list[frozenset[int]]:
    """Return the gripper's sides: bodies below each child of the palm that moves, and the palm for a lone jaw."""
    palm = palm_of(model, joint_ids)
    roots: dict[int, set[int]] = {}
    moved = {int(model.jnt_bodyid[j]) for j in joint_ids}
    for body in range(1, model.nbody):
        path = []
        walk = body
        while walk != palm and walk != 0:
            path.append(walk)
            walk = int(model.body_parentid[walk])
        if walk == palm and path and any(b in moved for b in path):
            roots.setdefault(path[-1], set()).add(body)
    # A link without a shape, as the far side of a drawn linkage, holds nothing.
    groups = [frozenset(bodies) for bodies in roots.values() if any(model.body_geomnum[b] for b in bodies)]
    if len(groups) == 1:
        weld = int(model.body_weldid[palm])
        groups.append(frozenset(b for b in range(1, model.nbody) if int(model.body_weldid[b]) == weld) - groups[0])
    return groups


def collision_geoms(model: mujoco.MjModel, bodies: frozenset[int]) -> list[int]:
    """Return the geoms of these bodies that collide, or all when none does."""
    geoms = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in bodies]
    solid = [g for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]
    return solid or geoms


def polarities(
    model: mujoco.MjModel, data: mujoco.MjData, joint_ids: Sequence[int], actuator_ids: Sequence[int]
) -> list[int]:
    """Return for each actuator whether a larger control takes its finger the way the first one's does: 1, or -1.

    One actuator has nothing to agree with. Of several, each finger's far end is watched against the others'.

    Raises:
        ValueError: None of the gripper's sides has a shape.
    """
    if len(actuator_ids) < 2:
        return [1] * len(actuator_ids)
    groups = moving_groups(model, joint_ids)
    if not groups:
        raise ValueError("moves nothing that has a shape")
    if len(groups) > JAWS and (steps := _in_step(model, actuator_ids)) is not None:
        return steps
    signs = []
    keep = data.qpos.copy()
    for actuator in actuator_ids:
        joint = int(model.actuator_trnid[actuator, 0])
        if model.actuator_trntype[actuator] != _JOINT:
            signs.append(1)
            continue
        mine = next((g for g in groups if int(model.jnt_bodyid[joint]) in g), groups[0])
        others = frozenset().union(*(g for g in groups if g is not mine))
        low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-0.5, 0.5)
        gaps = []
        for share in (0.1, 0.9):
            data.qpos[:] = keep
            data.qpos[model.jnt_qposadr[joint]] = low + share * (high - low)
            mujoco.mj_fwdPosition(model, data)
            first = world_points(model, data, collision_geoms(model, mine), 0.01).mean(axis=0)
            second = world_points(model, data, collision_geoms(model, others), 0.01).mean(axis=0)
            gaps.append(float(np.linalg.norm(first - second)))
        rising = (gaps[1] > gaps[0]) == (model.actuator_gear[actuator, 0] > 0.0)
        signs.append(1 if rising else -1)
    data.qpos[:] = keep
    mujoco.mj_fwdPosition(model, data)
    return [sign * signs[0] for sign in signs]


def _in_step(model: mujoco.MjModel, actuator_ids: Sequence[int]) -> list[int] | None:
    """Return for each actuator of fingers that equalities keep in step which way it goes: 1 as the first, or -1; None of others."""
    joints = [int(model.actuator_trnid[a, 0]) for a in actuator_ids]
    signs = {joints[0]: 1}
    for e in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT.value):
        if int(model.eq_obj2id[e]) == joints[0] and IN_STEP in str(model.equality(int(e)).name):
            signs[int(model.eq_obj1id[e])] = 1 if model.eq_data[e, 1] > 0.0 else -1
    return [signs[j] for j in joints] if signs.keys() >= set(joints) else None


def is_in_step(model: mujoco.MjModel) -> bool:
    """Return whether the robot has fingers with a servo each that are kept in step."""
    return any(IN_STEP in str(model.equality(e).name) for e in range(model.neq))


def sweep_gripper(
    model: mujoco.MjModel, data: mujoco.MjData, joint_ids: Sequence[int], actuator_ids: Sequence[int]
) -> Sweep:
    """Drive the gripper from one end of its control range to the other and sample it on the way.

    The arm's joints stay where they are in `data`. Gravity is off.

    Raises:
        ValueError: An actuator has no range.
    """
    actuators, joints_wanted = list(actuator_ids), list(joint_ids)
    still = free_hand(model, joints_wanted)
    ranges = np.array([control_range(model, actuator) for actuator in actuators])
    for row, sign in enumerate(polarities(model, data, joint_ids, actuator_ids)):
        if sign < 0:
            ranges[row] = ranges[row, ::-1]
    addresses = model.jnt_qposadr[joints_wanted]
    for actuator in range(model.nu):
        if actuator not in actuators:
            _hold(model, data, actuator)
    inside = joints_below(model, joints_wanted)
    for joint in inside:
        # Fingers that start outside their limits may start inside one another.
        if model.jnt_limited[joint]:
            address = model.jnt_qposadr[joint]
            data.qpos[address] = np.clip(data.qpos[address], *model.jnt_range[joint])
    apart = _end_apart(model, still, data, joints_wanted, actuators, ranges)
    drive = Drive(still, data, inside, actuators, ranges)
    if apart:
        drive.rest(1.0)
    drive.rest(0.0)
    joints, lengths, qpos = [], [], []
    steps = max(1, int(ROBOT_TOLERANCES.sweep_seconds / model.opt.timestep / _SAMPLES))
    for k in range(_SAMPLES + 1):
        drive.advance(k / _SAMPLES, steps if k else 0)
        if k == _SAMPLES:
            drive.rest(1.0)
        place(model, data, data.qpos)
        joints.append(data.qpos[addresses].copy())
        lengths.append(data.actuator_length[actuators].copy())
        qpos.append(data.qpos.copy())
    # MuJoCo starts over from its reference posture when accelerations explode.
    exploded = data.warning[mujoco.mjtWarning.mjWARN_BADQACC.value].number > 0
    if exploded or not np.isfinite(qpos).all():
        raise ValueError("makes the simulation diverge when it is driven over its range")
    return Sweep(np.array(joints), np.array(lengths), np.array(qpos))


class Drive:
    """Moves a gripper's joints by its servos; the arm is put back after every few steps, however its own servos pull.

    Args:
        model: The robot in which the gripper touches nothing but itself.
        data: Its state.
        joints: Ids of all joints below the palm.
        actuators: Ids of the gripper's.
        ranges: Controls of both ends, shape (actuators, 2).
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, joints: list[int], actuators: list[int], ranges: Array
    ) -> None:
        self._model, self._data = model, data
        self._driven, self._dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._actuators, self._ranges = actuators, ranges
        self._frozen = data.qpos.copy()

    def advance(self, fraction: float, count: int) -> None:
        """Step about `count` times with the controls at a fraction of the way between their ends."""
        data, ranges = self._data, self._ranges
        data.ctrl[self._actuators] = ranges[:, 0] + fraction * (ranges[:, 1] - ranges[:, 0])
        for _ in range(max(1, count // 10)):
            mujoco.mj_step(self._model, data, 10)
            arm = self._frozen.copy()
            arm[self._driven] = data.qpos[self._driven]
            data.qpos[:] = arm
            speed = np.zeros(self._model.nv)
            speed[self._dofs] = data.qvel[self._dofs]
            data.qvel[:] = speed

    def rest(self, fraction: float) -> None:
        """Drive there until nothing moves, or long enough."""
        settle = int(_SETTLE_SECONDS / self._model.opt.timestep)
        for _ in range(_MOST_SETTLES):
            self.advance(fraction, settle)
            if float(np.abs(self._data.qvel[self._dofs]).max(initial=0.0)) < _STILL:
                return


def _end_apart(
    model: mujoco.MjModel,
    still: mujoco.MjModel,
    data: mujoco.MjData,
    joint_ids: list[int],
    actuators: list[int],
    ranges: Array,
) -> bool:
    """Put fingers that start inside one another to the end of their range where they do not; tell whether that is the far one.

    Locked into each other they could not be driven apart. Fingers with joints that follow others stay as they are.
    """
    driven = [int(model.actuator_trnid[a, 0]) for a in actuators if model.actuator_trntype[a] == _JOINT]
    if set(driven) != set(joint_ids) or len(driven) != len(actuators):
        return False

    def depth() -> float:
        mujoco.mj_fwdPosition(still, data)
        return -float(data.contact.dist.min(initial=0.0))

    least, chosen, found = 0.5 * depth(), data.qpos.copy(), 0
    if least < _LOCKED:
        return False
    for end in (0, 1):
        for actuator, joint, controls in zip(actuators, driven, ranges, strict=True):
            scale, offset = servo_map(model, actuator)
            length = (controls[end] - offset) / scale
            data.qpos[model.jnt_qposadr[joint]] = length / model.actuator_gear[actuator, 0]
        if depth() < least:
            least, chosen, found = depth(), data.qpos.copy(), end
    data.qpos[:] = chosen
    return found == 1


def place(model: mujoco.MjModel, data: mujoco.MjData, qpos: Array) -> None:
    """Put a model into a configuration."""
    data.qpos[:] = qpos
    mujoco.mj_fwdPosition(model, data)


def free_hand(model: mujoco.MjModel, joint_ids: list[int]) -> mujoco.MjModel:
    """Return the model without gravity, in which the gripper touches nothing but itself."""
    still = copy.copy(model)
    still.opt.gravity[:] = 0.0
    still.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    palm = int(model.body_weldid[palm_of(model, joint_ids)])
    root = palm_of(model, joint_ids)
    for g in range(model.ngeom):
        body = int(model.geom_bodyid[g])
        if not (_is_below(model, body, root) or int(model.body_weldid[body]) == palm):
            still.geom_contype[g] = still.geom_conaffinity[g] = 0
    return still


def _hold(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> None:
    joint = int(model.actuator_trnid[actuator, 0])
    if model.actuator_trntype[actuator] != _JOINT:
        return
    try:
        scale, offset = servo_map(model, actuator)
    except ValueError:
        return
    length = data.qpos[model.jnt_qposadr[joint]] * model.actuator_gear[actuator, 0]
    data.ctrl[actuator] = scale * length + offset


def joints_below(model: mujoco.MjModel, joint_ids: list[int]) -> list[int]:
    """Return all joints below the gripper joints' common parent."""
    root = palm_of(model, joint_ids)
    inside = {body for body in range(model.nbody) if _is_below(model, body, root)} - {root}
    return [j for j in range(model.njnt) if int(model.jnt_bodyid[j]) in inside]


def _is_below(model: mujoco.MjModel, body: int, root: int) -> bool:
    while body and body != root:
        body = int(model.body_parentid[body])
    return body == root
