"""The offline planner: a grammar for what people say, and a reaction to every kind of failure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from robosandbox.agent.episode import Episode
from robosandbox.agent.language.answers import NOTHING_YET, Answer, Past, answered
from robosandbox.agent.language.dialogue import Dialogue
from robosandbox.agent.language.discourse import Discourse, listed
from robosandbox.agent.language.draft import Draft
from robosandbox.agent.language.front import ENGLISH, language_of, learn_words
from robosandbox.agent.language.interpret import interpret, resumed
from robosandbox.agent.language.remarks import is_stated, without_remarks
from robosandbox.agent.language.replan import replan
from robosandbox.agent.language.text import MAX_CHARACTERS
from robosandbox.agent.language.viewer import Frame, turned_attempts, turned_calls, turned_scene
from robosandbox.agent.protocols import Attempt
from robosandbox.errors import InputError
from robosandbox.types import ObservedScene, Plan, Refusal, RefusalCode, SkillCall
from robosandbox.world.operators import Operator

_SENTENCES = re.compile(r"(?<=[?.!])\s+")
# What is said of the robot's own axes, whoever looks on.
_IN_BASE = re.compile(
    r"\b(?:base|robot)(?:'s)? (?:frame|coordinates)\b|\b(?:relative to|wrt) (?:the )?base\b|(?<![\w.])[-+]?[xy](?= axis| direction|\b(?!['.\w]))",
    re.IGNORECASE,
)


_STEP_ASIDE = SkillCall(skill="step_aside", arguments={})


class StubPlanner:
    """Plans from the sentence and the scene alone; no network, no model, the same answer every time."""

    def __init__(
        self,
        skills: Sequence[Operator],
        *,
        dialogue: bool = False,
        moves: Sequence[Operator] = (),
        frame: Frame = "robot",
    ) -> None:
        """Plan with these skills only.

        Args:
            skills: The skills at hand; their names are read, and the words of those that have some.
            dialogue: Let a prompt refer to the ones before: "it", answers to questions, "no, the green one".
            moves: What moves the hand by itself: called where a sentence says so, and nothing is brought about by them.
            frame: Whose left, right, front and back are meant: the robot's, or those of a viewer who faces it.

        Raises:
            InputError: There is no such frame.
        """
        if frame not in ("robot", "viewer"):
            raise InputError(f"frame: {frame!r} is neither robot nor viewer")
        self._is_turned = frame == "viewer"
        self._planned = tuple(skills)
        known = (*skills, *moves)
        self._skills = tuple(skill.name for skill in known)
        learn_words(known)
        self._dialogue = Dialogue(self._skills) if dialogue else None
        self._last: tuple[str, Draft] | None = None
        # A sentence that is read again once the arm has stepped aside.
        self._aside = ""
        self._past = NOTHING_YET

    def remember(self, episode: Episode) -> None:
        """Take note of what came of an order, for who asks."""
        if episode.steps or episode.attempts:
            done = ", ".join(str(step.call) for step in episode.steps) or "nothing"
            failed = (
                "" if episode.success else f"; then {episode.final_reason.replace('_', ' ')}: {episode.final_detail}"
            )
            self._past = replace(self._past, told=f"For “{episode.prompt}” I did {done}{failed}")
        elif not self._past.told and not episode.answer:
            why = f"{episode.final_reason.replace('_', ' ')}: {episode.final_detail}"
            self._past = replace(self._past, told=f"Nothing yet; “{episode.prompt}” was {why}")

    def begin_anew(self) -> None:
        """Forget what was said: the world has started over."""
        self._dialogue = Dialogue(self._skills) if self._dialogue else None
        self._last, self._past = None, NOTHING_YET

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the skill calls for a sentence, or what remains of them after failures; an answer to a question.

        Args:
            prompt: What was said.
            scene: What perception sees now.
            history: The attempts so far, oldest first; the new plan covers what they left undone.
        """
        if self._turns(prompt):
            answer = self._planned_for(prompt, turned_scene(scene), turned_attempts(history, scene))
            answer = _turned_back(answer, scene)
        else:
            answer = self._planned_for(prompt, scene, history)
        if isinstance(answer, Plan) and answer.steps and not history:
            self._past = replace(self._past, prompt=prompt, scene=scene)
        return answer

    def _past_of(self, prompt: str) -> Past:
        """Return what went before, its scene turned as that in which a prompt is read."""
        before = self._past.scene
        return replace(self._past, scene=turned_scene(before)) if before and self._turns(prompt) else self._past

    def _turns(self, prompt: str) -> bool:
        return self._is_turned and not _IN_BASE.search(prompt)

    def _planned_for(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt]) -> Plan | Refusal:
        draft: Draft | Refusal
        discourse = self._dialogue.discourse if self._dialogue else Discourse()
        asked = not history and len(prompt) <= MAX_CHARACTERS and language_of(prompt) == ENGLISH
        reply = answered(prompt, scene, discourse, self._skills, self._past_of(prompt)) if asked else None
        if isinstance(reply, Answer):
            if reply.about:
                discourse.mention(reply.about)
            return Plan(steps=(), answer=reply.text)
        if asked and "?" in prompt and (told := self._answered_beside(prompt, scene, discourse)):
            return Plan(steps=(), answer=told)
        if isinstance(reply, Refusal):
            return reply
        if history:
            before = self._last[1] if self._last and self._last[0] == prompt else None
            draft = replan(prompt, scene, self._planned, history, before)
            if before is not None and isinstance(draft, Draft):
                draft = replace(draft, tempo=before.tempo)
        elif self._dialogue:
            draft = self._dialogue.interpret(prompt, scene)
        else:
            draft = interpret(prompt, scene, self._skills)
        if isinstance(draft, Refusal):
            return draft if history else self._looked_for(prompt, draft, scene)
        self._last = (prompt, draft)
        return _plan_of(draft)

    def _looked_for(self, prompt: str, refusal: Refusal, scene: ObservedScene) -> Plan | Refusal:
        """Return a plan to look past the arm where it may hide what was not found; once for a prompt."""
        if refusal.code is not RefusalCode.OBJECT_NOT_FOUND or not scene.unseen:
            return refusal
        hidden = (
            f"the arm has hidden {max(100.0 * scene.unseen, 1.0):.0f} % of the table that it reaches from the cameras"
        )
        again, self._aside = self._aside, ""
        if again or _STEP_ASIDE.skill not in self._skills:
            return refusal.model_copy(update={"message": f"{refusal.message.rstrip('.')}; {hidden}."})
        self._aside = prompt
        return Plan(
            steps=(_STEP_ASIDE,), then=prompt, note=f"{refusal.message.rstrip('.')}; {hidden}, so I look past it."
        )

    def _answered_beside(self, prompt: str, scene: ObservedScene, discourse: Discourse) -> str:
        """Return the answer to a question beside which something is remarked; "" where there is none, or an order beside it.

        As in "Sorry, I looked away. Are you holding anything?" and "How far open is the gripper? I need to know."
        """
        plain, _ = without_remarks(prompt, [item.id for item in scene.objects])
        found, beside, past = list[Answer](), list[str](), self._past_of(prompt)
        for sentence in _SENTENCES.split(plain.strip()):
            reply = answered(sentence, scene, discourse, self._skills, past) if "?" in sentence else None
            if isinstance(reply, Answer):
                found.append(reply)
            else:
                beside.append(sentence)
        if len(found) != 1 or not all(is_stated(each) and self._is_no_order(each, scene) for each in beside):
            return ""
        passed = f" I take no account of {listed([f'“{each}”' for each in beside])}." if beside else ""
        return f"{found[0].text}{passed}"

    def _is_no_order(self, sentence: str, scene: ObservedScene) -> bool:
        heard = interpret(sentence, scene, self._skills)
        return isinstance(heard, Refusal) and heard.code in (RefusalCode.UNSUPPORTED, RefusalCode.UNRECOGNIZED)

    def go_on(self, scene: ObservedScene) -> Plan | Refusal:
        """Return what is done now that the last plan's steps are, by what is seen now."""
        if self._aside:
            answer = self.plan(self._aside, scene)
            self._aside = ""
            return answer
        prompt, draft = self._last or ("", Draft(()))
        turns = self._turns(prompt)
        if draft.question:
            discourse = self._dialogue.discourse if self._dialogue else Discourse()
            seen = turned_scene(scene) if turns else scene
            reply = answered(draft.question, seen, discourse, self._skills, self._past_of(prompt))
            self._last = (prompt, Draft(()))
            # What was ordered is done, whether the question can be answered or not.
            told = reply.message if isinstance(reply, Refusal) else reply.text if reply else ""
            return Plan(steps=(), answer=told)
        later = resumed(draft, turned_scene(scene) if turns else scene, self._skills)
        if isinstance(later, Refusal):
            return later
        later = replace(later, tempo=draft.tempo)
        self._last = (prompt, later)
        return _turned_back(_plan_of(later), scene) if turns else _plan_of(later)


def _turned_back(answer: Plan | Refusal, scene: ObservedScene) -> Plan | Refusal:
    """Return a plan for the turned scene as one for the scene itself."""
    if isinstance(answer, Refusal):
        return answer
    return answer.model_copy(update={"steps": turned_calls(answer.steps, scene)})


def _plan_of(draft: Draft) -> Plan:
    answer = draft.nothing.message if draft.nothing else ""
    return Plan(
        steps=draft.calls,
        answer=answer,
        then=draft.rest.text if draft.rest else draft.question,
        note=draft.note,
        tempo=draft.tempo if draft.calls else "",
    )
