"""The outermost driver: every command to a robot goes through it, and at every control tick it looks whether to go on.

`driver_factory` puts one before whatever is installed. What else a driver is, a simulated world or one with a referee, its
safe face is as well: a class beside the protocol says how, and `face_of` makes it known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Self, TypeVar

from robosandbox.driver.clamps import Clamps
from robosandbox.driver.passing import PassingDriver
from robosandbox.driver.protocols import Driver, Guard, Refereed, Simulated
from robosandbox.driver.safety import Safety
from robosandbox.errors import LimitError

if TYPE_CHECKING:
    from robosandbox.types import Array, Scene, Trajectory, Truth


class SafeDriver(PassingDriver):
    """A driver that is commanded within its robot's limits alone, and stops where a limit or a watchdog says so.

    Args:
        inner: What drives the robot. Its guards are this one's from now on.

    Attributes:
        safety: What is kept, and how the robot stands.

    Raises:
        UnsupportedError: The robot's own limits name a force, and the driver feels none.
    """

    def __init__(self, inner: Driver) -> None:
        super().__init__(inner)
        self.safety = Safety(inner)
        self._clamps = Clamps(inner.spec)
        self._waits_out_stops = inner.capabilities.clock == "wall"
        self._braking = False
        self._last: Array | None = None
        self._guards: list[Guard] = [*inner.guards]
        inner.guards[:] = [self._after_tick]

    @property
    def guards(self) -> list[Guard]:
        """Asked after every control tick, once the limits have been."""
        return self._guards

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory within the robot's limits.

        Raises:
            LimitError: It passes a limit of position, speed or acceleration, or begins elsewhere, and nothing has moved; or
                the arm came to a limit of place or force, and holds.
            FaultError: A watchdog has stopped the arm, or nothing moves before `recover`.
        """
        self.safety.begin()
        self._clamps.check_trajectory(trajectory, self._last, self._measured)
        self.safety.moving()
        try:
            self._inner.follow(trajectory, guards)
        except BaseException as error:
            self._broken_off(error)
            raise
        self._last = trajectory.q[-1]
        self.safety.arrived()

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal`; errors as of `follow`."""
        self.safety.begin()
        self._clamps.check_step(goal, self._last, self._measured)
        self.safety.moving()
        try:
            self._inner.trim(goal, guards)
        except BaseException as error:
            self._broken_off(error)
            raise
        self._last = goal
        self.safety.arrived()

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass, which a fault does not keep from it; errors as of a motion under way."""
        try:
            self._inner.wait(seconds, guards)
        except BaseException as error:
            self._broken_off(error)
            raise

    def stop(self) -> None:
        """Command the arm to stay where it is, and see to it that it stands.

        On a wall's clock it returns when the arm stands. Where time is simulated it returns at once, and the arm is watched
        while time is let pass.

        Raises:
            FaultError: The arm still moves after the time in which it has to stand.
        """
        self._inner.stop()
        self._stopped()
        if self._waits_out_stops:
            self._wait_out_stop()

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper; raises FaultError where nothing moves before `recover`."""
        self.safety.begin()
        self._inner.set_gripper(closed, force)

    def recover(self) -> None:
        """Have the driver move again after a fault; somebody has looked after what was the matter.

        Raises:
            FaultError: It still is.
        """
        self.safety.recover()
        self._last = None

    def close(self) -> None:
        """Let go of the robot, and of listeners and guards."""
        self._guards.clear()
        self._inner.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _after_tick(self) -> Exception | None:
        """Return why the motion has to end, or None; the one guard of the driver behind."""
        error: Exception | None = self.safety.ticked()
        if error is not None or self._braking:
            return error
        for guard in self._guards:
            error = guard()
            if error is not None:
                return error
        return None

    def _measured(self) -> Array:
        return self._inner.state().q

    def _stopped(self) -> None:
        self._last = None
        self.safety.stopping()

    def _broken_off(self, error: BaseException) -> None:
        """See to it that the arm stops after a motion or a wait that has ended early."""
        # A driver stops when one of its guards says so; whether it does when something else fails is its own business.
        self._inner.stop()
        self._stopped()
        if self._waits_out_stops and isinstance(error, Exception):
            self._wait_out_stop()

    def _wait_out_stop(self) -> None:
        # What asks to end a motion, as a cancel, is left for the next one to hear.
        self._braking = True
        try:
            while self.safety.is_stopping:
                try:
                    self._inner.wait(self.control_timestep)
                except LimitError:
                    # It brakes against something: it was told to stop where it is now, and is to stand there in time.
                    continue
        finally:
            self._braking = False


Face = TypeVar("Face", bound=type[SafeDriver])
_FACES: list[tuple[type[Any], type[SafeDriver]]] = [(Driver, SafeDriver)]


def face_of(kind: type[Any]) -> Callable[[Face], Face]:
    """Return what makes a class known as the safe face of drivers of a protocol; what is made known last is asked first."""

    def known(face: Face) -> Face:
        _FACES.insert(0, (kind, face))
        return face

    return known


def made_safe(driver: Driver) -> SafeDriver:
    """Return a driver's safe face, which is what else the driver is; a safe one itself.

    Raises:
        UnsupportedError: The robot's own limits name a force, and the driver feels none.
    """
    if isinstance(driver, SafeDriver):
        return driver
    return next((face for kind, face in _FACES if isinstance(driver, kind)), SafeDriver)(driver)


@face_of(Refereed)
class SafeRefereed(SafeDriver):
    """One with a referee."""

    def __init__(self, inner: Refereed) -> None:
        super().__init__(inner)
        self._refereed = inner

    def referee(self) -> Truth:
        """Return the state to judge on."""
        return self._refereed.referee()


@face_of(Simulated)
class SafeSimulated(SafeDriver):
    """A simulated world."""

    def __init__(self, inner: Simulated) -> None:
        super().__init__(inner)
        self._simulated = inner

    @property
    def scene(self) -> Scene:
        """The scene as loaded or last reset to."""
        return self._simulated.scene

    @property
    def physics_steps(self) -> int:
        """Physics steps since the last reset."""
        return self._simulated.physics_steps

    @property
    def jump_hooks(self) -> list[Callable[[], None]]:
        """Called after the state was set in another way than by letting time pass."""
        return self._simulated.jump_hooks

    @property
    def wait_hooks(self) -> list[Callable[[], None]]:
        """Called again and again while a scene is loaded and settles."""
        return self._simulated.wait_hooks

    def truth(self, *, for_judging: bool = True) -> Truth:
        """Return the simulated state."""
        return self._simulated.truth(for_judging=for_judging)

    def reset(self, scene: Scene | None = None, q: Array | None = None) -> None:
        """Start over; a fault is over with the world that it was in."""
        self._simulated.reset(scene, q)
        self._jumped()

    def snapshot(self) -> Array:
        """Return the whole simulated state as one vector."""
        return self._simulated.snapshot()

    def restore(self, state: Array) -> None:
        """Go back to a snapshot of this scene."""
        self._simulated.restore(state)
        self._jumped()

    def resume(self, scene: Scene, state: Array, physics_steps: int) -> None:
        """Go back to a snapshot that was taken in `scene` after so many physics steps."""
        self._simulated.resume(scene, state, physics_steps)
        self._jumped()

    def fork(self) -> Simulated:
        """Return a copy that shares nothing that moves, not even the limits: whoever acts in it puts it behind its own."""
        return self._simulated.fork()

    def _jumped(self) -> None:
        self._last = None
        self.safety.anew()
