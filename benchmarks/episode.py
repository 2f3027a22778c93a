"""What an episode costs beyond its physics: CPU time over the same number of bare mj_step calls, in one run.

    python benchmarks/episode.py [--task pick_cube_franka] [--episodes 20] [--json]

The bare side replays the controls of the same episode from the same state, one mj_step call a control tick, so both
sides do the same physics, grasp contacts included. Load and reset are left out on both.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time

import mujoco
import numpy as np

from robosandbox import open_session


def measure(task: str, episodes: int) -> dict[str, object]:
    with open_session(task) as session:
        sim = session.sim
        compilations = sim.compilations
        ratios, whole, bares, idles, steps = [], [], [], [], []
        for seed in range(episodes):
            session.reset(seed)
            start = sim.snapshot()
            controls: list[np.ndarray] = []
            end = sim.subscribe(lambda log=controls: log.append(sim.controls))
            session.run()
            end()
            session.reset(seed)
            begin = time.process_time()
            episode = session.run()
            cpu = time.process_time() - begin
            if not episode.success:
                raise SystemExit(f"seed {seed} failed: {episode.final_detail}")
            count = sim.physics_steps
            substeps = count // len(controls)
            data = mujoco.MjData(sim.model)
            mujoco.mj_setState(sim.model, data, start, mujoco.mjtState.mjSTATE_INTEGRATION)
            begin = time.process_time()
            for control in controls:
                data.ctrl[:] = control
                mujoco.mj_step(sim.model, data, substeps)
            bare = time.process_time() - begin
            mujoco.mj_setState(sim.model, data, start, mujoco.mjtState.mjSTATE_INTEGRATION)
            begin = time.process_time()
            for _ in range(count):
                mujoco.mj_step(sim.model, data)
            idle = time.process_time() - begin
            ratios.append(cpu / bare)
            whole.append(cpu)
            bares.append(bare)
            idles.append(cpu / idle)
            steps.append(count)
        return {
            "task": task,
            "episodes": episodes,
            "ratio_median": round(statistics.median(ratios), 3),
            "ratio_max": round(max(ratios), 3),
            "ratio_to_idle_steps_median": round(statistics.median(idles), 3),
            "cpu_s_median": round(statistics.median(whole), 4),
            "bare_s_median": round(statistics.median(bares), 4),
            "physics_steps_median": statistics.median(steps),
            "compilations": compilations,
            "mujoco": mujoco.__version__,
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--task", default="pick_cube_franka")
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    result = measure(arguments.task, arguments.episodes)
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        for key, value in result.items():
            print(f"{key:28} {value}")


if __name__ == "__main__":
    main()
