"""The kinds of objects that are installed, by name."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from robosandbox.plugins import make_installed
from robosandbox.shapes.compound import FILE_KINDS
from robosandbox.shapes.shape import Shape


@cache
def shapes() -> Mapping[str, Shape]:
    """Return every shape registered under `robosandbox.shapes`, by kind; what does not load is left out with a warning."""
    return make_installed("shapes", Shape)


def shape_of(kind: str) -> Shape:
    """Return the shape of a kind, or what all of a kind of files have in common.

    Raises:
        ValueError: No such kind is installed.
    """
    found = shapes().get(kind) or FILE_KINDS.get(kind)
    if found is None:
        raise ValueError(f"{kind!r} is no kind of object; there is {', '.join(shapes())}")
    return found


def kinds_that_hold() -> frozenset[str]:
    """Return the kinds that things can be put into."""
    return frozenset(kind for kind, shape in (*shapes().items(), *FILE_KINDS.items()) if shape.holds_things)
