"""What becomes of perturbed episodes: recovered, rightly refused, or neither.

    python benchmarks/recovery.py [--seeds 20] [--no-what-if] [--compare] [--perception rgbd] [--cases nudged slipped ...] [--jobs 2] [--json]

A fault strikes at a random moment of a bundled task: support.cases draws it, the moment and the layout from
the seed. Where the task can still be done, the share of episodes that end with it done, judged on the simulated state, is
the recovery rate. Where it cannot, a correct refusal ends the episode after the first failed skill call, with an error
whose evidence names the cause. A false claim is an agent's "done" that the simulated state contradicts. The largest force
of the arm on the table, on itself and on what no call named is kept over all control ticks.

With `--compare` each failure's repairs are looked for twice: on the twin, which is made of what is believed, and on an exact
copy of the simulated world, hidden faults included. The twin's are used. With `--perception rgbd` the agent sees through cameras;
cases that are about what ground truth gets wrong are left out.
"""

from __future__ import annotations

import argparse
import json
import logging
import multiprocessing
import statistics
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from typing import Any

from support.behind import work_with
from support.cases import CASES, draw_perturbation, lost
from support.causes import out_of_reach
from support.faults import ContactMeter
from support.sampling import Perturbation

from robosandbox.agent.context import AgentContext
from robosandbox.agent.episode import SkillStarted
from robosandbox.agent.repairs import find_repairs
from robosandbox.apps.bench.interval import wilson_interval
from robosandbox.driver import simulated
from robosandbox.errors import Repair
from robosandbox.sim.intervention import Intervention
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session
from robosandbox.world.alternatives import FailedCall

# Cases of an object that ground truth is made to see elsewhere or in another size.
MISTAKEN = ("mislocated", "missized")


@dataclass(frozen=True, slots=True)
class Row:
    """One episode.

    Attributes:
        case: Which perturbation it had.
        seed: The draw.
        task: The bundled task.
        about: The drawn figures.
        hopeless: Whether the task could not be done: by the case, or because the object ended out of every reach.
        done: What the simulated state says.
        claimed: What the agent said.
        named: Whether the last error names the cause.
        attempts: Failed plans.
        errors: Their codes, with the grasp's reason.
        reason: Why the agent ended.
        detail: Its last sentence.
        sim_secs: Simulated seconds.
        cpu_secs: Processor seconds, roll-outs included.
        contacts: The largest force on what was not to be touched, by kind: N and the two bodies.
        compared: With `--compare`, the repairs of each failure on the twin and on an exact copy.
        repairs_secs: Wall and processor seconds that each failure's repairs were looked for.
    """

    case: str
    seed: int
    task: str
    about: str
    hopeless: bool
    done: bool
    claimed: bool
    named: bool
    attempts: int
    errors: tuple[str, ...]
    reason: str
    detail: str
    sim_secs: float
    cpu_secs: float
    contacts: dict[str, tuple[float, str, str]]
    compared: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = ()
    repairs_secs: tuple[tuple[float, float], ...] = ()

    @property
    def refused_rightly(self) -> bool:
        """Whether it ended after the first failure, with the cause."""
        return not self.claimed and self.attempts <= 1 and self.named


class Watched(AgentContext):
    """A context that takes the time of looking for repairs, and looks for them on an exact copy of the world, too, if asked to.

    Attributes:
        compare: Whether it does the latter.
        found: Of each failure what was found on the twin and on the copy.
        spent: Wall and processor seconds that looking for repairs took, of each failure.
    """

    compare: bool
    found: list[tuple[tuple[str, ...], tuple[str, ...]]]
    spent: list[tuple[float, float]]
    exact: bool = False

    def twin(self) -> AgentContext:
        """Return a context in the twin, or in a copy while that is asked for."""
        if not self.exact:
            return super().twin()
        return work_with(super().twin(), simulated(self.driver, "it is copied").fork())

    def repairs_for(self, failed: FailedCall) -> tuple[Repair, ...]:
        """Return what the twin says, and keep what the copy says."""
        wall, cpu = time.perf_counter(), time.process_time()
        used = super().repairs_for(failed)
        self.spent.append((round(time.perf_counter() - wall, 3), round(time.process_time() - cpu, 3)))
        if not self.compare:
            return used
        self.exact = True
        other = find_repairs(self, failed)
        self.exact = False
        self.found.append((_calls(used), _calls(other)))
        return used


def _calls(repairs: Sequence[Repair]) -> tuple[str, ...]:
    return tuple("; ".join(map(str, repair.calls)) for repair in repairs)


def run(name: str, seed: int, what_if: bool, compare: bool = False, perception: str = "ground_truth") -> Row:
    """Run one episode."""
    case = CASES[name]
    task, perturbation, subject = draw_perturbation(case, seed)
    with open_session(task, what_if=what_if, perception=perception) as session:
        if perturbation.perception is not None:
            session.ctx.perception = perturbation.perception
        session.ctx.__class__ = Watched
        session.ctx.compare, session.ctx.found, session.ctx.spent = compare, [], []
        meter = ContactMeter(session.mujoco)
        ends = [session.driver.subscribe(meter)]
        session.ctx.events.subscribe(lambda event: _expect(meter, event))
        ends += arm(session, perturbation)
        begin = time.process_time()
        episode = session.run()
        cpu, secs = time.process_time() - begin, session.driver.time
        for end in ends:
            end()
        verdict = session.judge()
        gone = not verdict.success and lost(session, subject)
    errors = [attempt.error for attempt in episode.attempts]
    last = errors[-1] if errors else None
    named = case.named if perturbation.hopeless else out_of_reach
    return Row(
        case=name,
        seed=seed,
        task=task.name,
        about=perturbation.about,
        hopeless=perturbation.hopeless or gone,
        done=verdict.success,
        claimed=episode.success,
        named=last is not None and named(last),
        attempts=len(errors),
        errors=tuple(f"{error.code}:{getattr(error.evidence, 'reason', '')}".rstrip(":") for error in errors),
        reason=str(episode.final_reason),
        detail=episode.final_detail,
        sim_secs=round(secs, 2),
        cpu_secs=round(cpu, 2),
        contacts={kind: (round(force, 1), a, b) for kind, (force, a, b) in meter.worst.items()},
        compared=tuple(session.ctx.found),
        repairs_secs=tuple(session.ctx.spent),
    )


def _expect(meter: ContactMeter, event: object) -> None:
    if isinstance(event, SkillStarted):
        meter.intended = {value for value in event.call.arguments.values() if isinstance(value, str)}


def arm(session: EmbeddedWorkcell, perturbation: Perturbation) -> list[Callable[[], None]]:
    """Let the fault begin at its moment."""
    if perturbation.fault is None:
        return []
    injector = Intervention(session.mujoco)
    ticks = perturbation.fault(injector)
    if perturbation.at <= 0.0:
        next(ticks, None)

    def tick() -> None:
        if session.driver.time >= perturbation.at - 1e-9:
            next(ticks, None)

    return [session.driver.subscribe(tick)]


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of some episodes."""
    pairs = [pair for row in rows for pair in row.compared]
    spent = [secs for row in rows for secs in row.repairs_secs] or [(0.0, 0.0)]
    hopeful = [row for row in rows if not row.hopeless]
    hopeless = [row for row in rows if row.hopeless]
    worst: dict[str, tuple[float, str, str]] = {}
    for row in rows:
        for kind, found in row.contacts.items():
            worst[kind] = max(worst.get(kind, (0.0, "", "")), found)
    return {
        "recovered": _rate(sum(row.done and row.claimed for row in hopeful), len(hopeful)),
        "refused_rightly": _rate(sum(row.refused_rightly for row in hopeless), len(hopeless)),
        "false_claims": sum(row.claimed and not row.done for row in rows),
        "wrong_refusals": sum(not row.claimed and row.reason in ("refused", "gave_up") for row in hopeful),
        "attempts_mean": round(statistics.mean(row.attempts for row in rows), 2),
        "sim_s_median": statistics.median(row.sim_secs for row in rows),
        "cpu_s_median": statistics.median(row.cpu_secs for row in rows),
        "cpu_s_max": max(row.cpu_secs for row in rows),
        "repairs_wall_s": {"median": statistics.median(s[0] for s in spent), "max": max(s[0] for s in spent)},
        "repairs_cpu_s": {"median": statistics.median(s[1] for s in spent), "max": max(s[1] for s in spent)},
        "worst_contact_n": worst,
        "same_repairs": _rate(sum(twin == copy for twin, copy in pairs), len(pairs)),
        "same_first_repair": _rate(sum(twin[:1] == copy[:1] for twin, copy in pairs), len(pairs)),
    }


def _rate(count: int, total: int) -> dict[str, Any] | None:
    if not total:
        return None
    low, high = wilson_interval(count, total)
    return {"count": count, "of": total, "rate": round(count / total, 4), "low": round(low, 3), "high": round(high, 3)}


def _line(name: str, figures: dict[str, Any]) -> str:
    def rate(key: str) -> str:
        found = figures[key]
        return "" if found is None else f"{found['count']}/{found['of']} ({found['low']:.2f}-{found['high']:.2f})"

    forces = ", ".join(f"{kind} {force:.0f}" for kind, (force, _, _) in sorted(figures["worst_contact_n"].items()))
    return (
        f"{name:16}{rate('recovered'):>22}{rate('refused_rightly'):>22}{figures['false_claims']:>7}"
        f"{figures['wrong_refusals']:>7}{figures['attempts_mean']:>9}{figures['sim_s_median']:>8.1f}"
        f"{figures['cpu_s_median']:>8.2f}{figures['repairs_wall_s']['median']:>10.2f}{figures['repairs_wall_s']['max']:>7.1f}  "
        f"{forces}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--no-what-if", action="store_true")
    parser.add_argument("--perception", default="ground_truth")
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--compare", action="store_true", help="look for repairs on an exact copy, too")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--misses", action="store_true", help="also print every episode that went wrong")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    logging.disable(logging.WARNING)
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    if arguments.perception != "ground_truth":
        arguments.cases = [name for name in arguments.cases if name not in MISTAKEN]
    episodes = [
        (name, seed, not arguments.no_what_if, arguments.compare, arguments.perception)
        for name in arguments.cases
        for seed in seeds
    ]
    if arguments.jobs > 1:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(arguments.jobs, mp_context=context) as pool:
            rows = list(pool.map(run, *zip(*episodes, strict=True)))
    else:
        rows = [run(*episode) for episode in episodes]
    table = {name: summary([row for row in rows if row.case == name]) for name in arguments.cases}
    table["all"] = summary(rows)
    if arguments.json:
        print(json.dumps({"what_if": not arguments.no_what_if, "cases": table, "rows": [asdict(r) for r in rows]}))
        return
    print(
        f"{'case':16}{'recovered':>22}{'rightly refused':>22}{'false':>7}{'wrong':>7}{'attempts':>9}{'sim s':>8}"
        f"{'cpu s':>8}{'repairs s':>10}{'max':>7}  largest force on what was not to be touched, N"
    )
    for name, figures in table.items():
        print(_line(name, figures))
    if arguments.compare:
        print(f"same repairs: {table['all']['same_repairs']}; same first repair: {table['all']['same_first_repair']}")
    if arguments.misses:
        for row in rows:
            if not (row.refused_rightly if row.hopeless else row.done and row.claimed):
                print(f"{row.case} {row.seed} {row.task} ({row.about}): {row.reason}, {row.errors}: {row.detail}")


if __name__ == "__main__":
    main()
