"""Inverse kinematics by damped least squares, with restarts from configurations that already come close.

Each step solves (J^T W J + lambda I) dq = J^T W e with the damping lambda proportional to the squared error
(T. Sugihara, "Solvability-Unconcerned Inverse Kinematics by the Levenberg-Marquardt Method", IEEE T-RO 27(5), 2011).
A joint that a step pushes against its limit is held there and the step solved again without it. What decides the
solve rate is where one starts: restarts come from a fixed library of sampled configurations, nearest TCP pose first.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from robosandbox.robots.kinematics import bounded_step
from robosandbox.robots.robot import Robot
from robosandbox.types import Array

# One radian of orientation error weighs as much as this many metres of position error.
_METRES_PER_RADIAN = 0.3
_STRICT = 1e-3
_LOOSE = 0.12
_FULL_POSE = 6
_FEW_JOINTS_SHARE = 0.1
_DAMPING = 0.05
_MIN_DAMPING = 1e-6
_MAX_STEP = 0.6
_MAX_ITERATIONS = 40
_STALL_ITERATIONS = 8
_STALL_RATIO = 0.7
_LIBRARY_SIZE = 4096
# How much the distance of a start from the seed counts, beside the turn of its TCP.
_SEED_SHARE = 0.3


@dataclass(frozen=True, slots=True)
class Solution:
    """A configuration and how far its TCP is from the target.

    Attributes:
        q: Shape (n,).
        position_error: Metres.
        orientation_error: Radians.
        solved: Both are within tolerance.
    """

    q: Array
    position_error: float
    orientation_error: float
    solved: bool

    @property
    def cost(self) -> float:
        """One number to rank by."""
        return self.position_error + _METRES_PER_RADIAN * self.orientation_error


class DlsSolver:
    """Solves for one robot on MjData of its own.

    Args:
        model: The world model that the robot is bound to.
        robot: Its arm is solved for; everything else stays as it is in `data`.
        position_tolerance: Metres.
        orientation_tolerance: Radians; when left out, strict for six joints and more, loose for an arm that has too few
            for every orientation: it takes the position exactly and comes as near to the orientation as it can.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        robot: Robot,
        *,
        position_tolerance: float = 1e-4,
        orientation_tolerance: float | None = None,
    ) -> None:
        self.model = model
        self.robot = robot
        self.data = mujoco.MjData(model)
        self.position_tolerance = position_tolerance
        few = robot.n < _FULL_POSE
        self.orientation_tolerance: float = orientation_tolerance or (_LOOSE if few else _STRICT)
        self._weight = _METRES_PER_RADIAN * (_FEW_JOINTS_SHARE if few else 1.0)
        self._few = few
        self.reach: float = _reach(model, robot)
        self._jacobian = np.zeros((6, model.nv))
        self._quat = np.zeros(4)
        self._target_quat = np.zeros(4)
        self._rotvec = np.zeros(3)
        self._error = np.zeros(6)
        self._lower, self._upper = robot.lower, robot.upper
        self._sampling_low = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
        self._sampling_high = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
        self._library: tuple[Array, Array, Array] | None = None

    def forward(self, q: Array) -> tuple[Array, Array]:
        """Return the TCP's position (3,) and rotation (3, 3) in the world at `q`."""
        self.data.qpos[self.robot.qpos_indices] = q
        mujoco.mj_kinematics(self.model, self.data)
        return self.robot.tcp(self.data)

    def solve(self, position: Array, rotation: Array, seed: Array, *, restarts: int = 60) -> Solution:
        """Return the first solution found from `seed` and then from restarts, or the best try.

        Args:
            position: Target TCP position in the world, shape (3,).
            rotation: Target TCP rotation in the world, shape (3, 3).
            seed: Configuration to start from, shape (n,).
            restarts: How many further starts may be made.
        """
        best = self.descend(position, rotation, seed)
        if best.solved or self._is_beyond_reach(position):
            return best
        for start in self._nearest_starts(position, rotation, seed, restarts):
            solution = self.descend(position, rotation, start)
            if solution.solved:
                return solution
            if solution.cost < best.cost:
                best = solution
        return best

    def descend(self, position: Array, rotation: Array, seed: Array) -> Solution:
        """Return where one descent from `seed` ends."""
        model, data, robot = self.model, self.data, self.robot
        site, dofs, addresses = robot.tcp_site, robot.dof_indices, robot.qpos_indices
        # The site aims at what puts the TCP frame on the target.
        mujoco.mju_mat2Quat(self._target_quat, (rotation @ robot.R_site_tcp.T).ravel())
        q = np.clip(seed, self._lower, self._upper)
        best_cost, best = np.inf, None
        checkpoint = np.inf
        error, jacobian = self._error, self._jacobian
        for iteration in range(_MAX_ITERATIONS):
            data.qpos[addresses] = q
            mujoco.mj_kinematics(model, data)
            error[:3] = position - data.site_xpos[site]
            mujoco.mju_mat2Quat(self._quat, data.site_xmat[site])
            mujoco.mju_subQuat(self._rotvec, self._target_quat, self._quat)
            error[3:] = data.site_xmat[site].reshape(3, 3) @ self._rotvec
            position_error = float(np.sqrt(error[:3] @ error[:3]))
            orientation_error = float(np.sqrt(error[3:] @ error[3:]))
            cost = position_error + _METRES_PER_RADIAN * orientation_error
            if cost < best_cost:
                best_cost, best = cost, (q, position_error, orientation_error)
            if position_error <= self.position_tolerance and orientation_error <= self.orientation_tolerance:
                return Solution(q, position_error, orientation_error, True)
            if iteration % _STALL_ITERATIONS == 0:
                if best_cost > _STALL_RATIO * checkpoint:
                    break
                checkpoint = best_cost
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], site)
            weight = self._weight
            if self._few and orientation_error <= self.orientation_tolerance:
                weight *= _FEW_JOINTS_SHARE
            q = self._step(q, jacobian[:, dofs], error, weight)
        assert best is not None
        return Solution(best[0], best[1], best[2], False)

    def _step(self, q: Array, jacobian: Array, error: Array, weight: float) -> Array:
        weighted = jacobian.copy()
        weighted[3:] *= weight
        target = error.copy()
        target[3:] *= weight
        damping = _DAMPING * float(target @ target) + _MIN_DAMPING
        hessian = weighted.T @ weighted
        hessian.flat[:: len(q) + 1] += damping
        dq = bounded_step(q, hessian, weighted.T @ target, self._lower, self._upper)
        largest = float(np.abs(dq).max())
        if largest > _MAX_STEP:
            dq *= _MAX_STEP / largest
        return np.clip(q + dq, self._lower, self._upper)

    def _is_beyond_reach(self, position: Array) -> bool:
        return bool(np.linalg.norm(position - self.robot_root()) > self.reach)

    def robot_root(self) -> Array:
        """Return the anchor of the first arm joint in the world, shape (3,)."""
        anchor: Array = self.data.xanchor[self.model.dof_jntid[self.robot.dof_indices[0]]].copy()
        return anchor

    def _nearest_starts(self, position: Array, rotation: Array, seed: Array, count: int) -> Array:
        """Return library configurations, nearest TCP pose first and of two alike the one nearer the seed, shape (count, n)."""
        if self._library is None:
            self._library = self._sample_library()
        configurations, positions, rotations = self._library
        distance = np.linalg.norm(positions - position, axis=1)
        # trace(A^T B) = 1 + 2 cos(angle)
        cosine = np.clip((np.einsum("kij,ij->k", rotations, rotation) - 1.0) / 2.0, -1.0, 1.0)
        cost = distance + _METRES_PER_RADIAN * np.arccos(cosine)
        cost += _METRES_PER_RADIAN * _SEED_SHARE * np.abs(configurations - seed).mean(axis=1)
        nearest = np.argpartition(cost, min(count, len(cost) - 1))[:count]
        return configurations[nearest[np.argsort(cost[nearest], kind="stable")]]

    def _sample_library(self) -> tuple[Array, Array, Array]:
        rng = np.random.default_rng(0)
        configurations = rng.uniform(self._sampling_low, self._sampling_high, (_LIBRARY_SIZE, self.robot.n))
        positions, rotations = np.empty((_LIBRARY_SIZE, 3)), np.empty((_LIBRARY_SIZE, 3, 3))
        for k, q in enumerate(configurations):
            positions[k], rotations[k] = self.forward(q)
        return configurations, positions, rotations


def _reach(model: mujoco.MjModel, robot: Robot) -> float:
    """Return an upper bound on the TCP's distance from the first arm joint's anchor, metres."""
    chain = []
    body = int(model.site_bodyid[robot.tcp_site])
    while body:
        chain.append(body)
        body = int(model.body_parentid[body])
    first = int(model.dof_bodyid[robot.dof_indices[0]])
    length = float(np.linalg.norm(model.site_pos[robot.tcp_site]))
    for body in chain[: chain.index(first)]:
        length += float(np.linalg.norm(model.body_pos[body]))
    for dof in robot.dof_indices:
        joint = int(model.dof_jntid[dof])
        length += 2.0 * float(np.linalg.norm(model.jnt_pos[joint]))
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE.value:
            length += float(np.abs(model.jnt_range[joint]).max()) if model.jnt_limited[joint] else np.inf
    return length
