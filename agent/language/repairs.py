"""Repairs in speech: the phrase said before that the better words of a correction replace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from robosandbox.agent.language.intent import Ref, Relation
from robosandbox.agent.language.lexicon import Phrases
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.slots import HOLDERS, HOLDING, Said
from robosandbox.agent.language.tokens import MARKS, Token, id_parts
from robosandbox.agent.language.verbs import BASE_FORMS
from robosandbox.values import frozen

_REVERSED = Phrases()
_REVERSED.add_all(
    "other way round, other way around, the other way round, the other way around, vice versa, the reverse, "
    "do it the other way round, do it the other way around",
    "REVERSED",
)
_KEPT = Phrases()
_KEPT.add_all(
    [
        f"{keep} {it}{there}"
        for keep in ("keep", "leave")
        for it in ("it", "that", "that one")
        for there in ("", " where it is", " there", " alone", " be", " for now")
    ],
    "KEPT",
)
PREPOSITIONS = frozenset({"in", "into", "on", "onto", "to", "beside", "behind", "by", "near", "of", "inside", "under"})
_SIDES = {"left": "to the left of", "right": "to the right of", "front": "in front of", "behind": "behind"}
_SIDED = frozenset({*_SIDES, "on", "to", "in", "at", "the", "side", "its"})
DETERMINERS = frozenset({"the", "a", "an", "that", "this", "my", "our", "your"})
_ADJECTIVES = ("COLOUR", "SIZE", "SUPER", "POS", "SHADE")
Words = tuple[Token, ...]
_Change = tuple[int, int, Words]


@frozen
class _Thing:
    """One thing that is named: from which token to which, and whether it tells a place."""

    start: int
    end: int
    ref: Ref
    place: bool


@dataclass
class Repair:
    """A correction: what was said before `cue`, the better words from `start` on, and what was said to be wrong."""

    said: Said
    cue: int
    start: int
    stop: int
    wrong: tuple[str, ...] = ()
    resume: int = 0
    needs_wrong: bool = False

    def ways(self) -> list[Words]:
        """Return the sentence in the better words, in every way in which they can replace what was said."""
        texts, tokens = self.said.texts, self.said.tokens
        wrong = tuple(word for word in self.wrong if word not in DETERMINERS)
        if self.needs_wrong and not self._find(wrong):
            return []
        length = _REVERSED.match(tokens, self.start) if self.start < len(tokens) else 0
        if length and at_edge(texts, self.start + length):
            return self._reversed(self.start + length)
        kept = _KEPT.match(tokens, self.start) if self.start < len(tokens) else 0
        if kept and texts[self.start + kept : self.start + kept + 1] and texts[self.start + kept] in MARKS:
            return self._given_up(self.start + kept + 1)
        if self.start < len(tokens) and texts[self.start] in BASE_FORMS:
            return self._commanded()
        anew = self._thing_and_place()
        if anew:
            return [anew]
        for end in self._ends():
            if self._shared(end):
                return []
            better = tokens[self.start : end]
            found = [change for change in self._replaced(end, better, wrong) if self._changes(*change)]
            if found:
                rest = tokens[self.resume or end :]
                return [self._joined(start, stop, words, rest) for start, stop, words in found]
        return []

    def _changes(self, start: int, stop: int, words: Words) -> bool:
        """Say whether other words are said: "the fig and the olive in the bag, correction: the fig" leaves one out."""
        if not self.wrong and {"then", ".", ";"} & {*self.said.texts[stop : self.cue]}:
            # "the hammer in the crate, then the brick. No, the toolbox": for both, or for the brick alone?
            return False
        before = [text for text in self.said.texts[start:stop] if text not in DETERMINERS]
        return before != [token.text for token in words if token.text not in DETERMINERS]

    def _shared(self, end: int) -> bool:
        """As in "the nut in the bag, no, the bolt and the pin in the box": is the bolt for the bag or for the box?"""
        n = len(self.said.texts)
        if self.said.texts[end : end + 1] != ["and"] or end + 1 >= n or self.resume:
            return False
        ends = [m for m, ref in self.said.grammar.np(end + 1) if not (ref.unknown or ref.relations)]
        return any(at_edge(self.said.texts, m) or self.said.texts[m] in PREPOSITIONS for m in ends)

    def _thing_and_place(self) -> Words:
        """As in "put the cup by the jug, I mean the glass by it": thing and place anew."""
        texts, tokens, places = self.said.texts, self.said.tokens, self._places()
        limit = self.resume or next((k for k in range(self.start, len(texts)) if texts[k] in MARKS), len(texts))
        ends = [
            end for end, ref in self.said.grammar.np(self.start) if not (ref.unknown or ref.relations) and end < limit
        ]
        ends = [end for end in ends if texts[end] in (*PREPOSITIONS, "next") and limit in named(self.said, end)]
        objects = [thing for thing in self._things if not thing.place]
        if not ends or len(places) != 1 or len(objects) != 1 or objects[0].end > places[0][0]:
            return ()
        start, stop, _ = places[0]
        anchor = next((thing for thing in self._things if start < thing.start and thing.end == stop), None)
        anew = tokens[self.start : min(limit, self.stop)]
        if anew[-1].text in ("it", "there") and anchor:
            anew = (*anew[:-1], *tokens[anchor.start : anchor.end])
        return (*tokens[: objects[0].start], *anew, *tokens[stop : self.cue], *tokens[limit:])

    def _ends(self) -> list[int]:
        """Return where the better words may end, the longest first."""
        texts, limit = self.said.texts, self.stop
        if self.resume:
            return [limit]
        return [
            end
            for end in sorted({*named(self.said, self.start), *self._others(), self.start + 1}, reverse=True)
            if self.start < end <= limit and at_edge(texts, end)
        ]

    def _others(self) -> list[int]:
        kinds = ("direction", "distance", "times")
        side = self.start
        while side < len(self.said.texts) and self.said.texts[side] in _SIDED:
            side += 1
        return [side] + [end for end, element in self.said.grammar.element(self.start) if element.kind in kinds]

    def _joined(self, start: int, stop: int, words: Words, rest: Sequence[Token]) -> Words:
        """Return the sentence with other words between two tokens, and what follows the repair."""
        before, behind = tuple(self.said.tokens[:start]), tuple(self.said.tokens[stop : self.cue])
        rest = self._without_echo(tuple(rest), words)
        if len(rest) > 1 and rest[0].text == "," and rest[1].text in PREPOSITIONS:
            # "put key 103, I mean 102, on the tray" goes on where it was broken off.
            rest = rest[1:]
        return (*before, *words, *behind, *rest)

    def _without_echo(self, rest: Words, words: Words) -> Words:
        """As in "sorry, B. B please": said again, it adds nothing."""
        end = past_marks([token.text for token in rest], 0)
        for length in range(len(words), 0, -1):
            echo = [token.text for token in rest[end : end + length]]
            if (
                end
                and echo
                and echo == [token.text for token in words[:length]]
                and at_edge([t.text for t in rest], end + length)
            ):
                return rest[end + length :]
        return rest

    def _find(self, words: tuple[str, ...]) -> list[tuple[int, int]]:
        """Return where words were said before the cue."""
        n = len(words)
        return [(k, k + n) for k in range(self.cue - n + 1) if n and tuple(self.said.texts[k : k + n]) == words]

    @cached_property
    def _things(self) -> list[_Thing]:
        """What was named before the cue, one after the other."""
        found: list[_Thing] = []
        i = 0
        while i < self.cue:
            ends = [
                (end, ref)
                for end, ref in self.said.grammar.np(i)
                if end <= self.cue
                and not (ref.unknown or ref.relations or ref.determiner == "it")
                and _tells(ref)
                and not PREPOSITIONS & {*self.said.texts[i:end]}
            ]
            texts = self.said.texts
            # "stack the block on the brick": what is to be done is no thing.
            verb = (
                texts[i] in BASE_FORMS and {*texts[i + 1 : i + 2]} <= DETERMINERS and (i == 0 or at_edge(texts, i - 1))
            )
            if not ends or verb or texts[i : i + 2] == ["can", "you"]:
                i += 1
                continue
            end, ref = max(ends, key=lambda hit: hit[0])
            place = i > 0 and self.said.texts[i - 1] in PREPOSITIONS
            found.append(_Thing(i, end, ref, place))
            i = end
        return found

    def _places(self) -> list[tuple[int, int, Relation]]:
        """The places that were told before the cue, the last first, each as far as it goes."""
        found: list[tuple[int, int, Relation]] = []
        for i in range(self.cue):
            ends = [
                (end, element.value)
                for end, element in self.said.grammar.element(i)
                if element.kind == "place" and isinstance(element.value, Relation) and end <= self.cue
            ]
            if ends and not (found and i < found[-1][1]):
                end, place = max(ends, key=lambda hit: hit[0])
                found.append((i, end, place))
        return found[::-1]

    def _replaced(self, end: int, better: Sequence[Token], wrong: tuple[str, ...]) -> list[_Change]:
        """Return what the better words up to `end` replace: from where to where, and by what."""
        words = tuple(better)
        texts = [token.text for token in words]
        elements = {element.kind for stop, element in self.said.grammar.element(self.start) if stop == end}
        if len(words) == 1 and self._small(words[0]):
            return self._word(words[0], wrong)
        side = next((text for text in texts if text in _SIDES), "")
        if side and {*texts} <= _SIDED:
            found = self._side(side, words)
            if found:
                return found
        colours = [token for i, token in enumerate(words) if self._adjective(self.start + i)]
        bare = [text for text in texts if text not in DETERMINERS and text not in ("one", "ones")]
        heads = {id_parts(name)[-1] for name in self.said.words.ids}
        if len(colours) == 1 and bare == [colours[0].text] and not {*bare} & heads:
            found = self._adjective_of(colours[0], wrong, noun=len(words) > 1)
            if found:
                return found
        for kind in ("distance", "direction", "times"):
            if kind in elements:
                return self._element(kind, words)
        if "place" in elements and texts[0] in (*PREPOSITIONS, "next", "between", "left", "right"):
            return self._place(words)
        if texts[0] == "all":
            return self._all_but(words)
        if any(stop == end and _tells(ref) for stop, ref in self.said.grammar.np(self.start)):
            return self._thing(end, words, wrong)
        return []

    def _all_but(self, words: Words) -> list[_Change]:
        """As in "the fruit in the bag, no, all but the fig": all of what was named, but the fig."""
        texts = [token.text for token in words]
        at = 3 if texts[1:3] in (["of", "it"], ["of", "them"]) else 1
        groups = [thing for thing in self._things if thing.ref.plural or thing.ref.determiner == "all"]
        groups = [thing for thing in groups if not thing.place]
        if texts[at : at + 1] not in (["but"], ["except"], ["apart"], ["bar"]) or len(groups) != 1:
            return []
        return [(groups[0].end, groups[0].end, words[at:])]

    def _small(self, token: Token) -> bool:
        """Say whether a word tells which of several that are called the same: a number or a letter."""
        return token.kind == "number" or (
            len(token.text) == 1 and token.text.isalpha() and token.text in self.said.words.parts
        )

    def _word(self, word: Token, wrong: tuple[str, ...]) -> list[_Change]:
        alike = [
            k for k in range(self.cue) if self._small(self.said.tokens[k]) and self.said.tokens[k].kind == word.kind
        ]
        alike = [k for k in alike if (self.said.texts[k],) == wrong] or alike
        return [(k, k + 1, (word,)) for k in alike[::-1]]

    def _adjective(self, i: int) -> list[str]:
        return [tag for tag in _ADJECTIVES if any(end == i + 1 for end, _ in self.said.grammar.tag(i, tag))]

    def _adjective_of(self, word: Token, wrong: tuple[str, ...], *, noun: bool) -> list[_Change]:
        """As in "I meant green", "the pink one, I mean": another adjective, or one where there was none."""
        at = next(k for k in range(self.start, len(self.said.tokens)) if self.said.texts[k] == word.text)
        tags = {*self._adjective(at)}
        alike: list[_Change] = [
            (k, k + 1, (word,))
            for thing in self._things
            for k in range(thing.start, thing.end)
            if tags & {*self._adjective(k)} and (not wrong or (self.said.texts[k],) == wrong)
        ]
        if alike and noun and not wrong and len(self._things) == 1:
            # "the grey block, no, the pink one": what is pink may be no block.
            thing = self._things[0]
            one = tuple(Token(text, text, "word") for text in ("the", word.text, "thing"))
            return [*alike[::-1], (thing.start, thing.end, one)]
        if alike or wrong or not noun:
            return alike[::-1]
        return [
            (
                thing.start,
                thing.start + (self.said.texts[thing.start] in DETERMINERS),
                (Token("the", "the", "word"), word),
            )
            for thing in self._things
            if thing.ref.nouns and not thing.ref.plural
        ]

    def _side(self, side: str, words: Words) -> list[_Change]:
        told = [k for k in range(self.cue) if self.said.texts[k] in _SIDES]
        for start, end, place in self._places():
            if any(not start <= k < end for k in told):
                # "next to the bowl, on the left. no, the right": the word by itself.
                return [(k, k + 1, (Token(side, side, "word"),)) for k in told if len(told) == 1]
            if place.kind in (*_SIDES, "beside", "back") and place.refs:
                anchor = next((thing for thing in self._things if start < thing.start and thing.end == end), None)
                if anchor:
                    phrase = tuple(Token(text, text, "word") for text in _SIDES[side].split())
                    return [(start, anchor.start, phrase)]
        return self._element("direction", words)

    def _element(self, kind: str, words: Words) -> list[_Change]:
        found = [
            (i, end, words)
            for i in range(self.cue)
            for end, element in self.said.grammar.element(i)
            if element.kind == kind and end <= self.cue
        ]
        return [max(found, key=lambda hit: (hit[1], hit[1] - hit[0]))] if found else []

    def _place(self, words: Words) -> list[_Change]:
        for start, end, place in self._places()[:1]:
            anchor = next((thing for thing in self._things if start < thing.start and thing.end == end), None)
            if words[-1].text in ("it", "that", "there") and place.refs and anchor:
                words = (*words[:-1], *self.said.tokens[anchor.start : anchor.end])
            return [(start, end, words)]
        return self._element("home", words)

    def _thing(self, end: int, words: Words, wrong: tuple[str, ...]) -> list[_Change]:
        if self.said.texts[self.cue - 1] in PREPOSITIONS:
            # "stick it in, hmm no, not the cup, the grey bin"
            return [(self.cue, self.cue, words)]
        things = self._things
        if wrong:
            things = [t for t in things if {*wrong} <= {*self.said.texts[t.start : t.end]}]
        if len(things) < 2:
            return [(thing.start, thing.end, words) for thing in things]
        likeness = [self._likeness(self.start, end, thing) for thing in things]
        best = max(likeness)
        return [(t.start, t.end, words) for t, like in zip(things, likeness, strict=True) if like == best][::-1]

    def _likeness(self, start: int, end: int, thing: _Thing) -> int:
        """Return how alike two things are by their names: called the same, both containers or both none, or not."""
        one, other = self._heads(start, end), self._heads(thing.start, thing.end)
        if one & other:
            return 2
        holds = [
            any(NOUN_CLASS.get(head) in HOLDING or head.endswith(HOLDERS) for head in heads) for heads in (one, other)
        ]
        return int(holds[0] == holds[1])

    def _heads(self, start: int, end: int) -> set[str]:
        """Return what the things are called that words may mean: the last words of their ids."""
        words = {text for text in self.said.texts[start:end] if text in self.said.words.parts}
        names = [id_parts(name) for name in self.said.words.ids if words & {*id_parts(name)}]
        most = max((len(words & {*parts}) for parts in names), default=0)
        named = [parts for parts in names if len(words & {*parts}) == most]
        return {next((part for part in reversed(parts) if part.isalpha() and len(part) > 1), "") for parts in named}

    def _reversed(self, end: int) -> list[Words]:
        """As in "put the red ring on the blue ring. No! Other way round"."""
        tokens, things = self.said.tokens, self._things
        if len(things) != 2:
            return []
        one, other = things
        return [
            (
                *tokens[: one.start],
                *tokens[other.start : other.end],
                *tokens[one.end : other.start],
                *tokens[one.start : one.end],
                *tokens[other.end : self.cue],
                *tokens[end:],
            )
        ]

    def _given_up(self, end: int) -> list[Words]:
        """As in "tap the grey block, actually leave it where it is, tap the pink one"."""
        tokens = self.said.tokens
        if {"it", "that", "them", "there"} & {*self.said.texts[end:]} or any(
            m in self.said.texts[: self.cue] for m in (".", ";", "then", "and")
        ):
            return []
        return [tuple(tokens[end:])] if {*self.said.texts[end : end + 1]} & BASE_FORMS else []

    def _commanded(self) -> list[Words]:
        """As in "put the muffin on the plate, scratch that, put the croissant there": a whole command anew."""
        texts, tokens = self.said.texts, self.said.tokens
        if {"first", "also", "too"} & {*texts[self.start :]}:
            # "wait, put the banana in there first" takes nothing back.
            return []
        if {".", ";", "then", "and", ":"} & {*texts[: self.cue]}:
            no = (Token(",", ",", "mark"), Token("no", "no", "word"), Token(",", ",", "mark"))
            return [
                (
                    *tokens[: self.cue],
                    *no,
                    *tokens[self.start : self.stop],
                    *(tokens[self.resume :] if self.resume else ()),
                )
            ]
        end = next(
            (k for k in range(self.start, len(texts)) if texts[k] in MARKS or texts[k] in ("and", "then")), len(texts)
        )
        end = min(end, self.stop)
        anew = list(tokens[self.start : end])
        if "there" in texts[self.start : end] and self._places():
            start, stop, _ = self._places()[0]
            at = texts.index("there", self.start) - self.start
            anew[at : at + 1] = tokens[start:stop]
        objects = [thing for thing in self._things if not thing.place]
        if {"it", "that"} & {*texts[self.start : end]} and objects:
            anew = [*tokens[objects[0].start : objects[0].end], Token(",", ",", "mark"), *anew]
        return [(*anew, *tokens[self.resume or end :])]


def past_marks(texts: Sequence[str], i: int) -> int:
    """Return where the next word is from token `i` on."""
    while i < len(texts) and texts[i] in MARKS:
        i += 1
    return i


def at_edge(texts: Sequence[str], i: int) -> bool:
    """Say whether a clause ends before token `i`."""
    return i >= len(texts) or texts[i] in MARKS or texts[i] in ("and", "then")


def named(said: Said, i: int) -> list[int]:
    """Return where a plain name or place ends that starts at token `i`, the longest first."""
    ends = [end for end, element in said.grammar.element(i) if element.kind == "place"]
    ends += [end for end, ref in said.grammar.np(i) if not ref.unknown]
    return sorted({*ends}, reverse=True)


def _tells(ref: Ref) -> bool:
    return bool(ref.nouns or ref.names or ref.colours or ref.one or ref.ranks)
