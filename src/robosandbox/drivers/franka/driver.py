"""A driver of a Franka arm and its hand: motions of the controller's own, watched at every tick."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Final, Literal

import numpy as np

from robosandbox.driver import (
    ARM,
    TOLERANCES,
    BareArm,
    BareHand,
    BareSenses,
    CameraSpec,
    Capabilities,
    Eyes,
    Guard,
    IntegralAction,
    WallClockDriver,
    braking_rows,
    open_eyes,
    refusal,
)
from robosandbox.errors import FaultError, InputError, LimitError, Phase
from robosandbox.evidence import LimitEvidence
from robosandbox.extras import missing_extra
from robosandbox.motion.fixed_surroundings import meetings
from robosandbox.motion.planning_scene import PlanningScenes
from robosandbox.robots.kinematics import Kinematics
from robosandbox.robots.loader import robots_of
from robosandbox.sim.populated import populated
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
    force_limits,
    frozen_array,
)
from robosandbox.types.robot import GripperSpec, RobotSpec

try:
    from robosandbox.drivers.franka.link import FrankaLink, InModeError, LinkError
    from robosandbox.drivers.franka.waypoints import Waypoints, begun_at, waypoints
except ImportError as error:
    raise missing_extra(error, "--driver franka", "franka") from None

_log = logging.getLogger(__name__)

# What a controller is in when it moves nothing, and the way out of it.
_MODES: Mapping[str, str] = {
    "Reflex": "the arm's own reflex has stopped it{errors}: see that nothing is jammed and that it may move on, then recover()",
    "UserStopped": "the user stop is pressed{errors}: release it, then recover()",
    "Guiding": "somebody guides the arm by hand: let go of its buttons, then recover()",
    "Other": "the controller is not ready{errors}: unlock the joints and activate FCI in Desk, then recover()",
}
# The way out of those for a program that comes to a controller that is in one already.
_BY_HAND = "see that nothing is jammed and that it may move on, press the user stop and release it"


class Franka(WallClockDriver):
    """A Franka arm with seven joints, and its hand, behind the controller's FCI.

    Args:
        scene: The robot, and the table that it stands at.
        host: Address of the controller.
        realtime: "enforce" refuses a computer without a realtime kernel, "ignore" takes it.
        speed: Share of the speed of every trajectory that the arm follows it with, above 0 to 1.
        grip: Force that the hand closes with where nobody says one, N; that of the model's motors if left out.
        grip_speed: By how much its width changes in a second, m.
        wrench: Whether the arm's estimate of the force at its hand is a sense of it.
        cameras: `module:function` that is called with this driver and returns its senses, with `cameras`.
        tick: Seconds between two looks at guards and limits.
        link_timeout: Seconds without a state of the arm after which it is lost.
        answer: Seconds in which the controller has to answer.

    Raises:
        InputError: The controller cannot be reached, or the robot is not of its kind. Nothing moves.
    """

    episode: Final = 0

    def __init__(
        self,
        scene: Scene,
        *,
        host: str,
        realtime: Literal["enforce", "ignore"] = "enforce",
        speed: float = 1.0,
        grip: float | None = None,
        grip_speed: float = 0.1,
        wrench: bool = True,
        cameras: str | None = None,
        tick: float = 0.01,
        link_timeout: float = 0.1,
        answer: float = 1.0,
    ) -> None:
        super().__init__(tick)
        if not 0.0 < speed <= 1.0:
            raise InputError(f"speed is {speed:g}; give a share above 0, to 1")
        nothing = ObservedScene(time=0.0, objects=(), table_height=scene.table_height, base_xy=(0.0, 0.0))
        planning = PlanningScenes(scene).of(nothing)
        spec = planning.robot.spec
        if spec.n != 7:
            raise InputError(f"--driver franka: {spec.name} has {spec.n} joints; a Franka has 7")
        self.host, self.speed, self.answer = host, speed, answer
        self._realtime, self._wrench, self._link_timeout = realtime, wrench, link_timeout
        self._planned_gripper = planning.robot.gripper
        try:
            self.link = self._connect(spec)
        except InModeError as error:
            raise InputError(f"--driver franka: {error}: {_BY_HAND}, then start again") from None
        except LinkError as error:
            raise InputError(
                f"--driver franka: {error}; look whether the controller is on, its joints are unlocked and FCI is active"
            ) from None
        hand = None if spec.gripper is None else _FrankaHand(self, spec.gripper, grip, grip_speed)
        self._hand = hand
        self.hands = {} if hand is None else {hand.name: hand}
        self._arm = _FrankaArm(self, spec, planning.kinematics(), hand)
        self._arm.meets = meetings(planning)
        self.arms = {ARM: self._arm}
        self._cameras: Mapping[str, CameraSpec] = {}
        try:
            eyes = None if cameras is None else open_eyes(cameras, self)
        except BaseException:
            self.link.close()
            raise
        self._cameras = {} if eyes is None else eyes.cameras
        (robot,) = robots_of(populated(scene)).values()
        self.senses = _FrankaSenses(self, eyes, robot.base_pose.rotation)
        self.look()
        try:
            # In a fault the controller takes no settings; recover() makes up for it.
            if not self.fault:
                self._set_reflex()
        except LinkError as error:
            self.link.close()
            raise InputError(f"--driver franka: {error}; restart the controller") from None
        if realtime == "ignore":
            _log.warning(
                "realtime: this computer may be late with a command at any time, which ends a motion with "
                "communication_constraints_violation; a kernel with PREEMPT_RT and realtime=enforce keep it from that"
            )

    @property
    def capabilities(self) -> Capabilities:
        """Encoders, the estimate of the wrench, a grip with a force, and cameras where there are some."""
        return Capabilities(
            grip_limit=self._hand is not None,
            wrist_wrench=self._wrench,
            cameras=self._cameras,
            clock="wall",
            link_timeout=self._link_timeout,
            speed=self.speed,
        )

    def close(self) -> None:
        """Brake what moves, and let go of the controller, which holds the arm."""
        self._loop.close()
        self._arm.stop()
        end = time.monotonic() + self.answer
        while self.link.is_stopping and time.monotonic() < end:
            time.sleep(self.control_timestep)
        self.link.close()

    def recover(self) -> None:
        """Connect again where the link is lost, have the controller end its errors and take the limits, and end a fault.

        Raises:
            FaultError: It is not over.
        """
        self.fault = ""
        try:
            if self.link.error or self.time - self.heard > self._link_timeout:
                self.link.close()
                self.link = self._connect(self._arm.spec)
            self.link.recover()
            self._await_readiness()
            self._set_reflex()
        except InModeError as error:
            self.fault = f"{error}: {_BY_HAND}, then recover()"
        except LinkError as error:
            self.fault = str(error)
        self._arm.forget()
        if self._hand is not None:
            self._hand.forget()
        if not self.fault:
            self.look()
        if self.fault:
            raise FaultError(f"{self.fault}; it is not over", phase=Phase.CHECK)

    # Between the parts of this driver and the controller.

    @property
    def heard(self) -> float:
        """When the arm was last heard of, by this driver's clock."""
        return self.since(self.link.heard)

    def posture(self) -> dict[str, Posture]:
        """Return how the arm stands, as a frame of a camera tells it."""
        gripper, hand = self._planned_gripper, self._hand
        values = gripper.joints_at(hand.state().joint) if gripper and hand else np.zeros(0)
        return {ARM: Posture(q=self._arm.state().q, gripper_q=frozen_array(values))}

    def _connect(self, spec: RobotSpec) -> FrankaLink:
        link = FrankaLink(
            self.host,
            enforce_realtime=self._realtime == "enforce",
            hand=spec.gripper is not None,
            period=self.control_timestep,
            deadline=self.answer,
        )
        try:
            link.limit(spec.velocity_limits, spec.acceleration_limits)
        except BaseException:
            link.close()
            raise
        return link

    def _set_reflex(self) -> None:
        """Have the arm's own reflex act by the robot's limits; raises LinkError where the controller does not take them."""
        spec = self._arm.spec
        collision, contact = force_limits(spec.limits)
        self.link.set_collision_thresholds(contact, collision, spec.reach[1])

    def _await_readiness(self) -> None:
        """Wait until the controller has left the modes in which it moves nothing; it takes some ticks to say so."""
        end = time.monotonic() + self.answer
        while self.link.arm.mode in (*_MODES, "AutomaticErrorRecovery") and time.monotonic() < end:
            time.sleep(self.control_timestep)

    def look(self) -> None:
        """See what is the matter with the link, the controller and the hand."""
        if self.link.error:
            self.fail(
                f"the link to {self.host} is lost ({self.link.error}): look after cable and power, then recover()"
            )
            return
        told = self.link.arm
        if told.mode in _MODES:
            errors = f" ({', '.join(told.errors)})" if told.errors else ""
            self.fail(_MODES[told.mode].format(errors=errors))
        if self._hand is not None:
            self._hand.look()


class _FrankaArm(BareArm):
    """The arm as its controller tells of it."""

    def __init__(self, cell: Franka, spec: RobotSpec, kinematics: Kinematics, hand: _FrankaHand | None) -> None:
        super().__init__(cell, spec)
        self._cell, self._kinematics, self._hand = cell, kinematics, hand
        self._integral = IntegralAction(spec.n, cell.control_timestep)

    def state(self) -> ArmState:
        """Return what the controller told last, and of which time that is."""
        told = self._cell.link.arm
        return ArmState(
            time=self._cell.heard,
            q=told.q,
            qd=told.qd,
            tcp_pose=Pose.from_matrix(*self._kinematics.forward(told.q)),
            gripper=None if self._hand is None else self._hand.state(),
        )

    def follow(self, trajectory: Trajectory, guards: Sequence[Guard] = ()) -> None:
        """Have the controller follow a trajectory as one motion, and return when it says that it has.

        One that goes on is sent with a braking behind it, which the next one replaces: an arm whose host is gone stands.

        Raises:
            LimitError: A row is outside of the controller's own limits, and nothing has moved.
            FaultError: The controller gave it up, or does not end it; it says why.
        """
        q, dt = trajectory.q + self._integral.shift, trajectory.dt / self._cell.speed
        self._check_range(q)
        if len(q) < 2:
            self._go_to(q[0], guards)
            self._watch(TOLERANCES.window, guards)
            return
        braking = braking_rows(self.spec, q[-1], (q[-1] - q[-2]) / dt, dt) if trajectory.goes_on else q[:0]
        link = self._cell.link
        self._await_stop(guards)
        through = waypoints(
            begun_at(link.arm.commanded, np.concatenate([q, braking])),
            dt,
            spacing=TOLERANCES.window,
            acceleration=link.acceleration,
            jerk=link.jerk,
        )
        self._move(through)
        if trajectory.goes_on:
            self._watch(through.stretch * (len(q) - 1) * dt, guards, to_its_end=False)
        else:
            self._watch(float(through.seconds.sum()), guards)

    def trim(self, goal: Array, guards: Sequence[Guard] = ()) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,).

        Raises:
            LimitError: It is outside of the controller's own limits.
        """
        told = self._cell.link.arm
        # A joint that moves is on its way: what keeps it off is seen when it stands.
        self._integral.take_up(np.where(np.abs(told.qd) < TOLERANCES.still, goal - told.q, 0.0))
        row = goal + self._integral.shift
        self._check_range(row[None])
        self._go_to(row, guards)
        try:
            self._cell.tick(guards)
            self._look()
        except BaseException:
            self.stop()
            raise

    def stop(self) -> None:
        """Have the controller brake; `SafeDriver` sees to it that the arm comes to stand."""
        self._cell.link.stop()

    def forget(self) -> None:
        """Begin anew, after a fault."""
        self._integral.begin_at(np.zeros(self.spec.n))

    def _go_to(self, q: Array, guards: Sequence[Guard]) -> None:
        """Begin to go to a configuration (n,), and to rest."""
        self._await_stop(guards)
        self._move(Waypoints(q=q[None], qd=np.zeros((1, len(q))), seconds=np.array([TOLERANCES.window]), stretch=1.0))

    def _await_stop(self, guards: Sequence[Guard]) -> None:
        """Let ticks pass until the controller has answered the last stop."""
        cell, asked = self._cell, self._cell.time
        while cell.link.is_stopping:
            if cell.time - asked > cell.answer:
                cell.fail(
                    f"the controller has not answered a stop for {cell.answer:g} s: look after it, then recover()"
                )
            self._raise_fault()
            cell.tick(guards)

    def _move(self, through: Waypoints) -> None:
        """Begin a motion, if nothing is the matter."""
        self._raise_fault()
        try:
            self._cell.link.move(through)
        except LinkError as error:
            self._cell.fail(
                f"the controller did not take the motion ({error}): look what is the matter, then recover()"
            )
            self._raise_fault()

    def _watch(self, seconds: float, guards: Sequence[Guard], *, to_its_end: bool = True) -> None:
        """Let ticks pass until what was begun is over, or for as long as it takes by the robot's clock."""
        cell = self._cell
        began = cell.link.arm.time
        try:
            while True:
                cell.tick(guards)
                gone = cell.link.arm.time - began
                if self._look() or (not to_its_end and gone >= seconds):
                    return
                if gone > 2.0 * seconds + cell.answer:
                    cell.fail(
                        f"the controller has not ended a motion of {seconds:.2f} s {gone:.2f} s after it was sent: see what "
                        "keeps the arm, then recover()"
                    )
                    self._raise_fault()
        except BaseException:
            self.stop()
            raise

    def _look(self) -> bool:
        """Return whether the motion is over; raises FaultError where it ended in another way."""
        try:
            arrived = self._cell.link.has_arrived()
        except LinkError as error:
            self._cell.fail(f"the controller ended the motion ({error}): see what stopped it, then recover()")
            arrived = False
        self._raise_fault()
        return arrived

    def _raise_fault(self) -> None:
        if self._cell.fault:
            raise FaultError(f"{self._cell.fault}; nothing moves before recover() is called", phase=Phase.CHECK)

    def _check_range(self, rows: Array) -> None:
        """Refuse rows, shape (k, n), outside of what the controller itself allows, which an arm that stands outside may leave."""
        link, q = self._cell.link, self._cell.link.arm.q
        lower, upper = np.minimum(link.lower, q), np.maximum(link.upper, q)
        over = np.maximum(lower - rows, rows - upper)
        if over.max() <= TOLERANCES.position:
            return
        row, joint = (int(index) for index in np.unravel_index(over.argmax(), over.shape))
        name, value = self.spec.joints[joint], float(rows[row, joint])
        low, high = float(link.lower[joint]), float(link.upper[joint])
        raise LimitError(
            f"{name} would be at {value:.4g} rad, and this controller allows {low:.4g}..{high:.4g}; nothing has moved: send "
            "another, or open the driver with the model of this arm",
            phase=Phase.CHECK,
            evidence=LimitEvidence(quantity=f"position of {name}, rad", value=value, low=low, high=high),
        )


class _FrankaHand(BareHand):
    """The hand as its own controller tells of it.

    One command is sent when the one before is over, because a hand that is told to stop never answers what it was doing.
    """

    def __init__(self, cell: Franka, spec: GripperSpec, grip: float | None, speed: float) -> None:
        super().__init__(cell, spec)
        self._cell, self._speed = cell, speed
        # The model's motors close both fingers; the hand is told with how much each presses.
        self._grip = float(spec.force_limits.sum()) / len(spec.geometry.pads) if grip is None else grip
        self._closed: float | None = None
        # What is to be sent; and of what was sent a function that tells whether it is over, and by when, on the hand's clock, it
        # has to be.
        self._wanted: tuple[float, float | None] | None = None
        self._is_over: Callable[[], bool] | None = None
        self._deadline = 0.0

    def state(self) -> GripperState:
        """Return what the hand told last; what is held keeps it from where it was sent."""
        geometry = self.spec.geometry
        width = self._cell.link.hand.width
        joint = geometry.joint_for_aperture(width)
        closed = geometry.closed_fraction(joint)
        return GripperState(
            joint=joint,
            width=width,
            closed=closed,
            force=None,
            commanded=min(max(closed, 0.0), 1.0) if self._closed is None else self._closed,
        )

    def set_gripper(self, closed: float, force: float | None = None) -> None:
        """Command the hand: 0 is the sidecar's open, 1 its closed, where it presses with `force` N at most. Returns at once.

        Raises:
            ValueError: `closed` is outside 0..1, or the force is not positive.
            FaultError: The hand did not do what it was told last.
        """
        if not 0.0 <= closed <= 1.0:
            raise ValueError(f"closed is {closed}; a gripper takes 0 (open) to 1 (closed)")
        if force is not None and not force > 0.0:
            raise ValueError(f"force is {force}; give newtons above 0, or leave it out")
        self._closed, self._wanted = closed, (closed, force)
        self.look()
        if self._cell.fault:
            raise FaultError(f"{self._cell.fault}; nothing moves before recover() is called", phase=Phase.CHECK)

    def look(self) -> None:
        """See what has become of the last command, and send the next one."""
        cell = self._cell
        try:
            if self._is_over is not None and self._is_over():
                self._is_over = None
            if self._is_over is not None and cell.link.hand.time > self._deadline:
                self._is_over = self._closed = None
                cell.fail(
                    f"the hand does not say that it has done what it was told, {cell.answer:g} s after it should have: look "
                    "what is between its fingers, then recover()"
                )
            elif self._is_over is None and self._wanted is not None and not cell.fault:
                self._send(*self._wanted)
                self._wanted = None
        except LinkError as error:
            self._is_over = self._closed = None
            cell.fail(f"the hand did not do what it was told ({error}): home it in Desk, then recover()")

    def forget(self) -> None:
        """Begin anew, after a fault; a hand that did what it was told goes on holding what it holds."""
        self._wanted, self._is_over = None, None

    def _send(self, closed: float, force: float | None) -> None:
        geometry, link = self.spec.geometry, self._cell.link
        width = geometry.aperture(geometry.open_joint + closed * (geometry.closed_joint - geometry.open_joint))
        width = min(max(0.0, width), link.hand.max_width)
        if force is not None or closed == 1.0:
            self._is_over = link.grasp(width, self._speed, self._grip if force is None else force / 2.0)
        else:
            self._is_over = link.move_hand(width, self._speed)
        self._deadline = link.hand.time + link.hand.max_width / self._speed + self._cell.answer


class _FrankaSenses(BareSenses):
    """Cameras where some were named, and the estimate of the wrench.

    Args:
        cell: The driver.
        eyes: Senses with cameras.
        base: Rotation of the arm's base in the world, shape (3, 3).
    """

    def __init__(self, cell: Franka, eyes: Eyes | None, base: Array) -> None:
        super().__init__(cell)
        self._cell, self._eyes, self._base = cell, eyes, base

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        """Return what a camera delivers now."""
        if self._eyes is None:
            raise refusal(self._cell, "cameras", f"a frame of {camera!r} was asked for")
        return self._eyes.capture(camera, window)

    def force_on(self, object_id: str | None, arm: str | None = None) -> Array:
        """Return what the hand gives to the rest of the world as the arm estimates it, N in the world, shape (3,).

        It cannot tell of which object, or of the table.

        Raises:
            UnsupportedError: The driver was opened without that sense.
        """
        del object_id, arm
        if not self._cell.capabilities.wrist_wrench:
            raise refusal(self._cell, "wrist_wrench", "a force was asked for")
        return frozen_array(self._base @ self._cell.link.arm.force)
