"""Whether an arm's servos are stable under the integrator of somebody's scene."""

from __future__ import annotations

from collections.abc import Collection

import mujoco
import numpy as np

from robosandbox.robots.robot import Robot

# Times its rate at which an explicit step takes a damper beyond rest by as much as it was off: it grows from there on.
_EXPLICIT_LIMIT = 2.0


def use_stable_integrator(model: mujoco.MjModel, robots: Collection[Robot]) -> None:
    """Have a model of Euler's method stepped by `implicitfast` where an arm's servos would oscillate.

    Euler's method takes the damping of joints implicitly, and that of servos explicitly: it grows where the time step times the
    servos' damping over the arm's inertia passes 2. What has no motor moves as before.

    Args:
        model: The scene with its robots in it.
        robots: Bound to it, each looked at where it is at home.
    """
    if model.opt.integrator != mujoco.mjtIntegrator.mjINT_EULER:
        return
    data, inertia = mujoco.MjData(model), np.empty((model.nv, model.nv))
    for robot in robots:
        data.qpos[robot.qpos_indices] = robot.home_q
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, inertia)
    for robot in robots:
        dofs, servos, step = robot.dof_indices, robot.actuator_ids, model.opt.timestep
        damping = -model.actuator_biasprm[servos, 2] * model.actuator_gear[servos, 0] ** 2
        resisting = inertia[np.ix_(dofs, dofs)] + step * np.diag(model.dof_damping[dofs])
        rates = np.linalg.eigvals(np.linalg.solve(resisting, np.diag(damping)))
        if step * float(rates.real.max()) > _EXPLICIT_LIMIT:
            model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
            return
