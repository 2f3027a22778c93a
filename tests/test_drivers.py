"""Any driver under the skills: what it lacks is said, and what it has is enough."""

from __future__ import annotations

import contextlib
import re
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from support.performing import perform

from robosandbox.agent.agent import Agent
from robosandbox.agent.context import AgentContext
from robosandbox.agent.planner import StubPlanner
from robosandbox.apps.conformance import check_driver
from robosandbox.driver import BareSenses, Capabilities, Guard, driver_factory, load_driver
from robosandbox.driver.force import ForceGuard
from robosandbox.drivers.hardware import Hardware
from robosandbox.errors import ErrorCode, InputError, UnsupportedError
from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.perception.factory import Setup
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.perception.sensed import SensedDriver
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import require_mujoco
from robosandbox.skills.catalogue import load_skills
from robosandbox.tasks.loader import find_task
from robosandbox.types import Array, Limits, PictureWindow, RgbdFrame, Scene
from robosandbox.workcell.session import open_session


def context(driver: Hardware, scene: Scene, limits: Limits | None = None) -> AgentContext:
    return AgentContext(
        sim=driver,
        perception=RgbdPerception(setup=Setup.of(scene)),
        grasp=AnalyticTopDown(),
        motion=DLSMotionPlanner(),
        limits=limits,
    )


def agent(ctx: AgentContext) -> Agent[AgentContext]:
    skills = load_skills()
    return Agent(ctx=ctx, skills=skills, planner=StubPlanner(skills))


@pytest.fixture
def hardware() -> Iterator[Hardware]:
    driver = Hardware(find_task("pick_cube_franka").scene)
    yield driver
    driver.close()


def test_drivers_are_installed_by_name_and_opened_on_a_scene_with_options() -> None:
    with load_driver("mujoco:control_timestep=0.02", Scene(), supplied={"render_size": (48, 64)}) as sim:
        world = require_mujoco(sim, "it is of the size that was asked for")
        assert (world.control_timestep, world.render_size) == (0.02, (48, 64))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("hardware:latency=late", "--driver hardware:latency=late: input should be a valid number"),
        ("hardware:lateness=1", "--driver hardware:lateness: the driver 'hardware' takes no such option"),
        ("hardware:seed", "'seed' is no option; write key=value"),
        ("hardware:start_q=1", "--driver hardware:start_q: "),
        ("robot", "--driver: no driver 'robot'; there is"),
    ],
)
def test_a_wrong_option_of_a_driver_is_one_line_before_anything_is_opened(name: str, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        driver_factory(name)


@pytest.mark.gl
def test_a_session_on_hardware_is_judged_by_its_referee_and_says_what_needs_a_simulation() -> None:
    with open_session(
        "pick_cube_franka", driver="hardware", driver_options={"seed": 3}, perception="rgbd", seed=2
    ) as cell:
        drawn = cell.start.objects["red_cube"].pose
        assert cell.run().success
        assert cell.judge().success
        assert cell.elapsed()[1] is None
        for refused in (cell.checkpoint, cell.reset):
            with pytest.raises(
                UnsupportedError, match=r"truth: the driver of panda does not know the true state of its world"
            ):
                refused()
    with open_session("pick_cube_franka", seed=2) as simulated:
        assert np.allclose(simulated.start.objects["red_cube"].pose.xyz, drawn.xyz, atol=1e-4)


def test_what_draws_or_records_a_model_says_so_to_a_driver_without_one(hardware: Hardware) -> None:
    with pytest.raises(UnsupportedError, match=r"model: the driver of panda has no simulated model, and the viewer"):
        require_mujoco(hardware, "the viewer draws it")


def test_what_a_driver_does_not_have_is_no_zero(hardware: Hardware) -> None:
    gripper = hardware.state().gripper
    assert gripper is not None and gripper.force is None and gripper.commanded == 0.0
    for ask in (
        lambda: hardware.senses.force_on(None),
        lambda: hardware.hands["hand"].grip_on(None),
        lambda: hardware.arms["arm"].servo_force(0),
        hardware.senses.contacts,
        hardware.senses.strongest_contact,
    ):
        with pytest.raises(UnsupportedError) as failure:
            ask()
        assert failure.value.code == ErrorCode.UNSUPPORTED


@pytest.mark.gl
def test_one_camera_of_any_name_is_enough_to_see_with() -> None:
    scene = find_task("pick_cube_franka").scene

    class OneEye(Hardware):
        """Has the plant's camera beside the table, and calls it something else."""

        @property
        def capabilities(self) -> Capabilities:
            whole = super().capabilities
            return replace(whole, cameras={"left_of_bench": whole.cameras["scene"]})

        def next_frame(self, camera: str, window: PictureWindow | None) -> RgbdFrame:
            assert camera == "left_of_bench"
            return replace(super().next_frame("scene", window), camera=camera)

    driver = OneEye(scene)
    try:
        seen = RgbdPerception(setup=Setup.of(scene)).perceive(driver)
        assert [item.id for item in seen.objects] == ["red_cube"]
        true = driver.referee().objects["red_cube"].pose
        assert np.abs(seen.objects[0].pose.position - true.position).max() < 0.005
    finally:
        driver.close()


def test_pixels_are_refused_where_no_camera_is_declared(hardware: Hardware) -> None:
    hardware._capabilities = replace(hardware.capabilities, cameras={})
    with pytest.raises(UnsupportedError, match=r"cameras: .* perception from colour and depth looks through them"):
        RgbdPerception().perceive(hardware)


def test_ground_truth_is_refused_where_there_is_none(hardware: Hardware) -> None:
    with pytest.raises(UnsupportedError, match=r"truth: the driver of .* rgbd"):
        GroundTruthPerception().perceive(hardware)


def test_a_limit_of_force_is_refused_where_no_contact_is_felt(hardware: Hardware) -> None:
    scene = find_task("pick_cube_franka").scene
    with pytest.raises(UnsupportedError, match=r"contact: .* limits.max_force_n, 20 N"):
        context(hardware, scene, Limits(max_force_n=20.0))


def test_without_a_sense_of_force_it_is_said_once_that_no_limit_is_kept(
    hardware: Hardware, caplog: pytest.LogCaptureFixture
) -> None:
    scene = find_task("pick_cube_franka").scene
    ctx = context(hardware, scene)
    assert not any(isinstance(guard, ForceGuard) for guard in hardware.guards) and ctx.max_force_n == 60.0
    assert [record.message for record in caplog.records if "no limit of force is kept" in record.message] == [
        "force: the driver of panda tells neither contact nor a wrench at the wrist, so that no limit of force is kept"
    ]


def test_commands_take_effect_after_the_latency(hardware: Hardware) -> None:
    hardware.hands["hand"].set_gripper(1.0)
    before = hardware._plant.controls.copy()
    moved = []
    for _ in range(5):
        hardware.wait(hardware.control_timestep)
        moved.append(bool(np.abs(hardware._plant.controls - before).max() > 0.0))
    assert moved == [False, False, False, True, True]


def test_on_the_wall_clock_time_passes_by_itself_and_waits_take_as_long_as_they_say() -> None:
    driver = Hardware(Scene(), clock="wall")
    try:
        first, begin = driver.time, time.monotonic()
        while time.monotonic() < begin + 3 * driver.control_timestep:
            pass
        assert driver.time >= first + 2 * driver.control_timestep
        first, begin = driver.time, time.monotonic()
        driver.wait(0.2)
        # The last tick before the wait may have been due nearly a tick ago.
        assert time.monotonic() - begin > 0.2 - 2 * driver.control_timestep
        assert driver.time - first >= 0.2
    finally:
        driver.close()


@pytest.mark.slow
def test_hardware_on_the_wall_clock_passes_the_check() -> None:
    driver = Hardware(Scene(), clock="wall")
    try:
        check_driver(driver, pictures=False)
    finally:
        driver.close()


@pytest.mark.gl
@pytest.mark.parametrize("sense", [None, "gripper_force", "joint_torque", "wrist_wrench"])
def test_hardware_passes_the_check_with_and_without_each_sense(sense: str | None) -> None:
    driver = Hardware(Scene(), **({sense: True} if sense else {}))
    try:
        check_driver(driver)
    finally:
        driver.close()


@pytest.mark.gl
def test_the_mujoco_driver_passes_the_check_exact_and_as_cameras_leave_it() -> None:
    with MuJoCoBackend() as sim:
        sim.load(Scene())
        check_driver(sim)
        check_driver(SensedDriver(sim))


class Boastful(Hardware):
    """Answers 0 where it measures nothing."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self.senses = Zeros(self)


class Zeros(BareSenses):
    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        return np.zeros(3)


class Deaf(Hardware):
    """Goes on whatever a guard says."""

    def tick(self, guards: Sequence[Guard]) -> None:
        with contextlib.suppress(Exception):
            super().tick(guards)


@pytest.mark.parametrize(
    ("kind", "said"), [(Boastful, "wrist_wrench is not declared"), (Deaf, r"guard did not end follow\(\)")]
)
def test_the_check_tells_a_broken_promise(kind: type[Hardware], said: str) -> None:
    driver = kind(Scene())
    try:
        with pytest.raises(AssertionError, match=said):
            check_driver(driver, pictures=False)
    finally:
        driver.close()


@pytest.mark.gl
def test_a_cube_is_picked_from_pixels_through_late_noisy_numb_hardware() -> None:
    task = find_task("pick_cube_franka")
    driver = Hardware(task.scene)
    try:
        cube = driver._plant.truth().objects["red_cube"].pose.position[2]
        episode = agent(context(driver, task.scene)).run(task.prompt)
        assert episode.success, episode
        driver.wait(1.0)
        assert driver._plant.truth().objects["red_cube"].pose.position[2] > cube + 0.1
    finally:
        driver.close()


@pytest.mark.gl
def test_a_tap_is_refused_where_no_force_is_felt() -> None:
    scene = find_task("pick_cube_franka").scene
    driver = Hardware(scene)
    try:
        ctx = context(driver, scene)
        tap = next(skill for skill in load_skills() if skill.name == "tap")
        with pytest.raises(UnsupportedError, match=r"wrist_wrench: .* a tap ends where the object is felt"):
            perform(ctx, tap, {"object": "red_cube"})
    finally:
        driver.close()


def test_a_grip_is_as_hard_as_it_is_told_to_be() -> None:
    with open_session("pick_cube_franka") as cell:
        assert cell.run().success
        for force in (30.0, 10.0):
            cell.driver.hands["hand"].set_gripper(1.0, force)
            cell.driver.wait(1.0)
            gripper = cell.driver.state().gripper
            assert gripper is not None and gripper.force == pytest.approx(force, rel=0.02)
            assert cell.driver.hands["hand"].grip_on("red_cube") == pytest.approx(force / 2.0, rel=0.05)


def test_a_force_is_refused_by_a_gripper_that_takes_none(hardware: Hardware) -> None:
    with pytest.raises(UnsupportedError, match="grip_limit: the driver of panda takes no limit of its gripper's force"):
        hardware.hands["hand"].set_gripper(1.0, 10.0)
