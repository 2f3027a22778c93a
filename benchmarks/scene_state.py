"""Known scenes: how far off `rgbd` measures the things and parts of a scene's file when all of them are elsewhere than the file says.

    uv run benchmarks/scene_state.py [--scenes 40] [--first-seed 1400] [--sensor realsense]

`furnished_scenes.py` writes the files; things are put at random on the table, turned at random, and doors and drawers opened at random in the simulation, and
the perception, which has the file alone, looks once. Prints by thing and part how far off each is, what is not seen and what is taken for hidden.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
from furnished_scenes import drawn

from robosandbox.errors import InputError
from robosandbox.perception.factory import Setup, make_perception
from robosandbox.sim.intervention import Intervention
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import SceneObject
from robosandbox.workcell.session import open_session

# Times that a place is drawn for a thing that would be in another; metres from the table's edges.
_DRAWS, _FROM_EDGE = 60, 0.1


@dataclass
class Found:
    """Errors of things that are seen, metres, and of parts, mm or mrad; seconds of a look; numbers of things hidden and not seen."""

    things: list[float] = field(default_factory=list)
    parts: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    hidden: int = 0
    missing: int = 0


def scatter(sim: MuJoCoBackend, rng: np.random.Generator) -> None:
    """Put all things elsewhere on the table, and doors and drawers anywhere on their way."""
    world, model = sim.world, sim.world.model
    (x0, x1), (y0, y1) = world.scene.table_area
    with Intervention(sim).state() as data:
        for item in world.scene.objects:
            body = world.object_bodies.get(item.id)
            if body is None:
                continue
            joint = int(model.body_jntadr[body])
            if item.geometry is not None and item.geometry.joint is not None:
                if not _springs_back(item):
                    data.qpos[model.jnt_qposadr[joint]] = rng.uniform(*model.jnt_range[joint])
            elif not item.is_fixed:
                address = int(model.jnt_qposadr[joint])
                for _ in range(_DRAWS):
                    place = rng.uniform([x0 + _FROM_EDGE, y0 + _FROM_EDGE], [x1 - _FROM_EDGE, y1 - _FROM_EDGE])
                    yaw = rng.uniform(-np.pi, np.pi)
                    data.qpos[address : address + 2] = place
                    data.qpos[address + 3 : address + 7] = [np.cos(yaw / 2.0), 0.0, 0.0, np.sin(yaw / 2.0)]
                    mujoco.mj_forward(model, data)
                    if not any(body in model.geom_bodyid[one.geom] and one.dist < -0.002 for one in data.contact):
                        break
    sim.wait(1.0)


def _springs_back(item: SceneObject) -> bool:
    joint = None if item.geometry is None else item.geometry.joint
    return joint is not None and joint.stiffness > 0.0


def measure(seed: int, sensor: str, found: Found) -> None:
    """Look at one scattered scene and note how far off what is seen is."""
    with tempfile.TemporaryDirectory() as folder:
        path = drawn(seed).write(Path(folder))
        try:
            cell = open_session(scene=path, seed=0, sensor=sensor)
        except InputError as error:
            print(f"{seed}: {error}", file=sys.stderr)
            return
        with cell:
            scatter(cell.mujoco, np.random.default_rng(seed))
            eyes = make_perception("rgbd", Setup.of(cell.mujoco.world.scene))
            begun = time.perf_counter()
            seen = {item.id: item for item in eyes.perceive(eyes.view(cell.driver)).objects}
            found.seconds.append(time.perf_counter() - begun)
            for name, true in cell.mujoco.truth().objects.items():
                item = seen.get(name)
                if item is None:
                    found.missing += 1
                elif true.opening is not None:
                    found.parts.append(1e3 * abs((item.opening or 0.0) - true.opening))
                elif not item.is_fixed and item.confidence < 1.0:
                    found.hidden += 1
                elif not item.is_fixed:
                    found.things.append(float(np.linalg.norm(item.pose.position - true.pose.position)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=1400)
    parser.add_argument("--sensor", default="realsense")
    given = parser.parse_args()
    found = Found()
    for seed in range(given.first_seed, given.first_seed + given.scenes):
        measure(seed, given.sensor, found)
    for name, values, unit in (
        ("things", 1e3 * np.array(found.things), "mm"),
        ("parts", np.array(found.parts), "mm or mrad"),
    ):
        half, most, worst = np.percentile(values, [50, 90, 100])
        print(
            f"{name}: {len(values)}, off by {half:.1f} {unit} at the median, {most:.1f} at the 90th percentile, {worst:.1f} at the most"
        )
    print(
        f"hidden {found.hidden}, not seen {found.missing}; a look took {np.median(found.seconds):.2f} s at the median"
    )


if __name__ == "__main__":
    main()
