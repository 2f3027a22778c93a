"""Answers to questions about what is seen, from the relations and measurements that plans are checked with; nothing moves for them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace as changed

import numpy as np

from robosandbox.agent.language.binding import with_nouns
from robosandbox.agent.language.describing import (
    apart,
    be,
    description,
    from_base,
    length,
    measure,
    place,
    side_of,
    size,
    whereabouts,
)
from robosandbox.agent.language.discourse import Discourse, RefusedError, cannot_see, listed
from robosandbox.agent.language.front import ENGLISH, questions_in
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Ref, Relation, replace, unseen
from robosandbox.agent.language.logic import Question
from robosandbox.agent.language.match import NAMED, NOUN_CLASS, SHAPE_KINDS, THING_KINDS, colour_of, noun_fit
from robosandbox.agent.language.things import KINDS_OF
from robosandbox.agent.language.world import World
from robosandbox.shapes import shapes
from robosandbox.types import SIDE_AXES, DetectedObject, ObservedScene, Refusal, RefusalCode
from robosandbox.world.contracts import find
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.locations import location_of
from robosandbox.world.parts import is_part, open_share
from robosandbox.world.placement_sampling import in_easy_reach
from robosandbox.world.predicate import View
from robosandbox.world.relations import bounds, centre, contents, gap, loose

_THERE = {
    "left": "to the left of",
    "right": "to the right of",
    "front": "in front of",
    "back": "behind",
    "beside": "next to",
    "reach": "within my reach",
    "beyond": "out of my reach",
}
_COMPARED = {
    "big": "bigger",
    "small": "smaller",
    "tall": "taller",
    "short": "shorter",
    "wide": "wider",
    "narrow": "narrower",
    "near": "nearer",
    "far": "farther",
}
# Orders in which things may be alike; of several one may be called the middle one, and is not seen to be.
_MEASURED = frozenset({*_COMPARED, "left", "right"})
_LESS = frozenset({"small", "short", "narrow", "near"})
_ARTICLES = frozenset({"the", "a", "an", "any", "some", "these", "those", "all", "of", "one"})
# Ratio up to which two sizes count as one. Chosen: what cannot be told by eye.
_SAME = 0.02
# Words for shapes, and for what fills things and is not seen as such.
_SHAPES = frozenset({"orb", "cuboid", "container", "receptacle", "tin", "bead"}).union(
    *(shape.nouns for shape in shapes().values())
)
_STUFF = KINDS_OF["drink"] | {"coffee", "tea", "cream", "sand", "drink"}
_THINGS = frozenset({"thing", "object", "item", "piece", "stuff", "thingy"})
_ANYTHING = Ref(text="things", determiner="a", nouns=("thing",), plural=True)


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer to a question.

    Attributes:
        text: A sentence or two.
        about: Ids of what it speaks of: what "it" may refer to then.
    """

    text: str
    about: tuple[str, ...] = ()


class _NotSeenError(Exception):
    """A question that what is seen does not settle."""


def answered(
    prompt: str, scene: ObservedScene, discourse: Discourse, skills: Sequence[str], told: str = ""
) -> Answer | Refusal | None:
    """Return the answer to a question.

    Args:
        prompt: What was said.
        scene: What perception sees.
        discourse: What was spoken of before.
        skills: What the robot can do.
        told: What came of the last order, as a sentence; "" before the first.

    Returns:
        None for what is no question that is known here; a refusal where it asks for what is not there or may be several things.
    """
    asked = questions_in(ENGLISH, prompt, tuple(item.id for item in scene.objects))
    if isinstance(asked, Refusal):
        return asked
    refusal: Refusal | None = None
    for question in asked:
        try:
            return _Answers(scene, discourse, skills, told).reply(question)
        except RefusedError as error:
            refusal = refusal or error.refusal
        except _NotSeenError as error:
            return Answer(str(error))
    return refusal


class _Answers:
    """The answers to questions, by what they ask.

    Args:
        scene: What perception sees.
        discourse: What was spoken of before.
        skills: What the robot can do.
        told: What came of the last order.
    """

    def __init__(self, scene: ObservedScene, discourse: Discourse, skills: Sequence[str], told: str) -> None:
        self._scene = scene
        self._view = View.of(scene)
        self._ground = Grounder(World(scene), discourse)
        self._skills = skills
        self._told = told

    def reply(self, asked: Question) -> Answer:
        """Return the answer to a question.

        Raises:
            RefusedError: A word of it names nothing that can be perceived, or it asks for what is not there or may be several things.
        """
        strange = unseen(asked) or tuple(self._strange(asked))
        if strange:
            raise cannot_see(strange)
        if any(ref.options for ref in (*asked.things, *asked.others)):
            raise RefusedError(RefusalCode.UNSUPPORTED, "Ask about one of them at a time.")
        answer: Answer = getattr(self, f"_say_{asked.about}")(asked)
        return answer

    def _strange(self, asked: Question) -> Iterable[str]:
        """Yield the nouns that nothing is seen to be: anything may be called a toy, and a can is no coke can to the eye."""
        told = [ref for ref in (asked.what, asked.so) if ref is not None]
        for ref in (*asked.things, *asked.others, *told):
            for noun in sorted({noun for one in (ref, *ref.options) for noun in one.nouns}):
                kind = NOUN_CLASS.get(noun, noun)
                shown = noun in _SHAPES or (kind == noun and noun not in _STUFF)
                named = any(noun_fit(noun, item) == NAMED for item in self._scene.objects)
                if (kind == "thing" and noun not in _THINGS) or (
                    ref in told and not (shown or named or kind == "thing")
                ):
                    yield noun

    # What descriptions mean, and what is true of a thing.

    def _meant(self, refs: Iterable[Ref]) -> list[DetectedObject]:
        """Return the things that descriptions mean.

        Raises:
            RefusedError: One means nothing that is seen, or may mean several things.
        """
        told = [self._among_all(ref) for ref in with_nouns(tuple(refs))]
        names = [name for ref in told for name in self._ground.many(ref, lambda name: True).ids]
        return [self._view.get(name) for name in dict.fromkeys(names)]

    def _among_all(self, ref: Ref) -> Ref:
        """Return "the biggest thing" as one of all things: who asks for things means bins too, who orders does not."""
        if not (ref.ranks and ref.nouns and {*ref.nouns} <= _THINGS):
            return ref
        items = self._such(replace(ref, ranks=(), determiner="all"))
        return replace(ref, relations=(), options=tuple(Ref(text=item.id, names=(item.id,)) for item in items))

    def _such(self, ref: Ref) -> list[DetectedObject]:
        """Return everything that a description is true of; none where it is true of nothing that is seen."""
        if ref.determiner == "it":
            return [item for item in self._meant((ref,)) if self._is(item, replace(ref, determiner="a"))]
        plain = replace(ref, determiner="all", plural=True, number=None, relations=())
        bare = replace(plain, text="", nouns=(), colours=(), one=False, not_colours=()) == Ref("", "all", plural=True)
        if bare and {*ref.nouns} <= _THINGS:
            colours, other = ref.colours, ref.not_colours
            items = [item for item in self._scene.objects if not colours or colour_of(item) in colours]
            found = [item for item in items if colour_of(item) not in other]
        else:
            found = [self._view.get(name) for name in self._ground.fitting(plain)]
        for relation in ref.relations:
            for vessel in self._meant(relation.refs) if relation.kind == "in" else ():
                _held_in(vessel)
            if relation.kind in ("empty", "full"):
                found = [item for item in found if item.shape.holds_things] or found
        found = [item for item in found if all(self._holds(item, relation) for relation in ref.relations)]
        under = [each for relation in ref.relations if relation.kind == "under" for each in self._meant(relation.refs)]
        if under and not found:
            raise RefusedError(
                RefusalCode.UNSUPPORTED, f"I do not see what is under {listed(_ids(under))}.", _ids(under)
            )
        return found

    def _looked_for(self, ref: Ref) -> list[DetectedObject]:
        """As `_such`, for things that are asked for by shape, or by a name that something here has.

        Raises:
            RefusedError: Nothing is seen to be called so: that there is none cannot be told.
        """
        found = self._such(ref)
        kinds = {NOUN_CLASS.get(noun, noun) for noun in ref.nouns if noun not in _SHAPES}
        if not found and not kinds <= {"thing", *SHAPE_KINDS, *THING_KINDS}:
            seen = listed(_ids(self._scene.objects))
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"I see {_none(ref.text)}; I see {seen}.")
        return found

    def _is(self, item: DetectedObject, so: Ref) -> bool:
        """Say whether a description is true of a thing."""
        if so.ranks:
            alike = self._ranked(replace(so, determiner="the"))
            if len(alike) > 1 and item in alike and not so.plural:
                raise _NotSeenError(f"{listed(_ids(alike))} are alike in that.")
            return item in alike
        if so.nouns or so.names or so.shapes or so.measures:
            return item in self._such(so)
        colour = colour_of(item)
        right = (not so.colours or colour in so.colours) and colour not in so.not_colours
        return right and all(self._holds(item, relation) for relation in so.relations)

    def _holds(self, item: DetectedObject, relation: Relation) -> bool:
        kind = relation.kind
        if kind == "held":
            return item.id == self._scene.held
        if kind in ("reach", "beyond"):
            return self._reaches(item) == (kind == "reach")
        if kind in ("open", "closed"):
            return self._opening(item, kind)[0]
        if kind in ("empty", "full"):
            _held_in(item)
        if kind == "full":
            raise _NotSeenError(self._contents(item)[0])
        if kind in ("empty", "upright"):
            return self._surely(fact(kind, item.id), item)
        if kind in ("on", "in") and not relation.refs:
            return location_of(self._scene, item) == fact("on", item.id, TABLE)
        if kind == "than" and relation.order in ("near", "far"):
            return self._exceeds(item, relation)
        if kind in ("on", "in", *SIDE_AXES, "beside"):
            return any(self._stands(item, kind, other) for other in self._meant(relation.refs) if other is not item)
        return self._ground.stands(item.id, relation, Ref(text=item.id))

    def _stands(self, item: DetectedObject, kind: str, other: DetectedObject) -> bool:
        """Say whether a thing is on, in, beside or on a side of another."""
        at = side_of(item, other)
        if kind in SIDE_AXES:
            return at == kind
        if kind == "beside":
            return bool(at) and find(fact("beside", item.id, other.id, at), self._view).holds
        if kind == "on":
            return self._surely(fact("on", item.id, other.id), item)
        if not other.shape.holds_things:
            return False
        within = any(name == item.id for name, _ in contents(self._scene.objects, other))
        return within or self._surely(fact("inside", item.id, other.id), item)

    def _exceeds(self, item: DetectedObject, relation: Relation) -> bool:
        """As in "closer to the bin than the ball"."""
        near, far = self._distances(item, relation)
        if abs(near - far) <= _SAME * max(near, far):
            raise _NotSeenError(f"Neither: {self._farness(item, relation)}")
        return (near < far) == (relation.order == "near")

    def _distances(self, item: DetectedObject, relation: Relation) -> list[float]:
        (other, *anchors) = self._meant(relation.refs)
        both = (item, other)
        return [apart(each, anchors[0]) if anchors else from_base(self._scene, each) for each in both]

    def _farness(self, item: DetectedObject, relation: Relation) -> str:
        (other, *anchors), (one, two) = self._meant(relation.refs), self._distances(item, relation)
        origin = anchors[0].id if anchors else "my base"
        return f"{item.id} is {length(one)} from {origin}, {other.id} {length(two)}."

    def _ranked(self, ref: Ref) -> list[DetectedObject]:
        """Return what comes first in an order; several where they are alike in that."""
        try:
            return self._meant((ref,))
        except RefusedError as error:
            alike = error.refusal.candidates
            told = ref.ranks and all(rank.key in _MEASURED for rank in ref.ranks)
            if error.refusal.code is not RefusalCode.AMBIGUOUS or not alike or not told:
                raise
            return [self._view.get(name) for name in alike]

    def _surely(self, what: Fact, item: DetectedObject) -> bool:
        finding = find(what, self._view)
        if not finding.is_sure:
            if what.relation == "empty":
                raise _NotSeenError(f"I cannot see what is in {item.id}.")
            raise _NotSeenError(f"I cannot tell for sure. {whereabouts(self._scene, item)}")
        return finding.holds

    def _reaches(self, item: DetectedObject) -> bool:
        """Say whether the hand gets to a thing, as every skill asks before it moves.

        Raises:
            RefusedError: It is at a distance where only the arm's kinematics tell, which are not asked here.
        """
        if in_easy_reach(self._scene, item):
            return True
        if find(fact("reachable", item.id), self._view).holds:
            far = length(from_base(self._scene, item))
            told = f"{item.id} is {far} from my base, at the edge of my reach: an order to pick it up would show."
            raise RefusedError(RefusalCode.UNSUPPORTED, told, (item.id,))
        return False

    def _opening(self, item: DetectedObject, state: str = "open") -> tuple[bool, str]:
        """Return whether a thing is open, or closed, and how far each of its doors is open."""
        inner = [each for each in self._scene.objects if is_part(each) and each.id.startswith(f"{item.id}.")]
        doors = [item] if is_part(item) else inner
        if doors:
            told = "; ".join(f"{door.id} is {max(0.0, open_share(door)):.0%} open" for door in doors)
            return all(find(fact(state, door.id), self._view).holds for door in doors), f"{told}."
        if not item.shape.opens:
            raise _NotSeenError(f"{item.id} neither opens nor closes.")
        if item.opening is None:
            raise _NotSeenError(f"I cannot see how far {item.id} is open.")
        return find(fact(state, item.id), self._view).holds, f"{item.id} is {1e3 * abs(item.opening):.0f} mm open."

    # What there is.

    def _say_all(self, asked: Question) -> Answer:
        told = [f"{item.id} is {place(self._scene, item)}" for item in self._scene.objects]
        return Answer("; ".join(told) + "." if told else "I see nothing.", _ids(self._scene.objects))

    def _say_colours(self, asked: Question) -> Answer:
        colours = tuple(dict.fromkeys(item.colour for item in self._scene.objects))
        return Answer(f"{len(colours)}: {listed(colours)}.")

    def _say_count(self, asked: Question) -> Answer:
        what = _with(asked.what or _ANYTHING, asked.so)
        found = self._looked_for(what)
        if not found:
            return Answer(f"None: I see {_none(what.text)}.")
        if any(item.shape.is_granular and not item.grains for item in found):
            return Answer(f"I see {listed(_ids(found))} and cannot count them.", _ids(found))
        vessels = [each for relation in what.relations if relation.kind == "in" for each in self._meant(relation.refs)]
        within = [name for vessel in vessels for name, _ in contents(self._scene.objects, vessel)]
        number = sum(
            within.count(item.id) if item.shape.is_granular and vessels else len(loose(item)) for item in found
        )
        return Answer(f"{number}: {listed(_ids(found))}.", _ids(found))

    def _say_more(self, asked: Question) -> Answer:
        assert asked.what is not None
        what, than = with_nouns((asked.what, *asked.others)[::-1])[::-1]
        ours, theirs = self._such(what), self._such(than)
        more = (len(ours) > len(theirs)) - (len(ours) < len(theirs))
        holds = more == {"more": 1, "fewer": -1, "as many": 0}[asked.by]
        told = f"{len(ours)} {_bare(what.text)}, {len(theirs)} {_bare(than.text)}"
        return Answer(f"{'Yes' if holds else 'No'}: {told}.", _ids((*ours, *theirs)))

    def _say_there(self, asked: Question) -> Answer:
        what = _with(asked.what or _ANYTHING, asked.so)
        found, bound = self._looked_for(what), asked.bound
        if any(relation.kind == "held" for relation in what.relations):
            return Answer(f"{'Yes' if found else 'No'}: {self._held()}", _ids(found))
        if bound is not None and bound.none:
            return Answer(f"{'No' if found else 'Yes'}: I see {listed(_ids(found)) if found else 'none'}.", _ids(found))
        if not found:
            for vessel in (each for rel in what.relations if rel.kind == "in" for each in self._meant(rel.refs)):
                self._contents(vessel)
            return Answer(f"No: I see {_none(what.text)}; I see {listed(_ids(self._scene.objects))}.")
        number = what.number or (bound.least if bound and (bound.loose or bound.least != 1) else None)
        most = bound.most if bound else None
        enough = number is None or (len(found) == number if bound is None or bound.loose else len(found) >= number)
        holds = enough and (most is None or len(found) <= most)
        return Answer(f"{'Yes' if holds else f'No, {len(found)}'}: {listed(_ids(found))}.", _ids(found))

    def _say_which(self, asked: Question) -> Answer:
        so, what = asked.so, asked.what
        assert so is not None
        both = _with(what or _ANYTHING, so)
        if so.ranks:
            one = replace(both, determiner="the", plural=both.plural and so.plural)
            return self._say_what(changed(asked, things=(one,)))
        relation = (*so.relations, Relation(""))[0]
        kind = relation.kind
        if kind == "held" and what is None:
            return Answer(self._held(), (self._scene.held,) if self._scene.held else ())
        vessels = self._meant(relation.refs) if kind == "in" else []
        if what is None and len(vessels) == 1:
            return Answer(*self._contents(vessels[0]))
        near = Ref(text=so.text, relations=so.relations)
        among = self._looked_for(_with(what or _ANYTHING, near if kind else None))
        found = [item for item in among if self._is(item, replace(so, relations=()))]
        there = self._where(relation, so.text)
        if not found and kind and (what is None or {*what.nouns} <= _THINGS):
            return Answer(f"Nothing is {there}.")
        if not found:
            return Answer(f"None: I see {_none(f'{what.text} {there}' if what and kind else both.text)}.")
        if not kind:
            return Answer(self._described(found), _ids(found))
        if kind in (*SIDE_AXES, "beside"):
            (other, *_) = self._meant(relation.refs)
            found.sort(key=lambda item: gap(other, item))
        return Answer(f"{listed(_ids(found))} {be(_ids(found))} {there}.", _ids(found))

    def _held(self) -> str:
        return f"I hold {self._scene.held or 'nothing: the gripper is empty'}."

    def _where(self, relation: Relation, text: str) -> str:
        """Return a place phrase with the ids of what it is told by."""
        kind = relation.kind
        if relation.refs and (kind in _THERE or kind in ("on", "in", "between")):
            return f"{_THERE.get(kind, kind)} {listed(_ids(self._meant(relation.refs)))}"
        return "on the table" if kind in ("on", "in") and not relation.refs else _THERE.get(kind, text)

    def _contents(self, item: DetectedObject) -> tuple[str, tuple[str, ...]]:
        """Return what is in a thing, as a sentence and as ids."""
        _held_in(item)
        inside = [name for name, _ in contents(self._scene.objects, item)]
        if not inside:
            self._surely(fact("empty", item.id), item)
        names = tuple(dict.fromkeys(inside))
        told = [f"{inside.count(name)} {name}" if self._view.get(name).shape.is_granular else name for name in names]
        return f"{listed(told)} {be(inside)} in {item.id}." if names else f"Nothing is in {item.id}.", names

    # How things are.

    def _described(self, items: Iterable[DetectedObject]) -> str:
        return " ".join(description(self._scene, item) for item in items)

    def _say_where(self, asked: Question) -> Answer:
        found = self._meant(asked.things)
        return Answer(" ".join(whereabouts(self._scene, item) for item in found), _ids(found))

    def _say_what(self, asked: Question) -> Answer:
        one, *more = asked.things
        found = self._meant(asked.things) if more else self._ranked(one)
        if len(found) > 1 and one.ranks and not one.plural and one.determiner == "the":
            return Answer(f"{listed(_ids(found))} are alike in that.", _ids(found))
        return Answer(self._described(found), _ids(found))

    def _say_whether(self, asked: Question) -> Answer:
        so = asked.so
        assert so is not None
        if len(asked.things) == 1 and asked.things[0].determiner == "a" and not (so.nouns or so.names or so.ranks):
            found = self._say_there(changed(asked, what=replace(asked.things[0], number=None)))
            return changed(found, text=found.text.replace("Yes: ", "Yes: I see "))
        items = self._meant(asked.things)
        strange = [n for n in so.nouns if NOUN_CLASS.get(n, n) not in {"thing", *SHAPE_KINDS, *THING_KINDS}]
        if strange and not self._such(so):
            raise cannot_see(strange)
        holds = all([self._is(item, so) != asked.denied for item in items])
        return Answer(f"{'Yes' if holds else 'No'}: {self._evidence(items, so)}", _ids(items))

    def _evidence(self, items: Sequence[DetectedObject], so: Ref) -> str:
        """Return what is seen of things that a description is said of."""
        if not so.relations:
            return self._described(items)
        relation = so.relations[0]
        kind = relation.kind
        if kind in ("open", "closed"):
            return " ".join(self._opening(item)[1] for item in items)
        if kind == "empty":
            return " ".join(self._contents(item)[0] for item in items)
        others = self._meant(relation.refs) if kind in (*SIDE_AXES, "beside") else []
        if others:
            return " ".join(self._beside(item, other, kind) for item in items for other in others)
        if kind == "than" and relation.order in ("near", "far"):
            return " ".join(self._farness(item, relation) for item in items)
        if kind in ("reach", "beyond"):
            return " ".join(whereabouts(self._scene, item) for item in items)
        return " ".join(
            f"{item.id} {'are' if item.shape.is_plural else 'is'} {place(self._scene, item)}." for item in items
        )

    def _beside(self, item: DetectedObject, other: DetectedObject, kind: str) -> str:
        at = side_of(item, other)
        if kind == "beside":
            return f"{length(max(gap(item, other), 0.0))} lie between {item.id} and {other.id}."
        if not at:
            return f"{item.id} and {other.id} are at one place seen from above."
        far = abs(float((centre(item) - centre(other))[:2] @ np.array(SIDE_AXES[at])))
        return f"{item.id} is {length(far)} {_THERE[at]} {other.id}."

    def _say_opening(self, asked: Question) -> Answer:
        (item,) = self._meant(asked.things)
        is_open, told = self._opening(item)
        return Answer(f"{'Open' if is_open else 'Closed'}: {told}", (item.id,))

    # Sizes and distances.

    def _say_compared(self, asked: Question) -> Answer:
        one, two = self._two(asked)
        if asked.by in ("near", "far"):
            relation = Relation("than", (Ref(text=two.id, names=(two.id,)), *asked.others), order=asked.by)
            (first, second), told = self._distances(one, relation), self._farness(one, relation)
        else:
            first, second = (measure(item, _COMPARED[asked.by]) for item in (one, two))
            told = f"{one.id} measures {size(one)}, {two.id} {size(two)}."
        if abs(first - second) <= _SAME * max(first, second):
            return Answer(f"Neither: {told}", (one.id, two.id))
        winner = one if (first < second) == (asked.by in _LESS) else two
        return Answer(f"{winner.id} is {_COMPARED[asked.by]}: {told}", (winner.id,))

    def _say_alike(self, asked: Question) -> Answer:
        found = self._meant(asked.things)
        if len(found) < 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"{listed(_ids(found))}: alike to what?", _ids(found))
        sizes = [bounds(item)[1] - bounds(item)[0] for item in found]
        height = asked.by == "height"
        same = all(np.allclose(each[2 * height :], sizes[0][2 * height :], rtol=_SAME) for each in sizes)
        same = len({item.colour for item in found}) == 1 if asked.by == "colour" else same
        return Answer(f"{'Yes' if same else 'No'}: {self._described(found)}", _ids(found))

    def _say_far(self, asked: Question) -> Answer:
        found = self._meant(asked.things)
        if len(found) == 1:
            return Answer(
                f"{found[0].id} is {length(from_base(self._scene, found[0]))} from the robot's base.", _ids(found)
            )
        one, two = self._two(asked)
        far, between = length(apart(one, two)), length(max(gap(one, two), 0.0))
        told = f"{one.id} is {far} from {two.id}"
        told = f"{one.id} and {two.id} are {far} apart" if asked.by == "apart" else told
        return Answer(f"{told}, centre to centre; {between} lie between them.", (one.id, two.id))

    def _two(self, asked: Question) -> tuple[DetectedObject, DetectedObject]:
        """Return the two things of a question.

        Raises:
            RefusedError: There are not two.
        """
        found = self._meant(asked.things)
        if len(found) != 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which two do you mean by “{asked.text}”?", _ids(found))
        return found[0], found[1]

    def _say_fits(self, asked: Question) -> Answer:
        item, vessel = self._two(asked)
        if not vessel.shape.holds_things:
            return Answer(f"{vessel.id} holds nothing: it is {vessel.shape.name}.", (item.id,))
        if item.shape.is_granular:
            told = f"I cannot see how much room {item.id} take up in all."
            raise RefusedError(RefusalCode.UNSUPPORTED, told, (item.id,))
        fits = World(self._scene).fits_in(item.id, vessel.id)
        sizes = f"{item.id} measures {size(item)}, {vessel.id} {size(vessel)}."
        return Answer(f"{'Yes' if fits else 'No'}: {sizes}", (item.id,))

    # The robot itself.

    def _say_abilities(self, asked: Question) -> Answer:
        own = ", ".join(name.replace("_", " ") for name in self._skills)
        return Answer(f"My skills are {own}. I also say where things are, how many, how big and how far apart.")

    def _say_able(self, asked: Question) -> Answer:
        return Answer(f"{'Yes' if asked.by == 'able' else 'No'}: {self._say_abilities(asked).text}")

    def _say_last(self, asked: Question) -> Answer:
        return Answer(self._told or "Nothing was done yet.")


def _with(what: Ref, so: Ref | None) -> Ref:
    """Return a description that says what another says besides."""
    if so is None:
        return what
    lists = ("relations", "ranks", "colours", "not_colours", "shapes", "measures")
    added = {name: (*getattr(what, name), *getattr(so, name)) for name in lists}
    said, told = _bare(what.text), _bare(so.text)
    text = f"{said} {told}" if so.relations or said.endswith("thing") else f"{told} {said}"
    return replace(what, text=text, nouns=so.nouns or what.nouns, **added)


def _held_in(vessel: DetectedObject) -> None:
    """Refuse to tell what is in a thing that holds nothing."""
    if not vessel.shape.holds_things:
        told = f"{vessel.id} is {vessel.shape.name}, which is no container; I see it from outside."
        raise RefusedError(RefusalCode.UNSUPPORTED, told, (vessel.id,))


def _ids(items: Iterable[DetectedObject]) -> tuple[str, ...]:
    return tuple(item.id for item in items)


def _bare(text: str) -> str:
    """Return a description without the articles at its head."""
    words = text.split()
    while words[:1] and words[0] in _ARTICLES:
        words = words[1:]
    return " ".join(words)


def _none(text: str) -> str:
    """Return that there is nothing as a description tells: "no red cans", "nothing on the table"."""
    words = _bare(text).split()
    return " ".join(["nothing", *words[1:]] if words[:1] in (["anything"], ["something"]) else ["no", *words])
