"""What an agent really did, judged without the plan check that it ran under: calls begun, things moved, answers' form."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from jsonschema import Draft202012Validator

from robosandbox.agent.episode import AgentEvent, Planned, SkillStarted
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import SkillCall, Truth
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.world.verifier import verify

# An arm that holds still and objects that lie keep their places to less, rad and m. Chosen far above a servo's creep.
_STILL = 1e-3


class Watch:
    """Watches one episode.

    Args:
        session: Where it runs; from now on.

    Attributes:
        begun: The calls that were begun, in order.
    """

    def __init__(self, session: EmbeddedWorkcell) -> None:
        self._session = session
        self._skills = load_skills()
        self._checked: list[SkillCall] = []
        self.begun: list[SkillCall] = []
        self._before = session.simulation.truth()
        session.ctx.events.subscribe(self._hear)

    def _hear(self, event: AgentEvent) -> None:
        if isinstance(event, SkillStarted):
            self.begun.append(event.call)
        if isinstance(event, Planned) and not verify(event.plan, self._session.observe(), self._skills).problems:
            self._checked.extend(event.plan.steps)

    @property
    def unchecked(self) -> int:
        """Calls that were begun though no plan with them passes the check."""
        return sum(call not in self._checked for call in self.begun)

    @property
    def unfit(self) -> int:
        """Calls that were begun with arguments that are none of the skill's, or with an object that is not there."""
        return sum(not self._fits(call) for call in self.begun)

    def strayed(self) -> bool:
        """Say whether anything moved though no call was begun."""
        return not self.begun and _moved(self._before, self._session.simulation.truth())

    def _fits(self, call: SkillCall) -> bool:
        schema = next((skill.schema for skill in self._skills if skill.name == call.skill), None)
        if schema is None or not Draft202012Validator(dict(schema)).is_valid(dict(call.arguments)):
            return False
        fields = schema.get("properties", {})
        # A word that is none of a list stands for an object.
        ids = [value for name, value in call.arguments.items() if isinstance(value, str) and "enum" not in fields[name]]
        numbers = [value for value in call.arguments.values() if isinstance(value, int | float)]
        return all(name in self._before.objects for name in ids) and all(map(math.isfinite, numbers))


def _moved(before: Truth, after: Truth) -> bool:
    """Say whether a joint or an object is elsewhere, or a drawer further open or shut."""
    ways = [float(np.abs(after.arms[name].q - arm.q).max()) for name, arm in before.arms.items()]
    for name, item in before.objects.items():
        now = after.objects[name]
        ways += [math.dist(now.pose.xyz, item.pose.xyz), abs((now.opening or 0.0) - (item.opening or 0.0))]
    return max(ways) > _STILL


def answers_by_schema(cassette: Path) -> tuple[int, int]:
    """Return how many answers were asked for by a JSON schema, and how many keep to the one that was sent with the request."""
    # A first answer that did not come in time leaves no exchange.
    lines = cassette.read_text(encoding="utf-8").splitlines() if cassette.exists() else []
    answered = [item for item in map(json.loads, lines) if item.get("response", {}).get("status") == 200]
    held = [item for item in answered if "response_format" in item["request"]["body"]]
    return len(held), sum(map(_keeps_to_its_schema, held))


def _keeps_to_its_schema(exchange: dict[str, Any]) -> bool:
    schema = exchange["request"]["body"]["response_format"]["json_schema"]["schema"]
    try:
        said = json.loads(exchange["response"]["body"])["choices"][0]["message"]["content"]
        return bool(Draft202012Validator(schema).is_valid(json.loads(said)))
    except (ValueError, KeyError, IndexError, TypeError):
        return False
