"""Drivers, arms, hands and senses that hand everything on to others: what stands before one overrides what it changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robosandbox.driver.capabilities import Capabilities
    from robosandbox.driver.protocols import Arm, Driver, Guard, Hand, Mode, Senses, Simulated
    from robosandbox.types import (
        ArmState,
        Array,
        GripperState,
        Observation,
        PictureWindow,
        RgbdFrame,
        Trajectory,
        Truth,
    )
    from robosandbox.types.robot import GripperSpec, RobotSpec


class PassingArm:
    """An arm whose members are those of another; `Arm` says what each is."""

    def __init__(self, inner: Arm) -> None:
        self._inner = inner

    @property
    def name(self) -> str:
        """Its name."""
        return self._inner.name

    @property
    def spec(self) -> RobotSpec:
        """Specification."""
        return self._inner.spec

    def state(self) -> ArmState:
        """Return what it reads of itself."""
        return self._inner.state()

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory."""
        self._inner.follow(trajectory, guards)

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let a tick pass, the commands shifted against what keeps the arm off its goal."""
        self._inner.trim(goal, guards)

    def stop(self) -> None:
        """Command the arm to stay where it is."""
        self._inner.stop()

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what a joint's servo gives now and the most that it can, N m or N."""
        return self._inner.servo_force(joint)


class PassingHand:
    """A hand whose members are those of another; `Hand` says what each is."""

    def __init__(self, inner: Hand) -> None:
        self._inner = inner

    @property
    def name(self) -> str:
        """Its name."""
        return self._inner.name

    @property
    def arm(self) -> str:
        """Name of its arm."""
        return self._inner.arm

    @property
    def spec(self) -> GripperSpec:
        """Specification."""
        return self._inner.spec

    def state(self) -> GripperState:
        """Return what it reads of itself."""
        return self._inner.state()

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper."""
        self._inner.set_gripper(closed, force)

    def grip_on(self, object_id: str | None) -> float:
        """Return with how much force each side presses on an object, N; None is any."""
        return self._inner.grip_on(object_id)


class PassingSenses:
    """Senses whose members are those of others; `Senses` says what each is."""

    def __init__(self, inner: Senses) -> None:
        self._inner = inner

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what a camera's sensor delivers."""
        return self._inner.capture(camera, window)

    def strongest_contact(self, arm: str | None = None) -> tuple[float, str, str]:
        """Return the largest force between an arm and anything else, N, and the two bodies."""
        return self._inner.strongest_contact(arm)

    def contacts(self, arm: str | None = None) -> tuple[tuple[str, str], ...]:
        """Return the pairs (body of the arm, other body) that touch now."""
        return self._inner.contacts(arm)

    def forces(self, arm: str | None = None) -> Mapping[str, Array]:
        """Return the sum of what an arm presses and pulls each thing with, N in the world, shape (3,)."""
        return self._inner.forces(arm)

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return the sum of what an arm presses and pulls an object with, N in the world, shape (3,); None is all."""
        return self._inner.force_on(object_id, arm)


class PassingDriver:
    """A driver whose members are those of another; `Driver` says what each is.

    Args:
        inner: Whose they are.
    """

    def __init__(self, inner: Driver) -> None:
        self._inner = inner

    @property
    def arms(self) -> Mapping[str, Arm]:
        """The arms by name."""
        return self._inner.arms

    @property
    def hands(self) -> Mapping[str, Hand]:
        """The hands by name."""
        return self._inner.hands

    @property
    def senses(self) -> Senses:
        """Cameras, contact and forces."""
        return self._inner.senses

    @property
    def capabilities(self) -> Capabilities:
        """What it has."""
        return self._inner.capabilities

    @property
    def mode(self) -> Mode:
        """How it stands."""
        return self._inner.mode

    @property
    def fault(self) -> str:
        """Why nothing moves."""
        return self._inner.fault

    def recover(self) -> None:
        """End a fault."""
        self._inner.recover()

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
        """Return how the arms stand, and pictures."""
        return self._inner.state(cameras)

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass."""
        self._inner.wait(seconds, guards)

    def stop(self) -> None:
        """Command every arm to stay where it is."""
        self._inner.stop()

    @property
    def simulation(self) -> Simulated | None:
        """The simulated world that it drives."""
        return self._inner.simulation

    @property
    def referee(self) -> Callable[[], Truth] | None:
        """Returns the state to judge on."""
        return self._inner.referee

    def close(self) -> None:
        """Close it."""
        self._inner.close()
