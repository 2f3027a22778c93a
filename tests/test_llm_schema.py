"""The schema that a server is held to: what a grammar cannot keep is told in words, and no valid value is shut out."""

from enum import StrEnum
from typing import Annotated, Any, Literal

import pytest
from jsonschema import Draft202012Validator
from pydantic import Field
from pydantic_ai.tools import ToolDefinition
from support.flatness import unflat

from robosandbox.agent.flat_schema import flat
from robosandbox.agent.llm.answer import answer_tools
from robosandbox.agent.llm.modes import Mode, decodable
from robosandbox.agent.llm.pointing import TOOL as POINT
from robosandbox.agent.llm.toolbox import acting_tools
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import StrictModel


class Grip(StrEnum):
    SOFT = "soft"
    FIRM = "firm"


class Point(StrictModel):
    x: Annotated[float, Field(ge=-1.0, le=1.0)]


class Tree(StrictModel):
    height: Annotated[float, Field(gt=0.0)]
    branches: tuple["Tree", ...] = ()


class Arguments(StrictModel):
    """Arguments with everything that pydantic refers to by definitions."""

    grip: Grip
    to: Point
    via: Annotated[tuple[Point, ...], Field(max_length=2)] = ()
    tree: Tree | None = None
    turns: Annotated[int, Field(ge=1, multiple_of=2)] = 2
    label: Annotated[str, Field(pattern="^[a-z]+$", max_length=5)] = "a"


class Other(StrictModel):
    """Arguments whose definition has the name of another's, and other contents."""

    class Point(StrictModel):
        side: Literal["left", "right"]

    to: Point


def inside(*schemas: dict[str, Any]) -> dict[str, Any]:
    """Return a schema with others deep in it, as a plan's schema holds those of its skills."""
    return {"type": "object", "properties": {"step": {"anyOf": list(schemas)}}, "required": ["step"]}


WHOLE = decodable(inside(flat(Arguments.model_json_schema()), flat(Other.model_json_schema())))


def keywords(schema: Any) -> set[str]:
    """Return every key of a schema, names of properties and definitions among them."""
    if isinstance(schema, dict):
        return set(schema) | {key for item in schema.values() for key in keywords(item)}
    return {key for item in schema for key in keywords(item)} if isinstance(schema, list) else set()


def test_what_no_grammar_keeps_is_told_in_the_description() -> None:
    gone = {"minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "multipleOf", "pattern", "title"}
    assert not gone & keywords(WHOLE)
    fields = WHOLE["properties"]["step"]["anyOf"][0]["properties"]
    assert fields["turns"]["description"] == "(>= 1, multipleOf 2)"
    assert fields["label"] == {"type": "string", "maxLength": 5, "default": "a", "description": '(pattern "^[a-z]+$")'}
    assert fields["to"]["properties"]["x"]["description"] == "(>= -1, <= 1)"


@pytest.mark.parametrize(
    "step",
    [
        {"grip": "soft", "to": {"x": 0.5}, "via": [{"x": 0}], "turns": 4, "label": "abc"},
        {"grip": "firm", "to": {"x": 1}, "tree": {"height": 2, "branches": [{"height": 1}]}},
        {"grip": "firm", "to": {"x": 7}, "turns": -3, "label": "A"},
        {"to": {"side": "left"}},
    ],
)
def test_a_value_of_the_right_form_fits_and_its_range_is_left_to_the_reader(step: dict[str, Any]) -> None:
    Draft202012Validator(WHOLE).validate({"step": step})


@pytest.mark.parametrize(
    "step",
    [
        {"grip": "hard", "to": {"x": 0.5}},
        {"grip": "soft", "to": {"x": "left"}},
        {"grip": "soft", "to": {"side": "left"}},
        {"grip": "soft", "to": {"x": 0}, "via": [{"x": 0}] * 3},
        {"grip": "soft", "to": {"x": 0}, "tree": {"height": "tall"}},
        {"grip": "soft", "to": {"x": 0}, "label": "abcdef"},
        {"to": {"side": "up"}},
    ],
)
def test_what_a_grammar_keeps_is_still_asked_for(step: dict[str, Any]) -> None:
    assert not Draft202012Validator(WHOLE).is_valid({"step": step})


@pytest.mark.parametrize(
    "tool",
    [*answer_tools(load_skills()), *acting_tools(load_skills(), can_ask=True, can_program=True), POINT],
    ids=lambda tool: tool.name,
)
def test_every_tool_that_a_model_is_sent_is_flat(tool: ToolDefinition) -> None:
    (sent,) = Mode.TOOLS.parameters([tool]).output_tools
    assert not list(unflat(sent.parameters_json_schema))


@pytest.mark.parametrize("model", [Arguments, Other])
def test_any_model_of_arguments_becomes_flat(model: type[StrictModel]) -> None:
    found = list(unflat(flat(model.model_json_schema())))
    # A tree holds trees.
    assert found == (["arguments.tree.branches.[]: an object without properties"] if model is Arguments else [])


def test_what_fits_one_of_several_alternatives_fits_the_flat_schema() -> None:
    schema = flat(
        inside(
            Arguments.model_json_schema(),
            {"type": "null"},
            {"type": "object", "properties": {"grip": {"const": "hook"}}},
        )
    )
    step = schema["properties"]["step"]
    assert step["properties"]["grip"]["enum"] == ["soft", "firm", "hook"] and "required" not in step
