"""From descriptions to objects: which things a noun phrase means in this scene, or why it means none."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import RefusedError, cannot_see, listed
from robosandbox.agent.language.intent import Ref, Relation, replace
from robosandbox.agent.language.materials import is_familiar, told
from robosandbox.agent.language.measures import Measure, has_measure
from robosandbox.agent.language.orders import CONTRARY, Fits, Meaning
from robosandbox.agent.language.scene_words import id_parts
from robosandbox.agent.language.shades import is_rather, shade_distance
from robosandbox.agent.language.things import KINDS_OF, SHAPES
from robosandbox.agent.language.truth import Truth, contradicts
from robosandbox.types import DetectedObject, RefusalCode

# Number of names that are suggested for one that is not there, and how alike a name has to be, a share.
_MOST_SUGGESTED, _ALIKE = 3, 0.4
_PLACE_WORDS = frozenset({"left", "right", "front", "back", "top", "middle", "bottom"})
_SIDEWAYS = frozenset({"left", "right", "front", "back", "near", "far"})


class Grounder(Truth):
    """Looks descriptions up in a world."""

    def one(self, ref: Ref, fits: Fits | None = None, exclude: Iterable[str] = ()) -> Meaning:
        """Return the one object that a description means.

        Raises:
            RefusedError: None fits, or several do, or several are meant.
        """
        meaning = self.many(ref, fits, exclude)
        if len(meaning.ids) > 1:
            raise self._ambiguous(ref, meaning.ids)
        return meaning

    def many(self, ref: Ref, fits: Fits | None = None, exclude: Iterable[str] = ()) -> Meaning:
        """Return the objects that a description means.

        Args:
            ref: The description.
            fits: What the verb asks of them ("a container"); only prefers, where nothing is left without.
            exclude: Ids that cannot be meant, such as the object that is to be put there.

        Raises:
            RefusedError: None fits, or several where one is meant.
        """
        barred = set(exclude)
        if ref.text in self.chosen and self.chosen[ref.text] in self.world.objects:
            meaning = Meaning((self.chosen[ref.text],))
        elif ref.determiner == "it":
            meaning = self._pronoun(ref, fits, barred)
        else:
            found = self._one_of(ref, fits, barred) if ref.options else self._candidates(ref, fits, barred)
            meaning = self._counted(ref, found)
            self._singled_out(ref, meaning)
            self._no_contents(ref, meaning, fits)
            self.discourse.mention(meaning.ids, ref.nouns or tuple(name for name in ref.names[-1:] if name.isalpha()))
            if ref.nouns or ref.colours:
                self.discourse.described.append(ref)
            return meaning
        self.discourse.mention(meaning.ids)
        return meaning

    def has(self, ref: Ref, whole: Ref | None = None, fits: Fits | None = None) -> bool:
        """Say whether anything fits a description, is one of what another means, and will do."""
        try:
            names = {name for name in self._loosely(ref, list(self.world.objects)) if fits is None or fits(name)}
            return bool(names & {*self._loosely(whole, list(self.world.objects))}) if whole else bool(names)
        except RefusedError:
            return False

    def fitting(self, ref: Ref) -> list[str]:
        """Return everything that fits a description, none if nothing does."""
        try:
            return self._loosely(ref, list(self.world.objects))
        except RefusedError:
            return []

    def stands(self, name: str, relation: Relation, ref: Ref) -> bool:
        """Say whether one thing stands in a relation that a description tells."""
        return bool(self._related([name], relation, ref, empty=True))

    def plainly_beside(self, name: str, side: str, anchors: Iterable[str]) -> bool:
        """Say whether one thing is farther to a side of others than it is across it."""
        return all(self._is_straight(side, name, anchor) for anchor in anchors)

    def plainly_on(self, name: str, side: str, anchor: str) -> bool:
        """Say whether one thing stands to that side of another, and farther so than across it."""
        return self._around(side, [name], anchor) == [name] and self._is_straight(side, name, anchor)

    def side_by_side(self, name: str, anchors: Iterable[str]) -> bool:
        """Say whether there is less room between one thing and others than the thing itself takes."""
        return all(self._gap(name, anchor) < 2 * self.world.radius(name) for anchor in anchors)

    def _one_of(self, ref: Ref, fits: Fits | None, barred: set[str]) -> list[str]:
        """As in "the can or the ball, whichever is closer": what any of the descriptions means, in order."""
        names: list[str] = []
        for option in ref.options:
            names += [name for name in self.many(option, fits, barred).ids if name not in names]
        for rank in ref.ranks:
            names = self._ranked(names, rank, ref)
        return names

    def _singled_out(self, ref: Ref, meaning: Meaning) -> None:
        """Refuse to choose by what cannot be seen: "a wooden cube", of one cube or of several."""
        ids = (*meaning.ids, *meaning.others)
        if all(told(claim, name) for claim in ref.claims for name in ids):
            return
        if len(ids) == 1:
            raise cannot_see(ref.claims)
        quoted = listed([f"“{word}”" for word in ref.claims])
        raise RefusedError(
            RefusalCode.AMBIGUOUS,
            f"I cannot see which is {quoted}; which do you mean by “{ref.text}”: {listed(ids, 'or')}?",
            ids,
            about=ref.text,
        )

    def _no_contents(self, ref: Ref, meaning: Meaning, fits: Fits | None) -> None:
        """As in "the pills", where there is a pill cup: what is in it is not the cup."""
        name, said = meaning.ids[0], (*ref.names, *ref.nouns)
        parts = id_parts(name)
        open_above = match.is_round_vessel(self.world.objects[name]) or match.NOUN_CLASS.get(parts[-1]) == "mug"
        apart = ref.plural and len(said) == 1 and ref.determiner != "all" and said[0] in parts[:-1]
        if apart and open_above and len(meaning.ids) == 1 and fits == self.world.movable:
            raise self._ambiguous(ref, (name,))

    def _claimed(self, claim: str, names: list[str], *, several: bool) -> list[str]:
        """As in "the wooden thing", "everything edible": what the names tell, where that settles it."""
        known = {name: told(claim, name) for name in names}
        fitting = [name for name in names if known[name]]
        named = [name for name in fitting if claim.removesuffix("en") in id_parts(name)]
        if len(named) == 1 and not several:
            return named
        return fitting if fitting and None not in known.values() else names

    def _pronoun(self, ref: Ref, fits: Fits | None, barred: set[str]) -> Meaning:
        groups = [ids for ids in reversed(self.discourse.themes)] + [ids for ids in reversed(self.discourse.mentioned)]
        if self.world.held and not ref.plural:
            groups.insert(0, (self.world.held,))
        as_several = self._spoken_of_as_several() if ref.plural and not ref.number else ()
        self.discourse.them = as_several or self.discourse.them
        for ids in [as_several] if as_several else groups:
            left = tuple(name for name in ids if name not in barred and (fits is None or fits(name)))
            if ref.plural:
                left = left if len(ids) > 1 or as_several else ()
                if ref.number and len(left) != ref.number:
                    continue
            elif len(left) != 1:
                continue
            if left:
                return Meaning(left, several=ref.plural)
        if ref.plural:
            together = tuple(
                dict.fromkeys(
                    name
                    for ids in self.discourse.themes
                    for name in ids
                    if name not in barred and (fits is None or fits(name))
                )
            )
            if len(together) > 1 and (ref.number is None or ref.number == len(together)):
                return Meaning(together, several=True)
        if ref.plural and ref.number:
            # "put the can on the block and then put both of them in the bin"
            last = list(dict.fromkeys(name for ids in reversed(self.discourse.mentioned) for name in ids))[: ref.number]
            if len(last) == ref.number and all(name not in barred and fits and fits(name) for name in last):
                return Meaning(tuple(reversed(last)), several=True)
        movable = [
            name
            for name in self.world.objects
            if name not in barred and (fits(name) if fits else self.world.movable(name))
        ]
        if len(movable) == 1 and not ref.plural:
            return Meaning((movable[0],))
        raise RefusedError(
            RefusalCode.AMBIGUOUS, f"What does “{ref.text}” refer to? I see {listed(movable)}.", movable, about=ref.text
        )

    def _spoken_of_as_several(self) -> tuple[str, ...]:
        """As in "pick up the pliers and put them on the box, then tap them": one thing that is called like several.

        Nothing where something else was told to be done before, so that "them" may mean both.
        """
        told = self.discourse.themes or self.discourse.mentioned[-1:]
        last = (self.world.held,) if self.world.held else told[-1] if told else ()
        moved = {name for ids in told for name in ids if self.world.movable(name)}
        alone = self.world.held or self.discourse.them == last or moved == {*last}
        return last if alone and len(last) == 1 and match.is_called_several(last[0]) else ()

    def _candidates(self, ref: Ref, fits: Fits | None, barred: set[str]) -> list[str]:
        """Return the ids that a description fits, the first choice first."""
        world = self.world
        moved = {name for name, xy in world.start_at.items() if world.at[name] != xy} | world.put_in | {world.held}
        counted = any(
            rank.key in ("middle", "central") or (rank.key in _SIDEWAYS and rank.nth not in (0, 1))
            for rank in ref.ranks
        )
        if counted and (moved - {None} or barred):
            # "the leftmost on the second from the left", "on the middle one": counted as they stood when that was said.
            now, world.at, put_in, world.put_in = world.at, world.start_at, world.put_in, set()
            try:
                return self._fitting(ref, lambda name: fits is None or name in moved | barred or fits(name), set())
            finally:
                world.at, world.put_in = now, put_in
        return self._fitting(ref, fits, barred)

    def _fitting(self, ref: Ref, fits: Fits | None, barred: set[str]) -> list[str]:
        self._known(ref)
        objects = self.world.objects
        pool = [item for item in objects.values() if item.id not in barred]
        if any(relation.kind in ("open", "closed") for relation in ref.relations):
            # "shut the one that is open": of all things only drawers are open or closed.
            pool = [item for item in pool if item.shape.opens] or pool
        several = ref.plural or ref.determiner == "all"
        found = self._named(ref, pool, several, fits)
        if ref.other:
            found = self._others(ref, found, pool, fits, barred)
        if not found:
            raise self._not_found(ref, fits, barred)
        names = [item.id for item in found]
        for relation in ref.relations:
            names = self._related(names, relation, ref)
        names = self._without(ref, names, several=several)
        if fits:
            preferred = [name for name in names if fits(name)]
            names = preferred or names
        alike = [gone.colours for gone in ref.instead if gone.one or gone.nouns == ref.nouns]
        if any(shown and len(match.with_colour([objects[n] for n in names], shown)) == len(names) for shown in alike):
            # "in the bin, not the green one", where the bin is green.
            raise self._not_found(ref, fits, barred)
        for claim in ref.claims:
            names = self._claimed(claim, names, several=several)
        if not names:
            raise self._not_found(ref, fits, barred)
        if any(rank.key in _SIDEWAYS for rank in ref.ranks):
            # "the leftmost in the rack, the rightmost in the bin": of those that stood there.
            names = [name for name in names if name not in self.world.put_in] or names
        for rank in sorted(reversed(ref.ranks), key=lambda rank: rank.strict):
            names = self._ranked(names, rank, ref)
        names = self._shaded(names, ref, several=several)
        names = [name for name in names if not contradicts(ref, name)]
        if not names:
            raise self._not_found(ref, fits, barred)
        return self._told_to_be(names, ref) if ref.told_to_be else names

    def _others(
        self, ref: Ref, found: list[DetectedObject], pool: list[DetectedObject], fits: Fits | None, barred: set[str]
    ) -> list[DetectedObject]:
        """Return those of some things that were not spoken of: "the other one".

        Raises:
            RefusedError: Nothing was.
        """
        several = ref.plural or ref.determiner == "all"
        if not self.discourse.mentioned and not self.world.held:
            raise RefusedError(
                RefusalCode.AMBIGUOUS,
                f"“{ref.text}”: other than which? I see {listed(list(self.world.objects))}.",
                list(self.world.objects),
            )
        told = self.discourse.spoken_of() | {self.world.held}
        self._second(ref, told | barred)
        left = [item for item in found if item.id not in told]
        # "near the crate ... the other container": a bowl will do, where the crate is the only one called so.
        others = [item for item in pool if item.id not in told] if match.is_general(ref.nouns) else []
        found = left or self._named(ref, others, several, fits)
        if ref.one and not ref.colours and self.discourse.described and not several:
            # "one red cube on the other": another red cube, if there is one.
            spoken = reversed(self.discourse.described) if fits == self.world.movable else self.discourse.described[-1:]
            likes = (self._named(replace(ref, names=()), found, False, None) for ref in spoken)
            found = next((like for like in likes if like), found)
        return found

    def _without(self, ref: Ref, names: list[str], *, several: bool) -> list[str]:
        """Return things but those that a description leaves out.

        Raises:
            RefusedError: It is not clear which those are, or none is left.
        """
        every = names
        for excluded in ref.without:
            gone = set(self._loosely(excluded, names))
            if excluded.determiner == "the" and not (excluded.plural or gone or self.fitting(excluded)):
                # "everything but the yellow one", where nothing is yellow; "but not the first", counted from where?
                raise self._not_found(excluded, None, set())
            counted = excluded.number or (
                1 if excluded.text.split(" ")[0] in ("one", "some", "any", "either") else None
            )
            if counted is not None and len(gone) > counted:
                # "all but one of the bottles": which one stays? "A white one" leaves out all that are white.
                raise self._ambiguous(excluded, sorted(gone))
            doubtful = [name for name in names if name not in gone and self._has_shape(name, excluded)]
            if several and doubtful:
                # "everything that is not round": a can is round seen from above.
                raise self._ambiguous(excluded, doubtful)
            kind = ref.nouns or ref.names
            if (
                excluded.text.startswith("but ")
                and excluded.determiner != "all"
                and kind
                and gone
                and not gone & {*names}
            ):
                # "tap the cubes, but the cans first" leaves no can out.
                raise RefusedError(
                    RefusalCode.UNRECOGNIZED,
                    f"“{ref.text}”: {listed(sorted(gone))} would not be among them anyway; what about it?",
                    sorted(gone),
                )
            names = [name for name in names if name not in gone]
            if several and every and not names:
                raise RefusedError(
                    RefusalCode.OBJECT_NOT_FOUND,
                    f"“{ref.text}”: that leaves none of {listed(every)}.",
                    every,
                    firm=True,
                )
        return names

    def _shaded(self, names: list[str], ref: Ref, *, several: bool) -> list[str]:
        """Return those that are light or dark, as told; of one thing the one that is so most."""
        objects = self.world.objects
        if ref.shades and several:
            # "the dark things": darker or lighter than grey.
            return [name for name in names if is_rather(objects[name], ref.colours, ref.shades[0])]
        if ref.shades and len(names) > 1:
            return [min(names, key=lambda name: shade_distance(objects[name], ref.colours, ref.shades[0]))]
        return names

    def _named(self, ref: Ref, pool: list[DetectedObject], several: bool, fits: Fits | None) -> list[DetectedObject]:
        found = self._parts_or_wholes(ref, self._described(ref, pool, several, fits))
        if not found and ref.colours and (ref.nouns or ref.names):
            # "the black bowl" is what is called so, whatever colour it is seen to have.
            found = self._described(ref, match.called_colour(pool, ref.colours), several, fits)
        return found

    def _parts_or_wholes(self, ref: Ref, found: list[DetectedObject]) -> list[DetectedObject]:
        """Of what has parts and its parts, "the cabinet" is the whole, "the top drawer of the cabinet" a part."""
        names = {item.id for item in found}
        owners = {match.owner_of(item.id, names) for item in found} - {""}
        if owners:
            told = {*ref.nouns, *ref.names}
            of_parts = any(match.is_word_for_parts(noun) for noun in ref.nouns) or any(
                told & ({*id_parts(own)} - {*id_parts(owner)})
                for owner, _, own in (item.id.rpartition(".") for item in found)
                if owner
            )
            found = [item for item in found if not (item.id in owners if of_parts else match.owner_of(item.id, names))]
        if len(found) < 2 or not all(match.owner_of(item.id, self.world.objects) for item in found):
            return found
        # "the back compartment" is the one called so, wherever it is seen from.
        said = {*ref.text.split()} & _PLACE_WORDS
        return [item for item in found if said & {*id_parts(item.id.rpartition(".")[2])}] or found

    def _described(
        self, ref: Ref, pool: list[DetectedObject], several: bool, fits: Fits | None
    ) -> list[DetectedObject]:
        found = pool
        # Colour first: "the red block" is the red cube where no block is red.
        if ref.colours:
            found = match.with_colour(found, ref.colours, ref.shades[0] if ref.shades else "")
        if ref.not_colours:
            found = [item for item in found if match.colour_of(item) not in ref.not_colours]
        if ref.names:
            compared = several or bool(ref.ranks or ref.relations)
            of_part = any(match.is_word_for_parts(noun) for noun in ref.nouns)
            found = match.with_names(found, ref.names, compared=compared, of_part=of_part)
        for shape in ref.shapes:
            shaped = [item for item in found if item.kind in SHAPES[shape]]
            # A ball is rounder than a can, and a round can is a can.
            rounder = [] if {*ref.nouns} - {"thing"} else [item for item in shaped if match.is_ball(item)]
            found = rounder or shaped
        if ref.nouns and ref.nouns != ("tower",):
            if fits is not None and ref.nouns == ("box",) and not several:
                # "in the box" means a container, if there is one that could be called so.
                preferred = [item for item in found if fits(item.id) and match.noun_fit("box", item)]
                found = preferred or found
            before = found
            found = match.with_noun(
                found, ref.nouns, several=several, count=ref.number, kinds=several or bool(ref.ranks)
            )
            # "the sand", where there is a sand cup as well: what is called so, not what it is in.
            found = [item for item in found if item.shape.is_granular and item.id in ref.nouns] or found
            if len(ref.nouns) > 1:
                # "cans and cubes": the cans first.
                fits_best = {item.id: [-match.noun_fit(noun, item) for noun in ref.nouns] for item in found}
                found = sorted(found, key=lambda item: fits_best[item.id].index(min(fits_best[item.id])))
            sorts = {match.NOUN_CLASS.get(noun, noun) for noun in ref.nouns}
            if several and found and sorts & {*KINDS_OF}:
                strange = [
                    item.id
                    for item in before
                    if item not in found and self.world.movable(item.id) and not is_familiar(item.id)
                ]
                if strange:
                    # "all the fruit": a thing that nobody here knows may be one as well.
                    raise self._ambiguous(ref, [*(item.id for item in found), *strange])
            if not found and fits is not None and all(match.NOUN_CLASS.get(noun) == "thing" for noun in ref.nouns):
                # "put the ball in the black thing"
                found = [item for item in before if fits(item.id)]
        elif ref.one and self.discourse.nouns and self._in_stacks(ref, found):
            # "put the coal wagon on the station, the tank wagon on top of that, then tap the top one": of whatever sort.
            found = self._in_stacks(ref, found)
        elif ref.one and self._contrasted(ref, found):
            found = self._contrasted(ref, found)
        elif ref.one and self.discourse.nouns:
            found = self._same_noun(found, several, fits)
        elif not ref.names and not ref.nouns:
            things = [item for item in found if self.world.movable(item.id)]
            fitting = [item for item in things if fits and fits(item.id)]
            # "in yellow" is in the yellow crate, whatever else is yellow.
            fitting = fitting or [item for item in found if fits and fits(item.id)]
            found = fitting or (things if things or fits is None else found)
        if ref.nouns == ("tower",):
            found = [item for item in found if self.world.level(item.id) and not self.world.on_top_of(item.id)]
        for measure in ref.measures:
            found = [item for item in found if has_measure(item, Measure(*measure))]
        return found

    def _in_stacks(self, ref: Ref, found: list[DetectedObject]) -> list[DetectedObject]:
        if not any(rank.key in ("top", "bottom") and rank.strict for rank in ref.ranks):
            return []
        return [item for item in found if self.world.level(item.id) or self.world.on_top_of(item.id)]

    def _contrasted(self, ref: Ref, found: list[DetectedObject]) -> list[DetectedObject]:
        """As in "the smaller white box on the bigger one": of the white boxes, if there is another."""
        last = self.discourse.described[-1] if self.discourse.described else ref
        told = last.plural or last.relations or last.other or not (last.nouns or last.names)
        if told or ref.colours or [CONTRARY.get(rank.key) for rank in ref.ranks] != [rank.key for rank in last.ranks]:
            return []
        return self._named(replace(last, ranks=()), found, True, None) if ref.ranks else []

    def _same_noun(self, found: list[DetectedObject], several: bool, fits: Fits | None) -> list[DetectedObject]:
        """As in "one" stands for the noun spoken of last that makes sense here."""
        for nouns in reversed(self.discourse.nouns):
            same = [item for item in match.with_noun(found, nouns, several=several) if fits is None or fits(item.id)]
            if same:
                return same
        return [item for item in found if self.world.movable(item.id) or fits]

    def _known(self, ref: Ref) -> None:
        if not ref.unknown:
            return
        quoted = listed([f"“{word}”" for word in ref.unknown])
        if not ref.nouns and not ref.names:
            near = _nearest_names(" ".join(ref.unknown), self.world.objects)
            raise RefusedError(
                RefusalCode.OBJECT_NOT_FOUND,
                f"I see nothing called “{ref.text.replace('namelyonly', 'only')}”; I see {listed(list(self.world.objects))}.",
                near or tuple(self.world.objects),
                sure=False,
            )
        raise RefusedError(RefusalCode.UNRECOGNIZED, f"I do not know what {quoted} means in “{ref.text}”.", ref.unknown)

    def _loosely(self, ref: Ref, among: Sequence[str]) -> list[str]:
        """Return everything that fits a description, with no claim that it is one."""
        if ref.determiner == "it":
            return list(self._pronoun(ref, None, set()).ids)
        if ref.options:
            return list(dict.fromkeys(name for option in ref.options for name in self._loosely(option, among)))
        self._known(ref)
        pool = [self.world.objects[name] for name in among]
        several = ref.plural or ref.determiner != "the"
        named = self._named(ref, pool, several, lambda name: True)
        if not named:
            named = self._named(ref, list(self.world.objects.values()), several, lambda name: True)
            if not named:
                raise self._not_found(ref, None, set())
        names = [item.id for item in named]
        for relation in ref.relations:
            names = self._related(names, relation, ref, empty=True)
        for rank in sorted(reversed(ref.ranks), key=lambda rank: rank.strict):
            names = self._ranked(names, rank, ref)
        names = self._shaded(names, ref, several=several)
        self.discourse.mention(tuple(names), ref.nouns)
        return names

    def _counted(self, ref: Ref, names: list[str]) -> Meaning:
        if ref.total is not None and len(names) != ref.total:
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"“{ref.text}”: I see {listed(names)}.", names)
        told = replace(ref, text="", number=None, plural=False)
        open_ended = told == Ref(text="", determiner="a", one=True) and not self.discourse.mentioned
        if open_ended and len(names) > (ref.number or 1):
            # "put one in the bin", "tap two of them": of what?
            raise self._ambiguous(ref, names)
        if ref.share is not None:
            if all(self.world.objects[name].shape.is_granular for name in names):
                raise RefusedError(
                    RefusalCode.UNSUPPORTED,
                    f"“{ref.text}”: I pour all that is in a vessel, and cannot measure a part.",
                    names,
                )
            count = round(ref.share * len(names))
            if abs(count - ref.share * len(names)) > 1e-6 or not count:
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE, f"“{ref.text}”: {listed(names)} do not divide into equal parts.", names
                )
            chosen = sorted(names, key=self._handiness)
            return Meaning(tuple(chosen[:count]), tuple(chosen[count:]), several=True)
        if (ref.number and ref.number > 1) or (ref.number and ref.determiner == "all"):
            count = ref.number or 1
            if len(names) < count:
                raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"“{ref.text}”: I see only {listed(names)}.", names)
            if len(names) > count:
                if ref.determiner in ("the", "all"):
                    raise self._ambiguous(ref, names)
                chosen = sorted(names, key=self._handiness)
                return Meaning(tuple(chosen[:count]), tuple(chosen[count:]), several=True)
            return Meaning(tuple(names), several=True)
        if ref.determiner == "all" or (ref.plural and ref.determiner in ("the", "bare")):
            return Meaning(tuple(names), several=True)
        if ref.plural and ref.text.startswith("any ") and not ref.number:
            # "any red or green cubes": as many as there are.
            return Meaning(tuple(names), several=True)
        if ref.plural and not (ref.number == 1 and ref.determiner == "a"):
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"“{ref.text}”: how many, and which? I see {listed(names)}.", names
            )
        if ref.determiner == "a":
            chosen = sorted(names, key=self._handiness)
            return Meaning((chosen[0],), tuple(chosen[1:]))
        if len(names) > 1:
            recent = [ids[0] for ids in reversed(self.discourse.mentioned) if len(ids) == 1 and ids[0] in names]
            if (
                not recent
                or not ref.nouns
                or ref.colours
                or ref.ranks
                or ref.relations
                or ref.other
                or ref.determiner != "the"
            ):
                raise self._ambiguous(ref, names)
            # "the ball nearest the white tray ... that tray": the one spoken of.
            return Meaning((recent[0],))
        return Meaning((names[0],))

    def _handiness(self, name: str) -> tuple[bool, bool, float, str]:
        """Any will do: rather one with nothing on it, on the table, near the robot."""
        world = self.world
        return (
            bool(world.on_top_of(name)),
            name in world.parent,
            round(math.dist(world.at[name], world.base_xy), 6),
            name,
        )

    def _not_found(self, ref: Ref, fits: Fits | None, barred: set[str]) -> RefusedError:
        names = [name for name in self.world.objects if name not in barred]
        words = {*ref.nouns, *ref.colours, *ref.names}
        near = [name for name in names if words & {*id_parts(name), match.colour_of(self.world.objects[name])}]
        near = near or list(_nearest_names(ref.text, names)) or names
        return RefusedError(
            RefusalCode.OBJECT_NOT_FOUND, f"I see no {bare_name(ref.text)}; I see {listed(names)}.", near
        )


def bare_name(text: str) -> str:
    """Return what was said of a thing without its article."""
    first, _, rest = text.partition(" ")
    if first in ("all", "both", "each", "every") and rest:
        return bare_name(rest)
    return rest if first in ("the", "a", "an") and rest else text


def _nearest_names(word: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return the names that look most like a word, best first."""
    from rapidfuzz import process
    from rapidfuzz.distance import Indel

    found = process.extract(word, list(names), scorer=Indel.normalized_similarity, limit=_MOST_SUGGESTED)
    return tuple(name for name, score, _ in found if score > _ALIKE)
