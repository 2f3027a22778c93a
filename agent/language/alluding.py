"""What "it", "there" and "one" mean beside a condition: what the condition speaks of, or what is done where it holds."""

from __future__ import annotations

from robosandbox.agent.language.conditions import THING
from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.agent.language.logic import Condition, If, Is, Steps, There, stripped, substituted
from robosandbox.agent.language.readings import Part


def told_of(body: Steps, condition: Condition) -> Steps:
    """Return steps after a condition with "it" and "there" as what the condition speaks of; nothing where that is not there."""
    told, denied = stripped(condition)
    first = body[0]
    if first.control or not isinstance(told, (There, Is)):
        return body
    it = bool(first.objects) and first.objects[0].determiner == "it"
    objects, place, what, there = first.objects, first.place, None, None
    if isinstance(told, There):
        ref = told.what
        anchors = [relation.refs for relation in ref.relations]
        anchor = anchors[0][0] if len(anchors) == 1 and len(anchors[0]) == 1 else None
        thing, none = ref.nouns == THING.nouns and not ref.colours, denied != told.bound.none
        single = not (thing or none or ref.plural or told.bound.loose)
        what = replace(ref, determiner="the") if single else anchor if thing and none else None
        there = anchor if thing or none else None
        if it and none and what is None:
            return ()
    elif it:
        what = told.subject
        # "if the can is not in the tray, put it there"
        around = [relation.refs for relation in told.so.relations]
        there = around[0][0] if len(around) == 1 and len(around[0]) == 1 else None
    if it and what is not None:
        objects = (what, *objects[1:])
    elif objects and objects[0].text == "one" and isinstance(told, There):
        # "while there are cans on the table, put one in the bin"
        kind = replace(told.what, text=told.what.text, determiner="a", plural=False, number=None, relations=())
        objects = (kind, *objects[1:])
    if isinstance(place, Relation) and len(place.refs) == 1 and place.refs[0].determiner == "it" and there:
        if it and what == there:
            return ()
        place = replace(place, refs=(there,))
    return (replace(first, objects=objects, place=place), *body[1:])


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


def echoed(other: Steps, form: If) -> Steps:
    """Return an alternative in which "it" and "one" are what they mean where the condition holds; nothing where that is open."""
    first, model = other[0], form.then[0]
    if first.control or model.control:
        return other
    condition, _ = stripped(form.condition)
    about = condition.subject if isinstance(condition, Is) else None
    named, place, there = model.objects or ((about,) if about else ()), first.place, model.place
    if any(ref.other for ref in first.objects):
        return ()
    if first.objects and first.objects[0].determiner == "it":
        plural = len(named) > 1 or any(ref.plural for ref in named)
        if not named or (named[0].determiner == "it" and about is None):
            return ()
        if first.objects[0].plural != plural or len(first.objects) > 1:
            return ()
        if about is not None and about != named[0] and first.verb != model.verb and named[0].determiner != "it":
            # "if the drawer is open, put the key in it, otherwise open it"
            if first.verb not in ("open", "close"):
                return ()
            named = (about,)
        elif named[0].determiner == "it" and about is not None:
            named = (about,)
        first = replace(first, objects=named)
    else:
        like = named[0] if len(named) == 1 else None
        objects = tuple(
            replace(ref, nouns=like.nouns, names=like.names, one=False)
            if ref.one and not (ref.nouns or ref.names) and like is not None
            else ref
            for ref in first.objects
        )
        first = replace(first, objects=objects)
    if isinstance(place, Relation) and any(ref.determiner == "it" for ref in place.refs):
        anchor = about or _looked_at(condition)
        told = there.refs if isinstance(there, Relation) and len(there.refs) == 1 else ()
        told = told if told and told[0].determiner != "it" else (anchor,) if anchor else ()
        if len(place.refs) > 1 or not told or told == first.objects:
            return ()
        first = replace(first, place=replace(place, refs=told))
    return (first, *other[1:])


def _looked_at(condition: Condition) -> Ref | None:
    """Return the one thing that a condition says is on or in something: that something."""
    relations = condition.what.relations if isinstance(condition, There) else ()
    refs = [ref for relation in relations for ref in relation.refs]
    return refs[0] if len(refs) == 1 else None
