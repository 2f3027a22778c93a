"""Ellipsis and pronouns: the verb of the step before, the noun of the thing behind it, and what a pronoun agrees with."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace as changed
from typing import Any

from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.intent import Command, Place, Ref, Relation, Sentence, replace
from robosandbox.agent.language.logic import Condition, If, Is, Steps, There, mapped, stripped
from robosandbox.agent.language.ruleset import COSTS
from robosandbox.agent.language.vocabulary import EVERYTHING, Vocabulary
from robosandbox.skills.words import Words
from robosandbox.types import RefusalCode

UNSAID: Any = ""
"""The verb of a command that has none: it gets that of the one before it."""
OPPOSITE = {"left": "right", "right": "left", "forward": "back", "back": "forward"}
SAME, OTHER = "same", "opposite"
"""Directions that are told by the one before."""
_ONES = ("one", "ones")
_SIDEWAYS = ("left", "right", "front", "back", "beside")
_ENDS_BESIDE = (" left", " right")
THERE_TOO = "there_too"
"""The text of a thing that is the place of the step before."""


def with_verbs(steps: Steps) -> Steps | None:
    """Return steps, each that lacks a verb with that of the one before it; None where that makes no sense."""
    made: list[Command] = []
    for step in steps:
        if step.verb == UNSAID:
            last = made[-1] if made else None
            if last is not None and _says_how_often(last, step):
                # "nod for the kids, three times"
                made[-1] = last._replace(slots=(*last.slots, *step.slots))
                continue
            told = _after(last, step, made) if last is not None and not last.control else None
            if told is None:
                return None
            step = replace(told, bare=COSTS[1])
        made.append(step)
    return tuple(made)


def _says_how_often(last: Command, step: Command) -> bool:
    """Say whether a step without a verb tells no more than how often the last one is done."""
    told = {argument for argument, _ in step.slots}
    return (
        step.words is not None and step.words == last.words and told == {"times"} and told.isdisjoint(dict(last.slots))
    )


def _after(last: Command, step: Command, made: Sequence[Command]) -> Command | None:
    """Return a step without a verb as one like the last before it."""
    objects = step.objects
    if step.words is not None:
        return _said_on(last, step, step.words)
    if last.words is not None and step.distance is not None and step.place is None and not (objects or step.direction):
        return _farther(last, step.distance)
    if last.words is not None and not last.words.object and len(objects) == 1 and step.place is None:
        # "hover over the red cube, then the green one"
        things = {slot.argument for slot in last.words.slots if slot.kind == "object"}
        if any(name in things for name, _ in last.slots):
            slots = tuple((name, objects[0] if name in things else value) for name, value in last.slots)
            return last._replace(slots=slots)
    if last.words is not None and not last.words.object and objects:
        # "open halfway, then the rest"
        return None
    if step.bare and len(made) > 1 and last.objects and last.objects[0].determiner == "it" and made[-2].verb != "pick":
        # "push the box to the left and put it in the bin, do the same with the can": both?
        return None
    same, step = step.bare > 0, replace(step, bare=0.0)
    if step == Command(UNSAID, times=step.times):
        # "tap the cube and do it again"; of several it is not said what "it" is.
        return last if len(last.objects) == 1 and not last.bare else None
    if objects and objects[0].determiner == "all" and objects[0].without and not (objects[0].nouns or objects[0].names):
        # "..., all but the red one" is about what was just named.
        return None
    if last.verb == "stack" and not last.place:
        # "stack the cubes, then the ball": on what?
        return None
    if last.verb in ("release", "home", "nothing") or any(
        ref.one and ref.determiner == "a" and ref.text == "one" for ref in objects
    ):
        # "tap the can, just one"
        return None
    sided = [ref for ref in objects if any(rank.key in _SIDEWAYS for rank in ref.ranks)]
    if sided and (last.direction or (last.place and any(ref.text.endswith(_ENDS_BESIDE) for ref in sided))):
        # "push the can to the left and the ball to the right, not the cup"; "the ball in the bin and the cube on the right"
        return None
    if objects and step == Command(UNSAID, objects, times=step.times):
        if same:
            return replace(last, objects=objects)
        if last.times > 1 and not step.times:
            # "tap the can twice and the ball": how often?
            return None
        return replace(last, objects=objects, times=step.times or 1)
    if step.distance is not None and not (objects or step.place or step.direction) and last.direction:
        return replace(last, distance=step.distance)
    if step.direction in (SAME, OTHER):
        if not last.direction or len({each.direction for each in made if each.direction}) > 1:
            return None
        way = last.direction if step.direction == SAME else OPPOSITE[last.direction]
        distance = step.distance if step.distance is not None else last.distance
        return replace(last, objects=objects or last.objects, direction=way, distance=distance)
    if step.direction == "back" and not objects and step.distance is None and last.direction:
        if len(made) > 1 and made[-2].direction:
            return None
        return replace(last, direction=OPPOSITE[last.direction])
    if last.verb == "push" and isinstance(step.place, Relation) and step.place.kind in ("in", "on"):
        # "push the can towards the ball and the ball in the bin"
        return replace(step, verb="put")
    if isinstance(step.place, Relation) and [ref.text for ref in step.place.refs] == [THERE_TOO]:
        if step.place.kind == "to" and last.place is not None:
            return replace(step, verb=last.verb, place=last.place)
        if not isinstance(last.place, Relation) or last.place.kind not in _SIDEWAYS:
            # "a cube on the left tray and one on the right": of that tray, or on the other?
            return None
        return replace(step, verb=last.verb, place=step.place._replace(refs=last.place.refs))
    if any(bool(a) != bool(b) for a, b in zip(_arguments(step), _arguments(last), strict=True)):
        return None
    distance = step.distance if step.distance is not None or step.place else last.distance
    return replace(step, verb=last.verb, skill=last.skill, objects=objects or last.objects, distance=distance)


def _farther(last: Command, distance: float) -> Command | None:
    """Return a step with a way of another length: "go up 5 cm, then another 3 cm"."""
    assert last.words is not None
    lengths = {slot.argument for slot in last.words.slots if slot.kind == "length"}
    ways = [(name, value) for name, value in last.slots if name in lengths]
    if len(ways) != 1 or len(last.slots) != 1:
        return None
    (name, value), *_ = ways
    return last._replace(slots=((name, math.copysign(distance, value)),))


def _said_on(last: Command, step: Command, words: Words) -> Command | None:
    """Return what a skill says for itself with the verb of the last step, if that may be one of its verbs.

    As in "hover over the red cube, then over the blue one"; "move up 5 cm, then to (0.3, 0.1, 0.2)".
    """
    if last.words is not None and last.words.means and not last.slots:
        # "remember where you are now as bench": that is one step.
        return None
    if last.words == words:
        told = {argument for argument, _ in step.slots}
        kept = (slot for slot in last.slots if isinstance(slot[1], Ref) and slot[0] not in told)
        return replace(step, verb=last.verb, objects=step.objects or last.objects, slots=(*kept, *step.slots))
    if last.words is None or last.words.object or words.object:
        return None
    told = {name for name, _ in step.slots}
    # "down" is said by the verb of "descend 5 cm", which was not the verb.
    unsaid = any(slot.argument in told and any(not begins for begins, _ in slot.beginnings) for slot in words.slots)
    if unsaid or (last.words.body and words.body and last.words.body != words.body):
        return None
    if {*last.words.verbs}.isdisjoint(words.verbs):
        return None
    return replace(step, verb=last.verb)


def _arguments(command: Command) -> tuple[object, ...]:
    return (command.place, command.direction, command.slots)


def with_nouns(refs: Sequence[Ref], agree: Callable[[Ref, Ref], bool] = lambda one, other: True) -> tuple[Ref, ...]:
    """Return things of a list, each without a noun as what the next is that agrees with it: "the red and the blue cube"."""
    made: list[Ref] = []
    for ref in reversed(refs):
        after = made[-1] if made else None
        open_ended = ref.one and not ref.nouns and not ref.other and not ref.text.endswith(_ONES)
        if after is not None and open_ended and (after.nouns or after.names) and agree(ref, after):
            ref = replace(ref, nouns=after.nouns, names=(*ref.names, *after.names), one=False)
            if [rank.key for rank in ref.ranks] == [""] and len(after.ranks) == 1:
                # "the first and the third cube from the left"
                ref = replace(ref, ranks=(ref.ranks[0]._replace(key=after.ranks[0].key),))
        if ref.options:
            ref = replace(ref, options=with_nouns(ref.options, agree))
        if ref.instead:
            ref = replace(ref, instead=with_nouns((*ref.instead, replace(ref, instead=())), agree)[:-1])
        made.append(ref)
    return tuple(reversed(made))


class Binder:
    """Binds what the steps of one sentence leave open to what was said before in it.

    Args:
        genders: What each description agrees with.
        vocabulary: Of the language.
    """

    def __init__(self, genders: Mapping[Ref, int], vocabulary: Vocabulary) -> None:
        self._genders = genders
        self._vocabulary = vocabulary
        self._named: list[Ref] = []
        self._theme: Ref | None = None

    def bound(self, sentence: Sentence) -> Sentence:
        """Return a sentence with its nouns and pronouns bound.

        Raises:
            RefusedError: A pronoun agrees with nothing that was said before, or with several things.
        """
        return changed(sentence, steps=self._steps(sentence.steps))

    def _steps(self, steps: Steps) -> Steps:
        return tuple(self._step(step) for step in steps)

    def _step(self, step: Command) -> Command:
        objects, place = self._things(step.objects), self._place(step.place)
        step = replace(step, objects=objects, place=place, tower=self._things(step.tower))
        self._named += [ref for ref in (*objects, *refs_of(place)) if ref.determiner != "it"]
        if len(objects) == 1 and objects[0].determiner != "it":
            self._theme = objects[0]
        if isinstance(step.control, If):
            step = replace(step, control=self._conditional(step.control))
        return step

    def _conditional(self, form: If) -> If:
        subjects = _spoken_of(form.condition)
        # "open the drawer if it is closed": what "it" is was said in what is done.
        told_after = any(ref.determiner == "it" for ref in subjects) and not self._named
        then = self._steps(form.then) if told_after else ()
        condition = mapped(form.condition, self._named_again)
        self._named += [ref for ref in subjects if ref.determiner != "it"]
        then = then or self._steps(form.then)
        return changed(form, condition=condition, then=then, otherwise=self._steps(form.otherwise))

    def _named_again(self, ref: Ref) -> Ref:
        """Return what a pronoun of a condition stands for by its name: conditions are looked at before anything is done."""
        told = self._thing(ref)
        if told.determiner != "it" or told.plural or self._theme is None or not self._is_gendered(ref):
            return told
        return replace(self._theme, determiner="the")

    def _place(self, place: Place | None) -> Place | None:
        return place._replace(refs=self._things(place.refs)) if isinstance(place, Relation) else place

    def _things(self, refs: Sequence[Ref]) -> tuple[Ref, ...]:
        return tuple(self._thing(ref) for ref in with_nouns(refs, self._agree))

    def _agree(self, one: Ref, other: Ref) -> bool:
        return bool(self._gender(one) & self._gender(other))

    def _gender(self, ref: Ref) -> int:
        mask = self._genders.get(ref, EVERYTHING)
        return self._vocabulary.any_case(mask) if self._vocabulary.has_gender else EVERYTHING

    def _is_gendered(self, ref: Ref) -> bool:
        return self._vocabulary.has_gender and ref in self._genders

    def _thing(self, ref: Ref) -> Ref:
        """Return what a pronoun stands for where that is not what was acted on last; other descriptions as they are.

        Raises:
            RefusedError: Not one thing that was said before agrees with it.
        """
        if ref.determiner != "it" or ref.plural or not self._named or not self._is_gendered(ref):
            return ref
        if self._theme is not None and self._agree(ref, self._theme):
            return ref
        fitting = [named for named in dict.fromkeys(self._named) if self._agree(ref, named)]
        if len(fitting) != 1 or fitting[0].ranks or fitting[0].relations or fitting[0].determiner == "all":
            seen = listed([f"“{named.text}”" for named in fitting], "or") if fitting else "nothing that was named"
            raise RefusedError(RefusalCode.AMBIGUOUS, f"“{ref.text}” may stand for {seen}; which?", about=ref.text)
        return replace(fitting[0], determiner="the")


def refs_of(place: Place | None) -> tuple[Ref, ...]:
    """Return the things that a place is told by."""
    return place.refs if isinstance(place, Relation) else ()


def _spoken_of(condition: Condition) -> list[Ref]:
    """Return the things that a condition is about."""
    inner, _ = stripped(condition)
    match inner:
        case Is(subject=ref) | There(what=ref):
            return [ref]
        case _:
            return []
