"""Changes of a simulated world that no robot makes: things put elsewhere, pushed, or given other properties."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.saved_state import continue_from, integrated_size, take_state
from robosandbox.sim.sleep_timer import moving_count
from robosandbox.types import Array, Pose


class Intervention:
    """Changes a world from outside: where things are, how fast, and what the model says of them.

    Args:
        sim: The world.
    """

    def __init__(self, sim: MuJoCoBackend) -> None:
        self.sim = sim
        self._data = mujoco.MjData(sim.model)

    @contextmanager
    def state(self) -> Iterator[mujoco.MjData]:
        """Give the state as MjData to change; what was changed becomes the world's, and wakes with all that it touched."""
        model, data = self.sim.model, self._data
        continue_from(model, data, self.sim.snapshot())
        yield data
        # MuJoCo wakes what is elsewhere than it fell asleep, has a speed, or is pushed.
        mujoco.mj_kinematics(model, data)
        data.tree_asleep[data.tree_asleep < 0] = moving_count(model)
        self.sim.restore(take_state(model, data))

    def wake(self) -> None:
        """Wake everything: what the model says of things was changed, and what slept is to feel it."""
        state = self.sim.snapshot()
        state[integrated_size(self.sim.model) :] = moving_count(self.sim.model)
        self.sim.restore(state)

    def pose(self, name: str) -> Pose:
        """Return where an object is."""
        return self.sim.truth().objects[name].pose

    def set_pose(self, name: str, pose: Pose) -> None:
        """Put an object somewhere, at rest."""
        with self.state() as data:
            joint = data.joint(self._joint(name))
            x, y, z, w = pose.quat_xyzw
            joint.qpos = [*pose.xyz, w, x, y, z]
            joint.qvel = np.zeros(6)

    def set_velocity(self, name: str, linear: Array, angular: Array | None = None) -> None:
        """Give an object's centre a velocity in the world's frame; a turn is in the object's own."""
        with self.state() as data:
            joint = data.joint(self._joint(name))
            joint.qvel[:3] = linear
            if angular is not None:
                joint.qvel[3:] = angular

    def geoms(self, name: str) -> NDArray[np.intp]:
        """Return the geoms of an object's body."""
        return np.flatnonzero(self.sim.model.geom_bodyid == self.sim.object_bodies[name])

    def dofs(self, name: str) -> slice:
        """Return the addresses of an object's velocities."""
        begin = int(self.sim.model.body_dofadr[self.sim.object_bodies[name]])
        return slice(begin, begin + 6)

    def _joint(self, name: str) -> str:
        model = self.sim.model
        return str(model.joint(int(model.body_jntadr[self.sim.object_bodies[name]])).name)
