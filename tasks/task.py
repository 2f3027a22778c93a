"""A task: a prompt, a scene, when it has succeeded, and how seeds vary it. One YAML file each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Self

from pydantic import Field, field_validator, model_validator

from robosandbox.tasks.bundled import ALL_SUITES, STANDARD_SUITE
from robosandbox.tasks.judge.checks import TABLE, Check, On, Tapped
from robosandbox.tasks.success import Criterion
from robosandbox.types import IDENTIFIER, MAX_PROMPT_LENGTH, Finite, Limits, Randomize, Scene, StrictModel
from robosandbox.validation import did_you_mean

# Characters; chosen longer than any file of the bundled tasks: a note is a paragraph.
MAX_NOTES_LENGTH = 10_000
DEFAULT_RANDOMIZE = Randomize(xy_jitter=0.02, yaw_jitter=math.radians(10.0))
DEFAULT_RANDOMIZE_WITHOUT_OBJECTS = Randomize(q_jitter=0.1)


class Task(StrictModel):
    """Task: prompt, scene and success criterion.

    Attributes:
        name: In lists and results.
        prompt: What the agent is told: a sentence, or relations that it is to bring about; `goal` in a file says the latter.
        scene: Robot and objects, as seed 0 has them.
        success: When it counts as done.
        randomize: How far other seeds may differ. Left out, objects move by up to 2 cm and turn by up to 10 degrees (and
            a scene without objects starts with the arm up to 0.1 rad off per joint), so that seeds are never the same.
        start_q: Where the arm starts, one value per arm joint; at home when left out.
        limits: What no planner can pass.
        suite: Which of the bench's suites it belongs to.
        notes: Free text for people; `seed_note` in a file is the same.
    """

    name: str
    prompt: Annotated[str, Field(min_length=1, max_length=MAX_PROMPT_LENGTH)]
    scene: Scene
    success: Criterion
    randomize: Randomize | None = None
    start_q: tuple[Finite, ...] | None = None
    limits: Limits | None = None
    suite: str = STANDARD_SUITE
    notes: Annotated[str | None, Field(max_length=MAX_NOTES_LENGTH)] = None

    @model_validator(mode="before")
    @classmethod
    def _seed_note_is_notes(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "seed_note" not in data:
            return data
        if "notes" in data:
            raise ValueError("seed_note: is the same as notes, which is there too; keep one of them")
        return {"notes" if name == "seed_note" else name: value for name, value in data.items()}

    @model_validator(mode="before")
    @classmethod
    def _goal_is_a_prompt(cls, data: Any) -> Any:
        """Take `goal:` in place of `prompt:`, and as what success is where nothing else is said."""
        if not isinstance(data, dict) or "goal" not in data:
            return data
        if "prompt" in data:
            raise ValueError("goal: stands in place of prompt, which is there too; keep one of them")
        rest = {name: value for name, value in data.items() if name != "goal"}
        return {"success": {"kind": "goal", "relations": data["goal"]}, **rest, "prompt": data["goal"]}

    @property
    def randomization(self) -> Randomize:
        """Randomization of the other seeds, with the default filled in."""
        if self.randomize is not None:
            return self.randomize
        return DEFAULT_RANDOMIZE if self.scene.objects else DEFAULT_RANDOMIZE_WITHOUT_OBJECTS

    @field_validator("suite")
    @classmethod
    def _suite_is_plain(cls, value: str) -> str:
        if not IDENTIFIER.fullmatch(value) or value == ALL_SUITES:
            raise ValueError(f"{value!r} is no suite: use letters, digits, '_', '-' or '.', and not '{ALL_SUITES}'")
        return value

    @field_validator("name")
    @classmethod
    def _name_is_plain(cls, value: str) -> str:
        if not IDENTIFIER.fullmatch(value):
            raise ValueError(f"{value!r} is not a name: use up to 64 letters, digits, '_', '-' or '.'")
        return value

    @model_validator(mode="after")
    def _success_is_about_the_scene(self) -> Self:
        if self.is_unread:
            return self
        kinds: dict[str, str] = {item.id: item.kind for item in self.scene.objects}
        for field, check in _walk("success", self.success):
            named: list[str] = []
            for part, name, wanted in check.references():
                if name == TABLE and isinstance(check, On) and part == "target":
                    continue
                if name not in kinds:
                    there = ", ".join(kinds) or "none"
                    raise ValueError(
                        f"{field}.{part}: {name!r} is no object of the scene, which has {there}{did_you_mean(name, kinds)}"
                    )
                if wanted and kinds[name] not in wanted:
                    raise ValueError(
                        f"{field}.{part}: {name!r} is a {kinds[name]}; it takes a {' or '.join(sorted(wanted))}"
                    )
                if name in named:
                    raise ValueError(f"{field}.{part}: {name!r} is named twice; name another object")
                named.append(name)
        return self

    @model_validator(mode="after")
    def _seeds_differ(self) -> Self:
        still = Randomize()
        everywhere = [self.randomization, *(item.randomize for item in self.scene.objects if item.randomize)]
        if all(item == still for item in everywhere):
            raise ValueError(
                "randomize: is all zero, so every seed would be the same scene; leave it out for the default, or give "
                "xy_jitter"
            )
        if not self.scene.objects and not self.is_unread and self.randomization.q_jitter == 0.0:
            raise ValueError(
                "randomize.q_jitter: is 0 and there are no objects, so seeds would not differ; give e.g. 0.1"
            )
        for index, item in enumerate(self.scene.objects):
            field = f"scene.objects[{index}].randomize"
            for name in ("q_jitter", "omit"):
                if item.randomize and getattr(item.randomize, name) > 0:
                    raise ValueError(
                        f"{field}.{name}: {getattr(item.randomize, name):g} is not about one object; give it in the task's own "
                        "randomize"
                    )
        return self

    @model_validator(mode="after")
    def _companions_are_there(self) -> Self:
        if self.is_unread:
            return self
        names = [item.id for item in self.scene.objects]
        if self.randomization.moves_with is not None:
            raise ValueError("randomize.moves_with: is about one object; give it in that object's randomize")
        for index, item in enumerate(self.scene.objects):
            other = item.randomize and item.randomize.moves_with
            if other and (other not in names or other == item.id):
                raise ValueError(
                    f"scene.objects[{index}].randomize.moves_with: {other!r} is no other object of the scene"
                    f"{did_you_mean(other, names)}"
                )
        if (most := len(names) - len(self.named)) < self.randomization.omit:
            raise ValueError(f"randomize.omit: {self.randomization.omit} of {most} objects that success does not name")
        return self

    @property
    def is_unread(self) -> bool:
        """True where the scene's file was not read yet, so that nobody knows what is in it."""
        return self.scene.world is not None and not any(item.body is not None for item in self.scene.objects)

    @property
    def felt(self) -> frozenset[str]:
        """Ids of the objects whose touches success asks about."""
        return frozenset(check.object for _, check in _walk("success", self.success) if isinstance(check, Tapped))

    @property
    def named(self) -> frozenset[str]:
        """Ids of the objects that success names, and of those that keep their place to them."""
        found = {name for _, check in _walk("success", self.success) for _, name, _ in check.references()} - {TABLE}
        while True:
            # Both ways: an object and its companions stay or go together.
            pairs = [(item.id, item.randomize.moves_with) for item in self.scene.objects if item.randomize]
            more = {a for a, b in pairs if b in found} | {b for a, b in pairs if b and a in found}
            if more <= found:
                return frozenset(found)
            found |= more


def _walk(field: str, check: Check) -> Iterator[tuple[str, Check]]:
    yield field, check
    for part, child in check.children():
        yield from _walk(f"{field}.{part}", child)
