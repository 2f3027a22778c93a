"""Signature of a skill in one short line, for prompts, corrections and messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robosandbox.world.operators import Operator

BOUNDS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
"""How the range of a number is written, by the keyword of JSON schema."""


def signature(skill: Operator) -> str:
    """Return a skill's name and arguments, as in `push(object, direction: forward|back|left|right, distance > 0 = 0.1)`."""
    return form(skill.name, skill.schema)


def form(name: str, schema: Mapping[str, Any]) -> str:
    """Return the same of anything that has a name and a JSON schema."""
    required = set(schema.get("required", ()))
    arguments = [
        _argument(field, given, optional=field not in required) for field, given in schema.get("properties", {}).items()
    ]
    return f"{name}({', '.join(arguments)})"


def bounds(field: Mapping[str, Any]) -> list[str]:
    """Return the range of a number in a JSON schema, as in `["> 0", "<= 1"]`; nothing where it has none."""
    return [f"{sign} {field[key]:g}" for key, sign in BOUNDS.items() if key in field]


def _argument(name: str, field: Mapping[str, Any], *, optional: bool) -> str:
    text = name
    if "enum" in field:
        text += f": {'|'.join(map(str, field['enum']))}"
    elif field.get("type") not in ("string", None):
        text += " ".join([f": {field['type']}", ", ".join(bounds(field))]).rstrip()
    return f"{text} = {field.get('default')}" if optional else text
