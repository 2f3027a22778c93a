"""A driver over a hidden MuJoCo plant: late commands, noisy encoders, lost frames, and no sense but those it is given."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from robosandbox.driver import (
    ARM,
    BareArm,
    BareDriver,
    BareHand,
    BareSenses,
    Capabilities,
    Guard,
    per_tick,
    refusal,
    require,
)
from robosandbox.motion.fixed_surroundings import meetings
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.robots.kinematics import Kinematics
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.opening import open_mujoco
from robosandbox.types import (
    ArmState,
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
from robosandbox.types.robot import GripperSpec, RobotSpec

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
        nothing = ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
        planning = PlanningScenes(scene).of(nothing)
        spec = planning.robot.spec
        self._plant = open_mujoco(scene, sensor=sensor, felt=felt, start_q=start_q)
        self._random = np.random.default_rng(seed)
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
        hand = None if spec.gripper is None else _HardwareHand(self, spec.gripper, encoder_noise)
        self.hands = {} if hand is None else {hand.name: hand}
        arm = _HardwareArm(self, spec, planning.kinematics(), hand, encoder_noise)
        if clock == "wall":
            arm.meets = meetings(planning)
        self.arms = {ARM: arm}
        self.senses = _HardwareSenses(self)
        self._ticks = 0
        # Seconds of the wall's clock when it was switched on; None where that clock is not this driver's.
        self._began = time.monotonic() if clock == "wall" else None

    @property
    def capabilities(self) -> Capabilities:
        """Quantities that it measures."""
        return self._capabilities

    @property
    def time(self) -> float:
        """Seconds since it was switched on."""
        self.catch_up()
        return self._plant.time

    def close(self) -> None:
        """Switch it off."""
        self._loop.close()
        self._plant.close()

    @property
    def referee(self) -> Callable[[], Truth]:
        """Returns the plant's true state, for a judge: nothing that skills or perception see comes from it."""
        return self._plant.truth

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held."""
        for _ in range(max(1, round(seconds / self.control_timestep))):
            self.tick(guards)

    def state(self, cameras: Sequence[str] = ()) -> Observation:
        """Return what the encoders read, and pictures."""
        return replace(super().state(), images=self._plant.state(cameras).images)

    # Between the parts of this driver and its plant.

    @property
    def plant(self) -> MuJoCoBackend:
        """What is behind the wires."""
        return self._plant

    def noise(self, size: int) -> Array:
        """Return samples of a normal distribution, shape (size,)."""
        return self._random.standard_normal(size)

    def command(self, actuators: NDArray[np.intp], controls: Array) -> None:
        """Send some actuators commands, which reach them a latency later."""
        self._commands[actuators] = controls

    def next_frame(self, camera: str, window: PictureWindow | None) -> RgbdFrame:
        """Return the next frame of a camera that is not lost; of a window of it, that part."""
        while self._random.random() < self._lost_share:
            # Nobody is told of these ticks: a frame may be waited for by what listens to ticks.
            for _ in range(round(_FRAME_SECONDS / self.control_timestep)):
                self._let_pass()
        self.catch_up()
        return self._plant.capture(camera, window)

    def tick(self, guards: Sequence[Guard]) -> None:
        """Let one control tick pass, and ask the guards."""
        self._let_pass()
        self._ticked(guards)

    def catch_up(self) -> None:
        """Let pass what the wall's clock says has passed since the last call, with the last commands held."""
        if self._began is None:
            return
        while self._began + (self._ticks + 1) * self.control_timestep <= time.monotonic():
            self._advance()

    def _let_pass(self) -> None:
        """Let one control tick pass, on the wall's clock where that is this driver's."""
        self.catch_up()
        if self._began is not None:
            due = self._began + (self._ticks + 1) * self.control_timestep
            time.sleep(max(0.0, due - time.monotonic()))
        self._advance()

    def _advance(self) -> None:
        """Let the plant pass one control tick, with the commands that were sent a latency ago."""
        self._on_the_way.append(self._commands.copy())
        self._plant.replay(self._on_the_way.popleft())
        self._ticks += 1


class _HardwareArm(BareArm):
    """The arm as its encoders know it."""

    def __init__(
        self, cell: Hardware, spec: RobotSpec, kinematics: Kinematics, hand: _HardwareHand | None, noise: float
    ) -> None:
        super().__init__(cell, spec)
        self._cell = cell
        self._kinematics = kinematics
        self._hand = hand
        self._noise = noise
        self._trim = np.zeros(spec.n)

    def state(self) -> ArmState:
        """Return what the encoders read."""
        self._cell.catch_up()
        q = self._measured_q()
        seen = self._cell.plant.arm_state(self.name)
        return replace(
            seen,
            q=frozen_array(q),
            tcp_pose=Pose.from_matrix(*self._kinematics.forward(q)),
            gripper=None if self._hand is None else self._hand.state(),
        )

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory, commands interpolated to the control ticks."""
        tick = self._cell.control_timestep
        q = per_tick(trajectory, tick)
        velocity = np.diff(q, axis=0, append=q[-1:]) / tick
        ahead = q + self._cell.plant.servo_lag(self.name) * velocity
        try:
            for row in ahead:
                self._command(row + self._trim)
                self._cell.tick(guards)
        except BaseException:
            self.stop()
            raise

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,)."""
        off = goal - self._measured_q()
        self._trim = np.clip(self._trim + _TRIM_SHARE * off, -_LARGEST_TRIM, _LARGEST_TRIM)
        self._command(goal + self._trim)
        self._cell.tick(guards)

    def stop(self) -> None:
        """Command the arm to stay where its encoders say it is."""
        self._command(np.clip(self._measured_q(), self.spec.lower, self.spec.upper))

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo gives now and the most that it can, N m or N.

        Raises:
            UnsupportedError: The joints measure no torque.
        """
        require(self._cell, "joint_torque", "a joint's torque was asked for")
        return self._cell.plant.servo_force(self.name, joint)

    def _measured_q(self) -> Array:
        q: Array = self._cell.plant.arm_state(self.name).q + self._noise * self._cell.noise(self.spec.n)
        return q

    def _command(self, q: Array) -> None:
        robot = self._cell.plant.robot
        self._cell.command(np.asarray(robot.actuator_ids, dtype=np.intp), robot.control(q))


class _HardwareHand(BareHand):
    """The gripper as its encoders know it."""

    def __init__(self, cell: Hardware, spec: GripperSpec, noise: float) -> None:
        super().__init__(cell, spec)
        self._cell = cell
        self._noise = noise
        self._closed = 0.0

    def state(self) -> GripperState:
        """Return what its encoders read."""
        exact = self._cell.plant.arm_state(self.arm).gripper
        assert exact is not None
        geometry = self.spec.geometry
        # Relative to a radian as an arm joint's noise is; a gripper's travel is often a few centimetres.
        noise = self._noise * float(self._cell.noise(1)[0])
        joint = exact.joint + noise * abs(geometry.closed_joint - geometry.open_joint)
        return GripperState(
            joint=joint,
            width=max(0.0, exact.width + geometry.aperture(joint) - geometry.aperture(exact.joint)),
            closed=geometry.closed_fraction(joint),
            force=exact.force if self._cell.capabilities.gripper_force else None,
            commanded=self._closed,
            seal=exact.seal,
        )

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed. Returns at once.

        Raises:
            ValueError: `closed` is outside 0..1.
            UnsupportedError: A force is given: it closes as hard as it can.
        """
        if force is not None:
            raise refusal(self._cell, "grip_limit", f"a grip of {force:g} N was asked for")
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; a gripper takes 0 (open) to 1 (closed)")
        self._closed = closed
        bound = self._cell.plant.world.grippers[self.name]
        self._cell.command(np.asarray(bound.actuator_ids, dtype=np.intp), self.spec.geometry.control(closed))

    def grip_on(self, object_id: str | None) -> float:
        """Return how hard the pads are pressed, N; they cannot tell by which object.

        Raises:
            UnsupportedError: The gripper measures no force.
        """
        del object_id
        require(self._cell, "gripper_force", "a grip was asked for")
        return self._cell.plant.grip_on(self.name, None)


class _HardwareSenses(BareSenses):
    """Cameras, and a force sensor at the wrist where there is one."""

    def __init__(self, cell: Hardware) -> None:
        super().__init__(cell)
        self._cell = cell

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return the next frame of a camera that is not lost; of a window of it, that part."""
        return self._cell.next_frame(camera, window)

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return what the wrist's sensor feels, N in the world, shape (3,); it cannot tell of which object, or of the table.

        Raises:
            UnsupportedError: There is no such sensor.
        """
        del object_id, arm
        require(self._cell, "wrist_wrench", "a force was asked for")
        return frozen_array(sum(self._cell.plant.forces().values(), np.zeros(3)))
