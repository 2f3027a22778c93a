"""A compiled world and its state in MuJoCo, and how time passes in it: physics steps, control ticks, listeners, guards."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import mujoco
import numpy as np

from robosandbox.driver import ControlLoop, Guard
from robosandbox.errors import InputError
from robosandbox.robots.robot import Robot
from robosandbox.shapes.mesh_file import mesh_bounds
from robosandbox.sim.pressing import Pressing
from robosandbox.sim.saved_state import continue_from, take_state
from robosandbox.sim.sleep_timer import MOST_STEPS, SleepTimer
from robosandbox.sim.sleepers import Sleepers
from robosandbox.sim.world import World
from robosandbox.types import Array, Scene, frozen_array
from robosandbox.types.robot import RobotSpec

# Seconds that settling may take: a cube that falls by a centimetre moves for 0.14 s, as measured; a ball may roll on after.
_SETTLE_SECONDS = 3.0
# Seconds between two looks at whether things lie still: the time constant of MuJoCo's default contact (solref).
_SETTLE_CHUNK_SECONDS = 0.02
# Looks in a row, a number, at which nothing may move: chosen so that the top of a bounce, where speed is 0, is no rest.
_CALM_CHUNKS = 5
# Speed of rest, m/s or rad/s: twenty times what contacts leave of a cube that stands still, measured at 0.0002 m/s.
_REST_SPEED = 0.005
_NOTHING = frozen_array(np.zeros(3))
_UNTOUCHED: Mapping[str, Array] = {}
# What a program is told that reads or moves a world which is not there.
_NO_SCENE = "no scene is loaded: call load(scene) first; what was closed stays closed, so open another session"


class Simulation:
    """A world that is simulated.

    Args:
        control_timestep: Seconds between commands to the servos; a whole multiple of the physics time step.

    Attributes:
        control_timestep: Likewise.
        guards: Asked after every control tick.
        wait_hooks: Called again and again while a scene is loaded and settles. One that raises ends that.
        jump_hooks: Called after the state was set in another way than by letting time pass.
        physics_steps: Physics steps since the last reset.
        episode: Counts how often the world was put into another state than time alone brings.
    """

    def __init__(self, control_timestep: float) -> None:
        self.control_timestep: float = control_timestep
        self._wanted_timestep = control_timestep
        self._loop = ControlLoop()
        self.guards: list[Guard] = self._loop.guards
        self.wait_hooks: list[Callable[[], None]] = []
        self.jump_hooks: list[Callable[[], None]] = []
        self.physics_steps: int = 0
        self.episode: int = 0
        self._world: World | None = None
        self._data: mujoco.MjData | None = None
        self._arm_specs: dict[str, RobotSpec] = {}
        self._substeps = 1
        self._strides = [1]
        self._mesh_sizes: dict[str, tuple[float, ...]] = {}
        self._felt: dict[str, float] = {}
        # By arm, and None for all of them.
        self._pressing: dict[str | None, Pressing] = {}
        self._sleepers: Sleepers | None = None
        self._timer: SleepTimer | None = None
        # Counts the states that the world was in, so that what is read of one twice is computed once.
        self._moment = 0
        self._pressed: dict[str | None, tuple[int, Mapping[str, Array]]] = {}

    @property
    def world(self) -> World:
        """The compiled scene."""
        return self._loaded

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self._loaded.model

    @property
    def robots(self) -> Mapping[str, Robot]:
        """Indices and measured figures of each robot, by the name of its arm."""
        return self._loaded.robots

    @property
    def robot(self) -> Robot:
        """Those of the only robot; an InputError where there are several."""
        return self._loaded.robot

    def spec_of(self, arm: str) -> RobotSpec:
        """Return the specification of an arm."""
        if arm not in self._arm_specs:
            self._arm_specs[arm] = self.robots[arm].spec
        return self._arm_specs[arm]

    @property
    def scene(self) -> Scene:
        """The scene as loaded or last reset to."""
        return self._loaded.scene

    @property
    def object_bodies(self) -> Mapping[str, int]:
        """Body ids of the objects."""
        return self._loaded.object_bodies

    @property
    def body_names(self) -> Sequence[str]:
        """Names of the bodies for people."""
        return self._loaded.names

    @property
    def time(self) -> float:
        """Simulated seconds since reset."""
        return float(self._live.time)

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener` called after every control tick, before the guards; return what ends that."""
        return self._loop.subscribe(listener)

    def stop(self) -> None:
        """Command every arm to stay where it is."""
        for name in self.robots:
            self.stop_arm(name)

    def stop_arm(self, name: str) -> None:
        """Command an arm to stay where it is."""
        robot = self.robots[name]
        q = self._live.qpos[robot.qpos_indices]
        self._live.ctrl[robot.actuator_ids] = robot.control(np.clip(q, robot.lower, robot.upper))

    def forces(self, arm: str | None = None) -> Mapping[str, Array]:
        """Return the sum of what an arm presses and pulls each thing with that it touches, N in the world, shape (3,).

        Of all arms where none is named.
        """
        if len(self.robots) == 1:
            arm = None
        # Guards, meters and skills ask for it in one control tick.
        moment, forces = self._pressed.get(arm, (-1, _UNTOUCHED))
        if moment != self._moment:
            if arm not in self._pressing:
                self._pressing[arm] = Pressing(self._loaded, self._live, arm)
            forces = self._pressing[arm].forces()
            self._pressed[arm] = (self._moment, forces)
        return forces

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return the sum of what an arm presses and pulls an object with, N in the world, shape (3,); None is all of them."""
        forces = self.forces(arm)
        if object_id is not None:
            return forces.get(object_id, _NOTHING)
        of_objects = [force for name, force in forces.items() if name in self._loaded.parts]
        return frozen_array(np.sum(of_objects, axis=0)) if of_objects else _NOTHING

    def feel(self, names: Iterable[str]) -> None:
        """Keep for `truth` the most that the robot presses or pulls these objects with, from now on."""
        self._felt = dict.fromkeys(names, 0.0)

    def snapshot(self) -> Array:
        """Return the whole simulated state as one vector."""
        return take_state(self.model, self._live)

    def restore(self, state: Array) -> None:
        """Go back to a snapshot of this model."""
        continue_from(self.model, self._live, state)
        self.episode += 1
        self._jumped()

    @property
    def sleepers(self) -> Sleepers:
        """Contacts among the bodies that sleep."""
        if self._sleepers is None:
            self._sleepers = Sleepers(self.model, self._live)
        return self._sleepers

    @property
    def _sleep_timer(self) -> SleepTimer:
        if self._timer is None:
            self._timer = SleepTimer(self.model, self._live)
        return self._timer

    def close(self) -> None:
        """Free the world, and let go of listeners, guards and hooks; the simulation can load again."""
        self._unload()
        self._loop.close()
        self.wait_hooks.clear()
        self.jump_hooks.clear()

    def _unload(self) -> None:
        """Free the model, the state, and all that is read of them."""
        self._world = None
        self._arm_specs = {}
        self._data = None
        self._pressing = {}
        self._pressed = {}
        self._sleepers = None
        self._timer = None

    def ask_wait_hooks(self) -> None:
        """Ask the wait hooks whether to go on; they raise where not."""
        for hook in self.wait_hooks:
            hook()

    @property
    def _loaded(self) -> World:
        if self._world is None:
            raise RuntimeError(_NO_SCENE)
        return self._world

    @property
    def _live(self) -> mujoco.MjData:
        if self._data is None:
            raise RuntimeError(_NO_SCENE)
        return self._data

    def adopt(self, world: World) -> None:
        """Simulate a compiled world, everything where the model has it."""
        self._world = world
        self._arm_specs = {}
        self._data = mujoco.MjData(world.model)
        self._pressing = {}
        self._pressed = {}
        self._sleepers = None
        self._timer = None
        self._moment += 1
        self._mesh_sizes = {}
        for item in world.scene.objects:
            if item.mesh is not None:
                low, high = mesh_bounds(item.mesh, item.scale, of=item.id)
                self._mesh_sizes[item.id] = tuple(float(c) for c in (high - low) / 2.0)
        if world.scene.world is not None:
            # Somebody's file has the time step that it has: commands come at the whole multiple of it that is nearest.
            step = float(world.model.opt.timestep)
            self.control_timestep = max(1, round(self._wanted_timestep / step)) * step
        substeps = self.control_timestep / world.model.opt.timestep
        if abs(substeps - round(substeps)) > 1e-6 or round(substeps) < 1:
            raise InputError(
                f"control_timestep {self.control_timestep} is no whole multiple of the physics time step "
                f"{world.model.opt.timestep}"
            )
        self._substeps = round(substeps)
        self._strides = [min(MOST_STEPS, self._substeps - done) for done in range(0, self._substeps, MOST_STEPS)]

    def _settle(self) -> None:
        """Step until no object has moved for a while; a ball that rolls on is left rolling after a few seconds."""
        model, data = self.model, self._live
        dofs = [int(model.body_dofadr[b]) + i for b in self._loaded.owners for i in range(int(model.body_dofnum[b]))]
        chunk = round(_SETTLE_CHUNK_SECONDS / model.opt.timestep)
        calm = 0
        for _ in range(round(_SETTLE_SECONDS / _SETTLE_CHUNK_SECONDS)):
            self.ask_wait_hooks()
            # Bodies that fall asleep here have moved by themselves only: MuJoCo's own few steps will do.
            mujoco.mj_step(model, data, chunk)
            calm = calm + 1 if not dofs or np.abs(data.qvel[dofs]).max() < _REST_SPEED else 0
            if calm >= _CALM_CHUNKS * (1 if self._all_asleep() else 2):
                return

    def _all_asleep(self) -> bool:
        """Tell whether all objects sleep."""
        trees = self.model.body_treeid[list(self._loaded.owners)]
        return bool((self._live.tree_asleep[trees[trees >= 0]] >= 0).all())

    def _tick(self, guards: Sequence[Guard] = ()) -> None:
        for steps in self._strides:
            self._advance(steps)
            self._sleep_timer.stepped(steps)
        self._moment += 1
        self.physics_steps += self._substeps
        for name, most in self._felt.items():
            self._felt[name] = max(most, math.hypot(*self.force_on(name).tolist()))
        self._loop.ticked(self.stop, guards)

    def _advance(self, steps: int) -> None:
        """Let so many physics steps pass with the commands held."""
        mujoco.mj_step(self._loaded.model, self._live, steps)

    def _jumped(self) -> None:
        self._moment += 1
        self.sleepers.forget()
        self._sleep_timer.restart()
        for hook in self.jump_hooks:
            hook()
