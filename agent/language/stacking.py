"""Towers: what goes on what, and from which end they are told."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence

from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.agent.language.placing import Placing
from robosandbox.agent.language.scene_words import id_parts
from robosandbox.types import RefusalCode


class Stacking(Placing, ABC):
    """The verbs that make and take apart towers."""

    @abstractmethod
    def _put(self, command: Command) -> None:
        """Put things somewhere; `Arranging` knows how."""

    def _stack(self, command: Command) -> None:
        place = command.place
        if place is not None and not command.order:
            self._put(command)
            return
        if not command.objects:
            movable = [name for name in self.world.objects if self.world.movable(name)]
            raise RefusedError(RefusalCode.AMBIGUOUS, f"A tower of what? I see {listed(movable)}.", movable)
        names, _ = self._objects(replace(command, objects=tuple(self._of_one_kind(command.objects))))
        targets: tuple[str, ...] = self._targets(place, names) if isinstance(place, Relation) and place.refs else ()
        names = tuple(name for name in names if name not in targets)
        on = isinstance(place, Relation) and place.kind == "on"
        if len(names) < 2 and not (names and on):
            raise RefusedError(RefusalCode.AMBIGUOUS, f"On what should {listed(names)} go?", tuple(self.world.objects))
        upwards = self._upwards(command, list(names))
        if on:
            self._pile(next(iter(targets)), upwards)
            return
        if place is not None:
            self._put_one(upwards[0], place, targets)
        self._pile(upwards[0], upwards[1:])

    def _upwards(self, command: Command, names: list[str]) -> list[str]:
        """Return what makes up a tower, the lowest first."""
        order = command.order
        if isinstance(order, tuple):
            return self._by_level(command, order, names)
        if order == "down":
            names.reverse()
        elif order is None and len(command.objects) == 1:
            # The widest below; what stands in a tower already stays.
            names.sort(key=self._breadth)
        return names

    def _by_level(self, command: Command, order: Sequence[tuple[str, Ref]], names: list[str]) -> list[str]:
        """As in "red at the bottom, then green, and blue on top"; what is not told goes where there is room for it."""
        levels = [level for level, _ in order]
        if any(ref.plural and ref.determiner != "a" for _, ref in order):
            return self._by_group(order, names)
        told: dict[int, str] = {}
        kind = command.objects[0].nouns if len(command.objects) == 1 else ()
        # "... and the other can in the middle": other than those of the levels that are named.
        for k, (level, ref) in sorted(enumerate(order), key=lambda item: item[1][1].other):
            barred = [*told.values()] if ref.other else []
            ref = replace(ref, other=False)
            if kind and ref.one and not (ref.nouns or ref.names) and self.ground.has(replace(ref, nouns=kind)):
                # "a tower of the blocks, red at the bottom": the red block.
                ref = replace(ref, nouns=kind)
            found = self.ground.one(ref, lambda name: name in names and name not in told.values(), barred).ids[0]
            counted = command.place is not None or any(each.number for each in command.objects)
            if found not in names and level in ("bottom", "top") and not counted:
                # "stack the cubes, with the can at the bottom"
                names.append(found)
            if found not in names or found in told.values():
                raise RefusedError(
                    RefusalCode.OBJECT_NOT_FOUND, f"“{ref.text}”: the tower is of {listed(names)}.", tuple(names)
                )
            told[k] = found
        whole = command.objects[0]
        if len(told) > 2 and len(command.objects) == 1 and whole.determiner == "bare" and not whole.number:
            # "a tower of cubes, red at the bottom, green in the middle, blue on top": of those.
            names = [name for name in names if name in told.values()]
        placed = [told[k] for k in range(len(order))]
        bottom, top = (
            [name for name, level in zip(placed, levels, strict=True) if level == end] for end in ("bottom", "top")
        )
        between = [name for name in placed if name not in bottom and name not in top]
        rest = [name for name in names if name not in placed]
        downwards = len(levels) > 1 and (levels[0] == "top" or levels[-1] == "bottom" or "below" in levels)
        told_on = {"next", "below"} & {*levels}
        if (
            len(bottom) > 1
            or len(top) > 1
            or (downwards and (levels[0] == "bottom" or levels[-1] == "top"))
            or (told_on and (top and bottom and rest))
            or (told_on and not downwards and "top" in levels[:-1])
        ):
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"I cannot tell the order of the tower of {listed(names)}.", tuple(names)
            )
        if told_on:
            between = between[::-1] if downwards else between
            rest.sort(key=self._breadth)
            return [*bottom, *rest, *between, *top] if downwards else [*bottom, *between, *rest, *top]
        if len(command.objects) > 1 and self._fits_ends(names, bottom, top) and not between:
            # "the brick, the block and the sponge, brick at the bottom": listed upwards.
            return names
        if len(command.objects) > 1 and self._fits_ends(names[::-1], bottom, top) and not between:
            return names[::-1]
        rest.sort(key=self._breadth)
        return [*bottom, *rest[: len(rest) // 2], *between, *rest[len(rest) // 2 :], *top]

    def _by_group(self, order: Sequence[tuple[str, Ref]], names: list[str]) -> list[str]:
        """As in "the big ones at the bottom, the small ones on top": the widest of each group below."""
        ends: dict[str, list[str]] = {"bottom": [], "top": []}
        for level, ref in order:
            found = [name for name in self.ground.many(ref, lambda name: name in names).ids if name in names]
            if not found or level not in ends or ends[level] or {*found} & {*ends["bottom"], *ends["top"]}:
                raise RefusedError(
                    RefusalCode.AMBIGUOUS, f"I cannot tell the order of the tower of {listed(names)}.", tuple(names)
                )
            ends[level] = sorted(found, key=self._breadth)
        rest = [name for name in names if name not in ends["bottom"] and name not in ends["top"]]
        return [*ends["bottom"], *sorted(rest, key=self._breadth), *ends["top"]]

    @staticmethod
    def _fits_ends(names: Sequence[str], bottom: Sequence[str], top: Sequence[str]) -> bool:
        return names[0] in (*bottom, names[0])[:1] and names[-1] in (*top, names[-1])[:1]

    def _breadth(self, name: str) -> tuple[float, float]:
        x, y, _ = self.world.extents(name)
        return -round(x * y, 6), round(math.dist(self.world.at[name], self.world.base_xy), 6)

    def _tower(self, refs: Sequence[Ref], command: Command) -> None:
        """From the bottom up; what stands right already stays."""
        names: list[str] = []
        for ref in self._of_one_kind(refs):
            names.append(self.ground.one(ref, None, names if ref.determiner != "the" else ()).ids[0])
        if len(set(names)) < len(names):
            raise RefusedError(RefusalCode.IMPOSSIBLE, "The same object cannot be in one tower twice.", names)
        self._theme(tuple(names[1:]))
        self._pile(names[0], names[1:], stack=command.verb == "stack")

    def _of_one_kind(self, refs: Sequence[Ref]) -> Sequence[Ref]:
        """As in "pink on black on brown": where the pink and the brown thing are blocks, so is the black one."""
        if len(refs) < 3 or not all(ref.one and ref.colours and not (ref.nouns or ref.names) for ref in refs):
            return refs
        found = [self.ground.many(replace(ref, plural=True), self.world.movable).ids for ref in refs]
        kinds = {
            next((part for part in reversed(id_parts(ids[0])) if part.isalpha()), "") for ids in found if len(ids) == 1
        }
        alike = [replace(ref, nouns=tuple(kinds), one=False) for ref in refs]
        return alike if len(kinds) == 1 and all(map(self.ground.has, alike)) else refs

    def _pile(self, base: str, names: Sequence[str], *, stack: bool = True) -> None:
        below = base
        for name in names:
            if self.world.parent.get(name) != ("on", below):
                self._put_on(name, below, stack=stack)
            below = name

    def _unstack(self, command: Command) -> None:
        ref = command.objects[0]
        names, _ = self._objects(command)
        group = list(names)
        if ref.nouns == ("tower",):
            below = names[0]
            while below in self.world.parent and self.world.parent[below][0] == "on":
                below = self.world.parent[below][1]
                group += [below] if below not in group else []
        high = sorted((name for name in group if self.world.level(name)), key=self.world.level, reverse=True)
        if not high:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{listed(names)}: nothing there is stacked.", names)
        for name in high:
            self._put_free(name, self.world.at[name])
