"""Move to: bring the hand to a pose."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from robosandbox.errors import CollisionError, Phase, UnreachableError
from robosandbox.evidence import CollisionEvidence
from robosandbox.grasp.hand import lean
from robosandbox.skills.base import Skill
from robosandbox.skills.primitives.carrying import carried_along
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, Pose, SkillResult, Speed
from robosandbox.world.contracts import Contract

_DOWN = np.array([0.0, 0.0, -1.0])
# Headings of the closing direction that are tried where none is asked for, rad from the present one: those of fingers are alike
# after half a turn.
_TURNS = (0.0, np.pi / 2.0)
# Configurations at random from which others are looked for where those at hand touch something.
_SEEDS = 12
# How near the hand comes to a pose that is asked for, metres and rad, and the seconds of integral action that it may take.
_NEAR, _TURNED, _SECONDS = 0.0005, 0.003, 1.5


class MoveTo(Skill):
    """Move the hand to a pose."""

    name = "move_to"

    def contract(self, **arguments: Any) -> Contract:
        """Return that what is held stays held; nothing else is promised."""
        del arguments
        return Contract(keeps_hold=True)

    def run(
        self,
        ctx: SkillContext,
        *,
        x: float,
        y: float,
        z: float,
        heading: float | None = None,
        tilt: Annotated[float, Field(ge=0.0, le=np.pi)] = 0.0,
        towards: float = 0.0,
        straight: bool = False,
    ) -> SkillResult:
        """Move the tool centre point to a place on a free way, the hand pointing down or tilted; what it holds stays held.

        Args:
            x: Forward from the world's origin, metres.
            y: To the left, metres.
            z: Up, metres.
            heading: Direction in which the fingers close about the vertical, before the hand tilts, rad from x; as it is when left out.
            tilt: Angle between the hand's approach and straight down, rad; 1.5708 points it level.
            towards: Direction into which the hand points when it is tilted, rad from x.
            straight: Whether the tool centre point goes in a straight line.

        Raises:
            UnreachableError: The hand cannot be there.
            CollisionError: Something is in the way.
            LimitError: It is outside of the workspace.
            TrackingError: The arm did not arrive.
        """
        arm = Manipulator(ctx)
        speed = ready_to_move(arm)
        goals = _poses(arm, (x, y, z), heading, tilt, towards)
        failure: UnreachableError | CollisionError | None = None
        for goal in goals:
            try:
                if straight:
                    trajectory = arm.motion.plan_line(arm.q, goal, speed=speed)
                else:
                    trajectory = arm.motion.plan_joints(arm.q, _standing_at(arm, goal), speed=speed)
            except (UnreachableError, CollisionError) as error:
                failure = failure or error
                continue
            arm.follow(trajectory, Phase.APPROACH)
            return SkillResult(skill=self.name, detail=arrived(arm, goal, trajectory.q[-1]))
        assert failure is not None
        raise failure


def ready_to_move(arm: Manipulator) -> Speed:
    """Take the world that is seen to plan in, with what is held; return how fast the hand may go with it.

    What the robot touches already it may touch on its way.
    """
    held = arm.start.held
    arm.use(arm.start, held=held)
    carried = carried_along(arm.find(held), arm.start) if held else ()
    allowed: list[str] = [*carried]
    arm.motion.allow(*allowed)
    while (touched := arm.motion.touch(arm.q)) is not None:
        evidence = touched.evidence
        if not isinstance(evidence, CollisionEvidence) or evidence.other in allowed:
            break
        allowed.append(evidence.other)
        arm.motion.allow(*allowed)
    if held is None:
        return arm.tempo.free
    # What a grip bears is reckoned for ways on which the hand stays upright; here it may turn with what it holds.
    return arm.tempo.full


def arrived(arm: Manipulator, goal: Pose, q: Array) -> dict[str, float | str | bool]:
    """Bring the hand, which has followed a way to `q` (n,), on to its goal; return where it is, metres, mm and degrees off."""
    deadline = arm.driver.time + _SECONDS
    while arm.driver.time < deadline:
        off, turned = _off(arm, goal)
        if off <= _NEAR and turned <= _TURNED:
            break
        arm.trim(q)
    there = arm.state.tcp_pose
    off, turned = _off(arm, goal)
    return {
        "x": there.xyz[0],
        "y": there.xyz[1],
        "z": there.xyz[2],
        "off_mm": 1e3 * off,
        "off_deg": float(np.degrees(turned)),
    }


def _off(arm: Manipulator, goal: Pose) -> tuple[float, float]:
    """Return how far the hand is from a pose, metres and rad."""
    there = arm.state.tcp_pose
    cosine = (np.trace(goal.rotation.T @ there.rotation) - 1.0) / 2.0
    off = float(np.linalg.norm(there.position - goal.position))
    return off, float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _poses(
    arm: Manipulator, point: tuple[float, float, float], heading: float | None, tilt: float, towards: float
) -> list[Pose]:
    """Return the poses that were asked for, the one first for which the hand turns least."""
    closing = arm.state.tcp_pose.rotation[:, 1]
    present = float(np.arctan2(closing[1], closing[0]))
    leant = lean(np.array([np.cos(towards), np.sin(towards), 0.0]), tilt)
    poses = []
    for angle in [heading] if heading is not None else [present + turn for turn in _TURNS]:
        y = np.array([np.cos(angle), np.sin(angle), 0.0])
        poses.append(Pose.from_matrix(np.array(point), leant @ np.column_stack([np.cross(y, _DOWN), y, _DOWN])))
    return poses


def _standing_at(arm: Manipulator, pose: Pose) -> Array:
    """Return a configuration at a pose, free of collisions, the first one found of those nearest to the arm's, home and others.

    Raises:
        UnreachableError: There is none.
        CollisionError: Each that is found touches something.
    """
    robot = arm.spec
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    others = np.random.default_rng(0).uniform(low, high, (_SEEDS, robot.n))
    failure: CollisionError | None = None
    for seed in (arm.q, robot.home_q, *others):
        q = arm.motion.ik(pose, seed)
        touched = arm.motion.touch(q)
        if touched is None:
            return q
        failure = failure or touched
    assert failure is not None
    raise failure
