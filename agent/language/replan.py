"""Replanning after a failure: change something that the evidence says may help, or stop and say why not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from robosandbox.agent.language.draft import Draft, Step
from robosandbox.agent.language.interpret import interpret
from robosandbox.agent.protocols import Attempt
from robosandbox.errors import ErrorCode
from robosandbox.evidence import PlacementEvidence
from robosandbox.skills.push import PushEvidence
from robosandbox.types import ObservedScene, Refusal, RefusalCode, SkillCall
from robosandbox.world.alternatives import BEFORE_MOVING
from robosandbox.world.changes import push_allowance
from robosandbox.world.operators import Operator

PLACES = frozenset({"place_on", "place_in", "place_beside", "place_at"})
# Failures before anything moved that may be of the thing, side or spot that was chosen.
_OF_THE_CHOICE = frozenset(
    {
        ErrorCode.UNREACHABLE,
        ErrorCode.LIMIT,
        ErrorCode.UNSUPPORTED,
        ErrorCode.INVALID_ARGUMENT,
        ErrorCode.COLLISION,
        ErrorCode.PLACEMENT,
        ErrorCode.GRASP,
    }
)
OBJECT_ARGUMENTS = ("object", "target", "container", "drawer")


def replan(
    prompt: str, scene: ObservedScene, skills: Sequence[Operator], history: Sequence[Attempt], before: Draft | None
) -> Draft | Refusal:
    """Return what remains to be done, changed where the last attempt failed.

    Args:
        prompt: The sentence.
        scene: What perception sees now.
        skills: The skills at hand.
        history: All attempts, oldest first.
        before: The draft that the last attempt ran; None takes it from the attempt itself.
    """
    last = history[-1]
    if before is None:
        before = _draft_of(last, interpret(prompt, scene, tuple(skill.name for skill in skills)))
    rest = _after_failure(before, last)
    return _Reaction(scene, skills, history, before, rest).react()


def _draft_of(attempt: Attempt, fresh: Draft | Refusal) -> Draft:
    """Return the draft of a plan that somebody else made, with the choices that the sentence leaves free.

    The plan itself is not made again: "the leftmost cube" is another one when the first has been moved.
    """
    known = fresh.steps if isinstance(fresh, Draft) else ()
    steps = [
        next((step for step in known if step.call == call), Step(call))
        for call in (*attempt.completed, attempt.failed, *attempt.remaining)
    ]
    return replace(fresh, steps=tuple(steps)) if isinstance(fresh, Draft) else Draft(tuple(steps))


def _after_failure(before: Draft, last: Attempt) -> tuple[Step, ...]:
    """Return the failed step and what remains to be done after it, with the choices that the draft knows of."""
    begin = len(last.completed)
    steps = before.steps[begin:] + before.steps[:begin]
    return tuple(
        next((step for step in steps if step.call == call), Step(call)) for call in (last.failed, *last.remaining)
    )


class _Reaction:
    def __init__(
        self,
        scene: ObservedScene,
        skills: Sequence[Operator],
        history: Sequence[Attempt],
        before: Draft,
        rest: tuple[Step, ...],
    ) -> None:
        self.scene = scene
        self.skills = {skill.name: skill for skill in skills}
        self.history = history
        self.before = before
        self.failed, self.after = rest[0], rest[1:]
        self.error = history[-1].error

    def react(self) -> Draft | Refusal:
        # What goes well needs no search: commands that are given one sentence start without it.
        from robosandbox.world.solve import solve, untried_repair

        gone = self._gone()
        if gone:
            return self._stop(f"{gone} is no longer in sight", RefusalCode.OBJECT_NOT_FOUND)
        if untried_repair(self.history, self.skills) is None:
            changed = self._pushed_enough() or (self._other() if self._is_of_the_choice() else None)
            if changed is not None:
                return changed
        left = (self.failed.call, *(step.call for step in self.after))
        answer = solve(left, self.scene, tuple(self.skills.values()), tried=self.history)
        if isinstance(answer, Refusal):
            lost = self.error.code == ErrorCode.OBJECT_NOT_FOUND
            code = RefusalCode.OBJECT_NOT_FOUND if lost else RefusalCode.IMPOSSIBLE
            return self._other() or self._stop(code=code)
        return self._draft(*map(self._step, answer.steps))

    def _step(self, call: SkillCall) -> Step:
        """Return a call with the choices that the sentence left for it."""
        return next((step for step in (self.failed, *self.after) if step.call == call), Step(call))

    def _is_of_the_choice(self) -> bool:
        """Tell whether another thing, side or spot that means the same is better than to make room for this one."""
        evidence = self.error.evidence
        if evidence is not None and evidence.is_final:
            return True
        return self.error.code in _OF_THE_CHOICE and self.error.phase in BEFORE_MOVING

    # What can be changed.

    def _gone(self) -> str | None:
        """Return an object that a remaining step needs and perception no longer sees."""
        for step in (self.failed, *self.after):
            for key in OBJECT_ARGUMENTS:
                name = step.call.arguments.get(key)
                if name is not None and self.scene.find(str(name)) is None:
                    return str(name)
        return None

    def _other(self) -> Draft | None:
        """Another object, side or spot that means the same to the person."""
        return self._other_call() or self._other_object()

    def _other_call(self) -> Draft | None:
        failed = [attempt.failed for attempt in self.history]
        left = [call for call in self.failed.others if call not in failed]
        if not left:
            return None
        return self._draft(*self._holding_again(), Step(left[0], tuple(left[1:])), *self.after)

    def _other_object(self) -> Draft | None:
        for key in OBJECT_ARGUMENTS:
            name = self.failed.call.arguments.get(key)
            left = [other for other in self.before.substitutes.get(str(name), ()) if self.scene.find(other)]
            if not left:
                continue
            substitutes = {k: v for k, v in self.before.substitutes.items() if k != name}
            substitutes[left[0]] = tuple(left[1:])
            swapped = [_renamed(step, str(name), left[0]) for step in (self.failed, *self.after)]
            return replace(self.before, steps=tuple(swapped), substitutes=substitutes)
        return None

    def _carried(self) -> str | None:
        """Return what the failed step was to place."""
        evidence = self.error.evidence
        if isinstance(evidence, PlacementEvidence):
            return evidence.object
        calls = [call for attempt in self.history for call in attempt.completed]
        picks = [call.arguments["object"] for call in calls if call.skill == "pick" and "object" in call.arguments]
        return str(picks[-1]) if picks else None

    def _holding_again(self) -> tuple[Step, ...]:
        """The pick that a place needs if the object is no longer held."""
        if self.failed.call.skill not in PLACES or self.scene.held:
            return ()
        name = self._carried()
        return (Step(SkillCall(skill="pick", arguments={"object": name})),) if name else ()

    def _pushed_enough(self) -> Draft | None:
        """Steps that remain behind a push whose strokes have done enough of it together."""
        evidence = self.error.evidence
        if not isinstance(evidence, PushEvidence) or self.failed.call.skill != "push":
            return None
        left, allowance = _left(evidence), push_allowance(self._whole_push(evidence))
        is_enough = -2.0 * allowance <= left <= allowance and abs(evidence.across) < allowance
        return self._draft(*self.after) if is_enough else None

    def _whole_push(self, last: PushEvidence) -> float:
        """Return the distance of the push of which the last one was to do the rest, metres; its own where it was the first."""
        for attempt in reversed(self.history[:-1]):
            before = attempt.error.evidence
            if not isinstance(before, PushEvidence) or (before.object, _left(before)) != (last.object, last.wanted):
                break
            last = before
        return last.wanted

    # Ends.

    def _draft(self, *steps: Step) -> Draft:
        return replace(self.before, steps=steps)

    def _stop(self, why: str | None = None, code: RefusalCode = RefusalCode.IMPOSSIBLE) -> Refusal:
        message = f"{self.failed.call} failed: {self.error.message}"
        if why:
            message = f"{why}; {message}"
        return Refusal(code=code, message=message)


def _left(evidence: PushEvidence) -> float:
    """Return what is missing of a push, metres, as it is asked for anew."""
    return round(evidence.wanted - evidence.along, 4)


def _renamed(step: Step, old: str, new: str) -> Step:
    def renamed(call: SkillCall) -> SkillCall:
        return SkillCall(skill=call.skill, arguments={k: new if v == old else v for k, v in call.arguments.items()})

    return Step(renamed(step.call), tuple(renamed(call) for call in step.others))
