"""Lists whose order is told apart from them: "the bolt, the nut and the gear in reverse order", "the can and the jar, jar first"."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.tokens import MARKS, SceneWords, Token

_REVERSED = tuple(
    ("in", *the, reverse, *sorted_, "order")
    for the in ((), ("the",))
    for reverse in ("reverse", "reversed", "inverse", "opposite")
    for sorted_ in ((), ("alphabetical",), ("numerical",), ("numeric",))
)
_JOINTS = frozenset({",", "and"})
_NAMING = frozenset({"COLOUR", "SIZE", "SHADE", "NOUN"})
_STARTING = frozenset({"starting", "beginning", "start", "begin"})
_TURNS = (
    *(((verb,), last) for verb in ("do", "take", "move", "handle") for last in (False, True)),
    *(((verb, "with"), False) for verb in ("starting", "beginning", "start", "begin")),
)
_PLACING = frozenset({"in", "on", "into", "onto", "to", "next", "beside"})
_AFTER_IT = (
    *((after, that) for after in ("after", "following") for that in ("that", "it", "this")),
    *((word,) for word in ("next", "afterwards", "last", "lastly")),
    *((*at, "end") for at in (("at", "the"), ("at", "the", "very"), ("in", "the"))),
    ("last", "of", "all"),
)
"""What is said behind a thing that comes after those told before."""
_LEFT_OUT = frozenset({"not", "no", "never", "without", "except", "but", "leave", "nor"})
_PLACED = frozenset(words[-1] for words in _AFTER_IT)
Item = tuple[int, int]


def in_order(said: Said) -> Said:
    """Return a sentence with its list in the order that is told beside it; the same sentence if none is."""
    said = _one_after_the_other(said) if _PLACED & {*said.texts} else said
    texts = said.texts
    if "order" in texts:
        for words in _REVERSED:
            for i in range(len(texts) - len(words) + 1):
                if tuple(texts[i : i + len(words)]) == words:
                    return _reversed(said, i, i + len(words))
    if {"first", "last"} & {*texts} or "with" in texts:
        said = _whose_turn(said)
    if "first" in texts:
        return _first_named(said)
    return said


def _one_after_the_other(said: Said) -> Said:
    """As in "lemon in the basket, apple after that, plum last": each a step of its own, where it was not named before."""
    texts = said.texts
    made: list[Token] = []
    i = 0
    while i < len(texts):
        thing = i
        while made and thing < len(texts) and texts[thing] in (*_JOINTS, "then"):
            thing += 1
        ends = _one_of_its_own(said, i, thing) if i < thing < len(texts) else []
        told = next(
            (m for end in ends for words in _AFTER_IT for m in [end + len(words)] if tuple(texts[end:m]) == words), 0
        )
        closed = told and (told == len(texts) or texts[told] in MARKS or texts[told] == "and")
        named = {*texts[thing:told]} - {"the", "one"}
        if closed and not named & {*texts[:i]}:
            end = next(end for end in ends if told > end)
            made += [Token(",", ",", "mark"), Token("then", "then", "word"), *said.tokens[thing:end]]
            i = told
            continue
        made.append(said.tokens[i])
        i += 1
    return said.now(made)


def _one_of_its_own(said: Said, told: int, i: int) -> list[int]:
    """Return where a single thing ends that is called something, at token `i`; none if it may be one of several told before."""
    if _LEFT_OUT & {*said.texts[:told]}:
        # "tap the can, but not the cup, and the jar last": a step, or left out as well?
        return []
    for k in range(told):
        hits = said.grammar.np(k)
        single = {end for end, ref in hits if not ref.plural and ref.determiner != "all"}
        if any(end not in single for end, _ in hits):
            return []
    named = [hit for hit in said.grammar.np(i) if (hit[1].nouns or hit[1].names) and not hit[1].ranks]
    single = {end for end, ref in named if not (ref.unknown or ref.plural or ref.number or ref.relations)}
    return sorted(single, reverse=True)


def _whose_turn(said: Said) -> Said:
    """As in "put the can in the box and the jar on the tray, but do the jar first", "..., starting with the jar"."""
    texts = said.texts
    end = len(texts)
    while end and texts[end - 1] in (".", "!"):
        end -= 1
    turn = texts[end - 1]
    comma = max((k for k in range(end) if texts[k] == ","), default=0)
    named = {*texts[comma + 1 : end - 1]} - {"the", "one", "and", "with"}
    if turn in ("first", "last") and comma and named:
        # "the can in the box and the jar on the tray, the jar first"
        ordered = _with_turn(said, comma, named, last=turn == "last")
        if ordered is not said:
            return ordered
    for lead, last in _TURNS:
        ends = 1 if lead[0] not in _STARTING else 0
        for k in range(end - 1, 3, -1):
            told = tuple(texts[k : k + len(lead)]) == lead and texts[k - 1] in (",", ";", ".", "but", "and")
            if not told or (ends and texts[end - 1] != ("last" if last else "first")):
                continue
            which = {*texts[k + len(lead) : end - ends]} - {"the", "one", "with", "first"}
            cut = k
            while texts[cut - 1] in (",", ";", ".", "but", "and"):
                cut -= 1
            return _with_turn(said, cut, which, last=last) if which else said
    return said


def _with_turn(said: Said, end: int, which: set[str], *, last: bool) -> Said:
    steps = _steps(said, end)
    meant = [k for k, (_, (a, b), _) in enumerate(steps) if which <= _words(said.tokens[a:b])]
    if len(meant) != 1 or len(steps) < 2:
        return said
    step = steps.pop(meant[0])
    steps.insert(len(steps) if last else 0, step)
    made: list[Token] = []
    for verb, (a, b), until in steps:
        then = (Token(",", ",", "mark"), Token("then", "then", "word")) if made else ()
        made += [*then, *verb, *said.tokens[a:b], *said.tokens[b:until]]
    return said.now(made)


def _steps(said: Said, end: int) -> list[tuple[Sequence[Token], Item, int]]:
    """Return the commands up to `end`: the verb of each, where it names its one thing, and where it ends; none if one is not so plain."""
    steps: list[tuple[Sequence[Token], Item, int]] = []
    i, verb = 0, said.tokens[:0]
    told = Said(tuple(said.tokens[:end]), said.words)
    while i < end:
        verbs = [b for b, _ in told.grammar.tag(i, "VERB")]
        verb, i = (said.tokens[i : verbs[-1]], verbs[-1]) if verbs else (verb, i)
        things = [b for b in told.ends("that", i) if not _PLACING & {*said.texts[i:b]}]
        if not verb or not things:
            return []
        laid = [b for kind in ("place", "way") for b in told.ends(kind, things[0])]
        until = max((b for b in laid if _JOINTS.isdisjoint(said.texts[i:b])), default=things[0])
        steps.append((verb, (i, things[0]), until))
        i = until
        while i < end and said.texts[i] in (*_JOINTS, "then"):
            i += 1
        if i == until < end:
            return []
    return steps


def _reversed(said: Said, i: int, end: int) -> Said:
    """As in "put the bolt, the nut and the gear in the tray in reverse order"."""
    items = _only_list(said, 0, i)
    if not items:
        return said
    tokens = said.tokens
    spans = [tokens[a:b] for a, b in items]
    if not said.texts[end - 2].startswith(("reverse", "inverse", "opposite")):
        spans.sort(key=lambda span: [(token.number if token.kind == "number" else 0.0, token.text) for token in span])
    return said.now((*_relisted(tokens, items, spans[::-1], i), *tokens[end:]))


def _first_named(said: Said) -> Said:
    """As in "tap the can and the jar, the jar first": one of the things listed, and nothing after it."""
    tokens, texts = said.tokens, said.texts
    end = len(texts)
    while end and texts[end - 1] in (".", "!"):
        end -= 1
    if texts[end - 1 : end] != ["first"]:
        return said
    comma = max((k for k in range(end) if texts[k] == ","), default=-1)
    items = _only_list(said, 0, comma) if comma > 0 else []
    which = {text for text in texts[comma + 1 : end - 1] if text not in ("the", "one", "with", "and")}
    meant = [k for k, (a, b) in enumerate(items) if which and which <= _words(tokens[a:b])]
    if len(meant) != 1 or len(items) != 2:
        return said
    spans = [tokens[a:b] for a, b in items]
    spans.insert(0, spans.pop(meant[0]))
    return said.now(_relisted(tokens, items, spans, comma))


def _words(tokens: Sequence[Token]) -> set[str]:
    return {part for token in tokens for part in (token.text, *token.text.split("_"))}


def _relisted(
    tokens: Sequence[Token], items: Sequence[Item], spans: Sequence[Sequence[Token]], end: int
) -> tuple[Token, ...]:
    made: list[Token] = []
    at = 0
    for (a, b), span in zip(items, spans, strict=True):
        made += [*tokens[at:a], *span]
        at = b
    return (*made, *tokens[at:end])


def _only_list(said: Said, start: int, end: int) -> list[Item]:
    """Return the things of the one list of a sentence, each in full or all of them letters or numbers; none if it is not plain."""
    lists: list[list[Item]] = []
    i, joined = start, False
    while i < end:
        b = i
        while b < end and _names(said.tokens, b, said.words):
            b += 1
        if b == i:
            joined = joined and said.texts[i] in _JOINTS
            i += 1
            continue
        if joined and lists:
            lists[-1].append((i, b))
        else:
            lists.append([(i, b)])
        i, joined = b, True
    lists = [items for items in lists if len(items) > 1]
    if len(lists) != 1:
        return []
    items = lists[0]
    short = [_numbering(said.tokens[b - 1], said.words) and b - a == 1 for a, b in items[1:]]
    a, b = items[0]
    if all(short):
        # "samples A, B and C": the noun stays where it is.
        return [(b - 1, b), *items[1:]] if _numbering(said.tokens[b - 1], said.words) and b - a > 1 else []
    full = [_full(said.tokens[a:b], said.words) for a, b in items]
    return items if all(full) else []


def _names(tokens: Sequence[Token], i: int, words: SceneWords) -> bool:
    tags = {tag for _, tag, _ in LEXICON.at(tokens, i)}
    text = tokens[i].text
    if text in _JOINTS or ("VERB" in tags and text not in words.forms):
        return False
    return (
        tokens[i].kind == "id"
        or text == "the"
        or text in words.forms
        or bool(tags & _NAMING)
        or _numbering(tokens[i], words)
    )


def _numbering(token: Token, words: SceneWords) -> bool:
    text = str(int(token.number)) if token.kind == "number" and token.number.is_integer() else token.text
    return text in words.parts and (len(text) == 1 or text.isdigit())


def _full(tokens: Sequence[Token], words: SceneWords) -> bool:
    """Say whether an item names its thing by itself, and one thing: not "the red" of "the red and the green cube"."""
    last = tokens[-1]
    singular = last.text in words.parts or any(
        tag == "NOUN" and not value[2] for _, tag, value in LEXICON.at(tokens, len(tokens) - 1)
    )
    return last.kind == "id" or (
        singular and not any(tag == "COLOUR" for _, tag, _ in LEXICON.at(tokens, len(tokens) - 1))
    )
