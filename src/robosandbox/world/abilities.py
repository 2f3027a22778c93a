"""Abilities of a robot that relations ask for: reach, grasps, force. Without a robot to ask nothing is denied."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

from robosandbox.types import DetectedObject, ObservedScene, Workspace
from robosandbox.values import frozen
from robosandbox.world.placement_sampling import Placement

# An object farther away than this many times the distance at which the robot works easily is out of reach whatever its
# height; between the two its kinematics decide. Chosen above 1.16, what the bundled arm has at most (0.93 m of 0.80);
# doubled, more objects are left to the kinematics and none is refused otherwise.
_FAR_OUT = 1.6
# An object nearer than this share of the least distance at which the robot works is at its foot: a tenth is left for how
# coarsely that distance is measured.
_FOOT = 0.9
# Digits behind the point of metres to which places are told apart; chosen as a tenth of a millimetre, far below what
# arms repeat.
_DIGITS = 4

_Found = TypeVar("_Found")


@frozen(kw_only=True)
class Obstruction:
    """Obstacle that keeps the hand from where it has to be.

    Attributes:
        cause: In a clause.
        met: Id of the object that it would touch there; None where it is out of reach.
    """

    cause: str
    met: str | None = None


class Abilities:
    """Abilities of a robot as the scene alone tells them.

    Attributes:
        gripper: Whether it can hold things.
        apertures: Least and most gap between its fingers, metres.
        aperture: The gap between them now, metres.
        cup: Diameter of its suction cup, metres; None for fingers.
        workspaces: Where its tool centre point may be, each a limit of its own.
        max_force: With which it may press on anything, N.
    """

    gripper: bool = True
    apertures: tuple[float, float] = (0.0, math.inf)
    aperture: float = 0.0
    cup: float | None = None
    workspaces: Sequence[Workspace] = ()
    max_force: float = math.inf

    @classmethod
    def of(cls, scene: ObservedScene) -> Abilities:
        """Return the abilities that a scene tells of."""
        robot = Abilities()
        robot.gripper = scene.grips
        return robot

    def out_of_reach(
        self, point: Sequence[float], scene: ObservedScene, carried: DetectedObject | None = None
    ) -> str | None:
        """Return why the hand cannot work at a point (3,) of the world, metres; None where it can, or that is not known.

        Args:
            point: Where.
            scene: What is around.
            carried: What it brings there, in the hand or where it is to be taken from; None for nothing.
        """
        del carried
        distance = math.dist(point[:2], scene.base_xy)
        far = scene.reach[1]
        if distance > _FAR_OUT * far:
            return f"it is {distance:.2f} m from the robot, which works up to {far:.2f} m away"
        if distance < _FOOT * scene.reach[0]:
            return f"it is {distance:.2f} m from the middle of the robot, where its own foot is"
        return None

    def ungraspable(self, item: DetectedObject, scene: ObservedScene) -> str | None:
        """Return why the gripper cannot take hold of an object as it lies; None where it can, or that is not known."""
        del item, scene
        return None

    def unpushable(
        self, item: DetectedObject, axis: Sequence[float], distance: float, scene: ObservedScene
    ) -> Obstruction | None:
        """Return what keeps the hand from pushing an object along a level unit vector (3,); None where that is not known."""
        del item, axis, distance, scene
        return None

    def unpushable_to(self, item: DetectedObject, point: Sequence[float], scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from pushing an object to a point (2,) of the table; None where that is not known."""
        del item, point, scene
        return None

    def unopenable(self, drawer: DetectedObject, scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from pulling a drawer open at its grip; None where that is not known."""
        del drawer, scene
        return None

    def untakeable(self, item: DetectedObject, scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from taking an object where it is; None where that is not known."""
        del item, scene
        return None

    def unplaceable(
        self, item: DetectedObject, spots: Sequence[Placement], allowed: Sequence[str], scene: ObservedScene
    ) -> Obstruction | None:
        """Return what keeps the hand from putting an object down on each of some spots; None where that is not known.

        Args:
            item: What is in the hand then.
            spots: Where it may go.
            allowed: What it or the hand may touch there: what it is to stand on.
            scene: What is around.
        """
        del item, spots, allowed, scene
        return None

    def off_home(self) -> float | None:
        """Return how far the arm's joints are off their home, radians or metres; None where that is not known."""
        return None


class LateAbilities(Abilities):
    """A robot that is asked late: what it denied before is known, the rest is told from the scene alone but while `asking`.

    Args:
        robot: Whose kinematics and grasps are asked.

    Attributes:
        denied: How often it has said no.
    """

    def __init__(self, robot: Abilities) -> None:
        self.gripper, self.apertures, self.aperture = robot.gripper, robot.apertures, robot.aperture
        self.workspaces, self.max_force, self.cup = robot.workspaces, robot.max_force, robot.cup
        self.denied: int = 0
        self._robot = robot
        self._is_asking = False
        self._reasons: dict[tuple[object, ...], str | None] = {}
        self._obstructions: dict[tuple[object, ...], Obstruction | None] = {}

    @contextmanager
    def asking(self) -> Iterator[None]:
        """Ask the robot itself about what is not known yet, within this context."""
        self._is_asking = True
        try:
            yield
        finally:
            self._is_asking = False

    def out_of_reach(
        self, point: Sequence[float], scene: ObservedScene, carried: DetectedObject | None = None
    ) -> str | None:
        """Return why the hand cannot work at a point (3,) of the world, metres; None where it can, or that is not known."""
        cheap = super().out_of_reach(point, scene)
        key = ("reach", *_rounded(point), *(() if carried is None else _placed(carried)))
        return cheap or self._answer(self._reasons, key, lambda: self._robot.out_of_reach(point, scene, carried))

    def ungraspable(self, item: DetectedObject, scene: ObservedScene) -> str | None:
        """Return why the gripper cannot take hold of an object as it lies; None where it can, or that is not known."""
        return self._answer(self._reasons, ("grasp", *_placed(item)), lambda: self._robot.ungraspable(item, scene))

    def unpushable(
        self, item: DetectedObject, axis: Sequence[float], distance: float, scene: ObservedScene
    ) -> Obstruction | None:
        """Return what keeps the hand from pushing an object along a level unit vector (3,); None where that is not known."""
        key = ("push", item.id, *_rounded(axis), distance, *_arranged(scene))
        return self._answer(self._obstructions, key, lambda: self._robot.unpushable(item, axis, distance, scene))

    def unpushable_to(self, item: DetectedObject, point: Sequence[float], scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from pushing an object to a point (2,) of the table; None where that is not known."""
        key = ("push to", item.id, *_rounded(point), *_arranged(scene))
        return self._answer(self._obstructions, key, lambda: self._robot.unpushable_to(item, point, scene))

    def unopenable(self, drawer: DetectedObject, scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from pulling a drawer open at its grip; None where that is not known."""
        key = ("open", drawer.id, *_arranged(scene))
        return self._answer(self._obstructions, key, lambda: self._robot.unopenable(drawer, scene))

    def untakeable(self, item: DetectedObject, scene: ObservedScene) -> Obstruction | None:
        """Return what keeps the hand from taking an object where it is; None where that is not known."""
        key = ("take", item.id, *_arranged(scene))
        return self._answer(self._obstructions, key, lambda: self._robot.untakeable(item, scene))

    def unplaceable(
        self, item: DetectedObject, spots: Sequence[Placement], allowed: Sequence[str], scene: ObservedScene
    ) -> Obstruction | None:
        """Return what keeps the hand from putting an object down on each of some spots; None where that is not known."""
        key = ("put", item.id, *spots, *_arranged(scene))
        return self._answer(self._obstructions, key, lambda: self._robot.unplaceable(item, spots, allowed, scene))

    def off_home(self) -> float | None:
        """Return how far the arm's joints are off their home, radians or metres; None where that is not known."""
        return self._robot.off_home()

    def _answer(
        self, known: dict[tuple[object, ...], _Found | None], key: tuple[object, ...], ask: Callable[[], _Found | None]
    ) -> _Found | None:
        if self._is_asking and key not in known:
            known[key] = ask()
            self.denied += known[key] is not None
        return known.get(key)


def _rounded(values: Sequence[float]) -> tuple[float, ...]:
    return tuple(round(float(value), _DIGITS) for value in values)


def _placed(item: DetectedObject) -> tuple[object, ...]:
    return (item.id, *_rounded((*item.pose.xyz, *item.pose.quat_xyzw)))


def _arranged(scene: ObservedScene) -> tuple[object, ...]:
    """Return where all objects are and how far drawers are open, to know a scene again."""
    return tuple((*_placed(item), round(item.opening or 0.0, _DIGITS)) for item in scene.objects)
