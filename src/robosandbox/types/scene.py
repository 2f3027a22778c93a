"""A robot and the objects around it, and what limits the robot there."""

from __future__ import annotations

import operator
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, field_validator, model_validator

from robosandbox.spatial import Finite, StrictModel
from robosandbox.types.objects import TABLE_AREA, Area, SceneObject

# A scene's table top, metres, where it says nothing else; as in the seeds.
TABLE_HEIGHT = 0.04
# Names that mean something else, or are those of the only arm.
_BODIES = frozenset({"arm", "table", "floor", "robot", "object", "world"})
# Least height of a table that is built for a scene, metres.
_LEAST_TABLE = 0.005


class SceneArm(StrictModel):
    """One of several arms in a scene.

    Attributes:
        name: In calls and answers, and before the names of its parts, as in "left/hand".
        robot_base: Where its base stands: x, y and z, metres, and the turn about z, radians.
        robot_urdf: Its model, as a scene names one; None is the scene's, with all that is said of that.
        robot_config: The sidecar of `robot_urdf`.
    """

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)]
    robot_base: tuple[Finite, Finite, Finite, Finite]
    robot_urdf: Path | None = None
    robot_config: Path | None = None

    @model_validator(mode="after")
    def _a_sidecar_is_of_a_model(self) -> Self:
        if self.robot_config is not None and self.robot_urdf is None:
            raise ValueError("robot_config: is the sidecar of a model; give robot_urdf as well")
        return self


class Scene(StrictModel):
    """A robot and the objects around it.

    Attributes:
        robot_urdf: A .urdf or .xml path or a bundled robot's name; None is the bundled Panda.
        robot_config: The sidecar; None looks for `<stem>.robosandbox.yaml` beside the model.
        robot_arm: Which arm, where a model without a sidecar has several: the name of its last body or of a joint, or a part
            of one.
        robot_gripper: A gripper's model to mount on an arm that has none, and no sidecar.
        objects: The objects, with distinct ids.
        table_height: Height of the table top, metres.
        world: Somebody's MJCF file: its bodies with a free joint are things, the others fixtures, their hinges and slides
            parts. Beside it `<stem>.robosandbox.yaml` says what it does not.
        robot_base: Where the robot's base stands in that world: x, y and z, metres, and the turn about z, radians; None takes the
            sidecar's, or a place from which most things are in reach.
        table_area: Least and largest x, then y, of the table's top, metres; of a world's file it is measured.
        arms: Several arms, with distinct names; none where there is the one robot.
    """

    robot_urdf: Path | None = None
    robot_config: Path | None = None
    robot_arm: str | None = None
    robot_gripper: Path | None = None
    objects: tuple[SceneObject, ...] = ()
    table_height: Annotated[float, Field(ge=-1.0, le=2.0, allow_inf_nan=False)] = TABLE_HEIGHT
    world: Path | None = None
    robot_base: tuple[Finite, Finite, Finite, Finite] | None = None
    table_area: Area = TABLE_AREA
    # Scenes with one robot are written as before there were others.
    arms: Annotated[tuple[SceneArm, ...], Field(exclude_if=operator.not_)] = ()

    def for_arm(self, arm: SceneArm) -> Scene:
        """Return the scene with one of its arms as the only robot."""
        said: dict[str, object] = {"robot_base": arm.robot_base, "arms": ()}
        if arm.robot_urdf is not None:
            said |= {"robot_urdf": arm.robot_urdf, "robot_config": arm.robot_config}
            said |= {"robot_arm": None, "robot_gripper": None}
        return self.model_copy(update=said)

    @model_validator(mode="after")
    def _arms_are_several_and_told_from_things(self) -> Self:
        if self.arms and self.robot_base is not None:
            raise ValueError("robot_base: each arm has its own; leave it out")
        if len(self.arms) == 1:
            raise ValueError("arms: one arm is the scene's own robot; leave arms out, or name two")
        taken = {item.id for item in self.objects} | _BODIES
        for arm in self.arms:
            if arm.name in taken:
                raise ValueError(f"arms: {arm.name!r} is the name of something else in the scene; give the arm another")
            taken.add(arm.name)
        return self

    @model_validator(mode="after")
    def _a_table_of_our_own_has_a_height(self) -> Self:
        if self.world is None and self.table_height <= _LEAST_TABLE:
            raise ValueError(
                f"table_height: {self.table_height:g} is too low for a table; more than {_LEAST_TABLE:g} m"
            )
        if self.world is None and self.robot_base is not None:
            raise ValueError(
                "robot_base: is of scenes from files; give scene.world, or base_pose in the robot's sidecar"
            )
        return self

    @model_validator(mode="after")
    def _a_sidecar_says_arm_and_gripper(self) -> Self:
        if self.robot_config is not None and (self.robot_arm is not None or self.robot_gripper is not None):
            field = "robot_arm" if self.robot_arm is not None else "robot_gripper"
            raise ValueError(f"{field}: the sidecar that robot_config names says that; leave one of them out")
        return self

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
