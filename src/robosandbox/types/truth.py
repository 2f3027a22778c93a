"""The simulated state, for judging and for tests: what really is, not what is perceived."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robosandbox.shapes.compound import Geometry
from robosandbox.spatial import Array, Pose, Vec3
from robosandbox.types.objects import TABLE_AREA, Area, ObjectKind
from robosandbox.types.sensed import DetectedObject, the_only
from robosandbox.values import frozen


@frozen(kw_only=True)
class Convex:
    """A convex piece of what an object is made of, as it is simulated: all that lies within `radius` of the hull of points.

    Attributes:
        points: In the world, metres, shape (k, 3); of a ball its middle, of a capsule both ends, of a cylinder both rims.
        radius: Metres; 0 for what has corners.
        part: 0 for the object's first body, 1 for what slides in it.
    """

    points: Array
    radius: float = 0.0
    part: int = 0


@frozen(kw_only=True)
class Touch:
    """A contact of an object with something else.

    Attributes:
        other: "table", "floor", "robot", or an object's id.
        point: In the world, metres.
        force: What the other presses and rubs the object with, N in the world.
    """

    other: str
    point: Vec3
    force: Vec3


@frozen(kw_only=True)
class ObjectTruth:
    """One object as simulated.

    Attributes:
        id: Its scene id.
        kind: Its shape.
        size: Metres, as its shape names them; for a mesh the half-extents of its box.
        rgba: Its colour.
        pose: In the world.
        linear_velocity: m/s, shape (3,).
        angular_velocity: rad/s, shape (3,).
        contacts: What it touches: "table", "floor", "robot", object ids.
        opening: For a drawer: how far it is open, metres.
        grains: For beads: where each is; their pose is in the middle, their velocity the mean.
        felt: The most that the robot has pressed or pulled it with since the reset, N; for what `feel` was asked about.
        tag: Number of its AprilTag.
        solids: What it is made of, where it is now; beads are `grains` alone.
        touches: Its contacts that carry force; None where the world does not tell forces.
        weight: N; None where it is not known.
        mass_centre: In the world, metres; None where it is not known.
        geometry: Its convex pieces in the frame of its pose, of what a scene's file has.
    """

    id: str
    kind: ObjectKind
    size: tuple[float, ...]
    rgba: tuple[float, float, float, float]
    pose: Pose
    linear_velocity: Array
    angular_velocity: Array
    contacts: tuple[str, ...]
    opening: float | None = None
    grains: tuple[Vec3, ...] = ()
    felt: float = 0.0
    tag: int | None = None
    solids: tuple[Convex, ...] = ()
    touches: tuple[Touch, ...] | None = None
    weight: float | None = None
    mass_centre: Vec3 | None = None
    geometry: Geometry | None = None

    def detected(self) -> DetectedObject:
        """Return it as perception would, were perception perfect; the colour is left unnamed."""
        return DetectedObject(
            id=self.id,
            kind=self.kind,
            size=self.size,
            colour="",
            rgba=self.rgba,
            pose=self.pose,
            opening=self.opening,
            grains=self.grains,
            tag=self.tag,
            geometry=self.geometry,
        )


@frozen(kw_only=True)
class ArmTruth:
    """State of one arm as simulated.

    Attributes:
        q: Configuration, shape (n,).
        home_q: The robot's home, shape (n,).
    """

    q: Array
    home_q: Array


@frozen(kw_only=True)
class Truth:
    """The whole simulated state that success is judged on.

    Attributes:
        time: Simulated seconds since reset.
        arms: States of the arms by name.
        table_height: Metres.
        table_area: Least and largest x, then y, of the table's top, metres.
        objects: By id.
        hands: Objects that both sides of each hand touch, by the hand's name; None in an empty one.
    """

    time: float
    arms: Mapping[str, ArmTruth]
    table_height: float
    objects: Mapping[str, ObjectTruth]
    hands: Mapping[str, str | None]
    table_area: Area = TABLE_AREA

    @property
    def off_home(self) -> float:
        """Distance of the joint that is farthest off its home, of any arm, radians or metres."""
        return max(float(np.abs(arm.q - arm.home_q).max(initial=0.0)) for arm in self.arms.values())

    @property
    def in_hands(self) -> frozenset[str]:
        """Ids of all that is held, in whichever hand."""
        return frozenset(name for name in self.hands.values() if name is not None)

    @property
    def held(self) -> str | None:
        """Object in the only hand; None in an empty one, or without one. A ValueError where there are several hands."""
        return the_only(self.hands, "hands") if self.hands else None


@frozen
class Verdict:
    """Verdict on a task's success.

    Attributes:
        success: The answer.
        detail: The measurements at the end of the episode, or at the moment at which it ceased to hold.
    """

    success: bool
    detail: dict[str, float]
