"""Planning scene: the robot and the objects as they are believed to be, compiled into one planning model."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cached_property
from types import MappingProxyType

import mujoco
import numpy as np

from robosandbox.driver import Driver
from robosandbox.errors import InputError
from robosandbox.motion.beliefs import DeclaredProperties, believed_scene
from robosandbox.motion.collision import CollisionChecker
from robosandbox.motion.robot_shapes import RobotShapes
from robosandbox.motion.twin import make_twin, stand
from robosandbox.robots.kinematics import POSITION_TOLERANCE, Kinematics
from robosandbox.robots.loader import robots_of
from robosandbox.robots.robot import Robot
from robosandbox.sim.populated import populated
from robosandbox.sim.world import World, build_world
from robosandbox.types import ArmState, Array, DetectedObject, ObservedScene, Scene

# Two sightings of an object whose sizes differ by less than this share a compiled model, metres: the accuracy that
# benchmarks/perception.py measures for the sizes of objects in depth pictures.
_SAME_SIZE = 0.0015
# Cosine of an angle within which two directions are alike: half a degree.
_ALIKE = math.cos(math.radians(0.5))
_MESH = mujoco.mjtGeom.mjGEOM_MESH.value
_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


class PlanningScene:
    """A robot, the objects that are believed to be around it, and the other arms of its cell.

    Skills, grasp planners and motion planners ask it for hulls, names, kinematics and collision checks. Nobody else has
    the compiled model, and nobody changes it.

    Args:
        world: The compiled model of robots, table and objects.
        seen: Where the objects are believed to be.
        believed: Compiles what is believed; None where `world` is that already.
        arm: The arm that is planned for; needless where there is one.
        others: How the other arms stand, by name: obstacles.

    Attributes:
        seen: Where the objects are believed to be.
    """

    def __init__(
        self,
        world: World,
        seen: ObservedScene,
        *,
        believed: Callable[[ObservedScene], World] | None = None,
        arm: str | None = None,
        others: Mapping[str, ArmState] = MappingProxyType({}),
    ) -> None:
        self._world = world
        self._believed = believed
        self._arm = arm
        self._others = others
        self.seen: ObservedScene = seen

    def for_arm(self, arm: str, others: Mapping[str, ArmState]) -> PlanningScene:
        """Return the same scene to plan in for one arm of several.

        Args:
            arm: Its name.
            others: How the other arms stand, by name.

        Raises:
            InputError: The scene has other arms than the driver.
        """
        if self._world.robots.keys() != {arm, *others}:
            raise InputError(
                f"scene.arms: the driver moves {', '.join(sorted({arm, *others}))}, and the scene says "
                f"{', '.join(self._world.robots)}; name the same arms in both"
            )
        return PlanningScene(self._world, self.seen, believed=self._believed, arm=arm, others=others)

    def twin(self, state: ArmState) -> Driver:
        """Return a simulated world that is what is believed and nothing else, to try things out in.

        Args:
            state: How the robot stands now.
        """
        world = self._world if self._believed is None else self._believed(self.seen)
        (arm,) = world.robots if self._arm is None else (self._arm,)
        return make_twin(world, self.seen, {arm: state, **self._others})

    @property
    def robot(self) -> Robot:
        """The robot that is planned for, as the planning model has it."""
        return self._world.robot if self._arm is None else self._world.robots[self._arm]

    def shares_model(self, other: PlanningScene) -> bool:
        """Tell whether what was computed of the other scene's model is true of this one's, object poses apart."""
        same = self._world.model is other._world.model and self._world.revision == other._world.revision
        return same and self._arm == other._arm

    # Queries of motion planners.

    def kinematics(self, *, position_tolerance: float = POSITION_TOLERANCE) -> Kinematics:
        """Return new kinematics of the robot, that put the TCP within so many metres of a position."""
        return Kinematics.of(self._world.model, self.robot, position_tolerance=position_tolerance)

    def collisions(self, clearance: float, *, hand_only: bool = False) -> CollisionChecker:
        """Return a new checker of collisions that keeps `clearance` metres from obstacles, of the arm or of its hand alone."""
        world, movers = self._world, self._hand_bodies if hand_only else None
        return CollisionChecker(
            world.model, self.robot, world.names, clearance=clearance, movers=movers, hand=self._hand_bodies
        )

    def arrange(self, checker: CollisionChecker) -> None:
        """Put what `collisions` checks against where it is believed to be: objects, and the other arms."""
        for item in self.seen.objects:
            body = self.body(item.id)
            if body is not None:
                checker.place(body, item.pose)
                if item.opening is not None:
                    checker.slide(body, item.opening)
        stand(self._world.robots, self._others, checker.data.qpos)

    def body(self, object_id: str) -> int | None:
        """Return an object's body in the collision checker; None for one that is not avoided, as beads."""
        return self._world.object_bodies.get(object_id)

    # Queries of skills.

    def loose_mass(self, object_id: str) -> float | None:
        """Return what an object is believed to weigh, kg; None for one that is fixed, and for grains."""
        model, body = self._world.model, self.body(object_id)
        if body is None or int(model.body_weldid[body]) == 0:
            return None
        return float(model.body_subtreemass[body])

    def pieces(self, object_id: str) -> tuple[Array, ...]:
        """Return points that span each convex piece, in the object's frame, each (k, 3); none where kind and size say it all."""
        item = self.seen.find(object_id)
        if item is not None and item.geometry is not None:
            return item.geometry.corners
        body = self.body(object_id)
        return () if body is None else _mesh_pieces(self._world.model, body)

    def is_of_gripper(self, name: str) -> bool:
        """Tell whether a part of this name belongs to the gripper."""
        return name in self._gripper_names

    def is_of_hand(self, name: str) -> bool:
        """Tell whether a part of this name is where it is by the TCP's pose alone: fingers, palm, and what they are fixed to."""
        return name in {self._world.names[body] for body in self._hand_bodies}

    def hand_bounds(self) -> tuple[float, float, float, float]:
        """Return x_min, x_max, y_min, y_max of the hand in the TCP frame, whatever is behind its fingers included, metres."""
        model = self._world.model
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        position, rotation = self.robot.tcp(data)
        solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        geoms = np.flatnonzero(np.isin(model.geom_bodyid, list(self._hand_bodies)) & solid)
        boxes = model.geom_aabb[geoms]
        corners = boxes[:, None, :3] + _CORNERS * boxes[:, None, 3:]
        turned = np.einsum("gij,gcj->gci", data.geom_xmat[geoms].reshape(-1, 3, 3), corners)
        local = (turned + data.geom_xpos[geoms][:, None] - position).reshape(-1, 3) @ rotation
        (x_min, y_min), (x_max, y_max) = local[:, :2].min(axis=0, initial=0.0), local[:, :2].max(axis=0, initial=0.0)
        return float(x_min), float(x_max), float(y_min), float(y_max)

    def can_face(self, rotation: Array) -> bool:
        """Tell whether the hand can be turned so at all (3, 3): on slides alone it cannot, on parallel hinges about these alone."""
        home, axes = self._turning
        rest = rotation @ home.T
        if not len(axes):
            return bool(np.trace(rest) > 1.0 + 2.0 * _ALIKE)
        parallel = bool((np.abs(axes @ axes[0]) > _ALIKE).all())
        return not parallel or bool(axes[0] @ rest @ axes[0] > _ALIKE)

    @cached_property
    def _turning(self) -> tuple[Array, Array]:
        """Rotation of the TCP at home (3, 3), and the axes there of the arm's hinges (k, 3)."""
        model, robot = self._world.model, self.robot
        data = mujoco.MjData(model)
        data.qpos[robot.qpos_indices] = robot.home_q
        mujoco.mj_kinematics(model, data)
        joints = [int(model.dof_jntid[dof]) for dof in robot.dof_indices]
        hinges = [j for j in joints if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE.value]
        return robot.tcp(data)[1], data.xaxis[hinges].copy()

    def finger_side(self, name: str) -> int:
        """Return on which side of the gap a part of the gripper is: -1 or 1 along the closing direction, 0 for palm and cup."""
        gripper = self.robot.gripper
        if gripper is not None and gripper.geometry.cup is None:
            for sign, bodies in zip((-1, 1), gripper.finger_bodies, strict=True):
                if name in {self._world.names[body] for body in bodies}:
                    return sign
        return 0

    @cached_property
    def _hand_bodies(self) -> frozenset[int]:
        model, gripper = self._world.model, self.robot.gripper
        rigid = model.body_weldid == model.body_weldid[model.site_bodyid[self.robot.tcp_site]]
        palm = frozenset(int(body) for body in rigid.nonzero()[0] if body in self.robot.bodies)
        return palm | frozenset(gripper.bodies if gripper else ())

    @cached_property
    def _gripper_names(self) -> frozenset[str]:
        gripper = self.robot.gripper
        return frozenset(self._world.names[body] for body in gripper.bodies) if gripper else frozenset()


class PlanningScenes:
    """Makes planning scenes from beliefs; a model is compiled only where other objects or sizes are believed.

    Args:
        scene: Names the robots and the table; its objects are not read.
        known: What is known of objects that no camera shows, by id.
    """

    def __init__(self, scene: Scene, known: Mapping[str, DeclaredProperties] | None = None) -> None:
        scene = populated(scene)
        self._frame = scene.model_copy(update={"objects": ()})
        self._known = dict(known or {})
        self._robot_models = robots_of(scene)
        self._believed: dict[str, DetectedObject] = {}
        self._world: World = build_world(self._frame, self._robot_models)

    @classmethod
    def exact(cls, scene: Scene) -> PlanningScenes:
        """Return those of a scene whose objects are known exactly, but for where they are and how large."""
        scene = populated(scene)
        return cls(scene, {item.id: DeclaredProperties.of(item, exactly=True) for item in scene.objects})

    def robot_shapes(self) -> RobotShapes:
        """Return the drawn shapes of all robots, to be placed by their joints."""
        return RobotShapes(self._world.model, self._world.robots)

    def of(self, seen: ObservedScene) -> PlanningScene:
        """Return the robot among these objects."""
        return PlanningScene(self.world_of(seen), seen)

    def world_of(self, seen: ObservedScene) -> World:
        """Return the compiled model of the robot among these objects, wherever they are."""
        believed = {item.id: item for item in seen.objects}
        known = self._believed
        if believed.keys() != known.keys() or not all(_alike(known[name], believed[name]) for name in believed):
            scene = believed_scene(self._frame, believed.values(), self._known)
            self._world = build_world(scene, self._robot_models)
            self._believed = believed
        return self._world


def _alike(a: DetectedObject, b: DetectedObject) -> bool:
    return (
        a.kind == b.kind
        and (a.geometry is b.geometry or a.geometry == b.geometry)
        and len(a.grains) == len(b.grains)
        and all(abs(x - y) < _SAME_SIZE for x, y in zip(a.size, b.size, strict=True))
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
