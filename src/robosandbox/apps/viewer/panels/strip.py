"""The strip under the scene: phases, joint speed, gripper opening and force over the simulated time since the last order."""

from __future__ import annotations

import math
import time
from html import escape

import numpy as np
import viser

from robosandbox.agent import episode as events
from robosandbox.apps.viewer.html import COLOURS, number
from robosandbox.apps.viewer.news import Began, Doing, Loaded, News, Went
from robosandbox.apps.viewer.source import Blueprint, Frame
from robosandbox.apps.viewer.timeline import PhaseSpan, Recording, Timeline
from robosandbox.error_codes import ErrorCode
from robosandbox.types import Array
from robosandbox.values import frozen

# Seconds between drawings. Chosen: each is some 15 kB of SVG; four a second read as live and cost a browser little.
_SECONDS = 0.25
_POINTS = 300  # Number of points of a curve. Chosen: more than the pixels of a phone, fewer than those of a desktop.
# Simulated seconds that the axis spans at least, and how many of its ticks there are at most.
_LEAST_SPAN = 2.0
_TICKS = 6  # Number of ticks of an axis, about. Chosen.
_HEIGHT_PX = 166  # Pixels. Chosen: two rows of curves with their titles.
# Where there is room, the strip has the window's lower edge to itself. On a phone it is a part of the panel, with names and
# values over one another. Viser's panel is 20 em wide there; the sheet that it is can have the whole width.
_STYLE = f"""<style>
.strip {{ box-sizing: border-box; background: #fff; color: {COLOURS["ink"]}; font-size: 12px; line-height: 1.2;
  padding: 8px 12px 4px; font-variant-numeric: tabular-nums; }}
.strip .row {{ display: grid; grid-template-columns: 7.6em minmax(0, 1fr); column-gap: 8px; margin-bottom: 2px; }}
.strip .name, .strip .most, .strip .axis, .strip .none {{ color: {COLOURS["grey"]}; }}
.strip .value {{ grid-column: 1; font-weight: 600; overflow: hidden; text-overflow: ellipsis; white-space: nowrap; }}
.strip .failed {{ color: {COLOURS["red"]}; }}
.strip .picture {{ grid-column: 2; grid-row: 1 / span 2; align-self: center; min-width: 0; }}
.strip .most {{ display: none; }}
.strip .phases {{ position: relative; height: 18px; background: #f3f5f7; overflow: hidden; }}
.strip .phases span {{ position: absolute; top: 0; bottom: 0; padding: 2px 0 0 4px; overflow: hidden; text-overflow: ellipsis;
  white-space: nowrap; box-sizing: border-box; }}
.strip svg {{ display: block; width: 100%; height: 34px; border-bottom: 1px solid #d5dae0; }}
.strip .axis {{ position: relative; height: 16px; }}
.strip .axis span {{ position: absolute; transform: translateX(-50%); top: 2px; white-space: nowrap; }}
.strip .axis span:first-child {{ transform: none; }}
@media (max-width: 36em) {{
  div[style*="width: 20em"] {{ width: 100% !important; }}
}}
@media (min-width: 36.0625em) and (min-height: 36em) {{
  #root {{ height: calc(100% - {_HEIGHT_PX}px); }}
  .strip {{ position: fixed; left: 0; right: 0; bottom: 0; height: {_HEIGHT_PX}px; border-top: 1px solid #c9d0d8;
    padding: 8px 16px 4px; }}
  .strip .row {{ grid-template-columns: 7.2em 5.4em minmax(0, 1fr) 4.6em; align-items: center; margin: 0; }}
  .strip .value {{ grid-column: auto; text-align: right; }}
  .strip .picture {{ grid-column: auto; grid-row: auto; }}
  .strip .most {{ display: inline; }}
  .strip svg {{ height: 36px; }}
}}
</style>"""
_BANDS = ("#dfe9f4", "#eef3f9")
_FAILED_BAND = "#f7d6d6"


@frozen
class Lane:
    """One curve.

    Attributes:
        name: What it shows.
        unit: Of its values.
        colour: A key of `COLOURS`.
        most: What its top stands for at least.
    """

    name: str
    unit: str
    colour: str
    most: float


class StripPanel:
    """Draws a timeline four times a second while the robot moves, and nothing while it does not.

    Args:
        server: Where.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        server.gui.add_html(_STYLE)
        self._board = server.gui.add_html("")
        self._timeline = Timeline()
        self._lanes: tuple[Lane, ...] = ()
        self._drawn = 0.0

    def adopt(self, blueprint: Blueprint) -> None:
        """Show another robot's units and ranges."""
        self._timeline.clear()
        gripper = blueprint.robot.gripper
        self._lanes = (Lane("Joint speed", blueprint.speed_unit, "blue", 10.0),)
        if gripper is not None:
            self._lanes += (
                Lane("Gripper opening", "mm", "green", 1000.0 * gripper.geometry.max_aperture),
                Lane("Gripper force", blueprint.force_unit(), "amber", 1.0),
            )
        self._board.content = strip(self._timeline.recording(), self._lanes)

    def hear(self, news: News) -> None:
        """Take news."""
        match news:
            case Began(Doing.RUNNING, _) | Went() | Loaded():
                self._timeline.clear()
            case Began(Doing.MOVING, what):
                self._timeline.enter(what)
            case events.PhaseEntered(_, phase):
                self._timeline.enter(phase)
            case events.SkillFailed(_, error) if error.code != ErrorCode.CANCELLED:
                self._timeline.fail()
            case _:
                pass

    def draw(self, frame: Frame, blueprint: Blueprint) -> None:
        """Take a frame."""
        self._timeline.add(frame, blueprint)
        if time.monotonic() - self._drawn >= _SECONDS:
            self._drawn = time.monotonic()
            self._board.content = strip(self._timeline.recording(), self._lanes)


def strip(recording: Recording, lanes: tuple[Lane, ...]) -> str:
    """Return the strip as HTML.

    Args:
        recording: What was measured; its columns go with the lanes.
        lanes: From top to bottom.
    """
    begin = float(recording.seconds[0]) if len(recording.seconds) else 0.0
    end = float(recording.seconds[-1]) if len(recording.seconds) else 0.0
    span = max(_LEAST_SPAN, end - begin)
    bands = _bands(recording.phases, begin, end, span)
    rows = [_row("PhaseSpan", _last(recording.phases), f'<div class="phases">{_labels(bands)}</div>', "")]
    for index, lane in enumerate(lanes):
        values = recording.values[:, index]
        top = _nice(max(lane.most, float(values.max(initial=0.0))))
        known = len(values) and np.isfinite(values[-1])
        now = f"{number(float(values[-1]), 1)} {lane.unit}" if known else "–"
        curve = _curve(recording.seconds - begin, values, span, top, COLOURS[lane.colour], bands)
        rows.append(_row(lane.name, now, curve, f"{top:g} {lane.unit}"))
    rows.append(_row("Simulated time", f"{number(end, 2)} s", f'<div class="axis">{_ticks(span)}</div>', ""))
    return f'<div class="strip">{"".join(rows)}</div>'


def _row(name: str, value: str, picture: str, most: str) -> str:
    return (
        f'<div class="row"><span class="name">{name}</span><span class="value">{value}</span>'
        f'<div class="picture">{picture}</div><span class="most">{most}</span></div>'
    )


def _last(phases: tuple[PhaseSpan, ...]) -> str:
    if not phases:
        return "–"
    name = escape(phases[-1].name)
    return f'<span class="failed">{name} failed</span>' if phases[-1].failed else name


def _bands(phases: tuple[PhaseSpan, ...], begin: float, end: float, span: float) -> list[tuple[str, str, float, float]]:
    """Return name, colour, left and width of each phase, the latter as shares of the span."""
    ends = [phase.start for phase in phases[1:]] + [end]
    found = []
    for index, (phase, stop) in enumerate(zip(phases, ends, strict=False)):
        start = max(phase.start, begin)
        colour = _FAILED_BAND if phase.failed else _BANDS[index % len(_BANDS)]
        if stop >= start:
            found.append((phase.name, colour, (start - begin) / span, (stop - start) / span))
    return found


def _labels(bands: list[tuple[str, str, float, float]]) -> str:
    if not bands:
        return '<span class="none">What moves is drawn here</span>'
    return "".join(
        f'<span title="{escape(name)}" style="left:{100 * left:.2f}%;width:{100 * width:.2f}%;background:{colour}">'
        f"{escape(name)}</span>"
        for name, colour, left, width in bands
    )


def _curve(
    seconds: Array, values: Array, span: float, top: float, colour: str, bands: list[tuple[str, str, float, float]]
) -> str:
    """Return a curve over the phases' bands; of samples that share a point, the largest counts."""
    areas = "".join(
        f'<rect x="{1000 * left:.1f}" width="{1000 * width:.1f}" height="100" fill="{fill}"/>'
        for _, fill, left, width in bands
    )
    line = ""
    if len(seconds) > 1:
        first = np.arange(0, len(seconds), math.ceil(len(seconds) / _POINTS))
        across, up = 1000.0 * seconds[first] / span, 100.0 - 96.0 * np.maximum.reduceat(values, first) / top
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(across, up, strict=True))
        line = (
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6" stroke-linejoin="round" '
            'vector-effect="non-scaling-stroke"/>'
        )
    return f'<svg viewBox="0 0 1000 100" preserveAspectRatio="none">{areas}{line}</svg>'


def _ticks(span: float) -> str:
    step = _nice(span / _TICKS)
    marks = [step * index for index in range(int(span / step + 1e-9) + 1)]
    return "".join(f'<span style="left:{100 * mark / span:.2f}%">{mark:g} s</span>' for mark in marks)


def _nice(value: float) -> float:
    """Return the least of 1, 2 and 5 times a power of ten that is no less than a value above 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(
        float(f"{factor * power:.3g}") for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= value * (1.0 - 1e-9)
    )
