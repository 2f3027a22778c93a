"""`replay` and `runs`: what was recorded, run again, listed, shown and drawn."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.apps.commands.lazy import plain_group
from robosandbox.apps.commands.recording import parse_size
from robosandbox.errors import InputError
from robosandbox.extras import missing_extra
from robosandbox.progress import doing

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from robosandbox.workcell.recording.episode import RecordedEpisode

app: typer.Typer = plain_group(help="Recorded episodes.")

EpisodeFolder = Annotated[Path, typer.Argument(help="An episode's folder.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]
Camera = Annotated[str, typer.Option("--camera", help="Which camera's picture.")]
Out = Annotated[Path | None, typer.Option("-o", "--output", help="The file to write; beside the steps if left out.")]
Fps = Annotated[float, typer.Option("--fps", help="Frames per simulated second.")]
Size = Annotated[str, typer.Option("--size", help="WIDTHxHEIGHT of the pictures.")]


def replay(
    episode: EpisodeFolder,
    check: Annotated[
        bool, typer.Option("--check", help="Exit with 1 unless outcome and final object poses are the recorded ones.")
    ] = False,
    json: Json = False,
) -> int:
    """Run a recorded episode's actions again through physics, and compare."""
    found = load(episode)
    from robosandbox.workcell.recording.replay import TOLERANCE_MM, open_replay

    run = open_replay(found)
    try:
        with doing(f"running {found.name} again"):
            replayed = run.run()
    finally:
        run.session.close()
    judged = replayed.judged
    document: dict[str, Any] = {
        "episode": found.name,
        "same": replayed.same,
        "same_outcome": replayed.same_outcome,
        "recorded": replayed.recorded,
        "judged": judged.success if judged else None,
        "detail": judged.detail if judged else {},
        "object_error_mm": replayed.object_error_mm,
        "joint_error": replayed.joint_error,
        "steps": len(found) - 1,
        "changed_versions": [list(change) for change in replayed.changed_versions],
    }
    for name, then, now in replayed.changed_versions:
        print(f"note: {name} is {now}; it was {then} when this was recorded", file=sys.stderr)
    if json:
        print_json(document)
    else:
        worst = max(replayed.object_error_mm.values(), default=0.0)
        outcome = "not judged" if judged is None else f"judged {'a success' if judged.success else 'a failure'}"
        before = (
            "" if replayed.recorded is None else f", recorded as {'a success' if replayed.recorded else 'a failure'}"
        )
        print(f"{'same' if replayed.same else 'different'}: {document['steps']} ticks, {outcome}{before}")
        print(f"objects end within {worst:.3g} mm of where they did (limit {TOLERANCE_MM:g} mm)")
    return EXIT_DONE if replayed.same or not check else EXIT_FAILED


@app.command("list")
def list_runs(
    folder: Annotated[Path, typer.Argument(help="A folder with episodes in it.")] = Path("."), json: Json = False
) -> int:
    """List the episodes in a folder."""
    from robosandbox.workcell.recording.files import find_episodes

    if not folder.is_dir():
        raise InputError(f"{str(folder)!r} is no folder")
    rows = [row for path in find_episodes(folder) if (row := _readable(path, folder))]
    if json:
        print_json(rows)
        return EXIT_DONE
    if not rows:
        raise InputError(f"no episode lies in {str(folder)!r}; record some with --record")
    width = max(len(row["episode"]) for row in rows)
    for row in rows:
        seconds = f"{row['sim_secs']:6.2f} s" if row["sim_secs"] is not None else "       -"
        print(f"{row['episode']:<{width}}  {row['outcome']:<10}  {seconds}  {row['prompt']}")
    return EXIT_DONE


@app.command("show")
def show_run(episode: EpisodeFolder, json: Json = False) -> int:
    """Show what an episode is, what happened in it and how it ended."""
    found = load(episode)
    events = found.events()
    if json:
        document = {
            "meta": found.meta.model_dump(mode="json", exclude={"checkpoint"}),
            "result": found.result.model_dump(mode="json") if found.result else None,
        }
        print_json({**document, "events": events, "rows": _rows(found)})
        return EXIT_DONE
    meta = found.meta
    print(f"{found.name}: {meta.prompt}")
    print(f"  task {meta.task['name']} with seed {meta.seed}, {meta.robot_name}, {meta.started:%Y-%m-%d %H:%M:%S} UTC")
    print(f"  {_rows(found)} rows at {1.0 / meta.control_timestep:g} Hz; {_outcome(found)}")
    for line in events:
        print(f"  {line['time']:8.2f} s  {_told(line)}")
    if found.result is not None:
        print(f"  {found.result.reason}: {found.result.detail}")
        if found.result.judged is not None:
            numbers = ", ".join(f"{key}={value:.3f}" for key, value in found.result.judged.detail.items())
            print(f"  judged: {'success' if found.result.judged.success else 'failure'} ({numbers})")
    return EXIT_DONE


@app.command("plot")
def plot_run(
    episode: EpisodeFolder,
    out: Out = None,
    only: Annotated[
        str | None, typer.Option("--only", help="Panels by comma, of joints, tcp, gripper, force, phases.")
    ] = None,
) -> int:
    """Draw joints, TCP, gripper, contact force and phases over time as a PNG."""
    found = load(episode)
    try:
        from robosandbox.workcell.recording.drawing import PLOTS, plot

        kinds = PLOTS if only is None else tuple(name for name in only.split(",") if name)
        for kind in kinds:
            if kind not in PLOTS:
                raise InputError(f"--only: {kind!r} is not one of {', '.join(PLOTS)}")
        target = out or found.folder / "plot.png"
        with doing(f"drawing {found.name}"):
            plot(found, target, kinds or PLOTS)
    except ModuleNotFoundError as error:
        raise missing_extra(error, "plot", "record") from None
    print(target)
    return EXIT_DONE


@app.command("video")
def film_run(
    episode: EpisodeFolder, camera: Camera = "scene", out: Out = None, fps: Fps = 25.0, size: Size = "640x480"
) -> int:
    """Draw an episode's states into a film (MP4)."""
    from robosandbox.workcell.recording.video import Film

    found = load(episode)
    target = out or found.folder / f"{camera}.mp4"
    pixels = parse_size(size)
    film = Film(target, fps, pixels)
    try:
        with doing(f"filming {found.name}"):
            for picture in _pictures(found, camera, fps, pixels):
                film.add(picture)
    finally:
        film.close()
    print(target)
    return EXIT_DONE


@app.command("gif")
def animate_run(
    episode: EpisodeFolder,
    camera: Camera = "scene",
    out: Out = None,
    fps: Fps = 10.0,
    size: Size = "320x240",
    speed: Annotated[float, typer.Option("--speed", help="Simulated seconds per second of the animation.")] = 1.0,
) -> int:
    """Draw an episode's states into an animated GIF."""
    from robosandbox.workcell.recording.animation import write_gif

    if not 0.0 < speed <= 100.0:
        raise InputError(f"--speed: {speed:g}; give a number above 0, up to 100")
    found = load(episode)
    target = out or found.folder / f"{camera}.gif"
    with doing(f"drawing {found.name}"):
        write_gif(list(_pictures(found, camera, fps, parse_size(size))), target, 1.0 / (fps * speed))
    print(target)
    return EXIT_DONE


def load(folder: Path) -> RecordedEpisode:
    """Return a recorded episode.

    Raises:
        InputError: The folder holds none, or a package is missing.
    """
    try:
        from robosandbox.workcell.recording.episode import RecordedEpisode
    except ModuleNotFoundError as error:
        raise missing_extra(error, "recordings", "record") from None
    return RecordedEpisode.load(folder)


def _pictures(found: RecordedEpisode, camera: str, fps: float, size: tuple[int, int]) -> Iterator[NDArray[np.uint8]]:
    from robosandbox.workcell.recording.drawing import frames, world_of
    from robosandbox.workcell.recording.settings import rows_per_frame

    every = rows_per_frame(fps, found.meta.control_timestep, "--fps")
    for pictures in frames(found, world_of(found), (camera,), every, size):
        yield pictures[camera]


def _rows(found: RecordedEpisode) -> int:
    try:
        return len(found)
    except InputError:
        return 0


def _outcome(found: RecordedEpisode) -> str:
    if found.result is None:
        return "cut short"
    if found.result.judged is not None:
        return "success" if found.result.judged.success else "failure"
    return "done" if found.result.success else found.result.reason


def _readable(path: Path, folder: Path) -> dict[str, Any] | None:
    """Return an episode's line; None, with a note on stderr, where its folder cannot be read."""
    try:
        return _summary(load(path), folder)
    except InputError as error:
        print(f"note: left out: {error}", file=sys.stderr)
        return None


def _summary(found: RecordedEpisode, folder: Path) -> dict[str, Any]:
    return {
        "episode": str(found.folder.relative_to(folder)) if found.folder != folder else found.name,
        "task": found.meta.task["name"],
        "seed": found.meta.seed,
        "robot": found.meta.robot_name,
        "prompt": found.meta.prompt,
        "outcome": _outcome(found),
        "sim_secs": found.result.sim_secs if found.result else None,
    }


def _told(line: dict[str, Any]) -> str:
    """Return an event as people read it."""
    match line["event"]:
        case "started":
            return f"told: {line['prompt']}"
        case "planned":
            return f"plan: {', '.join(_call(call) for call in line['plan']) or 'nothing to do'}"
        case "skill_started":
            return f"begin {_call(line['call'])}"
        case "phase":
            return f"  {line['phase']}"
        case "skill_ended":
            return f"done {_call(line['call'])}"
        case "skill_failed":
            return f"failed {_call(line['call'])}: {line['error']['message']}"
        case "replanning":
            return f"planning anew after {line['code']}"
        case "seen":
            scene = line["scene"] or {"objects": []}
            return f"  seen: {', '.join(item['id'] for item in scene['objects']) or 'nothing'}"
        case other:
            return str(other)


def _call(call: dict[str, Any]) -> str:
    return f"{call['skill']}({', '.join(f'{key}={value}' for key, value in call['arguments'].items())})"
