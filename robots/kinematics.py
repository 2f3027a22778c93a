"""Kinematics of an arm: where its tool is, how it moves with the joints, and which joints put it somewhere.

Inverse kinematics is damped least squares. Each step solves (J^T W J + lambda I) dq = J^T W e with the damping lambda
proportional to the squared error (T. Sugihara, "Solvability-Unconcerned Inverse Kinematics by the Levenberg-Marquardt
Method", IEEE T-RO 27(5), 2011). A joint that a step pushes against its limit is held there and the step solved again without
it. What decides the solve rate is where one starts: restarts come from a fixed library of sampled configurations, nearest
tool pose first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.robots.chains import Chains, Tool, length_bound, turned
from robosandbox.robots.compiled import CompiledDescent, can_descend, library
from robosandbox.robots.descent import bounded_step, turn_of_axis
from robosandbox.robots.limits import commandable
from robosandbox.robots.robot import Robot
from robosandbox.types import Array
from robosandbox.types.robot import FULL_POSE
from robosandbox.values import frozen

# Metres of position error that count as much as one radian of turn; chosen near the length of a forearm, which makes that
# way when it turns so far.
_METRES_PER_RADIAN = 0.3
# Metres and radians within which a pose is reached; chosen as a tenth of the accuracy that benchmarks/ik.py asks for.
POSITION_TOLERANCE, _STRICT = 1e-4, 1e-3
# Radians within which an arm that has too few joints for every orientation has reached one; chosen: with it the arms of five
# joints in docs/arms.md pick.
_LOOSE = 0.12
# Joints that it takes for any position and approach direction.
_APPROACH = 5
# Share of an orientation's usual weight while position alone decides; chosen as one order of magnitude.
_ORIENTATION_SHARE = 0.1
# Damping per squared error, and the least of it, numbers for errors in metres; tried: benchmarks/ik.py solves every pose.
_DAMPING, _MIN_DAMPING = 0.05, 1e-6
# Largest change of a joint in one step, rad or m; chosen because beyond it the Jacobian says little of where the tool goes.
_MAX_STEP = 0.6
# Steps of a descent; every so many the error must have shrunk to this share; tried: benchmarks/ik.py solves every pose.
_MAX_STEPS, _STALL_STEPS, _STALL_SHARE = 40, 8, 0.7
# What descent.c is told of these.
_NUMBERS = {
    "metres_per_radian": _METRES_PER_RADIAN,
    "damping": _DAMPING,
    "min_damping": _MIN_DAMPING,
    "max_step": _MAX_STEP,
    "stall_share": _STALL_SHARE,
    "max_steps": _MAX_STEPS,
    "stall_steps": _STALL_STEPS,
}
# Configurations that restarts are taken from; tried: benchmarks/ik.py solves every pose.
_LIBRARY_SIZE = 4096
# Share of the distance of a start from the seed beside the turn of its tool; chosen so that of two starts whose tools are about
# as near, the one in the nearer posture comes first.
_SEED_SHARE = 0.3


@frozen
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


class Kinematics:
    """Forward and inverse kinematics of arm joints, on MjData of its own.

    A target's orientation is a rotation, shape (3, 3), or an approach direction, shape (3,), about which the turn is free.

    Args:
        model: The robot, alone or in a world.
        joints: Ids of its arm joints, hinges and slides.
        tool: Where its TCP is.
        qpos: Everything else stays like this, shape (nq,); as the model has it when left out.
        limits: Least and largest joint values, each (n,), infinite where there is none; when left out what the joints can be
            commanded to, half a turn either way where there is no end.
        position_tolerance: Metres.
        orientation_tolerance: Radians; when left out, strict for six joints and more, loose for an arm that has too few
            for every orientation: it takes the position exactly and comes as near to the orientation as it can.
        compiled: Descend in C where that was built; the same steps in NumPy otherwise.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        joints: Sequence[int],
        tool: Tool,
        *,
        qpos: Array | None = None,
        limits: tuple[Array, Array] | None = None,
        position_tolerance: float = POSITION_TOLERANCE,
        orientation_tolerance: float | None = None,
        compiled: bool = True,
    ) -> None:
        self.model: mujoco.MjModel = model
        self.tool: Tool = tool
        self.data: mujoco.MjData = mujoco.MjData(model)
        if qpos is not None:
            self.data.qpos[:] = qpos
        self.joints: NDArray[np.intp] = np.asarray(joints, dtype=np.intp)
        self.addresses: NDArray[np.int32] = model.jnt_qposadr[self.joints].copy()
        self.dofs: NDArray[np.int32] = model.jnt_dofadr[self.joints].copy()
        self.lower: Array
        self.upper: Array
        self.lower, self.upper = commandable(model, joints) if limits is None else limits
        self.position_tolerance: float = position_tolerance
        few = len(self.joints) < FULL_POSE
        self.orientation_tolerance: float = orientation_tolerance or (_LOOSE if few else _STRICT)
        self.reach: float = length_bound(model, joints, tool)
        mujoco.mj_kinematics(model, self.data)
        # Views: making them anew costs as much as the arithmetic of a step.
        self._origin, self._axes = self.data.xpos[tool.body], self.data.xmat[tool.body].reshape(3, 3)
        self._local = tool.position, tool.rotation
        if tool.site is not None and tool.R_site_tcp is not None:
            self._origin, self._axes = self.data.site_xpos[tool.site], self.data.site_xmat[tool.site].reshape(3, 3)
            self._local = np.zeros(3), tool.R_site_tcp
        self._jacobian = np.zeros((6, model.nv))
        self._linear, self._angular = self._jacobian[:3], self._jacobian[3:]
        self._quat, self._target_quat, self._turn, self._error = np.zeros(4), np.zeros(4), np.zeros(3), np.zeros(6)
        self._offset, self._rotation_error = self._error[:3], self._error[3:]
        self._qpos = self.data.qpos
        self._library: tuple[Array, Array, Array] | None = None
        self._compiled: CompiledDescent | None = None
        if compiled and (found := library()) is not None and can_descend(self):
            self._compiled = CompiledDescent(found, self, _NUMBERS)

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        robot: Robot,
        *,
        position_tolerance: float = POSITION_TOLERANCE,
        orientation_tolerance: float | None = None,
        compiled: bool = True,
    ) -> Self:
        """Return the kinematics of a robot that is bound to a model; the rest as the constructor takes it."""
        joints = model.dof_jntid[robot.dof_indices].tolist()
        tool = Tool.at_site(model, robot.tcp_site, robot.R_site_tcp)
        return cls(
            model,
            joints,
            tool,
            limits=(robot.lower, robot.upper),
            position_tolerance=position_tolerance,
            orientation_tolerance=orientation_tolerance,
            compiled=compiled,
        )

    @property
    def is_compiled(self) -> bool:
        """True where descents are those in C."""
        return self._compiled is not None

    @property
    def n(self) -> int:
        """The number of arm joints."""
        return len(self.addresses)

    def forward(self, q: Array) -> tuple[Array, Array]:
        """Return the TCP's position (3,) and rotation (3, 3) in the model's world at `q` (n,)."""
        self._qpos[self.addresses] = q
        mujoco.mj_kinematics(self.model, self.data)
        return self._tcp()

    def jacobian(self, point: Array) -> Array:
        """Return the Jacobian (6, n), linear rows first, of a point (3,) on the tool's body, at the last `forward`."""
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_jac(self.model, self.data, self._linear, self._angular, point, self.tool.body)
        columns: Array = self._jacobian[:, self.dofs]
        return columns

    def root(self) -> Array:
        """Return the anchor of the first arm joint, shape (3,), at the last `forward`."""
        anchor: Array = self.data.xanchor[self.joints[0]].copy()
        return anchor

    def solve(self, position: Array, orientation: Array, seed: Array, *, restarts: int = 60) -> Solution:
        """Return the first solution found from `seed` and then from restarts, or the best try.

        Args:
            position: Of the TCP, shape (3,).
            orientation: Rotation (3, 3) or approach (3,).
            seed: Configuration to start from, shape (n,).
            restarts: How many further starts may be made.
        """
        found = self._descents(position, orientation, seed, restarts, None)
        best = next(found)
        for solution in found if not best.solved else ():
            if solution.solved or solution.cost < best.cost:
                best = solution
            if solution.solved:
                break
        return best

    def find(
        self,
        position: Array,
        orientation: Array,
        *,
        tilt: float = 0.03,
        restarts: int = 8,
        seed: Array | None = None,
        collides: Callable[[Array], str | None] = lambda q: None,
    ) -> Array | None:
        """Return a configuration with the TCP at a place that touches nothing, or None.

        Args:
            position: Of the TCP, shape (3,).
            orientation: Rotation (3, 3) or approach (3,).
            tilt: How far off the orientation may be, radians.
            restarts: How many sampled starts are tried.
            seed: Tried first, shape (n,).
            collides: What touches at a configuration (n,), or None; those that touch are passed over.
        """
        for solution in self._descents(position, orientation, seed, restarts, tilt):
            if solution.solved and collides(solution.q) is None:
                return solution.q
        return None

    def descend(self, position: Array, orientation: Array, seed: Array, *, tilt: float | None = None) -> Solution:
        """Return where one descent from `seed` ends; `tilt` radians off is near enough, by default the tolerance."""
        data, free_turn = self.data, orientation.ndim == 1
        tolerance = self.orientation_tolerance if tilt is None else tilt
        usual, yielding = self._weights(free_turn)
        if self._compiled is not None:
            return Solution(
                *self._compiled(position, orientation, seed, tolerance=tolerance, weights=(usual, yielding))
            )
        if not free_turn:
            # The body, or the site, aims at what puts the TCP on the target.
            mujoco.mju_mat2Quat(self._target_quat, (orientation @ self._local[1].T).ravel())
        q = np.clip(seed, self.lower, self.upper)
        best, best_cost, checkpoint = (q, np.inf, np.inf), np.inf, np.inf
        error, offset, turn = self._error, self._offset, self._rotation_error
        for step in range(_MAX_STEPS):
            self._qpos[self.addresses] = q
            mujoco.mj_kinematics(self.model, data)
            point = self._origin + self._axes.dot(self._local[0])
            np.subtract(position, point, out=offset)
            turn[:] = turn_of_axis(self._tcp()[1], orientation) if free_turn else self._turn_to_target()
            position_error, orientation_error = math.sqrt(offset.dot(offset)), math.sqrt(turn.dot(turn))
            # Of a direction that may be off by so much, only what is beyond that is an error.
            off = max(0.0, orientation_error - tolerance) if free_turn else orientation_error
            cost = position_error + _METRES_PER_RADIAN * off
            if position_error <= self.position_tolerance and orientation_error <= tolerance:
                return Solution(q, position_error, orientation_error, True)
            if cost < best_cost:
                best_cost, best = cost, (q, position_error, orientation_error)
            if step % _STALL_STEPS == 0:
                if best_cost > _STALL_SHARE * checkpoint:
                    break
                checkpoint = best_cost
            weight = usual
            if orientation_error <= tolerance:
                weight = yielding
                if free_turn:
                    turn[:] = 0.0
            q = self._stepped(q, point, error, weight)
        return Solution(*best, False)

    def samples(self) -> tuple[Array, Array, Array]:
        """Return random configurations (k, n), their TCP positions (k, 3) and rotations (k, 3, 3)."""
        if self._library is None:
            low = np.where(np.isfinite(self.lower), self.lower, -np.pi)
            high = np.where(np.isfinite(self.upper), self.upper, np.pi)
            q = np.random.default_rng(0).uniform(low, high, (_LIBRARY_SIZE, self.n))
            qpos = np.repeat(self.data.qpos[None], _LIBRARY_SIZE, axis=0)
            qpos[:, self.addresses] = q
            positions, quats = (each[:, 0] for each in Chains(self.model, [self.tool.body]).poses(qpos))
            axes = [turned(quats, axis) for axis in self.tool.rotation.T]
            self._library = (q, positions + turned(quats, self.tool.position), np.stack(axes, axis=2))
        return self._library

    def starts(self, position: Array, orientation: Array, count: int, *, seed: Array | None = None) -> Array:
        """Return sampled configurations, nearest TCP pose first and of two alike the one nearer the seed, shape (count, n)."""
        configurations, positions, rotations = self.samples()
        if orientation.ndim == 1:
            cosine = rotations[:, :, 2] @ orientation
        else:
            # trace(A^T B) = 1 + 2 cos(angle)
            cosine = (np.einsum("kij,ij->k", rotations, orientation) - 1.0) / 2.0
        cost = np.linalg.norm(positions - position, axis=1) + _METRES_PER_RADIAN * np.arccos(np.clip(cosine, -1.0, 1.0))
        if seed is not None:
            cost += _METRES_PER_RADIAN * _SEED_SHARE * np.abs(configurations - seed).mean(axis=1)
        nearest = np.argpartition(cost, min(count, len(cost) - 1))[:count]
        return configurations[nearest[np.argsort(cost[nearest], kind="stable")]]

    def _descents(
        self, position: Array, orientation: Array, seed: Array | None, restarts: int, tilt: float | None
    ) -> Iterator[Solution]:
        if seed is not None:
            yield self.descend(position, orientation, seed, tilt=tilt)
        if np.linalg.norm(position - self.root()) <= self.reach:
            for start in self.starts(position, orientation, restarts, seed=seed):
                yield self.descend(position, orientation, start, tilt=tilt)

    def _weights(self, free_turn: bool) -> tuple[float, float]:
        """Return how many metres a radian counts as, and how many where the orientation is near enough."""
        # What cannot have any orientation, or need not, gives orientation up for position.
        few = self.n < (_APPROACH if free_turn else FULL_POSE)
        usual = _METRES_PER_RADIAN * (_ORIENTATION_SHARE if few else 1.0)
        return usual, usual * (_ORIENTATION_SHARE if few or free_turn else 1.0)

    def _tcp(self) -> tuple[Array, Array]:
        position, rotation = self._local
        return self._origin + self._axes @ position, self._axes @ rotation

    def _turn_to_target(self) -> Array:
        mujoco.mju_mat2Quat(self._quat, self._axes.ravel())
        mujoco.mju_subQuat(self._turn, self._target_quat, self._quat)
        turn: Array = self._axes @ self._turn
        return turn

    def _stepped(self, q: Array, point: Array, error: Array, weight: float) -> Array:
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_jac(self.model, self.data, self._linear, self._angular, point, self.tool.body)
        weighted, target = self._jacobian.take(self.dofs, axis=1), error.copy()
        weighted[3:] *= weight
        target[3:] *= weight
        hessian = weighted.T @ weighted
        hessian.reshape(-1)[:: len(q) + 1] += _DAMPING * float(target.dot(target)) + _MIN_DAMPING
        dq = bounded_step(q, hessian, weighted.T @ target, self.lower, self.upper)
        largest = float(np.abs(dq).max())
        if largest > _MAX_STEP:
            dq *= _MAX_STEP / largest
        return np.minimum(np.maximum(q + dq, self.lower), self.upper)
