"""A world with an agent in it, ready for prompts: what the command line, the bench and short scripts use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.agent.episode import Episode
from robosandbox.agent.planners import make_planner
from robosandbox.errors import InputError, UnreachableError
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.perception.factory import Setup, make_perception
from robosandbox.plugins import make_plugin
from robosandbox.protocols import GraspPlanner, MotionPlanner, Skill
from robosandbox.service.server.checkpoint import Checkpoint
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.objects.weight import weighed
from robosandbox.sim.sensors import find_sensor
from robosandbox.skills.catalogue import load_skills
from robosandbox.tasks.evaluate import Verdict, evaluate
from robosandbox.tasks.loader import find_task, load_task
from robosandbox.tasks.randomize import draw_layout
from robosandbox.tasks.success import AtHome
from robosandbox.tasks.task import Task
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, Scene, Truth
from robosandbox.world.relations import centre

DEFAULT_TASK = "pick_from_three"
_REACH_YAWS = (0.0, np.pi / 2.0)
_REACH_ABOVE = (0.0, 0.12)
_DOWN = np.array([0.0, 0.0, -1.0])
_BASE_RADIUS = 0.15
_START_DRAWS = 20


@dataclass(slots=True, kw_only=True)
class Session:
    """A loaded task, and an agent that can act in it.

    Attributes:
        task: What is loaded.
        sim: The world.
        ctx: What skills use in it.
        skills: What the robot can do.
        agent: Carries out prompts.
        seed: The last reset's.
        start: The state after it, which success is judged against.
    """

    task: Task
    sim: MuJoCoBackend
    ctx: AgentContext
    skills: list[Skill]
    agent: Agent[AgentContext]
    seed: int
    start: Truth
    _extents: dict[str, tuple[float, ...]]
    _start_state: Array

    def run(self, prompt: str | None = None, *, timeout: float | None = None) -> Episode:
        """Carry out a prompt, or the task's own.

        Args:
            prompt: A sentence.
            timeout: Simulated seconds after which the running skill is stopped.
        """
        with self.ctx.goal(timeout):
            return self.agent.run(self.task.prompt if prompt is None else prompt)

    def reset(self, seed: int = 0) -> None:
        """Start over with this seed's layout.

        Raises:
            InputError: The seed is negative or has no layout.
        """
        robot = self.sim.robot
        for attempt in range(_START_DRAWS):
            layout = draw_layout(
                self.task,
                seed,
                joints=len(robot.home_q),
                extents=self._extents,
                accept=_ReachCheck(self.sim, self.task.scene),
                attempt=attempt,
            )
            q = np.array(self.task.start_q or robot.home_q) + layout.q_offset
            try:
                self.sim.reset(layout.scene, q=np.clip(q, robot.lower, robot.upper))
                break
            except InputError as error:
                # Seed 0 is the scene as written, so there is nothing to draw again.
                if seed == 0 or attempt == _START_DRAWS - 1:
                    raise InputError(f"{self.task.name}: seed {seed}: {error}") from None
        self._begin(seed)

    def _begin(self, seed: int) -> None:
        self.start, self._start_state = self.sim.truth(), self.sim.snapshot()
        self.seed = seed

    def checkpoint(self) -> Checkpoint:
        """Return the world as it is, for `restore`."""
        return Checkpoint(
            seed=self.seed,
            scene=self.sim.scene,
            start=tuple(self._start_state.tolist()),
            state=tuple(self.sim.snapshot().tolist()),
            physics_steps=self.sim.physics_steps,
        )

    def restore(self, checkpoint: Checkpoint) -> None:
        """Go back to a checkpoint of this task; the arm holds.

        Raises:
            InputError: The checkpoint is of another task.
        """
        self.sim.resume(checkpoint.scene, np.array(checkpoint.start), 0)
        self._begin(checkpoint.seed)
        self.sim.resume(checkpoint.scene, np.array(checkpoint.state), checkpoint.physics_steps)
        self.sim.stop()

    @property
    def robot_name(self) -> str:
        """The robot's model."""
        return self.sim.robot.name

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""
        return self.sim.cameras

    def elapsed(self) -> tuple[float, int]:
        """Return simulated seconds and physics steps since the last reset."""
        return self.sim.time, self.sim.physics_steps

    def picture(self, camera: str, format: str = "png") -> bytes:
        """Return a camera's picture as a PNG or JPEG file's bytes.

        Raises:
            InputError: No such camera.
            RenderingError: No OpenGL on this machine.
        """
        from robosandbox.service.server.studio import encode

        return encode(self.sim.state((camera,)).images[camera], "jpeg" if format == "jpeg" else "png")

    def observe(self) -> ObservedScene:
        """Return what perception sees now."""
        return self.ctx.look()

    def judge(self) -> Verdict:
        """Tell whether the task has succeeded since the last reset; waits as long as it asks success to hold."""
        return evaluate(self.task.success, self.start, self.sim.truth, self.sim.wait)

    def close(self) -> None:
        """Free the world."""
        self.sim.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_session(
    task: Task | Scene | Path | str | None = None,
    *,
    robot: Path | str | None = None,
    planner: str = "stub",
    planner_options: Mapping[str, Any] | None = None,
    camera: str | None = None,
    dialogue: bool = False,
    perception: str = "ground_truth",
    perception_options: Mapping[str, Any] | None = None,
    grasp: str = "analytic",
    grasp_options: Mapping[str, Any] | None = None,
    motion: str = "dls",
    motion_options: Mapping[str, Any] | None = None,
    sensor: str = "ideal",
    seed: int = 0,
    max_replans: int = 3,
    what_if: bool = True,
    render_size: tuple[int, int] = (240, 320),
    wait_hook: Callable[[], None] | None = None,
) -> Session:
    """Load a world and put an agent in it.

    Args:
        task: A task, the name of a bundled one, a YAML file, or a bare scene (whose task is to be at home); a table with
            three cubes when left out.
        robot: A model file or a bundled robot's name, in place of the task's robot.
        planner: Name of an installed planner.
        planner_options: What it takes besides the skills, such as `model`; None counts as not given.
        camera: The camera whose picture the planner is to see.
        dialogue: Whether prompts may refer to those before them, where the planner can do that.
        perception: Name of an installed perception.
        perception_options: What it takes besides; None counts as not given.
        grasp: Name of an installed grasp planner.
        grasp_options: What it takes.
        motion: Name of an installed motion planner.
        motion_options: What it takes, such as `clearance`.
        sensor: What its cameras are like: ideal, realsense or rough.
        seed: The layout; 0 is the task as written.
        max_replans: How often a failure may be answered with a new plan.
        what_if: Whether skills may try repairs on copies of the world.
        render_size: (height, width) of camera pictures, pixels.
        wait_hook: Called again and again while the world is loaded and settles; what it raises ends that.

    Raises:
        InputError: A name, file or value is wrong.
    """
    chosen = resolve_task(task)
    if robot is not None:
        scene = chosen.scene.model_copy(update={"robot_urdf": Path(robot), "robot_config": None})
        chosen = chosen.model_copy(update={"scene": scene})
    # Before masses are varied by seed.
    chosen = chosen.model_copy(update={"scene": weighed(chosen.scene)})
    skills = load_skills()
    sim = MuJoCoBackend(render_size=render_size, sensor=find_sensor(sensor))
    if wait_hook is not None:
        sim.wait_hooks.append(wait_hook)
    options = dict(planner_options or {})
    if camera is not None:
        options["picture"] = lambda: sim.state([camera]).images[camera]
    mind = make_planner(planner, skills, options, dialogue=dialogue)
    grasps: GraspPlanner = make_plugin("grasp_planners", grasp, options=grasp_options)
    paths: MotionPlanner = make_plugin("motion_planners", motion, options=motion_options)
    try:
        sim.feel(chosen.felt)
        _load(sim, chosen.scene)
        _check_start_q(chosen, sim)
        if camera is not None and camera not in sim.cameras:
            raise InputError(f"camera {camera!r} is not one of {', '.join(sim.cameras)}")
    except InputError as error:
        sim.close()
        # With a robot of the caller's own the task is not to blame.
        raise error if robot is not None else InputError(f"{chosen.name}: {error}") from None
    try:
        eyes = make_perception(perception, Setup.of(chosen.scene), perception_options)
    except InputError:
        sim.close()
        raise
    ctx = AgentContext(
        sim=eyes.view(sim),
        perception=eyes,
        grasp=grasps,
        motion=paths,
        what_if=what_if,
        limits=chosen.limits,
    )
    agent = Agent(ctx=ctx, skills=skills, planner=mind, max_replans=max_replans)
    agent.permits.append(ctx.permit)
    start = sim.truth()
    extents = {
        item.id: tuple(half / item.scale for half in start.objects[item.id].size)
        for item in chosen.scene.objects
        if item.mesh is not None
    }
    session = Session(
        task=chosen,
        sim=sim,
        ctx=ctx,
        skills=skills,
        agent=agent,
        seed=0,
        start=start,
        _extents=extents,
        _start_state=sim.snapshot(),
    )
    if seed != 0 or chosen.start_q is not None:
        try:
            session.reset(seed)
        except InputError:
            session.close()
            raise
    return session


def resolve_task(task: Task | Scene | Path | str | None) -> Task:
    """Return the task that a value names.

    Raises:
        InputError: There is none of that name, or its file is wrong.
    """
    match task:
        case None:
            return find_task(DEFAULT_TASK)
        case Task():
            return task
        case Scene():
            return Task(name="scene", prompt="go home", scene=task, success=AtHome(kind="at_home"))
        case Path():
            return load_task(task)
        case _:
            return load_task(task) if task.endswith((".yaml", ".yml")) else find_task(task)


def _load(sim: MuJoCoBackend, scene: Scene) -> None:
    """Load a scene; where that fails on a robot with a sidecar of its own, say what is wrong with the sidecar."""
    try:
        sim.load(scene)
    except InputError as error:
        # The checks infer a robot from its model, which most worlds never need.
        from robosandbox.robots.check.diagnosis import advice, own_files

        files = own_files(scene.robot_urdf, scene.robot_config)
        raise InputError(f"{error}{advice(files, str(error)) if files else ''}") from None


def _check_start_q(task: Task, sim: MuJoCoBackend) -> None:
    if task.start_q is None:
        return
    robot = sim.robot
    if len(task.start_q) != len(robot.joints):
        raise InputError(f"start_q: has {len(task.start_q)} values; {robot.name} has {len(robot.joints)} arm joints")
    for name, value, low, high in zip(robot.joints, task.start_q, robot.lower, robot.upper, strict=True):
        if not low <= value <= high:
            raise InputError(f"start_q: {value:g} is outside the limits of {name!r}, {low:.4g}..{high:.4g}")


class _ReachCheck:
    """Says whether the gripper can be over an object and at it, pointing down.

    An arm that cannot do so even where the task puts the object works in another way; its draws are not checked.
    """

    def __init__(self, sim: MuJoCoBackend, scene: Scene) -> None:
        self._sim = sim
        # The same seed gives the same layout whichever motion planner works in it.
        self._motion = DLSMotionPlanner()
        self._exempt: dict[str, bool] = {}
        self._scene = scene
        self._ready = False

    def __call__(self, obj: DetectedObject) -> bool:
        if not self._ready:
            # Reach is a matter of the arm alone.
            nothing = ObservedScene(time=0.0, objects=(), table_height=self._scene.table_height, base_xy=(0.0, 0.0))
            self._motion.use(PlanningScene(self._sim.world, nothing), self._sim.state())
            self._ready = True
        if obj.id not in self._exempt:
            written = next(item for item in self._scene.objects if item.id == obj.id)
            self._exempt[obj.id] = not self._reaches(replace(obj, pose=written.pose))
        return self._exempt[obj.id] or self._reaches(obj)

    def _reaches(self, obj: DetectedObject) -> bool:
        self._sim.ask_wait_hooks()
        middle = centre(obj)
        base = self._sim.robot.base_position
        if float(np.hypot(*(middle - base)[:2])) < _BASE_RADIUS:
            return False
        return any(self._reaches_with(middle, yaw) for yaw in _REACH_YAWS)

    def _reaches_with(self, middle: Array, yaw: float) -> bool:
        closing = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        rotation = np.column_stack([np.cross(closing, _DOWN), closing, _DOWN])
        seed: Array | None = None
        for above in _REACH_ABOVE:
            try:
                seed = self._motion.ik(Pose.from_matrix(middle + [0.0, 0.0, above], rotation), seed)
            except UnreachableError:
                return False
        return True
