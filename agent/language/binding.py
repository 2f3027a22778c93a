"""Ellipsis and pronouns: the verb of the step before, the noun of the thing behind it; and the logical form that fields fill."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace as changed
from typing import Any, NamedTuple

from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.inflection import EVERYTHING, Lexicon
from robosandbox.agent.language.intent import Command, Place, Rank, Ref, Region, Relation, Sentence, Table, replace
from robosandbox.agent.language.logic import Bound, Condition, If, Is, Not, Steps, There, mapped, stripped
from robosandbox.types import RefusalCode

# Number of digits behind the point of a length or an angle that is said: a micrometre. Chosen.
_DIGITS = 12


class Filled(NamedTuple):
    """One field of a form; `more` adds to it."""

    field: str
    value: Any
    more: bool


UNSAID: Any = ""
"""The verb of a command that has none: it gets that of the one before it (binding.py)."""
Fields = tuple[Filled, ...]


class Misfit(Exception):
    """A form cannot have these fields, so that this is no way to read the words."""


def gathered(fields: Sequence[Filled]) -> dict[str, Any]:
    """Return the value of each field.

    Raises:
        Misfit: A field that takes one value is filled twice and differently.
    """
    values: dict[str, Any] = {}
    for name, value, more in fields:
        if more:
            # A list of things is a plain tuple; a thing is one with names.
            values[name] = (*values.get(name, ()), *(value if type(value) is tuple else (value,)))
        elif values.setdefault(name, value) != value:
            raise Misfit
    return values


def formed(form: str, fields: Sequence[Filled], text: str) -> Any:
    """Return a logical form.

    Args:
        form: Its name, one of FORMS.
        fields: What rules filled it with.
        text: The words that it was read from.

    Raises:
        Misfit: It cannot have these fields.
    """
    return FORMS[form](gathered(fields), text)


def _thing(values: dict[str, Any], text: str) -> Ref:
    nth, key = values.pop("nth", None), values.pop("key", "")
    if nth is not None:
        values["ranks"] = (*values.get("ranks", ()), Rank(key, int(nth)))
    if values.get("number") is not None:
        if int(values["number"]) != values["number"]:
            raise Misfit
        values["number"] = int(values["number"])
    # What is picked out by its order alone is said without a noun.
    return Ref(**{"text": text, **values})


def _list(values: Mapping[str, Any], text: str) -> tuple[Any, ...]:
    return tuple(values["item"])


def _product(values: Mapping[str, Any], text: str) -> float:
    return float(round(math.prod(values["of"]), _DIGITS))


def _slot(values: Mapping[str, Any], text: str) -> tuple[tuple[str, Any], ...]:
    return tuple(values.items())


def _command(values: dict[str, Any], text: str) -> Command:
    values.pop("denied", None)
    values["times"] = int(values.get("times", 1))
    return Command(**{"verb": UNSAID, **values})


def _sentence(values: Mapping[str, Any], text: str) -> Sentence:
    return Sentence(tuple(values.get("steps", ())), tuple(values.get("avoid", ())))


def _plain(kind: Any, *, said: bool = False) -> Callable[[dict[str, Any], str], Any]:
    """Return a maker of a form that takes its fields as they are; `said` where it tells its words."""
    return lambda values, text: kind(**{**({"text": text} if said else {}), **values})


FORMS: dict[str, Callable[[dict[str, Any], str], Any]] = {
    "any": lambda values, text: values["is"],
    "list": _list,
    "product": _product,
    "slot": _slot,
    "Ref": _thing,
    "Command": _command,
    "Sentence": _sentence,
    "Rank": _plain(Rank),
    "Relation": _plain(Relation),
    "Region": _plain(Region),
    "Table": _plain(Table),
    "Bound": _plain(Bound),
    "If": _plain(If),
    "Is": _plain(Is, said=True),
    "Not": _plain(Not),
    "There": _plain(There, said=True),
}
"""The forms that a rule may name: those of `intent` and `logic`, the value of `is`, all of `item`, the product of `of`, an argument."""


# Strain, a number of units, of a verb that is left unsaid, chosen as the grammar of English counts it.
_FETCHED = 0.3


class Binder:
    """Binds what the steps of one sentence leave open to what was said before in it.

    Args:
        genders: What each description agrees with.
        lexicon: Of the language.
    """

    def __init__(self, genders: Mapping[Ref, int], lexicon: Lexicon) -> None:
        self._genders = genders
        self._lexicon = lexicon
        self._named: list[Ref] = []
        self._theme: Ref | None = None

    def bound(self, sentence: Sentence) -> Sentence | None:
        """Return a sentence with its verbs, nouns and pronouns bound; None if a step without a verb has none before it.

        Raises:
            RefusedError: A pronoun agrees with nothing that was said before, or with several things.
        """
        steps = _with_verbs(sentence.steps)
        if steps is None:
            return None
        return changed(sentence, steps=tuple(self._step(step) for step in steps))

    def _step(self, step: Command) -> Command:
        objects = tuple(self._thing(ref) for ref in self._with_nouns(step.objects))
        place = self._place(step.place)
        step = replace(step, objects=objects, place=place)
        self._named += [ref for ref in (*objects, *_refs(place)) if ref.determiner != "it"]
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
        if told.determiner != "it" or told.plural or self._theme is None:
            return told
        return replace(self._theme, determiner="the")

    def _steps(self, steps: Steps) -> Steps:
        return tuple(self._step(step) for step in steps)

    def _place(self, place: Place | None) -> Place | None:
        if not isinstance(place, Relation):
            return place
        return place._replace(refs=tuple(self._thing(ref) for ref in self._with_nouns(place.refs)))

    def _with_nouns(self, refs: Sequence[Ref]) -> tuple[Ref, ...]:
        """Return things of a list, each without a noun as what the next is that agrees with it: "the red and the blue cube"."""
        made: list[Ref] = []
        for ref in reversed(refs):
            after = made[-1] if made else None
            if after is not None and ref.one and after.nouns and self._agree(ref, after):
                ref = self._like(ref, nouns=after.nouns)
            if ref.options:
                ref = self._like(ref, options=self._with_nouns(ref.options))
            if ref.instead:
                ref = self._like(ref, instead=self._with_nouns((*ref.instead, replace(ref, instead=())))[:-1])
            made.append(ref)
        return tuple(reversed(made))

    def _like(self, ref: Ref, **fields: object) -> Ref:
        one = ref.one and "nouns" not in fields
        return replace(ref, one=one, **fields)

    def _agree(self, one: Ref, other: Ref) -> bool:
        return bool(self._gender(one) & self._gender(other))

    def _gender(self, ref: Ref) -> int:
        return self._lexicon.any_case(self._genders.get(ref, EVERYTHING))

    def _thing(self, ref: Ref) -> Ref:
        """Return what a pronoun stands for where that is not what was acted on last; other descriptions as they are.

        Raises:
            RefusedError: Not one thing that was said before agrees with it.
        """
        if ref.determiner != "it" or ref.plural or not self._named or ref not in self._genders:
            return ref
        if self._theme is not None and self._agree(ref, self._theme):
            return ref
        fitting = [named for named in dict.fromkeys(self._named) if self._agree(ref, named)]
        if len(fitting) != 1 or fitting[0].ranks or fitting[0].relations or fitting[0].determiner == "all":
            seen = listed([f"“{named.text}”" for named in fitting], "or") if fitting else "nothing that was named"
            raise RefusedError(RefusalCode.AMBIGUOUS, f"“{ref.text}” may stand for {seen}; which?", about=ref.text)
        return replace(fitting[0], determiner="the")


def _spoken_of(condition: Condition) -> list[Ref]:
    """Return the things that a condition is about."""
    inner, _ = stripped(condition)
    match inner:
        case Is(subject=ref) | There(what=ref):
            return [ref]
        case _:
            return []


def _refs(place: Place | None) -> tuple[Ref, ...]:
    return place.refs if isinstance(place, Relation) else ()


def _with_verbs(steps: Steps) -> Steps | None:
    made: list[Command] = []
    for step in steps:
        if step.verb == UNSAID:
            if not made or not _same_arguments(made[-1], step):
                return None
            last = made[-1]
            if step == Command(UNSAID, step.objects):
                # "put the cube in the bin and then the ball": there as well.
                step = replace(last, objects=step.objects)
            step = replace(step, verb=last.verb, skill=last.skill, bare=_FETCHED)
        made.append(step)
    return tuple(made)


def _same_arguments(one: Command, other: Command) -> bool:
    """Say whether two commands have the same arguments, so that what one is told to do can be done with the other."""
    alone = bool(other.objects) and other == Command(UNSAID, other.objects)
    same = all(map(lambda a, b: bool(a) == bool(b), _arguments(one), _arguments(other)))
    return one.control is None and (alone or same)


def _arguments(command: Command) -> Iterator[object]:
    yield from (command.objects, command.place, command.direction, command.slots, command.control)
