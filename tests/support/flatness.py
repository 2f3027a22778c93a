"""What keeps a tool's schema from being flat."""

from collections.abc import Iterator, Mapping
from typing import Any

_NESTING = {"anyOf", "oneOf", "allOf", "$ref", "$defs", "const"}


def unflat(schema: Mapping[str, Any], where: str = "arguments") -> Iterator[str]:
    """Yield each reference, alternative, empty object and untyped value of a schema; a tool itself may take nothing."""
    yield from (f"{where}: {keyword}" for keyword in sorted(_NESTING & schema.keys()))
    if not schema.get("type"):
        yield f"{where}: no type"
    fields = schema.get("properties")
    if (schema.get("type") == "object" and where != "arguments" and not fields) or fields == {}:
        yield f"{where}: an object without properties"
    if schema.get("type") == "array" and "items" not in schema:
        yield f"{where}: an array without items"
    for name, field in {**(fields or {}), **({"[]": schema["items"]} if "items" in schema else {})}.items():
        yield from unflat(field, f"{where}.{name}")
