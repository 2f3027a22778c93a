"""Antecedents of pronouns beside a condition: "if there is a ball, tap it", "put the key in it if it is open"."""

from __future__ import annotations

from dataclasses import replace as changed

from robosandbox.agent.language.intent import Ref, Relation, replace
from robosandbox.agent.language.logic import Alike, Condition, If, Is, Not, Steps, There, mapped, stripped

THING = Ref(text="something", determiner="a", nouns=("thing",))
THERE = Relation("there")


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
        # "if it is not near the bin, put it there": near it, and not in it.
        inside = told.so.relations and told.so.relations[0].kind in ("in", "on")
        there = around[0][0] if inside and len(around) == 1 and len(around[0]) == 1 else None
    if it and what is not None:
        objects = (what, *objects[1:])
    elif objects and objects[0].text == "one" and isinstance(told, There):
        # "while there are cans on the table, put one in the bin"
        kind = replace(told.what, text=told.what.text, determiner="a", plural=False, number=None, relations=())
        objects = (kind, *objects[1:])
    if isinstance(place, Relation) and len(place.refs) == 1 and place.refs[0].determiner == "it" and there:
        if it and what == there:
            return ()
        on = isinstance(told, Is) and place.refs[0].text == "there" and told.so.relations[0].kind == "on"
        place = replace(place, refs=(there,), kind="on" if on else place.kind)
    return (replace(first, objects=objects, place=place), *body[1:])


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


def about(condition: Condition, done: Steps) -> Condition | None:
    """Return a condition that follows steps with "it", "there" and "they" as what the last of them is about; None if open."""
    last = done[-1]
    place = last.place if isinstance(last.place, Relation) else None
    named = last.objects[0] if len(last.objects) == 1 else None
    inner, _ = stripped(condition)
    if isinstance(inner, Is) and inner.subject.determiner == "it":
        if any(relation == THERE for relation in inner.so.relations):
            if place is None or not place.refs or named is None:
                return None
            so = replace(inner.so, relations=(place._replace(directional=False),))
            return _again(condition, changed(inner, subject=named, so=so))
        if named is not None and not inner.subject.plural and (named.plural or named.determiner == "all"):
            # "tap every cube unless it is red": of each by itself, or of all?
            return None
        if place is None and last.place is None and named is not None and named.determiner != "it":
            return _again(condition, changed(inner, subject=named))
        among = (*last.objects, *(place.refs if place else ()))
        # "put the can in the tray if it is there" is open, "... if it is empty" is about the tray.
        return _again(condition, changed(inner, among=among)) if among else None
    if isinstance(inner, Is) and named and last.place is None and named != inner.subject:
        return mapped(condition, lambda ref: named if ref.determiner == "it" else ref)
    if isinstance(inner, Alike):
        things = (*last.objects, *(place.refs if place else ()))
        own = all(ref.determiner == "it" for ref in inner.things)
        return _again(condition, changed(inner, things=things)) if own else condition
    if isinstance(inner, There) and inner.what.determiner == "it":
        return _again(condition, changed(inner, what=replace(named, number=None))) if named else None
    if isinstance(inner, There):
        kinds = {
            relation.kind
            for relation in inner.what.relations
            if relation.refs[:1] and relation.refs[0].determiner == "it"
        }
        if kinds:
            there = place.refs[0] if place and len(place.refs) == 1 and {place.kind} == kinds else None
            there = named if last.place is None else there
            if there is None or there.determiner == "it":
                return None
            return mapped(condition, lambda ref: there if ref.determiner == "it" else ref)
    return condition


def _again(condition: Condition, inner: Condition) -> Condition:
    return Not(_again(condition.of, inner)) if isinstance(condition, Not) else inner
