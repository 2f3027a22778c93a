"""Protocols of drivers: a cell with named arms, hands and senses; the simulated world behind one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, Protocol

if TYPE_CHECKING:
    from robosandbox.driver.capabilities import Capabilities
    from robosandbox.types import (
        ArmState,
        Array,
        GripperState,
        Observation,
        PictureWindow,
        RgbdFrame,
        Scene,
        Trajectory,
        Truth,
    )
    from robosandbox.types.robot import GripperSpec, RobotSpec


# Asked in a driver's control loop, after each tick: why the motion has to end with the arm holding, or None to go on. It moves
# nothing itself and does not raise.
Guard = Callable[[], Exception | None]

Mode = Literal["ready", "moving", "stopping", "stopped", "fault", "lost"]
"""State of a driver: at rest after a motion, in one, told to stop, seen to stand after that; ended by a fault; not heard of."""


class Arm(Protocol):
    """One arm of a cell. Others hold still while it moves."""

    @property
    def name(self) -> str:
        """Its key in `driver.arms`."""
        ...

    @property
    def spec(self) -> RobotSpec:
        """Specification: joints, limits, reach, and the gripper that it carries."""
        ...

    def state(self) -> ArmState:
        """Return what its encoders read, and its gripper's."""
        ...

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow the trajectory; return when its last row has been commanded.

        Where a guard says why not, one of these or a standing one, the driver stops the arm and raises that.
        """
        ...

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,); guards as above."""
        ...

    def stop(self) -> None:
        """Command the arm to stay where it is."""
        ...

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what a joint's servo gives now and the most that it can, N m or N; infinite without a limit."""
        ...


class Hand(Protocol):
    """One hand of a cell: the gripper that an arm carries."""

    @property
    def name(self) -> str:
        """Its key in `driver.hands`."""
        ...

    @property
    def arm(self) -> str:
        """Name of the arm that carries it."""
        ...

    @property
    def spec(self) -> GripperSpec:
        """Specification of the gripper."""
        ...

    def state(self) -> GripperState:
        """Return what the gripper's own encoders and motor tell: how far it is open, its force, a cup's seal."""
        ...

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed; with `force` newtons of its motors at most.

        Returns at once. Without a force it closes as hard as its motors do. Raises UnsupportedError for a force where
        `grip_limit` is not declared.
        """
        ...

    def grip_on(self, object_id: str | None) -> float:
        """Return with how much force each side presses on an object, N, as pads that feel would; None is any."""
        ...


class Senses(Protocol):
    """Cameras, and what the arms feel: of one arm by its name, of all where none is named."""

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what the RGB-D sensor of a camera delivers now; raises RenderingError where nothing renders.

        A `window` is given only where the camera's `windows` is declared: the rest of the frame is black and without depth.
        """
        ...

    def strongest_contact(self, arm: str | None = None) -> tuple[float, str, str]:
        """Return the largest normal force between an arm and anything else, N, and the two bodies; 0 without one."""
        ...

    def contacts(self, arm: str | None = None) -> tuple[tuple[str, str], ...]:
        """Return the pairs (body of the arm, other body) that touch now."""
        ...

    def forces(self, arm: str | None = None) -> Mapping[str, Array]:
        """Return the sum of what an arm presses and pulls each thing with that it touches, N in the world, shape (3,).

        Keys are ids of objects, "table", or what else the driver calls it; one key for all where it does not tell them apart.
        """
        ...

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return the sum of what an arm presses and pulls an object with, N in the world, shape (3,); None is all objects."""
        ...


class Driver(Protocol):
    """A cell: its arms, hands and senses, advanced in control ticks.

    An entry point of `robosandbox.drivers` is called as `factory(scene, **options)` and returns one that is connected;
    `docs/drivers.md` says which options it may take. `conformance.check_driver` tries every member.
    """

    @property
    def arms(self) -> Mapping[str, Arm]:
        """The arms by name; the only one is "arm"."""
        ...

    @property
    def hands(self) -> Mapping[str, Hand]:
        """The hands by name; the only one is "hand". None for arms that carry no gripper."""
        ...

    @property
    def senses(self) -> Senses:
        """Cameras, contact and forces; what is not there raises an UnsupportedError where it is asked for."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """Capabilities; what is not there raises an UnsupportedError where it is asked for."""
        ...

    @property
    def mode(self) -> Mode:
        """How the cell stands, as far as the driver knows; "fault" while there is one."""
        ...

    @property
    def fault(self) -> str:
        """Reason why nothing moves before `recover`, in words; "" where there is no fault."""
        ...

    def recover(self) -> None:
        """End a fault, somebody having looked after it; raises FaultError where it is not over."""
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

    def state(self, cameras: Sequence[str] = ()) -> Observation:
        """Return how every arm stands, and a picture per named camera."""
        ...

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held; guards as those of `Arm.follow`."""
        ...

    def stop(self) -> None:
        """Command every arm to stay where it is."""
        ...

    @property
    def simulation(self) -> Simulated | None:
        """The simulated world that it drives; None where there is none, or nobody is to know it."""
        ...

    @property
    def referee(self) -> Callable[[], Truth] | None:
        """Returns the state to judge on, measured apart from what skills are told; a judge and a bench alone may call it.

        None where there is no such thing. A simulated world's judge is its truth.
        """
        ...

    def close(self) -> None:
        """Let go of the robot, which holds where it is, or free the world."""
        ...


class Simulated(Protocol):
    """A simulated world: it knows its own state, starts over and can be copied.

    Judges, ground-truth perception, replay and trials ask for it, by `simulated`, which says so where it is not there.
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

    def reset(self, scene: Scene | None = None, q: Array | Mapping[str, Array] | None = None) -> None:
        """Start over, in a scene with the same robot and the arm at `q` (n,), or each arm by name; else as it began.

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

    def fork(self) -> Driver:
        """Return a driver of a copy that shares nothing that moves."""
        ...
