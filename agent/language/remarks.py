"""An order without what is remarked beside it: "wait ten seconds while I fish my pen out", "my eyes are bad, so go slowly".

A clause is a remark where somebody or something is its subject, or where it compares; where it has no number, asks for nothing, takes
nothing back and tells of nothing that could be brought about. What is passed over is told.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from itertools import pairwise

from robosandbox.agent.language.front import ENGLISH
from robosandbox.agent.language.ruleset import ruleset
from robosandbox.agent.language.wordlist import word_set

_THINGS = word_set("it they this that these those there here")
_DESCRIBED = word_set("the a an these those some")
# Verbs by which a clause is known that begins with a thing, before they could be the verb of an order.
_TELLING = word_set(
    """
    is are was were am has had have will would can could does did looks look looked feels feel felt seems seem sounds sound smells
    gets got makes made helps hurts bothers belonged used keeps came happened works worked rolled fell broke
    """
)
# What asks for something, sets something right, or takes it back; and what is so in the end.
_BINDING = word_set(
    """
    cancel stop abort called named call please after before then last again times never mine yours hers ours theirs tomorrow tonight
    later today yesterday example pretend allowed forbidden plan already myself yourself himself herself ourselves themselves alone
    do did done doing handle both each some any all every everything rest other others half ones
    """
)
_FINDING_OUT = {(verb, "if") for verb in ("see", "hear", "know", "check", "find", "tell", "learn")}
_YOURS = word_set("are were look looked seem seemed know see frighten scare startle understand")
_LIKE = re.compile(
    r"^(?:just |a bit |sort of |kind of |nearly |rather )?(?:like (?!(?:it|this|that|these|those|before|last|the|now|so|one|two)\b)"
    r"|as if\b|as though\b|the way (?:we|i|they|people|he|she)\b)",
    re.IGNORECASE,
)
# What is handled with care, and what makes a likeness an order of its own.
_FRAGILE = word_set("egg eggs eggshell glass glassy fragile delicate baby bomb porcelain bubble china crystal newborn")
_OPENERS = re.compile(
    r"^(?:(?:and|but|so|well|oh|ah|because|since|cause|as(?! if| though)|while|whilst|for|though|although|you know|you see|mind you|see|anyway|hi|hello)[, ]+)+",
    re.IGNORECASE,
)
# Before the subject of a clause within one: "wait while I fish it out", "go up so I can see".
_WITHIN = re.compile(
    r"\s+(?=(?:while|whilst|because|since|cause|so that|so|as|in case|though|although)\s+(?:i|we|he|she|my|our|his|her|nobody|everyone|somebody)\b)"
    r"|\s+(?=(?:while|whilst|because|cause|in case)\s+(?:it|they|there|the|this|that)\b)|\s+(?=(?:like when|as if|as though)\b)"
    r"|\s+(?=like (?:you|we|i|he|she|they|people|when|a|an|some|\w{3,}ing)\b)|\s+(?=the way (?:we|i|they|people|he|she) )"
    r"|\s+(?=so (?:that )?(?:the|those|these|people|visitors|everyone|everybody|they|my|our) [^,.;:!?]*\b(?:can|could|may|might) (?:see|hear|watch|read|follow|look|know|tell|learn|understand|count|join)\b)",
    re.IGNORECASE,
)
_MARKS = re.compile(r"(?<!\d)([.,;:!?])+(?=\s|$)|(?<=\d)([.,;:!?])+(?=\s|$)|\s+[-–—]+\s+")
# What may be said in a word or two and tells nothing.
_EMPTY = word_set(
    "you_know you_see mind_you so_to_speak bless_you of_course i_think i_guess sorry excuse_me pardon pardon_me i_beg_your_pardon my_dear"
)


# "so that it is on the left" is asked for; "while I hold it" says when.
_IN_THE_END = re.compile(
    r"^(?:and |but )?so(?: that)? (?!i\b|we\b|he\b|she\b|my\b|our\b|nobody\b|everyone\b|everybody\b)", re.IGNORECASE
)
_MEANWHILE = re.compile(r"^(?:while|whilst|as) ", re.IGNORECASE)
_COMPARED = word_set("a an some it they there this its")
# What an order is for, where that is to be seen or heard of it.
_TO_BE_SEEN = re.compile(
    r"^so (?:that )?[^,.;:!?]*\b(?:can|could|may|might) (?:see|hear|watch|read|follow|look|know|tell|learn|understand|count|join)\b",
    re.IGNORECASE,
)
_UNITS = word_set(
    """
    cm mm m centimetre centimetres centimeter centimeters millimetre millimetres inch inches foot feet metre metres degree degrees
    newton newtons second seconds minute minutes percent
    """
)
_SHORT = 3  # Words up to which nothing is told: "as if", "my turn".


_GOES_ON = re.compile(r"\s+(?=(?:and|but|then)\b)", re.IGNORECASE)


def without_remarks(prompt: str, ids: Collection[str]) -> tuple[str, tuple[str, ...]]:
    """Return an order without the remarks in it, and those; the whole of it and nothing where it has none, or is nothing else.

    Args:
        prompt: What was said.
        ids: Of the things in the scene.
    """
    kept: list[str] = []
    remarks: list[str] = []
    parts = {part for name in ids for part in name.lower().split("_")}
    # In an order that is about none of the things "it" is none of them either.
    of_none = parts.isdisjoint(prompt.lower().split())
    for clause, mark in _clauses(prompt):
        if _is_remark(clause, parts, of_none=of_none):
            remarks.append(clause)
            if kept and mark in ".!?:;" and kept[-1][-1:] == ",":
                kept[-1] = kept[-1][:-1] + ("." if mark in ":;" else mark)
        else:
            kept.append(clause + mark)
    plain = " ".join(kept).strip(" ,;:")
    plain = re.sub(r"^(?:so|and|but|then)\b[, ]*", "", plain, flags=re.IGNORECASE) if remarks else plain
    return (plain, tuple(remarks)) if remarks and plain else (prompt, ())


def is_stated(sentence: str) -> bool:
    """Say whether a sentence begins as those do that tell something, and no order does."""
    words = re.findall(r"[a-z]+", _OPENERS.sub("", sentence.lower()))
    persons = ruleset(ENGLISH).vocabulary.lists["persons"]
    return bool(words) and (words[0] in persons or words[0] in _THINGS or words[0] in ("my", "our", "the"))


def tells_nothing(remark: str) -> bool:
    """Say whether a remark is a likeness, or what an order is to be seen for: neither tells which things are meant, or where they go."""
    return bool(_LIKE.match(remark) or _TO_BE_SEEN.match(remark))


def _clauses(prompt: str) -> list[tuple[str, str]]:
    """Return the clauses of a prompt, each with the mark behind it."""
    told: list[tuple[str, str]] = []
    start = 0
    for match in _MARKS.finditer(prompt):
        told.append((prompt[start : match.start()].strip(), match[0].strip()[:1] or ","))
        start = match.end()
    told.append((prompt[start:].strip(), ""))
    apart: list[tuple[str, str]] = []
    for clause, mark in told:
        # What goes on behind a likeness is no part of it: "like a screwdriver and then let go".
        within = (part for part in _WITHIN.split(clause) if part)
        parts = [part for each in within for part in (_GOES_ON.split(each) if _LIKE.match(each) else (each,)) if part]
        apart += [(part, "") for part in parts[:-1]] + ([(parts[-1], mark)] if parts else [])
    return apart


def _is_remark(clause: str, parts: Collection[str], *, of_none: bool) -> bool:
    """Say whether a clause is a remark.

    Args:
        clause: What stands between two marks.
        parts: Words of the ids of the things in the scene.
        of_none: The order is about none of these.
    """
    vocabulary = ruleset(ENGLISH).vocabulary
    text = _OPENERS.sub("", clause.lower().replace("’", "'"))
    words = re.findall(r"[a-z]+|\d+", text.replace("n't", " not").replace("'", " "))
    if not words or any(word.isdigit() for word in words):
        return "_".join(re.findall("[a-z]+", clause.lower())) in _EMPTY
    counts = vocabulary.classes["NUMBER"]
    numbers = {
        form for value, forms in counts.items() if str(value) not in ("1", "1.0") for form in forms if " " not in form
    }
    if not numbers.isdisjoint(words):
        return False
    binding = _BINDING.union(*(vocabulary.lists[name] for name in ("binding", "obliging", "always")))
    if len(words) <= _SHORT and not vocabulary.lists["reporting"].isdisjoint(words):
        # "she told me"
        return False
    if _LIKE.match(text):
        # Nothing said of a likeness is asked for; but an egg is handled with care, and "like a centimetre" is a length.
        of_a_thing = not _COMPARED.isdisjoint(words[1:4])
        told = frozenset(_FRAGILE if of_a_thing else ()).union(_UNITS, ("times", "did", "done"), parts)
        return len(words) >= _SHORT and told.isdisjoint(words)
    if _TO_BE_SEEN.match(clause):
        return True
    if _IN_THE_END.match(clause) or (not of_none and _MEANWHILE.match(clause) and not {"it", "them"}.isdisjoint(words)):
        return False
    # "I want to see if it works" has no condition.
    said = [word for word, before in zip(words, ("", *words), strict=False) if (before, word) not in _FINDING_OUT]
    if not binding.isdisjoint(said) or words[0] in ("if", "when", "whenever", "once"):
        return False
    colours = {form for forms in vocabulary.classes["COLOUR"].values() for form in forms}
    if not colours.union(parts).isdisjoint(words):
        # "mine is the blue one", "I hate the red cube"
        return False
    first, second = words[0], words[1] if len(words) > 1 else ""
    if first in ("my", "our", "his", "her") and not any(map(_is_finite, words[2:])):
        # "my turn"
        return False
    if first in vocabulary.lists["persons"]:
        return _asks_nothing(words, vocabulary.lists["wishing"])
    if first == "you":
        return second in _YOURS
    telling = next((k for k, word in enumerate(words[1:7], 1) if word in _TELLING), 0)
    begins = first in _THINGS and telling == 1 and not (first in ("this", "that") and second in ("was", "were"))
    begins = begins or (first in _DESCRIBED and second not in vocabulary.lists["moments"] and telling > 1)
    obliges = any(pair in (("has", "to"), ("have", "to"), ("need", "to"), ("needs", "to")) for pair in pairwise(words))
    # "it is not a car" tells which one is meant.
    return begins and not obliges and {"not", "no", "none"}.isdisjoint(words)


def _is_finite(word: str) -> bool:
    return word in _TELLING or word.endswith("ed") or (word.endswith("s") and not word.endswith("ss"))


def _asks_nothing(words: Sequence[str], wishing: Collection[str]) -> bool:
    """Say whether what somebody does or is asks for nothing: "I need to wipe the table" does not, "I need a circle" does."""
    if "not" in words and words[-1] in ("so", "that", "this", "it", "to"):
        # "I do not think so", "we do not want that"
        return False
    wish = next((k for k, word in enumerate(words) if word in wishing and k < 4), 0)
    if not wish:
        return "you" not in words or "not" not in words
    if words[wish] == "would" and words[wish + 1 : wish + 2] not in (
        ["like"],
        ["love"],
        ["prefer"],
        ["rather"],
        ["want"],
    ):
        return "you" not in words
    follows = words[wish + 1 :]
    follows = follows[1:] if follows[:1] in (["like"], ["love"], ["prefer"], ["want"]) else follows
    own = follows[:1] == ["to"] and follows[1:2] not in (["be"], ["have"], ["get"]) and "you" not in follows[:2]
    reason = follows[:1] in (["it"], ["them"], ["this"], ["that"]) and follows[1:2] == ["for"]
    return own or reason or follows[:1] in (["room"], ["space"], ["time"])
