"""A simulated driver made from beliefs: robot and objects as they are believed to be, to try things out in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import mujoco
import numpy as np

from robosandbox.robots.gripper.calibrate import is_in_step
from robosandbox.robots.robot import Gripper, Robot
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.objects.standing import stand as stand_object
from robosandbox.sim.opening import simulate
from robosandbox.sim.saved_state import take_state
from robosandbox.sim.world import World
from robosandbox.types import ArmState, Array, DetectedObject, GripperState, ObjectTruth, ObservedScene, Pose

# Seconds that a twin is given before anything is tried: ten time constants of MuJoCo's default contact (0.02 s), in which
# things that are believed to overlap by a little have been pushed apart.
_SETTLE_SECONDS = 0.2


def make_twin(world: World, seen: ObservedScene, arms: Mapping[str, ArmState]) -> MuJoCoBackend:
    """Return a simulation of what is believed: objects at rest where they are seen, what the hand holds in the hand.

    Args:
        world: The compiled model of what is believed.
        seen: Where the objects are; one that the model does not have, as beads without a container, is left out.
        arms: How each arm stands, by name.
    """
    data = mujoco.MjData(world.model)
    data.time = max(state.time for state in arms.values())
    data.qpos[:] = standing(world, seen.objects, arms)
    for name, state in arms.items():
        _command(world.model, world.robots[name], data, state)
    twin = simulate(world, take_state(world.model, data))
    twin.wait(_SETTLE_SECONDS)
    return twin


def standing(world: World, objects: Iterable[DetectedObject | ObjectTruth], arms: Mapping[str, ArmState]) -> Array:
    """Return a model's positions, shape (nq,), with robots and objects where they are said to be.

    Args:
        world: The compiled model.
        objects: Those that the model does not have are left out.
        arms: How each arm stands, by name.
    """
    model = world.model
    qpos: Array = model.qpos0.copy()
    stand(world.robots, arms, qpos)
    for item in objects:
        if item.id not in world.parts:
            continue
        bodies = world.parts[item.id]
        joints = model.body_jntadr[bodies]
        if item.id in world.fixed:
            if item.opening is not None:
                qpos[int(model.jnt_qposadr[joints[0]])] = item.opening
            continue
        places = [Pose(xyz=grain) for grain in item.grains] if item.grains else [item.pose]
        for body, pose in zip(bodies, places, strict=False):
            stand_object(model, qpos, int(body), pose)
        if item.opening is not None and len(joints) > 1:
            qpos[model.jnt_qposadr[joints[1]]] = np.clip(item.opening, *model.jnt_range[joints[1]])
    return qpos


def stand(robots: Mapping[str, Robot], arms: Mapping[str, ArmState], qpos: Array) -> None:
    """Put arms and their grippers where they stand into a model's positions, shape (nq,)."""
    for name, state in arms.items():
        robot = robots[name]
        qpos[robot.qpos_indices] = state.q
        if robot.gripper is not None and state.gripper is not None:
            qpos[robot.gripper.joint_indices] = robot.gripper.joints_at(state.gripper.joint)


def closing_stiffness(model: mujoco.MjModel, gripper: Gripper, closed: float) -> float:
    """Return how much more force the gripper's servos give per closed fraction commanded beyond `closed`.

    In the actuator's unit (N or N m); 0 where an actuator is no servo, the gripper cannot close further, or fingers are kept in
    step: what each of their servos gives depends on the others.
    """
    if closed >= 1.0 or is_in_step(model):
        return 0.0
    ids = gripper.actuator_ids
    if (model.actuator_biastype[ids] != mujoco.mjtBias.mjBIAS_AFFINE.value).any():
        return 0.0
    travel = np.abs(gripper.geometry.control(1.0) - gripper.geometry.control(closed)) / (1.0 - closed)
    return float((np.abs(model.actuator_gainprm[ids, 0]) * travel).sum())


def _command(model: mujoco.MjModel, robot: Robot, data: mujoco.MjData, state: ArmState) -> None:
    """Have the servos stay where the encoders say that the robot stands, and grip as they do."""
    data.ctrl[robot.actuator_ids] = robot.control(np.clip(state.q, robot.lower, robot.upper))
    if robot.gripper is not None and state.gripper is not None:
        closed = _commanded(model, robot.gripper, state.gripper)
        data.ctrl[robot.gripper.actuator_ids] = robot.gripper.geometry.control(closed)


def _commanded(model: mujoco.MjModel, gripper: Gripper, state: GripperState) -> float:
    """Return what the gripper was last sent to, 0 open to 1 closed: as it tells, or as its force tells."""
    closed = float(np.clip(state.closed, 0.0, 1.0))
    stiffness = closing_stiffness(model, gripper, closed)
    if state.commanded is not None:
        closed = state.commanded
    elif state.force is not None and stiffness > 0.0:
        closed += state.force / stiffness
    return float(np.clip(closed, 0.0, 1.0))
