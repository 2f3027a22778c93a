"""Answers to questions about what is seen, from the relations and measurements that plans are checked with; nothing moves for them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace as changed

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
from robosandbox.agent.language.intent import Ref, Relation, replace, unseen
from robosandbox.agent.language.logic import Question
from robosandbox.agent.language.match import NOUN_CLASS, SHAPE_KINDS, THING_KINDS
from robosandbox.agent.language.seen import (
    COMPARED,
    SAME,
    THINGS,
    NotSeenError,
    Seen,
    ids_of,
    none_of,
    without_articles,
)
from robosandbox.agent.language.world import World
from robosandbox.types import SIDE_AXES, ArmState, Array, DetectedObject, ObservedScene, Refusal, RefusalCode
from robosandbox.values import frozen
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
# Where one question ends and another one begins.
_AND_ASKED = re.compile(
    r"[?.]\s+(?:and\s+)?|,?\s+and\s+(?=(?:what|which|how|where|are|is|do|does|did|can|have)\b)", re.IGNORECASE
)
# What is asked of the robot itself: "it", behind such a question, is its hand.
_OWN = frozenset(
    {"hand", "grip", "pointing", "joints", "last", "poses", "speed", "widest", "which", "joint_count", "moved"}
)
_IT = re.compile(r"\b(?:it|they|them)\b(?! (?:work|succeed|go|fail)\b)", re.IGNORECASE)
_LESS = frozenset({"small", "short", "narrow", "near"})
# How near the gripper is to open or closed, of the way between them, to be called so; and the speed of a joint that stands, rad/s.
_ALMOST, _STANDS = 0.05, 0.01
# Degrees off straight down that nobody sees.
_UPRIGHT = 0.5
_ANYTHING = Ref(text="things", determiner="a", nouns=("thing",), plural=True)


# Metres that a thing seems to move when nothing moves it: more than pixels err by.
_UNMOVED = 0.005


@frozen
class Past:
    """The last order and what came of it, for questions about it.

    Attributes:
        told: What came of the last order, as a sentence; "" before the first.
        prompt: The last order that was planned; "" before the first.
        scene: What was seen before it; None before the first.
    """

    told: str = ""
    prompt: str = ""
    scene: ObservedScene | None = None


@frozen
class Answer:
    """Answer to a question.

    Attributes:
        text: A sentence or two.
        about: Ids of what it speaks of: what "it" may refer to then.
    """

    text: str
    about: tuple[str, ...] = ()


NOTHING_YET = Past()


def answered(
    prompt: str, scene: ObservedScene, discourse: Discourse, skills: Sequence[str], past: Past = NOTHING_YET
) -> Answer | Refusal | None:
    """Return the answer to a question.

    Args:
        prompt: What was said.
        scene: What perception sees.
        discourse: What was spoken of before.
        skills: What the robot can do.
        past: What went before.

    Returns:
        None for what is no question that is known here; a refusal where it asks for what is not there or may be several things.
    """
    ids = tuple(item.id for item in scene.objects)
    asked = questions_in(ENGLISH, prompt, ids)
    if not asked or isinstance(asked, Refusal):
        # "how high is your hand, and which cube is nearest to it?"
        parts = _several_asked(prompt, ids)
        answers = [answered(part, scene, discourse, skills, past) for part in parts]
        said = [answer for answer in answers if isinstance(answer, Answer)]
        if said and len(said) == len(parts):
            about = tuple(name for answer in said for name in answer.about)
            return Answer(" ".join(dict.fromkeys(answer.text for answer in said)), about)
    if isinstance(asked, Refusal):
        return asked
    refusal: Refusal | None = None
    for question in asked:
        try:
            return _Answers(scene, discourse, skills, past).reply(question)
        except RefusedError as error:
            refusal = refusal or error.refusal
        except NotSeenError as error:
            return Answer(str(error))
    return refusal


def _several_asked(prompt: str, ids: tuple[str, ...]) -> list[str]:
    """Return the questions of a prompt, where it is made of several about the robot itself; nothing where it is not."""
    parts = [part for part in _AND_ASKED.split(prompt) if part.strip()]
    parts = [_IT.sub("your hand", part) if k else part for k, part in enumerate(parts)]
    read = [questions_in(ENGLISH, part, ids) for part in parts]
    known = all(asked and not isinstance(asked, Refusal) for asked in read)
    own = known and all(not isinstance(asked, Refusal) and asked[0].about in _OWN for asked in read[:1])
    return parts if len(parts) > 1 and own else []


def _millimetres(way: Array) -> str:
    return f"{1000.0 * float(np.linalg.norm(way)):.0f} mm"


class _Answers(Seen):
    """The answers to questions, by what they ask.

    Args:
        scene: What perception sees.
        discourse: What was spoken of before.
        skills: What the robot can do.
        past: What went before.
    """

    def __init__(self, scene: ObservedScene, discourse: Discourse, skills: Sequence[str], past: Past) -> None:
        super().__init__(scene, discourse)
        self._skills = skills
        self._past = past

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

    # What there is.

    def _say_all(self, asked: Question) -> Answer:
        told = [f"{item.id} is {place(self._scene, item)}" for item in self._scene.objects]
        return Answer("; ".join(told) + "." if told else "I see nothing.", ids_of(self._scene.objects))

    def _say_colours(self, asked: Question) -> Answer:
        colours = tuple(dict.fromkeys(item.colour for item in self._scene.objects))
        return Answer(f"{len(colours)}: {listed(colours)}.")

    def _say_count(self, asked: Question) -> Answer:
        what = _with(asked.what or _ANYTHING, asked.so)
        found = self._looked_for(what)
        if not found:
            return Answer(f"None: I see {none_of(what.text)}.")
        if any(item.shape.is_granular and not item.grains for item in found):
            return Answer(f"I see {listed(ids_of(found))} and cannot count them.", ids_of(found))
        vessels = [each for relation in what.relations if relation.kind == "in" for each in self._meant(relation.refs)]
        within = [name for vessel in vessels for name, _ in contents(self._scene.objects, vessel)]
        number = sum(
            within.count(item.id) if item.shape.is_granular and vessels else len(loose(item)) for item in found
        )
        return Answer(f"{number}: {listed(ids_of(found))}.", ids_of(found))

    def _say_more(self, asked: Question) -> Answer:
        assert asked.what is not None
        what, than = with_nouns((asked.what, *asked.others)[::-1])[::-1]
        ours, theirs = self._such(what), self._such(than)
        more = (len(ours) > len(theirs)) - (len(ours) < len(theirs))
        holds = more == {"more": 1, "fewer": -1, "as many": 0}[asked.by]
        told = f"{len(ours)} {without_articles(what.text)}, {len(theirs)} {without_articles(than.text)}"
        return Answer(f"{'Yes' if holds else 'No'}: {told}.", ids_of((*ours, *theirs)))

    def _say_there(self, asked: Question) -> Answer:
        what = _with(asked.what or _ANYTHING, asked.so)
        found, bound = self._looked_for(what), asked.bound
        if any(relation.kind == "held" for relation in what.relations):
            return Answer(f"{'Yes' if found else 'No'}: {self._held()}", ids_of(found))
        if bound is not None and bound.none:
            return Answer(
                f"{'No' if found else 'Yes'}: I see {listed(ids_of(found)) if found else 'none'}.", ids_of(found)
            )
        if not found:
            for vessel in (each for rel in what.relations if rel.kind == "in" for each in self._meant(rel.refs)):
                self._contents(vessel)
            return Answer(f"No: I see {none_of(what.text)}; I see {listed(ids_of(self._scene.objects))}.")
        number = what.number or (bound.least if bound and (bound.loose or bound.least != 1) else None)
        most = bound.most if bound else None
        enough = number is None or (len(found) == number if bound is None or bound.loose else len(found) >= number)
        holds = enough and (most is None or len(found) <= most)
        return Answer(f"{'Yes' if holds else f'No, {len(found)}'}: {listed(ids_of(found))}.", ids_of(found))

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
        if not found and kind and (what is None or {*what.nouns} <= THINGS):
            return Answer(f"Nothing is {there}.")
        if not found:
            return Answer(f"None: I see {none_of(f'{what.text} {there}' if what and kind else both.text)}.")
        if not kind:
            return Answer(self._described(found), ids_of(found))
        if kind in (*SIDE_AXES, "beside"):
            (other, *_) = self._meant(relation.refs)
            found.sort(key=lambda item: gap(other, item))
        return Answer(f"{listed(ids_of(found))} {be(ids_of(found))} {there}.", ids_of(found))

    def _held(self) -> str:
        return f"I hold {self._scene.held or 'nothing: the gripper is empty'}."

    def _where(self, relation: Relation, text: str) -> str:
        """Return a place phrase with the ids of what it is told by."""
        kind = relation.kind
        if relation.refs and (kind in _THERE or kind in ("on", "in", "between")):
            return f"{_THERE.get(kind, kind)} {listed(ids_of(self._meant(relation.refs)))}"
        return "on the table" if kind in ("on", "in") and not relation.refs else _THERE.get(kind, text)

    # How things are.

    def _described(self, items: Iterable[DetectedObject]) -> str:
        return " ".join(description(self._scene, item) for item in items)

    def _say_where(self, asked: Question) -> Answer:
        found = self._meant(asked.things)
        return Answer(" ".join(whereabouts(self._scene, item) for item in found), ids_of(found))

    def _say_what(self, asked: Question) -> Answer:
        one, *more = asked.things
        found = self._meant(asked.things) if more else self._ranked(one)
        if len(found) > 1 and one.ranks and not one.plural and one.determiner == "the":
            return Answer(f"{listed(ids_of(found))} are alike in that.", ids_of(found))
        return Answer(self._described(found), ids_of(found))

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
        return Answer(f"{'Yes' if holds else 'No'}: {self._evidence(items, so)}", ids_of(items))

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
            first, second = (measure(item, COMPARED[asked.by]) for item in (one, two))
            told = f"{one.id} measures {size(one)}, {two.id} {size(two)}."
        if abs(first - second) <= SAME * max(first, second):
            return Answer(f"Neither: {told}", (one.id, two.id))
        winner = one if (first < second) == (asked.by in _LESS) else two
        return Answer(f"{winner.id} is {COMPARED[asked.by]}: {told}", (winner.id,))

    def _say_alike(self, asked: Question) -> Answer:
        found = self._meant(asked.things)
        if len(found) < 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"{listed(ids_of(found))}: alike to what?", ids_of(found))
        sizes = [bounds(item)[1] - bounds(item)[0] for item in found]
        height = asked.by == "height"
        same = all(np.allclose(each[2 * height :], sizes[0][2 * height :], rtol=SAME) for each in sizes)
        same = len({item.colour for item in found}) == 1 if asked.by == "colour" else same
        return Answer(f"{'Yes' if same else 'No'}: {self._described(found)}", ids_of(found))

    def _say_far(self, asked: Question) -> Answer:
        found = self._meant(asked.things)
        if len(found) == 1:
            return Answer(
                f"{found[0].id} is {length(from_base(self._scene, found[0]))} from the robot's base.", ids_of(found)
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
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which two do you mean by “{asked.text}”?", ids_of(found))
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

    @property
    def _arm(self) -> ArmState:
        """State of the arm, as it tells it.

        Raises:
            RefusedError: It was not asked.
        """
        if self._scene.arm is None:
            raise RefusedError(RefusalCode.UNSUPPORTED, "I do not know how my own arm stands.")
        return self._scene.arm

    def _say_hand(self, asked: Question) -> Answer:
        x, y, z = self._arm.tcp_pose.xyz
        above = length(max(z - self._scene.table_height, 0.0))
        return Answer(f"My hand is at ({x:.3f}, {y:.3f}, {z:.3f}) m, {above} above the table; {self._held()}")

    def _say_grip(self, asked: Question) -> Answer:
        gripper = self._arm.gripper
        if gripper is None:
            return Answer("I have no gripper.")
        if gripper.seal is not None:
            return Answer(f"My hand is a suction cup. {self._held()}")
        told = f"there are {1000.0 * gripper.width:.0f} mm between my fingers; {self._held()}"
        if not asked.by:
            return Answer(f"{told[0].upper()}{told[1:]}")
        wanted = gripper.closed if asked.by == "closed" else 1.0 - gripper.closed
        word = "Yes" if wanted > 1.0 - _ALMOST else "No" if wanted < _ALMOST else "In part"
        return Answer(f"{word}: {told}")

    def _say_reach(self, asked: Question) -> Answer:
        near, far = (length(distance) for distance in self._scene.reach)
        return Answer(f"I work from {near} to {far} from my base, seen from above.")

    def _say_joints(self, asked: Question) -> Answer:
        told = ", ".join(f"{value + 0.0:.3f}" for value in self._arm.q.round(3))
        degrees = ", ".join(f"{value + 0.0:.1f}" for value in np.degrees(self._arm.q).round(1))
        return Answer(f"My joints are at {told}, from the base on (rad; m where one slides); in degrees {degrees}.")

    def _say_joint_count(self, asked: Question) -> Answer:
        return Answer(f"My arm has {len(self._arm.q)} joints.")

    def _say_poses(self, asked: Question) -> Answer:
        return Answer(f"I know {listed(sorted({*self._scene.poses, 'home'}))}.")

    def _say_widest(self, asked: Question) -> Answer:
        gripper = self._arm.gripper
        if gripper is None or gripper.seal is not None:
            return self._say_grip(asked)
        now = f"{1000.0 * gripper.width:.0f} mm are between my fingers"
        if gripper.closed >= _ALMOST:
            # How the gap grows with the motor's way is the gripper's own.
            told = f"{now}, and how far they open I do not see; say “open the gripper”, and ask then."
            raise RefusedError(RefusalCode.UNSUPPORTED, told)
        return Answer(f"My gripper is open as wide as it goes: {now}.")

    def _say_squeezing(self, asked: Question) -> Answer:
        if self._scene.held is None:
            return Answer("I hold nothing.")
        pressing = self._arm.gripper.force if self._arm.gripper else None
        if pressing is None:
            told = f"I hold {self._scene.held}; nothing in my gripper measures how hard."
            raise RefusedError(RefusalCode.UNSUPPORTED, told)
        return Answer(
            f"I hold {self._scene.held}; the motor of my gripper presses with {pressing:.1f} N (N m where fingers turn)."
        )

    def _from_hand(self, item: DetectedObject) -> float:
        return float(np.linalg.norm(centre(item) - self._arm.tcp_pose.position))

    def _say_nearest(self, asked: Question) -> Answer:
        others = [item for item in self._looked_for(asked.what or _ANYTHING) if item.id != self._scene.held]
        if not others:
            return Answer("I see nothing else.")
        nearest, *_ = sorted(others, key=self._from_hand)
        return Answer(f"{nearest.id}: its middle is {length(self._from_hand(nearest))} from my hand.", (nearest.id,))

    def _say_from_hand(self, asked: Question) -> Answer:
        found = self._meant(asked.things)
        told = " ".join(f"The middle of {item.id} is {length(self._from_hand(item))} from my hand." for item in found)
        return Answer(told, ids_of(found))

    def _say_point_reach(self, asked: Question) -> Answer:
        point = np.array(asked.at)
        far = float(np.hypot(*(point[:2] - np.array(self._scene.base_xy))))
        least, most = self._scene.reach
        if not least <= far <= most:
            return Answer(f"No: it is {length(far)} from my base, and I work from {length(least)} to {length(most)}.")
        return Answer(
            f"By its distance, yes: it is {length(far)} from my base, and I work from {length(least)} to {length(most)}, seen from "
            "above. Whether my hand gets to that height an order to go there would show."
        )

    def _say_pace(self, asked: Question) -> Answer:
        if not self._scene.tempo:
            raise RefusedError(RefusalCode.UNSUPPORTED, "I do not know at which tempo I go.")
        told = self._scene.tempo
        return Answer(f"My hand goes at {told} at most." if told.endswith("m/s") else f"I go at the {told} tempo.")

    def _say_pointing(self, asked: Question) -> Answer:
        approach, closing = self._arm.tcp_pose.rotation[:, 2], self._arm.tcp_pose.rotation[:, 1]
        tilt = float(np.degrees(np.arccos(np.clip(-approach[2], -1.0, 1.0))))
        heading = round(float(np.degrees(np.arctan2(closing[1], closing[0])))) % 180
        down = "straight down" if tilt < _UPRIGHT else f"{tilt:.0f} degrees away from straight down"
        return Answer(
            f"My hand points {down}; its fingers close along {heading} degrees from forward, counterclockwise."
        )

    def _say_speed(self, asked: Question) -> Answer:
        fastest = float(np.max(np.abs(self._arm.qd), initial=0.0))
        return Answer("I stand still." if fastest < _STANDS else f"My fastest joint goes at {fastest:.2f} rad/s.")

    def _say_weight(self, asked: Question) -> Answer:
        names = ids_of(self._meant(asked.things))
        told = f"I cannot see how heavy {listed(names)} {be(names)}; I can feel it: say “weigh {asked.things[0].text}”."
        raise RefusedError(RefusalCode.UNSUPPORTED, told, names)

    def _say_load(self, asked: Question) -> Answer:
        told = "How much I can carry is in none of my files; what I hold I can feel: say “weigh” and a thing."
        raise RefusedError(RefusalCode.UNSUPPORTED, told)

    def _say_abilities(self, asked: Question) -> Answer:
        own = ", ".join(name.replace("_", " ") for name in self._skills)
        return Answer(f"My skills are {own}. I also say where things are, how many, how big and how far apart.")

    def _say_able(self, asked: Question) -> Answer:
        return Answer(f"{'Yes' if asked.by == 'able' else 'No'}: {self._say_abilities(asked).text}")

    def _say_last(self, asked: Question) -> Answer:
        return Answer(self._past.told or "Nothing was done yet.")

    def _say_moved(self, asked: Question) -> Answer:
        before = self._past.scene
        if before is None:
            return Answer("Nothing was done yet.")
        if asked.by == "hand":
            if before.arm is None:
                raise RefusedError(RefusalCode.UNSUPPORTED, "I do not know how my own arm stood.")
            gone = self._arm.tcp_pose.position - before.arm.tcp_pose.position
            return Answer(f"My hand is {_millimetres(gone)} from where it was before “{self._past.prompt}”.")
        stood = {item.id: item for item in before.objects}
        found = self._meant(asked.things) if asked.things else self._scene.objects
        ways = {item.id: centre(item) - centre(stood[item.id]) for item in found if item.id in stood}
        moved = {name: way for name, way in ways.items() if np.linalg.norm(way) > _UNMOVED}
        told = [
            f"The middle of {name} is {_millimetres(way)} from where it was before “{self._past.prompt}”."
            for name, way in (ways if asked.things else moved).items()
        ]
        told += [f"I did not see {item.id} before that." for item in found if asked.things and item.id not in stood]
        if not asked.things:
            gone_from_sight = stood.keys() - {item.id for item in self._scene.objects}
            told += [f"I no longer see {name}." for name in stood if name in gone_from_sight]
            other, then = ("else ", "then") if moved else ("", f"before “{self._past.prompt}”")
            told.append(f"Nothing {other}moved by more than {1000.0 * _UNMOVED:.0f} mm since {then}.")
        return Answer(" ".join(told), tuple(moved))


def _with(what: Ref, so: Ref | None) -> Ref:
    """Return a description that says what another says besides."""
    if so is None:
        return what
    lists = ("relations", "ranks", "colours", "not_colours", "shapes", "measures")
    added = {name: (*getattr(what, name), *getattr(so, name)) for name in lists}
    said, told = without_articles(what.text), without_articles(so.text)
    text = f"{said} {told}" if so.relations or said.endswith("thing") else f"{told} {said}"
    return replace(what, text=text, nouns=so.nouns or what.nouns, **added)
