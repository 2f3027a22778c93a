"""The hand by words: what is said comes out as calls, what they do is judged on the simulated state, and what is left out is asked for."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.processes import SimProcess

from robosandbox.agent.episode import Planned
from robosandbox.agent.planner import StubPlanner
from robosandbox.apps.conformance.conformance import check_words
from robosandbox.errors import CollisionError, ConnectionLostError, NotHoldingError, PlacementError, TrackingError
from robosandbox.sim.intervention import Intervention
from robosandbox.skills.base import Skill
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.events import PhaseEntered
from robosandbox.skills.manual import MANUAL
from robosandbox.skills.primitives.hand_move import Mover
from robosandbox.skills.set_tempo import SetTempo
from robosandbox.skills.words import Slot, Words
from robosandbox.types import Plan, Pose, Refusal, RefusalCode, Scene, SceneObject, SkillResult
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.workcell.zenoh.client import connect
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

TASK = "pick_from_three"
STOVE = Path(__file__).parents[1] / "examples" / "scenes" / "stove.xml"
PAGE = Path(__file__).parents[1] / "docs" / "hand.md"


@pytest.fixture(scope="module")
def still() -> Iterator[EmbeddedWorkcell]:
    """A world that no test moves."""
    with open_session(TASK, what_if=False) as session:
        yield session


@pytest.fixture
def cell() -> Iterator[EmbeddedWorkcell]:
    with open_session(TASK, what_if=False) as session:
        yield session


def planned(cell: EmbeddedWorkcell, said: str) -> str:
    answer = cell.agent.plan(said)
    return ", ".join(map(str, answer.steps)) if isinstance(answer, Plan) else f"{answer.code.value}: {answer.message}"


@pytest.mark.parametrize(
    ("said", "calls"), re.findall(r"^\| ([^`|]+) \| `([^`]+)` \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
)
def test_what_is_said_of_the_hand_comes_out_as_calls(still: EmbeddedWorkcell, said: str, calls: str) -> None:
    answer = still.agent.plan(said)
    assert isinstance(answer, Plan), answer
    told = [(step.skill, step.arguments) for step in answer.steps]
    wanted = [(step.skill, step.arguments) for step in written(still, calls)]
    assert told == wanted


def written(cell: EmbeddedWorkcell, calls: str) -> tuple[object, ...]:
    answer = cell.agent.plan(calls)
    assert isinstance(answer, Plan), answer
    return answer.steps


@pytest.mark.parametrize(
    ("said", "code", "asked"),
    [
        ("raise your hand", RefusalCode.AMBIGUOUS, "how far"),
        ("move over", RefusalCode.AMBIGUOUS, "where to"),
        (
            "go from (0.4, 0, 0.3), from (0.4, 0.1, 0.3) to (0.5, 0.1, 0.3)",
            RefusalCode.AMBIGUOUS,
            "two things for from",
        ),
        # What would not be as it was told, and words that say more than was understood.
        ("go up 5 cm at constant height", RefusalCode.IMPOSSIBLE, "at one height"),
        ("go left 5 cm, straight up", RefusalCode.IMPOSSIBLE, "straight up"),
        ("lift the red cube 5 cm without turning the hand", RefusalCode.IMPOSSIBLE, "without a turn of the hand"),
        (
            "rotate joint 1 by 20 degrees and go up 5 cm, other joints stay still",
            RefusalCode.IMPOSSIBLE,
            "other joints",
        ),
        ("close the gripper and end up open", RefusalCode.IMPOSSIBLE, "open in the end"),
        ("go up 5 cm, higher", RefusalCode.UNRECOGNIZED, "higher"),
        ("go up 5 cm, move left 3 cm, go back up", RefusalCode.UNRECOGNIZED, "Back up to where"),
        ("hover over the red cube, go left 5 cm, come back down", RefusalCode.UNRECOGNIZED, "Back down to where"),
        ("open the gripper to 5 cm, less", RefusalCode.UNRECOGNIZED, ""),
        ("push the red cube with the tool", RefusalCode.OBJECT_NOT_FOUND, "tool"),
        ("juggle the cubes", RefusalCode.UNSUPPORTED, "juggle"),
        # What is left out, or likened, may bind: none of these is half done.
        ("open halfway, then the rest", RefusalCode.UNRECOGNIZED, ""),
        ("shuffle the cubes", RefusalCode.UNRECOGNIZED, ""),
        ("move up 5 cm, look down", RefusalCode.UNRECOGNIZED, "look"),
        ("put the red cube on the blue one like before", RefusalCode.UNRECOGNIZED, "like before"),
        ("pick up the red cube like you did with the green one", RefusalCode.UNRECOGNIZED, ""),
        ("turn the hand 30 degrees clockwise, then 20 degrees in the same direction", RefusalCode.UNRECOGNIZED, ""),
        ("where is the red cube? I want the blue one on it", RefusalCode.UNSUPPORTED, ""),
        ("pick up the red cube three times", RefusalCode.UNRECOGNIZED, "three times"),
        ("open the gripper 100 times", RefusalCode.UNSUPPORTED, ""),
        ("pick up the red cube and put it back, again and again", RefusalCode.AMBIGUOUS, "how often"),
        ("tap the red cube repeatedly", RefusalCode.AMBIGUOUS, "“repeatedly”: how often"),
        ("put the red cube on the blue cube and turn the hand by 9 degrees three times", RefusalCode.UNRECOGNIZED, ""),
        ("hover over the moon", RefusalCode.OBJECT_NOT_FOUND, "moon"),
        ("don't move up 5 cm", RefusalCode.UNSUPPORTED, ""),
    ],
)
def test_what_is_left_out_or_unknown_is_asked_for(
    still: EmbeddedWorkcell, said: str, code: RefusalCode, asked: str
) -> None:
    answer = still.agent.plan(said)
    assert isinstance(answer, Refusal) and answer.code is code and asked in answer.message, answer


def test_things_are_moved_as_before(still: EmbeddedWorkcell) -> None:
    assert planned(still, "move the red cube 5 cm to the left").startswith("push(object=red_cube")
    assert planned(still, "lower the red cube onto the blue one").startswith("pick(object=red_cube)")
    assert planned(still, "hold the red cube") == "pick(object=red_cube)"


def test_it_that_is_not_to_be_lifted_is_what_the_sentence_is_about(still: EmbeddedWorkcell) -> None:
    assert planned(still, "point at the green cube") == "point_at(object=green_cube)"
    answer = still.agent.plan("weigh the red cube but don't lift it")
    assert isinstance(answer, Refusal) and answer.code is RefusalCode.IMPOSSIBLE, answer


def test_what_is_done_later_waits_before_it(still: EmbeddedWorkcell) -> None:
    for said in (
        "close your hand ten seconds later",
        "close your hand after ten seconds",
        "in ten seconds, close your hand",
    ):
        assert planned(still, said) == "wait(seconds=10.0), close_gripper()"


def test_what_is_picked_up_to_be_turned_is_turned_where_it_stands(still: EmbeddedWorkcell) -> None:
    turned = "turn(object=red_cube, angle=1.570796)"
    assert planned(still, "grab the red cube, turn it a quarter turn and set it down in the same place") == turned
    assert planned(still, "pick up the red cube, turn it a quarter turn and put it on the blue cube") == (
        f"{turned}, pick(object=red_cube), place_on(target=blue_cube)"
    )
    answer = still.agent.plan("pick up the red cube, turn it a quarter turn and put down the blue cube")
    assert isinstance(answer, Refusal) and answer.code is RefusalCode.IMPOSSIBLE, answer


def test_a_pace_counts_from_the_first_word_on(still: EmbeddedWorkcell) -> None:
    for said, tempo in (
        ("Slowly move up 5 cm.", "careful"),
        ("Go slowly up 5 cm", "careful"),
        ("As fast as you safely can, move up 5 cm", "fast"),
        ("move up 5 cm", ""),
    ):
        answer = still.agent.plan(said)
        assert isinstance(answer, Plan)
        assert (answer.tempo, [step.skill for step in answer.steps]) == (tempo, ["move_by"])
    for said, tempo in (
        ("from now on work at half speed", "brisk"),
        ("go slowly, please", "careful"),
        ("move at your normal speed", "fast"),
        ("go back to full speed", "fast"),
    ):
        assert planned(still, said) == f"set_tempo(tempo={tempo})"
    answer = still.agent.plan("from now on tap the red cube")
    assert isinstance(answer, Refusal) and "from now on" in answer.message, answer


def test_what_is_pushed_against_a_thing_meets_it(still: EmbeddedWorkcell) -> None:
    pushed = "push(object=red_cube, direction=left, distance=0.29)"
    assert planned(still, "push the red cube until it makes contact with the blue cube, then stop") == pushed
    for said in ("push the red cube until it touches the green cube", "push the red cube against the green cube"):
        # It would pass 5 cm beside.
        answer = still.agent.plan(said)
        assert isinstance(answer, Refusal) and "neither straight ahead nor straight to a side" in answer.message, answer


@pytest.mark.parametrize(
    ("said", "how"),
    [
        ("pick up the red cube with your fingers closed", "with closed fingers"),
        ("move up 5 cm but keep the fingertips where they are", "with the fingertips in place"),
    ],
)
def test_how_the_fingers_are_to_be_is_kept_or_refused(still: EmbeddedWorkcell, said: str, how: str) -> None:
    answer = still.agent.plan(said)
    assert isinstance(answer, Refusal) and answer.message.startswith(f"You asked for it {how}, and "), answer


def test_a_planner_without_moves_knows_none(still: EmbeddedWorkcell) -> None:
    answer = StubPlanner(still.skills).plan("move up 5 cm", still.observe())
    assert isinstance(answer, Refusal)


def test_the_hand_does_what_it_is_told(cell: EmbeddedWorkcell) -> None:
    before = cell.state().tcp_pose.position
    assert cell.run("move up 5 cm and 3 cm to the left, then wait 2 seconds").success
    assert np.allclose(cell.state().tcp_pose.position - before, [0.0, 0.03, 0.05], atol=0.002)
    assert cell.driver.time > 2.0
    assert cell.run("call this pose camera").success
    assert cell.run("point at the red cube").success
    pose, at = cell.state().tcp_pose, cell.truth().objects["red_cube"].pose
    line = at.position - pose.position
    assert pose.rotation[:, 2] @ line / np.linalg.norm(line) > np.cos(np.radians(3.0))
    cube = cell.truth().objects["blue_cube"].pose.position
    assert cell.run("bring the hand in front of the blue cube").success
    assert np.allclose(cell.state().tcp_pose.position, cube + [-0.115, 0.0, 0.015], atol=0.003)
    saved = cell.run("go to the pose camera")
    assert saved.success and np.allclose(
        cell.state().tcp_pose.position, before + np.array([0.0, 0.03, 0.05]), atol=0.002
    )
    assert cell.run("go down until you are 15 cm above the table").success
    assert cell.state().tcp_pose.xyz[2] - cell.observe().table_height == pytest.approx(0.15, abs=0.002)
    assert cell.run("open the gripper to 4 cm").success
    assert cell.state().gripper.width == pytest.approx(0.04, abs=0.001)
    assert cell.run("open the gripper to 75 %").success
    assert cell.state().gripper.width == pytest.approx(0.06, abs=0.001)


def test_what_is_held_is_held_over_a_thing_shaken_and_weighed(cell: EmbeddedWorkcell) -> None:
    assert cell.run("pick up the red cube and hold it 6 cm over the blue cube").success
    where = {name: item.pose.position for name, item in cell.truth().objects.items()}
    assert np.allclose(where["red_cube"][:2], where["blue_cube"][:2], atol=0.003)
    # Between the faces of two cubes of 30 mm.
    assert where["red_cube"][2] - where["blue_cube"][2] - 0.03 == pytest.approx(0.06, abs=0.004)
    weighed = cell.run("weigh it")
    mass = next(item.mass for item in cell.task.scene.objects if item.id == "red_cube")
    assert weighed.success and weighed.steps[-1].result.detail["mass_kg"] == pytest.approx(mass, rel=0.05)
    assert cell.run("shake it twice").success and cell.observe().held == "red_cube"
    assert not cell.run("open the gripper").success, "it would fall"


def test_the_hand_feels_its_way_down_turns_and_lifts_by_so_much(cell: EmbeddedWorkcell) -> None:
    felt = cell.run("hover over the green cube, then go down until you touch something")
    assert felt.success and felt.steps[-1].result.detail["touched"]
    assert felt.steps[-1].result.detail["force_n"] < 40.0
    assert cell.run("raise your hand 10 cm").success
    before = cell.state().tcp_pose
    assert cell.run("rotate the gripper by 90 degrees clockwise").success
    after = cell.state().tcp_pose
    turned = before.rotation[:, 1] @ after.rotation[:, 1]
    assert abs(turned) < np.sin(np.radians(1.0)) and np.allclose(after.position, before.position, atol=0.002)
    assert cell.run("tilt your hand 20 degrees").success
    tilted = cell.state().tcp_pose.rotation[:, 2]
    assert np.degrees(np.arccos(-tilted[2])) == pytest.approx(20.0, abs=0.5)
    assert tilted[:2] @ (after.position[:2] - np.array(cell.observe().base_xy)) > 0.0, "the tips go away from the base"
    joint = cell.state().q[0]
    assert cell.run("move joint 1 by 10 degrees").success
    assert cell.state().q[0] - joint == pytest.approx(np.radians(10.0), abs=0.003)
    stood = cell.truth().objects["red_cube"].pose.xyz[2]
    assert cell.run("lift the red cube by 5 cm").success
    assert cell.truth().objects["red_cube"].pose.xyz[2] - stood == pytest.approx(0.05, abs=0.001)
    assert cell.run("lower it 3 cm").success
    assert cell.truth().objects["red_cube"].pose.xyz[2] - stood == pytest.approx(0.02, abs=0.001)
    assert cell.run("lift it by 4 cm").success, "what is held is not picked up once more"
    assert cell.truth().objects["red_cube"].pose.xyz[2] - stood == pytest.approx(0.06, abs=0.001)
    assert cell.run("point at the blue cube").success and cell.observe().held == "red_cube"
    squeezed = cell.run("squeeze it with 10 N")
    assert squeezed.success and squeezed.steps[-1].result.detail["force_n"] == pytest.approx(10.0, rel=0.1)


def test_what_still_stands_is_not_weighed(cell: EmbeddedWorkcell) -> None:
    cell.do("move_over", object="red_cube")
    cell.do("open_gripper")
    cell.do("move_by", dz=cell.truth().objects["red_cube"].pose.xyz[2] - cell.state().tcp_pose.xyz[2])
    cell.do("close_gripper")
    with pytest.raises(NotHoldingError, match="still stands on something"):
        cell.do("weigh", object="red_cube")


def test_what_was_lifted_by_so_much_is_put_down_like_what_was_picked(cell: EmbeddedWorkcell) -> None:
    assert cell.run("lift the red cube by 5 cm and put it on the blue cube").success
    where = {name: item.pose.position for name, item in cell.truth().objects.items()}
    assert where["red_cube"][2] - where["blue_cube"][2] == pytest.approx(0.03, abs=0.002)


def test_what_is_held_out_is_let_go_of_when_it_is_pulled_at(cell: EmbeddedWorkcell) -> None:
    assert cell.run("pick up the red cube").success
    waits, hand, body = [], Intervention(cell.mujoco), cell.mujoco.object_bodies["red_cube"]
    leave = cell.ctx.events.subscribe(
        lambda told: waits.append(cell.driver.time) if isinstance(told, PhaseEntered) and told.phase == "wait" else None
    )

    def pull() -> None:
        # One second after it is held out, for as long as it is in the hand.
        with hand.state() as data:
            data.xfrc_applied[body, 0] = 5.0 if waits and cell.driver.time > waits[-1] + 1.0 else 0.0

    end = cell.driver.subscribe(pull)
    given = cell.run("give it to me")
    end()
    leave()
    assert given.success, given.final_detail
    detail = given.steps[-1].result.detail
    assert 4.0 < detail["pulled_n"] < 6.0 and 0.3 < detail["waited_s"] < 0.7
    assert cell.observe().held is None


def test_what_nobody_takes_stays_in_the_hand(cell: EmbeddedWorkcell) -> None:
    given = cell.run("hand me the red cube")
    assert not given.success and "nobody pulled at red_cube with 3 N within 20 s" in given.final_detail
    assert cell.observe().held == "red_cube"


def test_what_is_dropped_falls_from_where_it_was_said(cell: EmbeddedWorkcell) -> None:
    fallen = cell.run("drop the red cube from 8 cm")
    assert fallen.success and fallen.steps[-1].result.detail["fell_mm"] == pytest.approx(80.0, abs=4.0)
    assert cell.observe().held is None


def test_figures_are_drawn_where_they_were_said(cell: EmbeddedWorkcell) -> None:
    begun = cell.state().tcp_pose.position
    way: list[np.ndarray] = []
    end = cell.driver.subscribe(lambda: way.append(cell.state().tcp_pose.position))
    assert cell.run("draw a circle of 12 cm with your hand").success
    end()
    off = np.linalg.norm(np.array(way) - (begun + np.array([0.0, 0.06, 0.0])), axis=1) - 0.06
    assert np.abs(off).max() < 0.002 and np.allclose(cell.state().tcp_pose.position, begun, atol=0.002)
    assert np.ptp([point[0] for point in way]) > 0.118
    way.clear()
    end = cell.driver.subscribe(lambda: way.append(cell.state().tcp_pose.position))
    assert cell.run("trace a square of 6 cm").success
    end()
    assert np.allclose(np.ptp(np.array(way), axis=0), [0.06, 0.06, 0.0], atol=0.005), "corners"
    way.clear()
    end = cell.driver.subscribe(lambda: way.append(cell.state().tcp_pose.position))
    assert cell.run("trace a 6 cm square, flat, 40 cm above the table").success
    end()
    lowered = next(k for k, point in enumerate(way) if abs(point[2] - cell.observe().table_height - 0.4) < 0.002)
    assert np.ptp(np.array(way[:lowered])[:, :2], axis=0).max() < 0.005, "straight down first"
    assert np.allclose(np.ptp(np.array(way[lowered:]), axis=0), [0.06, 0.06, 0.0], atol=0.005)


@pytest.mark.parametrize("driver", ["mujoco", "hardware:wrist_wrench=true"])
def test_a_force_is_pressed_with(driver: str) -> None:
    eyes = "ground_truth" if driver == "mujoco" else "rgbd"
    with open_session(TASK, driver=driver, perception=eyes, what_if=False) as session:
        for force in (5.0, 20.0):
            pressed = session.run(f"press down on the red cube with {force:.0f} N for 2 seconds")
            assert pressed.success, pressed.final_detail
            detail = pressed.steps[-1].result.detail
            assert detail["force_n"] == pytest.approx(force, rel=0.05)
            assert detail["least_n"] > 0.9 * force and detail["most_n"] < 1.1 * force


@pytest.mark.parametrize("driver", ["mujoco", "hardware:wrist_wrench=true"])
def test_what_is_held_is_rubbed_over_the_table(driver: str) -> None:
    eyes = "ground_truth" if driver == "mujoco" else "rgbd"
    with open_session(TASK, driver=driver, perception=eyes, what_if=False) as session:
        others = {item.id: item.pose.position for item in session.observe().objects if item.id != "blue_cube"}
        assert session.run("pick up the blue cube").success
        above = session.state().tcp_pose.position
        way: list[np.ndarray] = []
        session.driver.subscribe(lambda: way.append(session.state().tcp_pose.position - above))
        wiped = session.run("wipe the table with it over 6 cm with 4 newtons")
        assert wiped.success, wiped.final_detail
        detail = wiped.steps[-1].result.detail
        assert detail["force_n"] == pytest.approx(4.0, rel=0.05) and detail["most_n"] < 10.0 and detail["felt"] > 0.95
        low = np.array([point for point in way if point[2] < -0.15])
        assert np.allclose(np.ptp(low[:, :2], axis=0), 0.06, atol=0.004)
        seen = {item.id: item.pose.position for item in session.observe().objects}
        assert session.observe().held == "blue_cube"
        assert all(np.linalg.norm(seen[name] - place) < 0.004 for name, place in others.items())
        hard = session.do("wipe", held="blue_cube", size=0.04, force=20.0).detail
        assert hard["force_n"] == pytest.approx(20.0, rel=0.05) and hard["most_n"] < 45.0, (
            "it does not slide up in the grip"
        )
        assert session.observe().held == "blue_cube"
        begun = session.state().tcp_pose.position
        session.do("move_to", x=0.17, y=0.03, z=float(begun[2]))
        with pytest.raises(CollisionError, match="green_cube"):
            session.do("wipe", held="blue_cube", size=0.1)
        assert np.allclose(session.state().tcp_pose.position, [0.17, 0.03, begun[2]], atol=0.002), "it went nowhere"


def test_the_table_is_wiped_with_what_is_held_and_with_nothing_it_is_asked(cell: EmbeddedWorkcell) -> None:
    asked = cell.plan("wipe the table")
    assert isinstance(asked, Refusal) and asked.code is RefusalCode.AMBIGUOUS and "say with what" in asked.message
    planned = cell.plan("pick up the red cube and wipe the table with 5 N")
    assert isinstance(planned, Plan)
    assert [str(call) for call in planned.steps] == ["pick(object=red_cube)", "wipe(held=red_cube, force=5.0)"]


def test_a_speed_that_no_arm_has_is_refused(still: EmbeddedWorkcell) -> None:
    refused = still.plan("move 30 cm to the left at 20 metres per second")
    assert (
        isinstance(refused, Refusal) and refused.code is RefusalCode.IMPOSSIBLE and "not at 20 m/s" in refused.message
    )
    assert isinstance(still.plan("move 30 cm to the left at 1 metre per second"), Plan)


@pytest.mark.gl
def test_a_picture_of_a_thing_is_taken_from_near_by_and_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with open_session(TASK, what_if=False) as session:
        episode = session.run("take a picture of the blue cube")
        assert episode.success, episode.final_detail
        detail = episode.steps[-1].result.detail
        picture = cv2.imread(str(detail["picture"]))
        assert str(detail["picture"]) in episode.final_detail and Path(str(detail["picture"])).is_relative_to(tmp_path)
        blue = (picture[..., 0] > 120) & (picture[..., 2] < 60)
        seen = np.argwhere(blue).mean(axis=0) / picture.shape[:2]
        assert blue.sum() > 500 and 0.35 < seen[1] < 0.65, "the hand points at it"
        assert detail["camera"] == "wrist" and 0.1 < float(detail["distance_m"]) < 0.4
        others = {item.id for item in session.observe().objects}
        assert others == {"red_cube", "green_cube", "blue_cube"} and session.observe().held is None


def test_a_bowl_is_stirred_with_what_is_held() -> None:
    bowl = SceneObject(id="bowl", kind="bowl", size=(0.045, 0.05), pose=Pose(xyz=(0.15, 0.1, 0.041)), mass=0.3)
    stick = SceneObject(
        id="stick",
        kind="cylinder",
        size=(0.008, 0.07),
        pose=Pose(xyz=(0.12, -0.12, 0.111)),
        mass=0.04,
        rgba=(1, 0, 0, 1),
    )
    thick = SceneObject(id="post", kind="cylinder", size=(0.037, 0.06), pose=Pose(xyz=(0.0, -0.2, 0.101)), mass=0.1)
    with open_session(Scene(objects=(bowl, stick, thick)), what_if=False) as session:
        way: list[np.ndarray] = []
        session.driver.subscribe(lambda: way.append(session.simulation.truth().objects["stick"].pose.position))
        stirred = session.run("stir the bowl with the stick")
        assert stirred.success, stirred.final_detail
        within = np.array([point for point in way if point[2] - 0.07 < 0.09])
        angles = np.unwrap(np.arctan2(within[:, 1] - 0.1, within[:, 0] - 0.15))
        assert abs(angles[-1] - angles[0]) == pytest.approx(3.0 * 2.0 * np.pi, rel=0.05)
        assert np.linalg.norm(session.simulation.truth().objects["bowl"].pose.position[:2] - [0.15, 0.1]) < 0.001
        assert session.observe().held == "stick"
        session.do("place_at", x=0.12, y=-0.12)
        session.pick("post")
        begun = session.driver.time
        with pytest.raises(PlacementError, match="too narrow to stir in with post"):
            session.do("stir", container="bowl", held="post")
        assert session.driver.time == begun


def test_what_is_not_met_is_not_pressed_on(cell: EmbeddedWorkcell, monkeypatch: pytest.MonkeyPatch) -> None:
    cell.do("move_to", x=0.2, y=0.1, z=0.6)
    monkeypatch.setattr(Mover, "come_down_near", lambda arm: None)
    with pytest.raises(TrackingError, match=r"pressed with 0.0 N at the end, not with 5.0 N"):
        cell.do("press_down", force=5.0)


def test_words_of_speed_and_care_are_obeyed_for_the_order_alone(cell: EmbeddedWorkcell) -> None:
    took = {}
    for said, tempo in (("pick up the red cube", ""), ("slowly pick up the red cube", "careful")):
        cell.reset(0)
        begun, tempos = cell.driver.time, []
        leave = cell.driver.subscribe(lambda tempos=tempos: tempos.append(cell.ctx.tempo.name))
        episode = cell.run(said)
        leave()
        assert episode.success and episode.plan is not None and episode.plan.tempo == tempo
        assert set(tempos) == {tempo or "fast"} and cell.ctx.tempo.name == "fast"
        assert [step.call.skill for step in episode.steps] == ["pick"]
        took[said] = cell.driver.time - begun
    assert took["slowly pick up the red cube"] > 1.3 * took["pick up the red cube"]
    assert "At the careful tempo: “slowly”." in str(episode.plan)


def test_the_tempo_is_as_before_after_a_failure(cell: EmbeddedWorkcell) -> None:
    assert cell.run("go half as fast").success
    given = cell.run("carefully hand me the red cube")
    assert not given.success and given.plan is not None and given.plan.tempo == "careful"
    assert cell.ctx.tempo.name == "brisk"


def test_a_tempo_that_cannot_be_set_ends_the_order(cell: EmbeddedWorkcell, monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(self: SetTempo, ctx: object, *, tempo: str) -> SkillResult:
        raise ConnectionLostError("the sim went away", phase="check")

    monkeypatch.setattr(SetTempo, "run", lost)
    episode = cell.run("slowly pick up the red cube")
    assert not episode.success and "the sim went away" in episode.final_detail and not episode.steps


def test_who_stops_a_slow_order_has_the_tempo_of_before(cell: EmbeddedWorkcell) -> None:
    leave = cell.ctx.events.subscribe(lambda told: cell.stop() if isinstance(told, Planned) else None)
    episode = cell.run("slowly pick up the red cube")
    leave()
    assert episode.final_reason == "cancelled" and not episode.steps
    assert cell.ctx.tempo.name == "fast" and cell.observe().held is None


def test_a_manner_that_nothing_takes_is_told(still: EmbeddedWorkcell) -> None:
    answer = still.agent.plan("slowly and precisely pick up the red cube")
    assert isinstance(answer, Plan) and answer.tempo == "careful"
    assert answer.note == "At the careful tempo: “slowly”. No skill takes “precisely”."
    both = still.agent.plan("quickly pick up the red cube and slowly put it on the blue cube")
    assert isinstance(both, Plan) and not both.tempo and "I go at my usual speed" in both.note


def test_a_share_of_a_parts_way_is_said_in_percent() -> None:
    with open_session(Scene(world=STOVE), what_if=False) as session:
        for said in (
            "turn on the stove to 40 percent",
            "turn the stove on to 40 %",
            "turn on the stove to forty percent",
        ):
            answer = session.agent.plan(said)
            assert isinstance(answer, Plan) and answer.steps[0].arguments["share"] == pytest.approx(0.4), answer


def test_a_failure_before_a_move_of_the_hand_is_told_by_its_cause() -> None:
    heavy = SceneObject(id="block", kind="box", size=(0.02, 0.02, 0.02), pose=Pose(xyz=(0.15, 0.0, 0.06)), mass=12.0)
    with open_session(Scene(objects=(heavy,)), what_if=False) as session:
        episode = session.run("pick up the block, then move up 5 cm")
        assert not episode.success and "heavier than" in episode.final_detail
        assert episode.attempts[0].failed.skill == "pick"


def test_a_client_says_the_same_over_the_network() -> None:
    with SimProcess("--task", TASK) as sim, connect(sim.endpoint) as client:
        with_words = RemoteWorkcell(client.robot())
        before = with_words.state().tcp_pose.position
        assert with_words.run("move up 5 cm").success
        assert with_words.state().tcp_pose.position[2] - before[2] == pytest.approx(0.05, abs=0.002)
        asked = with_words.agent.plan("turn the red cube by 45 degrees")
        assert isinstance(asked, Plan) and asked.steps[0].skill == "turn"
        slow = with_words.run("slowly pick up the red cube")
        assert slow.success and slow.plan is not None and slow.plan.tempo == "careful"


def test_each_verb_of_the_hand_is_understood(still: EmbeddedWorkcell) -> None:
    for skill in MANUAL:
        check_words(skill, still.observe(), {"object": "red_cube", "held": "red_cube", "container": "green_cube"})


def test_words_that_fill_what_a_skill_does_not_take_are_found(still: EmbeddedWorkcell) -> None:
    class Nod(Skill):
        """Nod."""

        name = "nod"
        words = Words(verbs=("nod",), slots=(Slot(argument="often", kind="number"),))

        def run(self, ctx: object) -> SkillResult:
            """Nod."""
            del ctx
            return SkillResult(skill=self.name)

    with pytest.raises(AssertionError, match="fill often, which it does not take"):
        check_words(Nod(), still.observe(), {})


def speeds(cell: EmbeddedWorkcell, said: str) -> tuple[float, float]:
    """Carry out an order; return the greatest speed of the tool centre point meanwhile, m/s, and how long it took, s."""
    places: list[tuple[float, ...]] = []
    began = cell.driver.time
    leave = cell.driver.subscribe(lambda: places.append((cell.driver.time, *cell.ctx.arm.state().tcp_pose.xyz)))
    assert cell.run(said).success, said
    leave()
    rows = np.array(places)
    # Over a tenth of a second: readings of single ticks tremble.
    ticks = max(1, round(0.1 / cell.driver.control_timestep))
    gone, took = rows[ticks:, 1:] - rows[:-ticks, 1:], rows[ticks:, 0] - rows[:-ticks, 0]
    return float((np.linalg.norm(gone, axis=1) / took).max()), cell.driver.time - began


def test_a_speed_and_a_time_in_numbers_are_kept(cell: EmbeddedWorkcell) -> None:
    fastest, _ = speeds(cell, "move up 10 cm at 5 cm per second")
    assert fastest == pytest.approx(0.05, rel=0.1)
    _, took = speeds(cell, "take a full 4 seconds to move 10 cm to the left")
    assert took == pytest.approx(4.0, abs=0.4)
    assert cell.run("from now on never go faster than 8 cm per second").success
    fastest, _ = speeds(cell, "pick up the red cube")
    assert fastest < 1.1 * 0.08
    assert cell.run("what is your speed set to?").answer == "My hand goes at 0.08 m/s at most."
    assert cell.run("normal speed please").success and cell.ctx.tempo.name == "fast"


def test_what_is_asked_behind_an_order_is_answered_when_it_is_done(cell: EmbeddedWorkcell) -> None:
    done = cell.run("open the gripper to 3 cm and tell me the gap")
    assert done.success and "30 mm between my fingers" in done.final_detail
    measured = cell.run("how wide is the blue cube? use your gripper to measure it")
    assert measured.success and "blue_cube is 30.1 mm wide between the fingers" in measured.final_detail
    assert cell.observe().held is None


def test_the_hand_goes_back_to_where_it_was(cell: EmbeddedWorkcell) -> None:
    home = cell.ctx.arm.state().q
    assert cell.run("move left 10 cm, then come back").success
    assert np.allclose(cell.ctx.arm.state().q, home, atol=0.01)
    assert cell.run("hover over the red cube").success and cell.run("undo the last move").success
    assert np.allclose(cell.ctx.arm.state().q, home, atol=0.01)
    assert cell.run("which poses do you know?").answer == "I know before, home and start."
    assert cell.run("forget the start position").success
    unknown = cell.agent.plan("go to the dock position")
    assert isinstance(unknown, Refusal) and "no pose called “dock position”" in unknown.message


def test_what_moved_is_told_by_what_was_seen_before_the_order(cell: EmbeddedWorkcell) -> None:
    cell.reset(seed=0)
    assert cell.run("did anything move?").final_detail == "Nothing was done yet."
    begun = {item.id: item.pose.position for item in cell.observe().objects}
    pushed = cell.run("push the green cube 7 cm to the left, then tell me how far it ended up from where it was")
    now = {item.id: item.pose.position for item in cell.observe().objects}
    far = round(1000.0 * float(np.linalg.norm(now["green_cube"] - begun["green_cube"])))
    assert pushed.success and f"green_cube is {far} mm from where it was" in pushed.final_detail
    told = cell.run("what moved?").final_detail
    assert f"green_cube is {far} mm" in told and "red_cube" not in told and "Nothing else moved" in told
    raised = cell.run("go up 5 cm. How far did your hand move?")
    assert "My hand is 50 mm from where it was" in raised.final_detail
    assert "Nothing moved by more than 5 mm" in cell.run("is everything still where it was?").final_detail


def test_what_moved_is_told_alike_to_a_viewer_who_faces_the_robot(still: EmbeddedWorkcell) -> None:
    planner, scene = StubPlanner(load_skills(), moves=MANUAL, frame="viewer"), still.observe()
    assert isinstance(planner.plan("push the green cube 5 cm to the left in the base frame", scene), Plan)
    told = planner.plan("what moved?", scene)
    assert isinstance(told, Plan) and told.answer.startswith("Nothing moved by more than 5 mm")
    fewer = replace(scene, objects=tuple(item for item in scene.objects if item.id != "red_cube"))
    gone = planner.plan("what moved?", fewer)
    assert isinstance(gone, Plan) and "I no longer see red_cube." in gone.answer


def test_what_was_asked_to_be_left_undone_is_refused(still: EmbeddedWorkcell) -> None:
    for said, why in (
        ("pick up the red cube without touching anything", "untouched"),
        ("move the red cube 30 cm up, no lifting", "ungripped"),
        ("go back and forth between the red cube and the blue cube", "passes"),
        ("pick up the red cube over 8 seconds", "one motion"),
    ):
        answer = still.agent.plan(said)
        assert isinstance(answer, Refusal) and why in answer.message, (said, answer)


def test_a_hand_between_the_fingers_of_which_something_fell_gets_away(cell: EmbeddedWorkcell) -> None:
    assert cell.run("pick up the red cube, lower it till it is 1 cm above the table, then drop it").success
    before = cell.observe().find("red_cube")
    assert cell.run("move left 10 cm").success
    after = cell.observe().find("red_cube")
    assert before and after and np.allclose(before.pose.xyz, after.pose.xyz, atol=0.001)


@pytest.mark.parametrize(
    ("said", "call"),
    [
        ("move 10 cm to the left", "move_by(dy=-0.1)"),
        ("move 10 cm to the left in the base frame", "move_by(dy=0.1)"),
        ("go 5 cm in y", "move_by(dy=0.05)"),
        ("lean your hand 10 degrees to the left", "turn_hand(sideways=-0.174533)"),
    ],
)
def test_a_viewer_s_left_is_the_robot_s_right(still: EmbeddedWorkcell, said: str, call: str) -> None:
    planner = StubPlanner(load_skills(), moves=MANUAL, frame="viewer")
    plan = planner.plan(said, still.observe())
    assert isinstance(plan, Plan), plan
    assert [str(step) for step in plan.steps] == [call]


def test_a_question_is_answered_beside_what_is_remarked(still: EmbeddedWorkcell) -> None:
    plan = StubPlanner(load_skills(), moves=MANUAL).plan(
        "How far open is the gripper? I need to know if a 50 mm box would fit.", still.observe()
    )
    assert isinstance(plan, Plan) and not plan.steps
    assert plan.answer.startswith("There are 80 mm") and "I need to know if a 50 mm box would fit" in plan.answer
    for order in ("Where is your hand? Move it up 5 cm.", "Where is the red cube? I want the blue one on it."):
        assert isinstance(StubPlanner(load_skills(), moves=MANUAL).plan(order, still.observe()), Refusal)
