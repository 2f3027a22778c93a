"""Things told by numbers: "the 3 cm cube", "the can that is 10 cm tall", "the ball with a radius of 2 cm", "with tag 8"."""

from __future__ import annotations

from typing import NamedTuple

from robosandbox.agent.language.chart import Chart, Found
from robosandbox.agent.language.wordlist import word_set
from robosandbox.types import DetectedObject

_TOLERANCE = 0.12  # Share by which a measure that people say may be off. Chosen: people round.
_LEAST_TOLERANCE = 0.003  # Metres by which it may be off at the least. Chosen.


class Length(float):
    """A length in metres that knows in which unit it was said, so that "make that 2" can be told."""

    unit: float

    def __new__(cls, metres: float, unit: float) -> Length:
        """Make one; `unit` is in metres."""
        made = super().__new__(cls, round(metres, 12))
        made.unit = unit
        return made

    def __getnewargs__(self) -> tuple[float, float]:
        return float(self), self.unit


class Measure(NamedTuple):
    """One measure of a thing.

    Attributes:
        dimension: height, diameter, radius, "" for any of its outer measures, or tag.
        metres: How much; of a tag its number.
    """

    dimension: str
    metres: float


_ADJECTIVES = {
    "tall": "height", "high": "height", "wide": "", "long": "", "broad": "", "across": "diameter", "thick": "",
    "deep": "", "big": "", "large": "",
}  # fmt: skip
TAG_WORDS = frozenset({"tag", "apriltag", "marker", "tagged"})
_IS = word_set("is are was measures measure measuring being")


def tagged(chart: Chart, i: int) -> Found[Measure]:
    """As in "with tag 8", "carrying the tag number 8", "tagged 8"."""
    k = (
        i + 2
        if chart.text(i) in ("that", "which") and chart.text(i + 1) in ("has", "carries", "bears", "is")
        else i + 1
    )
    if k > i + 1 or chart.text(i) in ("with", "carrying", "bearing", "having"):
        k = next((end + 1 for end in chart.optional(k, "THE", "A") if chart.text(end) in TAG_WORDS), 0)
    else:
        return []
    k = k + 1 if k and chart.text(k) in ("number", "no", "id") else k
    numbered = 0 < k < chart.count and chart.tokens[k].kind == "number"
    return [(k + 1, Measure("tag", chart.tokens[k].number))] if numbered else []


def measure_before(chart: Chart, i: int) -> Found[Measure]:
    """As in "3 cm" or "10 cm tall" before a noun; nothing that an article does not stand before."""
    if i == 0 or not ({"THE", "A", "ALL", "OTHER"} & {*chart.tags[i - 1]}):
        return []
    return [(k, measure) for j, metres in _length(chart, i) for k, measure in _described(chart, j, metres, bare=True)]


def measure_after(chart: Chart, i: int) -> Found[Measure]:
    """As in "with 3 cm sides", "that is 10 cm tall", "with a diameter of 5 cm", "whose edges are 3 cm long"."""
    word = chart.text(i)
    told = i + (word in ("that", "which"))
    stated = told + (chart.text(told) in _IS)
    bare = stated > told
    return [hit for j, metres in _length(chart, stated) for hit in _described(chart, j, metres, bare=bare)]


def has_measure(item: DetectedObject, measure: Measure) -> bool:
    """Say whether an object has such a measure, about as closely as people say one."""
    if measure.dimension == "tag":
        return item.tag == measure.metres
    allowed = max(_LEAST_TOLERANCE, _TOLERANCE * measure.metres)
    return any(abs(metres - measure.metres) <= allowed for metres in _measures(item, measure.dimension))


def _length(chart: Chart, i: int) -> Found[float]:
    if i >= chart.count or chart.tokens[i].kind != "number":
        return []
    return [(j, chart.tokens[i].number * unit) for j, unit in chart.tag(i + 1, "UNIT")]


def _described(chart: Chart, j: int, metres: float, *, bare: bool) -> Found[Measure]:
    found = [(j + 1, Measure(_ADJECTIVES[chart.text(j)], metres))] if chart.text(j) in _ADJECTIVES else []
    return [*found, (j, Measure("", metres))] if bare else found


def _measures(item: DetectedObject, dimension: str) -> tuple[float, ...]:
    """Return the outer measures of an object that a dimension can mean, metres."""
    radii = [value for field, value in zip(item.shape.size_fields, item.size, strict=False) if field.endswith("radius")]
    named = {"height": [2.0 * item.shape.hull(item.size).half_extents[2]], "radius": radii}
    return tuple(named.get(dimension, item.shape.extents(item.size)))
