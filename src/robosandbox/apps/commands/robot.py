"""`robot infer` and `robot check`: a sidecar from a model, and whether one fits."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.apps.commands.lazy import plain_group
from robosandbox.apps.commands.options import ArmName, GripperModel, NoCache, SidecarFile
from robosandbox.apps.commands.packages import PackagePath
from robosandbox.errors import InputError

if TYPE_CHECKING:
    from robosandbox.robots.findings import CheckResult
    from robosandbox.robots.infer.sidecar import Inference

app: typer.Typer = plain_group(help="Bring your own robot: infer its sidecar, check it.")

Model = Annotated[str, typer.Argument(help="A URDF or MJCF file, a bundled robot, or menagerie:<name>.")]
Output = Annotated[Path | None, typer.Option("-o", "--output", help="Write the sidecar here.")]
PictureFile = Annotated[Path | None, typer.Option("--picture", help="A picture of TCP, closing axis, home and reach.")]
Changes = Annotated[
    bool,
    typer.Option("--changes", help="List every value of the model that loading changes, file against loaded, and end."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]


@app.command("infer")
def infer(
    model: Model,
    gripper: GripperModel = None,
    arm: ArmName = None,
    output: Output = None,
    picture: PictureFile = None,
    package_path: PackagePath = None,
    no_cache: NoCache = False,
    json: Json = False,
) -> int:
    """Work out a robot's sidecar from its model, with the evidence for each field."""
    from robosandbox.robots.check.diagnosis import refuse_unsound
    from robosandbox.robots.infer.report import document, to_yaml
    from robosandbox.robots.infer.sidecar import infer as work_out

    found = work_out(_model(model), gripper=_file(gripper, "--gripper"), arm=arm)
    refuse_unsound(found)
    if output is not None:
        try:
            output.parent.mkdir(parents=True, exist_ok=True)
            place = None if output.exists() and not output.is_file() else output.resolve().parent
            output.write_text(to_yaml(found, place), encoding="utf-8")
        except OSError as error:
            raise InputError(f"--output: {output}: {error.strerror}") from None
        print(f"wrote {output}{_found_as(found.model.path, output)}", file=sys.stderr)
    if picture is not None:
        _draw(found, picture)
    if len(found.choices) > 1:
        print(f"{found.model.path.name}: arms to choose from with --arm: {', '.join(found.choices)}", file=sys.stderr)
    for note in found.notes:
        print(f"note: {note}", file=sys.stderr)
    if json:
        print_json(document(found))
    elif output is None:
        # Nobody says where it is to lie.
        print(to_yaml(found), end="")
    return EXIT_DONE


@app.command("check")
def check(
    model: Model,
    sidecar: SidecarFile = None,
    gripper: GripperModel = None,
    arm: ArmName = None,
    changes: Changes = False,
    package_path: PackagePath = None,
    no_cache: NoCache = False,
    json: Json = False,
) -> int:
    """Check a robot and its sidecar, first on paper and then in simulation, up to a pick."""
    if changes:
        if gripper is not None or arm is not None:
            raise InputError("--changes: compares one file with what is loaded of it; leave out --gripper and --arm")
        return _list_changes(_model(model), sidecar, as_json=json)
    from robosandbox.apps.conformance.robot_check import check_robot

    report = check_robot(
        model,
        sidecar=sidecar,
        gripper=_file(gripper, "--gripper"),
        arm=arm,
        on_check=None if json else _print_check,
    )
    if json:
        print_json(report.document())
    else:
        print("sound" if report.ok else "not sound")
    return EXIT_DONE if report.ok else EXIT_FAILED


def _list_changes(model: Path, sidecar: Path | None, *, as_json: bool) -> int:
    from dataclasses import asdict

    from robosandbox.robots.check.changes import changes, compile_file, table
    from robosandbox.robots.loader import load_robot
    from robosandbox.sim.world import ROBOT_PREFIX, build_world
    from robosandbox.types import Scene

    robot = load_robot(model, _file(sidecar, "--sidecar"))
    world = build_world(Scene(robot_urdf=model, robot_config=sidecar), robot)
    found = changes(compile_file(model), world.model, prefix=ROBOT_PREFIX)
    if as_json:
        print_json({"changes": [{**asdict(change), "derived": change.is_derived} for change in found]})
    else:
        print(*table(found), sep="\n")
    return EXIT_DONE


def _print_check(item: CheckResult) -> None:
    # What the robot cannot have, as a pick without a gripper, is no fault of it.
    mark = "ok  " if item.ok else "FAIL" if item.counts else "n/a "
    change = f"  [change {item.field}]" if item.field and not item.ok else ""
    print(f"{mark} {item.name:<14} {item.detail}{change}", flush=True)


def _found_as(model: Path, sidecar: Path) -> str:
    """Return what has to be said where the sidecar is not beside its model under the name that is looked for."""
    expected = model.with_suffix(".robosandbox.yaml")
    if sidecar.resolve() == expected.resolve():
        return ""
    return f"; it is found by itself as {expected}, else name it: --sidecar of any command, robot_config of a task"


def _model(name: str) -> Path:
    from robosandbox.robots.locate import resolve_robot

    return resolve_robot(Path(name)).resolve()


def _file(path: Path | None, option: str) -> Path | None:
    if path is not None and not path.is_file():
        raise InputError(f"{option}: {path}: no such file")
    return path.resolve() if path is not None else None


def _draw(found: Inference, picture: Path) -> None:
    from robosandbox.sim.robot_figure import draw_robot

    draw_robot(found.model, found.sidecar, found.workspace, picture)
