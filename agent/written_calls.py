"""Calls written out, as plans are printed: "pick(object=red_cube), place_on(target=blue_cube)"."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from robosandbox.types import SkillCall
from robosandbox.world.operators import Operator

_CALL = re.compile(r"\s*(\w+)\s*\(([^()]*)\)\s*(?:[,;.]|then\b|$)\s*")
_ARGUMENT = re.compile(r"\s*(?:(\w+)\s*=)?\s*(\"[^\"]*\"|'[^']*'|\[[^\]]*\]|[^,]*?)\s*(?:,|$)")


def written_calls(text: str, calls: Mapping[str, Operator]) -> tuple[SkillCall, ...]:
    """Return the calls that a text consists of; none where it holds anything else, or a name that nothing here has.

    Values are read as YAML reads them; those without a name are arguments in the order of the schema.
    """
    found: list[SkillCall] = []
    at = 0
    while at < len(text.rstrip()):
        match = _CALL.match(text, at)
        skill = calls.get(match[1]) if match else None
        if match is None or skill is None:
            return ()
        arguments = _arguments(match[2], tuple(skill.schema.get("properties", {})))
        if arguments is None:
            return ()
        found.append(SkillCall(skill=match[1], arguments=arguments))
        at = match.end()
    return tuple(found)


def _arguments(text: str, names: Sequence[str]) -> dict[str, Any] | None:
    """Return arguments by name; None where the text is no list of them."""
    if not text.strip():
        return {}
    found: dict[str, Any] = {}
    left = list(names)
    for part in re.findall(r"(?:[^,\"'\[]|\"[^\"]*\"|'[^']*'|\[[^\]]*\])+", text):
        match = _ARGUMENT.fullmatch(part)
        if match is None:
            return None
        name = match[1] or next((one for one in left if one not in found), None)
        if name is None or name in found:
            return None
        found[name] = _value(match[2])
    return found


def _value(text: str) -> Any:
    if text == "None":
        return None
    try:
        return yaml.safe_load(text) if text else text
    except yaml.YAMLError:
        return text
