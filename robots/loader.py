"""A robot from its model file and sidecar, checked and measured once, ready to stand in any world."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.progress import doing
from robosandbox.robots.fitting import fit_roles
from robosandbox.robots.gripper.calibrate import servo_map
from robosandbox.robots.gripper.collision import ensure_solid_tool, refine_fingers
from robosandbox.robots.gripper.geometry import DerivedGripper
from robosandbox.robots.gripper.hand import settle_listed
from robosandbox.robots.importers.files import is_file
from robosandbox.robots.importers.imported import ImportedModel, compile_spec
from robosandbox.robots.importers.importing import import_model
from robosandbox.robots.importers.isolate import keep_arm
from robosandbox.robots.importers.mount import mount
from robosandbox.robots.infer.placement import TableWorkspace
from robosandbox.robots.limits import joint_limits, motion_limits
from robosandbox.robots.locate import attached_model, find_sidecar, is_bundled, known_sidecar, resolve_robot, say
from robosandbox.robots.measurements import home_by_address, measurements
from robosandbox.robots.outline import outline_of
from robosandbox.robots.robot import Gripper, Robot
from robosandbox.robots.roles import apply_roles, check_actuators, check_home
from robosandbox.robots.sidecar import Sidecar, SuctionRoles
from robosandbox.suggestions import did_you_mean_file
from robosandbox.types import TABLE_HEIGHT, Array, Pose, Scene, frozen_array
from robosandbox.types.outline import Outline
from robosandbox.types.robot import ARM, RobotFiles
from robosandbox.validation import load_yaml_model
from robosandbox.values import frozen

WRIST_CAMERA = "robosandbox_wrist"


@frozen(kw_only=True)
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
        workspace: What it reaches over a table.
        tool_bounds: (x_min, x_max, y_min, y_max) of its last link about the TCP; of use to an arm without a gripper.
        notes: What the import repaired, added or left out, in sentences.
        options: The solver that its file asks for, as a spec that holds nothing else; None for the one that grasping needs.
        files: Its model and sidecar, if it has a sidecar of its own; None for a bundled or an inferred one.
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
    workspace: TableWorkspace
    tool_bounds: tuple[float, float, float, float]
    notes: tuple[str, ...] = ()
    options: mujoco.MjSpec | None = None
    files: RobotFiles | None = None
    # Worked out when the robot is first bound; a robot on another base has another.
    _outline: list[Outline | None] = field(default_factory=list[Outline | None], init=False, compare=False, repr=False)

    @property
    def base_pose(self) -> Pose:
        """Pose of the base in the world."""
        return Pose(xyz=self.sidecar.base_pose.xyz, quat_xyzw=self.sidecar.base_pose.quat_xyzw)

    def bind(self, model: mujoco.MjModel, prefix: str) -> Robot:
        """Return the robot's indices in a world that it was attached to under `prefix`."""
        arm = self.sidecar.arm
        joint_ids = [model.joint(prefix + name).id for name in arm.joints]
        actuator_ids = [model.actuator(prefix + name).id for name in arm.actuators]
        lower, upper = joint_limits(model, joint_ids)
        maps = [_arm_servo_map(model, actuator) for actuator in actuator_ids]
        bodies = frozenset(b for b in range(1, model.nbody) if model.body(b).name.startswith(prefix))
        gripper = self._bind_gripper(model, prefix)
        if not self._outline:
            self._outline.append(outline_of(model, joint_ids, bodies, gripper, prefix))
        return Robot(
            name=self.name,
            joints=arm.joints,
            qpos_indices=model.jnt_qposadr[joint_ids].copy(),
            dof_indices=model.jnt_dofadr[joint_ids].copy(),
            actuator_ids=np.array(actuator_ids),
            control_scale=frozen_array([scale for scale, _ in maps]),
            control_offset=frozen_array([offset for _, offset in maps]),
            lower=frozen_array(lower),
            upper=frozen_array(upper),
            velocity_limits=self.velocity_limits,
            acceleration_limits=self.acceleration_limits,
            home_q=frozen_array(arm.home_qpos),
            tcp_site=model.site(prefix + self.tcp_site).id,
            R_site_tcp=self.R_site_tcp,
            bodies=bodies,
            base_position=frozen_array(model.body_pos[min(bodies)]),
            reach=(self.workspace.near, self.workspace.far),
            tool_bounds=self.tool_bounds,
            gripper=gripper,
            limits=self.sidecar.limits,
            files=self.files,
            outline=self._outline[0],
        )

    def _bind_gripper(self, model: mujoco.MjModel, prefix: str) -> Gripper | None:
        roles = self.sidecar.gripper
        if roles is None or self.gripper is None:
            return None
        names, primary = ((), None) if isinstance(roles, SuctionRoles) else (roles.joints, roles.primary_joint)
        joint_ids = [model.joint(prefix + name).id for name in names]
        actuator_ids = np.array([model.actuator(prefix + name).id for name in roles.actuator_names])
        sides = [frozenset(model.body(prefix + name).id for name in side) for side in self.gripper.fingers]
        return Gripper(
            geometry=self.gripper.geometry,
            qpos_index=None if primary is None else int(model.jnt_qposadr[model.joint(prefix + primary).id]),
            joint_indices=model.jnt_qposadr[joint_ids].copy(),
            actuator_ids=actuator_ids,
            bodies=sides[0] | sides[1],
            finger_bodies=(sides[0], sides[1]),
            coupled_samples=self.gripper.coupled_samples,
            driven=np.flatnonzero(np.isin(joint_ids, [_driven_joint(model, a) for a in actuator_ids])),
            force_limits=_force_limits(model, actuator_ids),
        )


def load_robot(
    robot_urdf: Path | None = None,
    robot_config: Path | None = None,
    package_paths: tuple[Path, ...] = (),
    *,
    table_height: float = TABLE_HEIGHT,
    arm: str | None = None,
    gripper: Path | None = None,
) -> RobotModel:
    """Return a robot, measured; the same files give the same object.

    Args:
        robot_urdf: A .urdf or .xml file, a bundled robot's name or `menagerie:<name>`; None is the bundled Panda.
        robot_config: Its sidecar; None takes `<stem>.robosandbox.yaml` beside the model, a shipped one for a model of
            this name, or what can be inferred from the model.
        package_paths: Where a URDF's package:// names are looked up, before ROS_PACKAGE_PATH.
        table_height: Of the table that it works on, metres; where nobody says, its base is put on it.
        arm: Which arm, where the model has several: it is inferred, whatever sidecar lies beside the model.
        gripper: A gripper's model to mount on an arm that has none; it is inferred likewise.

    Raises:
        InputError: A file is missing or wrong; the message names file, field, value and remedy.
    """
    path = resolve_robot(robot_urdf).resolve()
    inferred = arm is not None or gripper is not None
    if gripper is not None and not is_file(gripper):
        raise InputError(f"robot_gripper: {str(gripper)!r} is no file{did_you_mean_file(gripper)}")
    gripper = gripper.resolve() if gripper else None
    config = None if inferred else find_sidecar(path, robot_config)
    stamps = tuple(file.stat().st_mtime_ns for file in (path, config, gripper) if file)
    with doing(f"loading {path.name}"):
        return _load(path, config, package_paths, table_height, arm, gripper, stamps)


def robots_of(scene: Scene) -> Mapping[str, RobotModel]:
    """Return the robots that a scene names by the name of their arm; see `robot_of`.

    Raises:
        InputError: A file is missing or wrong; the message names file, field, value and remedy.
    """
    if not scene.arms:
        return {ARM: robot_of(scene)}
    return {arm.name: robot_of(scene.for_arm(arm)) for arm in scene.arms}


def robot_of(scene: Scene) -> RobotModel:
    """Return the robot that a scene with one names, on its table, measured; see `load_robot`.

    Raises:
        InputError: A file is missing or wrong; the message names file, field, value and remedy.
    """
    if scene.robot_base is not None:
        return _based(scene, scene.robot_base)
    return load_robot(
        scene.robot_urdf,
        scene.robot_config,
        table_height=scene.table_height,
        arm=scene.robot_arm,
        gripper=scene.robot_gripper,
    )


def _based(scene: Scene, base: tuple[float, float, float, float]) -> RobotModel:
    """Return the robot with its base where a scene's file has room for it.

    Args:
        scene: Names the robot and the table's height.
        base: x, y and z, metres, and the turn about z, radians.
    """
    x, y, z, yaw = base
    named = {"arm": scene.robot_arm, "gripper": scene.robot_gripper}
    robot = load_robot(scene.robot_urdf, scene.robot_config, **named)  # type: ignore[arg-type]
    # A robot is measured over a table at some height under its base: the same where that is the same.
    over = z - scene.table_height
    if abs(robot.base_pose.xyz[2] - TABLE_HEIGHT - over) > 1e-6:
        height = robot.base_pose.xyz[2] - over
        robot = load_robot(scene.robot_urdf, scene.robot_config, table_height=height, **named)  # type: ignore[arg-type]
    turn = (0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
    there = robot.sidecar.base_pose.model_copy(update={"xyz": (x, y, z), "quat_xyzw": turn})
    return replace(robot, sidecar=robot.sidecar.model_copy(update={"base_pose": there}))


@lru_cache(maxsize=32)
def _load(
    path: Path,
    config: Path | None,
    package_paths: tuple[Path, ...],
    table_height: float,
    arm: str | None,
    gripper: Path | None,
    stamps: tuple[int, ...],
) -> RobotModel:
    """Return a robot read, completed, fitted and measured."""
    del stamps  # part of the cache key: an edited file is read again
    if arm is not None or gripper is not None:
        # What works a sidecar out is imported for those robots alone that have none.
        from robosandbox.robots.infer.sidecar import infer

        found = infer(path, gripper=gripper, arm=arm, package_paths=package_paths, table_height=table_height)
        return measure(found.model, found.sidecar, path.name, table_height=table_height, workspace=found.workspace)
    given = load_yaml_model(config, Sidecar) if config else None
    imported = import_model(path, package_paths, as_in_file=given is not None and given.physics == "as_in_file")
    if given is None and (known := known_sidecar(imported)) is not None:
        shipped = _on_table(known[1], table_height)
        try:
            robot = load_with(imported, shipped, known[0], package_paths, table_height=table_height)
        except InputError as error:
            # A model of the same name, and another hand: what was written for its namesake says nothing about it.
            say(f"{path.name}: the shipped {known[0].name} does not fit it ({error})")
            imported = import_model(path, package_paths)
        else:
            say(f"{path.name}: no sidecar beside it; runs on the shipped {known[0].name}")
            return robot
    if given is None or config is None:
        from robosandbox.robots.infer.sidecar import infer_imported

        found = infer_imported(imported, table_height=table_height)
        others = f"; other arms in it: {', '.join(found.choices[1:])}" if found.choices[1:] else ""
        say(f"{path.name}: no sidecar; runs on what was inferred (robo-sandbox robot infer shows it){others}")
        return measure(imported, found.sidecar, path.name, table_height=table_height, workspace=found.workspace)
    robot = load_with(imported, given, config, package_paths, table_height=table_height)
    files = RobotFiles(model=path, sidecar=config, package_paths=package_paths, table_height=table_height)
    return robot if is_bundled(config) else replace(robot, files=files)


def _on_table(sidecar: Sidecar, table_height: float) -> Sidecar:
    """Return a shipped sidecar, whose base stands on the default table, for a table of another height."""
    x, y, z = sidecar.base_pose.xyz
    base = sidecar.base_pose.model_copy(update={"xyz": (x, y, z + table_height - TABLE_HEIGHT)})
    return sidecar.model_copy(update={"base_pose": base})


def load_with(
    imported: ImportedModel,
    given: Sidecar,
    config: Path,
    package_paths: tuple[Path, ...] = (),
    *,
    table_height: float = TABLE_HEIGHT,
) -> RobotModel:
    """Return an imported model measured under a sidecar; the model is changed to fit it.

    Raises:
        InputError: The sidecar does not fit the model; the message names sidecar and field.
    """
    try:
        attached = given.gripper.attach if given.gripper else None
        if attached is not None:
            mount(imported, attached, attached_model(config, attached), package_paths)
        if given.fingers is not None and imported.options is None:
            settle_listed(imported, given.fingers.joints)
        sidecar = apply_roles(given, imported)
        model = compile_spec(imported.spec, imported.path.name)
        keep_arm(imported, model, sidecar.arm.joints)
        if imported.options is None:
            _fit_tool(imported, sidecar)
    except InputError as error:
        raise InputError(f"{config.name}: {error}") from None
    return measure(imported, sidecar, config.name, table_height=table_height)


def _fit_tool(imported: ImportedModel, sidecar: Sidecar) -> None:
    """Make what touches things fit to hold or push them."""
    if sidecar.fingers:
        refine_fingers(imported, sidecar.fingers.joints)
    elif sidecar.suction is None:
        ensure_solid_tool(imported, sidecar.arm.joints[-1])


def measure(
    imported: ImportedModel,
    sidecar: Sidecar,
    source: str,
    *,
    table_height: float = TABLE_HEIGHT,
    workspace: TableWorkspace | None = None,
) -> RobotModel:
    """Return the robot with all that skills need measured on it.

    Args:
        imported: The model, ready.
        sidecar: Its complete roles.
        source: Names them in errors.
        table_height: Of the table that it works on, metres.
        workspace: What it reaches, if that is known already.

    Raises:
        InputError: Home, actuators or gripper cannot be as the sidecar says.
    """
    spec, path = imported.spec, imported.path
    try:
        tcp_site = fit_roles(imported, sidecar)
        model = compile_spec(spec, path.name)
        check_home(sidecar, model)
        check_actuators(sidecar, model)
        found = measurements(model, sidecar, tcp_site, table_height=table_height, workspace=workspace)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    _add_wrist_camera(spec, model, tcp_site, found.R_site_tcp)
    velocity, acceleration = motion_limits(sidecar, spec, model, home_by_address(model, sidecar), imported.velocity)
    return RobotModel(
        name=path.stem,
        path=path,
        sidecar=sidecar,
        spec=spec,
        tcp_site=tcp_site,
        gripper=found.gripper,
        R_site_tcp=frozen_array(found.R_site_tcp),
        velocity_limits=velocity,
        acceleration_limits=acceleration,
        workspace=found.workspace,
        tool_bounds=found.tool_bounds,
        notes=tuple(imported.notes),
        options=imported.options,
    )


def _force_limits(model: mujoco.MjModel, actuators: Array) -> Array:
    """Return the largest force of each actuator, (k,), N or N m: its limit, or of one that sucks what its largest control gives."""
    limited = model.actuator_forcelimited[actuators].astype(bool)
    sucks = model.actuator_trntype[actuators] == mujoco.mjtTrn.mjTRN_BODY.value
    sucked = np.abs(model.actuator_ctrlrange[actuators]).max(axis=1) * np.abs(model.actuator_gainprm[actuators, 0])
    most = np.abs(model.actuator_forcerange[actuators]).max(axis=1)
    return np.where(limited, most, np.where(sucks, sucked, np.inf))


def _driven_joint(model: mujoco.MjModel, actuator: int) -> int:
    """Return the one joint that an actuator drives; -1 for a tendon."""
    direct = model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT.value
    return int(model.actuator_trnid[actuator, 0]) if direct else -1


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
