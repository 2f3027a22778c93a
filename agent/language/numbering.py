"""Things told by their numbers: "the odd numbered blocks", "object 7" for obj_07, "number three from the left"."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.lexicon import words_plural
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.tokens import SceneWords, Token, id_parts

_PARITIES = {"odd": 1, "even": 0}
_NUMBERED = frozenset({"numbered", "number", "numbers"})
_LEADS = frozenset({"the", "all", "every", "each", "all the", "of"})
_SHORT = {"object": "obj", "obj": "object"}
_BOUND = frozenset({"outbound", "inbound"})
_BEFORE_NAMES = frozenset(
    {"the", "to", "in", "into", "on", "for", "at", "of", "from", "go", "goes", "a", "that", "this"}
)


def by_number(said: Said) -> Said:
    """Return a sentence with the names of what it tells by numbers; the same sentence if there is nothing of the sort."""
    texts, words = {*said.texts}, said.words
    tokens: Sequence[Token] = said.tokens
    if texts & {*_PARITIES}:
        tokens = _by_parity(tokens, words)
    if any(token.kind == "number" for token in tokens):
        tokens = _padded(tokens, words)
    if texts & _BOUND & words.parts:
        tokens = _bound(tokens, words)
    return said.now(tuple(tokens))


def _by_parity(tokens: Sequence[Token], words: SceneWords) -> list[Token]:
    """As in "the even numbered cubes", "all cubes with an odd number"."""
    made: list[Token] = []
    i = 0
    while i < len(tokens):
        found = _parity_before(tokens, i, words) or _parity_after(tokens, i, words)
        if found:
            end, names = found
            while made and made[-1].text in _LEADS:
                made.pop()
            for name in names:
                made += [Token("and", "and", "word")] if made and made[-1].kind == "id" else []
                made.append(Token(name, name, "id"))
            i = end
        else:
            made.append(tokens[i])
            i += 1
    return made


def _parity_before(tokens: Sequence[Token], i: int, words: SceneWords) -> tuple[int, list[str]] | None:
    k = i + 1
    if tokens[i].text not in _PARITIES:
        return None
    k += k < len(tokens) and tokens[k].text in _NUMBERED
    names = _with_parity(tokens[k].text, _PARITIES[tokens[i].text], words) if k < len(tokens) else []
    return (k + 1, names) if names else None


def _parity_after(tokens: Sequence[Token], i: int, words: SceneWords) -> tuple[int, list[str]] | None:
    texts = [token.text for token in tokens[i : i + 5]]
    rest = [text for text in texts[1:] if text not in ("a", "an")]
    told = rest[:1] in (["with"], ["of"], ["bearing"], ["having"]) and rest[1:2] and rest[1] in _PARITIES
    if not told or rest[2:3] not in (["number"], ["numbers"]):
        return None
    names = _with_parity(texts[0], _PARITIES[rest[1]], words)
    return (i + 1 + texts[1:].index(rest[2]) + 1, names) if names else None


def _with_parity(noun: str, parity: int, words: SceneWords) -> list[str]:
    """Return the things "block_3" that a plural names, where each of the sort has a number."""
    sort = [name for name in words.ids.values() if noun in {words_plural(part) for part in id_parts(name)}]
    if any(not id_parts(name)[-1].isdigit() for name in sort):
        return []
    return sorted(name for name in sort if int(id_parts(name)[-1]) % 2 == parity)


def _padded(tokens: Sequence[Token], words: SceneWords) -> list[Token]:
    """As in "object 7", where there is an obj_07."""
    made: list[Token] = []
    for token in tokens:
        noun = made[-1].text if made and made[-1].kind == "word" else ""
        whole = token.kind == "number" and token.number.is_integer() and token.number >= 0
        called = {noun, _SHORT.get(noun, noun)}
        same = [
            name
            for name in (words.ids.values() if noun and whole else ())
            if len(id_parts(name)) == 2 and id_parts(name)[0] in called and id_parts(name)[1].isdigit()
            and int(id_parts(name)[1]) == int(token.number)
        ]  # fmt: skip
        if len(same) == 1 and id_parts(same[0]) != (noun, f"{token.number:g}"):
            made[-1] = Token(same[0], f"{made[-1].raw} {token.raw}", "id")
        else:
            made.append(token)
    return made


def _bound(tokens: Sequence[Token], words: SceneWords) -> list[Token]:
    """As in "parcels 1 and 2 outbound", where a container is called so."""
    made: list[Token] = []
    for token in tokens:
        if token.text in _BOUND and (token.text,) in map(id_parts, words.ids) and made[-1:]:
            made += [Token("to", "to", "word")] if made[-1].text not in _BEFORE_NAMES else []
        made.append(token)
    return made
