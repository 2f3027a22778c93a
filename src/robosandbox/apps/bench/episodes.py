"""Episodes run one after another in worlds that seeds of a task share."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from robosandbox.apps.bench.contact_monitor import ContactMonitor
from robosandbox.apps.bench.results import BenchSettings, Row
from robosandbox.errors import (
    RenderingError,
    RoboSandboxError,
    ServiceError,
    ServiceUnavailableError,
)
from robosandbox.sim.opening import mujoco_behind
from robosandbox.tasks.task import Task
from robosandbox.values import frozen
from robosandbox.versions import versions
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.recording.settings import open_recorder
from robosandbox.workcell.session import open_workcell
from robosandbox.workcell.workcell import Workcell
from robosandbox.workcell.zenoh.client.workcell import RemoteWorkcell

if TYPE_CHECKING:
    from robosandbox.workcell.recording.recorder import Recorder

_log = logging.getLogger(__name__)
# What ails the machine or the connection ends a bench: every episode to come would end in the same way.
_ENDS_BENCH = (ServiceError, ServiceUnavailableError, RenderingError)


@frozen
class Chunk:
    """Episodes that are run in one process, one after another.

    Attributes:
        task: Which.
        seeds: Its layouts.
        settings: What all episodes of the bench share.
    """

    task: Task
    seeds: tuple[int, ...]
    settings: BenchSettings


class EpisodeRunner:
    """Keeps the last task's world, so that its seeds share one compiled model.

    Args:
        remote: Run in this sim process, in place of worlds of our own.
    """

    def __init__(self, remote: RemoteWorkcell | None = None) -> None:
        self._remote = remote
        self._session: Workcell | None = None
        self._recorder: Recorder | None = None
        self._key: tuple[Task, BenchSettings] | None = None
        self._monitor: ContactMonitor | None = None
        # Whether an episode was run since the world was opened.
        self._used = False

    def rows(self, chunk: Chunk) -> Iterator[Row]:
        """Yield a row per episode as it ends; the row of one that cannot be run or not be judged says so.

        Raises:
            ServiceError: The sim is gone or does not let this bench run.
            ServiceUnavailableError: The sim is gone.
            RenderingError: This machine renders no pictures.
        """
        for seed in chunk.seeds:
            try:
                row = self._episode(chunk.task, seed, chunk.settings)
            except _ENDS_BENCH:
                raise
            except Exception as error:
                # The next seed gets a world of its own: what is left of this one is not known.
                self.close()
                line = _line_of(error, chunk.task)
                row = Row.of_error(chunk.task.name, seed, error=line, settings=chunk.settings)
            yield row

    def open(self, task: Task, settings: BenchSettings) -> Workcell:
        """Return the task's world, which is built if it is not there.

        Raises:
            InputError: It cannot be built, or not recorded as the settings say.
        """
        if self._session is None or self._key != (task, settings):
            self.close()
            self._session = self._build(task, settings)
            self._key = (task, settings)
        return self._session

    def close(self) -> None:
        """Free the world."""
        if self._recorder is not None:
            self._recorder.close()
        if self._session is not None:
            self._session.close()
        self._session = self._recorder = self._key = self._monitor = None
        self._used = False

    def _episode(self, task: Task, seed: int, settings: BenchSettings) -> Row:
        session = self._begun(task, seed, settings)
        if self._monitor is not None:
            self._monitor.reset()
        begin = time.perf_counter()
        claimed, steps, replans, reason, said = False, 0, 0, "fault", ""
        usage: dict[str, Any] | None = None
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
            usage = episode.model_usage.record()
        secs = time.perf_counter() - begin
        sim_secs, physics_steps = session.elapsed()
        monitor = self._monitor
        verdict = session.judge()
        if self._recorder is not None and settings.recording is not None:
            keep = verdict.success or not settings.recording.only_success
            self._recorder.finish(judged=verdict, keep=keep)
            if self._recorder.cut_short is not None:
                raise ServiceUnavailableError(f"--record: {self._recorder.cut_short}; make room, then run it again")
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
            settings=settings.record(),
            versions=versions(),
            touched=tuple(sorted(monitor.touched)) if monitor else (),
            worst_force_n=round(monitor.worst_force, 3) if monitor else None,
            worst_intended_force_n=round(monitor.worst_intended_force, 3) if monitor else None,
            model_usage=usage,
        )

    def _begun(self, task: Task, seed: int, settings: BenchSettings) -> Workcell:
        """Return the task's world as it begins; a driver that does not start over is opened anew."""
        session = self.open(task, settings)
        if isinstance(session, EmbeddedWorkcell) and not session.driver.capabilities.reset:
            if session.seed != seed or self._used:
                self.close()
                self._session, self._key = self._build(task, settings, seed), (task, settings)
            self._used = True
            return self._session or session
        session.reset(seed)
        return session

    def _build(self, task: Task, settings: BenchSettings, seed: int = 0) -> Workcell:
        if self._remote is not None:
            self._remote.load(task)
            return self._remote
        # Nobody sits beside it.
        session = open_workcell(replace(settings, task=task, seed=seed, confirm=False))
        # It is ours to close from here on, also if the recording cannot begin.
        self._session = session
        if settings.recording is not None:
            self._recorder = open_recorder(settings.recording, session)
            self._recorder.follow()
        world = mujoco_behind(session.driver)
        if world is not None:
            self._monitor = ContactMonitor(world, session.agent.skills)
            session.ctx.events.subscribe(self._monitor.hear)
        return session


_runner = EpisodeRunner()


def run_chunk(chunk: Chunk) -> list[Row]:
    """Run a chunk in this process, which keeps the world for the next one of the same task."""
    return list(_runner.rows(chunk))


def try_world(task: Task, settings: BenchSettings) -> str | None:
    """Build a task's world and free it; return why that cannot be done, or None."""
    runner = EpisodeRunner()
    try:
        runner.open(task, settings)
    except _ENDS_BENCH:
        raise
    except Exception as error:
        return _line_of(error, task)
    finally:
        runner.close()
    return None


def _line_of(error: Exception, task: Task) -> str:
    """Return an error's line; a fault of the code goes to the log with its traceback, too."""
    if isinstance(error, RoboSandboxError):
        return str(error)
    _log.error("fault in %s", task.name, exc_info=error)
    return f"{type(error).__name__}: {error}"
