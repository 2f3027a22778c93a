"""The grammar first; a model for what the grammar is not sure of, held to what the grammar is sure of."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from robosandbox.agent.course import Continuing, Conversing, Course, Desk, PlannedCourse, PromptDone, Report, begin
from robosandbox.agent.partial import PartialReading
from robosandbox.agent.protocols import Attempt, Planner
from robosandbox.types import ObservedScene, Plan, Refusal

Reader = Callable[[str, ObservedScene], PartialReading]


class AutoPlanner:
    """Asks the second planner about what the first one refuses without being sure, and keeps to it for that prompt.

    A refusal that the first is sure of stands: it understood every word and says why not, or asks what only the person knows. So
    does the question that a part of the sentence leaves open.

    Args:
        first: Quick and certain.
        second: Slower, and understands more.
        read: Returns what is certain of a sentence that the first does not understand.
    """

    def __init__(self, first: Planner, second: Planner, read: Reader) -> None:
        self._first = first
        self._second = second
        self._read = read
        self._handed_over: str | None = None

    def plan(self, prompt: str, scene: ObservedScene, history: Sequence[Attempt] = ()) -> Plan | Refusal:
        """Return the first planner's answer, or the second's where the first refuses and is not sure."""
        if history and prompt == self._handed_over:
            return self._second.plan(prompt, scene, history)
        answer = self._first.plan(prompt, scene, history)
        if not isinstance(answer, Refusal) or answer.sure:
            return answer
        question = self._read(prompt, scene).question
        if question is not None:
            return question
        self._handed_over = prompt
        return self._second.plan(prompt, scene, history)

    def begin_anew(self) -> None:
        """Forget what was said: the world has started over."""
        for planner in (self._first, self._second):
            if isinstance(planner, Conversing):
                planner.begin_anew()

    def go_on(self, scene: ObservedScene) -> Plan | Refusal:
        """Return what is done now that the steps of the first planner's plan are."""
        return self._first.go_on(scene) if isinstance(self._first, Continuing) else Plan(steps=())


class AutoDirector(AutoPlanner):
    """The same with a second planner that acts call by call.

    Args:
        first: Quick and certain.
        second: Slower, understands more, and can begin a course.
        read: Returns what is certain of a sentence that the first does not understand.
    """

    def begin(self, prompt: str, desk: Desk) -> Course:
        """Return the course for a prompt."""
        return _AutoCourse(self._first, lambda: begin(self._second, prompt, desk), prompt, self._read)


class _AutoCourse:
    """The first planner's course, or the second's where the first refuses and is not sure."""

    def __init__(self, first: Planner, second: Callable[[], Course], prompt: str, read: Reader) -> None:
        self._course: Course = PlannedCourse(first, prompt)
        self._second = second
        self._prompt = prompt
        self._read = read

    @property
    def goes_on(self) -> bool:
        """True where it is asked again after a plan that succeeded."""
        return self._course.goes_on

    def next(self, scene: ObservedScene, report: Report | None) -> Plan | Refusal | PromptDone:
        """Return what to carry out now."""
        answer = self._course.next(scene, report)
        if report is not None or not isinstance(answer, Refusal) or answer.sure:
            return answer
        question = self._read(self._prompt, scene).question
        if question is not None:
            return question
        self._course = self._second()
        return self._course.next(scene, None)
