"""The world of this process, drawn between control ticks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from robosandbox.apps.viewer.believed import BelievedWorld
from robosandbox.apps.viewer.source import Blueprint, Frame, OnElsewhere, OnFrame
from robosandbox.apps.viewer.stream import FRAME_HZ
from robosandbox.apps.viewer.teleop import EmbeddedTeleop
from robosandbox.sim.opening import mujoco_behind
from robosandbox.workcell.host import WorkcellHost


class EmbeddedSource:
    """Makes frames of a cell of this process: of the simulated state where there is one, else of what perception saw last.

    Args:
        host: Owns the cell.
    """

    title = "simulated in this process"

    def __init__(self, host: WorkcellHost) -> None:
        self.host = host
        self._cell = host.embedded
        self._on_frame: OnFrame = lambda frame: None
        self._due = 0.0
        self._leave: Callable[[], None] = lambda: None
        self._adopt()

    @property
    def blueprint(self) -> Blueprint:
        """Blueprint of the world that is drawn."""
        world = self._believed.world if self._world is None else self._world.world
        return Blueprint.of(world, self._cell.ctx.arm.name)

    @property
    def teleop(self) -> EmbeddedTeleop:
        """Moves things by hand."""
        return EmbeddedTeleop(self._cell, self._send)

    def start(self, on_frame: OnFrame, on_elsewhere: OnElsewhere) -> None:
        """Begin; nobody else changes a world of this process."""
        self._on_frame = on_frame
        self.refresh()

    def refresh(self) -> None:
        """Send a frame."""
        self.host.read(self._send)

    @contextmanager
    def changing(self) -> Iterator[None]:
        """Listen to the driver of what was loaded meanwhile."""
        before = self._cell.driver
        yield
        if self._cell.driver is not before:
            self._adopt()

    def adopt(self) -> None:
        """Nothing: nobody else loads anything."""

    def stop(self) -> None:
        """Send no more frames."""
        self._leave()

    def _adopt(self) -> None:
        self._leave()
        driver = self._cell.driver
        self._world = mujoco_behind(driver)
        if self._world is None:
            self._believed = BelievedWorld(self._cell.task.scene, self._cell.observe())
        self._leave = driver.subscribe(self._between_ticks)

    def _between_ticks(self) -> None:
        now = time.monotonic()
        if now >= self._due:
            # Not from now on: ticks come every so often, and each frame would wait for the next one.
            self._due = max(self._due + 1.0 / FRAME_HZ, now)
            self._send()

    def _send(self) -> None:
        self._on_frame(self._frame())

    def _frame(self) -> Frame:
        sim = self._world
        if sim is None:
            return self._believed.frame(self._cell.ctx.seen or self._cell.observe(), self._cell.driver.state())
        state = sim.snapshot()
        # A state begins with the time, and positions come next.
        qpos = state[1 : 1 + sim.model.nq]
        return Frame(model=sim.model, seen=sim.state(), hands=sim.in_hands(), qpos=qpos, state=state)
