"""Arguments of a skill that name objects, and the objects that its contract allows for each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robosandbox.types import ObservedScene
from robosandbox.world.contracts import Contract, find, lookup
from robosandbox.world.facts import HELD, Fact
from robosandbox.world.operators import Operator
from robosandbox.world.predicate import View

# Stands for a number of any unit of which only the type matters; chosen within the bounds of all skills here.
_NUMBER = 0.05
# By how much the numbers of one call differ, in units of each; chosen so that two that are mixed up are noticed, and
# none leaves its bounds.
_APART = 0.001


def object_arguments(skill: Operator) -> tuple[str, ...]:
    """Return the arguments that are ids of objects; none for a skill that promises nothing."""
    return tuple(name for name, probe in _probes(skill).items() if probe in _objects(skill, {}))


def fitting(skill: Operator, argument: str, scene: ObservedScene) -> list[str]:
    """Return the ids that an argument can be given at all: of a kind for which the skill is made.

    Args:
        skill: Whose.
        argument: One of its `object_arguments`.
        scene: What is seen.
    """
    view = View.of(scene)

    def fits(name: str) -> bool:
        contract = _contract(skill, {argument: name})
        known = (need for need in contract.needs if lookup(need).is_fixed)
        about = (need for need in known if lookup(need).objects(need.arguments) == [name])
        return not any(find(need, view).is_refuted for need in about)

    return [item.id for item in scene.objects if fits(item.id)]


def terms(skill: Operator) -> str:
    """Return what a skill needs and brings about, in a sentence with its arguments' names; "" where it promises nothing."""
    contract = _contract(skill, {})
    if not contract.gives:
        return ""
    names = {value: name for name, value in _values(skill, {}).items()}
    # A need of two steps of a skill is listed once.
    needs, gives = (
        ", ".join(dict.fromkeys(_named(one, names) for one in facts)) for facts in (contract.needs, contract.gives)
    )
    return f"Needs {needs or 'nothing'}; brings about {gives}."


def _named(one: Fact, names: Mapping[Any, str]) -> str:
    """Return a fact with the arguments' names in place of the values that were put in for them."""
    return str(
        Fact(one.relation, tuple("held" if value == HELD else names.get(value, value) for value in one.arguments))
    )


def _objects(skill: Operator, given: Mapping[str, Any]) -> tuple[str, ...]:
    return _contract(skill, given).objects


def _contract(skill: Operator, given: Mapping[str, Any]) -> Contract:
    return skill.contract(**_values(skill, given))


def _values(skill: Operator, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments for a call: those given, names that no object has, and samples that differ from one another."""
    properties, probes = skill.schema.get("properties", {}), _probes(skill)
    return {
        name: given.get(name, probes.get(name, _sample(field, number)))
        for number, (name, field) in enumerate(properties.items())
    }


def _probes(skill: Operator) -> dict[str, str]:
    """Return for each argument that may be an id a name that no object has."""
    fields = skill.schema.get("properties", {}).items()
    return {name: f"*{name}" for name, field in fields if _may_be_id(field)}


def _may_be_id(field: Mapping[str, Any]) -> bool:
    options = [field, *field.get("anyOf", ())]
    return any(one.get("type") == "string" and "enum" not in one for one in options)


def _sample(field: Mapping[str, Any], number: int) -> Any:
    if "enum" in field:
        return field["enum"][0]
    return field["default"] if "default" in field else _NUMBER + number * _APART
