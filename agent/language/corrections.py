"""Corrections of what was just said: the better words take the place of those that they are like.

"Put the honey on the board, sorry no, I meant the jam" has three parts: what was said, the cue that it was wrong, and the
repair (reparandum, interregnum and repair of Shriberg, "Preliminaries to a Theory of Speech Disfluencies", 1994). The
repair replaces the phrase before the cue that is of its kind; where it might replace either of two, both ways are
returned, and sense decides.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from robosandbox.agent.language.intent import Ref, Relation
from robosandbox.agent.language.lexicon import Phrases
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.slots import HOLDERS, HOLDING, Said
from robosandbox.agent.language.speech import CORRECTION
from robosandbox.agent.language.tokens import MARKS, WAITED_FOR, Token, id_parts
from robosandbox.agent.language.verbs import BASE_FORMS
from robosandbox.agent.language.wordlist import word_set

_MOST_WAYS = 3
_MOST_REPAIRS = 4
_CUES = Phrases()
_CUES.add_all(CORRECTION, "CUE")
_CUES.add_all(
    "i said, i say, forget that, forget it, cancel that, just kidding, only kidding, just joking, only joking, kidding, "
    "changed my mind, i changed my mind, i have changed my mind, change of plan, change of plans, come to think of it, "
    "you know what, other one, other colour, other color, other side",
    "CUE",
)
_CUES.add_all("oh, ah, well, but, and, or, so, that is, let us make it, i want, it is, yes, instead, i think", "FILL")
_TOO_WEAK = frozenset({"rather", "better", "make it", "actually"})
_AFTER = Phrases()
_AFTER.add_all("i mean, i meant, i meant to say, i mean to say, i said", "CUE")
_REVERSED = Phrases()
_REVERSED.add_all(
    "other way round, other way around, the other way round, the other way around, vice versa, the reverse, "
    "do it the other way round, do it the other way around",
    "REVERSED",
)
_KEPT = Phrases()
_KEPT.add_all(
    " , ".join(
        f"{keep} {it}{there}"
        for keep in ("keep", "leave")
        for it in ("it", "that", "that one")
        for there in ("", " where it is", " there", " alone", " be", " for now")
    ).replace(" , ", ", "),
    "KEPT",
)
_PREPOSITIONS = frozenset({"in", "into", "on", "onto", "to", "beside", "behind", "by", "near", "of", "inside", "under"})
_SIDES = {"left": "to the left of", "right": "to the right of", "front": "in front of", "behind": "behind"}
_SIDED = frozenset({*_SIDES, "on", "to", "in", "at", "the", "side", "its"})
_DETERMINERS = frozenset({"the", "a", "an", "that", "this", "my", "our", "your"})
_TELLING = word_set(
    """
    no nope nah wait hang hold sorry mean meant not actually rather scratch strike oops wrong mistake bad kidding joking
    mind thought thoughts correction apologies make misspoke change did other better
    """
)
"""Words of which every cue has one."""
_ADJECTIVES = ("COLOUR", "SIZE", "SUPER", "POS", "SHADE")
Words = tuple[Token, ...]
_Change = tuple[int, int, Words]


@dataclass(frozen=True, slots=True)
class _Thing:
    """One thing that is named: from which token to which, and whether it tells a place."""

    start: int
    end: int
    ref: Ref
    place: bool


def may_correct(prompt: str) -> bool:
    """Say whether a sentence has a word that every cue of a correction has one of."""
    return bool(_TELLING & {*re.findall("[a-z]+", prompt.lower())})


def set_right(said: Said) -> tuple[Said, ...]:
    """Return the sentence with its corrections carried out, in every way that it can be meant; none if it has none."""
    ways: tuple[Said, ...] = (said,) if _TELLING & {*said.texts} else ()
    for _ in range(_MOST_REPAIRS):
        further = [better for way in ways for better in _once(way)]
        if not further:
            break
        ways = tuple({tuple(way.texts): way for way in further}.values())[:_MOST_WAYS]
    return ways if said not in ways else ()


def _once(said: Said) -> list[Said]:
    """Carry out the first correction that can be."""
    for i in range(1, len(said.tokens)):
        for repair in _repairs(said, i):
            ways = repair.ways()
            if ways:
                return [said.now(_tidied(way)) for way in ways if _tidied(way) != tuple(said.tokens)]
    return []


def _repairs(said: Said, i: int) -> list[_Repair]:
    """Return the corrections of what is said before token `i`."""
    texts, n = said.texts, len(said.texts)
    k = _past_marks(texts, i)
    asked = k + 1 if texts[k : k + 1] == ["and"] else k
    for ask in (["did", "i", "say"], ["i", "said"]):
        first = asked + len(ask)
        end = next((m for m in range(first, n) if texts[m] in MARKS), n)
        after, strong = _cue(said, end)
        if texts[asked:first] == ask and (strong or ask[0] == "did") and after < n:
            # "did I say yellow? I meant green"
            return [_Repair(said, i, after, n, tuple(texts[first:end]))]
    if k > i:
        # "..., the pink one, I mean"; "..., in the tray, not the bin"
        start = k + 1 if texts[k : k + 1] in (["and"], ["but"], ["so"]) else k
        end = next((m for m in range(start, n) if texts[m] in MARKS), n)
        cue = next((m for m in range(start + 1, end) if _AFTER.match(said.tokens, m) == end - m), 0)
        cue = cue or (
            end
            if end + 1 < n
            and _AFTER.match(said.tokens, end + 1)
            and _edge(texts, end + 1 + _AFTER.match(said.tokens, end + 1))
            else 0
        )
        if cue:
            after = end if cue < end else end + 1 + _AFTER.match(said.tokens, end + 1)
            return [_Repair(said, i, start, cue, resume=after)]
        if texts[end : end + 2] == [",", "not"]:
            for after in _named(said, end + 2):
                if _edge(texts, after):
                    return [_Repair(said, i, start, end, tuple(texts[end + 2 : after]), resume=after, needs_wrong=True)]
    after, strong = _cue(said, i)
    if not strong:
        return []
    wrong: tuple[str, ...] = ()
    if texts[after : after + 1] == ["not"]:
        # "no not two, block four"
        end = next((m for m in range(after, n) if texts[m] in MARKS or texts[m] == "but"), n)
        wrong, after = tuple(texts[after + 1 : end]), _past_marks(texts, end + (texts[end : end + 1] == ["but"]))
    return [_Repair(said, i, after, n, wrong)]


def _cue(said: Said, i: int) -> tuple[int, bool]:
    """Return where the words end that take back what was said before token `i`, and whether they surely do."""
    k, strong = _past_marks(said.texts, i), False
    while k < len(said.tokens):
        length = _CUES.match(said.tokens, k)
        if said.texts[k] == "wrong" and k + 1 < len(said.tokens):
            # "oops, wrong cube, the green one"
            length, strong = 2, True
        if not length or (said.texts[k + 1 : k + 3] == ["on", "to"] and length == 2):
            break
        phrase = " ".join(said.texts[k : k + length])
        filling = all(tag == "FILL" for end, tag, _ in _CUES.at(said.tokens, k) if end == k + length)
        # "or rather" takes back; "rather" after a mark, too.
        after = said.texts[k + length] if k + length < len(said.texts) else ""
        if (phrase.endswith("no") and not _opens(after)) or _waits(said.texts, k + length):
            # "no olives" forbids, "wait for me" asks for something.
            break
        strong = strong or not (filling or (phrase in _TOO_WEAK and k == i))
        k = _past_marks(said.texts, k + length)
    return k, strong


def _waits(texts: Sequence[str], i: int) -> bool:
    k = _past_marks(texts, i)
    return k < len(texts) and (texts[k] == "then" or (texts[i - 1] == "wait" and texts[k] in (*WAITED_FOR, "and")))


def _opens(text: str) -> bool:
    """Say whether better words may start so right after a "no"."""
    return (
        text in MARKS
        or text in _DETERMINERS
        or text in _PREPOSITIONS
        or text in ("", "not", "i", "make", "sorry", "wait", "that")
    )


def _past_marks(texts: Sequence[str], i: int) -> int:
    while i < len(texts) and texts[i] in MARKS:
        i += 1
    return i


def _edge(texts: Sequence[str], i: int) -> bool:
    return i >= len(texts) or texts[i] in MARKS or texts[i] in ("and", "then")


def _named(said: Said, i: int) -> list[int]:
    """Return where a plain name or place ends that starts at token `i`, the longest first."""
    ends = [end for end, element in said.grammar.element(i) if element.kind == "place"]
    ends += [end for end, ref in said.grammar.np(i) if not ref.unknown]
    return sorted({*ends}, reverse=True)


def _tidied(tokens: Words) -> Words:
    """Drop marks with nothing before them, and those before which a mark stands."""
    made: list[Token] = []
    for token in tokens:
        if token.text not in MARKS or (made and made[-1].text not in MARKS):
            made.append(token)
    return tuple(made)


@dataclass
class _Repair:
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
        wrong = tuple(word for word in self.wrong if word not in _DETERMINERS)
        if self.needs_wrong and not self._find(wrong):
            return []
        length = _REVERSED.match(tokens, self.start) if self.start < len(tokens) else 0
        if length and _edge(texts, self.start + length):
            return self._reversed(self.start + length)
        kept = _KEPT.match(tokens, self.start) if self.start < len(tokens) else 0
        if kept and texts[self.start + kept : self.start + kept + 1] and texts[self.start + kept] in MARKS:
            return self._given_up(self.start + kept + 1)
        if self.start < len(tokens) and texts[self.start] in BASE_FORMS:
            return self._commanded()
        for end in self._ends():
            better = tokens[self.start : end]
            found = [(start, stop, words) for start, stop, words in self._replaced(end, better, wrong)]
            if found:
                rest = tokens[self.resume or end :]
                return [self._joined(start, stop, words, rest) for start, stop, words in found]
        return []

    def _ends(self) -> list[int]:
        """Return where the better words may end, the longest first."""
        texts, limit = self.said.texts, self.stop
        if self.resume:
            return [limit]
        return [
            end
            for end in sorted({*_named(self.said, self.start), *self._others(), self.start + 1}, reverse=True)
            if self.start < end <= limit and _edge(texts, end)
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
        if len(rest) > 1 and rest[0].text == "," and rest[1].text in _PREPOSITIONS:
            # "put key 103, I mean 102, on the tray" goes on where it was broken off.
            rest = rest[1:]
        return (*before, *words, *behind, *rest)

    def _without_echo(self, rest: Words, words: Words) -> Words:
        """As in "sorry, B. B please": said again, it adds nothing."""
        end = _past_marks([token.text for token in rest], 0)
        for length in range(len(words), 0, -1):
            echo = [token.text for token in rest[end : end + length]]
            if (
                end
                and echo
                and echo == [token.text for token in words[:length]]
                and _edge([t.text for t in rest], end + length)
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
                and not _PREPOSITIONS & {*self.said.texts[i:end]}
            ]
            if not ends:
                i += 1
                continue
            end, ref = max(ends, key=lambda hit: hit[0])
            place = i > 0 and self.said.texts[i - 1] in _PREPOSITIONS
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
        bare = [text for text in texts if text not in _DETERMINERS and text not in ("one", "ones")]
        heads = {id_parts(name)[-1] for name in self.said.words.ids}
        if len(colours) == 1 and bare == [colours[0].text] and not {*bare} & heads:
            found = self._adjective_of(colours[0], wrong, noun=len(words) > 1)
            if found:
                return found
        for kind in ("distance", "direction", "times"):
            if kind in elements:
                return self._element(kind, words)
        if "place" in elements and texts[0] in (*_PREPOSITIONS, "next", "between", "left", "right"):
            return self._place(words, wrong)
        if any(stop == end and _tells(ref) for stop, ref in self.said.grammar.np(self.start)):
            return self._thing(end, words, wrong)
        return []

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
        if alike or wrong or not noun:
            return alike[::-1]
        return [
            (
                thing.start,
                thing.start + (self.said.texts[thing.start] in _DETERMINERS),
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

    def _place(self, words: Words, wrong: tuple[str, ...]) -> list[_Change]:
        for start, end, place in self._places()[:1]:
            anchor = next((thing for thing in self._things if start < thing.start and thing.end == end), None)
            if words[-1].text in ("it", "that", "there") and place.refs and anchor:
                words = (*words[:-1], *self.said.tokens[anchor.start : anchor.end])
            return [(start, end, words)]
        return self._element("home", words)

    def _thing(self, end: int, words: Words, wrong: tuple[str, ...]) -> list[_Change]:
        if self.said.texts[self.cue - 1] in _PREPOSITIONS:
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


def _tells(ref: Ref) -> bool:
    return bool(ref.nouns or ref.names or ref.colours or ref.one or ref.ranks)
