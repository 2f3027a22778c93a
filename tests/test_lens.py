"""A webcam's lens, measured from pictures of the board that a simulation renders and a known lens bends."""

from collections.abc import Iterator
from contextlib import closing

import cv2
import mujoco
import numpy as np
import pytest
import yaml

from robosandbox.apps.cli import app
from robosandbox.apps.commands.console import run_app
from robosandbox.driver.webcam_file import WebcamFile
from robosandbox.errors import SensorError
from robosandbox.perception.lens_calibration import LensViews
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.validation import load_yaml_model

pytestmark = pytest.mark.gl

WIDTH, HEIGHT = 640, 480
# A webcam of 60 degrees: 12 pixels are bent in its corners.
MATRIX = np.array([[562.0, 0.0, 331.0], [0.0, 560.0, 233.0], [0.0, 0.0, 1.0]])
BEND = np.array([-0.09, 0.03, 0.001, -0.0005, 0.0])
BOARD = CalibrationBoard(centre=(0.0, 0.0))


def held(tilts: float = 0.5, views: int = 24) -> Iterator[np.ndarray]:
    """Return noisy pictures of the board from all sides, up to `tilts` rad from straight above, BGR."""
    # The camera sees more than the lens shows, and twice as fine.
    wide, high, focal = 1600, 1200, 1000.0
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = wide, high
    BOARD.lay(spec, 0.0)
    spec.worldbody.add_light(pos=[0, 0, 3], dir=[0, 0, -1])
    fovy = float(np.degrees(2.0 * np.arctan(high / 2.0 / focal)))
    spec.worldbody.add_camera(name="eye", pos=[0, 0, 1], fovy=fovy)
    model = spec.compile()
    data = mujoco.MjData(model)
    pixels = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), axis=-1).reshape(-1, 1, 2).astype(float)
    rays = cv2.undistortPoints(pixels, MATRIX, BEND).reshape(HEIGHT, WIDTH, 2)
    where = (rays * focal + [(wide - 1) / 2.0, (high - 1) / 2.0]).astype(np.float32)
    random = np.random.default_rng(1)
    with closing(OffscreenRenderer(model, (high, wide))) as renderer:
        for _ in range(views):
            turn, tilt, away = random.uniform(-0.6, 0.6), random.uniform(-tilts, tilts, 2), random.uniform(0.45, 0.9)
            (ux, uy), aside = tilt, random.uniform(-0.12, 0.12, 2)
            about = [
                np.array([np.cos(a / 2), *(np.sin(a / 2) * np.eye(3)[axis])])
                for axis, a in ((2, turn), (0, ux), (1, uy))
            ]
            quat, both = np.zeros(4), np.zeros(4)
            mujoco.mju_mulQuat(both, about[0], about[1])
            mujoco.mju_mulQuat(quat, both, about[2])
            back = np.zeros(3)
            mujoco.mju_rotVecQuat(back, np.array([0.0, 0.0, away]), quat)
            model.cam_pos[0], model.cam_quat[0] = back + [*aside, 0.0], quat
            mujoco.mj_forward(model, data)
            seen = cv2.remap(renderer.render(data, "eye"), where, None, cv2.INTER_LINEAR)
            noisy = seen + random.normal(0.0, 3.0, seen.shape)
            yield np.clip(noisy, 0, 255).astype(np.uint8)[..., ::-1]


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    return [*held()]


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
    for picture in held(tilts=0.0, views=12):
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
