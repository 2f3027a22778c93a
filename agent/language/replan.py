"""Replanning after a failure: change something that the evidence says may help, or stop and say why not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from robosandbox.agent.language.draft import Draft, Step
from robosandbox.agent.language.interpret import interpret
from robosandbox.agent.language.world import World
from robosandbox.agent.protocols import Attempt
from robosandbox.errors import ErrorCode
from robosandbox.evidence import GraspEvidence, PlacementEvidence, PushEvidence
from robosandbox.types import ObservedScene, Refusal, RefusalCode, SkillCall
from robosandbox.world.changes import push_allowance
from robosandbox.world.operators import Operator

if TYPE_CHECKING:
    from robosandbox.agent.detours import Detours

RETRIES = 2
PLACES = frozenset({"place_on", "place_in", "place_beside", "place_at"})
_PLACED = 0.02  # Metres from its goal within which a thing has been placed. Chosen.
# What another try of the same would meet again.
_FINAL = frozenset({"none_found", "immovable", "too_heavy", "gripper_stuck"})
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
        self.again = sum(a.failed == self.failed.call and a.error.code == self.error.code for a in history) - 1

    def react(self) -> Draft | Refusal:
        answer = self._reaction()
        return (self._detour() or answer) if isinstance(answer, Refusal) else answer

    def _reaction(self) -> Draft | Refusal:
        gone = self._gone()
        if gone:
            return self._stop(f"{gone} is no longer in sight", RefusalCode.OBJECT_NOT_FOUND)
        repair = self._repair()
        if repair:
            return repair
        match self.error.code:
            case ErrorCode.UNREACHABLE | ErrorCode.LIMIT | ErrorCode.UNSUPPORTED | ErrorCode.INVALID_ARGUMENT:
                return self._other() or self._stop()
            case ErrorCode.COLLISION:
                return self._other() or self._way() or self._stop()
            case ErrorCode.TRACKING:
                return self._way() or self._stop()
            case ErrorCode.GRASP:
                return self._grasp()
            case ErrorCode.NOT_HOLDING:
                return self._pick_again() or self._stop()
            case ErrorCode.ALREADY_HOLDING:
                return self._retry(1) or self._stop() if self.scene.held is None else self._way() or self._stop()
            case ErrorCode.PLACEMENT:
                return self._placement()
            case ErrorCode.PUSH:
                return self._push_on() or self._stop()
            case ErrorCode.OBJECT_NOT_FOUND:
                return self._lost_sight() or self._stop(code=RefusalCode.OBJECT_NOT_FOUND)
            case ErrorCode.DRAWER | ErrorCode.POUR | ErrorCode.TAP:
                return self._way() or self._stop()
            case ErrorCode.AMBIGUOUS_OBJECT:
                return self._stop(code=RefusalCode.AMBIGUOUS)
            case ErrorCode.CONNECTION_LOST:
                return self._resume()
            case _:
                return self._stop()

    def _resume(self) -> Draft | Refusal:
        """Go on where a sim that went away has come back: it may have done some, all or nothing of the failed step."""
        name = self._carried()
        if self.failed.call.skill in PLACES and self.scene.held is None and name is not None:
            if self._is_placed(name):
                return self._draft(*self.after)
            return self._draft(Step(SkillCall(skill="pick", arguments={"object": name})), self.failed, *self.after)
        return self._draft(self.failed, *self.after)

    def _is_placed(self, name: str) -> bool:
        """Tell whether the object is where the failed step was to put it."""
        call, world = self.failed.call, World(self.scene)
        match call.skill:
            case "place_on":
                where = ("on", str(call.arguments["target"]))
                return world.parent.get(name) == where or (where[1] == "table" and name not in world.parent)
            case "place_in":
                return world.parent.get(name) == ("in", str(call.arguments["container"]))
            case "place_at":
                x, y = world.at[name]
                return math.hypot(x - float(call.arguments["x"]), y - float(call.arguments["y"])) < _PLACED
            case _:
                return False

    # What can be changed.

    def _gone(self) -> str | None:
        """Return an object that a remaining step needs and perception no longer sees."""
        for step in (self.failed, *self.after):
            for key in OBJECT_ARGUMENTS:
                name = step.call.arguments.get(key)
                if name is not None and self.scene.find(str(name)) is None:
                    return str(name)
        return None

    def _repair(self) -> Draft | None:
        """The calls that reached the post-condition on the twin; each is tried once."""
        repairs = self.error.repairs
        tried = sum(a.failed == self.failed.call and bool(a.error.repairs) for a in self.history) - 1
        if not repairs or tried >= max(RETRIES, len(repairs)):
            return None
        repair = repairs[min(tried, len(repairs) - 1)]
        if any(call.skill not in self.skills for call in repair.calls):
            return None
        return self._draft(*(Step(call) for call in repair.calls), *self.after)

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

    def _way(self) -> Draft | None:
        """Another way for the failed step, which nobody has tried."""
        calls = self._detours().around_failure()
        return self._draft(*map(Step, calls), *self.after) if calls else None

    def _detour(self) -> Draft | None:
        """Where a step failed that was to clear the way for a later one: another way for that."""
        found = self._detours().around_clearing()
        if found is None:
            return None
        calls, rest = found
        return self._draft(*map(Step, calls), *self.after[len(self.after) - len(rest) :])

    def _detours(self) -> Detours:
        # What goes well needs no search: commands that are given one sentence start without it.
        from robosandbox.agent.detours import Detours

        held = self._carried() if self.failed.call.skill in PLACES else None
        return Detours(self.history, self.scene, self.skills, held=held)

    def _retry(self, times: int = RETRIES) -> Draft | None:
        return self._draft(self.failed, *self.after) if self.again < times else None

    def _lost_sight(self) -> Draft | Refusal | None:
        """Try again; what was let go of already is looked for where it was to go, and fetched if it is elsewhere."""
        if self.failed.call.skill not in PLACES or self.scene.held:
            return self._retry(1)
        name = self._carried()
        return self._resume() if name and self.scene.find(name) and not self.again else None

    def _grasp(self) -> Draft | Refusal:
        evidence = self.error.evidence
        if not isinstance(evidence, GraspEvidence):
            return self._retry() or self._other_object() or self._stop()
        if evidence.object_width is not None and evidence.object_width > evidence.max_aperture:
            wide = (
                f"{1e3 * evidence.object_width:.0f} mm wide and the gripper opens {1e3 * evidence.max_aperture:.0f} mm"
            )
            return self._other_object() or self._stop(f"{evidence.object} is {wide}")
        if evidence.reason in _FINAL:
            return self._other_object() or self._stop()
        return self._retry() or self._other_object() or self._stop()

    def _pick_again(self) -> Draft | None:
        """The object slipped away: fetch it and go on."""
        name = self._carried()
        if name is None or self.again >= RETRIES or "pick" not in self.skills or self.scene.find(name) is None:
            return None
        return self._draft(Step(SkillCall(skill="pick", arguments={"object": name})), self.failed, *self.after)

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

    def _placement(self) -> Draft | Refusal:
        evidence = self.error.evidence
        if isinstance(evidence, PlacementEvidence) and evidence.reason == "unsuitable":
            return self._other() or self._stop()
        if isinstance(evidence, PlacementEvidence) and evidence.reason == "occupied":
            return self._other_call() or self._way() or self._stop()
        if isinstance(evidence, PlacementEvidence) and evidence.reason == "stuck":
            return self._retry(1) or self._stop()
        if self.again >= RETRIES:
            return self._stop()
        if self.failed.call.skill == "stack" or self.scene.held:
            return self._draft(self.failed, *self.after)
        return self._pick_again() or self._stop()

    def _push_on(self) -> Draft | None:
        """Push what is left of the way; where the strokes have done enough of it together, nothing is."""
        evidence = self.error.evidence
        if not isinstance(evidence, PushEvidence):
            return None
        left, allowance = _left(evidence), push_allowance(self._whole_push(evidence))
        if -2.0 * allowance <= left <= allowance and abs(evidence.across) < allowance:
            return self._draft(*self.after)
        pushes = sum(attempt.failed.skill == "push" for attempt in self.history)
        if pushes > RETRIES or left < 0.005 or abs(evidence.across) > 0.05:
            return None
        arguments = {**self.failed.call.arguments, "distance": left}
        return self._draft(Step(SkillCall(skill="push", arguments=arguments)), *self.after)

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
