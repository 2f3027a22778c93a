"""How well sentences are understood: right, rightly refused, wrongly refused, wrong motion; by who speaks, with timing.

    uv run benchmarks/language.py [--learned] [--unread] [--sealed] [--fresh] [--prompts FILE ...] [--scene FILE] [--paraphrase N] [--json]
                                  [--refusals N] [--planner NAME --base-url URL --model NAME --cassette FILE]

Without a choice the learned sentences are scored: those of tests/prompts that the grammar may be mended for. The sealed ones
of tests/prompts/sealed, and a third of the learned files that nobody reads, are figures only: what fails there is counted and
not shown. `sentences.py` tells the format of a file.
With --refusals some that were refused are printed for a person to read: is each true, and of help?
Intervals are Wilson's, of 95 %. In JSON `missed` are the wrongly refused.
"""

from __future__ import annotations

import argparse
import inspect
import json
import random
import re
import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sentences import FRESH, KINDS, LEARNED, PARAMETERS, SEALED, UNREAD, Prompt, accepts, load_prompts, load_scene

from robosandbox.agent.planners import make_planner
from robosandbox.agent.protocols import Planner
from robosandbox.apps.bench.interval import wilson_interval
from robosandbox.errors import InputError, PlannerError, UnsupportedError
from robosandbox.skills.base import Skill as BaseSkill
from robosandbox.skills.catalogue import load_skills
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Plan, Refusal, SkillResult
from robosandbox.world.operators import Operator

VERDICTS = ("right", "refused_right", "wrong_motion", "missed")
# Sections of fewer sentences than this that name no kind of speaker are summed up in the table; JSON has them all.
FEWEST_SHOWN = 100


@dataclass(frozen=True)
class Outcome:
    """What came of a prompt: right, refused_right, wrong_motion or missed."""

    prompt: Prompt
    verdict: str
    answer: Plan | Refusal
    seconds: float
    cpu_seconds: float


def catalogue() -> list[Operator]:
    """Return the installed skills, and for verbs that have none yet a stand-in that plans can name."""
    # The sets are older than `turn`, and expect it to be refused.
    installed = {skill.name: skill for skill in load_skills() if skill.name != "turn"}
    return [*installed.values(), *(_stand_in(name) for name in PARAMETERS if name not in installed)]


def _stand_in(name: str) -> BaseSkill:
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
        outcomes.append(Outcome(prompt, verdict(prompt.expected, answer), answer, seconds, cpu_seconds))
    return outcomes


def verdict(expected: str, answer: Plan | Refusal) -> str:
    """Judge an answer; one that moves nothing, as to a question, is no wrong motion."""
    moves = isinstance(answer, Plan) and bool(answer.steps)
    if accepts(expected, answer):
        return "right" if moves else "refused_right"
    return "wrong_motion" if moves else "missed"


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
        made.append(replace(source, text=text, category="paraphrase"))
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
    return {
        **_figures(outcomes),
        "by_kind": _grouped(outcomes, lambda outcome: outcome.prompt.kind),
        "by_category": _grouped(outcomes, lambda outcome: outcome.prompt.category),
        "milliseconds": quantiles([1e3 * outcome.seconds for outcome in outcomes]),
        "cpu_milliseconds": quantiles([1e3 * outcome.cpu_seconds for outcome in outcomes]),
    }


def _grouped(outcomes: Sequence[Outcome], group: Callable[[Outcome], str]) -> dict[str, Any]:
    groups: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        groups.setdefault(group(outcome), []).append(outcome)
    return {name: _figures(members) for name, members in sorted(groups.items())}


def _figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return counts, shares and their intervals."""
    count, total = Counter(outcome.verdict for outcome in outcomes), len(outcomes)
    good = count["right"] + count["refused_right"]
    return {
        "sentences": total,
        **{name: count[name] for name in VERDICTS},
        "share_right": good / max(total, 1),
        "share_right_95": wilson_interval(good, total) if total else (0.0, 1.0),
        "share_wrong_motion_95": wilson_interval(count["wrong_motion"], total) if total else (0.0, 1.0),
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


def table(report: dict[str, Any]) -> list[str]:
    """Return the figures by kind of speaker as lines of text."""
    width = max(len(kind) for kind in (*KINDS, "other sections"))
    lines = [
        f"{'':{width}}  sentences   right  rightly refused  wrongly refused  wrong motion   right or rightly refused"
    ]
    kinds = report["by_kind"]
    shown = [kind for kind in KINDS if kind in kinds]
    shown += [kind for kind in kinds if kind not in KINDS and kinds[kind]["sentences"] >= FEWEST_SHOWN]
    rest = Counter[str]()
    for kind in kinds.keys() - shown:
        rest.update({name: kinds[kind][name] for name in ("sentences", *VERDICTS)})
    rows = [(kind, kinds[kind]) for kind in shown]
    rows += [("other sections", rest)] if rest["sentences"] else []
    for name, row in [*rows, ("all", report)]:
        low, high = wilson_interval(row["right"] + row["refused_right"], row["sentences"])
        lines.append(
            f"{name:{width}.{width}} {row['sentences']:10} {row['right']:7} {row['refused_right']:16} {row['missed']:16} {row['wrong_motion']:13}"
            f"   {100 * (row['right'] + row['refused_right']) / row['sentences']:5.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
        )
    return lines


def refusals(outcomes: Sequence[Outcome], count: int, seed: int) -> list[str]:
    """Return refusals to read, seeded, each with its sentence and what was seen; none of the sealed part."""
    refused = [outcome for outcome in outcomes if isinstance(outcome.answer, Refusal) and not outcome.prompt.sealed]
    return [
        f"{outcome.prompt.text!r}\n    {answer_text(outcome.answer)}\n    seen: {', '.join(item.id for item in outcome.prompt.scene.objects)}"
        for outcome in random.Random(seed).sample(refused, min(count, len(refused)))
    ]


def _chosen(options: argparse.Namespace) -> list[Prompt]:
    scene = load_scene(options.scene) if options.scene else None
    paths = list(options.prompts or ())
    paths += SEALED if options.sealed else ()
    paths += UNREAD if options.unread else ()
    paths += FRESH if options.fresh else ()
    paths += [path for path in LEARNED if path not in UNREAD] if options.read else ()
    paths += LEARNED if options.learned or not paths else ()
    prompts = [prompt for path in paths for prompt in load_prompts(path, scene)]
    return prompts + paraphrases(prompts, options.paraphrase, options.seed)


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--learned", action="store_true", help="the sentences that the grammar may be mended for")
    parser.add_argument("--read", action="store_true", help="those of them that are read")
    parser.add_argument("--unread", action="store_true", help="those of them that nobody reads")
    parser.add_argument("--fresh", action="store_true", help="those that were written without sight of any grammar")
    parser.add_argument("--sealed", action="store_true", help="those that it may not")
    parser.add_argument("--prompts", type=Path, nargs="*", help="prompt files")
    parser.add_argument("--scene", type=Path, help="use this file's scene instead of each file's own")
    parser.add_argument("--paraphrase", type=int, default=0, metavar="N", help="add N seeded rewordings")
    parser.add_argument("--refusals", type=int, metavar="N", help="print N seeded refusals to read, and no figures")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--planner", default="stub", help="name of an installed planner")
    parser.add_argument("--base-url", help="where its model is served")
    parser.add_argument("--model", help="the model's name there")
    parser.add_argument("--cassette", type=Path, help="record what is said with the model, or replay it")
    parser.add_argument("--json", action="store_true")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    parser = _arguments()
    options = parser.parse_args(argv)
    chosen = {"base_url": options.base_url, "model": options.model, "cassette": options.cassette}
    try:
        planner = make_planner(options.planner, catalogue(), chosen)
        outcomes = run(_chosen(options), planner)
    except (InputError, PlannerError, OSError) as error:
        parser.error(str(error))
    if options.refusals:
        print("\n".join(refusals(outcomes, options.refusals, options.seed)))
        return 0
    report = summary(outcomes)
    report["failures"] = [
        {
            "prompt": o.prompt.text,
            "verdict": o.verdict,
            "expected": o.prompt.expected,
            "answer": answer_text(o.answer),
        }
        for o in outcomes
        if o.verdict in ("wrong_motion", "missed") and not o.prompt.sealed
    ]
    if options.json:
        json.dump(report, sys.stdout, indent=2)
        print()
        return 0
    for failure in report["failures"]:
        print(
            f"{failure['verdict']}: {failure['prompt']!r}\n    want {failure['expected']}\n    got  {failure['answer']}"
        )
    print("\n".join(table(report)))
    cpu, (_, most) = report["cpu_milliseconds"], report["share_wrong_motion_95"]
    print(
        f"\nwrong motions: {report['wrong_motion']}, at most {100 * most:.2f} % of such sentences; "
        f"CPU a sentence: median {cpu['median']:.2f} ms, p99 {cpu['p99']:.2f} ms, max {cpu['max']:.2f} ms"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
