"""Fewer and smaller pictures: noise laid over parts, changes told by fixed cameras, looks that need none."""

from dataclasses import replace

import numpy as np
import pytest

from robosandbox.perception.attention import Attention
from robosandbox.perception.change_detection import Reference, changed, disparity_of, table_disparity
from robosandbox.perception.frame import TablePrior
from robosandbox.sim.sensors import SENSORS, perfect_intrinsics
from robosandbox.types import PictureWindow, Pose, Posture, RgbdFrame
from robosandbox.workcell.session import open_session

SIZE = (480, 640)
WHOLE = PictureWindow(left=0, top=0, right=640, bottom=480)
NOTHING = np.zeros(SIZE, dtype=np.bool_)


def wall(time=0.0, metres=1.2, block=None, grey=120):
    """A wall seen straight on, with a darker block 40 pixels wide that stands out by 5 cm."""
    rgb, depth = np.full((*SIZE, 3), grey, np.uint8), np.full(SIZE, metres, np.float32)
    if block is not None:
        rgb[200:240, block : block + 40], depth[200:240, block : block + 40] = (60, 70, 140), metres - 0.05
    return RgbdFrame(
        camera="scene",
        time=time,
        rgb=rgb,
        depth=depth,
        intrinsics=perfect_intrinsics(SIZE, 0.8),
        pose_camera_in_world=Pose(xyz=(0.0, 0.0, 1.0)),
        arms={"arm": Posture(q=np.zeros(7), gripper_q=np.zeros(2))},
    )


def reference_of(rgbd):
    return Reference(rgbd, rgbd.rgb.copy(), disparity_of(rgbd.depth), np.ones(SIZE, dtype=np.bool_))


def test_laid_over_noise_has_the_statistics_of_drawn_noise():
    sensor = replace(SENSORS["realsense"], missing=0.0, edge_dropout=0, distortion=(0.0,) * 5, depth_step=0.0)
    frames = [sensor.sense(wall(time=0.1 * k)) for k in range(8)]
    errors = np.array([frame.depth - 1.2 for frame in frames]) / 1.2**2
    # Half of the variance is shared within 3 pixels, and interpolated; 0.7 of a standard deviation is each pixel's own.
    assert errors.std() == pytest.approx(1.11 * 0.0014, rel=0.03) and abs(errors.mean()) < 2e-5
    assert float((errors**4).mean() / errors.var() ** 2) == pytest.approx(3.0, abs=0.1)
    beside = float((errors[:, :, 1:] * errors[:, :, :-1]).mean() / errors.var())
    apart = float((errors[:, :, 12:] * errors[:, :, :-12]).mean() / errors.var())
    assert beside == pytest.approx(0.5, abs=0.05) and abs(apart) < 0.02
    assert abs(np.corrcoef(errors[0].ravel(), errors[1].ravel())[0, 1]) < 0.02
    colours = np.array([frame.rgb.astype(float) - frame.rgb.mean() for frame in frames])
    assert colours.std() == pytest.approx(2.02, rel=0.02)


def test_depth_is_lost_as_often_as_the_sensor_says():
    sensor = replace(SENSORS["realsense"], edge_dropout=0, distortion=(0.0,) * 5)
    lost = np.mean([(sensor.sense(wall(time=0.1 * k)).depth == 0.0).mean() for k in range(8)])
    assert lost == pytest.approx(sensor.missing, rel=0.1)


@pytest.mark.parametrize("sensor", ["ideal", "realsense", "rough"])
@pytest.mark.parametrize("corner", [(0, 0), (300, 190), (560, 400)])
def test_a_window_shows_what_the_whole_picture_shows_there(sensor, corner):
    sensor, frame = SENSORS[sensor], wall(block=310)
    window = PictureWindow(left=corner[0], top=corner[1], right=corner[0] + 80, bottom=corner[1] + 80)
    needed = sensor.needs(frame.intrinsics, window)
    part = replace(frame, rgb=frame.rgb[needed.rows, needed.columns], depth=frame.depth[needed.rows, needed.columns])
    whole, seen = sensor.sense(frame), sensor.sense(part, window)
    assert np.array_equal(seen.rgb[window.rows, window.columns], whole.rgb[window.rows, window.columns])
    assert np.array_equal(seen.depth[window.rows, window.columns], whole.depth[window.rows, window.columns])
    outside = np.ones(SIZE, dtype=np.bool_)
    outside[window.rows, window.columns] = False
    assert not seen.rgb[outside].any() and not seen.depth[outside].any()


@pytest.mark.parametrize("sensor", ["ideal", "realsense", "rough"])
def test_noise_and_exposure_are_no_change(sensor):
    sensor = replace(SENSORS[sensor], edge_dropout=2)
    reference = reference_of(sensor.sense(wall(block=310)))
    assert not any(
        changed(reference, sensor.sense(wall(time=0.1 * k, block=310)), NOTHING, WHOLE) for k in range(1, 25)
    )


@pytest.mark.parametrize("window", [WHOLE, PictureWindow(left=300, top=190, right=360, bottom=250)])
@pytest.mark.parametrize("now", [wall(1.0, block=312), wall(1.0), wall(1.0, block=310, metres=1.18)])
def test_what_moved_or_went_away_is_a_change(now, window):
    sensor = SENSORS["realsense"]
    assert changed(reference_of(sensor.sense(wall(block=310))), sensor.sense(now), NOTHING, window)


def test_what_has_the_colour_of_what_is_behind_it_is_seen_by_its_depth():
    sensor, came = SENSORS["realsense"], wall(1.0)
    came.depth[200:230, 300:330] -= 0.03
    assert changed(reference_of(sensor.sense(wall())), sensor.sense(came), NOTHING, WHOLE)


def test_what_the_robot_hides_is_no_change_and_is_learned_when_it_shows():
    sensor = SENSORS["realsense"]
    hidden = NOTHING.copy()
    hidden[180:260, 290:370] = True
    reference = reference_of(sensor.sense(wall()))
    reference.forget(hidden)
    block = sensor.sense(wall(1.0, block=310))
    assert not changed(reference, block, hidden, WHOLE)
    reference.learn(block, NOTHING, WHOLE)
    assert not changed(reference, sensor.sense(wall(2.0, block=310)), NOTHING, WHOLE)
    assert changed(reference, sensor.sense(wall(3.0)), NOTHING, WHOLE)


def test_the_bare_table_has_the_disparity_of_its_plane():
    # A metre above the table, looking straight down.
    down = np.diag([1.0, -1.0, -1.0])
    lens = perfect_intrinsics(SIZE, 0.8)
    everywhere = ~NOTHING
    found = table_disparity(
        lens, down, np.array([0.0, 0.0, 1.04]), TablePrior(0.04, area=((-0.3, 0.3), (-0.3, 0.3))), everywhere
    )
    found = found.reshape(SIZE)
    assert found[240, 320] == pytest.approx(1.0, abs=1e-6)
    beside = int(320 + 0.31 * lens.fx)
    assert found[240, beside] == 0.0 and found[240, beside - 20] == pytest.approx(1.0, abs=1e-6)


def test_nothing_is_told_before_anything_was_seen():
    assert Attention(TablePrior(0.04))._views(None, {}, None, None, everywhere=True) == {}


class Counted:
    """The pictures that a session takes."""

    def __init__(self, session):
        self.taken = []
        capture = session.mujoco.capture

        def counted(camera, window=None):
            self.taken.append((camera, window))
            return capture(camera, window)

        session.mujoco.capture = counted


@pytest.mark.gl
def test_a_pick_takes_five_pictures_and_one_of_them_small():
    with open_session("pick_cube_franka", perception="rgbd", sensor="realsense") as session:
        session.reset(1)
        pictures = Counted(session)
        assert session.run().success and session.judge().success
    assert len(pictures.taken) == 5 and sum(window is None for _, window in pictures.taken) == 3
    areas = [(w.right - w.left) * (w.bottom - w.top) for _, w in pictures.taken if w is not None]
    assert min(areas) < 0.01 * SIZE[0] * SIZE[1]


@pytest.mark.gl
def test_a_rendered_window_is_the_same_as_that_part_of_the_whole_picture():
    with open_session("put_in_bin", sensor="ideal") as session:
        for camera in session.mujoco.cameras:
            whole = session.mujoco.capture(camera)
            window = PictureWindow(left=213, top=147, right=402, bottom=333)
            part = session.mujoco.capture(camera, window)
            inside = np.s_[window.rows, window.columns]
            assert np.abs(part.rgb[inside].astype(int) - whole.rgb[inside]).max() <= 1
            assert np.abs(part.depth[inside] - whole.depth[inside]).max() < 1e-5
            assert not part.depth[: window.top].any()


@pytest.mark.gl
def test_what_is_nudged_between_two_looks_is_seen_where_it_is():
    with open_session("pick_from_three", perception="rgbd", sensor="realsense") as session:
        sim, ctx = session.mujoco, session.ctx
        before = {item.id: item.pose for item in ctx.look().objects}
        sim.wait(0.1)
        pictures = Counted(session)
        assert {item.id: item.pose for item in ctx.look().objects} == before and len(pictures.taken) <= 2
        cube = "red_cube"
        address = sim.model.joint(
            next(n for n in map(lambda k: sim.model.joint(k).name, range(sim.model.njnt)) if cube in n)
        )
        sim._live.qpos[address.qposadr[0]] += 0.02
        sim.wait(0.1)
        moved = ctx.look(cube).find(cube).pose
        truth = sim.truth().objects[cube].pose
        assert np.linalg.norm(moved.position - before[cube].position) > 0.015
        assert np.linalg.norm(moved.position - truth.position) < 0.004


@pytest.mark.gl
def test_what_is_put_beside_is_noticed_by_a_look_at_all_and_what_is_felt_takes_no_picture():
    with open_session("pick_cube_franka", perception="rgbd", sensor="realsense") as session:
        assert session.run().success
        ctx = session.ctx
        held = ctx.look().held
        session.driver.wait(0.1)
        pictures = Counted(session)
        assert held is not None and ctx.look(held).held == held and ctx.feel().held == held
        assert not pictures.taken
