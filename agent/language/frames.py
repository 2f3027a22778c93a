"""From a verb and its elements to a command, or to nothing where they do not go together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from robosandbox.agent.language.clauses import IT, Element
from robosandbox.agent.language.frame import ASIDE, DOWN, MUTUAL, TOGETHER, UP, Frame, excepted
from robosandbox.agent.language.intent import (
    At,
    Command,
    Matching,
    Offset,
    Original,
    Place,
    Ref,
    Region,
    Relation,
    Table,
    Verb,
)


def frame_command(verb: str, elements: Sequence[Element]) -> list[Command]:
    """Return the commands that a verb makes of its elements, the likeliest first."""
    elements = excepted(elements)
    frame = Frame.of(elements)
    builder = _FRAMES.get(verb)
    if builder is None or len(frame.objects) > 2 or len(frame.places) > 3:
        return []
    return builder(frame)


def _pick(frame: Frame) -> list[Command]:
    if frame.particle == "apart":
        return _unstack(frame)
    if (
        not frame.only("particle", "person")
        or len(frame.objects) > 1
        or not (frame.particle is None or frame.particle in UP)
    ):
        return []
    objects = frame.objects[0] if frame.objects else (IT,)
    if not frame.objects and frame.particle is None:
        return []
    if not frame.places:
        return [Command("pick", objects)]
    place = frame.places[0]
    if len(frame.places) > 1 or not isinstance(place, Relation):
        return []
    if place.kind == "from" and place.distance is None:
        return [Command("pick", _located(objects, place))]
    return []


def _located(objects: tuple[Ref, ...], place: Relation) -> tuple[Ref, ...]:
    return tuple(replace(ref, relations=(*ref.relations, place)) for ref in objects)


def _put(frame: Frame) -> list[Command]:
    if len(frame.objects) > 1:
        return []
    objects = frame.objects[0] if frame.objects else (IT,)
    particle = frame.particle
    places = [place for place in frame.places if not (isinstance(place, Relation) and place.kind == "from")]
    sources = [place for place in frame.places if isinstance(place, Relation) and place.kind == "from"]
    if sources:
        if len(sources) > 1 or sources[0].distance is not None:
            return []
        objects = _located(objects, sources[0])
    if "floor" in frame.rest:
        return []
    if "matching" in frame.rest:
        return [Command("put", objects, Matching())] if not places and frame.only("matching", "particle") else []
    if not frame.only("particle", "direction", "distance"):
        return []
    direction = frame.one("direction")
    if direction == "back" and particle in DOWN and not frame.places:
        return [Command("release", objects)]
    if direction == "back" and "distance" not in frame.rest:
        direction = None
        places = places or [Original()]
    if direction:
        if places or (particle and particle not in ("over", "down")):
            return []
        return [Command("put", objects, Offset(direction, frame.one("distance")))]
    if "distance" in frame.rest:
        return []
    if not places:
        if particle in DOWN and not frame.places:
            return [Command("release", objects)]
        if particle in ASIDE:
            return [Command("aside", objects)]
        if particle == "away":
            return [Command("tidy", objects)]
        if particle in TOGETHER:
            return [Command("line_up", objects, None)]
        if particle in MUTUAL and frame.objects:
            return [Command("stack", objects)]
        return []
    if particle not in (None, "down", "over", "up", "back down", "away", "off", "around", "round", "out", "back up"):
        return []
    return _placed("put", objects, places)


def _placed(verb: Verb, objects: tuple[Ref, ...], places: Sequence[Place]) -> list[Command]:
    """A destination, or a chain of them: "red on green on blue"."""
    first, *chain = places
    if isinstance(first, Relation):
        if first.kind in ("held", "towards", "away", "against", "from"):
            return []
        if first.kind == "beside" and len(chain) == 1 and isinstance(chain[0], Relation) and chain[0].refs == (IT,):
            # "next to the ball, on its left"
            return [Command(verb, objects, replace(chain[0], refs=first.refs))]
        supports: list[Ref] = []
        for support in chain:
            if not isinstance(support, Relation) or support.kind != "on" or not support.refs or first.kind != "on":
                return []
            supports += support.refs
        return [Command(verb, objects, first, tuple(supports))]
    if chain:
        # "in the corner on the left", "on the table next to the bin": the second says it closer.
        if isinstance(first, Table) and len(chain) == 1 and isinstance(chain[0], Relation | At | Region):
            return _placed(verb, objects, chain)
        return []
    return [Command(verb, objects, first)]


def _move(frame: Frame) -> list[Command]:
    person = "person" in frame.rest
    if person or len(frame.objects) > 1:
        return []
    objects = frame.objects[0] if frame.objects else (IT,)
    pushed = _push(frame)
    if frame.only("particle") and frame.particle in ASIDE and not frame.places and frame.objects:
        return [Command("aside", objects)]
    if frame.places or "matching" in frame.rest:
        put = _put(frame)
        if put:
            return put
    return pushed if "direction" in frame.rest or frame.places else []


def _throw(frame: Frame) -> list[Command]:
    """As in "chuck it in the bin", which means to put it there; throwing it to the left is another thing."""
    return [c for c in _put(frame) if isinstance(c.place, Relation) and c.place.kind in ("in", "on", "to")]


def _relocate(frame: Frame) -> list[Command]:
    """As in "move the ball out of the tray": to anywhere else."""
    if not frame.places or not all(isinstance(place, Relation) and place.kind == "from" for place in frame.places):
        return []
    return [Command("put", command.objects, Table()) for command in _pick(frame)]


def _push(frame: Frame) -> list[Command]:
    if len(frame.objects) > 1 or not frame.only("direction", "distance", "particle", "times"):
        return []
    objects = frame.objects[0] if frame.objects else (IT,)
    distance = frame.one("distance")
    direction = frame.one("direction")
    times = frame.one("times") or 1
    if frame.particle == "out" and not direction and frame.objects:
        return []
    if frame.particle not in (None, "over", "away", "out", "along", "around"):
        return []
    if frame.places:
        place = frame.places[0]
        if len(frame.places) > 1 or not isinstance(place, Relation) or direction:
            return []
        if (
            place.kind in ("towards", "away", "against")
            or (place.kind == "to" and not place.distance)
            or (place.kind == "from" and frame.particle == "away")
        ):
            kind = "away" if place.kind == "from" else "towards" if place.kind == "to" else place.kind
            return [
                Command("push", objects, Relation(kind, place.refs), distance=distance or place.distance, times=times)
            ]
        return []
    if frame.particle == "over" and not direction:
        return []
    if frame.particle == "away":
        direction = direction or "forward"
    return (
        [Command("push", objects, direction=direction, distance=distance, times=times)]
        if frame.objects or direction
        else []
    )


def _release(frame: Frame) -> list[Command]:
    if not frame.only("particle") or frame.places or len(frame.objects) > 1:
        return []
    if frame.particle not in (None, "down", "off"):
        return []
    return [Command("release", frame.objects[0] if frame.objects else (IT,))]


def _stack(frame: Frame) -> list[Command]:
    if len(frame.objects) > 1 or set(frame.rest) - {"particle", "order", "order_end", "direction"}:
        return []
    if frame.particle and frame.particle not in MUTUAL:
        return []
    objects = frame.objects[0] if frame.objects else (IT,)
    order = _order(frame, objects)
    if "direction" in frame.rest:
        return []
    if not frame.places:
        return [Command("stack", objects, None, (), order)] if frame.objects else []
    found: list[Command] = []
    for command in _placed("stack", objects, frame.places):
        kind = command.place.kind if isinstance(command.place, Relation) else ""
        if kind == "in" and order is None:
            # "pile them in the bin" builds no tower.
            found.append(replace(command, verb="put"))
        elif kind == "on" or (isinstance(command.place, Table) and order is None):
            found.append(replace(command, order=order))
    return found


def _order(frame: Frame, objects: tuple[Ref, ...]) -> Any:
    return frame.one("order") or tuple(frame.rest.get("order_end", ())) or None


def _build(frame: Frame) -> list[Command]:
    """As in "a tower of the red, green and blue cubes", "a tower with blue at the bottom, then green"."""
    tower = frame.objects[0][0].nouns[:1] if frame.objects else ()
    if len(frame.objects) == 1 and len(frame.objects[0]) == 1 and tower and not frame.rest and not frame.places:
        return [Command("stack")]
    if not tower or tower[0] not in ("tower", "stack", "pile", "column", "heap") or len(frame.objects[0]) != 1:
        return []
    ends = [end for end in frame.rest.get("order_end", ())]
    lists = [*frame.objects[1:], *frame.rest.get("material", ())]
    where = frame.places[0] if len(frame.places) == 1 else None
    tower_ref = frame.objects[0][0]
    plain = not (tower_ref.relations or tower_ref.ranks or tower_ref.without)
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
    whole = len(middle) == 1 and (middle[0].plural or middle[0].determiner == "all")
    listed_at = [k for k, kind in enumerate(frame.kinds) if kind in ("objects", "material")][1:]
    if whole or (listed_at and frame.kinds.index("order_end") > listed_at[0]):
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


def _pour(frame: Frame) -> list[Command]:
    if not frame.only("contents", "particle") or len(frame.objects) > 1 or frame.particle not in (None, "out", "over"):
        return []
    into = [p for p in frame.places if isinstance(p, Relation) and p.kind in ("in", "on", "to") and p.refs]
    sources = [p for p in frame.places if isinstance(p, Relation) and p.kind == "from" and p.refs]
    if len(into) != 1 or len(into) + len(sources) != len(frame.places) or len(sources) > 1:
        return []
    if sources and frame.objects:
        return []
    objects = sources[0].refs if sources else frame.objects[0] if frame.objects else (IT,)
    return [Command("pour", objects, into[0])]


def _simple(verb: Verb, *particles: str) -> Callable[[Frame], list[Command]]:
    def build(frame: Frame) -> list[Command]:
        if frame.places or len(frame.objects) != 1 or not frame.only("particle", "times"):
            return []
        if frame.particle is not None and frame.particle not in particles:
            return []
        return [Command(verb, frame.objects[0], times=frame.one("times") or 1)]

    return build


def _pull(frame: Frame) -> list[Command]:
    """As in "pull the drawer open", "push it shut"."""
    if frame.particle in ("open", "out") and frame.only("particle") and not frame.places and frame.objects:
        return [Command("open", frame.objects[0])]
    if frame.particle in ("shut", "closed") and frame.only("particle") and not frame.places and frame.objects:
        return [Command("close", frame.objects[0])]
    return []


def _swap(frame: Frame) -> list[Command]:
    if not frame.only("particle", "material") or frame.particle not in (
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
    if "material" in frame.rest:
        return (
            [Command("swap", (*frame.objects[0], *frame.one("material")))]
            if len(frame.objects) == 1 and not frame.places
            else []
        )
    if len(frame.objects) == 1 and not frame.places:
        return [Command("swap", frame.objects[0])]
    if len(frame.objects) == 2 and not frame.places:
        return [Command("swap", (*frame.objects[0], *frame.objects[1]))]
    return []


def _sort(frame: Frame) -> list[Command]:
    if len(frame.objects) > 1 or not frame.only("colour", "matching"):
        return []
    everything = Ref(text="everything", determiner="all", plural=True)
    objects = frame.objects[0] if frame.objects else (everything,)
    if "matching" in frame.rest:
        return [Command("put", objects, Matching())] if not frame.places else []
    if "colour" not in frame.rest and not (frame.objects and len(frame.places) < 2):
        return []
    if "colour" not in frame.rest and len(frame.places) == 1 and _one_container(frame.places[0]):
        # "sort the pens into the left box": they all go there.
        return _placed("put", objects, frame.places)
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


def _tidy(frame: Frame) -> list[Command]:
    """As in "clear the table", "empty the tray", "tidy up the blocks"."""
    if len(frame.objects) > 1 or not frame.only("particle", "table"):
        return []
    if frame.places:
        inside = all(isinstance(place, Relation) and place.kind in ("in", "to") for place in frame.places)
        return _placed("put", frame.objects[0], frame.places) if inside and frame.objects else []
    if frame.objects:
        return [Command("tidy", frame.objects[0])] if frame.particle in (None, "up", "away", "off", "out") else []
    return [Command("tidy", (Ref(text="everything", determiner="all", plural=True),))]


def _load(frame: Frame) -> list[Command]:
    """As in "load the tray with the blocks": the container is named first."""
    if len(frame.objects) != 1 or len(frame.objects[0]) != 1 or frame.places or not frame.only("material", "particle"):
        return []
    if "material" not in frame.rest or frame.particle not in (None, "up"):
        return []
    return [Command("put", frame.one("material"), Relation("in", frame.objects[0]))]


def _line_up(frame: Frame) -> list[Command]:
    if (
        not frame.only("particle")
        or frame.places
        or len(frame.objects) != 1
        or frame.particle not in (None, "up", *TOGETHER)
    ):
        return []
    return [Command("line_up", frame.objects[0])]


def _unstack(frame: Frame) -> list[Command]:
    if (
        not frame.only("particle")
        or frame.places
        or len(frame.objects) != 1
        or frame.particle not in (None, "apart", "down")
    ):
        return []
    return [Command("unstack", frame.objects[0])]


def _go(frame: Frame) -> list[Command]:
    if "home" not in frame.rest or frame.objects or frame.places or not frame.only("home", "direction", "particle"):
        return []
    goes = frame.one("direction") in (None, "back") and frame.particle in (None, "up", "over")
    return [Command("home")] if goes else []


_FRAMES: dict[str, Callable[[Frame], list[Command]]] = {
    "pick": _pick,
    "put": _put,
    "move": _move,
    "relocate": _relocate,
    "throw": _throw,
    "push": lambda frame: _pull(frame) or _push(frame),
    "release": _release,
    "stack": _stack,
    "build": _build,
    "pour": _pour,
    "open": _simple("open", "up", "out"),
    "close": _simple("close", "up"),
    "tap": _simple("tap"),
    "swap": _swap,
    "sort": _sort,
    "line_up": _line_up,
    "unstack": _unstack,
    "tidy": _tidy,
    # Without an object it would be everything, which nobody means by it.
    "discard": lambda frame: _tidy(frame) if frame.objects else [],
    "load": _load,
    "empty": _simple("tidy", "out", "off"),
    "go": _go,
}
