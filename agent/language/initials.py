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
_JOINTS = frozenset({",", "and", "/", "on", "then", ">"})


def in_full(said: Said) -> Said:
    """Return a sentence with letters for colours and sizes, and compounds said apart, as the scene has them."""
    tokens = _colours(list(said.tokens), said.words)
    tokens = _sizes(tokens, said.words)
    return said.now(tuple(_compounds(tokens, said.words)))


def _colours(tokens: list[Token], words: SceneWords) -> list[Token]:
    """As in "bottom to top R, G, B": two letters or more, each of which begins one colour of the scene."""
    at: list[int] = []
    runs: list[list[int]] = []
    for i, token in enumerate(tokens):
        if token.kind == "word" and token.text in _COLOURS:
            at.append(i)
        elif token.text not in _JOINTS:
            runs.append(at)
            at = []
    runs.append(at)
    for run in runs:
        letters = [tokens[i].text for i in run]
        if len(set(letters)) < 2 or len(set(letters)) < len(letters) or not set(letters) - words.parts:
            continue
        named = [_of_colour(letter, words) for letter in letters]
        shared = set.intersection(*(set(nouns) for nouns in named))
        if len(shared) == 1 and all(named):
            noun = shared.pop()
            for i, nouns in zip(run, named, strict=True):
                tokens[i] = Token(nouns[noun], tokens[i].raw, "id")
    return tokens


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
        plain = token.kind == "word" and token.text not in words.parts and before is not None
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
            if first and said:
                end = k + 1
                end += end < len(tokens) and tokens[end].text in ("things", "stuff", "items")
                made[-1:] = [Token(first, tokens[k].raw, "word"), tokens[i]]
                i = end
                continue
        i += 1
    return made
