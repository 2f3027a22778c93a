"""Steps of a sentence: branches chosen, loops unrolled, and the rest left until the robot has looked again.

What the relations of the world tell is decided at once, on paper after the steps before. What only time can tell, as how far
a push went or what lies in a drawer that was shut, ends the plan there: the rest is decided when those steps are done.
"""

from __future__ import annotations

from collections.abc import Callable

from robosandbox.agent.language.deciding import Deciding, NotYetError
from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.ground import bare_name
from robosandbox.agent.language.intent import Command, Ref, Relation, replace
from robosandbox.agent.language.logic import (
    Condition,
    ForEach,
    If,
    Steps,
    There,
    UntilLeft,
    While,
    stripped,
    substituted,
)
from robosandbox.types import RefusalCode
from robosandbox.values import frozen

_ENDLESS = "That would go on for ever: what is done does not end it; say how often, or with which things."
_MOST_ROUNDS = 40  # Number of decisions in one plan. Chosen: more things than a table holds.


@frozen
class Unfolded:
    """What of a sentence's steps can be planned now.

    Attributes:
        steps: Plain commands, in order.
        rest: What is decided when they are done and the robot has looked again; none where all is decided.
        not_so: Why nothing is done where a condition does not hold; None where each held or told what else to do.
    """

    steps: Steps
    rest: Steps = ()
    not_so: RefusedError | None = None


def unfolded(steps: Steps, after: Callable[[Steps], Deciding]) -> Unfolded:
    """Return the plain commands that steps come to.

    Args:
        steps: Of a sentence, some of them under conditions.
        after: Returns a world in which plain commands have been done on paper.

    Raises:
        RefusedError: A condition cannot be seen, or a loop would not end.
    """
    made, left = list[Command](), list(steps)
    spoken: tuple[Ref, ...] = ()
    not_so: RefusedError | None = None
    refused: RefusedError | None = None
    rounds, again = 0, False
    while left:
        step = left.pop(0)
        if step.control is None:
            if refused is not None and _refers_back(step):
                # "if there is a plum, tap it. Put it in the bowl", where there is none
                raise refused
            made += _speaking((step,), spoken)
            refused, spoken = None, ()
            continue
        rounds += 1
        if rounds > _MOST_ROUNDS:
            raise RefusedError(RefusalCode.IMPOSSIBLE, _ENDLESS)
        try:
            world = after(tuple(made))
        except RefusedError:
            if not again:
                raise
            raise RefusedError(RefusalCode.IMPOSSIBLE, _ENDLESS) from None
        for ref in spoken:
            world.ground.many(ref, lambda name: True)
        told = spoken
        try:
            chosen, refused, spoken = _chosen(step, world)
        except NotYetError:
            if not made:
                raise RefusedError(RefusalCode.UNSUPPORTED, "I cannot see yet what that depends on.") from None
            return Unfolded(tuple(made), (step, *left), not_so)
        if refused is not None and made and isinstance(step.control, If):
            _ask_when(step.control.condition, after)
        not_so = not_so or refused
        again = isinstance(step.control, While) and bool(chosen)
        left[:0] = _speaking(chosen, told)
    return Unfolded(tuple(made), (), not_so)


def _ask_when(condition: Condition, after: Callable[[Steps], Deciding]) -> None:
    """Ask about "put the cube in the bin; if the bin is empty, tap the ball": is it decided before the cube is in it?

    Args:
        condition: One that does not hold after the steps before it.
        after: Returns a world in which plain commands have been done on paper.

    Raises:
        RefusedError: It held before them.
    """
    try:
        before = after(()).finding(condition).holds
    except (RefusedError, NotYetError):
        return
    if before:
        raise RefusedError(
            RefusalCode.AMBIGUOUS,
            f"“{stripped(condition)[0].text}”: that changes with what is to be done first; is it decided before that, or after it?",
        )


def _chosen(step: Command, world: Deciding) -> tuple[Steps, RefusedError | None, tuple[Ref, ...]]:
    """Return what a step under a condition comes to, or why it comes to nothing and what was spoken of."""
    match step.control:
        case If(condition=condition, then=then, otherwise=otherwise) as form:
            found = world.finding(condition)
            chosen = then if found.holds else otherwise
            if form.apart and found.holds:
                raise RefusedError(
                    RefusalCode.AMBIGUOUS,
                    f"“{stripped(condition)[0].text}”: is what follows to be done then in place of what was told before, or after it?",
                )
            if not chosen:
                return (), not_so(condition, world), found.spoken
            return _speaking(chosen, found.spoken), None, ()
        case While(condition=condition, body=body):
            found = world.finding(condition)
            if not found.holds:
                return (), not_so(condition, world), ()
            return (*_speaking(body, found.spoken), step), None, ()
        case ForEach(what=what, body=body):
            names = world.ground.many(what, lambda name: True).ids
            each = [substituted(body, Ref(text=name, names=(name,))) for name in names]
            return tuple(command for steps in each for command in steps), None, ()
        case UntilLeft() as left:
            return _until_left(left, world), None, ()
        case _:
            return (step,), None, ()


def _refers_back(step: Command) -> bool:
    refs = (*step.objects[:1], *(step.place.refs if isinstance(step.place, Relation) else ()))
    return any(ref.determiner == "it" for ref in refs)


def _speaking(steps: Steps, spoken: tuple[Ref, ...]) -> Steps:
    if not steps or not spoken:
        return steps
    return (replace(steps[0], spoken=(*spoken, *steps[0].spoken)), *steps[1:])


def _until_left(form: UntilLeft, world: Deciding) -> Steps:
    body = form.body
    whole = replace(body.objects[0], determiner="all", plural=True, number=None)
    if form.spared is not None:
        return (replace(body, objects=(replace(whole, without=(*whole.without, form.spared)),)),)
    names = world.ground.many(whole, world.world.movable).ids
    left = form.bound.least if form.bound.most is None else form.bound.most
    number = len(names) - left
    if number < 1:
        raise RefusedError(RefusalCode.IMPOSSIBLE, f"“{form.text}”: I see {listed(names)}; there is nothing to do.")
    some = whole if not left else replace(whole, determiner="a", number=number, plural=number > 1)
    return (replace(body, objects=(some,)),)


def not_so(condition: Condition, world: Deciding) -> RefusedError:
    """Return the refusal of an order whose condition does not hold."""
    told, denied = stripped(condition)
    none = isinstance(told, There) and told.bound.none
    if (
        isinstance(told, There)
        and not (denied or none or told.what.relations or told.bound.loose)
        and told.bound.most is None
    ):
        seen = listed(list(world.world.objects))
        return RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"I see no {bare_name(told.what.text)}; I see {seen}.")
    return RefusedError(
        RefusalCode.IMPOSSIBLE, f"“{told.text}”: that is {'' if denied else 'not '}so; there is nothing to do."
    )
