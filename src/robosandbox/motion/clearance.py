"""How near a robot comes to what it is not to touch, measured in a simulated world as it moves."""

from __future__ import annotations

from collections.abc import Collection

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.driver import Driver
from robosandbox.sim.opening import require_mujoco
from robosandbox.sim.saved_state import put_state
from robosandbox.types import Array

# How far is looked for what is near, metres: an arm whose places are believed to within a hand's breadth meets nothing beyond it.
SIGHT = 0.1
# Metres that a pair has to come nearer to count: what stands near and stays, as a link beside its own table, tells nothing.
_NEARER = 0.001
# What MuJoCo measures no distance of.
_UNMEASURED = [mujoco.mjtGeom.mjGEOM_PLANE.value, mujoco.mjtGeom.mjGEOM_HFIELD.value]


class Clearance:
    """A listener to a simulated world's ticks: the least distance between the arm, with what it holds, and the rest.

    Args:
        driver: Whose ticks; a MuJoCo world.
        arm: Name of the arm.

    Attributes:
        nearest: The least distance since `begin`, metres, and the name of what that was to; None where nothing came into sight.

    Raises:
        UnsupportedError: There is no simulated model behind the driver.
    """

    def __init__(self, driver: Driver, arm: str) -> None:
        self._sim = require_mujoco(driver, "distances are measured in it")
        world = self._sim.world
        model = world.model
        self._data = mujoco.MjData(model)
        self._names = [name.partition("/")[0] for name in world.names]
        solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        solid &= ~np.isin(model.geom_type, _UNMEASURED)
        body = model.geom_bodyid
        robot = np.isin(body, list(world.robots[arm].bodies))
        # What is fixed to the world does not come near anything.
        self._links = solid & robot & (model.body_weldid[body] != 0)
        # Grains are not avoided: they lie wherever what holds them goes.
        grains = [part for name, parts in world.parts.items() if name not in world.object_bodies for part in parts]
        self._others = solid & ~robot & ~np.isin(body, grains)
        self._held = np.zeros(model.ngeom, dtype=bool)
        self._pairs: NDArray[np.intp] = np.empty((0, 2), dtype=np.intp)
        self._least: Array = np.empty(0)
        self.nearest: tuple[float, str] | None = None

    def begin(self, spared: Collection[str], held: Collection[str]) -> None:
        """Begin anew, with the world as it is now.

        Args:
            spared: Names of things that are meant to be touched.
            held: Names of things that are carried.
        """
        model = self._sim.world.model
        names = np.array(self._names)[model.geom_bodyid]
        self._held = np.isin(names, list(held)) & self._others
        meant = np.isin(names, list(spared))
        movers, rest = np.flatnonzero(self._links | self._held), np.flatnonzero(self._others & ~self._held & ~meant)
        pairs = np.stack(np.meshgrid(movers, rest, indexing="ij"), axis=-1).reshape(-1, 2)
        # What is carried comes from a table and goes to one.
        laid = self._held[pairs[:, 0]] & (names[pairs[:, 1]] == "table")
        self._pairs = pairs[~laid]
        self._least = np.full(len(self._pairs), SIGHT)
        self.nearest = None
        self._take()
        bounds = self._bounds()
        for index in np.flatnonzero(bounds < SIGHT).tolist():
            self._least[index] = self._distance(index) - _NEARER

    def __call__(self) -> None:
        """Measure what may have come nearer than anything before."""
        self._take()
        bounds = self._bounds()
        best = SIGHT if self.nearest is None else self.nearest[0]
        near = np.flatnonzero(bounds < np.minimum(self._least, best))
        for index in near[np.argsort(bounds[near])].tolist():
            if bounds[index] >= best:
                return
            distance = self._distance(index)
            if distance < min(best, self._least[index]):
                best = distance
                self.nearest = distance, self._names[self._sim.world.model.geom_bodyid[self._pairs[index, 1]]]

    def _take(self) -> None:
        """Take over how the world is now."""
        model = self._sim.world.model
        put_state(model, self._data, self._sim.snapshot())
        mujoco.mj_kinematics(model, self._data)

    def _distance(self, index: int) -> float:
        """Return the distance of a pair, metres, below 0 where they overlap."""
        first, second = self._pairs[index]
        model = self._sim.world.model
        return float(mujoco.mj_geomDistance(model, self._data, int(first), int(second), SIGHT, None))

    def _bounds(self) -> Array:
        """Return below which distance each pair is not, shape (pairs,): the mover's sphere to the other's box."""
        model, data = self._sim.world.model, self._data
        mover, other = self._pairs.T
        turned = data.geom_xmat.reshape(-1, 3, 3)[other]
        local = np.einsum("pij,pi->pj", turned, data.geom_xpos[mover] - data.geom_xpos[other])
        box = model.geom_aabb[other]
        outside = np.maximum(np.abs(local - box[:, :3]) - box[:, 3:], 0.0)
        bounds: Array = np.linalg.norm(outside, axis=1) - model.geom_rbound[mover]
        return bounds
