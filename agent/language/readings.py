"""From the parts of a sentence to what it asks for as a whole, with commands that mean something else beside one another."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from robosandbox.agent.language.discourse import RefusedError
from robosandbox.agent.language.intent import IT, Command, Ref, Relation, Sentence, Spot, Table, replace
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.things import KINDS_OF
from robosandbox.agent.language.tokens import id_parts
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


Part = Command | tuple[Ref, ...] | str


def sentence_of(parts: tuple[Part, ...]) -> Sentence | None:
    """Return the sentence that parts make up in their order, None if they ask for nothing and forbid nothing."""
    steps: list[Command] = []
    avoid: list[Ref] = []
    after: list[Ref] = []
    for part in parts:
        if isinstance(part, Command) and part.negated == "same":
            steps += _repeated(steps, part.objects)
        elif isinstance(part, Command):
            place = part.place
            again = part.verb == "put" and part.bare and isinstance(place, Relation) and place.kind in ("in", "to")
            if again and steps and steps[-1].verb == "pour":
                # "pour the red cup into the bowl and the blue one into the bin"
                part = replace(part, verb="pour")
            steps.append(part)
        elif isinstance(part, tuple):
            avoid += part
            after += part if steps else ()
    return _spared(Sentence(_on_the_way(_named_later(steps)), tuple(avoid)), after) if steps or avoid else None


def _named_later(steps: list[Command]) -> list[Command]:
    """As in "put the red block and the ball in the tray, but first tap each of them": what is done first is named last."""
    if len(steps) < 2 or len(steps[0].objects) != 1 or not steps[1].objects:
        return steps
    they, named = steps[0].objects[0], steps[1].objects
    several = len(named) > 1 or any(ref.plural for ref in named)
    if they.determiner != "it" or not they.plural or not several or any(ref.determiner == "it" for ref in named):
        return steps
    return [replace(steps[0], objects=named), replace(steps[1], objects=(they,)), *steps[2:]]


def _spared(sentence: Sentence, after: list[Ref]) -> Sentence:
    """As in "put the cans in the bin but leave the blue one": what is left alone is no part of the plural."""
    several = [
        (k, command)
        for k, command in enumerate(sentence.steps)
        if len(command.objects) == 1
        and (command.objects[0].plural or command.objects[0].determiner == "all")
        and command.objects[0].number is None
    ]
    if len(several) != 1 or several[0][1].objects[0].determiner == "it" or several[0][1].objects[0].other:
        return sentence
    k, command = several[0]
    whole = command.objects[0]
    own = [ref for ref in after if ref.determiner != "it" and part_of(ref, whole)]
    if not own:
        return sentence
    left = replace(
        whole,
        without=(*whole.without, *(ref if ref.nouns else replace(ref, nouns=whole.nouns, one=False) for ref in own)),
    )
    steps = (*sentence.steps[:k], replace(command, objects=(left,)), *sentence.steps[k + 1 :])
    return Sentence(steps, tuple(ref for ref in sentence.avoid if ref not in own))


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


def _on_the_way(steps: list[Command]) -> tuple[Command, ...]:
    """As in "bring the cube over to the can and set it down beside the can": one carrying."""
    made: list[Command] = []
    for step in steps:
        last = made[-1] if made and not (made[-1].control or step.control) else None
        over = last.place if last is not None and last.verb == "put" else None
        onwards = step.place if step.verb == "put" and step.objects == (IT,) else None
        step = replace(step, place=_left_free(last, step) or step.place) if last else step
        if last and isinstance(over, Relation) and over.kind == "to" and isinstance(onwards, Relation):
            named = [ref.nouns for ref in onwards.refs]
            again = all(map(_plainly, onwards.refs)) and named == [ref.nouns for ref in over.refs]
            there = over.refs if onwards.refs == (IT,) or again else onwards.refs
            made[-1] = replace(step, objects=last.objects, place=replace(onwards, refs=there))
        elif last and last.verb in ("aside", "unstack") and _one_thing(last) and onwards is not None:
            # "get the can out of the way, put it behind the cup": that is out of the way.
            made[-1] = replace(step, objects=last.objects)
        else:
            made.append(step)
    return tuple(made)


def _left_free(last: Command, step: Command) -> Relation | None:
    """As in "take the cup off the coaster and put the bowl on it": on the coaster, as the cup is held."""
    place = step.place
    if last.verb != "pick" or last.place or step.verb != "put" or not isinstance(place, Relation):
        return None
    if place.refs != (IT,) or place.kind != "on" or IT in step.objects or len(last.objects) != 1:
        return None
    left = [relation.refs for relation in last.objects[0].relations if relation.kind == "from"]
    return replace(place, refs=left[0]) if len(left) == 1 and len(left[0]) == 1 else None


def _one_thing(command: Command) -> bool:
    return len(command.objects) == 1 and not (command.objects[0].plural or command.objects[0].determiner == "all")


def _repeated(steps: list[Command], objects: tuple[Ref, ...]) -> list[Command]:
    """As in "pick it up, put it there, and do the same with the can": the commands about the last thing, for another."""
    start = len(steps)
    while start:
        start -= 1
        if steps[start].objects and steps[start].objects[0].determiner != "it":
            return [replace(steps[start], objects=objects), *steps[start + 1 :]]
    return []


def _plainly(ref: Ref) -> bool:
    """Say whether a description is no more than "the can"."""
    return ref.determiner == "the" and bool(ref.nouns) and not (ref.colours or ref.ranks or ref.names or ref.relations)
