"""Whether a clause that only tells of a thing may mean that an order for several is to spare it."""

from __future__ import annotations

from collections.abc import Sequence

from robosandbox.agent.language.lexicon import LEXICON, words_plural
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.tokens import Token

_WHOLE = frozenset({"ALL", "EVERYTHING", "BOTH", "OTHER", "OTHERS", "REST"})
_ANY = frozenset({"one", "thing"})


def may_spare(said: Said, left: Sequence[Token]) -> bool:
    """Tell whether what a sentence says beside its order names one of several things that the order is for.

    As in "the red block is mine, put the blocks in the bin": nobody can tell whether that goes too.

    Args:
        said: The sentence.
        left: What of it is the order; the same tokens.
    """
    kept = {id(token) for token in left}
    beside = [token for token in said.tokens if id(token) not in kept]
    told = _kinds(beside, said)
    if not told or not beside:
        return False
    tags = [{tag for _, tag, _ in LEXICON.at(left, i)} for i in range(len(left))]
    if any(_WHOLE & found for found in tags):
        return True
    several = {kind for kind, plural in _nouns(left, said) if plural} - {
        kind for kind, plural in _nouns(beside, said) if plural
    }
    return bool(several) and bool((told & several) | (told & _ANY) | (several & _ANY))


def _kinds(tokens: Sequence[Token], said: Said) -> set[str]:
    """Return what kinds of things words name; a colour alone may be of any."""
    kinds = {kind for kind, _ in _nouns(tokens, said)}
    coloured = any(tag == "COLOUR" for i in range(len(tokens)) for _, tag, _ in LEXICON.at(tokens, i))
    return kinds or ({"one"} if coloured else set())


def _nouns(tokens: Sequence[Token], said: Said) -> set[tuple[str, bool]]:
    """Return the kinds of things that words name, each with whether it is several; words of ids are kinds of their own."""
    found: set[tuple[str, bool]] = set()
    plurals = {words_plural(part): part for part in said.words.parts if part.isalpha() and len(part) > 2}
    for i, token in enumerate(tokens):
        tags = {tag for _, tag, _ in LEXICON.at(tokens, i)}
        nouns = [value for _, tag, value in LEXICON.at(tokens, i) if tag == "NOUN"]
        found |= {(noun, plural) for noun, _, plural in nouns}
        if token.text in plurals and token.text not in said.words.parts:
            found.add((plurals[token.text], True))
        elif token.text in said.words.parts and not nouns and not tags - {"ABSENT"}:
            found.add((token.text, False))
        if token.kind == "id":
            found |= {(part, False) for part in token.text.split("_") if part.isalpha()}
    return found
