"""What there is to plan among: the robot and the objects as they are believed to be, compiled into one planning model."""

from __future__ import annotations

from functools import cached_property

import mujoco
import numpy as np

from robosandbox.motion.collision import CollisionChecker
from robosandbox.motion.dls import DlsSolver
from robosandbox.motion.robot_shapes import RobotShapes
from robosandbox.robots.loader import load_robot
from robosandbox.robots.robot import Robot
from robosandbox.sim.world import World, build_world
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, Scene, SceneObject

# Two sightings of an object whose sizes differ by less than this share a compiled model, metres: the accuracy that
# benchmarks/perception.py measures for the sizes of objects in depth pictures.
_SAME_SIZE = 0.0015
# The smallest half size that a body is compiled with, metres; what is badly seen may look like less.
_LEAST_SIZE = 0.001
# Mass of a believed object, kg; a planning model is never stepped, so that any positive mass will do.
_BELIEVED_MASS = 0.05
_MESH = mujoco.mjtGeom.mjGEOM_MESH.value


class PlanningScene:
    """A robot and the objects that are believed to be around it.

    Skills, grasp planners and motion planners ask it for hulls, names, kinematics and collision checks. Nobody else has
    the compiled model, and nobody changes it.

    Args:
        world: The compiled model of robot, table and objects.
        seen: Where the objects are believed to be.

    Attributes:
        seen: Where the objects are believed to be.
    """

    def __init__(self, world: World, seen: ObservedScene) -> None:
        self._world = world
        self.seen: ObservedScene = seen

    @property
    def robot(self) -> Robot:
        """The robot as the planning model has it."""
        return self._world.robot

    def shares_model(self, other: PlanningScene) -> bool:
        """Tell whether what was computed of the other scene's model is true of this one's, object poses apart."""
        return self._world.model is other._world.model and self._world.revision == other._world.revision

    # What motion planners are made of.

    def kinematics(self) -> DlsSolver:
        """Return a new solver of the robot's inverse kinematics."""
        return DlsSolver(self._world.model, self._world.robot)

    def collisions(self, clearance: float) -> CollisionChecker:
        """Return a new checker of collisions that keeps `clearance` metres from obstacles."""
        return CollisionChecker(self._world.model, self._world.robot, self._world.names, clearance=clearance)

    def body(self, object_id: str) -> int | None:
        """Return an object's body in the collision checker; None for one that is not avoided, as beads."""
        return self._world.object_bodies.get(object_id)

    def robot_shapes(self) -> RobotShapes:
        """Return the robot's drawn shapes, to be placed by its joints."""
        return RobotShapes(self._world.model, self._world.robot)

    # What skills ask.

    def pieces(self, object_id: str) -> tuple[Array, ...]:
        """Return points that span each convex piece of a mesh, in the object's frame, each (k, 3); none without a mesh."""
        body = self.body(object_id)
        return () if body is None else _mesh_pieces(self._world.model, body)

    def is_of_gripper(self, name: str) -> bool:
        """Tell whether a part of this name belongs to the gripper."""
        return name in self._gripper_names

    def finger_side(self, name: str) -> int:
        """Return on which side of the gap a part of the gripper is: -1 or 1 along the closing direction, 0 for the palm."""
        gripper = self.robot.gripper
        if gripper is not None:
            for sign, bodies in zip((-1, 1), gripper.finger_bodies, strict=True):
                if name in {self._world.names[body] for body in bodies}:
                    return sign
        return 0

    def closing_stiffness(self, closed: float) -> float:
        """Return how much more force the gripper's servos give per closed fraction commanded beyond `closed`.

        In the actuator's unit (N or N m); 0 where an actuator is no servo, or the gripper cannot close further.
        """
        gripper, model = self.robot.gripper, self._world.model
        if gripper is None or closed >= 1.0:
            return 0.0
        ids = gripper.actuator_ids
        if (model.actuator_biastype[ids] != mujoco.mjtBias.mjBIAS_AFFINE.value).any():
            return 0.0
        travel = np.abs(gripper.geometry.control(1.0) - gripper.geometry.control(closed)) / (1.0 - closed)
        return float((np.abs(model.actuator_gainprm[ids, 0]) * travel).sum())

    @cached_property
    def _gripper_names(self) -> frozenset[str]:
        gripper = self.robot.gripper
        return frozenset(self._world.names[body] for body in gripper.bodies) if gripper else frozenset()


class PlanningScenes:
    """Makes planning scenes from beliefs; a model is compiled only where other objects or sizes are believed.

    Args:
        scene: Names the robot and the table; its objects are not read.
    """

    def __init__(self, scene: Scene) -> None:
        self._frame = scene.model_copy(update={"objects": ()})
        self._robot_model = load_robot(scene.robot_urdf, scene.robot_config, table_height=scene.table_height)
        self._believed: dict[str, DetectedObject] = {}
        self._world: World = build_world(self._frame, self._robot_model)

    def robot_shapes(self) -> RobotShapes:
        """Return the robot's drawn shapes, to be placed by its joints."""
        return RobotShapes(self._world.model, self._world.robot)

    def of(self, seen: ObservedScene) -> PlanningScene:
        """Return the robot among these objects."""
        believed = {item.id: item for item in seen.objects}
        known = self._believed
        if believed.keys() != known.keys() or not all(_alike(known[name], believed[name]) for name in believed):
            objects = tuple(_as_object(item) for item in believed.values())
            self._world = build_world(self._frame.model_copy(update={"objects": objects}), self._robot_model)
            self._believed = believed
        return PlanningScene(self._world, seen)


def _alike(a: DetectedObject, b: DetectedObject) -> bool:
    return a.kind == b.kind and all(abs(x - y) < _SAME_SIZE for x, y in zip(a.size, b.size, strict=True))


def _as_object(item: DetectedObject) -> SceneObject:
    # Where a mesh was only seen, no file of it is known.
    kind = item.kind if item.shape.size_fields else "box"
    size = tuple(max(measure, _LEAST_SIZE) for measure in item.size)
    pose = Pose(xyz=item.pose.xyz, quat_xyzw=item.pose.quat_xyzw)
    return SceneObject(
        id=item.id, kind=kind, size=size, pose=pose, mass=_BELIEVED_MASS, open=min(item.opening or 0.0, size[-1])
    )


def _mesh_pieces(model: mujoco.MjModel, body: int) -> tuple[Array, ...]:
    """Return the vertices of a body's colliding meshes, each in the body's frame, shape (k, 3)."""
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    found: list[Array] = []
    for geom in range(first, first + count):
        solid = model.geom_contype[geom] or model.geom_conaffinity[geom]
        if model.geom_type[geom] != _MESH or not solid:
            continue
        mesh = int(model.geom_dataid[geom])
        start, number = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        vertices = model.mesh_vert[start : start + number].astype(float)
        found.append(vertices @ rotation.reshape(3, 3).T + model.geom_pos[geom])
    return tuple(found)
