"""Protocols of drivers: any driver, a simulated world, a driver with a judge of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from robosandbox.driver.capabilities import Capabilities
    from robosandbox.types import Array, Observation, PictureWindow, RgbdFrame, Scene, Trajectory, Truth
    from robosandbox.types.robot import RobotSpec


# Asked in a driver's control loop, after each tick: why the motion has to end with the arm holding, or None to go on. It moves
# nothing itself and does not raise.
Guard = Callable[[], Exception | None]


@runtime_checkable
class Driver(Protocol):
    """A world with one robot in it, advanced in control ticks.

    An entry point of `robosandbox.drivers` is called as `factory(scene, **options)` and returns one that is connected;
    `docs/drivers.md` says which options it may take. `conformance.check_driver` tries every member.
    """

    @property
    def spec(self) -> RobotSpec:
        """Specification of the robot: joints, limits, gripper, reach."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities; what is not there raises an UnsupportedError where it is asked for."""
        ...

    @property
    def episode(self) -> int:
        """Changes with every reset: what was seen before it is of another world."""
        ...

    @property
    def time(self) -> float: ...
    @property
    def control_timestep(self) -> float: ...
    @property
    def guards(self) -> list[Guard]:
        """Asked after every control tick of any motion or wait: limits of force and place, cancelling, deadlines."""
        ...

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener` called after every control tick, before the guards; return what ends that."""
        ...

    def state(self, cameras: Sequence[str] = ()) -> Observation: ...
    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what the RGB-D sensor of a camera delivers now; raises RenderingError where nothing renders.

        A `window` is given only where the camera's `windows` is declared: the rest of the frame is black and without depth.
        """
        ...

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow the trajectory; return when its last row has been commanded.

        Where a guard says why not, one of these or a standing one, the driver stops the arm and raises that.
        """
        ...

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,); guards as above."""
        ...

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held; guards as above."""
        ...

    def stop(self) -> None:
        """Command the arm to stay where it is."""
        ...

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed; with `force` newtons of its motors at most.

        Returns at once. Without a force it closes as hard as its motors do. Raises UnsupportedError for a force where
        `grip_limit` is not declared.
        """
        ...

    def strongest_contact(self) -> tuple[float, str, str]:
        """Return the largest normal force between the robot and anything else, N, and the two bodies; 0 without one."""
        ...

    def forces(self) -> Mapping[str, Array]:
        """Return the sum of what the robot presses and pulls each thing with that it touches, N in the world, shape (3,).

        Keys are ids of objects, "table", or what else the driver calls it; one key for all where it does not tell them apart.
        """
        ...

    def force_on(self, object_id: str | None) -> Array:
        """Return the sum of what the robot presses and pulls an object with, N in the world, shape (3,); None is all."""
        ...

    def grip_on(self, object_id: str | None) -> float:
        """Return with how much force each side of the gripper presses on an object, N, as pads that feel would; None is any."""
        ...

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo gives now and the most that it can, N m or N; infinite without a limit."""
        ...

    def arm_contacts(self) -> tuple[tuple[str, str], ...]:
        """Return the pairs (robot body, other body) that touch now."""
        ...

    def close(self) -> None:
        """Let go of the robot, which holds where it is, or free the world."""
        ...


@runtime_checkable
class Simulated(Driver, Protocol):
    """A simulated world: it knows its own state, starts over and can be copied.

    Judges, ground-truth perception, replay and trials ask for it; `drivers.simulated` says so where it is not there.
    """

    @property
    def scene(self) -> Scene:
        """The scene as loaded or last reset to."""
        ...

    @property
    def physics_steps(self) -> int:
        """Physics steps since the last reset."""
        ...

    @property
    def jump_hooks(self) -> list[Callable[[], None]]:
        """Called after the state was set in another way than by letting time pass."""
        ...

    @property
    def wait_hooks(self) -> list[Callable[[], None]]:
        """Called again and again while a scene is loaded and settles. One that raises ends that."""
        ...

    def truth(self, *, for_judging: bool = True) -> Truth:
        """Return the simulated state, for judging and ground-truth perception; skills and planners never read it.

        Args:
            for_judging: Say also what objects are made of and what presses on them, which takes several times as long.
        """
        ...

    def reset(self, scene: Scene | None = None, q: Array | None = None) -> None:
        """Start over, in a scene with the same robot and the arm at `q` (n,); as it began where they are left out.

        Raises:
            InputError: Objects start inside something.
        """
        ...

    def snapshot(self) -> Array:
        """Return the whole simulated state as one vector."""
        ...

    def restore(self, state: Array) -> None:
        """Go back to a snapshot of this scene."""
        ...

    def resume(self, scene: Scene, state: Array, physics_steps: int) -> None:
        """Go back to a snapshot that was taken in `scene` after so many physics steps; raises InputError."""
        ...

    def fork(self) -> Simulated:
        """Return a copy that shares nothing that moves."""
        ...


@runtime_checkable
class Refereed(Driver, Protocol):
    """A driver that comes with a judge of its own: what it measures for a verdict, apart from what skills are told.

    A judge and a bench alone may call it. A simulated world's judge is its truth.
    """

    def referee(self) -> Truth:
        """Return the state to judge on."""
        ...
