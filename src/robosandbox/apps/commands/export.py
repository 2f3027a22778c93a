"""`export`: recorded episodes in the formats of others."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robosandbox.apps.commands.console import EXIT_DONE
from robosandbox.apps.commands.lazy import plain_group
from robosandbox.apps.commands.recording import parse_size
from robosandbox.errors import InputError
from robosandbox.extras import missing_extra
from robosandbox.progress import doing

if TYPE_CHECKING:
    from robosandbox.workcell.recording.episode import RecordedEpisode

app: typer.Typer = plain_group(help="Recorded episodes as datasets and logs.")

Paths = Annotated[
    list[Path], typer.Argument(metavar="EPISODES... OUT", help="Episodes or folders of episodes, and last the target.")
]
Cameras = Annotated[
    str | None, typer.Option("--cameras", help="Whose pictures go in, by comma; those filmed along if left out.")
]
Size = Annotated[str, typer.Option("--size", help="Width and height of pictures that have to be drawn.")]
Success = Annotated[bool, typer.Option("--only-success", help="Leave out what was not judged a success.")]


@app.command("lerobot")
def to_lerobot(
    paths: Paths,
    fps: Annotated[int, typer.Option("--fps", help="Frames per simulated second.")] = 20,
    cameras: Cameras = None,
    size: Size = "320x240",
    only_success: Success = False,
) -> int:
    """Write a LeRobotDataset (v3.0) of one robot's episodes."""
    episodes, target = _load(paths, only_success)
    try:
        from robosandbox.apps.export.lerobot import export_lerobot
    except ModuleNotFoundError as error:
        raise missing_extra(error, "export lerobot", "export") from None
    chosen, pixels = _pictures(episodes, cameras, size)
    frames = 0

    def tell(episode: RecordedEpisode, count: int) -> None:
        nonlocal frames
        frames += count
        print(f"{episode.name}: {count} frames", file=sys.stderr)

    with doing(f"exporting {len(episodes)} episodes"):
        export_lerobot(episodes, target, fps=fps, cameras=chosen, size=pixels, on_done=tell)
    megabytes = sum(file.stat().st_size for file in target.rglob("*") if file.is_file()) / 1e6
    noun = "episode" if len(episodes) == 1 else "episodes"
    print(f"exported {len(episodes)} {noun}, {frames} frames, {megabytes:.1f} MB, to {target}", file=sys.stderr)
    print(target)
    return EXIT_DONE


@app.command("mcap")
def to_mcap(
    paths: Paths,
    fps: Annotated[float, typer.Option("--fps", help="Pictures per simulated second.")] = 20.0,
    cameras: Cameras = None,
    size: Size = "320x240",
    only_success: Success = False,
) -> int:
    """Write an MCAP file for Foxglove; OUT is a file for one episode, a folder for several."""
    episodes, target = _load(paths, only_success)
    try:
        from robosandbox.apps.export.foxglove import export_mcap
    except ModuleNotFoundError as error:
        raise missing_extra(error, "export mcap", "export") from None
    chosen, pixels = _pictures(episodes, cameras, size)
    one = target.suffix == ".mcap"
    if one and len(episodes) > 1:
        raise InputError(f"{str(target)!r} is one file for {len(episodes)} episodes; name a folder")
    if not one:
        target.mkdir(parents=True, exist_ok=True)
    for episode in episodes:
        file = target if one else target / f"{episode.name}.mcap"
        with doing(f"exporting {episode.name}"):
            export_mcap(episode, file, fps=fps, cameras=chosen, size=pixels)
        print(file)
    return EXIT_DONE


def _load(paths: list[Path], only_success: bool) -> tuple[list[RecordedEpisode], Path]:
    from robosandbox.apps.commands.runs import load

    if len(paths) < 2:
        raise InputError("EPISODES... OUT: name at least one episode and the target")
    *sources, target = paths
    if not target.absolute().parent.is_dir():
        raise InputError(f"the folder of {str(target)!r} does not exist; make it first")
    episodes: list[RecordedEpisode] = []
    for source in sources:
        first = load(source) if not source.is_dir() else None
        found = [first] if first is not None else _inside(source)
        episodes += found
    if only_success:
        episodes = [
            item for item in episodes if item.result is not None and item.result.judged and item.result.judged.success
        ]
    if not episodes:
        raise InputError("no episode to export is in there; `robo-sandbox runs list FOLDER` lists those of a folder")
    return episodes, target


def _inside(folder: Path) -> list[RecordedEpisode]:
    from robosandbox.apps.commands.runs import load
    from robosandbox.workcell.recording.files import find_episodes

    return [load(path) for path in find_episodes(folder)]


def _pictures(
    episodes: list[RecordedEpisode], cameras: str | None, size: str
) -> tuple[tuple[str, ...], tuple[int, int]]:
    """Return the cameras and (height, width); of films that were recorded, if no camera is named."""
    pixels = parse_size(size)
    if cameras is not None:
        return tuple(name for name in cameras.split(",") if name), pixels
    videos = episodes[0].meta.videos
    if not videos:
        return (), pixels
    return tuple(video.camera for video in videos), (videos[0].height, videos[0].width)
