"""Faults for a running world: what happens to robot and objects between two control ticks, and what perception gets wrong.

Each fault is a generator: it does its part of the work, yields once a control tick, and ends when it is over. Copies of
the world share what a fault has done so far, the changed model included, and see nothing of what it will still do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from robosandbox.driver import Driver, simulated
from robosandbox.motion.planning_scene import PlanningScene, PlanningScenes
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.sim.intervention import Intervention
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, Scene
from robosandbox.world.relations import bottom, centre, top

Fault = Callable[[Intervention], Iterator[None]]

# Number above any priority of a geom here; as of MuJoCo's contacts the higher one alone gives the friction.
_GREASE_PRIORITY = 10
# N s/m or N m s/rad; chosen so that the strongest bundled arm's 100 N move it 0.1 mm a second.
_BOLT_DAMPING = 1e6
# N s/m or N m s/rad; chosen so that no gripper's servo moves its fingers.
_JAM_DAMPING = 1e7


def nudge(name: str, offset: Array, speed: float = 0.2) -> Fault:
    """Slide an object by `offset` (2,), metres, at a speed, as by somebody's hand."""

    def run(world: Intervention) -> Iterator[None]:
        start = world.pose(name).position[:2]
        length = float(np.linalg.norm(offset))
        velocity = np.array([*(offset / length * speed), 0.0])
        for _ in range(round(2.0 * length / speed / world.sim.control_timestep)):
            if float((world.pose(name).position[:2] - start) @ offset) >= length**2:
                break
            world.set_velocity(name, velocity)
            yield
        world.set_velocity(name, np.zeros(3), np.zeros(3))

    return run


def roll(name: str, velocity: Array) -> Fault:
    """Let a round object roll off at `velocity` (2,), m/s; it slows down by itself."""

    def run(world: Intervention) -> Iterator[None]:
        truth = world.sim.truth().objects[name]
        spin = np.cross([0.0, 0.0, 1.0], [*velocity, 0.0]) / truth.size[0]
        world.set_velocity(name, np.array([*velocity, 0.0]), truth.pose.rotation.T @ spin)
        yield

    return run


def slip(name: str, friction: float, seconds: float = 2.0) -> Fault:
    """Grease an object until it has left the fingers, or for so many seconds."""

    def run(world: Intervention) -> Iterator[None]:
        model, geoms = world.sim.model, world.geoms(name)
        before = model.geom_friction[geoms].copy(), model.geom_priority[geoms].copy()
        model.geom_friction[geoms, 0] = friction
        model.geom_priority[geoms] = _GREASE_PRIORITY
        for _ in range(round(seconds / world.sim.control_timestep)):
            yield
            if "robot" not in world.sim.truth().objects[name].contacts:
                break
        model.geom_friction[geoms], model.geom_priority[geoms] = before

    return run


def put(name: str, pose: Pose) -> Fault:
    """Put an object somewhere at once."""

    def run(world: Intervention) -> Iterator[None]:
        world.set_pose(name, pose)
        yield

    return run


def put_on(name: str, target: str, offset: tuple[float, float] = (0.0, 0.0)) -> Fault:
    """Put an object on top of another, `offset` metres from its middle."""

    def run(world: Intervention) -> Iterator[None]:
        truth = world.sim.truth()
        item, below = truth.objects[name].detected(), truth.objects[target].detected()
        x, y = centre(below)[:2] + offset
        z = item.pose.xyz[2] - bottom(item) + top(below) + 0.001
        world.set_pose(name, Pose(xyz=(float(x), float(y), float(z)), quat_xyzw=below.pose.quat_xyzw))
        yield

    return run


def knock(name: str, velocity: Array) -> Fault:
    """Hit an object: it gets `velocity` (3,), m/s, at once."""

    def run(world: Intervention) -> Iterator[None]:
        world.set_velocity(name, velocity)
        yield

    return run


def weaken(joint: int, gain: float, limit: float) -> Fault:
    """Leave an arm servo this share of its stiffness, damping and force limit, for good."""

    def run(world: Intervention) -> Iterator[None]:
        model, actuator = world.sim.model, int(world.sim.robot.actuator_ids[joint])
        model.actuator_gainprm[actuator, 0] *= gain
        model.actuator_biasprm[actuator, 1:3] *= gain
        model.actuator_forcerange[actuator] *= limit
        yield

    return run


def jam(aperture: float, seconds: float | None) -> Fault:
    """Let the gripper's fingers stick `aperture` metres apart, for so many seconds or for good."""

    def run(world: Intervention) -> Iterator[None]:
        model, gripper = world.sim.model, world.sim.robot.gripper
        assert gripper is not None
        dofs = [
            int(model.jnt_dofadr[j]) for j in range(model.njnt) if int(model.jnt_qposadr[j]) in gripper.joint_indices
        ]
        with world.state() as data:
            data.qpos[gripper.joint_indices] = gripper.joints_at(gripper.geometry.joint_for_aperture(aperture))
        before = model.dof_damping[dofs].copy()
        model.dof_damping[dofs] = _JAM_DAMPING
        yield
        if seconds is not None:
            for _ in range(round(seconds / world.sim.control_timestep)):
                yield
            model.dof_damping[dofs] = before

    return run


def half_open(aperture: float) -> Fault:
    """Let the gripper open no further than `aperture` metres, for good; what is open further is closed to it."""

    def run(world: Intervention) -> Iterator[None]:
        model, gripper = world.sim.model, world.sim.robot.gripper
        assert gripper is not None
        geometry = gripper.geometry
        limit = gripper.joints_at(geometry.joint_for_aperture(aperture))
        rest = gripper.joints_at(geometry.open_joint)
        for address, stop, opened in zip(gripper.joint_indices, limit, rest, strict=True):
            joint = int(np.flatnonzero(model.jnt_qposadr == address)[0])
            model.jnt_limited[joint] = 1
            model.jnt_range[joint, 1 if opened > stop else 0] = stop
        yield

    return run


def bolt(name: str) -> Fault:
    """Fix an object where it is, for good."""

    def run(world: Intervention) -> Iterator[None]:
        world.sim.model.dof_damping[world.dofs(name)] = _BOLT_DAMPING
        yield

    return run


def lock(name: str) -> Fault:
    """Fix a drawer's sliding box where it is, for good."""

    def run(world: Intervention) -> Iterator[None]:
        model = world.sim.model
        box = list(world.sim.body_names).index(f"{name}/box")
        model.dof_damping[int(model.body_dofadr[box])] = _BOLT_DAMPING
        yield

    return run


@dataclass(slots=True)
class MistakenPerception:
    """Ground truth but for one object, seen elsewhere or in another size.

    Attributes:
        object: Its id.
        offset: Where it is seen from where it is, metres, shape (3,).
        scale: How many times as large it is seen; its lowest point stays.
        begin: From which simulated second on.
        end: Until which.
    """

    object: str
    offset: Array = field(default_factory=lambda: np.zeros(3))
    scale: float = 1.0
    begin: float = 0.0
    end: float = np.inf
    _exact: GroundTruthPerception = field(default_factory=GroundTruthPerception)
    _told: Scene | None = None
    _scenes: PlanningScenes | None = None

    def view(self, sim: Driver) -> Driver:
        """Return the sim as it is."""
        return sim

    def planning(self, sim: Driver, seen: ObservedScene) -> PlanningScene:
        """Return the robot among what was seen, in a model of it: the object has its mistaken size there, too."""
        told = simulated(sim, "what is mistaken is so of a simulated world").scene
        if self._scenes is None or told != self._told:
            self._told, self._scenes = told, PlanningScenes.exact(told)
        return self._scenes.of(seen)

    def perceive(self, sim: Driver) -> ObservedScene:
        """Return all objects, that one mistaken."""
        scene = self._exact.perceive(sim)
        if not self.begin <= scene.time < self.end:
            return scene
        return replace(scene, objects=tuple(self._seen(item) for item in scene.objects))

    def _seen(self, item: DetectedObject) -> DetectedObject:
        if item.id != self.object:
            return item
        larger = replace(item, size=tuple(length * self.scale for length in item.size))
        shift = self.offset + [0.0, 0.0, bottom(item) - bottom(larger)]
        return replace(larger, pose=Pose.from_matrix(item.pose.position + shift, item.pose.rotation))


@dataclass(slots=True)
class ContactMeter:
    """A listener to ticks that keeps the largest force with which the arm touched what it was not to touch.

    Attributes:
        intended: Ids that the arm may touch now.
        worst: Per kind of thing ("table", "itself", "objects"): newtons and the two bodies.
    """

    sim: MuJoCoBackend
    intended: set[str] = field(default_factory=set)
    worst: dict[str, tuple[float, str, str]] = field(default_factory=dict)

    def __call__(self) -> None:
        """Look at the contacts of this tick."""
        robot, names = self.sim.robot, self.sim.body_names
        held = self.sim.in_hands()["hand"]
        for force, first, second in self.sim.contact_forces():
            if first not in robot.bodies and second not in robot.bodies:
                continue
            inner, outer = (first, second) if first in robot.bodies else (second, first)
            if outer in robot.bodies:
                kind = "itself"
            elif names[outer] in ("table", "floor"):
                kind = "table"
            # A drawer's sliding box is "<id>/box".
            elif names[outer].partition("/")[0] in self.intended or names[outer] == held:
                continue
            else:
                kind = "objects"
            if force > self.worst.get(kind, (0.0,))[0]:
                self.worst[kind] = (force, names[inner], names[outer])
