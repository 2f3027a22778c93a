"""The elements of one clause, sorted by kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from robosandbox.agent.language.clauses import Element
from robosandbox.agent.language.intent import Place, Rank, Ref, Relation, replace

UP = frozenset({"up", "upward", "upwards", "off", "out", "in the air", "into the air", "up in the air", "up into the air", "off the table", "up off the table",
    "up from the table", "off of the table", "off the ground", "from the ground", "off the desk", "off the surface", "into your gripper",
    "in your gripper", "into the gripper", "back up", "in your hand", "into your hand", "off the tabletop", "from the tabletop", "off of the desk",
    "up high", "in your grasp", "in your grip", "in your claw", "for me"})  # fmt: skip
DOWN = frozenset({"down", "back down"})
ASIDE = frozenset(
    {
        "aside",
        "out of the way",
        "out of my way",
        "out of our way",
        "to one side",
        "to the side",
        "off to one side",
        "off to the side",
        "over to one side",
    }
)
ROW = frozenset(
    {
        "in a row",
        "in a line",
        "in line",
        "into a row",
        "into a line",
        "in one row",
        "in a straight line",
        "in one line",
        "in a neat row",
        "in a neat line",
    }
)
TOGETHER = ROW | frozenset(
    {"together", "next to each other", "beside each other", "side by side", "next to one another", "beside one another"}
)
MUTUAL = frozenset(
    {
        "on top of each other",
        "on top of one another",
        "on each other",
        "on one another",
        "together",
        "up",
        "one on top of the other",
        "one on another",
        "on top of the other",
    }
)


MUTUAL |= frozenset(
    f"{into} {one}{tower}"
    for into in ("in", "into", "as")
    for one in ("a ", "one ", "a single ", "one big ", "one tall ")
    for tower in ("tower", "stack", "pile")
)


class Frame(NamedTuple):
    """The elements of one clause by kind.

    Attributes:
        objects: Lists of noun phrases, in order.
        places: Where.
        rest: The other kinds, with their values.
        kinds: All kinds in the order in which they were said.
    """

    objects: tuple[tuple[Ref, ...], ...]
    places: tuple[Place, ...]
    rest: dict[str, list[Any]]
    kinds: tuple[str, ...] = ()

    @classmethod
    def of(cls, elements: Sequence[Element]) -> Frame:
        """Sort elements by kind."""
        rest: dict[str, list[Any]] = {}
        for kind, value in elements:
            rest.setdefault(kind, []).append(value)
        kinds = tuple([kind for kind, _ in elements])
        return cls(tuple(rest.pop("objects", ())), tuple(rest.pop("place", ())), rest, kinds)

    def only(self, *kinds: str) -> bool:
        """Say whether no other kinds are there, and none twice."""
        return not self.rest or all(kind in kinds and len(values) == 1 for kind, values in self.rest.items())

    def one(self, kind: str) -> Any:
        """Return the value of a kind that occurs once, or None."""
        return self.rest[kind][0] if kind in self.rest else None

    @property
    def particle(self) -> str | None:
        """The particle, if there is one."""
        return str(self.one("particle")) if "particle" in self.rest else None


ATTACHED = frozenset({"also", "choice", "except", "sequence", "turns"})
"""Kinds of elements that belong to another one said before."""


def chosen_by(elements: Sequence[Element]) -> Sequence[Element]:
    """Attach "..., whichever is closer" at the end of a clause to the alternatives before it."""
    ranks = [e.value for e in elements if e.kind == "choice"]
    if not ranks:
        return elements
    made: list[Element] = []
    open_choices = 0
    for element in elements:
        value = element.value
        if element.kind == "objects" and len(value) == 1 and value[0].options and not value[0].ranks:
            open_choices += 1
            element = Element("objects", (replace(value[0], determiner="the", ranks=tuple(ranks)),))
        elif element.kind == "place" and isinstance(value, Relation) and any(ref.options for ref in value.refs):
            open_choices += 1
            refs = tuple(replace(ref, determiner="the", ranks=tuple(ranks)) for ref in value.refs)
            element = Element("place", replace(value, refs=refs))
        if element.kind != "choice":
            made.append(element)
    return made if open_choices == 1 and len(ranks) == 1 else elements


def joined(elements: Sequence[Element]) -> Sequence[Element]:
    """Add "..., along with the ball" at the end of a clause to the objects at its start."""
    also = [ref for e in elements if e.kind == "also" for ref in e.value]
    first = next((k for k, e in enumerate(elements) if e.kind == "objects"), None)
    if not also or first is None:
        return elements
    whole = Element("objects", (*elements[first].value, *also))
    return [whole if k == first else e for k, e in enumerate(elements) if e.kind != "also"]


def in_sequence(elements: Sequence[Element]) -> Sequence[Element]:
    """Attach "..., smallest first" at the end of a clause to the objects at its start."""
    keys = [e.value for e in elements if e.kind == "sequence"]
    first = next((k for k, e in enumerate(elements) if e.kind == "objects"), None)
    refs: tuple[Ref, ...] = elements[first].value if first is not None else ()
    if len(keys) != 1 or len(refs) != 1 or not (refs[0].plural or refs[0].determiner == "all") or refs[0].ranks:
        return elements
    ordered = Element("objects", (replace(refs[0], ranks=(Rank(keys[0], 0),)),))
    return [ordered if k == first else e for k, e in enumerate(elements) if e.kind != "sequence"]


def excepted(elements: Sequence[Element]) -> Sequence[Element]:
    """Attach "... except the red one" at the end of a clause to the objects at its start."""
    excluded = tuple(ref for e in elements if e.kind == "except" for ref in e.value)
    first = next((k for k, e in enumerate(elements) if e.kind == "objects"), None)
    if not excluded or first is None:
        return elements
    refs = elements[first].value
    if len(refs) != 1 or not (refs[0].plural or refs[0].determiner in ("all", "a")):
        return elements
    return [
        Element("objects", (replace(refs[0], without=(*refs[0].without, *excluded)),)) if k == first else element
        for k, element in enumerate(elements)
        if element.kind != "except"
    ]
