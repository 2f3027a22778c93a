"""What really happened in an odd episode: forces, displacements and the end, from raw contacts of the simulated state.

Nothing here is shared with skills, relations or the task's judge: contact points, geoms and forces are read from MuJoCo.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from odd_scenes import Odd

from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.saved_state import put_state

# Metres: how far a thing has to be raised to be picked up, and how far it may sink or drift in two seconds.
RAISED, DRIFT = 0.02, 0.004
# Metres that what was not named, or is to stay, may move.
STAYS = 0.010
# Share of the way that a push has to go.
PUSHED = 0.8
# Metres of a drawer's way within which it is shut.
SHUT = 0.003


def raw_state(sim: MuJoCoBackend, data: mujoco.MjData) -> mujoco.MjData:
    """Write a world's state into `data`, contacts and their forces computed anew."""
    put_state(sim.model, data, sim.snapshot())
    mujoco.mj_forward(sim.model, data)
    return data


def forces(sim: MuJoCoBackend, data: mujoco.MjData) -> dict[tuple[str, str], np.ndarray]:
    """Return the net force with which one thing presses another, N in the world, by (who, whom); all of the robot is "robot"."""
    world, found = sim.world, {}
    local = np.zeros(6)
    for index in range(data.ncon):
        contact = data.contact[index]
        names = [_name(world, int(world.model.geom_bodyid[geom])) for geom in contact.geom]
        if names[0] == names[1]:
            continue
        mujoco.mj_contactForce(world.model, data, index, local)
        force = contact.frame.reshape(3, 3).T @ local[:3]
        for pair, signed in (((names[0], names[1]), force), ((names[1], names[0]), -force)):
            found[pair] = found.get(pair, np.zeros(3)) + signed
    return found


def _name(world: object, body: int) -> str:
    if body in world.robot.bodies:  # type: ignore[attr-defined]
        return "robot"
    return str(world.owners.get(body, world.names[body]))  # type: ignore[attr-defined]


@dataclass
class Meter:
    """A listener to ticks that keeps the largest forces and who pressed whom.

    Attributes:
        sim: The world.
        odd: What was asked there.
        named: The most that the robot pressed something that it was told of with, N; its grip from both sides cancels.
        unnamed: The most that it pressed anything else with, N, and what.
    """

    sim: MuJoCoBackend
    odd: Odd
    named: float = 0.0
    unnamed: tuple[float, str] = (0.0, "")
    _data: mujoco.MjData | None = field(default=None, repr=False)

    def __call__(self) -> None:
        """Look at the contacts of this tick."""
        self._data = self._data or mujoco.MjData(self.sim.model)
        for (who, whom), force in forces(self.sim, raw_state(self.sim, self._data)).items():
            if who != "robot":
                continue
            size = float(np.linalg.norm(force))
            if whom in self.odd.named:
                self.named = max(self.named, size)
            elif size > self.unnamed[0]:
                self.unnamed = (size, whom)


def places(sim: MuJoCoBackend) -> dict[str, np.ndarray]:
    """Return where the objects' first bodies are, metres."""
    data = raw_state(sim, mujoco.MjData(sim.model))
    return {name: data.xpos[body].copy() for name, body in sim.object_bodies.items()}


def lowest(sim: MuJoCoBackend, data: mujoco.MjData, name: str) -> float:
    """Return the height of an object's lowest point, metres, by its geoms' own support."""
    model, low = sim.model, np.inf
    for geom in np.flatnonzero(model.geom_bodyid == sim.object_bodies[name]):
        down = data.geom_xmat[geom].reshape(3, 3).T @ np.array([0.0, 0.0, -1.0])
        size, kind = model.geom_size[geom], int(model.geom_type[geom])
        if kind == mujoco.mjtGeom.mjGEOM_BOX:
            reach = float(np.abs(down) @ size)
        elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
            reach = float(size[0] * np.hypot(down[0], down[1]) + size[1] * abs(down[2]))
        elif kind == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            begin, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            reach = float((model.mesh_vert[begin : begin + count] @ down).max())
        else:
            reach = float(size[0])
        low = min(low, float(data.geom_xpos[geom][2]) - reach)
    return low


def done(sim: MuJoCoBackend, odd: Odd, start: dict[str, np.ndarray], bottom: float) -> bool:
    """Tell whether what was asked is so now and two seconds on.

    Args:
        sim: The world, or a copy of it: time passes.
        odd: What was asked.
        start: Where the objects were.
        bottom: How high the subject's lowest point was, metres.
    """
    data = mujoco.MjData(sim.model)
    first = _now(sim, odd, raw_state(sim, data), start, bottom)
    before = data.xpos[sim.object_bodies[odd.subject]].copy()
    sim.wait(2.0)
    last = _now(sim, odd, raw_state(sim, data), start, bottom)
    drift = float(np.linalg.norm(data.xpos[sim.object_bodies[odd.subject]] - before))
    return first and last and drift < DRIFT


def _now(sim: MuJoCoBackend, odd: Odd, data: mujoco.MjData, start: dict[str, np.ndarray], bottom: float) -> bool:
    pressed = forces(sim, data)
    on_it = {who for (who, whom), force in pressed.items() if whom == odd.subject and np.linalg.norm(force) > 1e-4}
    raised = lowest(sim, data, odd.subject) - bottom
    if odd.goal == "held":
        return on_it == {"robot"} and raised > RAISED
    if odd.goal == "on":
        return on_it == {odd.target} and raised > RAISED
    if odd.goal in ("opened", "shut"):
        slid = _slid(sim, data, odd.subject)
        return slid < SHUT if odd.goal == "shut" else slid > odd.along
    where = data.xpos[sim.object_bodies[odd.subject]]
    return (
        bool("robot" not in on_it or odd.goal == "pushed")
        and float(where[0] - start[odd.subject][0]) > PUSHED * odd.along
    )


def _slid(sim: MuJoCoBackend, data: mujoco.MjData, name: str) -> float:
    """Return how far the one sliding joint of an object is from where it is shut, metres."""
    model = sim.model
    slides = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE)
    (joint,) = (j for j in slides if sim.world.owners.get(int(model.jnt_bodyid[j])) == name)
    return abs(float(data.qpos[model.jnt_qposadr[joint]]))
