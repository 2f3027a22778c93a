"""What each named number of perception decides: looks at the same frames with the number halved and doubled.

    uv run benchmarks/sensitivity.py segments fit --scenes 40

Frames are of random scenes, as in `benchmarks/perception.py`, and of the bundled tasks with drawers, cups and beads. A row
says how many visible objects are found, at the right kind and colour, how many detections are of nothing, and how large the
errors are, as it is and with one number changed; rows that equal the first are left out and named at the end. What only
several looks decide (tracking, what is held) does not show here.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np

# The benchmark beside this file.
from perception import Case, Visibility, _compare, random_scene  # noqa: TID251
from robosandbox.perception.factory import Setup
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.sensors import find_sensor
from robosandbox.tasks.bundled import bundled_tasks
from robosandbox.types import DetectedObject, RgbdFrame
from robosandbox.workcell.session import open_session

_LEAST_VISIBLE = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Frames of a scene, and what there is to see in them."""

    seed: int
    setup: Setup
    frames: list[RgbdFrame]
    truth: list[DetectedObject]
    shares: dict[str, float]


def looks(scenes: int, sensor: str) -> Iterator[Look]:
    """Yield looks at random scenes, and at every bundled task."""
    for seed in range(scenes):
        with MuJoCoBackend(sensor=find_sensor(sensor)) as sim:
            sim.load(random_scene(seed))
            yield _look(seed, sim, Setup())
    for number, name in enumerate(bundled_tasks()):
        with open_session(name, sensor=sensor) as session:
            yield _look(1000 + number, session.mujoco, Setup.of(session.task.scene))


def _look(seed: int, sim: MuJoCoBackend, setup: Setup) -> Look:
    visibility = Visibility(sim)
    shares = visibility.of()
    visibility.close()
    truth = [item.detected() for item in sim.truth().objects.values() if item.id in shares]
    frames = [sim.capture(camera) for camera in sim.capabilities.cameras]
    return Look(seed=seed, setup=setup, frames=frames, truth=truth, shares=shares)


def score(seen: list[Look]) -> str:
    """Return how well the looks' objects are seen, as a row."""
    cases: list[Case] = []
    false = 0
    for look in seen:
        things = [t for t in RgbdPerception(setup=look.setup).look(look.frames) if t.confidence >= 0.25]
        found, wrong = _compare(look.seed, look.truth, look.shares, things)
        cases += found
        false += wrong
    visible = [case for case in cases if case.visible >= _LEAST_VISIBLE]
    met = [case for case in visible if case.found]
    errors = [np.nanpercentile([getattr(c, name) for c in met], 95) for name in ("position_mm", "size_mm", "yaw_deg")]
    return (
        f"found {len(met)}/{len(visible)}, kind {sum(c.seen_kind == c.kind for c in met)}, colour {sum(c.colour for c in met)}, "
        f"of nothing {false}; p95 {errors[0]:.2f} mm, size {errors[1]:.2f} mm, yaw {errors[2]:.2f} deg"
    )


def changed(value: Any, factor: float) -> Any:
    """Return a number, or each of several, times a factor; whole numbers stay whole and at least 1."""
    if isinstance(value, tuple):
        return tuple(changed(each, factor) for each in value)
    if isinstance(value, int):
        return max(1, round(value * factor))
    return value * factor


@contextmanager
def changed_constant(name: str, value: Any, other: Any) -> Iterator[None]:
    """Put another value in a constant's place, in every module that imported it."""
    holders = [
        module
        for key, module in list(sys.modules.items())
        if key.startswith("robosandbox") and getattr(module, name, None) is value
    ]
    for module in holders:
        setattr(module, name, other)
    try:
        yield
    finally:
        for module in holders:
            setattr(module, name, value)


def measure(module: ModuleType, score: Callable[[], str], before: str, tell: Callable[[str], None]) -> None:
    """Tell what each constant of a module changes in a score."""
    file = Path(str(module.__file__))
    assigned = [node.targets[0] for node in ast.parse(file.read_text("utf-8")).body if isinstance(node, ast.Assign)]
    names = [target.id for target in assigned if isinstance(target, ast.Name) and target.id.isupper()]
    idle = []
    for name in names:
        value, rows = getattr(module, name), []
        if not all(type(number) in (int, float) for number in (value if isinstance(value, tuple) else (value,))):
            continue
        for factor in (0.5, 2.0):
            with changed_constant(name, value, changed(value, factor)):
                try:
                    rows.append((factor, score()))
                except (ArithmeticError, ValueError, IndexError, cv2.error, np.linalg.LinAlgError) as error:
                    rows.append((factor, f"{type(error).__name__}: {error}"))
        if all(row == before for _, row in rows):
            idle.append(name)
        for factor, row in rows if name not in idle else ():
            tell(f"{file.stem}.{name} = {value} x {factor:g}: {'as before' if row == before else row}")
    tell(f"{file.stem}: nothing changes with {', '.join(idle) or 'none'}")


def main() -> int:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="+", help="of robosandbox.perception, such as segments")
    parser.add_argument("--scenes", type=int, default=40, help="random scenes")
    parser.add_argument("--sensor", default="realsense")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    seen = list(looks(options.scenes, options.sensor))
    before = score(seen)
    print(f"as it is: {before}", flush=True)
    for name in options.modules:
        module = importlib.import_module(f"robosandbox.perception.{name}")
        measure(module, lambda: score(seen), before, lambda row: print(row, flush=True))
    return 0


if __name__ == "__main__":
    sys.exit(main())
