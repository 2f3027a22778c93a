"""Move to: bring the hand to a pose."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from robosandbox.errors import CollisionError, UnreachableError
from robosandbox.grasp.hand import lean
from robosandbox.skills.primitives.hand_move import HandMove, Mover
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Pose, SkillResult

_DOWN = np.array([0.0, 0.0, -1.0])
# Headings of the closing direction that are tried where none is asked for, rad from the present one: those of fingers are alike
# after half a turn.
_TURNS = (0.0, np.pi / 2.0)


class MoveTo(HandMove):
    """Move the hand to a pose."""

    name = "move_to"

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
            UnsupportedError: What lies in what is held would fall out.
            TrackingError: The arm did not arrive.
        """
        arm = Mover(ctx)
        failure: UnreachableError | CollisionError | None = None
        for goal in _poses(arm, (x, y, z), heading, tilt, towards):
            try:
                if straight:
                    way = arm.kept_level(arm.motion.plan_line(arm.q, goal, speed=arm.speed))
                else:
                    way = arm.way_to(arm.standing_at(goal))
            except (UnreachableError, CollisionError) as error:
                failure = failure or error
                continue
            return SkillResult(skill=self.name, detail=arm.arrive(way, goal))
        assert failure is not None
        raise failure


def _poses(
    arm: Mover, point: tuple[float, float, float], heading: float | None, tilt: float, towards: float
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
