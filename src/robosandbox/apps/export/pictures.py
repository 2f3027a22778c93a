"""Camera pictures of an episode: frames of the film that was recorded, or drawn from the states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from robosandbox.workcell.recording.drawing import frames, world_of
from robosandbox.workcell.recording.episode import RecordedEpisode

Picture = NDArray[np.uint8]


def pictures(
    episode: RecordedEpisode, cameras: Sequence[str], every: int, size: tuple[int, int]
) -> Iterator[dict[str, Picture]]:
    """Yield RGB pictures (height, width, 3) uint8 by camera, of every `every`-th row.

    Raises:
        InputError: No such camera, or the episode's task cannot be loaded any more.
        RenderingError: A picture has to be drawn and there is no OpenGL on this machine.
    """
    height, width = size
    filmed = {
        video.camera
        for video in episode.meta.videos
        if (video.every, video.height, video.width) == (every, height, width)
    }
    if set(cameras) <= filmed:
        films = [_decoded(episode, camera) for camera in cameras]
        for found in zip(*films, strict=True):
            yield dict(zip(cameras, found, strict=True))
        return
    yield from frames(episode, world_of(episode), cameras, every, size)


def _decoded(episode: RecordedEpisode, camera: str) -> Iterator[Picture]:
    import av

    path = episode.video(camera)
    with av.open(str(path)) as container:
        for frame in islice(container.decode(video=0), len(episode)):
            yield np.asarray(frame.to_ndarray(format="rgb24"), dtype=np.uint8)
