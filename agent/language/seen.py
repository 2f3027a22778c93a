"""Meaning of the descriptions in a question: which things are such, and what is true of a thing, by relations and measurements."""

from __future__ import annotations

from collections.abc import Iterable

from robosandbox.agent.language.binding import with_nouns
from robosandbox.agent.language.describing import apart, be, from_base, length, side_of, whereabouts
from robosandbox.agent.language.discourse import Discourse, RefusedError, listed
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Ref, Relation, replace
from robosandbox.agent.language.logic import Question
from robosandbox.agent.language.match import NAMED, NOUN_CLASS, SHAPE_KINDS, THING_KINDS, colour_of, noun_fit
from robosandbox.agent.language.things import KINDS_OF
from robosandbox.agent.language.world import World
from robosandbox.shapes import shapes
from robosandbox.types import SIDE_AXES, DetectedObject, ObservedScene, RefusalCode
from robosandbox.world.contracts import find
from robosandbox.world.facts import TABLE, Fact, fact
from robosandbox.world.locations import location_of
from robosandbox.world.parts import is_part, open_share
from robosandbox.world.placement_sampling import in_easy_reach
from robosandbox.world.predicate import View
from robosandbox.world.relations import contents

COMPARED = {
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
_MEASURED = frozenset({*COMPARED, "left", "right"})
_ARTICLES = frozenset({"the", "a", "an", "any", "some", "these", "those", "all", "of", "one"})
# Ratio up to which two sizes count as one. Chosen: what cannot be told by eye.
SAME = 0.02
# Words for shapes, and for what fills things and is not seen as such.
_SHAPES = frozenset({"orb", "cuboid", "container", "receptacle", "tin", "bead"}).union(
    *(shape.nouns for shape in shapes().values())
)
_STUFF = KINDS_OF["drink"] | {"coffee", "tea", "cream", "sand", "drink"}
THINGS = frozenset({"thing", "object", "item", "piece", "stuff", "thingy"})


class NotSeenError(Exception):
    """A question that what is seen does not settle."""


class Seen:
    """View of a scene for the things that a question speaks of.

    Args:
        scene: What perception sees.
        discourse: What was spoken of before.
    """

    def __init__(self, scene: ObservedScene, discourse: Discourse) -> None:
        self._scene = scene
        self._view = View.of(scene)
        self._ground = Grounder(World(scene), discourse)

    def _strange(self, asked: Question) -> Iterable[str]:
        """Yield the nouns that nothing is seen to be: anything may be called a toy, and a can is no coke can to the eye."""
        told = [ref for ref in (asked.what, asked.so) if ref is not None]
        for ref in (*asked.things, *asked.others, *told):
            for noun in sorted({noun for one in (ref, *ref.options) for noun in one.nouns}):
                kind = NOUN_CLASS.get(noun, noun)
                shown = noun in _SHAPES or (kind == noun and noun not in _STUFF)
                named = any(noun_fit(noun, item) == NAMED for item in self._scene.objects)
                if (kind == "thing" and noun not in THINGS) or (
                    ref in told and not (shown or named or kind == "thing")
                ):
                    yield noun

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
        if not (ref.ranks and ref.nouns and {*ref.nouns} <= THINGS):
            return ref
        items = self._such(replace(ref, ranks=(), determiner="all"))
        return replace(ref, relations=(), options=tuple(Ref(text=item.id, names=(item.id,)) for item in items))

    def _such(self, ref: Ref) -> list[DetectedObject]:
        """Return everything that a description is true of; none where it is true of nothing that is seen."""
        if ref.determiner == "it":
            return [item for item in self._meant((ref,)) if self._is(item, replace(ref, determiner="a"))]
        plain = replace(ref, determiner="all", plural=True, number=None, relations=())
        bare = replace(plain, text="", nouns=(), colours=(), one=False, not_colours=()) == Ref("", "all", plural=True)
        if bare and {*ref.nouns} <= THINGS:
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
                RefusalCode.UNSUPPORTED, f"I do not see what is under {listed(ids_of(under))}.", ids_of(under)
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
            seen = listed(ids_of(self._scene.objects))
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, f"I see {none_of(ref.text)}; I see {seen}.")
        return found

    def _is(self, item: DetectedObject, so: Ref) -> bool:
        """Say whether a description is true of a thing."""
        if so.ranks:
            alike = self._ranked(replace(so, determiner="the"))
            if len(alike) > 1 and item in alike and not so.plural:
                raise NotSeenError(f"{listed(ids_of(alike))} are alike in that.")
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
            raise NotSeenError(self._contents(item)[0])
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
        if abs(near - far) <= SAME * max(near, far):
            raise NotSeenError(f"Neither: {self._farness(item, relation)}")
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
                raise NotSeenError(f"I cannot see what is in {item.id}.")
            raise NotSeenError(f"I cannot tell for sure. {whereabouts(self._scene, item)}")
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
            raise NotSeenError(f"{item.id} neither opens nor closes.")
        if item.opening is None:
            raise NotSeenError(f"I cannot see how far {item.id} is open.")
        return find(fact(state, item.id), self._view).holds, f"{item.id} is {1e3 * abs(item.opening):.0f} mm open."

    def _contents(self, item: DetectedObject) -> tuple[str, tuple[str, ...]]:
        """Return what is in a thing, as a sentence and as ids."""
        _held_in(item)
        inside = [name for name, _ in contents(self._scene.objects, item)]
        if not inside:
            self._surely(fact("empty", item.id), item)
        names = tuple(dict.fromkeys(inside))
        told = [f"{inside.count(name)} {name}" if self._view.get(name).shape.is_granular else name for name in names]
        return f"{listed(told)} {be(inside)} in {item.id}." if names else f"Nothing is in {item.id}.", names


def _held_in(vessel: DetectedObject) -> None:
    """Refuse to tell what is in a thing that holds nothing."""
    if not vessel.shape.holds_things:
        told = f"{vessel.id} is {vessel.shape.name}, which is no container; I see it from outside."
        raise RefusedError(RefusalCode.UNSUPPORTED, told, (vessel.id,))


def ids_of(items: Iterable[DetectedObject]) -> tuple[str, ...]:
    """Return the ids of things."""
    return tuple(item.id for item in items)


def without_articles(text: str) -> str:
    """Return a description without the articles at its head."""
    words = text.split()
    while words[:1] and words[0] in _ARTICLES:
        words = words[1:]
    return " ".join(words)


def none_of(text: str) -> str:
    """Return that there is nothing as a description tells: "no red cans", "nothing on the table"."""
    words = without_articles(text).split()
    return " ".join(["nothing", *words[1:]] if words[:1] in (["anything"], ["something"]) else ["no", *words])
