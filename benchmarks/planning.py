"""Joint moves in clutter: how many are found, how fast, and whether an independent walk along them touches anything.

    uv run benchmarks/planning.py [--problems 500] [--seed 0] [--json]
    uv run --group kinematics benchmarks/planning.py --beside-ompl

A problem is a random scene of boxes, cans and tall pillars with two free configurations whose straight way is blocked.
Only problems that a reference search of ten times the effort can solve are kept. `--beside-ompl` plans the same moves with
OMPL's RRT-Connect in place of the sampling of our own, too.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from collections.abc import Callable
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np

from robosandbox import Pose, Scene, SceneObject, open_session
from robosandbox.errors import CollisionError
from robosandbox.motion.collision import CollisionChecker
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.motion.sampling import find_knots
from robosandbox.types import Array, Trajectory
from robosandbox.workcell.embedded import EmbeddedWorkcell

_MM, _RAD = 0.001, np.radians(0.5)
_SCENES_OF = 10
_REFERENCE = partial(find_knots, ways=40_000, seed=2)


def clutter(rng: np.random.Generator) -> Scene:
    """Return a scene of eight low things and four pillars."""
    objects: list[SceneObject] = []
    spots: list[tuple[float, float]] = []
    while len(objects) < 12:
        x, y = float(rng.uniform(0.0, 0.4)), float(rng.uniform(-0.35, 0.35))
        if any(np.hypot(x - a, y - b) < 0.11 for a, b in spots):
            continue
        spots.append((x, y))
        pillar = len(objects) < 4
        half = float(rng.uniform(0.12, 0.2) if pillar else rng.uniform(0.02, 0.05))
        size = (0.025, 0.025, half)
        pose = Pose(xyz=(x, y, 0.041 + half))
        objects.append(SceneObject(id=f"thing_{len(objects)}", kind="box", size=size, pose=pose, mass=2.0))
    return Scene(objects=tuple(objects))


def free_configuration(session: EmbeddedWorkcell, motion: DLSMotionPlanner, rng: np.random.Generator) -> Array | None:
    """Return a configuration that points down among the things and touches nothing."""
    yaw = rng.uniform(-np.pi, np.pi)
    c, s = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
    position = np.array([rng.uniform(0.0, 0.4), rng.uniform(-0.35, 0.35), rng.uniform(0.08, 0.25)])
    try:
        q = motion.ik(Pose.from_matrix(position, rotation))
    except Exception:
        return None
    return None if motion.touch(q) else q


def walk_touches(checker: CollisionChecker, session: EmbeddedWorkcell, path: Array) -> int:
    """Return how many configurations touch, 1 mm of the TCP or 0.5 deg of a joint apart."""
    robot, data = session.mujoco.robot, checker.data
    touching = 0
    for first, second in itertools.pairwise(path):
        ends = []
        for q in (first, second):
            checker.touch(q)
            ends.append(robot.tcp(data)[0])
        steps = max(np.linalg.norm(ends[1] - ends[0]) / _MM, np.abs(second - first).max() / _RAD, 1.0)
        for fraction in np.linspace(0.0, 1.0, int(np.ceil(steps)) + 1):
            touch = checker.touch(first + fraction * (second - first))
            touching += touch is not None and touch.depth > 0.0
    return touching


def planned(
    motion: DLSMotionPlanner, start: Array, goal: Array, find: Callable[..., Array | None]
) -> Trajectory | None:
    """Return a joint move whose way is sampled by `find` where it has to be, or None."""
    try:
        with patch("robosandbox.motion.ik.find_knots", find):
            return motion.plan_joints(start, goal)
    except CollisionError:
        return None


def measure(problems: int, seed: int, find: Callable[..., Array | None]) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    times: list[float] = []
    solved = asked = touching = unsolvable = 0
    while asked < problems:
        with open_session(clutter(rng)) as session:
            motion = DLSMotionPlanner()
            scene = session.observe()
            motion.use(session.ctx.planning(scene), session.ctx.arm.state())
            motion.open_to(0.04)
            checker = CollisionChecker(
                session.mujoco.model, session.mujoco.robot, session.mujoco.body_names, clearance=0.0
            )
            for item in scene.objects:
                checker.place(session.mujoco.object_bodies[item.id], item.pose)
            gripper = session.mujoco.robot.gripper
            if gripper:
                checker.set_gripper(gripper.geometry.joint_for_aperture(0.04))
            found = 0
            for _ in range(400):
                if found >= _SCENES_OF or asked >= problems:
                    break
                start, goal = (free_configuration(session, motion, rng) for _ in range(2))
                if start is None or goal is None:
                    continue
                straight = start + np.linspace(0.0, 1.0, 80)[:, None] * (goal - start)
                if checker.first_touch(straight) is None:
                    continue
                begin = time.perf_counter()
                trajectory = planned(motion, start, goal, find)
                took = 1000.0 * (time.perf_counter() - begin)
                if trajectory is None and planned(motion, start, goal, _REFERENCE) is None:
                    unsolvable += 1
                    continue
                found += 1
                asked += 1
                times.append(took)
                if trajectory is not None:
                    solved += 1
                    touching += walk_touches(checker, session, trajectory.q) > 0
    return {
        "problems": asked,
        "solved": solved,
        "share": round(solved / asked, 4),
        "median_ms": round(float(np.median(times)), 1),
        "p95_ms": round(float(np.percentile(times, 95)), 1),
        "max_ms": round(max(times), 1),
        "paths_that_touch": touching,
        "left_out_as_unsolvable": unsolvable,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--beside-ompl", action="store_true")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    results = {"robosandbox": measure(arguments.problems, arguments.seed, find_knots)}
    if arguments.beside_ompl:
        from planning_ompl import find_knots as ompls

        results["ompl"] = measure(arguments.problems, arguments.seed, ompls)
    if arguments.json:
        print(json.dumps(results, indent=2))
        return
    for name, result in results.items():
        print(f"{'planner':24} {name}")
        print("\n".join(f"{key:24} {value}" for key, value in result.items()))


if __name__ == "__main__":
    main()
