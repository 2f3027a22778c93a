"""Place phrases, alone or as a chain: "the cube near the left edge, next to the ball" may locate or be a target."""

from __future__ import annotations

import re

from robosandbox.agent.language.discourse import RefusedError
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.types import RefusalCode

_BY_SIDE = re.compile(
    r" (?:on|at|in|to|near|by|along|close to|next to) (?:the |its )?(?:(?:very|far|near) )*"
    r"(?P<side>left|right|back|rear|far|front|near)(?:[- ]?hand)?(?:most)?"
    r"(?P<part> side| edge| corner| border| end| half| part)?(?: of the \w+)?$"
)
_BESIDE = frozenset({"beside", "left", "right", "front", "back"})
_AT_THE_EDGE = 0.15  # Metres from the middle from which a thing is at the edge. Chosen.
_FAR = frozenset({"back", "rear", "far"})


def check_where_told(command: Command, ground: Grounder) -> None:
    """Refuse a reading in which words that tell where something goes would only tell where one thing stands.

    As in "put the cube near the left edge, next to the ball": the only cube is told by the edge if it is there, and is to
    go there if it is not.

    Args:
        command: What is to be put somewhere.
        ground: Finds what is described.

    Raises:
        RefusedError: A thing that is the only one of its kind is not where it is said to be.
    """
    if command.place is None or command.verb not in ("put", "stack", "push"):
        return
    told = command.place.refs if isinstance(command.place, Relation) else ()
    for ref in (*command.objects, *told):
        if ref.determiner in ("the", "bare") and not (ref.plural or ref.unknown or ref.other):
            _check(ref, ground)


def _check(ref: Ref, ground: Grounder) -> None:
    by_side = _BY_SIDE.search(f" {ref.text}") if ref.ranks else None
    beside = [relation for relation in ref.relations if relation.kind in _BESIDE and len(relation.refs) == 1]
    # "the ball which is near the tin" tells which in any case.
    if not (by_side or beside) or not (ref.nouns or ref.names) or " is " in ref.text:
        return
    rest = tuple(relation for relation in ref.relations if relation not in beside)
    plain = replace(ref, relations=rest, ranks=ref.ranks[:-1] if by_side else ref.ranks)
    names = ground.fitting(plain)
    if len(names) != 1:
        return
    name = names[0]
    clear = not by_side or _is_there(name, by_side["side"], bool(by_side["part"]), ground)
    for relation in beside:
        anchors = ground.fitting(relation.refs[0])
        if relation.kind == "beside":
            clear = clear and ground.side_by_side(name, anchors)
        else:
            clear = clear and ground.plainly_beside(name, relation.kind, anchors)
    if not clear:
        raise RefusedError(
            RefusalCode.OBJECT_NOT_FOUND,
            f"I see {name}, but not “{ref.text}”; say where it is to go in one way.",
            (name,),
        )


def _is_there(name: str, side: str, edge: bool, ground: Grounder) -> bool:
    world = ground.world
    x, y = world.at[name]
    if side in ("left", "right"):
        return (y if side == "left" else -y) > (_AT_THE_EDGE if edge else 0.0)
    depths = sorted(at[0] for other, at in world.at.items() if world.movable(other))
    middle = depths[len(depths) // 2]
    return x >= middle if side in _FAR else x <= middle
