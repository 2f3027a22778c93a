"""The part of a JSON schema that constrained decoding keeps; what it cannot keep is told in words.

Servers turn a schema into a grammar over tokens. A grammar holds types, keys, enumerations and lengths. The range of a
number is arithmetic: llama.cpp leaves it out for fractions, and vendors' services refuse or drop it. A schema sent with
such a keyword would promise what nobody keeps. The keyword therefore goes into the description, and the value is judged
where the answer is read.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from robosandbox.agent.signatures import BOUNDS, bounds

_NOTES = frozenset({"description", "default"})
# Keywords that the grammars of local servers and of the vendors' services have in common.
_KEPT = frozenset({"type", "enum", "const", "required", "minItems", "maxItems", "minLength", "maxLength"}) | _NOTES
_OF_ONE = frozenset({"items", "additionalProperties"})
# Keywords that restrict no answer, or are carried over in another way.
_SILENT = frozenset({"$ref", "$defs", "$schema", "$id", "title", "examples", "discriminator", *BOUNDS})


class _Carried(NamedTuple):
    """Reduction of a schema keyword: its new name, and the function that reduces the schema in its value."""

    name: str
    carry: Callable[[Callable[[Any], Any], Any], Any]


def _each(inner: Callable[[Any], Any], schemas: list[Any]) -> list[Any]:
    return [inner(item) for item in schemas]


_CARRIED = {
    **{key: _Carried(key, lambda inner, value: value) for key in _KEPT},
    **{key: _Carried(key, lambda inner, value: inner(value)) for key in _OF_ONE},
    **{key: _Carried(key, _each) for key in ("anyOf", "prefixItems")},
    # A grammar tells which alternatives fit, not whether only one does.
    "oneOf": _Carried("anyOf", _each),
    "properties": _Carried("properties", lambda inner, fields: {name: inner(field) for name, field in fields.items()}),
}


def decodable(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return a schema that says only what constrained decoding keeps; every value that fits the given one fits it.

    Definitions of schemas within it become definitions of the whole, since a reference is read from the root. One that
    leads nowhere allows any value.

    Args:
        schema: A JSON schema; references lead to the `$defs` of one of the schemas around them.
    """
    definitions: dict[str, Any] = {}
    found = _reduced(schema, {}, definitions)
    return {**found, "$defs": definitions} if definitions else found


def _reduced(schema: Mapping[str, Any], names: Mapping[str, str], definitions: dict[str, Any]) -> dict[str, Any]:
    """Return a schema reduced, with references renamed by `names` and its definitions added to `definitions`."""

    def inner(item: Any) -> Any:
        # True and false are schemas, too.
        return _reduced(item, names, definitions) if isinstance(item, Mapping) else item

    own = {name: _free(name, definitions) for name in schema.get("$defs", {})}
    names = {**names, **{f"#/$defs/{name}": f"#/$defs/{free}" for name, free in own.items()}}
    for name, free in own.items():
        definitions[free] = inner(schema["$defs"][name])
    if "$ref" in schema:
        reference = {"$ref": names[schema["$ref"]]} if schema["$ref"] in names else {}
        return reference | {key: schema[key] for key in schema if key in _NOTES}
    # Beside patterns "additionalProperties" speaks of what no pattern fits, which a grammar without them cannot tell.
    carried = _CARRIED if "patternProperties" not in schema else {k: v for k, v in _CARRIED.items() if k not in _OF_ONE}
    found = {carried[key].name: carried[key].carry(inner, value) for key, value in schema.items() if key in carried}
    told = bounds(schema)
    told += [f"{key} {json.dumps(schema[key])}" for key in schema if key not in carried and key not in _SILENT]
    if told:
        found["description"] = f"{found.get('description', '')} ({', '.join(told)})".strip()
    return found


def _free(name: str, taken: dict[str, Any]) -> str:
    """Return a name that no definition has yet, and reserve it."""
    free, number = name, 1
    while free in taken:
        number += 1
        free = f"{name}_{number}"
    taken[free] = {}
    return free
