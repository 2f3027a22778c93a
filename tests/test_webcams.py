"""Cameras without depth: where they stand, what they see, and webcams as senses. Videos and pictures stand for devices."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.driver.webcam_file import Webcam, WebcamFile, write_entries
from robosandbox.driver.webcams import OpenWebcam
from robosandbox.errors import InputError, SensorError
from robosandbox.perception.factory import Setup
from robosandbox.perception.fit import Fit
from robosandbox.perception.raycast import span
from robosandbox.perception.rgb import RgbPerception
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.sensors import SENSORS
from robosandbox.types import Pose, Scene, SceneObject
from robosandbox.validation import load_yaml_model
from robosandbox.workcell.session import open_session

BLUE, RED = (0.2, 0.3, 0.85, 1.0), (0.85, 0.2, 0.2, 1.0)
_DOWN = np.array([[0.0, 0.0, -1.0]])


def at(x, y, z):
    return Pose(xyz=(x, y, z))


@pytest.mark.parametrize(
    "shape, sizes, near, far",
    [
        ("box", (0.02, 0.03, 0.05), 0.95, 1.05),
        ("cylinder", (0.02, 0.05), 0.95, 1.05),
        ("lying", (0.02, 0.05), 0.98, 1.02),
        ("sphere", (0.04,), 0.96, 1.04),
    ],
)
def test_a_ray_from_above_enters_at_the_top_and_leaves_at_the_bottom(shape, sizes, near, far):
    fit = Fit(shape, np.zeros(3), np.array(sizes), 0.3, 0.0, np.zeros((0, 0)), 0)
    enters, leaves = span(fit, np.array([0.0, 0.0, 1.0]), _DOWN)
    assert (enters[0], leaves[0]) == (pytest.approx(near), pytest.approx(far))
    missed = span(fit, np.array([0.2, 0.0, 1.0]), _DOWN)
    assert missed[0][0] > missed[1][0]


@pytest.mark.gl
@pytest.mark.parametrize("camera", ["scene", "top"])
def test_the_table_s_edges_take_a_camera_back_from_degrees(camera):
    with MuJoCoBackend(sensor=replace(SENSORS["webcam"], seed=2)) as sim:
        sim.load(Scene())
        taken = sim.capture(camera)
        sim.sensor = SENSORS["ideal"]
        true = sim.capture(camera).pose_camera_in_world
    eyes = RgbPerception()
    eyes.look([taken])
    assert not taken.depth.any()
    before, after = (
        np.linalg.norm(true.rotation - pose.rotation) for pose in (taken.pose_camera_in_world, eyes.poses[camera].pose)
    )
    assert before > 0.005 and after < 0.2 * before


@pytest.mark.gl
@pytest.mark.parametrize("cameras, within", [(("scene", "top"), 0.003), (("scene",), 0.005)])
def test_things_are_placed_within_millimetres_without_depth(cameras, within):
    with open_session(
        "pick_from_three", perception="rgb", sensor="webcam", perception_options={"cameras": cameras}
    ) as cell:
        cell.reset(1)
        seen = {item.id: item for item in cell.ctx.look().objects}
        truth = cell.mujoco.truth().objects
    assert set(seen) == set(truth)
    for name, item in seen.items():
        assert np.linalg.norm(item.pose.position - truth[name].pose.position) < within


@pytest.mark.gl
def test_a_camera_that_sees_no_edge_says_so_and_nothing_is_acted_on():
    with open_session("pick_from_three", perception="rgb", sensor="webcam") as cell:
        capture, top = cell.mujoco.capture("scene"), cell.mujoco.capture("top")
        eyes = RgbPerception(setup=Setup.of(cell.task.scene))
        # As from a camera that has been turned by 20 degrees since it was calibrated.
        turned = Pose(xyz=(0.0, 0.0, 0.0), quat_xyzw=(0.0, 0.0, float(np.sin(0.175)), float(np.cos(0.175))))
        moved = replace(capture, pose_camera_in_world=capture.pose_camera_in_world @ turned)
        things = eyes.look([moved])
        assert "calibrate it again" in eyes.notes[0]
        assert all(thing.confidence < 0.3 for thing in things)
        beside = eyes.look([moved, top])
    assert {segment.frame.camera for thing in beside for segment in thing.group.segments} == {"top"}


@pytest.mark.gl
def test_a_stack_is_built_and_claimed_by_two_cameras_that_are_a_degree_off():
    with open_session("stack_two", perception="rgb", sensor="webcam") as cell:
        cell.reset(1)
        assert cell.run().success and cell.judge().success


@pytest.mark.gl
def test_one_camera_tells_what_is_on_a_block_from_what_is_behind_it():
    with open_session(
        "place_on_block", perception="rgb", sensor="webcam", perception_options={"cameras": ("scene",)}
    ) as cell:
        cell.reset(3)
        assert cell.run().success and cell.judge().success


@pytest.mark.gl
@pytest.mark.parametrize("behind", [0.08, 0.1])
def test_what_one_camera_sees_over_a_block_is_not_claimed_to_be_on_it(behind):
    away = behind * np.array([-0.68, 0.73])
    block = SceneObject(id="blue_block", kind="box", size=(0.04, 0.04, 0.02), pose=at(0.2, 0.05, 0.06), rgba=BLUE)
    cube = SceneObject(
        id="red_cube", kind="box", size=(0.015, 0.015, 0.015), pose=at(0.2 + away[0], 0.05 + away[1], 0.055), rgba=RED
    )
    scene = Scene(objects=(block, cube))
    with MuJoCoBackend(sensor=SENSORS["webcam"]) as sim:
        sim.load(scene)
        things = RgbPerception(setup=Setup.of(scene)).look([sim.capture("scene")])
    for thing in things:
        if thing.confidence >= TOLERANCES.acted_on:
            assert min(np.linalg.norm(thing.fit.centre - item.pose.position) for item in scene.objects) < 0.01


def webcam(source, size=(48, 64)):
    lens = {"width": size[1], "height": size[0], "fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 23.5}
    return Webcam.model_validate({"source": str(source), "lens": lens, "pose": {"xyz": [0.0, 0.0, 1.0]}})


def picture(path: Path, bgr=(200, 10, 30), size=(48, 64)) -> Path:
    cv2.imwrite(str(path), np.full((*size, 3), bgr, np.uint8))
    return path


def test_a_webcam_s_picture_is_red_green_blue(tmp_path):
    opened = OpenWebcam("desk", webcam(picture(tmp_path / "seen_0.png")))
    assert tuple(opened.picture()[0, 0]) == (30, 10, 200)
    with pytest.raises(SensorError, match="delivers no picture"):
        opened.picture()


def test_a_picture_of_another_size_than_the_lens_is_refused(tmp_path):
    opened = OpenWebcam("desk", webcam(picture(tmp_path / "seen_0.png", size=(24, 32))))
    with pytest.raises(SensorError, match="32 x 24 pixels, and its lens is given for 64 x 48"):
        opened.picture()


def test_a_source_that_does_not_open_is_named(tmp_path):
    with pytest.raises(InputError, match="desk: nothing opens at the source"):
        OpenWebcam("desk", webcam(tmp_path / "none.png"))


class Device:
    """A device of OpenCV's that delivers pictures by their grey; None is a picture that does not come, and a list a new opening."""

    def __init__(self, *openings):
        self.openings, self.opened = list(openings), 0

    def __call__(self, source):
        self.opened += 1
        self.greys = self.openings.pop(0) if self.openings else None
        return self

    def isOpened(self):
        return self.greys is not None

    def read(self):
        if not self.greys:
            return False, None
        # What was delivered last is so for ever.
        grey = self.greys.pop(0) if len(self.greys) > 1 else self.greys[0]
        return grey is not None, None if grey is None else np.full((48, 64, 3), grey, np.uint8)

    def grab(self):
        return True

    def set(self, key, value):
        return True

    def release(self):
        pass


def opened(device, monkeypatch, source="/dev/video7"):
    monkeypatch.setattr("robosandbox.driver.webcams.cv2.VideoCapture", device)
    return OpenWebcam("desk", webcam(source))


def test_a_webcam_that_went_is_opened_again_once_a_picture(monkeypatch):
    device = Device([10, None], [20, None], None, [30])
    desk = opened(device, monkeypatch)
    assert desk.picture()[0, 0, 0] == 10
    assert desk.picture()[0, 0, 0] == 20 and device.opened == 2
    with pytest.raises(SensorError, match="delivers no picture; look at its cable"):
        desk.picture()
    assert device.opened == 3
    assert desk.picture()[0, 0, 0] == 30 and device.opened == 4


def test_a_webcam_that_hangs_is_not_believed(monkeypatch):
    hangs, mended = Device([10, 11], [11]), Device([10, 11], [12])
    desk = opened(hangs, monkeypatch)
    assert [desk.picture()[0, 0, 0] for _ in range(2)] == [10, 11]
    with pytest.raises(SensorError, match=r"'/dev/video7' delivers the same picture for 1\.\d s"):
        desk.picture()
    assert hangs.opened == 2
    desk = opened(mended, monkeypatch)
    assert [desk.picture()[0, 0, 0] for _ in range(3)] == [10, 11, 12]


def test_a_picture_that_comes_late_is_waited_for(monkeypatch):
    desk = opened(Device([10, 10, 10, 10, 11]), monkeypatch)
    assert [desk.picture()[0, 0, 0] for _ in range(2)] == [10, 11]


FILE = """\
# Of the desk by the window.
webcams:
  side:  # on the tripod
    source: 0
    lens: {width: 640, height: 480, fx: 625, fy: 625, cx: 319.5, cy: 239.5}  # measured in May
  # Hangs from the lamp.
  above: {source: 2, lens: {width: 640, height: 480, fx: 579, fy: 579, cx: 319.5, cy: 239.5}}
  hand:
    pose:
      xyz: [0.0, 0.0, 1.0]  # a guess
      quat_xyzw:
        - 0.0
        - 0.0
        - 0.0
        - 1.0
    # By its name.
    source: "/dev/v4l/by-id/hand"
"""


@pytest.mark.parametrize("name", ["side", "above", "hand"])
def test_a_pose_goes_into_the_text_of_its_webcam_alone(name, tmp_path):
    path = tmp_path / "webcams.yaml"
    path.write_text(FILE)
    before = load_yaml_model(path, WebcamFile).webcams
    pose = Pose(xyz=(0.1, -0.2, 0.3), quat_xyzw=(0.1, 0.7, -0.7, 0.1))
    write_entries(path, {name: before[name].model_copy(update={"pose": pose})}, path)
    text = path.read_text()
    after = load_yaml_model(path, WebcamFile).webcams
    assert after[name].pose.xyz == pose.xyz and after[name].pose.quat_xyzw == pytest.approx(pose.quat_xyzw)
    assert {key: value for key, value in after.items() if key != name} == {
        key: value for key, value in before.items() if key != name
    }
    lines = {"side": 0, "above": 1, "hand": 6}[name]
    assert len({*FILE.splitlines()} - {*text.splitlines()}) <= max(lines, 1)
    assert text.count("#") >= 5


def test_an_entry_that_stands_elsewhere_is_left_to_its_owner(tmp_path):
    path = tmp_path / "webcams.yaml"
    text = "webcams:\n  side: &one {source: 0}\n  above: *one\n"
    path.write_text(text)
    placed = load_yaml_model(path, WebcamFile).webcams["above"].model_copy(update={"pose": at(0.0, 0.0, 1.0)})
    with pytest.raises(InputError, match="cannot be changed in place"):
        write_entries(path, {"above": placed}, path)
    assert path.read_text() == text


@pytest.fixture(scope="module")
def on_the_board():
    """Return a camera's picture of the board, and one without noise."""
    with MuJoCoBackend(sensor=SENSORS["webcam"], board=CalibrationBoard(centre=(0.2, -0.22))) as sim:
        sim.load(Scene())
        noisy = sim.capture("scene")
        sim.sensor = SENSORS["ideal"]
        return noisy, sim.capture("scene")


def board_file(folder, frame, pictures, **lens):
    """Write a file of one webcam that shows pictures, with a remark."""
    for number, shown in enumerate(pictures):
        cv2.imwrite(str(folder / f"seen_{number}.png"), shown[..., ::-1])
    known = {name: getattr(frame.intrinsics, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    entry = {"source": str(folder / "seen_%d.png"), "lens": {**known, **lens}}
    path = folder / "webcams.yaml"
    path.write_text("# Mine.\n" + yaml.safe_dump({"webcams": {"desk": entry}}))
    return path


@pytest.mark.gl
def test_a_file_stays_as_it_is_where_no_board_is_seen(tmp_path, on_the_board, capsys):
    file = board_file(tmp_path, on_the_board[1], [np.full((480, 640, 3), 90, np.uint8)])
    before = file.read_text()
    assert run_app(app, "robo-sandbox", ["calibrate", "--webcams", str(file)]) == 1
    assert file.read_text() == before and "sees 0 tags" in capsys.readouterr().out


@pytest.mark.gl
def test_a_lens_that_is_another_camera_s_is_refused_by_what_it_leaves(tmp_path, on_the_board, capsys):
    frame = on_the_board[1]
    file = board_file(tmp_path, frame, [frame.rgb], fx=0.8 * frame.intrinsics.fx, fy=frame.intrinsics.fy)
    before = file.read_text()
    assert run_app(app, "robo-sandbox", ["calibrate", "--webcams", str(file)]) == 1
    assert file.read_text() == before
    assert "pixels off where its best pose puts them, and 0.7 are allowed" in capsys.readouterr().out


@pytest.mark.gl
def test_a_board_that_was_moved_between_pictures_is_refused(tmp_path, on_the_board, capsys):
    frame = on_the_board[1]
    file = board_file(tmp_path, frame, [frame.rgb, np.roll(frame.rgb, 3, axis=1)])
    assert run_app(app, "robo-sandbox", ["calibrate", "--webcams", str(file)]) == 1
    assert "look whether the board lies flat and still" in capsys.readouterr().out


@pytest.mark.gl
def test_several_noisy_pictures_leave_a_pose_within_millimetres_and_remarks(tmp_path, on_the_board):
    noisy, clean = on_the_board
    random = np.random.default_rng(0)
    shown = [np.clip(noisy.rgb + random.normal(0.0, 4.0, noisy.rgb.shape), 0, 255).astype(np.uint8) for _ in range(10)]
    file = board_file(tmp_path, noisy, shown, distortion=list(noisy.intrinsics.distortion))
    assert run_app(app, "robo-sandbox", ["calibrate", "--webcams", str(file)]) == 0
    found = load_yaml_model(file, WebcamFile).webcams["desk"].pose
    assert np.linalg.norm(found.position - clean.pose_camera_in_world.position) < 0.004
    assert file.read_text().startswith("# Mine.\n")


@pytest.mark.gl
def test_calibrate_writes_where_a_webcam_stands(tmp_path, capsys):
    board = CalibrationBoard(centre=(0.2, -0.22))
    with MuJoCoBackend(sensor=SENSORS["ideal"], board=board) as sim:
        sim.load(Scene())
        taken = sim.capture("scene")
    cv2.imwrite(str(tmp_path / "seen_0.png"), taken.rgb[..., ::-1])
    lens = {name: getattr(taken.intrinsics, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    guessed = {"xyz": [1.0, -0.8, 0.8], "quat_xyzw": list(taken.pose_camera_in_world.quat_xyzw)}
    file = tmp_path / "webcams.yaml"
    file.write_text(
        yaml.safe_dump({"webcams": {"desk": {"source": str(tmp_path / "seen_0.png"), "lens": lens, "pose": guessed}}})
    )
    assert run_app(app, "robo-sandbox", ["calibrate", "--webcams", str(file)]) == 0
    assert "by 12 tags" in capsys.readouterr().out
    found = load_yaml_model(file, WebcamFile).webcams["desk"].pose
    assert np.linalg.norm(found.position - taken.pose_camera_in_world.position) < 0.005
