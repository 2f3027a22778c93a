"""Modes in which a server is held to the form of an answer, and the part of a schema that constrained decoding keeps."""

from __future__ import annotations

import json
from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from typing import Any

from pydantic_ai.models import ModelRequestParameters
from pydantic_ai.output import OutputObjectDefinition
from pydantic_ai.tools import ToolDefinition

from robosandbox.agent.flat_schema import flat
from robosandbox.agent.signatures import BOUNDS, bounds

# Keywords that the grammars of local servers and of the vendors' services have in common.
_KEPT = frozenset(
    {"type", "enum", "const", "required", "minItems", "maxItems", "minLength", "maxLength", "description", "default"}
)
# Keywords that restrict no answer, or are carried over in another way.
_SILENT = frozenset({"properties", "items", "additionalProperties", "anyOf", "$schema", "$id", "title", "examples"})


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

    def parameters(self, tools: Sequence[ToolDefinition]) -> ModelRequestParameters:
        """Return how a request holds a model to these tools."""
        match self:
            case Mode.SCHEMA:
                schema = OutputObjectDefinition(json_schema=decodable(_answer_schema(tools)), name="answer")
                return ModelRequestParameters(output_mode="native", output_object=schema, allow_text_output=True)
            case Mode.TOOLS | Mode.OFFERED:
                definitions = [
                    replace(tool, parameters_json_schema=decodable(flat(tool.parameters_json_schema)), kind="output")
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


def _answer_schema(tools: Sequence[ToolDefinition]) -> dict[str, Any]:
    """Return the schema of an answer with one of the tools; its root is an object, as services ask."""
    schemas = [tool.parameters_json_schema for tool in tools]
    if len(schemas) == 1:
        return schemas[0]
    return {
        "type": "object",
        "properties": {"answer": {"anyOf": schemas}},
        "required": ["answer"],
        "additionalProperties": False,
    }


def decodable(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return a schema that says only what constrained decoding keeps; every value that fits the given one fits it.

    Servers turn a schema into a grammar over tokens. A grammar holds types, keys, enumerations and lengths. The range of a
    number is arithmetic: llama.cpp leaves it out for fractions, and vendors' services refuse or drop it. Such a keyword goes
    into the description, and the value is judged where the answer is read.

    Args:
        schema: A JSON schema without references, flat but for `anyOf`.
    """
    found = {key: value for key, value in schema.items() if key in _KEPT}
    if "properties" in schema:
        found["properties"] = {name: decodable(field) for name, field in schema["properties"].items()}
    if "anyOf" in schema:
        found["anyOf"] = [decodable(option) for option in schema["anyOf"]]
    for key in ("items", "additionalProperties"):
        # Beside patterns "additionalProperties" speaks of what no pattern fits, which a grammar without them cannot tell.
        if key in schema and "patternProperties" not in schema:
            found[key] = decodable(schema[key]) if isinstance(schema[key], Mapping) else schema[key]
    told = bounds(schema)
    told += [
        f"{key} {json.dumps(value)}" for key, value in schema.items() if key not in _KEPT | _SILENT | BOUNDS.keys()
    ]
    if told:
        found["description"] = f"{found.get('description', '')} ({', '.join(told)})".strip()
    return found
