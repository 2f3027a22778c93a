"""A world with an agent in it, ready for prompts: what the command line, the bench and short scripts use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np

from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.agent.episode import Episode
from robosandbox.agent.planners import make_planner
from robosandbox.drivers import driver_factory, fitted, simulated
from robosandbox.errors import InputError
from robosandbox.perception.factory import Setup, make_perception
from robosandbox.plugins import make_plugin
from robosandbox.protocols import Driver, GraspPlanner, MotionPlanner, Simulated, Skill
from robosandbox.service.server.checkpoint import Checkpoint
from robosandbox.sim.objects.weight import weighed
from robosandbox.skills.catalogue import load_skills
from robosandbox.tasks.checks import AtHome
from robosandbox.tasks.evaluate import Verdict, evaluate, true_state
from robosandbox.tasks.layouts import Layouts
from robosandbox.tasks.loader import find_task, load_task
from robosandbox.tasks.task import Task
from robosandbox.tasks.workcell import nobody_judges
from robosandbox.types import Array, ObservedScene, Scene, Truth

DEFAULT_TASK = "pick_from_three"
# How far from a task's start configuration a driver may begin, rad or m: what an encoder's noise stays far below.
_BEGUN = 0.05


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
    """

    task: Task
    sim: Driver
    ctx: AgentContext
    skills: list[Skill]
    agent: Agent[AgentContext]
    seed: int
    _layouts: Layouts
    _start: Truth | None = None
    _start_state: Array | None = None

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
            UnsupportedError: The driver does not start over.
        """
        sim = simulated(self.sim, "a layout is laid out by it; open the session with the seed")
        self._layouts.lay_out(seed, lambda scene, q: sim.reset(scene, q=q))
        self._begin(seed)

    def _begin(self, seed: int) -> None:
        look = true_state(self.sim)
        self._start = None if look is None else look()
        self._start_state = self.sim.snapshot() if isinstance(self.sim, Simulated) else None
        self.seed = seed

    def checkpoint(self) -> Checkpoint:
        """Return the world as it is, for `restore`.

        Raises:
            UnsupportedError: The driver's world cannot be taken down.
        """
        sim = simulated(self.sim, "a checkpoint is taken of it")
        assert self._start_state is not None
        return Checkpoint(
            seed=self.seed,
            scene=sim.scene,
            start=tuple(self._start_state.tolist()),
            state=tuple(sim.snapshot().tolist()),
            physics_steps=sim.physics_steps,
        )

    def restore(self, checkpoint: Checkpoint) -> None:
        """Go back to a checkpoint of this task; the arm holds.

        Raises:
            InputError: The checkpoint is of another task.
            UnsupportedError: The driver's world cannot be put back.
        """
        sim = simulated(self.sim, "a checkpoint is put back into it")
        sim.resume(checkpoint.scene, np.array(checkpoint.start), 0)
        self._begin(checkpoint.seed)
        sim.resume(checkpoint.scene, np.array(checkpoint.state), checkpoint.physics_steps)
        sim.stop()

    @property
    def start(self) -> Truth:
        """The state after the last reset, which success is judged against.

        Raises:
            UnsupportedError: Nobody can judge.
        """
        if self._start is None:
            raise nobody_judges()
        return self._start

    @property
    def robot_name(self) -> str:
        """The robot's model."""
        return self.sim.robot.name

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""
        return self.sim.capabilities.cameras

    def elapsed(self) -> tuple[float, int | None]:
        """Return the driver's seconds since the last reset, and physics steps, where it simulates."""
        return self.sim.time, self.sim.physics_steps if isinstance(self.sim, Simulated) else None

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
        """Tell whether the task has succeeded since the last reset; waits as long as it asks success to hold.

        Raises:
            UnsupportedError: The driver knows no truth and has no referee.
        """
        look = true_state(self.sim)
        if look is None:
            raise nobody_judges()
        return evaluate(self.task.success, self.start, look, self.sim.wait)

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
    driver: str = "mujoco",
    driver_options: Mapping[str, Any] | None = None,
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
        driver: Name of an installed driver, with options behind it: "hardware:latency=0.02". One that does not start over
            is opened on the seed's layout.
        driver_options: More of what it takes; None counts as not given.
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
    chosen = chosen.model_copy(update={"scene": weighed(fitted(driver, chosen.scene))})
    skills = load_skills()
    sim: Driver
    options = dict(planner_options or {})
    if camera is not None:
        options["picture"] = lambda: sim.state([camera]).images[camera]
    mind = make_planner(planner, skills, options, dialogue=dialogue)
    grasps: GraspPlanner = make_plugin("grasp_planners", grasp, options=grasp_options)
    paths: MotionPlanner = make_plugin("motion_planners", motion, options=motion_options)
    eyes = make_perception(perception, Setup.of(chosen.scene), perception_options)

    connect = partial(
        driver_factory(driver, {**(driver_options or {}), "sensor": None if sensor == "ideal" else sensor}),
        render_size=render_size,
        felt=chosen.felt,
        wait_hook=wait_hook,
    )
    layouts = Layouts(chosen, wait_hook)
    # With a robot of the caller's own the task is not to blame.
    sim = _opened(connect, chosen, layouts, seed, blamed=chosen.name if robot is None else "")
    try:
        if camera is not None and camera not in sim.capabilities.cameras:
            cameras = ", ".join(sim.capabilities.cameras)
            raise InputError(f"{chosen.name}: camera {camera!r} is not one of {cameras}")
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
        session = Session(task=chosen, sim=sim, ctx=ctx, skills=skills, agent=agent, seed=seed, _layouts=layouts)
        session._begin(seed)
        if sim.capabilities.reset and (seed != 0 or chosen.start_q is not None):
            session.reset(seed)
    except BaseException:
        sim.close()
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


def _opened(connect: Callable[..., Driver], task: Task, layouts: Layouts, seed: int, *, blamed: str) -> Driver:
    """Return the driver, opened on the task's scene: as written where it can start over, on the seed's layout where not."""
    try:
        sim = connect(task.scene)
    except InputError as error:
        # A failure on a robot with a sidecar of its own is often the sidecar's. The checks infer a robot from its model,
        # which most worlds never need.
        from robosandbox.robots.check.diagnosis import advice, own_files

        files = own_files(task.scene.robot_urdf, task.scene.robot_config)
        text = f"{error}{advice(files, str(error)) if files else ''}"
        raise InputError(f"{blamed}: {text}" if blamed else text) from None
    if sim.capabilities.reset or (seed == 0 and layouts.begin_as_written):
        return sim
    sim.close()
    return layouts.lay_out(seed, lambda scene, q: _begun_at(connect(scene, start_q=q), q, task))


def _begun_at(sim: Driver, q: Array, task: Task) -> Driver:
    """Return a driver that stands where the task wants the arm to begin."""
    off = float(np.abs(sim.state().q - q).max())
    if task.start_q is not None and off > _BEGUN:
        sim.close()
        raise InputError(f"start_q: the driver begins {off:.3f} rad or m from there; use one that takes start_q")
    return sim
