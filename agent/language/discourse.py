"""Things spoken of so far, and refusals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from robosandbox.agent.language.intent import Ref, Sentence
from robosandbox.types import Refusal, RefusalCode


class RefusedError(Exception):
    """Carries a refusal out of the depth of a plan."""

    def __init__(
        self,
        code: RefusalCode,
        message: str,
        candidates: Iterable[str] = (),
        *,
        about: str = "",
        firm: bool = False,
        sure: bool = True,
    ) -> None:
        """Refuse; `about` are the words that an answer would make clear; `firm` if no farther reading could be meant.

        Not `sure` is a refusal over words that the grammar does not know.
        """
        super().__init__(message)
        self.about = about
        self.firm = firm
        sure = sure and code is not RefusalCode.UNRECOGNIZED
        self.refusal: Refusal = Refusal(code=code, message=message, candidates=tuple(candidates), sure=sure)


class AlreadySoError(RefusedError):
    """Carries out of the depth of a plan that an order is fulfilled as things stand."""

    def __init__(self, message: str, about: Iterable[str] = ()) -> None:
        """Say by which evidence, about these things."""
        super().__init__(RefusalCode.IMPOSSIBLE, message, about)


def cannot_see(words: Sequence[str]) -> RefusedError:
    """Return the refusal of what would have to be judged by words that name nothing which can be perceived."""
    quoted = listed([f"“{word}”" for word in words], "or")
    told = f"I cannot see whether something is {quoted}; I see shape, colour, size and place."
    return RefusedError(RefusalCode.UNSUPPORTED, told, words, firm=True)


@dataclass
class Discourse:
    """What was spoken of, oldest first: what "it", "them", "the other one" and "one" refer back to.

    Attributes:
        mentioned: Groups of ids.
        themes: Groups of ids that were acted on.
        described: The descriptions, as far as they have any.
        nouns: What things were called.
        origins: Where things were before they were moved last: xy, and what they were on or in.
        them: What "them" meant last where it was one thing: "the pliers".
        question: The words that the last refusal asked about.
        last: The last sentence that became a plan.
    """

    mentioned: list[tuple[str, ...]] = field(default_factory=list)
    themes: list[tuple[str, ...]] = field(default_factory=list)
    described: list[Ref] = field(default_factory=list)
    nouns: list[tuple[str, ...]] = field(default_factory=list)
    origins: dict[str, tuple[tuple[float, float], tuple[str, str] | None]] = field(default_factory=dict)
    them: tuple[str, ...] = ()
    question: str = ""
    last: Sentence | None = None

    def mention(self, ids: tuple[str, ...], nouns: tuple[str, ...] = ()) -> None:
        """Note that something was spoken of."""
        self.mentioned.append(ids)
        if nouns and nouns != ("thing",):
            self.nouns.append(nouns)

    def become(self, other: Discourse) -> None:
        """Take over what another one has noted."""
        self.mentioned, self.themes, self.nouns = other.mentioned, other.themes, other.nouns
        self.described, self.origins = other.described, other.origins
        self.them, self.question, self.last = other.them, other.question, other.last

    def spoken_of(self) -> set[str]:
        """Return everything spoken of."""
        return {name for ids in self.mentioned for name in ids}


def listed(names: Sequence[str], word: str = "and") -> str:
    """Return "a, b and c"; "nothing" for none."""
    if not names:
        return "nothing"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {word} {names[-1]}"
