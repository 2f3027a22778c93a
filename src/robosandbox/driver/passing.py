"""A driver that hands everything on to another one: what stands before a driver overrides what it changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robosandbox.driver.capabilities import Capabilities
    from robosandbox.driver.protocols import Driver, Guard
    from robosandbox.types import Array, Observation, PictureWindow, RgbdFrame, Trajectory
    from robosandbox.types.robot import RobotSpec


class PassingDriver:
    """A driver whose members are those of another; `Driver` says what each is.

    Args:
        inner: Whose they are.
    """

    def __init__(self, inner: Driver) -> None:
        self._inner = inner

    @property
    def spec(self) -> RobotSpec:
        """What the robot is."""
        return self._inner.spec

    @property
    def capabilities(self) -> Capabilities:
        """What it has."""
        return self._inner.capabilities

    @property
    def episode(self) -> int:
        """Changes with every reset."""
        return self._inner.episode

    @property
    def time(self) -> float:
        """Its seconds."""
        return self._inner.time

    @property
    def control_timestep(self) -> float:
        """Seconds between commands."""
        return self._inner.control_timestep

    @property
    def guards(self) -> list[Guard]:
        """Asked after every control tick."""
        return self._inner.guards

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have a listener called after every control tick; return what ends that."""
        return self._inner.subscribe(listener)

    def state(self, cameras: Sequence[str] = ()) -> Observation:
        """Return proprioception and pictures."""
        return self._inner.state(cameras)

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what a camera's sensor delivers."""
        # A driver whose cameras declare no windows need not know of them.
        return self._inner.capture(camera) if window is None else self._inner.capture(camera, window)

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory."""
        self._inner.follow(trajectory, guards)

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let a tick pass, the commands shifted against what keeps the arm off its goal."""
        self._inner.trim(goal, guards)

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass."""
        self._inner.wait(seconds, guards)

    def stop(self) -> None:
        """Command the arm to stay where it is."""
        self._inner.stop()

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper."""
        self._inner.set_gripper(closed, force)

    def strongest_contact(self) -> tuple[float, str, str]:
        """Return the largest force between the robot and anything else, N, and the two bodies."""
        return self._inner.strongest_contact()

    def forces(self) -> Mapping[str, Array]:
        """Return the sum of what the robot presses and pulls each thing with, N in the world, shape (3,)."""
        return self._inner.forces()

    def force_on(self, object_id: str | None) -> Array:
        """Return the sum of what the robot presses and pulls an object with, N in the world, shape (3,); None is all."""
        return self._inner.force_on(object_id)

    def grip_on(self, object_id: str | None) -> float:
        """Return with how much force each side of the gripper presses on an object, N; None is any."""
        return self._inner.grip_on(object_id)

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo gives now and the most that it can, N m or N."""
        return self._inner.servo_force(joint)

    def arm_contacts(self) -> tuple[tuple[str, str], ...]:
        """Return the pairs (robot body, other body) that touch now."""
        return self._inner.arm_contacts()

    def close(self) -> None:
        """Close it."""
        self._inner.close()
