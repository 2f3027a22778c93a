"""A simulated world whose compiled MuJoCo model is there to be drawn, recorded, exported and planned in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol, runtime_checkable

import mujoco

from robosandbox.driver import Driver, SafeSimulated, Simulated, face_of
from robosandbox.errors import UnsupportedError
from robosandbox.robots.robot import Robot
from robosandbox.robots.sidecar import Sidecar
from robosandbox.sim.step_recorder import StepRecorder
from robosandbox.sim.world import World
from robosandbox.types import Array


@runtime_checkable
class Modelled(Simulated, Protocol):
    """A simulated world with a MuJoCo model. What draws, records or exports a model asks for it, and nothing else does."""

    @property
    def world(self) -> World:
        """The compiled scene."""
        ...

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        ...

    @property
    def robot(self) -> Robot:
        """The robot bound to the model."""
        ...

    @property
    def compilations(self) -> int:
        """Number of times a model was compiled."""
        ...

    @property
    def sidecar(self) -> Sidecar:
        """The robot's roles, as written or inferred."""
        ...

    @property
    def body_names(self) -> Sequence[str]:
        """Names of the bodies for people."""
        ...

    @property
    def object_bodies(self) -> Mapping[str, int]:
        """Body ids of the objects."""
        ...

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras."""
        ...

    @property
    def render_size(self) -> tuple[int, int]:
        """(height, width) of camera pictures, pixels."""
        ...

    @property
    def controls(self) -> Array:
        """Commands to the actuators now, shape (actuators,)."""
        ...

    def camera_in_model(self, name: str) -> str:
        """Return what the model calls a camera; raises InputError."""
        ...

    def log(self, capacity: int) -> StepRecorder:
        """Return a log that can take down this world's state; it ends with the model."""
        ...

    def held(self) -> str | None:
        """Return the object that both sides of the gripper touch."""
        ...

    def contact_forces(self) -> list[tuple[float, int, int]]:
        """Return normal force, N, and body ids of every contact of the robot, those with itself included."""
        ...

    def contacts_around(self, carried: Iterable[str] = ()) -> list[tuple[str, str, float]]:
        """Return (link or carried object, what it touches, N) of the robot and of these objects, its grip on them left out."""
        ...

    def replay(self, controls: Array, push: Array | None = None) -> None:
        """Let one control tick pass with recorded commands (actuators,) and pushes on the bodies (bodies, 6), N and N m."""
        ...

    def fork(self) -> Modelled:
        """Return a copy that shares the model and nothing that moves."""
        ...


@face_of(Modelled)
class SafeModelled(SafeSimulated):
    """A simulated world with a MuJoCo model, behind its robot's limits."""

    def __init__(self, inner: Modelled) -> None:
        super().__init__(inner)
        self._modelled = inner

    @property
    def world(self) -> World:
        """The compiled scene."""
        return self._modelled.world

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self._modelled.model

    @property
    def robot(self) -> Robot:
        """The robot bound to the model."""
        return self._modelled.robot

    @property
    def compilations(self) -> int:
        """How often a model was compiled."""
        return self._modelled.compilations

    @property
    def sidecar(self) -> Sidecar:
        """The robot's roles, as written or inferred."""
        return self._modelled.sidecar

    @property
    def body_names(self) -> Sequence[str]:
        """What people call each body."""
        return self._modelled.body_names

    @property
    def object_bodies(self) -> Mapping[str, int]:
        """Body ids of the objects."""
        return self._modelled.object_bodies

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras."""
        return self._modelled.cameras

    @property
    def render_size(self) -> tuple[int, int]:
        """(height, width) of camera pictures, pixels."""
        return self._modelled.render_size

    @property
    def controls(self) -> Array:
        """What is commanded to the actuators now, shape (actuators,)."""
        return self._modelled.controls

    def camera_in_model(self, name: str) -> str:
        """Return what the model calls a camera."""
        return self._modelled.camera_in_model(name)

    def log(self, capacity: int) -> StepRecorder:
        """Return a log that can take down this world's state."""
        return self._modelled.log(capacity)

    def held(self) -> str | None:
        """Return the object that both sides of the gripper touch."""
        return self._modelled.held()

    def contact_forces(self) -> list[tuple[float, int, int]]:
        """Return normal force, N, and body ids of every contact of the robot."""
        return self._modelled.contact_forces()

    def contacts_around(self, carried: Iterable[str] = ()) -> list[tuple[str, str, float]]:
        """Return (link or carried object, what it touches, N) of the robot and of these objects."""
        return self._modelled.contacts_around(carried)

    def replay(self, controls: Array, push: Array | None = None) -> None:
        """Let one control tick pass with recorded commands, which are sent as they are; limits of place and force are kept.

        Raises:
            FaultError: Nothing moves before `recover`.
        """
        self.safety.begin()
        self.safety.moving()
        try:
            self._modelled.replay(controls, push)
        except BaseException as error:
            self._broken_off(error)
            raise
        self._last = None
        self.safety.arrived()

    def fork(self) -> Modelled:
        """Return a copy that shares the model and nothing that moves, not even the limits."""
        return self._modelled.fork()


def modelled(driver: Driver, purpose: str) -> Modelled:
    """Return the driver as the world with a model that it is.

    Args:
        driver: Whose model.
        purpose: What it is needed for, as "the viewer draws it".

    Raises:
        UnsupportedError: It has none.
    """
    if not isinstance(driver, Modelled):
        raise UnsupportedError(
            f"model: the driver of {driver.spec.name} has no simulated model, and {purpose}; use --driver mujoco"
        )
    return driver
