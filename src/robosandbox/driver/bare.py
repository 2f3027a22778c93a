"""Parts to make drivers of: the control loop's listeners and guards, commands per tick, senses that are not there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from robosandbox.driver.capabilities import Capabilities, refusal
from robosandbox.types import Observation
from robosandbox.types.robot import ARM, HAND

if TYPE_CHECKING:
    from robosandbox.driver.capabilities import Declares
    from robosandbox.driver.protocols import Arm, Guard, Hand, Mode, Senses, Simulated
    from robosandbox.driver.surroundings import Meets
    from robosandbox.types import ArmState, Array, GripperState, PictureWindow, RgbdFrame, Trajectory, Truth
    from robosandbox.types.robot import GripperSpec, RobotSpec


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
            stop: Has the arms hold where they are.
            guards: Those of this motion, asked after the standing ones.

        Raises:
            Exception: What the first guard returned that does not let the motion go on; the arms hold.
        """
        for listener in tuple(self._listeners):
            listener()
        for guard in (*self.guards, *guards):
            error = guard()
            if error is not None:
                stop()
                raise error


class BareArm(ABC):
    """An arm without any sense but its encoders.

    Attributes:
        driver: Whose arm.
        spec: Specification.
        name: Its key in `driver.arms`.
        meets: What it meets of itself and of what stands there fixed (`motion.fixed_surroundings.meetings`), which it is kept out of;
            None where its driver does not know.
    """

    def __init__(self, driver: Declares, spec: RobotSpec, name: str = ARM) -> None:
        self.driver = driver
        self.spec: RobotSpec = spec
        self.name: str = name
        self.meets: Meets | None = None

    @abstractmethod
    def state(self) -> ArmState:
        """Return what its encoders read."""

    @abstractmethod
    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory."""

    @abstractmethod
    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let a tick pass, the commands shifted against what keeps the arm off `goal` (n,)."""

    @abstractmethod
    def stop(self) -> None:
        """Command the arm to stay where it is."""

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Refuse: the joints measure no torque.

        Raises:
            UnsupportedError: Always.
        """
        del joint
        raise refusal(self.driver, "joint_torque", "a joint's torque was asked for")


class BareHand(ABC):
    """A hand that feels nothing.

    Attributes:
        driver: Whose hand.
        spec: Specification.
        name: Its key in `driver.hands`.
        arm: Name of the arm that carries it.
    """

    def __init__(self, driver: Declares, spec: GripperSpec, name: str = HAND, arm: str = ARM) -> None:
        self.driver = driver
        self.spec: GripperSpec = spec
        self.name: str = name
        self.arm: str = arm

    @abstractmethod
    def state(self) -> GripperState:
        """Return what its encoders read."""

    @abstractmethod
    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper."""

    def grip_on(self, object_id: str | None) -> float:
        """Refuse: the gripper measures no force.

        Raises:
            UnsupportedError: Always.
        """
        del object_id
        raise refusal(self.driver, "gripper_force", "a grip was asked for")


class BareSenses:
    """Senses of a driver that has none: each is refused by name until it is overridden.

    Attributes:
        driver: Whose.
    """

    def __init__(self, driver: Declares) -> None:
        self.driver = driver

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Refuse: there is no camera.

        Raises:
            UnsupportedError: Always.
        """
        del window
        raise refusal(self.driver, "cameras", f"a frame of {camera!r} was asked for")

    def strongest_contact(self, arm: str | None = None) -> tuple[float, str, str]:
        """Refuse: the arm has no skin.

        Raises:
            UnsupportedError: Always.
        """
        del arm
        raise refusal(self.driver, "contact", "a contact was asked for")

    def contacts(self, arm: str | None = None) -> tuple[tuple[str, str], ...]:
        """Refuse: the arm has no skin.

        Raises:
            UnsupportedError: Always.
        """
        del arm
        raise refusal(self.driver, "contact", "contacts were asked for")

    def forces(self, arm: str | None = None) -> Mapping[str, Array]:
        """Refuse: the arm has no skin.

        Raises:
            UnsupportedError: Always.
        """
        del arm
        raise refusal(self.driver, "contact", "the force on each thing was asked for")

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Refuse: nothing at the wrist measures force.

        Raises:
            UnsupportedError: Always.
        """
        del object_id, arm
        raise refusal(self.driver, "wrist_wrench", "a force was asked for")


class BareDriver(ABC):
    """A driver of arms without any sense but their encoders, and without a fault of its own.

    Attributes:
        arms: The arms by name, which a driver of yours sets.
        hands: Likewise the hands.
        senses: None, until a driver of yours sets them.
        fault: Reason why nothing moves; a driver whose controller has faults of its own sets it.
        simulation: None: it simulates nothing that anybody may know.
        referee: None: it judges nothing.
    """

    arms: Mapping[str, Arm]
    hands: Mapping[str, Hand]
    simulation: Simulated | None = None

    def __init__(self) -> None:
        self._loop = ControlLoop()
        self.senses: Senses = BareSenses(self)
        self.fault: str = ""

    @property
    @abstractmethod
    def capabilities(self) -> Capabilities:
        """Capabilities of the driver."""

    @property
    @abstractmethod
    def time(self) -> float:
        """Seconds by the driver's clock."""

    @property
    def mode(self) -> Mode:
        """Whether there is a fault; motions and stops are seen by `SafeDriver`."""
        return "fault" if self.fault else "ready"

    def recover(self) -> None:
        """End a fault."""
        self.fault = ""

    @property
    def referee(self) -> Callable[[], Truth] | None:
        """None: it judges nothing."""
        return None

    @property
    def guards(self) -> list[Guard]:
        """Asked after every control tick."""
        return self._loop.guards

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener` called after every control tick, before the guards; return what ends that."""
        return self._loop.subscribe(listener)

    def state(self, cameras: Sequence[str] = ()) -> Observation:
        """Return how the arms stand, and pictures."""
        arms = {name: arm.state() for name, arm in self.arms.items()}
        return Observation(time=self.time, arms=arms, images={name: self.senses.capture(name).rgb for name in cameras})

    def stop(self) -> None:
        """Command every arm to stay where it is."""
        for arm in self.arms.values():
            arm.stop()

    def _ticked(self, guards: Sequence[Guard]) -> None:
        """Tell and ask after a control tick; raises what a guard returned, the arms holding."""
        self._loop.ticked(self.stop, guards)


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
