"""Frames of the verbs that move one thing: from their elements to a command, or to nothing where they do not go together."""

from __future__ import annotations

from robosandbox.agent.language import lazy_regex
from robosandbox.agent.language.composing import discard, unstack
from robosandbox.agent.language.frame import ASIDE, DOWN, MUTUAL, TOGETHER, UP, Frame
from robosandbox.agent.language.intent import (
    IT,
    At,
    Command,
    Offset,
    Original,
    Ref,
    Region,
    Relation,
    Table,
    replace,
)
from robosandbox.agent.language.whereabouts import Axis
from robosandbox.agent.language.whereto import placed
from robosandbox.types import SIDE_AXES

_AIMED = lazy_regex.compile(
    r" (to|towards?) (the|your) (left|right|far|near|back|front)( hand)?( (edge|side|end)( of the table)?)?$"
)


def pick(frame: Frame) -> list[Command]:
    """As in "pick up the can", "take the can from the tray"."""
    if frame.particle in ("apart", "down"):
        return unstack(frame)
    if frame.particle == "away" and len(frame.places) == 1 and frame.only("particle"):
        # "take it away from the tower"; away from nowhere is no picking up.
        return pick(replace(frame, rest={}))
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


def put(frame: Frame) -> list[Command]:
    """As in "put the can in the bin", "set it down", "move it 5 cm to the left", "put them together"."""
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
        return (
            [Command("put", objects, frame.one("matching"))]
            if not places and frame.only("matching", "particle")
            else []
        )
    if not frame.only("particle", "direction", "distance", *(("person",) if places else ())):
        return []
    direction = frame.one("direction")
    if direction == "back" and particle in DOWN and not frame.places:
        return [Command("release", objects)]
    if direction == "back" and "distance" not in frame.rest:
        direction = None
        places = places or [Original()]
    if direction:
        if places or (particle and particle not in ("over", "down")) or (sources and "distance" not in frame.rest):
            # "put it left from the mug" is beside the mug.
            return []
        # "bring it 5 cm nearer" is rather a push.
        return [Command("put", objects, Offset(direction, frame.one("distance")), bare=0.6)]
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
        if particle in MUTUAL and particle != "up" and frame.objects:
            return [Command("stack", objects)]
        return []
    if particle not in (None, "down", "over", "up", "back down", "away", "off", "around", "out", "back up"):
        return []
    if particle == "over":
        places = [replace(p, order="over") if isinstance(p, Relation) and p.kind == "to" else p for p in places]
    return placed("put", objects, places)


def move(frame: Frame) -> list[Command]:
    """As in "move the can to the bin", which carries, and "move the can to the left", which pushes."""
    person = "person" in frame.rest
    if person or len(frame.objects) > 1:
        return []
    pushed = push(frame)
    if aside(frame):
        return aside(frame)
    if frame.places or "matching" in frame.rest:
        carried = put(frame)
        if carried:
            return carried
    return pushed if "direction" in frame.rest or frame.places else []


def aside(frame: Frame) -> list[Command]:
    """As in "move the can aside", "shove it out of the way"."""
    if frame.only("particle") and frame.particle in ASIDE and not frame.places and len(frame.objects) == 1:
        return [Command("aside", frame.objects[0])]
    return []


def throw(frame: Frame) -> list[Command]:
    """As in "chuck it in the bin", which means to put it there; throwing it to the left is another thing."""
    if frame.only("particle") and frame.particle in ("out", "away") and not frame.places:
        all_of_it = any(ref.determiner == "all" and not ref.nouns for refs in frame.objects for ref in refs)
        return [] if all_of_it else discard(frame)
    return [c for c in put(frame) if isinstance(c.place, Relation) and c.place.kind in ("in", "on", "to")]


def relocate(frame: Frame) -> list[Command]:
    """As in "move the ball out of the tray": to anywhere else."""
    if not frame.places or not all(isinstance(place, Relation) and place.kind == "from" for place in frame.places):
        return []
    return [Command("put", command.objects, Table()) for command in pick(frame)]


def push(frame: Frame) -> list[Command]:
    """As in "push the can 5 cm to the left", "push it towards the bin"."""
    if len(frame.objects) > 1 or not frame.only("direction", "distance", "particle", "times"):
        return []
    objects = frame.objects[0] if frame.objects else (IT,)
    if any(_AIMED.search(ref.text) for ref in objects):
        # "push the can to the left and the ball to the right edge": ways to go, which tell no things apart.
        return []
    distance = frame.one("distance")
    direction = frame.one("direction")
    times = frame.one("times") or 1
    if distance is not None and distance < 0 and isinstance(direction, Axis):
        # "-5 cm along x"
        distance, direction = -distance, _OPPOSITE[str(direction)]
    if frame.particle == "out" and not direction and frame.objects:
        return []
    if frame.particle not in (None, "over", "away", "out", "along", "around"):
        return []
    if frame.places:
        place = frame.places[0]
        alone = len(frame.places) == 1 and not (direction or distance or frame.particle) and times == 1
        # "over the edge" is off the table.
        aimed = isinstance(place, At) or (isinstance(place, Region) and (place.name != "edge" or len(place.sides) == 1))
        if alone and (aimed or (isinstance(place, Relation) and place.kind in _SLID_TO)):
            # "push it to the left edge", "slide it to the left of the bowl"
            return [Command("push", objects, place)]
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


# Relations that tell a place on the table to which a thing is slid.
_SLID_TO = frozenset({*SIDE_AXES, "beside", "between"})
_OPPOSITE = {"left": "right", "right": "left", "forward": "back", "back": "forward"}


def release(frame: Frame) -> list[Command]:
    """As in "let go", "put it down"."""
    if not frame.only("particle") or frame.places or len(frame.objects) > 1:
        return []
    if frame.particle not in (None, "down", "off"):
        return []
    return [Command("release", frame.objects[0] if frame.objects else (IT,))]


def go(frame: Frame) -> list[Command]:
    """As in "go back to the home position"."""
    if "home" not in frame.rest or frame.objects or frame.places or not frame.only("home", "direction", "particle"):
        return []
    goes = frame.one("direction") in (None, "back") and frame.particle in (None, "up", "over")
    return [Command("home")] if goes else []


def pull(frame: Frame) -> list[Command]:
    """As in "pull the drawer open", "push it shut"."""
    if frame.particle in ("open", "out") and frame.only("particle") and not frame.places and frame.objects:
        return [Command("open", frame.objects[0])]
    if frame.particle in ("shut", "closed") and frame.only("particle") and not frame.places and frame.objects:
        return [Command("close", frame.objects[0])]
    return []
