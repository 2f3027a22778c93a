"""Sensor values: the robot's encoders, camera pictures, detected objects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Annotated, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from robosandbox.shapes import Shape, shape_of
from robosandbox.shapes.compound import Geometry
from robosandbox.spatial import Array, Pose, Unsent, Vec3
from robosandbox.types.objects import FIXED_KINDS, TABLE_AREA, Area, ObjectKind
from robosandbox.types.robot import HAND
from robosandbox.values import frozen

T = TypeVar("T")


def the_only(named: Mapping[str, T], what: str) -> T:
    """Return the only value of a mapping by name.

    Args:
        named: Arms or hands, or what is told of each.
        what: What they are, for the error.

    Raises:
        ValueError: There is not exactly one; it has to be named.
    """
    if len(named) != 1:
        raise ValueError(
            f"there are {len(named)} {what} ({', '.join(named) or 'none'}): say which is meant, by its name"
        )
    (value,) = named.values()
    return value


@frozen(kw_only=True)
class GripperState:
    """The gripper as its own encoders and motor know it.

    Attributes:
        joint: The primary joint's value.
        width: Gap between the finger pads, metres.
        closed: 0 at the sidecar's open, 1 at its closed.
        force: What the actuator presses with, in its own unit (N or N m), >= 0; None where nothing measures it.
        commanded: Where the fingers were last sent, 0 open to 1 closed; None where that is not told.
        seal: Radius about a suction cup's axis that lies on something, metres; None for fingers.
    """

    joint: float
    width: float
    closed: float
    force: float | None
    commanded: float | None = None
    seal: float | None = None


@frozen(kw_only=True)
class ArmState:
    """Proprioception of one arm and of the gripper that it carries.

    Attributes:
        time: Seconds, by the driver's clock, when it was read.
        q: Configuration, radians or metres, shape (n,).
        qd: Its rate, shape (n,).
        tcp_pose: The TCP in the world.
        gripper: The gripper's state; None for an arm without one.
    """

    time: float
    q: Array
    qd: Array
    tcp_pose: Pose
    gripper: GripperState | None


@frozen(kw_only=True)
class Observation:
    """Proprioception of every arm, and pictures when they were asked for.

    What is asked of it without an arm's name is of the only arm, and a ValueError where there are several.

    Attributes:
        time: Seconds, by the driver's clock.
        arms: States of the arms by name.
        images: RGB by camera name, each (height, width, 3) uint8.
    """

    time: float
    arms: Mapping[str, ArmState]
    images: Annotated[Mapping[str, NDArray[np.uint8]], Unsent(), Field(exclude=True)] = field(default_factory=dict)

    @property
    def q(self) -> Array:
        """Configuration of the only arm, shape (n,)."""
        return the_only(self.arms, "arms").q

    @property
    def qd(self) -> Array:
        """Its rate, shape (n,)."""
        return the_only(self.arms, "arms").qd

    @property
    def tcp_pose(self) -> Pose:
        """The only arm's TCP in the world."""
        return the_only(self.arms, "arms").tcp_pose

    @property
    def gripper(self) -> GripperState | None:
        """State of the only arm's gripper; None where it carries none."""
        return the_only(self.arms, "arms").gripper


@frozen(kw_only=True)
class Intrinsics:
    """A camera's pinhole and lens: x right, y down, z along the optical axis; pixel centres at whole numbers.

    Attributes:
        width: Pixels.
        height: Pixels.
        fx: Focal length, pixels.
        fy: Focal length, pixels.
        cx: Principal point, pixels.
        cy: Principal point, pixels.
        distortion: Brown's k1, k2, p1, p2, k3, as OpenCV orders them.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)


@frozen(kw_only=True)
class PictureWindow:
    """A part of a picture, in pixels from its upper left corner; right and bottom are outside."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def rows(self) -> slice:
        """The rows of a picture that are in it."""
        return slice(self.top, self.bottom)

    @property
    def columns(self) -> slice:
        """The columns of a picture that are in it."""
        return slice(self.left, self.right)

    def widened(self, room: int, size: tuple[int, int]) -> PictureWindow:
        """Return it with so many pixels around it, within a picture of this size, (height, width)."""
        return PictureWindow(
            left=max(self.left - room, 0),
            top=max(self.top - room, 0),
            right=min(self.right + room, size[1]),
            bottom=min(self.bottom + room, size[0]),
        )


@frozen(kw_only=True)
class Posture:
    """Joints of an arm and of its gripper.

    Attributes:
        q: Arm configuration, shape (n,).
        gripper_q: All gripper joints, shape (g,); empty for an arm without one.
    """

    q: Array
    gripper_q: Array


@frozen(kw_only=True)
class RgbdFrame:
    """A colour picture with a depth for each pixel, and how robot and camera stood when it was taken.

    Of a picture of which only a part was asked for the rest is black and without depth.

    Attributes:
        camera: Its name.
        time: Simulated seconds of the exposure.
        rgb: (height, width, 3) uint8.
        depth: Metres along the optical axis, (height, width) float32; 0 where the sensor gave none.
        intrinsics: As calibrated.
        pose_camera_in_world: Of the optical frame (z forward, y down), as calibrated.
        arms: Postures of the arms at the exposure, by name.
    """

    camera: str
    time: float
    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    intrinsics: Intrinsics
    pose_camera_in_world: Pose
    arms: Mapping[str, Posture]


@frozen(kw_only=True)
class DetectedObject:
    """Object as perception sees it.

    Attributes:
        id: Stable name.
        kind: Shape.
        size: Metres, as its shape names them; for a mesh the half-extents of its box.
        colour: Its English name.
        rgba: Its colour, channels 0..1.
        pose: The object in the world.
        confidence: 0..1.
        opening: For a drawer: how far it is open, metres; for a part of a scene's file the value of its joint, metres or
            radians; None where it is not seen.
        grains: For beads: where each is, metres.
        tag: Number of the AprilTag on it; None where none was read.
        geometry: Its convex pieces, of what a scene's file has; None where kind and size say it all.
    """

    id: str
    kind: ObjectKind
    size: tuple[float, ...]
    colour: str
    rgba: tuple[float, float, float, float]
    pose: Pose
    confidence: float = 1.0
    opening: float | None = None
    grains: tuple[Vec3, ...] = ()
    tag: int | None = None
    geometry: Geometry | None = None

    def __hash__(self) -> int:
        """Return a hash of what tells objects of a scene apart: geometry is kept by object, and asked for often."""
        return hash((self.id, self.pose.xyz, self.opening))

    @property
    def shape(self) -> Shape:
        """What it is asked for: of its kind, or of its own pieces."""
        return shape_of(self.kind) if self.geometry is None else self.geometry.shape

    @property
    def is_fixed(self) -> bool:
        """True for what a scene's file fixes in its place, and for parts of that."""
        return self.kind in FIXED_KINDS


BEFORE = "before"
"""Name of the pose in which an arm stood before its last motion."""


@frozen(kw_only=True)
class ObservedScene:
    """The planner's scene: what perception sees, and what each hand holds.

    Calls are made with one hand at a time: `held` is what that holds, `in_hands` what any does.

    Attributes:
        time: Simulated seconds of the look.
        objects: Everything seen.
        table_height: Metres.
        table_area: Least and largest x, then y, of the table's top, metres.
        base_xy: Where the arm stands that calls are made with, metres; "nearest" is measured from there.
        hands: Ids of the objects in the hands, by the hand's name; None in an empty one. Without an arm's gripper there is none.
        hand: Name of the hand that calls are made with; needless where there is one.
        reach: Least and largest distance from `base_xy` at which that arm works, metres.
        grips: Whether the arm that calls are made with has a gripper to hold things with.
        notes: What could not be seen well and why, in sentences.
        arm: State of that arm and its gripper at the look, as they told it; None where they were not asked.
        is_turned: Whether it is told in the frame of a person who faces the robot, turned by half a turn about its base.
        poses: Names of the poses to which that arm can be sent, beside its home.
        tempo: Name of the tempo at which calls are made; "" where that is not told.
        unseen: Share of the table within that arm's reach that the robot has hidden from all cameras at each look so far.
    """

    time: float
    objects: tuple[DetectedObject, ...]
    table_height: float
    base_xy: tuple[float, float]
    hands: Mapping[str, str | None] = field(default_factory=dict)
    hand: str | None = None
    reach: tuple[float, float] = (0.22, 0.80)
    grips: bool = True
    notes: tuple[str, ...] = ()
    table_area: Area = TABLE_AREA
    arm: ArmState | None = field(default=None, compare=False)
    is_turned: bool = False
    poses: tuple[str, ...] = field(default=(), compare=False)
    tempo: str = field(default="", compare=False)
    unseen: float = field(default=0.0, compare=False)

    def __hash__(self) -> int:
        """Return a hash of the look and of what was seen: what is worked out of a scene is kept by it."""
        return hash((self.time, self.objects))

    def find(self, object_id: str) -> DetectedObject | None:
        """Return the object with this id, or None."""
        return next((item for item in self.objects if item.id == object_id), None)

    @property
    def held(self) -> str | None:
        """Id of what the hand holds that calls are made with; None in an empty one, or without one.

        A ValueError where there are several hands and none is named.
        """
        if self.hand is not None:
            return self.hands[self.hand]
        return the_only(self.hands, "hands") if self.hands and self.grips else None

    @property
    def in_hands(self) -> frozenset[str]:
        """Ids of all that is held, in whichever hand."""
        return frozenset(name for name in self.hands.values() if name is not None)

    def holding(self, object_id: str | None, hand: str | None = None) -> ObservedScene:
        """Return the scene with an object, or nothing, in a hand: the one named, or the one that calls are made with."""
        if hand is None:
            hand = self.hand or next(iter(self.hands), HAND)
        return replace(self, hands={**self.hands, hand: object_id})

    def letting_go(self, object_id: str) -> ObservedScene:
        """Return the scene with no hand holding an object."""
        if object_id not in self.in_hands:
            return self
        return replace(self, hands={hand: None if held == object_id else held for hand, held in self.hands.items()})
