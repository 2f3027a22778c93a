"""What recording costs, whether recordings run again to the same end, and what SIGKILL leaves of them.

`uv run benchmarks/recording.py [--cost] [--replay 50] [--kill 20]`; without options all three, with these numbers.
"""

from __future__ import annotations

import argparse
import json
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from robosandbox.recording.episode import RecordedEpisode, find_episodes
from robosandbox.recording.settings import RecordSettings, open_recorder
from robosandbox.tasks.loader import bundled_tasks
from robosandbox.tasks.replay import Replay
from robosandbox.tasks.session import Session, open_session

COST_TASKS = ("pick_cube_franka", "pick_from_three", "push_left", "put_in_bin", "stack_three")
COST_SEEDS = 10
COST_ROUNDS = 3


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cost", action="store_true")
    parser.add_argument("--replay", type=int, metavar="EPISODES", default=0)
    parser.add_argument("--kill", type=int, metavar="TIMES", default=0)
    options = parser.parse_args()
    every = not (options.cost or options.replay or options.kill)
    good = True
    with tempfile.TemporaryDirectory() as scratch:
        if options.cost or every:
            measure_cost(Path(scratch) / "cost")
        if options.replay or every:
            good &= replay_all(Path(scratch) / "replay", options.replay or 50)
        if options.kill or every:
            good &= kill_all(Path(scratch) / "kill", options.kill or 20)
    return 0 if good else 1


def measure_cost(folder: Path) -> None:
    """Print the CPU time of episodes with and without recording, reset and verdict included, loading excluded."""
    print("recording's cost, CPU time per episode; reset and verdict counted, loading not")
    totals = [0.0, 0.0]
    for name in COST_TASKS:
        # Both ways in turns, and the best of several rounds: other programs on the machine slow a round down.
        plain: list[float] = []
        recorded: list[float] = []
        with open_session(name) as session:
            _episodes(session, None)
            for _ in range(COST_ROUNDS):
                plain.append(_episodes(session, None))
                recorded.append(_episodes(session, folder))
        totals[0] += min(plain)
        totals[1] += min(recorded)
        ratio = 100.0 * (min(recorded) / min(plain) - 1.0)
        each = 1000.0 / COST_SEEDS
        print(f"  {name:<18} {min(plain) * each:7.1f} ms  recorded {min(recorded) * each:7.1f} ms  {ratio:+5.1f} %")
    print(f"  {'all':<18} {100.0 * (totals[1] / totals[0] - 1.0):+.1f} %")


def _episodes(session: Session, folder: Path | None) -> float:
    """Return the CPU seconds of all episodes."""
    recorder = None
    if folder is not None:
        recorder = open_recorder(RecordSettings(folder=folder), session)
        recorder.follow(session.agent)
    begin = time.process_time()
    for seed in range(1, COST_SEEDS + 1):
        session.reset(seed)
        session.run()
        verdict = session.judge()
        if recorder is not None:
            recorder.finish(judged=(verdict.success, verdict.detail))
    took = time.process_time() - begin
    if recorder is not None:
        recorder.close()
    return took


def replay_all(folder: Path, count: int) -> bool:
    """Record episodes of all tasks, run each again, and print how many end the same."""
    names = list(bundled_tasks())
    done, same, worst = 0, 0, 0.0
    for index, name in enumerate(names):
        seeds = range(index, count, len(names))
        if not seeds:
            continue
        with open_session(name) as session:
            recorder = open_recorder(RecordSettings(folder=folder), session)
            recorder.follow(session.agent)
            for number in range(len(seeds)):
                session.reset(number + 1)
                session.run()
                verdict = session.judge()
                recorder.finish(judged=(verdict.success, verdict.detail))
            recorder.close()
        # A world of its own: nothing of the recording session is left in it.
        with open_session(name) as other:
            for path in find_episodes(folder):
                episode = RecordedEpisode.load(path)
                if episode.meta.task["name"] != name:
                    continue
                replayed = Replay(episode, other).run()
                done += 1
                same += replayed.same
                worst = max([worst, *replayed.object_error_mm.values()])
    print(f"replayed to the same outcome and final poses: {same} of {done}; worst object {worst:.3g} mm off")
    return same == done


def kill_all(folder: Path, times: int) -> bool:
    """Kill a recording process at random moments and print how many folders open, and how much is missing at most."""
    generator = random.Random(0)
    opened, missing, rows = 0, 0.0, []
    for index in range(times):
        place = folder / f"{index:02d}"
        command = [sys.executable, __file__, "--child", str(place)]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert child.stdout is not None
        child.stdout.readline()
        time.sleep(generator.uniform(1.2, 6.0))
        child.send_signal(signal.SIGKILL)
        told = child.stdout.read().split()
        child.wait()
        (path,) = find_episodes(place)
        episode = RecordedEpisode.load(path)
        lost = float(told[-1]) - float(episode.seconds[-1])
        good = episode.result is None and lost <= 1.1 and len(episode.events()) > 0
        good &= bool(episode["time"][-1] >= 0.0) and json.loads((path / "meta.json").read_text())["prompt"] != ""
        opened += good
        rows.append(len(episode))
        missing = max(missing, lost)
    print(
        f"killed at random moments: {opened} of {times} folders open; {missing:.2f} s missing at most; "
        f"{statistics.median(rows):g} rows kept in the middle, {min(rows)} at least"
    )
    return opened == times


def child(folder: Path) -> None:
    """Stack cubes at the speed of the clock, telling the simulated time; until killed."""
    with open_session("stack_three") as session:
        recorder = open_recorder(RecordSettings(folder=folder), session)
        recorder.follow(session.agent)
        begun = time.monotonic()

        def keep_pace() -> None:
            print(session.sim.time, flush=True)
            time.sleep(max(0.0, session.sim.time - (time.monotonic() - begun)))

        session.sim.tick_hooks.append(keep_pace)
        print("begun", flush=True)
        session.run()


def arguments(given: Sequence[str]) -> Path | None:
    """Return the folder for a child process; None for the benchmark itself."""
    return Path(given[1]) if len(given) == 2 and given[0] == "--child" else None


if __name__ == "__main__":
    place = arguments(sys.argv[1:])
    if place is None:
        sys.exit(main())
    child(place)
