"""A scene's file laid on pictures: what is measured is compared with the simulated state, which the perception does not get."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.behind import backend

from robosandbox.apps.commands.world import open_here
from robosandbox.errors import InputError
from robosandbox.motion.scene_depths import SceneDepths
from robosandbox.perception.factory import Setup, make_perception
from robosandbox.perception.known_scene import KnownScenePerception
from robosandbox.perception.part_values import PartValues
from robosandbox.sim.intervention import Intervention
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import ObservedScene, Pose, Scene, SceneObject
from robosandbox.workcell.options import WorkcellOptions

KITCHEN = Path(__file__).parents[1] / "examples" / "scenes" / "kitchen.xml"
BASE = (0.264, 0.05, 0.74, 0.0)


@pytest.fixture(params=["ideal", "realsense"])
def sim(request: pytest.FixtureRequest) -> Iterator[MuJoCoBackend]:
    options = WorkcellOptions(scene=KITCHEN, robot_base=BASE, perception="ground_truth", sensor=request.param)
    with open_here(options) as cell:
        yield backend(cell.driver)


def seen_in(sim: MuJoCoBackend) -> ObservedScene:
    eyes = make_perception("rgbd", Setup.of(Scene(world=KITCHEN, robot_base=BASE)))
    return eyes.perceive(eyes.view(sim))


def test_what_is_as_in_the_file_is_seen_there_and_nothing_is_told(sim: MuJoCoBackend) -> None:
    seen, true = seen_in(sim), sim.truth().objects
    assert {item.id for item in seen.objects} == set(true)
    for item in seen.objects:
        assert np.abs(item.pose.position - true[item.id].pose.position).max() < 0.004, item.id
    assert seen.notes == ()


def test_a_door_that_stands_open_is_measured_and_told_of(sim: MuJoCoBackend) -> None:
    with Intervention(sim).state() as data:
        data.joint("cupboard_hinge").qpos[0] = -0.9
    seen = seen_in(sim)
    assert seen.find("cupboard.door").opening == pytest.approx(-0.9, abs=0.03)
    assert any("cupboard.door is 5" in note and "deg from where kitchen.xml has it" in note for note in seen.notes)


def test_a_thing_that_lies_elsewhere_on_its_side_is_found(sim: MuJoCoBackend) -> None:
    lies = Pose.from_matrix(np.array([0.50, 0.30, 0.79]), np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    Intervention(sim).set_pose("red_mug", lies)
    sim.wait(1.0)
    true, seen = sim.truth().objects["red_mug"].pose, seen_in(sim).find("red_mug")
    assert seen is not None and seen.confidence == 1.0
    assert np.linalg.norm(seen.pose.position - true.position) < 0.008
    assert np.trace(seen.pose.rotation.T @ true.rotation) > 1.0 + 2.0 * np.cos(np.radians(10.0))


def test_a_thing_that_is_not_there_is_not_claimed_and_one_behind_a_door_is_taken_to_be_there(
    sim: MuJoCoBackend,
) -> None:
    Intervention(sim).set_pose("box", Pose(xyz=(3.0, 3.0, 0.031)))
    seen = seen_in(sim)
    assert seen.find("box") is None
    assert "box is not where kitchen.xml has it, and is not seen anywhere" in seen.notes


def test_what_the_file_does_not_have_is_told_of(tmp_path: Path) -> None:
    path = tmp_path / "kitchen.xml"
    more = '<body name="vase" pos="0.45 0.25 0.80"><freejoint/><geom type="cylinder" size="0.04 0.06" rgba="0.2 0.3 0.9 1"/></body>'
    path.write_text(
        KITCHEN.read_text()
        .replace("</worldbody>", f"{more}</worldbody>")
        .replace("<keyframe>", "<!--")
        .replace("</keyframe>", "-->")
    )
    with open_here(WorkcellOptions(scene=path, robot_base=BASE)) as cell:
        seen = seen_in(backend(cell.driver))
    told = re.compile(r"something of \d x \d x 1\d cm at \(0\.45, 0\.25, 0\.8\d\) is not in kitchen\.xml")
    assert any(told.fullmatch(note) for note in seen.notes)


def test_a_box_is_put_on_a_shelf_by_pixels_alone() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN, robot_base=BASE, perception="rgbd", sensor="realsense")) as cell:
        assert cell.ctx.perception.view(cell.driver).simulation is None
        episode = cell.run("put the box on the shelf")
        assert episode.success, episode.final_detail
        assert "shelf" in backend(cell.driver).truth().objects["box"].contacts


def test_a_door_is_opened_by_pixels_alone() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN, robot_base=BASE, perception="rgbd")) as cell:
        episode = cell.run("open the cupboard")
        assert episode.success, episode.final_detail
        assert (backend(cell.driver).truth().objects["cupboard.door"].opening or 0.0) < -1.0


def test_a_button_that_the_hand_covers_is_felt_to_give_way() -> None:
    with open_here(WorkcellOptions(scene=KITCHEN, robot_base=BASE, perception="rgbd")) as cell:
        episode = cell.run("press the button")
        assert episode.success and episode.steps[0].result is not None
        assert float(episode.steps[0].result.detail["pressed_share"]) > 0.7


def test_a_part_that_no_camera_tells_of_keeps_its_value(sim: MuJoCoBackend) -> None:
    depths = SceneDepths(sim.world)
    depths.place()
    part = PartValues(depths, sim.world.object_bodies["cupboard.door"])
    part.put(-0.5)
    assert not part.measure([])
    assert part.value == -0.5


def test_a_thing_that_only_the_task_has_is_refused_with_what_to_do() -> None:
    scene = Scene(
        world=KITCHEN,
        objects=(SceneObject(id="cube", kind="box", size=(0.02, 0.02, 0.02), pose=Pose(xyz=(0.5, 0.0, 0.8))),),
    )
    with pytest.raises(InputError, match=r"cube: with kitchen\.xml rgbd knows what is in the file; add it there"):
        KnownScenePerception(setup=Setup.of(scene))
