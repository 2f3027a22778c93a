"""Things and small words of a sentence that is read loosely: names in any order, descriptions on either side of their noun, prepositions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.tokens import MARKS, Token, id_parts
from robosandbox.agent.language.wordlist import phrase_list, word_set

WISHING = word_set(
    "want wants wanting wish need needs needing needed like please kindly necessary possible let make do you love try help"
)
"""What makes an order of a clause."""
MODALS = word_set("must should shall can could would will may might ought has have having")
MAYBE = word_set("possible can could will would may might able")
"""What asks where an act is told, and only supposes where a thing is told to be somewhere."""
ASKED_AS = word_set("can could would will is may might shall")
"""Words of questions that may begin an order: "can you take ...", "is possible ..."."""
THEN = frozenset(
    {
        "then",
        "and then",
        "after that",
        "afterwards",
        "after this",
        "and after that",
        "and after this",
        "next",
        "and next",
        "and later",
    }
)
FLAT = word_set("mat board plate dish saucer coaster slab")
"""What things are put on where a speaker says "at"."""
BEING = word_set("is are be am been being")
STAYING = word_set("goes comes falls stays stands lies lands gets sits go come fall stay")
"""Said of a thing that is wished somewhere: "make that the cube comes in the bin"; alone, they tell where it is."""
LINKING = word_set("the a of for with")
"""What may stand between the words of one name: "the ball of glass"."""
DOING = word_set("make makes making do does doing let give gives have get start go")
"""Verbs that leave the act to the word beside them: "make a touch", "give it a push"."""
SPEAKERS = word_set("you i we u")
SILENT = word_set(
    """
    you i we u me the a an that to for of kind kindly favor favour obliged thankful grateful good nice glad great happy robot your hand with hands
    it what my our us now able order
    """
)
"""What adds nothing to a verb with its thing and place."""
RESUMED = word_set("it them him her he she they there")
RELATIVE = word_set("who which what that whose")
BETWEEN = word_set("it is are he she they has have color colour the of")
"""What may stand between a thing and its adjective: "which it is yellow", "which color is blue"."""
STATES = {"open": "open", "opened": "open", "closed": "close", "shut": "close", "close": "close"}
CARRIED = (
    "verb",
    "thing",
    "place",
    "it",
    "there",
    "not",
    "staying",
    "direction",
    "distance",
    "times",
    "source",
    "out",
    "home",
    "particle",
)
"""Kinds of phrases that may not be left out."""
CARRYING = frozenset({"put", "move", "relocate", "throw", "give", "stack", "load", "go"})
HOLDING_VERBS = frozenset({"pick"})
OFFERING = frozenset({"give", "want"})
_BY_MEANING = {
    "in": "in, into, inside, inside of, in to, in side, in side of, within, to the inside of, in the inside of, to inside, into inside, to in",
    "on": "on, onto, upon, on to, on top of, on the top of, on top, up on, at top of",
    "over": "over, above, over the top of",
    "to": "to, towards, toward",
    "at": "at",
    "from": "from, out of, off",
    "next to": "next to, beside, beside of, besides, near, near of, near to, near from, close to, by the side of, at the side of, at side of, aside of",
    "to the left of": "left of, left from, to the left of, to left of, on the left of, on left of, at the left of, at left of, "
    "at left side of, at the left side of, on the left side of, on left side of, to the left side of, at left side from, at the left hand of, at left hand of, "
    "at the left side from, on the left side from, left side of, to the left from",
    "to the right of": "right of, right from, to the right of, to right of, on the right of, on right of, at the right of, at right of, "
    "at right side of, at the right side of, on the right side of, on right side of, to the right side of, at right side from, at the right hand of, at right hand of, "
    "at the right side from, on the right side from, right side of, to the right from",
    "behind": "behind, behind of, in back of, at the back of",
    "in front of": "in front of, in front from, in the front of, at front of",
}
PREPOSITIONS: dict[str, list[tuple[tuple[str, ...], str]]] = {}
"""How a place may begin, by its first word, the longest first; and the plain preposition for it."""
for _plain, _phrases in _BY_MEANING.items():
    for _phrase in phrase_list(_phrases):
        PREPOSITIONS.setdefault(_phrase.split()[0], []).append((tuple(_phrase.split()), _plain))
for _found in PREPOSITIONS.values():
    _found.sort(key=lambda entry: -len(entry[0]))


_ADJECTIVES = ("COLOUR", "SHADE", "SIZE", "SUPER")
Words = tuple[Token, ...]


class Piece(NamedTuple):
    """One phrase of a clause: what it is, and its words as the grammar wants them."""

    kind: str
    words: Words
    verbs: frozenset[str] = frozenset()


@dataclass
class Clause:
    """What one verb has around it."""

    pieces: list[Piece] = field(default_factory=list)
    joint: str = ""

    def all(self, kind: str) -> list[Piece]:
        """Return its phrases of a kind."""
        return [piece for piece in self.pieces if piece.kind == kind]

    def has(self, *kinds: str) -> bool:
        """Say whether it has a phrase of one of these kinds."""
        return any(piece.kind in kinds for piece in self.pieces)

    @property
    def orders(self) -> bool:
        """Say whether it has a verb."""
        return self.has("verb")


class NotPlainError(Exception):
    """Something in the sentence is none of these phrases."""


def to_word(text: str) -> Token:
    """Return a word or mark as a token."""
    return Token(text, text, "mark" if text in MARKS else "word")


def to_words(text: str) -> Words:
    """Return words as tokens."""
    return tuple(to_word(part) for part in text.split())


class Things:
    """The things of one sentence."""

    def __init__(self, said: Said) -> None:
        self.said = said
        self.grammar = said.grammar
        self.tokens = tuple(said.tokens)
        self.text = said.grammar.text

    def _thing(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        if i >= len(self.tokens) or self.text(i) in MARKS:
            return i, None
        if self.text(i) in ("all", "everything") and self.text(i + 1) in RELATIVE:
            end, told = self._told_of(i + 1)
            nouns = [stop for stop, _ in self.grammar.tag(end, "NOUN")] or (
                [end + 1] if self.text(end) in self.said.words.parts else []
            )
            if nouns:
                return nouns[0], Piece("thing", (to_word("every"), *told, *self.tokens[end : nouns[0]]))
            return (end, Piece("thing", (to_word("everything"), *told))) if told else (i, None)
        one = i + 1 if self.text(i) in ("this", "that", "the") else i
        one += self.text(one) == "one" and one > i
        if one > i and self.text(one) in RELATIVE:
            end, told = self._told_of(one)
            return (end, Piece("thing", (to_word("the"), *told, to_word("one")))) if told else (i, None)
        named = self._by_name(i)
        if named:
            return named[0], Piece("thing", (Token(named[1], named[1], "id"),))
        ends = [
            end
            for end, ref in self.grammar.np(i)
            if not (ref.unknown or ref.relations or ref.determiner == "it" or ref.without or ref.options)
            and not {"what", "of", "that", "which", "is", "not", ","} & {*self.said.texts[i:end]}
            and self._named(i, end)
        ]
        if not ends:
            return i, None
        return self._described(i, max(ends))

    def _by_name(self, i: int) -> tuple[int, str] | None:
        """Read the words of one id in another order or with words between: "the ball of glass", "the pad for tests"."""
        found: list[str] = []
        end = 0
        for k in range(i, min(i + 6, len(self.tokens))):
            part = next((p for p in (self.text(k), self.text(k).removesuffix("s")) if p in self.said.words.parts), "")
            if part:
                found, end = [*found, part], k + 1
            elif self.text(k) not in LINKING:
                break
        while len({*found}) > 1:
            names = [name for name in self.said.words.ids.values() if {*found} <= {*id_parts(name)}]
            if names:
                return (end, names[0]) if len(names) == 1 else None
            found.pop()
            end = max(
                k + 1 for k in range(i, end - 1) if self.text(k).removesuffix("s") in found or self.text(k) in found
            )
        return None

    def _named(self, i: int, end: int) -> bool:
        """Say whether words name a thing and no more: "touch" in "put touch" does not."""
        last = self.tokens[end - 1]
        parts = {word for word in self.said.texts[i:end] if word in self.said.words.parts}
        if "and" not in self.said.texts[i:end] and not any(
            parts <= {*id_parts(name)} for name in self.said.words.ids.values()
        ):
            return False
        if self.grammar.tag(i, "VERB") and self.text(i + 1) in RESUMED | {"the", "a", "this", "that"}:
            return False
        if end == i + 1 and self.text(i) in ("can", "place", "lead", "set", "well", "tap", "touch"):
            before = self.grammar.tags[i - 1] if i else {}
            return bool({"THE", "COLOUR", "SIZE", "NUM"} & {*before}) or (
                last.text in self.said.words.parts and self.text(end) not in SPEAKERS
            )
        return not (end == i + 1 and self.text(i) in DOING)

    def _described(self, i: int, end: int) -> tuple[int, Piece | None]:
        """Add the adjectives that stand behind a thing: "cube red", "the ball who is yellow", "the cube of colour red"."""
        words = self.tokens[i:end]
        stop, told = self._adjectives(end)
        start = end + (self.text(end) == ",")
        if not told and self.text(start) in RELATIVE:
            stop, told = self._told_of(start)
        if not told and self.text(end) == "of":
            colour = end + 1 + (self.text(end + 1) in ("color", "colour"))
            stop, told = self._adjectives(colour)
            stop += self.text(stop) in ("color", "colour")
        if not told:
            return end, Piece("thing", words)
        determined = words[0].text in ("the", "a", "an", "this", "that", "all", "both", "these", "those", "every")
        return stop, Piece("thing", (*words[:determined], *told, *words[determined:]))

    def _told_of(self, i: int) -> tuple[int, Words]:
        """Read "who is red", "which it is yellow", "which color is blue", "what are cans"."""
        end = i + 1
        while self.text(end) in BETWEEN:
            end += 1
        stop, told = self._adjectives(end)
        return stop, told

    def _adjectives(self, i: int) -> tuple[int, Words]:
        end = i
        while end < len(self.tokens):
            ends = [stop for tag in _ADJECTIVES for stop, _ in self.grammar.tag(end, tag)]
            if not ends or self.grammar.tag(end, "NOUN"):
                break
            end = max(ends)
        return end, self.tokens[i:end]
