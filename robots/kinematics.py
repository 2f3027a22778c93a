"""A small solver for questions of placement: where can this arm hold its tool down?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from robosandbox.robots.limits import joint_limits
from robosandbox.types import Array

_ITERATIONS = 40
_MOST_STEP = 0.5
_METRES_PER_RADIAN = 0.2
_POSITION = 1e-3
_LIBRARY = 1500
# Of the reach, per radian; of the whole Jacobian; and the share of a lost direction that is a force.
_SINGULAR = 0.03
_STRETCHED = 0.1
_FORCE = 0.5
_EXACT = 0.01


@dataclass(frozen=True, slots=True)
class Tool:
    """A TCP on a body: position and rotation (z approach, y closing) in the body's frame."""

    body: int
    position: Array
    rotation: Array


class Kinematics:
    """Forward and inverse kinematics of arm joints in a robot compiled alone.

    Args:
        model: The robot.
        joints: Ids of its arm joints.
        tool: Where its TCP is.
        qpos: Everything else stays like this, shape (nq,).
    """

    def __init__(self, model: mujoco.MjModel, joints: tuple[int, ...], tool: Tool, qpos: Array | None = None) -> None:
        self.model, self.tool = model, tool
        self.data = mujoco.MjData(model)
        if qpos is not None:
            self.data.qpos[:] = qpos
        self.addresses = model.jnt_qposadr[list(joints)].copy()
        self.dofs = model.jnt_dofadr[list(joints)].copy()
        slide = model.jnt_type[list(joints)] == mujoco.mjtJoint.mjJNT_SLIDE.value
        free = np.where(slide, 0.5, np.pi)
        limited = model.jnt_limited[list(joints)].astype(bool)
        lower, upper = joint_limits(model, joints)
        self.lower = np.where(limited, lower, np.maximum(lower, -free))
        self.upper = np.where(limited, upper, np.minimum(upper, free))
        self._jacp, self._jacr = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        self._library: tuple[Array, Array, Array] | None = None

    @property
    def n(self) -> int:
        """The number of arm joints."""
        return len(self.addresses)

    def forward(self, q: Array) -> tuple[Array, Array]:
        """Return the TCP's position (3,) and rotation (3, 3) in the robot's frame."""
        self.data.qpos[self.addresses] = q
        mujoco.mj_kinematics(self.model, self.data)
        rotation = self.data.xmat[self.tool.body].reshape(3, 3)
        return self.data.xpos[self.tool.body] + rotation @ self.tool.position, rotation @ self.tool.rotation

    def jacobian(self, point: Array) -> tuple[Array, Array]:
        """Return the linear and angular Jacobians (3, n) of a point on the tool body, at the last `forward`."""
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_jac(self.model, self.data, self._jacp, self._jacr, point, self.tool.body)
        return self._jacp[:, self.dofs], self._jacr[:, self.dofs]

    def conditioning(self, q: Array) -> float:
        """Return how far the arm is from losing a direction of motion: 0 singular; metres per radian."""
        position, _ = self.forward(q)
        linear, _ = self.jacobian(position)
        return float(np.linalg.svd(linear, compute_uv=False)[-1])

    def is_singular(self, q: Array, length: float) -> bool:
        """Tell whether the arm cannot move its tool one way at `q` (n,), or holds a force without its motors.

        An arm that is stretched out, or folded onto its own axis, holds any force along a line without a motor: a direction
        that it has lost is a force. A wrist whose axes line up loses a turn: a couple, of which an arm can make its way out.

        Args:
            q: Shape (n,).
            length: How far it reaches, metres; what makes metres comparable to radians.
        """
        if self.conditioning(q) < _SINGULAR * length:
            return True
        lost, _, _ = self._lost(q, length)
        return bool(lost.size and np.linalg.norm(lost[:3], 2) > _FORCE)

    def singularity(self, q: Array, length: float) -> str | None:
        """Say in which way the arm is surely singular at `q` (n,), or None.

        A narrower question than `is_singular`: a start pose with a wrist that is nearly straight is no good choice, and no
        fault either. Stretched out, an arm holds a force along the line from its first joint to its tool without a motor.

        Args:
            q: Shape (n,).
            length: How far it reaches, metres.
        """
        ratio = self.conditioning(q) / max(length, 1e-6)
        if ratio < _SINGULAR:
            return f"the tool cannot move one way ({ratio:.3f} m/rad per metre)"
        lost, values, line = self._lost(q, length)
        if lost.size and float(np.linalg.norm(line @ lost[:3])) > _FORCE:
            return "it is stretched out and cannot move along its own line"
        exact = lost[:, values < _EXACT]
        if exact.size and float(np.linalg.norm(exact[:3], 2)) > _FORCE:
            return "axes of its joints line up and a direction is lost"
        return None

    def _lost(self, q: Array, length: float) -> tuple[Array, Array, Array]:
        """Return the wrenches nearly lost at `q` (6, k), their singular values (k,) and the line from root to tool (3,)."""
        position, _ = self.forward(q)
        linear, angular = self.jacobian(position)
        u, s, _ = np.linalg.svd(np.vstack([linear / max(length, 1e-6), angular]), full_matrices=False)
        # Lost directions come together, as in an arm whose elbow and wrist are straight at once: any mixture is lost.
        weak = np.flatnonzero(s[: min(6, self.n)] < _STRETCHED)
        line = position - self.data.xanchor[self.model.dof_jntid[self.dofs[0]]]
        return u[:, weak], s[weak], line / max(float(np.linalg.norm(line)), 1e-9)

    def centring(self, q: Array) -> float:
        """Return how far the joint nearest to a limit is from it: 0 at the limit, 1 in the middle."""
        half = (self.upper - self.lower) / 2.0
        return float((1.0 - np.abs(q - (self.upper + self.lower) / 2.0) / half).min())

    def solve(
        self,
        point: Array,
        approach: Array,
        *,
        tilt: float = 0.03,
        restarts: int = 8,
        seed: Array | None = None,
        collides: Callable[[Array], str | None] = lambda q: None,
    ) -> Array | None:
        """Return a configuration with the TCP at `point` (3,) pointing along `approach` (3,), or None.

        Args:
            point: In the robot's frame.
            approach: Unit vector; the turn about it is free.
            tilt: How far off it may point, radians.
            restarts: How many sampled starts are tried.
            seed: Tried first, shape (n,).
            collides: What touches at a configuration (n,), or None; those that touch are passed over.
        """
        starts = [] if seed is None else [seed]
        starts += list(self.starts(point, approach, restarts))
        for start in starts:
            q = self.descend(point, approach, start, tilt)
            if q is not None and collides(q) is None:
                return q
        return None

    def samples(self) -> tuple[Array, Array, Array]:
        """Return random configurations (k, n), their TCP positions (k, 3) and approach directions (k, 3)."""
        if self._library is None:
            rng = np.random.default_rng(0)
            q = rng.uniform(self.lower, self.upper, (_LIBRARY, self.n))
            positions, approaches = np.empty((_LIBRARY, 3)), np.empty((_LIBRARY, 3))
            for k in range(_LIBRARY):
                position, rotation = self.forward(q[k])
                positions[k], approaches[k] = position, rotation[:, 2]
            self._library = (q, positions, approaches)
        return self._library

    def starts(self, point: Array, approach: Array, count: int) -> Array:
        """Return sampled configurations (count, n), those nearest to a target first."""
        q, positions, approaches = self.samples()
        angle = np.arccos(np.clip(approaches @ approach, -1.0, 1.0))
        cost = np.linalg.norm(positions - point, axis=1) + _METRES_PER_RADIAN * angle
        return q[np.argsort(cost, kind="stable")[:count]]

    def descend(self, point: Array, approach: Array, start: Array, tilt: float) -> Array | None:
        """Return where one descent from `start` (n,) reaches the target, or None."""
        q = np.clip(start, self.lower, self.upper)
        for iteration in range(_ITERATIONS):
            position, rotation = self.forward(q)
            error = point - position
            axis = rotation[:, 2]
            turn = _cross(axis, approach)
            off = float(np.arctan2(np.linalg.norm(turn), axis @ approach))
            if off > 1e-9 and np.linalg.norm(turn) < 1e-6:
                turn = rotation[:, 0] * off
            elif off > 1e-9:
                turn = turn / np.linalg.norm(turn) * off
            # Within the tolerance position alone counts, lightly tied to the direction.
            weight = _METRES_PER_RADIAN if off > tilt else 0.2 * _METRES_PER_RADIAN
            if np.linalg.norm(error) < _POSITION and off <= tilt:
                return q
            if iteration == _ITERATIONS // 2 and np.linalg.norm(error) > 0.2:
                return None
            linear, angular = self.jacobian(position)
            stacked = np.vstack([linear, weight * angular])
            target = np.concatenate([error, weight * turn])
            damping = 1e-5 + 0.02 * float(target @ target)
            hessian = stacked.T @ stacked + damping * np.eye(self.n)
            step = bounded_step(q, hessian, stacked.T @ target, self.lower, self.upper)
            largest = float(np.abs(step).max())
            q = np.clip(q + step * min(1.0, _MOST_STEP / max(largest, 1e-9)), self.lower, self.upper)
        return None


def bounded_step(q: Array, hessian: Array, gradient: Array, lower: Array, upper: Array) -> Array:
    """Return the Newton step (n,) from `q` (n,); a joint that it pushes against its limit is held and it is solved again.

    Args:
        q: Configuration, within the limits.
        hessian: Damped J^T W J, shape (n, n).
        gradient: J^T W e, shape (n,).
        lower: Limits, shape (n,).
        upper: Shape (n,).
    """
    try:
        step: Array = np.asarray(np.linalg.solve(hessian, gradient), dtype=float)
    except np.linalg.LinAlgError:
        # Of lengths beyond all measure the damping is lost in rounding: nothing is reached.
        return np.zeros(len(q))
    blocked = ((q + step < lower) & (q <= lower)) | ((q + step > upper) & (q >= upper))
    if blocked.any() and not blocked.all():
        free = np.flatnonzero(~blocked)
        step = np.zeros(len(q))
        step[free] = np.linalg.solve(hessian[np.ix_(free, free)], gradient[free])
    return step


def _cross(a: Array, b: Array) -> Array:
    """Return a x b, both (3,); numpy's own takes ten times as long on single vectors, and this is the inner loop."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
