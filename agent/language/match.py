"""Does a description fit an object: by what it is called, what shape it has, and what colour it shows.

Ids are text from the scene: they are compared with words that were said and are never read as anything else.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from functools import lru_cache

from robosandbox.agent.language import things
from robosandbox.agent.language.inflection import plural
from robosandbox.agent.language.scene_words import id_parts
from robosandbox.agent.language.shades import has_shade
from robosandbox.agent.language.synonyms import SAME_AS
from robosandbox.agent.language.wordlist import word_set
from robosandbox.shapes import Shape, kinds_that_hold, shape_of, shapes
from robosandbox.types import DetectedObject

NAMED, SYNONYM, SHAPE, LOOSE = 4, 3, 2, 1
CONTAINERS = kinds_that_hold()
STANDING = frozenset(kind for kind, shape in shapes().items() if shape.stays_put)
"""Kinds that stay where they are unless somebody names them."""
SHAPE_KINDS: dict[str, frozenset[str]] = {
    "cube": frozenset({"box"}),
    "block": frozenset({"box"}),
    "box": frozenset({"box"}),
    "ball": frozenset({"sphere"}),
    "cylinder": frozenset({"cylinder"}),
    "capsule": frozenset({"capsule"}),
    "bin": frozenset({"bin"}),
    "bowl": frozenset({"bowl"}),
    "drawer": frozenset({"drawer"}),
}
"""Words for a shape: they fit whatever has it."""
THING_KINDS: dict[str, frozenset[str]] = {
    "can": frozenset({"cylinder"}),
    "bottle": frozenset({"cylinder", "capsule"}),
    "mug": frozenset({"bowl", "cup"}),
}
"""Words for a thing: they fit its usual shape only where the id names no other thing."""
_FROM_FILES = frozenset(kind for kind, shape in shapes().items() if not shape.size_fields)
VESSELS = _FROM_FILES.union(*THING_KINDS.values())
"""Kinds that may hold something to pour: what bottles, mugs and cans are made of here, and what a file describes."""


# Half of the longest side of what is turned like a knob, metres: a hand goes around it.
_LARGEST_KNOB = 0.08


def _classes() -> dict[str, str]:
    table: dict[str, str] = {}
    for noun, phrases in things.NOUNS.items():
        for phrase in phrases.split(","):
            table.setdefault(phrase.strip(), noun)
            table.setdefault(plural(phrase.strip()), noun)
    return table


_NO_PLURALS = frozenset({"lens", "gas", "canvas", "atlas", "thermos"})


def is_called_several(name: str) -> bool:
    """Say whether one thing is called like several: "peas", "pliers_2"; not "glass" or "bus"."""
    word = next((part for part in reversed(id_parts(name)) if part.isalpha()), "")
    return len(word) > 3 and word.endswith("s") and not word.endswith(("ss", "us", "is")) and word not in _NO_PLURALS


NOUN_CLASS = _classes()


# A thing that is called one of these may be called by another word for its form as well.
_FORMS = frozenset(SHAPE_KINDS)


def _add_installed_shapes() -> None:
    """Let the words of each kind of object that no word here names fit whatever has that kind."""
    named = {kind for table in (SHAPE_KINDS, THING_KINDS) for kinds in table.values() for kind in kinds}
    for kind, shape in shapes().items():
        if kind in named or shape.is_plural or not shape.size_fields:
            continue
        for noun in shape.nouns:
            noun_class = NOUN_CLASS.get(noun, noun)
            SHAPE_KINDS[noun_class] = SHAPE_KINDS.get(noun_class, frozenset()) | {kind}


_add_installed_shapes()
CANONICAL_COLOUR = {
    phrase.strip(): colour for colour, phrases in things.COLOURS.items() for phrase in phrases.split(",")
}


_SOLID = word_set(
    "battery marker pen pencil crayon chalk candle bulb bolt screw nail rod stick peg dowel cork eraser magnet spring"
)
"""What has the shape of a can and holds nothing."""
_KEPT = _SOLID | word_set(
    """
    brush toothbrush key coin spoon fork knife nut washer bead button card ticket straw napkin die dice rock stone pebble
    gem shell marble book block cube ball toy spool
    """
)
"""What containers are named after that are none of it."""
_PACKAGES = frozenset({"box", "can", "bottle"})
_ANY_CONTAINER = frozenset({"container", "receptacle"})
_GROWN = frozenset({"fruit", "vegetable"})
_OF_IT = frozenset({"half", "slice", "wedge", "piece", "chunk", "quarter"})
_NAMED_KINDS = things.ABSENT_NOUNS.union(*things.KINDS_OF.values())
_LIVING = frozenset({"fruit", "vegetable", "animal", "vehicle", "tool"})


def noun_fit(noun: str, item: DetectedObject) -> int:
    """Return how well a noun names an object: NAMED, SYNONYM, SHAPE, LOOSE or 0.

    Args:
        noun: As said, singular.
        item: The object.
    """
    part = _part_fit(noun, item)
    return _noun_fit(noun, item.id, item.kind, _is_cubic(item)) if part is None else part


def owner_of(name: str, names: Container[str]) -> str:
    """Return the id of what a part is on, if that is seen: "cupboard" of "cupboard.door"; "" for what is no part."""
    owner = name.rpartition(".")[0]
    return owner if owner in names else ""


def is_word_for_parts(noun: str) -> bool:
    """Say whether a noun is for what moves on something else: "drawer", "door", "knob"."""
    return any(noun in words for words in things.PARTS.values())


def _part_fit(noun: str, item: DetectedObject) -> int | None:
    """Return how well a noun names a part of a scene's file by how it moves; None where that tells nothing."""
    joint = None if item.geometry is None else item.geometry.joint
    if noun in id_parts(item.id.rpartition(".")[2]) or (joint is None and item.kind != "compartment"):
        return None
    if joint is None:
        sort = "compartment"
    elif joint.kind == "slide":
        sort = "drawer" if item.shape.holds_things else "button"
    else:
        sort = "door" if max(item.size) > _LARGEST_KNOB else "knob"
    return NAMED if noun in things.PARTS[sort] else 0 if is_word_for_parts(noun) else None


@lru_cache(maxsize=4096)
def _noun_fit(noun: str, name: str, kind: str, cubic: bool) -> int:
    parts = id_parts(name)
    noun_class = NOUN_CLASS.get(noun, noun)
    if noun_class == "thing":
        return LOOSE if kind not in STANDING else 0
    if shape_of(kind).is_granular and noun in ("bead", "grain", "pellet", "granule"):
        return SHAPE
    if (
        noun in parts
        or noun == "".join(parts)
        or noun.replace(" ", "") in parts
        or all(w in parts for w in noun.split())
    ):
        return NAMED
    if " " in noun and noun.split()[0] in parts and kind in SHAPE_KINDS.get(noun_class, ()):
        # "the waste bin" is the bin called waste, rather than a tray.
        return NAMED
    own = {NOUN_CLASS[part] for part in parts if part in NOUN_CLASS} - {"thing", "one"}
    if _head(parts) in SAME_AS.get(noun, ()) and _head(parts).endswith(noun):
        # "the pan" is the frypan rather than the pot.
        return NAMED
    if noun_class in own or _head(parts) in SAME_AS.get(noun, ()):
        return SYNONYM
    if any(part in things.KINDS_OF.get(noun_class, ()) for part in parts):
        head = _head(parts)
        if noun_class in _LIVING and head in NOUN_CLASS and head not in things.KINDS_OF[noun_class]:
            # A tomato can is no vegetable.
            return 0
        if noun_class in _GROWN and head and head not in things.KINDS_OF[noun_class] | _OF_IT:
            # Nor is a pepper mill.
            return 0
        return SHAPE
    if kind == "cupboard" and noun in ("cabinet", "cupboard"):
        return SHAPE
    if kind == "solid" and noun_class in _PACKAGES and not own:
        # "the cookie box" for what a file calls cookies.
        return LOOSE
    shapes = SHAPE_KINDS.get(noun_class, frozenset())
    if noun_class == "bin" and noun not in ("bin", *_ANY_CONTAINER) and own - {"bin", "box"}:
        # "the basket" is none that its id calls a bowl.
        return 0
    if kind in shapes:
        # "cube" for a plank, "bin" for what its id calls a tray.
        if noun_class == "cube" and not cubic:
            # A stapler is no cube, nor are sticky notes; a brick is hardly one.
            head = _head(parts)
            return LOOSE if not head or NOUN_CLASS.get(head) in ("block", "box", "thing") else 0
        return SHAPE
    if noun_class == "box" and _is_open_box(shape_of(kind)):
        return LOOSE
    if noun_class == "bin" and noun in ("container", "receptacle", "basin") and kind in CONTAINERS:
        return LOOSE
    if noun in things.COMPOUND_HEADS and any(part.endswith(noun) for part in parts):
        # "the brush" for a paintbrush, where nothing is called brush.
        return LOOSE
    if noun in things.POTS and kind in VESSELS and _head(parts) in things.POTTED:
        return LOOSE
    if kind in THING_KINDS.get(noun_class, ()) and not (own - _FORMS):
        # A battery may pass for a can, but is none of "the cans".
        return LOOSE if _head(parts) in things.ABSENT_NOUNS else SHAPE
    return 0


def _head(parts: Sequence[str]) -> str:
    """Return what an id calls the thing: "paint" of paint_2 and of paint_red."""
    return next((part for part in reversed(parts) if part.isalpha() and part not in CANONICAL_COLOUR), "")


@lru_cache(maxsize=4096)
def _is_for(noun: str, name: str, kind: str) -> bool:
    """Say whether a container is only named after what goes in it: no dice bowl is one of the dice."""
    parts = id_parts(name)
    head, noun_class = NOUN_CLASS.get(_head(parts)), NOUN_CLASS.get(noun, noun)
    contents = noun_class not in (*STANDING, "box") and noun in parts and noun != _head(parts)
    holds = head in (*STANDING, "box") or (head == "mug" and noun in _KEPT)
    return contents and kind in CONTAINERS and holds and head != noun_class


def _is_another(nouns: Sequence[str], name: str) -> bool:
    """Say whether an id calls a thing something else by its last word, and has the noun before that."""
    head = _head([part for part in id_parts(name) if len(part) > 1])
    kinds = {NOUN_CLASS.get(noun, noun) for noun in nouns}
    return head not in nouns and NOUN_CLASS.get(head, head if head in things.ABSENT_NOUNS else "") not in (*kinds, "")


_FORMS = frozenset({"block", "box", "ball"})


def is_only_shaped_so(nouns: Sequence[str], item: DetectedObject) -> bool:
    """Say whether a thing has the shape of what nouns name, and a name of its own: a marker is as long as a block."""
    kinds = {NOUN_CLASS.get(noun, noun) for noun in nouns}
    if not kinds or not kinds <= _FORMS or any(noun_fit(noun, item) > SHAPE for noun in nouns):
        return False
    parts = [part for part in id_parts(item.id) if part.isalpha()]
    if {word for kind in kinds for word in things.HYPONYMS.get(kind, ())} & {*parts}:
        return False
    # A lime is called after no colour.
    head = _head(parts) or parts[-1]
    return NOUN_CLASS.get(head, "") not in (*kinds, "") or head in _NAMED_KINDS


def _is_cubic(item: DetectedObject) -> bool:
    return item.shape.noun(item.size) == "cube"


def colour_of(item: DetectedObject) -> str:
    """Return the object's colour under its most common name."""
    return CANONICAL_COLOUR.get(item.colour.lower(), item.colour.lower())


def with_colour(items: Iterable[DetectedObject], colours: Sequence[str], shade: str = "") -> list[DetectedObject]:
    """Return the objects that show one of the colours, or a light or dark shade of it; by their ids where none shows it."""
    everything = list(items)
    seen = [item for item in everything if colour_of(item) in colours or (shade and has_shade(item, colours, shade))]
    # Beside a white mug one that is called red, or white and yellow, is not "the white mug".
    others = {item.id for item in seen if not _called_colours(item) <= {*colours}}
    return [item for item in seen if item.id not in others] or seen or called_colour(everything, colours)


def _called_colours(item: DetectedObject) -> set[str]:
    """Return the colours that an id names."""
    return {CANONICAL_COLOUR[part] for part in id_parts(item.id) if part in CANONICAL_COLOUR}


def called_colour(items: Iterable[DetectedObject], colours: Sequence[str]) -> list[DetectedObject]:
    """Return the objects whose ids name one of some colours."""
    return [item for item in items if any(CANONICAL_COLOUR.get(part) in colours for part in id_parts(item.id))]


def with_noun(
    items: Iterable[DetectedObject],
    nouns: Sequence[str],
    *,
    several: bool,
    count: int | None = None,
    kinds: bool = False,
) -> list[DetectedObject]:
    """Return the objects that the noun names best.

    Args:
        items: To choose from.
        nouns: As said; several are alternatives.
        several: More than one is meant: if too few bear the name, those of the shape count as well.
        count: How many are meant; two at least without it.
        kinds: What is a kind of it counts as well, although it has a name of its own: marbles among all balls.
    """
    if len(nouns) > 1:
        # "balls and blocks": the blocks are those called so, whatever there is of balls.
        items = list(items)
        each = [with_noun(items, (noun,), several=several, kinds=kinds) for noun in nouns]
        return [item for item in items if any(item in found for found in each)]
    fits = [(item, max(noun_fit(noun, item) for noun in nouns)) for item in items]
    named = [(item, fit) for item, fit in fits if not all(_is_for(noun, item.id, item.kind) for noun in nouns)]
    if not any(fit for _, fit in named) and all(noun in _KEPT for noun in nouns):
        # "the pencil" is no pencil cup, although "the coffee" may be a coffee cup.
        return []
    fits = named if any(fit >= SHAPE for _, fit in named) else fits
    best = max((fit for _, fit in fits), default=0)
    if best == 0:
        return []
    if several and {*nouns} & _ANY_CONTAINER and best < NAMED:
        # "in each container": into bowls as well as bins.
        return [item for item, fit in fits if fit]
    top = [item for item, fit in fits if fit == best]
    if kinds and best == SYNONYM and not count:
        # "the smallest ball" of a marble and a pearl: nothing there is called a ball.
        top = [item for item, fit in fits if fit >= SHAPE]
    elif kinds and best >= SYNONYM:
        words = frozenset(w for noun in nouns for w in things.HYPONYMS.get(NOUN_CLASS.get(noun, noun), ()) if noun != w)
        top = [item for item, fit in fits if fit == best or (fit and words & {*id_parts(item.id)})]
    if best == NAMED:
        # "the ball" is a golf ball rather than a ball marker, "the pencil" no pencil mug.
        top = [item for item in top if not _is_another(nouns, item.id)] or top
        if not (several or kinds):
            # "the tomato" is the one called just that, rather than tomato_2; "the little tomato" may be either.
            top = [item for item in top if item.id in nouns] or top
    if several and len(top) < (count or 2):
        return [item for item, fit in fits if fit >= min(best, SHAPE)]
    return top


def with_names(
    items: Iterable[DetectedObject], names: Sequence[str], *, compared: bool = False, of_part: bool = False
) -> list[DetectedObject]:
    """Return the objects whose id is the name, or has all the names as parts.

    Args:
        items: To choose from.
        names: Ids, or words of them.
        compared: Several are meant, or told apart: of tomato and small_tomato "the little tomato" is the other one.
        of_part: They stand for what the part that is meant is on: "the door of the cupboard" is cupboard.door.
    """
    everything = list(items)
    exact = [item for item in everything if item.id in names]
    if of_part and (parts := [item for item in everything if owner_of(item.id, names)]):
        return parts
    whole = [item for item in everything if all(name in id_parts(item.id) for name in names)]
    if len(names) > 1 and whole and not {item.id for item in exact} & {item.id for item in whole}:
        # Of tomato and small_tomato "the small tomato" is called so.
        return whole
    if exact and compared:
        alike = [item for item in everything if _head(id_parts(item.id)) in names]
        return alike if len(names) == 1 and alike else exact
    return exact or whole


def is_general(nouns: Sequence[str]) -> bool:
    """Say whether a noun is for whatever other things go into."""
    return bool({*nouns} & _ANY_CONTAINER)


def is_solid(item: DetectedObject) -> bool:
    """Say whether a round thing is called something that holds nothing: a battery, a marker."""
    head = _head(id_parts(item.id))
    return item.shape.rolls and head in _SOLID


def is_receptacle(item: DetectedObject) -> bool:
    """Say whether things are sorted and tidied into it: a bin or a bowl, rather than a cup or a tray."""
    return item.shape.is_open_container and item.shape.stays_put


def holds_things(item: DetectedObject) -> bool:
    """Say whether things can be put into an object: of its kind, or of its own pieces, as a cabinet's drawer."""
    return item.kind in CONTAINERS or item.shape.holds_things


def is_shallow(item: DetectedObject) -> bool:
    """Say whether nothing stands on it, and it is an open container wider than deep, such as a bowl."""
    room = item.shape.room(item.size) if item.shape.is_open_container and not item.shape.flat_top else None
    return room is not None and 2.0 * float(min(room.half)) > room.rim - room.floor


def has_straight_walls(item: DetectedObject) -> bool:
    """Say whether it is a bin or a drawer: a container that stays put and is put neither into nor onto another."""
    room = item.shape.room(item.size)
    return item.shape.stays_put and room is not None and not room.is_round


def is_cup(item: DetectedObject) -> bool:
    """Say whether it is a container that is taken in the hand to pour."""
    return item.shape.pours and not item.shape.stays_put


def is_round_vessel(item: DetectedObject) -> bool:
    """Say whether it is a cup or a bowl."""
    room = item.shape.room(item.size)
    return item.shape.pours and room is not None and room.is_round


def is_ball(item: DetectedObject) -> bool:
    """Say whether it rolls whichever way it lies, so that nothing stays on it."""
    return item.shape.rolls and not item.shape.flat_top


def _is_open_box(shape: Shape) -> bool:
    """Say whether a kind is taken for a box and is open above."""
    return shape.is_open_container and bool(shape.looks_like & SHAPE_KINDS["box"])


def is_waste(name: str) -> bool:
    """Say whether a container's id tells that it takes what is thrown away."""
    return bool(
        {"waste", "trash", "rubbish", "garbage", "scrap", "dustbin", "wastebasket", "discard"} & {*id_parts(name)}
    )
