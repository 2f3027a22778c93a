"""What an episode costs beyond its physics: CPU time over the same number of bare mj_step calls, in one run.

    python benchmarks/episode.py [--task pick_cube_franka] [--episodes 20] [--json]
    python benchmarks/episode.py --parts     # what each part of an episode takes of it

The bare side replays the controls of the same episode from the same state, one mj_step call a control tick, so both
sides do the same physics, grasp contacts included. Load and reset are left out on both.

Parts are sampled: a timer of the process's own CPU time notes which of our functions runs, so that nothing is slowed by
being measured. A part's time is that of what it calls in MuJoCo and NumPy, too.
"""

from __future__ import annotations

import argparse
import json
import signal
import statistics
import time
from collections import Counter
from types import FrameType

import mujoco
import numpy as np

from robosandbox import open_session
from robosandbox.sim.saved_state import continue_from

# Parts of an episode, by file and function: that of the innermost call that fits one.
PARTS = {
    "physics": ("sim/simulation.py:_tick",),
    "forces and guards": (
        "sim/pressing.py:",
        "sim/simulation.py:force",
        "driver/force.py:",
        "driver/sliding.py:",
        "driver/safety.py:",
        "driver/safe.py:_after_tick",
        "agent/context.py:_ended",
        "driver/bare.py:ticked",
        "skills/primitives/loads.py:",
        "skills/primitives/lifting.py:heavy",
        "skills/primitives/lifting.py:rubs",
        "skills/primitives/guarded.py:check",
    ),
    "commands": ("sim/control.py:", "sim/sensing.py:_tick", "driver/bare.py:per_tick"),
    "inverse kinematics": ("robots/kinematics.py:", "robots/descent.py:", "robots/compiled.py:", "motion/line.py:"),
    "collisions": ("motion/collision.py:",),
    "timing": ("motion/timing.py:",),
    "looks and state": ("sim/sensing.py:", "sim/states.py:", "sim/contacts.py:", "perception/", "robots/robot.py:"),
    "grasps": ("robosandbox/grasp/",),
    "sentences": ("agent/language/",),
    "contracts": ("robosandbox/world/",),
    "rest": (),
}
# Seconds of CPU time between samples; the least that kernels commonly keep is 4 ms.
_SAMPLE_SECONDS = 0.001


def measure(task: str, episodes: int) -> dict[str, object]:
    with open_session(task) as session:
        sim = session.mujoco
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
            continue_from(sim.model, data, start)
            begin = time.process_time()
            for control in controls:
                data.ctrl[:] = control
                mujoco.mj_step(sim.model, data, substeps)
            bare = time.process_time() - begin
            continue_from(sim.model, data, start)
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


def parts(task: str, episodes: int) -> dict[str, float]:
    """Return the milliseconds of CPU time that each part of an episode takes, the mean over all."""
    taken: Counter[str] = Counter()
    cpu = 0.0

    def sample(number: int, frame: FrameType | None) -> None:
        del number
        while frame is not None:
            place = f"{frame.f_code.co_filename}:{frame.f_code.co_name}"
            part = next((part for part, ends in PARTS.items() if any(end in place for end in ends)), None)
            if part:
                taken[part] += 1
                return
            frame = frame.f_back
        taken["rest"] += 1

    with open_session(task) as session:
        session.run()
        signal.signal(signal.SIGPROF, sample)
        for seed in range(episodes):
            session.reset(seed)
            begin = time.process_time()
            signal.setitimer(signal.ITIMER_PROF, _SAMPLE_SECONDS, _SAMPLE_SECONDS)
            session.run()
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            cpu += time.process_time() - begin
    each = 1000.0 * cpu / episodes / taken.total()
    return {part: round(each * taken[part], 2) for part in PARTS}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--task", default="pick_cube_franka")
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--parts", action="store_true", help="say in ms what each part of an episode takes")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    result = (parts if arguments.parts else measure)(arguments.task, arguments.episodes)
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        for key, value in result.items():
            print(f"{key:28} {value}")


if __name__ == "__main__":
    main()
