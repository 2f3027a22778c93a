"""Opening of a workcell in this process, for the command line, the bench and short scripts."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import ParamSpec

import numpy as np

from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.agent.gate import Gate
from robosandbox.agent.planners import make_planner
from robosandbox.driver import SafeDriver, driver_factory, fitted
from robosandbox.driver.stop_switch import StopSwitch
from robosandbox.errors import InputError
from robosandbox.grasp.protocols import GraspPlanner
from robosandbox.motion.protocols import MotionPlanner
from robosandbox.perception.factory import Setup, make_perception
from robosandbox.plugins import make_plugin
from robosandbox.progress import doing
from robosandbox.robots.locate import say
from robosandbox.sim.objects.weight import weighed
from robosandbox.sim.populated import left_out, populated
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.manual import MANUAL
from robosandbox.suggestions import did_you_mean, did_you_mean_file
from robosandbox.tasks.layouts import Layouts, Start
from robosandbox.tasks.loader import resolve_task, with_robot
from robosandbox.tasks.task import Task
from robosandbox.types import Scene, find_tempo
from robosandbox.workcell.embedded import EmbeddedWorkcell, OpenedTask, lay_out
from robosandbox.workcell.option_types import check_types
from robosandbox.workcell.options import WorkcellOptions
from robosandbox.world.operators import Operator

# How far from a task's start configuration a driver may begin, rad or m; chosen so that an encoder's noise stays far below.
_BEGUN = 0.05

P = ParamSpec("P")


def open_workcell(options: WorkcellOptions) -> EmbeddedWorkcell:
    """Load a world in this process and put an agent in it.

    Args:
        options: Which world, and who plans in it; others that are loaded later are opened likewise.

    Raises:
        InputError: A name, file or value is wrong.
    """

    def open_other(
        task: Task | Scene | Path | str, robot: Path | str | None, wait_hook: Callable[[], None] | None
    ) -> OpenedTask:
        # What was said of the robot is so of no other.
        other = replace(options, task=task, scene=None, robot_base=None, robot=robot, seed=0)
        if robot is None or robot != options.robot:
            other = replace(other, sidecar=None, arm=None, gripper=None)
        return _open_task(other, wait_hook)

    return EmbeddedWorkcell(_open_task(options, None), open_task=open_other, undoes=options.dialogue)


@doing("opening the world")
def _open_task(options: WorkcellOptions, wait_hook: Callable[[], None] | None) -> OpenedTask:
    """Load a world in this process and put an agent in it; `wait_hook` is called again and again on the way."""
    check_types(options)
    task = _task_of(options)
    skills: list[Operator] = [*load_skills()]
    driver: SafeDriver
    planner_options = dict(options.planner_options or {})
    if options.camera is not None:
        camera = options.camera
        planner_options["picture"] = lambda: driver.state([camera]).images[camera]
    mind = make_planner(options.planner, skills, planner_options, dialogue=options.dialogue, moves=MANUAL)
    grasps: GraspPlanner = make_plugin("grasp_planners", GraspPlanner, options.grasp, options=options.grasp_options)
    paths: MotionPlanner = make_plugin("motion_planners", MotionPlanner, options.motion, options=options.motion_options)
    eyes = make_perception(options.perception, Setup.of(task.scene), options.perception_options)
    sensor = None if options.sensor == "ideal" else options.sensor
    connect = partial(
        driver_factory(options.driver, {**(options.driver_options or {}), "sensor": sensor}),
        render_size=options.render_size,
        felt=task.felt,
        wait_hook=wait_hook,
    )
    layouts = Layouts(task, wait_hook)
    # With a robot of the caller's own the task is not to blame.
    driver = _opened(connect, task, layouts, options.seed, blamed=task.name if options.robot is None else "")
    try:
        if options.stop_switch is not None:
            driver.safety.switches.append(StopSwitch(Path(options.stop_switch)))
        if options.camera is not None and options.camera not in driver.capabilities.cameras:
            cameras = ", ".join(driver.capabilities.cameras)
            raise InputError(f"{task.name}: camera {options.camera!r} is not one of {cameras}")
        ctx = AgentContext(
            sim=eyes.view(driver),
            arm_name=_working_arm(driver, options, task),
            safety=driver.safety,
            perception=eyes,
            grasp=grasps,
            motion=paths,
            what_if=options.what_if,
            limits=task.limits,
            tempo=find_tempo(options.tempo),
        )
        agent = Agent(ctx=ctx, skills=skills, planner=mind, max_replans=options.max_replans)
        if driver.capabilities.clock == "wall" if options.confirm is None else options.confirm:
            agent.approve = Gate(agent)
        if driver.capabilities.reset and (options.seed != 0 or task.start_q is not None):
            lay_out(driver, layouts, options.seed)
    except BaseException:
        driver.close()
        raise
    return OpenedTask(task=task, driver=driver, agent=agent, layouts=layouts, seed=options.seed)


def _front_door(options: Callable[P, WorkcellOptions]) -> Callable[P, EmbeddedWorkcell]:
    """Return a function that takes what the options take and opens the workcell."""

    def open_session(*args: P.args, **kwargs: P.kwargs) -> EmbeddedWorkcell:
        """Load a world in this process and put an agent in it; the arguments are the fields of `WorkcellOptions`.

        Raises:
            InputError: A name, file or value is wrong.
        """
        unknown = next((name for name in kwargs if name not in signature.parameters), None)
        if unknown is not None:
            raise TypeError(f"open_session takes no {unknown!r}{did_you_mean(unknown, signature.parameters)}")
        return open_workcell(options(*args, **kwargs))

    signature = inspect.signature(options).replace(return_annotation=EmbeddedWorkcell)
    open_session.__signature__ = signature  # type: ignore[attr-defined]
    return open_session


open_session = _front_door(WorkcellOptions)


def _task_of(options: WorkcellOptions) -> Task:
    """Return the task with the robot that was asked for and the masses of its meshes."""
    task = resolve_task(options.task if options.scene is None else with_world(options.task, options.scene))
    if options.robot_base is not None:
        if task.scene.world is None:
            raise InputError(
                "--robot-base: is for scenes from files; give --scene, or base_pose in the robot's sidecar"
            )
        if task.scene.arms:
            raise InputError("--robot-base: each arm of the task has its own; change scene.arms in its file")
        task = task.model_copy(update={"scene": task.scene.model_copy(update={"robot_base": options.robot_base})})
    scene = task.scene if options.robot is None else with_robot(task.scene, options.robot)
    files = {"sidecar": options.sidecar, "gripper": options.gripper}
    for name, file in files.items():
        if file is not None and not Path(file).is_file():
            raise InputError(f"--{name}: {file}: no such file{did_you_mean_file(Path(file))}")
    said = {"arm": None if scene.arms else options.arm, "gripper": options.gripper}
    inferred = next((name for name, value in said.items() if value is not None), None)
    if options.sidecar is not None and inferred is not None:
        raise InputError(f"--{inferred}: the sidecar says that; leave out --sidecar or --{inferred}")
    if options.sidecar is not None or inferred is not None:
        config, gripper = (Path(file).resolve() if file is not None else None for file in files.values())
        named = {"robot_config": config, "robot_arm": said["arm"], "robot_gripper": gripper}
        scene = scene.model_copy(update=named)
    # Before masses are varied by seed.
    scene = weighed(populated(fitted(options.driver, scene)))
    if scene.world is None:
        return task.model_copy(update={"scene": scene})
    for line in left_out(scene):
        say(line)
    # What success names can be checked now that it is known what is there.
    return Task.model_validate({**dict(task), "scene": scene})


def _working_arm(driver: SafeDriver, options: WorkcellOptions, task: Task) -> str | None:
    """Return the arm that calls are made with at first: of several the one that was asked for, else the first."""
    if len(driver.arms) == 1:
        return None
    return (options.arm if task.scene.arms else None) or next(iter(driver.arms))


def with_world(task: Task | Scene | Path | str | None, world: Path | str) -> Task:
    """Return a task in somebody's scene, whose prompt comes from the person.

    Raises:
        InputError: A task is given as well.
    """
    if task is not None:
        raise InputError(
            "--scene: a task has its own scene (scene: {world: FILE} in its file); leave out --scene or --task"
        )
    return resolve_task(Scene(world=Path(world)))


def _opened(connect: Callable[..., SafeDriver], task: Task, layouts: Layouts, seed: int, *, blamed: str) -> SafeDriver:
    """Return the driver, opened on the task's scene: as written where it can start over, on the seed's layout where not."""
    try:
        driver = connect(task.scene)
    except InputError as error:
        # A failure on a robot with a sidecar of its own is often the sidecar's. The checks infer a robot from its model,
        # which most worlds never need.
        from robosandbox.robots.check.diagnosis import advice, own_files

        files = own_files(task.scene)
        text = f"{error}{advice(files, str(error)) if files else ''}"
        raise InputError(f"{blamed}: {text}" if blamed else text) from None
    if driver.capabilities.reset or (seed == 0 and layouts.begin_as_written):
        return driver
    driver.close()
    return layouts.lay_out(seed, lambda scene, q: _begun_at(connect(scene, start_q=q), q, task))


def _begun_at(driver: SafeDriver, q: Start, task: Task) -> SafeDriver:
    """Return a driver that stands where the task wants the arms to begin."""
    starts = q if isinstance(q, Mapping) else dict.fromkeys(driver.arms, q)
    off = max(float(np.abs(arm.state().q - starts[name]).max()) for name, arm in driver.arms.items())
    if task.start_q is not None and off > _BEGUN:
        driver.close()
        raise InputError(f"start_q: the driver begins {off:.3f} rad or m from there; use one that takes start_q")
    return driver
