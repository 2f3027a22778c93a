"""The values that all parts share: poses, scenes, observations, trajectories, grasps, plans, episodes.

What enters the process (scenes, tasks, skill arguments) is a strict, frozen pydantic model; what stays
inside is a frozen dataclass with read-only arrays. SI units and radians; poses are in the world frame
unless their name says otherwise.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, GetJsonSchemaHandler, field_validator, model_validator
from pydantic_core import CoreSchema, PydanticCustomError

from robosandbox.ranges import MOST_DISTANCE, Coordinate, Density, Length, Mass, Scale, Spread, Turn, within
from robosandbox.shapes import Shape, shape_of, shapes
from robosandbox.spatial import (
    DIRECTION_AXES as DIRECTION_AXES,
    SIDE_AXES as SIDE_AXES,
    Array as Array,
    Direction as Direction,
    Finite as Finite,
    Fraction as Fraction,
    NonNegative as NonNegative,
    Pose as Pose,
    Positive as Positive,
    QuatXyzw as QuatXyzw,
    Side as Side,
    StrictModel as StrictModel,
    Vec3 as Vec3,
    frozen_array as frozen_array,
    matrix_about_axis as matrix_about_axis,
    matrix_from_quat_xyzw as matrix_from_quat_xyzw,
    matrix_from_rotation_vector as matrix_from_rotation_vector,
    quat_xyzw_from_matrix as quat_xyzw_from_matrix,
)
from robosandbox.tags import BORDERED, TAG_COUNT, usual_tag_size

# Scenes.


def _installed(kind: str) -> str:
    if kind not in shapes():
        expected = ", ".join(repr(name) for name in shapes())
        raise PydanticCustomError("enum", "is no kind of object", {"expected": expected})
    return kind


class _KindSchema:
    """Lists the installed kinds in JSON schemas, when one is asked for."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {**handler(schema), "enum": list(shapes())}


# A kind of object that is installed under `robosandbox.shapes`; the shape's file says what its numbers and pose mean.
ObjectKind = Annotated[str, AfterValidator(_installed), _KindSchema()]

MAX_BEADS = 100

# A scene's table top, metres, where it says nothing else.
TABLE_HEIGHT = 0.04
MAX_PROMPT_LENGTH = 4000

IDENTIFIER = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}")


class Randomize(StrictModel):
    """How far a seed may move what the scene says; half-ranges, drawn uniformly.

    Attributes:
        xy_jitter: Metres along world x and y.
        yaw_jitter: Radians about world z.
        size_jitter: Fraction of every size.
        mass_jitter: Fraction of the mass.
        rgba_jitter: Of each colour channel.
        q_jitter: Radians on every arm joint's start; for a task, not for an object.
        area: Least and largest x, then y, between which objects are drawn in place of around where they are written.
        moves_with: Id of the object that it keeps its place to; for an object, not for a task.
        omit: How many of the objects that success does not name may be left out; for a task, not for an object.
    """

    xy_jitter: Spread = 0.0
    yaw_jitter: Annotated[float, Field(ge=0.0, le=math.pi)] = 0.0
    size_jitter: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    mass_jitter: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    rgba_jitter: Fraction = 0.0
    q_jitter: Turn = 0.0
    area: tuple[tuple[Coordinate, Coordinate], tuple[Coordinate, Coordinate]] | None = None
    moves_with: str | None = None
    omit: Annotated[int, Field(ge=0)] = 0

    @field_validator("area")
    @classmethod
    def _area_is_in_order(
        cls, area: tuple[tuple[float, float], tuple[float, float]] | None
    ) -> tuple[tuple[float, float], tuple[float, float]] | None:
        for low, high in area or ():
            if not low < high:
                raise ValueError(f"[{low:g}, {high:g}] is empty; give [[x least, x most], [y least, y most]]")
        return area


def _in_the_hall(pose: Pose) -> Pose:
    check = within(-MOST_DISTANCE, MOST_DISTANCE, "m")
    for index, value in enumerate(pose.xyz):
        try:
            check(value)
        except ValueError as error:
            raise ValueError(f"xyz[{index}]: {error}") from None
    return pose


# Width, depth and height of a cabinet; how far its drawer opens may be given beside them.
_CABINET_MEASURES = 3


class SceneObject(StrictModel):
    """One object of a scene.

    Attributes:
        id: Its name in prompts and results.
        kind: What it is made of.
        size: Metres; what each number is, its shape says.
        pose: Where it starts; it settles under gravity from there.
        rgba: Colour, each channel 0..1.
        mass: Kilograms.
        mesh: For `mesh`: the OBJ or STL file.
        scale: For `mesh`: metres per file unit.
        density: For `mesh`: kg/m^3, which gives its mass where `mass` is left out; None is that of water.
        collision: For `mesh`: one convex hull, or a convex decomposition.
        open: For `drawer`: how far it is open at the start, metres.
        locked: For `drawer`: it stays as it is, however one pulls.
        count: For `beads`: how many.
        inside: For `beads`: id of the container that they start in; it takes the place of a pose. Their mass is that of
            all of them.
        tag: Number of the AprilTag, family 36h11, on its face at the end of local z; no two objects have the same.
        tag_size: Edge of the tag's black square, metres; None leaves a rim of the face around its white border.
        randomize: Overrides the task's for this object.
    """

    id: str
    kind: ObjectKind
    size: tuple[Length, ...] = ()
    pose: Annotated[Pose, AfterValidator(_in_the_hall)]
    rgba: tuple[Fraction, Fraction, Fraction, Fraction] = (0.7, 0.7, 0.7, 1.0)
    mass: Mass = 0.05
    mesh: Path | None = None
    scale: Scale = 1.0
    density: Density | None = None
    collision: Literal["hull", "coacd"] = "hull"
    open: NonNegative = 0.0
    locked: bool = False
    count: Annotated[int, Field(ge=0, le=MAX_BEADS)] = 0
    inside: str | None = None
    tag: Annotated[int, Field(ge=0, lt=TAG_COUNT)] | None = None
    tag_size: Length | None = None
    randomize: Randomize | None = None

    @model_validator(mode="before")
    @classmethod
    def _beads_are_where_their_container_is(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("inside") is not None and "pose" not in data:
            # The scene puts them into the container.
            return {**data, "pose": Pose(xyz=(0.0, 0.0, 0.0))}
        return data

    @model_validator(mode="before")
    @classmethod
    def _drawer_max_open_is_the_last_size(cls, data: Any) -> Any:
        if not isinstance(data, dict) or data.get("kind") != "drawer" or "drawer_max_open" not in data:
            return data
        size = data.get("size")
        if not isinstance(size, list | tuple) or len(size) != _CABINET_MEASURES:
            raise ValueError(
                "drawer_max_open: stands for max_open in size [width, depth, height, max_open]; give three numbers and "
                "drawer_max_open, or four numbers"
            )
        rest = {name: value for name, value in data.items() if name != "drawer_max_open"}
        return {**rest, "size": [*size, data["drawer_max_open"]]}

    @field_validator("id")
    @classmethod
    def _id_is_plain(cls, value: str) -> str:
        if not IDENTIFIER.fullmatch(value):
            raise ValueError(f"{value!r} is not an id: use up to 64 letters, digits, '_', '-' or '.'")
        return value

    @model_validator(mode="after")
    def _size_fits_kind(self) -> Self:
        shape = self.shape
        takes = f"{shape.name} {'take' if shape.is_plural else 'takes'}"
        names = shape.size_fields
        if len(self.size) != len(names):
            wanted = f"[{', '.join(names)}]" if names else "no size (its file and scale give it)"
            raise ValueError(f"size: {takes} {wanted}, got {len(self.size)} numbers")
        wants_file = "mesh" in shape.options
        if wants_file != (self.mesh is not None):
            raise ValueError(f"mesh: {takes} {'a file' if wants_file else 'no mesh file'}")
        if self.density is not None and not wants_file:
            raise ValueError(f"density: {takes} none; give its mass")
        if names:
            shape.check(self.size)
        return self

    @model_validator(mode="after")
    def _options_fit_kind(self) -> Self:
        shape = self.shape
        takes = f"{shape.name} {'take' if shape.is_plural else 'takes'}"
        if not shape.opens and (self.open or self.locked):
            raise ValueError(f"{'open' if self.open else 'locked'}: {shape.name} is no drawer; leave it out")
        if shape.opens and self.open > shape.max_open(self.size):
            raise ValueError(f"open: {self.open:g} is more than the drawer's max_open, {shape.max_open(self.size):g}")
        if shape.is_granular != bool(self.count) or shape.is_granular != (self.inside is not None):
            many = "a count of 1 or more, and inside, the id of a container"
            raise ValueError(f"count: {takes} {many if shape.is_granular else 'no count and no inside'}")
        return self

    @model_validator(mode="after")
    def _tag_fits_its_face(self) -> Self:
        if self.tag is None:
            if self.tag_size is not None:
                raise ValueError("tag_size: there is no tag; give its number as tag, or leave tag_size out")
            return self
        face = self.shape.tag_face(self.size)
        if face is None:
            kinds = " or ".join(kind for kind, shape in shapes().items() if "tag" in shape.options)
            has = f"{self.shape.name} {'have' if self.shape.is_plural else 'has'}"
            raise ValueError(f"tag: {has} no flat face upward; give it to a {kinds}")
        edge = face[0]
        if self.tag_size is not None and BORDERED * self.tag_size > edge:
            raise ValueError(
                f"tag_size: {self.tag_size:g} and a white border take {BORDERED * self.tag_size:g} m of a face of {edge:g} m; "
                f"at most {edge / BORDERED:g}"
            )
        return self

    @property
    def shape(self) -> Shape:
        """What its kind answers for."""
        return shape_of(self.kind)

    @property
    def tag_edge(self) -> float:
        """Edge of its tag's black square, metres; 0 where it has no face for one."""
        if self.tag_size is not None:
            return self.tag_size
        face = self.shape.tag_face(self.size)
        return usual_tag_size(face[0]) if face else 0.0


class Scene(StrictModel):
    """A robot and the objects around it.

    Attributes:
        robot_urdf: A .urdf or .xml path or a bundled robot's name; None is the bundled Panda.
        robot_config: The sidecar; None looks for `<stem>.robosandbox.yaml` beside the model.
        objects: The objects, with distinct ids.
        table_height: Height of the table top, metres.
    """

    robot_urdf: Path | None = None
    robot_config: Path | None = None
    objects: tuple[SceneObject, ...] = ()
    table_height: Annotated[float, Field(gt=0.005, le=2.0, allow_inf_nan=False)] = TABLE_HEIGHT

    @field_validator("objects")
    @classmethod
    def _ids_are_distinct(cls, objects: tuple[SceneObject, ...]) -> tuple[SceneObject, ...]:
        seen: set[str] = set()
        for item in objects:
            if item.id in seen:
                raise ValueError(f"two objects have the id {item.id!r}; ids must be distinct")
            seen.add(item.id)
        return objects

    @field_validator("objects")
    @classmethod
    def _tags_are_distinct(cls, objects: tuple[SceneObject, ...]) -> tuple[SceneObject, ...]:
        owners: dict[int, str] = {}
        for item in objects:
            if item.tag is not None and (other := owners.setdefault(item.tag, item.id)) != item.id:
                raise ValueError(
                    f"{item.id}.tag: {item.tag} is on {other!r} already; give each object a number of its own"
                )
        return objects

    @field_validator("objects")
    @classmethod
    def _beads_start_in_a_container(cls, objects: tuple[SceneObject, ...]) -> tuple[SceneObject, ...]:
        vessels = {item.id: item for item in objects if item.shape.is_open_container}
        filled: set[str | None] = set()
        placed = []
        for item in objects:
            if item.inside is not None:
                vessel = vessels.get(item.inside or "")
                if vessel is None or item.inside in filled:
                    raise ValueError(
                        f"{item.id}.inside: {item.inside!r} is no bin, bowl or cup of this scene, or has beads already; "
                        f"there is {', '.join(vessels) or 'none'}"
                    )
                filled.add(item.inside)
                item = item.model_copy(update={"pose": vessel.pose})
            placed.append(item)
        return tuple(placed)


class Workspace(StrictModel):
    """Where the arm may work, world frame, metres; an axis that is left out is free.

    Attributes:
        x: Least and most.
        y: Least and most.
        z: Least and most, for the tool centre point alone.
    """

    x: tuple[Finite, Finite] | None = None
    y: tuple[Finite, Finite] | None = None
    z: tuple[Finite, Finite] | None = None

    @model_validator(mode="after")
    def _bounds_are_in_order(self) -> Self:
        for axis in ("x", "y", "z"):
            bounds = getattr(self, axis)
            if bounds is not None and not bounds[0] < bounds[1]:
                raise ValueError(f"{axis}: {list(bounds)} is empty; give [least, most]")
        return self


class Limits(StrictModel):
    """What no planner can pass; at least one of them.

    Attributes:
        workspace: Where the arm may work.
        max_force: With which the robot may press on anything, its grip included, N.
    """

    workspace: Workspace | None = None
    max_force: Positive | None = None

    @model_validator(mode="after")
    def _limits_something(self) -> Self:
        if self.workspace is None and self.max_force is None:
            raise ValueError("limits nothing; give workspace or max_force, or leave it out")
        return self


# What is sensed.


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperState:
    """The gripper as its own encoders and motor know it.

    Attributes:
        joint: The primary joint's value.
        width: Gap between the finger pads, metres.
        closed: 0 at the sidecar's open, 1 at its closed.
        force: What the actuator presses with, in its own unit (N or N m), >= 0; None where nothing measures it.
        commanded: Where the fingers were last sent, 0 open to 1 closed; None where that is not told.
    """

    joint: float
    width: float
    closed: float
    force: float | None
    commanded: float | None = None


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
    images: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)


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
class RgbdFrame:
    """A colour picture with a depth for each pixel, and how robot and camera stood when it was taken.

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
    """What perception says of one object.

    Attributes:
        id: Stable name.
        kind: Shape.
        size: Metres, as its shape names them; for a mesh the half-extents of its box.
        colour: Its English name.
        rgba: Its colour, channels 0..1.
        pose: The object in the world.
        confidence: 0..1.
        opening: For a drawer: how far it is open, metres; None where it is not seen.
        grains: For beads: where each is, metres.
        tag: Number of the AprilTag on it; None where none was read.
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

    @property
    def shape(self) -> Shape:
        """What its kind answers for."""
        return shape_of(self.kind)


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedScene:
    """The planner's scene: what perception sees, and what the gripper holds.

    Attributes:
        time: Simulated seconds of the look.
        objects: Everything seen.
        table_height: Metres.
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

    def find(self, object_id: str) -> DetectedObject | None:
        """Return the object with this id, or None."""
        return next((item for item in self.objects if item.id == object_id), None)


# Motion and grasps.


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Configurations at equal steps of time.

    Attributes:
        q: Shape (t, n); the first row is the start.
        dt: Seconds between rows.
    """

    q: Array
    dt: float

    @property
    def duration(self) -> float:
        """Seconds from the first to the last row."""
        return (len(self.q) - 1) * self.dt


@dataclass(frozen=True, slots=True, kw_only=True)
class Grasp:
    """A way to hold an object: where the TCP is when the fingers close.

    The TCP frame has z along the approach and y along the closing direction.

    Attributes:
        object: Id.
        tcp_pose: The TCP in the world at closure.
        width: Extent of the object between the fingers, metres.
        quality: Higher is better; for ranking only.
        how: Its kind, in a word: "top-down", "shallow", "angled", "side", "rim".
    """

    object: str
    tcp_pose: Pose
    width: float
    quality: float
    how: str = "top-down"


@dataclass(frozen=True, slots=True, kw_only=True)
class GraspSearch:
    """The ways to hold an object that a skill has weighed.

    Attributes:
        candidates: In the order in which they were tried.
        chosen: Index of the one that is to be carried out; None when none of them can be.
    """

    candidates: tuple[Grasp, ...]
    chosen: int | None


# What a skill is about to do, for those who watch: a path for the arm, or how it wants to hold something.
Intent = Trajectory | GraspSearch

# Plans and episodes.


class SkillCall(StrictModel):
    """A call of a skill.

    Attributes:
        skill: Its name.
        arguments: As its schema says.
    """

    skill: str
    arguments: dict[str, Any] = Field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.skill}({', '.join(f'{k}={v}' for k, v in self.arguments.items())})"


class Plan(StrictModel):
    """Skill calls in the order in which they run."""

    steps: tuple[SkillCall, ...]


class RefusalCode(StrEnum):
    """Why a planner will not plan."""

    OBJECT_NOT_FOUND = "object_not_found"
    AMBIGUOUS = "ambiguous"
    UNSUPPORTED = "unsupported"
    UNRECOGNIZED = "unrecognized"
    IMPOSSIBLE = "impossible"


class Refusal(StrictModel):
    """A planner's no.

    Attributes:
        code: Its kind.
        message: A sentence for the person.
        candidates: What could have been meant: object ids or verbs.
        sure: Whether the planner understood all that was said, so that asking another one cannot help.
    """

    code: RefusalCode
    message: str
    candidates: tuple[str, ...] = ()
    sure: bool = True


class SkillResult(StrictModel):
    """A skill's checked outcome.

    Attributes:
        skill: Its name.
        detail: The measured post-condition.
        side_effects: What else changed, in sentences.
    """

    skill: str
    detail: dict[str, float | str | bool] = Field(default_factory=dict)
    side_effects: tuple[str, ...] = ()
