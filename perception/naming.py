"""Names of things: those that a task declares where the description fits, else by colour and shape."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np

from robosandbox.perception.colour import lab_from_rgb
from robosandbox.shapes import shape_of
from robosandbox.types import Array, ObjectKind, SceneObject
from robosandbox.values import frozen

_LIKE_KIND = 0.3  # Cost of a kind that a camera may take for the described one; units as of `_COLOUR_STEP`. Chosen.
_WRONG_KIND = 1.5  # Cost of another kind, units. Chosen: half of what no name may cost.
_COLOUR_STEP = 20.0  # CIELAB distance of colours (CIE76) that costs one unit. Chosen.
_SIZE_STEP = 0.35  # Mean logarithm of the ratio of sizes that costs one unit. Chosen: 1.4 times as large.
_WORST = 3.0  # Cost from which a thing is not the described one, units. Chosen.


@frozen(kw_only=True)
class Declared:
    """Object as a task describes it: what a person could know without a look, and no place.

    Attributes:
        id: What it is called.
        kind: Its shape.
        size: Metres, as its shape names them; empty for a mesh.
        rgb: Its colour, channels 0..1.
        tag: Number of its tag; None without one.
        tag_size: Edge of the tag's black square, metres.
    """

    id: str
    kind: ObjectKind
    size: tuple[float, ...]
    rgb: tuple[float, float, float]
    tag: int | None = None
    tag_size: float = 0.0

    @classmethod
    def of(cls, item: SceneObject) -> Declared:
        """Return the description of a scene's object."""
        described = cls(id=item.id, kind=item.kind, size=item.size, rgb=item.rgba[:3])
        return described if item.tag is None else replace(described, tag=item.tag, tag_size=item.tag_edge)


def names_for(
    seen: Sequence[tuple[ObjectKind, tuple[float, ...], Array]],
    declared: Iterable[Declared],
    taken: Collection[str],
    tags: Sequence[int | None] = (),
) -> list[str | None]:
    """Return the declared id of each seen (kind, size, rgb), None where no free description fits.

    All are assigned at once, at the least total difference in kind, colour and size. What is seen to carry one of `tags`,
    a number or None for each, is nothing that is described with another.
    """
    free = [item for item in declared if item.id not in taken]
    if not seen or not free:
        return [None] * len(seen)
    costs = np.array([[_difference(*one, item) for item in free] for one in seen])
    for row, tag in enumerate(tags):
        if tag is not None:
            costs[row, [item.tag not in (None, tag) for item in free]] = 2.0 * _WORST
    found: list[str | None] = [None] * len(seen)
    from scipy.optimize import linear_sum_assignment

    for row, column in zip(*linear_sum_assignment(np.minimum(costs, 2.0 * _WORST)), strict=True):
        if costs[row, column] < _WORST:
            found[row] = free[column].id
    return found


def new_id(colour: str, kind: ObjectKind, taken: Collection[str], tag: int | None = None) -> str:
    """Return a new id such as `red_box_1`, or `red_box_tag_9` for what carries a tag."""
    if tag is not None and (name := f"{colour}_{kind}_tag_{tag}") not in taken:
        return name
    number = 1
    while (name := f"{colour}_{kind}_{number}") in taken:
        number += 1
    return name


def colour_difference(a: Sequence[float] | Array, b: Sequence[float] | Array) -> float:
    """Return the CIELAB distance between two colours, channels 0..1 (CIE76)."""
    return float(np.linalg.norm(lab_from_rgb(np.asarray(a, dtype=float)) - lab_from_rgb(np.asarray(b, dtype=float))))


def _difference(kind: ObjectKind, size: tuple[float, ...], rgb: Array, item: Declared) -> float:
    cost = min(colour_difference(rgb, item.rgb) / _COLOUR_STEP, 2.0 * _WORST)
    if kind != item.kind:
        alike = item.kind in shape_of(kind).looks_like or kind in shape_of(item.kind).looks_like
        cost += _LIKE_KIND if alike else _WRONG_KIND
    if item.size:
        ratio = np.log(shape_of(kind).extents(size) / shape_of(item.kind).extents(item.size))
        cost += min(float(np.abs(ratio).mean()) / _SIZE_STEP, _WORST)
    return cost
