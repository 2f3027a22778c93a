"""What is remembered of a thing while looks at it are poor, or while it is out of sight."""

from dataclasses import replace

import numpy as np
import pytest

from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.perception.evidence import ShapeEvidence, SurfacePoints
from robosandbox.perception.fit import fit
from robosandbox.perception.frame import TablePrior
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.groups import Group
from robosandbox.perception.occlusion import is_its_contents
from robosandbox.perception.shape_prior import KnownShape, candidates
from robosandbox.perception.silhouette import Rows
from robosandbox.perception.thing import Thing, size_and_pose
from robosandbox.perception.track import Track, update_from
from robosandbox.perception.tracker import Tracker
from robosandbox.types import DetectedObject, Pose
from robosandbox.workcell.session import open_session

TABLE = 0.04
BIN = np.array([0.074, 0.074, 0.025])
CAMERAS = (np.array([0.9, -0.6, 0.7]), np.array([0.1, 0.1, 1.1]))


def look_at_bin(middle, sizes, *, cameras=CAMERAS, tangents=32, confidence=1.0):
    """Return a bin as seen: the tangent planes of a box through each camera, and points on its rim."""
    centre = np.array([*middle, TABLE + sizes[2]])
    normals, values = [], []
    for camera in cameras:
        ahead = (centre - camera) / np.linalg.norm(centre - camera)
        side = np.cross(ahead, [0.0, 0.0, 1.0])
        side /= np.linalg.norm(side)
        around = np.cross(side, ahead)
        for angle in np.arange(tangents) * 2.0 * np.pi / tangents:
            out = np.cos(angle) * side + np.sin(angle) * around
            corners = centre + sizes * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            # The plane holds the camera, and of the corners the one that it leaves farthest outside.
            rays = corners - camera
            slopes = (rays @ out) / (rays @ ahead)
            normal = out - slopes.max() * ahead
            normal /= np.linalg.norm(normal)
            normals.append(normal)
            values.append(float(normal @ camera))
    u = np.linspace(-0.95, 0.95, 9)
    rim = np.array([[x, y, 1.0] for x in u for y in (-0.95, 0.95)] + [[x, y, 1.0] for y in u for x in (-0.95, 0.95)])
    seen = ShapeEvidence(
        Rows(np.array(normals), np.array(values), np.full(len(values), 1.0 / 0.001)),
        SurfacePoints(centre + rim * sizes, cameras[0], 1.0 / 0.002),
    )
    hull = fit("box", seen, TABLE)
    assert hull is not None
    size, pose = size_and_pose("bin", hull)
    return Thing(
        kind="bin",
        size=size,
        pose=pose,
        rgb=np.array([0.8, 0.2, 0.2]),
        confidence=confidence,
        sigma=np.full(4, 0.001),
        group=Group(()),
        fit=hull,
        seen=seen,
        resting=TABLE,
    )


def test_a_synthetic_bin_is_fitted_as_it_is():
    seen = look_at_bin((0.1, 0.3), BIN)
    assert np.allclose(np.sort(seen.fit.sizes), np.sort(BIN), atol=0.001)
    assert np.allclose(seen.fit.centre[:2], (0.1, 0.3), atol=0.001)


def test_a_poorer_look_does_not_change_a_bin_s_size():
    track = Track("bin", look_at_bin((0.1, 0.3), BIN))
    known, tangents = track.thing.size, track.tangents
    # A can that stands out of it makes it look higher.
    update_from(track, look_at_bin((0.1, 0.3), BIN + [0.0, 0.0, 0.004], cameras=CAMERAS[:1], confidence=0.6))
    assert np.allclose(track.thing.size, known, atol=0.0005)
    assert track.tangents == tangents
    assert track.confidence > 0.9


def test_a_poorer_look_tells_where_a_bin_has_been_pushed():
    track = Track("bin", look_at_bin((0.1, 0.3), BIN))
    known, tangents = track.thing.size, track.tangents
    update_from(track, look_at_bin((0.13, 0.28), BIN, cameras=CAMERAS[:1], confidence=0.7))
    assert np.allclose(track.thing.fit.centre[:2], (0.13, 0.28), atol=0.002)
    assert np.allclose(track.thing.size, known, atol=0.0005)
    assert track.tangents == tangents


def test_a_look_that_is_as_clear_tells_a_bin_s_size_anew():
    track = Track("bin", look_at_bin((0.1, 0.3), BIN + [0.008, 0.0, 0.0]))
    for _ in range(8):
        update_from(track, look_at_bin((0.1, 0.3), BIN))
    assert np.allclose(track.thing.fit.sizes, BIN, atol=0.003)


def test_a_corner_of_it_is_no_reason_to_doubt_what_was_clearly_seen():
    block = np.array([0.02, 0.02, 0.02])
    track = Track("block", replace(look_at_bin((0.1, 0.3), block), kind="box", size=tuple(block)))
    glimpse = look_at_bin((0.106, 0.3), block, cameras=CAMERAS[:1], tangents=6, confidence=0.05)
    update_from(track, replace(glimpse, kind="box", size=tuple(block)))
    assert track.confidence > 0.9
    assert np.allclose(track.thing.fit.centre[:2], (0.1, 0.3), atol=0.001)


def test_a_poor_look_elsewhere_is_reason_to_doubt():
    block = np.array([0.02, 0.02, 0.02])
    track = Track("block", replace(look_at_bin((0.1, 0.3), block), kind="box", size=tuple(block)))
    glimpse = look_at_bin((0.13, 0.3), block, cameras=CAMERAS[:1], tangents=6, confidence=0.05)
    update_from(track, replace(glimpse, kind="box", size=tuple(block)))
    assert track.confidence < 0.6


@pytest.mark.gl
def test_what_was_let_go_of_is_looked_for_below():
    with open_session("pick_can", perception="rgbd", sensor="realsense") as session:
        session.observe()
        seen = session.ctx.perception.things[0]

    def is_candidate(x, z):
        moved = replace(seen.fit, centre=seen.fit.centre + [x, 0.0, z])
        return bool(candidates(seen.group, [KnownShape(moved, seen.group, 40)]))

    assert is_candidate(0.0, 0.0) and is_candidate(0.0, 0.15)
    assert not is_candidate(0.0, -0.15) and not is_candidate(0.15, 0.0)


@pytest.mark.gl
def test_a_cube_that_the_hand_hid_is_known_again_where_it_was_pushed():
    with open_session("push_left", perception="rgbd", sensor="realsense") as session:
        session.reset(99)
        before = session.observe().find("red_cube")
        episode = session.run()
        after = session.observe().find("red_cube")
        true = session.simulation.truth().objects["red_cube"].pose.position
    assert episode.success and not episode.replans
    assert before is not None and after is not None
    assert np.linalg.norm(after.pose.position - true) < 0.004
    assert np.abs(np.subtract(after.size, before.size)).max() < 0.002


@pytest.mark.parametrize("beside", [False, True])
def test_a_stranger_that_comes_to_look_like_what_was_lost_is_that(beside):
    tracker = Tracker()
    thing = look_at_bin((0.1, 0.3), BIN)
    tracker.lost["red_bin"] = Track("red_bin", thing)
    tracker.tracks["red_bin_2"] = Track("red_bin_2", look_at_bin((0.2, 0.1), BIN))
    tracker.strangers["red_bin_2"] = {"red_bin"} if beside else set()
    tracker.update([look_at_bin((0.2, 0.1), BIN)], FrameSet(by_camera={}, table=TablePrior(TABLE)), (), [np.ones(3)])
    assert [*tracker.tracks] == (["red_bin_2"] if beside else ["red_bin"])


def test_what_is_seen_too_small_to_be_does_not_break_the_world_to_plan_in():
    with open_session("put_in_bin") as session:
        scenes = PlanningScenes(session.task.scene)
        seen = session.observe()
        cube, phantom = (
            seen.objects[0],
            DetectedObject(
                id="phantom",
                kind="box",
                size=(0.02, 0.0, 0.02),
                colour="red",
                rgba=(1.0, 0.0, 0.0, 1.0),
                pose=Pose(xyz=(0.2, 0.3, 0.06)),
            ),
        )
        planning = scenes.of(replace(seen, objects=(cube, phantom)))
        assert planning.body(cube.id) is not None and planning.body("phantom") is not None


def in_a_bin(rgb, kind="box"):
    """Return a small thing that stands in a bin at (0.1, 0.3), as seen."""
    size = np.array([0.02, 0.02, 0.02])
    return replace(look_at_bin((0.12, 0.3), size, confidence=0.7), kind=kind, size=tuple(size), rgb=np.array(rgb))


@pytest.mark.parametrize(
    ("bin_is_known", "rgb", "kind", "is_new"),
    [
        (True, (0.95, 0.85, 0.15), "box", False),
        (True, (0.1, 0.2, 0.9), "box", True),
        (True, (0.1, 0.2, 0.9), "bin", False),
        (False, (0.95, 0.85, 0.15), "box", True),
    ],
)
def test_a_piece_of_what_lies_in_a_known_bin_is_no_new_thing(bin_is_known, rgb, kind, is_new):
    tracker = Tracker()
    tracker.tracks["red_bin"] = Track("red_bin", look_at_bin((0.1, 0.3), BIN))
    tracker.tracks["lemon"] = Track("lemon", in_a_bin((1.0, 0.8, 0.1)))
    known = frozenset(tracker.tracks) if bin_is_known else frozenset()
    assert tracker._is_known_inside(in_a_bin(rgb, kind), known) is not is_new


def cube_at(x, y):
    """Return a cube in the bin as seen."""
    thing = look_at_bin((x, y), np.array([0.016, 0.016, 0.016]))
    return replace(thing, kind="box")


@pytest.mark.parametrize(
    ("shift", "cube_shift", "stays"),
    [
        ((-0.02, 0.0), (0.0, 0.0), True),
        ((-0.02, 0.0), (-0.02, 0.0), False),
        ((-0.003, 0.0), (0.0, 0.0), False),
        ((0.02, 0.0), (0.0, 0.0), False),
    ],
)
def test_a_bin_does_not_move_away_over_what_lies_in_it(shift, cube_shift, stays):
    # The cube lies in the corner at +x, +y.
    track = Track("bin", look_at_bin((0.1, 0.3), BIN))
    corner = Track("cube", cube_at(0.152, 0.352))
    looked = look_at_bin((0.1 + shift[0], 0.3 + shift[1]), BIN, confidence=0.62)
    again = cube_at(0.152 + cube_shift[0], 0.352 + cube_shift[1])
    assert is_its_contents(track, looked, [(track, looked), (corner, again)]) is stays
