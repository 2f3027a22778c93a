"""Perception that a model names: it points at things in a picture, and depth says where and what they are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, ValidationError
from pydantic_ai.messages import BinaryContent
from pydantic_ai.tools import ToolDefinition

from robosandbox.agent.flat_schema import flat
from robosandbox.agent.llm.budget import Budget, SpendingLimits
from robosandbox.agent.llm.endpoint import Question, converse
from robosandbox.agent.llm.forms import Call, MisuseError
from robosandbox.agent.llm.modes import Mode
from robosandbox.agent.llm.pictures import png
from robosandbox.agent.llm.service import Service
from robosandbox.agent.llm.settings import LLMSettings
from robosandbox.agent.tools import said_of
from robosandbox.errors import PlannerError
from robosandbox.perception.factory import Setup
from robosandbox.perception.frame import PointCloudFrame
from robosandbox.perception.rgbd import RgbdPerception
from robosandbox.perception.tolerances import TOLERANCES
from robosandbox.perception.track import Track
from robosandbox.types import Array, StrictModel

_POINT = "point"
# Pixels around the one pointed at whose depth is read as well. Chosen: a model may miss an edge by a little.
_AROUND = 3
_LEAST_DEPTHS = 5  # Number of pixels with depth among these that tell a place. Chosen.
_REACH = 0.015  # Metres from a thing's hull within which a place is on it. Chosen: half of a small cube.
_MOST = 60  # Number of things in one answer. Chosen far above what a table holds.

_INSTRUCTIONS = """You are the eyes of a robot arm at a table. You get one camera picture. Point at every loose object on the
table: a short plain name for each, such as "red cube" or "blue mug", and one pixel on it, x from the left and y from the
top. Take a pixel in the middle of what is visible of the object. Leave out the robot, the table and
the floor. Two objects that look alike get the same name."""
_FORM = '{"objects": [{"name": "NAME", "x": PIXEL, "y": PIXEL}, ...]}'
_CALL = "Answer with exactly one call of the tool `point`."
_HOW_TO_ANSWER = {
    Mode.SCHEMA: f"Answer with one JSON object: {_FORM}.",
    Mode.TOOLS: _CALL,
    Mode.OFFERED: _CALL,
    Mode.TEXT: f"Answer with one JSON object and no other text: {_FORM}.",
}


class Pointed(StrictModel):
    """Something that the model points at."""

    name: Annotated[str, Field(min_length=1, max_length=60)]
    x: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    y: Annotated[float, Field(ge=0, allow_inf_nan=False)]


class PointAnswer(StrictModel):
    """Arguments of `point`."""

    objects: Annotated[tuple[Pointed, ...], Field(max_length=_MOST)]


class PointingPerception(RgbdPerception):
    """Measures objects in colour and depth as `rgbd` does, and lets a model that sees say what they are called.

    The model is asked when something new is seen, not at every look. A pixel that it points at becomes a point of the
    world by the depth there, and the measured thing at that point gets the name; a pixel at which nothing is measured
    becomes a note, and a thing that the model leaves out keeps a plain name such as `red_box_1`. Shapes, sizes and poses
    never come from the model.

    Args:
        settings: Model, endpoint and limits.
        setup: Robot and table; the task's description of its objects is left out.
        calibration: Where the cameras are.
        camera: Whose picture is sent; that of the first one that looks when left out.

    Raises:
        InputError: A key is missing, or the cassette cannot be used.
    """

    def __init__(
        self, settings: LLMSettings, *, setup: Setup, calibration: Path | None = None, camera: str | None = None
    ) -> None:
        super().__init__(setup=Setup(scene=setup.scene), calibration=calibration)
        self._service = Service(settings)
        self._camera = camera
        self._named: set[str] = set()

    def assign_ids(self) -> None:
        """Ask for names where something new is seen.

        Raises:
            PlannerError: The model gives no usable answer, and none has been named before.
        """
        self._named &= {track.id for track in self.tracks}
        new = [
            track for track in self.tracks if track.id not in self._named and track.confidence >= TOLERANCES.acted_on
        ]
        by_camera = self.frames.by_camera
        segmented = by_camera.get(self._camera or next(iter(by_camera), ""))
        if not new or segmented is None:
            return
        try:
            pointed = self._ask(segmented.frame)
        except PlannerError as error:
            if not self._named:
                raise
            self.notes = (*self.notes, f"new things keep plain names: {error}")
            return
        for item in pointed:
            self._name(item, segmented.frame, new)
        self._named |= {track.id for track in new}

    def _name(self, item: Pointed, frame: PointCloudFrame, new: Sequence[Track]) -> None:
        """Give what the model points at its name, where it is new; note it where nothing is measured."""
        place = point_at(frame, item.x, item.y)
        track = None if place is None else _nearest(self.tracks, place)
        if track is None:
            pixel = f"({item.x:.0f}, {item.y:.0f})"
            note = f"the model points at {item.name!r} at pixel {pixel}, where nothing is measured"
            self.notes = (*self.notes, note)
        elif track in new and track.id not in self._named:
            name = _free(_as_id(item.name), {each.id for each in self.tracks} - {track.id})
            if name != track.id:
                self.rename(track.id, name)
            self._named.add(name)

    def _ask(self, frame: PointCloudFrame) -> Sequence[Pointed]:
        settings = self._service.settings
        height, width = frame.depth.shape
        text = f"The picture is {width} pixels wide and {height} pixels high. Point at every loose object."
        return converse(
            self._service,
            Question(
                instructions=lambda mode: f"{_INSTRUCTIONS}\n\n{_HOW_TO_ANSWER[mode]}",
                content=[text, BinaryContent(data=png(frame.rgb), media_type="image/png")],
                tools=[TOOL],
                read=lambda call: _read(call, width, height),
            ),
            budgets=(Budget(SpendingLimits(tokens=settings.max_tokens, seconds=settings.time_limit)),),
        )


TOOL = ToolDefinition(
    name=_POINT,
    description="Name every loose object on the table and give one pixel on each.",
    parameters_json_schema=flat(PointAnswer.model_json_schema()),
)


def point_at(frame: PointCloudFrame, x: float, y: float) -> Array | None:
    """Return the point of the world (3,) at a pixel: of the nearest surface around it; None where depth is missing."""
    height, width = frame.depth.shape
    column, row = round(x), round(y)
    crop = np.s_[max(row - _AROUND, 0) : row + _AROUND + 1, max(column - _AROUND, 0) : column + _AROUND + 1]
    if not (0 <= column < width and 0 <= row < height) or frame.valid[crop].sum() < _LEAST_DEPTHS:
        return None
    return np.asarray(np.median(frame.xyz[:, crop[0], crop[1]][:, frame.valid[crop]], axis=1), dtype=np.float64)


def _nearest(tracks: Sequence[Track], place: Array) -> Track | None:
    """Return the thing on or in whose hull a point (3,) lies."""
    off = [(track.thing.fit.outside(place), track) for track in tracks]
    distance, track = min(off, key=lambda item: item[0], default=(np.inf, None))
    return track if distance < _REACH else None


def _read(call: Call, width: int, height: int) -> Sequence[Pointed]:
    """Return what the model points at.

    Raises:
        MisuseError: The answer is of no use, with what is wrong with it.
    """
    try:
        answer = PointAnswer.model_validate(call.arguments)
    except ValidationError as error:
        raise MisuseError(f"{said_of(error.errors(include_url=False)[0])}. The form is {_FORM}") from error
    for item in answer.objects:
        if item.x >= width or item.y >= height:
            raise MisuseError(f"({item.x:g}, {item.y:g}) is outside of the picture of {width} x {height} pixels")
    return answer.objects


def _as_id(name: str) -> str:
    """Return a name as an id: lower case, words joined by underscores."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")[:40] or "thing"


def _free(name: str, taken: set[str]) -> str:
    """Return the name, numbered where it is taken."""
    if name not in taken:
        return name
    number = 2
    while f"{name}_{number}" in taken:
        number += 1
    return f"{name}_{number}"
