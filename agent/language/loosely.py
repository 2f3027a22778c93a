"""A sentence read loosely: a verb takes the things and places around it by what they are, in whatever order they stand.

    the cube red in the bin you must putting   ->   put the red cube in the bin

Articles, copulas, agreement and tense carry no meaning here; what does is a verb, a thing, a place, a way, a number of
times. A sentence of several orders, or one that holds anything else ("only", "not", "if", a word that nobody knows), is left as
it is. What comes out is a plain order for the grammar, which reads and grounds it like any other.
"""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.loose_pieces import Pieces
from robosandbox.agent.language.loose_things import (
    ASKED_AS,
    CARRIED,
    CARRYING,
    DOING,
    HOLDING_VERBS,
    OFFERING,
    Clause,
    NotPlainError,
    Piece,
    Words,
    to_word,
    to_words,
)
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.speech import QUESTIONS


def loosely(said: Said) -> Said:
    """Return a sentence as plain orders; the same sentence where some of it may mean more than those."""
    if not said.texts or said.texts[0] in QUESTIONS - ASKED_AS:
        return said
    try:
        clauses = _joined(Pieces(said).clauses())
        # Of several orders loose words do not tell what belongs to which.
        return said.now(list(_told(clauses[0]))) if len(clauses) == 1 else said
    except NotPlainError:
        return said


def _joined(clauses: Sequence[Clause]) -> list[Clause]:
    """Put together what belongs to one verb: "the cube, put it in the bin", "take the lemon, in the bowl throw"."""
    made: list[Clause] = []
    for clause in clauses:
        before = made[-1] if made else None
        if before is not None and _goes_with(before, clause):
            before.pieces += clause.pieces
        else:
            made.append(clause)
    return [clause for clause in made if clause.has(*CARRIED)]


def _goes_with(before: Clause, clause: Clause) -> bool:
    if not clause.has(*CARRIED):
        return True
    if clause.joint == "then":
        return False
    if not before.orders:
        if before.has("thing") and before.has("place"):
            carried = all(verb.verbs & CARRYING for verb in clause.all("verb"))
            return clause.orders and carried and clause.joint == "," and not clause.has("thing", "place")
        return not clause.has("thing" if before.has("thing") else "place")
    return not clause.orders and not clause.has("thing") and not before.has("place") and clause.joint == ","


def _told(clause: Clause) -> Words:
    """Return one clause as a plain order."""
    things, places, verbs = clause.all("thing"), clause.all("place"), _verbs(clause)
    once = ("direction", "distance", "times")
    if max(len(things), len(places), len(verbs), *(len(clause.all(kind)) for kind in once)) > 1:
        raise NotPlainError
    place = places[0].words if places else (to_word("there"),) if clause.has("there") else ()
    ways = tuple(word for kind in once for piece in clause.all(kind) for word in piece.words)
    thing = things[0].words if things else _referred(clause)
    if not verbs:
        stated = clause.has("being", "may", "not", "source", "out", "home") and not clause.has("wish")
        if stated or ways or not (thing and place) or clause.has("source", "not", "out", "home"):
            raise NotPlainError
        return (to_word("put"), *thing, *place)
    return _ordered(clause, verbs[0], thing, place, ways)


def _referred(clause: Clause) -> Words:
    """Return the pronoun for a thing that was named before."""
    told = [piece.words[0].text for piece in clause.all("it")]
    if told:
        return (to_word("them" if {"them", "they"} & {*told} else "it"),)
    return (to_word("it"),) if clause.joint and clause.orders else ()


def _ordered(clause: Clause, verb: Piece, thing: Words, place: Words, ways: Words) -> Words:
    """Return what one verb asks for as a plain order."""
    carries = bool(verb.verbs & CARRYING and place)
    astray = clause.has("direction", "distance") and not verb.verbs & {"push", "move"}
    # "leave it there" asks for nothing.
    idle = (clause.has("staying") and not place) or (verb.words[0].text == "leave" and not clause.has("place"))
    if astray or idle or (carries and ways) or (clause.has("out") and "pour" not in verb.verbs):
        raise NotPlainError
    if clause.has("not"):
        return _forbidden(clause, verb, (*thing, *place), ways)
    if clause.has("home") or (not clause.has("thing") and "home" in verb.verbs):
        return _sent_home(clause, verb, (*place, *ways))
    if clause.has("source"):
        return _poured(verb, thing if clause.has("thing") else (), place, clause.all("source")[0].words)
    if "tap" in verb.verbs and clause.has("place") and not clause.has("thing"):
        return (*verb.words, *place[1:], *ways)
    if not thing or verb.verbs & OFFERING:
        raise NotPlainError
    if carries:
        return (to_word("put"), *thing, *place)
    plain = to_words("pick up") if verb.verbs & HOLDING_VERBS and not (place or ways) else verb.words
    return (*plain, *thing, *place, *ways)


def _verbs(clause: Clause) -> list[Piece]:
    """Return what a clause asks for: "make a touch", "take and put" are one act."""
    verbs = clause.all("verb")
    heavy = [verb for verb in verbs if verb.words[0].text not in DOING] or verbs
    if len(heavy) == 2 and heavy[0].verbs & HOLDING_VERBS and heavy[1].verbs & CARRYING and clause.has("place"):
        return heavy[1:]
    return heavy


def _forbidden(clause: Clause, verb: Piece, what: Words, ways: Words) -> Words:
    """Return an order not to do something; what is only wished undone is left to the grammar."""
    if (
        ways
        or not clause.has("thing")
        or clause.has("wish", "may", "being", "staying")
        or verb.verbs & {"release", "want"}
    ):
        raise NotPlainError
    return (*to_words("do not"), *verb.words, *what)


def _sent_home(clause: Clause, verb: Piece, more: Words) -> Words:
    if more or clause.has("thing", "it", "source", "out") or not verb.verbs & {"home", "go"}:
        raise NotPlainError
    return to_words("go home")


def _poured(verb: Piece, thing: Words, place: Words, source: Words) -> Words:
    if "pour" not in verb.verbs or not place:
        raise NotPlainError
    return (to_word("pour"), *thing, *((to_word("from"),) if thing else ()), *source, *place)
