"""What a robot can do, as far as relations ask for it: where there is no robot to ask, nothing is denied."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from robosandbox.types import DetectedObject, ObservedScene, Workspace

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


class Abilities:
    """What is known of a robot from the scene alone.

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

    def out_of_reach(self, point: Sequence[float], scene: ObservedScene) -> str | None:
        """Return why the hand cannot work at a point (3,) of the world, metres; None where it can, or that is not known."""
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
        self._known: dict[tuple[object, ...], str | None] = {}

    @contextmanager
    def asking(self) -> Iterator[None]:
        """Ask the robot itself about what is not known yet, within this context."""
        self._is_asking = True
        try:
            yield
        finally:
            self._is_asking = False

    def out_of_reach(self, point: Sequence[float], scene: ObservedScene) -> str | None:
        """Return why the hand cannot work at a point (3,) of the world, metres; None where it can, or that is not known."""
        cheap = super().out_of_reach(point, scene)
        key = tuple(round(float(value), _DIGITS) for value in point)
        return cheap or self._answer(key, lambda: self._robot.out_of_reach(point, scene))

    def ungraspable(self, item: DetectedObject, scene: ObservedScene) -> str | None:
        """Return why the gripper cannot take hold of an object as it lies; None where it can, or that is not known."""
        key = (item.id, *(round(value, _DIGITS) for value in (*item.pose.xyz, *item.pose.quat_xyzw)))
        return self._answer(key, lambda: self._robot.ungraspable(item, scene))

    def off_home(self) -> float | None:
        """Return how far the arm's joints are off their home, radians or metres; None where that is not known."""
        return self._robot.off_home()

    def _answer(self, key: tuple[object, ...], ask: Callable[[], str | None]) -> str | None:
        if self._is_asking and key not in self._known:
            self._known[key] = ask()
            self.denied += self._known[key] is not None
        return self._known.get(key)
