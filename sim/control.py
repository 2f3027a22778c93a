"""Control of simulated arms and hands: trajectories and configurations to servos, and grippers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import mujoco
import numpy as np

from robosandbox.driver import ARM, Guard, per_tick
from robosandbox.robots.robot import Gripper, Robot
from robosandbox.sim.simulation import Simulation
from robosandbox.sim.world import World
from robosandbox.types import Array, Trajectory, frozen_array
from robosandbox.values import frozen

# Integral action: share of the error that is taken up a tick, chosen so that half of it is taken up in 8 ticks.
_TRIM_SHARE = 0.08
# Share of what a servo can give from where on it gives all.
_SPENT = 0.98
# The most that integral action shifts a command, rad or m: chosen so that an arm that was blocked does not leap when it is free.
_LARGEST_TRIM = 0.3


class ControlledSimulation(Simulation):
    """A simulation whose arms and hands take commands.

    Args:
        control_timestep: Seconds between commands to the servos.
    """

    def __init__(self, control_timestep: float) -> None:
        super().__init__(control_timestep)
        self._servo_lags: dict[str, Array] = {}
        self._trims: dict[str, Array] = {}
        # Of hands with a limit of force alone.
        self._grips: dict[str, _Grip] = {}

    @property
    def controls(self) -> Array:
        """Commands to the actuators now, shape (actuators,)."""
        return frozen_array(self._live.ctrl)

    def servo_lag(self, arm: str = ARM) -> Array:
        """Return by how many seconds each servo of an arm trails a moving target, shape (n,)."""
        return self._servo_lags[arm]

    def follow(self, arm: str, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Have an arm follow a trajectory, commands interpolated to the control ticks; return when the last is commanded."""
        robot, data, trim = self.robots[arm], self._live, self._trims[arm]
        q = per_tick(trajectory, self.control_timestep)
        # A damped servo lags a moving target by lag * velocity; commanding ahead by that keeps the arm on its path.
        velocity = np.diff(q, axis=0, append=q[-1:]) / self.control_timestep
        commands = robot.control(q + self._servo_lags[arm] * velocity + trim)
        commands[-1] = robot.control(trajectory.q[-1] + trim)
        control, actuators = data.ctrl, robot.actuator_ids
        try:
            for command in commands:
                control[actuators] = command
                self._tick(guards)
        except BaseException:
            self.stop_arm(arm)
            raise

    def trim(self, arm: str, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with an arm's commands shifted against what keeps it off `goal` (n,).

        That is integral action: a servo of finite stiffness sags under a load and stops short of a joint's friction.
        What it takes is kept for the motions that follow. A servo that gives all that it can already is not sent farther: it would
        only be wound up, and leap when it is free.
        """
        robot, data, motors = self.robots[arm], self._live, self.robots[arm].actuator_ids
        off = goal - data.qpos[robot.qpos_indices]
        ranges, force = self.model.actuator_forcerange[motors], data.actuator_force[motors]
        spent = self.model.actuator_forcelimited[motors].astype(bool) & np.where(
            off > 0.0, force >= _SPENT * ranges[:, 1], force <= _SPENT * ranges[:, 0]
        )
        off[spent] = 0.0
        trim = self._trims[arm] = np.clip(self._trims[arm] + _TRIM_SHARE * off, -_LARGEST_TRIM, _LARGEST_TRIM)
        data.ctrl[robot.actuator_ids] = robot.control(goal + trim)
        self._tick(guards)

    def wait(self, seconds: float | None = None, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held; one control tick when `seconds` is left out."""
        ticks = 1 if seconds is None else max(1, round(seconds / self.control_timestep))
        for _ in range(ticks):
            self._tick(guards)

    def set_gripper(self, hand: str, closed: float, force: float | None = None) -> None:
        """Command a hand: 0 is the sidecar's open, 1 its closed. Returns at once.

        Args:
            hand: Its name.
            closed: Likewise.
            force: What its motors may give together at most, N or N m; as much as they can when left out.

        Raises:
            ValueError: `closed` is outside 0..1, or the force is not positive.
        """
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; it takes 0 (open) to 1 (closed)")
        if force is not None and not force > 0.0:
            raise ValueError(f"force is {force}; give newtons above 0, or leave it out")
        gripper = self._loaded.grippers[hand]
        goal = gripper.geometry.control(closed)
        self._live.ctrl[gripper.actuator_ids] = goal
        before = self._grips.pop(hand, None)
        if force is not None:
            grip = before if before is not None and np.array_equal(before.goal, goal) else _Grip(goal)
            self._grips[hand] = replace(grip, force=force / len(goal))

    def _tick(self, guards: Sequence[Guard] = ()) -> None:
        for hand, grip in self._grips.items():
            self._grips[hand] = self._hold_back(self._loaded.grippers[hand], grip)
        super()._tick(guards)

    def _hold_back(self, gripper: Gripper, grip: _Grip) -> _Grip:
        """Command a gripper towards its goal, no further than its servos give their force for where it is; return the grip as it is then.

        A servo gives gain * control + bias, the bias affine in its length.
        """
        model, data = self.model, self._live
        ids = gripper.actuator_ids
        gain, bias = model.actuator_gainprm[ids, 0], model.actuator_biasprm[ids]
        resting = -(bias[:, 0] + bias[:, 1] * data.actuator_length[ids]) / gain
        reach = grip.force / np.abs(gain)
        if len(ids) > 1:
            grip, shift = grip.after(resting, gripper.geometry.control(1.0) - gripper.geometry.control(0.0))
            resting = resting + np.clip(shift, -reach, reach)
        data.ctrl[ids] = np.clip(grip.goal, resting - reach, resting + reach)
        return grip

    def restore(self, state: Array) -> None:
        """Go back to a snapshot of this model; a gripper whose force was limited holds as hard as it did then."""
        self._grips = {}
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
        self._trims = {name: np.zeros(robot.n) for name, robot in world.robots.items()}
        self._grips = {}
        self._servo_lags = {name: _servo_lag(world.model, robot) for name, robot in world.robots.items()}

    def _go_home(self, q: Array | Mapping[str, Array] | None) -> None:
        """Put the arm at `q` (n,), or each by name, at home when left out, the grippers open, and have the servos hold that."""
        data = self._live
        starts = q if isinstance(q, Mapping) else {} if q is None else {ARM: q}
        self._grips = {}
        for name, robot in self.robots.items():
            start = np.asarray(starts.get(name, robot.home_q), dtype=float)
            self._trims[name] = np.zeros(robot.n)
            data.qpos[robot.qpos_indices] = start
            data.ctrl[robot.actuator_ids] = robot.control(start)
        for gripper in self._loaded.grippers.values():
            geometry = gripper.geometry
            data.qpos[gripper.joint_indices] = gripper.joints_at(geometry.open_joint)
            data.ctrl[gripper.actuator_ids] = geometry.control(0.0)


@frozen
class _Grip:
    """A gripper that closes or opens with a limited force.

    Fingers with a servo each push alike, and would slide to and fro together with what they hold, as its weight has them. So they give way
    to a side only by as much as they get on towards their goal.

    Attributes:
        goal: Where its actuators are sent, shape (actuators,).
        force: What each of its servos may give, N or N m.
        nearest: How far off its goal it has been at the least, as a share of its way.
        aside: By how much its actuators are to be off that way, shape (actuators,); None before its first tick.
    """

    goal: Array
    force: float = 0.0
    nearest: float = np.inf
    aside: Array | None = None

    def after(self, now: Array, way: Array) -> tuple[_Grip, Array]:
        """Return the grip once its actuators are at `now`, of those that go along `way`, and where they are to go from there.

        All shapes (actuators,).
        """
        size = float(way @ way)
        off = self.goal - now
        share = float(off @ way) / size
        aside = now - self.goal + share * way
        if self.aside is None:
            return replace(self, nearest=abs(share), aside=aside), np.zeros_like(now)
        # One of n fingers that moves alone goes this much farther aside than all get on.
        free = max(0.0, self.nearest - abs(share)) * np.sqrt(size * (len(now) - 1))
        gone = aside - self.aside
        length = float(np.linalg.norm(gone))
        kept = self.aside + gone * min(1.0, free / length) if length > 0.0 else self.aside
        return replace(self, nearest=min(self.nearest, abs(share)), aside=kept), kept - aside


def _servo_lag(model: mujoco.MjModel, robot: Robot) -> Array:
    """Return by how many seconds each arm servo trails a moving target: total damping over stiffness, shape (n,)."""
    gear = model.actuator_gear[robot.actuator_ids, 0]
    stiffness = -model.actuator_biasprm[robot.actuator_ids, 1] * gear**2
    servo = -model.actuator_biasprm[robot.actuator_ids, 2] * gear**2
    lag: Array = (servo + model.dof_damping[robot.dof_indices].reshape(-1)) / stiffness
    return lag
