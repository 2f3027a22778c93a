"""A driver of any robot of LeRobot's: commands and readings at every tick, by the robot's own calibration."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import draccus
import numpy as np
import yaml
from lerobot.robots import Robot, RobotConfig, make_robot_from_config
from lerobot.utils.import_utils import register_third_party_plugins

from robosandbox.driver import (
    ARM,
    BareArm,
    BareHand,
    Capabilities,
    Guard,
    IntegralAction,
    WallClockDriver,
    open_eyes,
    per_tick,
    refusal,
)
from robosandbox.errors import FaultError, InputError, Phase
from robosandbox.motion.fixed_surroundings import meetings
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.robots.kinematics import Kinematics
from robosandbox.types import (
    ArmState,
    Array,
    GripperState,
    ObservedScene,
    Pose,
    Posture,
    Scene,
    Trajectory,
    frozen_array,
)
from robosandbox.types.robot import GripperSpec, RobotSpec
from robosandbox_lerobot.channels import POSITION, Channel, Units, channels
from robosandbox_lerobot.senses import RobotSenses, read_places

_log = logging.getLogger(__name__)
# Seconds over which a speed is taken.
_SPEED_SECONDS = 0.1
# Seconds in which an arm that was switched on comes to lie in its servos.
_SETTLE_SECONDS = 0.5


class LeRobot(WallClockDriver):
    """An arm, and its gripper, that a robot class of LeRobot's moves.

    Args:
        scene: The robot's model, and the table that it stands at.
        robot: File of the robot's configuration as LeRobot writes it, YAML or JSON, with its `type`.
        rate: Commands a second.
        units: Of joints, where the robot is no chain of serial servos with a calibration: degrees or radians from the model's
            zero, or normalized, -100 to 100 over the joint's limits. A gripper is 0 where closed, 100 where open.
        prefix: Before the names of this arm's joints, as `left_`; all others are held where they are.
        speed: Share of the speed of every trajectory that the arm follows it with, above 0 to 1.
        link_timeout: Seconds without an answer after which the arm is lost.
        release: Whether the torque goes off at the end, and the arm falls; to be said for a robot that knows no other end.
        cameras: `module:function` that is called with this driver and returns its senses, with `cameras`.
        places: File that says where the robot's own cameras stand and what their lenses are, see `senses.py`.

    Raises:
        InputError: The configuration, the robot or its calibration is not as it is to be. Nothing moves.
    """

    episode: Final = 0

    def __init__(
        self,
        scene: Scene,
        *,
        robot: Path,
        rate: float = 50.0,
        units: Units | None = None,
        prefix: str = "",
        speed: float = 1.0,
        link_timeout: float = 0.2,
        release: bool = False,
        cameras: str | None = None,
        places: Path | None = None,
    ) -> None:
        if not 0.0 < speed <= 1.0:
            raise InputError(f"speed is {speed:g}; give a share above 0, to 1")
        if not rate > 0.0:
            raise InputError(f"rate is {rate:g}; give commands a second, LeRobot's arms take 30 to 60")
        super().__init__(1.0 / rate)
        nothing = ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
        planning = PlanningScenes(scene).of(nothing)
        spec, gripper = planning.robot.spec, planning.robot.gripper
        self._gripper, self._link_timeout, self.speed = gripper, link_timeout, speed
        self._file, self._config = robot, _configuration(robot, release=release)
        self.robot = _made(self._config, robot)
        ends = None if gripper is None else (gripper.geometry.open_joint, gripper.geometry.closed_joint)
        limits = [*zip(spec.lower.tolist(), spec.upper.tolist(), strict=True)]
        self._channels = channels(self.robot, spec.joints, limits, ends, units, prefix)
        self._sent: dict[str, float] = {}
        self.observed: Mapping[str, Any] = {}
        self.heard, self._last_error = 0.0, ""
        hand = None if spec.gripper is None else _LeRobotHand(self, spec.gripper, self._channels[-1])
        self._hand = hand
        self.hands = {} if hand is None else {hand.name: hand}
        self._arm = _LeRobotArm(self, spec, self._channels[: spec.n], planning.kinematics(), hand)
        self._arm.meets = meetings(planning, None if hand is None else hand.last_joint)
        self.arms = {ARM: self._arm}
        self._eyes: RobotSenses | None = None
        self._connect()
        try:
            self._hold()
            if self.fault:
                raise InputError(f"--driver lerobot: {self.fault}")
            if cameras is not None:
                eyes = open_eyes(cameras, self)
                self.senses, self._cameras = eyes, eyes.cameras
            else:
                self.senses = own = RobotSenses(self, {} if places is None else read_places(places))
                self._cameras = own.cameras
        except BaseException:
            self._disconnect()
            raise

    @property
    def capabilities(self) -> Capabilities:
        """Encoders, and cameras where it is known where they stand."""
        return Capabilities(cameras=self._cameras, clock="wall", link_timeout=self._link_timeout)

    def close(self) -> None:
        """Let go of the robot; it holds where it is, unless it is to be released."""
        self._loop.close()
        self._disconnect()

    def recover(self) -> None:
        """Hear of the robot again, connect anew where nothing is heard, and end a fault.

        Raises:
            FaultError: It is not over.
        """
        self.fault = ""
        self._arm.forget()
        if self._hand is not None:
            self._hand.forget()
        if not self._read():
            try:
                self._disconnect()
                # What an error has left in the one before, as a port that is marked as in use, nobody clears.
                self.robot = _made(self._config, self._file)
                self._connect()
            except InputError as error:
                self.fault = str(error)
        if not self.fault:
            self._hold()
        if self.fault:
            raise FaultError(f"{self.fault}; it is not over", phase=Phase.CHECK)

    # Between the parts of this driver and the robot.

    def reading(self, channel: Channel) -> float:
        """Return the joint value that was read last."""
        return channel.value(float(self.observed[channel.key]))

    def refresh(self) -> None:
        """Read the robot where what was read last is older than a tick."""
        if not self.fault and self.time - self.heard > self.control_timestep:
            self.look()

    def goal(self, channel: Channel) -> float:
        """Return the joint value that was sent last."""
        return channel.value(self._sent[channel.key])

    def send(self, joints: Sequence[Channel], values: Array) -> None:
        """Send joints to values, all others to where they were sent last."""
        numbers = {joint.key: joint.number(float(value)) for joint, value in zip(joints, values, strict=True)}
        try:
            done = self.robot.send_action(self._sent | numbers)
        except Exception as error:
            self.fail(f"{self.robot.name} does not take commands: {_line(error)}; it holds where it was sent last")
        else:
            # A robot may keep a command from going too far, and says what it made of it.
            self._sent |= {key: float(done[key]) for key in self._sent if key in done}

    def look(self) -> None:
        """Take in what the robot tells."""
        if not self._read() and (silent := self.time - self.heard) > self._link_timeout:
            self.fail(f"{self.robot.name} has told nothing for {silent:.2f} s: {self._last_error}")
        self._arm.note()

    def posture(self) -> dict[str, Posture]:
        """Return how the arm stands, as a frame of a camera tells it."""
        gripper, hand = self._gripper, self._hand
        values = gripper.joints_at(hand.state().joint) if gripper and hand else np.zeros(0)
        return {ARM: Posture(q=self._arm.measured_q(), gripper_q=frozen_array(values))}

    def _read(self) -> bool:
        """Read the robot once; return whether it told all."""
        asked = self.time
        try:
            observed = self.robot.get_observation()
        except Exception as error:
            self._last_error = _line(error)
            return False
        if not all(np.isfinite(observed.get(channel.key, np.nan)) for channel in self._channels):
            self._last_error = "not all joints are numbers"
            return False
        # It may be as old as the request, where this computer was away meanwhile.
        self.observed, self.heard = observed, asked
        return True

    def _connect(self) -> None:
        """Open the robot; raises InputError."""
        try:
            # Not asked on the terminal: see below.
            self.robot.connect(calibrate=False)
        except Exception as error:
            self._disconnect()
            raise InputError(f"--driver lerobot: {self.robot.name}: {_line(error)}") from None
        if not self.robot.is_calibrated:
            self._disconnect()
            raise InputError(
                f"--driver lerobot: {self.robot.name}: the calibration in {self.robot.calibration_fpath} is not that of its servos: "
                "run lerobot-calibrate"
            )

    def _disconnect(self) -> None:
        """Close the robot."""
        try:
            if self.robot.is_connected:
                self.robot.disconnect()
        except Exception as error:
            _log.warning("%s: %s", self.robot.name, error)

    def _hold(self) -> None:
        """Have it hold where it is, and see how far its servos give way."""
        if not self._read():
            self.fail(f"{self.robot.name} tells nothing: {self._last_error}")
            return
        # What is no position is a speed, as of a base.
        self._sent = {
            key: float(self.observed[key]) if key.endswith(POSITION) else 0.0 for key in self.robot.action_features
        }
        self.send(self._channels, np.array([self.reading(channel) for channel in self._channels]))
        end = self.time + _SETTLE_SECONDS
        while self.time < end and not self.fault:
            time.sleep(self.control_timestep)
            self.look()
        if not self.fault:
            self._arm.settle()


def _configuration(file: Path, *, release: bool) -> RobotConfig:
    """Return the configuration in a file, so that its robot holds at the end unless it is to be released; raises InputError."""
    register_third_party_plugins()
    try:
        config: RobotConfig = draccus.decode(RobotConfig, yaml.safe_load(file.read_text(encoding="utf-8")))
    except OSError as error:
        raise InputError(f"robot: {file}: {error.strerror}") from None
    except (draccus.utils.DecodingError, yaml.YAMLError, ValueError, TypeError, AttributeError) as error:
        raise InputError(
            f"robot: {file}: {_line(error)}; it is to be a configuration of LeRobot's, with its `type`"
        ) from None
    # That of two arms has a configuration of each.
    holding = [each for each in (config, *vars(config).values()) if hasattr(each, "disable_torque_on_disconnect")]
    for each in holding:
        each.disable_torque_on_disconnect = release
    if not holding and not release:
        raise InputError(
            f"{file}: {config.type} may let go of the arm when it is disconnected, and has no option against it: hold the arm at "
            "the end, and say release=true"
        )
    return config


def _made(config: RobotConfig, file: Path) -> Robot:
    """Return the robot of a configuration, not connected; raises InputError."""
    try:
        return make_robot_from_config(config)
    except Exception as error:
        raise InputError(f"robot: {file}: {_line(error)}") from None


def _line(error: Exception) -> str:
    """Return an error's words in one line."""
    return " ".join(str(error).split())


class _LeRobotArm(BareArm):
    """The arm as the robot tells of it."""

    def __init__(
        self,
        cell: LeRobot,
        spec: RobotSpec,
        joints: Sequence[Channel],
        kinematics: Kinematics,
        hand: _LeRobotHand | None,
    ) -> None:
        super().__init__(cell, spec)
        self._cell, self._joints, self._kinematics, self._hand = cell, joints, kinematics, hand
        self._integral = IntegralAction(spec.n, cell.control_timestep)
        self._past: deque[tuple[float, Array]] = deque()

    def state(self) -> ArmState:
        """Return what the robot told last, and of which time that is."""
        q = self.measured_q()
        return ArmState(
            time=self._cell.heard,
            q=q,
            qd=frozen_array(self._speeds()),
            tcp_pose=Pose.from_matrix(*self._kinematics.forward(q)),
            gripper=None if self._hand is None else self._hand.state(),
        )

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Follow a trajectory, commands interpolated to the control ticks."""
        cell = self._cell
        slowed = replace(trajectory, dt=trajectory.dt / cell.speed)
        try:
            for row in per_tick(slowed, cell.control_timestep):
                cell.send(self._joints, row + self._integral.shift)
                cell.tick(guards)
        except BaseException:
            self.stop()
            raise

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,)."""
        self._integral.take_up(goal - self.measured_q())
        self._cell.send(self._joints, goal + self._integral.shift)
        self._cell.tick(guards)

    def stop(self) -> None:
        """Command the arm to stay where it is told to be, held against what its servos give way to."""
        self._cell.send(self._joints, self.measured_q() + self._integral.shift)

    def settle(self) -> None:
        """Take note of what the servos give way to while they hold."""
        goals = np.array([self._cell.goal(joint) for joint in self._joints])
        self._integral.begin_at(goals - self.measured_q())

    def forget(self) -> None:
        """Begin anew, after a fault."""
        self._past.clear()
        self._integral.begin_at(np.zeros(self.spec.n))

    def measured_q(self) -> Array:
        """Return what the robot told, shape (n,)."""
        self._cell.refresh()
        return frozen_array(np.array([self._cell.reading(joint) for joint in self._joints]))

    def note(self) -> None:
        """Remember how it stands, for speeds."""
        if self._cell.observed and (not self._past or self._cell.heard > self._past[-1][0]):
            numbers = self._cell.observed
            self._past.append(
                (self._cell.heard, np.array([joint.value(float(numbers[joint.key])) for joint in self._joints]))
            )
        while len(self._past) > 2 and self._past[-1][0] - self._past[0][0] > _SPEED_SECONDS:
            self._past.popleft()

    def _speeds(self) -> Array:
        """Return speeds from positions, rad/s, shape (n,)."""
        if len(self._past) < 2:
            return np.zeros(self.spec.n)
        (began, first), (ended, last) = self._past[0], self._past[-1]
        speeds: Array = (last - first) / (ended - began)
        return speeds


class _LeRobotHand(BareHand):
    """The gripper as the robot tells of it."""

    def __init__(self, cell: LeRobot, spec: GripperSpec, joint: Channel) -> None:
        super().__init__(cell, spec)
        self._cell, self._joint = cell, joint
        self._closed: float | None = None

    def state(self) -> GripperState:
        """Return what the robot told last; what is held keeps it from where it was sent."""
        self._cell.refresh()
        geometry = self.spec.geometry
        joint = self._cell.reading(self._joint)
        closed = geometry.closed_fraction(joint)
        return GripperState(
            joint=joint,
            width=max(0.0, geometry.aperture(joint)),
            closed=closed,
            force=None,
            commanded=min(max(closed, 0.0), 1.0) if self._closed is None else self._closed,
        )

    def last_joint(self) -> float:
        """Return what the robot told last, as a joint value."""
        return self._cell.reading(self._joint)

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed. Returns at once.

        Raises:
            ValueError: `closed` is outside 0..1.
            UnsupportedError: A force is given: the robot's configuration says how hard it closes.
        """
        if force is not None:
            raise refusal(self._cell, "grip_limit", f"a grip of {force:g} N was asked for")
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; a gripper takes 0 (open) to 1 (closed)")
        self._closed = closed
        geometry = self.spec.geometry
        goal = geometry.open_joint + closed * (geometry.closed_joint - geometry.open_joint)
        self._cell.send([self._joint], np.array([goal]))

    def forget(self) -> None:
        """Go by what it is told to be: what it held it may have let go of."""
        self._closed = None
