"""Clauses that tell of something beside the order: they are set aside, and what they speak of stays the topic.

A clause goes only if it is a statement about a person, or about how a thing is, and holds no order, prohibition,
condition, exception, count, measure or place among the things of the scene; and only if an order remains.
"""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.remarks import BINDING, HARMLESS, SPEAKERS, STATES, WHOSE, of_people, tells_where
from robosandbox.agent.language.slots import PEOPLE, Said
from robosandbox.agent.language.sparing import may_spare
from robosandbox.agent.language.speech import CONDITIONS
from robosandbox.agent.language.tokens import MARKS, Token
from robosandbox.agent.language.verbs import BASE_FORMS
from robosandbox.agent.language.wordlist import word_set

_REASONS = word_set("because cause since as seeing considering though although")
_LEADS = _REASONS | word_set("and but so then plus also well")
_ALWAYS_APART = _REASONS | word_set("so but before")
_PRONOUNS = word_set("it that this they there these those")
_AUXILIARIES = word_set("is are was were has have had will would can could may might does did do am be been")
_LINKS = (
    _AUXILIARIES
    | STATES
    | word_set(
        """
        keep kept went came fell broke got made told likes loves hates knows reckons thinks feels makes lets takes drives
        means_ hurts bothers annoys matters works helps happens leaks drips wobbles smells stinks stings
        """
    )
)
_ORDERING = word_set(
    """
    goes go belongs belong lives live sits sit stands stand stays stay remain remains needs need wants want deserves
    should must shall ought supposed meant let lets allowed rather instead myself yourself ourselves himself herself
    tomorrow tonight later soon yesterday nobody nothing none never no neither nor without only except unless until till
    if whether otherwise else or when while whenever once again first last stop wait cancel please
    unchanged constant untouched unmoved
    """
)
_WISHES = word_set("want wants need needs wish wishes prefer prefers expect expects wanted needed require requires")
_FUTURE = word_set("will shall going gonna")
_REFERRING = word_set("it that this them those these one the")
_IDLE = HARMLESS | word_set(
    """
    how why what as like likes know knows does did do makes made keep keeps kept going gone go way time times bad worse worst
    better best much many see good ok okay tired trouble
    """
)


_TELLING = frozenset(
    [
        "DIR",
        "REL",
        "ITS_SIDE",
        "NUM",
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
        "BEFORE",
        "AFTER",
        "FIRST",
        "PREAMBLE",
        "DESIRE",
        "OWN_WISH",
        "TIMES",
        "HOME",
        "FLOOR",
        "ARM",
        "OTHERS",
        "OTHER",
        "ORIGINAL",
        "SAME",
        "MATCHING",
        "FROM",
        "TOP",
        "BOTTOM",
    ]
)
_AROUND = word_set("edge edges corner table desk floor counter bench way side place spot own")
_PREPOSITIONS = word_set(
    "towards near close in on at of to with for from by about off over under around out up down apart away"
)
_SAYING = word_set("says say said tells told reckons thinks thought claims asked asks")
_GONE = word_set("out off bad mouldy moldy stale rotten soft rusty cold wrong on")


def without_incidentals(said: Said) -> Said:
    """Return a sentence without the clauses that only tell of something; the same sentence if there are none."""
    left = _Incidentals(said).removed()
    return said if may_spare(said, left) else said.now(left)


class _Incidentals:
    """One sentence, looked through for statements."""

    def __init__(self, said: Said) -> None:
        self.tokens = tuple(said.tokens)
        self.texts = said.texts
        self.words = said.words
        self.tags = [{tag for _, tag, _ in LEXICON.at(self.tokens, i)} for i in range(len(self.tokens))]
        self.topic: tuple[Token, ...] = ()

    def removed(self) -> tuple[Token, ...]:
        kept: list[Token] = []
        topic_at, i, n, changed = 0, 0, len(self.tokens), False
        while i < n:
            edge = not kept or kept[-1].text in MARKS
            lead = i
            while self._text(lead) in _LEADS and (
                edge or lead > i or (self._text(i) in _ALWAYS_APART and self._text(i - 2) != "as")
            ):
                lead += 1
            if self._text(lead) == "before" and self._text(lead + 1) in SPEAKERS | WHOSE | {"someone"}:
                lead += 1
            apart = edge or lead > i
            end = self._end(lead) if apart else lead
            topics = len(self.topic)
            if apart and end > lead and self._tells(lead, end, first=not kept):
                if len(self.topic) > topics:
                    if topics:
                        return self.tokens
                    topic_at = len(kept)
                changed = True
                i = end
                while (
                    edge and i < n and (self.texts[i] in (",", ".", "!", ";") or self.texts[i] in ("so", "and", "but"))
                ):
                    i += 1
                continue
            kept.append(self.tokens[i])
            i += 1
        while kept and kept[-1].text in (",", ";", ":", "and", "so", "but"):
            kept.pop()
        while kept and kept[0].text in ("but", "so", "and"):
            kept.pop(0)
        if not changed or not kept:
            return self.tokens
        return self._with_topic(kept, topic_at) if self.topic else tuple(kept)

    def _with_topic(self, kept: Sequence[Token], at: int) -> tuple[Token, ...]:
        """Name what was spoken of where the rest refers to it: "the can is old, bin it"."""
        rest = kept[at:]
        tags = [{tag for _, tag, _ in LEXICON.at(rest, i)} for i in range(len(rest))]
        pronoun = next((i for i in range(len(rest)) if "PRON" in tags[i]), None)
        if pronoun is None:
            bare = not any("VERB" in found and (k == 0 or "NOUN" not in found) for k, found in enumerate(tags))
            return (*kept[:at], *self.topic, Token(",", ",", "mark"), *rest) if bare else tuple(kept)
        if any(rest[i].text in self.words.forms or "NOUN" in tags[i] for i in range(pronoun)):
            if any("PRON" in found for found in tags[pronoun + 1 :]):
                return self.tokens
            return (*kept[:at], *rest[:pronoun], *self.topic, *rest[pronoun + 1 :])
        return (*kept[:at], *self.topic, Token(",", ",", "mark"), *rest)

    def _text(self, i: int) -> str:
        return self.texts[i] if 0 <= i < len(self.texts) else ""

    def _end(self, i: int) -> int:
        """Return where the clause at `i` ends: at a mark, or where a joint leads on to something else."""
        j = i
        while j < len(self.tokens) and self.texts[j] not in MARKS:
            apart = self.texts[j] in _ALWAYS_APART - {"as"}
            begins = self._opens(j + 1) or self._states(j + 1) or (j + 1 < len(self.tokens) and self._thing(j + 1))
            if j > i and apart and (self.texts[j] != "so" or begins):
                break
            if j > i and self.texts[j] in ("and", "then") and self._opens(j + 1):
                break
            j += 1
        return j

    def _opens(self, i: int) -> bool:
        """Say whether an order or a new statement may begin here."""
        while self._text(i) in ("then", "please", "also", "so"):
            i += 1
        if i >= len(self.tokens):
            return False
        new = {"PREAMBLE", "DESIRE", "NEGATION", "AVOID", "PRON"} & self.tags[i]
        return self.texts[i] in BASE_FORMS or bool(new) or self.texts[i] in ("i", "we", "he", "she", "they")

    def _states(self, i: int) -> bool:
        return i < len(self.tokens) and (self.texts[i] in _PRONOUNS or bool({"THE", "POSS"} & self.tags[i]))

    def _thing(self, k: int) -> bool:
        text = self._text(k)
        if text == "can" and not (k and self.tags[k - 1] & {"THE", "A", "COLOUR", "SIZE", "SHADE", "POSS"}):
            # "so the cat can see"
            return False
        named = self.tokens[k].kind == "id" or text in self.words.forms
        return named or bool({"NOUN", "COLOUR", "TABLE"} & self.tags[k])

    def _unknown(self, k: int) -> bool:
        return self.tokens[k].kind == "word" and not self.tags[k] and not self._thing(k)

    def _tells(self, i: int, end: int, *, first: bool) -> bool:
        """Say whether the clause tells of something and binds nothing; notes its topic."""
        span = range(i, end)
        if self._text(end + 1) in ("never", "forget", "scratch", "ignore"):
            # "where did I ... oh never mind" takes back what was begun.
            return False
        if end < i + 2 or self._text(end) == "?" or any(self.tokens[k].kind == "number" for k in span):
            return False
        outcome = self.texts[i:end] if self._text(i - 1) == "so" and self._ordered(i) else [""]
        if outcome[0] in ("it", "they") and tells_where(outcome):
            return False
        person = self._person(i, end) if outcome[0] != "they" or of_people(outcome) else 0
        if person:
            return self._about_person(person, end, first=first)
        if (
            self._text(i) in ("it", "that", "this")
            and self._text(i + 2) in ("what", "how", "why")
            and self._link(i + 1)
        ):
            # "that is how my mum likes it"
            bound = (_ORDERING - _WISHES) | BINDING | {"not"}
            return not (bound & {*self.texts[i:end]} or any(self._thing(k) for k in span))
        if self.texts[end - 1] in ("much", "little") and self._text(i) in _PRONOUNS:
            # "push it 10 cm, but that is too much" takes back how far.
            return False
        if self._text(i) in _PRONOUNS and not self._thing(i + 1):
            if self._text(end - 2) in ("a", "an", "the") and "ABSENT" in self.tags[end - 1]:
                # "take the orange one, it is a carrot" tells what it is.
                return False
            return self._link(i + 1) and self._idle(i + 1, end)
        name = next((k for k in range(i, end) if not self._thing(k)), end)
        # "the can is old", "sample c is old"
        bare = name > i and self._link(name)
        named = (
            bare
            or bool({"THE", "POSS", "BOTH", "ALL"} & self.tags[i])
            or self._text(i) in ("that", "this", "my", "our")
        )
        if not first or not named:
            return False
        verb = next((k for k in range(i + 1, end) if self._link(k)), None)
        if verb is None or not any(self._thing(k) for k in range(i, verb)) or not self._idle(verb, end):
            return False
        if any(
            not (self._thing(k) or self.tags[k] & {"SIZE", "SHADE", "THE", "A", "POS", "SUPER", "BOTH", "ALL"})
            for k in range(i, verb)
        ):
            return False
        self.topic += self.tokens[i:verb]
        return True

    def _ordered(self, i: int) -> bool:
        """Say whether an order was given before, of which "so" tells the outcome."""
        return any(text in BASE_FORMS for text in self.texts[:i])

    def _person(self, i: int, end: int) -> int:
        """Return where the words for a person at `i` end, 0 if there are none."""
        text = self._text(i)
        if text in SPEAKERS and text not in ("boss",):
            return i + 1
        start = i + 1 if text in WHOSE or text in ("the", "that", "this", "some", "a") else i
        if start > i and start < end and not self._thing(start):
            known = self._text(start) in PEOPLE or text in WHOSE
            if known or (self._unknown(start) and self._link(start + 1)):
                return start + 1
        named = start == i and (self._unknown(i) or text in PEOPLE) and text not in CONDITIONS
        return i + 1 if named and self._link(i + 1) else 0

    def _link(self, k: int) -> bool:
        """Say whether a finite verb stands here that asks for nothing."""
        text = self._text(k)
        if k >= len(self.tokens) or text in _ORDERING:
            return False
        told = self._unknown(k) and text.endswith(("s", "ed")) and len(text) > 3
        return text in _LINKS or told or (self._adverb(k) and self._link(k + 1))

    def _adverb(self, k: int) -> bool:
        return self._text(k) in ("just", "really", "always", "normally", "usually", "already", "still", "all") or (
            self._unknown(k) and self._text(k).endswith("ly")
        )

    def _about_person(self, i: int, end: int, *, first: bool) -> bool:
        texts = self.texts[i:end]
        if (
            _ORDERING - {"need", "needs", "want", "wants", "go", "goes", "live", "lives", "sit", "again", "no", "stand"}
        ) & {*texts}:
            return False
        if BINDING & {*texts} or "you" in texts:
            return False
        named = [k for k in range(i, end) if self._thing(k)]
        if named and not (first and self._spoken_of(named, i, end)):
            return False
        for k in range(i, end):
            if self.texts[k] in _WISHES and ("not" in texts or {*texts[k - i + 1 :]} & _REFERRING):
                return False
            if (
                self.texts[k] in _FUTURE
                and any("VERB" in self.tags[m] for m in range(k + 1, end))
                and {*texts} & _REFERRING
            ):
                # "I will do it" takes the order back.
                return False
            if self.texts[k] == "would" and self._text(k + 1) in ("like", "love", "prefer"):
                return False
        return any(self._link(k) or self.tags[k] & {"VERB", "DESIRE"} or self._unknown(k) for k in range(i, end))

    def _spoken_of(self, named: Sequence[int], i: int, end: int) -> bool:
        """Say whether one thing is told of and spared from nothing: "the customer waits for the can, put it in the box"."""
        the = next((k for k in range(named[-1], i - 1, -1) if "THE" in self.tags[k]), None)
        one = the is not None and all(the < k for k in named) and named[-1] - named[0] == len(named) - 1
        bound = _WISHES | _FUTURE | _SAYING | {"not", "would"}
        if self.texts[i : end - 1] == ["do", "not", "like"] and "COLOUR" in self.tags[end - 1]:
            return True
        if bound & {*self.texts[i:end]} or (the is not None and not one):
            return False
        if the is not None:
            self.topic += self.tokens[the : named[-1] + 1]
        return the is not None or not {"it", "them", "they"} & {*self.texts[end:]}

    def _idle(self, i: int, end: int) -> bool:
        """Say whether what is said of a thing names no other thing, no place and nothing that binds."""
        for k in range(i, end):
            text = self.texts[k]
            if text == "not":
                a = k + 2 if self._text(k + 1) in ("a", "an", "very", "that", "so") else k + 1
                if a >= end or not (self._unknown(a) or self._text(a) in HARMLESS):
                    return False
            elif text in _AROUND:
                continue
            elif text in _ORDERING - {"again", "go"} or text in BINDING - {"again"} or self._thing(k):
                return False
            elif text in ("going", "staying"):
                if self._text(k + 1) not in _GONE and not (k + 1 < end and self._unknown(k + 1)):
                    return False
            elif text not in _PREPOSITIONS and self._asks(k) and not (text in _IDLE or text in _LINKS):
                return False
        return True

    def _asks(self, k: int) -> bool:
        """Say whether a word could ask for something, or say where, which way or how much."""
        return bool(_TELLING & self.tags[k]) or ("VERB" in self.tags[k] and self.texts[k] in BASE_FORMS)
