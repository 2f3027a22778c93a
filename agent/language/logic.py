"""The logical form of what depends on something: conditions, and what is done if, while, until and for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace as changed
from typing import Any, Literal

from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.values import frozen

Steps = tuple[Command, ...]


@frozen
class Bound:
    """How many there are to be.

    Attributes:
        least: No fewer.
        most: No more; None for any number.
        loose: A bare number ("two cans"), which says neither that there are no more nor that there may be.
    """

    least: int = 1
    most: int | None = None
    loose: bool = False

    @property
    def none(self) -> bool:
        """Whether there is to be nothing."""
        return self.most == 0


@frozen
class There:
    """So many things are as a description tells: "there are two cans", "nothing is on the cube", "the bowl has a ball in it"."""

    what: Ref
    bound: Bound
    text: str


@frozen
class More:
    """There are more, fewer or as many of one as of another."""

    one: Ref
    other: Ref
    sign: Literal["more", "fewer", "as many"]
    text: str


@frozen
class Is:
    """Each thing that a description means has a colour, is of a kind, or stands in relations.

    Attributes:
        subject: What it is said of.
        so: The description that has to be true of it: its colours and relations, or a kind.
        text: As said.
        among: Where the subject is "it" and several things were spoken of: one of these.
    """

    subject: Ref
    so: Ref
    text: str
    among: tuple[Ref, ...] = ()


@frozen
class Alike:
    """Things are of one colour or size."""

    things: tuple[Ref, ...]
    text: str


@frozen
class Not:
    """It is not so."""

    of: Condition

    @property
    def text(self) -> str:
        """What is not so."""
        return self.of.text


@frozen
class Several:
    """All of some conditions are so, or any of them."""

    of: tuple[Condition, ...]
    every: bool
    text: str


Condition = There | More | Is | Alike | Not | Several


@frozen
class If:
    """What is done where a condition holds, and what otherwise.

    Attributes:
        condition: What has to be so.
        then: Done where it is.
        otherwise: Done where it is not.
        unless: Said with "unless": the condition is what must not be so, within a `Not`.
        apart: Said with "but if" after what is otherwise done: where it holds, that may be meant, too.
    """

    condition: Condition
    then: Steps
    otherwise: Steps = ()
    unless: bool = False
    apart: bool = False


@frozen
class While:
    """What is done again as long as a condition holds."""

    condition: Condition
    body: Steps


@frozen
class UntilLeft:
    """What is done with all things of a kind but so many, or but those named: "put cans in the bin until two are left".

    Attributes:
        body: What is done, with the kind as its only object.
        bound: How many are left.
        spared: Which are left; None leaves that open.
        text: As said.
    """

    body: Command
    bound: Bound
    spared: Ref | None
    text: str


@frozen
class ForEach:
    """What is done with one thing after the other."""

    what: Ref
    body: Steps


@frozen
class Question:
    """A question, by what it asks.

    Attributes:
        about: What is asked: the answer of that name in `answers.py`.
        text: As said.
        things: What it is asked of.
        others: With what they are compared.
        what: What is counted or looked for; None for anything.
        so: The description that is to be true of them.
        bound: How many there are to be; None for any number.
        by: In what they are compared.
        denied: Whether it is asked if that is not so.
        at: A place that is asked about, metres in the world.
    """

    about: str
    text: str
    things: tuple[Ref, ...] = ()
    others: tuple[Ref, ...] = ()
    what: Ref | None = None
    so: Ref | None = None
    bound: Bound | None = None
    by: str = ""
    denied: bool = False
    at: tuple[float, ...] = ()


@frozen
class Reply:
    """Words that are no sentence of their own: an answer to a question, or what follows an order.

    Attributes:
        better: What is changed in the order before, by the field that it is of; nothing where it is done again as it was.
        times: How often it is done again; 0 where something is changed.
        cancelled: What was asked or begun is left.
    """

    better: tuple[tuple[str, Any], ...] = ()
    times: int = 0
    cancelled: bool = False


Control = If | While | UntilLeft | ForEach


def stripped(condition: Condition) -> tuple[Condition, bool]:
    """Return a condition without its denials, and whether they deny it."""
    denied = False
    while isinstance(condition, Not):
        condition, denied = condition.of, not denied
    return condition, denied


def mapped(condition: Condition, change: Callable[[Ref], Ref]) -> Condition:
    """Return a condition with each description that stands in it changed, those of places included."""

    def of(ref: Ref) -> Ref:
        relations = tuple(r._replace(refs=tuple(map(change, r.refs))) for r in ref.relations)
        return change(replace(ref, relations=relations))

    match condition:
        case There():
            return changed(condition, what=of(condition.what))
        case More():
            return changed(condition, one=of(condition.one), other=of(condition.other))
        case Is():
            return changed(condition, subject=of(condition.subject), so=of(condition.so))
        case Alike():
            return changed(condition, things=tuple(map(of, condition.things)))
        case Not():
            return Not(mapped(condition.of, change))
        case Several():
            return changed(condition, of=tuple(mapped(each, change) for each in condition.of))


def substituted(steps: Steps, it: Ref) -> Steps:
    """Return steps in which "it", "this one" and "them" mean one thing."""

    def change(ref: Ref) -> Ref:
        return it if ref.determiner == "it" else ref

    def of(step: Command) -> Command:
        place = step.place
        if isinstance(place, Relation):
            place = place._replace(refs=tuple(map(change, place.refs)))
        step = replace(step, objects=tuple(map(change, step.objects)), place=place)
        match step.control:
            case If(condition=condition, then=then, otherwise=otherwise):
                form: Control = changed(
                    step.control,
                    condition=mapped(condition, change),
                    then=substituted(then, it),
                    otherwise=substituted(otherwise, it),
                )
            case While(condition=condition, body=body):
                form = While(mapped(condition, change), substituted(body, it))
            case _:
                return step
        return replace(step, control=form)

    return tuple(map(of, steps))


def commands_of(step: Command) -> Steps:
    """Return the plain commands of a step, those of every branch of it."""
    match step.control:
        case None:
            return (step,)
        case If(then=then, otherwise=otherwise):
            steps = (*then, *otherwise)
        case While(body=body) | ForEach(body=body):
            steps = body
        case UntilLeft(body=only):
            steps = (only,)
    return tuple(each for inner in steps for each in commands_of(inner))
