"""A driver of any arm that ROS 2 moves with FollowJointTrajectory: whole trajectories sent, watched at every tick."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from typing import Final

import numpy as np

from robosandbox.driver import (
    ARM,
    BareArm,
    BareHand,
    Capabilities,
    Guard,
    IntegralAction,
    WallClockDriver,
    braking_rows,
    refusal,
)
from robosandbox.errors import FaultError, InputError, Phase
from robosandbox.motion.fixed_surroundings import meetings
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.loader import robots_of
from robosandbox.robots.sidecar import GripperRoles
from robosandbox.sim.populated import populated
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

try:
    from robosandbox.drivers.ros2.link import RosLink, Sent
    from robosandbox.drivers.ros2.senses import RosSenses
    from robosandbox.drivers.ros2.splines import seconds_to, stretch
except ImportError as error:
    if error.name is None or error.name.startswith("robosandbox."):
        raise
    raise InputError(
        f"--driver ros2: Python cannot import {error.name!r}: source your ROS 2 (`source /opt/ros/jazzy/setup.bash`) in this "
        "shell, with a Python that it was built for, and have its package ros-jazzy-control-msgs; docs/ros2.md"
    ) from None

# Seconds over which a speed is taken where the joint states tell none.
_SPEED_SECONDS = 0.1
# Number of goals whose ways to the controller tell how long that of the next may take.
_WAYS = 20
# Rows on the way to a single one, by which it is seen whether the arm gets on.
_WAY_ROWS = 100


class Ros2(WallClockDriver):
    """An arm, and its gripper, behind controllers of ros2_control or others that serve the same actions.

    Args:
        scene: The robot, and the table that it stands at.
        controller: Its action is `<controller>/follow_joint_trajectory`.
        gripper: The gripper's action, GripperCommand or ParallelGripperCommand, which is found out; None where a robot with
            fingers is not to move them.
        joint_states: The topic on which all joints are told of.
        prefix: Before the names of the robot's joints, as "left_".
        gripper_joint: The gripper's joint in the joint states; the sidecar's primary joint, with the prefix, if left out.
        gripper_open: Its position where the sidecar's is open, rad or m; the same if left out.
        gripper_closed: Likewise closed.
        grip: Effort that the gripper is told to close with at most, N or N m; its controller's own if left out.
        grip_limit: Whether its controller keeps to an effort that it is told, so that skills may say one.
        wrench: Topic of what the hand gives to the rest of the world, weight of the hand taken out; None without such a sensor.
        cameras: Names joined by "+", each before `/image_raw`, `/depth/image_raw` (as seen by the same lens), `/camera_info`.
        world: The frame of tf that is this package's world: x forward from the robot's base, z up, the table at its height.
        tick: Seconds between two looks at guards and limits.
        link_timeout: Seconds without joint states after which the arm is lost; a wrench and a transform that moves may be as old.
        stamped: Whether messages are stamped by a clock that agrees with this computer's; else they count as new.
        answer: Seconds in which a controller has to answer, and a camera to deliver.
        discovery: Seconds in which everything has to be found when it is opened.

    Raises:
        InputError: Something is not there; it says what, and what is. Nothing moves.
    """

    episode: Final = 0

    def __init__(
        self,
        scene: Scene,
        *,
        controller: str = "/joint_trajectory_controller",
        gripper: str | None = None,
        joint_states: str = "/joint_states",
        prefix: str = "",
        gripper_joint: str | None = None,
        gripper_open: float | None = None,
        gripper_closed: float | None = None,
        grip: float | None = None,
        grip_limit: bool = False,
        wrench: str | None = None,
        cameras: str = "",
        world: str = "world",
        tick: float = 0.01,
        link_timeout: float = 0.1,
        stamped: bool = True,
        answer: float = 1.0,
        discovery: float = 10.0,
    ) -> None:
        super().__init__(tick)
        nothing = ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
        planning = PlanningScenes(scene).of(nothing)
        spec = planning.robot.spec
        self.answer = answer
        self._planned_gripper = planning.robot.gripper
        self._link_timeout, self._joints = link_timeout, [prefix + joint for joint in spec.joints]
        self._wrench = wrench
        topics = [topic for topic in cameras.split("+") if topic]
        hand = None
        if spec.gripper is not None:
            joint = gripper_joint or prefix + _primary_joint(scene)
            ends = gripper_open, gripper_closed
            hand = _RosHand(self, spec.gripper, joint, ends, grip, grip_limit, moves=gripper is not None)
        self.hands = {} if hand is None else {hand.name: hand}
        self.link = RosLink(
            "robosandbox_driver",
            joint_states=joint_states,
            controller=controller,
            gripper=gripper,
            wrench=wrench,
            stamped=stamped,
            oldest=link_timeout,
            world=world,
            cameras=topics,
        )
        self._hand = hand
        self._arm = _RosArm(self, spec, self._joints, planning.kinematics(), hand)
        self._arm.meets = meetings(planning)
        self.arms = {ARM: self._arm}
        senses = RosSenses(self, self.link, topics, self.posture, answer, link_timeout, self._began)
        self.senses = senses
        try:
            told = [*self._joints, *([] if hand is None else [hand.joint])]
            if missing := self.link.missing(told, link_timeout, discovery):
                raise InputError(f"--driver ros2: {missing} ({discovery:g} s after it was opened)")
            self._cameras = senses.built_in(self._arm.state().tcp_pose)
        except BaseException:
            self.link.close()
            raise

    @property
    def capabilities(self) -> Capabilities:
        """Encoders, and what else was named."""
        return Capabilities(
            grip_limit=self._hand is not None and self._hand.takes_force,
            wrist_wrench=self._wrench is not None,
            cameras=self._cameras,
            clock="wall",
            link_timeout=self._link_timeout,
        )

    def close(self) -> None:
        """End what it had sent, and leave the graph; the controller holds."""
        self._loop.close()
        if self._arm.moves:
            self._arm.stop()
            time.sleep(self.control_timestep)
        self.link.close()

    def recover(self) -> None:
        """Look for controllers and joint states again, and end a fault.

        Raises:
            FaultError: Something is not there.
        """
        self.fault = ""
        self.link.revive()
        if missing := self.link.missing(self._joints, self._link_timeout, self.answer):
            self.fault = missing
            raise FaultError(f"{missing}; it is not over", phase=Phase.CHECK)
        end = time.monotonic() + self.answer
        while self.link.is_cancelling and time.monotonic() < end:
            time.sleep(self.control_timestep)
        self.link.forget_cancels()
        self._arm.forget()
        # Where joint states tell no speeds, two of them tell whether it stands.
        self.look()
        time.sleep(_SPEED_SECONDS)
        self.look()

    # Between the parts of this driver and the graph.

    def tick(self, guards: Sequence[Guard]) -> None:
        """Let one control tick pass, and ask the guards."""
        super().tick(guards)
        if self.fault:
            # `SafeDriver` has raised it already.
            raise FaultError(self.fault, phase=Phase.CHECK)

    def look(self) -> None:
        """See what has become of what was sent."""
        if self.link.ended:
            self.fail(self.link.ended)
        self._arm.look()

    def posture(self) -> dict[str, Posture]:
        """Return how the arm stands, as a frame of a camera tells it."""
        gripper, hand = self._planned_gripper, self._hand
        values = gripper.joints_at(hand.state().joint) if gripper and hand else np.zeros(0)
        return {ARM: Posture(q=self._arm.state().q, gripper_q=frozen_array(values))}


def _primary_joint(scene: Scene) -> str:
    """Return the joint of the gripper whose value its sidecar's open and closed are.

    Raises:
        InputError: It is a suction cup, which no gripper action moves.
    """
    (robot,) = robots_of(populated(scene)).values()
    roles = robot.sidecar.gripper
    if not isinstance(roles, GripperRoles):
        raise InputError("--driver ros2: a suction cup is moved by no gripper action of control_msgs")
    # That of a gripper that was mounted has the gripper's name before it.
    return roles.primary_joint.rpartition("/")[2]


class _RosArm(BareArm):
    """The arm as its joint states and its controller's answers tell of it."""

    def __init__(
        self, cell: Ros2, spec: RobotSpec, joints: Sequence[str], kinematics: Kinematics, hand: _RosHand | None
    ) -> None:
        super().__init__(cell, spec)
        self._cell, self._joints, self._kinematics, self._hand = cell, joints, kinematics, hand
        # What the controller was sent last; None where it holds of itself.
        self._sent: Sent | None = None
        self._integral = IntegralAction(spec.n, cell.control_timestep)
        self._past: deque[tuple[float, Array]] = deque()
        # The rows that were sent last, and how long the controller took to answer goals, seconds.
        self._rows: Array = np.empty((0, spec.n))
        self._ways: deque[float] = deque(maxlen=_WAYS)

    @property
    def moves(self) -> bool:
        """True while the controller works on something that was sent from here."""
        return self._sent is not None and self._sent.outcome is None

    def state(self) -> ArmState:
        """Return what the joint states told last, and of which time that is."""
        told = self._cell.link.readings(self._joints)
        q = np.array([one.position for one in told])
        return ArmState(
            time=self._cell.since(min(one.time for one in told)),
            q=frozen_array(q),
            qd=frozen_array(
                np.array([one.velocity for one in told], dtype=float)
                if all(one.velocity is not None for one in told)
                else self._speeds()
            ),
            tcp_pose=Pose.from_matrix(*self._kinematics.forward(q)),
            gripper=None if self._hand is None else self._hand.state(),
        )

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Have the controller follow a trajectory as one goal, and return when it says that it has.

        One that goes on is sent with a braking behind it, which the next one replaces: an arm whose host is gone stands.

        Raises:
            FaultError: The controller did not take it, gave it up, or does not answer; it says why.
        """
        q, dt = trajectory.q + self._integral.shift, trajectory.dt
        # A server that answers in several threads may otherwise take up the one before after this one.
        self._wait_for_answer(guards)
        # Within what is allowed it may begin beside where the arm is, which then goes there no faster than it may.
        if len(q) < 2:
            there, way = self._seconds_to(q[0]), np.linspace(self.state().q, q[0], _WAY_ROWS)
            self._send(q, None, np.array([there]))
            self._watch(there, way, guards)
            return
        braking = (
            braking_rows(self.spec, q[-1], (q[-1] - q[-2]) / dt, dt)
            if trajectory.goes_on
            else np.empty((0, self.spec.n))
        )
        rows = np.concatenate([q, braking])
        velocities = np.gradient(rows, dt, axis=0)
        velocities[-1] = 0.0
        # Rows that keep to a speed may lie on cubics that do not.
        longer = stretch(rows, velocities, dt, self.spec.velocity_limits)
        velocities, dt = velocities / longer, dt * longer
        late = self._seconds_to(rows[1], velocities[1], dt) > dt
        begin, lead = (0, self._seconds_to(rows[0], velocities[0], dt)) if late else (1, 0.0)
        self._send(rows[begin:], velocities[begin:], lead + dt * np.arange(float(begin), len(rows)))
        self._watch(lead + longer * trajectory.duration, rows, guards, to_its_end=not trajectory.goes_on)

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,).

        A goal of one row is sent when the controller has answered the one before.
        """
        self._integral.take_up(goal - self.state().q)
        if not self._cell.link.is_cancelling and (self._sent is None or self._sent.accepted is not None):
            row = goal + self._integral.shift
            self._send(row[None], None, np.array([self._seconds_to(row)]))
        try:
            self._cell.tick(guards)
        except BaseException:
            self.stop()
            raise

    def stop(self) -> None:
        """End every trajectory of the controller, whoever sent it; it holds the arm where it is then."""
        sent = self._sent
        if sent is not None:
            # Its end is wanted, and no fault.
            sent.replaced = True
            sent.cancel()
        self._cell.link.cancel_all()

    def forget(self) -> None:
        """Begin anew, after a fault."""
        self._sent = None
        self._past.clear()
        self._integral.begin_at(np.zeros(self.spec.n))

    def look(self) -> None:
        """See what has become of what was sent, after a tick."""
        told = self._cell.link.readings(self._joints)
        self._past.append((min(one.time for one in told), np.array([one.position for one in told])))
        while self._past[-1][0] - self._past[0][0] > _SPEED_SECONDS:
            self._past.popleft()
        sent = self._sent
        if sent is None or sent.replaced or sent.outcome in (None, "succeeded"):
            return
        said = f" ({sent.said})" if sent.said else ""
        if sent.outcome == "rejected":
            self._cell.fail(
                "the controller did not take the trajectory: look whether it is active, and whether it is in error"
            )
        elif sent.outcome == "cancelled":
            self._cell.fail(f"somebody else has cancelled the trajectory{said}")
        else:
            self._cell.fail(
                f"the controller gave the trajectory up{said}: an error of its own, a tolerance, or a goal that another client sent"
            )
        sent.replaced = True

    def _send(self, rows: Array, velocities: Array | None, seconds: Array) -> None:
        if self._sent is not None:
            self._sent.replaced = True
            if self._sent.took is not None:
                self._ways.append(self._sent.took)
        self._rows = rows
        self._sent = self._cell.link.follow(self._joints, rows, velocities, seconds)

    def _seconds_to(self, q: Array, speeds: Array | None = None, least: float = np.inf) -> float:
        """Return in how many seconds a controller takes the arm somewhere within its limits of speed, a tick at the least.

        It begins where the arm is when the goal comes, and with its speed. Until then the arm goes on to where it was sent last: all
        of the way where that is one row, which is near, else as far as it gets until a goal comes as late as the slowest of those before,
        and a tick.

        Args:
            q: Where to, shape (n,).
            speeds: There, shape (n,); None where the controller is told none.
            least: The shortest time of use where that is shorter than a tick, seconds.
        """
        cell, now = self._cell, self.state()
        late = max(0.0, cell.time - now.time) + cell.control_timestep + max(self._ways, default=0.0)
        places, most = [now.q, now.q + late * now.qd], late * self.spec.velocity_limits
        if self.moves:
            ahead = self._rows[-1] - now.q
            places.append(now.q + (ahead if len(self._rows) == 1 else np.clip(ahead, -most, most)))
        steps = q - np.array(places)
        return seconds_to(steps, now.qd, speeds, self.spec.velocity_limits, min(least, cell.control_timestep))

    def _wait_for_answer(self, guards: Sequence[Guard]) -> None:
        """Let ticks pass until the controller has answered what was sent last, cancels as well."""
        cell, sent, asked = self._cell, self._sent, self._cell.time
        try:
            while cell.link.is_cancelling or (sent is not None and sent.accepted is None):
                if cell.time - asked > cell.answer:
                    cell.fail(f"the controller has not answered for {cell.answer:g} s")
                cell.tick(guards)
        except BaseException:
            self.stop()
            raise

    def _watch(self, seconds: float, way: Array, guards: Sequence[Guard], *, to_its_end: bool = True) -> None:
        """Let ticks pass until what was sent is over, or for as long as it takes.

        A controller may take longer than was asked for, as one does that scales speeds down, as long as it gets on: by its feedback, or
        where that tells of no progress by the joints, which after the time that was asked for have to get on.

        Args:
            seconds: How long it takes as it was asked for.
            way: Rows that the arm passes, shape (t, n).
            guards: As in `follow`.
            to_its_end: Whether the controller has to say that it has arrived.
        """
        cell, sent = self._cell, self._sent
        assert sent is not None
        self._wait_for_answer(guards)
        try:
            end = advanced = cell.time + seconds
            row = 0
            while sent.outcome is None and (to_its_end or cell.time < end):
                if sent.advanced is not None:
                    advanced = cell.since(sent.advanced)
                elif (passed := _passed(way, row, self.state().q)) > row:
                    row, advanced = passed, max(end, cell.time)
                if to_its_end and cell.time - advanced > cell.answer:
                    cell.fail(
                        f"the controller does not get on, and does not say that it has arrived: nothing has changed for "
                        f"{cell.answer:g} s"
                    )
                cell.tick(guards)
            # What it ended in may have come between two ticks.
            self.look()
            if cell.fault:
                raise FaultError(cell.fault, phase=Phase.CHECK)
        except BaseException:
            self.stop()
            raise

    def _speeds(self) -> Array:
        """Return speeds from positions, rad/s, shape (n,)."""
        if len(self._past) < 2:
            return np.zeros(self.spec.n)
        (began, first), (ended, last) = self._past[0], self._past[-1]
        speeds: Array = (last - first) / (ended - began) if ended > began else np.zeros(self.spec.n)
        return speeds


def _passed(way: Array, row: int, q: Array) -> int:
    """Return the row of a way that is nearest to a configuration (n,), going on from a row as long as they come nearer."""
    off = np.abs(way[row:] - q).max(axis=1)
    farther = np.flatnonzero(np.diff(off) > 0.0)
    return row + (int(farther[0]) if len(farther) else len(off) - 1)


class _RosHand(BareHand):
    """The gripper as the joint states tell of it.

    Args:
        cell: The driver.
        spec: Specification.
        joint: Its joint in the joint states.
        ends: Where that is open and closed, None where as in the specification.
        effort: To close with at most; None for its controller's own.
        takes_force: Whether its controller keeps to an effort.
        moves: Whether an action moves it.

    Attributes:
        joint: Its joint in the joint states.
        takes_force: Whether `set_gripper` takes a force.
    """

    def __init__(
        self,
        cell: Ros2,
        spec: GripperSpec,
        joint: str,
        ends: tuple[float | None, float | None],
        effort: float | None,
        takes_force: bool,
        *,
        moves: bool,
    ) -> None:
        super().__init__(cell, spec)
        self._cell, self.joint, self.takes_force = cell, joint, takes_force
        given = zip(ends, (spec.geometry.open_joint, spec.geometry.closed_joint), strict=True)
        self._open, self._shut = (own if end is None else end for end, own in given)
        self._effort, self._moves = effort, moves
        self._closed: float | None = None
        self._last: Sent | None = None

    def state(self) -> GripperState:
        """Return what the joint states told last; what is held keeps it from where it was sent."""
        geometry = self.spec.geometry
        (told,) = self._cell.link.readings([self.joint])
        closed = (told.position - self._open) / (self._shut - self._open)
        joint = geometry.open_joint + closed * (geometry.closed_joint - geometry.open_joint)
        return GripperState(
            joint=joint,
            width=max(0.0, geometry.aperture(joint)),
            closed=closed,
            force=None,
            commanded=min(max(closed, 0.0), 1.0) if self._closed is None else self._closed,
        )

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the gripper: 0 is the sidecar's open, 1 its closed. Returns at once.

        Raises:
            ValueError: `closed` is outside 0..1.
            UnsupportedError: A force is given, and its controller keeps to none.
            FaultError: No action moves it, or its controller did not take what was sent last.
        """
        if force is not None and not self.takes_force:
            raise refusal(self._cell, "grip_limit", f"a grip of {force:g} N was asked for")
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; a gripper takes 0 (open) to 1 (closed)")
        if not self._moves:
            raise FaultError(
                "the gripper's action was not named; open the driver with gripper=/gripper_controller/gripper_cmd",
                phase=Phase.CHECK,
            )
        if self._last is not None and self._last.outcome == "rejected":
            self._last = None
            raise FaultError(
                "the gripper's controller did not take the last command: look whether it is active", phase=Phase.CHECK
            )
        self._closed = closed
        position = self._open + closed * (self._shut - self._open)
        # One that ends before it is closed, because of what it holds, has done what it was told.
        self._last = self._cell.link.grip(self.joint, position, self._effort if force is None else force)
