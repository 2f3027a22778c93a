"""The tempos side by side: simulated time, moving, CPU and forces of the same tasks and seeds.

    uv run --group timing benchmarks/tempo.py [--tasks pick_cube_franka put_in_bin] [--seeds 3] [--json]

`moving` is the time of all trajectories, `optimal` what TOPP-RA (the library toppra) takes for the same paths within all of the
robot's velocity and acceleration limits; without the library that column is empty. `worst` is the most that anything was
pressed that was not to be touched, `worst meant` what was to be moved, the grip apart; both are of all seeds.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from robosandbox import open_session
from robosandbox.apps.bench.contact_monitor import ContactMonitor
from robosandbox.motion.timing import spline
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.skills.events import Intended
from robosandbox.types import TEMPOS, Array, Trajectory
from robosandbox.workcell.embedded import EmbeddedWorkcell

_TASKS = ("pick_cube_franka", "put_in_bin", "stack_three", "clear_to_bin")
# Joint way between the knots of a trajectory's path, rad, and the points at which it is timed: what 5 ms of motion turn at most,
# three times over, and twice what the motion planner takes.
_KNOT, _GRID = 0.03, 200


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What the episodes of a task at a tempo came to, medians over the seeds but for the counts and forces."""

    task: str
    tempo: str
    seeds: int
    success: int
    claimed_otherwise: int
    simulated_s: float
    moving_s: float
    optimal_s: float | None
    cpu_s: float
    worst_n: float
    worst_meant_n: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One episode."""

    success: bool
    claimed: bool
    simulated: float
    moving: float
    optimal: float
    cpu: float
    worst: float
    worst_meant: float


def optimal_seconds(trajectory: Trajectory, velocity: Array, acceleration: Array) -> float:
    """Return what toppra takes for a trajectory's path, or nan without it."""
    if find_spec("toppra") is None:
        return float("nan")
    import toppra
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    toppra.setup_logging("ERROR")
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(trajectory.q, axis=0), axis=1))])
    if gone[-1] < 1e-6:
        return 0.0
    knots = np.searchsorted(gone, np.linspace(0.0, gone[-1], max(2, round(gone[-1] / _KNOT))))
    path = spline(trajectory.q[np.unique(np.minimum(knots, len(gone) - 1))], _GRID)
    way = toppra.SplineInterpolator(np.linspace(0.0, 1.0, _GRID), path)
    limits = [
        JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
        JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
    ]
    found: Any = TOPPRA(limits, way, gridpoints=np.linspace(0.0, 1.0, _GRID)).compute_trajectory(0.0, 0.0)
    return float(found.duration) if found is not None else float("nan")


def run(session: EmbeddedWorkcell, seed: int, monitor: ContactMonitor) -> Run:
    """Run an episode and reckon its motions afterwards."""
    session.reset(seed)
    monitor.reset()
    sim, robot = session.driver, session.driver.arms["arm"].spec
    motions: list[Trajectory] = []

    def hear(event: object) -> None:
        if isinstance(event, Intended) and isinstance(event.intent, Trajectory):
            motions.append(event.intent)

    leave = session.ctx.events.subscribe(hear)
    start, begin = sim.time, time.process_time()
    episode = session.run()
    cpu, simulated = time.process_time() - begin, sim.time - start
    leave()
    return Run(
        success=session.judge().success,
        claimed=episode.success,
        simulated=simulated,
        moving=sum(motion.duration for motion in motions),
        optimal=sum(optimal_seconds(motion, robot.velocity_limits, robot.acceleration_limits) for motion in motions),
        cpu=cpu,
        worst=monitor.worst_force,
        worst_meant=monitor.worst_intended_force,
    )


def measure(task: str, tempo: str, seeds: int) -> Result:
    """Run a task at a tempo."""
    with open_session(task, tempo=tempo) as session:
        sim = session.driver
        assert isinstance(sim, MuJoCoBackend)
        monitor = ContactMonitor(sim, session.agent.skills)
        session.ctx.events.subscribe(monitor.hear)
        # The first episode makes what later ones find.
        run(session, 0, monitor)
        runs = [run(session, seed, monitor) for seed in range(seeds)]
    optimal = float(np.median([one.optimal for one in runs]))
    return Result(
        task=task,
        tempo=tempo,
        seeds=seeds,
        success=sum(one.success for one in runs),
        claimed_otherwise=sum(one.success != one.claimed for one in runs),
        simulated_s=float(np.median([one.simulated for one in runs])),
        moving_s=float(np.median([one.moving for one in runs])),
        optimal_s=None if np.isnan(optimal) else optimal,
        cpu_s=float(np.median([one.cpu for one in runs])),
        worst_n=max(one.worst for one in runs),
        worst_meant_n=max(one.worst_meant for one in runs),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tasks", nargs="+", default=_TASKS)
    parser.add_argument("--tempos", nargs="+", default=list(TEMPOS), choices=list(TEMPOS))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    head = (
        "task",
        "tempo",
        "success",
        "simulated s",
        "moving s",
        "optimal s",
        "ratio",
        "CPU s",
        "worst N",
        "worst meant N",
    )
    if not options.json:
        print("| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    results = []
    for task in options.tasks:
        for tempo in options.tempos:
            row = measure(task, tempo, options.seeds)
            results.append(row)
            if not options.json:
                optimal = f"{row.optimal_s:.2f} | {row.moving_s / row.optimal_s:.2f}" if row.optimal_s else " | "
                otherwise = f", {row.claimed_otherwise} claimed otherwise" if row.claimed_otherwise else ""
                print(
                    f"| {task} | {tempo} | {row.success}/{row.seeds}{otherwise} | {row.simulated_s:.2f} | {row.moving_s:.2f} | "
                    f"{optimal} | {row.cpu_s:.2f} | {row.worst_n:.1f} | {row.worst_meant_n:.1f} |",
                    flush=True,
                )
    if options.json:
        print(json.dumps([asdict(row) for row in results], indent=1))


if __name__ == "__main__":
    main()
