"""The Panda of `pybullet_data` as a driver: encoders, servos, a gripper without a sense of force, and three cameras."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final

import numpy as np
import pybullet

from robosandbox.driver import ARM, HAND, BareArm, BareDriver, BareHand, BareSenses, CameraSpec, Capabilities, Guard
from robosandbox.errors import InputError
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.robots.kinematics import Kinematics
from robosandbox.types import (
    ArmState,
    Array,
    GripperState,
    ObservedScene,
    PictureWindow,
    Pose,
    Posture,
    RgbdFrame,
    Scene,
    Trajectory,
    Truth,
    frozen_array,
)
from robosandbox.types.robot import GripperSpec, RobotSpec
from robosandbox_pybullet.cameras import cameras, draw
from robosandbox_pybullet.referee import measured, pressed
from robosandbox_pybullet.world import PHYSICS_TIMESTEP, ROBOT_MODEL, ROBOT_SIDECAR, BulletWorld
from robosandbox_pybullet.wrist import WristSensor

# Share of a joint's error that its servo takes up in a physics step: a time constant of 10 ms.
_SERVO_GAIN = 0.2
# Peak torques of the joints, N m: Franka Emika's data sheet of the Panda.
_TORQUES = (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)
# Speed of a finger, m/s: the Franka Hand's 50 mm/s for each of the two, as its data sheet says.
_FINGER_SPEED = 0.05
# Force of each finger, N: half of the 70 N with which the hand holds continuously.
_FINGER_FORCE = 35.0
# Integral action: share of the error taken up in a second, and the most of it, rad.
_TRIM_RATE = 8.0
_LARGEST_TRIM = 0.3
# Objects come to rest before anybody looks, seconds.
_SETTLE_SECONDS = 1.0
# Robots of a scene that this driver may stand in for: the bundled one, and its own.
_STANDS_FOR = (None, "franka_panda", str(ROBOT_MODEL))


class PyBulletDriver(BareDriver):
    """A Panda at a table in Bullet.

    Args:
        scene: Table and objects. Its robot is Bullet's Panda, whichever Panda it names.
        start_q: Where the arm stands at the beginning, shape (n,); at home when left out.
        felt: Objects of which the referee is to tell how hard they were pressed.

    Attributes:
        scene: The scene, with the robot that is really there.
        control_timestep: Seconds between commands.
        episode: Always 0: nothing starts over by itself.

    Raises:
        InputError: The scene names another robot, or an object that cannot be built.
    """

    episode: Final = 0

    def __init__(self, scene: Scene, *, start_q: Array | None = None, felt: Iterable[str] = ()) -> None:
        super().__init__()
        self.scene = self.fit(scene)
        nothing = ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
        planning = PlanningScenes(self.scene).of(nothing)
        self._robot = planning.robot.spec
        self._world = BulletWorld(self.scene, self._robot)
        self._cameras = cameras(scene.table_height)
        self.control_timestep: float = PHYSICS_TIMESTEP
        self._ticks = 0
        self._felt = dict.fromkeys(felt, 0.0)
        self._wrist = WristSensor(self._world)
        assert self._robot.gripper is not None
        self._hand = _PandaHand(self, self._robot.gripper)
        self._arm = _PandaArm(self, self._robot, planning.kinematics(), self._hand)
        self.arms, self.hands, self.senses = {ARM: self._arm}, {HAND: self._hand}, _PandaSenses(self)
        self._place(self._robot.home_q if start_q is None else start_q)
        self.wait(_SETTLE_SECONDS)
        self._ticks = 0

    @staticmethod
    def fit(scene: Scene) -> Scene:
        """Return the scene with Bullet's Panda in it, which stands in for the bundled one.

        Raises:
            InputError: The scene names another robot.
        """
        if (str(scene.robot_urdf) if scene.robot_urdf else None) not in _STANDS_FOR:
            raise InputError(f"robot_urdf: the driver 'pybullet' has a Panda, not {scene.robot_urdf}; leave it out")
        return scene.model_copy(update={"robot_urdf": ROBOT_MODEL, "robot_config": ROBOT_SIDECAR})

    @property
    def world(self) -> BulletWorld:
        """The engine."""
        return self._world

    @property
    def capabilities(self) -> Capabilities:
        """What a Panda tells of itself, with a force sensor between its flange and its hand."""
        cameras = {
            name: CameraSpec(intrinsics=item.intrinsics, pose=item.pose, arm=ARM if item.on_hand else None)
            for name, item in self._cameras.items()
        }
        return Capabilities(grip_limit=True, joint_torque=True, wrist_wrench=True, cameras=cameras, clock="simulated")

    @property
    def time(self) -> float:
        """Seconds since it was switched on."""
        return self._ticks * self.control_timestep

    @property
    def referee(self) -> Callable[[], Truth]:
        """Returns the state to judge on, read from the engine; skills and perceptions do not get at it."""
        return lambda: measured(self._world, time=self.time, home_q=self._robot.home_q, felt=self._felt)

    def close(self) -> None:
        """Switch it off."""
        self._world.close()

    def wait(self, seconds: float, guards: Sequence[Guard] = ()) -> None:
        """Let time pass with the last commands held."""
        for _ in range(max(1, round(seconds / self.control_timestep))):
            self.tick(guards)

    def tick(self, guards: Sequence[Guard]) -> None:
        """Let one control tick pass, and ask the guards."""
        self._world.call("stepSimulation")
        self._wrist.sample()
        for name, most in self._felt.items():
            self._felt[name] = max(most, pressed(self._world, name))
        self._ticks += 1
        self._ticked(guards)

    def frame(self, camera: str) -> RgbdFrame:
        """Return a camera's frame.

        Raises:
            InputError: No such camera.
        """
        if camera not in self._cameras:
            raise InputError(f"camera {camera!r} is not one of {', '.join(self._cameras)}")
        taken, seen = self._cameras[camera], self._arm.state()
        pose = seen.tcp_pose @ taken.pose if taken.on_hand else taken.pose
        rgb, depth = draw(self._world, taken, pose)
        fingers = frozen_array(self._world.joint_states(self._world.fingers)[:, 0])
        return RgbdFrame(
            camera=camera,
            time=self.time,
            rgb=rgb,
            depth=depth,
            intrinsics=taken.intrinsics,
            pose_camera_in_world=pose,
            arms={ARM: Posture(q=seen.q, gripper_q=fingers)},
        )

    def wrench(self) -> Array:
        """Return what the hand presses and pulls with, N in the world, shape (3,)."""
        return self._wrist.force

    def _place(self, q: Array) -> None:
        """Put the arm at a configuration, shape (n,), with the fingers open."""
        world = self._world
        for joint, value in zip(world.arm, q, strict=True):
            world.call("resetJointState", world.robot, joint, float(value))
        for finger in world.fingers:
            world.call("resetJointState", world.robot, finger, self._hand.spec.geometry.open_joint)
        self._arm.command(np.asarray(q, dtype=float))
        self._hand.set_gripper(0.0)


class _PandaArm(BareArm):
    """The arm: position servos, and encoders."""

    def __init__(self, cell: PyBulletDriver, spec: RobotSpec, kinematics: Kinematics, hand: _PandaHand) -> None:
        super().__init__(cell, spec)
        self._cell, self._world = cell, cell.world
        self._kinematics = kinematics
        self._hand = hand
        self._trim = np.zeros(spec.n)

    def state(self) -> ArmState:
        """Return what the encoders read."""
        arm = self._world.joint_states(self._world.arm)
        q = frozen_array(arm[:, 0])
        return ArmState(
            time=self._cell.time,
            q=q,
            qd=frozen_array(arm[:, 1]),
            tcp_pose=Pose.from_matrix(*self._kinematics.forward(q)),
            gripper=self._hand.state(),
        )

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory, commands interpolated to the control ticks."""
        tick = self._cell.control_timestep
        ticks = max(1, int(np.ceil(trajectory.duration / tick - 1e-9)))
        times = np.minimum(np.arange(ticks + 1) * tick, trajectory.duration)
        rows = np.arange(len(trajectory.q)) * trajectory.dt
        q = np.column_stack([np.interp(times, rows, column) for column in trajectory.q.T])
        velocity = np.diff(q, axis=0) / tick
        try:
            for row, rate in zip(q[1:], velocity, strict=True):
                self.command(row + self._trim, rate)
                self._cell.tick(guards)
            self.command(q[-1] + self._trim)
        except BaseException:
            self.stop()
            raise

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,)."""
        off = goal - self.state().q
        step = _TRIM_RATE * self._cell.control_timestep * off
        self._trim = np.clip(self._trim + step, -_LARGEST_TRIM, _LARGEST_TRIM)
        self.command(goal + self._trim)
        self._cell.tick(guards)

    def stop(self) -> None:
        """Command the arm to stay where it is."""
        self.command(np.clip(self.state().q, self.spec.lower, self.spec.upper))

    def servo_force(self, joint: int) -> tuple[float, float]:
        """Return what an arm joint's servo gives now and the most that it can, N m."""
        return abs(float(self._world.joint_states(self._world.arm)[joint, 2])), _TORQUES[joint]

    def command(self, q: Array, velocity: Array | None = None) -> None:
        """Send the servos to `q` (n,), on the way at `velocity` (n,)."""
        self._world.call(
            "setJointMotorControlArray",
            self._world.robot,
            self._world.arm,
            pybullet.POSITION_CONTROL,
            targetPositions=q.tolist(),
            targetVelocities=(np.zeros(len(q)) if velocity is None else velocity).tolist(),
            forces=list(_TORQUES),
            positionGains=[_SERVO_GAIN] * len(q),
            velocityGains=[1.0] * len(q),
        )


class _PandaHand(BareHand):
    """The gripper, without a sense of force."""

    def __init__(self, cell: PyBulletDriver, spec: GripperSpec) -> None:
        super().__init__(cell, spec)
        self._world = cell.world
        self._closed = 0.0

    def state(self) -> GripperState:
        """Return what its encoders read."""
        geometry = self.spec.geometry
        joint = float(self._world.joint_states(self._world.fingers)[:, 0].mean())
        return GripperState(
            joint=joint,
            width=max(0.0, geometry.aperture(joint)),
            closed=geometry.closed_fraction(joint),
            force=None,
            commanded=self._closed,
        )

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed. Returns at once.

        Raises:
            ValueError: `closed` is outside 0..1.
        """
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; a gripper takes 0 (open) to 1 (closed)")
        self._closed = closed
        geometry = self.spec.geometry
        goal = geometry.open_joint + closed * (geometry.closed_joint - geometry.open_joint)
        for finger in self._world.fingers:
            self._world.call(
                "setJointMotorControl2",
                self._world.robot,
                finger,
                pybullet.POSITION_CONTROL,
                targetPosition=goal,
                force=_FINGER_FORCE if force is None else min(_FINGER_FORCE, force / len(self._world.fingers)),
                maxVelocity=_FINGER_SPEED,
            )


class _PandaSenses(BareSenses):
    """Cameras, and a force sensor between flange and hand."""

    def __init__(self, cell: PyBulletDriver) -> None:
        super().__init__(cell)
        self._cell = cell

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return a camera's frame.

        Raises:
            InputError: No such camera.
        """
        del window
        return self._cell.frame(camera)

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return what the hand presses and pulls with, N in the world, shape (3,); it cannot tell of which object."""
        del object_id, arm
        return self._cell.wrench()
