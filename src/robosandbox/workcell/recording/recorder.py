"""Takes down what happens in a world: a folder per episode, from the first plan to the verdict."""

from __future__ import annotations

import logging
import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import to_json

from robosandbox.agent import episode as events
from robosandbox.driver import Driver
from robosandbox.sim.opening import mujoco_behind
from robosandbox.sim.world import World, build_world_of
from robosandbox.types import Array, ObservedScene, Verdict
from robosandbox.types.robot import RobotSpec
from robosandbox.versions import versions
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.recording.beliefs import BeliefRecorder
from robosandbox.workcell.recording.columns import columns_of
from robosandbox.workcell.recording.files import (
    EVENTS,
    META,
    RESULT,
    Meta,
    Result,
    RobotMeta,
    new_folder,
    write_whole,
)
from robosandbox.workcell.recording.settings import VideoSettings
from robosandbox.workcell.recording.video import VideoWriter
from robosandbox.workcell.recording.writer import StepLog, StepWriter

_log = logging.getLogger(__name__)
# Rows (10 s of control ticks) that the log has room for at first; chosen as a pick and a placement;
# benchmarks/recording.py measures what recording costs.
_LOG_ROWS = 1000


class _Open:
    """The episode that is being written."""

    def __init__(self, folder: Path, driver: Driver, log: StepLog, videos: list[VideoWriter]) -> None:
        self.folder = folder
        self.log = log
        self.writer = StepWriter(folder, log)
        self.videos = videos
        # A line each, at once: what was told before the process died is there.
        self.events = (folder / EVENTS).open("wb", buffering=0)
        self.begun = time.monotonic()
        self.sim_begun = driver.time
        self.ended: int | None = None
        self.episode: events.Episode | None = None
        self.interrupted = ""

    def close(self) -> None:
        """Close films and events."""
        for video in self.videos:
            video.close()
        self.events.close()


class Recorder:
    """Writes the episodes of one world, each into a folder of its own in `folder`.

    It records from `begin`, which the first event of a prompt calls too, until `finish`, the next episode or a reset; a
    call that belongs to no prompt is an episode of its own. A disk that is full ends the recording, not the motion.

    Args:
        folder: Where episodes go; made when needed.
        host: The world with its task.
        video: Cameras to film; none when left out.

    Attributes:
        last: The folder of the episode that was finished last.
        cut_short: Why the episode that was begun last is not there whole; None where it is.
    """

    def __init__(self, folder: Path, host: EmbeddedWorkcell, *, video: VideoSettings | None = None) -> None:
        self.last: Path | None = None
        self.cut_short: str | None = None
        self._folder = folder
        self._host = host
        self._driver = host.driver
        # None for a driver without a model: then it is taken down what its senses tell and where things are believed.
        self._simulated = mujoco_behind(host.driver)
        self._believed = build_world_of(host.task.scene) if self._simulated is None else None
        self._seen: ObservedScene | None = None
        self._video = video
        self._open: _Open | None = None
        self._leave_events: Callable[[], None] = _nothing
        self._alone = False
        self._log: tuple[int, StepLog] | None = None
        self._leave = self._driver.subscribe(self._tick)
        if self._simulated is not None:
            self._simulated.jump_hooks.append(self._jumped)
        self._task: dict[str, Any] = host.task.model_dump(mode="json")
        self._arms = {
            name: _robot_meta(arm.spec, name, self._world, self._simulated is not None)
            for name, arm in self._driver.arms.items()
        }
        self._skills = tuple(
            {"name": skill.name, "description": skill.description, "arguments": dict(skill.schema)}
            for skill in host.skills
        )

    def follow(self) -> None:
        """Take down the episodes of this world as its events tell of them."""
        self._leave_events()
        self._leave_events = self._host.ctx.events.subscribe(self.on_event)

    @property
    def _world(self) -> World:
        """The model that `qpos` is of."""
        if self._simulated is not None:
            return self._simulated.world
        assert self._believed is not None
        return self._believed

    @property
    def folder(self) -> Path | None:
        """The folder of the episode that is being written."""
        return self._open.folder if self._open else None

    def begin(self, prompt: str) -> None:
        """Begin an episode with the world as it is; one that is open ends.

        Raises:
            InputError: Its folder cannot be made.
        """
        self.finish()
        self.cut_short = None
        driver, host, world = self._driver, self._host, self._world
        folder = new_folder(self._folder, f"{self._task['name']}-seed{host.seed:04d}")
        videos = (
            [VideoWriter(folder, camera, driver, self._video) for camera in self._video.cameras] if self._video else []
        )
        meta = Meta(
            prompt=prompt,
            task=self._task,
            seed=host.seed,
            arms=self._arms,
            objects=tuple(world.object_bodies),
            bodies=world.names,
            skills=self._skills,
            control_timestep=driver.control_timestep,
            checkpoint=host.checkpoint() if self._simulated is not None else None,
            columns=columns_of(self._arms),
            videos=tuple(video.meta for video in videos),
            versions=versions(),
            started=datetime.now(UTC),
        )
        log = self._step_recorder()
        try:
            write_whole(folder / META, meta.model_dump_json() + "\n")
            self._open = _Open(folder, driver, log, videos)
        except OSError as error:
            self._cut_short(folder, error)
            return
        self._seen = None
        self._tick()

    def note(self, event: str, **content: Any) -> None:
        """Add a line to the events of the open episode; models in it become JSON."""
        if self._open is None:
            return
        row = self._open.writer.rows - 1
        line = {"event": event, "time": round(self._driver.time, 6), "row": row, "stamp": time.time(), **content}
        try:
            self._open.events.write(to_json(line) + b"\n")
        except OSError as error:
            self._give_up(error)

    def enter(self, skill: str, phase: str) -> None:
        """Have the rows that follow name a skill and its phase; both "" between skills."""
        if self._open is not None:
            self._open.log.enter(skill, phase)

    def on_event(self, event: events.AgentEvent) -> None:
        """Take down an event."""
        match event:
            case events.Started(prompt):
                self.begin(prompt)
                self.note("started", prompt=prompt)
            case events.Writing():
                self.note("writing", thought=event.thought, calls=event.calls)
            case events.Thought(text):
                self.note("thought", text=text)
            case events.Consulted():
                self.note("consulted", tool=event.tool, arguments=dict(event.arguments), answer=dict(event.answer))
            case events.Planned(plan, replan):
                self.note("planned", replan=replan, plan=plan.steps)
            case events.SkillStarted(call, index, total):
                if self._open is None or self._open.ended is not None or self._alone:
                    self.begin(str(call))
                    self._alone = True
                self.enter(call.skill, "")
                self.note("skill_started", call=call, index=index, total=total)
            case events.PhaseEntered(call, phase):
                self.enter(call.skill, phase)
                self.note("phase", skill=call.skill, phase=phase)
            case events.SkillEnded(call, result):
                self.enter("", "")
                self.note("skill_ended", call=call, result=result)
                self._end_alone(True, "plan_complete", str(call))
            case events.SkillFailed(call, error):
                self.enter("", "")
                self.note("skill_failed", call=call, error=error)
                self._end_alone(False, error.code, f"{call}: {error.message}")
            case events.Replanning(replan, error):
                self.note("replanning", replan=replan, code=error.code)
            case events.Ended(episode):
                self.end(episode)

    def _end_alone(self, success: bool, reason: str, detail: str) -> None:
        """Finish the episode of a call that belongs to no prompt."""
        if self._alone:
            self.finish(outcome=(success, reason, detail))

    def end(self, episode: events.Episode) -> None:
        """Note that the agent has ended; what follows until `finish` belongs to the verdict."""
        if self._open is not None:
            self._open.episode = episode
            self._open.ended = self._open.writer.rows - 1
            self.note("ended", success=episode.success, reason=episode.final_reason.value)

    def finish(
        self,
        *,
        judged: Verdict | None = None,
        outcome: tuple[bool, str, str] | None = None,
        keep: bool = True,
    ) -> Path | None:
        """End the open episode and write what came of it.

        Args:
            judged: What the simulated state says.
            outcome: Success, reason and detail, where no agent tells.
            keep: Whether the folder stays.

        Returns:
            The episode's folder; None when none was open or it did not stay.
        """
        current, self._open = self._open, None
        self._alone = False
        if current is None:
            return None
        if not keep:
            current.close()
            current.writer.abandon()
            shutil.rmtree(current.folder)
            return None
        try:
            current.close()
            current.writer.finish()
            result = self._result(current, judged, outcome)
            write_whole(current.folder / RESULT, result.model_dump_json(indent=1) + "\n")
        except OSError as error:
            self._cut_short(current.folder, error)
        self.last = current.folder
        return current.folder

    def close(self) -> None:
        """Finish what is open and follow the world no longer."""
        self.finish()
        self._leave()
        if self._simulated is not None and self._jumped in self._simulated.jump_hooks:
            self._simulated.jump_hooks.remove(self._jumped)
        self._leave_events()

    def _tick(self) -> None:
        current = self._open
        if current is None:
            return
        try:
            current.writer.add()
            for video in current.videos:
                video.add(current.writer.rows - 1)
        except OSError as error:
            self._give_up(error)
            return
        seen = self._host.ctx.seen
        if self._simulated is None and seen is not self._seen:
            self._seen = seen
            # What the arm said of itself is in every step.
            self.note("seen", scene=None if seen is None else replace(seen, arm=None))

    def _jumped(self) -> None:
        self.finish()

    def _give_up(self, error: OSError) -> None:
        current, self._open = self._open, None
        if current is not None:
            self._cut_short(current.folder, error)
            current.writer.abandon()

    def _cut_short(self, folder: Path, error: OSError) -> None:
        self.cut_short = f"{folder}: the recording is cut short: {error.strerror or error}"
        _log.error("%s; make room there", self.cut_short)

    def _step_recorder(self) -> StepLog:
        """Return the log of the loaded model; it is made once, for episodes of a second are many."""
        sim = self._simulated
        compilations = sim.compilations if sim is not None else 0
        log: StepLog
        if self._log is not None and self._log[0] == compilations:
            log = self._log[1]
        else:
            log = sim.log(_LOG_ROWS) if sim is not None else BeliefRecorder(self._host, self._world, _LOG_ROWS)
            self._log = (compilations, log)
        log.enter("", "")
        log.clear()
        return log

    def _result(
        self,
        current: _Open,
        judged: Verdict | None,
        outcome: tuple[bool, str, str] | None,
    ) -> Result:
        episode, rows = current.episode, current.writer.rows
        if outcome is None and episode is not None:
            outcome = (episode.success, episode.final_reason.value, episode.final_detail)
        success, reason, detail = outcome or (False, "interrupted", "ended before the agent did")
        return Result(
            success=success,
            reason=reason,
            detail=detail,
            steps=rows,
            ended=rows - 1 if current.ended is None else current.ended,
            sim_secs=round((rows - 1) * self._driver.control_timestep, 6),
            wall_secs=round(time.monotonic() - current.begun, 6),
            episode=episode.record() if episode else None,
            judged=judged,
        )


def _robot_meta(robot: RobotSpec, arm: str, world: World, simulated: bool) -> RobotMeta:
    geometry = robot.gripper.geometry if robot.gripper else None
    return RobotMeta(
        name=robot.name,
        joints=robot.joints,
        lower=_finite(robot.lower),
        upper=_finite(robot.upper),
        home_q=tuple(robot.home_q.tolist()),
        actuators=world.actuators_of(arm) if simulated else (),
        gripper=(geometry.min_aperture, geometry.max_aperture) if geometry else None,
        sidecar=world.sidecars[arm].model_dump(mode="json"),
    )


def _finite(values: Array) -> tuple[float | None, ...]:
    return tuple(float(value) if np.isfinite(value) else None for value in values)


def _nothing() -> None:
    pass
