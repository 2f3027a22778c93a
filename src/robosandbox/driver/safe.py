"""The outermost driver: every command to a robot goes through it, and at every control tick it looks whether to go on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from typing import TYPE_CHECKING, Self

from robosandbox.driver.clamps import Clamps
from robosandbox.driver.collector import put_off
from robosandbox.driver.fault_log import FaultLog
from robosandbox.driver.passing import PassingArm, PassingDriver, PassingHand
from robosandbox.driver.protocols import Arm, Driver, Guard, Hand, Mode
from robosandbox.driver.safety import Safety
from robosandbox.types import Trajectory

if TYPE_CHECKING:
    from robosandbox.types import Array


class SafeArm(PassingArm):
    """An arm that is commanded within its limits alone.

    Args:
        inner: The arm as its own driver has it.
        driver: That driver.
        safety: What looks after the cell.
    """

    def __init__(self, inner: Arm, driver: Driver, safety: Safety) -> None:
        super().__init__(inner)
        self._driver = driver
        self._safety = safety
        self._clamps = Clamps(inner.spec, driver.control_timestep)
        self._surroundings = safety.surroundings(inner.name)

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory within the robot's limits.

        Raises:
            LimitError: It passes a limit of position, speed or acceleration, begins elsewhere, or leads into the arm itself or what
                stands there, and nothing has moved; or the arm came to a limit of place or force, and holds.
            FaultError: A watchdog has stopped the arm, or nothing moves before `recover`.
        """
        self._safety.begin()
        self._clamps.check_trajectory(trajectory, self._driver.time, self._measured)
        if self._surroundings is not None:
            self._surroundings.check_trajectory(trajectory)
        self._command(lambda: self._inner.follow(trajectory, guards))
        self._clamps.followed(trajectory, self._driver.time)

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal`; errors as of `follow`."""
        self._safety.begin()
        self._clamps.check_step(goal, self._driver.time, self._measured)
        if self._surroundings is not None:
            self._surroundings.check(goal[None])
        self._command(lambda: self._inner.trim(goal, guards))
        self._clamps.stepped(goal, self._driver.time)

    def stop(self) -> None:
        """Command the arm to stay where it is, and see to it that it stands; as `SafeDriver.stop`."""
        self.halt()
        self._safety.halted(self.name)

    def halt(self) -> None:
        """Command the arm to stay where it is."""
        self._inner.stop()
        self._clamps.forget()

    def brake(self, guards: Sequence[Guard]) -> None:
        """Come to rest within the arm's limits where it was sent somewhere at a speed and nothing follows; errors as of `follow`."""
        rows = self._clamps.braking(self._driver.time)
        if rows is not None:
            self._clamps.forget()
            self._command(lambda: self._inner.follow(Trajectory(q=rows, dt=self._driver.control_timestep), guards))

    def forget_command(self) -> None:
        """Take note that the arm no longer goes by where it was sent last."""
        self._clamps.forget()

    def _command(self, move: Callable[[], None]) -> None:
        safety = self._safety
        with put_off() if self._driver.capabilities.clock == "wall" else nullcontext():
            safety.moving(self.name)
            try:
                move()
            except BaseException as error:
                # A driver stops when one of its guards says so; whether it does when something else fails is its own business.
                self.halt()
                safety.halted(self.name, waits=isinstance(error, Exception))
                raise
            safety.arrived()

    def _measured(self) -> Array:
        return self._inner.state().q


class SafeHand(PassingHand):
    """A hand that moves only while there is no fault."""

    def __init__(self, inner: Hand, safety: Safety) -> None:
        super().__init__(inner)
        self._safety = safety

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper; raises FaultError where nothing moves before `recover`."""
        self._safety.begin()
        self._inner.set_gripper(closed, force)


class SafeDriver(PassingDriver):
    """A driver that is commanded within its robot's limits alone, and stops where a limit or a watchdog says so.

    Args:
        inner: What drives the robot. Its guards are this one's from now on.

    Attributes:
        safety: What is kept, and how the robot stands.
        fault_log: The last ten seconds before each fault; None where time is simulated.

    Raises:
        UnsupportedError: The robot's own limits name a force, and the driver feels none.
    """

    def __init__(self, inner: Driver) -> None:
        super().__init__(inner)
        self.safety: Safety = Safety(inner)
        self._arms = {name: SafeArm(arm, inner, self.safety) for name, arm in inner.arms.items()}
        self._hands = {name: SafeHand(hand, self.safety) for name, hand in inner.hands.items()}
        self.fault_log: FaultLog | None = FaultLog(inner) if inner.capabilities.clock == "wall" else None
        self._guards: list[Guard] = [*inner.guards]
        inner.guards[:] = [self._after_tick]
        if inner.simulation is not None:
            inner.simulation.jump_hooks.append(self._jumped)

    @property
    def behind(self) -> Driver:
        """The driver that is looked after: to read what a driver of its kind tells besides, not to command."""
        return self._inner

    @property
    def arms(self) -> Mapping[str, Arm]:
        """The arms by name, within their limits."""
        return self._arms

    @property
    def hands(self) -> Mapping[str, Hand]:
        """The hands by name."""
        return self._hands

    @property
    def mode(self) -> Mode:
        """How the cell stands."""
        return self.safety.mode

    @property
    def fault(self) -> str:
        """Reason why nothing moves before `recover`, in words; "" where there is no fault."""
        return self.safety.fault or self._inner.fault

    @property
    def guards(self) -> list[Guard]:
        """Asked after every control tick, once the limits have been."""
        return self._guards

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass, which a fault does not keep from it; errors as of a motion under way.

        An arm that was to go on, and does not, first comes to rest.
        """
        for arm in self._arms.values():
            arm.brake(guards)
        try:
            self._inner.wait(seconds, guards)
        except BaseException as error:
            self._halt(waits=isinstance(error, Exception))
            raise

    def stop(self) -> None:
        """Command every arm to stay where it is, and see to it that they stand.

        On a wall's clock it returns when they stand. Where time is simulated it returns at once, and they are watched while
        time is let pass.

        Raises:
            FaultError: An arm still moves after the time in which it has to stand.
        """
        self._halt()

    def run_again(self, tick: Callable[[], None]) -> None:
        """Let a tick pass with recorded controls, which reach the servos as they are.

        They hold what the driver had added to its commands, the lead against the servos' lag and integral action, so that the
        clamps of commands do not fit them, and a world that refused one would not be the recorded one. Limits of place and force
        are kept, and a fault keeps them from moving anything.

        Raises:
            LimitError: The arm came to a limit of place or force, and holds.
            FaultError: Nothing moves before `recover`.
        """
        self.safety.begin()
        for name in self._arms:
            self.safety.moving(name)
        try:
            tick()
        except BaseException as error:
            self._halt(waits=isinstance(error, Exception))
            raise
        self._forget_commands()
        self.safety.arrived()

    def recover(self) -> None:
        """Have the driver move again after a fault; somebody has looked after what was the matter.

        Raises:
            FaultError: It still is.
        """
        self._inner.recover()
        self.safety.recover()
        self._forget_commands()

    def close(self) -> None:
        """Let go of the robot, and of listeners and guards."""
        self._guards.clear()
        for switch in self.safety.switches:
            switch.close()
        self._inner.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _after_tick(self) -> Exception | None:
        """Return why the motion has to end, or None; the one guard of the driver behind."""
        error: Exception | None = self.safety.ticked()
        if self.fault_log is not None:
            self.fault_log.ticked(self.mode, self.fault)
        if error is not None or self.safety.is_braking:
            return error
        for guard in self._guards:
            error = guard()
            if error is not None:
                return error
        return None

    def _halt(self, *, waits: bool = True) -> None:
        for arm in self._arms.values():
            arm.halt()
        self.safety.halted(*self._arms, waits=waits)

    def _jumped(self) -> None:
        """Begin anew: the simulated world was put into another state, and a fault is over with the world that it was in."""
        self._forget_commands()
        self.safety.anew()

    def _forget_commands(self) -> None:
        for arm in self._arms.values():
            arm.forget_command()


def made_safe(driver: Driver) -> SafeDriver:
    """Return a driver behind its robot's limits; one that is already, itself.

    Raises:
        UnsupportedError: The robot's own limits name a force, and the driver feels none.
    """
    return driver if isinstance(driver, SafeDriver) else SafeDriver(driver)
