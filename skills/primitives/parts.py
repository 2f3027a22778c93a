"""Moving a part along its joint: leading it by a grip, pushing it with closed fingers, and pressing it in.

The hand stops where what it presses with along the way passes a limit, and it is looked whether the part follows: first after a few
millimetres, since a drawer that has not followed them would only drag its cabinet along.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import product
from typing import Literal

import numpy as np

from robosandbox.driver import require
from robosandbox.errors import CollisionError, DrawerError, GraspError, Phase, SkillError, UnreachableError
from robosandbox.evidence import DrawerEvidence
from robosandbox.skills.primitives.gripping import empty_aperture
from robosandbox.skills.primitives.guarded import follow_free, follow_until, nowhere_faster
from robosandbox.skills.primitives.manipulator import Manipulator, most_telling, moved
from robosandbox.skills.primitives.part_ways import (
    HOVERS,
    PRESHAPE,
    SPEED,
    STAND_OFF,
    PartWay,
    around,
    is_hook,
    jams,
    no_grip,
    opened_for,
    plan_latched,
    plan_lead,
    plan_lead_partly,
    plan_push,
    pressing_poses,
    spring_force,
)
from robosandbox.types import Array, DetectedObject, ObservedScene, Pose, SkillResult, Trajectory
from robosandbox.world.nearness import nearer
from robosandbox.world.parts import TURNED_WITHIN, joint_of, lever, open_share, open_value, part_value, shut_value
from robosandbox.world.relations import bottom, contents, room_of, top

# N along the way from which a part is stuck: more might break it, or drag along what it is on; and from which it resists, above the
# friction of one that runs.
MOST_FORCE, RESISTED = 20.0, 5.0
# N across the way from which the hand and the part are on different ways; with the most along it 40 N, as an unintended touch may be.
_MOST_ACROSS = 35.0
# Share of its way by which a drawer has to come out; chosen so that the seeds' task, which asks for 80 mm of 120, is passed (halved
# nothing changes, at more than the way no drawer is open).
PULLED_SHARE = 0.75
# m/s of a hand that leads a part that it holds; that pushes it, since what is pushed runs ahead and is met again; that feels whether what
# it holds follows, as of a touch; that brings it to its stop, which gives least: what it presses with grows by its servos' stiffness times
# this; and that leaves a part, which it may still catch on.
_LEADS, _PUSHES, _FEELS, _STOPS, _LEAVES = 0.06, 0.04, 0.01, 0.006, 0.06
# m/s of a hand to which a part that is pushed still does not give way is stuck.
_SLOWEST = 0.005
# Metres that a hand goes at the most which turns on the spot.
_SPOT = 1e-3
# Share of a step that a part has to follow, for the play of a grip between two fingers.
_FOLLOWS = 0.4
# Metres within which a part has not moved, above perception's error.
_LOCKED_WITHIN = 0.003
# Metres to a part within which a thing stands against it.
_BESIDE = 0.005
# Times that a grip which slipped is taken anew, and that a part which has followed is pushed on; as in `pick`.
_ATTEMPTS = 3
# Metres beyond its travel that the hand goes at the most which presses a button: a stop of rubber gives before it is felt. And metres
# farther to which it is sent where it is to press with a force, as far as there is room: what it presses with is what its servos trail by.
_BEYOND, _TRAILS = 0.02, (0.1, 0.05, 0.025, 0.0)


def lead(arm: Manipulator, name: str, goals: Sequence[float], enough: float) -> tuple[DetectedObject, float]:
    """Take hold of a part and lead it along its joint; return it as it is then, and the most force along its way, N.

    Args:
        arm: The skill's manipulator.
        name: Id of the part.
        goals: Values of the joint, metres or radians, the best first: that to which the hand gets is taken.
        enough: The value from which on it is as it should be.

    Raises:
        UnsupportedError: The driver does not tell how hard the hand pulls.
        GraspError: Nothing of it fits between the fingers, or they missed it.
        UnreachableError: Its handle, or its way, is out of reach.
        CollisionError: Something is in the way.
        DrawerError: It is locked or blocked, or the hand slipped off.
    """
    return _until(arm, name, enough, lambda part: _lead_along(arm, part, plan_lead(arm, part, goals)))


def _lead_along(arm: Manipulator, part: DetectedObject, way: PartWay) -> float:
    """Take hold of a part, lead it along a way and let it go; return the most force along it, N."""
    assert way.grasp is not None
    _go(arm, way, opened_for(arm, way.grasp))
    arm.ctx.enter(Phase.GRASP)
    closed = arm.close_on(way.grasp.width)
    if not is_hook(arm, way.grasp.width) and closed < empty_aperture(arm.geometry, way.grasp.width):
        _let_go(arm, part)
        raise no_grip(arm, part, "missed", closed)
    try:
        force = follow_way(arm, part, way, MOST_FORCE)
    except CollisionError:
        _let_go(arm, part)
        raise
    _let_go(arm, part)
    return force


def _push_along(arm: Manipulator, part: DetectedObject, way: PartWay, most: float) -> float:
    """Push a part along a way and come off it; return the most force along it, N, of which `most` is where it is stuck."""
    _go(arm, way, way.aperture)
    try:
        force = follow_way(arm, part, way, most)
    except CollisionError:
        _step_back(arm, part, way)
        _withdraw(arm, part)
        raise
    _step_back(arm, part, way)
    _withdraw(arm, part)
    return force


def _lead_then_push(
    arm: Manipulator, name: str, goals: Sequence[float], enough: float, most: float
) -> tuple[DetectedObject, float]:
    """Lead a part as far as the hand gets with it, and push it on from there; return and raise as `lead`."""
    is_led = False

    def moved_on(part: DetectedObject) -> float:
        nonlocal is_led
        if not is_led:
            way = plan_lead_partly(arm, part, goals)
            is_led = True
            return _lead_along(arm, part, way)
        return _push_along(arm, part, plan_push(arm, part, goals), most)

    return _until(arm, name, enough, moved_on)


def lead_or_push(
    arm: Manipulator, name: str, goals: Sequence[float], enough: float, most: float = MOST_FORCE
) -> tuple[DetectedObject, float]:
    """Lead a part as `lead` does, or push it as `push` does where there is nothing to hold it by, or the grip jams; raises as `lead`.

    Where no way gets it there, it is moved as far as one does, and pushed on from there.
    """
    try:
        return lead(arm, name, goals, enough)
    except (UnreachableError, CollisionError, GraspError, DrawerError) as held:
        is_jammed = jams(arm, arm.find(name))
        if isinstance(held, DrawerError) and not is_jammed:
            raise
        try:
            return push(arm, name, goals, enough, most, partly=is_jammed)
        except (UnreachableError, CollisionError) as unpushed:
            if is_jammed or isinstance(held, GraspError):
                raise arm.clearest([held, unpushed]) from held
            try:
                return _lead_then_push(arm, name, goals, enough, most)
            except (UnreachableError, CollisionError) as ended:
                raise arm.clearest([held, unpushed, ended]) from held
        except DrawerError as felt:
            # What was felt tells more than that a grip could not be planned.
            raise (held if isinstance(held, DrawerError) else felt) from None
        except GraspError:
            raise held from None


def lead_latched(
    arm: Manipulator, name: str, handle: str, goals: Sequence[float], enough: float
) -> tuple[DetectedObject, float]:
    """Take hold of the handle on a part, turn it against its spring and lead the part; return and raise as `lead`.

    Args:
        arm: The skill's manipulator.
        name: Id of the part.
        handle: Id of its handle.
        goals: Values of the part's joint, metres or radians, the best first.
        enough: The value from which on it is as it should be.
    """

    def opened(part: DetectedObject) -> float:
        held = arm.find(handle)
        way = plan_latched(arm, part, held, goals)
        assert way.turn.grasp is not None
        _go(arm, way.turn, opened_for(arm, way.turn.grasp))
        arm.ctx.enter(Phase.GRASP)
        if arm.close_on(way.turn.grasp.width) < empty_aperture(arm.geometry, way.turn.grasp.width):
            _let_go(arm, held)
            raise no_grip(arm, held, "missed", arm.gripper.width)
        resists = spring_force(held, way.turn.values[-1], way.turn.poses[-1].position)
        force = follow_way(arm, held, way.turn, MOST_FORCE + resists)
        if math.dist(arm.state.tcp_pose.xyz, way.turn.poses[-1].xyz) > STAND_OFF:
            # The handle stopped before it was turned so far as the part is led from.
            _let_go(arm, held)
            return max(force - resists, 0.0)
        # What the spring asks for is no resistance of the part's.
        force = max(force - resists, follow_way(arm, part, way.lead, MOST_FORCE + resists) - resists, 0.0)
        first, last = way.lead.values[0], way.lead.values[-1]
        if abs(part_value(arm.find(name, arm.look())) - last) < TURNED_WITHIN * abs(last - first):
            follow_way(arm, held, way.back, MOST_FORCE + resists)
        _let_go(arm, held)
        return force

    return _until(arm, name, enough, opened)


def set_part(arm: Manipulator, skill: str, name: str, share: float) -> SkillResult:
    """Lead a part to a share of its way, unless it is there, and return what came of it; raises as `lead`."""
    before = now = arm.find(name)
    force, goal, off = 0.0, open_value(before, share), share - open_share(before)
    if abs(off) > TURNED_WITHIN:
        near = open_value(before, share - np.sign(off) * TURNED_WITHIN)
        now, force = lead_or_push(arm, name, [goal], near)
    already = {"already_there": True} if now is before else {}
    return SkillResult(skill=skill, detail={"part": name, "share": open_share(now), "force_n": force, **already})


def push(
    arm: Manipulator,
    name: str,
    goals: Sequence[float],
    enough: float,
    most: float = MOST_FORCE,
    *,
    partly: bool = False,
) -> tuple[DetectedObject, float]:
    """Push a part along its joint with the closed fingers; return it as it is then, and the most force along its way, N.

    Args:
        arm: The skill's manipulator.
        name: Id of the part.
        goals: Values of the joint, metres or radians, the best first: that to which the hand gets is taken.
        enough: The value from which on it is as it should be.
        most: N along its way from which it is stuck.
        partly: Whether it is pushed as far as one way leads, and on from there, where none leads to a goal.

    Raises:
        UnsupportedError: The driver does not tell how hard the hand pushes.
        GraspError: No face of it looks against its way.
        UnreachableError: No face to push on, or its way, is in reach.
        CollisionError: Something is in the way.
        DrawerError: It is locked or blocked, or the hand slipped off.
    """

    def pushed(part: DetectedObject) -> float:
        return _push_along(arm, part, plan_push(arm, part, goals, partly=partly), most)

    return _until(arm, name, enough, pushed, to_stop=goals[0] == shut_value(arm.find(name)))


def _until(
    arm: Manipulator, name: str, enough: float, once: Callable[[DetectedObject], float], *, to_stop: bool = False
) -> tuple[DetectedObject, float]:
    """Move a part until its joint has a value; what slipped is taken anew, and what follows is moved on.

    What goes `to_stop` is moved on until the stop is felt, where it is only seen to be there: sight is off by millimetres.
    """
    require(arm.driver, "wrist_wrench", "a part that is locked or blocked is told by how hard the hand pulls or pushes")
    first = now = arm.find(name, arm.look())
    worst, reached = 0.0, False
    for attempt in range(_ATTEMPTS):
        before, is_last = now, attempt == _ATTEMPTS - 1
        arm.ctx.enter(Phase.PLAN)
        arm.use(arm.look())
        try:
            force = once(before)
        except (UnreachableError, CollisionError, GraspError) as error:
            if reached:
                break
            if is_last or not isinstance(error, GraspError) or error.phase != Phase.GRASP:
                raise
            continue
        worst = max(worst, force)
        now = arm.find(name, arm.settle(name))
        sign = 1.0 if enough > part_value(before) else -1.0
        reached = reached or sign * (part_value(now) - enough) >= 0.0
        if reached and (is_last or not to_stop or worst > RESISTED):
            break
        if reached:
            continue
        if is_last or (force > RESISTED and _gone(before, now) <= _LOCKED_WITHIN):
            raise stuck(arm, first, now, enough, force)
    return now, worst


def _go(arm: Manipulator, way: PartWay, aperture: float | None) -> None:
    """Bring the hand to the first pose of a way, its fingers so many metres apart; None leaves what has none."""
    if aperture is not None:
        arm.open_for(way.approach, aperture)
    follow_free(arm, way.approach, Phase.APPROACH)
    follow_free(arm, way.descent, Phase.DESCEND)


def follow_way(arm: Manipulator, part: DetectedObject, way: PartWay, most: float) -> float:
    """Move the hand along a way while the part follows; return the most that it pressed with along it, N.

    Raises:
        CollisionError: The hand presses on what the part is on, and was never felt on anything else.
    """
    force, own, late, owner = 0.0, 0.0, 0.0, part.id.rpartition(".")[0]
    arm.ctx.enter(Phase.SLIDE)
    for number in range(1, len(way.poses)):
        step = way.poses[number].position - way.poses[number - 1].position
        length = float(np.linalg.norm(step))
        # A hand that turns a knob goes nowhere.
        direction = step / length if length > _SPOT else np.zeros(3)

        def felt(direction: Array = direction) -> bool:
            nonlocal force, own
            pressed = arm.force_on(part.id)
            own = max(own, float(np.linalg.norm(pressed)))
            if owner:
                # Where a part meets its stop the hand may press on what it is on as well, and a latch is a part of its own.
                beside = arm.force_on(owner)
                own = max(own, float(np.linalg.norm(arm.force_on(None) - beside - pressed)))
                pressed = pressed + beside
            along = float(pressed @ direction)
            across = float(np.linalg.norm(pressed - along * direction))
            # Across the way the hand only keeps the part on it.
            force = max(force, along if across <= _MOST_ACROSS else math.hypot(along, across))
            return along > most or across > _MOST_ACROSS

        stops = way.ends_at_stop and number == len(way.poses) - 1
        slow = _STOPS if stops else _FEELS if number == 1 else _PUSHES if way.grasp is None else _LEADS
        length = max(length, abs(way.values[number] - way.values[number - 1]) * lever(part))
        stopped = follow_until(arm, _slowed(way.steps[number - 1], length, slow), Phase.SLIDE, felt)
        while stopped and way.grasp is None and not stops and slow > _SLOWEST:
            # What is damped resists a hand by its speed: it gives way to a slower one.
            slow /= 2.0
            try:
                rest = arm.motion.plan_line(arm.q, way.poses[number], speed=SPEED)
            except (UnreachableError, CollisionError):
                break
            stopped = follow_until(arm, _slowed(rest, length, slow), Phase.SLIDE, felt)
        gone = part_value(arm.find(part.id, arm.look())) - way.values[0]
        wanted = way.values[number] - way.values[0]
        gone *= math.copysign(1.0, wanted)
        behind = abs(wanted) - gone
        if way.grasp is None and (force == 0.0 or (force < RESISTED and behind * lever(part) < STAND_OFF)):
            # What is pushed may be met later than its believed face says.
            late = behind
        elif stopped or gone < _FOLLOWS * (abs(wanted) - late):
            break
    if own == 0.0 and force > RESISTED:
        raise CollisionError(
            f"the hand met {owner} on its way, with {force:.0f} N, and not {part.id}; approach it from elsewhere",
            phase=Phase.SLIDE,
        )
    return force


def _slowed(way: Trajectory, length: float, metres_per_second: float) -> Trajectory:
    """Return a way of so many metres at no more than this mean speed."""
    return Trajectory(q=way.q, dt=way.dt * max(1.0, length / metres_per_second / max(way.duration, 1e-6)))


def _let_go(arm: Manipulator, part: DetectedObject) -> None:
    """Open the fingers and go back along the hand's approach, else up."""
    arm.ctx.enter(Phase.RELEASE)
    arm.open(min(arm.geometry.max_aperture, arm.gripper.width + 2.0 * PRESHAPE))
    _withdraw(arm, part)


def _step_back(arm: Manipulator, part: DetectedObject, way: PartWay) -> None:
    """Take the hand off what it pushes against the way, if it can: one that rises while it presses pulls the part along."""
    arm.use(arm.look())
    arm.motion.allow(by_hand=around(part))
    step = way.poses[-1].position - way.poses[-2].position
    goal = moved(arm.state.tcp_pose, -STAND_OFF * step / max(float(np.linalg.norm(step)), 1e-9))
    with suppress(UnreachableError, CollisionError):
        follow_until(arm, arm.motion.plan_line(arm.q, goal, speed=SPEED), Phase.RETREAT, _pulls(arm))


def _withdraw(arm: Manipulator, part: DetectedObject) -> None:
    """Take the hand off a part: back along its approach, and where that is not free, or the hand pulls on something, another way.

    Raises:
        UnreachableError: No way is in reach.
        CollisionError: None is free.
    """
    turn, gone, failures = arm.state.tcp_pose.rotation, False, list[SkillError]()
    # Fingers that were around something come off it along their approach, or along it.
    for way, distance in product((-turn[:, 2], turn[:, 0], -turn[:, 0], np.array([0.0, 0.0, 1.0])), HOVERS):
        arm.use(arm.look())
        arm.motion.allow(by_hand=around(part))
        try:
            back = arm.motion.plan_line(arm.q, moved(arm.state.tcp_pose, distance * way), speed=arm.tempo.free)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            continue
        gone = True
        if not follow_until(arm, nowhere_faster(arm, back, _LEAVES), Phase.RETREAT, _pulls(arm)):
            return
    if not gone:
        raise most_telling(failures).with_(phase=Phase.RETREAT)


def _pulls(arm: Manipulator) -> Callable[[], bool]:
    """Return what tells whether a hand that leaves takes something along: it presses on it harder than when it began to leave."""
    before = {name: float(np.linalg.norm(force)) for name, force in arm.forces().items()}

    def felt() -> bool:
        return any(
            float(np.linalg.norm(force)) > before.get(name, 0.0) + RESISTED for name, force in arm.forces().items()
        )

    return felt


def _gone(before: DetectedObject, now: DetectedObject) -> float:
    """Return how far the outermost point of a part has gone, metres."""
    return abs(part_value(now) - part_value(before)) * lever(before)


def stuck(arm: Manipulator, before: DetectedObject, now: DetectedObject, wanted: float, force: float) -> DrawerError:
    """Return the error of a part that did not follow the hand as far as wanted.

    Args:
        arm: Whose hand was at it.
        before: As it was seen when the hand began.
        now: As it is seen.
        wanted: The value asked for, metres or radians.
        force: The most that the hand felt along the way, N.
    """
    shut = shut_value(now)
    opening, asked = abs(part_value(now) - shut), abs(wanted - shut)
    verb = "pulled" if asked > opening else "pushed"
    blocking = _in_the_way(now, arm.look(), closing=verb == "pushed")
    reason: Literal["locked", "blocked", "slipped"] = "slipped"
    if force > RESISTED:
        reason = "blocked" if blocking or _gone(before, now) > _LOCKED_WITHIN else "locked"
    unit, scale = ("deg", 180.0 / math.pi) if joint_of(now).kind == "hinge" else ("mm", 1e3)
    figures = (
        f"{verb} with {force:.0f} N it is {opening * scale:.0f} {unit} open, {asked * scale:.0f} {unit} was wanted"
    )
    said = {
        "locked": f"{now.id} is locked: {figures}; unlock it, or leave it",
        "blocked": f"{now.id} is blocked: {figures}; clear "
        + (f"{', '.join(blocking)} away" if blocking else "what is in its way"),
        "slipped": f"the hand slipped off {now.id}: {figures}; try again",
    }
    return DrawerError(
        said[reason],
        phase=Phase.SLIDE,
        evidence=DrawerEvidence(
            drawer=now.id, reason=reason, wanted=wanted, opening=part_value(now), force=force, blocking=blocking
        ),
    )


def _in_the_way(part: DetectedObject, scene: ObservedScene, *, closing: bool) -> tuple[str, ...]:
    """Return what keeps a part from moving: what lies in it and stands out over its rim, or what stands against it."""
    others = [item for item in scene.objects if item.id != part.id and not item.is_fixed]
    if not part.shape.holds_things:
        return tuple(item.id for item in others if nearer(part, item, _BESIDE))
    within = {name for name, _ in contents(scene.objects, part)}
    rim = part.pose.xyz[2] + room_of(part).rim
    if closing:
        return tuple(item.id for item in others if item.id in within and top(item) > rim)
    return tuple(
        item.id for item in others if item.id not in within and bottom(item) < rim and nearer(part, item, _BESIDE)
    )


def press_part(arm: Manipulator, name: str, most: float | None = None) -> tuple[float, float]:
    """Press a part in with the closed fingers and come off it; return the share of its way that it went, and the most force, N.

    Args:
        arm: The skill's manipulator.
        name: Id of the part.
        most: Force to press with, N; until it is felt to stop when left out.

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
    trails = _TRAILS[-1:] if most is None else _TRAILS
    axis = np.array(joint.axis) * (1.0 if end > rest else -1.0)
    arm.ctx.enter(Phase.PLAN)
    if arm.spec.gripper is not None:
        arm.open(0.0)
    arm.use(arm.look())
    failures: list[SkillError] = []
    q = arm.q
    for tcp in pressing_poses(arm, part, axis):
        start = moved(tcp, -STAND_OFF * axis)
        try:
            arm.motion.allow()
            descent = arm.line_to(start, moved(start, -HOVERS[-1] * axis), speed=arm.tempo.near)
            approach = arm.motion.plan_joints(q, descent.q[0], speed=arm.tempo.free)
            arm.motion.allow(*around(part))
            stroke = _stroke(arm, descent.q[-1], [moved(tcp, (span + _BEYOND + trail) * axis) for trail in trails])
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            continue
        follow_free(arm, approach, Phase.APPROACH)
        follow_free(arm, descent, Phase.DESCEND)
        return _pressed(arm, part, stroke, tcp, axis, most)
    # A hand that cannot point along the way, or has no room to, presses with its side or at a slant.
    try:
        way = plan_push(arm, part, [end], _BEYOND)
        if way.aperture is not None:
            arm.open(way.aperture)
        arm.motion.allow(*around(part))
        tcp = moved(way.poses[0], STAND_OFF * axis)
        stroke = _stroke(arm, way.descent.q[-1], [moved(tcp, (span + _BEYOND + trail) * axis) for trail in trails])
    except (UnreachableError, CollisionError, GraspError):
        if failures:
            raise most_telling(failures) from None
        raise
    follow_free(arm, way.approach, Phase.APPROACH)
    follow_free(arm, way.descent, Phase.DESCEND)
    return _pressed(arm, part, stroke, tcp, axis, most)


def _stroke(arm: Manipulator, q: Array, goals: Sequence[Pose]) -> Trajectory:
    """Return the straight way from a configuration (n,) to the first of some poses that is free; raises as `plan_line` for the last."""
    for goal in goals[:-1]:
        try:
            return arm.motion.plan_line(q, goal, speed=SPEED)
        except (UnreachableError, CollisionError):
            continue
    return arm.motion.plan_line(q, goals[-1], speed=SPEED)


def _pressed(
    arm: Manipulator, part: DetectedObject, stroke: Trajectory, tcp: Pose, axis: Array, most: float | None
) -> tuple[float, float]:
    """Follow a stroke along an axis (3,) until the force is felt, or the hand is beyond the part's travel from where it meets it."""
    owner, joint, rest = part.id.rpartition(".")[0], joint_of(part), part_value(part)
    span = max(joint.high - rest, rest - joint.low)
    force = 0.0

    def felt() -> bool:
        nonlocal force
        # Where a part is flush with what it is on the hand presses on that as well.
        felt_on = arm.force_on(part.id) + (arm.force_on(owner) if owner else 0.0)
        now = float(felt_on @ axis)
        force = max(force, now)
        gone = float((arm.state.tcp_pose.position - tcp.position) @ axis)
        # With a force that is asked for the stroke leads on: fingers that yield fall behind the hand.
        return now > (MOST_FORCE if most is None else most) or (most is None and gone > span + _BEYOND)

    # A servo trails its target by its damping over its stiffness, and presses with what it trails by.
    follow_until(arm, nowhere_faster(arm, stroke, _FEELS), Phase.TOUCH, felt)
    scene = arm.look()
    share = abs(part_value(arm.find(part.id, scene)) - rest) / span
    arm.use(scene)
    arm.motion.allow(*around(part))
    # As far as there is room: the way of the stroke is free at the least.
    here = arm.state.tcp_pose
    for distance in (*HOVERS, STAND_OFF):
        try:
            back = arm.motion.plan_line(arm.q, moved(here, -distance * axis), speed=arm.tempo.leave)
        except (UnreachableError, CollisionError):
            if distance == STAND_OFF:
                raise
            continue
        arm.follow(back, Phase.RETREAT)
        break
    return share, force
