"""Talk before an order: words that ask for no act, are about no thing of the scene, and cannot bind the order.

An order that follows stands for itself, so talk before it need not be understood: it is enough that it cannot be an order,
a part of one, a limit or a condition of one. A sentence of its own can be less of those than a clause before the order.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

from robosandbox.agent.language.asides_clauses import (
    ADDRESSING,
    ASKING,
    AUXILIARIES,
    CONDITIONAL,
    DETERMINERS,
    GENERIC,
    HELD_BACK,
    JOKING,
    LIMITING,
    MODALS,
    NEGATIVE,
    OBJECTS,
    OF_LANGUAGE,
    PAST,
    PERSONS,
    PLACING,
    PURPOSES,
    PUTTING_OFF,
    REFERRING,
    REPORTING,
    WHOSE,
    Clause,
    Clausewise,
)
from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.slots import PEOPLE
from robosandbox.agent.language.verbs import BASE_FORMS, UNSUPPORTED_VERBS

_WAYS = frozenset({"DIR", "UNIT", "TIMES", "HOME", "EVERYTHING", "ALL", "BOTH", "EXCEPT", "AVOID", "CORRECTION"})
"""Tags of what says which way, how far, how often or which, if it stands by itself."""
_PLAIN = frozenset({"THE", "A", "PRON", "SHADE", "ABSENT", "ROBOT"})
_MANNER = ("ly", "ways", "wise", "ward", "wards")
_TO_A_PERSON = frozenset({"me", "us", "him", "her", "that", "it"})


class Talking(Enum):
    """Talk: of nothing here, or of what happened to a thing of the scene."""

    IDLE = 1
    OF_A_THING = 2


class _Statement(NamedTuple):
    """Words of a clause from its subject on.

    Attributes:
        verb: Where the finite verb is; None where no statement begins.
        words: All words of the clause.
    """

    start: int
    end: int
    verb: int | None
    words: set[str]


class Talk(Clausewise, ABC):
    """Tells talk from what may belong to an order that comes after it."""

    def apart(self, clause: Clause, clauses: Sequence[Clause]) -> bool:
        """Say whether the sentence of a clause holds no order: all its clauses are talk, and another sentence follows."""
        k = clauses.index(clause)
        first = next(j for j in range(k, -1, -1) if clauses[j].opens)
        last = next((j for j in range(k, len(clauses)) if clauses[j].closes), len(clauses) - 1)
        ended = self._text(clauses[last].end) in (".", "!", "?")
        beside = clauses[first : last + 1]
        return ended and last + 1 < len(clauses) and all(self.is_talk(c, apart=True) is not None for c in beside)

    def is_talk(self, clause: Clause, *, apart: bool) -> Talking | None:
        """Tell talk from what may belong to an order that comes after it; None for what may.

        Args:
            clause: One that no order comes before.
            apart: It is in a sentence of its own.
        """
        start, end = self._after_leads(clause), clause.end
        if start == end:
            return Talking.IDLE if apart else None
        if self._is_courtesy(start, end) or self._addresses(start, end):
            return Talking.IDLE
        if self._asks_for_act(start, end) or self._leads_into_order(clause, start, apart=apart):
            return None
        if apart:
            start = next((k for k in range(start, min(start + 4, end)) if self._text(k) in PERSONS), start)
        said = _Statement(start, end, self._subject(start), {*self.texts[clause.start : end]})
        if self._may_bind(said, apart=apart) or (not apart and self.comments(start, end)):
            return None
        if any(self._concerns(k) for k in range(start, end)):
            told = apart and self._is_somebody(said) and self._is_past(said)
            return Talking.OF_A_THING if told and not (ASKING | {"that"}) & said.words else None
        return Talking.IDLE if self._says_nothing_of_how(said, apart=apart) else None

    def _leads_into_order(self, clause: Clause, start: int, *, apart: bool) -> bool:
        """As in "as soon as she claps", "do it blindfolded", "he said:": when or how, or whose words follow."""
        first, after = self._text(start), self._text(start + 1)
        beside = first == "while" and after in PERSONS - {"you"}
        if (first in CONDITIONAL and not beside) or (
            first == "do" and after in OBJECTS and self._text(clause.end) != ":"
        ):
            return True
        quotes = self._text(clause.end - 1) in REPORTING - ({"say"} if apart else set()) and first != "i"
        return quotes or (not apart and (self._says_when_or_how(clause, start) and not beside))

    def _says_nothing_of_how(self, said: _Statement, *, apart: bool) -> bool:
        """Say whether words about no thing of the scene say nothing of how an order is to be done."""
        span, verb = range(said.start, said.end), said.verb
        acts = any(self._acts(k) for k in span)
        refers = any(self._refers(k, said.end) for k in span)
        if verb is None:
            done = refers and self._text(said.start) in AUXILIARIES
            return not done and self._is_fragment(said.start, said.end, apart=apart)
        if self._is_about_robot(said):
            after = verb + 1 + (verb == said.start)
            mild = {"can", "could", "would"} if self._text(after) in ADDRESSING else {"can", "could"}
            return not (acts or (MODALS - mild) & said.words)
        if not self._is_somebody(said):
            ways = any(_WAYS & self.tags[k] and not self._idle(k) for k in span)
            return not (ways or acts or self._text(verb) in MODALS | PLACING or self._text(verb + 1) == "to")
        return not (acts and refers)

    def _is_past(self, said: _Statement) -> bool:
        text = self._text(said.start if said.verb is None else said.verb)
        return text.endswith("ed") or text in PAST

    @abstractmethod
    def _after_leads(self, clause: Clause) -> int: ...

    @abstractmethod
    def _addresses(self, i: int, end: int) -> bool: ...

    @abstractmethod
    def _says_when_or_how(self, clause: Clause, start: int) -> bool: ...

    @abstractmethod
    def _is_courtesy(self, i: int, end: int) -> bool: ...

    def _concerns(self, k: int) -> bool:
        """Say whether a word names a thing of the scene; "thing" in "the thing is" does not."""
        if not self._thing(k):
            return False
        described = k and self.tags[k - 1] & {"COLOUR", "SIZE", "SHADE", "SUPER", "POS", "NUM", "ORDINAL"}
        return self.texts[k] not in GENERIC or bool(described)

    def _is_about_robot(self, said: _Statement) -> bool:
        asked = said.verb == said.start and self._text(said.start + 1) == "you"
        return asked or self._text(said.start) == "you"

    def _is_somebody(self, said: _Statement) -> bool:
        """Say whether a statement is about a person, or about a thing that is not here."""
        text = self._text(said.start)
        if said.verb is None or self._is_about_robot(said) or (text in REFERRING and said.verb == said.start + 1):
            return False
        return text in PERSONS | WHOSE | DETERMINERS or self._unknown(said.start) or said.verb == said.start

    def _asks_for_act(self, start: int, end: int) -> bool:
        """Say whether it begins like an order: "tidy up", "let us go"; "let me think", "show him" turn to a person."""
        ends = {start}
        for stop, tag, _ in LEXICON.at(self.tokens, start):
            if tag in ("PREAMBLE", "DESIRE"):
                ends.add(stop)
        for k in ends:
            text = self._text(k) if k < end else ""
            if text in ADDRESSING or text in AUXILIARIES or (k < end and self._thing(k)):
                continue
            if text in BASE_FORMS or text in UNSUPPORTED_VERBS:
                return True
        return False

    def _may_bind(self, said: _Statement, *, apart: bool) -> bool:
        """Say whether words may forbid, limit or put off the order that follows.

        What somebody says in a sentence of its own does so only where it is about the order: "we want it later".
        """
        words = said.words
        if words & JOKING or (words & (CONDITIONAL - {"while"}) and not apart):
            return True
        if (words & PUTTING_OFF and {"i", "we"} & words) or (words & NEGATIVE and self._is_about_robot(said)):
            return True
        forward = "this" in words and words & OF_LANGUAGE
        about = self._text(said.start) in ("they", "these", "those") and not self._is_somebody(said)
        forbids = words & NEGATIVE and words & {"must", "should", "shall", "ought"}
        if forward or about or forbids:
            # "read this aloud. ...", "they are glued together. ...", "the lid must not be touched. ..."
            return True
        return bool(words & (LIMITING | NEGATIVE)) and (not self._is_somebody(said) or bool(words & HELD_BACK))

    def _is_fragment(self, start: int, end: int, *, apart: bool) -> bool:
        """Say whether words that are no sentence tell no way, number or order in which to do what follows."""
        span = range(start, end)
        for k in span:
            number = self.tokens[k].kind == "number" or self.tags[k] == {"NUM"}
            counts = number and not (apart and (self._unknown(k + 1) or self._text(k - 1) == "at"))
            if counts or self.texts[k].endswith(_MANNER) or (_WAYS & self.tags[k] and not self._idle(k)):
                return False
        strange = [self._unknown(k) or self.tags[k] == {"ABSENT"} for k in span]
        called = all(
            new or self.tags[k] <= _PLAIN or self._text(k) in PEOPLE for k, new in zip(span, strange, strict=True)
        )
        purpose = self._text(start) in PURPOSES and not self.tags[end - 1] & {"ALL", "EVERYTHING"}
        turned = self._text(start) in ADDRESSING and {*self.texts[start:end]} & _TO_A_PERSON
        return bool(turned) or (any(strange) and (apart or purpose or (called and self._text(end) != ":")))
