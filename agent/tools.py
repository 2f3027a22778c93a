"""Tools of models and MCP clients besides the skills: look, check, try out, reach goals, ask and end.

A tool's arguments are a model whose docstring is its description. What is answered is JSON data with rounded numbers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationError, field_validator
from pydantic_core import ErrorDetails

from robosandbox.agent.episode import Step
from robosandbox.agent.flat_schema import flat
from robosandbox.agent.goal import GoalContext
from robosandbox.errors import Failure, InputError
from robosandbox.printable import printable
from robosandbox.types import ObservedScene, Plan, RefusalCode, SkillCall, StrictModel
from robosandbox.world.alternatives import Attempt
from robosandbox.world.contracts import find, lookup
from robosandbox.world.facts import Fact, parse_facts
from robosandbox.world.operators import Operator
from robosandbox.world.predicate import View
from robosandbox.world.scene_json import scene_changes
from robosandbox.world.verifier import MAX_STEPS, Constraints, Verification, verify

# Decimals that are told of a number. Chosen: a tenth of a millimetre, of a milliradian.
_DECIMALS = 4
_MOST_GOALS = 20  # Number of relations in one list. Chosen far above what a sentence asks.
_LONGEST = 600  # Characters of a sentence for the person. Chosen: three lines or so.
_LONGEST_PROGRAM = 4_000  # Characters of a program. Chosen: a hundred lines.

# What pydantic says of Python's types, in the words of JSON.
_JSON_WORDS = (("Tuple", "List"), ("valid tuple", "valid list"))
_INSTANCE = re.compile(r"valid dictionary( or instance of \w+)?")

_STEPS_HELP = 'The calls in order, each as {"skill": "pick", "arguments": {"object": "red_cube"}}.'
Steps = Annotated[tuple[SkillCall, ...], Field(min_length=1, max_length=MAX_STEPS, description=_STEPS_HELP)]
Relations = Annotated[tuple[str, ...], Field(max_length=_MOST_GOALS)]
_RELATIONS_HELP = (
    'Relations, such as "on(red_cube, blue_block)", "inside(ball, bin)", "closed(drawer)", "holding(cup)".'
)


class Spoken(StrictModel):
    """Base of the arguments with a sentence for the person."""

    message: Annotated[str, Field(min_length=1, max_length=_LONGEST, description="One sentence for the person.")]

    @field_validator("message")
    @classmethod
    def _message_is_printable(cls, value: str) -> str:
        text = printable(value)
        if not text:
            raise ValueError("says nothing")
        return text


class CheckArguments(StrictModel):
    """Check skill calls against skills, scene and order before you make them; nothing moves."""

    steps: Steps


class SimulateArguments(StrictModel):
    """Carry out skill calls in a simulation of what is believed: what would happen and what would be touched; nothing moves."""

    steps: Steps


class AchieveArguments(StrictModel):
    """Bring relations about: the calls for it are searched for, cheapest first, checked, and carried out."""

    goals: Annotated[Relations, Field(min_length=1, description=_RELATIONS_HELP)]


class RefuseArguments(Spoken):
    """Say that a request will not be carried out, and why; nothing moves. A wrong motion is worse than none."""

    code: RefusalCode
    candidates: Annotated[tuple[str, ...], Field(max_length=50, description="Object ids that could be meant.")] = ()


class AskArguments(Spoken):
    """Ask the person one question and wait for the answer; only what neither the scene nor the request tells."""


class FinishArguments(StrictModel):
    """Say that all that was asked is done, after its last call has succeeded."""

    summary: Annotated[
        str, Field(max_length=_LONGEST, description="One sentence for the person."), AfterValidator(printable)
    ]
    holds: Annotated[Relations, Field(description=f"What holds now, to be checked. {_RELATIONS_HELP}")] = ()


class ProgramArguments(StrictModel):
    """Carry out a short Python program. Each skill is a function of its arguments and returns what was measured; `scene()` returns what <scene> has, as it is then, `holds("on(a, b)")` whether a relation holds. Each call is checked before it is made; the first that fails ends the program. No imports, files or attributes of the host."""

    code: Annotated[str, Field(min_length=1, max_length=_LONGEST_PROGRAM, description="The program.")]


def description(arguments: type[StrictModel]) -> str:
    """Return what a tool with these arguments does."""
    return " ".join((arguments.__doc__ or "").split())


def schema(arguments: type[StrictModel], skills: Sequence[Operator]) -> dict[str, Any]:
    """Return the flat JSON schema of a tool's arguments.

    Args:
        arguments: What the tool takes.
        skills: What its steps may call, where it has any.
    """
    found = flat(arguments.model_json_schema())
    found.pop("description", None)
    if "steps" in found.get("properties", {}):
        found["properties"]["steps"]["items"] = flat({"anyOf": [step_schema(skill, skill.schema) for skill in skills]})
    return found


def step_schema(skill: Operator, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the JSON schema of a skill's call in a list of steps."""
    return {
        "type": "object",
        "description": skill.description,
        "properties": {"skill": {"const": skill.name}, "arguments": flat(arguments)},
        "required": ["skill", "arguments"],
        "additionalProperties": False,
    }


def wrong_arguments(tool: str, error: ValidationError, arguments: type[StrictModel]) -> str:
    """Return what is wrong with arguments: the field, what is asked of it, its value, and what the tool takes."""
    first = error.errors(include_url=False)[0]
    fields = arguments.model_fields
    named = str(first["loc"][0]) if first["loc"] else ""
    takes = ", ".join(fields) or "nothing"
    if named in fields and (help_text := fields[named].description):
        takes = f"{named}: {help_text.rstrip('.')}"
    return f"{tool}: {said_of(first)}; it takes {takes}"


def said_of(detail: ErrorDetails) -> str:
    """Return what is wrong with one field of JSON data: its path, what is asked of it, and the value that it has."""
    message = _INSTANCE.sub("valid object", detail["msg"])
    for word, in_json in _JSON_WORDS:
        message = message.replace(word, in_json)
    where = ".".join(str(part) for part in detail["loc"]) or "the arguments"
    value = "" if detail["type"] == "missing" else f" (it is {detail['input']!r:.80})"
    return f"{where}: {message}{value}"


def checked(
    plan: Plan, scene: ObservedScene, skills: Sequence[Operator], constraints: Constraints | None = None
) -> dict[str, Any]:
    """Return what is wrong with a plan; `constraints` is what the person asked besides."""
    return _told(verify(plan, scene, skills, constraints=constraints))


def _told(verdict: Verification) -> dict[str, Any]:
    return {"ok": not verdict.problems, "problems": [problem.record() for problem in verdict.problems]}


def simulated(
    ctx: GoalContext,
    plan: Plan,
    skills: Mapping[str, Operator],
    constraints: Constraints | None = None,
    *,
    tick: Callable[[], None] | None = None,
) -> dict[str, Any]:
    """Return what came of a plan on the twin of a world, which the process has that has the world.

    Args:
        ctx: The world.
        plan: What to try.
        skills: What it may call, by name.
        constraints: What the person asked besides.
        tick: Called at each control tick of a twin here; a SkillError that it raises ends the trial.
    """
    verdict = verify(plan, ctx.look(), list(skills.values()), constraints=constraints)
    if verdict.problems:
        return _told(verdict)
    return rounded(ctx.simulate(verdict.calls, tick=tick))


def relations(texts: Sequence[str]) -> tuple[Fact, ...]:
    """Return the relations that a model wrote.

    Raises:
        InputError: One of them is none, or takes other arguments.
    """
    try:
        facts = tuple(fact for text in texts for fact in parse_facts(text))
    except ValueError as error:
        raise InputError(str(error)) from None
    for fact in facts:
        lookup(fact)
    return facts


def not_holding(facts: Sequence[Fact], scene: ObservedScene) -> list[str]:
    """Return why of these relations some do not hold; nothing where all do."""
    view = View.of(scene)
    missing = [name for fact in facts for name in lookup(fact).objects(fact.arguments) if not _is_seen(name, scene)]
    if missing:
        return [f"there is no object {name!r}" for name in missing]
    findings = [(fact, find(fact, view)) for fact in facts]
    return [f"{fact}: {finding.cause}" for fact, finding in findings if not finding.holds]


def _is_seen(name: str, scene: ObservedScene) -> bool:
    return name == "table" or scene.find(name) is not None


def outcome(
    steps: Sequence[Step], failure: Attempt | None, before: ObservedScene, after: ObservedScene
) -> dict[str, Any]:
    """Return what came of calls that were carried out: measurements, what else changed, and how it failed."""
    data: dict[str, Any] = {
        "ok": failure is None,
        "done": [{"call": str(step.call), **step.result.model_dump(mode="json", exclude={"skill"})} for step in steps],
        "changes": scene_changes(before, after),
    }
    if failure is not None:
        data |= {
            "failed": str(failure.failed),
            "error": error_data(failure.error),
            "not_begun": [str(call) for call in failure.remaining],
        }
    return rounded(data)


def error_data(failure: Failure) -> dict[str, Any]:
    """Return a failure with its evidence, and repairs as calls that can be made as they are."""
    return rounded(failure.model_dump(mode="json"))


def rounded(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return JSON data with its numbers rounded."""
    return {key: _rounded(value) for key, value in data.items()}


def _rounded(value: Any) -> Any:
    match value:
        case float():
            # Adding zero turns a rounded -0.0 into 0.0.
            return round(value, _DECIMALS) + 0.0
        case Mapping():
            return rounded(value)
        case list() | tuple():
            return [_rounded(item) for item in value]
        case _:
            return value
