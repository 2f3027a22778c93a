"""Chat around an order: of its clauses the one with an act or a thing of the scene is the order, the others are chat.

A clause is set aside if it names no thing of the scene and asks for no act, or if somebody tells of a thing in it and asks
for nothing; never if it says if, not, only, again, maybe, instead and the like, which may bind the order. What is no
sentence ("ugh, Mondays") goes only where no order stands before it in the same sentence, as it may say how.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from robosandbox.agent.language.asides_clauses import (
    ACCIDENTS,
    ADDRESSING,
    ASKING,
    AUXILIARIES,
    BINDING,
    COURTEOUS,
    FRAMES,
    GENERIC,
    GREETINGS,
    HELD_BACK,
    HELD_OFF,
    LABELS,
    LEADS,
    LIMITING,
    MODALS,
    NO_MATTER,
    OBJECTS,
    ORDERED,
    PERSONS,
    PLACING,
    POLITE,
    PUT_OFF,
    REASONS,
    REFERRING,
    TAKEN_BACK,
    TIMED,
    WHOSE,
    WILLING,
    Clause,
    may_spare,
)
from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.talk import Talk, Talking
from robosandbox.agent.language.tokens import MARKS, Token
from robosandbox.agent.language.verbs import BASE_FORMS, UNSUPPORTED_VERBS

_TELLING = frozenset(
    [
        "DIR",
        "REL",
        "ITS_SIDE",
        "UNIT",
        "ALL",
        "BOTH",
        "EVERYTHING",
        "EXCEPT",
        "AVOID",
        "NEGATION",
        "STILL",
        "INSTEAD",
        "CORRECTION",
        "TIMES",
        "HOME",
        "FLOOR",
        "OTHER",
        "OTHERS",
        "REST",
        "ORIGINAL",
        "SAME",
        "MATCHING",
        "TOP",
        "BOTTOM",
        "SUPER",
        "TABLE",
    ]
)
"""Tags of what says where, which way, how much or which."""
_PLAIN_TAGS = frozenset({"THE", "A", "PRON", "IS", "SHADE", "SIZE", "ABSENT", "PART", "COPULA", "IS_NOW", "ROBOT"})
_FURTHER = frozenset({"next", "too", "also", "same", "likewise", "there", "well", "then"})
"""With which a thing is asked for as those before: "the can is next", "the can as well"."""
_MANNER = ("ly", "ways", "wise", "ward", "wards")


class _Kind(Enum):
    """What a clause is: what is asked for, chat, or something told of a thing."""

    ORDER = 1
    CHAT = 2
    TOLD = 3


_TALK = {Talking.IDLE: _Kind.CHAT, Talking.OF_A_THING: _Kind.TOLD}


def without_asides(said: Said) -> Said:
    """Return a sentence without the clauses that are chat; the same sentence if there are none, or nothing but those."""
    left = _Asides(said).left()
    return said if may_spare(said, left) else said.now(left)


class _Asides(Talk):
    """One sentence, of whose clauses some are set aside."""

    def left(self) -> tuple[Token, ...]:
        """Return the tokens of what is asked for, and before them the thing that they refer to."""
        kept: list[int] = []
        topics: list[tuple[Token, ...]] = []
        dropped = ordered = False
        clauses = [*self._clauses()]
        for clause in clauses:
            ordered = ordered and not clause.opens
            began = any(self._thing(k) for k in kept)
            talk = None if kept else self.is_talk(clause, apart=self.apart(clause, clauses))
            named = kept or any(self._thing(k) for k in range(clause.start, clause.end))
            kind = _Kind.ORDER if talk or not named else self._kind(clause, ordered=ordered, began=began)
            kind = _TALK[talk] if talk else kind
            if kind is _Kind.ORDER:
                start = clause.start + (not kept and self.texts[clause.start] in ("and", "but", "so"))
                framed = self._framed(start, clause.end)
                dropped, start = dropped or framed > start, framed
                kept += range(start, clause.after)
                ordered = True
                continue
            dropped = True
            if kind is _Kind.TOLD:
                topics.append(self._topic(clause))
            if kept and self.texts[kept[-1]] == ",":
                kept[-1:] = range(clause.end, clause.after)[:1]
            elif kept and clause.after > clause.end and self.texts[kept[-1]] not in MARKS:
                kept.append(clause.end)
        while kept and self.texts[kept[-1]] in (",", ";", ":"):
            kept.pop()
        if not dropped or not kept:
            return self.tokens
        return self._referring(kept, topics)

    def _referring(self, kept: Sequence[int], topics: Sequence[tuple[Token, ...]]) -> tuple[Token, ...]:
        """Name what was told of where the order only refers to it: "the can is old, bin it"."""
        order = tuple(self.tokens[k] for k in kept)
        refers = [k for k in kept if "PRON" in self.tags[k]]
        bare = not any("VERB" in self.tags[k] for k in kept)
        if topics and {"there", "back", "same"} & {self.texts[k] for k in kept}:
            # "somebody put the can in the bin. Put the ball there"
            return self.tokens
        named = next((k for k in kept if self._thing(k)), len(self.tokens))
        if not topics or not (bare or (refers and refers[0] < named)):
            return order
        if len(topics) != 1 or not topics[0]:
            return self.tokens
        return (*topics[0], Token(",", ",", "mark"), *order)

    def _kind(self, clause: Clause, *, ordered: bool, began: bool) -> _Kind:
        start = self._after_leads(clause)
        span = range(start, clause.end)
        things = [k for k in span if self._thing(k)]
        if not things and self._is_courtesy(start, clause.end):
            return _Kind.CHAT
        # "the note reads: pick up the can"
        if not span and self._text(clause.start) != "right":
            return _Kind.CHAT
        if span and not things and (self._gives_reason(clause, start) or self._addresses(start, clause.end)):
            return _Kind.CHAT
        if (
            not span
            or (self._text(clause.end) == ":" and (things or any(self._acts(k) for k in span)))
            or self._binds(clause, start, began=began)
            or self._says_when_or_how(clause, start)
        ):
            return _Kind.ORDER
        subject = self._subject(start, ordered=ordered)
        explains = self._text(clause.start) in REASONS and self._text(start) in PERSONS - {"you"} and not things
        if (self._orders(start, clause.end) and not explains) or (subject is not None and subject > clause.end):
            return _Kind.ORDER
        told = subject is not None and self._tells(start, subject, clause, things)
        if began:
            # What is said after an order may limit it or take it back: "it is the small one", "that will do".
            first = self._text(clause.start)
            reason = first in REASONS | {"before", "while", "cause"}
            says_how = any(_TELLING & self.tags[k] and not self._idle(k) for k in span)
            somebody = self._text(start) in PERSONS - {"you"} or self._text(start) in WHOSE - {"your"}
            # What is said between two orders may take the first one back.
            final = not any(self._thing(k) or self._acts(k) for k in range(clause.after, len(self.texts)))
            idle = self._unknown(clause.end - 1) or self._idle(clause.end - 1)
            told = told and (reason or (final and (somebody or idle)))
            told = told and not (things or says_how or (first != "before" and self.comments(start, clause.end)))
        if things:
            return _Kind.TOLD if told and not (ordered and self._text(clause.start) not in REASONS) else _Kind.ORDER
        if subject is not None:
            return _Kind.CHAT if told else _Kind.ORDER
        return _Kind.ORDER

    def _after_leads(self, clause: Clause) -> int:
        start = clause.start
        while start < clause.end and self.texts[start] in LEADS:
            start += 1
        return start

    def _framed(self, start: int, end: int) -> int:
        """Return where the order begins in "it would be super if you could pick ...", "might I ask you to pick ..."."""
        for k in range(start + 1, end):
            wished = self._text(k) in ("i", "we") and "DESIRE" in self.tags[k] and any(map(self._thing, range(k, end)))
            if wished and {*self.texts[start:k]} <= COURTEOUS | GENERIC and "if" not in self.texts[start:k]:
                return k
            tail = " ".join(self.texts[k - 2 : k])
            asked = tail in FRAMES or (self.texts[k - 1] == "to" and "you" in self.texts[start:k])
            if not (asked and self._text(k) in BASE_FORMS and "VERB" in self.tags[k]):
                continue
            # "so you can put it away" tells what for.
            polite = {*self.texts[start:k]} <= COURTEOUS and self.texts[start : start + 2] not in (
                ["so", "you"],
                ["as", "you"],
            )
            return k if polite and not {"i", "we"} & {*self.texts[k - 2 : k]} else start
        return start

    def _gives_reason(self, clause: Clause, start: int) -> bool:
        """As in "because I no longer need it", "so it does not roll away": why, and nothing of how or where."""
        first, words = self._text(clause.start), {*self.texts[clause.start : clause.end]}
        subject = self._subject(start)
        if first not in REASONS or start == clause.start or subject is None or self._text(start) == "you":
            return False
        if first in ("though", "although") and self.comments(start, clause.end):
            return False
        if first == "so" and self._text(start) not in PERSONS and self._text(subject + 1) != "not":
            # "so it is at the side" says where.
            return False
        if self._text(subject + 1) == "not" and self._text(subject + 2) in ACCIDENTS and not LIMITING & words:
            # "so it does not roll away"
            return True
        told = any(
            (_TELLING - {"NEGATION", "STILL"}) & self.tags[k] and not self._idle(k) for k in range(start, clause.end)
        )
        acts = any(self._acts(k) for k in range(start, clause.end))
        return not (told or acts or (BINDING | TIMED | HELD_OFF) & words)

    def _binds(self, clause: Clause, start: int, *, began: bool) -> bool:
        """Say whether a clause may forbid, limit, put off or take back an order."""
        words = {*self.texts[clause.start : clause.end]} - (frozenset() if began else TAKEN_BACK)
        if BINDING & words or (began and TAKEN_BACK & words):
            return True
        somebody = self._text(start) in PERSONS - {"you"} or self._text(start) in WHOSE - {"your"}
        if somebody and {"can", "could"} & words and not HELD_OFF & words:
            # "I can not reach it"
            words -= {"not"}
        negated = bool(words & {"not", "never", "no"}) and bool(words & HELD_BACK)
        things = any(self._thing(k) for k in range(start, clause.end))
        return bool(PUT_OFF & words) and (not somebody or negated or things)

    def _is_courtesy(self, i: int, end: int) -> bool:
        """As in "no rush", "thank you so much", "if that is all right", "when you have a minute"."""
        first, words = self._text(i), self.texts[i:end]
        if self._text(end) == ":" and LABELS & {*words}:
            return all(
                self._unknown(k) or self.tags[k] <= _PLAIN_TAGS | ORDERED or words[k - i] in LABELS
                for k in range(i, end)
            )
        if first == "no":
            return len(words) == 2 and words[1] in NO_MATTER
        if first in AUXILIARIES and words[1:2] == ["not"] and len(words) in (3, 4):
            # "..., does it not?", "is that not sweet"
            return words[2] in OBJECTS | PERSONS and all(self._unknown(k) for k in range(i + 3, end))
        if first in ("if", "when", "whenever"):
            said = {*words}
            free = bool(said & WILLING) and ("you" in said or "it" in said or "that" in said or "possible" in said)
            return free and said <= POLITE and words[-1] not in ("it", "that", "to", "you")
        acts = any(self._acts(k) or _TELLING & self.tags[k] for k in range(i + 1, end))
        if len(words) == 2 and first in ("will", "would", "could", "can") and words[1] == "you":
            return True
        alone = len(words) == 1 and first in ("sorry", "excuse", "pardon")
        return first in GREETINGS and not (
            alone or acts or (BINDING | PUT_OFF) & {*words} or any(self._refers(k, end) for k in range(i, end))
        )

    def _says_when_or_how(self, clause: Clause, start: int) -> bool:
        """Say whether a clause may tell at what time, in which way or of which thing an order is meant."""
        first, after = self._text(clause.start), self._text(start)
        if after in TIMED or "which" in self.texts[start + (clause.end > start + 1) : clause.end]:
            return True
        if first == "while":
            # "while I make coffee" says when as little as "before she comes"; "while the bin is empty" says as long as.
            return after not in PERSONS - {"you"}
        if first in ("before", "so") and after in REFERRING - {"there"}:
            # "so they can talk"
            return not (first == "so" and after == "they" and self._text(start + 1) in ("can", "could"))
        if first == "as":
            return after in ("you", "soon", "long", "much", "often", "far", "well")
        # "pick up the orange thing. It is a banana."
        what = self.texts[start + 2 : start + 3] in (["a"], ["an"], ["the"]) and after in REFERRING - {"there"}
        return what and "ABSENT" in self.tags[clause.end - 1]

    def _addresses(self, i: int, end: int) -> bool:
        """As in "look at you", "let us see what you have got", "be a dear"."""
        start = i + 2 if self.texts[i : i + 2] in (["let", "us"], ["let", "me"], ["do", "not"]) else i
        turned = start + 1 < end and self._text(start) in ADDRESSING
        acts = any("VERB" in self.tags[k] and self._text(k) in BASE_FORMS for k in range(start + 1, end))
        return (
            turned
            and not acts
            and "first" not in self.texts[start:end]
            and not any(self._refers(k, end) for k in range(start, end))
        )

    def _orders(self, i: int, end: int) -> bool:
        """Say whether a clause asks for an act: "pick ...", "you should put ...", "I want to move ..."."""
        ends = {i}
        for k in (i, i + 1):
            starts = (
                LEXICON.at(self.tokens, k) if k < end and (k == i or self._text(i) in ("please", "now", "just")) else ()
            )
            ends |= {stop for stop, tag, _ in starts if tag in ("PREAMBLE", "DESIRE", "OWN_WISH")}
        for k in ends:
            text = self._text(k) if k < end else ""
            if text in BASE_FORMS or (text in UNSUPPORTED_VERBS and text not in ADDRESSING | AUXILIARIES):
                return not (k > i and self._text(k + 1) == "you")
        return False

    def _tells(self, start: int, verb: int, clause: Clause, things: Sequence[int]) -> bool:
        """Say whether a statement tells of something and asks for nothing."""
        end, rest = clause.end, range(verb, clause.end)
        you = self._text(start) == "you" or (start == verb and self._text(start + 1) == "you")
        person = self._text(start) in PERSONS or self._text(start) in WHOSE or start == verb
        acts = [k for k in rest if self._acts(k) and not (person and not you and self._past(k))]
        does = any(self._text(k) in ("do", "done", "doing") and self._text(k + 1) in OBJECTS for k in rest)
        about = [k for k in things if k < verb]
        if person and not about:
            referred = bool(acts or does) and any(self._refers(k, end) for k in rest)
            asked = bool(things) and (you or bool(acts) or bool(ASKING & {*self.texts[verb:end]}))
            # "..., he said" tells whose words those are.
            return not (asked or (referred and not (you and not acts)) or self._text(end - 1) in ("said", "says"))
        telling = any(_TELLING & self.tags[k] and not self._idle(k) for k in rest if k > verb)
        if self._text(start) == "there":
            return not (acts or telling)
        if about and (about != list(things) or "you" in self.texts[start:end]):
            return False
        if about and _FURTHER & {*self.texts[verb:end]}:
            return False
        if about or self._text(start) in REFERRING:
            bound = self._text(verb) in MODALS | PLACING or self._text(verb + 1) == "to"
            reason = self._text(clause.start) in REASONS
            return not (acts or does or bound or (telling and not reason))
        return not (acts and things)

    def _topic(self, clause: Clause) -> tuple[Token, ...]:
        """Return the one thing that is told of with its determiner; nothing if there are several."""
        things = [k for k in range(clause.start, clause.end) if self._thing(k)]
        if things[-1] - things[0] != len(things) - 1:
            return ()
        first = things[0]
        while first > clause.start and self.tags[first - 1] & {"THE", "A", "SIZE", "SHADE", "SUPER", "POS"}:
            first -= 1
        return self.tokens[first : things[-1] + 1]
