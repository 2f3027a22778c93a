"""Pick: hold an object and lift it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from robosandbox.errors import CollisionError, GraspError, LimitError, Phase, SkillError, TrackingError
from robosandbox.evidence import CollisionEvidence, GraspEvidence
from robosandbox.skills.base import Skill
from robosandbox.skills.executor import require
from robosandbox.skills.primitives.drawing_out import draw_out
from robosandbox.skills.primitives.grasping import GraspPlan, in_frame, plan_grasp
from robosandbox.skills.primitives.gripping import Grip, empty_aperture
from robosandbox.skills.primitives.guarded import MetError, back_off, follow_free, follow_until
from robosandbox.skills.primitives.lifting import alone, free_of_others, rise_with, wedged
from robosandbox.skills.primitives.loads import LoadMeter, is_over, lift_error
from robosandbox.skills.primitives.manipulator import LIFT_HEIGHT, Manipulator
from robosandbox.skills.primitives.nudging import nudge_off_walls
from robosandbox.skills.primitives.placing import obstruction_there, opened_wide
from robosandbox.skills.primitives.sensing import around, changed, check_closed, check_open, check_sealed
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, DetectedObject, Grasp, ObservedScene, Pose, SkillResult
from robosandbox.world.abilities import Obstruction
from robosandbox.world.alternatives import Alternative, FailedCall
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.nearness import nearer
from robosandbox.world.relations import bottom

# Share of the hand's rise that a held object rises at least.
_MIN_RISE_FRACTION = 0.5
# Grasps that are tried; chosen: of 480 perturbed episodes 477 recover with three (docs/measured.md).
_ATTEMPTS = 3
# Failures that measure the load. They outrank failures of planning.
_LOAD_FAILURES = ("immovable", "too_heavy", "caught", "wedged", "braced")
# Looks on the way that may find something moved and plan anew; chosen so that a thing that never rests is given up.
_LOOKS = 5
# Times that what lies at a wall, where no finger fits, is dragged off it; chosen as once for each wall of a corner.
_NUDGES = 2
# Metres that a held object may slide along an axis of the hand while its grip is eased; chosen as what easing itself moves it,
# many times over.
_SLID = 0.001
# Metres to a neighbour within which it may be touched while the object rises; chosen as a finger's clearance (halved
# and doubled no episode of six tasks changes).
_BESIDE = 0.006


class Pick(Skill):
    """Hold an object and lift it."""

    name = "pick"

    def contract(self, *, object: str, to: str = "", on: bool = False) -> Contract:
        """Return what lifting an object needs and brings about."""
        del on
        fitting = () if not to else (fact("gripped_for", object, to),)
        return Contract(
            needs=(
                fact("has_gripper"),
                fact("liftable", object),
                fact("hand_ready", object),
                fact("accessible", object),
                fact("clear", object),
                fact("reachable", object),
                fact("graspable", object),
                fact("room_to_take", object),
            ),
            gives=(fact("holding", object), *fitting),
        )

    def alternatives(self, failed: FailedCall, *, object: str, to: str = "", on: bool = False) -> Iterator[Alternative]:
        """Yield opening the drawer that it is to go into to its end."""
        del object, on
        yield from opened_wide(failed, to)

    def run(self, ctx: SkillContext, *, object: str, to: str = "", on: bool = False) -> SkillResult:
        """Grasp an object and lift it clear of what it stands on.

        Args:
            object: Id of the object.
            to: Id of what it is to go on or into next: it is taken so that the hand has room there.
            on: Whether it is to go on what has room within as well, as on top of a cupboard.

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
        met = obstruction_there(ctx, target, arm.find(to), arm.start, on=on) if to else None
        after, width = take_up(arm, target, met)
        return SkillResult(
            skill=self.name,
            detail={
                "object": target.id,
                "dz_mm": 1000.0 * (bottom(after) - bottom(target)),
                "width_mm": 1000.0 * width,
            },
        )


def take_up(
    arm: Manipulator, target: DetectedObject, met: Callable[[Grasp, bool], Obstruction | None] | None
) -> tuple[DetectedObject, float]:
    """Grasp an object and lift it; return it as it hangs in the hand, and how far the fingers were apart on it, metres.

    Args:
        arm: Whose hand is empty.
        target: Where it stands now.
        met: Tells of a grasp what it is no good for: what is in the way, or None; looked at briefly where its second argument is true.

    Raises:
        SkillError: As `Pick.run` raises them.
    """
    needs = Pick().contract(object=target.id)
    tries = _Tries(arm, target.id, met=met)
    looks, nudges, scene = 0, 0, arm.start
    while True:
        seen = _shifted(arm.find(target.id, scene), tries.felt)
        if scene is not arm.start:
            require(arm.ctx, needs, scene)
        try:
            plan = tries.planned(seen, scene)
        except CollisionError:
            nudges += 1
            if nudges > _NUDGES or not nudge_off_walls(arm, target.id, most=arm.ctx.max_force_n):
                raise
            scene = arm.look()
            continue
        try:
            arm.open_for(plan.approach, plan.aperture)
            follow_free(arm, plan.approach, Phase.APPROACH)
            check_open(arm, plan.grasp, plan.aperture)
            if looks < _LOOKS and changed(scene, arm.look(*around(seen, scene))):
                looks, scene = looks + 1, arm.settle(target.id)
                continue
            scene = take_hold(arm, target, plan)
            width, held = arm.gripper.width, arm.find(target.id, scene)
            after = _lift(arm, held, plan.grasp.width, firm=tries.slipped, slowly=tries.stuck, out=plan.out)
        except (GraspError, TrackingError, LimitError) as error:
            arm.ctx.doubt()
            tries.failed(plan, seen, error)
            scene = arm.look()
        else:
            return after, width


def take_hold(arm: Manipulator, target: DetectedObject, plan: GraspPlan) -> ObservedScene:
    """Go down to a grasp from its hover and close on the object; return what is seen then.

    Raises:
        GraspError: The fingers met nothing, or did not close.
        MetError: Fingers pressed on something on the way.
        TrackingError: The arm did not arrive.
    """
    grasp = plan.grasp
    try:
        _descend(arm, target, plan)
    except MetError as met:
        # Where the palm meets an object that is taller than it seems, the fingers are beside it already.
        if met.other != target.id or arm.planning.finger_side(met.body) != 0:
            raise
    arm.ctx.enter(Phase.GRASP)
    before = arm.gripper
    arm.close_on(grasp.width)
    check_closed(arm, grasp, before)
    check_sealed(arm, grasp)
    scene = arm.look(*around(target, arm.start))
    if arm.gripper.width < empty_aperture(arm.geometry, grasp.width) and scene.held != target.id:
        raise _missed(arm, grasp, arm.gripper.width)
    return scene


class _Tries:
    """The grasps of one object that were carried out in vain, and what each of them taught.

    Attributes:
        felt: By how much (3,) the object lies elsewhere than it is seen, as fingers that came down on it tell; metres.
        slipped: Whether it came out of one of them: the next holds as hard as it can.
        stuck: Whether it did not come up with one of them: with the next it is lifted slowly, as it may come free and meet what holds it.
    """

    def __init__(
        self, arm: Manipulator, object: str, *, met: Callable[[Grasp, bool], Obstruction | None] | None
    ) -> None:
        self.felt: Array = np.zeros(3)
        self.slipped = self.stuck = False
        self._arm = arm
        self._object = object
        self._met = met
        self._excluded: list[Grasp] = []
        self._least_aperture = 0.0
        self._failure: SkillError | None = None

    def planned(self, seen: DetectedObject, scene: ObservedScene) -> GraspPlan:
        """Return a grasp that was not tried yet; where none is left, what the last one failed of counts."""
        try:
            return plan_grasp(
                self._arm,
                seen,
                scene,
                self._excluded,
                self._least_aperture,
                met=self._met,
            )
        except SkillError:
            if self._failure is not None and _reason(self._failure) in _LOAD_FAILURES:
                raise self._failure from None
            raise

    def failed(self, plan: GraspPlan, seen: DetectedObject, error: GraspError | TrackingError | LimitError) -> None:
        """Draw back from a grasp that failed.

        Raises:
            SkillError: `error`, where no further try is worth it.
        """
        if isinstance(error, LimitError) and not _pressed(error):
            raise error
        self._failure = error
        self.slipped = self.slipped or _reason(error) == "slipped"
        self.stuck = self.stuck or _reason(error) in _LOAD_FAILURES
        self._excluded.append(in_frame(plan.grasp, seen))
        # No other grasp frees fingers that stick.
        last = len(self._excluded) >= _ATTEMPTS or _reason(error) == "gripper_stuck"
        if last and isinstance(error, TrackingError):
            raise error
        if not isinstance(error, MetError):
            # As far as the fingers came: beside a wall there is no more room.
            self._arm.open(plan.aperture)
        elif error.other == self._object:
            self.felt = self.felt + _towards(self._arm, plan, error.body)
            self._least_aperture = self._arm.geometry.max_aperture
        back_off(self._arm, error)
        if last:
            raise error


def _descend(arm: Manipulator, target: DetectedObject, plan: GraspPlan) -> None:
    """Go down to a grasp: fingers touch nothing on the way; a cup stops as soon as it is felt on the object.

    Raises:
        MetError: Fingers pressed on something.
        TrackingError: The arm did not arrive.
    """
    if arm.geometry.cup is None or arm.driver.capabilities.contact is None:
        follow_free(arm, plan.descent, Phase.DESCEND)
    else:
        follow_until(arm, plan.descent, Phase.DESCEND, lambda: target.id in arm.forces())


def _lift_held(arm: Manipulator, target: DetectedObject) -> SkillResult:
    """Lift what the gripper holds already, if it has not been lifted: an earlier pick may have been stopped."""
    if bottom(target) - arm.start.table_height < _MIN_RISE_FRACTION * LIFT_HEIGHT:
        _lift(arm, target, arm.gripper.width)
    return SkillResult(
        skill=Pick.name,
        detail={"object": target.id, "already_held": True, "width_mm": 1000.0 * arm.gripper.width},
    )


def _lift(
    arm: Manipulator,
    target: DetectedObject,
    width: float,
    *,
    firm: bool = False,
    slowly: bool = False,
    out: Array | None = None,
) -> DetectedObject:
    """Lift what the fingers have closed on, and return where it is seen when it is still.

    Args:
        arm: Whose hand.
        target: The object as it lies between the fingers.
        width: Its extent between them, metres.
        firm: Hold as hard as the fingers can.
        slowly: Rise as slowly as what is heavy.
        out: Level way (3,) on which it comes out from under what is over it, metres; None where that is not known.

    Raises:
        GraspError: It did not come up.
        LimitError: It pulls harder than the robot may, which is too little to tell why.
    """
    scene = arm.look(*around(target, arm.start))
    arm.use(scene, held=target.id)
    load, grip = LoadMeter(arm, target.id), Grip(arm, target, firm=firm)
    end = arm.driver.subscribe(load)
    try:
        scene = draw_out(arm, target, scene, (grip,), out)
        target = arm.find(target.id, scene)
        # Going up, it leaves whatever it stands on, in or against.
        others = [item for item in scene.objects if item.id != target.id and not is_over(item, target)]
        arm.motion.allow("table", *(item.id for item in others if nearer(target, item, _BESIDE)))
        rise = _rise(arm, target, scene, others, width, grip, slowly=slowly)
    except TrackingError:
        raise lift_error(arm, target, width, load) from None
    except LimitError as error:
        if target.id not in _pressed(error) and "something" not in _pressed(error):
            raise
        cause = lift_error(arm, target, width, load)
        if _reason(cause) == "slipped":
            # The arm stopped at its limit before anything let go: no more is known.
            raise
        raise cause from None
    finally:
        end()
    before = _in_hand(arm, alone(arm, target, scene, width, rise).find(target.id) or target)
    grip.settle()
    # An object that slips out is still moving.
    after = _still_held(arm, target, width, rise, load)
    free_of_others(arm, target, scene, width, rise)
    if np.abs(_in_hand(arm, after) - before).max() > _SLID:
        # Less friction than was reckoned with: as hard as can be, then.
        grip.close()
        after = _still_held(arm, target, width, rise, load)
    return after


def _rise(
    arm: Manipulator,
    target: DetectedObject,
    scene: ObservedScene,
    others: Sequence[DetectedObject],
    width: float,
    grip: Grip,
    *,
    slowly: bool,
) -> float:
    """Rise with what is held, out of what it touches where it does; return how far, metres; errors as of `rise_with`.

    Raises:
        GraspError: One of the others is above it.
    """
    try:
        return rise_with(arm, target, scene, width, grip, slowly=slowly)
    except CollisionError:
        arm.allow_touched()
    try:
        return rise_with(arm, target, scene, width, grip, slowly=slowly)
    except CollisionError as above:
        other = above.evidence.other if isinstance(above.evidence, CollisionEvidence) else ""
        if all(item.id != other for item in others):
            raise
        said = f"{target.id} cannot be lifted as the hand holds it: {above}; try another grasp, or clear the way"
        raise wedged(arm, target, width, (other,), said) from None


def _still_held(arm: Manipulator, target: DetectedObject, width: float, rise: float, load: LoadMeter) -> DetectedObject:
    """Return where a lifted object is seen when it is still.

    Raises:
        GraspError: It did not come up, or not all the way.
    """
    scene = arm.settle(target.id)
    after = arm.find(target.id, scene)
    if scene.held != target.id or bottom(after) - bottom(target) < _MIN_RISE_FRACTION * rise:
        raise lift_error(arm, target, width, load)
    return after


def _in_hand(arm: Manipulator, held: DetectedObject) -> Array:
    """Return where an object is in the frame of the TCP, metres, shape (3,)."""
    return (arm.state.tcp_pose.inverse() @ held.pose).position


def _shifted(target: DetectedObject, shift: Array) -> DetectedObject:
    """Return the object as if it lay elsewhere by `shift` (3,)."""
    if not shift.any():
        return target
    return replace(target, pose=Pose.from_matrix(target.pose.position + shift, target.pose.rotation))


def _towards(arm: Manipulator, plan: GraspPlan, body: str) -> Array:
    """Return by how much (3,) an object that a finger came down on lies nearer to that finger than it was seen."""
    spare = (plan.aperture - plan.grasp.width) / 2.0 + arm.geometry.finger_thickness / 2.0
    closing = plan.grasp.tcp_pose.rotation[:, 1] * [1.0, 1.0, 0.0]
    shift: Array = arm.planning.finger_side(body) * spare * closing
    return shift


def _reason(error: SkillError) -> str:
    return error.evidence.reason if isinstance(error.evidence, GraspEvidence) else ""


def _pressed(error: LimitError) -> tuple[str, ...]:
    """Return what the arm was stopped at for pressing too hard; nothing where a limit of place stopped it."""
    return error.evidence.met() if error.evidence is not None else ()


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
