"""The logical forms that fields fill, and what a sentence leaves unsaid: verbs, nouns of a list."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from robosandbox.agent.language.antecedents import THING, about, echoed, told_of
from robosandbox.agent.language.binding import UNSAID, refs_of, with_nouns, with_verbs
from robosandbox.agent.language.intent import (
    IT,
    At,
    ByRobot,
    Command,
    Matching,
    Offset,
    Original,
    Rank,
    Ref,
    Region,
    Relation,
    Sentence,
    Spot,
    Table,
    replace,
    unseen,
)
from robosandbox.agent.language.logic import (
    Alike,
    Bound,
    Condition,
    ForEach,
    If,
    Is,
    More,
    Not,
    Question,
    Reply,
    Several,
    There,
    UntilLeft,
    While,
)
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.measures import Length, Measure
from robosandbox.agent.language.ruleset import COSTS
from robosandbox.agent.language.skill_words import Vague, ways_of
from robosandbox.skills.words import Words

_SIDES = ("left", "right", "front", "back")


class Filled(NamedTuple):
    """One field of a form; `more` adds to it."""

    field: str
    value: Any
    more: bool


class Misfit(Exception):
    """A form cannot have these fields, so that this is no way to read the words."""


def gathered(fields: Sequence[Filled]) -> dict[str, Any]:
    """Return the value of each field."""
    values: dict[str, Any] = {}
    for name, value, more in fields:
        if name == "dropped":
            # What is passed over has to be known all the same.
            if isinstance(value, Ref) and value.unknown:
                raise Misfit
            continue
        if more:
            values[name] = (*values.get(name, ()), *(value if type(value) is tuple else (value,)))
        elif values.setdefault(name, value) != value:
            raise Misfit
    return values


def formed(form: str, fields: Sequence[Filled], text: str) -> tuple[Any, float]:
    """Return a logical form, and what it costs besides."""
    try:
        made = FORMS[form](gathered(fields), text)
    except (KeyError, TypeError) as error:
        raise Misfit from error
    return (made[0], made[1]) if type(made) is Costly else (made, 0.0)


_TOPS = frozenset({"on top", "on the top", "onto the top", "at the top", "atop"})


class Costly(tuple):  # type: ignore[type-arg]
    """A form, and what it costs."""


def _thing(values: dict[str, Any], text: str) -> Any:
    nth, key = values.pop("nth", None), values.pop("key", "")
    closest, closest_to = values.pop("closest", ""), values.pop("closest_to", None)
    if closest:
        values["ranks"] = (*values.get("ranks", ()), Rank(closest, anchor=closest_to))
    if "stem" in values:
        values["names"] = (*values.get("names", ()), *values.pop("stem"))
    if key and values.get("ranks"):
        # "the cubes from the left to the right"
        raise Misfit
    if any(ref.nouns != values.get("nouns", ()) or ref.colours for ref in values.pop("such_as", ())):
        # "the sponge, any bolt"
        raise Misfit
    if nth is None and key and not values.get("plural"):
        raise Misfit
    if nth is not None or key:
        values["ranks"] = (*values.get("ranks", ()), Rank(key, 0 if nth is None else int(nth)))
    _count(values)
    _leave_out(values)
    # "the red cube which is red"
    values["colours"] = tuple(dict.fromkeys(values.get("colours", ())))
    if len(values["colours"]) > 1 and not values.pop("either", False):
        raise Misfit
    values.pop("either", None)
    if (
        text in ("a little", "one", "ones")
        and values.get("determiner") in ("a", "bare")
        and "number" not in values
        and not values.pop("counted", False)
    ):
        raise Misfit
    values.pop("counted", None)
    _correct(values)
    if len({ref.plural or ref.determiner == "all" for ref in values.get("options", ())}) > 1:
        # "everything pink or coffee"
        raise Misfit
    made = Ref(**{"text": text or "it", **values})
    if made.plural and made.number is None and any(rank.strict and rank.nth == 1 for rank in made.ranks):
        return Costly((made, 0.6))
    if not made.without:
        return made
    return replace(
        made,
        without=tuple(
            replace(_of_kind(ref, made), text=f"but {ref.text}" if not text.startswith("all but") else ref.text)
            for ref in made.without
        ),
    )


def _count(values: dict[str, Any]) -> None:
    """As in "three cubes": a whole number, one of which is a thing."""
    if values.get("number") is not None:
        if int(values["number"]) != values["number"] or values["number"] < 1:
            raise Misfit
        values["number"] = int(values["number"])
        if values["number"] == 1:
            values["plural"] = False
            values["determiner"] = "a" if values.get("determiner") == "bare" else values.get("determiner", "the")


def _leave_out(values: dict[str, Any]) -> None:
    """As in "the cubes but not the red one": what is left out of several, or named in place of what was."""
    one_bare = values.get("determiner") == "bare" and values.get("nouns") and not values.get("plural")
    if values.get("without") and (
        one_bare or not (values.get("plural") or values.get("determiner") in ("all", "a", "bare"))
    ):
        raise Misfit
    if any(
        ref.determiner == "it" or (ref.determiner == "all" and not (ref.nouns or ref.colours or ref.names))
        for ref in values.get("instead", ())
    ):
        raise Misfit
    if any(_is_any(ref) for ref in values.get("without", ())):
        raise Misfit
    if any(ref.text in ("that one", "this one", "the one") for ref in values.get("instead", ())):
        # "the ball, but not that one"
        raise Misfit
    values["without"] = (*values.get("without", ()), *values.pop("less", ()))
    if any(map(_is_unknown, (*values["without"], *values.get("instead", ())))):
        raise Misfit
    ranked = [rank for ref in (*values["without"], *values.get("instead", ())) for rank in ref.ranks]
    ranked += values.get("ranks", ()) if values["without"] else ()
    if any(rank.key in ("top", "bottom") for rank in ranked):
        raise Misfit
    whole = (ref for ref in values["without"] if ref.determiner == "all" and not ref.relations)
    if any(not (ref.nouns or ref.colours or ref.names) for ref in whole):
        raise Misfit


def _correct(values: dict[str, Any]) -> None:
    """As in "the ball, not the red one": what is meant is told by what is not."""
    if any(ref.unknown for ref in values.get("instead", ())) or any(ref.instead for ref in values.get("options", ())):
        raise Misfit
    said = (values.get("nouns", ()), values.get("names", ()))
    of_kind = [ref for ref in values.get("instead", ()) if (ref.nouns, ref.names) == said]
    if any(not (ref.colours or ref.ranks or ref.relations) for ref in of_kind):
        # "the ball, not the ball"
        raise Misfit
    own = of_kind or any(ref.one for ref in values.get("instead", ()))
    if values.get("instead") and (values.get("determiner") in ("a", "all") or (values.get("plural") and own)):
        # "a bowl but not the blue one" leaves out that.
        raise Misfit


def _list(values: dict[str, Any], text: str) -> Any:
    items = tuple(values["item"])
    if any(ref.instead and (len(items) > 2 or not ref.text.endswith(",")) for ref in items[:-1]):
        # "the can, but not the ball and the cube": neither of the two?
        raise Misfit
    # "everything but the can and the ball" leaves out both.
    return Costly((items, 0.7)) if any(ref.without for ref in items[:-1]) else items


def _spread(values: dict[str, Any], text: str) -> tuple[Ref, ...]:
    """As in "the red and blue cubes": each adjective with what they share."""
    each = values.pop("each")
    if "up_to" in values:
        (one,) = each
        first, last = int(one.names[0]), int(values.pop("up_to").names[0])
        if first >= last:
            raise Misfit
        each = [replace(one, names=(str(k),), text=str(k)) for k in range(first, last + 1)]
    if values.get("plural") and values.get("number") in (len(each), None) and values.get("number"):
        values["number"] = None
    base = _thing(values, text)
    base = base[0] if type(base) is Costly else base
    return tuple(
        replace(
            base,
            plural=base.plural and not any(rank.strict and rank.nth == 1 for rank in one.ranks),
            text=f"{one.text} {' '.join(base.nouns)}",
            **{n: getattr(one, n) for n in ("colours", "ranks", "shades", "names") if getattr(one, n)},
        )
        for one in each
    )


def _measure(values: dict[str, Any], text: str) -> Measure:
    return Measure(values.get("dimension", ""), float(values["metres"]))


def _product(values: dict[str, Any], text: str) -> float:
    return float(round(math.prod(values["of"]), 12))


def _length(values: dict[str, Any], text: str) -> Length:
    return Length(math.prod(values["of"]) * values["unit"], values["unit"])


def _among(ref: Ref, whole: Ref) -> Ref:
    """As in "of the two red things, put the fruit in the bin": the red fruit."""
    told = ref.nouns or ref.names
    if not told or (ref.nouns, ref.names) == (whole.nouns, whole.names):
        return ref
    if whole.ranks or whole.relations or whole.names or (whole.colours and ref.colours):
        raise Misfit
    return replace(ref, colours=ref.colours or whole.colours)


def _of_kind(ref: Ref, whole: Ref) -> Ref:
    """As in "the cubes, all but the red one": a cube."""
    if ref.one and not ref.nouns and not ref.names and (whole.nouns or whole.names):
        return replace(ref, nouns=whole.nouns, names=whole.names, one=False)
    return ref


def _command(values: dict[str, Any], text: str) -> Any:
    values.pop("denied", None)
    way = values.pop("way", None)
    if way is not None:
        return _for_skill(values, ways_of(values["skill"])[way])
    if {ref.nouns for ref in values.pop("such_as", ())} - {ref.nouns for ref in values.get("objects", ())}:
        raise Misfit
    values["times"] = int(values.get("times", 1))
    if values.get("order") == ():
        values.pop("order")
    _count_levels(values)
    _tell_ends(values)
    _choose_objects(values)
    _go_further(values)
    _spare(values)
    if getattr(values.get("place"), "kind", "") == "discard" and any(
        ref.determiner == "all" and not (ref.nouns or ref.relations) for ref in values.get("objects", ())
    ):
        raise Misfit
    keys = {rank.key for ref in values.get("objects", ()) for rank in ref.ranks}
    if values.get("order") in ("up", "down") and keys & {"top", "bottom", "middle"}:
        # "a tower: the red cube at the bottom, the blue one in the middle": places in it and none of the table.
        raise Misfit
    return _checked(Command(**{"verb": UNSAID, **values}))


def _count_levels(values: dict[str, Any]) -> None:
    """As in "a tower three high": so many things have to be meant."""
    high = values.pop("high", None)
    if high is not None:
        number = sum(
            (ref.number or 0) if ref.plural or ref.determiner == "all" else 1 for ref in values.get("objects", ())
        )
        if (number and number != high) or (not number and values.get("objects")):
            raise Misfit


def _tell_ends(values: dict[str, Any]) -> None:
    """As in "the biggest at the bottom": of which things that is one."""
    if values.get("verb") == "stack" and values.get("order") in ("up", "down"):
        ends = with_nouns(tuple(reversed(values.get("objects", ()))))[::-1]
        if len(ends) == 2 and all(len(ref.ranks) == 1 and ref.ranks[0].strict for ref in ends) and ends[0].nouns:
            # "the biggest cube at the bottom, the smallest on top": all cubes, and the others between them.
            every = Ref(text=ends[0].text, determiner="all", nouns=ends[0].nouns, plural=True)
            levels = ("bottom", "top") if values["order"] == "up" else ("top", "bottom")
            values["objects"], values["order"] = (every,), tuple(zip(levels, ends, strict=True))
    if isinstance(values.get("order"), tuple) and len(values.get("objects", ())) > 1:
        # "a, b and c, the biggest at the bottom": the biggest of those.
        these = with_nouns(values["objects"])
        values["order"] = tuple(
            (
                level,
                replace(ref, options=these, one=False)
                if ref.one and ref.ranks and not (ref.colours or ref.names or ref.nouns)
                else ref,
            )
            for level, ref in values["order"]
        )


def _choose_objects(values: dict[str, Any]) -> None:
    """As in "of the cups, the taller one": which of several things are meant."""
    part = values.pop("part", ())
    if part:
        # "put the cans in the box, but only the tall one", "put two of the cans in the box: the tall one and the red one"
        whole = values["objects"][0] if len(values.get("objects", ())) == 1 else None
        if whole is None or not _is_several(whole) or any(ref.plural for ref in part):
            raise Misfit
        if len(part) > 1 and whole.number != len(part):
            raise Misfit
        kind = replace(whole, determiner="a", number=None, total=None, plural=False)
        values["objects"] = tuple(replace(_of_kind(ref, kind), told_to_be=(kind,)) for ref in part)
    chosen = values.pop("whichever", ())
    if chosen:
        if len(values.get("objects", ())) != 1 or not values["objects"][0].options:
            raise Misfit
        values["objects"] = (replace(values["objects"][0], ranks=chosen),)
    among = values.pop("among", ())
    if among:
        # "of the ball and the cup, pick up the taller one"
        one = values["objects"][0] if len(values.get("objects", ())) == 1 else None
        if one is None or not (one.one and one.ranks) or one.colours or one.nouns or one.names:
            raise Misfit
        values["objects"] = (replace(one, options=among, one=False),)
    of = values.pop("of", None)
    if of is not None:
        if (
            any(map(_is_it, values.get("objects", ())))
            or not of.plural
            or of.determiner == "all"
            or (
                of.number
                and (
                    of.number < len(values["objects"])
                    or (values.get("verb") == "stack" and of.number != len(values["objects"]))
                )
            )
        ):
            raise Misfit
        values["objects"] = tuple(_among(_of_kind(ref, of), of) for ref in values["objects"])
    turn = values.pop("turn", "")
    if turn:
        whole = values.get("objects", ())
        if len(whole) != 1 or not (whole[0].plural or whole[0].determiner == "all") or whole[0].ranks:
            raise Misfit
        values["objects"] = (replace(whole[0], ranks=(Rank(turn, 0),)),)


def _go_further(values: dict[str, Any]) -> None:
    """As in "to the left, by 5 cm": a length that is said behind its way."""
    further = values.pop("further", None)
    if further is None:
        return
    if values.get("distance") is not None:
        raise Misfit
    place = values.get("place")
    if isinstance(place, Offset) and place.distance is None:
        values["place"] = Offset(place.direction, further)
    elif isinstance(place, Relation) and place.kind in ("left", "right", "front", "back") and place.distance is None:
        values["place"] = place._replace(distance=further)
    elif values.get("direction") or (isinstance(place, Relation) and place.kind in ("towards", "away")):
        values["distance"] = further
    else:
        raise Misfit


def _spare(values: dict[str, Any]) -> None:
    """As in "put the cans in the bin, without the red one"."""
    without = values.pop("without", ())
    if any(ref.determiner == "it" or _is_unknown(ref) for ref in without):
        raise Misfit
    if without:
        whole = values.get("objects", ())
        if any(rank.key in ("top", "bottom") for ref in without for rank in ref.ranks) or any(
            ref.determiner == "all" and not (ref.nouns or ref.colours or ref.names) for ref in without
        ):
            raise Misfit
        if len(whole) != 1 or not (whole[0].plural or whole[0].determiner == "all") or whole[0].without:
            raise Misfit
        values["objects"] = (
            replace(
                whole[0], without=tuple(replace(_of_kind(ref, whole[0]), text=f"but {ref.text}") for ref in without)
            ),
        )


def _checked(made: Command) -> Command:
    """Return a command that one thing alone may mean."""
    to_it = getattr(made.place, "kind", "") == "to" and [ref.text for ref in refs_of(made.place)] == ["it"]
    if any(_may_be(gone, each) for ref in refs_of(made.place) for gone in ref.instead for each in made.objects):
        # "put the can and the ball in the bin, but not the ball"
        raise Misfit
    if (made.direction or getattr(made.place, "kind", "") in _SIDES) and any(
        ref.text.endswith((" left", " right")) for ref in made.objects[:-1]
    ):
        # "push the can on the left and the ball to the right"
        raise Misfit
    if (to_it and any(ref.text == "it" for ref in made.objects)) or _is_beyond_its_end(made):
        raise Misfit
    if (
        made.verb in ("put", "push", "tap", "pick", "pour", "open", "close", "swap", "aside", "unstack")
        and not made.objects
    ):
        raise Misfit
    return made


def _for_skill(values: dict[str, Any], words: Words) -> Any:
    """As in "raise the hand by 5 cm": what a skill says for itself; a verb that asks for nothing beside is plainer as its own."""
    things = [argument for argument, value in values.get("slots", ()) if isinstance(value, Ref) and not _is_it(value)]
    if len(things) > len(set(things)):
        # "go above the red one, above the blue one": two steps.
        raise Misfit
    for is_vague in (False, True):
        said = {
            each
            for each in values.get("slots", ())
            if isinstance(each[1], float) and isinstance(each[1], Vague) is is_vague
        }
        if len(said) > len({argument for argument, _ in said}):
            # "down 4 cm, up 4 cm", "up a little, down a little"
            raise Misfit
    told = {argument for argument, _ in values.get("slots", ())}
    enough = told.issuperset(words.needed) and (not words.required or not told.isdisjoint(words.required))
    if (values.pop("alone", False) or "verb" not in values) and not enough:
        raise Misfit
    made = Command(**{"verb": "", **values, "words": words})
    placed = any(ref.relations or ref.ranks for ref in made.objects)
    if not enough:
        # A rule says what it costs to say nothing beside the verb.
        return Costly((made, COSTS[1] if words.pace else COSTS[2])) if told or made.terms else made
    return made if words.required or placed else Costly((made, -COSTS[1] - 0.1))


def _is_beyond_its_end(command: Command) -> bool:
    """Say whether a description may go on into the place: "push the can closest | to you", "take the ball | to the left"."""
    last = command.objects[-1] if command.objects else None
    if last is None:
        return False
    ranks = [rank.key for rank in last.ranks if rank.anchor is None]
    words, place = last.text.split(), command.place
    to = isinstance(place, Relation) and place.kind == "to" and not any(map(_is_it, place.refs))
    told = to or command.direction in ("forward", "back")
    nearest = told and {"near", "far"} & {*ranks} and words[-1] not in (*last.nouns, *last.names, "one", "ones")
    sideways = (
        command.verb == "pick"
        and last.text.endswith((" to the left", " to the right"))
        and not words[-4].endswith(("st", "one"))
    )
    return bool(nearest) or sideways


def _left_out(ref: Ref, spared: Sequence[Ref]) -> Ref:
    return replace(ref, without=(*ref.without, *(_of_kind(each, ref) for each in spared)))


def _is_any(ref: Ref) -> bool:
    """Say whether a description leaves open which thing is meant: "one"."""
    told = ref.nouns or ref.names or ref.colours or ref.ranks or ref.relations or ref.plural or ref.other
    return ref.determiner == "a" and ref.one and not told


def _commas(values: dict[str, Any], text: str) -> tuple[Ref, ...]:
    """As in "the can, the ball"; "tag 14, the bigger one" says one thing twice."""
    items: tuple[Ref, ...] = values["item"]
    if any((ref.one and not ref.nouns) or ref.text.endswith(" one") for ref in items[1:]):
        raise Misfit
    return items


def _is_open_after(step: Command, before: Command, text: str) -> bool:
    """Say whether it is open what a step means beside the one before it."""
    place = step.place
    on_it = isinstance(place, Relation) and place.kind == "on" and any(map(_is_it, place.refs))
    several = any(ref.plural and ref.determiner != "all" for ref in before.objects)
    # "only the can in the bin and the ball"
    only = "only" in text.split() and step.bare and (step.verb, place) == (before.verb, before.place)
    # "get the crayons, put it on the box"
    lifted = several and before.verb == "pick" and step.verb == "put" and step.objects[:1] == (IT,)
    # "put the red cube, the box in the middle, the lid on top": a tower?
    middle = len(before.objects) > 1 and isinstance(before.place, Region) and before.place.name == "middle"
    # "stack the cubes on the box, red on top"
    piled = (
        step.bare and before.verb == "stack" and before.place is not None and any(map(_is_several, before.objects[:1]))
    )
    return bool(only or lifted or (on_it and (middle or piled)))


def _check_step(step: Command, before: Command | None, text: str) -> None:
    """Raise where it is open what a step means, first in its sentence or behind the one before it."""
    place = step.place
    if before is not None and step.control and step.bare:
        raise Misfit
    if step.distance is not None and not (step.direction or step.place or step.verb == "push"):
        # "pick up the apple and another 2 cm"
        raise Misfit
    if before is not None and isinstance(before.control, ForEach | While) and any(map(_is_it, step.objects)):
        raise Misfit
    if before is None and any(map(_is_any, step.objects)):
        # "put one in the bin": of what?
        raise Misfit
    if before is not None and _is_open_after(step, before, text):
        raise Misfit
    piled = before is not None and before.verb == "stack" and before.place is None
    if piled and ((step.verb == "stack" and step.order) or (step.bare and isinstance(step.place, Region))):
        # "stack the cubes, red at the bottom, then blue": of one tower, or of two?
        raise Misfit
    counted = (ref for ref in (*step.objects, *refs_of(place)) if ref.one and [rank.key for rank in ref.ranks] == [""])
    if before is not None and len(before.objects) > 1 and any(counted):
        # "tap the can and the ball and put the first one in the bin": the first that was named?
        raise Misfit
    named = bool(step.objects) and step.objects[0].determiner != "it"
    if (
        before is None
        and named
        and (
            isinstance(place, Original)
            or (isinstance(place, Relation) and any(ref.text == "there" for ref in place.refs))
        )
    ):
        # "put the cup back", "put the cube there": where?
        raise Misfit
    if before is None and isinstance(place, Offset) and place.direction == "back" and place.distance is None:
        raise Misfit
    if (
        before is not None
        and step.verb == "push"
        and step.bare
        and isinstance(before.place, Relation)
        and before.place.kind in _SIDES
    ):
        # "put the red cube left of the bowl and the blue one to the right": of the bowl.
        raise Misfit


def _sparing(steps: tuple[Command, ...], spared: Sequence[Ref]) -> tuple[Command, ...]:
    """As in "put all the fruit in the bowl, don't touch the lemon": all but that."""
    if not spared:
        return steps
    whole = [
        step
        for step in steps
        if len(step.objects) == 1 and (step.objects[0].plural or step.objects[0].determiner == "all")
    ]
    if len(whole) != len(steps) or any(ref.determiner == "it" or ref.determiner == "all" for ref in spared):
        raise Misfit
    return tuple(replace(step, objects=(_left_out(step.objects[0], spared),)) for step in steps)


def _where_aside(steps: Sequence[Command]) -> list[Command]:
    """As in "get it out of the way, put it behind the mug": that is where it goes."""
    told: list[Command] = []
    for step in steps:
        if (
            told
            and told[-1].verb in ("aside", "unstack")
            and step.verb == "put"
            and not isinstance(step.place, Original)
            and [ref.determiner for ref in step.objects] == ["it"]
        ):
            step = replace(step, objects=told.pop().objects)
        told.append(step)
    return told


def _sentence(values: dict[str, Any], text: str) -> Any:
    steps = with_verbs(values.get("steps", ()))
    if steps is None:
        raise Misfit
    if "begins" in values and steps and steps[0].bare and not {".", ";", ":"} & {*text.split()}:
        # "do not tap the can, then the ball"
        raise Misfit
    for before, step in zip((None, *steps), steps, strict=False):
        _check_step(step, before, text)
    if any(_is_any(ref) for ref in values.get("avoid", ())):
        # "..., but leave one": which?
        raise Misfit
    told = _where_aside(_sparing(steps, values.get("spared", ())))
    # What a loop or a condition is followed by is more likely part of it.
    further = any(step.control for step in told[:-1])
    # "the ball lives in the crate, put it back": there, rather than back from there.
    pairs = pairwise(told)
    back = any(isinstance(b.place, Original) and b.objects[:1] == (IT,) and a.verb == "put" for a, b in pairs)
    # "the peg furthest from you: tap it": what "it" is was said there rather than in a sentence before.
    spoken_of = bool(told) and bool(told[0].spoken or values.get("avoid"))
    unsaid = bool(told) and any(map(_is_it, told[0].objects)) and not spoken_of
    return Costly(
        (
            Sentence(
                tuple(told),
                tuple(values.get("avoid", ())),
                anew=bool(values.get("anew")),
                asides=tuple(values.get("asides", ())),
                terms=tuple(dict.fromkeys((*values.get("terms", ()), *(t for step in told for t in step.terms)))),
            ),
            COSTS[2] * (further or back) + COSTS[2] * unsaid,
        )
    )


def _steps(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    steps = (*values.get("first", ()), *values.get("then", ()), *values.get("last", ()))
    told = with_verbs(steps) if steps and steps[0].verb != UNSAID else steps
    if told is None:
        raise Misfit
    return told


def _reversed(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    """As in "put the blocks in the tray, but first tap them": told in another order than done; "them" was named before."""
    last, first = values["last"], values["first"]
    told = with_verbs((*last, *first))
    if told is None:
        raise Misfit
    last, first = told[: len(last)], told[len(last) :]
    there = last[0].place
    first = tuple(
        replace(step, place=there)
        if isinstance(step.place, Relation) and there is not None and [ref.text for ref in step.place.refs] == ["there"]
        else step
        for step in first
    )
    theme = last[0].objects if last[0].objects and len(last[0].objects) == 1 else ()

    def named(ref: Ref) -> Ref:
        if ref.determiner != "it" or ref.relations:
            return ref
        if not theme or theme[0].determiner in ("it", "a") or len(last) > 1:
            raise Misfit
        if ref.plural != (theme[0].plural or theme[0].determiner == "all"):
            raise Misfit
        return theme[0]

    spoken = False

    def done(step: Command) -> Command:
        nonlocal spoken
        place = step.place
        if spoken:
            # "but take the eraser off first and leave it on the mat": that which was named just before.
            return step
        spoken = bool(step.objects) and step.objects[0].determiner != "it"
        told = bool(step.objects) and step.objects[0].determiner != "it"
        if isinstance(place, Relation) and told and theme:
            into = isinstance(there, Relation) and place.kind == there.kind == "in" and len(there.refs) == 1
            # "before you put the can in the bin, put the ball in it"
            refs = (
                there.refs if into and isinstance(there, Relation) and place.refs[0].determiner == "it" else place.refs
            )
            place = place._replace(refs=tuple(map(named, refs)))
        return replace(step, objects=tuple(map(named, step.objects)), place=place)

    done_first = tuple(map(done, first))
    if any(step.objects == last[0].objects and step.place == there is not None for step in done_first):
        # "put a battery in the box, once it is there"
        raise Misfit
    return (*done_first, *last)


def _at(values: dict[str, Any], text: str) -> At:
    return At(float(values["x"]) * values.get("unit", 1), float(values["y"]) * values.get("unit", 1))


def _level(values: dict[str, Any], text: str) -> tuple[tuple[str, Ref], ...]:
    what = values["what"]
    if what.one and not (what.colours or what.ranks or what.names or what.nouns):
        # "not the red one at the bottom"
        raise Misfit
    return ((values["level"], what),)


def _relation(values: dict[str, Any], text: str) -> Relation:
    if values.get("kind") == "on" and text.split(" of ")[0] in _TOPS:
        # On a cupboard, and not in it.
        values["order"] = "top"
    sided = values.get("kind") in (*_SIDES, "beside") and [ref.text for ref in values.get("refs", ())] in (
        ["that"],
        ["this"],
    )
    if sided:
        # "..., and the marble to the left of that": of what was moved, or of what that is beside?
        raise Misfit
    beside = [near for ref in values.get("refs", ()) if not ref.one for near in ref.relations]
    if any(near.kind in (*_SIDES, "beside") and any(map(_is_it, near.refs)) for near in beside):
        # "next to the mug, to the left of it": not a mug to the left of something.
        raise Misfit
    if any(
        ref.one and ref.text.split()[-1] in _SIDES and [rank.nth for rank in ref.ranks] == [1]
        for ref in values.get("refs", ())
    ):
        # "on the far left" is a place of the table.
        raise Misfit
    distance = values.pop("distance", None)
    if distance is not None and values.get("kind") in ("in", "on", "between", "under", "beside"):
        raise Misfit
    if "other" in values:
        # "closer to the bin than the ball"
        values["refs"] = (values.pop("other"), *([values.pop("anchor")] if "anchor" in values else []))
    return Relation(**values, distance=None if distance is None else float(distance))


def _rank(values: dict[str, Any], text: str) -> Rank:
    return Rank(values.pop("key", ""), int(values.pop("nth", 1)), **values)


def _amended(values: dict[str, Any], text: str) -> Any:
    """As in "put the red cube in the bin, no, the blue one": the better words take the place of what is most like them."""
    told = values["step"]
    steps: tuple[Command, ...] = told if type(told) is tuple else (told,)
    for fix in values["fix"]:
        made = amended(steps[-1], dict(fix))
        if made is None or made == steps[-1]:
            raise Misfit
        steps = (*steps[:-1], made)
    return steps


def _replaced(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    """As in "tap the ball, no, push it to the left": what was told first is not done, and told what "it" is."""
    told = values["old"]
    old: Command = told[-1] if type(told) is tuple else told
    step: Command = values["step"]
    if old.control or step.control or not step.objects:
        raise Misfit
    if isinstance(step.place, Relation) and any(map(_is_it, step.place.refs)):
        # "put the muffin on the plate, no, put the bun there": where that would have gone.
        if not isinstance(old.place, Relation) or [ref.text for ref in step.place.refs] != ["there"]:
            raise Misfit
        step = replace(step, place=old.place)
    if step.objects[0].determiner == "it":
        alone = len(old.objects) == len(step.objects) == 1
        if not alone or _is_several(old.objects[0]) != step.objects[0].plural:
            raise Misfit
        step = replace(step, objects=old.objects)
    elif not values.get("cancelled") and step.verb != old.verb:
        # "tap the can. Wait, put the ball in the bin": in its stead, or as well?
        raise Misfit
    elif len(old.objects) == len(step.objects) == 1:
        step = replace(step, objects=(_filled_in(step.objects[0], old.objects[0]),))
    return (*(told[:-1] if type(told) is tuple else ()), step)


def _corrected(values: dict[str, Any], text: str) -> tuple[Ref, ...]:
    """As in "the red cube, no, the blue one": a cube."""
    old, new = values["old"], values["new"]
    if len(old) > 2 and any(_may_be(new[0], ref) for ref in old):
        # "the can, the cup and the ball, no, the can, in the box": it alone, or in place of the ball?
        raise Misfit
    return _set_right(old, new)


def _set_right(old: Sequence[Ref], new: Sequence[Ref]) -> tuple[Ref, ...]:
    """Return what some things are where better words take the place of the last of them.

    Of "all but the can, no, the ball" they take the place of the can; of "the can and the ball, no, the ball" the ball alone is meant.
    """
    *others, last = old
    if any(ref.unknown for ref in old) or any(map(_is_open, new)) or (not others and _untold(new) == _untold(old)):
        raise Misfit
    again = [ref for ref in old if len(new) == 1 and _may_be(new[0], ref)]
    if others:
        if len(again) > 1:
            raise Misfit
        kept = () if again else tuple(ref for ref in others if not any(_may_be(each, ref) for each in new))
        return (*kept, *(_filled_in(each, (*again, last)[0]) for each in new))
    whole = replace(last, without=())
    if last.without and not any(ref.determiner == "all" for ref in new):
        (exception, *more) = last.without
        if more:
            raise Misfit
        if len(new) == 1 and _may_be(new[0], exception):
            return tuple(new)
        told = (_of_kind(_filled_in(ref, exception), whole) for ref in new)
        return (replace(last, without=tuple(replace(ref, text=f"but {ref.text}") for ref in told)),)
    if len(new) > 1:
        raise Misfit
    if new[0].without and not (new[0].nouns or new[0].names):
        return (replace(whole, text=new[0].text, without=new[0].without),)
    return tuple(_filled_in(ref, last) for ref in new)


def _is_unknown(ref: Ref) -> bool:
    return bool(ref.unknown) or any(map(_is_unknown, (each for relation in ref.relations for each in relation.refs)))


def _untold(refs: Sequence[Ref]) -> list[Ref]:
    return [replace(ref, text="") for ref in refs]


def _is_open(ref: Ref) -> bool:
    """Say whether better words tell too little to stand for others: "all of them", "three", "the one next to it"."""
    whole = ref.determiner == "all" and not (ref.nouns or ref.names or ref.colours or ref.without)
    counted = not (ref.nouns or ref.colours) and bool(ref.names) and all(name.isdigit() for name in ref.names)
    near = any(map(_is_it, (each for relation in ref.relations for each in relation.refs)))
    return _is_any(ref) or _is_it(ref) or whole or counted or near


def _is_several(ref: Ref) -> bool:
    return ref.plural or ref.determiner == "all"


def _is_it(ref: Ref) -> bool:
    return ref.determiner == "it"


def _specified(values: dict[str, Any], text: str) -> Ref:
    """As in "the can, the tall one", "the red cube, the one on the left,": one thing, told in two goes."""
    whole: Ref = values["whole"]
    part: Ref = values["more"] if "more" in values else values["part"]
    if whole.plural or part.plural or whole.determiner not in ("the", "a", "bare") or whole.without or whole.unknown:
        raise Misfit
    if not (whole.nouns or whole.names) or (whole.colours and part.colours):
        raise Misfit
    if "more" in values:
        both = {name: (*getattr(whole, name), *getattr(part, name)) for name in ("colours", "ranks", "relations")}
        return replace(whole, determiner="the", text=text, **both)
    if whole.colours or whole.ranks or whole.relations:
        raise Misfit
    return _of_kind(part, whole)


def _fix(values: dict[str, Any], text: str) -> tuple[tuple[tuple[str, Any], ...], ...]:
    told = values.get("ref")
    if told is not None and any(_is_it(each) for relation in told.relations for each in relation.refs):
        raise Misfit
    return (tuple(values.items()),)


def _reply(values: dict[str, Any], text: str) -> Reply:
    (better,) = values.pop("better", ((),))
    if unseen(better):
        raise Misfit
    if "times" in values and (values["times"] < 1 or int(values["times"]) != values["times"]):
        raise Misfit
    return Reply(better, int(values.get("times", 0)), values.get("cancelled", False))


def amended(step: Command, values: dict[str, Any]) -> Command | None:
    """Return a command with one of its arguments changed; None where it is not said which."""
    if "place" in values and step.place is not None:
        place = values["place"]
        if (
            isinstance(place, Relation)
            and isinstance(step.place, Relation)
            and [ref.determiner for ref in place.refs] == ["it"]
        ):
            place = place._replace(refs=step.place.refs)
        return replace(step, place=place)
    if "direction" in values and step.direction is not None:
        return replace(step, direction=values["direction"], distance=values.get("distance", step.distance))
    if "side" in values:
        if isinstance(step.place, Relation) and step.place.kind in _SIDES:
            return replace(step, place=step.place._replace(kind=values["side"]))
        return replace(step, direction=values["side"]) if step.direction in ("left", "right") else None
    if "times" in values:
        return replace(step, times=int(values["times"]))
    if "distance" in values and step.distance is not None:
        return replace(step, distance=values["distance"])
    if "amount" in values:
        # "push it 5 cm to the left, make that 2"
        told = step.distance
        return (
            replace(step, distance=Length(values["amount"] * told.unit, told.unit))
            if isinstance(told, Length)
            else None
        )
    if "ref" not in values:
        return None
    ref, old = values["ref"], values.get("old")
    place = step.place if isinstance(step.place, Relation) and len(step.place.refs) == 1 else None
    if any(ref.one and not ref.nouns and each.unknown for each in step.objects):
        return None
    of_object = max((-1 if _is_it(each) else likeness(ref, each) for each in step.objects), default=-1)
    of_place = likeness(ref, place.refs[0]) if place else -1
    if place and place.kind in ("in", "to") and _holder(ref) and not any(map(_holder, step.objects)):
        return replace(step, place=place._replace(refs=(_filled_in(ref, place.refs[0]),)))
    if old is not None:
        of_place = int(place is not None and _may_be(old, place.refs[0]))
        of_object = int(len(step.objects) == 1 and _may_be(old, step.objects[0]))
        if of_place == of_object:
            return None
    # Where the words do not tell, what makes sense does: the bag is put in nothing.
    if max(of_place, of_object) < 0 or (of_place == of_object and ref.determiner == "bare"):
        return None
    if place and of_place >= of_object and (values.get("of_place") or old is not None):
        return replace(step, place=place._replace(refs=(_filled_in(ref, place.refs[0]),)))
    told = any(_may_be(ref, each) for each in step.objects)
    if values.get("of_place") or of_place > of_object or (place and len(step.objects) > 1 and not told):
        return None
    return replace(step, objects=_set_right(step.objects, (ref,)))


_HOLDERS = frozenset({"bin", "bowl", "drawer", "plate", "box", "mug"})
# Ends of names of containers whose noun stands for a thing of its own, as "paper_bag".
_HOLDER_ENDS = ("bag", "basket", "crate", "tray", "tub")


def _holder(ref: Ref) -> bool:
    """Say whether a description is one of a container, as its noun or the end of its name says: "the toolbox"."""
    said = (ref.nouns or ref.names)[:1]
    kinds = [noun for noun, kind in NOUN_CLASS.items() if kind in _HOLDERS]
    return bool(said) and (NOUN_CLASS.get(said[0], "") in _HOLDERS or said[0].endswith((*kinds, *_HOLDER_ENDS)))


def likeness(new: Ref, old: Ref) -> int:
    """Return how much a description looks like another: the same noun, else the same kinds of words."""
    if new.nouns and old.nouns:
        holders = [NOUN_CLASS.get(ref.nouns[0], "") in _HOLDERS for ref in (new, old)]
        return 3 if new.nouns == old.nouns else 1 if holders[0] == holders[1] else 0
    if old.nouns and not new.one and new.names and NOUN_CLASS.get(old.nouns[0], "") in _HOLDERS:
        return 0
    if new.one or not (new.nouns or new.names):
        return (
            1
            + (_ordered(new) and _ordered(old))
            + 2
            * (
                bool(new.colours) == bool(old.colours)
                and (bool(new.colours) or _ordered(new))
                and _ordered(new) == _ordered(old)
            )
        )
    return 1 if bool(new.names) == bool(old.names) else 0


def _ordered(ref: Ref) -> bool:
    """Say whether a thing is told by its order or its side: "the left one"."""
    return bool(ref.ranks) or not {*_SIDES}.isdisjoint(ref.names)


def _filled_in(new: Ref, old: Ref) -> Ref:
    return (
        replace(new, one=False, nouns=old.nouns, names=tuple(n for n in old.names if n not in new.names))
        if new.one and not new.nouns and (old.nouns or old.names)
        else new
    )


def _plain(kind: Any, *, said: bool = False) -> Callable[[dict[str, Any], str], Any]:
    return lambda values, text: kind(**{**({"text": text} if said else {}), **values})


def _sorted(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    """As in "sort the cubes: red ones in the red bin, blue ones in the blue bin"."""
    head = values["head"].objects[0] if values["head"].objects else Ref(text="")

    def named(ref: Ref) -> Ref:
        several = head.plural and ref.determiner == "bare"
        return (
            replace(ref, nouns=head.nouns, names=(*ref.names, *head.names), one=False, plural=ref.plural or several)
            if ref.one and not ref.nouns
            else ref
        )

    return tuple(replace(step, objects=tuple(map(named, step.objects))) for step in values["then"])


def _respective(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    """As in "put the lemon, the cube and the mug in the bowl, the tray and the crate respectively"."""
    ways: tuple[Any, ...] = values.get("ways") or tuple(
        Relation(values["kind"], (ref,)) for ref in with_nouns(values["refs"])
    )
    objects = with_nouns(values["objects"])
    if len(ways) != len(objects) or len(ways) < 2 or any(ref.plural for ref in objects):
        raise Misfit
    if "refs" in values:
        return tuple(Command("put", (ref,), way) for ref, way in zip(objects, ways, strict=True))
    return tuple(
        Command("push", (ref,), direction=way, distance=values.get("distance"))
        for ref, way in zip(objects, ways, strict=True)
    )


def _turned(values: dict[str, Any], text: str) -> Command | tuple[Command, ...]:
    """As in "put the blue cube on the red one, no, the other way round"."""
    told = values["step"]
    if type(told) is tuple and len(told) == 2 and all(each.objects and each.place for each in told):
        # "the cube in the bowl, the ball in the box, no, the other way round"
        one, other = told
        return (replace(one, objects=other.objects), replace(other, objects=one.objects))
    step: Command = values["step"]
    place = getattr(step, "place", None)
    if not isinstance(place, Relation) or len(place.refs) != 1 or len(step.objects) != 1 or step.tower:
        raise Misfit
    return replace(step, objects=place.refs, place=place._replace(refs=step.objects))


def _if(values: dict[str, Any], text: str) -> Command:
    then, otherwise = values["then"], values.get("otherwise", ())
    if any(step.verb == UNSAID for step in otherwise):
        told = with_verbs((then[-1], *otherwise))
        if told is None:
            raise Misfit
        otherwise = told[1:]
    condition: Condition | None = values["condition"]
    assert condition is not None
    after, before, apart = values.get("after", False), values.get("before", False), values.get("apart", False)
    if after or before:
        condition = about(condition, otherwise if before else then)
    else:
        then = told_of(then, condition)
    if condition is None or not then:
        raise Misfit
    form = If(condition, then, unless=values.get("unless", False), apart=apart)
    if otherwise and not before:
        otherwise = echoed(otherwise, form)
        if not otherwise:
            raise Misfit
    places = [step.place for step in (then[0], *otherwise[:1]) if isinstance(step.place, Relation)]
    if any([ref.text for ref in place.refs] == ["there"] for place in places):
        # "if the bowl is empty, put it there": where?
        raise Misfit
    # "tap the key, go home if the plum is green, otherwise tap the plum": what is done otherwise in place of what?
    bare = 1.0 if after and otherwise else 0.0
    return Command("control", bare=bare, control=If(condition, then, otherwise, form.unless, apart))


def _there(values: dict[str, Any], text: str) -> There:
    """As in "two balls are in the tray", "the tray has a ball in it"."""
    what, holder, kind = values["what"], values.get("holder"), values.get("kind")
    relations = (*what.relations, *values.get("relations", ()))
    if holder is not None:
        if holder.plural or relations or what.determiner == "it":
            raise Misfit
        relations = (Relation(kind or "in", (holder,)),)
    elif kind == "held":
        relations = (*relations, Relation("held"))
    if what.nouns == THING.nouns and not (what.colours or relations):
        # "if there is nothing": where?
        raise Misfit
    told = text.replace(" not ", " ")
    return There(
        replace(what, relations=relations, colours=(*what.colours, *values.get("colours", ()))), values["bound"], told
    )


def _is(values: dict[str, Any], text: str) -> Is:
    subject = values["subject"]
    if subject.unknown or subject.determiner == "a":
        raise Misfit
    return Is(subject, values["so"], text.replace(" not ", " "))


def _more(values: dict[str, Any], text: str) -> More:
    one, other = with_nouns((values["other"], values["one"]))[::-1]
    return More(one, other, values["sign"], text)


def _may_go_on(body: Sequence[Command]) -> bool:
    """Say whether orders may be given again and again; how often several things at once would be done is open."""
    several = any(ref.plural and ref.determiner != "it" for step in body for ref in step.objects)
    return not several and all(step.verb not in ("push", "swap", "sort", "tidy") for step in body)


def _while(values: dict[str, Any], text: str) -> Command:
    body = told_of(tuple(values["body"]), values["condition"])
    condition = about(values["condition"], body) if body else None
    if condition is None or not _may_go_on(body):
        raise Misfit
    return Command("control", control=While(condition, body))


def _until(values: dict[str, Any], text: str) -> Command:
    body = values["body"]
    if (
        len(body.objects) != 1
        or body.verb != "put"
        or not (body.objects[0].plural or body.objects[0].determiner == "all")
    ):
        raise Misfit
    return Command("control", control=UntilLeft(body, values.get("bound", Bound(1)), values.get("spared"), text))


def _each(values: dict[str, Any], text: str) -> Command:
    body = tuple(values["body"])
    if any(not (step.bare or step.control or any(map(_is_it, (*step.objects, *refs_of(step.place))))) for step in body):
        # "for each can: tap it, then go home": at the end.
        raise Misfit
    return Command("control", control=ForEach(values["what"], body))


def _bound(values: dict[str, Any], text: str) -> Bound:
    if "exactly" in values:
        values["least"] = values["most"] = values.pop("exactly")
    if "over" in values:
        values["least"] = values.pop("over") + 1
    if "under" in values:
        values["most"] = values.pop("under") - 1
    whole: dict[str, Any] = {name: int(v) if type(v) in (int, float) else v for name, v in values.items()}
    return Bound(**whole)


def _topic(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    """As in "the small bottle: pick it up": what is spoken of before it is."""
    first, *rest = values["steps"]
    if values.get("about") and not any(
        ref.determiner == "it" for ref in (*first.objects, *getattr(first.place, "refs", ()))
    ):
        # "the can is fragile, put everything in the bin": is that meant as well?
        raise Misfit
    told = tuple(
        replace(ref, determiner="the" if ref.determiner in ("a", "bare") and not ref.plural else ref.determiner)
        for ref in values["spoken"]
    )
    if len(first.objects) == 1 and first.objects[0].determiner == "it":
        several = len(told) > 1 or any(ref.plural and ref.determiner != "all" for ref in told)
        if several and not first.objects[0].plural:
            # "the rag and the lamp, tap it"
            raise Misfit
        left_out = first.objects[0].without
        if left_out:
            # "the cups, tap them, except the blue one"
            (whole,) = told if len(told) == 1 else (None,)
            if whole is None:
                raise Misfit
            told = (_left_out(whole, left_out),)
        return (replace(first, objects=told), *rest)
    if isinstance(first.place, Relation) and len(told) == 1 and [ref.determiner for ref in first.place.refs] == ["it"]:
        return (replace(first, place=first.place._replace(refs=told)), *rest)
    return (replace(first, spoken=(*told, *first.spoken)), *rest)


def _claimed(values: dict[str, Any], text: str) -> Ref:
    """As in "the ball is in the bin": the ball that is there."""
    subject: Ref = values["subject"]
    so: Ref = values["so"]
    if subject.determiner == "it" or so.nouns or so.names or so.unknown or so.claims:
        raise Misfit
    lists = ("relations", "ranks", "shades", "not_colours", "measures", "without")
    if so.colours and subject.colours and so.colours != subject.colours:
        raise Misfit
    added = {name: (*getattr(subject, name), *getattr(so, name)) for name in lists}
    return replace(subject, text=text, colours=so.colours or subject.colours, **added)


def _contrary(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    """As in "not the red cube, lift the blue one": what is not meant is named, and what is meant as well."""
    steps = with_verbs(values["steps"])
    if steps is None or not steps[0].objects or any(ref.determiner == "it" for ref in steps[0].objects):
        raise Misfit
    # "not the jar of salt, the little one": of what kind it would be is not said.
    kind = replace(values["denied"][0], names=())
    objects = tuple(_of_kind(ref, kind) for ref in steps[0].objects)
    if any(replace(ref, text="") == replace(denied, text="") for ref in objects for denied in values["denied"]):
        raise Misfit
    return (replace(steps[0], objects=objects), *steps[1:])


def _denied(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    """As in "do not put the ball in the box, put it on the plate"."""
    not_so, (first, *rest) = values["denied"], values["steps"]
    not_so = not_so[0] if type(not_so) is tuple else not_so
    other = not_so.verb != first.verb and (
        (first.objects[:1] and first.objects[0].determiner != "it")
        or not_so.verb == "tap"
        or (not_so.verb, first.verb) == ("pick", "put")
    )
    if not not_so.objects or not first.objects or other or first.control or not_so.control:
        raise Misfit
    if all(getattr(first, name) == getattr(not_so, name) for name in ("verb", "objects", "place", "direction")):
        # "no touch the brick, tap the brick"
        raise Misfit
    if [ref.text for ref in refs_of(first.place)] == ["there"] and not_so.place is not None:
        first = replace(first, place=not_so.place)
    spoken = () if first.objects[0].determiner != "it" else not_so.objects[:1]
    if spoken and first.verb == not_so.verb and first.place == not_so.place and first.direction == not_so.direction:
        raise Misfit
    objects = tuple(not_so.objects) if spoken else first.objects
    if not spoken and first.place is None and not_so.place is not None:
        raise Misfit
    step = replace(first, objects=objects)
    if spoken or not_so.verb != first.verb or any(ref.one for ref in not_so.objects):
        return (step, *rest)
    # "do not tap the mugs, tap the red mug": a plan that does it all the same is refused.
    return (step, *rest, replace(not_so, verb="nothing", negated=not_so.verb))


def _split(values: dict[str, Any], text: str) -> tuple[Command, ...]:
    """As in "the red mug left, the black one right of the sponge"."""
    near, verb = values["refs"], values.get("verb", "put")
    if not {*values["kind"]} <= {*_SIDES}:
        # "the salt behind the lemon in the bowl"
        raise Misfit
    pairs = zip(values["item"], values["kind"], strict=True)
    return tuple(Command(verb, (item,), Relation(kind, near)) for item, kind in pairs)


def _may_be(ref: Ref, told: Ref) -> bool:
    """Say whether a description is a shorter one for what was named."""
    said = {*ref.nouns, *ref.names, *ref.colours, *(rank.key for rank in ref.ranks)}
    return bool(said) and said <= {*told.nouns, *told.names, *told.colours, *(rank.key for rank in told.ranks)}


def _in_turn(steps: tuple[Command, ...], turn: tuple[Ref, ...]) -> tuple[Command, ...]:
    """As in "put the cubes in the box, red first, then blue, then the rest"."""
    whole = steps[0].objects[0] if len(steps) == 1 and len(steps[0].objects) == 1 else None
    if (
        whole is None
        or steps[0].verb == "stack"
        or any(ref.nouns and ref.nouns != whole.nouns for ref in turn)
        or not (whole.plural or whole.determiner == "all")
        or steps[0].order
        or whole.number
        or whole.ranks
    ):
        raise Misfit
    named = [replace(ref, nouns=whole.nouns, names=whole.names) if ref.other else _of_kind(ref, whole) for ref in turn]
    if any(not (ref.colours or ref.ranks or ref.names or ref.other) for ref in named):
        raise Misfit
    return tuple(replace(steps[0], objects=(ref,), bare=COSTS[1]) for ref in named)


def _turns(values: dict[str, Any], text: str) -> Any:
    """As in "the cubes in the bin, the red one first"; "red in the bowl and blue in the crate, blue first"."""
    steps = with_verbs(values["steps"])
    if steps is None or values.get("avoid"):
        raise Misfit
    if "turn" in values:
        return _in_turn(steps, values["turn"])
    ref, when = values["what"], values["when"]
    if steps[0].verb == "stack" or ref.instead or (ref.one and not (ref.colours or ref.ranks or ref.names)):
        raise Misfit
    if (
        len(steps) == 1
        and (len(steps[0].objects) > 1 or any(ref.plural or ref.determiner == "all" for ref in steps[0].objects))
        and steps[0].order is None
    ):
        return (replace(steps[0], order=((when, ref),)),)
    if len(steps) > 1 and all(len(step.objects) == 1 for step in steps):
        meant = [step for step in steps if _may_be(ref, step.objects[0])]
        if len(meant) == 1:
            others = tuple(step for step in steps if step is not meant[0])
            return (meant[0], *others) if when == "first" else (*others, meant[0])
    raise Misfit


FORMS: dict[str, Callable[[dict[str, Any], str], Any]] = {
    "any": lambda values, text: values["is"],
    "list": _list, "numbers": lambda values, text: tuple(values["of"]),
    "Commas": _commas, "slot": lambda values, text: tuple((name.replace("__", " "), value) for name, value in values.items()),
    "triple": lambda values, text: tuple(map(float, values["of"])),
    "product": _product, "vague": lambda values, text: Vague(_product(values, text)), "sum": lambda values, text: sum(values["of"]), "Aside": lambda values, text: text, "Pair": lambda values, text: with_nouns(tuple(values["of"])), "Name": lambda values, text: "_".join(str(part) for part in values["of"]), "Rate": lambda values, text: f"{_product(values, text):g} m/s", "Paced": lambda values, text: f"{100.0 * _product(values, text):.0f} %", "Lasting": lambda values, text: f"{_product(values, text):g} s", "Length": _length, "Ref": _thing, "Spread": _spread, "Measure": _measure, "Command": _command, "Sentence": _sentence,
    "Steps": _steps, "Reversed": _reversed, "Topic": _topic, "Claimed": _claimed, "Respective": _respective, "Turned": _turned, "Sorted": _sorted, "Denied": _denied,
    "Contrary": _contrary,
    "Fix": _fix, "Corrected": _corrected, "Specified": _specified,
    "Replaced": _replaced,
    "Spare": lambda values, text: tuple(values["avoid"]), "Split": _split, "Turns": _turns, "At": _at, "Level": _level, "Amended": _amended, "Rank": _rank,
    "Relation": _relation,
    "Region": lambda values, text: Region(**{**values, "sides": tuple(values.get("sides", ()))}), "ByRobot": _plain(ByRobot), "Offset": _plain(Offset), "Original": _plain(Original), "Spot": _plain(Spot),
    "Table": _plain(Table), "Matching": _plain(Matching), "Bound": _bound, "If": _if, "While": _while, "UntilLeft": _until, "ForEach": _each,
    "Is": _is, "Not": _plain(Not), "There": _there, "More": _more, "Alike": _plain(Alike, said=True),
    "Several": _plain(Several, said=True), "Question": _plain(Question, said=True), "Reply": _reply,
}  # fmt: skip
