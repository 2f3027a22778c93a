"""Under which force things slide that are to stay where they are, by their weight and friction."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from robosandbox.grasp.hand import FRICTION
from robosandbox.motion.planning_scene import PlanningScene
from robosandbox.skills.primitives.gripping import GRAVITY
from robosandbox.types import ObservedScene

# N that are never taken for a shove; chosen above the noise of a force sensor at a wrist, and the weight of an empty cup.
_LEAST = 2.0


def slides_under(
    planning: Callable[[ObservedScene], PlanningScene], scene: ObservedScene, named: Iterable[str]
) -> Mapping[str, float]:
    """Return the level force, N, under which each thing slides that stays where it is unless somebody names it.

    Coulomb's law: friction times weight, as both are believed; what is in it and adds to its weight is left out.

    Args:
        planning: Returns what is believed of what is seen; not asked where nothing is to stay.
        scene: What is seen.
        named: Ids of what a call is about, which may have to be touched.
    """
    # What is in a hand stands on nothing.
    about = {*named, *scene.in_hands}
    left = [item.id for item in scene.objects if item.shape.stays_put and item.id not in about]
    believed = planning(scene) if left else None
    masses = {name: believed.loose_mass(name) for name in left} if believed else {}
    return {name: max(_LEAST, FRICTION * GRAVITY * mass) for name, mass in masses.items() if mass is not None}
