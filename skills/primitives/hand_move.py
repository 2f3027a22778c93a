"""Base of skills that move the hand by itself: what is held stays held and, where it holds things, level."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from robosandbox.errors import CollisionError, Phase, UnreachableError, UnsupportedError
from robosandbox.evidence import CollisionEvidence
from robosandbox.grasp.hand import lean
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.carrying import MOST_TILT, carried_along, tilt, transfer
from robosandbox.skills.primitives.guarded import nowhere_faster, touching_line
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, Pose, Speed, Trajectory
from robosandbox.world.contracts import Contract
from robosandbox.world.facts import fact
from robosandbox.world.relations import bottom, bounds, centre, top

# Configurations at random from which others are looked for where those at hand touch something.
_SEEDS = 12
# How people say that the hand goes somewhere: verbs that may do without it, and those that need to name what they move.
_GOES = (
    "traverse",
    *("move", "go", "come", "shift", "head", "travel", "glide", "float", "drift", "fly", "jog", "inch", "creep"),
    *(
        "edge",
        "translate",
        "proceed",
        "advance",
        "get",
        "swing",
        "position",
        "steer",
        "slide",
        "drive",
        "park",
        "move over",
        "move off",
        "move away",
        "move across",
        "back off",
        "get away",
    ),
)
_BRINGS = (
    "run",
    *("bring", "take", "put", "place", "push", "pull", "nudge", "displace", "offset", "lead", "guide", "send", "set"),
    *("ease", "carry", "reposition", "get"),
)
# How somebody says it who has said it before: "carry on down".
GOES_ON = ("carry on", "go on", "continue", "keep going", "keep moving", "go further", "move on")
HAND_GOES = (*_GOES, *(f"{verb} {{}}" for verb in _BRINGS))
# m/s of a hand that feels its way: two fingertips of the bundled arm that meet the table at once knock on it with 25 N, and with
# twice that at twice the speed.
_FEELING = 0.005
# N; what a hand that comes slowly feels before it presses hard.
LIGHT = 2.0
# Metres above what is believed to be below the hand from where on it feels its way, and how far about it that may be; chosen as ten
# times what pixels err by (2.2 mm p95), and the breadth of a finger.
_SHORT_OF_IT, _ABOUT = 0.03, 0.02
# Times that a way which leads out of reach is halved: to a millimetre of the longest.
_HALVINGS = 11
# Metres above a thing from which the tool centre point comes down on it, the first that is free: closed fingers may reach beyond it.
_ABOVE = (0.01, 0.03, 0.06)
# Metres to what stands there within which a way ends barely clear of it, and the m/s at which it is gone then.
_BARELY, _BARELY_FASTEST = 0.004, 0.1
# How near the hand comes to where its way ends, metres and rad, and the seconds of integral action that it may take.
_NEAR, _TURNED, _SECONDS = 0.0005, 0.003, 1.5
_DOWN = np.array([0.0, 0.0, -1.0])
# Headings of the closing direction that are tried where none is asked for, rad from the present one: those of fingers are alike
# after half a turn.
_TURNS = (0.0, np.pi / 2.0)


class HandMove(Skill):
    """A skill that moves the hand or its arm, and promises nothing but that what is held stays held."""

    def contract(self, *args: Any, **arguments: Any) -> Contract:
        """Return that what is to be held meanwhile is held, and that what is held stays so."""
        del args
        held = arguments.get("held")
        return Contract(needs=() if held is None else (fact("holding", held),), keeps_hold=True)


class Mover(Manipulator):
    """The hands and eyes of a call that moves the hand, ready to plan among what is seen.

    What the robot touches already it may touch on its way.

    Args:
        ctx: What the skill may use.

    Attributes:
        speed: How fast the hand goes with what it holds.
        carries: What lies in what it holds.
    """

    def __init__(self, ctx: SkillContext) -> None:
        super().__init__(ctx)
        name = self.start.held
        self.use(self.start, held=name)
        self.carries = carried_along(self.find(name), self.start) if name else ()
        allowed: list[str] = [*self.carries]
        self.motion.allow(*allowed)
        while (met := self.motion.touch(self.q)) is not None:
            evidence = met.evidence
            if not isinstance(evidence, CollisionEvidence) or evidence.other in allowed:
                break
            allowed.append(evidence.other)
            self.motion.allow(*allowed)
        # What a grip bears is reckoned for ways on which the hand stays upright; here it may turn with what it holds.
        self.speed: Speed = self.tempo.free if name is None else self.tempo.full

    def way_to(self, q: Array) -> Trajectory:
        """Return a free way to a configuration (n,), level where something lies in what is held.

        Raises:
            CollisionError: There is none.
            UnreachableError: There is none on which what is held stays level.
            UnsupportedError: What lies in what is held would fall out there.
        """
        return self.kept_level(transfer(self, q, level=bool(self.carries), speed=self.speed))

    def kept_level(self, trajectory: Trajectory) -> Trajectory:
        """Return a way, if nothing falls out of what is held on it.

        Raises:
            UnsupportedError: Something would.
        """
        if self.carries and tilt(self, trajectory) > MOST_TILT:
            raise UnsupportedError(
                f"{self.start.held} holds {', '.join(self.carries)}, which would fall out on that way; pour it out, put "
                "it down, or keep the hand upright",
                phase=Phase.PLAN,
            )
        return trajectory

    def standing_at(self, pose: Pose) -> Array:
        """Return a configuration (n,) at a pose, free of collisions: the first found of those near the arm's, home and others.

        Raises:
            UnreachableError: There is none.
            CollisionError: Each that is found touches something.
        """
        robot = self.spec
        low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
        others = np.random.default_rng(0).uniform(low, high, (_SEEDS, robot.n))
        failure: CollisionError | None = None
        for seed in (self.q, robot.home_q, *others):
            try:
                q = self.motion.ik(pose, seed)
            except UnreachableError as error:
                raise failure or error from None
            met = self.motion.touch(q)
            if met is None:
                return q
            failure = failure or met
        assert failure is not None
        raise failure

    def bring(
        self,
        point: tuple[float, float, float],
        *,
        heading: float | None = None,
        tilt: float = 0.0,
        towards: float = 0.0,
        straight: bool = False,
    ) -> dict[str, float | str | bool]:
        """Bring the tool centre point to a place, the hand pointing down or tilted; return as `arrive`.

        Args:
            point: The place, metres in the world.
            heading: Direction in which the fingers close about the vertical, before the hand tilts, rad from x; None is as it is.
            tilt: Angle between the hand's approach and straight down, rad.
            towards: Direction into which the hand points when it is tilted, rad from x.
            straight: Whether it goes in a straight line.

        Raises:
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        failure: UnreachableError | CollisionError | None = None
        for goal in self._poses(point, heading, tilt, towards):
            try:
                if straight:
                    way = self.kept_level(self.motion.plan_line(self.q, goal, speed=self.speed))
                else:
                    way = self.way_to(self.standing_at(goal))
            except (UnreachableError, CollisionError) as error:
                failure = failure or error
                continue
            return self.arrive(way, goal)
        assert failure is not None
        raise failure

    def come_over(self, name: str) -> None:
        """Bring the hand close over a thing, its fingers closed where they hold nothing.

        Raises:
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
        """
        if self.spec.gripper is not None and self.start.held is None:
            self.open(0.0)
            self.use(self.look())
        below = self.find(name)
        x, y, _ = centre(below)
        failure: UnreachableError | CollisionError | None = None
        for above in _ABOVE:
            try:
                self.bring((float(x), float(y), top(below) + above + self.hangs))
            except (UnreachableError, CollisionError) as error:
                failure = failure or error
            else:
                return
        assert failure is not None
        raise failure

    def come_down_near(self, most: float = np.inf) -> None:
        """Bring the hand straight down to a little above what is believed to be below it, where the way there is free.

        What is felt for slowly may be half a metre away.

        Args:
            most: How far down, metres, at most.
        """
        here = self.state.tcp_pose
        beside = _ABOUT + (self.geometry.max_aperture / 2.0 if self.spec.gripper is not None else 0.0)
        tops = [self.start.table_height]
        for item in self.start.objects:
            if item.id == self.start.held or item.id in self.carries:
                continue
            low, high = bounds(item)
            if np.all(low[:2] < here.position[:2] + beside) and np.all(high[:2] > here.position[:2] - beside):
                tops.append(float(high[2]))
        z = max(max(tops) + _SHORT_OF_IT + self.hangs, here.xyz[2] - most)
        if here.xyz[2] - z < _SHORT_OF_IT:
            return
        goal = Pose(xyz=(*here.xyz[:2], z), quat_xyzw=here.quat_xyzw)
        with suppress(UnreachableError, CollisionError):
            self.arrive(self.kept_level(self.motion.plan_line(self.q, goal, speed=self.speed)), goal)

    def as_far_as_it_goes(self, start: Pose, goal: Pose) -> Trajectory:
        """Return the slow straight way to a goal on which things may be touched, or as much of it as the arm reaches.

        Raises:
            UnreachableError: That is next to nothing.
            CollisionError: The arm itself, or what is fixed, is in the way all along.
        """
        failure: UnreachableError | CollisionError | None = None
        found: Trajectory | None = None
        near, share = 0.0, 1.0
        for halving in range(1, _HALVINGS + 1):
            point = start.position + share * (goal.position - start.position)
            try:
                found = touching_line(self, self.q, Pose(xyz=tuple(point), quat_xyzw=start.quat_xyzw))
            except (UnreachableError, CollisionError) as error:
                failure = failure or error
            else:
                near = share
                if failure is None:
                    break
            share = near + 0.5**halving
        if found is None:
            assert failure is not None
            raise failure
        return nowhere_faster(self, found, _FEELING)

    def pressed(self) -> Array:
        """Return the sum of what the arm presses with, N in the world, shape (3,)."""
        if self.driver.capabilities.contact == "named":
            return sum(self.forces().values(), np.zeros(3))
        return self.force_on(None)

    @property
    def hangs(self) -> float:
        """Distance that what is held reaches below the tool centre point, metres; 0 with nothing in the hand."""
        name = self.start.held
        return 0.0 if name is None else self.state.tcp_pose.xyz[2] - bottom(self.find(name))

    def _poses(
        self, point: tuple[float, float, float], heading: float | None, tilt: float, towards: float
    ) -> list[Pose]:
        """Return the poses that were asked for, the one first for which the hand turns least."""
        closing = self.state.tcp_pose.rotation[:, 1]
        present = float(np.arctan2(closing[1], closing[0]))
        leant = lean(np.array([np.cos(towards), np.sin(towards), 0.0]), tilt)
        poses = []
        for angle in [heading] if heading is not None else [present + turn for turn in _TURNS]:
            y = np.array([np.cos(angle), np.sin(angle), 0.0])
            poses.append(Pose.from_matrix(np.array(point), leant @ np.column_stack([np.cross(y, _DOWN), y, _DOWN])))
        return poses

    def arrive(self, trajectory: Trajectory, asked: Pose) -> dict[str, float | str | bool]:
        """Follow a way and come to rest at its end; return where the hand is, metres, mm and degrees off what was asked for.

        Raises:
            TrackingError: The arm did not arrive.
        """
        near = self.planning.collisions(_BARELY)
        if self.spec.gripper is not None:
            near.set_gripper(self.gripper.joint)
        if near.touch(trajectory.q[-1]) is not None:
            # What a servo swings out by where it comes to rest is more than is left there.
            trajectory = nowhere_faster(self, trajectory, _BARELY_FASTEST)
        self.follow(trajectory, Phase.APPROACH)
        goal, deadline = self.motion.forward(trajectory.q[-1]), self.driver.time + _SECONDS
        while self.driver.time < deadline:
            off, turned = _apart(self.state.tcp_pose, goal)
            if off <= _NEAR and turned <= _TURNED:
                break
            self.trim(trajectory.q[-1])
        there = self.state.tcp_pose
        off, turned = _apart(there, asked)
        x, y, z = there.xyz
        return {"x": x, "y": y, "z": z, "off_mm": 1e3 * off, "off_deg": float(np.degrees(turned))}


def _apart(one: Pose, other: Pose) -> tuple[float, float]:
    """Return how far two poses are apart, metres and rad."""
    return float(np.linalg.norm(one.position - other.position)), one.angle_to(other)
