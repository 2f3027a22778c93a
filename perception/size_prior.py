"""Sizes that are known before an outline is looked at: as the task describes things, or as they were clearly seen before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import permutations

import numpy as np

from robosandbox.perception.fit import Fit
from robosandbox.perception.naming import Declared
from robosandbox.perception.recognize import kind_of_form
from robosandbox.perception.shape_prior import KnownShape
from robosandbox.perception.support import Form
from robosandbox.shapes import shape_of
from robosandbox.shapes.hull import BoxHull, CylinderHull, Hull, SphereHull
from robosandbox.types import Array, ObjectKind
from robosandbox.values import frozen


@frozen(eq=False)
class SizePrior:
    """A shape whose size is known: described by the task, or clearly seen before.

    Attributes:
        kind: What it is.
        form: How it would lie.
        sizes: As in `Fit`, metres.
        chroma: Shares of red and green of its colour, (2,).
        place: Where it was last; None where that is not known.
    """

    kind: ObjectKind
    form: Form
    sizes: Array
    chroma: Array
    place: Fit | None = None

    @staticmethod
    def of_declared(declared: Iterable[Declared]) -> Iterator[SizePrior]:
        """Yield the ways in which described things can lie; meshes have none."""
        for item in declared:
            shape = shape_of(item.kind)
            if not item.size or shape.opens or shape.is_granular:
                continue
            rgb = np.array(item.rgb)
            for form, sizes in _ways(shape.hull(item.size), tips=not shape.holds_things):
                yield SizePrior(item.kind, form, sizes, rgb[:2] / max(float(rgb.sum()), 1e-6))

    @staticmethod
    def of_known(known: Iterable[KnownShape]) -> Iterator[SizePrior]:
        """Yield the shapes that were clearly seen before."""
        for item in known:
            chroma = np.median([segment.chroma for segment in item.group.segments], axis=0)
            place = None if item.lost else item.fit
            yield SizePrior(kind_of_form(item.fit.shape), item.fit.shape, item.fit.sizes, chroma, place)


def _ways(hull: Hull, *, tips: bool) -> Iterator[tuple[Form, Array]]:
    """Yield the forms and sizes that a hull has lying on each of its sides."""
    match hull:
        case BoxHull(size=half):
            for sizes in sorted(set(permutations(map(float, half)))):
                if tips or sizes[2] == half[2]:
                    yield "box", np.array(sizes)
        case CylinderHull(size=half):
            yield "cylinder", np.array(half)
            if tips:
                yield "lying", np.array(half)
        case SphereHull(size=half):
            yield "sphere", np.array(half)
        case _:
            return
