"""MetaWorld's environment as a driver: its state in a model of ours, moved by its actions alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import mujoco
import numpy as np

from robosandbox.driver import ARM, Capabilities
from robosandbox.errors import InputError
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.populated import populated
from robosandbox.sim.scene_model import read_scene_model
from robosandbox.sim.world import ROBOT_PREFIX, World, build_world_of
from robosandbox.types import Array, Scene
from robosandbox_metaworld.environment import FINGER_JOINTS, GRIP, LAST_LINK, MetaWorldEnvironment

# Seconds in which a finger's error dies out to a third, and its top speed, m/s.
_FINGER_TIME, _FINGER_SPEED = 0.05, 0.1
# Metres; any depth at which things touch, and any way that is none.
_MET = 1e-6
# Seconds by which the hand trails its moving target: critically damped, twice the time constant of the weld to it.
LAG = 0.04


class MetaWorldDriver(MuJoCoBackend):
    """MetaWorld's hand in MetaWorld's world, commanded by where it is to be.

    The model here never steps: after each step of MetaWorld it takes over positions, speeds and what presses on what.

    Args:
        scene: The environment's.
        environment: What is driven.
        felt: Objects of which the truth is to tell how hard they were pressed.
        wait_hook: Called while things settle; they have.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        environment: MetaWorldEnvironment,
        felt: Iterable[str] = (),
        wait_hook: Callable[[], None] | None = None,
    ) -> None:
        super().__init__(control_timestep=environment.timestep)
        del wait_hook
        self._environment = environment
        self.feel(felt)
        self.adopt(build_world_of(populated(scene)))

    def adopt(self, world: World) -> None:
        """Show the environment's state."""
        super().adopt(world)
        scene, gripper = world.scene.world, world.robot.gripper
        assert scene is not None
        assert gripper is not None
        theirs = read_scene_model(scene).spec.compile()
        self._servo_lags = {ARM: np.full(world.robot.n, LAG)}
        self._places, self._geoms = _like(theirs, world.model)
        motors = [theirs.joint(name) for name in FINGER_JOINTS]
        self._motors = np.array([int(joint.dofadr[0]) for joint in motors])
        self._ways = np.array([int(joint.qposadr[0]) for joint in motors])
        self._gain = float(theirs.actuator_gainprm[0, 0])
        self._damping, self._inertia = (float(motors[0].damping.flat[0]), float(motors[0].armature[0]))
        self._grip = GRIP
        self._begin()

    @property
    def capabilities(self) -> Capabilities:
        """All of a simulation but copies."""
        return replace(super().capabilities, fork=False)

    def reset(self, scene: Scene | None = None, q: Array | Mapping[str, Array] | None = None) -> None:
        """Start over.

        Raises:
            InputError: Another scene or configuration is asked for.
        """
        if (scene is not None and populated(scene) != self.scene) or q is not None:
            raise InputError("a MetaWorld environment starts over as its start has it; open another for another start")
        self._environment.reset()
        self._begin()
        self.episode += 1
        self.physics_steps = 0

    def set_gripper(self, hand: str, closed: float, force: float | None = None) -> None:
        """Command the hand; see `ControlledSimulation.set_gripper`."""
        super().set_gripper(hand, closed)
        self._grip = GRIP if force is None else min(GRIP, force / len(FINGER_JOINTS))

    def servo_force(self, arm: str, joint: int) -> tuple[float, float]:
        """Return what the world presses on the hand with along a slide, N; nothing limits it."""
        return abs(float(sum(force[joint] for force in self.forces(arm).values()))), np.inf

    def _begin(self) -> None:
        data, robot = self._live, self.robot
        assert robot.gripper is not None
        self._show()
        data.ctrl[robot.actuator_ids] = data.qpos[robot.qpos_indices]
        data.ctrl[robot.gripper.actuator_ids] = robot.gripper.geometry.control(0.0)
        data.time = 0.0
        self._jumped()

    def _advance(self, steps: int) -> None:
        """Let a step of MetaWorld pass; controls here are where hand and fingers are sent."""
        data = self._live
        self._environment.step(data.ctrl[self.robot.actuator_ids], self._effort())
        data.time += steps * self.model.opt.timestep
        self._show()

    def _effort(self) -> float:
        """Return the effort that sends the fingers to where they are commanded, with as much force as they may give."""
        state, gripper = self._environment.state, self.robot.gripper
        assert gripper is not None
        # One effort closes both: the mean of what each would need, as ways from open.
        signs = np.array([1.0, -1.0])
        way, speed = np.array(state["qpos"])[self._ways] * signs, np.array(state["qvel"])[self._motors] * signs
        goal = self._live.ctrl[gripper.actuator_ids] * signs
        wanted = np.clip((goal - way) / _FINGER_TIME, -_FINGER_SPEED, _FINGER_SPEED)
        net = np.clip(self._inertia * (wanted - speed) / _FINGER_TIME, -self._grip, self._grip)
        # What bounces off is braked as hard as can be: fingers of MetaWorld's have the inertia of 100 kg.
        net -= np.where(wanted * speed < 0.0, self._inertia * speed / _FINGER_TIME, 0.0)
        efforts = way + (self._damping * speed + net) / self._gain
        # Fingers that are sent all the way apart hold the one that is pushed in; the stop of the other bears the rest.
        return float(np.clip(efforts.min() if goal.max() < _MET else efforts.mean(), -1.0, 1.0))

    def _show(self) -> None:
        """Take over MetaWorld's state, with the forces at its contacts."""
        data, state, robot = self._live, self._environment.state, self.robot
        qpos, qvel, (to_qpos, from_qpos, to_qvel, from_qvel) = state["qpos"], state["qvel"], self._places
        before = data.qpos[robot.qpos_indices].copy()
        data.qpos[to_qpos], data.qvel[to_qvel] = np.array(qpos)[from_qpos], np.array(qvel)[from_qvel]
        data.qpos[robot.qpos_indices] = state["hand"]
        data.qvel[robot.dof_indices] = (state["hand"] - before) / self._environment.timestep
        # The weld that leads the hand lets it turn by some milliradians: contacts are where it is, plans are for a hand that is level.
        link = self.model.body(ROBOT_PREFIX + LAST_LINK).id
        level = self.model.body_pos[link].copy(), self.model.body_quat[link].copy()
        self.model.body_pos[link] = np.array(state["link_pos"]) - state["hand"]
        self.model.body_quat[link] = state["link_quat"]
        mujoco.mj_forward(self.model, data)
        self.model.body_pos[link], self.model.body_quat[link] = level
        forces = {
            (self._geoms[a], self._geoms[b]): np.array(f) for a, b, f in state["forces"] if {a, b} <= self._geoms.keys()
        }
        forces |= {(b, a): -force for (a, b), force in forces.items()}
        pairs = [tuple(pair) for pair in data.contact.geom.tolist()]
        for index, pair in enumerate(pairs):
            contact = data.contact[index]
            force = contact.frame.reshape(3, 3) @ forces.get(pair, np.zeros(3)) / pairs.count(pair)
            if contact.efc_address >= 0:
                data.efc_force[contact.efc_address : contact.efc_address + contact.dim] = 0.0
                data.efc_force[contact.efc_address : contact.efc_address + 3] = force[: min(3, contact.dim)]
            if pair in forces:
                # Geoms with a margin press before they meet, and what presses touches.
                contact.dist = min(contact.dist, -_MET)


def _like(theirs: mujoco.MjModel, ours: mujoco.MjModel) -> tuple[tuple[Array, ...], dict[int, int]]:
    """Return addresses in qpos here and there, and in qvel, of all joints that both have, and each geom there -> here."""
    names = {str(ours.joint(j).name).removeprefix(ROBOT_PREFIX): j for j in range(ours.njnt)}
    places: list[list[int]] = [[], [], [], []]
    ends = (np.append(theirs.jnt_qposadr, theirs.nq), np.append(theirs.jnt_dofadr, theirs.nv))
    for joint in range(theirs.njnt):
        like = names.get(str(theirs.joint(joint).name))
        if like is None:
            continue
        for k, (address, end) in enumerate(zip((ours.jnt_qposadr, ours.jnt_dofadr), ends, strict=True)):
            first, last = int(end[joint]), int(end[joint + 1])
            places[2 * k] += range(int(address[like]), int(address[like]) + last - first)
            places[2 * k + 1] += range(first, last)
    bodies = {str(ours.body(b).name).removeprefix(ROBOT_PREFIX): b for b in range(ours.nbody)}
    geoms: dict[int, int] = {}
    for body in range(theirs.nbody):
        like = bodies.get(str(theirs.body(body).name))
        if like is not None:
            geoms |= dict(zip(_solid(theirs, body), _solid(ours, like), strict=False))
    return tuple(np.array(one, dtype=int) for one in places), geoms


def _solid(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the geoms of a body that others collide with."""
    return [g for g in np.flatnonzero(model.geom_bodyid == body).tolist() if model.geom_conaffinity[g]]
