"""A skill's own way of planning, tried in a scene that may only be imagined: what it meets there is told before anything moves.

Skill and verifier plan with the same functions, so that they cannot disagree about what is in the way. Only what any way would
meet counts: the hand itself, or what it holds, touching something, or a straight line on which no configuration follows. Where a
part of the arm touches something, another posture may not; and the way over things, to where the hand comes down, is not looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from robosandbox.errors import CollisionError, Repair, SkillError, UnreachableError
from robosandbox.evidence import CollisionEvidence
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.protocols import Driver, GraspPlanner, MotionPlanner, Perception, SkillContext
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.types import (
    CAREFUL,
    Array,
    Intent,
    Observation,
    ObservedScene,
    Pose,
    SkillCall,
    Speed,
    Tempo,
    Trajectory,
)
from robosandbox.world.abilities import Obstruction
from robosandbox.world.alternatives import Failure

# Share of the joints' speed limits at which ways are timed that nobody follows; chosen as the fewest rows to compute.
_SPEED = 1.0


def rehearse(
    ctx: SkillContext, scene: ObservedScene, state: Observation, plan: Callable[[Manipulator], object]
) -> Obstruction | None:
    """Return what keeps a skill from planning what it does; None where nothing does.

    Args:
        ctx: The robot.
        scene: Where things are thought to be.
        state: How the robot is thought to stand, its fingers as far apart as the skill has them.
        plan: Plans with the hand that it is given, as the skill does.
    """
    try:
        plan(_Rehearsed(ctx, scene, state))
    except (CollisionError, UnreachableError) as error:
        return _obstruction(error)
    return None


def with_aperture(ctx: SkillContext, aperture: float) -> Observation:
    """Return the robot as it stands, but for its fingers, which are so many metres apart."""
    state, gripper = ctx.sim.state(), ctx.sim.spec.gripper
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

    def __init__(self, ctx: SkillContext, scene: ObservedScene, state: Observation) -> None:
        self._stands = state
        super().__init__(_Imagined(ctx, scene))

    @property
    def state(self) -> Observation:
        """How the robot is thought to stand."""
        return self._stands


class _HandOnly:
    """A motion planner that leaves out of account what the arm behind the hand touches, and the ways over things."""

    def __init__(self, planner: MotionPlanner) -> None:
        self._planner = planner
        self._planning: PlanningScene | None = None
        self._held: str | None = None
        self._has_failed = False

    def use(self, planning: PlanningScene, state: Observation, *, held: str | None = None) -> None:
        """Take the world to plan in."""
        self._planning, self._held = planning, held
        self._planner.use(planning, state, held=held)

    def allow(self, *names: str) -> None:
        """Let the robot touch these objects in the plans that follow, and nothing else."""
        self._planner.allow(*names)

    def open_to(self, aperture: float) -> None:
        """Check the paths that follow with the fingers `aperture` metres apart."""
        self._planner.open_to(aperture)

    def ik(self, tcp_pose: Pose, seed: Array | None = None, *, restarts: int = 60) -> Array:
        """Return a configuration (n,) with the TCP at `tcp_pose`; raises UnreachableError."""
        return self._planner.ik(tcp_pose, seed, restarts=restarts)

    def forward(self, q: Array) -> Pose:
        """Return the TCP pose in the world at `q` (n,)."""
        return self._planner.forward(q)

    def touch(self, q: Array) -> CollisionError | None:
        """Return the error that standing at `q` (n,) would be for the hand, or None."""
        found = self._planner.touch(q)
        return found if found is not None and self._is_of_hand(found) else None

    def plan_joints(self, q_start: Array, q_goal: Array, *, speed: Speed = 0.5) -> Trajectory:
        """Return a way that is not looked at: from where the arm will stand then there may be another."""
        del speed
        return Trajectory(q=np.array([q_start, q_goal]), dt=1.0)

    def plan_through(self, q_start: Array, tcp_poses: Sequence[Pose], *, speed: Speed = 0.5) -> Trajectory:
        """Return straight TCP lines through poses; raises UnreachableError, or CollisionError where the hand meets something."""
        del speed
        try:
            return self._planner.plan_through(q_start, tcp_poses, speed=_SPEED)
        except CollisionError as error:
            return self._jump(error, q_start, tcp_poses[-1])

    def plan_line(self, q_start: Array, tcp_pose: Pose, *, speed: Speed = 0.5) -> Trajectory:
        """Return a straight TCP line; raises UnreachableError, or CollisionError where the hand meets something."""
        del speed
        self._check_end(q_start, tcp_pose)
        try:
            return self._planner.plan_line(q_start, tcp_pose, speed=_SPEED)
        except CollisionError as error:
            return self._jump(error, q_start, tcp_pose)

    def _check_end(self, q_start: Array, tcp_pose: Pose) -> None:
        """Check where a line ends first, where an earlier one failed: most of the others will fail there, which is told sooner.

        Raises:
            CollisionError: The hand touches something there.
        """
        if not self._has_failed:
            return
        try:
            found = self.touch(self._planner.ik(tcp_pose, q_start, restarts=0))
        except UnreachableError:
            return
        if found is not None:
            raise found

    def _jump(self, error: CollisionError, q_start: Array, tcp_pose: Pose) -> Trajectory:
        """Return a way that is not looked at, where it is not the hand that is in the way; else raise the error."""
        if self._is_of_hand(error):
            self._has_failed = True
            raise error
        return Trajectory(q=np.array([q_start, self._planner.ik(tcp_pose, q_start)]), dt=1.0)

    def _is_of_hand(self, error: CollisionError) -> bool:
        evidence = error.evidence
        if not isinstance(evidence, CollisionEvidence) or self._planning is None:
            return False
        return evidence.body == self._held or self._planning.is_of_hand(evidence.body)


class _Imagined:
    """A skill's context that sees what is imagined; nobody hears of what is planned in it, and nothing is tried out."""

    what_if = False
    tempo: Tempo = CAREFUL

    def __init__(self, ctx: SkillContext, scene: ObservedScene) -> None:
        self._ctx = ctx
        self._scene = scene
        self.sim: Driver = ctx.sim
        self.perception: Perception = ctx.perception
        self.grasp: GraspPlanner = ctx.grasp
        self.motion: MotionPlanner = _HandOnly(ctx.motion)
        self.listeners: list[Callable[[str], None]] = []

    @property
    def max_force_n(self) -> float:
        """With how many newtons a skill may press what it is to move."""
        return self._ctx.max_force_n

    def look(self) -> ObservedScene:
        """Return what is imagined."""
        return self._scene

    def permit(self, call: SkillCall) -> None:
        """Check a call against the limits."""
        self._ctx.permit(call)

    def planning(self, seen: ObservedScene) -> PlanningScene:
        """Return what to plan among."""
        return self._ctx.planning(seen)

    def repairs_for(self, failure: Failure) -> tuple[Repair, ...]:
        """Return none."""
        del failure
        return ()

    def advice_for(self, error: SkillError) -> str:
        """Return none."""
        del error
        return ""

    def enter(self, phase: str) -> None:
        """Tell nobody."""

    def announce(self, intent: Intent) -> None:
        """Tell nobody."""
