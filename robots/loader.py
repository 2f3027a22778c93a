"""A robot from its model file and sidecar, checked and measured once, ready to stand in any world."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.robots.derive import DerivedGripper, derive_gripper, servo_map
from robosandbox.robots.robot import Gripper, Robot
from robosandbox.robots.sidecar import Sidecar
from robosandbox.types import Array, Pose, frozen_array
from robosandbox.validation import did_you_mean, load_yaml_model

TCP_SITE = "robosandbox_tcp"
WRIST_CAMERA = "robosandbox_wrist"
DEFAULT_ROBOT = "franka_panda"
_ARM_JOINTS = (mujoco.mjtJoint.mjJNT_HINGE.value, mujoco.mjtJoint.mjJNT_SLIDE.value)
_JOINT_TRANSMISSION = mujoco.mjtTrn.mjTRN_JOINT.value


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotModel:
    """A robot outside any world.

    Attributes:
        name: The model file's stem.
        path: The model file.
        sidecar: Its roles.
        spec: The robot with its TCP site and wrist camera; attach a copy of it.
        tcp_site: The TCP site's name.
        gripper: What was measured of the gripper; None for an arm without one.
        R_site_tcp: Rotation from the site's frame to the TCP frame (z approach, y closing).
        velocity_limits: Per arm joint, shape (n,).
        acceleration_limits: Per arm joint, shape (n,).
    """

    name: str
    path: Path
    sidecar: Sidecar
    spec: mujoco.MjSpec
    tcp_site: str
    gripper: DerivedGripper | None
    R_site_tcp: Array
    velocity_limits: Array
    acceleration_limits: Array

    @property
    def base_pose(self) -> Pose:
        """Where the base stands in the world."""
        return Pose(xyz=self.sidecar.base_pose.xyz, quat_xyzw=self.sidecar.base_pose.quat_xyzw)

    def bind(self, model: mujoco.MjModel, prefix: str) -> Robot:
        """Return the robot's indices in a world that it was attached to under `prefix`."""
        arm = self.sidecar.arm
        joint_ids = [model.joint(prefix + name).id for name in arm.joints]
        actuator_ids = [model.actuator(prefix + name).id for name in arm.actuators]
        limited = model.jnt_limited[joint_ids].astype(bool)
        ranges = model.jnt_range[joint_ids]
        maps = [_arm_servo_map(model, actuator) for actuator in actuator_ids]
        base = next(b for b in range(1, model.nbody) if model.body(b).name.startswith(prefix))
        return Robot(
            name=self.name,
            joints=arm.joints,
            qpos_indices=model.jnt_qposadr[joint_ids].copy(),
            dof_indices=model.jnt_dofadr[joint_ids].copy(),
            actuator_ids=np.array(actuator_ids),
            control_scale=frozen_array([scale for scale, _ in maps]),
            control_offset=frozen_array([offset for _, offset in maps]),
            lower=frozen_array(np.where(limited, ranges[:, 0], -np.inf)),
            upper=frozen_array(np.where(limited, ranges[:, 1], np.inf)),
            velocity_limits=self.velocity_limits,
            acceleration_limits=self.acceleration_limits,
            home_q=frozen_array(arm.home_qpos),
            tcp_site=model.site(prefix + self.tcp_site).id,
            R_site_tcp=self.R_site_tcp,
            bodies=frozenset(b for b in range(1, model.nbody) if model.body(b).name.startswith(prefix)),
            base_position=frozen_array(model.body_pos[base]),
            gripper=self._bind_gripper(model, prefix),
        )

    def _bind_gripper(self, model: mujoco.MjModel, prefix: str) -> Gripper | None:
        roles = self.sidecar.gripper
        if roles is None or self.gripper is None:
            return None
        joint_ids = [model.joint(prefix + name).id for name in roles.joints]
        actuator_ids = np.array([model.actuator(prefix + name).id for name in roles.actuator_names])
        sides = [frozenset(model.body(prefix + name).id for name in side) for side in self.gripper.fingers]
        limited = model.actuator_forcelimited[actuator_ids].astype(bool)
        return Gripper(
            geometry=self.gripper.geometry,
            qpos_index=int(model.jnt_qposadr[model.joint(prefix + roles.primary_joint).id]),
            joint_indices=model.jnt_qposadr[joint_ids].copy(),
            actuator_ids=actuator_ids,
            bodies=sides[0] | sides[1],
            finger_bodies=(sides[0], sides[1]),
            coupled_samples=self.gripper.coupled_samples,
            force_limits=np.where(limited, np.abs(model.actuator_forcerange[actuator_ids]).max(axis=1), np.inf),
        )


def resolve_robot(robot_urdf: Path | None) -> Path:
    """Return the model file that a scene's `robot_urdf` names: a path, or a bundled robot's name.

    Raises:
        InputError: There is no such file or bundled robot.
    """
    robots = Path(str(resources.files("robosandbox.robots")))
    bundled = {path.parent.name: path for path in robots.glob("*/*.xml")}
    if robot_urdf is None:
        return bundled[DEFAULT_ROBOT]
    if str(robot_urdf) in bundled:
        return bundled[str(robot_urdf)]
    if not robot_urdf.is_file():
        hint = did_you_mean(str(robot_urdf), bundled)
        raise InputError(
            f"robot_urdf: {str(robot_urdf)!r} is neither a file nor a bundled robot ({', '.join(sorted(bundled))}){hint}"
        )
    return robot_urdf


def load_robot(robot_urdf: Path | None = None, robot_config: Path | None = None) -> RobotModel:
    """Return the robot that a scene names, measured; the same files give the same object.

    Args:
        robot_urdf: A .urdf or .xml file or a bundled robot's name; None is the bundled Panda.
        robot_config: Its sidecar; None takes `<stem>.robosandbox.yaml` beside the model.

    Raises:
        InputError: A file is missing or wrong; the message names file, field, value and remedy.
    """
    path = resolve_robot(robot_urdf).resolve()
    config = robot_config if robot_config is not None else path.parent / f"{path.stem}.robosandbox.yaml"
    if not config.is_file():
        raise InputError(f"{config}: no such sidecar; write one (see docs) or give robot_config")
    config = config.resolve()
    return _load(path, config, path.stat().st_mtime_ns, config.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _load(path: Path, config: Path, model_stamp: int, config_stamp: int) -> RobotModel:
    del model_stamp, config_stamp  # part of the cache key: an edited file is read again
    sidecar = load_yaml_model(config, Sidecar)
    spec = _read_spec(path)
    _compensate_gravity(spec)
    try:
        _check_names(sidecar, spec, path)
        tcp_site = _place_tcp(spec, sidecar)
        model = _compile(spec, path)
        _check_home(sidecar, model)
        arm_q = {
            int(model.jnt_qposadr[model.joint(name).id]): value
            for name, value in zip(sidecar.arm.joints, sidecar.arm.home_qpos, strict=True)
        }
        site = model.site(tcp_site).id
        _check_actuators(sidecar, model)
        gripper = derive_gripper(model, sidecar.gripper, site, arm_q) if sidecar.gripper else None
    except InputError as error:
        raise InputError(f"{config.name}: {error}") from None
    R_site_tcp = gripper.R_site_tcp if gripper else np.eye(3)
    _add_wrist_camera(spec, model, tcp_site, R_site_tcp)
    velocity, acceleration = _limits(sidecar, spec, model, arm_q)
    return RobotModel(
        name=path.stem,
        path=path,
        sidecar=sidecar,
        spec=spec,
        tcp_site=tcp_site,
        gripper=gripper,
        R_site_tcp=frozen_array(R_site_tcp),
        velocity_limits=velocity,
        acceleration_limits=acceleration,
    )


def _read_spec(path: Path) -> mujoco.MjSpec:
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise InputError(f"{path.name}: {_one_line(error)}") from None


def _compensate_gravity(spec: mujoco.MjSpec) -> None:
    """Let the arm carry its own weight, as the controllers of real arms do; a load it still has to carry by its servos.

    Without that a servo of finite stiffness sags by its share of the arm's weight. A body that the file gives a value
    of its own keeps it.
    """
    for body in spec.bodies:
        if body.name != "world" and body.gravcomp == 0.0:
            body.gravcomp = 1.0


def _compile(spec: mujoco.MjSpec, path: Path) -> mujoco.MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        raise InputError(f"{path.name}: {_one_line(error)}") from None


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _check_names(sidecar: Sidecar, spec: mujoco.MjSpec, path: Path) -> None:
    names: dict[str, Iterable[str]] = {
        "joint": [item.name for item in spec.joints],
        "actuator": [item.name for item in spec.actuators],
        "body": [item.name for item in spec.bodies],
        "site": [item.name for item in spec.sites],
    }
    wanted: list[tuple[str, str, str]] = []
    wanted += [(f"arm.joints[{i}]", "joint", name) for i, name in enumerate(sidecar.arm.joints)]
    wanted += [(f"arm.actuators[{i}]", "actuator", name) for i, name in enumerate(sidecar.arm.actuators)]
    if sidecar.gripper:
        wanted += [(f"gripper.joints[{i}]", "joint", name) for i, name in enumerate(sidecar.gripper.joints)]
        wanted += [("gripper.actuator", "actuator", name) for name in sidecar.gripper.actuator_names]
    if sidecar.ee_site.inject:
        wanted.append(("ee_site.inject.attach_body", "body", sidecar.ee_site.inject.attach_body))
    if sidecar.ee_site.name:
        wanted.append(("ee_site.name", "site", sidecar.ee_site.name))
    for field, kind, name in wanted:
        if name not in names[kind]:
            hint = did_you_mean(name, [n for n in names[kind] if n and n != "world"])
            article = "an" if kind == "actuator" else "a"
            raise InputError(f"{field} {name!r} is not {article} {kind} of {path.name}{hint}")


def _place_tcp(spec: mujoco.MjSpec, sidecar: Sidecar) -> str:
    inject = sidecar.ee_site.inject
    if inject is None:
        return str(sidecar.ee_site.name)
    x, y, z, w = inject.quat_xyzw or (0.0, 0.0, 0.0, 1.0)
    spec.body(inject.attach_body).add_site(name=TCP_SITE, pos=inject.xyz, quat=[w, x, y, z], size=[0.005] * 3, group=4)
    return TCP_SITE


def _check_home(sidecar: Sidecar, model: mujoco.MjModel) -> None:
    for i, (name, value) in enumerate(zip(sidecar.arm.joints, sidecar.arm.home_qpos, strict=True)):
        joint = model.joint(name).id
        if int(model.jnt_type[joint]) not in _ARM_JOINTS:
            raise InputError(f"arm.joints[{i}] {name!r} is a ball or free joint; the arm takes hinges and slides")
        low, high = model.jnt_range[joint]
        if model.jnt_limited[joint] and not low - 1e-6 <= value <= high + 1e-6:
            raise InputError(f"arm.home_qpos[{i}]: {value:g} is outside the limits of {name!r}, {low:.4g}..{high:.4g}")


def _check_actuators(sidecar: Sidecar, model: mujoco.MjModel) -> None:
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


def _arm_servo_map(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    scale, offset = servo_map(model, actuator)
    return scale * float(model.actuator_gear[actuator, 0]), offset


def _add_wrist_camera(spec: mujoco.MjSpec, model: mujoco.MjModel, tcp_site: str, R_site_tcp: Array) -> None:
    """Put a camera behind and beside the TCP, looking at it along the approach."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    site = model.site(tcp_site).id
    body = int(model.site_bodyid[site])
    R_body = data.xmat[body].reshape(3, 3)
    R_tcp = R_body.T @ data.site_xmat[site].reshape(3, 3) @ R_site_tcp
    tcp = R_body.T @ (data.site_xpos[site] - data.xpos[body])
    eye = tcp + R_tcp @ np.array([0.07, 0.0, -0.12])
    forward = tcp - eye
    z_axis = -forward / np.linalg.norm(forward)
    x_axis = R_tcp[:, 1]
    rotation = np.column_stack([x_axis, np.cross(z_axis, x_axis), z_axis])
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, rotation.flatten())
    spec.body(model.body(body).name).add_camera(name=WRIST_CAMERA, pos=eye, quat=quat, fovy=70.0)


def _limits(
    sidecar: Sidecar, spec: mujoco.MjSpec, model: mujoco.MjModel, arm_q: dict[int, float]
) -> tuple[Array, Array]:
    """Return velocity and acceleration limits: the sidecar's, the model's custom numerics, or from torque and inertia."""
    n = len(sidecar.arm.joints)
    custom = {item.name: np.array(item.data, dtype=float) for item in spec.numerics}
    velocity = sidecar.arm.velocity_limits or custom.get("velocity_limits")
    acceleration = sidecar.arm.acceleration_limits or custom.get("acceleration_limits")
    if velocity is not None and acceleration is not None and len(velocity) == n == len(acceleration):
        return frozen_array(velocity), frozen_array(acceleration)

    data = mujoco.MjData(model)
    for address, value in arm_q.items():
        data.qpos[address] = value
    mujoco.mj_fwdPosition(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    dofs = [model.jnt_dofadr[model.joint(name).id] for name in sidecar.arm.joints]
    derived = np.empty(n)
    for i, (dof, name) in enumerate(zip(dofs, sidecar.arm.actuators, strict=True)):
        actuator = model.actuator(name).id
        force = abs(model.actuator_forcerange[actuator]).max() if model.actuator_forcelimited[actuator] else np.inf
        torque = force * abs(model.actuator_gear[actuator, 0])
        derived[i] = np.clip(0.4 * torque / max(inertia[dof, dof], 1e-6), 1.0, 8.0)
    if acceleration is None or len(acceleration) != n:
        acceleration = derived
    if velocity is None or len(velocity) != n:
        # Half a radian to reach full speed: fast enough to work, slow enough for servos nobody has tuned.
        velocity = np.clip(np.sqrt(np.asarray(acceleration)), 0.5, 2.0)
    return frozen_array(velocity), frozen_array(acceleration)
