"""How hard to hold: as the weighed load asks for, not as hard as the gripper can."""

from __future__ import annotations

import numpy as np

from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import CAREFUL, DetectedObject, Timing, share_of
from robosandbox.world.relations import centre

# m/s^2; the standard acceleration of free fall, rounded.
GRAVITY = 9.81
# Coefficient; chosen as what most pairs of materials have at least: friction is not seen. Halved it asks for twice the
# force.
FRICTION = 0.5
# Factor; chosen so that what is held stays when a hand is stopped at once; halved and doubled all of twelve episodes
# succeed.
_MARGIN = 2.5
# Where on the pad, from its middle, friction acts against a turn, as a share of the pad's width; chosen for an even
# pressure: the mean distance of a square's points from its middle is 0.38 of its edge, and pads press more in their
# middle.
_PAD_RADIUS_SHARE = 0.25
# Seconds that a lifted object hangs before it is weighed; chosen as five ticks in which the servos come to rest (halved
# and doubled, nothing but this time changes).
_WEIGHING_SECONDS = 0.05
# Seconds that fingers get to ease; chosen as what their servos take to settle (likewise).
_EASING_SECONDS = 0.12
# Share of the first grip that an eased one keeps at least; chosen for a weight that was measured too small.
_LEAST_SHARE = 0.1
# Share of the wanted force below which the easing has failed and the fingers close again; chosen for the error of a
# servo's slope (doubled, it always fails, and episodes are 2 % longer).
_SHORTFALL = 0.6
# Share of their travel by which fingers may stand beside where their gap says; chosen above a servo's error.
_ASTRAY = 0.05


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

    Weight and grip are measured, so that the arm has to stand still. A driver that measures neither is as careful as can be.

    Args:
        arm: Whose hand.
        held: What is held, where it is seen.
        speed: At most.
    """
    sim, least = arm.sim, share_of(CAREFUL.carry)
    if not (sim.capabilities.gripper_force and sim.capabilities.wrist_wrench):
        return speed * (min(speed.share, least) / speed.share)
    grip, weight = sim.grip_on(held.id), float(sim.force_on(held.id)[2])
    if weight <= 0.0:
        return speed * (min(speed.share, least) / speed.share)
    most = 2.0 * FRICTION * grip / (_MARGIN * _leverage(arm, held) * weight / GRAVITY) - GRAVITY
    share = float(np.clip(most / _quickest(arm), min(least, speed.share), speed.share))
    return speed * (share / speed.share)


def _quickest(arm: Manipulator) -> float:
    """Return the acceleration of the hand at the limit of the joints', m/s^2."""
    robot = arm.sim.spec
    return float(robot.acceleration_limits.max()) * robot.reach[1]


def _leverage(arm: Manipulator, held: DetectedObject) -> float:
    """Return how many times its weight an object asks of the pads' friction, for where they hold it."""
    tcp = arm.sim.state().tcp_pose
    offset, closing = centre(held) - tcp.position, tcp.rotation[:, 1]
    lever = float(np.linalg.norm(offset - closing * (closing @ offset)))
    return 1.0 + lever / (_PAD_RADIUS_SHARE * arm.geometry.finger_width)


def ease(arm: Manipulator, held: DetectedObject) -> float | None:
    """Weigh what hangs still in the closed fingers, hold it no harder than that takes, and return the pads' force, N.

    The servo is told to close less far: its force is its gain times what its target lies beyond where the fingers are.
    Where it is no servo, or the weight needs all the force there is, or the object would slip, the grip stays as it was;
    and where the driver tells no force at all, which returns None.
    """
    sim, gripper = arm.sim, arm.sim.spec.gripper
    if not (sim.capabilities.gripper_force and sim.capabilities.wrist_wrench):
        return None
    before = sim.grip_on(held.id)
    if gripper is None or before <= 0.0:
        return before
    sim.wait(_WEIGHING_SECONDS)
    mass = max(0.0, float(sim.force_on(held.id)[2])) / GRAVITY
    wanted = max(needed_force(arm, held, mass), _LEAST_SHARE * before)
    state = arm.gripper
    closed = float(np.clip(state.closed, 0.0, 1.0))
    geometry = gripper.geometry
    astray = abs(geometry.joint_for_aperture(state.width) - state.joint)
    if astray > _ASTRAY * abs(geometry.closed_joint - geometry.open_joint):
        # Fingers with servos of their own, at their limits, stand where the object pushed them: one command for both
        # would open the one that stands farther in.
        return before
    slope = arm.planning.closing_stiffness(closed)
    if wanted >= before or slope <= 0.0 or not state.force:
        return before
    # The actuator's own force at the wanted pad force, by the ratio that both have now.
    sim.set_gripper(float(np.clip(closed + wanted / before * state.force / slope, closed, 1.0)))
    sim.wait(_EASING_SECONDS)
    now = sim.grip_on(held.id)
    if now < _SHORTFALL * wanted:
        sim.set_gripper(1.0)
        sim.wait(_EASING_SECONDS)
        now = sim.grip_on(held.id)
    return now
