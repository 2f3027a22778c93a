"""Two Pandas at one table, as a task has them: each works while the other stands in its way, and all that is told names its arm."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robosandbox.errors import AlreadyHoldingError, CollisionError, InputError
from robosandbox.evidence import CollisionEvidence
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.tasks.loader import load_task
from robosandbox.tasks.task import Task
from robosandbox.types import Pose, Scene, SceneArm, SceneObject
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.recorder import Recorder
from robosandbox.workcell.recording.replay import open_replay
from robosandbox.workcell.session import open_session

LEFT, RIGHT = (-0.3, 0.35, 0.04, 0.0), (-0.3, -0.35, 0.04, 0.0)
DOWN = (1.0, 0.0, 0.0, 0.0)


def cube(name: str, x: float, y: float, rgba: tuple[float, float, float, float]) -> SceneObject:
    return SceneObject(id=name, kind="box", size=(0.02,) * 3, pose=Pose(xyz=(x, y, 0.061)), rgba=rgba, mass=0.05)


TASK = Task(
    name="two_arms",
    prompt="pick up the red cube",
    scene=Scene(
        arms=(SceneArm(name="left", robot_base=LEFT), SceneArm(name="right", robot_base=RIGHT)),
        objects=(
            cube("red_cube", 0.15, 0.2, (0.85, 0.1, 0.1, 1.0)),
            cube("green_cube", 0.15, -0.2, (0.1, 0.7, 0.2, 1.0)),
            cube("blue_cube", 0.15, 0.0, (0.1, 0.2, 0.85, 1.0)),
        ),
    ),
    success={"kind": "goal", "relations": "holding(red_cube, left), holding(green_cube, right)"},  # type: ignore[arg-type]
)


@pytest.fixture
def cell() -> Iterator[EmbeddedWorkcell]:
    with open_session(TASK) as session:
        yield session


def over(x: float, y: float, z: float) -> Pose:
    """Return a pose of the hand that points down at a point."""
    return Pose(xyz=(x, y, z), quat_xyzw=DOWN)


def go(cell: EmbeddedWorkcell, arm: str, pose: Pose) -> None:
    """Send an arm to a pose on a way that is planned."""
    ctx = cell.ctx
    ctx.work_with(arm)
    motion = DLSMotionPlanner()
    motion.use(ctx.planning(ctx.look()), ctx.arm.state())
    q = ctx.arm.state().q
    ctx.arm.follow(motion.plan_joints(q, motion.ik(pose, q)))
    cell.driver.wait(0.5)


def touches(cell: EmbeddedWorkcell, arm: str, path: np.ndarray) -> set[str]:
    """Return the parts of the other arm that an arm would touch along a path, by MuJoCo on the simulated model alone."""
    world = cell.mujoco.world
    model, robot, data = world.model, world.robots[arm], mujoco.MjData(world.model)
    for name, other in world.robots.items():
        data.qpos[other.qpos_indices] = cell.driver.arms[name].state().q
    found = set[str]()
    for begin, end in itertools.pairwise(path):
        for share in np.linspace(0.0, 1.0, 5):
            data.qpos[robot.qpos_indices] = begin + share * (end - begin)
            mujoco.mj_fwdPosition(model, data)
            for contact in data.contact[: data.ncon]:
                bodies = model.geom_bodyid[contact.geom].tolist()
                if {world.arm_of_body(body) for body in bodies} == {"left", "right"}:
                    found |= {world.names[body] for body in bodies if world.arm_of_body(body) != arm}
    return found


def test_each_arm_picks_its_cube_and_both_hold_at_the_end(cell: EmbeddedWorkcell) -> None:
    assert [*cell.driver.arms] == ["left", "right"] and cell.ctx.arm.name == "left"
    cell.do("pick", object="red_cube")
    assert not cell.judge().success
    cell.ctx.work_with("right")
    cell.do("pick", object="green_cube")
    assert cell.truth().hands == {"left": "red_cube", "right": "green_cube"}
    verdict = cell.judge()
    assert verdict.success and verdict.detail["holding(red_cube, left).in_hand"] == 1.0


def test_the_hand_that_is_named_has_to_hold(cell: EmbeddedWorkcell) -> None:
    cell.ctx.work_with("right")
    cell.do("pick", object="blue_cube")
    for hand, holds in (("right", True), ("left", False)):
        goal = {"kind": "goal", "relations": f"holding(blue_cube, {hand})"}
        success = Task.model_validate({**TASK.model_dump(), "success": goal}).success
        assert success.evaluate(cell.start, cell.truth()).holds is holds


def test_what_one_arm_holds_the_other_does_not_pick(cell: EmbeddedWorkcell) -> None:
    cell.do("pick", object="blue_cube")
    cell.ctx.work_with("right")
    before = cell.state()
    with pytest.raises(AlreadyHoldingError, match="the hand 'left' holds blue_cube; have that hand put it down first"):
        cell.do("pick", object="blue_cube")
    assert cell.state() is not before and cell.truth().hands == {"left": "blue_cube", "right": None}
    assert np.allclose(cell.state().arms["right"].q, before.arms["right"].q, atol=1e-3), "nothing has moved"


def test_a_sentence_is_carried_out_by_the_arm_that_was_chosen() -> None:
    with open_session(TASK, arm="right") as cell:
        assert cell.run("pick up the green cube").success
        assert cell.truth().hands == {"left": None, "right": "green_cube"}
    with pytest.raises(InputError, match="arm: 'rigth' is not one of left"):
        open_session(TASK, arm="rigth")


def test_a_way_through_the_other_arm_is_planned_around_it(cell: EmbeddedWorkcell) -> None:
    go(cell, "right", over(0.2, 0.1, 0.2))
    ctx = cell.ctx
    ctx.work_with("left")
    motion = DLSMotionPlanner()
    motion.use(ctx.planning(ctx.look()), ctx.arm.state())
    begin, end = (motion.ik(over(*xyz), ctx.arm.state().q) for xyz in ((0.0, -0.1, 0.15), (0.15, 0.3, 0.4)))
    assert touches(cell, "left", np.linspace(begin, end, 40)), "the straight way leads through the other arm"
    assert not touches(cell, "left", motion.plan_joints(begin, end).q)


def test_a_place_where_the_other_arm_is_is_refused_and_names_arm_and_link(cell: EmbeddedWorkcell) -> None:
    there = over(0.15, 0.2, 0.2)
    go(cell, "right", there)
    ctx = cell.ctx
    ctx.work_with("left")
    motion = DLSMotionPlanner()
    motion.use(ctx.planning(ctx.look()), ctx.arm.state())
    q = ctx.arm.state().q
    with pytest.raises(CollisionError, match=r"left/\w+ .* right/\w+") as caught:
        motion.plan_joints(q, motion.ik(there, q))
    assert isinstance(caught.value.evidence, CollisionEvidence) and caught.value.evidence.other.startswith("right/")
    with pytest.raises(CollisionError, match=r"right/\w+"):
        cell.do("pick", object="red_cube")
    go(cell, "right", over(0.15, -0.2, 0.2))
    ctx.work_with("left")
    cell.do("pick", object="red_cube")
    assert cell.truth().hands["left"] == "red_cube"


def test_the_twin_has_both_arms_where_they_stand(cell: EmbeddedWorkcell) -> None:
    cell.do("pick", object="red_cube")
    cell.ctx.work_with("right")
    with cell.ctx.twin() as twin:
        assert twin.arm.name == "right" and twin.look().hands == {"left": "red_cube", "right": None}
        for name, state in cell.state().arms.items():
            assert np.allclose(twin.driver.arms[name].state().q, state.q, atol=5e-3)


def test_a_file_of_a_task_names_arms(tmp_path: Path) -> None:
    text = """
name: two
prompt: pick up the red cube
scene:
  arms:
    - {name: left, robot_base: [-0.3, 0.35, 0.04, 0.0]}
    - {name: right, robot_base: [-0.3, -0.35, 0.04, 0.0], robot_urdf: xarm7}
  objects:
    - {id: red_cube, kind: box, size: [0.02, 0.02, 0.02], pose: {xyz: [0.15, 0.2, 0.061]}}
success: {kind: lifted, object: red_cube, hand: left}
"""
    (tmp_path / "two.yaml").write_text(text)
    task = load_task(tmp_path / "two.yaml")
    assert [arm.name for arm in task.scene.arms] == ["left", "right"]
    (tmp_path / "two.yaml").write_text(text.replace("name: right", "name: red_cube"))
    with pytest.raises(InputError, match="arms: 'red_cube' is the name of something else in the scene"):
        load_task(tmp_path / "two.yaml")


def test_a_layout_leaves_each_thing_to_the_arms_that_reach_it(cell: EmbeddedWorkcell) -> None:
    home = cell.state().arms
    cell.reset(3)
    assert {*cell.truth().objects} == {"red_cube", "green_cube", "blue_cube"}
    for name, arm in cell.state().arms.items():
        assert np.allclose(arm.q, home[name].q, atol=5e-3)


def test_a_recording_has_both_arms_and_is_run_again(cell: EmbeddedWorkcell, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, cell)
    recorder.begin("both")
    cell.do("pick", object="red_cube")
    cell.ctx.work_with("right")
    cell.do("pick", object="green_cube")
    folder = recorder.finish(judged=cell.judge(), outcome=(True, "plan_complete", ""))
    recorder.close()
    assert folder is not None
    episode = RecordedEpisode.load(folder)
    assert [*episode.meta.arms] == ["left", "right"] and episode.meta.robot_name == "panda"
    assert set(episode.table.column_names) == set(episode.meta.columns)
    for name, state in cell.state().arms.items():
        q, gripper, tcp = (episode.of_arm(name, column) for column in ("q", "gripper", "tcp_pose"))
        assert q is not None and gripper is not None and tcp is not None and state.gripper is not None
        assert np.array_equal(q[-1], state.q) and gripper[-1, 1] == pytest.approx(state.gripper.width, abs=1e-6)
        assert np.allclose(tcp[-1, :3], state.tcp_pose.xyz, atol=1e-6)
    with pytest.raises(ValueError, match=r"there are 2 arms \(left, right\)"):
        _ = episode.meta.robot
    replay = open_replay(episode)
    with replay.session:
        again = replay.run()
    assert again.same and again.joint_error == 0.0
    assert max(again.object_error_mm.values()) < 1e-4, "as near as the column's numbers tell"
