"""A webcam's lens, measured from pictures of the board that a simulation renders and a known lens bends."""

import cv2
import numpy as np
import pytest
import yaml
from support.held_board import BOARD, HEIGHT, WIDTH, held

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.driver.webcam_file import WebcamFile
from robosandbox.errors import SensorError
from robosandbox.perception.lens_calibration import LensViews
from robosandbox.validation import load_yaml_model

pytestmark = pytest.mark.gl

# A webcam of 60 degrees: 12 pixels are bent in its corners.
MATRIX = np.array([[562.0, 0.0, 331.0], [0.0, 560.0, 233.0], [0.0, 0.0, 1.0]])
BEND = np.array([-0.09, 0.03, 0.001, -0.0005, 0.0])


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    return [*held(MATRIX, BEND)]


def bent(matrix: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Return where a lens puts rays over the whole picture, pixels."""
    at = np.stack(np.meshgrid(np.linspace(0, WIDTH - 1, 9), np.linspace(0, HEIGHT - 1, 7)), axis=-1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(at, MATRIX, BEND).reshape(-1, 2)
    ahead = np.column_stack([rays, np.ones(len(rays))])
    return cv2.projectPoints(ahead, np.zeros(3), np.zeros(3), matrix, bend)[0].reshape(-1, 2)


def test_a_lens_is_measured_within_a_pixel_and_a_half_in_the_corners(pictures, tmp_path, capsys):
    for number, picture in enumerate(pictures):
        cv2.imwrite(str(tmp_path / f"held_{number:02d}.png"), picture)
    source = str(tmp_path / "held_%02d.png")
    file = tmp_path / "webcams.yaml"
    file.write_text(f"# Mine.\nwebcams:\n  desk:  # by the window\n    source: {source}\n")
    assert run_app(app, "robo-sandbox", ["calibrate", "--webcams", str(file), "--lens", "desk"]) == 0
    assert "pixels left" in capsys.readouterr().out
    assert file.read_text().startswith(
        f"# Mine.\nwebcams:\n  desk:  # by the window\n    source: {source}\n    lens: {{width: 640"
    )
    lens = load_yaml_model(file, WebcamFile).webcams["desk"].lens
    matrix = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    off = np.linalg.norm(bent(matrix, np.array(lens.distortion)) - bent(MATRIX, BEND), axis=1)
    assert off.max() < 1.5 and off.mean() < 0.6
    assert lens.fx == pytest.approx(MATRIX[0, 0], rel=0.003)


def test_pictures_that_do_not_tell_a_lens_are_refused(pictures):
    few, level = LensViews(BOARD), LensViews(BOARD)
    for picture in pictures[:3]:
        few.take(picture[..., ::-1], moves=False)
        assert not few.take(picture[..., ::-1], moves=False)
    with pytest.raises(SensorError, match=r"3 pictures show the board in different ways, and 8 are needed"):
        few.measure()
    for picture in held(MATRIX, BEND, tilts=0.0, views=12):
        level.take(picture[..., ::-1], moves=False)
    with pytest.raises(SensorError, match="tilt the board more"):
        level.measure()


def test_a_board_in_motion_is_waited_for(pictures):
    views = LensViews(BOARD)
    first, second = (picture[..., ::-1] for picture in pictures[:2])
    assert [views.take(shown, moves=True) for shown in (first, second, second, second)] == [False, False, True, False]


def test_a_webcam_without_a_lens_is_told_how_to_measure_it(tmp_path, capsys):
    file = tmp_path / "webcams.yaml"
    file.write_text(yaml.safe_dump({"webcams": {"desk": {"source": 0}}}))
    assert run_app(app, "robo-sandbox", ["calibrate", "--webcams", str(file)]) == 2
    assert "webcams.desk.lens is missing" in capsys.readouterr().err
    assert run_app(app, "robo-sandbox", ["calibrate", "--webcams", str(file), "--lens", "above"]) == 2
    assert "has no webcam 'above'" in capsys.readouterr().err
    assert run_app(app, "robo-sandbox", ["calibrate", "--lens", "desk"]) == 2
    assert "--lens: give --webcams" in capsys.readouterr().err
