"""Context of skills in this process: phases for listeners, limits, cancellation and deadlines between ticks."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import InitVar, dataclass, field, replace
from typing import Any, Self

from robosandbox.agent.goal import GoalContext
from robosandbox.agent.preview import PreviewStep, preview
from robosandbox.agent.twin_guard import TwinGuard
from robosandbox.driver import Arm, Driver, Hand, Mode, Safety, made_safe
from robosandbox.errors import (
    CancelledError,
    ErrorCode,
    Failure,
    GoalTimeoutError,
    InputError,
    InvalidArgumentError,
    Phase,
    Repair,
    SkillError,
)
from robosandbox.evidence import GraspEvidence, TimeoutEvidence
from robosandbox.grasp.hand import FRICTION
from robosandbox.grasp.protocols import GraspPlanner
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.motion.protocols import MotionPlanner
from robosandbox.perception.ground_truth import GroundTruthPerception
from robosandbox.perception.protocols import Glancing, Perception
from robosandbox.skills.base import Skill
from robosandbox.skills.executor import Executor, require
from robosandbox.skills.primitives.sliding import slides_under
from robosandbox.skills.protocols import MOST_BACK
from robosandbox.suggestions import did_you_mean
from robosandbox.types import (
    DEFAULT_TEMPO,
    Array,
    Limits,
    ObservedScene,
    Plan,
    RgbdFrame,
    SkillResult,
    Tempo,
    force_limits,
    the_only,
)
from robosandbox.types.robot import RobotSpec
from robosandbox.world.abilities import Abilities
from robosandbox.world.alternatives import FailedCall
from robosandbox.world.operators import BoundCall, meant_by
from robosandbox.world.workspace import check_call

_log = logging.getLogger(__name__)
# Failures that a sidecar with a wrong joint list, home, tool centre point, gripper or base brings about.
_SHAPED_BY_SIDECAR = frozenset(
    {
        ErrorCode.UNREACHABLE,
        ErrorCode.COLLISION,
        ErrorCode.TRACKING,
        ErrorCode.GRASP,
        ErrorCode.PUSH,
        ErrorCode.TAP,
        ErrorCode.LIMIT,
    }
)


@dataclass(kw_only=True)
class AgentContext(GoalContext):
    """A driver and the parts that skills use to work with it.

    Args:
        sim: What moves the robot, with its world loaded.
        arm_name: The arm that calls work with; needless where there is one.

    Attributes:
        driver: The same, behind its robot's limits.
        perception: What is where in it.
        grasp: Ways to hold things.
        motion: Configurations and paths.
        what_if: Whether skills may try repairs on the twin, a simulation of what is believed.
        what_if_seconds: How many simulated seconds all trials after one failure may take together.
        advise: Whether a failure on a robot with a sidecar of its own names what static checks find wrong with the sidecar.
        limits: What no call and no motion may pass, besides the limits in the robot's sidecar.
        tempo: How fast the arm goes.
        poses: Configurations that were given a name, shape (n,) each, by arm and name.
        starts: When the last calls began, on the driver's clock, seconds.
        safety: Of the driver that `sim` is a view of; where it is left out, `sim` is put behind its robot's limits.
        arm: The arm that calls work with; `work_with` changes it.
        hand: The hand that it carries; None where it carries none.
        phase: The phase that began last.
        seen: What perception saw when it last looked.
    """

    sim: InitVar[Driver]
    arm_name: InitVar[str | None] = None
    perception: Perception
    grasp: GraspPlanner
    motion: MotionPlanner
    what_if: bool = True
    what_if_seconds: float = 120.0
    advise: bool = True
    limits: Limits | None = None
    tempo: Tempo = DEFAULT_TEMPO
    poses: dict[tuple[str, str], Array] = field(default_factory=dict, repr=False)
    starts: deque[float] = field(default_factory=lambda: deque(maxlen=MOST_BACK + 1), init=False, repr=False)
    safety: Safety | None = field(default=None, repr=False)
    driver: Driver = field(init=False)
    arm: Arm = field(init=False, repr=False)
    hand: Hand | None = field(init=False, repr=False)
    phase: str = field(default=Phase.CHECK, init=False)
    seen: ObservedScene | None = field(default=None, init=False, repr=False)
    _rehearsed: list[PreviewStep] = field(default_factory=list, init=False, repr=False)
    _safety: Safety = field(init=False, repr=False)
    _tells_apart: bool = field(default=False, init=False, repr=False)
    _started: float = field(default=0.0, init=False, repr=False)
    _deadline: float | None = field(default=None, init=False, repr=False)

    def __post_init__(self, sim: Driver, arm_name: str | None) -> None:
        self.driver = sim
        if self.safety is None:
            safe = made_safe(sim)
            self.driver, self.safety = safe, safe.safety
        self.work_with(arm_name)
        self._safety = self.safety
        self._safety.phase = self.phase
        if self.limits is not None:
            self._safety.limit(self.limits)
        # Who is not told what is touched cannot mean to touch it.
        self._tells_apart = self.driver.capabilities.contact == "named"
        self._safety.expect(() if self._tells_apart else None)
        self.driver.guards.append(self._ended)

    def work_with(self, arm_name: str | None) -> None:
        """Have the calls that follow work with an arm; the others are obstacles.

        Args:
            arm_name: Its name; None for the only one.

        Raises:
            InputError: There is no such arm.
            ValueError: There are several, and none is named.
        """
        arms = self.driver.arms
        if arm_name is not None and arm_name not in arms:
            raise InputError(f"arm: {arm_name[:40]!r} is not one of {', '.join(arms)}{did_you_mean(arm_name, arms)}")
        self.arm = the_only(arms, "arms") if arm_name is None else arms[arm_name]
        carried = (hand for hand in self.driver.hands.values() if hand.arm == self.arm.name)
        self.hand = next(carried, None)
        self.seen = None if self.seen is None else self._of_this_arm(self.seen)

    @property
    def max_force_n(self) -> float:
        """Largest force on the object that a skill manipulates, N."""
        return force_limits(*self.all_limits())[0]

    def robot(self) -> RobotSpec:
        """Return the robot of the arm that calls work with."""
        return self.arm.spec

    def cameras(self) -> tuple[str, ...]:
        """Return the driver's cameras."""
        return tuple(self.driver.capabilities.cameras)

    def capture(self, camera: str) -> RgbdFrame:
        """Return what a camera of the driver sees now; raises as the driver does."""
        return self.driver.senses.capture(camera)

    def all_limits(self) -> list[Limits]:
        """Return the robot's own limits, and this context's."""
        return [limits for limits in (self.arm.spec.limits, self.limits) if limits is not None]

    def look(self, *names: str) -> ObservedScene:
        """Return what perception sees now; of these things alone, where it can look at some alone."""
        perception = self.perception
        if names and isinstance(perception, Glancing):
            seen = perception.glance(self.driver, names)
        else:
            seen = perception.perceive(self.driver)
        self.seen = self._of_this_arm(seen)
        return self.seen

    def go_at(self, tempo: Tempo) -> None:
        """Have the calls that follow go at a tempo."""
        self.tempo = tempo

    def _of_this_arm(self, seen: ObservedScene) -> ObservedScene:
        """Return what was seen as it concerns the arm that calls are made with, and what that arm says of itself."""
        poses = tuple(sorted(name for arm, name in self.poses if arm == self.arm.name))
        if len(self.driver.arms) == 1:
            return replace(seen, arm=self.arm.state(), poses=poses, tempo=self.tempo.name)
        robot = self.arm.spec
        base = float(robot.base_position[0]), float(robot.base_position[1])
        hand = None if self.hand is None else self.hand.name
        return replace(
            seen,
            hand=hand,
            base_xy=base,
            reach=robot.reach,
            grips=hand is not None,
            arm=self.arm.state(),
            poses=poses,
            tempo=self.tempo.name,
        )

    def feel(self) -> ObservedScene:
        """Return what is believed now without a look, where perception remembers: what the hand holds is where the hand is."""
        perception = self.perception
        if not isinstance(perception, Glancing):
            return self.look()
        self.seen = self._of_this_arm(perception.glance(self.driver, ()))
        return self.seen

    def doubt(self) -> None:
        """Have the next look be at everything anew: something went otherwise than it was believed to."""
        if isinstance(self.perception, Glancing):
            self.perception.doubt()

    def abilities(self) -> Abilities:
        """Return what the robot can do, by its own kinematics and grasps."""
        # It looks, and compiles what it plans in.
        from robosandbox.skills.primitives.abilities import RobotAbilities

        return RobotAbilities(self, self.limits)

    def planning(self, seen: ObservedScene) -> PlanningScene:
        """Return what to plan among where things are believed to be as `seen`, the other arms where they stand now."""
        found = self.perception.planning(self.driver, seen)
        others = {name: arm.state() for name, arm in self.driver.arms.items() if name != self.arm.name}
        return found.for_arm(self.arm.name, others) if others else found

    def permit(self, call: BoundCall) -> None:
        """Check a call against the workspace before anything moves, and take note of what it means to touch.

        Raises:
            LimitError: It leads outside.
        """
        held = self.seen.held if self.seen else None
        meant = meant_by(call, held)
        seen = self.look() if meant and self.seen is None else self.seen
        # Whoever means a door means the handle on it as well.
        meant = meant.union(item.id for item in (seen.objects if seen else ()) if item.id.rpartition(".")[0] in meant)
        # What only moves the arm, as going home, gets out of wherever it is.
        named = {*meant, *(value for value in call.arguments.values() if isinstance(value, str))}
        keeps = self._tells_apart and meant and seen
        slides = slides_under(self.planning, seen, named) if keeps and seen else {}
        in_hands = seen.hands if seen else {}
        hands = self.driver.hands.values()
        held_by = {hand.arm: one for hand in hands if (one := in_hands.get(hand.name)) is not None}
        self._safety.expect(meant if self._tells_apart else None, slides, FRICTION, self.arm.name, held_by)
        for limits in self.all_limits():
            if limits.workspace is not None:
                check_call(call.call, self.look(), limits.workspace)

    def twin(self) -> AgentContext:
        """Return a context in a simulation of what is believed now, for trying things out; nothing there touches this one.

        Whoever asks for it closes it.
        """
        copy = AgentContext(
            sim=self.planning(self.look()).twin(self.arm.state()),
            arm_name=self.arm.name if len(self.driver.arms) > 1 else None,
            perception=GroundTruthPerception(),
            grasp=self.grasp,
            motion=self.motion,
            what_if=False,
            advise=False,
            limits=self.limits,
            tempo=self.tempo,
            poses=dict(self.poses),
        )
        copy.skills = self.skills
        # A cancel stops what is tried out, too.
        copy._cancelled = self._cancelled
        return copy

    def close(self) -> None:
        """Free the driver."""
        self.driver.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def repairs_for(self, failed: FailedCall) -> tuple[Repair, ...]:
        """Return what would do in place of a failed call, tried on the twin; nothing with `what_if` off, or where nothing may move."""
        if not self.what_if or self.driver.fault:
            return ()
        # Repairs call skills, which are called with this context.
        from robosandbox.agent.repairs import find_repairs

        return find_repairs(self, failed)

    def simulate(self, calls: Sequence[BoundCall], *, tick: Callable[[], None] | None = None) -> dict[str, Any]:
        """Return what comes of calls on the twin, as JSON data."""
        plan = Plan(steps=tuple(call.call for call in calls))
        return preview(self, plan, {call.name: call.skill for call in calls}, tick=tick).told()

    def rehearse(self, calls: Sequence[BoundCall]) -> dict[str, Any]:
        """Return what comes of calls on the twin, as `simulate` does; an arm that then goes otherwise is stopped."""
        plan = Plan(steps=tuple(call.call for call in calls))
        tried = preview(self, plan, {call.name: call.skill for call in calls})
        self._rehearsed = list(tried.calls)
        return tried.told()

    def foreseen(self, call: BoundCall) -> Failure | None:
        """Return the failure, with repairs, that a call would end in before it moves anything; None where there is none to tell."""
        scene = self.look()
        try:
            require(self, call.contract, scene)
        except InvalidArgumentError:
            return None
        except SkillError as error:
            failed = FailedCall(
                call=call.call,
                error=error.failure,
                contract=call.contract.resolved(scene),
                before=scene,
                scene=scene,
            )
            return error.with_(repairs=error.repairs or self.repairs_for(failed)).failure
        return None

    def advice_for(self, failure: Failure) -> str:
        """Return what static checks find wrong with the robot's sidecar; nothing for other failures and bundled robots."""
        files = self.arm.spec.files
        if not self.advise or files is None or failure.code not in _SHAPED_BY_SIDECAR:
            return ""
        # The checks infer a robot from its model, which most worlds never need.
        from robosandbox.robots.check.diagnosis import advice

        evidence = failure.evidence
        missed = isinstance(evidence, GraspEvidence) and evidence.reason == "missed"
        return advice(files, failure.message, doubtful=missed)

    def enter(self, phase: str) -> None:
        """Tell listeners which phase begins.

        Raises:
            CancelledError: Somebody called `cancel`.
            GoalTimeoutError: The deadline passed.
        """
        self.phase = phase
        self._safety.phase = phase
        ended = self._ended()
        if ended is not None:
            raise ended
        self.entered(phase)

    @property
    def mode(self) -> Mode:
        """Mode of the cell."""
        return self._safety.mode

    @property
    def stop_deadline(self) -> float:
        """Seconds in which a stop has to be over."""
        return self._safety.stop_deadline

    def _perform(self, call: BoundCall[Skill]) -> SkillResult:
        rehearsed = self._rehearsal_of(call)
        # A person may have it tried on the arm though it failed on the twin, which went nowhere then.
        if rehearsed is None or rehearsed.result is None:
            return Executor(self).perform(call)
        with TwinGuard(self, rehearsed.track):
            return Executor(self).perform(call)

    def _rehearsal_of(self, call: BoundCall) -> PreviewStep | None:
        """Return how a call went on the twin, once; those before it are over."""
        for index, step in enumerate(self._rehearsed):
            if step.call == call.call:
                del self._rehearsed[: index + 1]
                return step
        return None

    def _allow(self, timeout: float | None) -> None:
        self._started = self.driver.time
        self._deadline = None if timeout is None else self._started + timeout

    def _ended(self) -> SkillError | None:
        """Return once why the goal has ended, a cancel or a missed deadline; what cleans up afterwards may move again."""
        if self._cancelled.is_set():
            self._cancelled.clear()
            _log.info("cancelled during %s at %.2f s", self.phase, self.driver.time)
            return CancelledError("cancelled; the arm holds where it was", phase=self.phase)
        if self._deadline is not None and self.driver.time > self._deadline:
            timeout, elapsed = self._deadline - self._started, self.driver.time - self._started
            self._deadline = None
            return GoalTimeoutError(
                f"not done after {timeout:g} s; the arm holds where it was; allow more time or ask for less at once",
                phase=self.phase,
                evidence=TimeoutEvidence(deadline=timeout, elapsed=elapsed),
            )
        return None
