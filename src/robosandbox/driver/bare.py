"""Parts to make drivers of: the control loop's listeners and guards, commands per tick, senses that are not there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from robosandbox.driver.capabilities import Capabilities, refusal

if TYPE_CHECKING:
    from robosandbox.driver.protocols import Guard
    from robosandbox.types import Array, PictureWindow, RgbdFrame, Trajectory
    from robosandbox.types.robot import RobotSpec


class ControlLoop:
    """Listeners and guards of a driver, called after each control tick, listeners first.

    Attributes:
        guards: Asked after every tick.
    """

    def __init__(self) -> None:
        self.guards: list[Guard] = []
        self._listeners: list[Callable[[], None]] = []

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` after every tick; return what ends that."""
        self._listeners.append(listener)

        def end() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return end

    def close(self) -> None:
        """Let go of listeners and guards: they hold the driver in turn, and all that it simulates with it."""
        self._listeners.clear()
        self.guards.clear()

    def ticked(self, stop: Callable[[], None], guards: Sequence[Guard] = ()) -> None:
        """Tell the listeners, and ask the guards.

        Args:
            stop: Has the arm hold where it is.
            guards: Those of this motion, asked after the standing ones.

        Raises:
            Exception: What the first guard returned that does not let the motion go on; the arm holds.
        """
        for listener in tuple(self._listeners):
            listener()
        for guard in (*self.guards, *guards):
            error = guard()
            if error is not None:
                stop()
                raise error


class BareDriver(ABC):
    """A driver without any sense but its encoders: each of the others is refused by name until it is overridden.

    Attributes:
        guards: Asked after every control tick.
    """

    def __init__(self) -> None:
        self._loop = ControlLoop()
        self.guards: list[Guard] = self._loop.guards

    @property
    @abstractmethod
    def spec(self) -> RobotSpec:
        """Specification of the robot."""

    @property
    @abstractmethod
    def capabilities(self) -> Capabilities:
        """Capabilities of the driver."""

    @abstractmethod
    def stop(self) -> None:
        """Command the arm to stay where it is."""

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener` called after every control tick, before the guards; return what ends that."""
        return self._loop.subscribe(listener)

    def _ticked(self, guards: Sequence[Guard]) -> None:
        """Tell and ask after a control tick; raises what a guard returned, the arm holding."""
        self._loop.ticked(self.stop, guards)

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Refuse: there is no camera.

        Raises:
            UnsupportedError: Always.
        """
        del window
        raise refusal(self, "cameras", f"a frame of {camera!r} was asked for")

    def strongest_contact(self) -> tuple[float, str, str]:
        """Refuse: the arm has no skin.

        Raises:
            UnsupportedError: Always.
        """
        raise refusal(self, "contact", "a contact was asked for")

    def arm_contacts(self) -> tuple[tuple[str, str], ...]:
        """Refuse: the arm has no skin.

        Raises:
            UnsupportedError: Always.
        """
        raise refusal(self, "contact", "contacts were asked for")

    def forces(self) -> Mapping[str, Array]:
        """Refuse: the arm has no skin.

        Raises:
            UnsupportedError: Always.
        """
        raise refusal(self, "contact", "the force on each thing was asked for")

    def force_on(self, object_id: str | None) -> Array:
        """Refuse: nothing at the wrist measures force.

        Raises:
            UnsupportedError: Always.
        """
        del object_id
        raise refusal(self, "wrist_wrench", "a force was asked for")

    def grip_on(self, object_id: str | None) -> float:
        """Refuse: the gripper measures no force.

        Raises:
            UnsupportedError: Always.
        """
        del object_id
        raise refusal(self, "gripper_force", "a grip was asked for")

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Refuse: the joints measure no torque.

        Raises:
            UnsupportedError: Always.
        """
        del joint
        raise refusal(self, "joint_torque", "a joint's torque was asked for")


def per_tick(trajectory: Trajectory, control_timestep: float) -> Array:
    """Return where a trajectory is at each control tick, shape (ticks, n); the last row is its end.

    Args:
        trajectory: Rows at a time step of their own.
        control_timestep: Seconds.
    """
    ticks = max(1, int(np.ceil(trajectory.duration / control_timestep - 1e-9)))
    times = np.minimum(np.arange(1, ticks + 1) * control_timestep, trajectory.duration)
    rows = np.arange(len(trajectory.q)) * trajectory.dt
    return np.column_stack([np.interp(times, rows, column) for column in trajectory.q.T])
