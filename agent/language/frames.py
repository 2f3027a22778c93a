"""From a verb and its elements to a command, or to nothing where they do not go together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from robosandbox.agent.language.carrying import aside, go, move, pick, pull, push, put, release, relocate, throw
from robosandbox.agent.language.clauses import Element
from robosandbox.agent.language.composing import build, discard, line_up, load, sort, stack, swap, tidy, unstack
from robosandbox.agent.language.frame import ATTACHED, Frame, chosen_by, excepted, in_sequence, joined
from robosandbox.agent.language.intent import IT, Command, Region, Relation, Verb
from robosandbox.agent.language.turns import taking_turns

_OUTMOST = frozenset({"furthest", "farthest", "closest", "nearest", "further", "farther", "closer", "nearer"})


def frame_command(verb: str, elements: Sequence[Element]) -> list[Command]:
    """Return the commands that a verb makes of its elements, the likeliest first."""
    builder = _FRAMES.get(verb)
    if builder is None:
        return []
    if not ATTACHED.isdisjoint([kind for kind, _ in elements]):
        elements = chosen_by(excepted(joined(elements)))
        # A tower has an order of its own.
        elements = elements if verb in ("stack", "build") else in_sequence(elements)
        turns = [value for kind, value in elements if kind == "turns"]
        if turns:
            kinds = [kind for kind, _ in elements]
            told = len(turns) == 1 and verb not in ("stack", "build") and "objects" in kinds[: kinds.index("turns")]
            others = [element for element in elements if element.kind != "turns"]
            return taking_turns(frame_command(verb, others), turns[0]) if told else []
    if _side_of_rank(elements):
        return []
    frame = Frame.of(elements)
    if len(frame.objects) > 2 or len(frame.places) > 3:
        return []
    return builder(frame)


def _side_of_rank(elements: Sequence[Element]) -> bool:
    """Say whether a way to go, or a part of the table, only says which: "the tin that is furthest to the left"."""
    return any(
        one.kind == "objects"
        and one.value
        and one.value[-1].text.rpartition(" ")[2] in _OUTMOST
        and (other.kind == "direction" or (other.kind == "place" and isinstance(other.value, Region)))
        for one, other in pairwise(elements)
    )


def _pour(frame: Frame) -> list[Command]:
    if (
        not frame.only("contents", "particle")
        or len(frame.objects) > 1
        or frame.particle not in (None, "out", "over", "away", "off")
    ):
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
    def made(frame: Frame) -> list[Command]:
        if frame.places or len(frame.objects) != 1 or not frame.only("particle", "times"):
            return []
        if frame.particle is not None and frame.particle not in particles:
            return []
        return [Command(verb, frame.objects[0], times=frame.one("times") or 1)]

    return made


_FRAMES: dict[str, Callable[[Frame], list[Command]]] = {
    "pick": pick,
    "put": put,
    "move": move,
    "relocate": relocate,
    "throw": throw,
    "push": lambda frame: pull(frame) or push(frame) or aside(frame),
    "release": release,
    "stack": stack,
    "build": build,
    "pour": _pour,
    "open": _simple("open", "up", "out"),
    "close": _simple("close", "up"),
    "tap": _simple("tap"),
    "swap": swap,
    "sort": sort,
    "line_up": line_up,
    "unstack": unstack,
    "tidy": tidy,
    # Without an object it would be everything, which nobody means by it.
    "discard": lambda frame: discard(frame) if frame.objects else [],
    # "clean the table" tidies; "clean the brushes" asks for water.
    "clean": lambda frame: tidy(frame) if "table" in frame.rest or frame.places else [],
    "load": load,
    "empty": _simple("tidy", "out", "off"),
    "go": go,
}
