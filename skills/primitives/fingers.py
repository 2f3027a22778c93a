"""The fingers of an arm: what they measure, and how they open and close."""

from __future__ import annotations

import math

import numpy as np

from robosandbox.driver import Arm, Driver, Hand
from robosandbox.errors import Phase, UnsupportedError
from robosandbox.motion.protocols import MotionPlanner
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import ArmState, GripperState, Trajectory
from robosandbox.types.robot import GripperGeometry, RobotSpec

# Metres before what they close on from which fingers are gentle, both together, and the share of their motors' force that they are
# gentle with; chosen: three times perception's error of a size, and a force at which the bundled hand's fingers move half as fast.
_MEETING, _GENTLE = 0.006, 0.4
# Rows of a trajectory between two that are looked at; chosen as 50 ms, in which a hand goes by less than a finger's thickness.
_EVERY = 10
# Seconds between two readings of fingers; chosen as several ticks, so that standing still shows (halved 1 % shorter
# episodes, doubled 2 % longer).
_LAG = 0.05
# Seconds that fingers get to come to rest; chosen for slow servos of small arms (halved and doubled all ends alike: the
# bundled gripper takes under one).
_GRIP_SECONDS = 4.0
# Metres between two readings below which fingers stand still; chosen far below what a grip creeps (halved or doubled,
# under 1 % of an episode).
_GRIP_STILL = 0.0002


class Fingers:
    """The fingers of the hand that a call works with.

    Args:
        ctx: What the skill may use.

    Attributes:
        driver: Of the cell: its clock, and what it can do.
        motion: Plans ways on which the fingers are as far apart as it is told.
    """

    def __init__(self, ctx: SkillContext) -> None:
        self.driver: Driver = ctx.driver
        self.motion: MotionPlanner = ctx.motion
        self._arm: Arm = ctx.arm
        self._hand: Hand | None = ctx.hand

    @property
    def spec(self) -> RobotSpec:
        """Specification of the arm."""
        return self._arm.spec

    @property
    def state(self) -> ArmState:
        """State of the arm."""
        return self._arm.state()

    @property
    def hand(self) -> Hand:
        """The hand.

        Raises:
            UnsupportedError: The arm carries none.
        """
        if self._hand is None:
            raise UnsupportedError(f"{self.spec.name} has no gripper", phase=Phase.CHECK)
        return self._hand

    @property
    def geometry(self) -> GripperGeometry:
        """The gripper's measured figures.

        Raises:
            UnsupportedError: The robot has no gripper.
        """
        gripper = self.spec.gripper
        if gripper is None:
            raise UnsupportedError(
                f"{self.spec.name} has no gripper in its sidecar, so it cannot hold things; it can push, tap and "
                "go home",
                phase=Phase.CHECK,
            )
        return gripper.geometry

    @property
    def gripper(self) -> GripperState:
        """The gripper's own readings.

        Raises:
            UnsupportedError: The robot has no gripper.
        """
        state = self.state.gripper
        if state is None:
            raise UnsupportedError(f"{self.spec.name} has no gripper", phase=Phase.CHECK)
        return state

    def open(self, aperture: float | None = None, *, wait: bool = True) -> None:
        """Open the fingers to `aperture` metres, or all the way."""
        geometry = self.geometry
        if aperture is None or aperture >= geometry.max_aperture:
            closed = 0.0
        else:
            closed = float(np.clip(geometry.closed_fraction(geometry.joint_for_aperture(aperture)), 0.0, 1.0))
        self.hand.set_gripper(closed)
        if wait:
            self.wait_for_fingers()

    def open_for(self, way: Trajectory, aperture: float) -> None:
        """Send the fingers to `aperture` metres for a way that was planned with them there.

        Where it is not free with them as they are, they are waited for first; else they go meanwhile.
        """
        wide = self.gripper.width
        self.open(aperture, wait=False)
        if abs(wide - aperture) > _GRIP_STILL:
            self.motion.open_to(wide)
            blocked = any(self.motion.touch(q) is not None for q in way.q[::_EVERY])
            self.motion.open_to(aperture)
            if blocked:
                self.wait_for_fingers()

    @property
    def spread(self) -> float:
        """How far the fingers are apart, metres, past the widest gap as well; 0 without any."""
        return 0.0 if self.spec.gripper is None else self.geometry.spread(self.gripper.joint)

    def close(self) -> float:
        """Close the fingers until they stop; return the gap between them, metres."""
        self.hand.set_gripper(1.0)
        return self.wait_for_fingers()

    @property
    def feels_grip(self) -> bool:
        """True where the fingers' force is measured, with what it carries, and can be limited."""
        has = self.driver.capabilities
        return has.gripper_force and has.wrist_wrench and has.grip_limit and self.geometry.cup is None

    def close_on(self, width: float) -> float:
        """Close the fingers on something of this width, metres: gently where they meet it, as far as their force is felt.

        Returns:
            The gap between them when they have stopped, metres.
        """
        gripper = self.spec.gripper
        strength = math.inf if gripper is None else float(gripper.force_limits.sum())
        if not self.feels_grip or not math.isfinite(strength):
            return self.close()
        self.hand.set_gripper(1.0)
        deadline = self.driver.time + _GRIP_SECONDS
        while self.gripper.width > width + _MEETING and self.driver.time < deadline:
            before = self.gripper.closed
            self.driver.wait(self.driver.control_timestep)
            if self.gripper.closed <= before:
                break
        self.hand.set_gripper(1.0, _GENTLE * strength)
        gap = self.wait_for_fingers()
        return gap if self.hand.grip_on(None) > 0.0 else self.close()

    def wait_for_fingers(self, until: float = math.inf) -> float:
        """Wait until the fingers no longer move, or are `until` metres apart; return the gap between them."""
        deadline = self.driver.time + _GRIP_SECONDS
        self.driver.wait(_LAG)
        state = self.gripper
        while self.driver.time < deadline and state.width < until:
            self.driver.wait(_LAG)
            before, state = state, self.gripper
            # A jaw that has swung far off still moves where its gap no longer grows.
            travel = abs(state.closed - before.closed) * self.geometry.max_aperture
            if max(abs(state.width - before.width), travel) < _GRIP_STILL:
                break
        return state.width
