"""Moving a part along its joint: a held handle led around a hinge or along a slide, and pushing with closed fingers.

The way of the hand is the part's own: each pose of the grip turned about the axis or moved along it. A hand that holds an upright bar
on an upright hinge need not turn with it, so ways on which the hand turns less are tried as well. The hand stops where what it presses
with along the way passes a limit, and every few millimetres it is looked whether the part follows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import Literal

import numpy as np

from robosandbox.driver import require
from robosandbox.errors import CollisionError, DrawerError, GraspError, Phase, SkillError, UnreachableError
from robosandbox.evidence import DrawerEvidence, GraspEvidence
from robosandbox.grasp.hand import FINGER_CLEARANCE, hand_pose, turned
from robosandbox.shapes.compound import PartJoint
from robosandbox.skills.primitives.gripping import empty_aperture
from robosandbox.skills.primitives.guarded import follow_free, follow_until
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT, Manipulator, most_telling, withdrawn
from robosandbox.spatial import matrix_about_axis, matrix_from_quat_xyzw
from robosandbox.types import Array, DetectedObject, Grasp, Pose, Trajectory
from robosandbox.world.parts import joint_of, part_value

# Share of the joints' speed limits at which a part is led, as for drawers.
SPEED = 0.12
# N along the way from which a part is stuck, and from which it resists, as for drawers.
MOST_FORCE, RESISTED = 20.0, 5.0
# Metres of the handle's way between two looks, and between two poses of the hand: the chord leaves an arc of 0.3 m by 0.2 mm.
_STEP = 0.02
# Share of a step that a part has to follow, for the play of a grip between two fingers.
_FOLLOWS = 0.4
# Share of the longest lever that a grip on a hinged part has, and metres that a handle stands away from what it is on.
_LEAST_LEVER = 0.5
# How much of the part's turn the hand makes, as a share, tried in this order.
_TURNS = (1.0, 0.7, 0.4)
# How much less sure a grip is that pulls by friction than one whose fingers push, as a ratio.
_RUBS = 0.8
# Leans of the hand about its closing line, radians, and the least cosine between its approach and the way from the robot's base.
_LEANS, _FROM_BEHIND = tuple(np.radians([0.0, 30.0, -30.0])), -0.3
# Metres by which what is held is wider than closed fingers.
_THINNEST = 0.001
# Sampled starts for a configuration: another grip is worth more than a harder search.
_RESTARTS = 3
# Grips that are tried.
_MOST_GRIPS = 48
_HOVERS = (HOVER_HEIGHT, 0.05, 0.03)
# Metres between each finger and the handle before they close.
_PRESHAPE = 0.008
# Where on a face it is pushed, shares of its half-extents; how squarely a face looks against the way, as a cosine; leans of the hand
# from along the way to downwards, radians; and faces that are tried.
_ON_FACE, _AGAINST = (0.0, 0.8, -0.8, 0.5, -0.5), 0.7
_PUSH_LEANS = tuple(np.radians([0.0, 35.0, 70.0]))
_MOST_FACES = 60
# Metres up to which two places to push at are one.
_SAME_PLACE = 0.04
# Share of its way before the end of which a part that stops has come to its stop.
_AT_ITS_STOP = 0.06
# Headings of a hand that presses, about its direction.
_YAWS = 8
# Metres before a button from which it is pressed, and beyond its travel that the hand goes, for servos to give.
_STAND_OFF, _BEYOND = 0.012, 0.003
# m/s of a hand that presses, as of a touch.
_PRESS_METRES_PER_SECOND = 0.01


@dataclass(frozen=True, slots=True)
class LedWay:
    """A grip on a part and the way on which it leads it.

    Attributes:
        grasp: Where the hand closes.
        approach: To before it.
        descent: From there to the grip.
        poses: The TCP at each step of the part's way, the first is the grip's.
        values: The joint's value at each.
    """

    grasp: Grasp
    approach: Trajectory
    descent: Trajectory
    poses: tuple[Pose, ...]
    values: tuple[float, ...]


def lead(arm: Manipulator, name: str, goals: Sequence[float]) -> tuple[float, float]:
    """Take hold of a part and lead it to a value of its joint; return the value reached and the most force along the way, N.

    Args:
        arm: The skill's manipulator.
        name: Id of the part.
        goals: Values of the joint, metres or radians, the best first: that to which the hand gets is taken.

    Raises:
        UnsupportedError: The driver does not tell how hard the hand pulls.
        GraspError: Nothing of it fits between the fingers, or they missed it.
        UnreachableError: Its handle, or its way, is out of reach.
        CollisionError: Something is in the way.
        DrawerError: It is locked or blocked, or the hand slipped off.
    """
    require(arm.driver, "wrist_wrench", "a part that is locked or blocked is told by how hard the hand pulls at it")
    part = arm.find(name)
    arm.ctx.enter(Phase.PLAN)
    arm.use(arm.look())
    way = _plan(arm, part, goals)
    aperture = min(arm.geometry.max_aperture, way.grasp.width + 2.0 * _PRESHAPE)
    arm.open_for(way.approach, aperture)
    follow_free(arm, way.approach, Phase.APPROACH)
    follow_free(arm, way.descent, Phase.DESCEND)
    arm.ctx.enter(Phase.GRASP)
    closed = arm.close_on(way.grasp.width)
    if closed < empty_aperture(arm.geometry, way.grasp.width):
        raise _no_grip(arm, part, "missed", closed)
    force = _led(arm, part, way)
    _let_go(arm, part)
    now = arm.find(name, arm.settle(name))
    return part_value(now), force


def push_part(arm: Manipulator, name: str, goal: float) -> tuple[float, float]:
    """Push a part to a value of its joint with the closed fingers; return the value reached and the most force along the way, N.

    Args:
        arm: The skill's manipulator.
        name: Id of the part.
        goal: Value of the joint, metres or radians.

    Raises:
        UnsupportedError: The driver does not tell how hard the hand pushes.
        UnreachableError: No face to push on, or its way, is in reach.
        CollisionError: Something is in the way.
        DrawerError: It is locked or blocked, or the hand slipped off.
    """
    require(arm.driver, "wrist_wrench", "a part that is locked or blocked is told by how hard the hand pushes at it")
    part = arm.find(name)
    arm.ctx.enter(Phase.PLAN)
    arm.use(arm.look())
    gripper = arm.spec.gripper
    if gripper is not None:
        arm.motion.open_to(gripper.geometry.min_aperture)
    approach, descent, poses, values = _pushing(arm, part, goal)
    if gripper is not None:
        arm.open_for(approach, 0.0)
    follow_free(arm, approach, Phase.APPROACH)
    follow_free(arm, descent, Phase.DESCEND)
    force = _follow_part(arm, part, poses, values, met=1)
    _withdraw(arm, part)
    return part_value(arm.find(name, arm.settle(name))), force


def press_part(arm: Manipulator, name: str) -> tuple[float, float]:
    """Press a part in with the closed fingers and come off it; return the share of its way that it went, and the most force, N.

    Raises:
        UnreachableError: It is out of reach.
        CollisionError: Something is in the way.
    """
    require(arm.driver, "wrist_wrench", "a button is pressed until it is felt to stop")
    part = arm.find(name)
    joint = joint_of(part)
    rest = part_value(part)
    end = joint.high if joint.high - rest >= rest - joint.low else joint.low
    span = abs(end - rest)
    axis = np.array(joint.axis) * (1.0 if end > rest else -1.0)
    arm.ctx.enter(Phase.PLAN)
    if arm.spec.gripper is not None:
        arm.open(0.0)
    arm.use(arm.look())
    failures: list[SkillError] = []
    q = arm.q
    for tcp in _pressing(arm, part, axis):
        start = _moved(tcp, -_STAND_OFF * axis)
        goal = _moved(tcp, (abs(end - rest) + _BEYOND) * axis)
        try:
            arm.motion.allow()
            descent = arm.line_to(start, _moved(start, -HOVER_HEIGHT * axis), speed=arm.tempo.near)
            approach = arm.motion.plan_joints(q, descent.q[0], speed=arm.tempo.free)
            arm.motion.allow(part.id, _owner(part))
            push = arm.motion.plan_line(descent.q[-1], goal, speed=SPEED)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            continue
        follow_free(arm, approach, Phase.APPROACH)
        follow_free(arm, descent, Phase.DESCEND)
        return _pressed(arm, part, push, axis, rest, span)
    raise most_telling(failures)


def _pressed(
    arm: Manipulator, part: DetectedObject, push: Trajectory, axis: Array, rest: float, span: float
) -> tuple[float, float]:
    force = 0.0

    def felt() -> bool:
        nonlocal force
        now = float(arm.force_on(part.id) @ axis)
        force = max(force, now)
        return now > MOST_FORCE

    # A servo trails its target by its damping over its stiffness, and presses with what it trails by.
    length = float(_STAND_OFF + span + _BEYOND)
    slow = max(1.0, length / _PRESS_METRES_PER_SECOND / max(push.duration, 1e-6))
    follow_until(arm, Trajectory(q=push.q, dt=slow * push.dt), Phase.TOUCH, felt)
    scene = arm.look()
    most = abs(part_value(arm.find(part.id, scene)) - rest) / span
    arm.use(scene)
    arm.motion.allow(part.id, _owner(part))
    away = _moved(arm.state.tcp_pose, -HOVER_HEIGHT * axis)
    arm.follow(arm.motion.plan_line(arm.q, away, speed=arm.tempo.leave), Phase.RETREAT)
    return most, force


def _pressing(arm: Manipulator, part: DetectedObject, axis: Array) -> Iterator[Pose]:
    """Yield TCP poses with the fingertips at the middle of a part's face, pointing along an axis (3,); the least turned first."""
    robot = arm.spec
    tip = robot.gripper.geometry.tip_depth if robot.gripper else 0.0
    centre = part.shape.centre(part)
    face = centre - axis * float(part.shape.support(part, -axis[None])[0] + axis @ centre)
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    hand = arm.state.tcp_pose.rotation
    rotations = []
    for k in range(_YAWS):
        y = turned(across, axis, 2.0 * math.pi * k / _YAWS)
        rotations.append(np.column_stack([np.cross(y, axis), y, axis]))
    rotations.sort(key=lambda rotation: -round(float(np.trace(hand.T @ rotation)), 6))
    for rotation in rotations:
        yield Pose.from_matrix(face - tip * axis, rotation)


def _plan(arm: Manipulator, part: DetectedObject, goals: Sequence[float]) -> LedWay:
    """Return the first grip from which the hand can lead a part to one of some values, the best value first."""
    grasps = _handles(arm, part)
    if not grasps:
        raise _no_grip(arm, part, "none_found", arm.gripper.width)
    failures: list[SkillError] = []
    starts: dict[int, Array] = {}
    for goal in goals:
        for number, grasp in enumerate(grasps):
            try:
                if number not in starts:
                    starts[number] = _free_at(arm, grasp)
                return _way(arm, part, grasp, starts[number], goal)
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
    raise most_telling(failures)


def _handles(arm: Manipulator, part: DetectedObject) -> list[Grasp]:
    """Return grips on the pieces of a part that have a lever there, the surest first.

    Fingers close across two faces of a piece's own box, and the hand comes along a third axis, straight or leaning, from the side
    on which the robot stands. Whether there is room for it is the collision checker's to say.
    """
    joint, base = joint_of(part), arm.spec.base_position
    axis, anchor = np.array(joint.axis), np.array(joint.anchor)
    assert part.geometry is not None
    rotation, origin = part.pose.rotation, part.pose.position
    points = origin + part.geometry.outer @ rotation.T - anchor
    longest = float(np.linalg.norm(np.cross(points, axis), axis=1).max())
    found: list[tuple[tuple[float, ...], Grasp]] = []
    cost: tuple[float, ...]
    for piece in part.geometry.pieces:
        axes = rotation @ matrix_from_quat_xyzw(piece.quat_xyzw)
        middle, half = origin + rotation @ np.array(piece.centre), piece.hull.half_extents
        if joint.kind == "hinge" and np.linalg.norm(np.cross(middle - anchor, axis)) < _LEAST_LEVER * longest:
            continue
        away = middle - base
        away = away / max(float(np.linalg.norm(away)), 1e-9)
        for c, a in permutations(range(3), 2):
            long = 3 - c - a
            spare = max(0.0, float(half[long]) - arm.geometry.finger_width / 2.0)
            for sign, lean, along in product((1.0, -1.0), _LEANS, dict.fromkeys((0.0, spare / 2.0, -spare / 2.0))):
                approach = turned(sign * axes[:, a], axes[:, c], lean)
                if approach @ away < _FROM_BEHIND:
                    continue
                point = middle + along * axes[:, long]
                grasp = _grip(arm, part, point, axes[:, c], approach, 2.0 * float(half[c]), float(half[a]))
                if grasp is not None:
                    # A hand that comes from where the robot stands has its arm behind it.
                    straight = round(max(0.0, float(approach @ away)), 1)
                    cost = (-_sure(grasp, joint) - straight, abs(lean), abs(along))
                    found.append((cost, grasp))
    # The best of each direction of the hand first: where one has no room, its neighbours have none either.
    turns: dict[tuple[float, ...], int] = {}
    ranked = []
    for cost, grasp in sorted(found, key=lambda one: one[0]):
        way = tuple(grasp.tcp_pose.rotation[:, 1:].round(1).ravel() + 0.0)
        turns[way] = turns.get(way, -1) + 1
        ranked.append(((turns[way], *cost), grasp))
    return [grasp for _, grasp in sorted(ranked, key=lambda one: one[0])[:_MOST_GRIPS]]


def _grip(
    arm: Manipulator, part: DetectedObject, point: Array, closing: Array, approach: Array, width: float, near: float
) -> Grasp | None:
    """Return the grip that closes on a width around a point, metres; None where fingers or palm have no room."""
    geometry = arm.geometry
    if not geometry.min_aperture + _THINNEST < width < geometry.max_aperture - 2.0 * FINGER_CLEARANCE:
        return None
    pose = hand_pose(
        geometry,
        point=point,
        closing=closing,
        approach=approach,
        width=width,
        near=near,
        floor=-math.inf,
        ceiling=math.inf,
    )
    return None if pose is None else Grasp(object=part.id, tcp_pose=pose, width=width, quality=1.0, how="side")


def _sure(grasp: Grasp, joint: PartJoint) -> float:
    """Return how surely a grip leads the part: fingers that close along its way push it, others rub on it."""
    axis = np.array(joint.axis)
    if joint.kind == "hinge":
        axis = np.cross(axis, grasp.tcp_pose.position - np.array(joint.anchor))
        axis /= max(float(np.linalg.norm(axis)), 1e-9)
    closing = abs(float(grasp.tcp_pose.rotation[:, 1] @ axis))
    approach = abs(float(grasp.tcp_pose.rotation[:, 2] @ axis))
    return round(max(closing, _RUBS * approach), 1)


def _free_at(arm: Manipulator, grasp: Grasp) -> Array:
    """Return a configuration at a grip in which the open hand touches nothing."""
    motion = arm.motion
    motion.open_to(min(arm.geometry.max_aperture, grasp.width + 2.0 * _PRESHAPE))
    motion.allow()
    failure: UnreachableError | None = None
    for seed in (arm.q, arm.spec.home_q):
        try:
            q = motion.ik(grasp.tcp_pose, seed, restarts=_RESTARTS)
        except UnreachableError as error:
            failure = error
            continue
        if (met := motion.touch(q)) is not None:
            raise met
        return q
    assert failure is not None
    raise failure


def _way(arm: Manipulator, part: DetectedObject, grasp: Grasp, q_grasp: Array, goal: float) -> LedWay:
    """Return the way to a grip and along the part's joint to a value.

    Raises:
        UnreachableError: Part of it is out of reach.
        CollisionError: Something is in the way.
    """
    motion, failures = arm.motion, list[SkillError]()
    values = _values(part, grasp.tcp_pose, goal)
    for share in _TURNS if joint_of(part).kind == "hinge" else (1.0,):
        poses = [_at(part, grasp.tcp_pose, value, share) for value in values]
        try:
            motion.allow(part.id, _owner(part))
            q = q_grasp
            for pose in poses[1:]:
                q = motion.plan_line(q, pose, speed=SPEED).q[-1]
            motion.ik(withdrawn(poses[-1], _HOVERS[-1]), q)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            continue
        for height in _HOVERS:
            try:
                motion.allow()
                before = motion.ik(withdrawn(grasp.tcp_pose, height), q_grasp)
                motion.allow(part.id)
                descent = motion.plan_line(before, grasp.tcp_pose, speed=arm.tempo.near)
                motion.allow()
                approach = motion.plan_joints(arm.q, before, speed=arm.tempo.free)
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
                continue
            return LedWay(grasp, approach, descent, tuple(poses), tuple(values))
    raise most_telling(failures)


def _values(part: DetectedObject, grip: Pose, goal: float) -> list[float]:
    """Return values of a joint from where a part is to a goal, so that a grip goes no farther than a step between two."""
    joint, here = joint_of(part), part_value(part)
    reach = 1.0
    if joint.kind == "hinge":
        reach = float(np.linalg.norm(np.cross(grip.position - np.array(joint.anchor), np.array(joint.axis))))
    count = max(2, math.ceil(abs(goal - here) * reach / _STEP) + 1)
    return [float(value) for value in np.linspace(here, goal, count)]


def _at(part: DetectedObject, grip: Pose, value: float, share: float) -> Pose:
    """Return a grip where it is when the part's joint has a value, the hand turned by a share of the part's turn."""
    joint, way = joint_of(part), value - part_value(part)
    axis, anchor = np.array(joint.axis), np.array(joint.anchor)
    if joint.kind == "slide":
        return _moved(grip, way * axis)
    place = anchor + matrix_about_axis(axis, way) @ (grip.position - anchor)
    return Pose.from_matrix(place, matrix_about_axis(axis, share * way) @ grip.rotation)


def _pushing(
    arm: Manipulator, part: DetectedObject, goal: float
) -> tuple[Trajectory, Trajectory, Sequence[Pose], Sequence[float]]:
    """Return the ways to a face of a part and along its joint, as poses with the joint's values."""
    motion, failures, q_now = arm.motion, list[SkillError](), arm.q
    for tcp, direction in _faces(arm, part, goal):
        start = _moved(tcp, -_STAND_OFF * direction)
        values = _values(part, tcp, goal)
        for share in _TURNS if joint_of(part).kind == "hinge" else (1.0,):
            # What stops it lies a little before where the hand goes on to, for servos to give.
            poses = [start, *(_at(part, tcp, value, share) for value in values)]
            try:
                motion.allow()
                descent = arm.line_to(start, withdrawn(start, _HOVERS[-1]), speed=arm.tempo.near)
                motion.allow(part.id, _owner(part))
                q = descent.q[-1]
                for pose in poses[1:]:
                    q = motion.plan_line(q, pose, speed=SPEED).q[-1]
                motion.allow()
                approach = motion.plan_joints(q_now, descent.q[0], speed=arm.tempo.free)
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
                continue
            return approach, descent, poses, [values[0], *values]
    if not failures:
        raise _no_grip(arm, part, "none_found", 0.0)
    raise most_telling(failures)


def _faces(arm: Manipulator, part: DetectedObject, goal: float) -> Iterator[tuple[Pose, Array]]:
    """Yield TCP poses with the fingertips on faces of a part that look against its way, and the way there, the longest lever first."""
    joint, robot, hand = joint_of(part), arm.spec, arm.state.tcp_pose.rotation
    axis, anchor = np.array(joint.axis), np.array(joint.anchor)
    sign = 1.0 if goal > part_value(part) else -1.0
    assert part.geometry is not None
    tip = robot.gripper.geometry.tip_depth if robot.gripper else 0.0
    found: dict[tuple[float, ...], tuple[tuple[float, ...], Pose, Array]] = {}
    for piece in part.geometry.pieces:
        axes = part.pose.rotation @ matrix_from_quat_xyzw(piece.quat_xyzw)
        middle, half = part.pose.position + part.pose.rotation @ np.array(piece.centre), piece.hull.half_extents
        for k, side in product(range(3), (1.0, -1.0)):
            normal = side * axes[:, k]
            i, j = (n for n in range(3) if n != k)
            for u, v in product(_ON_FACE, _ON_FACE):
                point = middle + half[k] * normal + u * half[i] * axes[:, i] + v * half[j] * axes[:, j]
                way = sign * (np.cross(axis, point - anchor) if joint.kind == "hinge" else axis)
                lever = float(np.linalg.norm(way))
                if lever < 1e-6 or normal @ way / lever > -_AGAINST:
                    continue
                way = way / lever
                for lean in _PUSH_LEANS:
                    level = np.cross(way, [0.0, 0.0, 1.0])
                    if np.linalg.norm(level) < 1e-3:
                        level = np.array([1.0, 0.0, 0.0])
                    level = level / np.linalg.norm(level)
                    approach = turned(way, level, -lean)
                    for y in (level, -level, np.cross(approach, level)):
                        rotation = np.column_stack([np.cross(y, approach), y, approach])
                        pose = Pose.from_matrix(point - tip * approach, rotation)
                        turn = -float(np.trace(hand.T @ rotation))
                        key = (*(pose.position / _SAME_PLACE).round(), *rotation[:, 1].round(1), round(lean, 1))
                        found.setdefault(key, ((-round(lever, 1), round(turn + lean, 2)), pose, way))
    best = sorted(found.values(), key=lambda one: one[0])
    yield from ((pose, way) for _, pose, way in best[:_MOST_FACES])


def _led(arm: Manipulator, part: DetectedObject, way: LedWay) -> float:
    """Lead a part along its way by the grip; return the most that the hand pressed with along it, N."""
    return _follow_part(arm, part, way.poses, way.values, met=0)


def _follow_part(
    arm: Manipulator, part: DetectedObject, poses: Sequence[Pose], values: Sequence[float], *, met: int
) -> float:
    """Move the hand along poses while a part follows; return the most that it pressed with along them, N.

    Args:
        arm: Its hand is at the first pose.
        part: As it was seen then.
        poses: The TCP's.
        values: What the part's joint is to be at each.
        met: Number of the pose from which on the part is touched.

    Raises:
        DrawerError: It does not follow.
    """
    force, name = 0.0, part.id
    arm.ctx.enter(Phase.SLIDE)
    for number in range(1, len(poses)):
        direction = poses[number].position - poses[number - 1].position
        direction = direction / max(float(np.linalg.norm(direction)), 1e-9)

        def felt(direction: Array = direction) -> bool:
            nonlocal force
            now = float(arm.force_on(name) @ direction)
            force = max(force, now)
            return now > MOST_FORCE

        arm.use(arm.look())
        arm.motion.allow(name, _owner(part))
        stopped = follow_until(arm, arm.motion.plan_line(arm.q, poses[number], speed=SPEED), Phase.SLIDE, felt)
        now = part_value(arm.find(name, arm.look()))
        wanted, gone = values[number] - values[0], now - values[0]
        if stopped and abs(values[-1] - now) < _AT_ITS_STOP * abs(values[-1] - values[0]):
            return force
        if stopped or (
            number > met and gone < _FOLLOWS * wanted if wanted > 0.0 else number > met and gone > _FOLLOWS * wanted
        ):
            (_withdraw if met else _let_go)(arm, part)
            raise stuck(part, arm.find(name, arm.look()), values[-1], force)
    return force


def _let_go(arm: Manipulator, part: DetectedObject) -> None:
    """Open the fingers and go back along the hand's approach, else up."""
    arm.ctx.enter(Phase.RELEASE)
    arm.open(min(arm.geometry.max_aperture, arm.gripper.width + 2.0 * _PRESHAPE))
    _withdraw(arm, part)


def _withdraw(arm: Manipulator, part: DetectedObject) -> None:
    """Take the hand back along its approach, else up."""
    arm.use(arm.look())
    arm.motion.allow(part.id, _owner(part))
    state = arm.state
    for distance in _HOVERS:
        try:
            back = arm.motion.plan_line(state.q, withdrawn(state.tcp_pose, distance), speed=arm.tempo.near)
        except (UnreachableError, CollisionError):
            continue
        arm.follow(back, Phase.RETREAT)
        return
    arm.rise(HOVER_HEIGHT, Phase.RETREAT)


def stuck(before: DetectedObject, now: DetectedObject, wanted: float, force: float) -> DrawerError:
    """Return the error of a part that did not follow the hand.

    Args:
        before: As it was.
        now: As it is seen.
        wanted: The value asked for, metres or radians.
        force: The most that the hand felt along the way, N.
    """
    joint = joint_of(now)
    unit, scale = ("deg", 180.0 / math.pi) if joint.kind == "hinge" else ("mm", 1e3)
    gone, asked = (abs(value - part_value(before)) * scale for value in (part_value(now), wanted))
    reason: Literal["locked", "blocked", "slipped"] = "slipped"
    if force > RESISTED:
        reason = "blocked" if gone > 0.1 * asked else "locked"
    figures = f"it followed {gone:.0f} of {asked:.0f} {unit} and resisted with {force:.0f} N"
    said = {
        "locked": f"{now.id} does not move: {figures}; it is locked or blocked",
        "blocked": f"{now.id} stops on its way: {figures}; clear what is in its way",
        "slipped": f"the hand slipped off {now.id}: {figures}; try again",
    }
    return DrawerError(
        said[reason],
        phase=Phase.SLIDE,
        evidence=DrawerEvidence(
            drawer=now.id, reason=reason, wanted=wanted, opening=part_value(now), force=force, blocking=()
        ),
    )


def _no_grip(
    arm: Manipulator, part: DetectedObject, reason: Literal["none_found", "missed"], aperture: float
) -> GraspError:
    geometry = arm.geometry
    said = (
        f"nothing of {part.id} that the fingers could lead it by is {geometry.min_aperture * 1000:.0f} to "
        f"{geometry.max_aperture * 1000:.0f} mm wide with room around it"
        if reason == "none_found"
        else f"the fingers closed to {aperture * 1000:.1f} mm and missed {part.id}; look again"
    )
    return GraspError(
        said,
        phase=Phase.PLAN if reason == "none_found" else Phase.GRASP,
        evidence=GraspEvidence(
            object=part.id,
            reason=reason,
            object_width=None,
            aperture=aperture,
            max_aperture=geometry.max_aperture,
        ),
    )


def _moved(pose: Pose, offset: Array) -> Pose:
    return Pose.from_matrix(pose.position + offset, pose.rotation)


def _owner(part: DetectedObject) -> str:
    """Return what a part is on: `cupboard` of `cupboard.door`."""
    return part.id.rpartition(".")[0] or part.id
