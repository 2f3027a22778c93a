"""How well sentences are understood: right, rightly refused, wrong motion, missed; by category, with timing.

    uv run benchmarks/language.py [--planner NAME --base-url URL --model NAME --cassette FILE]
                                  [--prompts FILE ...] [--scene FILE] [--paraphrase N] [--json]

A prompts file holds a scene and sentences by category, each with every acceptable plan: `pick(can); place_in(bin_a)`, with `|`
between alternatives, `*` for anything, `low..high` for a range, `any order [...] [...]`, and `!ambiguous` for a refusal
(`!*` for one of any code).
"""

from __future__ import annotations

import argparse
import inspect
import itertools
import json
import random
import re
import statistics
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from robosandbox.agent.planners import make_planner
from robosandbox.errors import InputError, PlannerError, UnsupportedError
from robosandbox.perception.colour import colour_name
from robosandbox.protocols import Planner, Skill, SkillContext
from robosandbox.skills.base import Skill as BaseSkill
from robosandbox.skills.catalogue import load_skills
from robosandbox.types import DetectedObject, ObservedScene, Plan, Pose, Refusal, Scene, SkillCall, SkillResult

CORPUS = Path(__file__).parent.parent / "tests" / "prompts"
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
    "tap": ("object",),
    "home": (),
}
NUMBER_TOLERANCE = 0.011


@dataclass(frozen=True)
class Prompt:
    """A sentence in a scene and what is acceptable for it."""

    text: str
    category: str
    expected: str
    scene: ObservedScene


@dataclass(frozen=True)
class Outcome:
    """What came of a prompt: right, refused_right, wrong_motion or missed."""

    prompt: Prompt
    verdict: str
    answer: Plan | Refusal
    seconds: float
    cpu_seconds: float


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
        held=held,
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
    own = dict(data["scene"])
    held = own.pop("held", None)
    seen = scene or observed(Scene.model_validate(own), held)
    return [
        Prompt(str(text), category, str(expected), seen)
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
            code = answer.code if isinstance(answer, Refusal) else "unsupported" if answer.answer else ""
            if code and alternative in ("!*", f"!{code}"):
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
    names = PARAMETERS[call.skill]
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


def catalogue() -> list[Skill]:
    """Return the installed skills, and for verbs that have none yet a stand-in that plans can name."""
    installed = {skill.name: skill for skill in load_skills()}
    return [installed.get(name) or _stand_in(name) for name in PARAMETERS]


def _stand_in(name: str) -> Skill:
    def run(self: BaseSkill, ctx: SkillContext, **arguments: Any) -> SkillResult:
        raise UnsupportedError(f"{name} is not installed")

    # A skill's schema comes from the signature of its run.
    parameters = [
        inspect.Parameter(argument, inspect.Parameter.KEYWORD_ONLY, annotation=str) for argument in PARAMETERS[name]
    ]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = dict.fromkeys(PARAMETERS[name], str)
    run.__doc__ = f"{name.replace('_', ' ').capitalize()}."
    return type(name, (BaseSkill,), {"name": name, "run": run})()


def run(prompts: Sequence[Prompt], planner: Planner) -> list[Outcome]:
    """Plan every prompt and judge the answers."""
    outcomes = []
    for prompt in prompts:
        start, cpu_start = time.perf_counter(), time.process_time()
        answer = planner.plan(prompt.text, prompt.scene)
        seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu_start
        if accepts(prompt.expected, answer):
            verdict = "right" if isinstance(answer, Plan) else "refused_right"
        else:
            verdict = "wrong_motion" if isinstance(answer, Plan) else "missed"
        outcomes.append(Outcome(prompt, verdict, answer, seconds, cpu_seconds))
    return outcomes


PREFIXES = (
    "please ",
    "could you ",
    "can you please ",
    "hey robot, ",
    "ok, ",
    "I'd like you to ",
    "um, ",
    "go ahead and ",
    "now ",
)
SUFFIXES = (" please", ", thanks", " for me", " now", "!", ".", " if you can")
SWAPS = (
    ("cube", "block"),
    ("pick up", "grab"),
    ("put", "place"),
    ("the can", "the tin"),
    ("push", "shove"),
    ("centimetres", "cm"),
    ("grey", "gray"),
)


def paraphrases(prompts: Sequence[Prompt], count: int, seed: int) -> list[Prompt]:
    """Return `count` rewordings of prompts that ask for a motion: politeness, synonyms and slips of the finger."""
    rng = random.Random(seed)
    sources = [p for p in prompts if not p.expected.startswith("!") and p.category not in ("dialogue",)]
    made = []
    while len(made) < count:
        source = rng.choice(sources)
        text = source.text
        for old, new in SWAPS:
            named = any(new in item.id.split("_") for item in source.scene.objects)
            if rng.random() < 0.3 and not named and re.search(rf"\b{old}\b", text) and f"_{old}" not in text:
                text = re.sub(rf"\b{old}\b", new, text)
        if rng.random() < 0.5 and text.split()[0] in ("pick", "put", "place", "push", "stack", "tap", "move", "grab"):
            text = rng.choice(PREFIXES) + text
        if rng.random() < 0.4 and text[-1].isalnum():
            text += rng.choice(SUFFIXES)
        if rng.random() < 0.3:
            text = _slip(text, rng)
        made.append(Prompt(text, "paraphrase", source.expected, source.scene))
    return made


def _slip(text: str, rng: random.Random) -> str:
    """Swap two letters inside one long word."""
    long = [m for m in re.finditer(r"(?<![\w.])[a-z]{5,}(?![\w.])", text)]
    if not long:
        return text
    match = rng.choice(long)
    k = match.start() + rng.randrange(1, len(match[0]) - 2)
    return text[:k] + text[k + 1] + text[k] + text[k + 2 :]


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return the figures of a run."""
    count = Counter(outcome.verdict for outcome in outcomes)
    by_category: dict[str, Counter[str]] = {}
    for outcome in outcomes:
        by_category.setdefault(outcome.prompt.category, Counter())[outcome.verdict] += 1
    verdicts = ("right", "refused_right", "wrong_motion", "missed")
    return {
        "sentences": len(outcomes),
        **{verdict: count[verdict] for verdict in verdicts},
        "share_right": (count["right"] + count["refused_right"]) / max(len(outcomes), 1),
        "by_category": {name: {v: c[v] for v in verdicts} for name, c in sorted(by_category.items())},
        "milliseconds": quantiles([1e3 * outcome.seconds for outcome in outcomes]),
        "cpu_milliseconds": quantiles([1e3 * outcome.cpu_seconds for outcome in outcomes]),
    }


def quantiles(values: Sequence[float]) -> dict[str, float]:
    """Return the median, the 99th percentile and the largest of some values."""
    ordered = sorted(values)
    return {
        "median": statistics.median(ordered),
        "p99": ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))],
        "max": ordered[-1],
    }


def answer_text(answer: Plan | Refusal) -> str:
    """Return an answer in one line."""
    return "; ".join(map(str, answer.steps)) if isinstance(answer, Plan) else f"<{answer.code}> {answer.message}"


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--prompts", type=Path, nargs="*", help="prompt files (default: tests/prompts/*.yaml)")
    parser.add_argument("--scene", type=Path, help="use this file's scene instead of each file's own")
    parser.add_argument("--paraphrase", type=int, default=0, metavar="N", help="add N seeded rewordings")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--planner", default="stub", help="name of an installed planner")
    parser.add_argument("--base-url", help="where its model is served")
    parser.add_argument("--model", help="the model's name there")
    parser.add_argument("--cassette", type=Path, help="record what is said with the model, or replay it")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(argv)
    scene = load_scene(options.scene) if options.scene else None
    prompts = [p for path in options.prompts or sorted(CORPUS.glob("*.yaml")) for p in load_prompts(path, scene)]
    prompts += paraphrases(prompts, options.paraphrase, options.seed)
    chosen = {"base_url": options.base_url, "model": options.model, "cassette": options.cassette}
    try:
        outcomes = run(prompts, make_planner(options.planner, catalogue(), chosen))
    except (InputError, PlannerError) as error:
        parser.error(str(error))
    report = summary(outcomes)
    bad = [outcome for outcome in outcomes if outcome.verdict in ("wrong_motion", "missed")]
    if options.json:
        report["failures"] = [
            {
                "prompt": o.prompt.text,
                "verdict": o.verdict,
                "expected": o.prompt.expected,
                "answer": answer_text(o.answer),
            }
            for o in bad
        ]
        json.dump(report, sys.stdout, indent=2)
        print()
        return 0
    for outcome in bad:
        print(
            f"{outcome.verdict}: {outcome.prompt.text!r}\n    want {outcome.prompt.expected}\n    got  {answer_text(outcome.answer)}"
        )
    for name, figures in report["by_category"].items():
        print(f"{name:22} " + "  ".join(f"{verdict} {n}" for verdict, n in figures.items()))
    wall, cpu = report["milliseconds"], report["cpu_milliseconds"]
    print(
        f"\n{report['sentences']} sentences: {report['right']} right, {report['refused_right']} rightly refused, "
        f"{report['wrong_motion']} wrong motion, {report['missed']} missed ({100 * report['share_right']:.1f}%); "
        f"median {wall['median']:.2f} ms, p99 {wall['p99']:.2f} ms, max {wall['max']:.2f} ms; of the CPU "
        f"median {cpu['median']:.2f} ms, p99 {cpu['p99']:.2f} ms, max {cpu['max']:.2f} ms"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
