"""Several objects at once: groups, swaps, sorting, rows."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import get_args

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import AlreadySoError, RefusedError, listed
from robosandbox.agent.language.draft import Step
from robosandbox.agent.language.intent import (
    At,
    Command,
    Matching,
    Place,
    Ref,
    Relation,
    Table,
    replace,
)
from robosandbox.agent.language.scene_words import id_parts
from robosandbox.agent.language.stacking import Stacking
from robosandbox.types import RefusalCode, Side, SkillCall


class Arranging(Stacking):
    """The verbs that put things in an order."""

    def _put(self, command: Command) -> None:
        place = command.place
        if isinstance(place, Matching):
            bins = Relation("in", (Ref(text=place.noun, determiner="all", nouns=(place.noun,), plural=True),))
            self._sort(Command("sort", command.objects, bins), matching=True, other=place.other)
            return
        if command.tower and isinstance(place, Relation):
            self._tower([*reversed(command.tower), *place.refs, *reversed(command.objects)], command)
            return
        if isinstance(place, Relation) and self._dealt(command, place):
            return
        other = isinstance(place, Relation) and any(ref.other for ref in place.refs)
        if any(ref.determiner == "a" and ref.text.startswith(("anything", "any thing")) for ref in command.objects):
            raise RefusedError(RefusalCode.AMBIGUOUS, "Anything, or everything? Say which.")
        definite = other or all(ref.determiner != "a" for ref in command.objects)
        targets: tuple[str, ...] = ()
        if isinstance(place, Relation) and place.refs and not definite:
            targets = self._targets(place, ())
        names, several = self._objects(command, targets)
        if isinstance(place, Relation) and place.refs and definite:
            targets = self._targets(place, names)
        if (
            isinstance(place, Table)
            and names
            and all(name in self.set_free and self.world.held != name for name in names)
        ):
            # "unstack the cube and put it on the table": it lies there already.
            return
        there = bool(names and targets) and all(
            name in self.put_down and self._is_there(name, place, targets) for name in names
        )
        if there and (len(names) == 1 or all(ref.determiner == "the" for ref in command.objects)):
            # "carry it to the bin and drop it in", "all the yellow ones, so the lemon and the can": done already.
            return
        again = [name for name in names if name in (self.put_down if several else self.dealt if command.bare else ())]
        if again and not any(ref.determiner == "it" for ref in command.objects):
            raise RefusedError(
                RefusalCode.AMBIGUOUS,
                f"{listed(again)} would be put somewhere and then moved again; say it as two commands, or leave it out.",
                again,
            )
        if several:
            done = bool(self.moved) and self.moved <= {*names}
            names = tuple(name for name in names if name not in targets and not self._is_there(name, place, targets))
            if not command.order:
                names = tuple(sorted(names, key=self.world.level, reverse=True))
            if not names and done:
                # "clear the table, everything goes in the bin"
                return
            if not names:
                raise AlreadySoError("They are there already; there is nothing to do.", targets)
        if len(names) > 1 and isinstance(place, At):
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{listed(names)} do not fit in one point.", names)
        if len(names) > 1 and command.verb == "stack" and targets:
            self._pile(targets[0], names)
            return
        for name in names:
            self._put_one(name, place, targets, stack=command.verb == "stack" and self.world.held != name)
        self.put_down.update(names)
        self._theme(names)

    def _dealt(self, command: Command, place: Relation) -> bool:
        """Put so many in each of several ("a cube in each bin"), or each in one of its own ("in different bins")."""
        if place.kind not in ("in", "on", "beside", "to") or len(place.refs) != 1:
            return False
        where = place.refs[0]
        every = where.determiner == "all" and not where.other
        if not (every or where.distinct):
            return False

        def holds(name: str) -> bool:
            return place.kind not in ("in", "to") or match.holds_things(self.world.objects[name])

        try:
            targets = self.ground.many(replace(where, determiner="all"), holds).ids
        except RefusedError:
            if where.without and command.objects[0].without:
                # "a ball in each bin: the blue one in the white bin, the yellow one in the black bin": none is left.
                return True
            raise
        if len(targets) < 2:
            return False
        if every and not where.distinct:
            each = command.objects[0]
            counted = each.determiner in ("a", "bare") and not each.total and not each.share and not each.options
            if len(command.objects) != 1 or not counted or (each.plural and not each.number):
                raise RefusedError(
                    RefusalCode.AMBIGUOUS, f"Which of them goes where: {listed(targets)}?", targets, about=where.text
                )
            names = self._some(each, (each.number or 1) * len(targets), targets)
        else:
            if where.number and where.number != len(targets):
                return False
            names, _ = self._objects(command, targets)
            if len(names) > len(targets) or len(names) < 2:
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE, f"{listed(names)} do not go one by one into {listed(targets)}.", targets
                )
        share = max(1, len(names) // len(targets))
        for k, name in enumerate(names):
            self._put_one(name, place, (targets[k // share],), stack=False)
        self.put_down.update(names)
        self.dealt.update(names)
        self._theme(tuple(names))
        return True

    def _some(self, ref: Ref, count: int, barred: Sequence[str]) -> tuple[str, ...]:
        """Return that many of what fits; those that will do best."""
        found = self.ground.many(replace(ref, determiner="a", number=count, plural=True), self.world.movable, barred)
        return found.ids

    def _is_there(self, name: str, place: Place | None, targets: Sequence[str]) -> bool:
        if not isinstance(place, Relation) or not targets:
            return isinstance(place, Table) and name not in self.world.parent and self.world.held != name
        parent = self.world.parent.get(name)
        return place.kind in ("in", "to", "on") and (
            parent in (("on", targets[0]), ("in", targets[0])) or name in self.world.inside(targets[0])
        )

    def _release(self, command: Command) -> None:
        self._wait_in_the_air()
        held = self.world.held
        if not held and self.steps and self.steps[-1].call.skill in ("squeeze", "press_down", "press", "tap"):
            # "squeeze it and let it go again", "press on it for 3 seconds, then release"
            return
        if not held and self.steps and self.steps[-1].call.skill.startswith("place_"):
            # "move it over the bin and let go"
            carried = [str(step.call.arguments["object"]) for step in self.steps if step.call.skill == "pick"][-1:]
            if command.objects and self._objects(command)[0] != tuple(carried):
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE, f"The gripper has put down {listed(carried)} already.", carried
                )
            return
        if (
            not held
            and self.left_standing
            and not ({*self._objects(command)[0]} if command.objects else set()) - self.left_standing
        ):
            # "pick up the cube, turn it and put it down"
            return
        if not held:
            raise RefusedError(RefusalCode.IMPOSSIBLE, "The gripper holds nothing that I could put down.")
        try:
            names, _ = self._objects(command, fits=lambda name: name == held)
        except RefusedError:
            names, _ = self._objects(command)
        if names and names != (held,):
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"The gripper holds {held}, not {listed(names)}.", (held,))
        self._put_free(held, self.world.at[held])

    def _wait_in_the_air(self) -> None:
        """Have what was carried some way and is put down after waiting held while the hand waits, and put down then."""
        waits = [*itertools.takewhile(lambda step: step.call.skill == "wait", reversed(self.steps))]
        k = len(self.steps) - len(waits) - 1
        taken = [step.call.arguments["object"] for step in self.steps[: max(k, 0)] if step.call.skill == "pick"]
        if not waits or not taken or self.steps[k].call.skill != "place_at" or "move_by" not in self.skills:
            return
        place, (x, y) = self.steps[k], self.discourse.origins[str(taken[-1])][0]
        to = place.call.arguments
        way = {"dx": round(float(to["x"]) - x, 4), "dy": round(float(to["y"]) - y, 4)}
        if any(way.values()):
            over = Step(SkillCall(skill="move_by", arguments={axis: far for axis, far in way.items() if far}))
            self.steps[k:] = [over, *waits, place]

    def _aside(self, command: Command) -> None:
        names, _ = self._objects(command)
        for name in sorted(names, key=self.world.level, reverse=True):
            x, y = self.world.at[name]
            away = 0.2 if y >= 0 else -0.2
            self._put_free(name, (x, max(-0.3, min(0.3, y + away))))

    def _tidy(self, command: Command) -> None:
        """Into the one container there is; a container named itself is emptied."""
        objects = self.world.objects
        names, _ = self._objects(command)
        if len(names) == 1 and (not self.world.movable(names[0]) or self.world.on_top_of(names[0])):
            self._empty(names[0])
            return
        receptacles = [item for item in objects.values() if match.is_receptacle(item)]
        bins = [item.id for item in receptacles if match.has_straight_walls(item)]
        everything = any(ref.determiner == "all" and not ref.nouns and not ref.colours for ref in command.objects)
        if len(bins) == 1 and everything:
            # With bowls about as well, one bin is no longer the place for all there is.
            bins += [item.id for item in receptacles if item.id not in bins]
        waste = [name for name in bins if match.is_waste(name)]
        called = [name for name in bins if "bin" in id_parts(name)]
        if isinstance(command.place, Relation):
            # What is thrown away, or "binned": where that goes by its name.
            bins = next((found for found in (waste, called) if len(found) == 1), bins)
        if len(bins) != 1:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Where should {listed(names)} go? I see {listed(bins)}.", bins)
        left = [name for name in names if name not in self.world.inside(bins[0])]
        for name in sorted(left, key=self.world.level, reverse=True):
            self._put_in(name, bins[0])

    def _empty(self, holder: str) -> None:
        """Take what is in or on something, and put it on the table."""
        world = self.world
        if world.objects[holder].shape.opens:
            raise RefusedError(RefusalCode.UNSUPPORTED, f"Name what to take out of {holder}.", (holder,))
        content = [*world.inside(holder), *world.on_top_of(holder)]
        if not content:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"I see nothing in or on {holder}.", (holder,))
        if world.beads_in(holder):
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Into what should I pour what is in {holder}?", (holder,))
        for name in sorted(content, key=world.level, reverse=True):
            self._put_free(name, world.at[name])

    def _swap(self, command: Command) -> None:
        names, _ = self._objects(command)
        if len(names) != 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Swap which two: {listed(names)}?", names)
        self._need_empty("swap")
        world = self.world
        first, second = names
        for name in names:
            if world.parent.get(name, ("", ""))[1] in names:
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE, f"{first} and {second} stand on each other; I cannot swap them.", names
                )
        places = {name: (world.at[name], world.parent.get(name)) for name in names}
        self._put_free(first, world.at[first], ignore=())
        for name, other in ((second, first), (first, second)):
            xy, parent = places[other]
            if parent and parent[0] == "in":
                self._put_in(name, parent[1])
            elif parent:
                self._put_on(name, parent[1])
            else:
                self._put_at(name, xy, f"the place of {other}")

    def _sort(self, command: Command, *, matching: bool = False, other: bool = False) -> None:
        names, _ = self._objects(command)
        if self.world.held not in names:
            self._need_empty("sort")
        objects = self.world.objects
        containers = [item for item in objects.values() if match.is_receptacle(item)]
        if isinstance(command.place, Relation) and command.place.refs:
            ids = self.ground.many(command.place.refs[0], lambda name: match.holds_things(objects[name]), names).ids
            containers = [objects[name] for name in ids]
        colours = {name: match.colour_of(objects[name]) for name in names}
        homes = {colour: match.with_colour(containers, (colour,)) for colour in dict.fromkeys(colours.values())}
        if other:
            # "in the bin that does not match its colour"
            homes = {colour: [item for item in containers if item not in own] for colour, own in homes.items()}
        if not isinstance(command.place, Relation) and len(containers) == 1 and not all(homes.values()):
            homes = {}
        if any(homes.values()) or (isinstance(command.place, Relation) and containers):
            if not any(homes.values()) and len(containers) >= len(homes) and not matching:
                homes = {colour: [container] for colour, container in zip(homes, containers, strict=False)}
            for colour, bins in homes.items():
                if len(bins) != 1:
                    stray = [name for name in names if colours[name] == colour]
                    raise RefusedError(
                        RefusalCode.IMPOSSIBLE if not bins else RefusalCode.AMBIGUOUS,
                        f"There {'is no container' if not bins else 'are several containers'} for what is {colour}: {listed(stray)}.",
                        [item.id for item in bins] or stray,
                    )
            for name in sorted(names, key=self.world.level, reverse=True):
                target = homes[colours[name]][0].id
                if name not in self.world.inside(target):
                    self._put_in(name, target)
            return
        self._sort_on_table(names, colours)

    def _sort_on_table(self, names: Sequence[str], colours: dict[str, str]) -> None:
        """Without bins: one row per colour, side by side from the left."""
        groups = list(dict.fromkeys(colours[name] for name in sorted(names, key=lambda name: -self.world.at[name][1])))
        if len(groups) < 2:
            raise RefusedError(RefusalCode.IMPOSSIBLE, "They all have the same colour.", names)
        if len(groups) == len(names):
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"{listed(names)}: each has a colour of its own; where should which go?", names
            )
        centres = {colour: (0.1, 0.25 - 0.5 * k / (len(groups) - 1)) for k, colour in enumerate(groups)}
        for name in sorted(names, key=lambda name: (groups.index(colours[name]), -self.world.level(name))):
            self._put_free(name, centres[colours[name]])

    def _line_up(self, command: Command) -> None:
        names, _ = self._objects(command)
        if any(rel.kind in ("beside", *get_args(Side)) for ref in command.objects for rel in ref.relations):
            raise RefusedError(
                RefusalCode.UNSUPPORTED,
                f"I line things up where one of them stands, not beside others: “{command.objects[-1].text}”.",
                names,
            )
        if len(names) < 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Line {listed(names)} up with what?", names)
        self._need_empty("line things up")
        along: tuple[Side, ...] = ("front", "back")
        across: tuple[Side, ...] = ("right", "left")

        def has_room(name: str, side: Side, end: str) -> bool:
            room = self.world.radius(name) - 0.01
            return side in {found for _, found, _ in self._sides_free(name, end, (*along, *across), room)}

        others = {anchor: [name for name in names if name != anchor] for anchor in names}
        anchors = sorted(names, key=lambda name: math.dist(self.world.at[name], (0.1, 0.0)))
        anchor, sides = next(
            (
                (anchor, sides)
                for anchor in anchors
                for sides in (along, across)
                if all(any(has_room(name, side, anchor) for name in others[anchor]) for side in sides[: len(names) - 1])
            ),
            (anchors[0], (*along, *across)),
        )
        ends = {side: anchor for side in sides}
        for name in others[anchor]:
            side = next((side for side in sides if has_room(name, side, ends[side])), None)
            if side is None:
                raise RefusedError(RefusalCode.IMPOSSIBLE, f"There is no room for a row through {anchor}.", (anchor,))
            self._put_beside(name, ends[side], (side,))
            ends[side] = name
            # A row goes on along the axis on which it began.
            sides = across if side in across else along
