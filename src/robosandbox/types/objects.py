"""One object of a scene, as people write it: its kind, size and place, and how far a seed may move it."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, GetJsonSchemaHandler, field_validator, model_validator
from pydantic_core import CoreSchema, PydanticCustomError

from robosandbox.ranges import MOST_DISTANCE, Coordinate, Density, Length, Mass, Scale, Spread, Turn, within
from robosandbox.shapes import Shape, shape_of, shapes
from robosandbox.shapes.compound import FILE_KINDS, Geometry
from robosandbox.spatial import Finite, Fraction, NonNegative, Pose, StrictModel
from robosandbox.tags import BORDERED, TAG_COUNT, usual_tag_size


def _installed(kind: str) -> str:
    if kind not in shapes() and kind not in FILE_KINDS:
        expected = ", ".join(repr(name) for name in shapes())
        raise PydanticCustomError("enum", "is no kind of object", {"expected": expected})
    return kind


class _KindSchema:
    """Lists the installed kinds in JSON schemas, when one is asked for."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {**handler(schema), "enum": list(shapes())}


# A kind of object that is installed under `robosandbox.shapes`; the shape's file says what its numbers and pose mean.
ObjectKind = Annotated[str, AfterValidator(_installed), _KindSchema()]

# Beads of one object; chosen because their contacts slow every tick (workcell/zenoh/server/loader.py has figures).
MAX_BEADS = 100

# Least and largest x, then y, metres: of the table's top where a scene says nothing else, as in the seeds.
Area = tuple[tuple[Finite, Finite], tuple[Finite, Finite]]
TABLE_AREA: Area = ((-0.5, 0.5), (-0.5, 0.5))

# Kinds of what a scene's file fixes in its place.
FIXED_KINDS = frozenset({"fixture", "cupboard", "compartment", "part"})

IDENTIFIER = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}")


class Randomize(StrictModel):
    """Ranges by which a seed may move what the scene says; half-ranges, drawn uniformly.

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


# Width, depth and height of a cabinet; as in the seeds how far its drawer opens may be given beside them.
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
        geometry: Of what the scene's own file has: its pieces. Reading the file gives it.
        body: Likewise: what the file calls its body.
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
    geometry: Geometry | None = None
    body: str | None = None

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
        if (self.kind in FILE_KINDS) != (self.geometry is not None):
            raise ValueError(f"kind: a {self.kind} comes from the file that scene.world names, with its geometry")
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
        """What it is asked for: of its kind, or of its own pieces."""
        return shape_of(self.kind) if self.geometry is None else self.geometry.shape

    @property
    def is_fixed(self) -> bool:
        """True for what the scene's file fixes in its place, and for parts of that."""
        return self.kind in FIXED_KINDS

    @property
    def tag_edge(self) -> float:
        """Edge of its tag's black square, metres; 0 where it has no face for one."""
        if self.tag_size is not None:
            return self.tag_size
        face = self.shape.tag_face(self.size)
        return usual_tag_size(face[0]) if face else 0.0
