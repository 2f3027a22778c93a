"""Choosing a grasp: the first candidate whose hand, approach, descent and lift are all free and in reach."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from robosandbox.errors import CollisionError, GraspError, Phase, SkillError, UnreachableError
from robosandbox.evidence import CollisionEvidence, GraspEvidence
from robosandbox.grasp.analytic import narrowest
from robosandbox.grasp.hand import FINGER_CLEARANCE, THINNEST
from robosandbox.grasp.solid import ROUND_DIRECTIONS
from robosandbox.grasp.suction import least_face, widest_face
from robosandbox.skills.primitives.drawing_out import carried_out
from robosandbox.skills.primitives.manipulator import (
    HOVER_HEIGHT,
    LIFT_HEIGHT,
    Manipulator,
    moved,
    withdrawn,
)
from robosandbox.skills.primitives.rising import check_rise
from robosandbox.types import Array, DetectedObject, Grasp, GraspSearch, ObservedScene, Pose, Trajectory
from robosandbox.types.robot import GripperGeometry
from robosandbox.values import frozen
from robosandbox.world.abilities import Obstruction
from robosandbox.world.covered import ways_out
from robosandbox.world.placement_sampling import about_z
from robosandbox.world.relations import support

# How much wider than the object the fingers come on each side, metres, the widest that is free first; chosen as a
# size's error, ten times over where there is room (halved, episodes are 2 % shorter, doubled 1 % longer).
_OPENINGS = (0.02, 0.01, 0.005)
# Cosine of the angle to the vertical below which a hand leans; chosen as 2.6 degrees.
_STRAIGHT_DOWN = 0.999
# Angle by which fingers may close askew, radians: within the cone of a friction of 0.4.
_ASKEW = math.atan(0.4)
# Metres behind a grasp, tried where HOVER_HEIGHT is out of reach; chosen for arms whose reach ends just over the table
# (docs/arms.md).
_LOW_HOVERS = (0.055, 0.035)
# Metres between the fingertips at a hover and the object; chosen as four times the planner's clearance.
_HOVER_CLEARANCE = 0.004
# Tries out of reach after which grasps of the same kind and lean are passed over; chosen because they differ by a turn
# alone.
_MOST_UNREACHABLE = 6
# Grasps of one kind and lean that meet what is fixed, after which others have their turn: those of one lean around a round object, both ways.
_MOST_MET_FIXED = 2 * ROUND_DIRECTIONS
# Grasps that are tried for one object; chosen so that even a mesh's every side has its turn, and a refusal comes soon.
_MOST_TRIED = 160
# Least cosine between the approach of a hand that reaches in from the side and the way in.
_INWARDS = 0.7
# Grasps whose approach may be blocked; chosen because each blocked way is searched for by sampling, which takes
# longest.
_MOST_BLOCKED = 5
# Sampled starts for a configuration; chosen as half of the planner's 60: another grasp is worth more than a harder
# search.
_RESTARTS = 30
# Metres between two grasps that are tried as one; chosen below a fingertip's width.
_SAME_PLACE = 0.008
# Cosine between the axes of two such grasps; chosen as 14 degrees.
_SAME_TURN = 0.97


@frozen
class GraspPlan:
    """A grasp and the way to it.

    Attributes:
        grasp: What to hold and how.
        aperture: How far apart the fingers come, metres.
        approach: To the hover.
        descent: From there to the grasp.
        out: Level way (3,) on which it is drawn out from under what is over it, metres; None where it rises.
    """

    grasp: Grasp
    aperture: float
    approach: Trajectory
    descent: Trajectory
    out: Array | None = None


def plan_grasp(
    arm: Manipulator,
    target: DetectedObject,
    scene: ObservedScene,
    excluded: Sequence[Grasp] = (),
    least_aperture: float = 0.0,
    *,
    met: Callable[[Grasp, bool], Obstruction | None] | None = None,
) -> GraspPlan:
    """Return the first candidate whose approach, descent and lift are all possible.

    Args:
        arm: The skill's manipulator.
        target: What to hold, as seen now.
        scene: What else is there.
        excluded: Grasps that were tried and did not hold, in the object's frame.
        least_aperture: How far apart the fingers are to come at least, metres.
        met: Tells what is met later with a grasp, where it is of no use for that; with True it looks at a few places alone, and
            may tell of something where there is room elsewhere.

    Raises:
        GraspError: There is no candidate.
        UnreachableError: None can be reached.
        CollisionError: All that can be reached touch something.
    """
    arm.ctx.enter(Phase.PLAN)
    arm.use(scene)
    pieces = arm.planning.pieces(target.id)
    hand = arm.state.tcp_pose.rotation
    found = arm.ctx.grasp.candidates(target, scene, arm.spec, pieces=pieces, hand=hand)
    ways = ways_out(target, scene.objects, 2.0 * LIFT_HEIGHT)
    search = _GraspSearch(arm, target, scene, least_aperture, ways)
    later = list[Obstruction]()
    tried = [Turned(other, np.zeros(3)) for other in excluded]
    fresh = (grasp for grasp in found if not any(other.has(in_frame(grasp, target)) for other in tried))
    candidates: Iterable[Grasp] = (_faced(arm, grasp) for grasp in fresh)
    if ways:
        # A hand from above has no room there as a rule.
        candidates = sorted(candidates, key=lambda grasp: _way_of(grasp, ways) is None)
    # A cup is to touch what it is to hold.
    touched = () if arm.geometry.cup is None else (target.id,)
    # Most grasps with which there is room have it at the first place that is looked at; the others are told at length if need be.
    for briefly in (True, False) if met is not None else (False,):
        left, later = list[Grasp](), list[Obstruction]()
        for grasp in search.in_turn(candidates):
            if met is not None and (obstruction := met(grasp, briefly)) is not None:
                later.append(obstruction)
                left.append(grasp)
                continue
            plan = search.attempt(grasp, *touched)
            if plan is not None:
                arm.ctx.announce(GraspSearch(candidates=tuple(search.tried), chosen=len(search.tried) - 1))
                return plan
            if search.is_over:
                break
        if search.is_over:
            break
        candidates = left
    # Where the measured gap is not exact, as of curved fingers, the hand may seem to touch what it is to hold.
    for grasp in tuple(search.touching):
        if _way_of(grasp, ways) is not None:
            # Coming level a finger would pass through its wall unseen.
            continue
        plan = search.attempt(grasp, target.id)
        if plan is not None:
            arm.ctx.announce(GraspSearch(candidates=tuple(search.tried), chosen=len(search.tried) - 1))
            return plan
    arm.ctx.announce(GraspSearch(candidates=tuple(search.tried), chosen=None))
    if later and not search.failures:
        raise CollisionError(f"{later[0].cause} where {target.id} is to go, with each grasp of it", phase=Phase.PLAN)
    if not search.failures:
        raise _no_candidate(arm, target, pieces)
    raise _most_telling(search.failures)


def _faced(arm: Manipulator, grasp: Grasp) -> Grasp:
    """Return a grasp for which the hand need not turn where it cannot and is nearly right as it is: friction does the rest."""
    hand, rotation = arm.state.tcp_pose.rotation, grasp.tcp_pose.rotation
    if arm.planning.can_face(rotation) or np.trace(hand.T @ rotation) < 1.0 + 2.0 * math.cos(_ASKEW):
        return grasp
    return replace(grasp, tcp_pose=Pose.from_matrix(grasp.tcp_pose.position, hand))


def in_frame(grasp: Grasp, target: DetectedObject) -> Grasp:
    """Return the grasp with its TCP pose in the object's frame, to know it again when the object has moved."""
    pose = target.pose.inverse() @ grasp.tcp_pose
    return Grasp(object=grasp.object, tcp_pose=pose, width=grasp.width, quality=grasp.quality, how=grasp.how)


class _GraspSearch:
    """Tries candidates and keeps what stood against them.

    Attributes:
        tried: Candidates, in order.
        failures: Each candidate's.
        touching: Candidates whose hand would touch the target itself, fingers by no more than their clearance.
    """

    def __init__(
        self,
        arm: Manipulator,
        target: DetectedObject,
        scene: ObservedScene,
        least_aperture: float,
        ways: Sequence[Array],
    ) -> None:
        self._arm = arm
        self._least_aperture = least_aperture
        self._target = target
        self._ways = ways
        self._scene = scene
        self._q = arm.q
        self._unreachable: Counter[tuple[str, float]] = Counter()
        self._met_fixed: Counter[tuple[str, float]] = Counter()
        self.tried: list[Grasp] = []
        self._blocked = 0
        self.failures: list[tuple[Grasp, SkillError]] = []
        self.touching: list[Grasp] = []

    def in_turn(self, grasps: Iterable[Grasp]) -> Iterator[Grasp]:
        """Yield grasps in their order, but last those of a kind and lean of which many have met what is fixed."""
        later = list[Grasp]()
        for grasp in grasps:
            if self._met_fixed[_kind(grasp)] < _MOST_MET_FIXED:
                yield grasp
            else:
                later.append(grasp)
        yield from later

    @property
    def is_over(self) -> bool:
        """True when it is time to give up."""
        return len(self.tried) >= _MOST_TRIED or self._blocked >= _MOST_BLOCKED

    def attempt(self, grasp: Grasp, *allowed: str) -> GraspPlan | None:
        """Return the way to a grasp, or None."""
        kind = _kind(grasp)
        if self._unreachable[kind] >= _MOST_UNREACHABLE:
            return None
        self.tried.append(grasp)
        geometry, motion = self._arm.geometry, self._arm.motion
        try:
            q_grasp = self._ik(grasp.tcp_pose)
            out = _way_of(grasp, self._ways)
            hovers = [withdrawn(grasp.tcp_pose, height) for height in self._hovers(grasp)]
            if out is not None:
                hovers = [moved(grasp.tcp_pose, out)]
        except UnreachableError as error:
            self._unreachable[kind] += 1
            self.failures.append((grasp, error))
            return None
        failure: SkillError | None = None
        wanted = (max(self._least_aperture, grasp.width + 2.0 * room) for room in _OPENINGS)
        for aperture in dict.fromkeys(min(geometry.max_aperture, aperture) for aperture in wanted):
            motion.open_to(aperture)
            motion.allow(*allowed)
            failure = motion.touch(q_grasp)
            if failure is None:
                try:
                    self._check_closing(grasp, aperture, q_grasp, *allowed)
                    descent = self._descent(grasp, hovers, q_grasp)
                    # What is drawn out rises where the hand came from.
                    risen_at = descent.q[-1] if out is None else descent.q[0]
                    check_rise(self._arm, risen_at, LIFT_HEIGHT / 2.0, self._target.id)
                    if out is not None:
                        self._check_out(grasp, aperture, descent.q[-1], out, *allowed)
                    return self._plan(grasp, aperture, descent, out)
                except (UnreachableError, CollisionError) as error:
                    failure = error
            if not self._is_of_fingers(failure):
                break
        assert failure is not None
        if self._may_only_seem(failure):
            self.touching.append(grasp)
        self._met_fixed[kind] += self._is_of_fixed(failure)
        self.failures.append((grasp, failure))
        return None

    def _is_of_fixed(self, failure: SkillError) -> bool:
        """Tell whether something fixed is in the way, be it over the object or beside it."""
        met = failure.evidence
        item = self._scene.find(met.other.partition("/")[0]) if isinstance(met, CollisionEvidence) else None
        return item is not None and item.is_fixed

    def _may_only_seem(self, failure: SkillError) -> bool:
        """Tell whether the hand may hold the target all the same, though it would touch it.

        A palm that comes down on what is taller than it seems has the fingers beside it; fingers that come down on it do not.
        """
        met = failure.evidence
        if not isinstance(met, CollisionEvidence) or met.other != self._target.id:
            return False
        return met.depth <= FINGER_CLEARANCE or self._arm.planning.finger_side(met.body) == 0

    def _check_closing(self, grasp: Grasp, aperture: float, q_grasp: Array, *allowed: str) -> None:
        """Check that the fingers meet nothing else on their way from `aperture` to the object, as a wall between them.

        Raises:
            CollisionError: They do.
        """
        motion = self._arm.motion
        motion.allow("table", grasp.object, *allowed)
        met = motion.touch_between(q_grasp, aperture, grasp.width)
        if met is not None:
            raise met
        motion.open_to(aperture)
        motion.allow(*allowed)

    def _check_out(self, grasp: Grasp, aperture: float, q: Array, out: Array, *allowed: str) -> None:
        """Check that what is held at `q` (n,) can be carried out on a level way (3,).

        Raises:
            UnreachableError: The way is out of reach.
            CollisionError: Something is in it.
        """
        motion = self._arm.motion
        motion.use(self._arm.planning, replace(self._arm.state, q=q, tcp_pose=motion.forward(q)), held=self._target.id)
        motion.open_to(grasp.width)
        try:
            carried_out(self._arm, self._target, self._scene, q, out)
        finally:
            self._arm.use(self._scene)
            motion.open_to(aperture)
            motion.allow(*allowed)

    def _ik(self, pose: Pose) -> Array:
        """Return a configuration near where the arm is, or near home: others may lead to where no line goes on.

        Raises:
            UnreachableError: There is none.
        """
        for seed in (self._q, self._arm.spec.home_q):
            try:
                return self._arm.motion.ik(pose, seed, restarts=0)
            except UnreachableError:
                continue
        return self._arm.motion.ik(pose, self._arm.spec.home_q, restarts=_RESTARTS)

    def _plan(self, grasp: Grasp, aperture: float, descent: Trajectory, out: Array | None) -> GraspPlan:
        """Add the approach, which is what takes longest to find."""
        self._arm.motion.allow()
        try:
            approach = self._arm.motion.plan_joints(self._q, descent.q[0], speed=self._arm.tempo.free)
        except CollisionError:
            self._blocked += 1
            raise
        return GraspPlan(grasp, aperture, approach, descent, out)

    def _hovers(self, grasp: Grasp) -> Iterator[float]:
        """Yield distances behind the grasp from which to come: far ones first."""
        approach = grasp.tcp_pose.rotation[:, 2]
        behind = float(support(self._target, -approach[None])[0] + approach @ grasp.tcp_pose.position)
        least = max(behind, 0.0) + self._arm.geometry.tip_depth + _HOVER_CLEARANCE
        yield HOVER_HEIGHT
        yield from (height for height in _LOW_HOVERS if height >= least)

    def _descent(self, grasp: Grasp, hovers: Sequence[Pose], q_grasp: Array) -> Trajectory:
        """Return a straight way to the grasp, from far behind it if that can be reached, else from nearer.

        Raises:
            UnreachableError: Not even from just behind the object.
            CollisionError: Something is in the way.
        """
        failure: UnreachableError | None = None
        for pose in hovers:
            for seed in (q_grasp, self._q):
                try:
                    hover = self._arm.motion.ik(pose, seed, restarts=_RESTARTS)
                    return self._arm.motion.plan_line(hover, grasp.tcp_pose, speed=self._arm.tempo.near)
                except UnreachableError as error:
                    failure = error
        assert failure is not None
        raise failure

    def _is_of_fingers(self, failure: SkillError) -> bool:
        """Tell whether fingers that open less could cure it."""
        evidence = failure.evidence
        return isinstance(evidence, CollisionEvidence) and self._arm.planning.is_of_gripper(evidence.body)


def _kind(grasp: Grasp) -> tuple[str, float]:
    """Return how a hand holds an object, and how it leans; grasps of one kind differ by a turn, or by where on the object they are."""
    return grasp.how, round(float(grasp.tcp_pose.rotation[2, 2]), 1)


def _way_of(grasp: Grasp, ways: Sequence[Array]) -> Array | None:
    """Return the way out (3,) that is against a grasp's approach, where there is one."""
    against = [way for way in ways if grasp.tcp_pose.rotation[:, 2] @ way < -_INWARDS * float(np.linalg.norm(way))]
    return against[0] if against else None


class Turned:
    """Grasps that are one but for a turn of the object, for comparison.

    Args:
        grasp: One of them.
        middle: A point of the vertical about which it is turned, shape (3,).
        turns: Angles, radians.
    """

    def __init__(self, grasp: Grasp, middle: Array, turns: Iterable[float] = (0.0,)) -> None:
        about = np.array([about_z(angle) for angle in turns])
        self._positions: Array = middle + about @ (grasp.tcp_pose.position - middle)
        self._rotations: Array = about @ grasp.tcp_pose.rotation

    def has(self, grasp: Grasp, within: float = _SAME_PLACE) -> bool:
        """Tell whether a grasp is the same as one of these for practical purposes: the hand turned alike, and within some metres."""
        near = np.square(self._positions - grasp.tcp_pose.position).sum(axis=1) < within * within
        if not near.any():
            return False
        axes = (self._rotations[near] * grasp.tcp_pose.rotation).sum(axis=1)
        return bool((axes > _SAME_TURN).all(axis=1).any())


def _is_of_leaning(grasp: Grasp, error: SkillError) -> bool:
    """Tell whether a leaning hand touches what the object stands on, which says nothing of why it had to lean."""
    evidence = error.evidence
    leaning = float(grasp.tcp_pose.rotation[2, 2]) > -_STRAIGHT_DOWN
    return leaning and isinstance(evidence, CollisionEvidence) and evidence.other == "table"


def _most_telling(failures: Sequence[tuple[Grasp, SkillError]]) -> SkillError:
    """Return, of the telling ones, the failure that came closest to working: a collision, else the smallest residual."""
    counts = Counter(error.code for _, error in failures)
    telling = [error for grasp, error in failures if not _is_of_leaning(grasp, error)]
    telling = telling or [error for _, error in failures]
    collisions = [error for error in telling if isinstance(error, CollisionError)]
    if collisions:
        chosen: SkillError = collisions[0]
    else:
        unreachable = [error for error in telling if isinstance(error, UnreachableError)]
        chosen = min(unreachable, key=lambda error: _residual(error))
    tried = ", ".join(f"{count} {code}" for code, count in sorted(counts.items()))
    return chosen.with_(message=f"{chosen.message} (grasps tried: {tried})")


def _residual(error: UnreachableError) -> float:
    evidence = error.evidence
    return getattr(evidence, "position_error", np.inf) + 0.3 * getattr(evidence, "orientation_error", np.inf)


def why_no_grasp(geometry: GripperGeometry, target: DetectedObject, pieces: Sequence[Array]) -> str:
    """Return why no grasp fits an object, in a clause."""
    if geometry.cup is not None:
        widest = widest_face(target, pieces)
        has = f"its widest measures {widest * 1000:.0f} mm" if widest else "it has none"
        return f"this cup holds flat faces of at least {least_face(geometry.cup) * 1000:.0f} mm across, and {has}"
    width = narrowest(target, pieces, geometry.min_aperture + THINNEST)
    if width >= geometry.max_aperture - 2.0 * FINGER_CLEARANCE:
        return f"it is {width * 1000:.0f} mm wide and the gripper opens to {geometry.max_aperture * 1000:.0f} mm"
    if width > geometry.min_aperture + THINNEST:
        if len(pieces) > 1:
            return "where it is thin enough for the hand there is no room for fingers and palm"
        return "it is too flat for the fingers"
    least = geometry.min_aperture * 1000
    return f"it is {width * 1000:.1f} mm thin, less than the gripper can hold: it closes to {least:.0f} mm"


def _no_candidate(arm: Manipulator, target: DetectedObject, pieces: Sequence[Array]) -> GraspError:
    geometry = arm.geometry
    return GraspError(
        f"no grasp fits {target.id}: {why_no_grasp(geometry, target, pieces)}",
        phase=Phase.PLAN,
        evidence=GraspEvidence(
            object=target.id,
            reason="none_found",
            object_width=narrowest(target, pieces, geometry.min_aperture + THINNEST) if geometry.cup is None else None,
            aperture=arm.gripper.width,
            max_aperture=geometry.max_aperture,
        ),
    )
