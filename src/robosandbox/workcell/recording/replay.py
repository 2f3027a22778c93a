"""Recorded actions run again through physics: the same commands, tick by tick, and whether the same comes of them."""

from __future__ import annotations

import numpy as np

from robosandbox.driver import made_safe
from robosandbox.errors import InputError
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import require_mujoco
from robosandbox.sim.step_recorder import Ragged, column_of
from robosandbox.tasks.task import Task
from robosandbox.types import Array, Verdict
from robosandbox.validation import validate
from robosandbox.values import frozen
from robosandbox.versions import versions
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.recording.episode import RecordedEpisode
from robosandbox.workcell.session import open_session

TOLERANCE_MM = 1.0


@frozen(kw_only=True)
class Replayed:
    """Result of recorded actions that were carried out again.

    Attributes:
        object_error_mm: By how far each object ends from where it ended when recorded.
        joint_error: Largest difference of an arm joint at the end, radians or metres.
        recorded: The recorded verdict; None where the episode was not judged.
        judged: The verdict now; None where the recording breaks off before it.
        changed_versions: What differs since: name, then, now.
    """

    object_error_mm: dict[str, float]
    joint_error: float
    recorded: bool | None
    judged: Verdict | None
    changed_versions: tuple[tuple[str, str, str], ...]

    @property
    def same_outcome(self) -> bool:
        """True where the verdict is the recorded one, or there is none to compare."""
        return self.recorded is None or (self.judged is not None and self.judged.success == self.recorded)

    @property
    def same(self) -> bool:
        """True where outcome and final poses are the recorded ones."""
        return self.same_outcome and all(error <= TOLERANCE_MM for error in self.object_error_mm.values())


class Replay:
    """An episode, ready to be run again.

    Args:
        episode: What was recorded.
        session: A world of the episode's robot and task; see `open_replay`.

    Attributes:
        world: What the actions are sent to.
    """

    def __init__(self, episode: RecordedEpisode, session: EmbeddedWorkcell) -> None:
        self.episode = episode
        self.session = session
        self._safe = made_safe(session.driver)
        self.world: MuJoCoBackend = require_mujoco(session.driver, "recorded actions go to its actuators")
        self.row: int = 0
        if episode.meta.checkpoint is None:
            raise InputError(
                f"{episode.name}: has no actions to run again, because its driver simulates no model; "
                "`robo-sandbox viewer --replay` and `runs video` show it"
            )
        self._actions = episode["action"]
        self._pushes: Ragged = episode.ragged("push")
        # With the episode's scene in place: a layout may leave things out.
        session.restore(episode.meta.checkpoint)
        self._check()

    def step(self) -> None:
        """Let the next recorded tick pass; after the last one the last commands are held."""
        if self.row + 1 >= len(self._actions):
            self._safe.wait(self._safe.control_timestep)
            return
        self.row += 1
        controls, push = self._actions[self.row], self._push(self.row)
        self._safe.run_again(lambda: self.world.replay(controls, push))

    def run(self) -> Replayed:
        """Run all that is left, and judge where the recording was judged."""
        episode = self.episode
        result = episode.result
        verdict = None
        if result is not None and result.judged is not None:
            while self.row < result.ended:
                self.step()
            verdict = self.session.judge()
        while self.row + 1 < len(self._actions):
            self.step()
        truth = self.world.truth()
        recorded = episode.object_poses[-1]
        errors = {
            name: 1000.0 * float(np.linalg.norm(truth.objects[name].pose.position - pose[:3]))
            for name, pose in zip(episode.meta.objects, recorded, strict=True)
        }
        then, now = episode.meta.versions, versions()
        return Replayed(
            object_error_mm=errors,
            joint_error=max(
                float(np.abs(arm.q - episode[column_of(name, "q")][-1]).max(initial=0.0))
                for name, arm in truth.arms.items()
            ),
            recorded=result.judged.success if result is not None and result.judged is not None else None,
            judged=verdict,
            changed_versions=tuple(
                (name, then.get(name, "none"), version) for name, version in now.items() if then.get(name) != version
            ),
        )

    def _push(self, row: int) -> Array | None:
        begin, end = self._pushes.offsets[row : row + 2]
        return None if begin == end else np.asarray(self._pushes.values[begin:end], dtype=float).reshape(-1, 6)

    def _check(self) -> None:
        meta, world = self.episode.meta, self.world
        found = {arm: world.world.actuators_of(arm) for arm in world.robots}
        if (
            found != {arm: robot.actuators for arm, robot in meta.arms.items()}
            or tuple(world.object_bodies) != meta.objects
        ):
            raise InputError(
                f"{self.episode.name}: {meta.robot_name} has other actuators or objects than when it was recorded; "
                "replay needs the same model"
            )


def open_replay(episode: RecordedEpisode) -> Replay:
    """Load the world of an episode and put it where the episode began; the session is the caller's to close.

    Raises:
        InputError: The task cannot be loaded any more, or its robot is another one now.
    """
    task = validate(episode.meta.task, Task, source=f"{episode.name}/meta.json: task")
    session = open_session(task, what_if=False)
    try:
        return Replay(episode, session)
    except InputError:
        session.close()
        raise
