"""Sensor values: the robot's encoders, camera pictures, detected objects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from robosandbox.shapes import Shape, shape_of
from robosandbox.shapes.compound import Geometry
from robosandbox.spatial import Array, Pose, Unsent, Vec3
from robosandbox.types.objects import FIXED_KINDS, TABLE_AREA, Area, ObjectKind


@dataclass(frozen=True, slots=True, kw_only=True)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """Proprioception, and pictures when they were asked for.

    Attributes:
        time: Simulated seconds.
        q: Arm configuration, radians or metres, shape (n,).
        qd: Its rate, shape (n,).
        tcp_pose: The TCP in the world.
        gripper: The gripper's state; None for an arm without one.
        images: RGB by camera name, each (height, width, 3) uint8.
    """

    time: float
    q: Array
    qd: Array
    tcp_pose: Pose
    gripper: GripperState | None
    images: Annotated[Mapping[str, NDArray[np.uint8]], Unsent(), Field(exclude=True)] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
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


@dataclass(frozen=True, slots=True, kw_only=True)
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


@dataclass(frozen=True, slots=True, kw_only=True)
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
        q: Arm configuration at the exposure, shape (n,).
        gripper_q: All gripper joints at the exposure, shape (g,); empty for an arm without one.
    """

    camera: str
    time: float
    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    intrinsics: Intrinsics
    pose_camera_in_world: Pose
    q: Array
    gripper_q: Array


@dataclass(frozen=True, slots=True, kw_only=True)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedScene:
    """The planner's scene: what perception sees, and what the gripper holds.

    Attributes:
        time: Simulated seconds of the look.
        objects: Everything seen.
        table_height: Metres.
        table_area: Least and largest x, then y, of the table's top, metres.
        base_xy: Where the robot stands, metres; "nearest" is measured from there.
        held: Id of the object in the gripper.
        reach: Least and largest distance from `base_xy` at which the robot works, metres.
        notes: What could not be seen well and why, in sentences.
    """

    time: float
    objects: tuple[DetectedObject, ...]
    table_height: float
    base_xy: tuple[float, float]
    held: str | None = None
    reach: tuple[float, float] = (0.22, 0.80)
    notes: tuple[str, ...] = ()
    table_area: Area = TABLE_AREA

    def find(self, object_id: str) -> DetectedObject | None:
        """Return the object with this id, or None."""
        return next((item for item in self.objects if item.id == object_id), None)
