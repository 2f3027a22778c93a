"""How well tags tell identical things apart: random scenes of 2 to 4 equal cubes with a tag each, one look from home.

    uv run benchmarks/tags.py --seeds 50 --sensor realsense

A cube is right where what is called by its id is seen within 20 mm of it. `read` are the tags that a camera shows whole
and that are read in its picture alone, by how many pixels the shorter side of their black square has there. `--plain`
looks at the same scenes without tags.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections import defaultdict
from dataclasses import replace
from typing import Any

os.environ.setdefault("MUJOCO_GL", "egl")
os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import cv2
import numpy as np

from robosandbox.perception.colour import COLOURS, colour_name
from robosandbox.perception.factory import Setup
from robosandbox.perception.frame import PointCloudFrame, TablePrior, make_frame
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.perception.tags import find_tags
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.sim.sensors import FRAME_SIZE, SENSORS, find_sensor
from robosandbox.tags import BORDERED, TAG_COUNT
from robosandbox.types import Array, Pose, Scene, SceneObject

_RIGHT = 0.02
_TABLE = 0.04
_BIN = 4.0


def random_scene(seed: int, smallest: float, largest: float) -> Scene:
    """Return a scene of 2 to 4 cubes of one size and colour, edges in metres, each with a number of its own."""
    rng = np.random.default_rng([seed, 36])
    count, edge = int(rng.integers(2, 5)), float(rng.uniform(smallest, largest))
    numbers = rng.permutation(TAG_COUNT)[:count]
    samples = [sample for word in COLOURS.values() for sample in word]
    rgb = samples[int(rng.integers(len(samples)))]
    places: list[tuple[float, float]] = []
    while len(places) < count:
        x, y = rng.uniform(0.0, 0.4), rng.uniform(-0.35, 0.35)
        apart = all(np.hypot(x - a, y - b) > 1.45 * edge + 0.012 for a, b in places)
        if 0.27 < np.hypot(x + 0.3, y) < 0.74 and apart:
            places.append((float(x), float(y)))
    objects = []
    for k, (x, y) in enumerate(places):
        yaw = rng.uniform(-np.pi, np.pi)
        turn = (0.0, 0.0, float(np.sin(yaw / 2.0)), float(np.cos(yaw / 2.0)))
        pose = Pose(xyz=(x, y, _TABLE + edge / 2.0 + 0.0005), quat_xyzw=turn)
        objects.append(
            SceneObject(
                id=f"cube_{k}", kind="box", size=(edge / 2.0,) * 3, pose=pose, rgba=(*rgb, 1.0), tag=int(numbers[k])
            )
        )
    return Scene(objects=tuple(objects))


def measure(seed: int, sensor: str, smallest: float, largest: float, plain: bool) -> dict[str, Any]:
    """Return what one look at one scene gives."""
    scene = random_scene(seed, smallest, largest)
    told = scene
    if plain:
        told = scene.model_copy(
            update={"objects": tuple(item.model_copy(update={"tag": None}) for item in scene.objects)}
        )
    with MuJoCoBackend(sensor=replace(find_sensor(sensor), seed=seed)) as sim:
        sim.load(told)
        eyes = RgbdPerception(setup=Setup.of(told))
        seen = {item.id: item for item in eyes.perceive(sim).objects}
        frames = [sim.capture(camera) for camera in sim.cameras]
        begin = time.process_time()
        eyes.look(frames)
        spent = time.process_time() - begin
        true = {name: item.pose.position for name, item in sim.truth().objects.items()}
        right = [
            name in seen and float(np.linalg.norm(seen[name].pose.position - place)) < _RIGHT
            for name, place in true.items()
        ]
        return {
            "cubes": len(true),
            "things": len(seen),
            "right": sum(right),
            "colour": sum(item.colour == colour_name(scene.objects[0].rgba) for item in seen.values()),
            "cpu_ms_per_frame": 1e3 * spent / len(frames),
            "reads": [] if plain else _reads(sim, eyes, scene),
        }


def _reads(sim: MuJoCoBackend, eyes: RgbdPerception, scene: Scene) -> list[tuple[str, float, bool]]:
    """Return the camera, the pixels and whether it was read, of each tag that a camera shows whole."""
    renderer, found = OffscreenRenderer(sim.model, FRAME_SIZE), []
    table = TablePrior(scene.table_height)
    for camera in sim.cameras:
        segmented = eyes.frames.by_camera[camera]
        rgbd = segmented.frame.rgbd
        frame = make_frame(rgbd, table, segmented.robot)
        numbers = {
            tag.number for tag in find_tags(frame, table, segmented.robot, [item.tag_edge for item in scene.objects])
        }
        bodies = renderer.bodies(sim._live, sim.camera_in_model(camera))
        for item in scene.objects:
            pixels = _shown(frame, bodies == sim.object_bodies[item.id], item, sim.truth().objects[item.id].pose)
            if pixels is not None:
                found.append((camera, pixels, item.tag in numbers))
    renderer.close()
    return found


def _shown(frame: PointCloudFrame, own: Array, item: SceneObject, pose: Pose) -> float | None:
    """Return how many pixels the shorter side of a tag has, None where its border is not all in sight."""
    along = np.linspace(-1.0, 1.0, 7) * item.tag_edge / 2.0
    places = np.array([[x * BORDERED, y * BORDERED, item.size[2]] for x in along for y in along])
    pixels, _ = frame.project(pose.position + places @ pose.rotation.T)
    columns, rows = np.rint(pixels).astype(int).T
    height, width = own.shape
    if min(columns.min(), rows.min()) < 0 or columns.max() >= width or rows.max() >= height:
        return None
    if float(own[rows, columns].mean()) < 0.97:
        return None
    ends = np.array([[x, y, item.size[2]] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]) * [
        item.tag_edge / 2.0,
        item.tag_edge / 2.0,
        1.0,
    ]
    corners, _ = frame.project(pose.position + ends @ pose.rotation.T)
    area = float(cv2.contourArea(corners.astype(np.float32)))
    longest = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max())
    return area / longest


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--sensor", choices=sorted(SENSORS), default="realsense")
    parser.add_argument("--edges", type=float, nargs=2, default=(0.04, 0.06), metavar="M", help="of cubes, metres")
    parser.add_argument("--plain", action="store_true", help="the same scenes without tags")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    smallest, largest = options.edges
    scenes = []
    for seed in range(options.first, options.first + options.seeds):
        scene = measure(seed, options.sensor, smallest, largest, options.plain)
        scenes.append(scene)
        if scene["right"] < scene["cubes"] or scene["things"] != scene["cubes"]:
            told = {name: value for name, value in scene.items() if name != "reads"}
            print(f"seed {seed}: {told}", file=sys.stderr)
    by_camera: dict[str, list[bool]] = defaultdict(list)
    by_pixels: dict[float, list[bool]] = defaultdict(list)
    for scene in scenes:
        for camera, pixels, read in scene["reads"]:
            by_camera[camera].append(read)
            by_pixels[_BIN * (pixels // _BIN)].append(read)
    cubes = sum(scene["cubes"] for scene in scenes)
    figures = {
        "scenes": len(scenes),
        "cubes": cubes,
        "right": sum(scene["right"] for scene in scenes) / cubes,
        "things": sum(scene["things"] for scene in scenes),
        "colour": sum(scene["colour"] for scene in scenes) / cubes,
        "cpu_ms_per_frame": float(np.median([scene["cpu_ms_per_frame"] for scene in scenes])),
        "read_by_camera": {name: f"{sum(reads)} of {len(reads)}" for name, reads in sorted(by_camera.items())},
        "read_by_pixels": {
            f"{low:g}-{low + _BIN:g}": f"{sum(reads)} of {len(reads)}" for low, reads in sorted(by_pixels.items())
        },
    }
    print(json.dumps(figures, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
