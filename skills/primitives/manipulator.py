"""The moves that skills are made of: look, go, grip, let go, wait."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from robosandbox.errors import (
    CollisionError,
    ObjectNotFoundError,
    Phase,
    SkillError,
    TrackingError,
    UnreachableError,
    UnsupportedError,
)
from robosandbox.evidence import ObjectNotFoundEvidence, TrackingEvidence
from robosandbox.grasp.hand import lean
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.protocols import Driver, Guard, MotionPlanner, SkillContext
from robosandbox.robots.spec import GripperGeometry
from robosandbox.skills.primitives.stillness import LOOK_SECONDS, Stillness
from robosandbox.types import (
    Array,
    DetectedObject,
    GripperState,
    Observation,
    ObservedScene,
    Pose,
    Speed,
    Tempo,
    Trajectory,
)

# How far what was grasped is lifted, metres; as in the seeds, whose pick comes up 167 mm (halved 6 % shorter episodes,
# doubled 11 % longer).
LIFT_HEIGHT = 0.17
# Straight way down to a grasp and up from a placement, metres; chosen as a finger's length, so that the hand turns over
# things and not between them (halved 7 % shorter episodes, doubled 9 % longer).
HOVER_HEIGHT = 0.08
# How far off its goal a joint may be that has arrived, rad or m; chosen as 2 to 4 mm at an arm's length (halved and
# doubled all ends alike: the bundled arm's servos come nearer).
_ARRIVED = 0.004
# Seconds that a joint gets to arrive; chosen so that integral action, which halves what is left in 8 ticks, is done.
_ARRIVAL_SECONDS = 1.5
# Seconds after which integral action takes up what keeps a joint off; chosen as what a servo takes to come to rest by
# itself.
_TRIM_AFTER = 0.15
# Shares of a rise and how far the hand leans outwards meanwhile, rad; chosen so that short arms give up height before
# they give up the vertical (docs/arms.md).
_RISES = (
    (1.0, 0.0),
    (0.75, 0.0),
    (0.5, 0.0),
    (1.0, 0.35),
    (0.5, 0.35),
    (1.0, 0.7),
    (0.5, 0.7),
    (0.5, 1.05),
    (0.25, 0.0),
)
# Share of its limit at which a servo counts as spent; chosen for what rounding and a joint's friction leave of it.
_SPENT = 0.95
# Metres before what they close on from which fingers are gentle, both together, and the share of their motors' force that they are
# gentle with; chosen: three times perception's error of a size, and a force at which the bundled hand's fingers move half as fast.
_MEETING, _GENTLE = 0.006, 0.4
# Rows of a trajectory between two that are looked at; chosen as 50 ms, in which a hand goes by less than a finger's thickness.
_EVERY = 10
# Seconds between two readings of fingers; chosen as several ticks, so that standing still shows (halved 1 % shorter
# episodes, doubled 2 % longer).
_LAG = 0.05
# Seconds that fingers get to come to rest; chosen for slow servos of small arms (halved and doubled all ends alike: the
# bundled gripper takes under one).
_GRIP_SECONDS = 4.0
# Metres between two readings below which fingers stand still; chosen far below what a grip creeps (halved or doubled,
# under 1 % of an episode).
_GRIP_STILL = 0.0002
# Seconds for which what stands askew or near an edge is watched; chosen as fourteen times the 0.07 s in which a can of
# 50 mm that leaves its balance is e times as far from it.
_WATCH_SECONDS = 1.0


class Manipulator:
    """One skill call's hands and eyes.

    Args:
        ctx: What the skill may use.

    Attributes:
        tempo: How fast it goes in each situation.
        start: What was seen when the skill began.
    """

    def __init__(self, ctx: SkillContext) -> None:
        self.ctx = ctx
        self.sim: Driver = ctx.sim
        self.motion: MotionPlanner = ctx.motion
        self.tempo: Tempo = ctx.tempo
        self._planning: PlanningScene | None = None
        ctx.enter(Phase.PERCEIVE)
        self.start: ObservedScene = self.look()

    # Looking.

    def look(self, *names: str) -> ObservedScene:
        """Return what perception sees now; with names, of these things, and what is remembered of the others."""
        return self.ctx.look(*names)

    def feel(self) -> ObservedScene:
        """Return what is believed now without a look."""
        return self.ctx.feel()

    def use(self, scene: ObservedScene, *, held: str | None = None) -> None:
        """Plan among these objects from now on."""
        self._planning = self.ctx.planning(scene)
        self.motion.use(self._planning, self.state, held=held)

    @property
    def planning(self) -> PlanningScene:
        """What is planned among: the objects that `use` was given last, or else those that were seen first."""
        if self._planning is None:
            self._planning = self.ctx.planning(self.start)
        return self._planning

    @property
    def state(self) -> Observation:
        """How the robot stands."""
        return self.sim.state()

    @property
    def q(self) -> Array:
        """The configuration that the arm has, shape (n,)."""
        return self.state.q

    @property
    def geometry(self) -> GripperGeometry:
        """The gripper's measured figures.

        Raises:
            UnsupportedError: The robot has no gripper.
        """
        gripper = self.sim.spec.gripper
        if gripper is None:
            raise UnsupportedError(
                f"{self.sim.spec.name} has no gripper in its sidecar, so it cannot hold things; it can push, tap and "
                "go home",
                phase=Phase.CHECK,
            )
        return gripper.geometry

    @property
    def gripper(self) -> GripperState:
        """The gripper's own readings.

        Raises:
            UnsupportedError: The robot has no gripper.
        """
        state = self.state.gripper
        if state is None:
            raise UnsupportedError(f"{self.sim.spec.name} has no gripper", phase=Phase.CHECK)
        return state

    def find(self, object_id: str, scene: ObservedScene | None = None) -> DetectedObject:
        """Return a seen object.

        Raises:
            ObjectNotFoundError: Nothing seen has this id.
        """
        scene = scene or self.start
        found = scene.find(object_id)
        if found is None:
            seen = tuple(item.id for item in scene.objects)
            raise ObjectNotFoundError(
                f"no object {object_id!r} is seen; there is {', '.join(seen) or 'nothing'}",
                phase=Phase.PERCEIVE,
                evidence=ObjectNotFoundEvidence(query=object_id, seen=seen),
            )
        return found

    @property
    def held(self) -> DetectedObject:
        """What the gripper held when the skill began; its contract has seen to it that it holds something."""
        return self.find(self.start.held or "")

    # Moving.

    def follow(
        self, trajectory: Trajectory, phase: Phase, *, yielding: bool = False, guards: Sequence[Guard] = ()
    ) -> None:
        """Execute a trajectory and wait until the arm has arrived.

        Args:
            trajectory: From where the arm is.
            phase: For listeners and errors.
            yielding: Accept that contact keeps the arm off its goal, as when pushing.
            guards: Asked after every control tick; what one returns ends the motion and is raised.

        Raises:
            TrackingError: A joint stayed off its goal.
        """
        self.ctx.enter(phase)
        self.ctx.announce(trajectory)
        self.sim.follow(trajectory, guards)
        self._arrive(trajectory.q[-1], phase, yielding, guards)

    def _arrive(self, goal: Array, phase: Phase, yielding: bool, guards: Sequence[Guard]) -> None:
        patience = self.sim.time + _TRIM_AFTER
        deadline = self.sim.time + _ARRIVAL_SECONDS
        while (error := np.abs(self.q - goal)).max() > _ARRIVED:
            if self.sim.time >= deadline:
                if yielding:
                    return
                raise self._off_goal(goal, int(error.argmax()), phase)
            if yielding or self.sim.time < patience:
                self.sim.wait(self.sim.control_timestep, guards)
            else:
                self.sim.trim(goal, guards)

    def _off_goal(self, goal: Array, joint: int, phase: Phase) -> TrackingError:
        """Return the error of a joint that did not get to its goal, with what its servo gave for it."""
        robot, error = self.sim.spec, float((goal - self.q)[joint])
        has = self.sim.capabilities
        contacts = tuple(f"{a} on {b}" for a, b in self.sim.arm_contacts()) if has.contact == "named" else ()
        force, limit = self.sim.servo_force(joint) if has.joint_torque else (None, np.inf)
        if contacts:
            cause = f"while {', '.join(contacts)}; clear what is in the way, or take something lighter"
        elif force is None:
            cause = (
                "for a reason that this driver does not measure; clear what is in the way, or take something lighter"
            )
        elif force >= _SPENT * limit:
            cause = f"with its servo at its limit of {limit:.0f}; the load is too heavy for it: take something lighter"
        else:
            cause = f"though nothing is touched; its servo gives {force:.1f} of at most {limit:.0f}: it is weak, or its joint stiff"
        return TrackingError(
            f"{robot.joints[joint]} stayed {abs(error):.3f} off its goal {cause}",
            phase=phase,
            evidence=TrackingEvidence(
                joint=robot.joints[joint],
                error=error,
                contacts=contacts,
                servo_force=None if force is None else round(force, 3),
                servo_limit=limit if np.isfinite(limit) else None,
            ),
        )

    def line_to(self, target: Pose, hover: Pose, *, speed: Speed) -> Trajectory:
        """Return a straight way of the TCP from one pose to another, in the posture nearest to the arm's, or the target's.

        Raises:
            UnreachableError: One of them is out of reach, or the line between them in both postures.
            CollisionError: Something is in the way.
        """
        motion, q = self.motion, self.q
        try:
            return motion.plan_line(motion.ik(hover, q), target, speed=speed)
        except UnreachableError as error:
            failure = error
        try:
            return motion.plan_line(motion.ik(hover, motion.ik(target, q)), target, speed=speed)
        except UnreachableError:
            raise failure from None

    def rise(self, height: float, phase: Phase, *, speed: Speed | None = None, guards: Sequence[Guard] = ()) -> float:
        """Move the TCP straight up by `height`, or by as much of it as can be reached; return how far; guards as in `follow`.

        It goes as with nothing near where no speed is given.

        Raises:
            UnreachableError: Not even a quarter of it can be reached.
            CollisionError: Something is above.
        """
        observation = self.sim.state()
        speed = self.tempo.free if speed is None else speed
        failure: UnreachableError | None = None
        for share, angle in _RISES:
            target = leaning(raised(observation.tcp_pose, share * height), self.sim.spec.base_position, angle)
            try:
                trajectory = self.motion.plan_line(observation.q, target, speed=speed)
            except UnreachableError as error:
                failure = failure or error
                continue
            self.follow(trajectory, phase, guards=guards)
            return share * height
        assert failure is not None
        raise failure.at(phase) from None

    # Gripping.

    def open(self, aperture: float | None = None, *, wait: bool = True) -> None:
        """Open the fingers to `aperture` metres, or all the way."""
        geometry = self.geometry
        if aperture is None or aperture >= geometry.max_aperture:
            closed = 0.0
        else:
            closed = float(np.clip(geometry.closed_fraction(geometry.joint_for_aperture(aperture)), 0.0, 1.0))
        self.sim.set_gripper(closed)
        if wait:
            self.wait_for_fingers()

    def open_for(self, way: Trajectory, aperture: float) -> None:
        """Send the fingers to `aperture` metres for a way that was planned with them there.

        Where they have to come nearer to each other for it to be free, they are waited for first; else they go meanwhile.
        """
        wide = self.gripper.width
        self.open(aperture, wait=False)
        if wide - aperture > _GRIP_STILL:
            self.motion.open_to(wide)
            blocked = any(self.motion.touch(q) is not None for q in way.q[::_EVERY])
            self.motion.open_to(aperture)
            if blocked:
                self.wait_for_fingers()

    def close(self) -> float:
        """Close the fingers until they stop; return the gap between them, metres."""
        self.sim.set_gripper(1.0)
        return self.wait_for_fingers()

    @property
    def feels_grip(self) -> bool:
        """Whether the fingers' force is measured, with what it carries, and can be limited."""
        has = self.sim.capabilities
        return has.gripper_force and has.wrist_wrench and has.grip_limit and self.geometry.cup is None

    def close_on(self, width: float) -> float:
        """Close the fingers on something of this width, metres: gently where they meet it, as far as their force is felt.

        Returns:
            The gap between them when they have stopped, metres.
        """
        gripper = self.sim.spec.gripper
        strength = math.inf if gripper is None else float(gripper.force_limits.sum())
        if not self.feels_grip or not math.isfinite(strength):
            return self.close()
        self.sim.set_gripper(1.0)
        deadline = self.sim.time + _GRIP_SECONDS
        while self.gripper.width > width + _MEETING and self.sim.time < deadline:
            before = self.gripper.closed
            self.sim.wait(self.sim.control_timestep)
            if self.gripper.closed <= before:
                break
        self.sim.set_gripper(1.0, _GENTLE * strength)
        gap = self.wait_for_fingers()
        return gap if self.sim.grip_on(None) > 0.0 else self.close()

    def wait_for_fingers(self, until: float = math.inf) -> float:
        """Wait until the fingers no longer move, or are `until` metres apart; return the gap between them."""
        deadline = self.sim.time + _GRIP_SECONDS
        self.sim.wait(_LAG)
        state = self.gripper
        while self.sim.time < deadline and state.width < until:
            self.sim.wait(_LAG)
            before, state = state, self.gripper
            # A jaw that has swung far off still moves where its gap no longer grows.
            travel = abs(state.closed - before.closed) * self.geometry.max_aperture
            if max(abs(state.width - before.width), travel) < _GRIP_STILL:
                break
        return state.width

    def settle(self, *names: str, seconds: float = 2.0) -> ObservedScene:
        """Let time pass until these objects are seen to be still, and return that look."""
        self.ctx.enter(Phase.SETTLE)
        deadline = self.sim.time + seconds
        stillness = Stillness(self.look(*names), names)
        while True:
            self.sim.wait(LOOK_SECONDS)
            now = self.look(*names)
            if stillness.seen(now) or self.sim.time >= deadline:
                return now

    def watch(self, name: str) -> ObservedScene:
        """Let time pass until an object that may still topple has had the time to, and return a look at it at rest."""
        self.ctx.enter(Phase.SETTLE)
        self.sim.wait(_WATCH_SECONDS)
        return self.settle(name)


def most_telling(failures: Sequence[SkillError]) -> SkillError:
    """Return the failure to plan that came closest to working: the first collision, else the first of all."""
    collisions = [error for error in failures if isinstance(error, CollisionError)]
    return (collisions or failures)[0].at(Phase.PLAN)


def withdrawn(pose: Pose, distance: float) -> Pose:
    """Return the pose moved back along its approach by `distance` metres."""
    return Pose(xyz=tuple(pose.position - distance * pose.rotation[:, 2]), quat_xyzw=pose.quat_xyzw)


def leaning(pose: Pose, base: Array, angle: float) -> Pose:
    """Return the pose with its approach tilted by `angle` radians away from the robot's base."""
    return Pose.from_matrix(pose.position, lean(pose.position - base, angle) @ pose.rotation)


def raised(pose: Pose, height: float) -> Pose:
    """Return the pose moved up by `height` metres."""
    x, y, z = pose.xyz
    return Pose(xyz=(x, y, z + height), quat_xyzw=pose.quat_xyzw)
