"""Pour: tip what a held container holds into another."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from robosandbox.errors import CollisionError, Phase, PourError, SkillError, UnreachableError
from robosandbox.evidence import PourEvidence
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.manipulator import Manipulator, most_telling, raised
from robosandbox.skills.primitives.placing import taken_anew
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import (
    Array,
    DetectedObject,
    Pose,
    SkillResult,
    Trajectory,
    matrix_about_axis,
)
from robosandbox.values import frozen
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.changes import LEAST_FRACTION, MOST_SPILLED
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import HELD, fact
from robosandbox.world.pouring import poured
from robosandbox.world.relations import bottom, contents, mouth_of, room_of, top

# Share of the joints' speed limits up to where things begin to leave; chosen so that a full cup does not slosh (halved,
# pour_beads takes 26 % longer, doubled 15 % less, and nothing is spilled).
_LEAN_SPEED = 0.3
# Likewise from there on; chosen so that beads leave in a stream (halved 17 % longer, doubled 2 % less, and nothing is
# spilled).
_POUR_SPEED = 0.15
# Number of steps that are leant fast; chosen as 70 degrees, at which nothing leaves a container that is not filled to
# its rim (halved 3 % shorter, doubled 9 % longer).
_LEANT = 7
# Rad between two poses of the way on which the lip stays over one point; chosen so that the lip strays by under a
# millimetre between them (halved and doubled nothing is spilled).
_STEP = np.radians(10.0)
_TILTS = tuple(np.radians([125.0, 112.0, 100.0]))
# Metres of the lip over the target's rim that are tried, the lowest first; chosen from the planner's clearance, seven
# times over, to what still falls into a bowl (halved and doubled nothing is spilled).
_HEIGHTS = (0.015, 0.03, 0.05, 0.08)
# Metres between what is carried and the tops of things on the way; chosen as what a held container swings, several
# times over (halved and doubled pour_beads ends alike).
_SAFE = 0.03
# Tilt of the held container, radians, up to which it is carried around: one that is at most half full spills nothing there.
# Chosen.
_LEVEL_WITHIN = np.radians(20.0)
# Configurations of a way that are looked at for whether it is level; chosen so that a hand turns by a few degrees
# between two.
_LEVEL_SAMPLES = 60
# Things leave the lip with some speed: share of the opening's radius by which the lip stays before its middle; chosen
# for a fall of some centimetres.
_LEAD = 0.3
# Ways there that may be blocked; chosen because each is searched for by sampling, which takes longest, and there are
# eight directions of two hands.
_MOST_BLOCKED = 16
_YAWS = tuple(np.radians([0.0, 45.0, -45.0, 90.0, -90.0, 135.0, -135.0, 180.0]))
# Metres between lip and fingers below which things fall onto the hand; chosen as a fingertip's width.
_FINGER_CLEARANCE = 0.02
# Seconds that are waited for what is still leaving; chosen above what thirty beads take.
_DRAIN_SECONDS = 3.0
_UP = np.array([0.0, 0.0, 1.0])


class Pour(Skill):
    """Tip what a held container holds into another."""

    name = "pour"

    def contract(self, *, target: str) -> Contract:
        """Return what pouring from the held container into another needs and brings about."""
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("holding", HELD),
                fact("distinct", HELD, target),
                fact("pours", HELD),
                fact("holds_things", target),
                fact("filled", HELD),
                fact("upright", target),
                fact("opened", target),
                fact("holds_load", HELD, target),
                fact("reachable_over", HELD, target),
            ),
            gives=(fact("poured", HELD, target),),
        )

    def alternatives(self, failed: FailedCall, *, target: str) -> Iterator[Alternative]:
        """Yield pouring what is left, and another grip on what is poured from."""
        del target
        evidence = failed.error.evidence
        if (
            failed.had_begun
            and isinstance(evidence, PourEvidence)
            and evidence.poured + evidence.spilled < evidence.count
        ):
            yield Alternative(why="what is left is poured", call=failed.call)
        yield from taken_anew(failed)

    def run(self, ctx: SkillContext, *, target: str) -> SkillResult:
        """Carry the held container level to another one and tip out into it what it holds.

        Args:
            target: Id of the container to pour into.

        Raises:
            NotHoldingError: The gripper is empty.
            ObjectNotFoundError: The target is not seen.
            InvalidArgumentError: What is held pours nothing.
            PlacementError: The target is no open container.
            UnreachableError: The arm cannot tip it there.
            CollisionError: Something is in the way.
            PourError: Nothing was in it, too little arrived, or too much was spilled.
        """
        arm = Manipulator(ctx)
        held = arm.held
        vessel = arm.find(target)
        cargo = contents(arm.start.objects, held)
        way = _find_way(arm, held, vessel)
        arm.follow(way.carry, Phase.TRANSFER)
        arm.follow(way.lean, Phase.POUR)
        arm.follow(way.tip, Phase.POUR)
        _drain(arm, held.id)
        for part, faster in ((way.tip, _LEAN_SPEED / _POUR_SPEED), (way.lean, 1.0)):
            arm.follow(Trajectory(q=part.q[::-1], dt=part.dt / faster), Phase.RETREAT)
        after = arm.settle(target, *{name for name, _ in cargo})
        relation = poured(
            cargo,
            after.objects,
            arm.find(held.id, after),
            arm.find(target, after),
            min_fraction=LEAST_FRACTION,
            max_spilled=MOST_SPILLED,
        )
        count = len(cargo)
        arrived, spilled = (round(relation.detail[name] * count) for name in ("fraction", "spilled"))
        if not relation.holds or after.held != held.id:
            lost = "" if after.held == held.id else f" and {held.id} was dropped"
            raise PourError(
                f"{arrived} of {count} went from {held.id} into {target}, {spilled} were spilled{lost}; at least "
                f"{LEAST_FRACTION:.0%} should arrive and at most {MOST_SPILLED:.0%} be spilled; look again",
                phase=Phase.VERIFY,
                evidence=PourEvidence(object=held.id, target=target, count=count, poured=arrived, spilled=spilled),
            )
        return SkillResult(
            skill=self.name,
            detail={"object": held.id, "target": target, "count": count, "poured": arrived, "spilled": spilled},
            side_effects=(f"spilled {spilled} of {count}",) if spilled else (),
        )


@frozen
class _Way:
    carry: Trajectory
    lean: Trajectory
    tip: Trajectory


def _find_way(arm: Manipulator, held: DetectedObject, vessel: DetectedObject) -> _Way:
    """Return how to carry the container level to the target and tip it about its lip, which stays over the target.

    Raises:
        UnreachableError: The arm cannot turn it so.
        CollisionError: Something is in the way.
    """
    arm.ctx.enter(Phase.PLAN)
    scene = arm.look()
    arm.use(scene, held=held.id)
    arm.motion.allow()
    observation = arm.state
    held = arm.find(held.id, scene)
    tcp_in_object = held.pose.inverse() @ observation.tcp_pose
    level = _levelled(held.pose)
    failures: list[SkillError] = []
    blocked = 0
    for height in _HEIGHTS:
        for direction, yaw in _directions(arm, held, level):
            poses = [pose @ tcp_in_object for pose in _tipping(held, vessel, level, direction, yaw, height)]
            try:
                carry = _carry(arm, held, observation.q, poses[0])
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
                blocked += isinstance(error, CollisionError)
                if blocked >= _MOST_BLOCKED:
                    raise most_telling(failures) from None
                continue
            for tilt in _TILTS:
                steps = 1 + round(tilt / _STEP)
                try:
                    lean = arm.motion.plan_through(carry.q[-1], poses[1:_LEANT], speed=_LEAN_SPEED)
                    tip = arm.motion.plan_through(lean.q[-1], poses[_LEANT:steps], speed=_POUR_SPEED)
                except (UnreachableError, CollisionError) as error:
                    failures.append(error)
                    continue
                return _Way(carry, lean, tip)
    raise most_telling(failures)


def _carry(arm: Manipulator, held: DetectedObject, q: Array, goal: Pose) -> Trajectory:
    """Return a way for the TCP on which what is carried stays level: on straight lines, or else about level.

    Raises:
        UnreachableError: It is not reached, or not with what is carried level.
        CollisionError: Something is in the way.
    """
    start = arm.motion.forward(q)
    tops = [top(item) for item in arm.start.objects if item.id != held.id and not item.shape.is_granular]
    clear = max([*tops, arm.start.table_height]) + _SAFE + start.xyz[2] - bottom(held)
    failures: list[SkillError] = []
    for height in sorted({max(start.xyz[2], goal.xyz[2]), max(clear, goal.xyz[2])}, reverse=True):
        up = Pose(xyz=(*start.xyz[:2], max(height, start.xyz[2])), quat_xyzw=start.quat_xyzw)
        over = Pose(xyz=(*goal.xyz[:2], up.xyz[2]), quat_xyzw=goal.quat_xyzw)
        try:
            return arm.motion.plan_through(q, (up, over, goal), speed=arm.tempo.full)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
    carried = held.pose.rotation.T @ start.rotation
    try:
        around = arm.motion.plan_joints(q, arm.motion.ik(goal, q), speed=arm.tempo.full)
    except (UnreachableError, CollisionError):
        raise most_telling(failures) from None
    for row in around.q[:: max(1, len(around.q) // _LEVEL_SAMPLES)]:
        axis = arm.motion.forward(row).rotation @ carried.T[:, 2]
        if axis[2] < np.cos(_LEVEL_WITHIN):
            raise most_telling(failures)
    return around


def _directions(arm: Manipulator, held: DetectedObject, level: Pose) -> Iterator[tuple[Array, float]]:
    """Yield ways to tip: a horizontal unit vector (3,) from the container as it is held, and a turn of all about world z.

    Ways that lead over a finger come last, those that turn the hand the least come first.
    """
    tcp = arm.state.tcp_pose
    closing = tcp.rotation[:, 1]
    pads = [tcp.position + sign * closing * arm.gripper.width / 2.0 for sign in (1.0, -1.0)]
    angles = np.arctan2(closing[1], closing[0]) + np.arange(8) * np.pi / 4.0
    clear: list[tuple[float, Array]] = []
    over_finger: list[tuple[float, Array]] = []
    for angle in angles:
        direction = np.array([np.cos(angle), np.sin(angle), 0.0])
        lip = level.position + level.rotation @ _lip(held, level, direction)
        # The hand's palm lies behind the TCP: what falls out there meets it.
        palm = tcp.position - arm.geometry.palm_depth * tcp.rotation[:, 2]
        near = min(float(np.linalg.norm(lip - point)) for point in (*pads, palm))
        (clear if near > _FINGER_CLEARANCE else over_finger).append((-near, direction))
    for options in (clear, over_finger):
        options.sort(key=lambda option: round(option[0], 3))
        for yaw in _YAWS:
            for _, direction in options:
                yield direction, yaw


def _tipping(
    held: DetectedObject, vessel: DetectedObject, level: Pose, direction: Array, yaw: float, height: float
) -> list[Pose]:
    """Return the container's poses from upright to as far as it may be tipped, its lip staying over one point."""
    middle, radius, rim = _opening(vessel)
    turn = matrix_about_axis(_UP, yaw)
    towards = turn @ direction
    lip = _lip(held, level, direction)
    pivot = np.array([*(middle - _LEAD * radius * towards[:2]), rim + height])
    axis = np.cross(_UP, towards)
    poses = []
    for angle in np.arange(0.0, max(_TILTS) + _STEP, _STEP):
        rotation = matrix_about_axis(axis, float(angle)) @ turn @ level.rotation
        there = Pose.from_matrix(pivot - rotation @ lip, rotation)
        # The part of the container below the lip stays over the target's rim as well.
        hangs = float(pivot[2]) - bottom(replace(held, pose=there))
        poses.append(raised(there, max(hangs, 0.0)))
    return poses


def _lip(held: DetectedObject, level: Pose, direction: Array) -> Array:
    """Return the point of the rim over which it pours in a direction, in the container's frame, shape (3,)."""
    local = level.rotation.T @ direction
    return room_of(held).lip(local)


def _opening(vessel: DetectedObject) -> tuple[Array, float, float]:
    """Return the middle (2,), the radius and the height of the opening that is poured into, in the world."""
    room = mouth_of(vessel)
    middle = vessel.pose.position + vessel.pose.rotation @ np.array([*room.middle, 0.0])
    return middle[:2], float(room.half.min()), vessel.pose.xyz[2] + room.rim


def _drain(arm: Manipulator, name: str) -> None:
    """Wait until nothing more leaves the container."""
    deadline = arm.driver.time + _DRAIN_SECONDS
    scene = arm.look()
    left = contents(scene.objects, arm.find(name, scene))
    still = 0
    while left and still < 5 and arm.driver.time < deadline:
        arm.driver.wait(0.1)
        scene = arm.look()
        now = contents(scene.objects, arm.find(name, scene))
        still, left = (still + 1 if len(now) == len(left) else 0), now


def _levelled(pose: Pose) -> Pose:
    """Return the pose turned upright."""
    axis = pose.rotation[:, 2]
    cross = np.cross(axis, _UP)
    sine = float(np.linalg.norm(cross))
    if sine < 1e-6:
        return pose
    return Pose.from_matrix(
        pose.position, matrix_about_axis(cross / sine, float(np.arctan2(sine, axis @ _UP))) @ pose.rotation
    )
