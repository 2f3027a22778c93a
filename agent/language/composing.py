"""Frames of the verbs that put several things in an order: towers, rows, swaps, sorting, tidying."""

from __future__ import annotations

from typing import Any

from robosandbox.agent.language.frame import MUTUAL, TOGETHER, Frame
from robosandbox.agent.language.intent import IT, Command, Place, Ref, Relation, Table, replace
from robosandbox.agent.language.whereto import placed

_LEVELS = (" bottom", " top", " middle", " lowest", " highest", " base")


def stack(frame: Frame) -> list[Command]:
    """As in "stack the cubes", "stack red on green", "pile them up with the red one on top"."""
    if set(frame.rest) - {"particle", "order", "order_end", "direction", "by_size"}:
        return []
    if len(frame.objects) > 1:
        return []
    if frame.particle and frame.particle not in MUTUAL:
        return []
    objects = frame.objects[0] if frame.objects else (IT,)
    order = _order(frame, objects)
    if any(map(_level_denied, objects)):
        return []
    if "direction" in frame.rest or ("by_size" in frame.rest and (order or frame.places or len(objects) != 1)):
        return []
    if not frame.places:
        return [Command("stack", objects, None, (), order)] if frame.objects else []
    found: list[Command] = []
    for command in placed("stack", objects, frame.places):
        kind = command.place.kind if isinstance(command.place, Relation) else ""
        if kind == "in" and order is None:
            # "pile them in the bin" builds no tower.
            found.append(replace(command, verb="put"))
        elif kind == "on" or (isinstance(command.place, Table) and order is None):
            found.append(replace(command, order=order))
    return found


def _level_denied(ref: Ref) -> bool:
    """As in "the cubes, not the red one at the bottom": it tells of a level, and of none that is left out."""
    denied = (*ref.without, *ref.instead)
    return any(each.text.endswith(_LEVELS) for each in (ref, *denied)) if denied else False


def _extreme(ref: Ref) -> bool:
    """As in "the biggest cube", of all cubes."""
    plain = not (ref.colours or ref.relations or ref.names)
    return plain and len(ref.ranks) == 1 and ref.ranks[0].strict and ref.ranks[0].nth == 1


def _of(whole: Ref, ref: Ref) -> Ref:
    """As in "the blue one" of the blocks."""
    return replace(ref, nouns=whole.nouns, one=False) if ref.one and not ref.nouns else ref


def _order(frame: Frame, objects: tuple[Ref, ...]) -> Any:
    return frame.one("order") or tuple(frame.rest.get("order_end", ())) or None


def build(frame: Frame) -> list[Command]:
    """As in "a tower of the red, green and blue cubes", "a tower with blue at the bottom, then green"."""
    tower = frame.objects[0][0].nouns[:1] if frame.objects else ()
    if len(frame.objects) == 1 and len(frame.objects[0]) == 1 and tower and not frame.rest and not frame.places:
        return [Command("stack")]
    if not tower or tower[0] != "tower" or len(frame.objects[0]) != 1:
        return []
    ends = [end for end in frame.rest.get("order_end", ())]
    lists = [*frame.objects[1:], *frame.rest.get("material", ())]
    where = frame.places[0] if len(frame.places) == 1 else None
    tower_ref = frame.objects[0][0]
    plain = not (tower_ref.relations or tower_ref.without or any(rank.strict for rank in tower_ref.ranks))
    if (tower_ref.number or 0) > 1 or any(map(_level_denied, (ref for refs in lists for ref in refs))):
        # "a two-high tower of the cubes": which two?
        return []
    on = isinstance(where, Relation) and where.kind == "on" and bool(where.refs)
    if (
        set(frame.rest) - {"order", "order_end", "material", "person"}
        or len(lists) > 1
        or not plain
        or (frame.places and not on)
    ):
        return []
    if len({level for level, _ in ends}) < len(ends):
        return []
    middle: tuple[Ref, ...] = lists[0] if lists else ()
    if on:
        return [Command("stack", middle, where)] if middle and not ends and "order" not in frame.rest else []
    if "order" in frame.rest:
        return [Command("stack", middle, None, (), frame.one("order"))] if middle and not ends else []
    if not ends:
        return [Command("stack", middle)] if middle else []
    if not middle and {level for level, _ in ends} == {"top", "bottom"} and all(_extreme(ref) for _, ref in ends):
        # "the biggest cube at the bottom, the smallest on top": the others between them.
        named = next((ref for _, ref in ends if ref.nouns and not ref.one), None)
        if named is None:
            return []
        every = Ref(text=named.text, determiner="all", nouns=named.nouns, plural=True)
        ends = [(level, _of(every, ref)) for level, ref in ends]
        return [Command("stack", (every,), None, (), tuple(ends))]
    whole = len(middle) == 1 and (middle[0].plural or middle[0].determiner == "all")
    listed_at = [k for k, kind in enumerate(frame.kinds) if kind in ("objects", "material")][1:]
    ranked = len(middle) > 1 and all(_extreme(ref) and not (ref.nouns or ref.names) for _, ref in ends)
    if ranked or whole or (listed_at and frame.kinds.index("order_end") > listed_at[0]):
        # "of the red, green and blue blocks with the green one on top": the end is one of those listed.
        return [Command("stack", middle, None, (), tuple(ends))]
    by_level: dict[str, Ref] = dict(ends)
    if "bottom" not in by_level and "middle" not in by_level:
        # "red on top, then green, then blue" goes on downwards.
        listed = (*reversed(middle), by_level["top"])
    else:
        listed = tuple(
            ref for ref in (by_level.get("bottom"), by_level.get("middle"), *middle, by_level.get("top")) if ref
        )
    return [Command("stack", listed, None, (), "up")] if len(listed) > 1 else []


def swap(frame: Frame) -> list[Command]:
    """As in "swap the can and the cube", "swap the can with the cube"."""
    if not frame.only("particle", "material", "in_exchange") or frame.particle not in (
        None,
        "around",
        "over",
        "round",
        "with each other",
        "with one another",
        "places",
        "positions",
        "spots",
        "locations",
        "places with each other",
    ):
        return []
    for kind in ("material", "in_exchange"):
        if kind in frame.rest:
            with_ = (*frame.objects[0], *frame.one(kind)) if len(frame.objects) == 1 and not frame.places else ()
            return [Command("swap", with_)] if with_ else []
    if len(frame.objects) == 1 and not frame.places:
        return [Command("swap", frame.objects[0])]
    if len(frame.objects) == 2 and not frame.places:
        return [Command("swap", (*frame.objects[0], *frame.objects[1]))]
    return []


def sort(frame: Frame) -> list[Command]:
    """As in "sort the cubes by colour", "sort the balls into the matching bins"."""
    if len(frame.objects) > 1 or not frame.only("colour", "matching"):
        return []
    everything = Ref(text="everything", determiner="all", plural=True)
    objects = frame.objects[0] if frame.objects else (everything,)
    if "matching" in frame.rest:
        return [Command("put", objects, frame.one("matching"))] if not frame.places else []
    if "colour" not in frame.rest and not (frame.objects and len(frame.places) < 2):
        return []
    if "colour" not in frame.rest and len(frame.places) == 1 and _one_container(frame.places[0]):
        # "sort the pens into the left box": they all go there.
        return placed("put", objects, frame.places)
    if not frame.places:
        return [Command("sort", objects)]
    place = frame.places[0]
    if len(frame.places) == 1 and isinstance(place, Relation) and place.kind in ("in", "to"):
        return [Command("sort", objects, place)]
    if len(frame.places) == 1 and isinstance(place, Table):
        return [Command("sort", objects)]
    return []


def _one_container(place: Place) -> bool:
    return (
        isinstance(place, Relation)
        and place.kind == "in"
        and len(place.refs) == 1
        and not (place.refs[0].plural or place.refs[0].determiner == "all")
    )


def tidy(frame: Frame) -> list[Command]:
    """As in "clear the table", "empty the tray", "tidy up the blocks"."""
    if len(frame.objects) > 1 or not frame.only("particle", "table"):
        return []
    if frame.places:
        inside = all(
            isinstance(place, Relation) and place.kind in ("in", "to", "on") and place.refs for place in frame.places
        )
        return placed("put", frame.objects[0], frame.places) if inside and frame.objects else []
    if frame.objects:
        return [Command("tidy", frame.objects[0])] if frame.particle in (None, "up", "away", "off", "out") else []
    return [Command("tidy", (Ref(text="everything", determiner="all", plural=True),))]


def discard(frame: Frame) -> list[Command]:
    """As in "throw the can away": into the waste bin, if one is called so."""
    objects = frame.objects or (((IT,),) if frame.particle else ())
    commands = tidy(replace(frame, objects=objects)) if objects else []
    return [replace(c, place=Relation("discard")) if c.verb == "tidy" else c for c in commands]


def load(frame: Frame) -> list[Command]:
    """As in "load the tray with the blocks": the container is named first."""
    if len(frame.objects) != 1 or len(frame.objects[0]) != 1 or frame.places or not frame.only("material", "particle"):
        return []
    if "material" not in frame.rest or frame.particle not in (None, "up"):
        return []
    return [Command("put", frame.one("material"), Relation("in", frame.objects[0]))]


def line_up(frame: Frame) -> list[Command]:
    """As in "line up the cubes"."""
    if (
        not frame.only("particle")
        or frame.places
        or len(frame.objects) != 1
        or frame.particle not in (None, "up", *TOGETHER)
    ):
        return []
    return [Command("line_up", frame.objects[0])]


def unstack(frame: Frame) -> list[Command]:
    """As in "take the tower apart"."""
    if (
        not frame.only("particle")
        or frame.places
        or len(frame.objects) != 1
        or frame.particle not in (None, "apart", "down")
    ):
        return []
    return [Command("unstack", frame.objects[0])]
