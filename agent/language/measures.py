"""Things told by numbers: "the 3 cm cube", "the can that is 10 cm tall", "the ball with a radius of 2 cm", "with tag 8"."""

from __future__ import annotations

from typing import NamedTuple

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

    def __reduce__(self) -> tuple[type[Length], tuple[float, float]]:
        return Length, (float(self), self.unit)


class Measure(NamedTuple):
    """One measure of a thing.

    Attributes:
        dimension: height, diameter, radius, "" for any of its outer measures, or tag.
        metres: How much; of a tag its number.
    """

    dimension: str
    metres: float


def has_measure(item: DetectedObject, measure: Measure) -> bool:
    """Say whether an object has such a measure, about as closely as people say one."""
    if measure.dimension == "tag":
        return item.tag == measure.metres
    allowed = max(_LEAST_TOLERANCE, _TOLERANCE * measure.metres)
    return any(abs(metres - measure.metres) <= allowed for metres in _measures(item, measure.dimension))


def _measures(item: DetectedObject, dimension: str) -> tuple[float, ...]:
    """Return the outer measures of an object that a dimension can mean, metres."""
    radii = [value for field, value in zip(item.shape.size_fields, item.size, strict=False) if field.endswith("radius")]
    named = {"height": [2.0 * item.shape.hull(item.size).half_extents[2]], "radius": radii}
    return tuple(named.get(dimension, item.shape.extents(item.size)))
