"""Another engine under the skills: the package in examples/drivers/pybullet, from its own bodies to a judged episode."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from robosandbox.apps.bench.bench import BenchSettings, run_bench
from robosandbox.apps.conformance import check_driver
from robosandbox.driver import load_driver, made_safe
from robosandbox.errors import InputError, LimitError, UnsupportedError
from robosandbox.tasks.bundled import STANDARD_SUITE, task_entries
from robosandbox.tasks.loader import find_task
from robosandbox.types import Pose, Scene, SceneObject, Trajectory
from robosandbox.workcell.session import open_session

pytest.importorskip("robosandbox_pybullet", reason="the group `engines` is not installed")

from robosandbox_pybullet.driver import PyBulletDriver
from robosandbox_pybullet.world import ROBOT_MODEL

# Share of episodes that have to succeed, as the issue tracker asks; benchmarks/drivers.py measures it on more seeds.
BARS = {"hardware": 0.95, "pybullet": 0.9}
# What a millimetre's worth of 42 degrees over 480 pixels at 1.3 m allows for, metres.
_PIXEL = 0.003


def opened(scene: Scene) -> PyBulletDriver:
    driver = load_driver("pybullet", scene)._inner
    assert isinstance(driver, PyBulletDriver)
    return driver


@pytest.fixture
def driver() -> Iterator[PyBulletDriver]:
    made = opened(find_task("put_in_bin").scene)
    yield made
    made.close()


def test_the_driver_passes_the_check(driver: PyBulletDriver) -> None:
    check_driver(driver)


def test_it_is_commanded_within_the_limits_alone_and_seen_to_stand_after_a_stop(driver: PyBulletDriver) -> None:
    safe, q = made_safe(driver), driver.state().q
    goal = q + 0.5 * np.eye(len(q))[0]
    with pytest.raises(LimitError, match=r"would move at 5 rad/s .* its limit is 2\.17"):
        safe.arms["arm"].follow(Trajectory(q=np.array([q, goal]), dt=0.1))
    share = (1.0 - np.cos(np.linspace(0.0, np.pi, 61))) / 2.0
    safe.arms["arm"].follow(Trajectory(q=q + share[:, None] * (goal - q), dt=0.01))
    safe.stop()
    safe.wait(safe.safety.stop_deadline)
    assert safe.safety.mode == "stopped" and safe.safety.stopped_after is not None
    assert [text.partition(":")[0] for text in safe.safety.unprotected] == ["sliding", "workspace"]


def test_the_engine_and_the_planner_agree_where_the_hand_is(driver: PyBulletDriver) -> None:
    world, robot = driver._world, driver.arms["arm"].spec
    rng = np.random.default_rng(0)
    for _ in range(5):
        for joint, value in zip(world.arm, robot.home_q + rng.uniform(-0.5, 0.5, robot.n), strict=True):
            world.call("resetJointState", world.robot, joint, float(value))
        told = driver.state().tcp_pose
        # The sidecar's TCP in the frame of the link that carries it.
        true = world.hand_pose() @ Pose(xyz=(0.0, 0.0, 0.105), quat_xyzw=(0.0, 0.0, 1.0, 0.0))
        assert np.abs(told.position - true.position).max() < 1e-6
        assert np.abs(told.rotation - true.rotation).max() < 1e-6


@pytest.mark.parametrize("camera", ["scene", "top", "wrist"])
def test_depth_and_colour_show_things_where_the_engine_has_them(driver: PyBulletDriver, camera: str) -> None:
    frame = driver.senses.capture(camera)
    lens, pose = frame.intrinsics, frame.pose_camera_in_world
    red = (frame.rgb[..., 0] > 150) & (frame.rgb[..., 1] < 80)
    v, u = np.nonzero(red)
    depth = frame.depth[red]
    points = np.column_stack([(u - lens.cx) / lens.fx * depth, (v - lens.cy) / lens.fy * depth, depth])
    seen = points @ pose.rotation.T + pose.position
    cube = driver.referee().objects["red_cube"]
    assert len(seen) > 50
    # Nothing of the cube is seen outside of it, and its top is where it is.
    assert np.abs(seen - cube.pose.position).max() < 0.015 + _PIXEL
    assert seen[:, 2].max() == pytest.approx(cube.pose.position[2] + 0.015, abs=_PIXEL)


def test_what_a_franka_hand_does_not_feel_is_refused(driver: PyBulletDriver) -> None:
    for ask in (lambda: driver.hands["hand"].grip_on(None), driver.senses.strongest_contact):
        with pytest.raises(UnsupportedError):
            ask()


def test_another_robot_is_refused() -> None:
    with pytest.raises(InputError, match=r"robot_urdf: the driver 'pybullet' has a Panda, not ur5e"):
        opened(Scene.model_validate({"robot_urdf": "ur5e"}))


def test_every_shape_comes_to_rest_on_the_table() -> None:
    sizes = {
        "box": (0.02, 0.02, 0.02),
        "sphere": (0.02,),
        "cylinder": (0.02, 0.03),
        "capsule": (0.02, 0.02),
        "bin": (0.05, 0.05, 0.04),
        "bowl": (0.05, 0.04),
        "cup": (0.035, 0.08),
        "drawer": (0.2, 0.15, 0.12, 0.1),
        "plate": (0.06, 0.02),
        "tray": (0.08, 0.06, 0.03),
        "block_l": (0.03, 0.03, 0.02, 0.015),
    }
    objects = tuple(
        SceneObject(
            id=f"a_{kind}",
            kind=kind,
            size=size,
            pose=Pose(xyz=(-0.1 + 0.25 * (k % 3), -0.35 + 0.22 * (k // 3), 0.12)),
        )
        for k, (kind, size) in enumerate(sizes.items())
    )
    driver = opened(Scene(objects=objects))
    try:
        for name, item in driver.referee().objects.items():
            lowest = -float(item.detected().shape.support(item.detected(), np.array([[0.0, 0.0, -1.0]]))[0])
            assert lowest == pytest.approx(0.04, abs=0.001), name
    finally:
        driver.close()


@pytest.mark.parametrize("name", ["put_in_bin", "push_left"])
def test_a_task_is_done_from_pixels_and_judged_by_the_engine(name: str) -> None:
    with open_session(name, driver="pybullet", perception="rgbd", seed=1) as session:
        assert session.task.scene.robot_urdf == ROBOT_MODEL
        episode = session.run()
        assert episode.success, episode
        assert session.judge().success


@pytest.mark.slow
def test_the_wrist_feels_what_the_hand_holds_and_nothing_of_the_hand() -> None:
    with open_session("pick_cube_franka", driver="pybullet", perception="rgbd") as session:
        assert np.abs(session.driver.senses.force_on(None)).max() < 0.1
        assert session.run().success
        weight = 9.81 * session.task.scene.objects[0].mass
        assert np.allclose(session.driver.senses.force_on(None), [0.0, 0.0, weight], atol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["open_drawer", "tap_cube"])
def test_what_needs_a_sense_of_force_is_done(name: str) -> None:
    with open_session(name, driver="pybullet", perception="rgbd") as session:
        assert session.run().success
        verdict = session.judge()
        assert verdict.success, verdict


@pytest.mark.slow
@pytest.mark.parametrize("driver", [pytest.param("hardware", marks=pytest.mark.gl), "pybullet"])
def test_the_standard_tasks_are_done_from_pixels(driver: str) -> None:
    tasks = [find_task(entry.name) for entry in task_entries() if entry.suite == STANDARD_SUITE]
    rows = list(run_bench(tasks, 1, settings=BenchSettings(driver=driver, perception="rgbd")))
    assert [row for row in rows if row.claimed and not row.success] == []
    missed = [(row.task, row.seed, row.detail) for row in rows if not row.success]
    assert len(missed) <= (1.0 - BARS[driver]) * len(rows), missed
