"""A robot and the objects around it, and what limits the robot there."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, field_validator, model_validator

from robosandbox.spatial import Finite, Positive, StrictModel
from robosandbox.types.objects import SceneObject

# A scene's table top, metres, where it says nothing else; as in the seeds.
TABLE_HEIGHT = 0.04


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
