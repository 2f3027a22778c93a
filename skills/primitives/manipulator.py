"""The moves that skills are made of: look, go, wait; and those of `fingers.py`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress

import numpy as np

from robosandbox.driver import Guard
from robosandbox.errors import (
    CollisionError,
    ObjectNotFoundError,
    Phase,
    SkillError,
    TrackingError,
    UnreachableError,
)
from robosandbox.evidence import CollisionEvidence, ObjectNotFoundEvidence, TrackingEvidence
from robosandbox.grasp.hand import lean
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.skills.primitives.fingers import Fingers
from robosandbox.skills.primitives.stillness import LOOK_SECONDS, Stillness
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import (
    Array,
    DetectedObject,
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
    (0.35, 0.0),
    (0.25, 0.0),
)
# Angles of an arm's first joint from which other postures are looked for, a number, and the farthest either way, radians.
_POSTURES, _HALF_TURN = 6, math.pi / 2.0
# Share of its limit at which a servo counts as spent; chosen for what rounding and a joint's friction leave of it.
_SPENT = 0.95
# Seconds for which what stands askew or near an edge is watched; chosen as fourteen times the 0.07 s in which a can of
# 50 mm that leaves its balance is e times as far from it.
_WATCH_SECONDS = 1.0
# Metres that fingers which hold something may move between two looks: ten times what encoders are off by (the driver `hardware`), a
# quarter of what the slowest jaw closes by that has lost it (an SO-101's, held back by its grip's limit).
_FINGERS_STILL = 0.001


class Manipulator(Fingers):
    """One skill call's hands and eyes.

    Args:
        ctx: What the skill may use.

    Attributes:
        tempo: How fast it goes in each situation.
        start: What was seen when the skill began.
    """

    def __init__(self, ctx: SkillContext) -> None:
        super().__init__(ctx)
        self.ctx = ctx
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
        """Planning scene: the objects that `use` was given last, or else those that were seen first."""
        if self._planning is None:
            self._planning = self.ctx.planning(self.start)
        return self._planning

    @property
    def q(self) -> Array:
        """The configuration that the arm has, shape (n,)."""
        return self.state.q

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
        """Object that the gripper held when the skill began; its contract has seen to it that it holds something."""
        return self.find(self.start.held or "")

    # Feeling.

    def forces(self) -> Mapping[str, Array]:
        """Return the sum of what the arm presses and pulls each thing with that it touches, N in the world, shape (3,)."""
        return self.driver.senses.forces(self._arm.name)

    def force_on(self, object_id: str | None) -> Array:
        """Return the sum of what the arm presses and pulls an object with, N in the world, shape (3,); None is all."""
        return self.driver.senses.force_on(object_id, self._arm.name)

    def strongest_contact(self) -> tuple[float, str, str]:
        """Return the largest normal force between the arm and anything else, N, and the two bodies; 0 without one."""
        return self.driver.senses.strongest_contact(self._arm.name)

    # Moving.

    def trim(self, goal: Array) -> None:
        """Let one control tick pass with the commands shifted against what keeps the arm off `goal` (n,)."""
        self._arm.trim(goal)

    def send(self, trajectory: Trajectory) -> None:
        """Have the arm follow a short trajectory, and do not wait until it has arrived."""
        self._arm.follow(trajectory)

    def follow(
        self, trajectory: Trajectory, phase: str, *, yielding: bool = False, guards: Sequence[Guard] = ()
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
        self._arm.follow(trajectory, guards)
        self._arrive(trajectory.q[-1], phase, yielding, guards)

    def _arrive(self, goal: Array, phase: str, yielding: bool, guards: Sequence[Guard]) -> None:
        patience = self.driver.time + _TRIM_AFTER
        deadline = self.driver.time + _ARRIVAL_SECONDS
        while (error := np.abs(self.q - goal)).max() > _ARRIVED:
            if self.driver.time >= deadline:
                if yielding:
                    return
                raise self._off_goal(goal, int(error.argmax()), phase)
            if yielding or self.driver.time < patience:
                self.driver.wait(self.driver.control_timestep, guards)
            else:
                self._arm.trim(goal, guards)

    def spent(self) -> str | None:
        """Return the joint whose servo gives all that it can now; None where none does, or where the driver does not tell."""
        if not self.driver.capabilities.joint_torque:
            return None
        for joint, name in enumerate(self.spec.joints):
            force, limit = self._arm.servo_force(joint)
            if force >= _SPENT * limit:
                return name
        return None

    def _off_goal(self, goal: Array, joint: int, phase: str) -> TrackingError:
        """Return the error of a joint that did not get to its goal, with what its servo gave for it."""
        robot, error = self.spec, float((goal - self.q)[joint])
        has = self.driver.capabilities
        contacts = (
            tuple(f"{a} on {b}" for a, b in self.driver.senses.contacts(self._arm.name))
            if has.contact == "named"
            else ()
        )
        force, limit = self._arm.servo_force(joint) if has.joint_torque else (None, np.inf)
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

    def free_posture(self, tcp: Pose, *, restarts: int) -> Array:
        """Return a configuration (n,) with the TCP at a pose in which the robot touches nothing, near how it stands where it can.

        A hand that would touch something does so in any posture of the arm.

        Args:
            tcp: The pose.
            restarts: Sampled starts beside where the arm stands and where it is at home.

        Raises:
            UnreachableError: It is out of reach.
            CollisionError: It touches something in every posture that was tried.
        """
        failure: SkillError | None = None
        home = self.spec.home_q
        turns = sorted(np.linspace(*self._swing, _POSTURES), key=lambda turn: abs(turn - self.q[0]))
        swung = [np.array([turn, *home[1:]]) for turn in turns]
        for seed in (self.q, home, *swung):
            try:
                q = self.motion.ik(tcp, seed, restarts=0 if failure else restarts)
            except UnreachableError as error:
                failure = failure or error
                continue
            met = self.motion.touch(q)
            if met is None:
                return q
            if not isinstance(failure, CollisionError):
                failure = met
            if isinstance(met.evidence, CollisionEvidence) and self.planning.is_of_hand(met.evidence.body):
                break
        assert failure is not None
        raise failure

    def is_of_links(self, failure: SkillError) -> bool:
        """Tell whether a link before the hand touches something, which another posture may not."""
        met = failure.evidence
        held = self.start.held
        return isinstance(met, CollisionEvidence) and met.body != held and not self.planning.is_of_hand(met.body)

    def clearest(self, failures: Sequence[SkillError]) -> SkillError:
        """Return the failure to plan that tells most what to do: one for a loose thing that can be put aside, else as `most_telling`."""
        loose = {item.id for item in self.start.objects if not item.is_fixed and item.id != self.start.held}
        met = [one for one in failures if isinstance(one.evidence, CollisionEvidence) and one.evidence.other in loose]
        return most_telling(met or failures)

    @property
    def _swing(self) -> tuple[float, float]:
        """Angles of the first joint between which postures are looked for, radians."""
        low, high = float(self.spec.lower[0]), float(self.spec.upper[0])
        return max(low, -_HALF_TURN), min(high, _HALF_TURN)

    def line_to(self, target: Pose, hover: Pose, *, speed: Speed, near: Array | None = None) -> Trajectory:
        """Return a straight way of the TCP from one pose to another, in the posture nearest to `near` (n,), or the target's.

        That is the arm's where it is left out.

        Raises:
            UnreachableError: One of them is out of reach, or the line between them in both postures.
            CollisionError: Something is in the way.
        """
        motion, q = self.motion, self.q if near is None else near
        try:
            return motion.plan_line(motion.ik(hover, q), target, speed=speed)
        except UnreachableError as error:
            failure = error
        try:
            return motion.plan_line(motion.ik(hover, motion.ik(target, q)), target, speed=speed)
        except UnreachableError:
            raise failure from None

    def line_down(self, target: Pose, *, speed: Speed) -> Trajectory:
        """Return a way down to a pose: straight from HOVER_HEIGHT over it, else from as high as can be reached, leaning where it must.

        Raises:
            UnreachableError: Not even from a quarter of that.
            CollisionError: Something is in the way.
        """
        try:
            return self.line_to(target, raised(target, HOVER_HEIGHT), speed=speed)
        except UnreachableError as error:
            failure = error
        q = self.motion.ik(target, self.q)
        for over, _ in self.over(target, HOVER_HEIGHT):
            with suppress(UnreachableError):
                return self.motion.plan_line(self.motion.ik(over, q, restarts=0), target, speed=speed)
        raise failure

    def line_up(self, q: Array, height: float, *, speed: Speed) -> tuple[Trajectory, float]:
        """Return a way of the TCP straight up from `q` (n,) by `height`, or by as much of it as can be reached, and how far that is.

        Raises:
            UnreachableError: Not even a quarter of it can be reached.
            CollisionError: Something is above.
        """
        failure: UnreachableError | None = None
        for over, risen in self.over(self.motion.forward(q), height):
            try:
                return self.motion.plan_line(q, over, speed=speed), risen
            except UnreachableError as error:
                failure = failure or error
        assert failure is not None
        raise failure

    def over(self, pose: Pose, height: float) -> Iterator[tuple[Pose, float]]:
        """Yield poses over a pose and how far each is, metres: at `height`, then lower, and leaning outwards, as short arms must."""
        for share, angle in _RISES:
            yield leaning(raised(pose, share * height), self.spec.base_position, angle), share * height

    def rise(self, height: float, phase: str, *, speed: Speed | None = None, guards: Sequence[Guard] = ()) -> float:
        """Move the TCP straight up by `height`, or by as much of it as can be reached; return how far; guards as in `follow`.

        It goes as with nothing near where no speed is given.

        Raises:
            UnreachableError: Not even a quarter of it can be reached.
            CollisionError: Something is above.
        """
        try:
            way, risen = self.line_up(self.state.q, height, speed=self.tempo.free if speed is None else speed)
        except UnreachableError as error:
            raise error.with_(phase=phase) from None
        self.follow(way, phase, guards=guards)
        return risen

    def allow_touched(self) -> None:
        """Let the arm touch the table, what stands freely, and of what is fixed what it touches now, no deeper than now."""
        self.motion.allow("table", *(item.id for item in self.start.objects if not item.is_fixed), touched=True)

    def rise_out(self, height: float, phase: str, *, speed: Speed | None = None) -> None:
        """Rise out of what the hand touches, or draw back along its approach where something is above.

        What stands freely may be touched on the way, what is fixed only where it is touched now: a hand that rose into a board
        over it would press with all that its servos have.

        Raises:
            UnreachableError: Not even a quarter of it can be reached.
            CollisionError: Something fixed is in either way.
        """
        self.allow_touched()
        try:
            self.rise(height, phase, speed=speed)
        except CollisionError as above:
            back = withdrawn(self.state.tcp_pose, height)
            try:
                way = self.motion.plan_line(self.q, back, speed=self.tempo.free if speed is None else speed)
            except (UnreachableError, CollisionError):
                raise above from None
            self.follow(way, phase)

    def settle(self, *names: str, seconds: float = 2.0) -> ObservedScene:
        """Let time pass until these objects are seen to be still, and return that look; what is held is as long as the fingers are."""
        self.ctx.enter(Phase.SETTLE)
        deadline = self.driver.time + seconds
        stillness, apart = Stillness(self.look(*names), names), self.spread
        while True:
            self.driver.wait(LOOK_SECONDS)
            now, before, apart = self.look(*names), apart, self.spread
            still = now.held not in names or abs(apart - before) < _FINGERS_STILL
            if (stillness.seen(now) and still) or self.driver.time >= deadline:
                return now

    def watch(self, name: str) -> ObservedScene:
        """Let time pass until an object that may still topple has had the time to, and return a look at it at rest."""
        self.ctx.enter(Phase.SETTLE)
        self.driver.wait(_WATCH_SECONDS)
        return self.settle(name)


def most_telling(failures: Sequence[SkillError]) -> SkillError:
    """Return the failure to plan that came closest to working: the first collision, else the first of all."""
    collisions = [error for error in failures if isinstance(error, CollisionError)]
    return (collisions or failures)[0].with_(phase=Phase.PLAN)


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


def moved(pose: Pose, offset: Array) -> Pose:
    """Return the pose shifted by an offset (3,) in the world, metres."""
    return Pose.from_matrix(pose.position + offset, pose.rotation)
