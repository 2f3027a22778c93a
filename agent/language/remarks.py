"""What people say beside a command: courtesies, reasons, purposes, small talk; left out only where it binds nothing.

A remark goes only if none of its words could ask for something, forbid it, or say when, where or how: what is doubtful
stays, and the sentence is refused as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.adjectives import CLAIMS, FEELINGS
from robosandbox.agent.language.courtesies import COURTESIES, is_purpose, restarted
from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.sparing import may_spare
from robosandbox.agent.language.tokens import MARKS, SceneWords, Token
from robosandbox.agent.language.verbs import BASE_FORMS, UNSUPPORTED_VERBS
from robosandbox.agent.language.wordlist import word_set

_PERHAPS = word_set(
    """
    if when whenever you it that is would be are were can could may might i so kind good nice sweet lovely able willing
    not too much trouble bother ask asking of to a an moment minute second sec time chance possible convenient okay ok
    alright fine up for free ready busy feel like do mind have get got find please the problem all no as long spare and
    there me my day care
    """
)
_WILLING = word_set(
    "mind kind good nice sweet lovely can could would able willing minute moment second sec time chance ready free like care please"
)
_NO_TROUBLE = word_set("trouble bother possible convenient ask asking okay ok alright fine problem")
_MAKING_SURE = frozenset({"if", "when", "whenever", "should"})
BINDING = word_set(
    """
    if unless until till when whenever otherwise else instead except only first then after once twice again yet later
    tomorrow tonight never joke joking kidding changed mind cancel stop abort wrong mistake mistaken lying meant mean
    should must shall ought supposed said says say told tells asked asks wrote quote upright upside sideways facing vertical horizontal not_ allowed forbidden without
    careful carefully avoid beware whether or
    """
)
SPEAKERS = word_set(
    """
    i we he she they everyone everybody someone somebody nobody people mommy mummy daddy granny nan grandad mum mom dad mother father grandma grandpa kids
    children guests visitors customers boss
    """
)
WHOSE = frozenset({"my", "our", "his", "her", "their"})
STATES = word_set(
    "is are was were looks look seems seem feels feel has have had got keeps smells appears gets getting became being came"
)
HARMLESS = (
    CLAIMS
    | FEELINGS
    | word_set(
        """
        a an the very too so really quite rather all just now here there today this that it them they my our your me us in
        of way everywhere anymore any more longer getting been being is are was were mess messy untidy crowded cluttered
        busy late early almost nearly already finally always still for at with and bit little lot big small
        rolling slipping tipping leaking dripping wobbling squeaking annoying bothering falling fall falls fallen over down off roll rolls rolling away break breaks breaking tip tips tipping spill spills
        slip slips lost get gets safe safer secure neat tidy nice out hurt clean will does do can could would
        right over side corner yours mine place spot position
        open opened closed shut unlocked went turned gone
        empty room space full enough needed necessary required useful important wanted good great ready done finished
        completely totally entirely utterly worn through
        dinner lunch breakfast came back arrived returned day morning week ages hours night
        """
    )
)
_DENIABLE = word_set(
    "needed necessary required useful important wanted good safe nice helpful fall roll break tip spill slip get hurt in be any"
)
_ABLE = frozenset({"can", "could", "may", "might", "will", "would"})
_ALONE = word_set(
    "hide sleep rest nap breathe dry cool cook bake warm watch see look listen eat drink play swim dance sing grow dream relax soak drip shine"
)
"""What a thing is put somewhere to do by itself."""
_WHEREABOUTS = word_set(
    "next beside near nearer close closer apart left side sides corner corners front behind between edge edges row line"
)
_WISHES = frozenset({"want", "need", "prefer", "like", "wish", "love", "would"})
_JOINTS = frozenset({"and", "then", "but", "so"})
_BEFALLING = word_set(
    """
    rolls roll falls fall slips slip slides slide tips tip tumbles tumble topples topple drops drop spills spill breaks break
    leaks leak drips drip melts melt cools gets get goes go bounces bounce wobbles wobble blows blow flies fly
    """
)
_OVER_THE_EDGE = word_set("the my our this table edge desk counter bench floor side ground")
_JUST_BEFORE = word_set("stop stops stopping just right shortly until till halt end ends")


def tells_where(outcome: Sequence[str]) -> bool:
    """Say whether an outcome tells of a place, as in "so that they are next to each other", "so it is in the corner"."""
    return not _WHEREABOUTS.isdisjoint(outcome)


def of_people(outcome: Sequence[str]) -> bool:
    """Say whether "they" do something themselves, as in "so they can reach it", "so they find it"."""
    return bool({*outcome[1:2]} & {*_ABLE, "do"}) or not {"it", "them"}.isdisjoint(outcome)


def without_remarks(said: Said) -> Said:
    """Return a sentence without courtesies, reasons and small talk that bind nothing; the same sentence if there are none."""
    said = COURTESIES.reworded(said.now(restarted(said.tokens)))
    left = _Remarks(said.tokens, said.words).removed()
    return said if may_spare(said, left) else said.now(left)


class _Remarks:
    """One sentence, looked through for remarks."""

    def __init__(self, tokens: Sequence[Token], words: SceneWords) -> None:
        self.tokens = tokens
        self.words = words
        self.tags = [{tag for _, tag, _ in LEXICON.at(tokens, i)} for i in range(len(tokens))]

    def removed(self) -> tuple[Token, ...]:
        kept: list[Token] = []
        i, n = 0, len(self.tokens)
        while i < n:
            edge = not kept or kept[-1].text in MARKS
            end = (
                self._conditional(i)
                or self._reason(i, edge=edge)
                or self._making_room(i)
                or (self._statement(i, kept) if edge else 0)
            )
            if end:
                kept += self._subject(i, end) if edge else ()
                i = end
                if edge and i < n and self.tokens[i].text in MARKS and self.tokens[i].text != "?":
                    i += 1
                continue
            token = self.tokens[i]
            if not (token.text in MARKS and (not kept or kept[-1].text in MARKS)):
                kept.append(token)
            i += 1
        while kept and kept[-1].text in (",", ";", ":"):
            kept.pop()
        return tuple(kept)

    def _text(self, i: int) -> str:
        return self.tokens[i].text if i < len(self.tokens) else ""

    def _making_room(self, i: int) -> int:
        """As in "make room around the can: move the ball aside"."""
        if self._text(i) not in ("make", "clear", "free", "create") or i:
            return 0
        end = self._segment_end(i)
        return (
            end
            if {"room", "space"} & {self._text(k) for k in range(i, min(end, i + 5))} and self._text(end) == ":"
            else 0
        )

    def _topic(self, i: int, end: int) -> Sequence[Token]:
        """Return the thing that a remark ends with: "I am looking for the ball, pick it up"."""
        k = next((k for k in range(end - 1, i, -1) if "THE" in self.tags[k]), end)
        named = all(
            {"COLOUR", "NOUN", "SIZE", "SHADE", "ABSENT"} & self.tags[m] or self._thing(m) for m in range(k + 1, end)
        )
        return (*self.tokens[k:end], Token(",", ",", "mark")) if k + 1 < end and named else ()

    def _tags(self, i: int) -> set[str]:
        return self.tags[i] if i < len(self.tags) else set()

    def _segment_end(self, i: int) -> int:
        """Return where the clause at `i` ends: at a mark, or where "and" joins a command to it."""
        j = i
        while j < len(self.tokens) and self._text(j) not in MARKS:
            if j > i and self._text(j) in _JOINTS and (self._commands(j + 1) or self._text(j) == "then"):
                break
            j += 1
        return j

    def _commands(self, i: int) -> bool:
        """Say whether a command could start here."""
        while self._text(i) in ("please", "then", "also", "so"):
            i += 1
        return self._text(i) in BASE_FORMS or bool(
            {"PREAMBLE", "NEGATION", "AVOID"} & (self.tags[i] if i < len(self.tags) else set())
        )

    def _conditional(self, i: int) -> int:
        """As in "if you would be so kind", "when you have a minute"."""
        if self._text(i) not in _MAKING_SURE:
            return 0
        j = i
        while self._text(j) in _PERHAPS:
            j += 1
        said = {self._text(k) for k in range(i, j)}
        polite = ("you" in said and said & _WILLING) or ("i" not in said and said & _NO_TROUBLE)
        if not polite or self._text(j - 1) in ("it", "that"):
            return 0
        if j >= len(self.tokens) or self._text(j) in MARKS:
            return j
        return j if self._text(j - 1) == "to" and self._text(j - 2) == "as" else 0

    def _reason(self, i: int, *, edge: bool) -> int:
        """As in "because it is in the way", "so that I can reach it", "before my boss arrives", "to make room"."""
        text = self._text(i)
        start = i
        if text in ("and", "just") and self._text(i + 1) in ("because", "since"):
            start, text = i + 1, self._text(i + 1)
        if text in (
            "because",
            "since",
            "as",
            "seeing",
            "given",
            "considering",
            "for",
            "before",
            "while",
            "so",
            "to",
            "in",
            "now",
            "such",
        ):
            end = self._segment_end(start)
            if edge and i == 0 and (end >= len(self.tokens) or self._text(end) not in ",;:."):
                return 0
            return end if end > start + 1 and self._binds_nothing(start, end) else 0
        return 0

    def _subject(self, i: int, end: int) -> Sequence[Token]:
        """As in "as the can is in the way, push it": the thing that is spoken of, where a pronoun follows."""
        if self._text(i) not in ("because", "since", "as") or not any("PRON" in tags for tags in self.tags[end:]):
            return ()
        start = i + 2 if self._text(i + 1) == "that" else i + 1
        verb = next((k for k in range(start, end) if self._text(k) in STATES), start)
        told = "THE" in self._tags(start) and self._names_things(start, verb)
        return (*self.tokens[start:verb], Token(",", ",", "mark")) if told else ()

    def _binds_nothing(self, i: int, end: int) -> bool:
        text = self._text(i)
        if text in ("to", "in"):
            return is_purpose(self.tokens[i:end], self.words)
        if text == "because" and self._text(i + 1) == "of":
            return self._idle(i + 2, end)
        if text == "for":
            names = [
                k
                for k in range(i + 1, end)
                if self._text(k)
                not in ("the", "a", "an", "my", "our", "your", "his", "her", "this", "later", "good", "ever")
            ]
            short = len(names) <= 2 and all(self._unknown(k) for k in names)
            return short and end > i + 1
        subject = i + 1
        while self._text(subject) in ("that", "as", "how"):
            subject += 1
        if text in ("since", "as", "because", "given", "seeing", "considering", "now"):
            about = self._text(subject) in (
                "it",
                "this",
                "that",
                "they",
                "there",
                "these",
                "those",
            ) or "THE" in self._tags(subject)
            if (text == "now" and self._text(i + 1) != "that") or not (about or self._speaks(subject)):
                return False
            return self._told(subject, end)
        if text in ("before", "while"):
            if text == "before" and end == subject + 1:
                return self._unknown(subject) or self._text(subject) in ("dinner", "lunch", "breakfast")
            if text == "before" and self._befalls(subject, end):
                return self._text(i - 1) not in _JUST_BEFORE
            return self._speaks(subject) and self._told(subject, end) and not self._names_things(subject, end)
        # "so that I can reach it", "so it does not roll away"
        if text in ("so", "such"):
            if tells_where([token.text for token in self.tokens[subject:end]]):
                return False
            if self._text(subject) == "they" and not of_people([token.text for token in self.tokens[subject:end]]):
                return self._idle(
                    subject + 1 + (self._text(subject + 1) == "stay"), self._apart_from_together(i, end), known=True
                )
            if self._speaks(subject):
                return self._told(subject, end)
            able = self._text(subject) in ("it", "he", "she", "they") and self._text(subject + 1) in _ABLE
            if able and end == subject + 3 and self._text(subject + 2) in _ALONE:
                # "so it can hide"
                return True
            return self._text(subject) in ("it", "they", "nothing", "that") and self._idle(subject + 1, end, known=True)
        return False

    def _apart_from_together(self, i: int, end: int) -> int:
        """Return where an outcome ends without "together", if the order before it tells of the place where they are so."""
        beside = any("REL" in self.tags[k] for k in range(i))
        one_place = [self._text(k) for k in range(end - 3, end)] == ["in", "one", "place"]
        return end - (1 if self._text(end - 1) == "together" else 3 if one_place else 0) if beside else end

    def _befalls(self, i: int, end: int) -> bool:
        """Say whether a clause tells what else would become of a thing: "it rolls off the table", "they get cold"."""
        if self._text(i) not in ("it", "they", "that", "something", "anything") or self._text(i + 1) not in _BEFALLING:
            return False
        where = next((k for k in range(i + 2, end) if self._text(k) in ("the", "my", "our", "this")), end)
        edge = {self._text(k) for k in range(where, end)} <= _OVER_THE_EDGE
        return edge and (where == i + 2 or self._idle(i + 2, where))

    def _speaks(self, i: int) -> bool:
        """Say whether a clause at `i` is about people: what they do is theirs."""
        return (
            self._text(i) in SPEAKERS
            or (self._text(i) in WHOSE and not self._thing(i + 1))
            or (self._text(i) == "the" and self._text(i + 1) in SPEAKERS)
        )

    def _told(self, i: int, end: int) -> bool:
        """Say whether a clause tells of something and neither asks nor rules out."""
        if end <= i + 1:
            # "the can is mine, put everything away" might spare the can.
            return False
        if self._text(i) in ("nobody", "no") and any("VERB" in self.tags[k] for k in range(i, end)):
            return False
        span = range(i, end)
        texts = [self._text(k) for k in span]
        if BINDING & {*texts} or any(self.tokens[k].kind in ("number", "mark") for k in span):
            return False
        if "you" in texts and any("VERB" in self.tags[k] for k in span):
            return False
        for k in span:
            if self._text(k) in _WISHES and self._text(k + 1) != "to" and self._asks(k + 1, end):
                return False
            if self._text(k) == "not" and self._names_things(k, end):
                return False
        speaks = self._speaks(i)
        if speaks:
            return True
        # About things: how they are, not what is done with them.
        verb = next((k for k in span if self._text(k) in STATES), None)
        return verb is not None and verb > i and self._idle(verb + 1, end)

    def _asks(self, i: int, end: int) -> bool:
        doing = any({"VERB", "DIR", "REL", "TO"} & self.tags[k] for k in range(i, end))
        return doing or self._names_things(i, end)

    def _names_things(self, i: int, end: int) -> bool:
        return any(self._thing(k) for k in range(i, end))

    def _thing(self, k: int) -> bool:
        if k >= len(self.tokens):
            return False
        text = self._text(k)
        return (
            self.tokens[k].kind == "id"
            or bool({"NOUN", "COLOUR", "TABLE", "ABSENT"} & self.tags[k])
            or text in self.words.parts
            or text.rstrip("s") in self.words.parts
        )

    def _unknown(self, k: int) -> bool:
        token = self.tokens[k]
        plain = token.kind == "word" and not self.tags[k] and token.text not in UNSUPPORTED_VERBS
        return plain and not self._thing(k) and token.text not in BINDING and token.text not in _TIMES

    def _idle(self, i: int, end: int, *, known: bool = False) -> bool:
        """Say whether words only describe: known to bind nothing, or unknown to the grammar."""
        if i >= end:
            return False
        for k in range(i, end):
            text = self._text(k)
            if text == "not":
                after = next(
                    (self._text(m) for m in range(k + 1, end) if self._text(m) not in ("very", "really", "so")), ""
                )
                if after not in _DENIABLE:
                    return False
            elif text == "can" and self._text(k - 1) in ("a", "the"):
                # "take the red one, it is a can" tells what it is.
                return False
            elif text in BINDING or not (text in HARMLESS or (self._unknown(k) and not known)):
                return False
        return True

    def _statement(self, i: int, kept: list[Token]) -> int:
        """As in "my hands are full, ...", "the can is empty, throw it away"; what "it" refers to stays."""
        end = self._segment_end(i)
        if end < len(self.tokens) and self._text(end) in ("and", "then", "but"):
            return 0
        whole = (i == 0 and end >= len(self.tokens)) or (end <= i + 1 and i > 0)
        vocative = self._unknown(0) or ("ABSENT" in self.tags[0] and self._text(0) not in self.words.parts)
        if i == 0 and end == 1 and self._text(end) in ("!", ",") and vocative and end + 1 < len(self.tokens):
            # "Jeeves, ..."
            return end
        if whole or self._text(end) == "?":
            return 0
        text = self._text(i)
        if self._speaks(i):
            refers = any("PRON" in tags for tags in self.tags[end:])
            topic = self._topic(i, end) if refers else ()
            if topic and self._told(i, end):
                kept += topic
                return end
            asks = (refers or any("DESIRE" in self.tags[k] for k in range(i, end))) and self._names_things(i, end)
            return end if not asks and self._told(i, end) else 0
        pointed = text in ("this", "that", "these", "those") and self._text(i + 1) not in STATES and self._thing(i + 1)
        if text in ("it", "this", "that", "they", "there", "things", "these") and not pointed:
            belongs = self._text(i + 1) in ("belongs", "belong", "goes", "go") and [
                self._text(k) for k in range(i + 2, end)
            ] in (["there"], ["in", "there"], ["in", "it"])
            stated = self._text(i + 1) in STATES and self._idle(i + 2, end)
            return end if (kept and (belongs or stated)) or (stated and text != "that") else 0
        points = end >= len(self.tokens) and self._text(end - 1) in ("is", "are")
        if (pointed or "THE" in self.tags[i]) and (points or self._told(i, end)):
            verb = next((k for k in range(i + 1, end) if self._text(k) in STATES), None)
            pointing = verb is not None and verb + 1 == end and end >= len(self.tokens)
            if verb is None or not (pointing or self._idle(verb + 1, end)):
                return 0
            rest = [k for k in range(end, len(self.tokens)) if self._text(k) not in MARKS]
            # "that can is broken, put it in the bin"; "that can is broken, left bin"
            refers = any("PRON" in self.tags[k] for k in rest) or (
                bool(rest) and not any("VERB" in self.tags[k] for k in rest)
            )
            if refers and self._names_things(i, verb):
                kept += self.tokens[i:verb]
                kept.append(Token(",", ",", "mark"))
            return end
        return 0


_TIMES = word_set(
    "second seconds minute minutes hour hours day days week weeks month months year years moment while sec secs min mins"
)
