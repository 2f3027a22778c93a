"""A conversation: answers to questions, corrections of what was said, and words that refer back."""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace as replaced
from typing import Any

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import Discourse, RefusedError
from robosandbox.agent.language.draft import Draft, Step
from robosandbox.agent.language.forms import amended
from robosandbox.agent.language.front import language_of, reply_in
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Command, Ref, Relation, Sentence, replace
from robosandbox.agent.language.interpret import choose, interpret
from robosandbox.agent.language.logic import Reply
from robosandbox.agent.language.world import World
from robosandbox.types import ObservedScene, Refusal, RefusalCode, SkillCall


class Dialogue:
    """Remembers what was spoken of from one sentence to the next, and which question is open."""

    def __init__(self, skills: Iterable[str]) -> None:
        """Begin a conversation with a robot that has these skills."""
        self._skills = tuple(skills)
        self._discourse = Discourse()
        self._open: tuple[str, Refusal, dict[str, str]] | None = None

    @property
    def discourse(self) -> Discourse:
        """What was spoken of."""
        return self._discourse

    def interpret(self, prompt: str, scene: ObservedScene) -> Draft | Refusal:
        """Return the plan for a sentence in the light of what was said before.

        "The left one" answers the question that the last refusal asked; "no, the green one" and "once more" do the last
        sentence again, with another object or as it was; everything else is a sentence of its own, whose "it" may refer back.
        """
        ids = tuple(item.id for item in scene.objects)
        began = self._open is not None or self._discourse.last is not None
        reply = reply_in(language_of(prompt), prompt, ids) if began else None
        if reply is not None and reply.cancelled:
            self._open = None
            return Draft((), nothing=Refusal(code=RefusalCode.IMPOSSIBLE, message="I do nothing more."))
        result = self._answer(prompt, reply, scene) or (self._again(prompt, reply, scene) if reply else None)
        if result is None:
            result = interpret(prompt, scene, self._skills, self._discourse)
            self._ask(prompt, result, {})
        return result

    def _ask(self, prompt: str, result: Draft | Refusal, chosen: dict[str, str]) -> None:
        asks = isinstance(result, Refusal) and result.code is RefusalCode.AMBIGUOUS
        self._open = (prompt, result, chosen) if isinstance(result, Refusal) and asks else None

    # Answers.

    def _answer(self, prompt: str, reply: Reply | None, scene: ObservedScene) -> Draft | Refusal | None:
        if self._open is None:
            return None
        question, refusal, chosen = self._open
        ref = dict(reply.better).get("ref") if reply else None
        if ref is not None and self._discourse.question:
            name = self._among(ref, refusal.candidates, scene)
            if name is None:
                return None
            answers = {**chosen, self._discourse.question: name}
            result = interpret(question, scene, self._skills, self._discourse, answers)
            self._ask(question, result, answers)
            return result
        # "Which way should it go?" - "to the left": the answer completes the sentence, unless it would be done as well by itself.
        completed, discourse = f"{question.rstrip(' .!?')} {prompt}", deepcopy(self._discourse)
        result = interpret(completed, scene, self._skills, discourse, chosen)
        if isinstance(result, Refusal):
            return None
        own = interpret(prompt, scene, self._skills, deepcopy(self._discourse))
        if isinstance(own, Draft) and any(call in result.calls for call in own.calls):
            return None
        self._discourse = discourse
        self._open = None
        return result

    def _among(self, ref: Ref, candidates: Iterable[str], scene: ObservedScene) -> str | None:
        """Return the one candidate that an answer describes."""
        left = {*candidates}
        among = replaced(scene, objects=tuple(item for item in scene.objects if item.id in left))
        try:
            return Grounder(World(among), Discourse()).one(ref, lambda name: True).ids[0]
        except RefusedError:
            return None

    # What follows an order.

    def _again(self, prompt: str, reply: Reply, scene: ObservedScene) -> Draft | Refusal | None:
        last = self._discourse.last
        if last is None or not last.steps:
            return None
        if reply.times:
            draft = choose(
                ((0.0, replaced(last, steps=last.steps * reply.times)),), scene, self._skills, self._discourse
            )
            self._ask(prompt, draft, {})
            return draft
        corrected = self._corrected(last, dict(reply.better), scene)
        if corrected is None:
            return None
        # A correction undoes the grasp.
        draft = choose(((0.0, corrected),), scene.holding(None), self._skills, self._discourse)
        self._ask(prompt, draft, {})
        return draft if isinstance(draft, Refusal) else self._put_down_first(draft, scene)

    def _corrected(self, last: Sentence, better: dict[str, Any], scene: ObservedScene) -> Sentence | None:
        """Put better words in the place that they fit: another description in that of the object, or of the container."""
        command = last.steps[-1] if len(last.steps) == 1 else _main(last)
        place, ref = command.place, better.get("ref")
        changed: Command | None
        if ref is None:
            changed = amended(command, better)
        elif isinstance(place, Relation) and place.kind == "in" and self._is_container(ref, scene):
            changed = replace(command, place=replace(place, refs=(ref,)))
        elif command.objects:
            named = replace(ref, nouns=command.objects[0].nouns, one=False) if ref.one and not ref.nouns else ref
            changed = replace(command, objects=(named,))
        else:
            return None
        if changed is None:
            return None
        kept = tuple(changed if step is command else step for step in last.steps)
        return Sentence(kept, last.avoid)

    def _is_container(self, ref: Ref, scene: ObservedScene) -> bool:
        if not ref.nouns and not ref.names:
            return False
        try:
            names = Grounder(World(scene), Discourse()).many(ref, lambda name: True).ids
        except RefusedError:
            return False
        objects = World(scene).objects
        return all(match.holds_things(objects[name]) for name in names)

    def _put_down_first(self, draft: Draft, scene: ObservedScene) -> Draft:
        held = scene.held
        if held is None:
            return draft
        if draft.calls and draft.calls[0] == SkillCall(skill="pick", arguments={"object": held}):
            return Draft(draft.steps[1:], draft.substitutes)
        world = World(scene)
        spots = world.free_spots(world.at[held], world.radius(held), (held,))
        if not spots or "place_at" not in self._skills:
            return draft
        down = SkillCall(skill="place_at", arguments={"x": spots[0][0], "y": spots[0][1]})
        return Draft((Step(down), *draft.steps), draft.substitutes)


def _main(sentence: Sentence) -> Command:
    """Return the command that a correction is about: the last one that names its object."""
    named = [step for step in sentence.steps if step.objects and step.objects[0].determiner != "it"]
    return named[-1] if named else sentence.steps[-1]
