"""The MuJoCo driver: a scene loaded, started over, copied; controlled and sensed as the modules beside it say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Self

import mujoco

from robosandbox.driver import Capabilities, Mode, Simulated, robot_name
from robosandbox.sim.arms import SimulatedArm, SimulatedHand, SimulatedSenses
from robosandbox.sim.calibration_board import CalibrationBoard
from robosandbox.sim.objects import can_rewrite, place, rewrite
from robosandbox.sim.objects.weight import weighed
from robosandbox.sim.populated import populated
from robosandbox.sim.sensing import SensedSimulation
from robosandbox.sim.sensors import SENSORS, Sensor
from robosandbox.sim.state_check import check_state
from robosandbox.sim.world import build_world_of, check_start
from robosandbox.types import Array, Scene, Truth


class MuJoCoBackend(SensedSimulation):
    """A cell in MuJoCo: the driver, and the simulated world that it drives.

    Args:
        render_size: (height, width) of camera pictures, pixels.
        control_timestep: Seconds between commands to the servos; a whole multiple of the physics time step.
        sensor: What `capture` sees through.
        board: Laid on the table of what is loaded, to calibrate cameras with.

    Attributes:
        compilations: How often a model was compiled.
    """

    def __init__(
        self,
        render_size: tuple[int, int] = (240, 320),
        control_timestep: float = 0.01,
        *,
        sensor: Sensor = SENSORS["ideal"],
        board: CalibrationBoard | None = None,
    ) -> None:
        super().__init__(control_timestep, render_size, sensor)
        self._board = board
        self.compilations: int = 0
        self._as_written = Scene()

    def load(self, scene: Scene, q: Array | Mapping[str, Array] | None = None) -> None:
        """Build the scene, put the robot at `q` (n,), at home when left out, and let the objects settle.

        Raises:
            InputError: A file, name or number of the robot or scene is wrong.
        """
        scene = weighed(populated(scene))
        self._unload()
        self._as_written = scene
        self._compile(scene)
        self.reset(q=q)

    def reset(self, scene: Scene | None = None, q: Array | Mapping[str, Array] | None = None) -> None:
        """Start over, without a new model where numbers alone differ.

        Args:
            scene: A scene with the loaded one's robot, ids and kinds, other poses, sizes, masses or colours.
            q: Start configuration of the arm, shape (n,), or of each by name; home when left out.

        Raises:
            InputError: Objects start inside something.
        """
        world = self._loaded
        scene = weighed(populated(scene)) if scene is not None else None
        if scene is not None and scene != world.scene:
            self._adopt(scene)
            world = self._loaded
        data = self._live
        mujoco.mj_resetData(world.model, data)
        self._go_home(q)
        for item in world.scene.objects:
            place(world.scene, item, data)
        check_start(world, data)
        self._settle()
        self._felt = dict.fromkeys(self._felt, 0.0)
        data.time = 0.0
        self.episode += 1
        self.physics_steps = 0
        self._jumped()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def arms(self) -> Mapping[str, SimulatedArm]:
        """The arms by name."""
        return {name: SimulatedArm(self, name) for name in self.robots}

    @property
    def hands(self) -> Mapping[str, SimulatedHand]:
        """The hands by name."""
        carrying = [SimulatedHand(self, name) for name, robot in self.robots.items() if robot.gripper is not None]
        return {hand.name: hand for hand in carrying}

    @property
    def senses(self) -> SimulatedSenses:
        """Cameras and contacts."""
        return SimulatedSenses(self)

    @property
    def mode(self) -> Mode:
        """Always ready: what moves and stops is seen by who watches it."""
        return "ready"

    @property
    def fault(self) -> str:
        """None: a simulated servo has no fault."""
        return ""

    def recover(self) -> None:
        """End a fault; there is none."""

    @property
    def simulation(self) -> Simulated:
        """This world."""
        return self

    @property
    def referee(self) -> Callable[[], Truth] | None:
        """None: its judge is its truth."""
        return None

    @property
    def capabilities(self) -> Capabilities:
        """All of them: a simulation knows everything."""
        return Capabilities(
            gripper_force=True,
            grip_limit=True,
            joint_torque=True,
            wrist_wrench=True,
            contact="named",
            cameras=self.camera_specs() if self._world else {},
            fork=True,
            reset=True,
            truth=True,
            clock="simulated",
        )

    def resume(self, scene: Scene, state: Array, physics_steps: int) -> None:
        """Go back to a snapshot that was taken in this scene.

        Args:
            scene: With the loaded one's robot.
            state: What `snapshot` returned there.
            physics_steps: As counted there.

        Raises:
            InputError: The snapshot is of another model, or of no world.
        """
        if scene != self.scene:
            self._adopt(scene)
        check_state(self.model, state, robot=robot_name(self))
        self.restore(state)
        self.physics_steps = physics_steps

    def fork(self) -> MuJoCoBackend:
        """Return a copy of the world that shares the model and nothing else: for trying things out."""
        other = MuJoCoBackend(self.render_size, self.control_timestep, sensor=self.sensor)
        other.adopt(self._loaded)
        other._trims = dict(self._trims)
        other._felt = dict(self._felt)
        other.restore(self.snapshot())
        other._grips = dict(self._grips)
        return other

    def _compile(self, scene: Scene) -> None:
        self.ask_wait_hooks()
        self.adopt(build_world_of(scene, board=self._board))
        self.compilations += 1

    def _as_loaded(self, scene: Scene) -> Scene:
        """Return a scene with its objects as the loaded scene has them; the scene itself where that has others."""
        loaded = {item.id: item for item in self._as_written.objects}
        if any(item.id not in loaded for item in scene.objects):
            return scene
        written = scene.model_copy(update={"objects": tuple(loaded[item.id] for item in scene.objects)})
        return written if _rewritable(written, scene) else scene

    def _adopt(self, scene: Scene) -> None:
        """Take another scene: numbers are written into the model, anything else compiles a new one.

        What is compiled are the same objects as the scene that was loaded has them, whatever lay there last: a model, to
        its last digit, must not depend on the scenes before it.
        """
        if not _rewritable(self._loaded.scene, scene):
            as_loaded = self._as_loaded(scene)
            self._unload()
            self._compile(as_loaded)
        world = self._loaded
        stale = [
            rewrite(world.model, a, b, parts, world.mass_share[parts], world.inertia_per_mass[parts])
            for a, b in zip(world.scene.objects, scene.objects, strict=True)
            for parts in (world.parts[b.id],)
        ]
        if any(stale):
            mujoco.mj_setConst(world.model, mujoco.MjData(world.model))
        self._world = replace(world, scene=scene, revision=world.revision + any(stale))


def _rewritable(old: Scene, new: Scene) -> bool:
    """Return whether a model of one scene becomes one of the other by numbers alone."""
    if old.model_copy(update={"objects": ()}) != new.model_copy(update={"objects": ()}):
        return False
    return len(old.objects) == len(new.objects) and all(map(can_rewrite, old.objects, new.objects))
