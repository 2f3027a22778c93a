"""Orders among things: the leftmost, the second biggest, the nearest to the bin, the big one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import Discourse, RefusedError, listed
from robosandbox.agent.language.intent import Rank, Ref
from robosandbox.agent.language.world import World, volume
from robosandbox.types import RefusalCode
from robosandbox.values import frozen
from robosandbox.world.parts import is_part
from robosandbox.world.relations import centre

Fits = Callable[[str], bool]
_NO_ROW = 0.7  # Ratio of the narrower extent of things to the wider from which they stand in no row. Chosen.
_CLEAR = 0.25  # Share of the extent by which a half must be clear of the others. Chosen.
_CENTRAL = 0.5
_FRONT_OR_BACK = frozenset({"front", "back", "rear", "hind"})
CONTRARY = {
    one: other
    for pair in (("big", "small"), ("tall", "short"), ("wide", "narrow"), ("near", "far"), ("left", "right"))
    for one, other in (pair, pair[::-1])
}
"""The other end of an order, by its key."""


@frozen
class Meaning:
    """What a description means.

    Attributes:
        ids: The objects.
        others: For an indefinite one: what would do as well, best first.
        several: A plural, even where only one fits.
    """

    ids: tuple[str, ...]
    others: tuple[str, ...] = ()
    several: bool = False


class Orders(ABC):
    """Picks from candidates by an order."""

    def __init__(self, world: World, discourse: Discourse, chosen: Mapping[str, str] | None = None) -> None:
        """Look up in a world.

        Args:
            world: Where.
            discourse: What was spoken of; noted in place.
            chosen: Answers to questions asked before: the words that were unclear, and the id that was meant.
        """
        self.world = world
        self.discourse = discourse
        self.chosen = chosen or {}

    @abstractmethod
    def one(self, ref: Ref, fits: Fits | None = None, exclude: Iterable[str] = ()) -> Meaning:
        """Return the one object that a description means; `Grounder` knows how."""

    def _ranked(self, names: list[str], rank: Rank, ref: Ref) -> list[str]:
        if len(names) == 1 and (not rank.strict or rank.nth == 1) and not rank.anchor:
            return self._plausible(names, rank, ref)
        if rank.key == "" and len(names) > 1:
            raise RefusedError(
                RefusalCode.AMBIGUOUS,
                f"“{ref.text}”: counted from where, the left or the right? I see {listed(names)}.",
                names,
                about=ref.text,
            )
        if not names:
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"“{ref.text}”: I see none.", tuple(self.world.objects))
        if rank.key == "central":
            # "the cube in the middle of the table": the one that lies there, and else the one between the others.
            (x0, x1), (y0, y1) = self.world.area
            away = {name: math.dist(self.world.at[name], ((x0 + x1) / 2.0, (y0 + y1) / 2.0)) for name in names}
            central, other, *_ = sorted(names, key=lambda name: away[name])
            if away[central] < _CENTRAL * away[other]:
                return [central]
        if rank.key in ("middle", "medium", "central"):
            return self._middle(names, rank, ref)
        if rank.key in ("top", "bottom"):
            stacked = [name for name in names if self.world.level(name) or self.world.on_top_of(name)]
            names = stacked or names
            if len(names) == 1:
                return names
        score = self._score(names, rank, ref) if rank.key else dict.fromkeys(names, 0.0)
        order = sorted(score, key=lambda name: score[name])
        if not order:
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"“{ref.text}”: I see only {listed(names)}.", names)
        if rank.nth == 0 and " next " in f" {ref.text}":
            # "the biggest, then the next biggest"
            spoken = self.discourse.spoken_of()
            return self._ranked([name for name in names if name not in spoken], rank._replace(nth=1), ref)
        if rank.nth == 0:
            return order
        if not rank.strict and ref.number == len(order):
            # "the two little balls", where there are two.
            return order
        if not rank.strict:
            return self._extreme(order, score, ref)
        index = rank.nth - 1 if rank.nth > 0 else len(order) + rank.nth
        if not 0 <= index < len(order):
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"“{ref.text}”: I see only {listed(names)}.", names)
        if rank.nth > 1 and ref.text.split()[0] in ("every", "each"):
            # "every second cube from the left": the second, the fourth, ...
            return order[rank.nth - 1 :: rank.nth]
        tied = [
            name for name in order if abs(score[name] - score[order[index]]) < 1e-3 * max(1.0, abs(score[order[index]]))
        ]
        if len(tied) > 1 and ref.determiner != "a":
            if ref.plural and index == 0:
                return tied
            raise self._ambiguous(ref, tied)
        if ref.plural and not ref.number and rank.anchor and index == 0:
            # "the cubes closest to the bin": how many of them?
            raise self._ambiguous(ref, order)
        if ref.plural and (ref.number or rank.key in ("left", "right", "near", "far")) and index == 0:
            return order[: ref.number] if ref.number else self._side(order, rank)
        return [order[index]]

    def _side(self, order: list[str], rank: Rank) -> list[str]:
        """As in "the cubes on the left": those on that half of the table."""
        sign = {"left": (0, 1.0), "right": (0, -1.0), "near": (1, -1.0), "far": (1, 1.0)}[rank.key]
        centre = (0.0, 0.1)[sign[0]]
        half = [name for name in order if (self.world.at[name][1 - sign[0]] - centre) * sign[1] > 0.01]
        return half or order[:1]

    def _score(self, names: Sequence[str], rank: Rank, ref: Ref) -> dict[str, float]:
        """Return what to sort by, the first in the order lowest."""
        world, objects = self.world, self.world.objects
        if rank.key in ("near", "far"):
            anchor = rank.anchor
            origin = world.base_xy
            if anchor:
                target = self.one(anchor).ids[0]
                origin = world.at[target]
                names = [name for name in names if name != target]
            distance = {name: math.dist(world.at[name], origin) for name in names}
            far = 1.0 if rank.key == "near" else -1.0
            if world.is_turned and not anchor and not _FRONT_OR_BACK.isdisjoint(ref.text.split()):
                # The front is the viewer's; the nearest is the robot's.
                return {name: far * world.at[name][0] for name in names}
            scores = {name: far * d for name, d in distance.items()}
            return scores
        keys: dict[str, Callable[[str], float]] = {
            "left": lambda name: -world.at[name][1],
            "right": lambda name: world.at[name][1],
            "big": lambda name: -1e3 * volume(objects[name]),
            "small": lambda name: 1e3 * volume(objects[name]),
            "tall": lambda name: -world.extents(name)[2],
            "long": lambda name: -max(world.extents(name)),
            "short": lambda name: world.extents(name)[2],
            "flat": lambda name: world.extents(name)[2],
            "wide": lambda name: -max(world.extents(name)[:2]),
            "narrow": lambda name: max(world.extents(name)[:2]),
            "top": lambda name: -self._height(name),
            "bottom": lambda name: self._height(name),
        }
        return {name: keys[rank.key](name) for name in names}

    def _height(self, name: str) -> float:
        """Return how high something is: of a part its middle, metres; of a thing how many are below it."""
        item = self.world.objects[name]
        return float(centre(item)[2]) if is_part(item) else float(self.world.level(name))

    def _extreme(self, order: list[str], score: dict[str, float], ref: Ref) -> list[str]:
        """As in "the big cube": the biggest, if it stands out; "the big cubes": those above the widest gap."""
        if ref.plural and ref.ranks and ref.ranks[-1].key == "flat":
            # Flat is what is far less high than wide.
            flat = [name for name in order if self.world.extents(name)[2] < 0.5 * max(self.world.extents(name)[:2])]
            return flat or order
        first, last = score[order[0]], score[order[-1]]
        scale = max(abs(first), abs(last), 1e-12)
        if abs(first - last) < 0.05 * scale:
            return order
        if ref.plural:
            gaps = [score[order[k + 1]] - score[order[k]] for k in range(len(order) - 1)]
            return order[: gaps.index(max(gaps)) + 1]
        return [name for name in order if abs(score[name] - first) < 0.05 * scale]

    def _plausible(self, names: list[str], rank: Rank, ref: Ref) -> list[str]:
        """A single candidate: "the small red cube" is not the biggest cube of all."""
        if (
            rank.key in ("top", "bottom")
            and rank.strict
            and not match.owner_of(names[0], self.world.objects)
            and not self.world.level(names[0])
            and not self.world.on_top_of(names[0])
        ):
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"“{ref.text}”: {names[0]} is in no stack.", names)
        if rank.strict or rank.key not in ("big", "small", "tall", "short") or not ref.nouns:
            return names
        peers = [item.id for item in match.with_noun(self.world.objects.values(), ref.nouns, several=True)]
        if len(peers) < 2 or names[0] not in peers:
            return names
        score = self._score(peers, rank, ref)
        worst, best = max(score.values()), min(score.values())
        if score[names[0]] == worst and worst - best > 0.15 * abs(best):
            raise RefusedError(
                RefusalCode.OBJECT_NOT_FOUND,
                f"“{ref.text}”: {names[0]} is there, but it is not {rank.key} beside {listed([p for p in peers if p != names[0]])}.",
                names,
            )
        return names

    def _middle(self, names: list[str], rank: Rank, ref: Ref) -> list[str]:
        if rank.key == "medium":
            order = sorted(names, key=lambda name: volume(self.world.objects[name]))
        else:
            spread = [max(at) - min(at) for at in zip(*(self.world.at[name] for name in names), strict=True)]
            axis = 1 if spread[1] >= spread[0] else 0
            order = sorted(names, key=lambda name: self.world.at[name][axis])
            across = sorted(names, key=lambda name: self.world.at[name][1 - axis])
            half = len(names) // 2
            if order[half] != across[half] and min(spread) > _NO_ROW * max(spread):
                # Neither a row nor a column: the one between left and right, if none lies between near and far as well.
                order = sorted(names, key=lambda name: self.world.at[name][1])
                if not self._lies_between(order, 1) or self._lies_between(order, 0):
                    raise self._ambiguous(ref, order)
        if len(order) % 2 == 0:
            raise self._ambiguous(ref, order)
        return [order[len(order) // 2]]

    def _lies_between(self, names: Sequence[str], axis: int) -> bool:
        """Say whether the middle one of three stands clear of the other two along an axis."""
        low, *between, high = sorted(self.world.at[name][axis] for name in names)
        clear = _CLEAR * (high - low)
        return len(between) == 1 and min(between[0] - low, high - between[0]) > clear

    def _ambiguous(self, ref: Ref, names: Sequence[str]) -> RefusedError:
        return RefusedError(
            RefusalCode.AMBIGUOUS,
            f"Which one do you mean by “{ref.text}”: {listed(list(names), 'or')}?",
            names,
            about=ref.text,
        )
