"""In which way a server can be held to the form of an answer."""

from __future__ import annotations

from collections.abc import Container, Sequence
from enum import StrEnum
from typing import Any

from pydantic_ai.models import ModelRequestParameters
from pydantic_ai.output import OutputObjectDefinition
from pydantic_ai.tools import ToolDefinition

from robosandbox.agent.flat_schema import flat
from robosandbox.agent.llm.forms import AnswerTool
from robosandbox.agent.llm.schema import decodable


class Mode(StrEnum):
    """Ways of asking for an answer, the most binding first."""

    SCHEMA = "schema"
    """The server writes JSON by a schema and nothing else (`response_format`, `output_config.format`)."""
    TOOLS = "tools"
    """The model must call one of the tools (`tool_choice` required, Anthropic's `any`)."""
    OFFERED = "offered"
    """The model may call one of the tools (`tool_choice` auto), where a server cannot be told that it must."""
    TEXT = "text"
    """The form is only described; the answer is read from the text."""

    @property
    def binds(self) -> bool:
        """True where the server holds the model to the form."""
        return self in (Mode.SCHEMA, Mode.TOOLS)

    @property
    def has_tools(self) -> bool:
        """True where the server is sent tools and answers with calls of them."""
        return self in (Mode.TOOLS, Mode.OFFERED)

    def parameters(self, tools: Sequence[AnswerTool]) -> ModelRequestParameters:
        """Return how a request holds a model to these tools."""
        match self:
            case Mode.SCHEMA:
                schema = OutputObjectDefinition(json_schema=decodable(_answer_schema(tools)), name="answer")
                return ModelRequestParameters(output_mode="native", output_object=schema, allow_text_output=True)
            case Mode.TOOLS | Mode.OFFERED:
                definitions = [
                    ToolDefinition(
                        name=tool.name,
                        description=tool.description,
                        parameters_json_schema=decodable(flat(tool.schema)),
                        kind="output",
                    )
                    for tool in tools
                ]
                return ModelRequestParameters(
                    output_mode="tool", output_tools=definitions, allow_text_output=self is Mode.OFFERED
                )
            case Mode.TEXT:
                return ModelRequestParameters(output_mode="text", allow_text_output=True)


def after_refusal(tried: Container[Mode]) -> Mode | None:
    """Return the next way to ask a server that does not take a request; None after the last."""
    return next((mode for mode in Mode if mode not in tried), None)


def after_no_answer(tried: Container[Mode]) -> Mode:
    """Return the next way to ask a server that takes requests and does not keep to them: binding, or in words."""
    return next((mode for mode in Mode if mode not in tried and mode.binds), Mode.TEXT)


def _answer_schema(tools: Sequence[AnswerTool]) -> dict[str, Any]:
    """Return the schema of an answer with one of the tools; its root is an object, as services ask."""
    schemas = [dict(tool.schema) for tool in tools]
    if len(schemas) == 1:
        return schemas[0]
    return {
        "type": "object",
        "properties": {"answer": {"anyOf": schemas}},
        "required": ["answer"],
        "additionalProperties": False,
    }
