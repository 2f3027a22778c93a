"""Things that were clearly seen before: where they are half hidden their size is known, and their place alone is asked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from robosandbox.perception.doubles import same_colour
from robosandbox.perception.evidence import Evidence
from robosandbox.perception.fit import Fit, Prior, fit_near
from robosandbox.perception.groups import Group

# A known thing may explain a group so much worse than any other shape, and not worse than this.
GAIN = 0.7
_WORST = 1.5
_SPREAD = 0.00005
_NEAR = 0.03
_AS_MUCH = 0.9


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """A solid thing that was clearly seen before.

    Attributes:
        fit: Its size, and where it is thought to be.
        group: The pieces that it was last seen by.
        tangents: How many told its size.
    """

    fit: Fit
    group: Group
    tangents: int


def candidates(members: Group, known: Sequence[Known]) -> list[Known]:
    """Return the known things of a group's colour that are thought to be where it is seen."""
    low, high = members.bounds
    return [
        each
        for each in known
        if (low - _NEAR < each.fit.centre).all()
        and (each.fit.centre < high + _NEAR).all()
        and same_colour(each.group, members)
    ]


def as_one_of(near: Sequence[Known], seen: Evidence, resting: float | None) -> Fit | None:
    """Return the known thing, moved from where it was, that explains measurements best; None where none does well.

    None too where it is seen as well as it ever was, so that its size can be told anew.
    """
    fits = [
        fit_near(each.fit, seen, resting, Prior(each.fit.sizes, _SPREAD))
        for each in near
        if len(seen.rows.values) < _AS_MUCH * each.tangents
    ]
    found = min((each for each in fits if each is not None), key=lambda each: each.cost, default=None)
    return found if found is not None and found.cost < _WORST else None


def pairs(near: Sequence[Known]) -> Iterator[tuple[Fit, Fit]]:
    """Yield every two known things, the lower one first."""
    for one, other in combinations(sorted(near, key=lambda each: each.fit.top), 2):
        yield one.fit, other.fit
