"""What `<stem>.robosandbox.yaml` beside a scene's file says: what the file does not."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from robosandbox.shapes.compound import FileKind
from robosandbox.spatial import Finite, Fraction, StrictModel
from robosandbox.validation import load_yaml_model

SIDECAR_SUFFIX = ".robosandbox.yaml"


class ObjectNotes(StrictModel):
    """What is said of one body of the file.

    Attributes:
        id: What it is called in prompts and results; the body's name where left out.
        kind: Which kind it is, where its geometry misleads.
        rgba: Its colour, each channel 0..1.
    """

    id: str | None = None
    kind: FileKind | None = None
    rgba: tuple[Fraction, Fraction, Fraction, Fraction] | None = None


class SceneSidecar(StrictModel):
    """What a scene's file does not say; all of it may be left out.

    Attributes:
        robot_base: Where the robot's base stands: x, y and z, metres, and the turn about z, radians.
        table: The body that "the table" is.
        leave_out: Bodies that are not in the scene, with all that hangs on them.
        keyframe: The keyframe with which it starts; as the bodies stand in the file where left out.
        objects: What is said of single bodies, by their names in the file.
    """

    robot_base: tuple[Finite, Finite, Finite, Finite] | None = None
    table: str | None = None
    leave_out: tuple[str, ...] = ()
    keyframe: str | None = None
    objects: dict[str, ObjectNotes] = Field(default_factory=dict)


def sidecar_path(world: Path) -> Path:
    """Return where a scene file's sidecar is looked for."""
    return world.with_name(world.stem + SIDECAR_SUFFIX)


def scene_sidecar(world: Path) -> SceneSidecar:
    """Return what the file beside a scene says; nothing where there is none.

    Raises:
        InputError: It says something that is not valid; the message names the field.
    """
    path = sidecar_path(world)
    return load_yaml_model(path, SceneSidecar) if path.is_file() else SceneSidecar()
