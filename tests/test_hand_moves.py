"""The hand by itself: poses, ways, joints, the gripper's width and force, waiting."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from math import pi
from pathlib import Path

import numpy as np
import pytest
from support.models import wheel_files
from support.written_arms import written

import robosandbox
from robosandbox import Pose, Scene, SceneObject, Workcell
from robosandbox.errors import (
    CancelledError,
    CollisionError,
    GoalTimeoutError,
    GraspError,
    InvalidArgumentError,
    NotHoldingError,
    UnreachableError,
    UnsupportedError,
)
from robosandbox.sim.intervention import Intervention
from robosandbox.skills.events import SkillStarted
from robosandbox.types import Plan, SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.world.relations import contents


@pytest.fixture
def cell() -> Iterator[EmbeddedWorkcell]:
    with robosandbox.open_session(task="pick_from_three") as opened:
        yield opened


def tcp(cell: EmbeddedWorkcell) -> tuple[np.ndarray, np.ndarray]:
    pose = cell.driver.arms["arm"].state().tcp_pose
    return pose.position, pose.rotation


@pytest.mark.parametrize("tilt, towards", [(0.0, 0.0), (0.6, 1.0), (pi / 2.0, 0.0), (pi / 2.0, -0.7)])
def test_the_hand_points_where_it_is_told_to(cell: EmbeddedWorkcell, tilt: float, towards: float) -> None:
    cell.do("move_to", x=0.3, y=0.1, z=0.3, tilt=tilt, towards=towards)
    position, rotation = tcp(cell)
    pointing = np.array([np.sin(tilt) * np.cos(towards), np.sin(tilt) * np.sin(towards), -np.cos(tilt)])
    assert np.linalg.norm(position - [0.3, 0.1, 0.3]) < 0.002
    assert np.degrees(np.arccos(min(1.0, float(rotation[:, 2] @ pointing)))) < 1.0


def test_the_fingers_close_along_the_heading(cell: EmbeddedWorkcell) -> None:
    cell.do("move_to", x=0.3, y=0.0, z=0.3, heading=0.4)
    assert abs(tcp(cell)[1][:, 1] @ [np.cos(0.4), np.sin(0.4), 0.0]) > np.cos(np.radians(1.0))


def test_a_way_is_straight_and_does_not_turn_the_hand(cell: EmbeddedWorkcell) -> None:
    cell.do("move_to", x=0.2, y=0.1, z=0.3)
    start, rotation = tcp(cell)
    path: list[np.ndarray] = []
    end_of_listening = cell.driver.subscribe(lambda: path.append(tcp(cell)[0]))
    cell.do("move_by", dy=-0.2, dz=0.05)
    end_of_listening()
    end, turned = tcp(cell)
    assert np.linalg.norm(end - start - [0.0, -0.2, 0.05]) < 0.002
    assert np.trace(rotation.T @ turned) > 2.999
    along = (end - start) / np.linalg.norm(end - start)
    assert max(np.linalg.norm(np.cross(point - start, along)) for point in path) < 0.003


def test_a_way_down_ends_on_the_table_and_leaves_it_again(cell: EmbeddedWorkcell) -> None:
    cell.do("move_to", x=0.4, y=-0.1, z=0.12)
    cell.do("close_gripper")
    done = cell.do("move_by", dz=-0.2, until_force=2.0)
    assert done.detail["touched"] is True and 2.0 <= float(done.detail["force_n"]) < 30.0
    assert any("table" in pair for pair in cell.driver.senses.contacts())
    cell.do("move_by", dz=0.05)
    assert not cell.driver.senses.contacts()


def test_a_way_that_ends_before_anything_is_felt_says_so(cell: EmbeddedWorkcell) -> None:
    cell.do("move_to", x=0.3, y=-0.1, z=0.3)
    assert cell.do("move_by", dz=-0.02, until_force=1.0).detail["touched"] is False


def test_joints_go_where_they_are_sent_or_are_named(cell: EmbeddedWorkcell) -> None:
    q = (0.3, 0.1, 0.2, -1.5, 0.0, 1.6, 0.7)
    cell.do("move_joints", q=q)
    assert np.abs(cell.driver.arms["arm"].state().q - q).max() < 0.005
    with pytest.raises(InvalidArgumentError, match="joint4 goes from"):
        cell.do("move_joints", q=(0.0, 0.1, 0.2, 3.0, 0.0, 1.5, 0.7))
    with pytest.raises(InvalidArgumentError, match="7 joints"):
        cell.do("move_joints", q=(0.0, 0.1))


def test_what_is_held_stays_held(cell: EmbeddedWorkcell) -> None:
    cell.pick("red_cube")
    cell.do("move_to", x=0.25, y=0.15, z=0.35)
    cell.do("move_by", dz=0.1)
    cell.do("move_joints", q=tuple(cell.driver.arms["arm"].spec.home_q))
    assert cell.observe().held == "red_cube"


@pytest.mark.parametrize("force", [5.0, 10.0, 20.0])
def test_a_grip_presses_as_hard_as_asked(cell: EmbeddedWorkcell, force: float) -> None:
    cell.pick("red_cube")
    assert cell.do("close_gripper", force=force).detail["held"] == "red_cube"
    cell.do("wait", seconds=0.5)
    assert cell.driver.hands["hand"].grip_on("red_cube") == pytest.approx(force, rel=0.1)


def test_a_grip_on_what_is_held_reaches_its_force_or_tells(cell: EmbeddedWorkcell) -> None:
    cell.pick("red_cube")
    with pytest.raises(GraspError, match=r"presses with .* N, and was to press with 190.0 N"):
        cell.do("close_gripper", force=190.0)


def test_fingers_with_a_servo_each_do_not_slide_with_what_they_hold() -> None:
    """They push alike, so that its weight had both go 4 mm to a side in 10 s."""
    model = wheel_files("inspect-robots-yam==0.37.0") / "inspect_robots_yam/assets/yam_collision.xml"
    cube = SceneObject(id="cube", kind="box", size=(0.012,) * 3, pose=Pose(xyz=(0.05, 0.0, 0.0525)), mass=0.1)
    with robosandbox.open_session(task=Scene(objects=(cube,)), robot=str(model), what_if=False) as yam:
        yam.pick("cube")
        yam.do("move_to", x=0.05, y=0.0, z=0.25, heading=0.0, tilt=1.0, towards=0.0)

        def in_hand() -> np.ndarray:
            hand = yam.driver.state().tcp_pose
            return hand.rotation.T @ (yam.truth().objects["cube"].pose.position - hand.position)

        before = in_hand()
        yam.do("wait", seconds=5.0)
        assert in_hand() == pytest.approx(before, abs=1e-4)


@pytest.mark.parametrize("joint", [1, -1])
def test_a_joint_turns_to_the_left_as_seen_from_above(cell: EmbeddedWorkcell, joint: int) -> None:
    before = cell.driver.state().tcp_pose.rotation
    cell.do("move_joint", joint=joint, turn=0.3)
    turned = cell.driver.state().tcp_pose.rotation @ before.T
    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(0.3, abs=0.01)


def test_a_joint_that_lies_turns_to_no_side(cell: EmbeddedWorkcell) -> None:
    with pytest.raises(InvalidArgumentError, match="does not turn about the vertical"):
        cell.do("move_joint", joint=4, turn=0.3)


def test_the_gripper_opens_to_a_width(cell: EmbeddedWorkcell) -> None:
    assert float(cell.do("open_gripper", width=0.03).detail["width_mm"]) == pytest.approx(30.0, abs=0.5)
    with pytest.raises(InvalidArgumentError, match="opens to 80 mm"):
        cell.do("open_gripper", width=0.2)


def test_waiting_takes_as_long_as_it_says(cell: EmbeddedWorkcell) -> None:
    before = cell.driver.time
    cell.do("wait", seconds=2.5)
    assert cell.driver.time - before == pytest.approx(2.5, abs=cell.driver.control_timestep)


def test_a_wait_is_counted_from_the_start_of_a_call_before(cell: EmbeddedWorkcell) -> None:
    before = cell.driver.time
    cell.do("move_by", dz=0.02)
    cell.do("move_by", dz=0.02)
    cell.do("wait", seconds=3.0, since=2)
    assert cell.driver.time - before == pytest.approx(3.0, abs=cell.driver.control_timestep)
    # What is over is not waited for.
    now = cell.driver.time
    cell.do("wait", seconds=3.0, since=3)
    assert cell.driver.time == now


def test_what_is_done_every_few_seconds_begins_as_often(cell: EmbeddedWorkcell) -> None:
    begins: list[float] = []
    cell.ctx.events.subscribe(
        lambda told: (
            begins.append(cell.driver.time) if isinstance(told, SkillStarted) and told.call.skill == "move_by" else None
        )
    )
    assert cell.run("every 2 seconds go up 1 cm, four times").success
    assert np.diff(begins) == pytest.approx([2.0] * 3, abs=cell.driver.control_timestep)


def test_a_wait_ends_with_a_cancel_and_with_its_deadline(cell: EmbeddedWorkcell) -> None:
    end_of_listening = cell.driver.subscribe(lambda: cell.ctx.cancel() if cell.driver.time > 1.0 else None)
    with pytest.raises(CancelledError):
        cell.do("wait", seconds=60.0)
    assert cell.driver.time < 1.1
    end_of_listening()
    with pytest.raises(GoalTimeoutError):
        cell.do("wait", seconds=60.0, timeout=2.0)


@pytest.mark.parametrize(
    "move, arguments, error",
    [
        ("move_to", {"x": 2.0, "y": 0.0, "z": 0.3}, UnreachableError),
        ("move_to", {"x": 0.3, "y": 0.0, "z": 0.02}, CollisionError),
        ("move_by", {"dz": -0.5}, (CollisionError, UnreachableError)),
        ("move_to", {"x": 0.3, "y": 0.0, "z": 0.3, "tilt": -1.0}, InvalidArgumentError),
        ("wait", {"seconds": 0.0}, InvalidArgumentError),
        ("wait", {"seconds": float("nan")}, InvalidArgumentError),
    ],
)
def test_a_move_that_cannot_be_is_refused_before_anything_moves(
    cell: EmbeddedWorkcell, move: str, arguments: dict[str, float], error: type[Exception]
) -> None:
    before = cell.driver.arms["arm"].state().q
    with pytest.raises(error):
        cell.do(move, **arguments)
    assert np.abs(cell.driver.arms["arm"].state().q - before).max() < 1e-3


def test_moves_can_be_said_as_calls(cell: Workcell) -> None:
    episode = cell.run("move_by(dz=0.05), wait(seconds=0.5), move_joints(q=[0, 0.1, 0.2, -1.5, 0, 1.5, 0.7])")
    assert episode.success, episode


def test_what_is_lost_on_the_way_is_said(cell: EmbeddedWorkcell) -> None:
    cell.pick("red_cube")

    def open_up() -> None:
        if cell.driver.time > began + 0.3:
            cell.driver.hands["hand"].set_gripper(0.0)

    began = cell.driver.time
    cell.driver.subscribe(open_up)
    with pytest.raises(NotHoldingError, match="red_cube is out of the hand"):
        cell.do("move_to", x=0.1, y=0.3, z=0.3)


def test_several_points_are_passed_without_a_stop(cell: EmbeddedWorkcell) -> None:
    cell.do("move_to", x=0.2, y=0.1, z=0.3)
    path: list[np.ndarray] = []
    end_of_listening = cell.driver.subscribe(lambda: path.append(tcp(cell)[0]))
    cell.do("move_through", points=(0.2, -0.1, 0.3, 0.2, -0.1, 0.4, 0.2, 0.1, 0.4))
    end_of_listening()
    assert np.linalg.norm(tcp(cell)[0] - [0.2, 0.1, 0.4]) < 0.002
    for corner in ([0.2, -0.1, 0.3], [0.2, -0.1, 0.4]):
        assert min(np.linalg.norm(point - corner) for point in path) < 0.005
    with pytest.raises(InvalidArgumentError, match="2 numbers"):
        cell.do("move_through", points=(0.2, 0.1))


def test_a_pose_is_found_again_by_its_name_also_on_the_twin(cell: EmbeddedWorkcell) -> None:
    cell.do("move_to", x=0.3, y=0.2, z=0.3)
    saved = cell.driver.arms["arm"].state().q
    cell.do("save_pose", pose="camera")
    cell.do("move_to_pose", pose="home")
    episode = cell.run("move_to_pose(pose=camera)")
    assert episode.success and np.abs(cell.driver.arms["arm"].state().q - saved).max() < 0.005
    foreseen = cell.simulate(Plan(steps=(SkillCall(skill="move_to_pose", arguments={"pose": "camera"}),)))
    assert "would_fail" not in foreseen or foreseen["would_fail"] is None, foreseen
    with pytest.raises(InvalidArgumentError, match="camera, home"):
        cell.do("move_to_pose", pose="camra")
    with pytest.raises(InvalidArgumentError, match="home"):
        cell.do("save_pose", pose="home")


def test_a_tempo_counts_for_what_follows(cell: EmbeddedWorkcell) -> None:
    def seconds(tempo: str) -> float:
        cell.do("set_tempo", tempo=tempo)
        cell.do("move_to_pose", pose="home")
        began = cell.driver.time
        cell.do("move_to", x=0.3, y=0.2, z=0.3)
        return cell.driver.time - began

    careful, fast = seconds("careful"), seconds("fast")
    assert careful > 1.2 * fast
    with pytest.raises(InvalidArgumentError, match="tempo"):
        cell.do("set_tempo", tempo="wild")


def test_what_lies_in_what_is_held_does_not_fall_out() -> None:
    with robosandbox.open_session(task="pour_beads") as cell:
        vessel = next(item.id for item in cell.task.scene.objects if item.kind == "cup")
        cell.pick(vessel)
        full = len(contents(cell.observe().objects, cell.observe().find(vessel)))
        cell.do("move_by", dx=0.02, dy=0.05, dz=-0.02)
        # It hangs from a leaning hand: one that points elsewhere would tip it.
        for tilt in (0.0, 1.2):
            with pytest.raises((UnreachableError, UnsupportedError)):
                cell.do("move_to", x=0.25, y=0.2, z=0.35, tilt=tilt, towards=3.0)
        assert full and len(contents(cell.observe().objects, cell.observe().find(vessel))) == full


@pytest.mark.parametrize("force", [2.0, 5.0, 20.0])
def test_open_fingers_close_on_a_thing_with_the_force_that_is_asked_for(force: float) -> None:
    with robosandbox.open_session("pick_from_three", what_if=False) as session:
        session.do("move_over", object="red_cube")
        session.do("open_gripper")
        down = session.truth().objects["red_cube"].pose.xyz[2] - session.state().tcp_pose.xyz[2]
        session.do("move_by", dz=down)
        squeezed = session.do("close_gripper", force=force).detail
        assert squeezed["held"] == "red_cube" and squeezed["force_n"] == pytest.approx(force, rel=0.1)


def from_shoulder(cell: EmbeddedWorkcell) -> float:
    world = cell.mujoco.world
    joint = int(world.model.dof_jntid[world.robot.dof_indices[1]])
    with Intervention(cell.mujoco).state() as data:
        return float(np.linalg.norm(data.xanchor[joint] - tcp(cell)[0]))


@pytest.mark.parametrize("name, elbow", [("panda", 3), ("so101", 2), ("ur5e", 2)])
def test_an_elbow_that_is_bent_brings_the_hand_nearer_to_the_shoulder(tmp_path: Path, name: str, elbow: int) -> None:
    model, sidecar = (None, None) if name == "panda" else written(name, tmp_path)
    with robosandbox.open_session(robot=model, sidecar=sidecar) as cell:
        before, far = cell.driver.arms["arm"].state(), from_shoulder(cell)
        cell.do("move_joint", joint="elbow", bend=0.15)
        assert from_shoulder(cell) < far - 0.005
        turned = cell.driver.arms["arm"].state().q - before.q
        assert abs(turned[elbow]) == pytest.approx(0.15, abs=0.01)
        assert np.abs(np.delete(turned, elbow)).max() < 0.01
        cell.do("move_joint", joint="elbow", bend=-0.15)
        assert np.abs(cell.driver.arms["arm"].state().q - before.q).max() < 0.01


def test_the_hand_points_forward_from_any_tilt(cell: EmbeddedWorkcell) -> None:
    cell.do("turn_hand", tilt=0.3)
    cell.do("turn_hand", upright=True, tilt=pi / 2.0)
    _, rotation = tcp(cell)
    assert abs(float(rotation[2, 2])) < 0.02
    assert float(rotation[0, 2]) > 0.9


def test_a_hand_that_goes_to_just_over_the_table_does_not_knock_on_it(cell: EmbeddedWorkcell) -> None:
    # Its servos swing out by more than the millimetre that plans keep off: at full speed a finger knocks with 126 N.
    cell.do("move_joints", q=(0.32545, 0.626473, 0.094586, -1.619651, -0.069407, 2.238566, -0.34106))
    felt = [0.0]
    cell.driver.subscribe(lambda: felt.append(cell.driver.senses.strongest_contact("arm")[0]))
    for down in np.arange(0.107, 0.1, -0.0001):
        with suppress(CollisionError):
            cell.do("move_by", dx=-0.060666, dy=0.039724, dz=-float(down))
            break
    assert 0.1 < down < 0.107, "as low as it may go"
    assert max(felt) == 0.0


def test_a_line_begins_where_it_is_told_to(cell: EmbeddedWorkcell) -> None:
    way: list[np.ndarray] = []
    cell.driver.subscribe(lambda: way.append(tcp(cell)[0]))
    assert cell.run("go in a straight line from (0.2, 0.15, 0.3) to (0.2, -0.15, 0.3)").success
    assert np.linalg.norm(way[-1] - [0.2, -0.15, 0.3]) < 0.002
    begun = next(k for k, point in enumerate(way) if np.linalg.norm(point - [0.2, 0.15, 0.3]) < 0.002)
    line = np.array(way[begun:])
    assert np.abs(line[:, [0, 2]] - [0.2, 0.3]).max() < 0.003 and np.ptp(line[:, 1]) > 0.29


def test_what_slips_out_while_it_is_carried_is_not_put_down(cell: EmbeddedWorkcell) -> None:
    cell.pick("red_cube")
    began = cell.driver.time

    def open_on_the_way() -> None:
        if cell.driver.time > began + 0.3:
            cell.driver.hands["hand"].set_gripper(0.0)

    cell.driver.subscribe(open_on_the_way)
    with pytest.raises(NotHoldingError, match=r"red_cube is out of the hand: the gripper is empty, and it is at \("):
        cell.do("place_at", x=0.25, y=-0.3)
    # The hand has not gone on down to where it would have let go.
    assert tcp(cell)[0][2] > 0.05


def test_what_slides_in_the_hand_while_it_is_carried_is_put_down_as_it_sits(cell: EmbeddedWorkcell) -> None:
    cell.pick("red_cube")
    sim, began = cell.mujoco, cell.driver.time
    height = int(sim.model.jnt_qposadr[sim.model.body_jntadr[sim.world.object_bodies["red_cube"]]]) + 2
    slid: list[float] = []
    pressed: list[float] = []

    def slide() -> None:
        if not slid and cell.driver.time > began + 0.3:
            sim._live.qpos[height] -= 0.006
            slid.append(cell.driver.time)
        pressed.append(float(np.linalg.norm(sim.force_on("red_cube"))))

    cell.driver.subscribe(slide)
    cell.do("place_at", x=0.25, y=-0.3)
    assert slid
    # As it sat before it would be pressed into the table by 6 mm: 40 N.
    assert max(pressed) < 10.0
