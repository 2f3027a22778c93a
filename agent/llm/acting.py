"""A model that acts call by call: the agent carries out what it calls and tells it what came of that.

The conversation is an agent's of pydantic-ai whose tools are all external: its run ends with calls, they are handled here one
after another, and the next run begins with what came of them. So the robot moves in the agent's own loop and thread, where
events, confirmation, limits and Ctrl-C act as for every plan.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError
from pydantic_ai import Agent, DeferredToolRequests, DeferredToolResults
from pydantic_ai.messages import BinaryContent, ModelMessage, ToolCallPart, ToolReturn, UserContent
from pydantic_ai.tools import ToolDefinition
from pydantic_ai.toolsets import ExternalToolset

from robosandbox.agent.agent import check_prompt
from robosandbox.agent.course import Course, Desk, PromptDone, Report
from robosandbox.agent.episode import Consulted, Thought
from robosandbox.agent.llm.answer import as_refusal
from robosandbox.agent.llm.budget import Budget
from robosandbox.agent.llm.endpoint import NO_LIMITS, Endpoint
from robosandbox.agent.llm.forms import find_calls, thought_of
from robosandbox.agent.llm.ledger import PromptLedger
from robosandbox.agent.llm.pictures import marked_picture, png
from robosandbox.agent.llm.planner import LLMPlanner, prompt_budget
from robosandbox.agent.llm.prompt import act_instructions, describe_robot, question
from robosandbox.agent.llm.service import ModelConnection, Service, run_apart
from robosandbox.agent.llm.settings import LLMSettings
from robosandbox.agent.llm.toolbox import OWN, SceneLookArguments, acting_tools, one_call
from robosandbox.agent.tools import (
    AchieveArguments,
    AskArguments,
    CheckArguments,
    FinishArguments,
    ProgramArguments,
    RefuseArguments,
    SimulateArguments,
    checked,
    error_data,
    outcome,
    relations,
    rounded,
    simulated,
    wrong_arguments,
)
from robosandbox.agent.usage import count_sent_back
from robosandbox.errors import InputError, RenderingError
from robosandbox.types import ObservedScene, Plan, Refusal, SkillCall
from robosandbox.world.scene_json import describe_scene
from robosandbox.world.solve import solve
from robosandbox.world.verifier import Constraints, verify

if TYPE_CHECKING:
    from robosandbox.agent.llm.program import RunningProgram

# How many earlier requests of a session a model is told of. Chosen: what "it" and "again" reach back to.
_REMEMBERED = 6
# Answers asked for until one has a form that can be read. Chosen: two ways of asking, and what is repeated twice is repeated.
_READINGS = 4


class ActingPlanner(LLMPlanner):
    """Asks a model what to do next after each call, and for a whole plan where only a plan is relations."""

    def __init__(self, skills: Sequence[Any], settings: LLMSettings) -> None:
        super().__init__(skills, settings)
        self._earlier: deque[dict[str, Any]] = deque(maxlen=_REMEMBERED)

    def begin_anew(self) -> None:
        """Forget what was said: the world has started over."""
        self._earlier.clear()

    def begin(self, prompt: str, desk: Desk) -> Course:
        """Return the course for a prompt."""
        check_prompt(prompt)
        self._prompt = prompt_budget(self._settings)
        earlier = tuple(self._earlier)
        self._earlier.append({"request": prompt, "calls": []})
        budgets = (self._prompt, self._session)
        return ActingCourse(
            prompt,
            desk,
            self._service,
            budgets,
            certain=self.certain,
            earlier=earlier,
            note=self._earlier[-1],
        )


class ActingCourse:
    """One prompt's conversation.

    Args:
        prompt: What was said.
        desk: World, skills, and who can be asked.
        service: The model and its endpoint.
        budgets: What may be spent, that of the prompt first.
        certain: Returns what the prompt holds every call to.
        earlier: Requests before this one and what was done for them.
        note: What later prompts are told of this one; calls that succeed are added.
    """

    goes_on = True

    def __init__(
        self,
        prompt: str,
        desk: Desk,
        service: Service,
        budgets: Sequence[Budget],
        *,
        earlier: Sequence[Mapping[str, Any]] = (),
        certain: Callable[[str, ObservedScene], Constraints],
        note: dict[str, Any],
    ) -> None:
        self._prompt, self._desk, self._service = prompt, desk, service
        self._budgets, self._earlier = tuple(budgets), earlier
        self._ledger = PromptLedger(desk.skills, budgets, note)
        self._can_program = service.settings.mode == "code"
        self._tools = self._offered()
        self._agent = Agent(output_type=[str, DeferredToolRequests], name="act")
        self._said: list[ModelMessage] = []
        self._calls: deque[ToolCallPart] = deque()
        self._results: dict[str, Any] = {}
        self._pictures: list[UserContent] = []
        self._under_way: tuple[ToolCallPart, ObservedScene] | None = None
        self._program: RunningProgram | None = None
        self._certain = certain

    def next(self, scene: ObservedScene, report: Report | None) -> Plan | Refusal | PromptDone:
        """Return what the model wants to be carried out, or that it ends.

        Raises:
            PlannerError: It does not answer, or not in the limits.
            InputError: The service does not know the model or the key.
        """
        if report is None:
            self._ledger.due = self._certain(self._prompt, scene)
            self._calls.extend(run_apart(self._run(scene, first=True)))
        elif self._under_way is not None:
            further = self._take(report, scene)
            if further is not None:
                return further
        while True:
            while self._calls:
                answer = self._handled(self._calls.popleft(), scene)
                if answer is not None:
                    return answer
            self._calls.extend(run_apart(self._run(scene, first=False)))
            # A model may take a minute, and people do not stand still meanwhile.
            scene = self._desk.ctx.look()

    def _offered(self, scene: ObservedScene | None = None) -> list[ToolDefinition]:
        """Return the tools; with a scene only what fits it."""
        skills = list(self._desk.skills.values())
        return acting_tools(skills, scene, can_ask=self._desk.ask is not None, can_program=self._can_program)

    async def _run(self, scene: ObservedScene, *, first: bool) -> list[ToolCallPart]:
        """Return what the model calls next, now that it is told of the world or of what came of its calls."""
        content: list[UserContent] = []
        if first:
            about = describe_robot(self._desk.ctx, scene, self._desk.skills)
            about |= {"cameras": list(self._desk.ctx.cameras())}
            content = [question(self._prompt, scene, (), earlier=self._earlier, robot=about, certain=self._ledger.due)]
            if self._service.settings.picture is not None:
                content.append(BinaryContent(data=png(self._service.settings.picture()), media_type="image/png"))
        async with ModelConnection(self._service, self._budgets) as connection:
            model = Endpoint(
                connection,
                instructions=lambda mode: act_instructions(self._tools, mode),
                exact_tools=[one_call(self._offered(scene))],
                find=find_calls,
                turns=_READINGS,
            )
            result = await self._agent.run(
                content if first else None,
                message_history=self._said,
                deferred_tool_results=None if first else DeferredToolResults(calls=self._results),
                model=model,
                toolsets=[ExternalToolset(self._tools)],
                usage_limits=NO_LIMITS,
                infer_name=False,
            )
        self._said, self._results = result.all_messages(), {}
        # An `Endpoint` answers with calls only.
        assert isinstance(result.output, DeferredToolRequests)
        thought = thought_of(result.response)
        if thought:
            self._desk.emit(Thought(thought))
        return result.output.calls

    def _handled(self, call: ToolCallPart, scene: ObservedScene) -> Plan | Refusal | PromptDone | None:
        """Return what a call asks the agent for; None where it has been answered here."""
        arguments = call.args_as_dict()
        try:
            answer = self._answer(call.tool_name, arguments, scene)
        except ValidationError as error:
            answer = {"ok": False, "error": wrong_arguments(call.tool_name, error, OWN[call.tool_name])}
        except InputError as error:
            answer = {"ok": False, "error": str(error)}
        return self._settled(call, answer, scene)

    def _settled(
        self, call: ToolCallPart, answer: Plan | Refusal | PromptDone | dict[str, Any], scene: ObservedScene
    ) -> Plan | Refusal | PromptDone | None:
        """Return what a call asks the agent for, once it is checked; None where it is answered here."""
        if isinstance(answer, Plan):
            refused = self._turned_down(answer, scene)
            if refused is not None and not refused["ok"]:
                count_sent_back(f"{call.tool_name}: {json.dumps(refused)}")
            if refused is not None and self._program is not None:
                refused = self._program.broken_off(refused)
            answer = refused or answer
        if not isinstance(answer, dict):
            self._under_way = (call, scene)
            return answer
        data = rounded(answer)
        self._program = None
        self._results[call.tool_call_id] = ToolReturn(data, content=self._pictures) if self._pictures else data
        self._pictures = []
        self._desk.emit(Consulted(tool=call.tool_name, arguments=call.args_as_dict(), answer=data))
        if not data.get("ok", True):
            self._leave_rest(f"{call.tool_name} before it did not work")
        return None

    def _answer(
        self, name: str, arguments: Mapping[str, Any], scene: ObservedScene
    ) -> Plan | Refusal | PromptDone | dict[str, Any]:
        """Return what a tool comes to: something for the agent, or data for the model."""
        model = OWN.get(name)
        if model is None:
            return Plan(steps=(SkillCall(skill=name, arguments=dict(arguments)),))
        given, kept = model.model_validate(arguments), self._ledger.of_each_call
        skills = list(self._desk.skills.values())
        match given:
            case CheckArguments():
                return checked(Plan(steps=given.steps), scene, skills, kept)
            case SimulateArguments():
                return simulated(self._desk.ctx, Plan(steps=given.steps), self._desk.skills, kept)
            case AchieveArguments():
                goals, robot = relations(given.goals), self._desk.ctx.abilities()
                found = solve(goals, scene, skills, constraints=kept, robot=robot)
                return found if isinstance(found, Plan) else {"ok": False, "error": found.message}
            case ProgramArguments():
                return self._programmed(given)
            case AskArguments():
                if self._desk.ask is None:
                    raise InputError("nobody is here to answer; refuse with `ambiguous` where it matters")
                return {"answer": self._desk.ask(given.message)}
            case FinishArguments():
                return self._ledger.finished(given, scene)
            case RefuseArguments():
                return as_refusal(given, scene, self._desk.skills)
            case SceneLookArguments():
                return self._looked(given)
        raise AssertionError(f"{name} has no handler")

    def _programmed(self, given: ProgramArguments) -> Plan | dict[str, Any]:
        """Return the first call of a program, or what it came to without one."""
        if not self._can_program:
            raise InputError("programs are not carried out here; make one call after another")
        from robosandbox.agent.llm.program import RunningProgram

        self._program = RunningProgram(given.code, self._desk.ctx, self._desk.skills)
        return self._program.begin()

    def _turned_down(self, plan: Plan, scene: ObservedScene) -> dict[str, Any] | None:
        """Return why a plan is not begun; None where nothing stands against it."""
        if not plan.steps:
            return {"ok": True, "done": [], "note": "it holds already"}
        over = self._ledger.over_budget(plan)
        if over:
            return {"ok": False, "error": over}
        verdict = verify(plan, scene, list(self._desk.skills.values()), constraints=self._ledger.of_each_call)
        if verdict.problems:
            # Only the first call would be made in the scene as it is.
            is_of_the_first = verdict.problems[0].step == 1 and bool(verdict.calls)
            error = self._desk.ctx.foreseen(verdict.calls[0]) if is_of_the_first else None
            told = {"ok": False, "turned_down": [problem.record() for problem in verdict.problems]}
            return told if error is None else {**told, "error": error_data(error)}
        return None

    def _looked(self, given: SceneLookArguments) -> dict[str, Any]:
        scene = self._desk.ctx.look()
        data: dict[str, Any] = {"scene": describe_scene(scene)}
        if not given.camera:
            return data
        try:
            picture, calibration = marked_picture(self._desk.ctx, given.camera, scene)
        except RenderingError as error:
            return data | {"error": str(error)}
        self._pictures.append(BinaryContent(data=picture, media_type="image/png"))
        return data | {"picture": calibration}

    def _take(self, report: Report, scene: ObservedScene) -> Plan | Refusal | PromptDone | None:
        """Note what came of the call under way; return the next one of a program that goes on."""
        assert self._under_way is not None
        call, before = self._under_way
        self._under_way = None
        self._ledger.take(report)
        told = outcome(report.steps, report.failure, before, scene)
        if self._program is not None:
            return self._settled(call, self._program.go_on(told), scene)
        self._results[call.tool_call_id] = told
        if report.failure is not None:
            self._leave_rest(f"{self._ledger.failed} failed")
        return None

    def _leave_rest(self, why: str) -> None:
        """Answer the calls of the same turn that are left: each was meant for a world in which those before had worked."""
        while self._calls:
            self._results[self._calls.popleft().tool_call_id] = {"ok": False, "not_begun": why}
