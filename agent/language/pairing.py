"""Lists told side by side: "the cup and the ball in the bin and the drawer respectively", "the former", "the latter"."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.tokens import MARKS, Token

_STOPS = frozenset({".", ";", ":", "!", "?"})
_JOINTS = frozenset({"and", "then", "but", ","})
_RESPECTIVELY = (
    ("respectively",),
    ("in", "the", "same", "order"),
)
_WHICH = {"former": 0, "latter": -1}
_LAID = frozenset({"place", "direction", "distance", "times"})
_NOT_INSIDE = frozenset({"and", ",", "to", "in", "on", "at", "from", "next", "near"})
_BEFORE_PLACES = frozenset({"in", "on", "into", "onto", "to", "of", "by", "beside", "behind", "under", "with"})
_SIDES = frozenset({"left", "right", "front", "back", "forward", "forwards", "backwards"})
Span = tuple[int, int]
Row = tuple[Span, ...]


def pairwise_told(said: Said) -> Said:
    """Return a sentence with each of several things beside the place, way or number that it has; the same if none is told so."""
    if _WHICH.keys() & {*said.texts}:
        said = _of_two(said)
    for words in _RESPECTIVELY:
        if words[-1] in said.texts:
            for i in range(len(said.texts) - len(words) + 1):
                if tuple(said.texts[i : i + len(words)]) == words:
                    return _respectively(said, i, i + len(words))
    return said


def _respectively(said: Said, at: int, after: int) -> Said:
    """As in "put the cup and the ball in the bin and the drawer, respectively"."""
    texts, tokens = said.texts, said.tokens
    closes = after == len(texts) or texts[after] in MARKS or texts[after] in _JOINTS
    if closes and texts[at - 1] == "," and texts[after : after + 1] == [","]:
        # "put the cup and the ball, respectively, in the bin and the drawer"
        between = Said((*tokens[: at - 1], *tokens[at:after], *tokens[after + 1 :]), said.words)
        inside = _respectively(between, at - 1, after - 1) if texts[after + 1 : after + 2] else between
        if inside is not between:
            return inside
    start = next((k + 1 for k in range(at - 1, -1, -1) if texts[k] in _STOPS or texts[k] == "then"), 0)
    end = at - 1 if closes and texts[at - 1] == "," else at
    if closes:
        part, rest = Said(tuple(tokens[:end]), said.words), tokens[after:]
        rows = _rows(part, start)[-2:]
    else:
        # "put the cup and the ball respectively in the bin and the drawer"
        part = Said((*tokens[:at], *tokens[after:]), said.words)
        rows = _rows(part, start)
        follows = [row for row in rows if row[0][0] >= at][:1]
        rows = [*[row for row in rows if row[-1][1] <= at][-2 + len(follows) :], *follows]
        # "left and right respectively by 3 cm": each by as much.
        stop = next((k for k in range(at, len(part.texts)) if part.texts[k] in MARKS | _JOINTS), len(part.texts))
        end = follows[0][-1][1] if follows else stop
        part, rest = Said(part.tokens[:end], said.words), part.tokens[end:]
    if len(rows) != 2 or len(rows[0]) != len(rows[1]):
        return said
    things, others = rows
    opened = next((k + 1 for k in range(things[0][0] - 1, -1, -1) if part.texts[k] in MARKS | _JOINTS), 0)
    head, mid = part.tokens[opened : things[0][0]], part.tokens[things[-1][1] : others[0][0]]
    tail = part.tokens[others[-1][1] :]
    told = {token.text for token in (*mid, *tail)}
    if (_JOINTS | {"between"}) & told or (tail and not _goes_on(part, others[-1][1])):
        return said
    pairs = list(zip(_each(part, things), _each(part, others), strict=True))
    made = list(part.tokens[:opened])
    for k, (thing, other) in enumerate(pairs):
        made += [*([Token("and", "and", "word")] if k else []), *head, *thing, *mid, *other, *tail]
    return said.now((*made, *rest))


def _goes_on(said: Said, i: int) -> bool:
    """Say whether what follows the second list belongs to each of its members: "3 cm and 5 cm to the right"."""
    n = len(said.texts)
    return n in said.ends("way", i) or (said.texts[i] == "of" and n in said.ends("one", i + 1))


def _rows(said: Said, start: int) -> list[Row]:
    """Return the lists of things, places, ways or numbers from `start` on, each as long as can be."""
    rows: list[Row] = []
    i = start
    while i < len(said.texts):
        thing = _thing_end(said, i)
        row = max((_row(said, i, ending) for ending in (_thing_end, _laid_end)), key=len)
        if len(row) > 1:
            rows.append(row)
        i = max(i + 1, thing, *(end for _, end in row[1:]))
    return rows


def _row(said: Said, i: int, ending: Callable[[Said, int], int]) -> Row:
    spans: list[Span] = []
    while i < len(said.texts) and (end := ending(said, i)) > i:
        spans.append((i, end))
        i = end + (said.texts[end : end + 1] == [","])
        i += said.texts[i : i + 1] == ["and"]
        if i == end:
            break
    if spans[1:] and "of" in (last := said.texts[slice(*spans[-1])]) and said.texts[spans[0][1] - 1] in _SIDES:
        # "to the left and right of the cup": of the cup is said of both.
        spans[-1] = spans[-1][0], spans[-1][0] + last.index("of")
    return tuple(spans)


def _thing_end(said: Said, i: int) -> int:
    """Return where the thing at `i` ends, with nothing that says where it is; `i` for none."""
    refs = [(end, ref) for end, ref in said.grammar.np(i) if _NOT_INSIDE.isdisjoint(said.texts[i:end])]
    # "push the ball left": left is no part of the ball's name.
    refs = [(end, ref) for end, ref in refs if said.texts[end - 1] not in _SIDES or end < i + 3]
    return max((end for end, ref in refs if not (ref.relations or ref.unknown or ref.number)), default=i)


def _laid_end(said: Said, i: int) -> int:
    """Return where the place, way, distance or number of times at `i` ends; `i` for none."""
    if said.tokens[i].kind == "number" and said.texts[i + 1 : i + 2] in (["and"], [","]):
        return i + 1
    found = [end for end, element in said.grammar.element(i) if element.kind in _LAID]
    # "in the bin and the drawer" is no place.
    return max((end for end in found if "and" not in said.texts[i:end]), default=i)


def _each(said: Said, row: Row) -> list[Sequence[Token]]:
    """Return the members of a list in full: "the red cube" of "the red and the blue cube", "3 cm" of "3 and 5 cm"."""
    last = said.tokens[row[-1][0] : row[-1][1]]
    noun, single = last[-1:], tuple(last)
    short = False
    made: list[Sequence[Token]] = []
    for a, b in row[:-1]:
        refs = [ref for end, ref in said.grammar.np(a) if end == b]
        bare = said.tokens[b - 1].kind == "number" or any(ref.one for ref in refs)
        bare = bare and said.texts[b - 1] not in ("one", "ones")
        short = short or bare
        made.append((*said.tokens[a:b], *noun) if bare else said.tokens[a:b])
    if short:
        named = [value for _, tag, value in LEXICON.at(said.tokens, row[-1][1] - 1) if tag == "NOUN"]
        if any(plural for _, _, plural in named):
            # "the red and green cubes": one of each.
            phrase = next(phrase for _, phrase, plural in named if plural)
            noun = (Token(phrase, phrase, "word"),)
            made[:] = [(*item[:-1], *noun) for item in made]
            single = (*last[:-1], *noun)
    made.append(single)
    return made


def _of_two(said: Said) -> Said:
    """As in "put the cup and the can in the bin, then tap the latter"."""
    texts = said.texts
    at = next((k for k, text in enumerate(texts) if text in _WHICH and k and texts[k - 1] == "the"), 0)
    if not at or _names(said, at + 1):
        return said
    which, verb = _WHICH[texts[at]], texts[at - 2]
    before = Said(tuple(said.tokens[: at - 1]), said.words)
    rows = [row for row in _rows(before, 0) if all(_thing_end(before, a) == b for a, b in row)]
    # In "the can in the bin and the cup in the crate" bin and cup are no pair.
    rows = [row for row in rows if not {texts[row[0][0] - 1], texts[row[-1][1]]} <= _BEFORE_PLACES]
    if verb in ("open", "close", "shut"):
        rows = [row for row in rows if row[which][1] in before.ends("drawer", row[which][0])]
    pairs = rows or [_named(before)]
    if len(pairs) != 1 or len(pairs[0]) != 2:
        return said
    meant = _each(before, pairs[0])[which]
    return _of_two(said.now((*said.tokens[: at - 1], *meant, *said.tokens[at + 1 :])))


def _names(said: Said, i: int) -> bool:
    """Say whether the word at `i` goes on naming a thing: "the former cup"."""
    tags = {tag for _, tag, _ in LEXICON.at(said.tokens, i)} if i < len(said.texts) else set()
    return bool(tags & {"NOUN", "COLOUR", "SIZE", "ABSENT"}) or said.texts[i : i + 1] in (["one"], ["two"])


def _named(said: Said) -> Row:
    """Return every thing that is named, each once."""
    spans: dict[tuple[str, ...], Span] = {}
    i = 0
    while i < len(said.texts):
        end = _thing_end(said, i)
        if end > i:
            spans.setdefault(tuple(said.texts[i:end]), (i, end))
        i = max(i + 1, end)
    return tuple(spans.values())
