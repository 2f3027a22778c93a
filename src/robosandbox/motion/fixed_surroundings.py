"""What an arm meets of itself and of a scene's fixtures, for drivers that have no world of their own to feel it in."""

from __future__ import annotations

from collections.abc import Callable

from robosandbox.driver.surroundings import Meeting, Meets
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.types import Array


def meetings(planning: PlanningScene, finger: Callable[[], float] | None = None) -> Meets:
    """Return what tells what an arm meets in a scene in which nothing is seen: itself, the table, walls and furniture.

    Args:
        planning: That scene.
        finger: Returns the gripper's joint value now; its fingers stand as the model has them where it is left out.
    """
    checker = planning.collisions(0.0)

    def met(q: Array) -> Meeting | None:
        if finger is not None:
            checker.set_gripper(finger())
        deepest = checker.touch(q)
        return None if deepest is None else Meeting(part=deepest.body, other=deepest.other, depth=deepest.depth)

    return met
