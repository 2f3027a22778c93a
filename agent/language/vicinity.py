"""Relations among things: on, in, left of, beside, between, bigger than, of the same colour, as they are in the world."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.intent import Rank, Ref, Relation, replace
from robosandbox.agent.language.orders import Orders
from robosandbox.types import RefusalCode
from robosandbox.world.relations import top

# Cosine of the angle between an upright axis and the vertical below which a thing lies askew: 18 degrees.
_LEVEL = 0.95


class Vicinity(Orders, ABC):
    """Tells which of some things stand in a relation to another."""

    @abstractmethod
    def _loosely(self, ref: Ref, among: Sequence[str]) -> list[str]:
        """Return everything that fits a description, with no claim that it is one; `Grounder` knows how."""

    def _related(self, names: list[str], relation: Relation, ref: Ref, *, empty: bool = False) -> list[str]:
        kind, world = relation.kind, self.world
        told = self._told_from_its_like(names, relation, ref)
        if told:
            return told
        if kind == "held":
            found = [name for name in names if name == world.held]
        elif kind == "than":
            found = self._exceeding(names, relation)
        elif kind in ("alike", "unlike"):
            (anchor,) = self.one(relation.refs[0], lambda name: True).ids
            colour = match.colour_of(world.objects[anchor])
            others = [name for name in names if name != anchor]
            found = [n for n in others if (match.colour_of(world.objects[n]) == colour) == (kind == "alike")]
        elif kind in ("holds", "lacks"):
            inner = set(self._loosely(relation.refs[0], list(world.objects)))
            found = [name for name in names if bool(inner & {*world.inside(name)}) == (kind == "holds")]
        elif kind == "empty":
            holders = [name for name in names if match.holds_things(world.objects[name])]
            found = [name for name in holders if not world.inside(name)] if holders else names
        elif kind == "full":
            found = [name for name in names if world.inside(name)]
        elif kind in ("stacked", "loose"):
            piled = [name for name in names if world.level(name) or world.on_top_of(name)]
            found = [name for name in names if (name in piled) == (kind == "stacked")]
        elif kind in ("open", "closed"):
            found = [
                name for name in names if world.objects[name].shape.opens and (name in world.opened) == (kind == "open")
            ]
        elif not relation.refs:
            found = [name for name in names if name not in world.parent and name != world.held]
        elif kind in ("on", "in", "under", "from"):
            anchors = self._anchors(relation.refs[0], loose=True)
            if relation.refs[0].nouns == ("tower",):
                if kind in ("on", "in") and (ref.plural or ref.determiner == "all"):
                    # "the blocks in the tower" are all that it is made of.
                    return [name for name in names if any(name in world.column(top) for top in anchors)]
                # "off the tower" is its top itself.
                return [name for name in names if name in anchors] or anchors
            found = [name for name in names if any(self._touches(kind, name, anchor) for anchor in anchors)]
            if not found and kind == "on":
                # What has tipped leans on it.
                found = [name for name in names if any(self._leans(name, anchor) for anchor in anchors)]
        elif kind == "between" and len(relation.refs) == 1 and relation.refs[0].other:
            # "the cube between the other two": of three; of one, those that are called so.
            rest = replace(relation.refs[0], other=False, number=None)
            of = names if len(names) > 1 else self._anchors(rest, loose=True)
            thirds = [(name, [other for other in of if other != name]) for name in names]
            found = [name for name, ends in thirds if len(ends) == 2 and self._between([name], ends)]
        elif kind == "between":
            ends = [name for part in relation.refs for name in self._anchors(part, loose=part.plural)]
            found = self._between(names, ends)
            if len(found) > 1 and ref.determiner == "the" and not (ref.plural or ref.ranks):
                # "the cup between the two cans" is the one on the way from one to the other, where all else is clear of it.
                in_line = [name for name in found if self._from_line(name, ends) <= 0]
                width = min(self.world.radius(end) for end in ends)
                clear = all(self._from_line(name, ends) > width for name in found if name not in in_line)
                found = in_line if len(in_line) == 1 and clear else found
        else:
            anchor = self._anchors(relation.refs[0], loose=False)[0]
            found = self._around(kind, [name for name in names if name != anchor], anchor)
            if len(found) > 1 and ref.determiner == "the" and not (ref.plural or ref.ranks):
                # "the cup right of the can" is the one next to it, where one clearly is.
                found.sort(key=lambda name: self._gap(name, anchor))
                straight = self._around(kind, found, anchor, narrow=True)
                near, next_ = (math.dist(self.world.at[name], self.world.at[anchor]) for name in found[:2])
                found = straight if len(straight) == 1 else found[:1] if near < 0.7 * next_ else found
        if not found and not empty:
            raise RefusedError(
                RefusalCode.OBJECT_NOT_FOUND,
                f"I see {listed(names)}, but none that fits “{ref.text}”.",
                names,
            )
        return found

    def _told_from_its_like(self, names: list[str], relation: Relation, ref: Ref) -> list[str]:
        """As in "the red cube left of the other red cube": of things alike, told by where the rest of them is."""
        other = relation.refs[0] if len(relation.refs) == 1 else ref
        sideways = relation.kind in ("left", "right", "front", "back", "beside")
        if (
            not (sideways and other.other)
            or self.discourse.mentioned
            or other.relations
            or other.ranks
            or len(names) < 2
        ):
            return []
        alike = replace(other, other=False, one=False, nouns=other.nouns or ref.nouns, names=other.names or ref.names)
        likes = {*self._loosely(replace(alike, colours=other.colours or (ref.colours if other.one else ())), names)}
        rest = {name: [like for like in likes if like != name] for name in names}
        if not (ref.plural or other.plural) and any(len(likes_) != 1 for likes_ in rest.values()):
            return []
        return [
            name
            for name in names
            if rest[name] and all(self._around(relation.kind, [name], like) for like in rest[name])
        ]

    def measured(self, names: Sequence[str], order: str, anchor: str = "") -> dict[str, float]:
        """Return what things are compared by: the one with the least of it is nearest, biggest, ... of them.

        Args:
            names: The things.
            order: The key of a rank.
            anchor: For near and far: from what; the robot where it is "".
        """
        if order not in ("near", "far"):
            return self._score(names, Rank(order), Ref(text=""))
        origin = self.world.at[anchor] if anchor else self.world.base_xy
        sign = 1.0 if order == "near" else -1.0
        return {name: sign * math.dist(self.world.at[name], origin) for name in names}

    def _exceeding(self, names: list[str], relation: Relation) -> list[str]:
        """As in "taller than the can": what comes before it in the order."""
        anchor = self.one(relation.refs[0], lambda name: True).ids[0]
        score = self.measured([*names, anchor], relation.order)
        limit = score[anchor] - 0.03 * abs(score[anchor])
        return [name for name in names if name != anchor and score[name] < limit]

    def _anchors(self, ref: Ref, *, loose: bool) -> list[str]:
        if loose and ref.determiner != "it":
            return self._loosely(ref, list(self.world.objects))
        return list(self.one(ref, lambda name: True).ids)

    def _touches(self, kind: str, name: str, anchor: str) -> bool:
        parent = self.world.parent.get(name)
        if kind == "on":
            return parent == ("on", anchor) or (parent == ("in", anchor))
        if kind == "under":
            return self.world.parent.get(anchor) == ("on", name)
        return name in self.world.inside(anchor) or (kind == "from" and parent == ("on", anchor))

    def _leans(self, name: str, anchor: str) -> bool:
        """Say whether a thing that lies askew lies partly over another."""
        item, base = self.world.objects[name], self.world.objects[anchor]
        askew = name != anchor and float(np.abs(item.pose.rotation[2]).max()) < _LEVEL
        return askew and not base.is_fixed and self._gap(name, anchor) == 0.0 and top(item) > top(base)

    def _is_straight(self, side: str, name: str, anchor: str) -> bool:
        """Say whether one thing is at most as far across a side of another as along it."""
        dx, dy = (a - b for a, b in zip(self.world.at[name], self.world.at[anchor], strict=True))
        along, across = (abs(dy), abs(dx)) if side in ("left", "right") else (abs(dx), abs(dy))
        return across <= along

    def _around(self, kind: str, names: list[str], anchor: str, *, narrow: bool = False) -> list[str]:
        kind = "back" if kind == "opposite" else kind
        ax, ay = self.world.at[anchor]
        offsets = {name: (self.world.at[name][0] - ax, self.world.at[name][1] - ay) for name in names}
        axes = {"left": (0.0, 1.0), "right": (0.0, -1.0), "front": (-1.0, 0.0), "back": (1.0, 0.0)}
        if kind in axes:
            ex, ey = axes[kind]
            along = {name: dx * ex + dy * ey for name, (dx, dy) in offsets.items()}
            across = {name: abs(dx * ey - dy * ex) for name, (dx, dy) in offsets.items()}
            found = [name for name in names if along[name] > 0.015]
            cone = [name for name in found if along[name] >= (3.0 if narrow else 1.0) * across[name]]
            return cone if narrow else cone or found
        if narrow:
            return []
        gaps = {name: self._gap(name, anchor) for name in names}
        near = sorted((name for name in names if gaps[name] < 0.15), key=lambda name: gaps[name])
        if not near and names:
            near = sorted(names, key=lambda name: gaps[name])
            near = near if gaps[near[0]] < 0.25 else []
        if len(near) > 1 and gaps[near[0]] < 0.6 * gaps[near[1]] - 0.01:
            near = near[:1]
        return near

    def _gap(self, name: str, anchor: str) -> float:
        ex, ey, _ = self.world.extents(anchor)
        fx, fy, _ = self.world.extents(name)
        (x, y), (ax, ay) = self.world.at[name], self.world.at[anchor]
        return math.hypot(max(abs(x - ax) - ex - fx, 0.0), max(abs(y - ay) - ey - fy, 0.0))

    def _from_line(self, name: str, ends: list[str]) -> float:
        """Return how far a thing's outline is from the line between two others, in metres; negative where it is on the line."""
        (x, y), (ax, ay), (bx, by) = (self.world.at[each] for each in (name, *ends))
        length = math.dist((ax, ay), (bx, by)) or 1e-9
        return abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length - self.world.radius(name)

    def _between(self, names: list[str], ends: list[str]) -> list[str]:
        if len(ends) != 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"“Between” needs two things; {listed(ends)} fit.", ends)
        (ax, ay), (bx, by) = self.world.at[ends[0]], self.world.at[ends[1]]
        length = math.dist((ax, ay), (bx, by)) or 1e-9
        found = []
        for name in names:
            x, y = self.world.at[name]
            along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length**2
            across = abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length
            if name not in ends and 0.1 < along < 0.9 and across < max(0.06, 0.35 * length):
                found.append(name)
        return found
