"""Distances of an arm to what stands there, where it is sent; tried on a copy of the state without a step of physics."""

from __future__ import annotations

import copy
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.sim.world import World
from robosandbox.types import Array
from robosandbox.values import frozen

# Metres up to which distances are told.
FAR = 0.05
# Metres by which what rests on something may sink into it before it is pressed there.
_RESTING = 2e-4


@frozen
class Near:
    """Distances of an arm, metres; `FAR` is that or more, below 0 they tell a depth.

    Attributes:
        others: To what does not give way, by itself or by what it takes along.
        own: To itself.
        bare: As `others`, without what it takes along.
        comes_upon: Whether it is where something is that gives way, and that it does not touch yet.
    """

    others: float
    own: float
    bare: float
    comes_upon: bool


class Lookahead:
    """Distances of an arm to what does not give way, at configurations that it may be sent to.

    What it touches now goes along with it, as what it holds does; what it would come upon is shoved aside; where either is then near
    something that does not give way, or pressed deeper into it, as a cube on a table, that counts as well.

    Args:
        world: The scene.
        live: Its state, which stays as it is.
        arm: Name of the arm.
    """

    def __init__(self, world: World, live: mujoco.MjData, arm: str) -> None:
        self._live, self._qpos = live, world.robots[arm].qpos_indices
        self._gripper = world.robots[arm].gripper
        self._model = copy.copy(world.model)
        self._model.geom_margin[:] = FAR
        self._scratch = mujoco.MjData(self._model)
        self._is_arm: NDArray[np.bool_] = world.arm_of_geom == list(world.robots).index(arm)
        self._body: NDArray[np.intp] = np.asarray(world.model.geom_bodyid, dtype=np.intp)
        # The free body that each geom belongs to; -1 for what is fixed, or turns or slides on that.
        root = np.asarray(world.model.body_weldid, dtype=np.intp)[self._body]
        first = np.asarray(world.model.body_jntadr)[root]
        is_free = (first >= 0) & (np.asarray(world.model.jnt_type)[first] == mujoco.mjtJoint.mjJNT_FREE)
        self._free = np.where(is_free, root, -1)
        is_box = np.asarray(world.model.geom_type) == mujoco.mjtGeom.mjGEOM_BOX
        stays = ~self._is_arm & (self._free < 0)
        self._boxes, self._fixed_boxes = np.flatnonzero(is_box & ~stays), np.flatnonzero(is_box & stays)
        self._box_pairs = self._collide(self._boxes[:, None], self._fixed_boxes)
        self._box_sizes = world.model.geom_rbound[self._boxes, None] + world.model.geom_rbound[self._fixed_boxes]

    def distances(self, q: Array, closed: float | None = None) -> Near:
        """Return how near the arm would be to things at `q` (n,), its gripper closed from 0 to 1, or as it is now where that is left out."""
        model, live, scratch = self._model, self._live, self._scratch
        scratch.qpos[:] = live.qpos
        scratch.qpos[self._qpos] = q
        if closed is not None and self._gripper is not None:
            ends = self._gripper.geometry.open_joint, self._gripper.geometry.closed_joint
            joint = ends[0] + closed * (ends[1] - ends[0])
            scratch.qpos[self._gripper.joint_indices] = self._gripper.joints_at(joint)
        mujoco.mj_kinematics(model, scratch)
        moved = set[int]()
        for body, by, _ in self._met(live):
            if body not in moved:
                moved.add(body)
                self._carry(body, by)
        if moved:
            mujoco.mj_kinematics(model, scratch)
        mujoco.mj_collision(model, scratch)
        shoved = {body: way for body, _, way in self._met(scratch) if body not in moved}
        if shoved:
            for body, way in shoved.items():
                address = model.jnt_qposadr[model.body_jntadr[body]]
                scratch.qpos[address : address + 3] += way
            mujoco.mj_kinematics(model, scratch)
            mujoco.mj_collision(model, scratch)
        return Near(*self._nearest({*moved, *shoved}), comes_upon=bool(shoved))

    def _met(self, data: mujoco.MjData) -> Iterator[tuple[int, int, Array]]:
        """Yield free bodies that the arm touches in a state, its body that does, and the way (3,) on which they come out of that."""
        geoms, dist = data.contact.geom[: data.ncon], data.contact.dist[: data.ncon]
        for k in np.flatnonzero(dist < 0.0).tolist():
            first, second = geoms[k].tolist()
            for ours, other, sign in ((first, second, 1.0), (second, first, -1.0)):
                if self._is_arm[ours] and self._free[other] >= 0:
                    # The frame's first axis points from the first geom to the second.
                    yield int(self._free[other]), int(self._body[ours]), -sign * dist[k] * data.contact.frame[k][:3]

    def _carry(self, body: int, by: int) -> None:
        """Put a free body to where it would be if it were stuck to a body of the arm."""
        live, scratch = self._live, self._scratch
        turn = scratch.xmat[by].reshape(3, 3) @ live.xmat[by].reshape(3, 3).T
        quaternion, turned = np.zeros(4), np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, turn.ravel())
        mujoco.mju_mulQuat(turned, quaternion, live.xquat[body])
        address = self._model.jnt_qposadr[self._model.body_jntadr[body]]
        scratch.qpos[address : address + 3] = scratch.xpos[by] + turn @ (live.xpos[body] - live.xpos[by])
        scratch.qpos[address + 3 : address + 7] = turned

    def _nearest(self, taken_along: set[int]) -> tuple[float, float, float]:
        """Return the first three of `Near`."""
        data = self._scratch
        geoms, dist = data.contact.geom[: data.ncon], data.contact.dist[: data.ncon]
        is_arm, free = self._is_arm[geoms], self._free[geoms]
        stays = ~is_arm & (free < 0)
        own = float(dist[is_arm.all(axis=1)].min(initial=FAR))
        others = float(dist[is_arm.any(axis=1) & stays.any(axis=1)].min(initial=FAR))
        others = bare = self._from_boxes(self._is_arm, others)
        for body in taken_along:
            then = float(dist[(free == body).any(axis=1) & stays.any(axis=1)].min(initial=FAR))
            then = self._from_boxes(self._free == body, then)
            now = self._rests(body)
            # What rests on something is not near it until it is pressed there.
            others = min(others, then if now > 0.0 else FAR if then >= now - _RESTING else then - now)
        return others, own, bare

    def _from_boxes(self, ours: NDArray[np.bool_], least: float) -> float:
        """Return the least distance of boxes among some geoms to boxes that do not give way, metres; `least` where none is nearer.

        Contacts of two boxes tell none before they touch, where an edge comes first.
        """
        model, data, rows = self._model, self._scratch, np.flatnonzero(ours[self._boxes])
        boxes, fixed = self._boxes[rows], self._fixed_boxes
        apart = np.linalg.norm(data.geom_xpos[boxes, None] - data.geom_xpos[fixed], axis=2) - self._box_sizes[rows]
        for row, column in np.argwhere(self._box_pairs[rows] & (apart < least)).tolist():
            least = min(least, mujoco.mj_geomDistance(model, data, boxes[row], fixed[column], least, None))
        return least

    def _collide(self, first: NDArray[np.intp], second: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Tell of pairs of geoms, of shapes that broadcast, whether contacts between them are looked for."""
        model, bodies = self._model, (self._body[first], self._body[second])
        masks = model.geom_contype[first] & model.geom_conaffinity[second]
        masks |= model.geom_contype[second] & model.geom_conaffinity[first]
        moves = (model.body_weldid[bodies[0]] != 0) | (model.body_weldid[bodies[1]] != 0)
        # As MuJoCo keeps pairs of bodies between which there are none.
        signature = (np.minimum(*bodies) << 16) + np.maximum(*bodies)
        found: NDArray[np.bool_] = (masks != 0) & moves & ~np.isin(signature, model.exclude_signature)
        return found

    def _rests(self, body: int) -> float:
        """Return how deep (below 0) a free body is in what does not give way as it is now, metres; `FAR` where it touches nothing such."""
        geoms, dist = self._live.contact.geom[: self._live.ncon], self._live.contact.dist[: self._live.ncon]
        stays = ~self._is_arm[geoms] & (self._free[geoms] < 0)
        return float(dist[(self._free[geoms] == body).any(axis=1) & stays.any(axis=1)].min(initial=FAR))
