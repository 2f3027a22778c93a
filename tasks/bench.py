"""Episodes over tasks and seeds, judged on simulated truth; the same rows whatever the number of processes."""

from __future__ import annotations

import importlib.metadata
import logging
import multiprocessing
import platform
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

from robosandbox.errors import InputError, RoboSandboxError
from robosandbox.tasks.interval import beta_interval
from robosandbox.tasks.remote import RemoteSession
from robosandbox.tasks.session import open_session
from robosandbox.tasks.task import Task
from robosandbox.tasks.workcell import Workcell

_log = logging.getLogger(__name__)
_CHUNK = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchSettings:
    """What all episodes of a bench share.

    Attributes:
        planner: Name of an installed planner.
        planner_options: What it takes besides the skills.
        perception: Name of an installed perception.
        max_replans: How often a failure may be answered with a new plan.
        what_if: Whether skills may try repairs on copies of the world.
    """

    planner: str = "stub"
    planner_options: Mapping[str, Any] = field(default_factory=dict)
    perception: str = "ground_truth"
    max_replans: int = 3
    what_if: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One episode.

    Attributes:
        task: Its name.
        seed: Its layout.
        success: What simulated truth says.
        claimed: What the agent said.
        steps: Skill calls that reached their post-condition.
        replans: New plans after failures.
        secs: Wall time of the episode, loading excluded.
        sim_secs: Simulated time of it.
        physics_steps: Physics steps of it.
        reason: Why the agent ended.
        detail: What success was judged on; and the agent's last sentence where it did not succeed.
        versions: Of what the outcome depends on.
        assists: Interventions in the physics on the robot's behalf: there are none.
    """

    task: str
    seed: int
    success: bool
    claimed: bool
    steps: int
    replans: int
    secs: float
    sim_secs: float
    physics_steps: int
    reason: str
    detail: dict[str, float | str]
    versions: dict[str, str]
    assists: tuple[str, ...] = ()

    def record(self) -> dict[str, Any]:
        """Return the row as JSON data."""
        return asdict(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """How often a task succeeded, with the 95% Beta interval of the rate."""

    task: str
    successes: int
    episodes: int
    low: float
    high: float


def run_bench(
    tasks: Sequence[Task],
    seeds: int,
    *,
    jobs: int = 1,
    settings: BenchSettings | None = None,
    on_done: Callable[[int], None] | None = None,
    remote: RemoteSession | None = None,
) -> Iterator[Row]:
    """Yield a row per task and seed, tasks in the given order, seeds from 0.

    Args:
        tasks: What to run.
        seeds: How many layouts of each.
        jobs: Processes; 1 stays in this one.
        settings: What all episodes share.
        on_done: Told how many episodes more are finished, in whatever order they finish.
        remote: Run in this sim process, with the planner that it was made with, in place of worlds of our own.

    Raises:
        InputError: A task cannot be loaded.
    """
    settings = settings or BenchSettings()
    done = on_done or (lambda _: None)
    size = max(1, min(_CHUNK, -(-seeds // jobs)))
    chunks = [(task, range(at, min(at + size, seeds))) for task in tasks for at in range(0, seeds, size)]
    jobs = min(jobs, len(chunks))
    if jobs <= 1 or remote is not None:
        worker = _Worker(remote)
        try:
            for task, chunk in chunks:
                for seed in chunk:
                    yield worker.episode(task, seed, settings)
                    done(1)
        finally:
            worker.close()
        return
    # Forking a process with threads (a progress bar, a renderer) can deadlock; spawning cannot.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(max_workers=jobs, mp_context=context) as pool:
        pending: list[Future[list[Row]]] = []
        for task, chunk in chunks:
            future = pool.submit(_episodes, task, chunk, settings)
            future.add_done_callback(partial(_tell, done, len(chunk)))
            pending.append(future)
        try:
            for future in pending:
                yield from future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _tell(done: Callable[[int], None], count: int, future: Future[list[Row]]) -> None:
    if not future.cancelled():
        done(count)


def rates(rows: Sequence[Row]) -> list[Rate]:
    """Return each task's rate, in the order of the rows."""
    found = []
    for task in dict.fromkeys(row.task for row in rows):
        results = [row.success for row in rows if row.task == task]
        low, high = beta_interval(sum(results), len(results))
        found.append(Rate(task=task, successes=sum(results), episodes=len(results), low=low, high=high))
    return found


def versions() -> dict[str, str]:
    """Return the versions that an outcome depends on."""
    found = {name: importlib.metadata.version(name) for name in ("robosandbox", "mujoco", "numpy")}
    return {**found, "python": platform.python_version(), "machine": platform.machine()}


class _Worker:
    """Keeps the last task's world, so that its seeds share one compiled model."""

    def __init__(self, remote: RemoteSession | None = None) -> None:
        self._remote = remote
        self._session: Workcell | None = None
        self._key: tuple[Task, BenchSettings] | None = None

    def episode(self, task: Task, seed: int, settings: BenchSettings) -> Row:
        session = self._session_for(task, settings)
        session.reset(seed)
        begin = time.perf_counter()
        claimed, steps, replans, reason, said = False, 0, 0, "fault", ""
        try:
            episode = session.run()
        except RoboSandboxError:
            raise
        except Exception as fault:
            # A bench of hundreds of episodes reports a fault of the code as a failed row and goes on.
            _log.exception("fault in %s, seed %d", task.name, seed)
            said = f"{type(fault).__name__}: {fault}"
        else:
            claimed, steps, replans = episode.success, len(episode.steps), episode.replans
            reason, said = episode.final_reason.value, episode.final_detail
        secs = time.perf_counter() - begin
        sim_secs, physics_steps = session.elapsed()
        verdict = session.judge()
        if verdict is None:
            raise InputError("--connect: the sim was started with --no-ground-truth, so nothing can be judged there")
        detail: dict[str, float | str] = {key: round(value, 3) for key, value in verdict.detail.items()}
        if not claimed:
            detail["agent"] = f"{reason}: {said}"
        return Row(
            task=task.name,
            seed=seed,
            success=verdict.success,
            claimed=claimed,
            steps=steps,
            replans=replans,
            secs=round(secs, 3),
            sim_secs=round(sim_secs, 6),
            physics_steps=physics_steps,
            reason=reason,
            detail=detail,
            versions=versions(),
        )

    def close(self) -> None:
        if self._session is not None:
            self._session.close()
        self._session = self._key = None

    def _session_for(self, task: Task, settings: BenchSettings) -> Workcell:
        if self._session is None or self._key != (task, settings):
            self.close()
            self._session = self._open(task, settings)
            self._key = (task, settings)
        return self._session

    def _open(self, task: Task, settings: BenchSettings) -> Workcell:
        if self._remote is not None:
            self._remote.load(task)
            return self._remote
        return open_session(
            task,
            planner=settings.planner,
            planner_options=settings.planner_options,
            perception=settings.perception,
            max_replans=settings.max_replans,
            what_if=settings.what_if,
        )


_process_worker = _Worker()


def _episodes(task: Task, seeds: Sequence[int], settings: BenchSettings) -> list[Row]:
    return [_process_worker.episode(task, seed, settings) for seed in seeds]
