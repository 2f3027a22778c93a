"""Furnished scenes: what is claimed, pressed and refused among shelves, cupboards, drawers, buttons and walls, against raw state and an oracle.

    uv run benchmarks/furnished.py [--scenes 200] [--first-seed 1000] [--perception rgbd --sensor realsense] [--seconds 20] [--no-oracle] [--json FILE]

`furnished_scenes.py` writes from a seed a file with a table of some height and size, a shelf of two or three boards, a cupboard with a door or a
cabinet of drawers, a button, one or two walls or posts, and three to five boxes, cans, mugs and bowls on them; the bundled arm stands where
the sidecar says or where it is inferred. Two or three goals are said one after the other, as relations or in a sentence. A claim is false where
`furnished_judge.py` finds in raw state that what was asked is not so, or not a second later. Of a refusal `furnished_oracle.py` says why it is
right, else it is counted as not proved. A goal that takes more CPU seconds than `--seconds` is stopped, and counts as given up; the scene ends there. Ends with 1 where a claim is false.
"""

from __future__ import annotations

import argparse
import json
import logging
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from furnished_judge import Meter, done, moved, places
from furnished_oracle import Oracle
from furnished_scenes import Furnished, Goal, drawn

from robosandbox.apps.bench.interval import wilson_interval
from robosandbox.errors import InputError, RoboSandboxError
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

# N: the default limit of a driver, and by how much it may be passed.
LIMIT_N, OVER = 60.0, 1.1


class OutOfTime(BaseException):
    """The time of a goal is over; nothing between here and there is to catch it."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise `OutOfTime` within after so many CPU seconds of this process; 0 for never."""

    def stop(number: int, frame: object) -> None:
        raise OutOfTime

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@dataclass(frozen=True, slots=True)
class Row:
    """Outcome of one goal.

    Attributes:
        seed: Of the scene.
        goal: What was said.
        relation: Of the goal.
        achieved: What the raw state says.
        claimed: What the agent said.
        proved: Why what was refused or given up cannot be, by the oracle; "" where that is not proved or was not asked.
        fixed_n: The most that the robot pressed what is fixed with, N, and what.
        part_n: The same of what turns or slides.
        thing_n: The same of a thing.
        carried_n: The same of a held thing on what is fixed.
        moved_mm: The farthest that something moved that was not named, and what.
        simulated_s: Simulated seconds.
        wall_s: Seconds.
        stopped: Whether it took more CPU time than it may.
        why: How the agent ended, and its last sentence.
        calls: What it did.
    """

    seed: int
    goal: str
    relation: str
    achieved: bool
    claimed: bool
    proved: str
    fixed_n: tuple[float, str]
    part_n: tuple[float, str]
    thing_n: tuple[float, str]
    carried_n: tuple[float, str]
    moved_mm: tuple[float, str]
    simulated_s: float
    wall_s: float
    stopped: bool
    why: str
    calls: tuple[str, ...]

    @property
    def worst_n(self) -> float:
        """The most that the robot pressed anything with, N."""
        return max(self.fixed_n[0], self.part_n[0], self.thing_n[0], self.carried_n[0])


def run(seed: int, *, oracle: bool = True, seconds: float = 0.0, **options: Any) -> list[Row]:
    """Run the goals of a scene one after the other; no rows where the arm cannot stand there.

    Args:
        seed: Of the scene.
        oracle: Whether refusals are looked at.
        seconds: CPU seconds after which a goal is stopped; 0 for never.
        options: What `open_session` takes besides.
    """
    room = drawn(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = room.write(Path(folder))
        try:
            cell = open_session(scene=path, seed=0, **options)
        except InputError as error:
            print(f"{seed}: {error}", file=sys.stderr)
            return []
        with cell:
            rows: list[Row] = []
            for goal in room.goals:
                rows.append(row(cell, room, goal, oracle, seconds))
                if rows[-1].stopped:
                    break
            return rows


def row(cell: EmbeddedWorkcell, room: Furnished, goal: Goal, oracle: bool, seconds: float) -> Row:
    """Run one goal in a world as it is, and judge it."""
    world = cell.mujoco.fork()
    start, meter = places(world, room), Meter(cell.mujoco, room)
    end, begin, clock = cell.driver.subscribe(meter), time.perf_counter(), cell.driver.time
    stopped = False
    try:
        with at_most(seconds):
            episode = cell.run(goal.said)
        claimed, why = episode.success, f"{episode.final_reason}: {episode.final_detail}"
        calls = tuple(str(step.call) for step in episode.steps)
    except RoboSandboxError as error:
        claimed, why, calls = False, f"{type(error).__name__}: {error}", ()
    except OutOfTime:
        stopped, claimed, why, calls = True, False, f"stopped after {seconds:.0f} s of CPU", ()
    finally:
        end()
    took, simulated = time.perf_counter() - begin, cell.driver.time - clock
    achieved = done(cell.mujoco.fork(), room, goal, meter)
    far, what = moved(start, places(cell.mujoco, room), {goal.subject, goal.target})
    proved = Oracle(world, room).impossible(goal) if oracle and not claimed and not achieved else ""
    return Row(
        seed=room.seed,
        goal=goal.said,
        relation=goal.relation,
        achieved=achieved,
        claimed=claimed,
        proved=proved,
        fixed_n=_told(meter.fixed),
        part_n=_told(meter.part),
        thing_n=_told(meter.thing),
        carried_n=_told(meter.carried),
        moved_mm=(round(1e3 * far, 1), what),
        simulated_s=round(simulated, 1),
        wall_s=round(took, 1),
        stopped=stopped,
        why=why[:400],
        calls=calls,
    )


def _told(force: tuple[float, str]) -> tuple[float, str]:
    return round(force[0], 1), force[1]


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of some rows."""
    count, achieved = len(rows), sum(one.achieved for one in rows)
    given_up = [one for one in rows if not one.claimed and not one.achieved]
    return {
        "goals": count,
        "achieved": achieved,
        "achieved_95": _interval(achieved, count),
        "refused_proved": sum(bool(one.proved) for one in given_up),
        "refused_unproved": sum(not one.proved and not one.stopped for one in given_up),
        "stopped_unproved": sum(not one.proved and one.stopped for one in given_up),
        "achieved_or_proved_95": _interval(achieved + sum(bool(one.proved) for one in given_up), count),
        "false_claims": sum(one.claimed and not one.achieved for one in rows),
        "false_claims_95": _interval(sum(one.claimed and not one.achieved for one in rows), count),
        "not_claimed": sum(one.achieved and not one.claimed for one in rows),
        "over_the_limit": sum(one.worst_n > OVER * LIMIT_N for one in rows),
        "worst_fixed_n": max(one.fixed_n[0] for one in rows),
        "worst_n": max(one.worst_n for one in rows),
        "moved_over_10_mm": sum(one.moved_mm[0] > 10.0 for one in rows),
        "simulated_s_median": sorted(one.simulated_s for one in rows)[count // 2],
        "wall_s_median": sorted(one.wall_s for one in rows)[count // 2],
        "wall_s_most": max(one.wall_s for one in rows),
    }


def _interval(part: int, whole: int) -> str:
    low, high = wilson_interval(part, whole)
    return f"{100 * part / whole:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--perception", default="ground_truth")
    parser.add_argument("--sensor", default="ideal", help="what the cameras are like")
    parser.add_argument("--seconds", type=float, default=20.0, help="CPU time of a goal; 0 for no end")
    parser.add_argument("--no-oracle", action="store_true", help="do not look whether what was refused can be done")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    rows: list[Row] = []
    empty = 0
    for seed in range(given.first_seed, given.first_seed + given.scenes):
        found = run(
            seed, oracle=not given.no_oracle, seconds=given.seconds, perception=given.perception, sensor=given.sensor
        )
        empty += not found
        for one in found:
            rows.append(one)
            print(json.dumps(asdict(one)), flush=True)
        if given.json:
            given.json.write_text(json.dumps([asdict(one) for one in rows], indent=1))
    groups = {"all": rows} | {
        name: [r for r in rows if r.relation == name] for name in sorted({r.relation for r in rows})
    }
    for name, group in groups.items():
        if group:
            print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in summary(group).items()))
    print(f"scenes {given.scenes}, of which {empty} could not be opened")
    return 1 if any(one.claimed and not one.achieved for one in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
