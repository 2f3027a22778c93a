"""A joint servo at every physics step through LIBERO's torque motors."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from robosandbox.types import Array, Trajectory

# Natural frequency of the servo, rad/s, critically damped: a fifth of what a step of 2 ms can follow.
_FREQUENCY = 100.0
# Seconds by which a critically damped servo trails a moving target.
LAG = 2.0 / _FREQUENCY
# Share of a motor's torque that a motion may ask for; the rest is the servo's. Seconds between rows that are looked at, and over which
# a motion comes down to where it has to be slow.
_SHARE, _LOOK, _EASES = 0.8, 0.02, 0.3


class JointServo:
    """Computed torque: the arm's own inertia and bias forces, and an error that dies out, within what the motors give.

    Args:
        model: LIBERO's.
        joints: The arm's.
        motors: Their torque motors, in the same order.

    Attributes:
        qpos: Addresses of the joints in qpos.
        dofs: And in qvel.
        actuators: Ids of the motors.
    """

    def __init__(self, model: mujoco.MjModel, joints: Sequence[str], motors: Sequence[str]) -> None:
        ids = [model.joint(name).id for name in joints]
        self._model = model
        self.qpos = model.jnt_qposadr[ids].copy()
        self.dofs = model.jnt_dofadr[ids].copy()
        self.actuators = np.array([model.actuator(name).id for name in motors])
        self._most = model.actuator_ctrlrange[self.actuators, 1].copy()
        # What is only asked for its dynamics touches nothing.
        self._alone = copy.copy(model)
        self._alone.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT.value
        self._scratch = mujoco.MjData(self._alone)

    def advance(self, data: mujoco.MjData, goal: Array, steps: int) -> None:
        """Let physics steps pass with the joints sent to `goal` (n,)."""
        model, dofs, motors = self._model, self.dofs, self.actuators
        wanted, needed = np.zeros(model.nv), np.zeros(model.nv)
        for _ in range(steps):
            mujoco.mj_step1(model, data)
            off, speed = goal - data.qpos[self.qpos], data.qvel[dofs]
            wanted[dofs] = _FREQUENCY**2 * off - 2.0 * _FREQUENCY * speed
            mujoco.mj_mulM(model, data, needed, wanted)
            torque = needed[dofs] + data.qfrc_bias[dofs] - data.qfrc_passive[dofs]
            data.ctrl[motors] = np.clip(torque, -self._most, self._most)
            mujoco.mj_step2(model, data)

    def paced(self, data: mujoco.MjData, trajectory: Trajectory) -> Trajectory:
        """Return a trajectory slowed down where it asks for more than the motors give.

        The air resists LIBERO's hand, whose small bodies have the inertia of large ones, with 24 N m and more at 1 rad/s; the last two motors give 12.
        """
        q, dt = trajectory.q, trajectory.dt
        if len(q) < 3:
            return trajectory
        speed = np.gradient(q, dt, axis=0)
        change = np.gradient(speed, dt, axis=0)
        self._scratch.qpos[:] = data.qpos
        rows = np.unique([*range(0, len(q), max(1, round(_LOOK / dt))), len(q) - 1])
        slower = np.array([self._slower(q[k], speed[k], change[k]) for k in rows])
        slower = np.interp(np.arange(len(q)), rows, slower)
        width = 2 * max(1, round(_EASES / dt)) + 1
        slower = uniform_filter1d(maximum_filter1d(slower, width, mode="nearest"), width, mode="nearest")
        times = np.concatenate([[0.0], np.cumsum((slower[1:] + slower[:-1]) / 2.0 * dt)])
        if times[-1] <= (len(q) - 1) * dt * (1.0 + 1e-9):
            return trajectory
        even = np.linspace(0.0, times[-1], max(2, round(times[-1] / dt) + 1))
        eased = np.column_stack([np.interp(even, times, column) for column in q.T])
        return replace(trajectory, q=eased, dt=float(even[1]))

    def _slower(self, q: Array, speed: Array, change: Array) -> float:
        """Return by how much slower the motors allow to go where the arm is at `q` with a speed and its change, each (n,); 1 for not at all."""
        model, data, dofs = self._alone, self._scratch, self.dofs
        data.qpos[self.qpos] = q
        data.qvel[:] = 0.0
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        still = data.qfrc_bias[dofs] - data.qfrc_passive[dofs]
        wanted, needed = np.zeros(model.nv), np.zeros(model.nv)
        data.qvel[dofs], wanted[dofs] = speed, change
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_mulM(model, data, needed, wanted)
        # What speed and its change ask for falls with the square of the time that is taken.
        moving = needed[dofs] + data.qfrc_bias[dofs] - data.qfrc_passive[dofs] - still
        room = np.maximum(_SHARE * self._most - np.abs(still), 1e-3 * self._most)
        return float(np.sqrt(max(1.0, float((np.abs(moving) / room).max()))))
