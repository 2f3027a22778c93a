"""Cost of a reading: unknown words, and modifiers where a plain noun would do; the plainest reading counts."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from robosandbox.agent.language import lazy_regex
from robosandbox.agent.language.intent import Command, Element, Ref, Sentence
from robosandbox.agent.language.logic import commands_of

# A second list of things, or a second place, beside one verb.
_AGAIN = 0.5
# Strain, a number of units, of a colour that several nouns would share. Chosen: in "the red, white and green cubes" another
# white thing is no white cube.
_SHARED = 1.6
_LEVELS = frozenset({"bottom", "top", "middle"})
_SIDES = frozenset({"left", "right", "front", "back"})
_TO_ONE_SIDE = lazy_regex.compile(r" (?:to the (?:left|right)|in front|behind)$")
_AT_LEVEL = lazy_regex.compile(r" (?:at|on|in) (?:the )?\w+$")


Known = dict[int, tuple[Any, float]]
"""How far-fetched nodes are, by identity; it keeps them, so that no other takes their place."""


def strain(value: Any, known: Known) -> float:
    """Return how far-fetched a phrase is: a noun phrase, a list, a place, an argument, a command or a sentence.

    Args:
        value: The phrase.
        known: What was found out before; readings are made of the same few nodes.
    """
    if type(value) is tuple:
        total, objects, places = 0.0, 0, 0
        for item in value:
            total += strain(item, known)
            kind = getattr(item, "kind", "")
            objects += kind == "objects"
            places += kind == "place"
        return total + _AGAIN * (max(objects - 1, 0) + max(places - 1, 0))
    found = known.get(id(value))
    if found is None:
        found = known[id(value)] = (value, _of_node(value, known))
    return found[1]


def _of_node(value: Any, known: Known) -> float:
    if isinstance(value, Ref):
        return _of_ref(value)
    if isinstance(value, Command):
        return _of_command(value)
    if isinstance(value, Sentence):
        # "stack a, b and c on the plate" has one place for all, rather than one of its own for c.
        apart = sum(a.verb == "stack" and a.place is None and b.bare > 0 for a, b in pairwise(value.steps))
        return sum(map(_of_command, value.steps)) + sum(map(_of_ref, value.avoid)) + _AGAIN * apart
    if isinstance(value, Element):
        return strain(value.value, known)
    # A relation or another place has noun phrases.
    return strain(getattr(value, "refs", ()), known) if not isinstance(value, (str, int)) else 0.0


def parties(command: Command) -> tuple[Ref, ...]:
    """Return the noun phrases of a command."""
    return (*command.objects, *command.tower, *getattr(command.place, "refs", ()))


def _of_command(command: Command) -> float:
    if command.control:
        return sum(map(_of_command, commands_of(command)))
    several = len(command.objects) == 1 and command.objects[0].plural
    # "all the cans into the tray but not the blue one" leaves out a can, and tells of no other tray.
    contrast = 0.6 * sum(" but not " in ref.text for ref in getattr(command.place, "refs", ())) if several else 0.0
    levels = [ref for _, ref in command.order] if isinstance(command.order, tuple) else []
    colours = _SHARED * _colours_before_a_noun(command.objects)
    # "the can to the left, the cup to the right of the box": a place, not which can.
    sided = getattr(command.place, "kind", "") in _SIDES and any(
        _TO_ONE_SIDE.search(r.text) for r in command.objects[:-1]
    )
    return command.bare + contrast + colours + _SHARED * sided + sum(map(_of_ref, (*parties(command), *levels)))


def _colours_before_a_noun(refs: tuple[Ref, ...]) -> bool:
    last = refs[-1] if refs else None
    shared = last is not None and len(last.colours) == 1 and bool(last.nouns or last.names)
    return shared and any(
        ref.one and ref.colours and not (ref.nouns or ref.ranks or ref.text.endswith(("one", "ones")))
        for ref in refs[:-1]
    )


def _of_ref(ref: Ref) -> float:
    # "each of them" means those spoken of, rather than all there is.
    bare = 0.2 * (ref.determiner == "bare") + (0.9 if ref.text.endswith("of them") else 0.3) * (
        ref.one and not ref.nouns
    )
    if not (ref.relations or ref.without or ref.options or ref.unknown or ref.ranks):
        return bare
    # "everything but the trays and the tin" leaves both out.
    inner = sum(map(_of_ref, (*(r for relation in ref.relations for r in relation.refs), *ref.without, *ref.options)))
    bare -= 0.6 * len(ref.without)
    # "big green at the bottom" is rather a level of a tower than one of several things.
    level = 0.3 if any(rank.key in _LEVELS for rank in ref.ranks) and _AT_LEVEL.search(ref.text) else 0.0
    return 20.0 * len(ref.unknown) + 1.0 * len(ref.relations) + bare + level + inner
