"""The world as skills may know it where cameras see: the robot's own senses, without what a simulation knows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from robosandbox.driver import Capabilities, Driver, Guard
from robosandbox.errors import UnsupportedError
from robosandbox.types import (
    Array,
    Observation,
    PictureWindow,
    RgbdFrame,
    Trajectory,
)
from robosandbox.types.robot import RobotSpec


class SensedSim:
    """A sim without its truth: joints, cameras and commands are the sim's; no contact is told by what it is with.

    Args:
        sim: The real one.
    """

    def __init__(self, sim: Driver) -> None:
        self._sim = sim

    def arm_contacts(self) -> tuple[tuple[str, str], ...]:
        """Refuse: the arm feels that it touches something, not what.

        Raises:
            UnsupportedError: Always.
        """
        raise UnsupportedError("contact: this driver tells contact without what is touched; read strongest_contact()")

    def strongest_contact(self) -> tuple[float, str, str]:
        """Return the largest force that the robot feels, and on which link; not what it touches."""
        force, link, _ = self._sim.strongest_contact()
        return force, link, "something" if link else ""

    def forces(self) -> Mapping[str, Array]:
        """Return all that the robot presses and pulls with, N in the world, shape (3,), as of one thing: it is not told which."""
        found = tuple(self._sim.forces().values())
        return {"something": np.sum(found, axis=0)} if found else {}

    def force_on(self, object_id: str | None) -> Array:
        """Return what a force sensor at the wrist feels, N in the world, shape (3,); it cannot tell of which object."""
        del object_id
        return self._sim.force_on(None)

    def grip_on(self, object_id: str | None) -> float:
        """Return how hard pads that feel are pressed, N; they cannot tell by which object."""
        del object_id
        return self._sim.grip_on(None)

    # Sensors and motions of the robot, which need no simulated truth.

    @property
    def spec(self) -> RobotSpec:
        """Specification of the robot."""
        return self._sim.spec

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities of the sim, without what only a simulation can."""
        whole = self._sim.capabilities
        felt = whole.contact and "felt"
        return replace(whole, contact=felt, fork=False, reset=False, truth=False)

    @property
    def time(self) -> float:
        """Simulated seconds since reset."""
        return self._sim.time

    @property
    def episode(self) -> int:
        """Changes with every reset."""
        return self._sim.episode

    @property
    def control_timestep(self) -> float:
        """Seconds between commands."""
        return self._sim.control_timestep

    @property
    def guards(self) -> list[Guard]:
        """Asked after every control tick."""
        return self._sim.guards

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have a listener called after every control tick."""
        return self._sim.subscribe(listener)

    def state(self, cameras: Sequence[str] = ()) -> Observation:
        """Return proprioception and pictures."""
        return self._sim.state(cameras)

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what a camera's sensor delivers."""
        # A driver whose cameras declare no windows need not know of them.
        return self._sim.capture(camera) if window is None else self._sim.capture(camera, window)

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory."""
        self._sim.follow(trajectory, guards)

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let a tick pass, shifted against what keeps the arm off its goal."""
        self._sim.trim(goal, guards)

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass."""
        self._sim.wait(seconds, guards)

    def stop(self) -> None:
        """Command the arm to stay."""
        self._sim.stop()

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo presses with, and its limit, N m or N."""
        return self._sim.servo_force(joint)

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper."""
        self._sim.set_gripper(closed, force)

    def close(self) -> None:
        """Close the sim."""
        self._sim.close()
