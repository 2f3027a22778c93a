"""A sentence clause by clause: where clauses begin, what they are about, what stands for a thing or an act in them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from robosandbox.agent.language.asides_words import (
    AUXILIARIES,
    BEING,
    DETERMINERS,
    FINITE,
    JOINTS,
    OBJECTS,
    PERSONS,
    REFERRING,
)
from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.speech import GRAMMAR_WORDS, QUESTIONS
from robosandbox.agent.language.tokens import MARKS, Token
from robosandbox.agent.language.verbs import BASE_FORMS


class Clause(NamedTuple):
    """Tokens from `start` up to `end`, and where the next clause begins.

    Attributes:
        opens: It begins a sentence.
        closes: It ends one.
    """

    start: int
    end: int
    after: int
    opens: bool
    closes: bool


class Clausewise:
    """One sentence, clause by clause."""

    def __init__(self, said: Said) -> None:
        self.said = said
        self.tokens: tuple[Token, ...] = tuple(said.tokens)
        self.texts = said.texts
        self.tags = [{tag for _, tag, _ in LEXICON.at(self.tokens, i)} for i in range(len(self.tokens))]

    def _clauses(self) -> Iterator[Clause]:
        i, n, opens = 0, len(self.texts), True
        while i < n:
            end = i
            while end < n and self.texts[end] not in MARKS and not (end > i and self._begins(end)):
                end += 1
            after = end
            while after < n and self.texts[after] in MARKS:
                after += 1
            closes = after == n or bool({".", "!", "?", ";"} & {*self.texts[end:after]})
            yield Clause(i, end, after, opens, closes)
            i, opens = after, closes

    def _begins(self, k: int) -> bool:
        """Say whether a clause begins with the joint at `k`: "and she hates onions", "so I can reach it"."""
        text = self._text(k)
        if text not in JOINTS or (text == "as" and self._text(k - 2) == "as"):
            return False
        start = k + 2 if self._text(k + 1) in ("that", "then", "now", "please") else k + 1
        return (
            text in ("because", "cause", "though", "although") or self._opens(start) or self._subject(start) is not None
        )

    def _opens(self, k: int) -> bool:
        """Say whether an order may begin here."""
        found = self.tags[k] if k < len(self.tags) else set()
        return bool({"PREAMBLE", "NEGATION", "AVOID", "DESIRE"} & found) or self._text(k) in BASE_FORMS

    def _text(self, i: int) -> str:
        return self.texts[i] if 0 <= i < len(self.texts) else ""

    def _thing(self, k: int) -> bool:
        if k >= len(self.tokens) or self._modal(k):
            return False
        text = self.texts[k]
        ours = text in self.said.words.forms and len(text) > 2 and text not in GRAMMAR_WORDS
        return self.tokens[k].kind == "id" or ours or bool({"NOUN", "COLOUR"} & self.tags[k])

    def _modal(self, k: int) -> bool:
        """Say whether "can" is no thing: "I can see"."""
        before = self.tags[k - 1] if k else set()
        return self.texts[k] == "can" and not before & {"THE", "A", "COLOUR", "SIZE", "SHADE", "SUPER", "NUM"}

    def _refers(self, k: int, end: int) -> bool:
        """Say whether a pronoun stands for a thing here: "pick it", "do that"; but "I heard that ..." goes on."""
        text = self._text(k)
        return text in ("it", "them", "one", "ones") or (text in OBJECTS and k + 1 == end)

    def _subject(self, i: int, *, ordered: bool = True) -> int | None:
        """Return where the finite verb is whose subject begins at `i`; None if no statement begins there."""
        text, after = self._text(i), self._text(i + 1)
        if text in AUXILIARIES and (after in PERSONS or after in REFERRING):
            return i
        if text in QUESTIONS and text not in AUXILIARIES and after not in MARKS and not self._thing(i + 1):
            return i
        if text in PERSONS and after and after not in MARKS:
            return i + 1
        if text in REFERRING and (after in FINITE or self._verb(i + 1)):
            return i + 1
        noun = text in DETERMINERS
        if not (noun or self._unknown(i) or self._thing(i)) or (not noun and self._opens(i)):
            return None
        for k in range(i + 1 + noun, min(i + 8, len(self.texts))):
            if self._text(k) in MARKS or self._text(k) in JOINTS:
                return None
            # After an order, "y unchanged" is no sentence.
            if self._text(k) in FINITE or ((noun or not ordered) and self._verb(k)):
                return k if not self._thing(k) else None
        return None

    def _verb(self, k: int) -> bool:
        """Say whether a word looks like a finite verb of somebody: "my son spilled it"."""
        text = self._text(k)
        past = text.endswith("ed") and text not in BASE_FORMS and not self._thing(k - 1)
        return (self._unknown(k) and len(text) > 3 and text.endswith(("s", "ed"))) or (past and "VERB" in self.tags[k])

    def _unknown(self, k: int) -> bool:
        return k < len(self.tokens) and self.tokens[k].kind == "word" and not self.tags[k] and not self._thing(k)

    def _acts(self, k: int) -> bool:
        """Say whether a word stands for an act here; "empty" in "it is empty" does not."""
        state = self._text(k - 1) in BEING and not self._text(k).endswith(("ing", "ed"))
        return "VERB" in self.tags[k] and not (state or self._thing(k) or self._text(k) in FINITE)

    def _past(self, k: int) -> bool:
        """Say whether a verb tells of what was done: "my cat knocked the tower down", "I keep dropping it"."""
        return self._text(k) not in BASE_FORMS and not self._text(k).endswith("s")

    def _idle(self, k: int) -> bool:
        """Say whether a word of place or number says nothing of a thing: "in here", "and all"."""
        if self._text(k) in ("here", "there", "all", "time", "way") or self._text(k + 1) in ("here", "there"):
            return True
        # "melting in the sun", "in my way"
        noun = k + 1 + (self._text(k + 1) in DETERMINERS)
        return "REL" in self.tags[k] and (self._unknown(noun) or self._text(noun) == "way")
