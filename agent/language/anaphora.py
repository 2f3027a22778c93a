"""Pronouns where the order of words is not the order of actions, or beside a condition."""

from __future__ import annotations

from robosandbox.agent.language.intent import IT, Command, Ref, Relation, replace
from robosandbox.agent.language.logic import If, Is, stripped, substituted
from robosandbox.agent.language.phrases import single
from robosandbox.agent.language.readings import Part


def still_about(command: Command, rest: tuple[Part, ...]) -> tuple[Part, ...]:
    """As in "if the can is red, tap it. If it is green, ...": "it" in the second condition is what the first is told of."""
    condition = stripped(command.control.condition)[0] if isinstance(command.control, If) else None
    after = rest[0] if isinstance(rest[0], Command) and isinstance(rest[0].control, If) else None
    told = stripped(after.control.condition)[0] if after is not None and isinstance(after.control, If) else None
    own = isinstance(condition, Is) and condition.subject.determiner != "it"
    if after is None or not own or not (isinstance(told, Is) and told.subject.determiner == "it"):
        return rest
    assert isinstance(condition, Is)
    return (*substituted((after,), condition.subject), *rest[1:])


def in_it(parts: tuple[Part, ...], named: tuple[Part, ...], *, alone: bool) -> tuple[Part, ...]:
    """As in "close the drawer, but first put the tape in it": what is done first speaks of what was named last.

    Returns nothing where "them" would be one thing; `alone` where no command stands before.
    """
    first, last = parts[0] if parts else None, named[0] if named else None
    if not (isinstance(first, Command) and isinstance(last, Command) and len(last.objects) == 1):
        return parts
    place, there = first.place, last.place
    inside = isinstance(place, Relation) and place.kind == "in" and place.refs == (IT,)
    if inside and isinstance(there, Relation) and there.kind == "in" and there.refs not in ((), (IT,)):
        # "put the can in the bin, but first put the cup in there"
        first = replace(first, place=there)
    elif isinstance(place, Relation) and place.refs == (IT,) and last.objects[0].determiner != "it":
        first = replace(first, place=replace(place, refs=last.objects))
    elif first.objects and any(relation.refs == (IT,) for relation in first.objects[0].relations):
        # "put the book in the box, but first take the case off it"
        what = first.objects[0]
        told = tuple(replace(r, refs=last.objects) if r.refs == (IT,) else r for r in what.relations)
        first = replace(first, objects=(replace(what, relations=told), *first.objects[1:]))
    elif first.objects and _several(first.objects[0]) and single(last.objects[0]):
        # "put the cup next to the can, but first tap both": the cup and the can.
        both = "both" in first.objects[0].text.split()
        refs = last.place.refs if alone and isinstance(last.place, Relation) else ()
        which = len(refs) == 1 and single(refs[0]) and (both or (isinstance(there, Relation) and there.kind != "in"))
        return (replace(first, objects=(*last.objects, *refs)), *parts[1:]) if which else ()
    elif first.objects and first.objects[0].determiner == "it":
        into = last.place.refs if isinstance(last.place, Relation) and last.place.kind == "in" else ()
        opened = first.verb in ("open", "close") and into and into != (IT,)
        first = replace(first, objects=(*(into if opened else last.objects), *first.objects[1:]))
    return (first, *parts[1:])


def _several(ref: Ref) -> bool:
    """Say whether a description is a pronoun for several things: "them", "both of them", "both"."""
    both = ref.text.startswith("both") and not (ref.nouns or ref.names or ref.colours or ref.ranks)
    return both or (ref.determiner == "it" and ref.plural)


def inside_it(second: Command, first: Command) -> Command:
    """As in "close the drawer once the apple is inside", "put the can in the bin after you put the cup in there"."""
    into, there = second.place, first.place
    if not (isinstance(into, Relation) and into.refs == (IT,)):
        return second
    if isinstance(there, Relation) and there.kind == into.kind and there.refs not in ((), (IT,)):
        return replace(second, place=there)
    named = first.objects and first.objects[0].determiner != "it"
    return replace(second, place=replace(into, refs=first.objects)) if named else second


def named_first(first: Command, second: Command) -> tuple[Command, Command]:
    """As in "before you put the brick in the crate, tap it": what is done first is named last."""
    there, into = first.place, second.place
    if isinstance(there, Relation) and there.refs == (IT,):
        # "before you put the brick in the crate, put the ball in there"; "before closing the drawer, put the ball in it"
        refs = into.refs if isinstance(into, Relation) else second.objects if second.verb in ("open", "close") else ()
        first = replace(first, place=replace(there, refs=refs)) if refs not in ((), (IT,)) else first
    named = second.objects[0] if second.objects and second.objects[0].determiner != "it" else None
    if named and first.objects and len(second.objects) == 1 and single(named):
        # "before you pick up the block, put what is on it in the bin"
        first = replace(first, objects=tuple(_about(ref, named) for ref in first.objects))
    if first.objects and first.objects[0].determiner == "it" and named:
        return replace(first, objects=second.objects), replace(second, objects=(first.objects[0],))
    return first, second


def _about(ref: Ref, named: Ref) -> Ref:
    """Return a description with "it" in it standing for a thing: "what is on it" of the block."""
    where = tuple(replace(part, refs=(named,)) if part.refs == (IT,) else part for part in ref.relations)
    return ref if where == ref.relations else replace(ref, relations=where)
