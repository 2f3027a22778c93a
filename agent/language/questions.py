"""Questions about what is seen, answered from the same relations that plans are checked with; nothing moves for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robosandbox.agent.language.asides_clauses import ADDRESSING
from robosandbox.agent.language.asked import Asked, Span, no_container, words_of
from robosandbox.agent.language.chart import TooComplicatedError
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
from robosandbox.agent.language.lexicon import LEXICON
from robosandbox.agent.language.question_forms import TAGS, TRUTH, Form
from robosandbox.agent.language.tokens import Token, TooLongError, passed_over, tokenize
from robosandbox.agent.language.whether import replied
from robosandbox.agent.language.world import World
from robosandbox.types import SIDE_AXES, DetectedObject, ObservedScene, Refusal, RefusalCode
from robosandbox.world.contracts import find
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.locations import location_of
from robosandbox.world.parts import is_part, open_share
from robosandbox.world.placement_sampling import in_easy_reach
from robosandbox.world.relations import bounds, centre, contents, gap, loose
from robosandbox.world.standing import standing_on

_SAID_OF_SIDES = {
    "left": "to the left of",
    "right": "to the right of",
    "front": "in front of",
    "back": "behind",
}
_ARTICLES = frozenset({"the", "a", "an", "any", "some", "these", "those", "all"})
# Words for less of a measure.
_LESS = frozenset({"smaller", "shorter"})
# Ratio up to which two sizes count as one. Chosen: what cannot be told by eye.
_SAME = 0.02
# How questions begin that an order may look like: "do the cubes touch?", "is the cup easy to grasp?".
_NO_ORDERS = tuple(
    f"{be} {what} "
    for be in ("do", "does", "did", "is", "are", "was", "were", "has", "have")
    for what in ("the", "these", "those", "all", "any", "they", "something", "anything")
)
_WHETHER = Token("whether", "whether", "word")


@dataclass(frozen=True, slots=True)
class Answer:
    """What a question is answered with.

    Attributes:
        text: A sentence or two.
        about: Ids of what it speaks of: what "it" may refer to then.
    """

    text: str
    about: tuple[str, ...] = ()


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
    try:
        found = _found(_Answers(_words(prompt, scene), scene, discourse, skills, told))
        over = [f"“{each.words}”" for each in passed_over(prompt, words_of(scene))] if isinstance(found, Answer) else []
    except (TooLongError, TooComplicatedError):
        return None
    message = f"I do not know what {listed(over)} asks here; say the question without it."
    if found is None and prompt.rstrip().endswith("?") and prompt.lower().startswith(_NO_ORDERS):
        message = "I say where things are, how many, how big, how far apart and what holds of them, and not this."
        return Refusal(code=RefusalCode.UNSUPPORTED, message=message)
    return Refusal(code=RefusalCode.UNSUPPORTED, message=message) if over else found


def _found(asked: _Answers) -> Answer | Refusal | None:
    refusal: Refusal | None = None
    try:
        for start, form in asked.forms():
            for slots in asked.matches(form.parts, start):
                try:
                    return asked.reply(form, slots)
                except RefusedError as error:
                    # Of words that are not known the grammar says more.
                    refusal = refusal or (error.refusal if error.refusal.sure else None)
        unseen = refusal is not None and refusal.code is RefusalCode.UNSUPPORTED
        said = replied(asked.tokens, asked.scene, asked.discourse) if asked.tokens and not unseen else None
    except RefusedError as error:
        return refusal or error.refusal
    return Answer(*said) if said else refusal


def _words(text: str, scene: ObservedScene) -> tuple[Token, ...]:
    """Return the words of a question; "is not it there?" asks what "is it there?" does, and "it is there, right?" as well."""
    tokens = tuple(token for token in tokenize(text, words_of(scene)) if token.kind != "mark")
    texts = [token.text for token in tokens]
    if texts[1:2] == ["not"] and texts[0] in ("is", "are", "do", "does"):
        return (tokens[0], *tokens[2:])
    for truth in map(str.split, TRUTH):
        if texts[: len(truth)] == truth:
            return (_WHETHER, *tokens[len(truth) :])
    if text.rstrip().endswith("?") and texts[:1] == ["the"] and {"is", "are"} & {*texts}:
        tag = next((len(tag) for tag in map(str.split, TAGS) if texts[-len(tag) :] == tag), 0)
        return (_WHETHER, *tokens[: len(tokens) - tag])
    return tokens


class _Answers(Asked):
    """The answers to a question of each form.

    Args:
        tokens: The question, without marks.
        scene: What perception sees.
        discourse: What was spoken of before.
        skills: What the robot can do.
        told: What came of the last order.
    """

    def __init__(
        self, tokens: tuple[Token, ...], scene: ObservedScene, discourse: Discourse, skills: Sequence[str], told: str
    ) -> None:
        super().__init__(tokens, scene, discourse)
        self._skills = skills
        self._told = told

    def reply(self, form: Form, slots: tuple[Span, ...]) -> Answer:
        """Return the answer of a form whose slots are filled.

        Raises:
            RefusedError: It asks for what is not there, or may be several things.
        """
        answer: Answer = getattr(self, f"_say_{form.about}")(*slots, **form.given)
        return answer

    def _say_all(self) -> Answer:
        names = [item.id for item in self.scene.objects]
        if not names:
            return Answer("I see nothing.")
        return Answer(
            "; ".join(f"{name} is {place(self.scene, self.view.get(name))}" for name in names) + ".", tuple(names)
        )

    def _say_where(self, span: Span, *others: Span) -> Answer:
        ids, _ = self.meant(span)
        return Answer(" ".join(whereabouts(self.scene, self.view.get(name)) for name in ids), ids)

    def _say_on(self, span: Span) -> Answer:
        item = self.one(span)
        above = [one.id for one in standing_on(self.view, item.id)]
        return Answer(f"{listed(above)} {be(above)} on {item.id}." if above else f"Nothing is on {item.id}.", (*above,))

    def _say_on_table(self) -> Answer:
        names = [item.id for item in self.scene.objects if location_of(self.scene, item) == fact("on", item.id, TABLE)]
        return Answer(
            f"{listed(names)} {be(names)} on the table." if names else "Nothing stands on the table.", (*names,)
        )

    def _say_in(self, span: Span) -> Answer:
        return self._contents(self.one(span))

    def _say_beside(self, span: Span, side: str = "") -> Answer:
        item = self.one(span)
        others = [other for other in self.view.others(item.id) if self._stands(other, item, side)]
        names = tuple(other.id for other in sorted(others, key=lambda other: gap(item, other)))
        there = f"{_SAID_OF_SIDES[side]} {item.id}" if side else f"next to {item.id}"
        return Answer(f"{listed(names)} {be(names)} {there}." if names else f"Nothing is {there}.", names)

    def _stands(self, item: DetectedObject, other: DetectedObject, side: str) -> bool:
        """Tell whether a thing is on that side of another; without a side, whether it stands next to it."""
        at = side_of(item, other)
        return at == side if side else bool(at) and find(fact("beside", item.id, other.id, at), self.view).holds

    def _say_held(self) -> Answer:
        held = self.scene.held
        return Answer(f"I hold {held}.", (held,)) if held else Answer("I hold nothing: the gripper is empty.")

    def _say_count(self, span: Span) -> Answer:
        ids, said = self.fitting(span)
        if not ids:
            return Answer(f"None: I see no {said}.")
        seen = [self.view.get(name) for name in ids]
        if any(item.shape.is_granular and not item.grains for item in seen):
            return Answer(f"I see {listed(ids)} and cannot count them.", ids)
        return Answer(f"{sum(len(loose(item)) for item in seen)}: {listed(ids)}.", ids)

    def _say_count_in(self, span: Span, other: Span, relation: str) -> Answer:
        (ids, said), target = self.fitting(span), self.one(other)
        if relation == "on":
            there = [one.id for one in standing_on(self.view, target.id) if one.id in ids]
            return Answer(f"{len(there)}: {listed(there)}." if there else "None of what I see.", tuple(there))
        within = [name for name, _ in contents(self.scene.objects, target) if name in ids]
        names = tuple(dict.fromkeys(within))
        return Answer(f"{len(within)}: {listed(names)}." if within else f"None: I see no {said} in {target.id}.", names)

    def _say_far(self, span: Span, other: Span) -> Answer:
        one, two = self.one(span), self.one(other)
        far, between = apart(one, two), max(gap(one, two), 0.0)
        return Answer(
            f"{one.id} is {length(far)} from {two.id}, centre to centre; {length(between)} lie between them.", (one.id,)
        )

    def _say_far_apart(self, span: Span) -> Answer:
        ids, said = self.meant(span)
        if len(ids) != 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which two do you mean by “{said}”?", ids)
        one, two = (self.view.get(name) for name in ids)
        return Answer(
            f"{one.id} and {two.id} are {length(apart(one, two))} apart, centre to centre; "
            f"{length(max(gap(one, two), 0.0))} lie between them.",
            ids,
        )

    def _say_far_from_me(self, span: Span) -> Answer:
        item = self.one(span)
        return Answer(f"{item.id} is {length(from_base(self.scene, item))} from the robot's base.", (item.id,))

    def _say_what(self, span: Span) -> Answer:
        try:
            ids, _ = self.meant(span)
        except RefusedError as error:
            alike = error.refusal.candidates
            told = all(rank.key for ref in self._refs(span) for rank in ref.ranks)
            if error.refusal.code is not RefusalCode.AMBIGUOUS or not alike or not told:
                raise
            return Answer(f"{listed(alike)} are alike in that.", tuple(alike))
        return Answer(" ".join(description(self.scene, self.view.get(name)) for name in ids), ids)

    def _say_which(self, span: Span, other: Span) -> Answer:
        """Answer which of some things another description fits too: "which cube is the biggest"."""
        words = " ".join(token.text for token in self.tokens[other[0] : other[1]])
        noun = " ".join(token.text for token in self.tokens[span[0] : span[1]] if token.text not in _ARTICLES)
        of_both = f"what is {words.removesuffix(' one')} {noun}"
        again = _Answers(_words(of_both, self.scene), self.scene, self.discourse, self._skills, self._told)
        if len(again.tokens) in again.ends(2):
            return again._say_what((2, len(again.tokens)))
        if any(ref.ranks or not ref.plural for ref in self._refs(other)):
            raise RefusedError(RefusalCode.UNRECOGNIZED, f"I do not know what “{words} {noun}” is.")
        return self._say_count_such(span, other)

    def _say_whether(self, span: Span, other: Span, relation: str) -> Answer:
        item, target = self.one(span), self.one(other)
        finding = find(fact(relation, item.id, target.id), self.view)
        return self._yes(finding.holds, item, finding.is_sure)

    def _say_whether_on_table(self, span: Span) -> Answer:
        item = self.one(span)
        return self._yes(location_of(self.scene, item) == fact("on", item.id, TABLE), item)

    def _say_whether_beside(self, span: Span, other: Span, side: str = "") -> Answer:
        item, target = self.one(span), self.one(other)
        yes = "Yes" if self._stands(item, target, side) else "No"
        at = side_of(item, target)
        if not side:
            return Answer(f"{yes}: {length(max(gap(item, target), 0.0))} lie between them.", (item.id,))
        if not at:
            return Answer(f"{yes}: {item.id} and {target.id} are at one place seen from above.", (item.id,))
        far = abs(float((centre(item) - centre(target))[:2] @ np.array(SIDE_AXES[at])))
        return Answer(f"{yes}: {item.id} is {length(far)} {_SAID_OF_SIDES[at]} {target.id}.", (item.id,))

    def _say_whether_state(self, span: Span, relation: str) -> Answer:
        item = self.one(span)
        finding = find(fact(relation, item.id), self.view)
        yes = "Yes" if finding.holds else "No"
        if relation == "empty":
            inside = self._contents(item)
            is_told = item.shape.holds_things and finding.is_sure
            return Answer(f"{yes}: {inside.text}" if is_told else inside.text, (item.id,))
        if relation not in ("open", "closed"):
            return self._yes(finding.holds, item, finding.is_sure)
        doors = (
            [item]
            if is_part(item)
            else [o for o in self.view.scene.objects if is_part(o) and o.id.startswith(f"{item.id}.")]
        )
        if doors:
            found = [find(fact(relation, door.id), self.view).holds for door in doors]
            told = "; ".join(f"{door.id} is {max(0.0, open_share(door)):.0%} open" for door in doors)
            return Answer(f"{'Yes' if all(found) else 'No'}: {told}.", tuple(door.id for door in doors))
        if not item.shape.opens:
            return Answer(f"{item.id} neither opens nor closes.", (item.id,))
        if item.opening is None:
            return Answer(f"I cannot see how far {item.id} is open.", (item.id,))
        return Answer(f"{yes}: {item.id} is {1e3 * abs(item.opening):.0f} mm open.", (item.id,))

    def _say_opening(self, span: Span) -> Answer:
        told = self._say_whether_state(span, "open")
        said = told.text.replace("Yes: ", "Open: ").replace("No: ", "Closed: ")
        return Answer(said, told.about)

    def _say_alike(self, *spans: Span, of: str) -> Answer:
        ids = tuple(dict.fromkeys(name for span in spans for name in self.meant(span)[0]))
        if len(ids) < 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"{listed(ids)}: alike to what?", ids)
        seen = [self.view.get(name) for name in ids]
        sizes = [bounds(item)[1] - bounds(item)[0] for item in seen]
        height = of == "height"
        same = all(np.allclose(size[2 * height :], sizes[0][2 * height :], rtol=_SAME) for size in sizes)
        same = len({item.colour for item in seen}) == 1 if of == "colour" else same
        return Answer(f"{'Yes' if same else 'No'}: {' '.join(description(self.scene, item) for item in seen)}", ids)

    def _say_whether_held(self, span: Span) -> Answer:
        item = self.one(span)
        return self._yes(item.id == self.scene.held, item)

    def _say_whether_there(self, span: Span) -> Answer:
        ids, said = self.fitting(span)
        number = next((ref.number for ref in self._refs(span) if ref.number), None)
        if ids:
            return Answer(f"{'Yes' if number in (None, len(ids)) else f'No, {len(ids)}'}: {listed(ids)}.", ids)
        words = [word for word in said.split() if word not in _ARTICLES]
        none = (
            f"nothing {' '.join(words[1:])}" if words[:1] in (["anything"], ["something"]) else f"no {' '.join(words)}"
        )
        return Answer(f"No: I see {none}; I see {listed([item.id for item in self.scene.objects]) or 'nothing'}.")

    def _say_whether_is(self, span: Span, other: Span) -> Answer:
        if any(ref.options and any(one.nouns for one in ref.options) for ref in self._refs(other)):
            raise RefusedError(RefusalCode.UNSUPPORTED, "Ask about one of them at a time.")
        if any(ref.determiner == "bare" and ref.nouns and not ref.plural for ref in self._refs(other)):
            raise RefusedError(RefusalCode.UNRECOGNIZED, "“is the red cube?” asks nothing of it.")
        (ids, _), (fitting, _) = self.meant(span), self.such(other)
        if not all(ref.plural for ref in self._refs(span)):
            ids = (self.one(span).id,)
        told = " ".join(description(self.scene, self.view.get(name)) for name in ids)
        return Answer(f"{'Yes' if {*ids} <= {*fitting} else 'No'}: {told}", ids)

    def _say_more(self, span: Span, other: Span, wanted: str) -> Answer:
        (ours, said), (theirs, than) = self.fitting(span), self.fitting(other)
        holds = len(ours) > len(theirs) if wanted == "more" else len(ours) < len(theirs)
        return Answer(f"{'Yes' if holds else 'No'}: {len(ours)} {said}, {len(theirs)} {than}.", (*ours, *theirs))

    def _say_compared(self, span: Span, other: Span, word: str) -> Answer:
        one, two = self.one(span), self.one(other)
        if word in ("heavier", "lighter"):
            raise cannot_see((word,))
        first, second = (measure(item, word) for item in (one, two))
        sizes = f"{one.id} measures {size(one)}, {two.id} {size(two)}."
        if abs(first - second) <= _SAME * max(first, second):
            return Answer(f"Neither: {sizes}", (one.id, two.id))
        winner = one if (first > second) == (word not in _LESS) else two
        return Answer(f"{winner.id} is {word}: {sizes}", (winner.id,))

    def _say_mass(self, span: Span) -> Answer:
        item = self.one(span)
        told = f"I see {item.id} and do not know what it weighs; its size is {size(item)}."
        raise RefusedError(RefusalCode.UNSUPPORTED, told, (item.id,))

    def _say_abilities(self) -> Answer:
        own = ", ".join(name.replace("_", " ") for name in self._skills)
        return Answer(f"My skills are {own}. I also say where things are, how many, how big and how far apart.")

    def _say_count_such(self, span: Span, other: Span) -> Answer:
        such, _ = self.such(other)
        names = tuple(name for name in self.fitting(span)[0] if name in such)
        return Answer(f"{len(names)}: {listed(names)}." if names else "None of what I see.", names)

    def _say_nearer(self, span: Span, other: Span) -> Answer:
        told = sorted((from_base(self.scene, item), item.id) for item in (self.one(span), self.one(other)))
        return Answer(" ".join(f"{name} is {length(far)} from my base." for far, name in told), (told[0][1],))

    def _say_colours(self) -> Answer:
        colours = tuple(dict.fromkeys(item.colour for item in self.scene.objects))
        return Answer(f"{len(colours)}: {listed(colours)}.")

    def _say_able(self, span: Span) -> Answer:
        verbs = [end for end, tag, _ in LEXICON.at(self.tokens, span[0]) if tag == "VERB"]
        if verbs and span[1] not in verbs:
            # "are you able to pick up the can?" asks for it.
            raise RefusedError(RefusalCode.UNRECOGNIZED, "That is an order.")
        if not verbs and self.tokens[span[0]].text in ADDRESSING:
            raise RefusedError(RefusalCode.UNRECOGNIZED, "That is no skill.")
        return Answer(f"{'Yes' if verbs else 'No'}: {self._say_abilities().text}")

    def _say_reach(self, span: Span, beyond: str = "") -> Answer:
        ids, _ = self.meant(span)
        found = [self._reaches(self.view.get(name)) for name in ids]
        yes = not any(found) if beyond else all(found)
        where = " ".join(whereabouts(self.scene, self.view.get(name)) for name in ids)
        return Answer(f"{'Yes' if yes else 'No'}: {where}", ids)

    def _say_reached(self, *span: Span, beyond: str = "") -> Answer:
        among = self.fitting(*span)[0] if span else [item.id for item in self.scene.objects]
        names = tuple(name for name in among if self._reaches(self.view.get(name)) != bool(beyond))
        where = f"{'out of' if beyond else 'within'} my reach."
        return Answer(f"{listed(names)} {be(names)} {where}" if names else f"Nothing is {where}", names)

    def _reaches(self, item: DetectedObject) -> bool:
        """Say whether the hand gets to a thing, as every skill asks before it moves.

        Raises:
            RefusedError: It is at a distance where only the arm's kinematics tell, which are not asked here.
        """
        if in_easy_reach(self.scene, item):
            return True
        if find(fact("reachable", item.id), self.view).holds:
            far = length(from_base(self.scene, item))
            told = f"{item.id} is {far} from my base, at the edge of my reach: an order to pick it up would show."
            raise RefusedError(RefusalCode.UNSUPPORTED, told, (item.id,))
        return False

    def _say_fits(self, span: Span, other: Span) -> Answer:
        item, target = self.one(span), self.one(other)
        if not target.shape.holds_things:
            return Answer(f"{target.id} holds nothing: it is {target.shape.name}.", (item.id,))
        if item.shape.is_granular:
            raise RefusedError(
                RefusalCode.UNSUPPORTED, f"I cannot see how much room {item.id} take up in all.", (item.id,)
            )
        fits = World(self.scene).fits_in(item.id, target.id)
        sizes = f"{item.id} measures {size(item)}, {target.id} {size(target)}."
        return Answer(f"{'Yes' if fits else 'No'}: {sizes}", (item.id,))

    def _say_last(self) -> Answer:
        return Answer(self._told or "Nothing was done yet.")

    def _yes(self, holds: bool, item: DetectedObject, is_sure: bool = True) -> Answer:
        if not is_sure:
            return Answer(f"I cannot tell for sure. {whereabouts(self.scene, item)}", (item.id,))
        return Answer(f"{'Yes' if holds else 'No'}: {item.id} is {place(self.scene, item)}.", (item.id,))

    def _contents(self, item: DetectedObject) -> Answer:
        if not item.shape.holds_things:
            raise no_container(item)
        inside = [name for name, _ in contents(self.scene.objects, item)]
        if not inside and not find(fact("empty", item.id), self.view).is_sure:
            return Answer(f"I cannot see what is in {item.id}.")
        names = tuple(dict.fromkeys(inside))
        said = [f"{inside.count(name)} {name}" if self.view.get(name).shape.is_granular else name for name in names]
        return Answer(f"{listed(said)} {be(inside)} in {item.id}." if names else f"Nothing is in {item.id}.", names)
