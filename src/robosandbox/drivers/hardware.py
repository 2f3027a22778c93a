"""A driver over a hidden MuJoCo plant: late commands, noisy encoders, lost frames, and no sense but those it is given."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from robosandbox.driver import BareDriver, Capabilities, Guard, per_tick, refusal, require
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.sim.opening import open_mujoco
from robosandbox.types import (
    Array,
    GripperState,
    Observation,
    ObservedScene,
    PictureWindow,
    Pose,
    RgbdFrame,
    Scene,
    Trajectory,
    Truth,
    frozen_array,
)
from robosandbox.types.robot import RobotSpec

# Time from a command to the servos, seconds; chosen as three control ticks, what a bus and a controller box take.
_LATENCY = 0.03
# Standard deviation of a joint's reading, rad: a twentieth of the 0.004 rad within which skills call an arm arrived.
_ENCODER_NOISE = 2e-4
# Share of frames that are lost; chosen far above what a USB camera drops, so that every episode meets it.
_LOST_SHARE = 0.1
# Seconds until the next frame; as of cameras with 30 a second.
_FRAME_SECONDS = 1.0 / 30.0
# Integral action as the MuJoCo driver has it: share of the error taken up a tick, and the most of it, rad.
_TRIM_SHARE = 0.08
# The most that integral action shifts a command, rad; as in the MuJoCo driver (sim/control.py).
_LARGEST_TRIM = 0.3


class Hardware(BareDriver):
    """A robot as its driver knows it: encoders, cameras and commands; the plant behind it is nobody's business.

    Args:
        scene: What the plant is loaded with.
        latency: Seconds from a command to the servos; a whole number of control ticks.
        encoder_noise: Standard deviation of a joint's reading, rad or m.
        lost_share: Share of camera frames that are lost.
        gripper_force: Whether the gripper measures its force.
        joint_torque: Whether the joints measure their torques.
        wrist_wrench: Whether there is a force sensor at the wrist.
        sensor: What its cameras are like.
        clock: "wall" where time passes by itself, at the wall clock's pace, and "simulated" where only calls let it pass,
            as fast as it can be computed.
        seed: Of the noise.
        felt: Objects of which the referee is to tell how hard they were pressed.
        start_q: Where the arm stands when it is switched on, shape (n,); at home when left out.

    Attributes:
        control_timestep: Seconds between commands.
        episode: Always 0: nothing starts over by itself.
    """

    episode: Final = 0

    def __init__(
        self,
        scene: Scene,
        *,
        latency: float = _LATENCY,
        encoder_noise: float = _ENCODER_NOISE,
        lost_share: float = _LOST_SHARE,
        gripper_force: bool = False,
        joint_torque: bool = False,
        wrist_wrench: bool = False,
        sensor: str = "ideal",
        clock: Literal["simulated", "wall"] = "simulated",
        seed: int = 0,
        felt: Iterable[str] = (),
        start_q: Array | None = None,
    ) -> None:
        super().__init__()
        self._plant = open_mujoco(scene, sensor=sensor, felt=felt, start_q=start_q)
        nothing = ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
        planning = PlanningScenes(scene).of(nothing)
        self._spec = planning.robot.spec
        self._kinematics = planning.kinematics()
        self._random = np.random.default_rng(seed)
        self._noise = encoder_noise
        self._lost_share = lost_share
        self._capabilities = Capabilities(
            gripper_force=gripper_force,
            joint_torque=joint_torque,
            wrist_wrench=wrist_wrench,
            cameras=self._plant.camera_specs(),
            clock=clock,
        )
        self.control_timestep: float = self._plant.control_timestep
        self._commands = self._plant.controls.copy()
        self._on_the_way: deque[Array] = deque(
            self._commands.copy() for _ in range(round(latency / self.control_timestep))
        )
        self._trim = np.zeros(self.spec.n)
        self._closed = 0.0
        self._ticks = 0
        # Seconds of the wall's clock when it was switched on; None where that clock is not this driver's.
        self._began = time.monotonic() if clock == "wall" else None

    @property
    def spec(self) -> RobotSpec:
        """Specification of the robot."""
        return self._spec

    @property
    def capabilities(self) -> Capabilities:
        """Quantities that it measures."""
        return self._capabilities

    @property
    def time(self) -> float:
        """Seconds since it was switched on."""
        self._catch_up()
        return self._plant.time

    def close(self) -> None:
        """Switch it off."""
        self._loop.close()
        self._plant.close()

    def referee(self) -> Truth:
        """Return the plant's true state, for a judge: nothing that skills or perception see comes from it."""
        return self._plant.truth()

    # Acting.

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory, commands interpolated to the control ticks."""
        q = per_tick(trajectory, self.control_timestep)
        velocity = np.diff(q, axis=0, append=q[-1:]) / self.control_timestep
        ahead = q + self._plant.servo_lag * velocity
        try:
            for row in ahead:
                self._command(row + self._trim)
                self._tick(guards)
        except BaseException:
            self.stop()
            raise

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,)."""
        off = goal - self._measured_q()
        self._trim = np.clip(self._trim + _TRIM_SHARE * off, -_LARGEST_TRIM, _LARGEST_TRIM)
        self._command(goal + self._trim)
        self._tick(guards)

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held."""
        for _ in range(max(1, round(seconds / self.control_timestep))):
            self._tick(guards)

    def stop(self) -> None:
        """Command the arm to stay where its encoders say it is."""
        self._command(np.clip(self._measured_q(), self.spec.lower, self.spec.upper))

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed. Returns at once.

        Raises:
            ValueError: `closed` is outside 0..1, or the robot has no gripper.
            UnsupportedError: A force is given: it closes as hard as it can.
        """
        if force is not None:
            raise refusal(self, "grip_limit", f"a grip of {force:g} N was asked for")
        gripper = self.spec.gripper
        if gripper is None or not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; a gripper takes 0 (open) to 1 (closed)")
        self._closed = closed
        self._commands[self._plant_gripper_ids()] = gripper.geometry.control(closed)

    # Sensing.

    def state(self, cameras: Sequence[str] = ()) -> Observation:
        """Return what the encoders read, and pictures."""
        self._catch_up()
        q = self._measured_q()
        seen = self._plant.state(cameras)
        return replace(
            seen,
            q=frozen_array(q),
            tcp_pose=Pose.from_matrix(*self._kinematics.forward(q)),
            gripper=self._gripper_state(seen.gripper),
        )

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return the next frame of a camera that is not lost; of a window of it, that part."""
        while self._random.random() < self._lost_share:
            # Nobody is told of these ticks: a frame may be waited for by what listens to ticks.
            for _ in range(round(_FRAME_SECONDS / self.control_timestep)):
                self._let_pass()
        self._catch_up()
        return self._plant.capture(camera, window)

    def force_on(self, object_id: str | None) -> Array:
        """Return what the wrist's sensor feels, N in the world, shape (3,); it cannot tell of which object.

        Raises:
            UnsupportedError: There is no such sensor.
        """
        del object_id
        require(self, "wrist_wrench", "a force was asked for")
        return self._plant.force_on(None)

    def grip_on(self, object_id: str | None) -> float:
        """Return how hard the pads are pressed, N; they cannot tell by which object.

        Raises:
            UnsupportedError: The gripper measures no force.
        """
        del object_id
        require(self, "gripper_force", "a grip was asked for")
        return self._plant.grip_on(None)

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo gives now and the most that it can, N m or N.

        Raises:
            UnsupportedError: The joints measure no torque.
        """
        require(self, "joint_torque", "a joint's torque was asked for")
        return self._plant.servo_force(joint)

    # Inside.

    def _measured_q(self) -> Array:
        q: Array = self._plant.state().q + self._random.normal(0.0, self._noise, self.spec.n)
        return q

    def _gripper_state(self, exact: GripperState | None) -> GripperState | None:
        gripper = self.spec.gripper
        if exact is None or gripper is None:
            return None
        geometry = gripper.geometry
        # Relative to a radian as an arm joint's noise is; a gripper's travel is often a few centimetres.
        joint = exact.joint + self._random.normal(0.0, self._noise) * abs(geometry.closed_joint - geometry.open_joint)
        return GripperState(
            joint=joint,
            width=max(0.0, exact.width + geometry.aperture(joint) - geometry.aperture(exact.joint)),
            closed=geometry.closed_fraction(joint),
            force=exact.force if self._capabilities.gripper_force else None,
            commanded=self._closed,
            seal=exact.seal,
        )

    def _command(self, q: Array) -> None:
        self._commands[np.asarray(self._plant.robot.actuator_ids, dtype=np.intp)] = self._plant.robot.control(q)

    def _plant_gripper_ids(self) -> NDArray[np.intp]:
        gripper = self._plant.robot.gripper
        assert gripper is not None
        return np.asarray(gripper.actuator_ids, dtype=np.intp)

    def _tick(self, guards: Sequence[Guard]) -> None:
        self._let_pass()
        self._ticked(guards)

    def _let_pass(self) -> None:
        """Let one control tick pass, on the wall's clock where that is this driver's."""
        self._catch_up()
        if self._began is not None:
            due = self._began + (self._ticks + 1) * self.control_timestep
            time.sleep(max(0.0, due - time.monotonic()))
        self._advance()

    def _catch_up(self) -> None:
        """Let pass what the wall's clock says has passed since the last call, with the last commands held."""
        if self._began is None:
            return
        while self._began + (self._ticks + 1) * self.control_timestep <= time.monotonic():
            self._advance()

    def _advance(self) -> None:
        """Let the plant pass one control tick, with the commands that were sent a latency ago."""
        self._on_the_way.append(self._commands.copy())
        self._plant.replay(self._on_the_way.popleft())
        self._ticks += 1
