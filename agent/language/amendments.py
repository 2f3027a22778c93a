"""Amendments of the command before: corrections, the same with another thing or way, places where it may go on."""

from __future__ import annotations

from abc import ABC, abstractmethod

from robosandbox.agent.language.chart import Found
from robosandbox.agent.language.clauses import Elements
from robosandbox.agent.language.commands import Commands
from robosandbox.agent.language.frames import frame_command
from robosandbox.agent.language.intent import IT, Command, Ref, Relation, replace
from robosandbox.agent.language.match import NOUN_CLASS
from robosandbox.agent.language.modifiers import says_nothing
from robosandbox.agent.language.phrases import means, of_its_kind, single
from robosandbox.agent.language.readings import Part, part_of
from robosandbox.agent.language.strain import parties
from robosandbox.agent.language.tokens import id_parts
from robosandbox.agent.language.turns import turns_of
from robosandbox.agent.language.wishes import spoken

_SIDES = frozenset({"left", "right", "front", "back", "beside"})
_ALL = frozenset({"all", "everything", "every one", "each one", "all of it", "all of them", "each of them", "the lot"})
_EACH = frozenset({"each", "each one", "each of them", "every one"})
_SIDE_WORDS = frozenset({"left", "right", "front", "behind", "back", "side"})
_ADJECTIVES = frozenset({"COLOUR", "SHADE", "SIZE", "POS", "SUPER", "THE"})
_LAST = frozenset({"last", "lastly", "finally", "afterwards", "afterward", "later", "at", "in", "after"})
_OPPOSITE = {"left": "right", "right": "left", "forward": "back", "back": "forward"}
_WAYS = frozenset({"towards", "toward", "away", "closer", "nearer"})


class Amendments(Commands, ABC):
    """The rules for what follows a command and changes or repeats it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.joints: dict[int, list[int]] = {}

    @abstractmethod
    def _parts(self, i: int, /) -> Found[tuple[Part, ...]]:
        """Everything from `i` to the end; `Grammar` knows how."""

    def _corrected_place(self, part: tuple[Part, ...], k: int) -> Found[tuple[Part, ...]]:
        last = part[-1]
        if (
            not isinstance(last, Command)
            or last.verb not in ("put", "push", "stack", "pour")
            or last.tower
            or not last.objects
        ):
            return []
        found: Found[tuple[Part, ...]] = []
        for j, opposite in self._other_side(last, k):
            # "to the left of the can, no, to the right": of the can.
            set_right = (*part[:-1], replace(last, place=opposite, bare=last.bare - 0.6))
            if self._skip(j) >= len(self.tokens):
                return [(len(self.tokens), set_right)]
            found += [(end, (*set_right, *rest)) for m in self._joints(j) for end, rest in self._parts(m) if rest]
        narrowed = [
            (len(self.tokens), (*part[:-1], replace(last, objects=refs, bare=last.bare - 0.6)))
            for j, refs in (self.np_list(k) if len(last.objects) > 1 else ())
            if not any(ref.relations for ref in last.objects)
            and self._skip(j) >= len(self.tokens)
            and {*map(_naming, refs)} < {*map(_naming, last.objects)}
        ]
        if narrowed:
            # "the salt and the pepper on the plate... nah, only the salt"
            return narrowed[:1]
        places = last.place.refs if isinstance(last.place, Relation) else ()
        inside = isinstance(last.place, Relation) and last.place.kind == "in"
        denied = self._denied(k)
        if denied is not None:
            # "sorry, not the butter, the lemon": what stands in for the butter, wherever it was.
            for j, refs in self.np_list(k):
                if self._skip(j) >= len(self.tokens) and len(refs) == 1:
                    objects, there = (
                        [of_its_kind(refs[0], ref) if means(denied, ref) else ref for ref in old]
                        for old in (last.objects, places)
                    )
                    place = replace(last.place, refs=tuple(there)) if isinstance(last.place, Relation) else last.place
                    if (tuple(objects), place) != (last.objects, last.place):
                        better = replace(last, objects=tuple(objects), place=place, bare=last.bare - 0.6)
                        found.append((len(self.tokens), (*part[:-1], better)))
            return found[:1]
        for j, refs in self.np_list(k) if places and len(last.objects) == 1 else []:
            same = [bool(_kind(ref)) and _kind(ref) == _kind(refs[0]) for ref in (*last.objects, *places)]
            if len(refs) == 1 and refs[0].one and refs[0].colours and not refs[0].nouns:
                # "put the red cup on the tray, no, the white one": colours stand against each other.
                same = [bool(ref.colours) for ref in (*last.objects, *places)]
                refs = (replace(refs[0], nouns=next(iter(last.objects)).nouns, one=False),)
            better = replace(last, objects=refs)
            if same[0] and not any(same[1:]):
                # "put the red cube on the plate, oh wait, the green cube": it is the cube that was wrong.
                found += self._going_on(part, replace(better, bare=last.bare - 0.6), j)
            elif not any(same[1:]) and refs[0].names + refs[0].nouns and not (inside and _is_container(refs[0])):
                # "put red_1 in the bucket, make that blue_2": what makes sense decides.
                found += self._going_on(part, replace(better, bare=last.bare + 0.3), j)
        better_distance = self._bare_number(k) if last.verb == "push" and last.distance else None
        if better_distance and self._skip(k + 1) >= len(self.tokens):
            # "5 cm to the left, no, make it 10"
            found.append((len(self.tokens), (*part[:-1], replace(last, distance=better_distance))))
        for j, elements in self.elements(k):
            if not elements or any(e.kind not in ("place", "direction", "distance") for e in elements):
                continue
            for command in frame_command(last.verb, (spoken(last.objects), *_beside_it(elements, places))):
                better = replace(command, distance=command.distance or last.distance, times=last.times)
                if command.verb == "push" and not command.direction and not command.place:
                    better = replace(better, direction=last.direction, place=last.place)
                if self._skip(j) >= len(self.tokens):
                    found.append((len(self.tokens), (*part[:-1], better)))
                for m in self._joints(j):
                    found += [(end, (*part[:-1], better, *rest)) for end, rest in self._parts(m) if rest]
        return found

    def _going_on(self, part: tuple[Part, ...], better: Command, j: int) -> Found[tuple[Part, ...]]:
        """Return the parts with a better last one, and what follows it from `j` on."""
        parts = (*part[:-1], better)
        if self._skip(j) >= len(self.tokens):
            return [(len(self.tokens), parts)]
        if self.text(j) == "and":
            # "no, the bolt and the pin in the box": is the bolt for the box, too?
            return []
        return [(end, (*parts, *rest)) for m in self._joints(j) for end, rest in self._parts(m) if rest]

    def _gapped(self, part: tuple[Part, ...], k: int) -> Found[tuple[Part, ...]]:
        """As in "push the cube left, then right"; "push the can back and the cube forward": the verb from before."""
        last = part[-1]
        if (
            not isinstance(last, Command)
            or last.verb not in ("push", "pick", "tap", "put", "stack", "pour")
            or last.tower
        ):
            return []
        found: Found[tuple[Part, ...]] = []
        n = len(self.tokens)
        if "first" in (self.text(k), self.text(k - 1)) and ":" not in (self.text(k - 1), self.text(k - 2)):
            # "the cans in the box, first the red one, then ..." says in which order, which is not known here.
            return []
        if self.text(k - 2) == "before" and self.text(k - 1) in ("that", "this"):
            # "tap the can, but before that the cup" tells of what comes first.
            return []
        if self.text(k) in ("whichever", "whatever"):
            # "the left bin or the right bin, whichever is nearer" is no further thing.
            return []
        end = next((k + n for n in (1, 2, 3) if self.said(k, k + n) in _ALL and self.tag(k + n, "EXCEPT")), 0)
        if end:
            return self._all_but(part, k, end)
        if self.said(k, k + 3) == "all of it":
            # "the ice in the bowl, all of it": the same ice.
            return [(n, part)] if self._skip(k + 3) >= n else []
        counted = [
            (j, tuple(replace(ref, number=2 if self.text(k) == "both" else None) for ref in last.objects))
            for j in self.all_of_them(k)
            if self._skip(j) >= n and all(ref.plural and ref.determiner in ("the", "bare") for ref in last.objects)
        ]
        if counted and len(last.objects) == 1:
            # "the dice in the bowl, both of them": the same dice.
            return [(n, (*part[:-1], replace(last, objects=refs))) for _, refs in counted[:1]]
        said = [ref for ref in parties(last) if ref.determiner in ("a", "all") or ref.number]
        if self.text(k) in ("any", "either") and said:
            # "put a bolt in each box, any bolt" says that it does not matter which.
            same = [
                self._skip(j)
                for j, ref in self.np(k)
                if not (ref.unknown or ref.relations)
                and any((ref.nouns, ref.names) == (known.nouns, known.names) or ref.one for known in said)
            ]
            if same:
                return [(n, part) for j in same if j >= n][:1]
        if self.text(k - 1) == ":":
            # "put two things in the bin: the can and the ball": the list says which.
            open_ = len(last.objects) == 1 and (last.objects[0].number or last.objects[0].determiner == "it")
            return [
                (n, (*part[:-1], replace(last, objects=refs)))
                for j, refs in (self.np_list(k) if open_ else ())
                if self._skip(j) >= n and last.objects[0].number in (None, len(refs))
            ]
        if self.text(k - 1) == "," and len(last.objects) == 1 and (last.objects[0].number or 0) > 1:
            # "put two blocks in the tray, yellow and red": which two.
            whole = last.objects[0]
            which = [
                refs
                for j, refs in self.np_list(k)
                if self._skip(j) >= n
                and len(refs) > 1
                and all((ref.one and not ref.nouns) or ref.nouns == whole.nouns for ref in refs)
            ]
            if which and len(which[0]) != whole.number:
                return []
            if which:
                named = tuple(replace(ref, nouns=whole.nouns, one=False) for ref in which[0])
                return [(n, (*part[:-1], replace(last, objects=named)))]
        for j, ref in self.np(k):
            # "the red cube left of the bowl and the blue one to the right": of the bowl.
            for end, place in self._other_side(last, j) if self.text(j - 1) not in _SIDE_WORDS else []:
                again = replace(last, objects=(ref,), place=place, bare=0.3)
                if self._skip(end) >= n:
                    found.append((n, (*part, again)))
                for m in self._joints(end):
                    found += [(q, (*part, again, *rest)) for q, rest in self._parts(m) if rest]
        for j, refs in self.np_list(k) if last.verb not in ("push", "stack") or last.place else []:
            beside = isinstance(last.place, Relation) and last.place.kind in _SIDES
            if any(ref.text in _EACH for ref in refs) or (
                last.verb == "put"
                and self.text(j - 1) in _SIDE_WORDS
                and (beside or self.text(j - 2) in ("the", "in", "to"))
            ):
                # "..., 5 cm each" and "the blue one to the right" are no more of the same, nor is "black right".
                continue
            # "into the bowl; then the ball": the same with another object; "the ball does too", "the ball joins it there".
            # "tap the can twice, then the ball": a new order, done once.
            afresh = self.text(k - 1) in ("then", "next", "that", "afterwards", "finally", "lastly")
            again = replace(last, objects=refs, bare=0.9, times=1 if afresh else last.times)
            again = replace(again, order=None) if turns_of(last) else again
            j = max((end for end, _ in self.tag(j, "DOES_TOO")), default=j)
            done, further = part, again
            for end, times in self.tag(j, "TIMES") if last.verb in ("tap", "push") else []:
                # "tap the can once, then the ball twice"
                j, again, further = end, replace(again, times=times), replace(again, times=1)
                others = tuple(ref for ref in last.objects if _naming(ref) not in map(_naming, refs))
                if others and not afresh:
                    # "tap the can, the cup and the ball, the ball twice"
                    done = (*part[:-1], replace(last, objects=others))
            if self._skip(j) >= n:
                found.append((n, (*done, again)))
            for m in self._joints(j):
                found += [
                    (end, (*done, *((again, *rest[1:]) if rest[0] == further else rest)))
                    for end, rest in self._gapped((further,), m)
                ]
                found += [(end, (*done, again, *rest)) for end, rest in self._parts(m) if rest]
        if last.verb != "push":
            return found
        for j, again in self._pushed_on(last, k):
            if self._skip(j) >= n:
                found.append((n, (*part, again)))
            for m in self._joints(j):
                found += [(end, (*part, *rest)) for end, rest in self._gapped((again,), m)]
                found += [(end, (*part, again, *rest)) for end, rest in self._parts(m) if rest]
        for j, elements in self.elements(k):
            if not any(e.kind in ("direction", "distance") for e in elements):
                continue
            if any(e.kind == "objects" and any(ref.text in _EACH for ref in e.value) for e in elements):
                continue
            for command in frame_command("push", elements):
                if command.direction is None and command.place is None:
                    # "left, then 5 cm more"
                    command = replace(command, direction=last.direction)
                if command.direction is None:
                    continue
                told = any(e.kind == "objects" for e in elements)
                if (
                    self.text(k - 1) == ","
                    and not told
                    and self.text(k) in _WAYS
                    and command.direction != last.direction
                ):
                    # "back, away from you" contradicts itself.
                    continue
                if self.text(k - 1) == "," and not told and command.direction == last.direction:
                    # "10 cm backwards, towards the base", "a bit closer, 5 cm towards you": the same push, more exactly.
                    better = None if command.distance and last.distance else command.distance or last.distance
                    if better and self._skip(j) >= n:
                        found.append((n, (*part[:-1], replace(last, distance=better))))
                        continue
                again = replace(command, objects=last.objects) if not told else replace(command, bare=0.3)
                if self._skip(j) >= n:
                    found.append((n, (*part, again)))
                for m in self._joints(j):
                    found += [(end, (*part, *rest)) for end, rest in self._gapped((again,), m)]
                    found += [(end, (*part, again, *rest)) for end, rest in self._parts(m) if rest]
        return found

    def _all_but(self, part: tuple[Part, ...], k: int, end: int) -> Found[tuple[Part, ...]]:
        """As in "the cubes in the box, all but the red one", which leaves one out, and is no more things."""
        last = part[-1]
        if not isinstance(last, Command) or len(last.objects) != 1 or self.text(k - 1) != ",":
            return []
        whole = last.objects[0]
        if not (whole.plural or whole.determiner == "all"):
            return []
        found: Found[tuple[Part, ...]] = []
        for start, _ in self.tag(end, "EXCEPT"):
            for j, refs in self.np_list(start):
                if whole.number or not all(part_of(ref, whole) and not says_nothing(ref) for ref in refs):
                    continue
                gone = (replace(ref, text=f"but {ref.text}") for ref in refs)
                left = replace(last, objects=(replace(whole, without=(*whole.without, *gone)),))
                found += self._going_on(part, left, j)
        return found

    def _pushed_on(self, last: Command, k: int) -> Found[Command]:
        """As in "5 cm to the left, then 5 cm more", "10 cm to the left, then back again"."""
        if not last.direction or last.place:
            return []
        it = replace(last, objects=(replace(IT, plural=last.objects[0].plural),), bare=0.3)
        if self.text(k) in ("backagain", "back"):
            # "to the left and back" returns, or comes nearer; after two ways, which of them goes back?
            plain = -0.6 if last.direction == "forward" or self.text(k) == "backagain" else 0.3
            ways = [replace(it, direction=_OPPOSITE[last.direction], bare=plain)]
            return [(k + 1, way) for way in ways if last.objects[0].determiner != "it"]
        further = self.text(k - 1) in ("then", "and") and last.distance is not None
        return [(j, replace(it, distance=metres, times=1)) for j, metres in (self.distance(k) if further else ())]

    def _other_side(self, last: Command, k: int) -> Found[Relation]:
        """Return the places that "to the right" and the like at `k` mean, after one at another side of something."""
        beside = last.place
        if not isinstance(beside, Relation) or not beside.refs or beside.kind not in _SIDES:
            return []
        told = [(j, replace(beside, kind=side)) for j, side in self.tag(k, "OPPOSITE")]
        side = {"behind": "back"}.get(self.text(k), self.text(k))
        if side in ("left", "right", "back") and (
            self._skip(k + 1) > k + 1 or k + 1 >= self.count or self.tag(k + 1, "THEN")
        ):
            # "the red one left of the bowl, the blue one right"
            told.append((k + 1, replace(beside, kind=side)))
        return told

    def _joints(self, j: int) -> list[int]:
        """Return where the next part can start after one that ended at `j`."""
        if j not in self.joints:
            self.joints[j] = self._joints_after(j)
        return self.joints[j]

    def _joints_after(self, j: int) -> list[int]:
        starts = []
        k = self._skip(j)
        if k > j:
            starts.append(k)
        for end, _ in self.tag(k, "THEN"):
            if (
                k == j
                and self.text(k) in _LAST
                and (self.text(end) == ":" or (self.tokens[end:] and self.tokens[end].kind == "mark"))
            ):
                # "tap the can last, first the ball": it tells what comes last first.
                continue
            starts.append(self._skip(end))
            starts += [self._skip(m) for m, _ in self.tag(self._skip(end), "THEN")]
        if any(self.tag(k, tag) for tag in ("AVOID", "NEGATION", "STILL", "SAME")):
            starts.append(k)
        if self.text(k) == "but":
            starts.append(k + 1)
        # "put a in the grey bin and tap it" is not "put a in the grey", and then to bin something.
        noun = k > 0 and k < self.count and "NOUN" in self.tags[k] and not _ADJECTIVES.isdisjoint(self.tags[k - 1])
        if (
            k == j
            and not noun
            and self.text(k) not in self.words.parts
            and any(
                verb in ("pick", "put", "push", "stack", "tap", "go", "open", "close")
                for _, verb in self.tag(k, "VERB")
            )
        ):
            starts.append(k)
        return list(dict.fromkeys(starts))


def _beside_it(elements: Elements, places: tuple[Ref, ...]) -> Elements:
    """As in "on top of the tape, no, next to it": next to the tape."""
    return tuple(
        replace(e, value=replace(e.value, refs=places))
        if isinstance(e.value, Relation) and e.value.refs == (IT,) and places
        else e
        for e in elements
    )


def _kind(ref: Ref) -> tuple[str, ...]:
    """Return what sort of thing a description names, by its noun or by the first word of its id."""
    return ref.nouns[:1] or (id_parts(ref.names[0])[:1] if ref.names else ())


def _is_container(ref: Ref) -> bool:
    """Say whether a thing is named as a container, so that "in the pot, no, the mixing bowl" corrects the pot."""
    heads = (*ref.nouns, *(id_parts(name)[-1] for name in ref.names))
    return any(NOUN_CLASS.get(head) in ("bin", "bowl", "drawer", "mug") for head in heads)


def _naming(ref: Ref) -> tuple[tuple[str, ...], ...]:
    return ref.nouns, ref.names, ref.colours


def without(parts: tuple[Part, ...], then: Part) -> tuple[Part, ...]:
    """As in "the cans in the left bin, but the blue one in the right bin": the blue one is none of them."""
    last = parts[-1]
    if (
        not (isinstance(last, Command) and isinstance(then, Command))
        or len(last.objects) != 1
        or len(then.objects) != 1
    ):
        return parts
    whole, apart = last.objects[0], then.objects[0]
    several = (whole.plural or whole.determiner == "all") and whole.number is None and whole.determiner != "it"
    if last.verb == then.verb == "put" and several and single(apart) and part_of(apart, whole):
        less = replace(
            whole, without=(*whole.without, apart if apart.nouns else replace(apart, nouns=whole.nouns, one=False))
        )
        return (*parts[:-1], replace(last, objects=(less,)))
    return parts
