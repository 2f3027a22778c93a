"""Ways on which a hand moves a part along its joint: a grip led around a hinge or along a slide, or a face pushed.

The way of the hand is the part's own: each pose of the grip turned about the axis or moved along it. A hand that holds an upright bar
on an upright hinge need not turn with it, so ways on which the hand turns less are tried as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import pairwise, permutations, product
from typing import Literal, TypeVar

import numpy as np

from robosandbox.errors import CollisionError, GraspError, Phase, SkillError, UnreachableError
from robosandbox.evidence import CollisionEvidence, GraspEvidence
from robosandbox.grasp.hand import FINGER_CLEARANCE, hand_pose, turned
from robosandbox.shapes.body import PartJoint
from robosandbox.skills.primitives.manipulator import HOVER_HEIGHT, Manipulator, most_telling, moved, withdrawn
from robosandbox.skills.primitives.strokes import flange_depth
from robosandbox.spatial import cross, matrix_about_axis, matrix_from_quat_xyzw
from robosandbox.types import Array, DetectedObject, Grasp, Pose, Trajectory
from robosandbox.values import frozen
from robosandbox.world.effects import load_of
from robosandbox.world.parts import brought_to, joint_of, lever, part_value

T = TypeVar("T")

# Share of the joints' speed limits at which a part is led at most: what servos trail by leads the hand off its line, and it holds the part
# (halved, drawer tasks take 21 % longer, doubled 11 % less; all succeed).
SPEED = 0.12
# Metres between each finger and the handle before they close.
PRESHAPE = 0.012
# Metres before what is pushed at which the closed fingers come down.
STAND_OFF = 0.012
HOVERS = (HOVER_HEIGHT, 0.05, 0.035)
# Shares of its way to an end that a handle which a spring turns back is turned, the most first: nobody sees what frees its latch.
_FREES = (1.0, 0.85, 0.7)
# Metres of the handle's way after which it is looked whether the part follows at all, and between two poses of the hand around a hinge:
# the chord leaves an arc of 0.3 m by 0.2 mm.
_TRIAL, _STEP = 0.005, 0.02
# Metres before the end of its range from which a part is pushed slowly, since it meets its stop there, and beyond it, for servos to give.
_STOP_WITHIN, _PRESS = 0.008, 0.002
# Share of the longest lever that a grip on a hinged part has.
_LEAST_LEVER = 0.5
# Shares of a step at which it is looked whether a link is in the part's way.
_ALONG = (0.0, 0.5, 1.0)
# How much of the part's turn the hand makes, as a share, tried in this order.
_TURNS = (1.0, 0.7, 0.4)
# How much less sure a grip is that pulls by friction than one whose fingers push, as a ratio.
_RUBS = 0.8
# Leans of the hand about its closing line, radians, and the least cosine between its approach and the way from where it is at home.
_LEANS, _FROM_BEHIND = tuple(np.radians([0.0, 30.0, -30.0])), -0.3
# Turns of the hand about the length of what it holds, radians, tried in this order: a hand that is square to a bar may have no room
# between what is over and under it.
_ROLLS = ((0.0,), tuple(np.radians([10.0, -10.0, 25.0, -25.0, 45.0, -45.0])))
# Metres of the fingertips by which a part is held at the least.
_TIPS = 0.008
# Metres by which what is held is wider than closed fingers.
_THINNEST = 0.001
# Least cosine between the closing line and the way of what fingers lead that do not hold it.
_HOOKS = 0.7
# Metres more than the play of closed fingers that one of them goes to lead a part: their own springs and margins.
_PLAY = 0.005
# Sampled starts for a configuration: another grip is worth more than a harder search.
_RESTARTS = 3
# Grips that are tried.
_MOST_GRIPS = 96
# Where on a face it is pushed, shares of its half-extents; how squarely a face looks against the way, as a cosine; leans of the hand
# from along the way to downwards, radians; places that are tried far apart, and then nearer ones with each direction of the hand.
_ON_FACE, _AGAINST = (0.0, 0.8, -0.8, 0.5, -0.5), 0.7
_PUSH_LEANS = tuple(np.radians([0.0, 35.0, 44.0, 52.5, 70.0, 90.0]))
_MOST_FAR, _MOST_NEAR = 60, 8
# Pushes whose approach may be blocked: each is searched for by sampling, which takes longest.
_MOST_BLOCKED = 6
# Metres before a face that is pushed at which nothing of the hand touches the part yet.
_BEFORE = 0.003
# Metres between places to push at that are tried first, and then between others: room that is as high as a finger is missed by the first.
_FAR, _NEAR = 0.04, 0.02
# Cosine between two directions from which on they are not at a right angle.
_LEVEL = 0.05
# Cosine to its approach up to which a hand pushes with its side: what its tips press down does not slide along it.
_BY_SIDE = 0.7
# Headings of a hand that presses, about its direction.
_YAWS = 8


@frozen
class PartWay:
    """Motions that bring the hand to a part, and poses on which it moves it.

    Attributes:
        grasp: Where the hand closes; None where it pushes.
        approach: To before it.
        descent: From there to the first pose.
        poses: The TCP at each step of the part's way; the first is the grip's, or the one from which it is pushed.
        steps: From each pose to the next.
        values: The joint's value at each pose.
        ends_at_stop: Whether the last step meets the end of the joint's range.
        aperture: How far apart the fingers of a hand that pushes are, metres; None without fingers, and where it grips.
    """

    grasp: Grasp | None
    approach: Trajectory
    descent: Trajectory
    poses: tuple[Pose, ...]
    steps: tuple[Trajectory, ...]
    values: tuple[float, ...]
    ends_at_stop: bool
    aperture: float | None = None


@frozen
class LatchedWay:
    """Motions that turn a handle and lead what it is on, the hand never off it.

    Attributes:
        turn: Of the handle, with the way to it.
        lead: Of what it is on, from where the handle is turned.
        back: Of the handle to where its spring holds it, so that it does not strike the hand that lets it go.
    """

    turn: PartWay
    lead: PartWay
    back: PartWay


# What it costs to push a face, the TCP's pose there, and the rest of it.
_Place = tuple[tuple[float, ...], Pose, "_Face"]
# A push by its number: what the hand may touch, whether the palm may not meet the part first, the share of the part's turn that the hand
# makes, and whether the part's end slides along the fingers.
_Pushing = tuple[int, tuple[str, ...], bool, float, bool]


@frozen
class _Face:
    """Pose of a hand at a face, and the finger with which it pushes it.

    Attributes:
        tcp: Its pose.
        way: Along which the face goes from there, shape (3,).
        finger: The middle of what pushes, shape (3,), metres.
        spans: Whether that lies on the part on both sides of its hinge, where it would hold what it is to turn.
    """

    tcp: Pose
    way: Array
    finger: Array
    spans: bool


class _Comings:
    """Ways of the hand from where it is to a pose: each is planned once, whatever is done from there.

    Args:
        arm: Whose hand, its fingers as far apart as they come.
        tcp: The pose.
        allowed: What the hand may touch on the last of the way.
        near: A configuration (n,) in which the hand is there; any when left out.
    """

    def __init__(self, arm: Manipulator, tcp: Pose, allowed: Sequence[str] = (), near: Array | None = None) -> None:
        self._arm, self._tcp, self._allowed, self._near = arm, tcp, allowed, near
        self._q = arm.q
        self._found: dict[tuple[str, float], Trajectory | SkillError] = {}

    def descent(self, height: float) -> Trajectory:
        """Return the straight way to the pose from so many metres back; raises as `plan_line`."""

        def planned() -> Trajectory:
            self._arm.motion.allow(*self._allowed)
            start = withdrawn(self._tcp, height)
            return self._arm.line_to(self._tcp, start, speed=self._arm.tempo.near, near=self._near)

        return self._once(("descent", height), planned)

    def approach(self, height: float) -> Trajectory:
        """Return the way to where a descent begins, which takes longest where it is blocked; raises CollisionError."""

        def planned() -> Trajectory:
            self._arm.motion.allow()
            return self._arm.motion.plan_joints(self._q, self.descent(height).q[0], speed=self._arm.tempo.free)

        return self._once(("approach", height), planned)

    def is_lost(self, height: float, *, approach: bool = False) -> bool:
        """Tell whether the descent or the approach, or the approach alone, was looked for in vain."""
        looked = ("approach",) if approach else ("descent", "approach")
        return any(isinstance(self._found.get((way, height)), SkillError) for way in looked)

    def _once(self, key: tuple[str, float], plan: Callable[[], Trajectory]) -> Trajectory:
        if key not in self._found:
            try:
                self._found[key] = plan()
            except (UnreachableError, CollisionError) as error:
                self._found[key] = error
        found = self._found[key]
        if isinstance(found, SkillError):
            raise found
        return found


class _Leading:
    """A grip that leads a part along its joint, and how far it is known to lead it.

    Args:
        arm: Whose hand.
        part: What is led.
        grasp: Where the hand closes.
        share: Of the part's turn, by which the hand turns.
        comings: Ways to the grip.

    Attributes:
        reached: Value of the joint to which a way led that ended before its goal; where the part is before one did.
        ends_within: How far from where the part is that way could not go, metres or radians.
    """

    def __init__(self, arm: Manipulator, part: DetectedObject, grasp: Grasp, share: float, comings: _Comings) -> None:
        self._arm, self._part, self._grasp, self._share, self._comings = arm, part, grasp, share, comings
        self.reached, self.ends_within = part_value(part), math.inf

    def to(self, goal: float) -> PartWay:
        """Return the way to the grip and along the part's joint to a value.

        Raises:
            UnreachableError: Part of it is out of reach.
            CollisionError: Something is in the way.
        """
        arm, part, grasp, motion, failures = self._arm, self._part, self._grasp, self._arm.motion, list[SkillError]()
        motion.open_to(opened_for(arm, grasp))
        tcp, values = grasp.tcp_pose, _values(part, grasp.tcp_pose, goal)
        poses = _along(part, tcp, values[1:], self._share)
        if is_hook(arm, grasp.width):
            # A finger comes against it first.
            way = math.copysign(arm.geometry.min_aperture - grasp.width + _PLAY, goal - part_value(part))
            poses = tuple(moved(pose, way * _way(joint_of(part), pose.position)) for pose in poses)
        here, ended, within = part_value(part), list[Array](), list[float]()
        for height in HOVERS:
            steps: list[Trajectory] = []
            try:
                descent = self._comings.descent(height)
                if any(np.allclose(descent.q[-1], q) for q in ended):
                    continue
                if self._comings.is_lost(height, approach=True):
                    self._comings.approach(height)
                motion.allow(*around(part), *_load(arm, part))
                steps.extend(_steps(arm, descent.q[-1], poses))
                _check_beside(arm, part, steps, values)
                approach = self._comings.approach(height)
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
                if not steps:
                    continue
                is_cut = len(steps) < len(poses)
                within.append(abs(values[len(steps) + 1] - here) if is_cut else math.inf)
                if is_cut:
                    ended.append(steps[0].q[0])
                    self.reached = max(self.reached, values[len(steps)], key=lambda value: abs(value - here))
                continue
            return PartWay(grasp, approach, descent, (tcp, *poses), tuple(steps), tuple(values), _is_end(part, goal))
        # What never came to its first step may come to it, and what was led all the way ended elsewhere.
        self.ends_within = max(within, default=math.inf)
        raise most_telling(failures)


def touched(part: DetectedObject) -> tuple[str, ...]:
    """Return what planners call the body that moves: a drawer's sliding box, or the part itself."""
    return (f"{part.id}/box",) if part.shape.opens else (part.id,)


def around(part: DetectedObject) -> tuple[str, ...]:
    """Return what the hand may touch while the part moves: itself, and of a part what it is on."""
    owner = part.id.rpartition(".")[0]
    return (*touched(part), owner) if owner and not part.shape.opens else touched(part)


def plan_lead(arm: Manipulator, part: DetectedObject, goals: Sequence[float]) -> PartWay:
    """Return the first grip from which the hand can lead a part to one of some values of its joint, the best value first.

    Raises:
        GraspError: Nothing of it fits between the fingers.
        UnreachableError: Its handle, or its way, is out of reach.
        CollisionError: Something is in the way.
    """
    found, failures = _leads(arm, part, goals)
    if isinstance(found, PartWay):
        return found
    if not failures:
        raise no_grip(arm, part, "none_found", arm.gripper.width)
    # What stands in the way tells more than that there is no room for fingers at the part itself.
    in_the_way = [error for error in failures if not _is_own(part, error)]
    raise arm.clearest(in_the_way or failures)


def plan_lead_partly(arm: Manipulator, part: DetectedObject, goals: Sequence[float]) -> PartWay:
    """Return the way on which the hand leads a part farthest towards the last of some values, where none leads it all the way.

    Raises:
        GraspError: Nothing of it fits between the fingers.
        UnreachableError: Its handle, or all of its way, is out of reach.
        CollisionError: Something is in the way.
    """
    here = part_value(part)
    found, failures = _leads(arm, part, goals[-1:])
    if isinstance(found, PartWay):
        return found
    for leading in sorted(found, key=lambda one: -abs(one.reached - here)):
        if abs(leading.reached - here) * lever(part) <= _TRIAL:
            break
        try:
            return leading.to(leading.reached)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
    if not failures:
        raise no_grip(arm, part, "none_found", arm.gripper.width)
    raise most_telling(failures)


def _leads(
    arm: Manipulator, part: DetectedObject, goals: Sequence[float]
) -> tuple[PartWay | list[_Leading], list[SkillError]]:
    """Return the first way on which the hand leads a part to one of some values, else the grips that lead it less far; and what failed."""
    failures: list[SkillError] = []
    here, is_knob = part_value(part), _is_knob(arm, part)
    # A hand that turns with the part does not turn in its grip: one that turns less is tried where no grip allows that.
    turns = _TURNS[:1] if is_knob else _turns(arm, part)
    rolled: dict[Sequence[float], list[Grasp]] = {}
    free: dict[tuple[Sequence[float], int], _Comings | None] = {}
    leadings: dict[tuple[Sequence[float], int, float], _Leading] = {}
    # A grip with the hand turned about the bar that leads it all the way is better than a square one that does not.
    for goal, rolls in product(goals, _ROLLS[:1] if is_knob else _ROLLS):
        grasps = rolled.get(rolls) or rolled.setdefault(rolls, _handles(arm, part, rolls))
        for share, (number, grasp) in product(turns, enumerate(grasps)):
            key = rolls, number
            try:
                if key not in free:
                    free[key] = None
                    free[key] = _Comings(arm, grasp.tcp_pose, touched(part), _free(arm, grasp))
                if (comings := free[key]) is None:
                    continue
                leading = leadings.setdefault((*key, share), _Leading(arm, part, grasp, share, comings))
                # What ends a way ends one that leads farther.
                if abs(goal - here) < leading.ends_within:
                    return leading.to(goal), failures
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
    return list(leadings.values()), failures


def plan_latched(arm: Manipulator, part: DetectedObject, handle: DetectedObject, goals: Sequence[float]) -> LatchedWay:
    """Return the first grip on a handle with which the hand can turn it and then lead the part that it is on, the best value first.

    Args:
        arm: Whose hand.
        part: What is led.
        handle: What is turned, on it.
        goals: Values of the part's joint, metres or radians.

    Raises:
        GraspError: Nothing of the handle fits between the fingers.
        UnreachableError: The handle, or its way, is out of reach.
        CollisionError: Something is in the way.
    """
    failures: list[SkillError] = []
    joint, here = joint_of(handle), part_value(handle)
    ends = [end for end in (joint.high, joint.low) if math.isfinite(end)]
    turned_to = [here + share * (end - here) for share, end in product(_FREES, ends)]
    for rolls in _ROLLS:
        grasps = _handles(arm, handle, rolls)
        free: dict[int, _Comings | None] = {}
        for goal, angle, (number, grasp) in product(goals, turned_to, enumerate(grasps)):
            try:
                if number not in free:
                    free[number] = None
                    free[number] = _Comings(arm, grasp.tcp_pose, touched(handle), _free(arm, grasp))
                if (comings := free[number]) is not None:
                    turn = _Leading(arm, handle, grasp, 1.0, comings).to(angle)
                    return _led_on(arm, part, handle, turn, goal)
            except (UnreachableError, CollisionError) as error:
                failures.append(error)
    if not failures:
        raise no_grip(arm, handle, "none_found", arm.gripper.width)
    raise most_telling(failures)


def _led_on(arm: Manipulator, part: DetectedObject, handle: DetectedObject, turn: PartWay, goal: float) -> LatchedWay:
    """Return the way along a part's joint to a value from where the hand has turned the handle on it, and back with the handle.

    Raises:
        UnreachableError: Part of it is out of reach.
        CollisionError: Something is in the way.
    """
    tcp, failures = turn.poses[-1], list[SkillError]()
    values = _values(part, tcp, goal)
    for share in _turns(arm, part):
        poses = (tcp, *_along(part, tcp, values[1:], share))
        returns = tuple(_along(part, pose, (goal,), share)[0] for pose in reversed(turn.poses))
        load = _load(arm, part)
        arm.motion.allow(*touched(handle), *touched(part), *load)
        try:
            steps = tuple(_steps(arm, turn.steps[-1].q[-1], poses[1:]))
            _check_beside(arm, part, steps, values)
            arm.motion.allow(*touched(handle), *touched(part), *load)
            back = tuple(_steps(arm, steps[-1].q[-1], returns[1:]))
            arm.motion.plan_line(back[-1].q[-1], withdrawn(returns[-1], HOVERS[-1]), speed=SPEED)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            continue
        lead = PartWay(turn.grasp, turn.approach, turn.descent, poses, steps, tuple(values), _is_end(part, goal))
        at_rest = PartWay(turn.grasp, turn.approach, turn.descent, returns, back, turn.values[::-1], False)
        return LatchedWay(turn, lead, at_rest)
    raise most_telling(failures)


def spring_force(part: DetectedObject, value: float, point: Array) -> float:
    """Return the force at a point (3,) of a hinged part with which its spring resists when its joint has a value, N."""
    joint = joint_of(part)
    return abs(value - part_value(part)) * joint.stiffness / max(_arm_of(joint, point), 1e-6)


def _turns(arm: Manipulator, part: DetectedObject) -> tuple[float, ...]:
    """Return shares of a part's turn that the hand may make; none of it where the hand cannot turn so."""
    joint = joint_of(part)
    if joint.kind == "slide":
        return _TURNS[:1]
    turn = matrix_about_axis(np.array(joint.axis), 0.5)
    return _TURNS if arm.planning.can_face(turn @ arm.state.tcp_pose.rotation) else (0.0,)


def jams(arm: Manipulator, part: DetectedObject) -> bool:
    """Tell whether a grip on a part jams as that turns: the hand cannot turn with it."""
    return _turns(arm, part) == (0.0,)


def _load(arm: Manipulator, part: DetectedObject) -> tuple[str, ...]:
    """Return the ids of what lies in a part or on it: it goes where that goes."""
    return load_of(arm.planning.seen, part.id)


def _is_own(part: DetectedObject, error: SkillError) -> bool:
    """Tell whether the hand would only meet the part itself, or what it is on."""
    met = _of(error)
    return met == part.id or met in around(part)


def _of(error: SkillError) -> str:
    """Return what is met with that an error tells of; "" where it tells of nothing."""
    return error.evidence.other if isinstance(error.evidence, CollisionEvidence) else ""


def plan_push(
    arm: Manipulator, part: DetectedObject, goals: Sequence[float], press: float = _PRESS, *, partly: bool = False
) -> PartWay:
    """Return the first way on which the hand can push a face of a part to a value of its joint: closed, or else with one open finger.

    An open finger goes before the palm, which may have no room where closed fingers have.

    Args:
        arm: Whose hand.
        part: What is pushed.
        goals: Values of its joint on one side of where it is, the best first.
        press: How far beyond the end of its range it is pushed, where that is the goal, metres.
        partly: Whether the way that leads farthest is returned where none leads to a goal.

    Raises:
        GraspError: No face of it looks against its way.
        UnreachableError: Its faces, or its way, are out of reach.
        CollisionError: Something is in the way.
    """
    motion, failures, turns, load = arm.motion, list[SkillError](), _turns(arm, part), _load(arm, part)
    gripper = arm.spec.gripper
    apertures = (None,) if gripper is None else (gripper.geometry.min_aperture, gripper.geometry.max_aperture)
    pushes = [(aperture, face) for aperture in apertures for face in _faces(arm, part, goals[0], aperture)]
    if jams(arm, part):
        pushes.sort(key=lambda push: push[1].spans)
    # A hand that presses on what the part is on does not shut it: only where nothing else is left.
    ways = [(share, False) for share in turns] + [(0.0, True)] * jams(arm, part)
    # Nor does the palm meet the part before what pushes, where there is another way.
    free = tuple(product(dict.fromkeys((touched(part), around(part))), (True, False)))
    starts = [moved(face.tcp, -STAND_OFF * face.way) for _, face in pushes]
    comings = [_Comings(arm, start) for start in starts]
    # What ends a way ends one that leads farther.
    ended: dict[_Pushing, float] = {}
    height, here = HOVERS[-1], part_value(part)

    def planned(goal: float, pushing: _Pushing) -> PartWay:
        number, allowed, tips_first, share, slides = pushing
        aperture, face = pushes[number]
        tcp = face.tcp
        if aperture is not None:
            motion.open_to(aperture)
        values = _values(part, tcp, goal)
        beyond = [*values[1:-1], _pressed_home(part, values[-1], tcp, press)]
        poses = _beside(part, tcp, beyond) if slides else _along(part, tcp, beyond, share, face.finger)
        steps: list[Trajectory] = []
        try:
            descent = comings[number].descent(height)
            if tips_first:
                motion.allow()
                motion.plan_line(descent.q[-1], moved(tcp, -_BEFORE * face.way), speed=SPEED)
            motion.allow(*allowed, *load)
            steps.extend(_steps(arm, descent.q[-1], poses))
            _check_beside(arm, part, steps, values)
            approach = comings[number].approach(height)
        except (UnreachableError, CollisionError):
            ended[pushing] = abs(values[len(steps)] - here)
            raise
        way = (starts[number], *poses)
        return PartWay(None, approach, descent, way, tuple(steps), tuple(values), _is_end(part, goal), aperture)

    def is_left(goal: float, pushing: _Pushing) -> bool:
        return abs(goal - here) <= ended.get(pushing, math.inf) and not comings[pushing[0]].is_lost(height)

    for goal, (allowed, tips_first), number, (share, slides) in product(goals, free, range(len(pushes)), ways):
        pushing = number, allowed, tips_first, share, slides
        face = pushes[number][1]
        if not is_left(goal, pushing) or (slides and abs(face.way @ face.tcp.rotation[:, 2]) > _BY_SIDE):
            continue
        try:
            return planned(goal, pushing)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
        if sum(one.is_lost(height, approach=True) for one in comings) == _MOST_BLOCKED:
            break
    farthest = sorted(ended.items(), key=lambda one: -one[1]) if partly else ()
    for length, pushing in ((length, pushing) for pushing, length in farthest if length * lever(part) > _TRIAL):
        goal = here + math.copysign(length, goals[-1] - here)
        if not is_left(goal, pushing):
            continue
        with suppress(UnreachableError, CollisionError):
            return planned(goal, pushing)
    if not failures:
        raise no_grip(arm, part, "none_found", 0.0)
    raise arm.clearest(failures)


def pressing_poses(arm: Manipulator, part: DetectedObject, axis: Array) -> Iterator[Pose]:
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
    rotations = [rotation for rotation in rotations if arm.planning.can_face(rotation)]
    rotations.sort(key=lambda rotation: -round(float(np.trace(hand.T @ rotation)), 6))
    for rotation in rotations:
        yield Pose.from_matrix(face - tip * axis, rotation)


def _handles(arm: Manipulator, part: DetectedObject, rolls: Sequence[float]) -> list[Grasp]:
    """Return grips on the pieces of a part that have a lever there, the surest first.

    Fingers close across two faces of a piece's own box, and the hand comes along a third axis, straight or leaning, from the side
    on which it is at home, or it is turned about the piece's length. Whether there is room for it is the collision checker's to say.

    Args:
        arm: Whose hand.
        part: What is to be held.
        rolls: Turns of the hand about the length of what it holds, radians.
    """
    joint, hand = joint_of(part), arm.state.tcp_pose.rotation
    home = arm.motion.forward(arm.spec.home_q).position
    rotation, origin = part.pose.rotation, part.pose.position
    longest, is_knob = lever(part), _is_knob(arm, part)
    away = part.shape.centre(part) - home
    away = away / max(float(np.linalg.norm(away)), 1e-9)
    found: list[tuple[tuple[float, ...], Grasp]] = []
    cost: tuple[float, ...]
    for piece in part.shape.handles(part):
        axes = rotation @ matrix_from_quat_xyzw(piece.quat_xyzw)
        middle, half = origin + rotation @ np.array(piece.centre), piece.hull.half_extents
        for c, a in permutations(range(3), 2):
            long = 3 - c - a
            spare = max(0.0, float(half[long]) - arm.geometry.finger_width / 2.0)
            along_it = dict.fromkeys((0.0, spare / 2.0, -spare / 2.0, spare, -spare))
            # Or only by the tips, where what the part is on leaves no room beside it.
            short = max(0.0, float(half[a]) + arm.geometry.tip_depth - _TIPS)
            for sign, side, lean, roll in product((1.0, -1.0), (1.0, -1.0), _LEANS, rolls):
                if roll and lean:
                    continue
                square = side * axes[:, c], turned(sign * axes[:, a], axes[:, c], lean)
                closing, approach = (turned(one, axes[:, long], roll) for one in square)
                # Across a corner it is wider.
                width = 2.0 * float(half[c] * abs(math.cos(roll)) + half[a] * abs(math.sin(roll)))
                if approach @ away < _FROM_BEHIND or (is_knob and abs(approach @ np.array(joint.axis)) < _AGAINST):
                    continue
                if not arm.planning.can_face(np.column_stack([cross(closing, approach), closing, approach])):
                    continue
                # What stands out towards the hand is there to be held.
                deep = float(part.shape.support(part, -approach[None])[0])
                # A hand that comes from where it is at home has its arm behind it; one along a knob's axis only turns.
                line = np.sign(approach @ np.array(joint.axis)) * np.array(joint.axis) if is_knob else away
                straight = round(max(0.0, float(approach @ line)), 1)
                for along, back in product(along_it, dict.fromkeys((0.0, short))):
                    at = middle + along * axes[:, long]
                    if _arm_of(joint, at) < _LEAST_LEVER * longest and not is_knob:
                        continue
                    point = at - back * approach
                    grasp = _grip(arm, part, point, closing, approach, width, float(half[a]) - back)
                    if grasp is None or (
                        lean and not _is_between(arm, grasp, middle, axes[:, [a, long]], half[[a, long]])
                    ):
                        continue
                    turn = -round(float(np.trace(hand.T @ grasp.tcp_pose.rotation)), 3)
                    sunk = round(deep + float(at @ approach), 2)
                    cost = (-_sure(grasp, joint) - straight, sunk, abs(lean), back, abs(along), turn)
                    found.append((cost, grasp))
    return _by_direction([(cost, grasp.tcp_pose, grasp) for cost, grasp in found])[:_MOST_GRIPS]


def _grip(
    arm: Manipulator, part: DetectedObject, point: Array, closing: Array, approach: Array, width: float, near: float
) -> Grasp | None:
    """Return the grip that closes on a width around a point, metres; None where fingers or palm have no room.

    What is thinner than the gap of closed fingers is led by one of them, where it goes along their closing line.
    """
    geometry = arm.geometry
    if width >= geometry.max_aperture - 2.0 * FINGER_CLEARANCE:
        return None
    if is_hook(arm, width) and abs(closing @ _way(joint_of(part), point)) < _HOOKS:
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


def _is_between(arm: Manipulator, grasp: Grasp, middle: Array, axes: Array, half: Array) -> bool:
    """Tell whether a piece is between the pads of a hand that leans along it, and has not drawn back from it for its palm.

    Args:
        arm: Whose hand.
        grasp: Its pose.
        middle: Of the piece, shape (3,).
        axes: The two of the piece that the fingers do not close along, columns, shape (3, 2).
        half: Its half extents along these, metres, shape (2,).
    """
    tcp, approach = grasp.tcp_pose.position, grasp.tcp_pose.rotation[:, 2]
    pads = tcp + np.outer([0.0, 0.5, 1.0], arm.geometry.tip_depth * approach)
    return bool((np.abs((pads - middle) @ axes) <= half).all(axis=1).any())


def is_hook(arm: Manipulator, width: float) -> bool:
    """Tell whether closed fingers have play around what is so wide, metres, and lead it by one of them."""
    return width <= arm.geometry.min_aperture + _THINNEST


def _sure(grasp: Grasp, joint: PartJoint) -> float:
    """Return how surely a grip leads the part: fingers that close along its way push it, others rub on it."""
    return round(max(abs(float(grasp.tcp_pose.rotation[:, 1] @ _way(joint, grasp.tcp_pose.position))), _RUBS), 1)


def _is_knob(arm: Manipulator, part: DetectedObject) -> bool:
    """Tell whether all of a part that turns fits between the fingers: the hand closes across its axis and turns with it."""
    return joint_of(part).kind == "hinge" and 2.0 * lever(part) < arm.geometry.max_aperture


def _arm_of(joint: PartJoint, point: Array) -> float:
    """Return how far a point (3,) goes for a unit of its joint, metres a metre or a radian."""
    if joint.kind == "slide":
        return 1.0
    return float(np.linalg.norm(cross(np.array(joint.axis), point - np.array(joint.anchor))))


def _way(joint: PartJoint, point: Array) -> Array:
    """Return the unit vector (3,) in which a point goes as its joint's value grows; zero on the axis itself."""
    axis = np.array(joint.axis)
    if joint.kind == "slide":
        return axis
    way = cross(axis, point - np.array(joint.anchor))
    turned_by: Array = way / max(float(np.linalg.norm(way)), 1e-9)
    return turned_by


def opened_for(arm: Manipulator, grasp: Grasp) -> float:
    """Return how far apart the fingers come to a grip, metres."""
    return min(arm.geometry.max_aperture, grasp.width + 2.0 * PRESHAPE)


def _free(arm: Manipulator, grasp: Grasp) -> Array:
    """Return a configuration (n,) in which the hand is at a grip, open, and nothing is touched.

    Raises:
        UnreachableError: It is out of reach.
        CollisionError: It touches something there.
    """
    arm.motion.open_to(opened_for(arm, grasp))
    arm.motion.allow()
    return arm.free_posture(grasp.tcp_pose, restarts=_RESTARTS)


def _steps(arm: Manipulator, q: Array, poses: Sequence[Pose]) -> Iterator[Trajectory]:
    """Yield the straight ways from a configuration (n,) through poses.

    Raises:
        UnreachableError: The next one is out of reach.
        CollisionError: Something is in its way.
    """
    for pose in poses:
        step = arm.motion.plan_line(q, pose, speed=SPEED)
        yield step
        q = step.q[-1]


def _check_beside(arm: Manipulator, part: DetectedObject, steps: Sequence[Trajectory], values: Sequence[float]) -> None:
    """Check that no link before the hand meets a part as that moves, nor any what goes with it, nor as the hand comes off it at the end.

    Args:
        arm: Whose hand moves it.
        part: What is moved.
        steps: The ways of the arm.
        values: The joint's value where each begins, and where the last ends.

    Raises:
        CollisionError: A link meets it.
        UnreachableError: The hand cannot draw back from it.
    """
    motion, seen, load = arm.motion, arm.planning.seen, _load(arm, part)
    motion.allow(by_hand=around(part))

    def bring(value: float) -> None:
        there = brought_to(seen, part, value) if load else seen
        motion.move_part(part.id, value, [item for item in there.objects if item.id in load])

    try:
        for step, (first, last) in zip(steps, pairwise(values), strict=True):
            for share in _ALONG:
                bring(first + share * (last - first))
                met = motion.touch(step.q[round(share * (len(step.q) - 1))])
                if met is not None and (_is_own(part, met) or _of(met) in load):
                    raise met
        bring(values[-1])
        q = steps[-1].q[-1]
        motion.plan_line(q, withdrawn(motion.forward(q), HOVERS[-1]), speed=SPEED)
    finally:
        bring(part_value(part))


def _is_end(part: DetectedObject, value: float) -> bool:
    """Tell whether a part meets its stop at a value: an end of its range, or where it is shut a little before one."""
    joint = joint_of(part)
    return value in (joint.low, joint.high, joint.shut)


def _values(part: DetectedObject, grip: Pose, goal: float) -> list[float]:
    """Return values of a joint from where a part is to a goal: a trial, steps, and a short last one where it meets its stop."""
    joint, here = joint_of(part), part_value(part)
    length = abs(goal - here) * max(_arm_of(joint, grip.position), lever(part))
    last = length - _STOP_WITHIN if _is_end(part, goal) else length
    steps = np.linspace(0.0, last, max(2, math.ceil(last / _STEP) + 1))[1:] if joint.kind == "hinge" else [last]
    marks = [0.0, _TRIAL, *(float(step) for step in steps if step > _TRIAL), length]
    kept = [mark for mark, then in pairwise(marks) if mark < then and mark < length]
    # What is at its stop already may be pressed against it.
    return [here, *(here + (goal - here) * mark / length for mark in kept[1:]), goal]


def _pressed_home(part: DetectedObject, goal: float, grip: Pose, press: float) -> float:
    """Return the value of its joint to which a hand pushes a part, beyond its stop where that is the goal."""
    if not _is_end(part, goal):
        return goal
    joint = joint_of(part)
    outwards = goal == joint.high or (goal == joint.shut and joint.far < goal)
    return goal + (press if outwards else -press) / _arm_of(joint, grip.position)


def _along(
    part: DetectedObject, grip: Pose, values: Sequence[float], share: float, point: Array | None = None
) -> tuple[Pose, ...]:
    """Return a grip's poses where the part's joint has each of some values, the hand turned by a share of the part's turn.

    Args:
        part: What moves.
        grip: The TCP's pose where the part is now.
        values: Of its joint, metres or radians.
        share: Of the part's turn, by which the hand turns.
        point: Of the hand, which goes with the part, shape (3,), metres; its TCP when left out.
    """
    joint, here = joint_of(part), part_value(part)
    axis, anchor = np.array(joint.axis), np.array(joint.anchor)
    if joint.kind == "slide":
        return tuple(moved(grip, (value - here) * axis) for value in values)
    point = grip.position if point is None else point
    found = []
    for value in values:
        turn = matrix_about_axis(axis, share * (value - here))
        there = anchor + matrix_about_axis(axis, value - here) @ (point - anchor)
        found.append(Pose.from_matrix(there + turn @ (grip.position - point), turn @ grip.rotation))
    return tuple(found)


def _beside(part: DetectedObject, tcp: Pose, values: Sequence[float]) -> tuple[Pose, ...]:
    """Return poses of a hand that pushes a hinged part and lets its end slide along the fingers where its way leads along them.

    Fingers that come from above do not get under a lever that they lift; its end lies on their side until it is level.
    """
    approach, joint = tcp.rotation[:, 2], joint_of(part)
    far = lever(part) / max(_arm_of(joint, tcp.position), 1e-6)
    found = []
    for pose in _along(part, tcp, values, 0.0):
        way = pose.position - tcp.position
        found.append(moved(tcp, far * (way - (way @ approach) * approach)))
    return tuple(found)


def _faces(arm: Manipulator, part: DetectedObject, goal: float, aperture: float | None) -> Iterator[_Face]:
    """Yield where the hand is at faces of a part that look against its way, the longest lever first.

    Args:
        arm: Whose hand.
        part: What is pushed.
        goal: Value of its joint.
        aperture: How far apart the fingers are, metres; None without any.
    """
    joint, hand = joint_of(part), arm.state.tcp_pose.rotation
    sign = 1.0 if goal > part_value(part) else -1.0
    found: list[_Place] = []
    far: dict[tuple[float, ...], _Place] = {}
    # What is to be pushed along a slide goes the same way everywhere.
    hands: dict[bytes, list[tuple[float, float, Array, list[Array]]]] = {}
    for piece in part.shape.handles(part):
        axes = part.pose.rotation @ matrix_from_quat_xyzw(piece.quat_xyzw)
        middle, half = part.pose.position + part.pose.rotation @ np.array(piece.centre), piece.hull.half_extents
        for k, side in product(range(3), (1.0, -1.0)):
            normal = side * axes[:, k]
            i, j = (n for n in range(3) if n != k)
            for u, v in product(_ON_FACE, _ON_FACE):
                point = middle + half[k] * normal + u * half[i] * axes[:, i] + v * half[j] * axes[:, j]
                way = sign * _way(joint, point)
                if normal @ way > -_AGAINST:
                    continue
                named = way.tobytes()
                if named not in hands:
                    hands[named] = [
                        (lean, -float(np.trace(hand.T @ rotation)), rotation, _foremost(arm, rotation, way, aperture))
                        for lean, rotation in _pushing(arm, way)
                    ]
                arm_length = round(_arm_of(joint, point), 1)
                for lean, turn, rotation, firsts in hands[named]:
                    # An edge of the tips slides on a face that their ends or their side would lie on.
                    on_edge = float(0.0 < lean < np.pi / 2.0)
                    for first in firsts:
                        pose = Pose.from_matrix(point - first, rotation)
                        finger, around_it = _pusher(arm, rotation, first, aperture)
                        finger = finger + pose.position
                        face = _Face(
                            pose, way, finger, _spans(joint, normal, (middle, axes * half), (finger, around_it))
                        )
                        # No deeper than it has to be: there may be something below.
                        depth = round(float(pose.position @ rotation[:, 2]), 3)
                        cost = (-arm_length, on_edge, round(turn + lean, 2), depth)
                        found.append((cost, pose, face))
                        # Places of the part's own, so that it is pushed alike wherever it stands.
                        place = part.pose.rotation.T @ (pose.position - part.pose.position) / _FAR
                        key = (*place.round(), *rotation[:, 1].round(1), round(lean, 1))
                        # Within one the middle of a face is surer than one that is less deep.
                        if key not in far or cost[:-1] < far[key][0][:-1]:
                            far[key] = cost, pose, face
    apart = _by_direction(list(far.values()))[:_MOST_FAR]
    tried = {id(face) for face in apart}
    yield from apart
    yield from (face for face in _by_direction(list(_apart(found)), _MOST_NEAR) if id(face) not in tried)


def _apart(places: Sequence[_Place]) -> Iterator[_Place]:
    """Yield those places with the hand turned alike that are apart from better ones."""
    kept: dict[tuple[float, ...], list[Array]] = {}
    for cost, pose, face in sorted(places, key=lambda one: one[0][:-1]):
        near = kept.setdefault(tuple(pose.rotation.round(1).ravel() + 0.0), [])
        if all(np.linalg.norm(pose.position - other) >= _NEAR for other in near):
            near.append(pose.position)
            yield cost, pose, face


def _pushing(arm: Manipulator, way: Array) -> list[tuple[float, Array]]:
    """Return leans from along a way (3,) to downwards, radians, and rotations (3, 3) of a hand that pushes along it.

    A hand that cannot be turned into any of them pushes as it is.
    """
    level = cross(way, np.array([0.0, 0.0, 1.0]))
    if np.linalg.norm(level) < 1e-3:
        level = np.array([1.0, 0.0, 0.0])
    level = level / np.linalg.norm(level)
    found = []
    for lean in _PUSH_LEANS:
        approach = turned(way, level, -lean)
        across = cross(approach, level)
        for y in (level, -level, across, -across):
            rotation = np.column_stack([cross(y, approach), y, approach])
            if arm.planning.can_face(rotation):
                found.append((lean, rotation))
    return found or [(0.0, arm.state.tcp_pose.rotation)]


def _by_direction(candidates: Sequence[tuple[tuple[float, ...], Pose, T]], most: float = math.inf) -> list[T]:
    """Return candidates by cost, the best of each direction of the hand first: where one has no room, its neighbours have none either.

    Args:
        candidates: Each with its cost and the TCP's pose.
        most: Of each direction so many at the most.
    """
    turns: dict[tuple[float, ...], int] = {}
    ranked = []
    for cost, pose, candidate in sorted(candidates, key=lambda one: one[0]):
        direction = tuple(pose.rotation[:, 1:].round(1).ravel() + 0.0)
        turns[direction] = turns.get(direction, -1) + 1
        ranked.append(((turns[direction], *cost), candidate))
    return [candidate for rank, candidate in sorted(ranked, key=lambda one: one[0]) if rank[0] < most]


def _foremost(arm: Manipulator, rotation: Array, way: Array, aperture: float | None) -> list[Array]:
    """Return offsets (3,) from the TCP to what of a hand goes first along a way (3,): its tips, a corner of them, or its side.

    None where that is not known: fingers taper, and their thickness is the largest. Of an open hand each finger may go first.
    """
    local = rotation.T @ way
    x, y, z = np.where(np.abs(local) > _LEVEL, local, 0.0)
    if arm.spec.gripper is None or aperture is None:
        # A flange has no fingers to reach down with: what it pushes with lies around its TCP.
        return [(flange_depth(arm.spec.tool_bounds, local) if z == 0.0 else 0.0) * way]
    if y != 0.0 and z != 0.0:
        return []
    geometry = arm.spec.gripper.geometry
    finger = (aperture + geometry.finger_thickness) / 2.0
    half = np.array([geometry.finger_width / 2.0, aperture / 2.0 + geometry.finger_thickness, geometry.tip_depth])
    first = np.sign([x, y, z]) * half
    sides = (finger, -finger) if aperture > geometry.min_aperture and y == 0.0 else (first[1],)
    return [rotation @ np.array([first[0], side, first[2]]) for side in sides]


def _pusher(arm: Manipulator, rotation: Array, first: Array, aperture: float | None) -> tuple[Array, Array]:
    """Return what of a hand pushes, `first` (3,) being its foremost point: closed fingers, one open finger, or a flange.

    Returns:
        The offset of its middle from the TCP, shape (3,), and its half-extents along its axes, columns, shape (3, 3); metres.
    """
    if arm.spec.gripper is None or aperture is None:
        return np.zeros(3), np.zeros((3, 3))
    geometry = arm.spec.gripper.geometry
    half = np.array([geometry.finger_width, geometry.finger_thickness, 0.0]) / 2.0
    if aperture <= geometry.min_aperture:
        half[1] = aperture / 2.0 + geometry.finger_thickness
        return np.zeros(3), rotation * half
    across = rotation[:, 1] * np.sign(first @ rotation[:, 1])
    return across * (aperture + geometry.finger_thickness) / 2.0, rotation * half


def _spans(joint: PartJoint, normal: Array, piece: tuple[Array, Array], pusher: tuple[Array, Array]) -> bool:
    """Tell whether a finger lies on a face on both sides of the part's hinge.

    Args:
        joint: The part's.
        normal: Of the face, shape (3,).
        piece: Whose face it is: its middle (3,), and its half-extents along its axes, columns (3, 3); metres.
        pusher: The finger, likewise.
    """
    along = cross(np.array(joint.axis), normal)
    length = float(np.linalg.norm(along))
    if joint.kind == "slide" or length < _LEVEL:
        return False
    along = along / length
    low, high = -math.inf, math.inf
    for middle, half in (piece, pusher):
        at, reach = float((middle - np.array(joint.anchor)) @ along), float(np.abs(along @ half).sum())
        low, high = max(low, at - reach), min(high, at + reach)
    return low < 0.0 < high


def no_grip(
    arm: Manipulator, part: DetectedObject, reason: Literal["none_found", "missed"], aperture: float
) -> GraspError:
    """Return the error of a part of which the fingers hold nothing."""
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
