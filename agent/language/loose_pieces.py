"""The phrases of a sentence that is read loosely: verbs, things, places, ways, times; anything else makes it unreadable."""

from __future__ import annotations

from robosandbox.agent.language.loose_things import (
    BEING,
    FLAT,
    MAYBE,
    MODALS,
    PREPOSITIONS,
    RESUMED,
    SILENT,
    SPEAKERS,
    STATES,
    STAYING,
    THEN,
    WISHING,
    Clause,
    NotPlainError,
    Piece,
    Things,
    Words,
    to_word,
    to_words,
)
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.slots import HOLDERS, HOLDING
from robosandbox.agent.language.tokens import MARKS
from robosandbox.agent.language.verbs import VERBS, forms
from robosandbox.agent.language.wordlist import phrase_list

_BASE = {form: phrase for phrases in VERBS.values() for phrase in phrase_list(phrases) for form in forms(phrase)}
# Endings by which an irregular verb is inflected where English does not; the longest first.
_ENDINGS = ("ting", "ing", "ted", "ed", "d")


class Pieces(Things):
    """The phrases of one sentence, one after the other."""

    def clauses(self) -> list[Clause]:
        """Return the phrases between the joints of the sentence."""
        made, i = [Clause()], 0
        while i < len(self.tokens):
            end, piece = self._piece(i, made[-1])
            if piece and piece.kind == "joint":
                made.append(Clause(joint=piece.words[0].text))
            elif piece and piece.kind == "thing":
                end, listed = self._listed(end, piece)
                made[-1].pieces.append(listed)
            elif piece:
                made[-1].pieces.append(piece)
            i = end
        return [clause for clause in made if clause.pieces]

    def _listed(self, end: int, first: Piece) -> tuple[int, Piece]:
        """Add the things that "and" joins to one, and "all" or "both" behind them."""
        words = first.words
        while self.text(end) == "and":
            stop, further = self._thing(end + 1, Clause())
            if further is None or stop == end + 1:
                break
            end, words = stop, (*words, self.tokens[end], *further.words)
        behind = end + (self.text(end) == ",")
        both = "and" in {word.text for word in words} or words[0].text == "both"
        several = both or words[-1].text.endswith("s") or words[0].kind == "number"
        said_again = (self.text(behind) == "both" and both) or (self.text(behind) == "all" and several)
        return behind + 1 if said_again else end, first._replace(words=words)

    def _piece(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        for rule in (
            self._joint,
            self._wish,
            self._times,
            self._way,
            self._relation,
            self._thing,
            self._verb,
            self._small,
        ):
            end, piece = rule(i, clause)
            if end > i:
                return end, piece
        raise NotPlainError(self.text(i))

    def _joint(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        if self.text(i) in MARKS:
            return i + 1, Piece("joint", (to_word(","),))
        for end, _ in self.grammar.tag(i, "THEN"):
            if " ".join(self.said.texts[i:end]) in THEN and i and end < len(self.tokens):
                return end, Piece("joint", (to_word("then"),))
        if self.text(i) in ("first", "firstly") and not clause.pieces and not clause.joint:
            return i + 1, None
        if self.text(i) == "after" and clause.joint and self.text(i + 1) not in BEING | SPEAKERS and not clause.pieces:
            return i + 1, None
        return (i + 1, Piece("joint", (to_word("and"),))) if self.text(i) == "and" else (i, None)

    def _times(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        ends = [end for end, _ in self.grammar.tag(i, "TIMES")]
        if ends:
            return ends[0], Piece("times", self.tokens[i : ends[0]])
        if self.text(i + 1) == "time" and self.grammar.tag(i, "NUM"):
            return i + 2, Piece("times", (self.tokens[i], to_word("times")))
        return i, None

    def _way(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        start = i + 1 if self.text(i) in ("with", "for", "by", "about") else i
        found = [(end, "distance") for end, _ in self.grammar.distance(start)]
        if start == i:
            found += [
                (end, "direction")
                for end, element in self.grammar.element(i)
                # "to the left of the block" is a place.
                if element.kind in ("direction", "home") and self.text(end) not in ("of", "from")
            ]
        if not found:
            return i, None
        end, kind = max(found)
        if self.grammar.text(start) in ("home", "go") or "home" in self.said.texts[start:end]:
            return end, Piece("home", ())
        stop = end + (kind == "direction" and self.text(end) == "side")
        return stop, Piece(kind, self.tokens[start:end])

    def _relation(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        """A preposition with the thing behind it; or with the thing before it, where none stands behind."""
        for words, plain in PREPOSITIONS.get(self.text(i), ()):
            end = i + len(words)
            if tuple(self.said.texts[i:end]) != words:
                continue
            stop, thing = self._thing(end, clause)
            if thing is not None and stop > end:
                return self._postposed(stop, self._place(plain, thing))
            if self.text(end) in RESUMED and (plain in ("in", "on") or clause.joint):
                return end + 1, Piece("place", (*to_words(plain), to_word("it")))
            things = clause.all("thing")
            if plain in ("in", "on") and len(things) > 1 and clause.pieces[-1] == things[-1]:
                # "the ball box inside put"
                clause.pieces[-1] = self._place(plain, things[-1])
                return end, None
            if plain == "in" and clause.joint and not clause.pieces:
                # "open the drawer and inside must come the nut"
                return end, Piece("place", to_words("in it"))
            if plain in ("in", "on") and clause.has("place"):
                # "on the block put the cube on"
                return end, None
        return i, None

    def _postposed(self, end: int, place: Piece) -> tuple[int, Piece | None]:
        """As in "on the box inside"."""
        after = end + 1 if self.text(end) == "the" else end
        if self.text(after) in ("inside", "in") and place.words[0].text in ("in", "on"):
            following, _ = self._thing(after + 1, Clause())
            if following == after + 1:
                return after + 1, place._replace(words=(to_word("in"), *place.words[1:]))
        return end, place

    def _place(self, plain: str, thing: Piece) -> Piece:
        if thing.kind != "thing":
            raise NotPlainError(plain)
        holder = self._holds(thing.words)
        if plain in ("to", "at"):
            if plain == "at" and not holder and thing.words[-1].text.rpartition("_")[2] not in FLAT:
                raise NotPlainError(plain)
            plain = "in" if holder else "on" if plain == "at" else plain
        if plain == "from":
            return Piece("source", thing.words)
        return Piece(
            "place",
            (*to_words("in" if plain == "over" and holder else "on" if plain == "over" else plain), *thing.words),
        )

    def _holds(self, words: Words) -> bool:
        head = words[-1].text.rpartition("_")[2]
        return NOUN_CLASS.get(head) in HOLDING or head.endswith(HOLDERS)

    def _verb(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        found = [] if self.text(i) in BEING else self.grammar.tag(i, "VERB") or self._by_stem(i)
        if self.text(i) in STATES and self.text(i - 1) in BEING | {"make", "let"}:
            if not clause.has("wish"):
                raise NotPlainError(self.text(i))
            return i + 1, Piece("verb", (to_word(STATES[self.text(i)]),), frozenset({STATES[self.text(i)]}))
        if not found or self.text(i) in SILENT:
            return i, None
        end = found[0][0]
        words = " ".join(self.said.texts[i:end])
        verbs = frozenset(verb for stop, verb in found if stop == end)
        self._subject(i, clause)
        base = next(
            (words.removesuffix(e) for e in _ENDINGS if words not in _BASE and words.removesuffix(e) in _BASE), words
        )
        return end, Piece("verb", to_words(_BASE.get(base, base)), verbs)

    def _by_stem(self, i: int) -> list[tuple[int, str]]:
        """Read a verb that is inflected by rule where English is not regular: "putted", "taked"."""
        for ending in _ENDINGS if not self.grammar.tags[i] else ():
            stem = self.text(i).removesuffix(ending)
            if stem != self.text(i) and stem in _BASE:
                return [(i + 1, verb) for verb, phrases in VERBS.items() if stem in phrase_list(phrases)]
        return []

    def _subject(self, i: int, clause: Clause) -> None:
        """Raise where a verb tells of what somebody does: "I put the cube in the bin"."""
        start = i
        while start and self.text(start - 1) not in MARKS and self.text(start - 1) not in ("and", "then"):
            start -= 1
        before = {*self.said.texts[start:i]}
        asked = before & (WISHING | MODALS) and self.text(i - 1) not in ("i", "we")
        past = self.text(i).endswith("ed") or self.text(i) in ("took", "taken", "got", "stuck")
        if (before & {"i", "we"} and not asked) or (past and not before & (BEING | {"want", "need", "that", "have"})):
            raise NotPlainError(self.text(i))

    def _wish(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        text = self.text(i)
        named = text == "can" and (self.text(i + 1) not in SPEAKERS and self._thing(i, clause)[1] is not None)
        spanned = any(end > i + 1 for end, _ in self.grammar.tag(i, "VERB"))
        if text == "see" and self.text(i - 1) == "to":
            return i + 1, Piece("may", ())
        if text not in WISHING | MODALS or named or spanned:
            return i, None
        # "the cube I like" tells which.
        ends = self.text(i + 1) in MARKS or not self.text(i + 1)
        liked = ends and clause.has("verb") and self.text(i - 1) in ("i", "you")
        if liked or (text in ("have", "has", "having") and not self._obliges(i)):
            raise NotPlainError(text)
        # "would be possible the bolt in the tray?" asks for it; "it is possible that it is there" supposes.
        asked = text == "possible" and self.said.texts[-1] == "?" and "that" not in self.said.texts
        return i + 1, Piece("may" if text in MAYBE and not asked else "wish", ())

    def _obliges(self, i: int) -> bool:
        """Tell "has to be put", "to have" and "have the kindness" from "has been put"."""
        opens = i == 0 or self.text(i - 1) in MARKS
        return "to" in (self.text(i + 1), self.text(i - 1)) or (opens and self.text(i + 1) in ("the", "a"))

    def _small(self, i: int, clause: Clause) -> tuple[int, Piece | None]:
        text = self.text(i)
        if text == "not" or (text == "no" and self.grammar.tag(i + 1, "VERB")):
            return i + 1, Piece("not", ())
        if text in RESUMED:
            return i + 1, Piece("there" if text == "there" else "it", (self.tokens[i],))
        if text == "if" and self.text(i + 1) in SPEAKERS and clause.pieces and not clause.has("verb", "thing", "not"):
            # "it would be good if you put ..."
            return i + 1, Piece("wish", ())
        if text in ("color", "colour") and clause.has("thing"):
            return i + 1, None
        if text in BEING | STAYING:
            clause.pieces.append(Piece("being", ()))
            return i + 1, Piece("staying", ()) if text in STAYING else None
        if text in ("up", "down") and clause.has("verb", "thing"):
            return i + 1, Piece("particle", (self.tokens[i],))
        if text == "out" and (clause.has("verb") or self.grammar.tag(i + 1, "VERB")):
            return i + 1, Piece("out", ())
        if text in ("to", "from") and self.text(i + 1) in ("me", "us", "you", "my", "your", "the", "a"):
            raise NotPlainError(text)
        return (i + 1, None) if text in SILENT else (i, None)
