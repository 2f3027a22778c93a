"""Grasp planners as skills ask them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    from robosandbox.types import Array, DetectedObject, Grasp, ObservedScene
    from robosandbox.types.robot import RobotSpec


@runtime_checkable
class GraspPlanner(Protocol):
    """Ways to hold an object, best first, made as they are asked for; feasibility is the motion planner's to say.

    `pieces`, each (k, 3), span a mesh's convex pieces in the object's frame; `hand` (3, 3) is the TCP's rotation now, so that of
    grasps about as good the one that turns it least may come first.
    """

    def candidates(
        self,
        target: DetectedObject,
        scene: ObservedScene,
        robot: RobotSpec,
        *,
        pieces: Sequence[Array] = (),
        hand: Array | None = None,
    ) -> Iterable[Grasp]: ...
