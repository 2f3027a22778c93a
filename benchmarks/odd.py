"""Odd scenes: what is claimed, pressed, moved, refused and said there, against raw contacts and an oracle.

    python benchmarks/odd.py [--episodes 300] [--first-seed 0] [--families sizes corner ...] [--jobs 2] [--json] [--misses]

Things of 8 to 90 mm and 5 g to 12 kg, smooth and rough, at edges, in corners, touching, on, under and against one another, on
pillars and on the floor, and drawers: `benchmarks/odd_scenes.py` draws each from a seed. The arm is told in a sentence what to do. Its judge,
`odd_judge.py`, reads raw contacts; of a refusal the oracle, `odd_oracle.py`, finds out by trying grasps on copies of the true world
whether it was right; the cause of what cannot be done is known by construction. A claim is false where the raw contacts say that
what was asked is not so, or not two seconds later. "Stuck" is an arm that can neither go home nor let go at the end.
"""

from __future__ import annotations

import argparse
import itertools
import json
import logging
import multiprocessing
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import Any

import mujoco
import numpy as np
from odd_judge import STAYS, Meter, done, lowest, places, raw_state
from odd_oracle import can_hold
from odd_scenes import FAMILIES, Cause, Odd, drawn

from robosandbox.agent.episode import Episode
from robosandbox.errors import InputError, SkillError
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.sim.intervention import Intervention
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.tasks.task import Task
from robosandbox.types import SkillCall
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

# N: the most on what was named (the default limit of a driver), by how much it may be passed, and the most on anything else.
LIMIT_N, OVER, UNNAMED_N = 60.0, 1.1, 60.0


@dataclass(frozen=True, slots=True)
class Row:
    """What came of an episode.

    Attributes:
        family: Of the scene.
        seed: The draw.
        prompt: What was asked.
        claimed: What the agent said.
        done: What raw contacts say.
        judged: What the task's judge says.
        possible: Whether it could be done: by construction, by having been done, or by the oracle; None where that is not known.
        named_n: The most that the robot pressed what it was told of with, N.
        unnamed_n: The most on anything else, N.
        unnamed: What that was.
        moved_mm: The farthest that something moved that was not named.
        bin_mm: The farthest that something moved that is to stay.
        cause: What the agent named as the cause; "" for none of those that a family knows.
        causes: What may rightly be named.
        stuck: Whether it can neither go home nor let go at the end.
        why: How the agent ended.
        said: Its last sentence.
        errors: Codes of the failures, with reasons.
        cpu_secs: Of the episode.
    """

    family: str
    seed: int
    prompt: str
    claimed: bool
    done: bool
    judged: bool
    possible: bool | None
    named_n: float
    unnamed_n: float
    unnamed: str
    moved_mm: float
    bin_mm: float
    cause: str
    causes: tuple[str, ...]
    stuck: bool
    why: str
    said: str
    errors: tuple[str, ...]
    cpu_secs: float


def run(name: str, seed: int, oracle: bool = True) -> Row | None:
    """Run one episode of a family; None where the scene cannot be built as it was drawn."""
    return episode(drawn(name, seed), can_hold if oracle else None)


Oracle = Callable[[MuJoCoBackend, Odd, PlanningScene], bool]


def episode(odd: Odd, oracle: Oracle | None, **options: Any) -> Row | None:
    """Run one episode; None where the scene cannot be built as it was drawn.

    Args:
        odd: The scene, and what is asked.
        oracle: Tells of what was not held whether it can be; None asks nobody.
        options: What `open_session` takes besides.
    """
    try:
        session = open_session(_task(odd), **options)
    except InputError:
        return None
    with session:
        hand = Intervention(session.mujoco)
        for thing, slip in odd.friction.items():
            session.mujoco.model.geom_friction[hand.geoms(thing), 0] = slip
            # Above that of any finger pad: the thing's own friction counts, not the larger of both.
            session.mujoco.model.geom_priority[hand.geoms(thing)] = session.mujoco.model.geom_priority.max() + 1
        hand.wake()
        world = session.mujoco.fork()
        start = places(world)
        bottom = lowest(world, raw_state(world, mujoco.MjData(world.model)), odd.subject)
        meter = Meter(session.mujoco, odd)
        end = session.driver.subscribe(meter)
        begin = time.process_time()
        run = session.run()
        cpu = time.process_time() - begin
        end()
        is_done = done(session.mujoco.fork(), odd, start, bottom)
        now = places(session.mujoco)
        judged = session.judge().success
        possible: bool | None = odd.possible
        if is_done:
            possible = True
        elif possible is None and oracle is not None and odd.goal == "held":
            possible = oracle(world, odd, session.ctx.planning(session.observe()))
        moved = {thing: 1e3 * float(np.linalg.norm(now[thing] - start[thing])) for thing in now}
        return Row(
            family=odd.family,
            seed=odd.seed,
            prompt=odd.prompt,
            claimed=run.success,
            done=is_done,
            judged=judged,
            possible=possible,
            named_n=round(meter.named, 1),
            unnamed_n=round(meter.unnamed[0], 1),
            unnamed=meter.unnamed[1],
            moved_mm=round(max((far for thing, far in moved.items() if thing not in odd.named), default=0.0), 1),
            bin_mm=round(max((moved[thing] for thing in odd.still), default=0.0), 1),
            cause=_cause(run, odd),
            causes=tuple(sorted(odd.causes)),
            stuck=is_stuck(session),
            why=str(run.final_reason),
            said=run.final_detail,
            errors=tuple(_code(attempt.error) for attempt in run.attempts),
            cpu_secs=round(cpu, 2),
        )


def _task(odd: Odd) -> Task:
    check: dict[str, Any] = {
        "held": {"kind": "lifted", "object": odd.subject, "min_mm": 20},
        "on": {"kind": "on", "object": odd.subject, "target": odd.target},
        "pushed": {
            "kind": "displaced",
            "object": odd.subject,
            "direction": "forward",
            "min_mm": max(1.0, 800.0 * odd.along),
        },
        "opened": {"kind": "opened", "object": odd.subject, "min_mm": max(1.0, 1e3 * odd.along)},
        "shut": {"kind": "closed", "object": odd.subject},
    }[odd.goal]
    if odd.goal == "held" and odd.still:
        # What is lifted together with the bin that it lies in hangs in one grip with it.
        stay = [{"kind": "not", "check": {"kind": "lifted", "object": name, "min_mm": 10}} for name in odd.still]
        check = {"kind": "all", "checks": [check, *stay]}
    return Task.model_validate(
        {"name": f"{odd.family}_{odd.seed}", "prompt": odd.prompt, "scene": odd.scene, "success": check}
    )


def is_stuck(session: EmbeddedWorkcell) -> bool:
    """Tell whether the arm can neither go home as it is, nor after letting go; the world is changed."""
    if _goes_home(session):
        return False
    session.driver.hands["hand"].set_gripper(0.0)
    session.driver.wait(1.0)
    return session.mujoco.in_hands()["hand"] is not None or not _goes_home(session)


def _goes_home(session: EmbeddedWorkcell) -> bool:
    try:
        session.agent.perform(SkillCall(skill="home", arguments={}))
    except SkillError:
        return False
    return True


def _code(error: SkillError) -> str:
    return f"{error.code}:{getattr(error.evidence, 'reason', '')}".rstrip(":")


# What is said, and the cause that it names; the first that is found counts.
_CAUSES_BY_WORD: tuple[tuple[str, Cause], ...] = (
    ("too_wide", "too_wide"),
    (" wide", "too_wide"),
    ("too_heavy", "too_heavy"),
    ("heav", "too_heavy"),
    ("slip", "slippery"),
    ("unreachable", "out_of_reach"),
    ("reach", "out_of_reach"),
    ("collision", "blocked"),
    ("in the way", "blocked"),
    ("against", "blocked"),
    (":blocked", "blocked"),
    (":locked", "locked"),
    ("wedged", "blocked"),
)


def _cause(episode: Episode, odd: Odd) -> str:
    """Return the cause that the agent named for what was asked: of the last failure of a call for the subject, else as it ended."""
    if episode.success:
        return ""
    asked = [attempt.error for attempt in episode.attempts if odd.subject in attempt.failed.arguments.values()]
    if not asked:
        return _named_in(episode.final_detail)
    last = asked[-1]
    if last.evidence is not None and set(last.evidence.met()) & {*odd.still}:
        # That a thing is met which the family put in the way is a cause, too.
        return "blocked"
    return _named_in(f"{_code(last)} {last.message}")


def _named_in(text: str) -> str:
    return next((cause for word, cause in _CAUSES_BY_WORD if word in text), "")


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of some episodes."""
    refused = [row for row in rows if not row.claimed and row.possible is not None]
    corners = [row for row in rows if row.family == "corner" and row.possible]
    caused = [row for row in rows if not row.claimed and row.possible is False and row.causes]
    # Of what can be done, no weight and no width is the cause.
    invented = [row for row in rows if not row.claimed and row.possible and row.cause in ("too_heavy", "too_wide")]
    return {
        "episodes": len(rows),
        "done": sum(row.done for row in rows),
        "can_be_done": sum(row.possible is True for row in rows),
        "false_claims": sum(row.claimed and not row.done for row in rows),
        "judges_differ": sum(row.judged != row.done for row in rows),
        "unnamed_over_60_n": sum(row.unnamed_n > UNNAMED_N for row in rows),
        "limit_passed": sum(row.named_n > OVER * LIMIT_N for row in rows),
        "worst_named_n": max((row.named_n for row in rows), default=0.0),
        "worst_unnamed_n": max((row.unnamed_n for row in rows), default=0.0),
        "corners_picked": [sum(row.done and row.claimed for row in corners), len(corners)],
        "bin_moved": sum(row.bin_mm > 1e3 * STAYS for row in rows),
        "refusals_right": [sum(row.possible is False for row in refused), len(refused)],
        "causes_right": [sum(row.cause in row.causes for row in caused), len(caused) + len(invented)],
        "causes_invented": len(invented),
        "stuck": sum(row.stuck for row in rows),
        "cpu_s": round(sum(row.cpu_secs for row in rows), 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=300, help="in all, dealt to the families in turn")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--families", nargs="+", choices=sorted(FAMILIES), default=sorted(FAMILIES))
    options = parsed(parser)
    seeds = itertools.count(options.first_seed)
    dealt = itertools.islice(((name, seed) for seed in seeds for name in options.families), options.episodes)
    found = rows_of(run, [(name, seed, not options.no_oracle) for name, seed in dealt], options.jobs, _told)
    rows = [row for row in found if row is not None]
    table = {name: summary([row for row in rows if row.family == name]) for name in options.families}
    table["all"] = {**summary(rows), "not_built": len(found) - len(rows)}
    report(options, "families", table, rows, wrong)


def parsed(parser: argparse.ArgumentParser) -> argparse.Namespace:
    """Add the options of every round of odd episodes and return what was given."""
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--no-oracle", action="store_true", help="do not try what was refused")
    parser.add_argument("--misses", action="store_true", help="also print every episode that went wrong")
    parser.add_argument("--json", action="store_true")
    logging.disable(logging.CRITICAL)
    return parser.parse_args()


def rows_of(
    run: Callable[..., Row | None], jobs: Sequence[tuple[Any, ...]], processes: int, told: Callable[[Row], str]
) -> list[Row | None]:
    """Return the row of each job, told on stderr as it is done: a long round that is cut off has shown what it found."""
    found = []
    with ExitStack() as stack:
        done_in_turn: Iterable[Row | None] = itertools.starmap(run, jobs)
        if processes > 1:
            spawn = multiprocessing.get_context("spawn")
            pool = stack.enter_context(ProcessPoolExecutor(processes, mp_context=spawn))
            done_in_turn = pool.map(run, *zip(*jobs, strict=True))
        for row in done_in_turn:
            if row is not None:
                print(told(row), file=sys.stderr, flush=True)
            found.append(row)
    return found


def report(
    options: argparse.Namespace, groups: str, table: dict[str, Any], rows: Sequence[Row], wrong: Callable[[Row], bool]
) -> None:
    """Print the figures of each group, or with --json those and the rows; with --misses also what went wrong."""
    if options.json:
        print(json.dumps({groups: table, "rows": [asdict(row) for row in rows]}))
        return
    for name, figures in table.items():
        print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in figures.items()))
    for row in rows if options.misses else ():
        if wrong(row):
            print(asdict(row))


def _told(row: Row) -> str:
    return f"{row.family} {row.seed}: {'wrong: ' + json.dumps(asdict(row)) if wrong(row) else 'fine'}"


def wrong(row: Row) -> bool:
    """Tell whether something is wrong with an episode."""
    return bool(
        row.claimed != row.done
        or row.judged != row.done
        or row.unnamed_n > UNNAMED_N
        or row.named_n > OVER * LIMIT_N
        or row.bin_mm > 1e3 * STAYS
        or row.stuck
        or (not row.claimed and (row.possible or (row.causes and row.cause not in row.causes)))
    )


if __name__ == "__main__":
    main()
