"""`scene infer` and `scene check`: a sidecar from somebody's scene, and whether the scene is sound."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.apps.commands.lazy import plain_group
from robosandbox.apps.commands.options import Json, RobotBase, RobotName, SidecarFile, read_base
from robosandbox.errors import InputError
from robosandbox.types import Scene

app: typer.Typer = plain_group(help="Bring your own scene: infer its sidecar, check it.")

World = Annotated[Path, typer.Argument(help="An MJCF file.", metavar="FILE")]
Output = Annotated[Path | None, typer.Option("-o", "--output", help="Write the sidecar here.")]
PictureFile = Annotated[Path | None, typer.Option("--picture", help="A picture of the scene with the robot in it.")]


@app.command("infer")
def infer(
    world: World,
    robot: RobotName = None,
    robot_base: RobotBase = None,
    sidecar: SidecarFile = None,
    output: Output = None,
    picture: PictureFile = None,
    json: Json = False,
) -> int:
    """Work out what is in a scene's file, with the evidence for each thing, fixture and part."""
    from robosandbox.sim.populated import populated, robot_base_of
    from robosandbox.sim.scene_file import read_scene_file
    from robosandbox.sim.scene_report import document, to_yaml

    scene = _scene(world, robot, robot_base, sidecar)
    file = read_scene_file(world)
    base, why = robot_base_of(scene, file)
    scene = populated(scene.model_copy(update={"robot_base": base}))
    text = to_yaml(file, base, why)
    if output is not None:
        try:
            output.parent.mkdir(parents=True, exist_ok=True)
            output.write_text(text, encoding="utf-8")
        except OSError as error:
            raise InputError(f"--output: {output}: {error.strerror}") from None
        print(f"wrote {output}", file=sys.stderr)
    if picture is not None:
        from robosandbox.sim.scene_figure import draw_scene

        draw_scene(scene, picture)
    for note in file.notes:
        print(f"note: {note}", file=sys.stderr)
    if json:
        print_json(document(file, scene, why))
    elif output is None:
        print(text, end="")
    return EXIT_DONE


@app.command("check")
def check(
    world: World,
    robot: RobotName = None,
    robot_base: RobotBase = None,
    sidecar: SidecarFile = None,
    json: Json = False,
) -> int:
    """Let a scene settle, push its parts, and tell what is wrong with it."""
    from robosandbox.sim.scene_check import check_scene

    found = []
    for item in check_scene(_scene(world, robot, robot_base, sidecar)):
        found.append(item)
        if not json:
            mark = "ok  " if item.ok else "FAIL" if item.counts else "n/a "
            print(f"{mark} {item.name:<9} {item.detail}", flush=True)
    sound = all(item.ok or not item.counts for item in found)
    if json:
        checks = [{"name": item.name, "ok": item.ok, "counts": item.counts, "detail": item.detail} for item in found]
        print_json({"sound": sound, "checks": checks})
    else:
        print("sound" if sound else "not sound")
    return EXIT_DONE if sound else EXIT_FAILED


def _scene(world: Path, robot: str | None, base: str | None, sidecar: Path | None) -> Scene:
    return Scene(
        world=world,
        robot_urdf=None if robot is None else Path(robot),
        robot_config=sidecar,
        robot_base=None if base is None else read_base(base),
    )
