"""A camera that is pushed aside is noticed by what stands still; light, hands and things are no push."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pytest
from support.hidden_plant import PlantServer, PlantSim

from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.perception.camera_watch import CameraWatch
from robosandbox.perception.factory import Setup
from robosandbox.perception.frame import TablePrior, make_frame
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.perception.robot_mask import RobotMask
from robosandbox.sim.sensors import find_sensor
from robosandbox.tasks.loader import find_task
from robosandbox.types import RgbdFrame

pytestmark = pytest.mark.gl
TASK = "clear_to_bin"


class _Cameras(PlantServer):
    """Cameras of a plant that nobody asks over a socket."""

    def __init__(self, sensor: str) -> None:
        self.sim, self.blind, self.pushed = PlantSim.of(TASK, None, 0, 0.002), False, np.zeros(3)
        self.sim.world.sensor = find_sensor(sensor)

    def shot(self, camera: str) -> RgbdFrame:
        taken = self.do_capture(camera, None)
        assert isinstance(taken, RgbdFrame), taken
        return taken


@pytest.fixture(scope="module")
def watched() -> Callable[[CameraWatch, RgbdFrame], bool]:
    mask, table = RobotMask(PlanningScenes(find_task(TASK).scene).robot_shapes()), TablePrior(0.04)

    def has_moved(watch: CameraWatch, taken: RgbdFrame) -> bool:
        mask.place(taken.arms)
        robot, _ = mask.masks(taken)
        return watch.has_moved(make_frame(taken, table, robot), robot, table)

    return has_moved


@pytest.mark.parametrize("sensor", ["ideal", "realsense"])
@pytest.mark.parametrize("camera", ["scene", "top"])
def test_a_camera_that_is_pushed_along_the_table_is_noticed(
    watched: Callable[[CameraWatch, RgbdFrame], bool], sensor: str, camera: str
) -> None:
    cameras, watch = _Cameras(sensor), CameraWatch()
    assert not watched(watch, cameras.shot(camera)), "the first frame is what later ones are compared with"
    for turn in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
        cameras.do_push((0.03 * np.cos(turn), 0.03 * np.sin(turn), 0.0))
        assert watched(watch, cameras.shot(camera)), f"{np.degrees(turn):.0f} degrees"
    cameras.do_push((0.0, 0.0, 0.0))
    assert not watched(watch, cameras.shot(camera)), "it was put back"


def test_light_hands_and_things_are_no_push(watched: Callable[[CameraWatch, RgbdFrame], bool]) -> None:
    cameras, watch = _Cameras("realsense"), CameraWatch()
    first = cameras.shot("scene")
    assert not watched(watch, first)
    brighter = replace(first, rgb=np.clip(first.rgb * 1.25, 0, 255).astype(np.uint8))
    assert not watched(watch, brighter)
    rng = np.random.default_rng(0)
    for _ in range(12):
        # Somebody leans over: an arm of a striped sleeve from the picture's edge to anywhere in it.
        rgb, depth = first.rgb.copy(), first.depth.copy()
        end = int(rng.integers(0, 640)), int(rng.integers(0, 480))
        begin = int(rng.integers(0, 640)), int(rng.choice([0, 479]))
        for wide, colour in ((110, (190, 140, 120)), (70, (60, 60, 160)), (30, (230, 230, 230))):
            cv2.line(rgb, begin, end, colour, wide)
        cv2.line(depth, begin, end, 0.6, 110)
        assert not watched(watch, replace(first, rgb=rgb, depth=depth)), (begin, end)
    qpos = cameras.sim.world.model.joint("object/red_cube").qposadr[0]
    cameras.sim.data.qpos[qpos] += 0.04
    assert not watched(watch, cameras.shot("scene")), "a thing was pushed"


def test_a_pushed_camera_is_not_looked_through_and_that_is_told() -> None:
    cameras = _Cameras("ideal")
    task = find_task(TASK)
    eyes = RgbdPerception(setup=Setup(scene=task.scene), cameras=("scene", "top"))
    assert eyes.look([cameras.shot("scene"), cameras.shot("top")])
    cameras.do_push((0.0, 0.03, 0.0))
    assert not eyes.look([cameras.shot("scene"), cameras.shot("top")])
    assert [note.split()[0] for note in eyes.notes] == ["scene", "top"]
    assert all("put it back, or calibrate it" in note for note in eyes.notes)
