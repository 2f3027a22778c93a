"""Plot of joint speed, gripper opening and force over simulated time since the last order, with the phases."""

from __future__ import annotations

import threading
from collections import deque

import numpy as np

from robosandbox.apps.viewer.source import Blueprint, Frame
from robosandbox.apps.viewer.stream import FRAME_HZ
from robosandbox.types import Array
from robosandbox.values import frozen

# Ten minutes of frames; an episode that lasts longer loses its beginning.
_KEPT = int(600 * FRAME_HZ)


@frozen
class PhaseSpan:
    """A phase that begins at `start`, simulated seconds; `failed` once an error has ended it."""

    name: str
    start: float
    failed: bool = False


@frozen(kw_only=True)
class Recording:
    """Series that the timeline draws.

    Attributes:
        seconds: Simulated time of each sample, increasing, shape (k,).
        values: Speed of the fastest arm joint (°/s, or mm/s where none turns), opening (mm) and force (the gripper's own
            unit), shape (k, 3); NaN where there is no gripper.
        phases: In order.
    """

    seconds: Array
    values: Array
    phases: tuple[PhaseSpan, ...]


class Timeline:
    """Takes samples in one thread and phases in another."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._samples: deque[tuple[float, float, float, float]] = deque(maxlen=_KEPT)
        self._phases: list[PhaseSpan] = []

    def clear(self) -> None:
        """Begin anew."""
        with self._lock:
            self._samples.clear()
            self._phases = []

    def add(self, frame: Frame, blueprint: Blueprint) -> None:
        """Take a frame; one from before the last sample, as after a step back, begins anew."""
        seen, now = frame.seen.arms[blueprint.arm], frame.seen.time
        force = seen.gripper.force if seen.gripper else None
        gripper = (
            (np.nan, np.nan)
            if seen.gripper is None
            else (1000.0 * seen.gripper.width, np.nan if force is None else force)
        )
        sample = (now, joint_speed(seen.qd, blueprint), *gripper)
        with self._lock:
            if self._samples and now < self._samples[-1][0]:
                self._samples.clear()
                self._phases = []
            if not self._samples or now > self._samples[-1][0]:
                self._samples.append(sample)

    def enter(self, phase: str) -> None:
        """Begin a phase at the latest sample; one that is under way by that name goes on."""
        with self._lock:
            now = self._samples[-1][0] if self._samples else 0.0
            if self._phases and self._phases[-1].start == now:
                self._phases.pop()
            if self._phases and self._phases[-1] == PhaseSpan(phase, self._phases[-1].start):
                return
            self._phases.append(PhaseSpan(phase, now))

    def fail(self) -> None:
        """Mark the phase under way as the one that failed."""
        with self._lock:
            if self._phases:
                last = self._phases[-1]
                self._phases[-1] = PhaseSpan(last.name, last.start, True)

    def recording(self) -> Recording:
        """Return what was taken so far."""
        with self._lock:
            samples = np.array(self._samples).reshape(-1, 4)
            return Recording(seconds=samples[:, 0], values=samples[:, 1:], phases=tuple(self._phases))


def joint_speed(qd: Array, blueprint: Blueprint) -> float:
    """Return the speed of the fastest arm joint: °/s over those that turn, mm/s for an arm whose joints all slide."""
    turns = np.array([blueprint.turns(index) for index in range(len(qd))], dtype=bool)
    if turns.any():
        return float(np.degrees(np.abs(qd[turns]).max()))
    return float(1000.0 * np.abs(qd).max(initial=0.0))
