"""Sentences with what is acceptable for each: the format of a prompts file, how an answer is judged, who speaks.

A prompts file holds a scene, or the name of a bundled task, and sentences by section, each with every acceptable plan:
`pick(can); place_in(bin_a)`, with `|` between alternatives, `*` for anything, `low..high` for a range,
`any order [...] [...]`, and `!ambiguous` for a refusal (`!*` for one of any code).
"""

from __future__ import annotations

import itertools
import random
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from robosandbox.perception.colour import colour_name
from robosandbox.tasks.bundled import bundled_task
from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose, Refusal, Scene, SkillCall

CORPUS = Path(__file__).parent.parent / "tests" / "prompts"
LEARNED = tuple(sorted(CORPUS.glob("*.yaml")))
SEALED = tuple(sorted((CORPUS / "sealed").glob("*.yaml")))
# Written without sight of any grammar; the rules are mended for them, the older grammar is not.
FRESH = tuple(sorted((CORPUS / "fresh").glob("*.yaml")))
# A third of the learned files, at random, each by its own name so that a further file moves none: scored, and read by nobody.
# One of them was read by mistake, and is one of the others since.
_READ = frozenset({"allotment"})
UNREAD = tuple(path for path in LEARNED if path.stem not in _READ and random.Random(f"40 {path.stem}").random() < 1 / 3)
PARAMETERS: dict[str, tuple[str, ...]] = {
    "pick": ("object",),
    "place_on": ("target",),
    "place_in": ("container",),
    "place_beside": ("target", "side"),
    "place_at": ("x", "y"),
    "stack": ("object", "target"),
    "push": ("object", "direction", "distance"),
    "pour": ("target",),
    "open_drawer": ("drawer",),
    "close_drawer": ("drawer",),
    "push_to": ("object", "x", "y"),
    "tap": ("object",),
    "home": (),
}
NUMBER_TOLERANCE = 0.011


# How people speak, by what the name of a section says; a section that says none of it is a kind of its own.
KINDS = {
    "hobbyist": r"hobby|newcomer|beginner|visitor|everyday",
    "terse": r"\bterse|engineer|technician|programs",
    "second language": r"second[ _]language|non_native|tongue|abroad|other_languages",
    "conditions and many steps": r"\b(?<!refuse_)condition|colour_condition|loop|\bcounts|^steps|(several|multi|two|three)_?steps?$|when_and_what|^long|sequence",
    "chatty": r"chatty|^talk|spoken|beside_the_command|small_talk",
    "tricky": r"tricky|correct|must_not|near.miss|negat|except",
}


@dataclass(frozen=True)
class Prompt:
    """A sentence in a scene and what is acceptable for it.

    Attributes:
        category: The section that it stands in.
        sealed: It is scored and not shown, as one of a file of SEALED or UNREAD: nobody mends the grammar for it.
    """

    text: str
    category: str
    expected: str
    scene: ObservedScene
    sealed: bool = False

    @property
    def kind(self) -> str:
        """Return who speaks: one of KINDS, or the section's name."""
        return next((kind for kind, pattern in KINDS.items() if re.search(pattern, self.category)), self.category)


def observed(scene: Scene, held: str | None = None) -> ObservedScene:
    """Return the scene as ground-truth perception would see it."""
    places = {item.id: item.pose for item in scene.objects}
    for item in scene.objects:
        if item.inside is not None:
            x, y, z = places[item.inside].xyz
            places[item.id] = Pose(xyz=(x, y, z + 0.01))
    return ObservedScene(
        time=0.0,
        table_height=scene.table_height,
        base_xy=(-0.3, 0.0),
        hands={"hand": held},
        objects=tuple(
            DetectedObject(
                id=item.id,
                kind=item.kind,
                size=item.size,
                colour=colour_name(item.rgba),
                rgba=item.rgba,
                pose=places[item.id],
                opening=item.open if item.shape.opens else None,
                tag=item.tag,
                grains=(places[item.id].xyz,) * item.count,
            )
            for item in scene.objects
        ),
    )


def _read(path: Path) -> dict[str, Any]:
    """Return what a YAML file holds; the corpus is 2.8 MB, so libyaml reads it where PyYAML has it."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    data: dict[str, Any] = yaml.load(path.read_text(encoding="utf-8"), Loader=loader)
    return data


def load_prompts(path: Path, scene: ObservedScene | None = None) -> list[Prompt]:
    """Return the prompts of a file, in its own scene or in the one given."""
    data = _read(path)
    seen = scene or load_scene(bundled_task(data["task"]) if "task" in data else path)
    return [
        Prompt(str(text), category, str(expected), seen, sealed=path in SEALED or path in UNREAD)
        for category, sentences in data["prompts"].items()
        for text, expected in sentences.items()
    ]


def load_scene(path: Path) -> ObservedScene:
    """Return the scene of a task or prompts file."""
    own = dict(_read(path)["scene"])
    own.pop("robot_urdf", None)
    own.pop("robot_config", None)
    return observed(Scene.model_validate({k: v for k, v in own.items() if k != "held"}), own.get("held"))


def accepts(expected: str, answer: Plan | Refusal) -> bool:
    """Say whether an answer is one of those expected."""
    for alternative in re.split(r"\s*\|\s*", expected):
        if alternative.startswith("!"):
            # A question that is answered moves nothing either.
            said = (
                (answer.code,)
                if isinstance(answer, Refusal)
                else ("unsupported", "impossible")
                if answer.answer
                else ()
            )
            if said and alternative in ("!*", *(f"!{code}" for code in said)):
                return True
        elif isinstance(answer, Plan):
            calls = [part for step in answer.steps for part in _unstacked(step)]
            for steps in _orders(re.sub(r"stack\(([\w/]+|\*), ([\w/]+|\*)\)", r"pick(\1); place_on(\2)", alternative)):
                if _same(steps, calls):
                    return True
    return False


def _unstacked(call: SkillCall) -> list[SkillCall]:
    """Return the two calls that `stack` is: the same motion however it is planned."""
    if call.skill != "stack":
        return [call]
    return [
        SkillCall(skill="pick", arguments={"object": call.arguments["object"]}),
        SkillCall(skill="place_on", arguments={"target": call.arguments["target"]}),
    ]


def _orders(expected: str) -> Iterator[list[str]]:
    if expected.startswith("any order"):
        groups = [[step.strip() for step in group.split(";")] for group in re.findall(r"\[([^\]]*)\]", expected)]
        tail = [step.strip() for step in expected.rpartition("]")[2].split(";") if step.strip()]
        for order in itertools.permutations(groups):
            yield [step for group in order for step in group] + tail
    else:
        yield [step.strip() for step in expected.split(";") if step.strip()]


def _same(expected: Sequence[str], steps: Sequence[SkillCall]) -> bool:
    return len(expected) == len(steps) and all(_fits(e, s) for e, s in zip(expected, steps, strict=True))


def _fits(expected: str, call: SkillCall) -> bool:
    match = re.fullmatch(r"(\w+)\((.*)\)", expected)
    if match is None or match[1] != call.skill:
        return False
    wanted = [value.strip() for value in match[2].split(",")] if match[2] else []
    names = PARAMETERS.get(call.skill, tuple(call.arguments))
    return len(wanted) == len(names) and all(
        _value_fits(w, call.arguments.get(name)) for w, name in zip(wanted, names, strict=True)
    )


def _value_fits(wanted: str, value: Any) -> bool:
    if wanted == "*":
        return True
    if isinstance(value, (int, float)):
        low, dots, high = wanted.partition("..")
        if dots:
            return float(low) - 1e-6 <= value <= float(high) + 1e-6
        return abs(float(wanted) - value) <= NUMBER_TOLERANCE
    return str(value) in wanted.split("/")
