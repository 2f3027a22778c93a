"""Inverse kinematics on random reachable poses: how many are solved, and how fast.

    python benchmarks/ik.py [--poses 10000] [--json]

A pose is reachable because a random configuration within the joint limits gave it. Every solve starts at home.
"""

from __future__ import annotations

import argparse
import json
import math
import time

import numpy as np

from robosandbox.robots.kinematics import Kinematics
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.types import Scene

POSITION_TOLERANCE = 1e-3
ORIENTATION_TOLERANCE = math.radians(0.5)


def measure(poses: int, seed: int) -> dict[str, object]:
    with MuJoCoBackend() as sim:
        sim.load(Scene())
        robot = sim.robot
        solver = Kinematics.of(
            sim.model,
            robot,
            position_tolerance=POSITION_TOLERANCE,
            orientation_tolerance=ORIENTATION_TOLERANCE,
        )
        rng = np.random.default_rng(seed)
        seconds, solved = [], 0
        for _ in range(poses):
            position, rotation = solver.forward(rng.uniform(robot.lower, robot.upper))
            begin = time.perf_counter()
            solution = solver.solve(position, rotation, robot.home_q)
            seconds.append(time.perf_counter() - begin)
            found, turned = solver.forward(solution.q)
            cosine = (np.trace(turned.T @ rotation) - 1.0) / 2.0
            angle = math.acos(min(1.0, max(-1.0, cosine)))
            # Judged afresh from the answer, not from what the solver says of itself.
            right = np.linalg.norm(found - position) <= POSITION_TOLERANCE and angle <= ORIENTATION_TOLERANCE + 1e-6
            within = bool(((solution.q >= robot.lower) & (solution.q <= robot.upper)).all())
            solved += bool(right and within)
        milliseconds = 1000.0 * np.array(seconds)
        return {
            "robot": robot.name,
            "poses": poses,
            "solved": solved,
            "rate": solved / poses,
            "median_ms": round(float(np.median(milliseconds)), 3),
            "p99_ms": round(float(np.percentile(milliseconds, 99)), 3),
            "max_ms": round(float(milliseconds.max()), 3),
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    result = measure(arguments.poses, arguments.seed)
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        for key, value in result.items():
            print(f"{key:12} {value}")


if __name__ == "__main__":
    main()
