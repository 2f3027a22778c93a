"""Files that a task names without a path: `@builtin:` for what is bundled, `@ycb:` for objects of a YCB folder."""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path
from typing import Any

from robosandbox.errors import InputError
from robosandbox.ranges import Mass, Scale
from robosandbox.types import Fraction, NonNegative, SceneObject, StrictModel
from robosandbox.validation import did_you_mean, load_yaml_model

BUILTIN, YCB = "@builtin:", "@ycb:"
YCB_VARIABLE = "ROBOSANDBOX_YCB"
_OBJECT_SUFFIX = ".robosandbox.yaml"
_MESH_SUFFIXES = (".obj", ".stl")
# The meshes of a YCB object as it is distributed, the plainest first; others come after these.
_USUAL_MESHES = ("nontextured.stl", "textured.obj", "textured_simple.obj")


class YcbObject(StrictModel):
    """Content of `<name>.robosandbox.yaml` in an object's folder.

    Attributes:
        visual_mesh: Its mesh, in the same folder; its convex hull is what collides.
        collision_meshes: Convex parts for other simulators; not used.
        scale: Metres per unit of the mesh.
        mass: Kilograms.
        friction: Sliding, torsional and rolling, for other simulators; not used.
        rgba: Colour, each channel 0..1.
    """

    visual_mesh: Path
    collision_meshes: tuple[Path, ...] = ()
    scale: Scale = 1.0
    mass: Mass | None = None
    friction: tuple[NonNegative, NonNegative, NonNegative] | None = None
    rgba: tuple[Fraction, Fraction, Fraction, Fraction] | None = None


def builtin_file(name: Path, field: str) -> Path:
    """Return the bundled file that `@builtin:robots/<robot>/<file>` names.

    Args:
        name: As it stands in the task.
        field: Names it in errors.

    Raises:
        InputError: No such file is bundled.
    """
    folder = Path(str(resources.files("robosandbox.robots"))).resolve()
    said = str(name)
    inside = Path(said.removeprefix(BUILTIN))
    there = [f"{BUILTIN}robots/{path.relative_to(folder)}" for path in sorted(folder.glob("*/*.*ml")) if path.is_file()]
    full = folder.joinpath(*inside.parts[1:]).resolve()
    if inside.parts[:1] != ("robots",) or not full.is_relative_to(folder) or not full.is_file():
        shown = [path for path in there if not path.startswith(f"{BUILTIN}robots/known/")]
        hint = did_you_mean(said, shown) or f"; there is {', '.join(shown)}"
        raise InputError(f"{field}: {said!r} is not bundled{hint}")
    return full


def ycb_object(item: SceneObject, field: str) -> SceneObject:
    """Return a mesh object whose file is `@ycb:<id>` with its file; what the task leaves out comes from beside the mesh.

    Args:
        item: The object.
        field: Names its mesh in errors.

    Raises:
        InputError: No folder is given, or it has no such object.
    """
    said = str(item.mesh)
    name = said.removeprefix(YCB)
    root = os.environ.get(YCB_VARIABLE)
    if not root:
        raise InputError(f"{field}: {said!r} needs the folder of the YCB objects; set {YCB_VARIABLE} to it")
    folders = {path.name: path for path in Path(root).expanduser().glob("*") if path.is_dir()}
    if name not in folders:
        hint = did_you_mean(name, folders) or f"; there is {', '.join(sorted(folders)[:5]) or 'no folder'}"
        raise InputError(f"{field}: {said!r} is not in {root} ({YCB_VARIABLE}){hint}")
    folder = folders[name]
    described = next(iter(sorted(folder.glob(f"*{_OBJECT_SUFFIX}"))), None)
    if described is None:
        return item.model_copy(update={"mesh": _usual_mesh(folder, said, field)})
    notes = load_yaml_model(described, YcbObject)
    mesh = (folder / notes.visual_mesh).resolve()
    if not mesh.is_relative_to(folder.resolve()) or not mesh.is_file():
        raise InputError(f"{described}: visual_mesh: {str(notes.visual_mesh)!r} is not a file of this folder")
    given: dict[str, Any] = {"scale": notes.scale, "mass": notes.mass, "rgba": notes.rgba}
    left_out = {key: value for key, value in given.items() if value is not None and key not in item.model_fields_set}
    return item.model_copy(update={**left_out, "mesh": mesh})


def _usual_mesh(folder: Path, said: str, field: str) -> Path:
    meshes = [path for path in folder.rglob("*") if path.suffix.lower() in _MESH_SUFFIXES]
    if not meshes:
        raise InputError(f"{field}: {said!r}: {folder} has no OBJ or STL file")
    order = {name: rank for rank, name in enumerate(_USUAL_MESHES)}
    return min(
        meshes, key=lambda path: (order.get(path.name.lower(), len(order)), len(path.parts), str(path))
    ).resolve()
