"""`look`: what perception sees, as a list, as JSON, or drawn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.apps.commands.options import Json
from robosandbox.apps.commands.world import open_here, takes_world
from robosandbox.errors import InputError
from robosandbox.progress import doing
from robosandbox.workcell.options import WorkcellOptions

if TYPE_CHECKING:
    from robosandbox.perception.protocols import Perception
    from robosandbox.types import DetectedObject, ObservedScene


@takes_world(
    without=("planner", "time_limit", "camera", "grasp", "motion", "max_replans", "what_if", "confirm", "stop_switch"),
    perception="rgbd",
    sensor="realsense",
)
def look(
    world: WorkcellOptions,
    picture: Annotated[Path | None, typer.Option("--picture", help="Draw what the cameras see into this PNG.")] = None,
    json: Json = False,
) -> int:
    """Print what is seen: names, shapes, places, sizes, and how sure that is."""
    if picture is not None:
        _check_picture(picture)
    # The model, if any, is the perception's: nothing is planned here.
    with open_here(_to_look(world)) as session, doing("looking"):
        scene = session.observe()
        if picture is not None:
            _draw(session.ctx.perception, world.perception, picture)
    if json:
        print_json(
            {
                "time": scene.time,
                "objects": [_record(item) for item in scene.objects],
                "held": dict(scene.hands) if len(scene.hands) > 1 else scene.held,
                "notes": list(scene.notes),
            }
        )
    else:
        print("\n".join(lines(scene)))
    return EXIT_DONE if scene.objects else EXIT_FAILED


def _check_picture(path: Path) -> None:
    if path.suffix.lower() != ".png":
        raise InputError(f"--picture: {path.name!r} does not end in .png; PNG is what is written")
    if not path.parent.is_dir():
        raise InputError(f"--picture: there is no folder {str(path.parent)!r}; make it first")


def _to_look(world: WorkcellOptions) -> WorkcellOptions:
    """Return the options with what was said of a model said of the perception's, and no other planner than the offline one."""
    model = {name: value for name, value in (world.planner_options or {}).items() if name != "time_limit"}
    return replace(world, planner_options=None, perception_options={**(world.perception_options or {}), **model})


def lines(scene: ObservedScene) -> list[str]:
    """Return a line for each object, and what could not be seen."""
    width = max((len(item.id) for item in scene.objects), default=0)
    told = [
        f"{item.id:<{width}}  {item.colour} {item.kind} at ({', '.join(f'{value:.3f}' for value in item.pose.xyz)}), "
        f"{item.shape.describe(item)} mm, {100.0 * item.confidence:.0f} %"
        f"{'' if item.tag is None else f', tag {item.tag}'}"
        for item in scene.objects
    ]
    return [*(told or ["nothing is seen"]), *(f"note: {note}" for note in scene.notes)]


def _record(item: DetectedObject) -> dict[str, Any]:
    return {
        "id": item.id,
        "kind": item.kind,
        "size": list(item.size),
        "colour": item.colour,
        "rgba": list(item.rgba),
        "pose": item.pose.model_dump(mode="json"),
        "confidence": item.confidence,
        "tag": item.tag,
    }


def _draw(eyes: Perception, name: str, path: Path) -> None:
    from robosandbox.perception.protocols import Pictured

    if not isinstance(eyes, Pictured):
        raise InputError(f"--picture: {name} looks through no camera; give --perception rgbd")
    import cv2

    written, content = cv2.imencode(".png", eyes.picture()[..., ::-1])
    try:
        if written:
            path.write_bytes(content.tobytes())
    except OSError as error:
        raise InputError(f"--picture: {path}: {error.strerror}") from None
