"""Pick: hold an object and lift it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from robosandbox.errors import (
    CollisionError,
    CollisionEvidence,
    GraspError,
    GraspEvidence,
    Phase,
    SkillError,
    TrackingError,
    UnreachableError,
)
from robosandbox.grasp.analytic import closing_directions, width_along
from robosandbox.perception.relations import bottom, bounds
from robosandbox.protocols import SkillContext
from robosandbox.skills.base import Skill
from robosandbox.skills.manipulator import (
    CARRY_SPEED,
    FREE_SPEED,
    HOVER_HEIGHT,
    LIFT_HEIGHT,
    Manipulator,
    MetError,
    check_rise,
    withdrawn,
)
from robosandbox.skills.sensing import (
    LoadMeter,
    changed,
    check_closed,
    check_open,
    check_uncovered,
    finger_side,
    lift_error,
)
from robosandbox.types import Array, DetectedObject, Grasp, GraspSearch, ObservedScene, Pose, SkillResult, Trajectory

_PRESHAPE_CLEARANCE = 0.02
_LEAST_RISE = 0.5
_CLOSED_ON_NOTHING = 0.5
_ATTEMPTS = 3
_LOOKS = 5
_FINAL = ("immovable", "too_heavy", "gripper_stuck")
_STRAIGHT_DOWN = 0.999
_LOW_HOVERS = (0.055, 0.035)
_HOVER_CLEARANCE = 0.004


@dataclass(frozen=True, slots=True)
class _GraspPlan:
    grasp: Grasp
    aperture: float
    approach: Trajectory
    descent: Trajectory


class Pick(Skill):
    """Hold an object and lift it."""

    name = "pick"

    def run(self, ctx: SkillContext, *, object: str) -> SkillResult:
        """Grasp an object and lift it clear of what it stands on.

        Args:
            object: Id of the object.

        Raises:
            ObjectNotFoundError: It is not seen.
            AlreadyHoldingError: The gripper is full.
            GraspError: No grasp fits, the fingers met nothing, or it slipped.
            UnreachableError: No grasp can be reached.
            CollisionError: Every grasp would touch something else.
            TrackingError: The arm did not arrive.
        """
        arm = Manipulator(ctx)
        target = arm.find(object)
        if arm.start.held == object:
            return _lift_held(arm, target)
        arm.require_empty()
        excluded: list[Grasp] = []
        looks, least_aperture, felt = 0, 0.0, np.zeros(3)
        scene = arm.start
        while True:
            seen = _shifted(arm.find(object, scene), felt)
            check_uncovered(seen, scene)
            plan = _plan_grasp(arm, seen, scene, excluded, least_aperture)
            try:
                arm.open(plan.aperture, wait=False)
                arm.follow(plan.approach, Phase.APPROACH, guarded=True)
                check_open(arm, plan.grasp, plan.aperture)
                if looks < _LOOKS and changed(scene, arm.look()):
                    looks, scene = looks + 1, arm.settle(object)
                    continue
                return self._execute(arm, target, plan)
            except (GraspError, TrackingError) as error:
                if isinstance(error.evidence, GraspEvidence) and error.evidence.reason in _FINAL:
                    _back_off(arm, error)
                    raise
                if isinstance(error, MetError) and error.other == object:
                    felt = felt + _towards(arm, plan, error.body)
                    least_aperture = arm.geometry.max_aperture
                excluded.append(plan.grasp)
                if len(excluded) >= _ATTEMPTS:
                    raise
                _back_off(arm, error)
                scene = arm.look()

    def _execute(self, arm: Manipulator, target: DetectedObject, plan: _GraspPlan) -> SkillResult:
        grasp = plan.grasp
        try:
            arm.follow(plan.descent, Phase.DESCEND, guarded=True)
        except MetError as met:
            # Where the palm meets an object that is taller than it seems, the fingers are beside it already.
            if met.other != target.id or finger_side(arm.sim, met.body) != 0:
                raise
        arm.ctx.enter(Phase.GRASP)
        before = arm.gripper.width
        arm.close()
        check_closed(arm, grasp, before)
        width, geometry = arm.gripper.width, arm.geometry
        empty = geometry.min_aperture + _CLOSED_ON_NOTHING * (grasp.width - geometry.min_aperture)
        scene = arm.look()
        if width < empty and scene.held != target.id:
            raise _missed(arm, grasp, width)
        after = _lift(arm, arm.find(target.id, scene), grasp.width)
        return SkillResult(
            skill=self.name,
            detail={
                "object": target.id,
                "dz_mm": 1000.0 * (bottom(after) - bottom(target)),
                "width_mm": 1000.0 * width,
            },
            side_effects=arm.disturbed(target.id),
        )


def _lift_held(arm: Manipulator, target: DetectedObject) -> SkillResult:
    """Lift what the gripper holds already, if it has not been lifted: an earlier pick may have been stopped."""
    if bottom(target) - arm.start.table_height < _LEAST_RISE * LIFT_HEIGHT:
        _lift(arm, target, arm.gripper.width)
    return SkillResult(
        skill=Pick.name,
        detail={"object": target.id, "already_held": True, "width_mm": 1000.0 * arm.gripper.width},
        side_effects=arm.disturbed(target.id),
    )


def _lift(arm: Manipulator, target: DetectedObject, width: float) -> DetectedObject:
    """Lift what the fingers have closed on, and return where it is seen when it is still.

    Args:
        arm: Whose hand.
        target: The object as it lies between the fingers.
        width: Its extent between them, metres.

    Raises:
        GraspError: It did not come up.
    """
    arm.use(arm.look(), held=target.id)
    arm.motion.allow("table", *(item.id for item in arm.start.objects))
    load = LoadMeter(arm.sim, target.id)
    arm.sim.tick_hooks.append(load)
    try:
        rise = arm.rise(LIFT_HEIGHT, Phase.LIFT, speed=CARRY_SPEED)
    except TrackingError:
        raise lift_error(arm, target, width, load.pull) from None
    finally:
        arm.sim.tick_hooks.remove(load)
    # What slips out is still moving.
    scene = arm.settle(target.id)
    after = arm.find(target.id, scene)
    if scene.held != target.id or bottom(after) - bottom(target) < _LEAST_RISE * rise:
        raise lift_error(arm, target, width, load.pull)
    return after


def _back_off(arm: Manipulator, error: SkillError) -> None:
    """Let go and rise, so that the next grasp starts from free space."""
    arm.open()
    arm.use(arm.look())
    arm.motion.allow(*(item.id for item in arm.start.objects))
    try:
        arm.rise(HOVER_HEIGHT, Phase.RETREAT)
    except (UnreachableError, CollisionError):
        raise error from None


def _plan_grasp(
    arm: Manipulator, target: DetectedObject, scene: ObservedScene, excluded: list[Grasp], least_aperture: float
) -> _GraspPlan:
    """Return the first candidate whose approach, descent and lift are all possible.

    Raises:
        GraspError: There is no candidate.
        UnreachableError: None can be reached.
        CollisionError: All that can be reached touch something.
    """
    arm.ctx.enter(Phase.PLAN)
    geometry, motion = arm.geometry, arm.motion
    candidates = [g for g in arm.ctx.grasp.candidates(target, scene, arm.sim.robot) if g not in excluded]
    if not candidates:
        raise _no_candidate(arm, target)
    arm.use(scene)
    q = arm.q
    failures: list[SkillError] = []
    telling: list[SkillError] = []
    ordered = _nearest_first(arm, candidates)
    for index, grasp in enumerate(ordered):
        aperture = min(geometry.max_aperture, max(least_aperture, grasp.width + 2.0 * _PRESHAPE_CLEARANCE))
        try:
            motion.open_to(aperture)
            hover = _hover(arm, grasp, target, q)
            motion.allow()
            approach = motion.plan_joints(q, hover, speed=FREE_SPEED)
            motion.allow(target.id)
            descent = motion.plan_line(hover, grasp.tcp_pose, speed=CARRY_SPEED)
            check_rise(arm, grasp.tcp_pose, LIFT_HEIGHT / 2.0, hover)
        except (UnreachableError, CollisionError) as error:
            failures.append(error)
            if not _is_of_leaning(error, grasp):
                telling.append(error)
            continue
        arm.ctx.announce(GraspSearch(candidates=tuple(ordered), chosen=index))
        return _GraspPlan(grasp, aperture, approach, descent)
    arm.ctx.announce(GraspSearch(candidates=tuple(ordered), chosen=None))
    raise _most_telling(failures, telling or failures)


def _is_of_leaning(error: SkillError, grasp: Grasp) -> bool:
    """Tell whether a leaning hand touches what the object stands on, which says nothing of why it had to lean."""
    evidence = error.evidence
    leaning = float(grasp.tcp_pose.rotation[2, 2]) > -_STRAIGHT_DOWN
    return leaning and isinstance(evidence, CollisionEvidence) and evidence.other == "table"


def _hover(arm: Manipulator, grasp: Grasp, target: DetectedObject, q: Array) -> Array:
    """Return a configuration behind the grasp along its approach: far if it can be reached, else nearer.

    Raises:
        UnreachableError: Not even just above the object.
    """
    top = float(bounds(target)[1][2]) - grasp.tcp_pose.xyz[2]
    least = max(top, 0.0) + arm.geometry.tip_depth + _HOVER_CLEARANCE
    *higher, lowest = (HOVER_HEIGHT, *(h for h in _LOW_HOVERS if h >= least))
    for height in higher:
        try:
            return arm.motion.ik(withdrawn(grasp.tcp_pose, height), q)
        except UnreachableError:
            continue
    return arm.motion.ik(withdrawn(grasp.tcp_pose, lowest), q)


def _nearest_first(arm: Manipulator, candidates: list[Grasp]) -> list[Grasp]:
    """Order grasps of about equal quality by how little the hand has to turn."""
    hand = arm.sim.observe().tcp_pose.rotation

    def key(grasp: Grasp) -> tuple[float, float]:
        return (-round(grasp.quality, 1), -float(np.trace(hand.T @ grasp.tcp_pose.rotation)))

    return sorted(candidates, key=key)


def _most_telling(failures: list[SkillError], telling: list[SkillError]) -> SkillError:
    """Return, of the telling ones, the failure that came closest to working: a collision, else the smallest residual."""
    counts = Counter(str(error.code) for error in failures)
    collisions = [error for error in telling if isinstance(error, CollisionError)]
    if collisions:
        chosen: SkillError = collisions[0]
    else:
        unreachable = [error for error in telling if isinstance(error, UnreachableError)]
        chosen = min(unreachable, key=lambda error: _residual(error))
    tried = ", ".join(f"{count} {code}" for code, count in sorted(counts.items()))
    chosen.message = f"{chosen.message} (grasps tried: {tried})"
    return chosen


def _residual(error: UnreachableError) -> float:
    evidence = error.evidence
    return getattr(evidence, "position_error", np.inf) + 0.3 * getattr(evidence, "orientation_error", np.inf)


def _no_candidate(arm: Manipulator, target: DetectedObject) -> GraspError:
    widths = [width_along(target, direction) for direction in closing_directions(target)]
    geometry = arm.geometry
    narrowest = min(widths)
    reason = (
        f"it is {narrowest * 1000:.0f} mm wide and the gripper opens to {geometry.max_aperture * 1000:.0f} mm"
        if narrowest >= geometry.max_aperture - 0.006
        else "it is too flat for the fingers"
        if narrowest > geometry.min_aperture + 0.001
        else f"it is {narrowest * 1000:.1f} mm thin, less than the gripper can hold"
    )
    return GraspError(
        f"no grasp fits {target.id}: {reason}",
        phase=Phase.PLAN,
        evidence=GraspEvidence(
            object=target.id,
            reason="none_found",
            object_width=narrowest,
            aperture=arm.gripper.width,
            max_aperture=geometry.max_aperture,
        ),
    )


def _shifted(target: DetectedObject, shift: Array) -> DetectedObject:
    """Return the object as if it lay elsewhere by `shift` (3,)."""
    return replace(target, pose=Pose.from_matrix(target.pose.position + shift, target.pose.rotation))


def _towards(arm: Manipulator, plan: _GraspPlan, body: str) -> Array:
    """Return by how much (3,) an object that a finger came down on lies nearer to that finger than it was seen."""
    spare = (plan.aperture - plan.grasp.width) / 2.0 + arm.geometry.finger_thickness / 2.0
    closing = plan.grasp.tcp_pose.rotation[:, 1] * [1.0, 1.0, 0.0]
    shift: Array = finger_side(arm.sim, body) * spare * closing
    return shift


def _missed(arm: Manipulator, grasp: Grasp, width: float) -> GraspError:
    return GraspError(
        f"closed on nothing: the fingers are {width * 1000:.1f} mm apart and {grasp.object} is {grasp.width * 1000:.1f} mm "
        "wide; look again and try another grasp",
        phase=Phase.GRASP,
        evidence=GraspEvidence(
            object=grasp.object,
            reason="missed",
            object_width=grasp.width,
            aperture=width,
            max_aperture=arm.geometry.max_aperture,
        ),
    )
