"""Shape priors: an object that was clearly seen before keeps its size where it is half hidden; only its place is fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from robosandbox.perception.evidence import ShapeEvidence
from robosandbox.perception.fit import Fit, Prior, fit_near
from robosandbox.perception.frames import FrameSet
from robosandbox.perception.free_space import seen_through
from robosandbox.perception.groups import Group, same_colour
from robosandbox.values import frozen

# Cost by which a known size may be worse than any other, because it was well seen before (units: mean squared residual over
# standard deviation). Chosen.
GAIN = 0.7
# Cost from which a known size does not explain what is seen (units: mean squared residual over standard deviation). Chosen.
WORST = 1.5
AS_MUCH = 0.9  # Share of the tangents that told a size from which a new look tells as much. Chosen.
_SPREAD = 0.00005  # Standard deviation of a known size, metres. Chosen so small that it stays.
NEAR = 0.03  # Metres from its place within which a known thing may be what is seen. Chosen.


@frozen(eq=False)
class KnownShape:
    """A solid thing that was clearly seen before.

    Attributes:
        fit: Its size, and where it is thought to be.
        group: The pieces that it was last seen by.
        tangents: How many told its size.
        lost: Whether it is known not to be there any more.
    """

    fit: Fit
    group: Group
    tangents: int
    lost: bool = False


def candidates(members: Group, known: Sequence[KnownShape]) -> list[KnownShape]:
    """Return the known things of a group's colour that are thought to be where it is seen, or over it: what is let go of falls."""
    low, high = members.bounds
    return [
        each
        for each in known
        if (low - NEAR < each.fit.centre).all()
        and (each.fit.centre[:2] < high[:2] + NEAR).all()
        and same_colour(each.group, members)
    ]


def is_gone(known: KnownShape, frames: FrameSet) -> bool:
    """Tell whether a known thing is seen not to be where it was thought to be: pushed, or taken away."""
    return known.lost or seen_through(known.fit, frames)


def best_known(options: Sequence[KnownShape], seen: ShapeEvidence, resting: float | None, worst: float) -> Fit | None:
    """Return the known thing, moved from where it was, that explains measurements best; None where none does well.

    None too where it is seen as well as it ever was, so that its size can be told anew.

    Args:
        options: Which it may be.
        seen: The measurements.
        resting: As for `fit`.
        worst: What its cost must be below.
    """
    fits = [
        fit_near(each.fit, seen, resting, Prior(each.fit.sizes, _SPREAD))
        for each in options
        if len(seen.rows.values) < AS_MUCH * each.tangents
    ]
    found = min((each for each in fits if each is not None), key=lambda each: each.cost, default=None)
    return found if found is not None and found.cost < worst else None


def pairs(near: Sequence[KnownShape]) -> Iterator[tuple[Fit, Fit]]:
    """Yield every two known things, the lower one first."""
    for one, other in combinations(sorted(near, key=lambda each: each.fit.top), 2):
        yield one.fit, other.fit
