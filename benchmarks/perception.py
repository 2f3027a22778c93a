"""How well RGB-D perception sees: random scenes of 1 to 8 objects, one look each, measured against the simulated state.

    uv run benchmarks/perception.py --seeds 100 --sensor realsense
    uv run benchmarks/perception.py --seeds 50 --sensor webcam --perception rgb --cameras scene top

An object counts as visible when some camera shows 40 pixels of it or more and at least 40 % of its outline. Precision is
the share of detections that are of a visible or partly hidden object; recall the share of visible objects that were
detected with the right shape or a like one within 40 mm. CPU time is of one core, without rendering, of a look through
cameras that were looked through before; the first one also makes what depends on robot and lenses alone. `rgb` sees without
depth, and is told the sizes of the objects, as by a task; with `--undescribed` it is not. `rgbd` is never told.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

os.environ.setdefault("MUJOCO_GL", "egl")
# What is measured is one core's time; NumPy's linear algebra reads this once, when it is loaded.
os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import cv2
import mujoco
import numpy as np
from odd_judge import raw_state
from scipy.optimize import linear_sum_assignment

from robosandbox.perception.colour import COLOURS, colour_name
from robosandbox.perception.factory import Setup
from robosandbox.perception.rgb import RgbPerception
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.perception.thing import Thing
from robosandbox.perception.track import Track
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.rendering import OffscreenRenderer
from robosandbox.sim.sensors import FRAME_SIZE, SENSORS, find_sensor
from robosandbox.types import DetectedObject, ObjectKind, Pose, Scene, SceneObject
from robosandbox.world.relations import bottom, centre, gap, support

_MATCH = 0.04
_LEAST_PIXELS = 40
_LEAST_VISIBLE = 0.4
_SPACING = 0.012
_TABLE = 0.04
_STACKED = 0.12
_KINDS: tuple[ObjectKind, ...] = ("box", "box", "box", "cylinder", "cylinder", "sphere", "bin")


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One true object and how it was seen."""

    seed: int
    id: str
    kind: str
    distance: float
    visible: float
    found: bool
    seen_kind: str = ""
    position_mm: float = float("nan")
    size_mm: float = float("nan")
    yaw_deg: float = float("nan")
    colour: bool = False
    confidence: float = 0.0


def random_scene(seed: int) -> Scene:
    """Return a scene of 1 to 8 objects apart from one another, now and then one on another."""
    rng = np.random.default_rng([seed, 7])
    objects: list[SceneObject] = []
    count = int(rng.integers(1, 9))
    for _ in range(400):
        if len(objects) == count:
            break
        item = _random_object(rng, len(objects), objects)
        if item is not None:
            objects.append(item)
    return Scene(objects=tuple(objects))


def _random_object(rng: np.random.Generator, number: int, others: list[SceneObject]) -> SceneObject | None:
    kind: ObjectKind = _KINDS[int(rng.integers(len(_KINDS)))]
    word = list(COLOURS)[int(rng.integers(len(COLOURS)))]
    sample = COLOURS[word][int(rng.integers(len(COLOURS[word])))]
    rgb = np.clip(np.array(sample) + rng.uniform(-0.04, 0.04, 3), 0.0, 1.0)
    if colour_name([*rgb]) != word:
        rgb = np.array(sample)
    yaw = rng.uniform(-np.pi, np.pi)
    rotation = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    size: tuple[float, ...]
    match kind:
        case "box":
            size = tuple(rng.uniform(0.012, 0.04, 3)) if rng.random() < 0.6 else (float(rng.uniform(0.012, 0.03)),) * 3
        case "cylinder":
            size = (float(rng.uniform(0.013, 0.035)), float(rng.uniform(0.015, 0.06)))
            if rng.random() < 0.3:
                rotation = rotation @ np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        case "sphere":
            size = (float(rng.uniform(0.015, 0.035)),)
        case _:
            size = (float(rng.uniform(0.045, 0.08)), float(rng.uniform(0.045, 0.08)), float(rng.uniform(0.035, 0.06)))
    base = [other for other in others if other.kind == "box" and min(other.size[:2]) > 0.024]
    x, y = rng.uniform(-0.02, 0.42), rng.uniform(-0.38, 0.38)
    height = _TABLE
    on = None
    if base and kind in ("box", "cylinder") and rng.random() < _STACKED:
        on = base[0]
        x, y = on.pose.xyz[:2]
        height = on.pose.xyz[2] + on.size[2]
    elif not 0.24 < float(np.hypot(x + 0.3, y)) < 0.76:
        return None
    seen = _as_seen(kind, size, Pose.from_matrix(np.array([x, y, height]), rotation))
    z = height - bottom(seen) + height + 0.0005
    pose = Pose.from_matrix(np.array([x, y, z]), rotation)
    seen = _as_seen(kind, size, pose)
    for other in others:
        if other is not on and gap(seen, _as_seen(other.kind, other.size, other.pose)) < _SPACING:
            return None
    if on is not None and (
        size[0] > min(on.size[:2]) or len([o for o in others if o.pose.xyz[:2] == on.pose.xyz[:2]]) > 1
    ):
        return None
    return SceneObject(
        id=f"{word}_{kind}_{number}", kind=kind, size=size, pose=pose, rgba=(*map(float, rgb), 1.0), mass=0.1
    )


def _as_seen(kind: ObjectKind, size: tuple[float, ...], pose: Pose) -> DetectedObject:
    return DetectedObject(id="", kind=kind, size=size, colour="", rgba=(0.0, 0.0, 0.0, 1.0), pose=pose)


class Visibility:
    """How much of each object the cameras show, by drawing the simulated state in false colours."""

    def __init__(self, sim: MuJoCoBackend) -> None:
        self._sim = sim
        self._renderer = OffscreenRenderer(sim.model, FRAME_SIZE)
        frames = [sim.capture(camera) for camera in sim.capabilities.cameras]
        self._lenses = {frame.camera: (frame.intrinsics, frame.pose_camera_in_world) for frame in frames}

    def of(self) -> dict[str, float]:
        """Return the largest share of its outline that some camera shows, 0 below the least pixels."""
        data = raw_state(self._sim, mujoco.MjData(self._sim.model))
        shares: dict[str, float] = defaultdict(float)
        for camera in self._sim.capabilities.cameras:
            bodies = self._renderer.bodies(data, self._sim.camera_in_model(camera))
            for name, body in self._sim.object_bodies.items():
                pixels = int((bodies == body).sum())
                whole = self._outline(camera, self._sim.truth().objects[name].detected())
                if pixels >= _LEAST_PIXELS:
                    shares[name] = max(shares[name], min(1.0, pixels / whole))
        return {name: shares[name] for name in self._sim.object_bodies}

    def _outline(self, camera: str, item: DetectedObject) -> float:
        lens, pose = self._lenses[camera]
        rng = np.random.default_rng(0)
        directions = rng.standard_normal((400, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        reach = support(item, directions)
        # Points of the hull: where its planes meet rays from the middle.
        middle = centre(item)
        rays = directions
        lengths = ((reach - directions @ middle)[:, None] / np.maximum(directions @ rays.T, 1e-9)).min(axis=0)
        local = (middle + rays * lengths[:, None] - pose.position) @ pose.rotation
        if (local[:, 2] < 0.02).any():
            return np.inf
        pixels = local[:, :2] / local[:, 2:] * [lens.fx, lens.fy] + [lens.cx, lens.cy]
        return max(1.0, float(cv2.contourArea(cv2.convexHull(pixels.astype(np.float32)))))

    def close(self) -> None:
        """Free the drawing context."""
        self._renderer.close()


def measure(
    seeds: range,
    sensor: str,
    *,
    own_seed: bool = True,
    eyes_of: Callable[[Scene], RgbdPerception] = lambda scene: RgbdPerception(),
    cameras: Sequence[str] = (),
) -> Iterator[tuple[list[Case], int, int, float, float]]:
    """Yield each scene's cases, its false and all detections, and CPU seconds a frame of the first look and of another."""
    for seed in seeds:
        scene = random_scene(seed)
        preset = find_sensor(sensor)
        from dataclasses import replace

        with MuJoCoBackend(sensor=replace(preset, seed=seed) if own_seed else preset) as sim:
            sim.load(scene)
            visibility = Visibility(sim)
            shares = visibility.of()
            visibility.close()
            eyes = eyes_of(scene)
            frames = [sim.capture(camera) for camera in cameras or sim.capabilities.cameras]
            begin = time.process_time()
            things = eyes.look(frames)
            first = time.process_time()
            eyes.look(frames)
            again = time.process_time()
            things = [thing for thing in things if thing.confidence >= 0.25]
            truth = [item.detected() for item in sim.truth().objects.values()]
            yield (
                *_compare(seed, truth, shares, things),
                len(things),
                (first - begin) / len(frames),
                (again - first) / len(frames),
            )


def _compare(
    seed: int, truth: list[DetectedObject], shares: dict[str, float], things: list[Thing]
) -> tuple[list[Case], int]:
    seen = [Track(str(number), thing, confidence=thing.confidence).detected() for number, thing in enumerate(things)]
    pairs: dict[int, int] = {}
    if seen and truth:
        far = np.array([[float(np.linalg.norm(centre(a) - centre(b))) for b in seen] for a in truth])
        rows, columns = linear_sum_assignment(np.minimum(far, 1.0))
        pairs = {int(r): int(c) for r, c in zip(rows, columns, strict=True) if far[r, c] < _MATCH}
    cases = []
    base = np.array([-0.3, 0.0])
    for number, item in enumerate(truth):
        share = shares[item.id]
        distance = float(np.hypot(*(item.pose.position[:2] - base)))
        if number not in pairs:
            cases.append(Case(seed=seed, id=item.id, kind=item.kind, distance=distance, visible=share, found=False))
            continue
        other = seen[pairs[number]]
        cases.append(
            Case(
                seed=seed,
                id=item.id,
                kind=item.kind,
                distance=distance,
                visible=share,
                found=True,
                seen_kind=other.kind,
                position_mm=1e3 * float(np.linalg.norm(centre(item) - centre(other))),
                size_mm=1e3 * float(np.abs(item.shape.extents(item.size) - other.shape.extents(other.size)).mean()),
                yaw_deg=_yaw_error(item, other),
                colour=colour_name(item.rgba) == other.colour,
                confidence=other.confidence,
            )
        )
    return cases, len(seen) - len(pairs)


def _yaw_error(item: DetectedObject, other: DetectedObject) -> float:
    """Return by how much the heading is off, degrees; not a number where there is none."""
    if item.kind != other.kind:
        return float("nan")
    if item.kind in ("box", "bin"):
        turn = np.degrees(item.pose.yaw - other.pose.yaw)
        return float(abs((turn + 45.0) % 90.0 - 45.0))
    if item.kind == "cylinder":
        axes = [each.pose.rotation[:, 2] for each in (item, other)]
        if max(abs(axis[2]) for axis in axes) > 0.5:
            return float("nan")
        return float(np.degrees(np.arccos(np.clip(abs(axes[0] @ axes[1]), 0.0, 1.0))))
    return float("nan")


def summarize(
    cases: list[Case], false: int, detections: int, spent: list[float], scenes: int, first: list[float] | None = None
) -> dict[str, Any]:
    """Return the figures; `spent` and `first` are CPU seconds a frame of looks and, if measured, of first looks."""
    visible = [case for case in cases if case.visible >= _LEAST_VISIBLE]
    return {
        "scenes": scenes,
        "objects": len(cases),
        "visible": len(visible),
        "precision": 1.0 - false / max(detections, 1),
        "recall": float(np.mean([case.found for case in visible])) if visible else float("nan"),
        "all": _figures(visible),
        "by_shape": {
            kind: _figures([c for c in visible if c.kind == kind]) for kind in sorted({c.kind for c in cases})
        },
        "by_distance_m": {
            f"{low:.1f}-{low + 0.2:.1f}": _figures([c for c in visible if low <= c.distance < low + 0.2])
            for low in (0.2, 0.4, 0.6)
        },
        "by_visible_share": {
            f"{low:.1f}-{high:.1f}": _figures([c for c in cases if low <= c.visible < high])
            for low, high in ((0.0, 0.4), (0.4, 0.7), (0.7, 0.9), (0.9, 1.01))
        },
        "cpu_ms_per_frame": _per_frame(spent),
        **({"first_look_cpu_ms_per_frame": _per_frame(first)} if first else {}),
    }


def _per_frame(seconds: list[float]) -> dict[str, float]:
    median, p95 = 1e3 * np.percentile(seconds, [50, 95])
    return {"median": float(median), "p95": float(p95)}


def _figures(cases: list[Case]) -> dict[str, float]:
    found = [case for case in cases if case.found]
    if not found:
        return {"objects": len(cases), "recall": 0.0 if cases else float("nan")}

    def at(name: str, percent: float) -> float:
        values = [getattr(case, name) for case in found if np.isfinite(getattr(case, name))]
        return round(float(np.percentile(values, percent)), 2) if values else float("nan")

    return {
        "objects": len(cases),
        "recall": round(len(found) / len(cases), 4),
        "kind": round(float(np.mean([case.seen_kind == case.kind for case in found])), 4),
        "position_mm_median": at("position_mm", 50),
        "position_mm_p95": at("position_mm", 95),
        "size_mm_median": at("size_mm", 50),
        "size_mm_p95": at("size_mm", 95),
        "yaw_deg_median": at("yaw_deg", 50),
        "yaw_deg_p95": at("yaw_deg", 95),
        "colour": round(float(np.mean([case.colour for case in found])), 4),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--sensor", choices=sorted(SENSORS), default="realsense")
    parser.add_argument("--perception", choices=["rgbd", "rgb"], default="rgbd")
    parser.add_argument("--cameras", nargs="*", default=[], help="those that are looked through; else all")
    parser.add_argument("--undescribed", action="store_true", help="tell rgb nothing of the objects")
    parser.add_argument("--json", metavar="FILE", help="the figures and every case; '-' is stdout")
    parser.add_argument("--misses", action="store_true", help="print each object that was missed or badly seen")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    cases: list[Case] = []
    false = detections = 0
    spent, first = [], []
    seeds = range(options.first, options.first + options.seeds)

    def eyes_of(scene: Scene) -> RgbdPerception:
        if options.perception == "rgbd":
            return RgbdPerception()
        return RgbPerception() if options.undescribed else RgbPerception(setup=Setup.of(scene))

    looks = measure(seeds, options.sensor, eyes_of=eyes_of, cameras=options.cameras)
    for found, wrong, count, first_seconds, seconds in looks:
        cases += found
        false += wrong
        detections += count
        spent.append(seconds)
        first.append(first_seconds)
        if options.misses:
            for case in found:
                bad = (
                    not case.found
                    or case.position_mm > 8
                    or case.size_mm > 6
                    or not case.colour
                    or case.kind != case.seen_kind
                )
                if case.visible >= _LEAST_VISIBLE and bad:
                    print(json.dumps(asdict(case)), file=sys.stderr)
            if wrong:
                print(f"seed {found[0].seed}: {wrong} false", file=sys.stderr)
    figures = summarize(cases, false, detections, spent, options.seeds, first)
    document = json.dumps({**figures, "sensor": options.sensor, "cases": [asdict(case) for case in cases]})
    if options.json == "-":
        print(document)
    else:
        if options.json:
            with open(options.json, "w", encoding="utf-8") as file:
                file.write(document)
        print(json.dumps(figures, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
