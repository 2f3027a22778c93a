"""A joint servo at every physics step through LIBERO's torque motors."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from robosandbox.types import Array

# Natural frequency of the servo, rad/s, critically damped: a fifth of what a step of 2 ms can follow.
_FREQUENCY = 100.0
# Seconds by which a critically damped servo trails a moving target.
LAG = 2.0 / _FREQUENCY


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
