"""The intent tree: what a sentence asks for, before any object is looked up."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar

from robosandbox.skills.words import Words
from robosandbox.values import frozen

if TYPE_CHECKING:
    from robosandbox.agent.language.logic import Control

N = TypeVar("N", bound=NamedTuple)
Determiner = Literal["the", "a", "all", "it", "bare"]
Verb = Literal[
    "pick",
    "hand_to",
    "put",
    "release",
    "stack",
    "push",
    "pour",
    "open",
    "close",
    "tap",
    "home",
    "swap",
    "sort",
    "line_up",
    "unstack",
    "aside",
    "tidy",
    "empty",
    "nothing",
    "control",
    "worded",
]


class Rank(NamedTuple):
    """A place in an order: the leftmost, the second biggest, the one nearest to the bin.

    Attributes:
        key: What is ordered: left, right, near, far, middle, big, small, tall, short, wide, narrow, top, bottom or
            "" where an order was not named ("the second cube").
        nth: 1 is the first.
        anchor: For near and far: from what; None is the robot.
        strict: A superlative; a plain adjective ("the big cube") need not single anything out.
    """

    key: str
    nth: int = 1
    anchor: Ref | None = None
    strict: bool = True


class Relation(NamedTuple):
    """A position relative to things: a modifier of a noun or the place where something goes.

    Attributes:
        kind: on, in, at (in what holds things, else on), left, right, front, back, opposite, beside, between, under, from, to, towards, away, against, held (in the gripper), open or
            closed (of drawers), stacked or loose (on or below others or not), empty or full (of containers), holds or lacks (something inside), than ("taller than the can"), alike or unlike (of the same colour, or of another), discard (where waste goes).
        refs: The things; none is the table.
        distance: Metres.
        directional: "into", "onto", "to": says where something goes, never where it is.
        order: For than: what is compared, as the key of a `Rank`; "from" for "from under", "over" for "over to",
            "top" for "on top of".
    """

    kind: str
    refs: tuple[Ref, ...] = ()
    distance: float | None = None
    directional: bool = False
    order: str = ""


@frozen
class Region:
    """A part of the table, or of the space around the robot.

    Attributes:
        name: corner, edge, side or middle.
        sides: left, right, far, near; none leaves it open.
        anchor: For a corner: the thing that it is nearest to, or farthest from.
        farthest: It is farthest from the anchor.
        directional: "towards": a way to go rather than where to arrive.
    """

    name: str
    sides: tuple[str, ...] = ()
    anchor: Ref | None = None
    farthest: bool = False
    directional: bool = False


@frozen
class ByRobot:
    """Near the robot's base, on a side of it: front is where it looks; distance in metres, None for not far."""

    side: Literal["front", "left", "right", "beside"]
    distance: float | None = None


@frozen
class At:
    """Coordinates in the world, metres."""

    x: float
    y: float


@frozen
class Offset:
    """A shift from where the object is; distance in metres, None for a little way."""

    direction: str
    distance: float | None = None


@frozen
class Original:
    """Where the object was before this sentence moved it.

    Attributes:
        vacated: "where it was": of a thing that has not been moved, the place that another one has left.
    """

    vacated: bool = False


@frozen
class Spot:
    """Where another thing stands, or stood before this sentence moved it."""

    refs: tuple[Ref, ...]


@frozen
class Table:
    """Anywhere free on the table."""


@frozen
class Matching:
    """In the container of the same colour.

    Attributes:
        noun: What the container was called.
        other: In the one that is of another colour.
    """

    noun: str = "bin"
    other: bool = False


Place = Relation | Region | ByRobot | At | Offset | Original | Spot | Table | Matching


class Ref(NamedTuple):
    """A description of one or several objects.

    Attributes:
        text: The words as said.
        determiner: the (exactly one fits), a (any will do), all, it (a pronoun) or bare.
        nouns: What it is called; several are alternatives ("cubes or balls"); none is any thing.
        plural: More than one is meant.
        number: How many.
        colours: Any of these.
        shades: dark or light.
        not_colours: None of these.
        ranks: Orders, applied one after the other, the one next to the noun first.
        relations: Where it is.
        without: What is left out ("except").
        instead: What was said not to be meant ("the red cube, not the blue one").
        names: Parts of an id ("b" in "block b").
        other: "the other one", "the rest": not what was spoken of before.
        one: The noun is "one": inherits the noun spoken of before.
        unknown: Words nobody can look up, kept for the refusal.
        options: "the can or the ball": one of these.
        claims: What is said of it and cannot be seen ("wooden"): no plan is made by it.
        felt: How the speaker feels about it ("lovely").
        shapes: Shapes by adjective ("round").
        share: "half of the cubes": this part of all that fit.
        total: "two of the three cubes": how many must fit.
        distinct: "different bins": each thing gets one of its own.
        measures: "3 cm", "10 cm tall": each a dimension and metres.
        told_to_be: "..., it is a car": what is said beside it to tell what it is.
    """

    text: str
    determiner: Determiner = "the"
    nouns: tuple[str, ...] = ()
    plural: bool = False
    number: int | None = None
    colours: tuple[str, ...] = ()
    shades: tuple[str, ...] = ()
    not_colours: tuple[str, ...] = ()
    ranks: tuple[Rank, ...] = ()
    relations: tuple[Relation, ...] = ()
    without: tuple[Ref, ...] = ()
    names: tuple[str, ...] = ()
    other: bool = False
    one: bool = False
    unknown: tuple[str, ...] = ()
    options: tuple[Ref, ...] = ()
    claims: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    share: float | None = None
    total: int | None = None
    distinct: bool = False
    instead: tuple[Ref, ...] = ()
    measures: tuple[tuple[str, float], ...] = ()
    told_to_be: tuple[Ref, ...] = ()
    felt: tuple[str, ...] = ()


IT = Ref(text="it", determiner="it")


class Command(NamedTuple):
    """One thing to do.

    Attributes:
        verb: What.
        objects: To what.
        place: Where to.
        tower: Further supports, from the one right below the objects down ("red on green on blue").
        order: For towers of listed objects: "up" names the bottom one first, "down" the top one; or
            which one is to be at the "top", "middle" or "bottom".
        direction: For push: forward, back, left or right.
        distance: For push: metres.
        times: How often.
        bare: How much is left unsaid: no verb, or no place.
        negated: For nothing: the verb that is not to be done.
        control: For control: what depends on a condition, or is done again.
        spoken: What a condition that was found to hold spoke of just before.
        skill: For worded: which skill says itself how it is asked for.
        slots: For worded: what else was said, by argument.
        words: For worded: those that were said.
        terms: For worded: as those of a sentence.
    """

    verb: Verb
    objects: tuple[Ref, ...] = ()
    place: Place | None = None
    tower: tuple[Ref, ...] = ()
    order: Literal["up", "down"] | tuple[tuple[str, Ref], ...] | None = None
    direction: str | None = None
    distance: float | None = None
    times: int = 1
    bare: float = 0.0
    negated: str = ""
    control: Control | None = None
    spoken: tuple[Ref, ...] = ()
    skill: str = ""
    slots: tuple[tuple[str, Any], ...] = ()
    words: Words | None = None
    terms: tuple[str, ...] = ()


@frozen
class Sentence:
    """Orders of a sentence, one after the other, and what to keep away from.

    Attributes:
        steps: In order.
        avoid: What is not to be touched.
        manners: Words of speed and care, which no skill is told.
        anew: "again", "instead" in the first step: something was done before.
        terms: How it is to be done: the names of tempos, "0.05 m/s" or "8 s"; and what it is not to do, as "untouched".
        asides: What no plan takes account of, as it was said.
    """

    steps: tuple[Command, ...]
    avoid: tuple[Ref, ...] = ()
    manners: tuple[str, ...] = ()
    anew: bool = False
    terms: tuple[str, ...] = ()
    asides: tuple[str, ...] = ()


def replace(node: N, /, **changes: Any) -> N:
    """Return a node with some of its fields changed.

    A parse makes thousands of nodes and compares them: what there are many of are named tuples, made, hashed and
    compared an order faster than frozen dataclasses.

    Raises:
        TypeError: It has no such field.
    """
    made = node._make(map(changes.pop, node._fields, node))
    if changes:
        raise TypeError(f"{type(node).__name__} has no {', '.join(changes)}")
    return made


def unseen(said: object) -> tuple[str, ...]:
    """Return the words of a reading that name nothing which can be perceived, wherever in it they stand."""
    return tuple(dict.fromkeys(_unseen(said)))


def _unseen(said: object) -> Iterator[str]:
    if isinstance(said, Ref):
        yield from (*said.unknown, *said.claims, *said.felt)
    if isinstance(said, tuple):
        parts: Iterable[object] = said
    elif is_dataclass(said) and not isinstance(said, Words):
        # The words of a skill are its own and not this sentence's.
        parts = (getattr(said, part.name) for part in fields(said))
    else:
        return
    for part in parts:
        if not isinstance(part, str):
            yield from _unseen(part)
