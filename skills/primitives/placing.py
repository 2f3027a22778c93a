"""Putting down what is held: where it may stand, how the hand gets there, and whether it stayed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from robosandbox.errors import (
    CollisionError,
    ErrorCode,
    LimitError,
    Phase,
    PlacementError,
    RoboSandboxError,
    SkillError,
    UnreachableError,
)
from robosandbox.evidence import CollisionEvidence, PlacementEvidence
from robosandbox.skills.primitives.carrying import carried_along, carry_speed, transfer
from robosandbox.skills.primitives.grasping import Turned
from robosandbox.skills.primitives.gripping import bearable, landing
from robosandbox.skills.primitives.manipulator import (
    HOVER_HEIGHT,
    Manipulator,
    most_telling,
    moved,
    raised,
)
from robosandbox.skills.primitives.rehearsal import hand_planner, rehearse, with_aperture
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import (
    CAREFUL,
    Array,
    DetectedObject,
    Grasp,
    ObservedScene,
    Pose,
    SkillResult,
    Speed,
    Timing,
    Trajectory,
)
from robosandbox.values import frozen
from robosandbox.world.abilities import Obstruction
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import first_refuted, lost
from robosandbox.world.effects import put, taken
from robosandbox.world.episode_cache import cached_for_episode
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.parts import is_part
from robosandbox.world.placement_sampling import (
    CARRIED_OVER,
    Placement,
    levelled,
    placements_in,
    placements_on,
    resting_pose,
)
from robosandbox.world.predicate import View
from robosandbox.world.relations import MeasuredRelation, centre, contents
from robosandbox.world.rings import placements_around

# Metres above the support from which the last of the way is for it alone; chosen as four times the planner's clearance.
_STAND_OFF = 0.004
# Metres by which a thing may slide in the hand on its way and still come down as it was planned, short of what it stands off.
_SLID = _STAND_OFF / 2.0
# How far each finger opens to let go, metres; chosen as a size's error ten times
# over where there is room (halved or doubled, 1 % of an episode's time).
_OPENINGS = (0.0, 0.003, 0.006, 0.009, 0.012)
# Metres that each finger has to open to let go; chosen above a pad's give.
_LEAST_OPENING = 0.003
# Share of its opening from which a hand may rise; chosen as that at which the fingers are three pads' give off what they held.
_OPENED = 0.6
# Metres between two grasps with both of which, or neither, the hand is taken to have room where a thing is to go: less than a hand is thick.
_HAND = 0.015
# Searches for a grasp whose answers are kept: more than the repairs of one failure ask for again.
_CACHED = 64
# Seconds before the fingers open; chosen so that what was lowered has come to rest (halved or doubled, 1 % of an
# episode's time).
_RELEASE_SECONDS = 0.1
_HIGHER_HOVERS = (HOVER_HEIGHT, 0.05)
# Metres over the goal; chosen as the least from which a hand still comes down straight.
_LOWEST_HOVER = 0.03
# Sampled starts for a configuration; chosen as half of the planner's 60: another spot is worth more than a harder
# search.
_RESTARTS = 30
# Number of spots, spread over all, that are looked at where a look is to be brief.
_SPOTS = 4
# Spots out of reach after which it is given up; chosen as all headings of five spots.
_MOST_UNREACHABLE = 40
# Angle from its goal at which a thing stands askew, radians; chosen above what things put down flat were measured at (0.02 degrees).
_ASKEW = math.radians(1.0)
# Distance of a thing's middle from the edge of what it is on, millimetres; chosen as twice perception's error.
_EDGE_MM = 4.0
# Ways that may be blocked; chosen because each is searched for by sampling, which takes longest.
_MOST_BLOCKED = 5
# Spots, those nearest to the open side first, at which the hand meets with one heading what is fixed where a thing is to go in from the
# side: farther in it has no more room.
_MOST_MET = 6

# Spots and headings with the failure of an object that has no room there by itself.
Barred = dict[tuple[Placement, float], SkillError]


@frozen
class PlacePlan:
    """Pose at which an object is put down, the ways there, and how far the fingers open to let go, metres.

    `points` are those of the TCP on the descent, which has the timing `lower`, for an object that is in the hand's frame at `in_hand`.
    Where it comes in from the side, `back` is by how much (3,) the hand goes to be out again, metres.
    """

    goal: Pose
    transfer: Trajectory
    descent: Trajectory
    points: tuple[Pose, ...]
    lower: Speed
    in_hand: Pose
    opening: float
    back: Array | None = None


def place(
    arm: Manipulator,
    held: DetectedObject,
    spots: Iterable[Placement],
    *,
    skill: str,
    target: str,
    allowed: Iterable[str],
    check: Callable[[DetectedObject, ObservedScene], MeasuredRelation],
    lower: Callable[[PlacePlan], None] | None = None,
) -> SkillResult:
    """Put the held object on the first spot that can be reached, let go, and check where it is.

    Args:
        arm: The skill's manipulator.
        held: What the gripper holds.
        spots: In order of preference.
        skill: Name for the result.
        target: Name for the evidence.
        allowed: What the object or the fingers may touch: the support.
        check: Whether the settled object is where it should be.
        lower: Brings it down from the end of the way there; straight to its goal where it is left out.

    Raises:
        NotHoldingError: It slipped out of the hand on its way.
        PlacementError: It ended elsewhere or was not let go.
        UnreachableError: No spot can be reached.
        CollisionError: All that can be reached touch something.
    """
    allowed = tuple(allowed)
    _leave(arm, held.id)
    scene = arm.look()
    held = arm.find(held.id, scene)
    way = plan_place(arm, held, scene, spots, allowed)
    arm.follow(way.transfer, Phase.TRANSFER)
    way = _as_it_sits(arm, held.id, way, allowed, skill)
    _lower(arm, held.id, way, lower)
    _release(arm, held.id, way)
    after = arm.settle(held.id)
    if after.find(held.id) is None:
        after = _from_aside(arm, held.id)
    placed = arm.find(held.id, after)
    relation = check(placed, after)
    if relation.holds and _precarious(way.goal, placed.pose, relation):
        after = arm.watch(held.id)
        placed = arm.find(held.id, after)
        relation = check(placed, after)
    if after.held == held.id or not relation.holds:
        raise _elsewhere(placed, way.goal, target, relation, stuck=after.held == held.id)
    return SkillResult(
        skill=skill,
        detail={"object": held.id, "target": target, **relation.detail},
    )


def _elsewhere(
    placed: DetectedObject, goal: Pose, target: str, relation: MeasuredRelation, *, stuck: bool
) -> PlacementError:
    """Return the failure of what does not stand where it was put, or is still in the hand."""
    reason: Literal["stuck", "toppled", "missed"] = (
        "stuck" if stuck else "toppled" if _toppled(goal, placed.pose) else "missed"
    )
    figures = ", ".join(f"{name} {value:.1f}" for name, value in relation.detail.items())
    return PlacementError(
        f"{placed.id} is not where it was placed ({target}): {reason}, {figures}; look again and place it anew",
        phase=Phase.VERIFY,
        evidence=PlacementEvidence(object=placed.id, target=target, reason=reason, expected=goal, actual=placed.pose),
    )


def opened_wide(failed: FailedCall, container: str) -> Iterator[Alternative]:
    """Yield opening a drawer to its end, where the hand found no way to put something into it as it is."""
    vessel = failed.scene.find(container)
    if vessel is None or not is_part(vessel) or failed.error.code not in (ErrorCode.UNREACHABLE, ErrorCode.COLLISION):
        return
    yield Alternative(
        why=f"{container} is opened to its end first", first=(fact("open", container, 1.0),), call=failed.call
    )


def taken_anew(failed: FailedCall) -> Iterator[Alternative]:
    """Yield putting down what is held and taking it anew, where the hand as it holds it found no way.

    First by a grip with which the hand has room where it goes, then by any.
    """
    held = failed.scene.held
    if held is None or failed.error.code not in (ErrorCode.UNREACHABLE, ErrorCode.COLLISION):
        return
    first = (fact("on", held, TABLE),)
    target = failed.scene.find(str(next(iter(failed.call.arguments.values()), "")))
    if target is not None:
        fitting = (*first, fact("gripped_for", held, target.id))
        yield Alternative(why=f"{held} is put down and taken as it fits there", first=fitting, call=failed.call)
    yield Alternative(why=f"{held} is put down and taken anew", first=first, call=failed.call)


def spots_within(
    scene: ObservedScene, held: DetectedObject, vessel: DetectedObject
) -> tuple[list[Placement], tuple[DetectedObject, ...]]:
    """Return where something may stand within what holds things, the best place first, and what lies in that."""
    names = {name for name, _ in contents(scene.objects, vessel)} - {held.id}
    within = tuple(item for item in scene.objects if item.id in names)
    solid = [item for item in within if not item.shape.is_granular]
    return list(placements_in(vessel, held, solid, scene)), within


def touched_within(vessel: DetectedObject, within: Iterable[DetectedObject]) -> tuple[str, ...]:
    """Return the ids of what may be touched by what is put into something: that, what lies in it, and the fixture of a compartment."""
    is_compartment = vessel.geometry is not None and vessel.geometry.compartment is not None
    whole = (vessel.id.rpartition(".")[0],) if is_compartment else ()
    return (vessel.id, *whole, *(item.id for item in within))


def _leave(arm: Manipulator, held: str) -> None:
    """Rise from what the held object still stands on or leans against, if it does."""
    scene = arm.look()
    arm.use(scene, held=held)
    arm.motion.allow(*carried_along(arm.find(held, scene), scene))
    if arm.motion.touch(arm.q) is None:
        return
    arm.rise_out(HOVER_HEIGHT, Phase.LIFT, speed=arm.tempo.lift)


def obstruction_there(
    ctx: SkillContext, item: DetectedObject, base: DetectedObject, scene: ObservedScene, *, on: bool
) -> Callable[[Grasp, bool], Obstruction | None]:
    """Return what tells of a grasp what the hand meets with it where it puts an object on or into another; None for nothing.

    What is returned looks at some of the spots alone where its second argument is true.

    Args:
        ctx: Whose hand.
        item: What is to be taken, as it stands now.
        base: What it is to go on or into.
        scene: What is seen.
        on: Whether it goes on what has room within as well.
    """
    above = taken(scene, item.id)
    held = above.find(item.id) or item
    barred: Barred = {}
    if base.shape.holds_things and not on:
        spots, within = spots_within(scene, item, base)
        allowed = touched_within(base, within)
    elif around := placements_around(item, base, scene):
        spots, allowed = around, (TABLE,)
    else:
        spots, allowed = placements_on(item, base, scene.objects)[0], (base.id,)

    # Headings about which two grasps may differ with which the hand comes to the same places, as the thing may be turned so there.
    turns = set[float].intersection(*({yaw - spot.yaws[0] for yaw in spot.yaws} for spot in spots)) if spots else set()
    in_vain = _in_vain(ctx.arm.spec.name, item.id, base.id, tuple(_place_of(one) for one in scene.objects), on)

    def met(grasp: Grasp, briefly: bool) -> Obstruction | None:
        # What has no place there yet, as in a drawer that is still shut, is told by whoever puts it there.
        if not spots:
            return None
        for turned, obstruction in in_vain[briefly]:
            if turned.has(grasp, _HAND):
                return obstruction
        tcp_pose = held.pose @ item.pose.inverse() @ grasp.tcp_pose
        state = replace(with_aperture(ctx, grasp.width), tcp_pose=tcp_pose)
        open_ones = [spot for spot in spots if any((spot, yaw) not in barred for yaw in spot.yaws)] or spots
        looked_at = open_ones[:: max(1, len(open_ones) // _SPOTS)] if briefly else open_ones
        plan = partial(plan_put, held=held, scene=above, spots=looked_at, allowed=allowed, barred=barred)
        found = rehearse(ctx, hand_planner(ctx), above, state, plan)
        if found is not None:
            in_vain[briefly].append((Turned(grasp, centre(item), turns), found))
        return found

    return met


@cached_for_episode(_CACHED)
def _in_vain(
    robot: str, item: str, base: str, places: tuple[tuple[object, ...], ...], on: bool
) -> dict[bool, list[tuple[Turned, Obstruction]]]:
    """Return a record to be filled of grasps with which a robot's hand has no room where an object goes, by whether that was told briefly.

    What is searched again while nothing but the arm has moved, as in what repairs try out, is answered at once.
    """
    del robot, item, base, places, on
    return {True: [], False: []}


def _place_of(item: DetectedObject) -> tuple[object, ...]:
    """Return what an object is and where it stands, to the millimetre and about half a degree: what a look may differ by is no move."""
    turn = item.pose.rotation.round(2) + 0.0
    return (
        item.id,
        item.kind,
        item.size,
        (item.pose.position.round(3) + 0.0).tobytes(),
        turn.tobytes(),
        round(item.opening or 0.0, 3),
    )


def plan_put(
    arm: Manipulator,
    held: DetectedObject,
    scene: ObservedScene,
    spots: Sequence[Placement],
    allowed: Sequence[str],
    barred: Barred | None = None,
) -> None:
    """Plan how an object is put down, as what places it does; `barred` as of `plan_place`."""
    arm.use(scene, held=held.id)
    plan_place(arm, held, scene, spots, tuple(allowed), barred)


def plan_place(
    arm: Manipulator,
    held: DetectedObject,
    scene: ObservedScene,
    spots: Iterable[Placement],
    allowed: tuple[str, ...],
    barred: Barred | None = None,
) -> PlacePlan:
    """Return the way to the first spot where hand and object have room, coming, opening and going.

    Args:
        arm: The skill's manipulator.
        held: What the gripper holds.
        scene: What is where.
        spots: In order of preference.
        allowed: What the object or the fingers may touch.
        barred: Spots and headings at which the object itself has no room, however it is held: not tried, and added to.

    Raises:
        UnreachableError: No spot can be reached.
        CollisionError: All that can be reached touch something.
    """
    arm.ctx.enter(Phase.PLAN)
    search = _PlaceSearch(arm, held, scene, allowed, {} if barred is None else barred)
    for spot in spots:
        for yaw in search.headings(spot):
            way = search.attempt(spot, yaw)
            if way is not None:
                return way
            if search.is_over:
                raise search.failure
    raise search.failure


class _PlaceSearch:
    """Tries spots and keeps what stood against them."""

    def __init__(
        self,
        arm: Manipulator,
        held: DetectedObject,
        scene: ObservedScene,
        allowed: tuple[str, ...],
        barred: Barred,
    ) -> None:
        self._arm = arm
        self._barred = barred
        self._held = held
        self._scene = scene
        self._allowed = allowed
        observation = arm.state
        self._q = observation.q
        self._width = arm.gripper.width
        self._tcp_in_object = (observation.tcp_pose.inverse() @ held.pose).inverse()
        self._level = levelled(held)
        self._load = carried_along(held, scene)
        self._speed = carry_speed(arm, held, scene, arm.tempo.carry)
        lower = arm.tempo.lower
        self._lower = landing(arm, held, bearable(arm, held, lower)) if isinstance(lower, Timing) else lower
        self._failures: list[SkillError] = []
        self._blocked = self._unreachable = 0
        self._met = Counter[tuple[object, float]]()

    @property
    def failure(self) -> SkillError:
        """Failure of the candidate that came closest: a collision, else the first that is out of reach."""
        return most_telling(self._failures)

    @property
    def is_over(self) -> bool:
        """True when it is time to give up."""
        return self._unreachable >= _MOST_UNREACHABLE or self._blocked >= _MOST_BLOCKED

    def headings(self, spot: Placement) -> Sequence[float]:
        """Return the headings for a spot, those first with which the hand comes from the side to which it is open."""
        if spot.way_out is None:
            return (*spot.yaws, *self._carried_around(spot))
        out = np.array([*spot.way_out, 0.0])
        hands = {yaw: spot.rotation(self._level, yaw) @ self._tcp_in_object.rotation[:, 2] @ out for yaw in spot.yaws}
        return sorted(spot.yaws, key=lambda yaw: round(float(hands[yaw]), 2))

    def _carried_around(self, spot: Placement) -> tuple[float, ...]:
        """Return the heading that an arm of few joints gives an object by turning about its base alone, where any will do."""
        if self._arm.spec.turns_freely or not spot.is_turnable:
            return ()
        base = self._arm.spec.base_position
        (x, y), (x0, y0) = np.array(spot.xy) - base[:2], centre(self._held)[:2] - base[:2]
        return (math.atan2(y, x) - math.atan2(y0, x0),)

    def attempt(self, spot: Placement, yaw: float) -> PlacePlan | None:
        """Return the way to a spot, or None."""
        arm, motion = self._arm, self._arm.motion
        coming = (spot.way_out, yaw)
        if self._met[coming] >= _MOST_MET:
            return None
        if (bar := self._barred.get((spot, yaw))) is not None:
            self._fail(bar)
            return None
        goal = resting_pose(self._held, spot, spot.rotation(self._level, yaw))
        tcp_goal = goal @ self._tcp_in_object
        # Just above the support nothing may be touched; the last millimetres are for the support alone.
        above = raised(tcp_goal, _STAND_OFF if spot.way_out is None else CARRIED_OVER)
        back = None if spot.way_out is None else spot.depth * np.array([*spot.way_out, 0.0])
        try:
            q_above = motion.ik(above, self._q, restarts=_RESTARTS)
            self._hold()
            if (found := motion.touch(q_above)) is not None:
                if isinstance(found.evidence, CollisionEvidence) and found.evidence.body == self._held.id:
                    self._barred[spot, yaw] = found
                    raise found
                if not arm.is_of_links(found):
                    raise found
                q_above = arm.free_posture(above, restarts=0)
            q_goal = motion.ik(tcp_goal, q_above, restarts=_RESTARTS)
            opening = self._opening(q_goal)
            leave = None if back is None else self._way_back(goal, q_goal, opening, back)
            self._hold()
            hover, leans = (
                self._hover(raised(tcp_goal, spot.over), q_above)
                if back is None
                else (motion.ik(moved(above, back), q_above), False)
            )
            motion.plan_line(hover, above, speed=self._lower)
            # From a hover that leans it has the turn that it is to have there before it comes down on anything.
            through = [tcp_goal] if back is None and not leans else [above, tcp_goal]
            motion.allow(*self._load, *self._allowed)
            descent = motion.plan_through(hover, through, speed=self._lower)
            motion.allow(*self._load)
            self._blocked += 1
            way = transfer(arm, hover, level=bool(self._load), speed=self._speed)
            if self._load:
                # Led along lines it may get there in another posture.
                motion.allow(*self._load, *self._allowed)
                descent = motion.plan_through(way.q[-1], through, speed=self._lower)
        except (UnreachableError, CollisionError) as error:
            self._fail(error)
            self._met[coming] += spot.way_out is not None and self._is_hand_on_fixture(error)
            return None
        return PlacePlan(
            goal=goal,
            transfer=way,
            descent=descent,
            points=tuple(through),
            lower=self._lower,
            in_hand=self._tcp_in_object.inverse(),
            opening=opening,
            back=leave,
        )

    def _fail(self, error: SkillError) -> None:
        self._failures.append(error)
        self._unreachable += isinstance(error, UnreachableError)

    def _is_hand_on_fixture(self, error: SkillError) -> bool:
        """Tell whether the hand meets what the object is to go on or into, or another thing that is fixed, as a board over it."""
        met = error.evidence
        if not isinstance(met, CollisionEvidence) or not self._arm.planning.is_of_hand(met.body):
            return False
        other = met.other.partition("/")[0]
        item = self._scene.find(other)
        return other in self._allowed or (item is not None and item.is_fixed)

    def _hold(self) -> None:
        """Plan with the object in hand, and what lies in it free to touch it."""
        self._arm.use(self._scene, held=self._held.id)
        self._arm.motion.allow(*self._load)

    def _opening(self, q: Array) -> float:
        """Return how far the fingers can open around the object at `q` (n,), as far as is wanted or as there is room.

        Raises:
            CollisionError: The hand touches something there, or the fingers cannot let go without touching it.
        """
        motion = self._arm.motion
        # The object stays behind, so the hand no longer carries it along and may touch it.
        self._arm.use(self._scene)
        motion.allow(self._held.id, *self._load)
        free = None
        apart = self._width
        for room in _OPENINGS:
            before, apart = apart, self._width + 2.0 * room
            found = motion.touch_between(q, before, apart)
            if found is not None:
                if free is None or free < _LEAST_OPENING:
                    raise found
                break
            free = room
        return self._width + 2.0 * (free or 0.0)

    def _way_back(self, goal: Pose, q: Array, opening: float, back: Array) -> Array:
        """Return by how much (3,) the hand goes from `q` (n,) to leave what it put down: where it points away from, else where it came from.

        Raises:
            UnreachableError: It cannot.
            CollisionError: It would touch something, or take along what it put down.
        """
        arm, motion = self._arm, self._arm.motion
        arm.use(put(self._scene.holding(None), self._held.id, goal))
        motion.open_to(opening)
        motion.allow()
        tcp = motion.forward(q)
        along = -float(np.linalg.norm(back)) * tcp.rotation[:, 2]
        try:
            motion.plan_line(q, moved(tcp, along))
        except (UnreachableError, CollisionError):
            motion.plan_line(q, moved(tcp, back))
            return back
        return along

    def _hover(self, tcp_goal: Pose, q_above: Array) -> tuple[Array, bool]:
        """Return a configuration over the goal, high if it can be reached, else lower, else leaning, and whether it leans.

        Raises:
            UnreachableError: Not even just above it.
        """
        for height in _HIGHER_HOVERS:
            try:
                return self._arm.motion.ik(raised(tcp_goal, height), q_above, restarts=_RESTARTS), False
            except UnreachableError:
                continue
        try:
            return self._arm.motion.ik(raised(tcp_goal, _LOWEST_HOVER), q_above), False
        except UnreachableError as error:
            failure = error
        for over, height in self._arm.over(tcp_goal, HOVER_HEIGHT):
            # What lies in the object would be spilt.
            if height >= _LOWEST_HOVER and not self._load:
                with suppress(UnreachableError):
                    return self._arm.motion.ik(over, q_above, restarts=0), True
        raise failure


def _as_it_sits(arm: Manipulator, object_id: str, way: PlacePlan, allowed: tuple[str, ...], skill: str) -> PlacePlan:
    """Return the plan with a way down that fits how the object sits in the hand by now, where it has slid on its way.

    The way down stays as it was where that one is blocked.

    Raises:
        NotHoldingError: It has slipped out.
    """
    scene = arm.look(object_id)
    if scene.held != object_id:
        # What only shakes in the hand is seen in it when it is still.
        scene = arm.settle(object_id)
        if slip := first_refuted([fact("holding", object_id)], view := View.of(scene)):
            raise lost(*slip, view, by=skill)
    held = arm.find(object_id, scene)
    in_hand = arm.state.tcp_pose.inverse() @ held.pose
    if np.linalg.norm(in_hand.position - way.in_hand.position) < _SLID and in_hand.angle_to(way.in_hand) < _ASKEW:
        return way
    slid = way.in_hand @ in_hand.inverse()
    points = tuple(point @ slid for point in way.points)
    arm.use(scene, held=object_id)
    arm.motion.allow(*carried_along(held, scene), *allowed)
    try:
        descent = arm.motion.plan_through(arm.q, points, speed=way.lower)
    except (UnreachableError, CollisionError):
        return way
    return replace(way, descent=descent, points=points, in_hand=in_hand)


def _lower(arm: Manipulator, object_id: str, way: PlacePlan, lower: Callable[[PlacePlan], None] | None) -> None:
    """Bring what is held down; what a limit of force stops there, and the hand holds no more, is let go."""
    try:
        if lower is None:
            arm.follow(way.descent, Phase.LOWER, yielding=True)
        else:
            lower(way)
    except LimitError:
        # What leans on a finger would be taken to stand by itself; where that cannot be seen or done, the stop is what is told.
        with suppress(RoboSandboxError):
            if arm.look().held != object_id:
                arm.open(way.opening)
        raise


def _release(arm: Manipulator, object_id: str, way: PlacePlan) -> None:
    arm.ctx.enter(Phase.RELEASE)
    arm.driver.wait(_RELEASE_SECONDS)
    before = arm.gripper.width
    arm.open(way.opening, wait=False)
    # The rest of the way the fingers go while the hand begins to rise.
    arm.wait_for_fingers(until=before + _OPENED * (way.opening - before))
    arm.use(arm.feel())
    arm.motion.allow(object_id)
    if way.back is not None:
        out = arm.motion.plan_line(arm.q, moved(arm.state.tcp_pose, way.back), speed=arm.tempo.leave)
        arm.follow(out, Phase.RETREAT)
        return
    try:
        arm.rise(HOVER_HEIGHT, Phase.RETREAT, speed=arm.tempo.leave)
    except CollisionError:
        # The fingers opened against a neighbour; straight up is still the way that disturbs it least.
        arm.rise_out(HOVER_HEIGHT, Phase.RETREAT, speed=CAREFUL.lower)
    except UnreachableError:
        # At the end of its reach the arm goes back up as it came down.
        back = [*reversed(way.points[:-1]), arm.motion.forward(way.descent.q[0])]
        out = arm.motion.plan_through(arm.q, back, speed=arm.tempo.leave)
        arm.follow(out, Phase.RETREAT)


def _from_aside(arm: Manipulator, object_id: str) -> ObservedScene:
    """Take the arm out of the cameras' way and look again; where it finds no way it looks from where it is."""
    scene = arm.look()
    arm.use(scene)
    try:
        away = arm.motion.plan_joints(arm.q, arm.spec.home_q, speed=arm.tempo.free)
    except CollisionError:
        return scene
    arm.follow(away, Phase.RETREAT)
    return arm.settle(object_id)


def occupied(held: str, target: str, blocking: Sequence[str]) -> PlacementError:
    """Return the error for a place that has no room."""
    by = f"occupied by {', '.join(blocking)}" if blocking else "off the table or too small"
    return PlacementError(
        f"no room for {held} at {target}: {by}; clear it or choose another place",
        phase=Phase.PLAN,
        evidence=PlacementEvidence(object=held, target=target, reason="occupied", blocking=tuple(blocking)),
    )


def _precarious(goal: Pose, actual: Pose, relation: MeasuredRelation) -> bool:
    """Tell whether what was put down stands askew or near the edge of what it is on: it may be on its way over."""
    askew = float(goal.rotation[:, 2] @ actual.rotation[:, 2]) < math.cos(_ASKEW)
    return askew or relation.detail.get("margin_mm", math.inf) < _EDGE_MM


def _toppled(goal: Pose, actual: Pose) -> bool:
    return bool((goal.rotation[2] @ actual.rotation[2]) < 0.9)
