"""The inside of a noun phrase: determiner, adjectives, noun or name."""

from __future__ import annotations

from typing import Any

from robosandbox.agent.language.adjectives import CLAIMS, DISTINCT, FEELINGS, MEASURES, SHAPES, TINTS
from robosandbox.agent.language.chart import Found, rule
from robosandbox.agent.language.intent import Determiner, Rank, Ref, replace
from robosandbox.agent.language.match import CANONICAL_COLOUR, NOUN_CLASS, is_word_for_parts
from robosandbox.agent.language.measures import measure_before
from robosandbox.agent.language.modifiers import PLACE_RANKS, STATES, Modifiers, coloured_too
from robosandbox.agent.language.speech import CONDITIONS, GRAMMAR_WORDS, QUESTIONS
from robosandbox.agent.language.synonyms import SAME_AS
from robosandbox.agent.language.things import ABSENT_NOUNS, COLOURS
from robosandbox.agent.language.verbs import UNSUPPORTED_VERBS
from robosandbox.agent.language.wordlist import word_set


class Nouns(Modifiers):
    """The rules for determiners, adjectives, nouns and names."""

    def _suffix(self, i: int) -> str:
        """Return the letter or number that ends an id, as the id has it; "" for none."""
        part = self._part(i) if i < len(self.tokens) else ""
        return part if part in self.words.parts and (len(part) == 1 or part.isdigit()) else ""

    def _numeral(self, i: int) -> Found[Ref]:
        """As in "blocks 1, 2 and 3, with 3 at the bottom": a number alone that ends an id."""
        number = self._suffix(i)
        told = number.isdigit() and self.text(i) != "one"
        alone = told and not self.tag(i + 1, "UNIT") and not self.tag(i + 1, "NOUN")
        return [(i + 1, Ref(text=self.said(i, i + 1), names=(number,)))] if alone else []

    @rule
    def _determiners(self, i: int) -> Found[Ref]:
        found: Found[Ref] = []

        def add(j: int, determiner: Determiner, **more: Any) -> None:
            found.append((j, Ref(text="", determiner=determiner, **more)))

        add(i, "bare")
        here = self.tags[i] if i < self.count else {}
        for tag, determiner in _DETERMINERS if not _DETERMINING.isdisjoint(here) else ():
            for j, _ in self.tag(i, tag):
                found.append((j, Ref(text=self.text(i), determiner=determiner)))
                for k, number in self._count(j):
                    add(k, determiner, number=number, plural=number > 1)
                for k, _ in self.tag(j, "OTHER") if self.text(i) != "each" else []:
                    add(k, "the" if determiner != "all" else "all", other=True)
                    for m, number in self._count(k):
                        add(m, "the", other=True, number=number, plural=number > 1)
        for j, _ in here.get("BOTH", ()):
            add(j, "all", number=2, plural=True)
        for j, number in self._count(i):
            add(j, "bare", number=number, plural=number > 1)
            if self.text(j) == "of":
                # "two of the balls": any two.
                for k in self.optional(j + 1, "THE"):
                    if k > j + 1:
                        add(k, "a", number=number, plural=number > 1)
                        for m, total in self._count(k):
                            if total > number:
                                add(m, "a", number=number, plural=True, total=total)
        for j, _ in here.get("ONE_OF", ()):
            for k in self.optional(j, "THE"):
                for m in (k, *(end for end, _ in self._count(k))):
                    add(m, "a", number=1)
        if self.text(i) == "another":
            add(i + 1, "a", other=True)
        if self.text(i) == "half":
            # "half of the cubes", "half the cubes"
            start = i + 2 if self.text(i + 1) == "of" else i + 1
            for k in self.optional(start, "THE", "ALL"):
                if k > start:
                    add(k, "a", share=0.5, plural=True)
        exact = i + 1 if self.text(i) in _EXACTLY else i + 2 if self.said(i, i + 2) == "at least" else 0
        if exact:
            found += [(j, ref) for j, ref in self._determiners(exact) if j > exact]
        return found

    def _count(self, i: int) -> Found[int]:
        token = self.tokens[i] if i < len(self.tokens) else None
        if token and token.kind == "number":
            return [(i + 1, int(token.number))] if token.number == int(token.number) and 0 < token.number < 100 else []
        return [(j, int(n)) for j, n in self.tag(i, "NUM") if n >= 2 and n == int(n) and self.text(i) != "a"]

    def opens_none(self, i: int) -> bool:
        """Say whether a word is one of the most common that begin no noun, unless an id has it."""
        return self.texts[i] in _NO_NOUNS and self.texts[i] not in self.words.parts

    def _head(self, i: int, base: Ref) -> Found[Ref]:
        """Adjectives, then a noun, an id, or nothing where the adjectives say enough."""
        found: Found[Ref] = []
        for j, _ in self.tag(i, "REST"):
            if base.determiner in ("the", "all"):
                ref = replace(base, determiner="all", plural=True, other=True)
                # "the others" are of the same kind; the rest is everything.
                found.append((j, replace(ref, one=self.text(i) in ("others", "other") or self.text(j - 1) == "ones")))
                if self.text(j) == "of":
                    for k in self.optional(j + 1, "THE"):
                        found += self._noun(k, ref)
        for j, ref in self._adjectives(i, base, 0):
            found += self._noun(j, ref)
            # "the left" alone is a place, not a thing.
            ranked = any(rank.key not in PLACE_RANKS or rank.nth != 1 for rank in ref.ranks)
            # "the leftmost" alone is a thing, but in "the closest bin" closest is none.
            outmost = any(text in _OUTMOST or text.endswith("most") for text in self.texts[i:j])
            ranked = ranked or (outmost and not self.tag(j, "NOUN"))
            part = self.text(j) == "of" and any(rank.key in ("near", "far") for rank in ref.ranks)
            bare = ranked or part or ref.colours or ref.not_colours or ref.unknown
            pointed = base.other or base.determiner == "all" or (base.number and base.determiner != "bare")
            # "red first" tells an order.
            named = not (base.determiner == "bare" and j > i + 1 and self.tag(j - 1, "ORDINAL"))
            # "a little" is how much; "the lemon" is a lemon and nothing yellow.
            little = base.determiner == "a" and self.text(j - 1) == "little" and not ref.colours
            thing = ref.colours and (self.text(j - 1) in _NAMES_OF_THINGS or self.text(j - 1) in self.words.hues)
            named = named and not (little or thing)
            # "the yellow and white mug" is called so.
            named = named and not any("and" in said and self._says(i, said) for said, _ in self._stems(i))
            if (j > i and bare and named) or (j == i and pointed and i > 0):
                found.append((j, replace(ref, one=True)))
        return found

    def _adjectives(self, i: int, ref: Ref, depth: int) -> Found[Ref]:
        found: Found[Ref] = [(i, ref)]
        if depth > 5:
            return found
        start = i
        if depth and self.text(i) in (",", "and") and not any(rank.strict for rank in ref.ranks):
            start = i + 1
        step: Found[Ref] = []
        for j, colour in self.tag(start, "COLOUR") if not (start > i and ref.colours) else []:
            for k in self.optional(j, "COLOURED"):
                step.append((k, coloured_too(ref, (colour,))))
                if self.text(k) == "or" and not ref.colours:
                    # "any red or green cubes"
                    step += [(m, replace(ref, colours=(colour, other))) for m, other in self.tag(k + 1, "COLOUR")]
        if self.text(start) in ("coloured", "colored", "colourful", "colorful"):
            # "the three coloured cubes": whatever is not black, white or grey.
            step.append((start + 1, replace(ref, not_colours=(*ref.not_colours, *_COLOURLESS))))
        if start < self.count and not _ADJECTIVES.isdisjoint(self.tags[start]):
            step += self._adjective(start, ref)
        if self.text(start) in STATES:
            step.append((start + 1, replace(ref, relations=(*ref.relations, STATES[self.text(start)]))))
        if start < self.count and self.tokens[start].kind == "number":
            step += [(j, replace(ref, measures=(*ref.measures, measure))) for j, measure in measure_before(self, start)]
        word = self.text(start)
        if word in SHAPES and not any(end > start + 1 for end, _ in self.tag(start, "NOUN")):
            step.append((start + 1, replace(ref, shapes=(*ref.shapes, word))))
        if word in FEELINGS:
            step.append((start + 1, replace(ref, felt=(*ref.felt, word))))
        if word in TINTS and (word not in CLAIMS or self.text(start + 1) == "pink") and self.tag(start + 1, "COLOUR"):
            step.append((start + 1, ref))
        if word in DISTINCT:
            step.append((start + 1, replace(ref, distinct=True)))
        verbal = word in UNSUPPORTED_VERBS or "VERB" in (self.tags[start] if start < len(self.tokens) else {})
        if word in CLAIMS and word not in self.words.parts and not (verbal and ref.determiner == "bare"):
            step.append((start + 1, replace(ref, claims=(*ref.claims, word))))
        elif start < len(self.tokens) and self._is_strange(start):
            step.append((start + 1, replace(ref, unknown=(*ref.unknown, self.tokens[start].raw))))
        for j, nexts in step:
            found += self._adjectives(j, nexts, depth + 1)
        return found

    def _adjective(self, start: int, ref: Ref) -> Found[Ref]:
        """One adjective of size, shade or order, or "non-"."""
        step: Found[Ref] = []
        for j, shade in self.tag(start, "SHADE"):
            step.append((j, replace(ref, shades=(*ref.shades, shade))))
        for j, size in self.tag(start, "SIZE"):
            step.append((j, replace(ref, ranks=(*ref.ranks, Rank(size, strict=False)))))
        for j, key in self.tag(start, "SUPER"):
            step.append((j, replace(ref, ranks=(*ref.ranks, Rank(key)))))
        for j, key in self.tag(start, "POS"):
            step.append((j, replace(ref, ranks=(*ref.ranks, Rank(key)))))
        # "next to the tile" names no next one.
        for j, index in self.tag(start, "ORDINAL") if self.said(start, start + 2) != "next to" else ():
            step.append((j, replace(ref, ranks=(*ref.ranks, Rank("", index)))))
            for tag in ("SUPER", "FROM"):
                for k, key in self.tag(j, tag):
                    step.append((k, replace(ref, ranks=(*ref.ranks, Rank(key, index)))))
        for j, _ in self.tag(start, "NON"):
            for k, colour in self.tag(j, "COLOUR"):
                step.append((k, replace(ref, not_colours=(*ref.not_colours, colour))))
        for j, _ in self.tag(start, "NON"):
            for k, (noun, phrase, many) in self.tag(j, "NOUN") if self.text(start) == "non" else []:
                # "all non-cubes"
                kind = Ref(text=self.said(j, k), determiner="all", nouns=(phrase,), plural=True)
                if noun != "one" and many:
                    step.append((k, replace(ref, nouns=("thing",), plural=True, without=(*ref.without, kind))))
        for j, _ in self.tag(start, "OTHER"):
            step.append((j, replace(ref, other=True)))
        return step

    def _noun(self, i: int, ref: Ref) -> Found[Ref]:
        found: Found[Ref] = []
        if i >= self.count or self.opens_none(i):
            return found
        token = self.tokens[i]
        if (
            token.text in MEASURES
            and self.text(i + 1) == "of"
            and token.text not in self.words.parts
            and i + 2 < len(self.tokens)
        ):
            # "the roll of tape"
            found += [(j, named) for j, named in self._noun(i + 2, ref) if not named.unknown]
        elif token.text.endswith("s") and token.text[:-1] in MEASURES and self.text(i + 1) == "of":
            # "both balls of wool"
            found += [(j, replace(named, plural=True)) for j, named in self._noun(i + 2, ref) if not named.unknown]
        nouns, absent = self.tags[i].get("NOUN", ()), self.tags[i].get("ABSENT", ())
        called = (
            any(phrase == token.text for _, (_, phrase, _) in nouns) or (token.text, False) in dict(absent).values()
        )
        if token.kind == "id" and not called:
            # What is called by a noun of its own is found by that.
            found.append((i + 1, replace(ref, names=(token.text,))))
        if token.text in self.words.hues:
            # "the orange" is the orange, and not whatever is orange.
            named = replace(ref, names=(token.text,))
            found += self._suffixed(i + 1, named) if self.text(i + 1) not in _THINGS else []
        for j, (noun, phrase, plural) in nouns:
            phrase = "tower" if noun == "tower" and phrase not in self.words.parts else phrase
            own = token.text in self.words.single and (phrase == token.text or phrase not in self.words.parts)
            plural = plural and not own
            many = (ref.plural or plural) and ref.number != 1
            named = replace(ref, nouns=(phrase,) if noun != "one" else (), one=noun == "one", plural=many)
            found += self._suffixed(j, named)
            if self.text(j) in ("or", "and") and plural:
                for k, (_, other, also) in self.tag(j + 1, "NOUN"):
                    if also:
                        found.append((k, replace(named, nouns=(phrase, other))))
        for j, (noun, plural) in absent:
            found += self._suffixed(j, replace(ref, nouns=(noun,), plural=ref.plural or plural))
        letter = token.text in self.words.parts and len(token.text) == 1 and token.text.isalpha()
        if letter and (token.text not in ("a", "i") or self.text(i + 1) in _AFTER_A_NAME):
            # "stack B on C"
            found.append((i + 1, replace(ref, names=(token.text,))))
        in_full: Found[Ref] = [
            (i + len(spoken), replace(ref, names=(name,)))
            for spoken, name in self.words.by_first_word.get(self._part(i), ())
            if tuple(map(self._part, range(i, min(i + len(spoken), len(self.tokens))))) == spoken
        ]
        in_full += [(i + len(said), replace(ref, names=stem)) for said, stem in self._stems(i) if self._says(i, said)]
        j = i
        parts: list[str] = []
        pointed = i > 0 and (ref.determiner != "bare" or bool(ref.colours or ref.ranks))
        while j < len(self.tokens) and self._is_name(j, pointed=pointed) and len(parts) < 4:
            parts.append(_singular(self.tokens[j].text, self.words.parts))
            j += 1
            plural = ref.plural or self.tokens[j - 1].text not in self.words.parts
            # In "push it to the left" nobody names left_box; "the eraser" is found by its noun.
            same = len(parts) == 1 and (parts[0], plural) in dict(absent).values()
            if not same and not all(part in _SIDES for part in parts):
                found += self._suffixed(j, replace(ref, names=tuple(parts), plural=plural))
                if not plural and parts[-1].endswith("s") and not parts[-1].endswith("ss"):
                    # Of seeds_bean and seeds_carrot "the seeds" are both.
                    found.append((j, replace(ref, names=tuple(parts), plural=True)))
            for k, (noun, phrase, many) in self.tags[j].get("NOUN", ()) if j < self.count else ():
                if noun == "one":
                    found.append((k, replace(ref, names=tuple(parts), plural=ref.plural or many)))
                    continue
                found += self._suffixed(k, replace(ref, names=tuple(parts), nouns=(phrase,), plural=ref.plural or many))
            for k, (noun, many) in self.tags[j].get("ABSENT", ()) if j < self.count else ():
                if noun in SAME_AS and self.text(j) not in self.words.parts:
                    # "the rubber ducky" for what is called rubber_duck
                    found += self._suffixed(
                        k, replace(ref, names=tuple(parts), nouns=(noun,), plural=ref.plural or many)
                    )
            if (
                self.text(j) in _PACKED
                and self.text(j) not in self.words.parts
                and self.text(j - 1) in self.words.parts
            ):
                # "the jam jar", where the jam is called just that; "the scoops stand" tells how they are.
                found.append((j + 1, replace(ref, names=tuple(parts), plural=ref.plural)))
        if in_full:
            # Said in full it means that one; other readings of the same words only multiply.
            ends = {end for end, _ in in_full}
            found = [*in_full, *(item for item in found if item[0] not in ends)]
        if not ref.colours:
            # "the block green", as some say it
            found += [
                (k, replace(named, colours=(colour,)))
                for j, named in list(found)
                if NOUN_CLASS.get((named.nouns or ("",))[0]) != "tower"
                for k, colour in self.tag(j, "COLOUR")
                if k == j + 1 and not (self.tag(k, "NOUN") or self.text(k) in self.words.parts)
            ]
        if self._is_strange(i):
            found.append((i + 1, replace(ref, unknown=(*ref.unknown, token.raw))))
        return found

    def _stems(self, i: int) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
        """Return names in full that begin with a word, as they are said, with the words of the id."""
        return self.words.stems.get(self._part(i), []) if self.words.stems and i < self.count else []

    def _says(self, i: int, said: tuple[str, ...]) -> bool:
        return tuple(map(self._part, range(i, min(i + len(said), len(self.tokens))))) == said

    def _part(self, i: int) -> str:
        """Return a word as an id would have it: numbers in digits."""
        if i not in self.id_words:
            self.id_words[i] = self._id_word(i)
        return self.id_words[i]

    def _id_word(self, i: int) -> str:
        token = self.tokens[i]
        if token.kind == "number":
            return str(int(token.number)) if token.number.is_integer() else token.text
        return next(
            (str(int(n)) for _, n in self.tag(i, "NUM") if n >= 1 and token.text not in ("a", "an")), token.text
        )

    def _is_strange(self, i: int) -> bool:
        """Say whether nobody knows the word: it may name a thing that is not there."""
        token = self.tokens[i]
        known = token.text in self.words.parts or token.text in _FUNCTION_WORDS or token.text in UNSUPPORTED_VERBS
        return token.kind == "word" and len(token.text) > 1 and not self.tags[i] and not known

    def _is_name(self, i: int, *, pointed: bool = False) -> bool:
        """Say whether a word is part of an id; after "the", even one that elsewhere leaves something out ("the bar")."""
        token = self.tokens[i]
        if token.kind != "word" or len(token.text) < 2:
            return False
        single = _singular(token.text, self.words.parts)
        return single in self.words.parts and (_NOT_POINTED_AT if pointed else _NOT_NAMES).isdisjoint(self.tags[i])

    def _suffixed(self, j: int, ref: Ref) -> Found[Ref]:
        """As in "block b", "cube number 2": a letter or number that ends an id."""
        found = [(j, ref)]
        if self.text(j) in _THINGS:
            # "the hammer thing"
            found.append((j + 1, ref))
        of = j + 2 if self.said(j, j + 2) == "of the" else j + 1
        filling = _singular(self.text(of), self.words.parts) if self.text(j) == "of" else ""
        if ref.nouns and is_word_for_parts(ref.nouns[0]) and self.text(j) == "of":
            # "the middle layer of the drawer": of what has it
            found += [(end, ref) for end, (noun, _, many) in self.tag(of, "NOUN") if noun == "drawer" and not many]
        fillings: tuple[str, ...] = (filling,)
        while filling in self.words.parts and ref.nouns and not ref.plural and ref.nouns != ("tower",):
            # "the bottle of water", "the can of beans", "the drawer of the tools"; "a tower of red, blue" is of both.
            found.append((of + len(fillings), replace(ref, names=(*ref.names, *fillings))))
            # "the top drawer of the wooden cabinet"
            filling = _singular(self.text(of + len(fillings)), self.words.parts)
            fillings = (*fillings, filling)
        k = j + 1 if self.text(j) in ("number", "no", "#") else j
        # "give the red ball a gentle tap" names no ball called a.
        given = (
            self.text(k) == "a" and any(tag in self.tags[k + 1] for tag in _STROKES) if k + 1 < self.count else False
        )
        if self._suffix(k) and not given:
            found.insert(0, (k + 1, replace(ref, names=(*ref.names, self._suffix(k)))))
        for m, _ in self.tag(j, "CALLED"):
            if m < len(self.tokens) and (self.tokens[m].kind == "id" or self.text(m) in self.words.parts):
                found.append((m + 1, replace(ref, names=(*ref.names, self.text(m)))))
        return found


_DETERMINERS: tuple[tuple[str, Determiner], ...] = (("THE", "the"), ("A", "a"), ("ALL", "all"))
_DETERMINING = frozenset(tag for tag, _ in _DETERMINERS)
_STROKES = ("LIGHT_ADJECTIVE", "LIGHT_NOUN")
_NAMES_OF_THINGS = (ABSENT_NOUNS & {*CANONICAL_COLOUR}) - {*COLOURS}
"""Colours that are called after a thing."""
_ADJECTIVES = frozenset({"SHADE", "SIZE", "SUPER", "POS", "ORDINAL", "NON", "OTHER"})
_PACKED = word_set(
    "jar pot packet pack tub shaker mill tube stick bar carton bag sachet roll reel spool holder stand dispenser piece pen"
)
_NOT_NAMES = word_set(
    """
    REL TO SOURCE THE A ALL BOTH PRON THEN BEFORE AFTER NOT_IS EXCEPT AVOID TABLE COLOUR NOUN
    """
)
_EXACTLY = frozenset({"exactly", "precisely", "only", "just"})
_COLOURLESS = ("black", "white", "grey")
_OUTMOST = frozenset({"nearest", "closest", "farthest", "furthest"})
_NOT_POINTED_AT = _NOT_NAMES - {"EXCEPT", "AVOID"}
_AFTER_A_NAME = word_set(
    "on in into onto to next and or with for then before after goes beside behind from off under above , . ; ? !"
) | {""}
_NO_NOUNS = word_set("the a an and then in on into onto to of from with put . , ; : ! ?")
_THINGS = word_set("thing thingy object item toy")
_SIDES = word_set("left right front back rear top bottom middle centre center near far upper lower inner outer")
_FUNCTION_WORDS = GRAMMAR_WORDS | QUESTIONS | CONDITIONS


def _singular(word: str, parts: frozenset[str]) -> str:
    if word in parts:
        return word
    for ending, with_ in (("ies", "y"), ("es", ""), ("s", ""), ("ing", ""), ("ing", "e")):
        if word.endswith(ending) and word[: -len(ending)] + with_ in parts:
            return word[: -len(ending)] + with_
    # "the cookie box" for what is called cookies
    return f"{word}s" if len(word) > 2 and f"{word}s" in parts else word
