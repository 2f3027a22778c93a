"""Control of the simulated robot: trajectories and configurations to servos, and the gripper."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from robosandbox.driver import Guard, per_tick
from robosandbox.robots.robot import Robot
from robosandbox.sim.simulation import Simulation
from robosandbox.sim.world import World
from robosandbox.types import Array, Trajectory, frozen_array

# Integral action: share of the error that is taken up a tick, chosen so that half of it is taken up in 8 ticks.
_TRIM_SHARE = 0.08
# The most that integral action shifts a command, rad or m: chosen so that an arm that was blocked does not leap when it is free.
_LARGEST_TRIM = 0.3


class ControlledSimulation(Simulation):
    """A simulation whose robot takes commands.

    Args:
        control_timestep: Seconds between commands to the servos.
    """

    def __init__(self, control_timestep: float) -> None:
        super().__init__(control_timestep)
        self._servo_lag: Array = np.zeros(0)
        self._trim: Array = np.zeros(0)
        # Where the gripper is sent, and what each of its servos may give; None without a limit.
        self._grip: tuple[Array, float] | None = None

    @property
    def servo_lag(self) -> Array:
        """By how many seconds each arm servo trails a moving target, shape (n,)."""
        return self._servo_lag

    @property
    def controls(self) -> Array:
        """Commands to the actuators now, shape (actuators,)."""
        return frozen_array(self._live.ctrl)

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory, commands interpolated to the control ticks; return when the last row is commanded."""
        robot, data = self.robot, self._live
        q = per_tick(trajectory, self.control_timestep)
        # A damped servo lags a moving target by lag * velocity; commanding ahead by that keeps the arm on its path.
        velocity = np.diff(q, axis=0, append=q[-1:]) / self.control_timestep
        commands = robot.control(q + self._servo_lag * velocity + self._trim)
        commands[-1] = robot.control(trajectory.q[-1] + self._trim)
        control, actuators = data.ctrl, robot.actuator_ids
        try:
            for command in commands:
                control[actuators] = command
                self._tick(guards)
        except BaseException:
            self.stop()
            raise

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,).

        That is integral action: a servo of finite stiffness sags under a load and stops short of a joint's friction.
        What it takes is kept for the motions that follow.
        """
        robot, data = self.robot, self._live
        off = goal - data.qpos[robot.qpos_indices]
        self._trim = np.clip(self._trim + _TRIM_SHARE * off, -_LARGEST_TRIM, _LARGEST_TRIM)
        data.ctrl[robot.actuator_ids] = robot.control(goal + self._trim)
        self._tick(guards)

    def wait(self, seconds: float | None = None, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held; one control tick when `seconds` is left out."""
        ticks = 1 if seconds is None else max(1, round(seconds / self.control_timestep))
        for _ in range(ticks):
            self._tick(guards)

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed. Returns at once.

        Args:
            closed: Likewise.
            force: What its motors may give together at most, N or N m; as much as they can when left out.

        Raises:
            ValueError: `closed` is outside 0..1, the force is not positive, or the robot has no gripper.
        """
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; it takes 0 (open) to 1 (closed)")
        if force is not None and not force > 0.0:
            raise ValueError(f"force is {force}; give newtons above 0, or leave it out")
        gripper = self.robot.gripper
        if gripper is None:
            raise ValueError(f"{self.robot.name} has no gripper")
        goal = gripper.geometry.control(closed)
        self._live.ctrl[gripper.actuator_ids] = goal
        self._grip = None if force is None else (goal, force / len(goal))

    def _tick(self, guards: Sequence[Guard] = ()) -> None:
        if self._grip is not None:
            self._hold_back(*self._grip)
        super()._tick(guards)

    def _hold_back(self, goal: Array, force: float) -> None:
        """Command the gripper towards `goal` (actuators,), no further than its servos give `force` each for where it is.

        A servo gives gain * control + bias, the bias affine in its length.
        """
        model, data, gripper = self.model, self._live, self.robot.gripper
        if gripper is None:
            return
        ids = gripper.actuator_ids
        gain, bias = model.actuator_gainprm[ids, 0], model.actuator_biasprm[ids]
        resting = -(bias[:, 0] + bias[:, 1] * data.actuator_length[ids]) / gain
        reach = force / np.abs(gain)
        data.ctrl[ids] = np.clip(goal, resting - reach, resting + reach)

    def restore(self, state: Array) -> None:
        """Go back to a snapshot of this model; a gripper whose force was limited holds as hard as it did then."""
        self._grip = None
        super().restore(state)

    def replay(self, controls: Array, push: Array | None = None) -> None:
        """Let one control tick pass with recorded commands.

        Args:
            controls: To the actuators, shape (actuators,).
            push: Forces and torques on the bodies from outside, N and N m, shape (bodies, 6); none when left out.
        """
        data = self._live
        data.ctrl[:] = controls
        data.xfrc_applied[:] = 0.0 if push is None else push
        self._tick()

    def adopt(self, world: World) -> None:
        """Simulate a compiled world, everything where the model has it."""
        super().adopt(world)
        self._trim = np.zeros(world.robot.n)
        self._grip = None
        self._servo_lag = _servo_lag(world.model, world.robot)

    def _go_home(self, q: Array | None) -> None:
        """Put the arm at `q` (n,), at home when left out, the gripper open, and have the servos hold that."""
        data, robot = self._live, self.robot
        start = robot.home_q if q is None else np.asarray(q, dtype=float)
        self._trim = np.zeros(robot.n)
        self._grip = None
        data.qpos[robot.qpos_indices] = start
        data.ctrl[robot.actuator_ids] = robot.control(start)
        if robot.gripper:
            geometry = robot.gripper.geometry
            data.qpos[robot.gripper.joint_indices] = robot.gripper.joints_at(geometry.open_joint)
            data.ctrl[robot.gripper.actuator_ids] = geometry.control(0.0)


def _servo_lag(model: mujoco.MjModel, robot: Robot) -> Array:
    """Return by how many seconds each arm servo trails a moving target: total damping over stiffness, shape (n,)."""
    gear = model.actuator_gear[robot.actuator_ids, 0]
    stiffness = -model.actuator_biasprm[robot.actuator_ids, 1] * gear**2
    servo = -model.actuator_biasprm[robot.actuator_ids, 2] * gear**2
    lag: Array = (servo + model.dof_damping[robot.dof_indices].reshape(-1)) / stiffness
    return lag
