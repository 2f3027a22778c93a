"""The world around a robot: floor, table, light, cameras, objects, and the contact settings that hold a grasp."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.driver import ARM
from robosandbox.errors import InputError
from robosandbox.robots.importers.imported import copy_options, copy_physics
from robosandbox.robots.loader import WRIST_CAMERA, RobotModel, robots_of
from robosandbox.robots.robot import Gripper, Robot
from robosandbox.robots.sidecar import Sidecar
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.integration import use_stable_integrator
from robosandbox.sim.keyframes import put_keyframes
from robosandbox.sim.objects import PREFIX, add_objects, body_names
from robosandbox.sim.room import FLOOR, PHYSICS_TIMESTEP, TABLE, add_camera, add_room, set_options
from robosandbox.sim.scene_file import SceneFile, read_scene_file
from robosandbox.types import Array, Scene, SceneObject, frozen_array
from robosandbox.types.robot import hand_of

ROBOT_PREFIX = "robot/"
# Depth of a contact at the start from which on a scene is refused, metres; chosen above the 0.2 mm that what rests in
# the bundled tasks was measured to sink into its support.
_PENETRATION = 0.001


@dataclass(frozen=True)
class World:
    """A compiled scene.

    Attributes:
        scene: What it was built from.
        model: The MuJoCo model.
        robots: Its robots by the name of their arm.
        sidecars: Roles in each, likewise.
        names: For every body what people call it: "table", "floor", an object's id, "<id>/box" for a drawer's sliding
            part, or a link's name.
        object_bodies: Body id of every object that has one body to itself or to its cabinet; beads have none.
        parts: Ids of all bodies of every object, shape (k,).
        owners: Body id -> id of the object that it belongs to.
        arm_of_geom: Number of the arm that each geom belongs to, in the order of `robots`; -1 of others, shape (geoms,).
        mass_share: What every body has of its object's mass as compiled, shape (bodies,).
        inertia_per_mass: Every body's principal inertia over its mass as compiled, m^2, shape (bodies, 3).
        cameras: Camera names as people use them -> names in the model.
        revision: How often numbers in the model were rewritten since it was compiled.
        fixed: Ids of the objects that a scene's file fixes in their place, parts included.
    """

    scene: Scene
    model: mujoco.MjModel
    robots: Mapping[str, Robot]
    sidecars: Mapping[str, Sidecar]
    names: tuple[str, ...]
    object_bodies: dict[str, int]
    parts: dict[str, NDArray[np.intp]]
    owners: dict[int, str]
    arm_of_geom: NDArray[np.int8]
    mass_share: Array
    inertia_per_mass: Array
    cameras: dict[str, str]
    revision: int = 0
    fixed: frozenset[str] = frozenset()

    @property
    def robot(self) -> Robot:
        """The robot of a world with one, as drivers and planners of one robot ask for it.

        Raises:
            InputError: There are several.
        """
        if len(self.robots) != 1:
            raise InputError(f"scene.arms: there are {', '.join(self.robots)}, and this works with one robot alone")
        return next(iter(self.robots.values()))

    @cached_property
    def grippers(self) -> Mapping[str, Gripper]:
        """The grippers by the name of their hand."""
        return {hand_of(name): robot.gripper for name, robot in self.robots.items() if robot.gripper is not None}

    @cached_property
    def robot_bodies(self) -> frozenset[int]:
        """Ids of the bodies of all robots."""
        return frozenset().union(*(robot.bodies for robot in self.robots.values()))

    @cached_property
    def robot_geoms(self) -> NDArray[np.bool_]:
        """Whether each geom is a robot's, shape (geoms,)."""
        return self.arm_of_geom >= 0

    def actuators_of(self, arm: str) -> tuple[str, ...]:
        """Return the names of an arm's actuators in the model's order; of the only robot all that there are."""
        names = [str(self.model.actuator(index).name) for index in range(self.model.nu)]
        return tuple(name for name in names if arm == ARM or name.startswith(_prefix(arm)))

    def arm_of_body(self, body: int) -> str | None:
        """Return the name of the arm that a body belongs to; None of others."""
        return next((name for name, robot in self.robots.items() if body in robot.bodies), None)

    def geoms_of(self, arm: str | None) -> NDArray[np.bool_]:
        """Return whether each geom is an arm's, or any arm's where none is named, shape (geoms,)."""
        return self.robot_geoms if arm is None else self.arm_of_geom == [*self.robots].index(arm)


def build_world(
    scene: Scene, robots: RobotModel | Mapping[str, RobotModel], *, board: CalibrationBoard | None = None
) -> World:
    """Compile a scene.

    Args:
        scene: What is in it.
        robots: Its robot; of several each by the name of its arm.
        board: Laid on the table, to calibrate cameras with.

    Raises:
        InputError: An object cannot be made, or the scene does not compile.
    """
    models = {ARM: robots} if isinstance(robots, RobotModel) else robots
    file = None if scene.world is None else read_scene_file(scene.world)
    spec = _own_room(scene, models.values()) if file is None else _room_of(file, scene)
    if board is not None:
        board.lay(spec, scene.table_height)
    for name, robot_model in models.items():
        base = robot_model.base_pose
        x, y, z, w = base.quat_xyzw
        frame = spec.worldbody.add_frame(pos=base.xyz, quat=[w, x, y, z])
        robot = robot_model.spec.copy()
        copy_options(robot, spec)
        spec.attach(robot, prefix=_prefix(name), frame=frame)
    add_objects(spec, scene)
    model = _compiled(spec, models.values())
    if file is not None and file.keyframes:
        homes = {
            _prefix(name) + joint: value
            for name, robot_model in models.items()
            for joint, value in zip(robot_model.sidecar.arm.joints, robot_model.sidecar.arm.home_qpos, strict=True)
        }
        put_keyframes(spec, file.keyframes, model, homes)
        model = _compiled(spec, models.values())
    bound = {name: robot_model.bind(model, _prefix(name)) for name, robot_model in models.items()}
    use_stable_integrator(model, bound.values())
    cameras = {
        **_cameras(model, tuple(map(_prefix, models))),
        **{"wrist" if name == ARM else f"{name}_wrist": _prefix(name) + WRIST_CAMERA for name in models},
    }
    return world_around(model, scene, bound, {name: one.sidecar for name, one in models.items()}, cameras)


def world_around(
    model: mujoco.MjModel,
    scene: Scene,
    robots: Mapping[str, Robot],
    sidecars: Mapping[str, Sidecar],
    cameras: dict[str, str],
) -> World:
    """Return a compiled model as the world of a scene.

    Args:
        model: With the bodies of the scene's objects, by the names that they have in its file or that `build_world` gives them.
        scene: What is in it.
        robots: Its robots by the name of their arm, bound to the model.
        sidecars: Roles in each, likewise.
        cameras: Camera names as people use them -> names in the model.
    """
    file = None if scene.world is None else read_scene_file(scene.world)
    parts = {item.id: _bodies_of(model, item, file) for item in scene.objects}
    mass_share = np.zeros(model.nbody)
    for item in scene.objects:
        if item.body is None:
            _check_mass(model, parts[item.id], item)
        mass_share[parts[item.id]] = model.body_mass[parts[item.id]] / item.mass
    whole = [item for item in scene.objects if item.geometry is None or item.geometry.compartment is None]
    arm_of_geom = np.full(model.ngeom, -1, dtype=np.int8)
    for number, arm in enumerate(robots.values()):
        # The robot never sleeps: guards read it at every tick.
        trees = model.body_treeid[sorted(arm.bodies)]
        model.tree_sleep_policy[trees[trees >= 0]] = mujoco.mjtSleepPolicy.mjSLEEP_NEVER.value
        arm_of_geom[np.isin(model.geom_bodyid, list(arm.bodies))] = number
    return World(
        scene=scene,
        model=model,
        robots=robots,
        sidecars=sidecars,
        names=_names(model, file),
        object_bodies={item.id: int(parts[item.id][0]) for item in whole if not item.shape.is_granular},
        parts=parts,
        owners={int(body): item.id for item in whole for body in parts[item.id]},
        arm_of_geom=arm_of_geom,
        mass_share=frozen_array(mass_share),
        inertia_per_mass=frozen_array(model.body_inertia / np.maximum(model.body_mass, 1e-12)[:, None]),
        cameras=cameras,
        fixed=frozenset(item.id for item in scene.objects if item.is_fixed),
    )


def _prefix(arm: str) -> str:
    """Return what the names of an arm's elements begin with in a world's model."""
    return ROBOT_PREFIX if arm == ARM else f"{arm}/"


def _own_room(scene: Scene, robots: Iterable[RobotModel]) -> mujoco.MjSpec:
    """Return a room with a floor, a table, lights and cameras, under settings of our own."""
    spec = mujoco.MjSpec()
    spec.modelname = "robosandbox"
    set_options(spec)
    for robot_model in robots:
        if robot_model.options is not None:
            copy_physics(spec, robot_model.options)
            spec.option.timestep = PHYSICS_TIMESTEP
    add_room(spec, table_height=scene.table_height)
    return spec


def _room_of(file: SceneFile, scene: Scene) -> mujoco.MjSpec:
    """Return somebody's scene as it is, less what is left out, and with cameras that see its table."""
    spec = file.spec(keep=[item.id for item in scene.objects if item.body is not None])
    # Pictures need room; none of this is physics.
    spec.visual.global_.offwidth = max(int(spec.visual.global_.offwidth), 1280)
    spec.visual.global_.offheight = max(int(spec.visual.global_.offheight), 960)
    (x0, x1), (y0, y1) = file.table.area
    x, y, height = (x0 + x1) / 2.0, (y0 + y1) / 2.0, file.table.height
    there = {camera.name for camera in spec.cameras}
    if "scene" not in there:
        add_camera(spec, "scene", file.eye, (x, y, height + 0.10), 50.0)
    if "top" not in there:
        add_camera(spec, "top", (x, y, height + 1.36), (x, y, height), 50.0)
    return spec


def _compiled(spec: mujoco.MjSpec, robots: Iterable[RobotModel]) -> mujoco.MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        files = ", ".join(robot_model.path.name for robot_model in robots)
        raise InputError(f"{files}: the scene does not compile: {' '.join(str(error).split())}") from None


def _cameras(model: mujoco.MjModel, robots: tuple[str, ...]) -> dict[str, str]:
    """Return the cameras that are none of the robots', whose names begin so, those of the house first."""
    names = [str(model.camera(k).name) for k in range(model.ncam)]
    found = [name for name in names if name and not name.startswith(robots)]
    return {name: name for name in sorted(found, key=lambda name: name not in ("scene", "top"))}


def _names(model: mujoco.MjModel, file: SceneFile | None) -> tuple[str, ...]:
    """Return what people call each body."""
    raw = [str(model.body(b).name) for b in range(model.nbody)]
    if file is None:
        return tuple(_spoken_name(name) for name in raw)
    whole = [item.id for item in file.objects if item.geometry is None or item.geometry.compartment is None]
    said = {name: item for item in whole for name in file.bodies[item]}
    if file.floor is not None:
        said.setdefault(file.floor, FLOOR)
    said[file.table.body] = TABLE
    return tuple(said.get(name) or _spoken_name(name) for name in raw)


def build_world_of(scene: Scene, *, board: CalibrationBoard | None = None) -> World:
    """Compile a scene with the robots that it names; see `build_world`.

    Raises:
        InputError: A file, name or number of a robot or the scene is wrong.
    """
    return build_world(scene, robots_of(scene), board=board)


def _bodies_of(model: mujoco.MjModel, item: SceneObject, file: SceneFile | None) -> NDArray[np.intp]:
    """Return the ids of an object's bodies."""
    names = body_names(item) if file is None or item.body is None else file.bodies_of(item.body)
    return np.array([model.body(name).id for name in names], dtype=np.intp)


def _check_mass(model: mujoco.MjModel, bodies: NDArray[np.intp], item: SceneObject) -> None:
    """Refuse a robot whose compiler settings reached the objects: their dynamics would be wrong."""
    compiled = float(model.body_mass[bodies].sum())
    if abs(compiled - item.mass) > 1e-6 * max(1.0, item.mass):
        raise InputError(
            f"objects[{item.id}]: compiled to {compiled:.4g} kg in place of {item.mass:.4g}; "
            "the robot file's <compiler> settings reach the scene"
        )


def _spoken_name(body: str) -> str:
    for prefix in (PREFIX, ROBOT_PREFIX):
        if body.startswith(prefix):
            name, _, part = body[len(prefix) :].partition("/")
            # Beads are many and go by one name; ids have no slash, names of links may.
            return name if prefix == PREFIX and part.isdigit() else body[len(prefix) :]
    return body


def check_start(world: World, data: mujoco.MjData) -> None:
    """Refuse a scene whose objects or robot start inside one another, the table or the floor.

    Raises:
        InputError: The first such pair and how deep.
    """
    try:
        mujoco.mj_fwdPosition(world.model, data)
    except mujoco.FatalError:
        # More contacts than MuJoCo reserves memory for.
        raise InputError(
            "objects: start inside one another in more places than can be computed; move them apart"
        ) from None
    bodies = world.model.geom_bodyid
    by_body = world.owners
    for contact in data.contact[: data.ncon]:
        first, second = (int(bodies[g]) for g in contact.geom)
        if contact.dist > -_PENETRATION:
            continue
        depth = f"{-contact.dist * 1000:.1f} mm inside"
        if {first, second} & by_body.keys():
            inside, other = (first, second) if first in by_body else (second, first)
            raise InputError(f"objects[{by_body[inside]}].pose: starts {depth} {world.names[other]!r}; move it apart")
        if world.arm_of_body(first) != world.arm_of_body(second):
            inside, other = (first, second) if first in world.robot_bodies else (second, first)
            raise InputError(
                f"the robot's {world.names[inside]!r} starts {depth} {world.names[other]!r}; "
                "raise base_pose.xyz or bend home_qpos"
            )
