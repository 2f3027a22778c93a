"""Members of a group that go their own way: told apart, denied, or dealt out one by one."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from robosandbox.agent.language.discourse import RefusedError, listed
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Command, Ref, Region, Relation, replace
from robosandbox.agent.language.match import holds_things
from robosandbox.agent.language.readings import part_of
from robosandbox.types import RefusalCode

_ACROSS, _ALONG = frozenset({"left", "right"}), frozenset({"far", "near"})
_RESTS = ("the rest", "the remainder", "the remaining", "rest", "remaining", "whatever is left", "what is left")
_SOME = frozenset({"one", "some", "half", "any"})
_SORTED_TO = frozenset({"in", "to", "on", "beside", "left", "right", "front", "back"})


def members_apart(commands: Sequence[Command], ground: Grounder) -> tuple[Command, ...]:
    """As in "the fruit in the bowl, the lime in the bin", "tap the cubes, the red one twice": one goes its own way.

    Args:
        commands: The commands of a sentence.
        ground: Finds what they describe, with no memory of what was spoken of.
    """
    made = list(commands)
    for k, (group, own) in enumerate(pairwise(commands)):
        whole = group.objects[0] if len(group.objects) == 1 else None
        if whole is None or not (whole.plural or whole.determiner == "all") or whole.number or whole.share:
            continue
        alike = group.verb == own.verb and own.bare and _manner(group) != _manner(own)
        if whole.determiner == "it" or not alike or len(own.objects) != 1:
            continue
        apart = _of_kind(own.objects[0], whole)
        single = _told_by_looks(apart) or (not apart.plural and apart.nouns and not apart.other)
        if single and ground.has(apart, whole):
            made[k] = replace(made[k], objects=(replace(whole, without=(*whole.without, apart)),))
    return tuple(made)


def other_regions(commands: Sequence[Command]) -> tuple[Command, ...]:
    """As in "the can in the far left corner and the cup in the near one": a corner, and no bin that is near.

    Raises:
        RefusedError: Which one is meant is not told by its sides: "the other one".
    """
    made = list(commands)
    for k in range(1, len(made)):
        region, place = made[k - 1].place, made[k].place
        if not (isinstance(region, Region) and isinstance(place, Relation) and len(place.refs) == 1):
            continue
        one = place.refs[0]
        fits = place.kind in ("to", "beside", "in" if region.name == "corner" else "on")
        told = one.nouns or one.names or one.colours or one.relations or one.unknown or one.options
        if not (one.one and fits) or told:
            continue
        sides = tuple(dict.fromkeys(rank.key for rank in one.ranks))
        if one.other or not sides or not set(sides) <= {*_ACROSS, *_ALONG}:
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"Which {region.name} of the table is “{one.text}”?", about=one.text
            )
        kept = [side for axis in (_ACROSS, _ALONG) if not axis & {*sides} for side in region.sides if side in axis]
        made[k] = replace(made[k], place=Region(region.name, (*sides, *(kept if region.name == "corner" else ()))))
    return tuple(made)


def rest_of_its_kind(commands: Sequence[Command]) -> tuple[Command, ...]:
    """As in "two of the cubes in the bowl and the rest in the bin": the rest of the cubes.

    Raises:
        RefusedError: "Put a cube in the bowl and the rest in the bin": of the cubes, or of all there is?
    """
    made = list(commands)
    for k, (some, rest) in enumerate(pairwise(commands)):
        ref = rest.objects[0] if len(rest.objects) == 1 else None
        whole = some.objects[0] if len(some.objects) == 1 else None
        everything = (
            ref is not None and ref.other and ref.determiner == "all" and not (ref.nouns or ref.names or ref.one)
        )
        if ref is None or not everything or not ref.text.startswith(_RESTS) or whole is None or whole.determiner != "a":
            continue
        if not (whole.nouns or whole.names) or whole.nouns == ("thing",):
            continue
        if not (whole.number or whole.share or whole.total or whole.text.split(" ")[0] in _SOME):
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"“{ref.text}”: of those like “{whole.text}”, or of everything?", about=ref.text
            )
        made[k + 1] = replace(
            rest, objects=(replace(ref, nouns=whole.nouns, names=whole.names, colours=whole.colours),)
        )
    return tuple(made)


def _manner(command: Command) -> tuple[object, ...]:
    return command.place, command.times, command.direction, command.distance


def members_named(commands: Sequence[Command], ground: Grounder) -> tuple[Command, ...]:
    """As in "put two of the fruits in the bowl, namely the lime and the fig": those are the two.

    Args:
        commands: As for `members_apart`.
        ground: As for `members_apart`.

    Raises:
        RefusedError: Some of those named are of that kind, and some are not.
    """
    for k, group in enumerate(commands):
        whole = group.objects[0] if group.objects else None
        if whole is None or whole.determiner != "a" or not (whole.nouns and whole.number):
            continue
        listed_with = group.objects[1:]
        if len(listed_with) == whole.number and all(_is_named(ref) and ground.has(ref, whole) for ref in listed_with):
            # "two of the cans, namely the soup and the corn, go in the bowl": those, where there are no two others.
            if len(ground.many(replace(whole, determiner="all", number=None, total=None)).ids) >= 2 * whole.number:
                raise _which_ones(whole, listed_with)
            return (*commands[:k], replace(group, objects=listed_with), *members_named(commands[k + 1 :], ground))
        if listed_with:
            continue
        end = k + 1
        while end < len(commands) and commands[end].bare and _again(commands[end], group):
            end += 1
        own = tuple(ref for command in commands[k + 1 : end] for ref in command.objects)
        fits = len(own) == whole.number and all(map(_is_named, own))
        of_it = [ground.has(ref, whole) for ref in own] if fits else []
        if any(of_it) and not all(of_it):
            raise _which_ones(whole, own)
        if any(of_it):
            # So that "the other one" is a fruit, too.
            named = [replace(ref, nouns=whole.nouns, names=(*ref.names, *ref.nouns)) for ref in own]
            of_them = tuple(one if ground.has(one) else ref for one, ref in zip(named, own, strict=True))
            return (*commands[:k], replace(group, objects=of_them), *members_named(commands[end:], ground))
    return tuple(commands)


def _is_named(ref: Ref) -> bool:
    return bool(ref.nouns or ref.names) and not (ref.number or (ref.plural and not ref.names))


def _which_ones(whole: Ref, named: Sequence[Ref]) -> RefusedError:
    told = listed([ref.text for ref in named])
    return RefusedError(RefusalCode.AMBIGUOUS, f"“{whole.text}”: are {told} the ones, or more?")


def _again(command: Command, before: Command) -> bool:
    return replace(command, objects=before.objects, bare=before.bare) == before


def other_than_its_place(command: Command) -> Command:
    """As in "put the other red cube on the large red cube", where nothing was spoken of before: other than that one."""
    place, (ref, *more) = command.place, command.objects or (None,)
    single = isinstance(place, Relation) and len(place.refs) == 1 and not more
    if ref is None or not single or not ref.other or ref.plural or not (ref.nouns or ref.names):
        return command
    assert isinstance(place, Relation)
    there = place.refs[0]
    alike = (there.nouns == ref.nouns or there.names) and not (there.plural or there.other or there.determiner != "the")
    return replace(command, objects=(replace(ref, other=False, without=(*ref.without, there)),)) if alike else command


def without_what_is_denied(command: Command, ground: Grounder) -> Command:
    """As in "put the cubes in the bowl, not the red one": of the cubes, as no bowl was told by its looks.

    Args:
        command: To leave them out of.
        ground: As for `members_apart`.
    """
    place, groups = command.place, [ref for ref in command.objects if ref.plural or ref.determiner == "all"]
    told = (*command.objects, *(place.refs if isinstance(place, Relation) else ()))
    for denied in (each for ref in told for each in ref.instead if each.one and not (each.nouns or each.options)):
        if not any(ground.has(_of_kind(denied, ref)) for ref in told if ref.nouns or ref.names):
            # "put the butter in the drawer, but not the white one": there is one drawer, and one butter.
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"“not {denied.text}”: I see none that could be meant.")
    if not groups or not isinstance(place, Relation):
        return command
    spared: dict[Ref, list[Ref]] = {whole: [] for whole in groups}

    def holds(name: str) -> bool:
        return place.kind not in ("in", "to") or holds_things(ground.world.objects[name])

    for ref in place.refs:
        for denied in (*ref.without, *ref.instead) if ref.determiner != "all" and not ref.plural else ():
            contrast = denied.one and not denied.nouns and bool(ref.colours or ref.ranks or ref.relations)
            if contrast and ground.has(_of_kind(denied, ref), fits=holds):
                if not _told_alike(denied, ref) and any(ground.has(_of_kind(denied, whole), whole) for whole in groups):
                    # "the bolts in the blue bowl, not the one on the left"
                    raise RefusedError(
                        RefusalCode.AMBIGUOUS, f"“not {denied.text}”: which of the things, or which place?"
                    )
                # "in the blue bowl, not the red one"
                continue
            for whole in groups:
                own = _of_kind(denied, whole)
                if ground.has(own, whole):
                    spared[whole].append(own)
    return replace(
        command,
        objects=tuple(
            replace(ref, without=(*ref.without, *spared[ref])) if spared.get(ref) else ref for ref in command.objects
        ),
    )


def _told_alike(one: Ref, other: Ref) -> bool:
    """Say whether two descriptions tell a thing by the same: its colour, its rank, or where it is."""
    return any(a and b for a, b in zip(*((r.colours, r.ranks, r.relations) for r in (one, other)), strict=True))


def dealt_first(commands: Sequence[Command]) -> list[Command]:
    """As in "put a ball in each bin, the yellow one in the white bin": what is told apart goes first, then the rest."""
    dealt: list[Command] = []
    for command in commands:
        before = dealt[-1] if dealt else None
        if before is None or not (_deals(before) and _tells_apart(command, before)):
            dealt.append(command)
            continue
        place, where = before.place, command.place
        assert isinstance(place, Relation) and isinstance(where, Relation)
        kind, bins = before.objects[0], place.refs[0]
        apart = _of_kind(command.objects[0], kind)
        there = tuple(_of_kind(ref, bins) for ref in where.refs)
        rest = replace(
            before,
            objects=(replace(kind, without=(*kind.without, apart)),),
            place=replace(place, refs=(replace(bins, without=(*bins.without, *there)),)),
        )
        dealt[-1:] = [replace(command, objects=(apart,), place=replace(where, refs=there)), rest]
    return dealt


def sorted_as_told(commands: Sequence[Command]) -> tuple[Command, ...]:
    """As in "sort the balls: the white one into the cup, the others into the bin": that is how they are sorted."""
    lead, told = commands[0], commands[1:]
    sorts = lead.objects if lead.verb == "sort" and lead.place is None else ()
    if len(sorts) > 1 and tuple(ref.nouns for c in told for ref in c.objects) == tuple(ref.nouns for ref in sorts):
        # "sort the mugs and the fruit: mugs in the drawer, fruit in the bowl"
        return tuple(told)
    whole = sorts[0] if len(sorts) == 1 else None
    if whole is not None and whole.determiner == "it" and told and all(_goes_somewhere(c) for c in told):
        # "sort these: the bolts in the tray, the fuse in the bucket"
        return tuple(told)
    end = next((k for k, c in enumerate(told) if whole is None or not _takes_some(c, whole)), len(told))
    if whole is None or end < 2:
        return tuple(commands)
    dealt = (replace(c, objects=tuple(_all_of_kind(ref, whole) for ref in c.objects)) for c in told[:end])
    return (*dealt, *told[end:])


def _all_of_kind(ref: Ref, whole: Ref) -> Ref:
    """Return a description with the kind of what is sorted; "red" alone means all that are red."""
    alone = ref.determiner == "bare" and ref.one and not (ref.number or ref.ranks or ref.text.endswith("one"))
    return _of_kind(replace(ref, determiner="all", plural=True) if alone else ref, whole)


def _takes_some(command: Command, whole: Ref) -> bool:
    """Say whether a command puts some of what was named before into something."""
    place = command.place
    anything = whole.determiner == "all" and whole.nouns in ((), ("thing",)) and not (whole.names or whole.colours)
    some = anything or all(
        not (ref.nouns or ref.names) or (ref.nouns and ref.nouns == whole.nouns) for ref in command.objects
    )
    return command.verb == "put" and isinstance(place, Relation) and place.kind in _SORTED_TO and some


def _goes_somewhere(command: Command) -> bool:
    place = command.place
    somewhere = command.verb == "put" and isinstance(place, Relation) and place.kind in _SORTED_TO
    return somewhere and all(ref.nouns or ref.names for ref in command.objects)


def _deals(command: Command) -> bool:
    place = command.place
    return (
        command.verb == "put"
        and len(command.objects) == 1
        and command.objects[0].determiner == "a"
        and isinstance(place, Relation)
        and len(place.refs) == 1
        and place.refs[0].determiner == "all"
    )


def _tells_apart(command: Command, dealt: Command) -> bool:
    where, place = command.place, dealt.place
    return (
        command.verb == "put"
        and len(command.objects) == 1
        and isinstance(where, Relation)
        and isinstance(place, Relation)
        and where.kind == place.kind
        and len(where.refs) == 1
        and all(_told_by_looks(ref) for ref in (command.objects[0], where.refs[0]))
        and part_of(_of_kind(command.objects[0], dealt.objects[0]), dealt.objects[0])
        and part_of(_of_kind(where.refs[0], place.refs[0]), place.refs[0])
    )


def _told_by_looks(ref: Ref) -> bool:
    """Say whether one thing is told by what does not change when others move: its name or its colour."""
    one = not (ref.plural or ref.number) and ref.determiner in ("the", "bare")
    return one and bool(ref.colours or ref.names) and not (ref.ranks or ref.relations)


def _of_kind(ref: Ref, whole: Ref) -> Ref:
    """Return a description that may say a colour only ("the yellow one", "yellow") with the kind of what it is one of."""
    if ref.nouns or ref.names or ref.determiner == "it":
        return ref
    return replace(ref, nouns=whole.nouns, names=() if whole.nouns else whole.names, one=False)
