"""Relation of what was in one container and is in another."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.types import DetectedObject
from robosandbox.world.relations import MeasuredRelation, inside, loose

# Share that sums of whole things may be off by; chosen far above floating-point error and far below one thing in a
# thousand.
_ROUNDING = 1e-9


def poured(
    contents: Sequence[tuple[str, int]],
    objects: Sequence[DetectedObject],
    source: DetectedObject,
    target: DetectedObject,
    *,
    min_fraction: float,
    max_spilled: float,
) -> MeasuredRelation:
    """Tell whether what was in one container is in another.

    Args:
        contents: What was in it, as `contents` says; nothing is never poured.
        objects: Everything as it is now.
        source: What it was in, as it is now.
        target: What it is to be in.
        min_fraction: Of the contents, that must be in the target.
        max_spilled: Of the contents, that may be in neither.
    """
    parts = {(item.id, k): part for item in objects for k, part in enumerate(loose(item))}
    known = [parts[key] for key in contents if key in parts]
    count = len(contents)
    arrived = sum(inside(part, target).holds for part in known)
    stayed = sum(inside(part, source).holds for part in known)
    fraction, spilled = arrived / max(count, 1), (count - arrived - stayed) / max(count, 1)
    # Fractions of whole things: 0.02 of 50 is 1, whatever the last bit says.
    holds = count > 0 and fraction >= min_fraction - _ROUNDING and spilled <= max_spilled + _ROUNDING
    return MeasuredRelation(holds, {"fraction": fraction, "spilled": spilled, "count": float(count)})
