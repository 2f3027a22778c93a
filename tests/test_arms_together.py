"""Two Pandas at one table, as a task has them: each works while the other stands in its way, and all that is told names its arm."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mcap.reader import make_reader
from support.processes import SimProcess

from robosandbox.apps.bench.contact_monitor import ContactMonitor
from robosandbox.apps.envs.env import ManipulationEnv
from robosandbox.apps.export.foxglove import export_mcap
from robosandbox.apps.export.lerobot import export_lerobot
from robosandbox.apps.viewer.app import Viewer
from robosandbox.apps.viewer.connected import ConnectedSource
from robosandbox.apps.viewer.embedded import EmbeddedSource
from robosandbox.apps.viewer.replay import recorded_frames
from robosandbox.errors import AlreadyHoldingError, CollisionError, InputError, InvalidArgumentError, LimitError
from robosandbox.evidence import CollisionEvidence
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.tasks.loader import load_task
from robosandbox.tasks.task import Task
from robosandbox.types import Limits, Pose, Scene, SceneArm, SceneObject, Trajectory
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.host import WorkcellHost
from robosandbox.workcell.recording.drawing import plot
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.recorder import Recorder
from robosandbox.workcell.recording.replay import open_replay
from robosandbox.workcell.session import open_session
from robosandbox.workcell.zenoh.client.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell
from robosandbox.workcell.zenoh.messages import Info, decode
from robosandbox.workcell.zenoh.server.readings import info_of

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


def test_an_arm_is_chosen_by_a_call_as_others_are(cell: EmbeddedWorkcell) -> None:
    assert cell.do("use_arm", arm="right").detail == {"arm": "right"} and cell.ctx.arm.name == "right"
    with pytest.raises(InvalidArgumentError, match="arm: 'rigth' is not one of left, right; did you mean 'right'"):
        cell.do("use_arm", arm="rigth")
    cell.do("pick", object="blue_cube")
    assert cell.truth().hands == {"left": None, "right": "blue_cube"}
    with open_session() as alone:
        assert "use_arm" not in alone.calls and "use_arm" in cell.calls


def test_a_sim_process_takes_the_arm_with_a_goal_and_says_which_it_is(tmp_path: Path) -> None:
    file = tmp_path / "two.yaml"
    file.write_text(TASK.model_dump_json())
    with SimProcess("--task", str(file), "--pace", "fast") as sim, connect(sim.endpoint) as client:
        far = RemoteWorkcell(client.robot())
        assert [*far.robot.info().arms] == ["left", "right"] and far.robot.state().arm == "left"
        far.do("use_arm", arm="right")
        far.do("pick", object="green_cube")
        state = far.robot.state()
        assert state.arm == "right" and state.hands == {"left": None, "right": "green_cube"}
        source = ConnectedSource(WorkcellHost(far))
        frame = source._drawn.frame(state)
        assert source.blueprint.arm == "right" and frame.hands == state.hands
        robot = source.blueprint.robots["right"]
        assert np.allclose(frame.qpos[robot.qpos_indices], state.robot.arms["right"].q, atol=1e-4)


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


def test_an_arm_may_go_on_holding_what_it_may_not_press_otherwise() -> None:
    heavy = tuple(item.model_copy(update={"mass": 0.5}) for item in TASK.scene.objects)
    scene = TASK.scene.model_copy(update={"objects": heavy})
    with open_session(TASK.model_copy(update={"scene": scene, "limits": Limits(max_unintended_force_n=4.0)})) as cell:
        cell.do("pick", object="red_cube")
        cell.do("use_arm", arm="right")
        cell.do("pick", object="green_cube")
        weight = float(np.linalg.norm(cell.driver.senses.force_on("red_cube", "left")))
        assert weight > 4.5 and cell.truth().hands == {"left": "red_cube", "right": "green_cube"}


def test_drivers_of_one_robot_refuse_a_scene_with_several() -> None:
    with pytest.raises(InputError, match=r"scene\.arms: there are left, right, and this works with one robot alone"):
        open_session(TASK, driver="hardware")


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
    for change, said in (
        (("name: right", "name: red_cube"), "arms: 'red_cube' is the name of something else in the scene"),
        (("name: right", "name: left"), "arms: 'left' is the name of something else in the scene"),
        (("    - {name: left,", "    # - {name: left,"), "arms: one arm is the scene's own robot"),
        (("robot_urdf: xarm7", "robot_config: x.yaml"), "robot_config: is the sidecar of a model; give robot_urdf"),
    ):
        (tmp_path / "two.yaml").write_text(text.replace(*change))
        with pytest.raises(InputError, match=said):
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


def test_exports_and_pictures_of_a_recording_have_both_arms(cell: EmbeddedWorkcell, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, cell)
    recorder.begin("one")
    cell.do("pick", object="red_cube")
    folder = recorder.finish()
    recorder.close()
    assert folder is not None
    episode = RecordedEpisode.load(folder)
    target = tmp_path / "set"
    export_lerobot([episode], target, fps=20, cameras=(), size=(120, 160))
    names = json.loads((target / "meta/info.json").read_text())["features"]["observation.state"]["names"]
    assert names[0] == "left/joint1.pos" and names[7] == "left/gripper.closed" and names[8] == "right/joint1.pos"
    assert len(names) == 16
    plot(episode, tmp_path / "plot.png")
    assert (tmp_path / "plot.png").stat().st_size > 10_000
    frames = recorded_frames(episode, cell)
    drawn = frames.frame(len(episode) - 1)
    assert np.allclose(drawn.seen.arms["left"].q, cell.state().arms["left"].q)
    export_mcap(episode, tmp_path / "log.mcap", fps=20.0, cameras=(), size=(120, 160))
    with (tmp_path / "log.mcap").open("rb") as stream:
        topics = {channel.topic for channel in make_reader(stream).get_summary().channels.values()}  # type: ignore[union-attr]
    assert {"/left/tcp", "/right/tcp", "/left/state", "/right/state", "/joint_states"} <= topics


def test_info_tells_of_each_arm(cell: EmbeddedWorkcell) -> None:
    info = info_of(cell, robot_id="cell", boot_id="b", truth=True, pace="fast", sizes={})
    assert decode(info.model_dump_json().encode(), Info) == info
    assert [*info.arms] == ["left", "right"] and info.base_xy == info.arms["left"].base_xy == LEFT[:2]
    assert info.arms["right"].base_xy == RIGHT[:2] and len(info.arms["right"].joints) == 7
    with open_session() as alone:
        told = info_of(alone, robot_id="arm", boot_id="b", truth=True, pace="fast", sizes={}).model_dump()
        assert told["robot"] == "panda" and "arms" not in told


def test_cameras_see_things_and_neither_arm_nor_what_they_hold() -> None:
    with open_session(TASK, perception="rgbd") as cell:
        go(cell, "right", over(0.2, 0.0, 0.25))
        seen, truth = cell.ctx.look(), cell.truth().objects
        assert {item.id for item in seen.objects} == {*truth} and seen.hands == {"left": None, "right": None}
        for item in seen.objects:
            assert np.linalg.norm(item.pose.position - truth[item.id].pose.position) < 0.005, item.id
        cell.ctx.work_with("left")
        cell.do("pick", object="red_cube")
        cell.ctx.work_with("right")
        cell.do("pick", object="green_cube")
        seen = cell.ctx.look()
        assert seen.hands == {"left": "red_cube", "right": "green_cube"} and seen.held == "green_cube"
        for name in ("red_cube", "green_cube"):
            found = seen.find(name)
            assert found is not None
            assert np.linalg.norm(found.pose.position - cell.truth().objects[name].pose.position) < 0.005
        assert {item.id for item in seen.objects} == {*truth}, "no arm is taken for a thing"


def test_an_environment_moves_the_arm_that_is_named(cell: EmbeddedWorkcell) -> None:
    env = ManipulationEnv(cell, arm="right", action="joint")
    seen, _ = env.reset()
    before = cell.state().arms
    assert env.action_space.shape == (8,) and seen["agent_pos"].shape == (8,)
    goal = before["right"].q + 0.2 * np.eye(7)[0]
    for _ in range(20):
        seen, *_ = env.step(env.controller.joint_action(goal, closed=1.0))
    after = cell.state().arms
    assert np.allclose(seen["agent_pos"][:7], goal, atol=5e-3) and np.allclose(
        after["left"].q, before["left"].q, atol=1e-3
    )
    assert after["right"].gripper is not None and after["right"].gripper.closed > 0.9
    assert after["left"].gripper is not None and after["left"].gripper.closed < 0.1


def test_a_viewer_draws_all_arms_and_says_whose_readings_are_which(cell: EmbeddedWorkcell) -> None:
    source = EmbeddedSource(WorkcellHost(cell, pace="watched"))
    viewer = Viewer(source, 0)
    try:
        assert source.blueprint.arm == "left" and source.blueprint.robot_scene.robot_base == LEFT
        cell.ctx.work_with("right")
        cell.do("pick", object="green_cube")
        viewer._draw(source._frame())
        assert viewer._blueprint.arm == "right", "layers are about the arm that works now"
        world, data = cell.mujoco.world, mujoco.MjData(cell.mujoco.model)
        for name, robot in world.robots.items():
            data.qpos[robot.qpos_indices] = cell.state().arms[name].q
        mujoco.mj_kinematics(world.model, data)
        for name in world.robots:
            hand = world.names.index(f"{name}/hand")
            assert np.allclose(viewer._body_scene.pose(hand).position, data.xpos[hand], atol=1e-4), name
        told = viewer._readings._board.content
        for heading in ("Joints, left", "Joints, right", "Gripper, right", "Tool centre point, left"):
            assert heading in told
        assert told.index("nothing") < told.index("green_cube"), "the left hand is empty, the right one is not"
    finally:
        viewer.server.stop()


def test_arms_that_touch_count_as_a_contact_that_nobody_means(cell: EmbeddedWorkcell) -> None:
    monitor = ContactMonitor(cell.mujoco, cell.agent.skills)
    go(cell, "right", over(0.15, 0.2, 0.2))
    assert not monitor.touched
    cell.ctx.work_with("left")
    motion = DLSMotionPlanner()
    motion.use(cell.ctx.planning(cell.ctx.look()), cell.ctx.arm.state())
    q = cell.ctx.arm.state().q
    goal = motion.ik(over(0.15, 0.25, 0.2), q)
    with pytest.raises(LimitError, match=r"presses on right/"):
        cell.ctx.arm.follow(Trajectory(q=np.linspace(q, goal, 300), dt=0.01))
    assert any("left/" in one and "right/" in one for one in monitor.touched), monitor.touched
