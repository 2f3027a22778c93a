"""Is a description true of what it picks out: every colour that is told, the thing's own name, and "other" than what."""

from __future__ import annotations

from abc import ABC, abstractmethod

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.intent import Ref, replace
from robosandbox.agent.language.orders import CONTRARY, Fits
from robosandbox.agent.language.scene_words import id_parts
from robosandbox.agent.language.things import POSITIONS, SHADES, SHAPES, SIZES
from robosandbox.agent.language.vicinity import Vicinity
from robosandbox.agent.language.wordlist import phrase_list
from robosandbox.types import DetectedObject, RefusalCode

_STATES = {"empty": "empty", "full": "full", "open": "open", "opened": "open", "closed": "closed", "shut": "closed"}
# What a word says of a thing, by the word: an order's key, a state or a shade.
_KEYS: dict[str, str] = _STATES | {
    phrase: key
    for table in (POSITIONS, SIZES, SHADES)
    for key, phrases in table.items()
    for phrase in phrase_list(phrases)
}
_KEYS |= {"top": "top", "upper": "top", "bottom": "bottom", "lower": "bottom"}
_PAIRS = (("top", "bottom"), ("empty", "full"), ("open", "closed"), ("dark", "light"), ("soft", "hard"))
_CONTRARIES = {frozenset(pair) for pair in (*_PAIRS, *CONTRARY.items())}
_PLACED = frozenset({"on", "to", "at", "from", "in", "by"})


def contradicts(ref: Ref, name: str) -> bool:
    """Say whether an object's id says the contrary of what a description says of the object.

    As in "the right shoe" of left_shoe, "the wooden spoon" of metal_spoon. Where it lies is another matter: "the
    leftmost shoe" and "the shoe on the left" may be the right one.

    Args:
        ref: The description.
        name: The object's id.
    """
    parts = {_KEYS.get(part, part) for part in id_parts(name)}
    return any(frozenset({said, part}) in _CONTRARIES for said in _said_of(ref) for part in parts)


def _said_of(ref: Ref) -> set[str]:
    """Return what a description says of a thing itself, and not of where it lies."""
    words = ref.text.split()
    plain = {
        _KEYS[word]
        for k, word in enumerate(words)
        if word in _KEYS and not (k > 1 and words[k - 1] == "the" and words[k - 2] in _PLACED)
    }
    ranks = {rank.key for rank in ref.ranks if rank.nth == 1 and not rank.anchor}
    # "the smaller cube" says small of it; "the leftmost cube" says where it lies.
    compared = {key for key in ranks if key in SIZES}
    return (ranks & plain) | compared | {relation.kind for relation in ref.relations} | {*ref.shades, *ref.claims}


class Truth(Vicinity, ABC):
    """Checks what else a description says against what it found."""

    @abstractmethod
    def _named(self, ref: Ref, pool: list[DetectedObject], several: bool, fits: Fits | None) -> list[DetectedObject]:
        """Return what a description names; `Grounder` knows how."""

    def _told_to_be(self, names: list[str], ref: Ref) -> list[str]:
        """As in "the orange thing, it is a car": those of them that are what is said beside.

        Raises:
            RefusedError: None of them is.
        """
        for what in ref.told_to_be:
            so = [name for name in names if name in self._such(what)]
            if not so:
                raise RefusedError(RefusalCode.IMPOSSIBLE, f"“{ref.text}”: {listed(names)} is not that.", names)
            names = so
        return names

    def _second(self, ref: Ref, told: set[str | None]) -> None:
        """Refuse "the other bin" where no bin was spoken of before.

        Args:
            ref: A description with "other" in it.
            told: Ids of what was spoken of.

        Raises:
            RefusedError: Of what is called so, none was spoken of.
        """
        if ref.plural or ref.determiner == "all" or ref.one or not (ref.nouns or ref.names):
            return
        whole = replace(ref, other=False, plural=True, ranks=(), relations=(), colours=(), not_colours=())
        like = self._named(whole, list(self.world.objects.values()), match.is_general(ref.nouns), None)
        if like and not told & {item.id for item in like}:
            names = [item.id for item in like]
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"“{ref.text}”: other than which? I see {listed(names)}.", names, firm=True
            )

    def _has_shape(self, name: str, ref: Ref) -> bool:
        """Say whether a thing has the shapes that are told of others: "round" of "not round" or "but the round things"."""
        told = {*ref.shapes, *(word for noun in ref.nouns for word in noun.split() if word in SHAPES)}
        return bool(told) and all(self.world.objects[name].kind in SHAPES[shape] for shape in told)

    def _such(self, what: Ref) -> list[str]:
        objects = self.world.objects
        if what.nouns == ("thing",):
            return [item.id for item in match.with_colour(objects.values(), what.colours)]
        return self._loosely(what, list(objects))
