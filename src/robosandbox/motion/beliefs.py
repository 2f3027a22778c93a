"""Scene of believed objects that can be compiled: seen poses and sizes, and what a task says beside them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from robosandbox.ranges import LEAST_MASS, MOST_MASS
from robosandbox.shapes.beads import stacked
from robosandbox.sim.objects.weight import DEFAULT_DENSITY, weighed
from robosandbox.sim.scene_file import read_scene_file
from robosandbox.types import DetectedObject, Pose, Scene, SceneObject
from robosandbox.values import frozen

# The smallest half size that a body is compiled with, metres; chosen below what a depth camera resolves.
_LEAST_SIZE = 0.001


@frozen(kw_only=True)
class DeclaredProperties:
    """Properties that a task tells of one of its objects and no camera shows; no place.

    Attributes:
        mass: Kilograms; None where the task gives none.
        mesh: The file of a mesh; None for other kinds.
        scale: Metres per unit of the file.
        density: Of a mesh, kg/m^3; None where the task gives none.
        collision: What of a mesh collides.
    """

    mass: float | None = None
    mesh: Path | None = None
    scale: float = 1.0
    density: float | None = None
    collision: Literal["hull", "coacd"] = "hull"

    @classmethod
    def of(cls, item: SceneObject, *, exactly: bool = False) -> DeclaredProperties:
        """Return what a scene says of an object; its mass only where somebody wrote it down, or where all is known `exactly`."""
        mass = item.mass if exactly or "mass" in item.model_fields_set else None
        return cls(mass=mass, mesh=item.mesh, scale=item.scale, density=item.density, collision=item.collision)


def believed_scene(frame: Scene, seen: Iterable[DetectedObject], known: Mapping[str, DeclaredProperties]) -> Scene:
    """Return a scene of what is seen.

    Args:
        frame: Names the robot and the table; its objects are not read.
        seen: The objects as they are believed to be.
        known: What is known of them beside that, by id.
    """
    items = tuple(seen)
    fixed = [] if frame.world is None else [item for item in read_scene_file(frame.world).objects if item.is_fixed]
    loose = [item for item in items if not item.is_fixed]
    objects = [*fixed]
    objects += [
        _as_object(item, known.get(item.id, DeclaredProperties())) for item in loose if not item.shape.is_granular
    ]
    for item in loose:
        if item.shape.is_granular and (vessel := _vessel(item, items)) is not None:
            mass = known.get(item.id, DeclaredProperties()).mass
            objects.append(_grains(item, vessel, mass))
    return weighed(frame.model_copy(update={"objects": tuple(objects)}))


def _as_object(item: DetectedObject, known: DeclaredProperties) -> SceneObject:
    told: dict[str, Any] = {"id": item.id, "kind": item.kind, "pose": _plain(item.pose), "rgba": item.rgba}
    if not item.shape.size_fields and known.mesh is not None:
        told.update(mesh=known.mesh, scale=known.scale, density=known.density, collision=known.collision)
        return SceneObject(**told) if known.mass is None else SceneObject(**told, mass=known.mass)
    size = tuple(max(measure, _LEAST_SIZE) for measure in item.size)
    told.update(geometry=item.geometry)
    told.update(size=size, open=float(np.clip(item.opening or 0.0, 0.0, size[-1])) if item.shape.opens else 0.0)
    if not item.shape.size_fields:
        # Where a mesh was only seen, no file of it is known.
        told["kind"] = "box"
    made = SceneObject(**told)
    return made.model_copy(update={"mass": known.mass or _mass(made)})


def _mass(item: SceneObject) -> float:
    """Return what an object weighs that is of the density of plastic throughout, kg."""
    volume = sum(piece.hull.volume for body in item.shape.bodies(item) for piece in body.pieces)
    return float(np.clip(DEFAULT_DENSITY * volume, LEAST_MASS, MOST_MASS))


def _plain(pose: Pose) -> Pose:
    return Pose(xyz=pose.xyz, quat_xyzw=pose.quat_xyzw)


def _vessel(item: DetectedObject, among: Iterable[DetectedObject]) -> DetectedObject | None:
    """Return the open container nearest to the middle of the grains that has room for all of them."""
    able = []
    for other in among:
        room = other.shape.room(other.size) if other.shape.is_open_container else None
        if room is not None and len(stacked(item.size[0], len(item.grains), room)) >= len(item.grains):
            able.append((float(np.linalg.norm(other.pose.position - item.pose.position)), other))
    return min(able, key=lambda pair: pair[0])[1] if able and item.grains else None


def _grains(item: DetectedObject, vessel: DetectedObject, mass: float | None) -> SceneObject:
    made = SceneObject(
        id=item.id,
        kind=item.kind,
        size=item.size,
        pose=_plain(vessel.pose),
        rgba=item.rgba,
        count=len(item.grains),
        inside=vessel.id,
    )
    return made.model_copy(update={"mass": mass or _mass(made)})
