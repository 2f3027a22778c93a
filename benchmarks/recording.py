"""What recording costs, whether recordings run again to the same end, and what SIGKILL leaves of them.

`uv run benchmarks/recording.py [--episodes 50] [--kills 20] [--only cost replay kill] [--json]`
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
from pathlib import Path
from typing import Any

from robosandbox.tasks.loader import bundled_tasks
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.recording.files import find_episodes
from robosandbox.workcell.recording.replay import Replay
from robosandbox.workcell.recording.settings import RecordSettings, open_recorder
from robosandbox.workcell.session import open_session

COST_TASKS = ("pick_cube_franka", "pick_from_three", "push_left", "put_in_bin", "stack_three")
COST_SEEDS = 10
COST_ROUNDS = 5
# What a killed process may lack: what came since the last flush, a second at most, and the tick that flushes.
LOST_SECONDS = 1.1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=50, help="recorded and run again, over all tasks")
    parser.add_argument("--kills", type=int, default=20, help="recording processes that are killed")
    parser.add_argument("--only", nargs="+", choices=("cost", "replay", "kill"), default=("cost", "replay", "kill"))
    parser.add_argument("--json", action="store_true", help="one document on stdout")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child is not None:
        record_until_killed(options.child)
        return 0
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        if "cost" in options.only:
            found["cost"] = measure_cost(folder / "cost")
        if "replay" in options.only:
            found["replay"] = replay_all(folder / "replay", options.episodes)
        if "kill" in options.only:
            found["kill"] = kill_all(folder / "kill", options.kills)
    if options.json:
        print(json.dumps(found, indent=1))
    else:
        tell(found)
    return 0 if all(part.get("good", part.get("times")) == part.get("times") for part in found.values()) else 1


def tell(found: dict[str, Any]) -> None:
    """Print the figures for people."""
    for name, (plain, recorded, percent) in found.get("cost", {}).items():
        print(f"{name:<18} {plain:7.1f} ms of CPU an episode, recorded {recorded:7.1f} ms: {percent:+5.1f} %")
    if replay := found.get("replay"):
        print(
            "run again to the same outcome and final poses: {good} of {times}; {worst_mm:.3g} mm at most".format(
                **replay
            )
        )
    if kill := found.get("kill"):
        print(
            "killed at random moments: {good} of {times} folders open; {missing_s:.2f} s missing at most; "
            "{rows_median:g} rows kept in the middle, {rows_min} at least".format(**kill)
        )


def measure_cost(folder: Path) -> dict[str, tuple[float, float, float]]:
    """Return for each task, and all together, CPU ms of an episode without and with recording, and the difference in %.

    Resets and verdicts are counted, loading is not. Both ways take turns, and of each episode the cheapest of several runs
    counts: it does the same work each time, and other programs on the machine only slow it down.
    """
    found: dict[str, tuple[float, float, float]] = {}
    totals = [0.0, 0.0]
    for name in COST_TASKS:
        plain: list[list[float]] = []
        recorded: list[list[float]] = []
        with open_session(name) as session:
            _episodes(session, None)
            _episodes(session, folder)
            for _ in range(COST_ROUNDS):
                plain.append(_episodes(session, None))
                recorded.append(_episodes(session, folder))
        sums = [sum(map(min, zip(*rounds, strict=True))) for rounds in (plain, recorded)]
        totals = [total + part for total, part in zip(totals, sums, strict=True)]
        found[name] = _compared(*sums, COST_SEEDS)
    found["all"] = _compared(*totals, COST_SEEDS * len(COST_TASKS))
    return found


def _compared(plain: float, recorded: float, episodes: int) -> tuple[float, float, float]:
    each = 1000.0 / episodes
    return round(plain * each, 2), round(recorded * each, 2), round(100.0 * (recorded / plain - 1.0), 2)


def _episodes(session: EmbeddedWorkcell, folder: Path | None) -> list[float]:
    """Return the CPU seconds of each episode."""
    recorder = None
    if folder is not None:
        recorder = open_recorder(RecordSettings(folder=folder), session)
        recorder.follow()
    took = []
    for seed in range(1, COST_SEEDS + 1):
        begin = time.process_time()
        session.reset(seed)
        session.run()
        verdict = session.judge()
        if recorder is not None:
            recorder.finish(judged=verdict)
        took.append(time.process_time() - begin)
    if recorder is not None:
        recorder.close()
    return took


def replay_all(folder: Path, count: int) -> dict[str, Any]:
    """Record episodes of all tasks, run each again, and return how many end the same, and their objects within 1 mm."""
    names = list(bundled_tasks())
    done, same, worst = 0, 0, 0.0
    for index, name in enumerate(names):
        seeds = range(index, count, len(names))
        if not seeds:
            continue
        with open_session(name) as session:
            recorder = open_recorder(RecordSettings(folder=folder), session)
            recorder.follow()
            for number in range(len(seeds)):
                session.reset(number + 1)
                session.run()
                verdict = session.judge()
                recorder.finish(judged=verdict)
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
    return {"times": done, "good": same, "worst_mm": worst}


def kill_all(folder: Path, times: int) -> dict[str, Any]:
    """Kill a recording process at random moments and return how many folders open, and how much is missing at most."""
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
        good = episode.result is None and lost <= LOST_SECONDS and len(episode.events()) > 0
        good &= bool(episode["time"][-1] >= 0.0) and json.loads((path / "meta.json").read_text())["prompt"] != ""
        opened += good
        rows.append(len(episode))
        missing = max(missing, lost)
    return {
        "times": times,
        "good": opened,
        "missing_s": round(missing, 3),
        "rows_median": statistics.median(rows),
        "rows_min": min(rows),
    }


def record_until_killed(folder: Path) -> None:
    """Stack cubes no faster than the clock goes, telling the simulated time; until killed."""
    with open_session("stack_three") as session:
        recorder = open_recorder(RecordSettings(folder=folder), session)
        recorder.follow()
        due = time.monotonic()

        def keep_pace() -> None:
            nonlocal due
            print(session.driver.time, flush=True)
            # Not to catch up either: what is lost is written within so many seconds of the clock, and told in simulated ones.
            now = time.monotonic()
            due = max(due + session.driver.control_timestep, now)
            time.sleep(due - now)

        session.driver.subscribe(keep_pace)
        print("begun", flush=True)
        session.run()


if __name__ == "__main__":
    sys.exit(main())
