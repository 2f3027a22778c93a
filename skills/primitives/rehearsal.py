"""A skill's own way of planning, tried in a scene that may only be imagined: what it meets there is told before anything moves.

Skill and verifier plan with the same functions, so that they cannot disagree about what is in the way. Only what any way would
meet counts: the hand itself, or what it holds, touching something, or a straight line on which no configuration follows. Where a
part of the arm touches something, another posture may not; and the way over things, to where the hand comes down, is not looked at.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from robosandbox.driver import Arm, Driver, Hand
from robosandbox.errors import CollisionError, Failure, Repair, SkillError, UnreachableError, UnsupportedError
from robosandbox.evidence import CollisionEvidence
from robosandbox.grasp.protocols import GraspPlanner
from robosandbox.motion.collision import CollisionChecker
from robosandbox.motion.ik import DLSMotionPlanner
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.motion.protocols import MotionPlanner
from robosandbox.perception.protocols import Perception
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import (
    CAREFUL,
    ArmState,
    Array,
    Intent,
    ObservedScene,
    Pose,
    Speed,
    Tempo,
    Trajectory,
)
from robosandbox.world.abilities import Obstruction
from robosandbox.world.alternatives import FailedCall
from robosandbox.world.operators import BoundCall

# Share of the joints' speed limits at which ways are timed that nobody follows; chosen as the fewest rows to compute.
_SPEED = 1.0


def rehearse(
    ctx: SkillContext,
    planner: HandOnly,
    scene: ObservedScene,
    state: ArmState,
    plan: Callable[[Manipulator], object],
) -> Obstruction | None:
    """Return what keeps a skill from planning what it does; None where nothing does.

    Args:
        ctx: The robot.
        planner: Of ways of its hand.
        scene: Where things are thought to be.
        state: How the robot is thought to stand, its fingers as far apart as the skill has them.
        plan: Plans with the hand that it is given, as the skill does.
    """
    planner.begin()
    try:
        plan(_Rehearsed(ctx, scene, state, planner))
    except (CollisionError, UnreachableError) as error:
        return _obstruction(error)
    return None


def hand_planner(ctx: SkillContext) -> HandOnly:
    """Return the planner of ways of a robot's hand: one for each motion planner, since it learns a model as that does."""
    return _PLANNERS.setdefault(ctx.motion, HandOnly())


def with_aperture(ctx: SkillContext, aperture: float) -> ArmState:
    """Return the robot as it stands, but for its fingers, which are so many metres apart."""
    state, gripper = ctx.arm.state(), ctx.arm.spec.gripper
    if gripper is None or state.gripper is None:
        return state
    joint = gripper.geometry.joint_for_aperture(aperture)
    closed = float(np.clip(gripper.geometry.closed_fraction(joint), 0.0, 1.0))
    return replace(state, gripper=replace(state.gripper, joint=joint, width=aperture, closed=closed))


def _obstruction(failure: SkillError) -> Obstruction:
    evidence = failure.evidence
    if not isinstance(evidence, CollisionEvidence):
        return Obstruction(cause="it is out of reach, or the arm cannot follow a straight way there")
    met = evidence.other.partition("/")[0]
    return Obstruction(cause=f"{evidence.body} would touch {met}", met=met)


class _Rehearsed(Manipulator):
    """One whose eyes see what is imagined, and whose robot stands as it is thought to."""

    def __init__(self, ctx: SkillContext, scene: ObservedScene, state: ArmState, planner: MotionPlanner) -> None:
        self._stands = state
        super().__init__(_Imagined(ctx, scene, planner))

    @property
    def state(self) -> ArmState:
        """State of the robot in the rehearsal."""
        return self._stands


class HandOnly(DLSMotionPlanner):
    """A motion planner that leaves out of account what the arm behind the hand touches, and the ways over things."""

    def __init__(self) -> None:
        super().__init__()
        self._has_failed = False
        self._bounds: tuple[PlanningScene, tuple[float, float, float, float]] | None = None

    def bounds(self, planning: PlanningScene) -> tuple[float, float, float, float]:
        """Return x_min, x_max, y_min, y_max of the hand in the TCP frame, metres."""
        if self._bounds is None or not planning.shares_model(self._bounds[0]):
            self._bounds = (planning, planning.hand_bounds())
        return self._bounds[1]

    def checker_of(self, planning: PlanningScene) -> CollisionChecker:
        """Return a new checker of what the hand may touch."""
        return planning.collisions(self.clearance, hand_only=True)

    def begin(self) -> None:
        """Forget what came of the lines of another rehearsal."""
        self._has_failed = False

    def plan_joints(self, q_start: Array, q_goal: Array, *, speed: Speed = 0.5) -> Trajectory:
        """Return a way that is not looked at: from where the arm will stand then there may be another."""
        del speed
        return Trajectory(q=np.array([q_start, q_goal]), dt=1.0)

    def plan_line(self, q_start: Array, tcp_pose: Pose, *, speed: Speed = 0.5) -> Trajectory:
        """Return a straight TCP line; raises UnreachableError, or CollisionError where the hand meets something."""
        del speed
        try:
            if self._has_failed:
                self._check_end(q_start, tcp_pose)
            return super().plan_line(q_start, tcp_pose, speed=_SPEED)
        except CollisionError:
            self._has_failed = True
            raise

    def _check_end(self, q_start: Array, tcp_pose: Pose) -> None:
        """Check where a line ends first: where one has failed most of the others will fail there, which is told sooner.

        Raises:
            CollisionError: The hand touches something there.
        """
        try:
            found = self.touch(self.ik(tcp_pose, q_start, restarts=0))
        except UnreachableError:
            return
        if found is not None:
            raise found


class _Imagined:
    """A skill's context that sees what is imagined; nobody hears of what is planned in it, and nothing is tried out."""

    what_if = False
    tempo: Tempo = CAREFUL

    def __init__(self, ctx: SkillContext, scene: ObservedScene, planner: MotionPlanner) -> None:
        self._ctx = ctx
        self._scene = scene
        self.driver: Driver = ctx.driver
        self.arm: Arm = ctx.arm
        self.hand: Hand | None = ctx.hand
        self.poses: dict[tuple[str, str], Array] = ctx.poses
        self.starts: deque[float] = ctx.starts
        self.perception: Perception = ctx.perception
        self.grasp: GraspPlanner = ctx.grasp
        self.motion: MotionPlanner = planner

    @property
    def max_force_n(self) -> float:
        """Largest force on the object that a skill manipulates, N."""
        return self._ctx.max_force_n

    def work_with(self, arm_name: str | None) -> None:
        """Refuse: what is rehearsed is a way of one hand.

        Raises:
            UnsupportedError: Always.
        """
        raise UnsupportedError(f"arm: {arm_name!r} cannot be chosen while a way of {self.arm.name!r} is rehearsed")

    def go_at(self, tempo: Tempo) -> None:
        """Refuse: a rehearsal has a tempo of its own.

        Raises:
            UnsupportedError: Always.
        """
        raise UnsupportedError(f"tempo: {tempo.name} cannot be chosen while a way is rehearsed")

    def look(self, *names: str) -> ObservedScene:
        """Return what is imagined."""
        del names
        return self._scene

    def feel(self) -> ObservedScene:
        """Return what is imagined."""
        return self._scene

    def doubt(self) -> None:
        """Doubt nothing that is imagined."""

    def permit(self, call: BoundCall) -> None:
        """Check a call against the limits."""
        self._ctx.permit(call)

    def planning(self, seen: ObservedScene) -> PlanningScene:
        """Return what to plan among."""
        return self._ctx.planning(seen)

    def repairs_for(self, failed: FailedCall) -> tuple[Repair, ...]:
        """Return none."""
        del failed
        return ()

    def advice_for(self, failure: Failure) -> str:
        """Return none."""
        del failure
        return ""

    def enter(self, phase: str) -> None:
        """Tell nobody."""

    def announce(self, intent: Intent) -> None:
        """Tell nobody."""


_PLANNERS: WeakKeyDictionary[MotionPlanner, HandOnly] = WeakKeyDictionary()
