"""Flat JSON schemas: without references, alternatives and untyped properties, as every service takes them in a tool."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

_TYPES = ("string", "number", "boolean", "array", "object")
_JSON_TYPES = {str: "string", bool: "boolean", int: "integer", float: "number", list: "array", dict: "object"}
_LEFT_OUT = frozenset({"$ref", "$defs", "$schema", "$id", "anyOf", "oneOf", "allOf", "const", "discriminator", "title"})


def flat(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return a schema that says the same in types, properties, items and enumerations alone.

    References are replaced by what they lead to. Alternatives become one schema that each of them fits: properties and
    enumerations are united, and what they do not agree on is left out. Null is none of them: an argument that may be null may be
    left out. The values themselves are checked where a call is read.

    Args:
        schema: A JSON schema of an object; references lead to the `$defs` of one of the schemas around them.
    """
    return _flat(schema, {}, ())


def _flat(schema: Mapping[str, Any], definitions: Mapping[str, Any], within: tuple[str, ...]) -> dict[str, Any]:
    """Return a schema made flat; `within` are the references that have been followed to it."""
    definitions = {**definitions, **schema.get("$defs", {})}
    reference = schema.get("$ref")
    if reference in within:
        # A value that holds values of its own kind has no flat form.
        return {"type": "object"}

    def inner(item: Mapping[str, Any]) -> dict[str, Any]:
        return _flat(item, definitions, (*within, reference) if reference else within)

    found: dict[str, Any] = {}
    if reference is not None:
        found = inner(definitions.get(reference.removeprefix("#/$defs/"), {}))
    for part in schema.get("allOf", ()):
        found |= inner(part)
    options = [*schema.get("anyOf", ()), *schema.get("oneOf", ())]
    if options:
        found |= _united([inner(option) for option in options if option.get("type") != "null"])
    found |= {key: value for key, value in schema.items() if key not in _LEFT_OUT}
    if "const" in schema:
        found["enum"] = [schema["const"]]
    if found.get("default", ...) is None:
        del found["default"]
    if "properties" in found:
        found["properties"] = {name: inner(field) for name, field in found["properties"].items()}
    if "prefixItems" in found:
        found["items"] = _united([inner(item) for item in found.pop("prefixItems")])
    elif isinstance(found.get("items"), Mapping):
        found["items"] = inner(found["items"])
    if isinstance(found.get("additionalProperties"), Mapping):
        found["additionalProperties"] = inner(found["additionalProperties"])
    if not found.get("properties", True):
        del found["properties"]
    return {"type": found.pop("type", None) or _type_of(found), **found}


def _united(schemas: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the schema that what fits any of these flat ones fits."""
    if not schemas:
        return {}
    first, *others = schemas
    found = {key: value for key, value in first.items() if all(key in one and one[key] == value for one in others)}
    if "type" not in found:
        types = [kind for one in schemas for kind in _listed(one["type"])]
        if "number" in types:
            types = [kind for kind in types if kind != "integer"]
        found["type"] = types[0] if len(set(types)) == 1 else list(dict.fromkeys(types))
    if all("enum" in one for one in schemas):
        found["enum"] = list(dict.fromkeys(value for one in schemas for value in one["enum"]))
    if any("properties" in one for one in schemas):
        names = dict.fromkeys(name for one in schemas for name in one.get("properties", {}))
        found["properties"] = {
            name: _united([one["properties"][name] for one in schemas if name in one.get("properties", {})])
            for name in names
        }
        found.pop("required", None)
        required = [name for name in names if all(name in one.get("required", ()) for one in schemas)]
        if required:
            found["required"] = required
    return found


def _type_of(schema: Mapping[str, Any]) -> str | list[str]:
    """Return the type of a schema that names none: that of its enumeration, else any but null."""
    kinds = list(dict.fromkeys(_JSON_TYPES[type(value)] for value in schema.get("enum", ()) if value is not None))
    if "properties" in schema:
        return "object"
    return (kinds[0] if len(kinds) == 1 else kinds) or list(_TYPES)


def _listed(kind: str | list[str]) -> list[str]:
    return [kind] if isinstance(kind, str) else kind
