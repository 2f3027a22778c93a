"""Grip force: as much as the weighed load asks for, not as much as the gripper can give."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np

from robosandbox.grasp.hand import FRICTION
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import CAREFUL, DetectedObject, Timing, share_of
from robosandbox.types.robot import GripperGeometry
from robosandbox.world.relations import centre

# Fraction of the way from the closed aperture to a thing's width below which closed fingers hold nothing.
_EMPTY_GRIP_FRACTION = 0.5
# m/s^2; the standard acceleration of free fall, rounded.
GRAVITY = 9.81
# Factor; chosen so that what is held stays when a hand is stopped at once; halved and doubled all of twelve episodes
# succeed.
_MARGIN = 2.5
# Where on the pad, from its middle, friction acts against a turn, as a share of the pad's width; chosen for an even
# pressure: the mean distance of a square's points from its middle is 0.38 of its edge, and pads press more in their
# middle.
_PAD_RADIUS_SHARE = 0.25
# kg/m^3: what a thing may weigh for its size before it is felt; chosen as that of glass, stone and aluminium.
_DENSITY = 2700.0
# Factor by which the load has to ask for more before the grip is changed; chosen so that a lift changes it a few times.
_RISEN = 1.1
# Readings in a row, one for each control tick, that have to agree: what is pinched less springs back for a tick or two.
_READINGS = 3
# Seconds that fingers get to hold as hard as they were told; chosen as what their servos take to settle.
_EASING_SECONDS = 0.12
# Share of the hardest grip that a gentle one keeps at least; chosen for a weight that was measured too small.
_LEAST_SHARE = 0.1
# Share of the most that the robot may press with up to which weight and inertia of what it carries come; chosen for what a servo
# overshoots.
_OF_LIMIT = 0.9
# Share of a speed that the heaviest load keeps; chosen so that it arrives at all.
_LEAST_SPEED = 0.03
# Times that the hand may be quicker with all joints than with one; chosen as measured: 4.6 kg carried by the bundled arm.
_TOGETHER = 3.0
# Metres past its widest gap from which a jaw has swung off: encoders' noise of the driver `hardware`, of a gap of 80 mm.
_SWUNG_OFF = 0.0002
# Share of the wanted force below which the easing has failed and the fingers close again; chosen for the error of a
# servo's slope (doubled, it always fails, and episodes are 2 % longer).
_SHORTFALL = 0.6


def empty_aperture(geometry: GripperGeometry, width: float) -> float:
    """Return the aperture below which fingers that closed on a thing of this width hold nothing, metres."""
    return geometry.min_aperture + _EMPTY_GRIP_FRACTION * (width - geometry.min_aperture)


def needed_force(arm: Manipulator, held: DetectedObject, mass: float) -> float:
    """Return the force of each pad that holds an object against weight, carrying and turning, with a margin, N.

    Coulomb friction at two pads: mu N each against the force, mu N r each against the moment about the closing line.

    Args:
        arm: Whose hand.
        held: What is held, where it is seen.
        mass: Its mass, kg.
    """
    acceleration = share_of(arm.tempo.carry) * _quickest(arm)
    return _MARGIN * mass * (GRAVITY + acceleration) * _leverage(arm, held) / (2.0 * FRICTION)


def bearable(arm: Manipulator, held: DetectedObject, speed: Timing) -> Timing:
    """Return the timing, made less where the grip does not hold an object at it, by the reckoning of `needed_force`.

    Likewise where its weight and inertia together come near what the robot may press with. Weight and grip are measured, so that
    the arm has to stand still. A driver that measures neither is as careful as can be.

    Args:
        arm: Whose hand.
        held: What is held, where it is seen.
        speed: At most.
    """
    has, least = arm.driver.capabilities, share_of(CAREFUL.carry)
    if not (has.gripper_force and has.wrist_wrench):
        return speed * (min(speed.share, least) / speed.share)
    grip, weight = arm.hand.grip_on(held.id), float(arm.force_on(held.id)[2])
    if weight <= 0.0:
        return speed * (min(speed.share, least) / speed.share)
    most = 2.0 * FRICTION * grip / (_MARGIN * _leverage(arm, held) * weight / GRAVITY) - GRAVITY
    share = float(np.clip(most / _quickest(arm), min(least, speed.share), speed.share))
    spare = (_OF_LIMIT * arm.ctx.max_force_n - weight) * GRAVITY / weight
    share = min(share, max(spare / (_TOGETHER * _quickest(arm)), _LEAST_SPEED * speed.share))
    return speed * (share / speed.share)


def landing(arm: Manipulator, held: DetectedObject, speed: Timing) -> Timing:
    """Return the timing, arriving slower where the grip passes on more than the robot may press with.

    What comes down on a support is pressed by the hand above it, at an arrival as tempos have it by more than most limits allow
    for a tick, but by no more than that at which it slides between two pads of a friction of 1. So a light thing, held lightly,
    arrives at the tempo's speed, and what is held hard in proportion slower.

    Args:
        arm: Whose hand. A driver that measures no grip leaves the timing as it is.
        held: What is held, where it is seen.
        speed: At most.
    """
    if not arm.driver.capabilities.gripper_force:
        return speed
    passed_on = 2.0 * arm.hand.grip_on(held.id)
    return replace(speed, arrival=speed.arrival * arm.ctx.max_force_n / max(passed_on, arm.ctx.max_force_n))


def _quickest(arm: Manipulator) -> float:
    """Return the acceleration of the hand at the limit of the joints', m/s^2."""
    robot = arm.spec
    return float(robot.acceleration_limits.max()) * robot.reach[1]


def _leverage(arm: Manipulator, held: DetectedObject) -> float:
    """Return how many times its weight an object asks of the pads' friction, for where they hold it."""
    tcp = arm.state.tcp_pose
    offset, closing = centre(held) - tcp.position, tcp.rotation[:, 1]
    lever = float(np.linalg.norm(offset - closing * (closing @ offset)))
    return 1.0 + lever / (_PAD_RADIUS_SHARE * arm.geometry.finger_width)


class Grip:
    """Grip force on what the fingers have closed on: as large as the felt load asks for, not as large as it can be.

    At first as hard as a thing of its size may weigh; while it is lifted, harder as soon as the load asks for it; at rest, what its
    weight asks for. A driver that measures no force, or limits none, holds as hard as it can; so does a jaw that has swung off the line on
    which it would meet the other one: it presses askew, and how much of that holds is not known.

    Args:
        arm: Whose hand.
        held: What its fingers have closed on, where it is seen.
        firm: Hold as hard as they can.
    """

    def __init__(self, arm: Manipulator, held: DetectedObject, *, firm: bool = False) -> None:
        self._arm, self._held = arm, held
        gripper = arm.spec.gripper
        strength = math.inf if gripper is None else float(gripper.force_limits.sum())
        now, motors = (arm.hand.grip_on(held.id), arm.gripper.force or 0.0) if arm.feels_grip else (0.0, 0.0)
        firm = firm or arm.spread > arm.geometry.max_aperture + _SWUNG_OFF
        self._limits = not firm and now > 0.0 and motors > 0.0 and math.isfinite(strength)
        # What the motors give for each newton of a pad, as both are now.
        self._motors_per_pad = motors / now if self._limits else 0.0
        self._most = strength / self._motors_per_pad if self._limits else 0.0
        # N of a pad for each kg, where the thing lies between the pads now; it does not move among them.
        self._per_kg = needed_force(arm, held, 1.0) if self._limits else 0.0
        self._wanted, self._since = self._most, 0.0
        self._loads: deque[float] = deque(maxlen=_READINGS)
        self._grips: deque[float] = deque(maxlen=_READINGS)
        if self._limits:
            self._ask(self._needed(_DENSITY * float(np.prod(held.shape.extents(held.size)))))
        elif firm:
            self.close()

    def __call__(self) -> None:
        """Hold harder where the load asks for it: a guard that never ends a motion."""
        if not self._limits:
            return
        arm = self._arm
        self._loads.append(math.hypot(*arm.force_on(self._held.id).tolist()))
        self._grips.append(arm.hand.grip_on(self._held.id))
        wanted = self._needed(min(self._loads) / GRAVITY) if len(self._loads) == _READINGS else 0.0
        if wanted > _RISEN * self._wanted:
            self._ask(wanted)
        elif arm.driver.time - self._since > _EASING_SECONDS and max(self._grips) < _SHORTFALL * self._wanted:
            # The motors' friction or the fingers' levers take more of a small force than of a large one.
            self.close()

    def settle(self) -> None:
        """Hold what hangs still as hard as its weight asks for."""
        if self._limits:
            wanted = self._needed(max(0.0, float(self._arm.force_on(self._held.id)[2])) / GRAVITY)
            if wanted < self._wanted:
                self._ask(wanted)

    def close(self) -> None:
        """Hold as hard as the fingers can from now on."""
        self._limits = False
        self._arm.hand.set_gripper(1.0)

    def _needed(self, mass: float) -> float:
        return min(max(self._per_kg * mass, _LEAST_SHARE * self._most), self._most)

    def _ask(self, wanted: float) -> None:
        """Limit the motors to what gives `wanted` at each pad, N."""
        self._wanted, self._since = wanted, self._arm.driver.time
        limit = self._motors_per_pad * wanted if wanted < self._most else None
        self._arm.hand.set_gripper(1.0, limit)
