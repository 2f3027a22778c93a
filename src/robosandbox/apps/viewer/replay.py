"""A recorded episode as frames: its recorded states are drawn, no physics runs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robosandbox.apps.viewer.source import Frame
from robosandbox.errors import InputError
from robosandbox.sim.opening import require_mujoco
from robosandbox.sim.step_recorder import column_of
from robosandbox.types import ArmState, Array, GripperState, Observation, Pose, frozen_array
from robosandbox.values import frozen
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.recording.episode import RecordedEpisode


@frozen(kw_only=True)
class RecordedFrames:
    """States in the order in which they were.

    Attributes:
        name: Of the episode.
        seconds: Since its begin, shape (rows,).
        frame: Returns a row as a frame.
        said: Returns what went on at a row, in words.
    """

    name: str
    seconds: Array
    frame: Callable[[int], Frame]
    said: Callable[[int], str]

    def row(self, seconds: float) -> int:
        """Return the row that was current at a time."""
        return int(np.clip(np.searchsorted(self.seconds, seconds + 1e-9) - 1, 0, len(self.seconds) - 1))


class _RecordedArm:
    """States of one arm by row."""

    def __init__(self, episode: RecordedEpisode, arm: str) -> None:
        self._times = episode["time"]
        self._q, self._qd, self._tcp = (episode[column_of(arm, name)] for name in ("q", "qd", "tcp_pose"))
        self._gripper = episode.of_arm(arm, "gripper")

    def state(self, row: int) -> ArmState:
        """Return the state of a row."""
        x, y, z, i, j, k, w = self._tcp[row].tolist()
        fingers = None
        if self._gripper is not None:
            joint, width, closed, force = self._gripper[row].tolist()
            measured = force if np.isfinite(force) else None
            fingers = GripperState(joint=joint, width=width, closed=closed, force=measured)
        return ArmState(
            time=float(self._times[row]),
            q=frozen_array(self._q[row]),
            qd=frozen_array(self._qd[row]),
            tcp_pose=Pose(xyz=(x, y, z), quat_xyzw=(i, j, k, w)),
            gripper=fingers,
        )


def recorded_frames(episode: RecordedEpisode, session: EmbeddedWorkcell) -> RecordedFrames:
    """Return the frames of an episode, for a world of its task.

    Raises:
        InputError: The world has other joints than the recorded one.
    """
    model = require_mujoco(session.driver, "its recorded states are drawn").model
    qpos = episode["qpos"]
    if qpos.shape[1] != model.nq:
        raise InputError(f"{episode.name}: its robot or objects have other joints than when it was recorded")
    arms = {name: _RecordedArm(episode, name) for name in episode.meta.arms}
    times = episode["time"]
    skills, phases = episode["skill"], episode["phase"]

    def frame(row: int) -> Frame:
        seen = Observation(time=float(times[row]), arms={name: arm.state(row) for name, arm in arms.items()})
        return Frame(model=model, seen=seen, hands={}, qpos=frozen_array(qpos[row]))

    def said(row: int) -> str:
        return f"{skills[row]}: {phases[row]}" if skills[row] else "between skills"

    return RecordedFrames(name=episode.name, seconds=episode.seconds, frame=frame, said=said)
