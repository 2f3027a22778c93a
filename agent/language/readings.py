"""From the parts of a sentence to what it asks for as a whole, with commands that mean something else beside one another."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from robosandbox.agent.language.discourse import RefusedError
from robosandbox.agent.language.intent import Command, Ref, Relation, Spot, Table, replace
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.scene_words import id_parts
from robosandbox.agent.language.things import KINDS_OF
from robosandbox.types import RefusalCode


def fused(commands: Sequence[Command]) -> list[Command]:
    """As in "pick up both balls and put them in the bin": two hands would be needed, so each goes before the next is taken."""
    made: list[Command] = []
    for command in commands:
        before = made[-1] if made else None
        several = (
            before
            and before.verb in ("pick", "tidy")
            and (len(before.objects) > 1 or any(ref.plural or ref.determiner == "all" for ref in before.objects))
        )
        # What goes into a drawer must not be in the hand when the drawer is opened.
        into = isinstance(command.place, Relation) and command.place.kind == "in"
        if (
            before
            and before.verb == "pick"
            and (several or into)
            and command.verb in ("put", "stack")
            and len(command.objects) == 1
            and command.objects[0].determiner == "it"
        ):
            one = Command(command.verb, before.objects, command.place, command.tower, command.order)
            made[-1] = replace(one, spoken=before.spoken)
        elif before and before.verb == "tidy" and several and not before.place and _of_them(command):
            # "tidy away the blocks. They go in the crate."
            made[-1] = replace(before, verb="put", place=command.place)
        elif before and _of_them(command) and before.verb == "put" and _is_over(before):
            # "carry it over to the blue one and set it down on top": of the blue one.
            assert isinstance(before.place, Relation)
            place = command.place
            if isinstance(place, Relation) and all(ref.determiner == "it" for ref in place.refs):
                place = place._replace(refs=before.place.refs)
            made[-1] = replace(before, place=place)
        elif before and _lifts_both(before, command):
            # "red on blue and both on the slab": a tower on the slab, not two cubes side by side.
            place = command.place
            assert isinstance(place, Relation)
            made[-1] = replace(before, tower=(*before.tower, *place.refs))
        elif (
            before
            and _taken_out(before)
            and command.verb in ("pick", "put", "stack", "push", "tap")
            and _others(command)
        ):
            # "take the ball out of the bowl and put the cube in there": the ball goes on the table.
            made[-1:] = [replace(before, verb="put", place=Table()), command]
        else:
            made.append(command)
    return made


def _of_them(command: Command) -> bool:
    """Say whether it only tells where what was spoken of goes."""
    them = len(command.objects) == 1 and command.objects[0].determiner == "it"
    return command.verb == "put" and them and command.place is not None


def _is_over(command: Command) -> bool:
    """Say whether a command tells only which thing it goes to."""
    return isinstance(command.place, Relation) and command.place.kind == "to" and len(command.place.refs) == 1


def _taken_out(command: Command) -> bool:
    """Say whether something is only taken off or out of something else."""
    out = any(relation.kind == "from" and relation.refs for ref in command.objects for relation in ref.relations)
    return command.verb == "pick" and out


def _others(command: Command) -> bool:
    """Say whether a command is about things that it names itself."""
    return bool(command.objects) and not any(ref.determiner == "it" for ref in command.objects)


def _lifts_both(before: Command, command: Command) -> bool:
    """Say whether a command puts the two that the one before stacked on something else."""
    on = [isinstance(c.place, Relation) and c.place.kind == "on" and len(c.place.refs) == 1 for c in (before, command)]
    both = command.objects[0] if len(command.objects) == 1 else None
    plain = (
        both is not None
        and (both.number == 2 or (both.determiner == "it" and both.plural))
        and not (both.nouns or both.colours or both.names or both.other)
    )
    return (
        all(on)
        and plain
        and not command.tower
        and len(before.objects) == 1
        and not before.objects[0].plural
        and {before.verb, command.verb} <= {"put", "stack"}
    )


def check_sides(commands: Sequence[Command]) -> None:
    """As in "the cup left of the can, and the jar left of that": left of the can, or of the cup?"""
    # "the cup left of the can and the jar": where the cup is told to go, and not which cup.
    told_apart = (
        (replace(c, objects=(ref,), place=relation), replace(c, objects=c.objects[1:]))
        for c in commands
        for ref in (c.objects[:1] if c.objects[1:] else ())
        for relation in ref.relations[-1:]
    )
    for before, command in (*pairwise(commands), *told_apart):
        here, there = before.place, command.place
        if not (isinstance(here, Relation) and isinstance(there, Relation) and before.verb == command.verb == "put"):
            continue
        again = there.kind == here.kind in ("left", "right", "front", "back") and here.refs and here.distance is None
        if again and there.refs and there.refs[0].determiner == "it" != here.refs[0].determiner:
            told = " or ".join(f"“{ref.text}”" for ref in (*here.refs, *before.objects))
            raise RefusedError(RefusalCode.AMBIGUOUS, f"“{there.refs[0].text}”: is that {told}?")


def is_tower(commands: Sequence[Command]) -> bool:
    """Say whether all commands put one described thing on another."""
    return len(commands) > 1 and all(
        command.verb in ("put", "stack")
        and isinstance(command.place, Relation)
        and command.place.kind == "on"
        and not any(
            ref.determiner == "it" or (ref.one and not ref.colours) for ref in (*command.objects, *command.place.refs)
        )
        for command in commands
    )


def swapped(steps: Sequence[Command]) -> tuple[Command, ...]:
    """As in "the can where the cup is and the cup where the can is"; nothing for anything else."""
    if len(steps) != 2 or any(len(step.objects) != 1 or step.verb != "put" for step in steps):
        return ()
    one, other = steps
    if not (isinstance(one.place, Spot) and isinstance(other.place, Spot)):
        return ()
    mutual = _named_alike(one.objects[0], other.place.refs[0]) and _named_alike(other.objects[0], one.place.refs[0])
    return (Command("swap", (one.objects[0], other.objects[0])),) if mutual else ()


def _named_alike(ref: Ref, other: Ref) -> bool:
    """Say whether two descriptions name one thing: "the red paint", then "the red one"."""
    if ref.one or other.one:
        return (ref.colours, ref.ranks) == (other.colours, other.ranks) != ((), ())
    return ref.text.split()[-1:] == other.text.split()[-1:]


def part_of(ref: Ref, whole: Ref) -> bool:
    """Say whether a description can be of one of several: "the blue one" of the cans, "the red cube" of everything."""
    if ref.unknown or ref.options or (ref.determiner == "all" and ref.other):
        return False
    general = whole.nouns in ((), ("thing",)) and not whole.names
    # "battery_2" is one of the batteries.
    in_full = len(ref.names) == 1 and bool(whole.nouns) and {*whole.nouns} <= {*id_parts(ref.names[0])}
    named = ref.nouns == whole.nouns or general or in_full or _is_kind_of(ref, whole)
    return (ref.one and not ref.nouns) or (bool(ref.nouns or ref.names) and named)


def _is_kind_of(ref: Ref, whole: Ref) -> bool:
    """As in "the lemon" of the fruit, "the hammer" of the tools."""
    kinds = KINDS_OF.get(NOUN_CLASS.get(whole.nouns[0], ""), frozenset()) if len(whole.nouns) == 1 else frozenset()
    return bool(kinds) and bool(kinds & {part for name in (*ref.nouns, *ref.names) for part in id_parts(name)})
