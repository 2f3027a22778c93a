"""Parts by name: what an outside package registers is found, told its options, checked, and used in an episode."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from support.processes import mcp_command

from robosandbox import open_session, plugins
from robosandbox.apps.conformance import check_grasp_planner, check_motion_planner
from robosandbox.errors import InputError
from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.grasp.protocols import GraspPlanner
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.motion.protocols import MotionPlanner
from robosandbox.types import Pose
from robosandbox.workcell.embedded import EmbeddedWorkcell

OUTSIDE = '''
"""A grasp planner and a motion planner of somebody else's."""

from robosandbox.grasp.analytic import AnalyticTopDown
from robosandbox.motion.ik import DLSMotionPlanner


class Few:
    """The first grasps of the analytic planner and no others."""

    asked = 0

    def __init__(self, *, most=5):
        self.most = most
        self.inner = AnalyticTopDown()

    def candidates(self, target, scene, robot, *, pieces=(), hand=None):
        type(self).asked += 1
        for count, grasp in enumerate(self.inner.candidates(target, scene, robot, pieces=pieces, hand=hand)):
            if count == self.most:
                return
            yield grasp


class Slow(DLSMotionPlanner):
    """Moves at a share of the speed that is asked for."""

    planned = 0

    def __init__(self, share, *, clearance=0.002):
        super().__init__(clearance=clearance)
        self.share = share

    def plan_joints(self, q_start, q_goal, *, speed=0.5):
        type(self).planned += 1
        return super().plan_joints(q_start, q_goal, speed=self.share * speed)
'''
ENTRY_POINTS = """[robosandbox.grasp_planners]
few = outside_planners:Few

[robosandbox.motion_planners]
slow = outside_planners:Slow
absent = outside_planners_that_are_not_there:Planner
"""


@pytest.fixture
def outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Install a package with planners of its own."""
    (tmp_path / "outside_planners.py").write_text(OUTSIDE)
    installed = tmp_path / "outside_planners-1.0.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: outside-planners\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(str(tmp_path))
    plugins._all.cache_clear()
    yield
    plugins._all.cache_clear()


HALF = """
class Waver:
    name = "wave"


class Blind:
    def perceive(self, sim): ...
    def planning(self, sim, seen): ...
"""
HALF_ENTRY_POINTS = """[robosandbox.skills]
wave = half_made:Waver

[robosandbox.shapes]
cone = not_importable:Cone

[robosandbox.perceptions]
broken = not_importable:Eyes
blind = half_made:Blind
"""


def with_broken_package(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run `robo-sandbox` where a package is installed of which one module does not import and another lacks what it needs."""
    installed = folder / "half_made-1.0.dist-info"
    installed.mkdir()
    (folder / "half_made.py").write_text(HALF)
    (folder / "not_importable.py").write_text("import not_there_at_all")
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: half-made\nVersion: 1.0\n")
    (installed / "entry_points.txt").write_text(HALF_ENTRY_POINTS)
    command = [*mcp_command()[:-1], *arguments]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)


def test_what_is_installed_and_broken_is_left_out_with_a_line_each(tmp_path: Path) -> None:
    ran = with_broken_package(tmp_path, "run", "pick up the red cube", "--json")
    assert ran.returncode == 0, ran.stderr
    warned = [line for line in ran.stderr.splitlines() if line.startswith("WARNING")]
    assert len(warned) == 2
    assert "the shape 'cone' is left out: the package half-made 1.0 has the entry point" in warned[0]
    assert "cone = not_importable:Cone, which does not import (ModuleNotFoundError" in warned[0]
    assert (
        "the skill 'wave' is left out" in warned[1]
        and "Waver lacks alternatives, check, contract, description, run" in warned[1]
    )


@pytest.mark.parametrize(
    ("name", "why"),
    [("broken", "does not import (ModuleNotFoundError"), ("blind", "makes no Perception: Blind lacks view")],
)
def test_what_is_named_and_broken_is_refused_in_a_line(tmp_path: Path, name: str, why: str) -> None:
    ran = with_broken_package(tmp_path, "plan", "pick up the red cube", "--perception", name)
    assert ran.returncode == 2 and "Traceback" not in ran.stderr
    line = ran.stderr.splitlines()[-1]
    assert line.startswith(f"robo-sandbox: --perception {name}: the package half-made 1.0 has the entry point")
    assert why in line and line.endswith(
        "take another perception: " + ("blind" if name == "broken" else "broken") + ", ground_truth, rgb, rgbd, vlm"
    )


@pytest.fixture(scope="module")
def world() -> Iterator[EmbeddedWorkcell]:
    with open_session("pick_cube_franka") as session:
        yield session


@pytest.mark.parametrize("name", plugins.plugin_names("grasp_planners"))
def test_an_installed_grasp_planner_keeps_its_promises(name: str, world: EmbeddedWorkcell) -> None:
    scene = world.observe()
    planner = plugins.make_plugin("grasp_planners", GraspPlanner, name)
    assert check_grasp_planner(planner, scene.objects[0], scene, world.mujoco.robot)


@pytest.mark.parametrize("name", plugins.plugin_names("motion_planners"))
def test_an_installed_motion_planner_keeps_its_promises(name: str, world: EmbeddedWorkcell) -> None:
    check_motion_planner(plugins.make_plugin("motion_planners", MotionPlanner, name), world.ctx)


def test_planners_of_an_outside_package_carry_out_a_task(outside: None) -> None:
    with open_session("pick_cube_franka") as session:
        session.run()
        usual = session.driver.time
    options = {"grasp_options": {"most": 2}, "motion_options": {"share": 0.5, "clearance": 0.003}}
    with open_session("pick_cube_franka", grasp="few", motion="slow", **options) as session:
        scene = session.observe()
        check_grasp_planner(session.ctx.grasp, scene.objects[0], scene, session.mujoco.robot)
        check_motion_planner(session.ctx.motion, session.ctx)
        asked, planned = type(session.ctx.grasp).asked, type(session.ctx.motion).planned
        assert len(list(session.ctx.grasp.candidates(scene.objects[0], scene, session.mujoco.robot))) == 2
        assert session.ctx.motion.clearance == 0.003
        assert session.run().success and session.judge().success
        assert type(session.ctx.grasp).asked > asked + 1 and type(session.ctx.motion).planned > planned
        assert session.driver.time > 1.2 * usual


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"grasp": "fwe"}, "--grasp: no grasp planner 'fwe'; there is analytic, few; did you mean 'few'?"),
        ({"motion": "dsl"}, "--motion: no motion planner 'dsl'; there is absent, dls, slow; did you mean 'dls'?"),
        ({"motion": "slow"}, "--share: is missing; the motion planner 'slow' needs it"),
        (
            {"grasp_options": {"most": 2}},
            "--most: the grasp planner 'analytic' takes no such option; it takes none; --grasp few takes it",
        ),
        (
            {"motion_options": {"share": 0.5}},
            "--share: the motion planner 'dls' takes no such option; it takes --n-waypoints, --dt, --clearance; "
            "--motion slow takes it",
        ),
        (
            {"planner_options": {"dialogue": True}},
            "--dialogue: the planner 'stub' takes no such option; it takes --frame",
        ),
        (
            {"perception": "rgbd", "perception_options": {"setup": None, "model": "m"}},
            "--model: the perception 'rgbd' takes no such option; it takes --cameras, --calibration; "
            "--perception vlm takes it",
        ),
    ],
)
def test_a_wrong_option_says_what_there_is(outside: None, arguments: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        open_session("pick_cube_franka", **arguments)  # type: ignore[arg-type]
    assert str(caught.value).removeprefix("pick_cube_franka: ").startswith(message)


def test_the_checks_find_what_is_broken(world: EmbeddedWorkcell) -> None:
    scene = world.observe()

    class Far(AnalyticTopDown):
        def candidates(self, target, scene, robot, *, pieces=(), hand=None):  # type: ignore[no-untyped-def]
            for grasp in super().candidates(target, scene, robot, pieces=pieces, hand=hand):
                away = Pose.from_matrix(grasp.tcp_pose.position + 0.3, grasp.tcp_pose.rotation)
                yield replace(grasp, tcp_pose=away)

    class Reckless(DLSMotionPlanner):
        def plan_joints(self, q_start, q_goal, *, speed=0.5):  # type: ignore[no-untyped-def]
            found = super().plan_joints(q_start, q_goal, speed=speed)
            return replace(found, dt=found.dt / 50.0)

    with pytest.raises(AssertionError, match="from the object's centre"):
        check_grasp_planner(Far(), scene.objects[0], scene, world.mujoco.robot)
    with pytest.raises(AssertionError, match="faster than the joints may be"):
        check_motion_planner(Reckless(), world.ctx)
