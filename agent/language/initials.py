"""Words that stand for words of the scene: letters for its colours and sizes, names said the other way round."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from robosandbox.agent.language.lexicon import words_plural
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.tokens import SceneWords, Token, id_parts

_COLOURS = {
    "r": ("red",), "g": ("green",), "b": ("blue",), "y": ("yellow",), "o": ("orange",), "p": ("purple", "pink"), "w": ("white",),
    "k": ("black",),
}  # fmt: skip
_SIZES = {"s": ("small", "little", "tiny"), "m": ("medium",), "l": ("large", "big"), "xl": ("huge", "giant")}
_JOINTS = frozenset({",", "and", "/", "then"})
_AXES = frozenset({"positive", "negative", "in", "along", "minus"})


def in_full(said: Said) -> Said:
    """Return a sentence with letters for colours and sizes, and compounds said apart, as the scene has them."""
    tokens = _colours(list(said.tokens), said.words)
    tokens = _sizes(tokens, said.words)
    return said.now(tuple(_compounds(tokens, said.words)))


def _colours(tokens: list[Token], words: SceneWords) -> list[Token]:
    """As in "bottom to top R, G, B", "R on G": two letters or more, each of which begins one colour of the scene."""
    at = [i for i in range(len(tokens)) if _is_colour(tokens, i, words)]
    letters = {tokens[i].text for i in at}
    if len(letters) < 2 or not letters - words.parts:
        return tokens
    named = {letter: _of_colour(letter, words) for letter in letters}
    shared = set.intersection(*(set(nouns) for nouns in named.values()))
    if len(shared) == 1:
        noun = shared.pop()
        for i in reversed(at):
            tokens[i] = Token(named[tokens[i].text][noun], tokens[i].raw, "id")
            if i and tokens[i - 1].text in (noun, words_plural(noun)):
                # "cubes R and G"
                del tokens[i - 1]
    return tokens


def _is_colour(tokens: Sequence[Token], i: int, words: SceneWords) -> bool:
    """Say whether a letter stands alone: after no noun that it numbers, before no number, or as one of three in a row."""
    if tokens[i].kind != "word" or tokens[i].text not in _COLOURS:
        return False
    before = tokens[i - 1].text if i else ""
    after = tokens[i + 1] if i + 1 < len(tokens) else None
    if before in _AXES or (
        tokens[i].text == "y" and after is not None and (after.kind == "number" or after.text == "=")
    ):
        return False
    return tokens[i].text not in words.parts or _row(tokens, i, -1) + _row(tokens, i, 1) >= 2


def _row(tokens: Sequence[Token], i: int, step: int) -> int:
    """Return how many letters stand beside the one at `i`, joined to it by commas, "and" or slashes."""
    count = 0
    while 0 <= (i := i + step) < len(tokens) and (tokens[i].text in _JOINTS or tokens[i].text in _COLOURS):
        count += tokens[i].text in _COLOURS
    return count


def _of_colour(letter: str, words: SceneWords) -> dict[str, str]:
    """Return the ids "red_cube" that a letter may stand for, by what they are; none where it may stand for two."""
    found: dict[str, str] = {}
    for name in words.ids.values():
        parts = id_parts(name)
        if len(parts) == 2 and any(colour in parts for colour in _COLOURS[letter]):
            noun = next((part for part in parts if part not in _COLOURS[letter]), "")
            if noun in found:
                return {}
            found[noun] = name
    return found


def _sizes(tokens: list[Token], words: SceneWords) -> list[Token]:
    """As in "green S on green L", "parcels S and M": sizes of things of the scene."""
    made: list[Token] = []
    for i, token in enumerate(tokens):
        meant = [size for size in _SIZES.get(token.text, ()) if size in words.parts]
        before = tokens[i - 1] if i else None
        plain = token.kind == "word" and token.text not in words.parts
        if (
            plain
            and len(meant) == 1
            and _sized(tokens[i + 1 : i + 2], meant[0], words)
            and (not before or before.kind != "number")
        ):
            # "S cubes to the tray"
            made.append(Token(meant[0], token.raw, "word"))
            continue
        if not (plain and len(meant) == 1 and before and before.kind == "word"):
            made.append(token)
            continue
        size = Token(meant[0], token.raw, "word")
        if before.text in words.parts and any({before.text, meant[0]} <= {*id_parts(name)} for name in words.ids):
            # "green S": the small green one.
            made[-1:] = [size, before, Token("one", "one", "word")]
        elif before.text.removesuffix("s") in words.parts or (
            before.text == "and" and made[-2:-1] and made[-2].text == "one"
        ):
            made[-1:] = [before, size]
        else:
            made.append(token)
    return made


def _sized(tokens: Sequence[Token], size: str, words: SceneWords) -> bool:
    """Say whether a word names what comes in a size."""
    named = tokens[0].text.removesuffix("s") if tokens else ""
    return any({named, size} <= {*id_parts(name)} for name in words.ids)


def _compounds(tokens: Sequence[Token], words: SceneWords) -> list[Token]:
    """As in "the board of cutting", "the bin for the sharp things": a cutting board, a sharps bin."""
    pairs = {pair for name in words.ids for pair in pairwise(id_parts(name))}
    made: list[Token] = []
    i = 0
    while i < len(tokens):
        made.append(tokens[i])
        head = tokens[i].text
        k = i + 2
        if k < len(tokens) and tokens[i + 1].text in ("of", "for") and head in words.parts:
            k += tokens[k].text == "the"
            said = tokens[k].text if k < len(tokens) else ""
            first = next((a for a, b in pairs if b == head and said in (a, words_plural(a), a.removesuffix("s"))), "")
            end = k + 1
            end += end < len(tokens) and tokens[end].text in ("things", "stuff", "items", "colour", "color")
            if first and said and not (end < len(tokens) and tokens[end].text in words.parts):
                made[-1:] = [Token(first, tokens[k].raw, "word"), tokens[i]]
                i = end
                continue
        i += 1
    return made
