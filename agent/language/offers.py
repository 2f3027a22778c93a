"""Offers to who was refused: the part that was understood, and a sentence near to theirs that would work."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from robosandbox.agent.language.front import ENGLISH
from robosandbox.agent.language.intent import unseen
from robosandbox.agent.language.parser import Parser, TooComplicatedError
from robosandbox.agent.language.ruleset import ruleset
from robosandbox.agent.language.scene_words import scene_words
from robosandbox.agent.language.text import ENDS, TooLongError, classes_of, said
from robosandbox.agent.language.vocabulary import Token
from robosandbox.agent.language.wordlist import word_set
from robosandbox.types import Refusal, RefusalCode

_JOINTS = ENDS | {"and", "then", "but", "otherwise", "else"}
# What such words reach is not told without the rest of the sentence.
_BINDING = word_set(
    "not no never without except only if unless until while when before after than or either neither once"
)
# A question asks for no order, and nothing is offered out of what is forbidden.
_NO_OFFER = frozenset({"?", "not", "no", "never", "without"})
_MOST_PARTS = 4  # Number of parts of a sentence that are tried alone. Chosen: more are no help.
_ORDERS = ("pick up {}", "open {}", "close {}", "tap {}")


def with_offer(refusal: Refusal, prompt: str, ids: tuple[str, ...], works: Callable[[str], bool]) -> Refusal:
    """Return a refusal that says as well what was understood, or what could be said instead.

    Args:
        refusal: Why the sentence is not carried out.
        prompt: The sentence.
        ids: Those of the scene.
        works: Tells whether a sentence would be carried out.
    """
    if refusal.code not in (RefusalCode.UNSUPPORTED, RefusalCode.UNRECOGNIZED):
        return refusal
    words, book = scene_words(ids), ruleset(ENGLISH)
    try:
        tokens = said(prompt, words, book).tokens
        if {token.text for token in tokens} & _NO_OFFER:
            return refusal
        parts = [part for part in _parts(tokens) if works(part)]
        if parts:
            told = " and ".join(f"“{part}”" for part in parts)
            return _adding(refusal, f"I understood {told}: say that alone, or the rest in other words.")
        near = next(
            (order for order in _near(Parser(tokens, book, classes_of(tokens, words, book))) if works(order)), ""
        )
    except (TooLongError, TooComplicatedError):
        return refusal
    return _adding(refusal, f"I could do this, for example: “{near}”.") if near else refusal


def _adding(refusal: Refusal, more: str) -> Refusal:
    end = "" if refusal.message.endswith((".", "?", "!")) else "."
    return refusal.model_copy(update={"message": f"{refusal.message}{end} {more}"})


def _parts(tokens: Sequence[Token]) -> Iterator[str]:
    """Yield the parts of a sentence that say something for themselves."""
    starts = [0, *(k + 1 for k, token in enumerate(tokens) if token.text in _JOINTS)]
    spans = list(zip(starts, [*(start - 1 for start in starts[1:]), len(tokens)], strict=True))
    for start, end in spans[:_MOST_PARTS] if len(spans) > 1 else ():
        part = tokens[start:end]
        if len(part) > 1 and _BINDING.isdisjoint(token.text for token in part):
            yield " ".join(token.raw for token in part)


def _near(parser: Parser) -> Iterator[str]:
    """Yield orders about the things that are named, the first of them first."""
    for i in range(parser.count):
        found = [(reading.end, reading.fields[0].value) for reading in parser.rule("alone", i)]
        ends = [
            end for end, ref in found if ref.determiner == "the" and not (unseen(ref) or ref.plural or ref.relations)
        ]
        if ends:
            thing = parser.said(i, max(ends))
            yield from (order.format(thing) for order in _ORDERS)
            return
