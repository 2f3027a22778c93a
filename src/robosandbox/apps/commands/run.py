"""`run` and `plan`: a prompt in an embedded world; `agent`: in a sim process."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, EXIT_UNAVAILABLE, print_json, read_prompt
from robosandbox.apps.commands.options import Json, Prompt
from robosandbox.apps.commands.recording import Record, Video, VideoFps, record_settings, recording, tell_recorded
from robosandbox.apps.commands.world import OF_THE_WORLD, Connection, open_here, takes_world
from robosandbox.errors import InputError
from robosandbox.printable import printable
from robosandbox.workcell.options import WorkcellOptions

if TYPE_CHECKING:
    from robosandbox.agent.agent import Agent
    from robosandbox.agent.episode import Episode
    from robosandbox.types import Plan, Refusal, Verdict
    from robosandbox.workcell.recording.recorder import Recorder
    from robosandbox.workcell.workcell import Workcell

DryRun = Annotated[bool, typer.Option("--dry-run", help="Show the plan and what it would do; nothing moves.")]

Steps = Annotated[
    str | None,
    typer.Option("--steps", help="Check the plan in this file, as --json prints one; '-' reads it from stdin."),
]
Goal = Annotated[
    str | None,
    typer.Option("--goal", help='Relations to bring about, as "on(red_cube, blue_block), closed(drawer)".'),
]
Policy = Annotated[
    str | None, typer.Option("--policy", help="Run this policy, MODULE:FACTORY, on the task in place of a planner.")
]


@takes_world()
def run(
    world: WorkcellOptions,
    prompt: Prompt = None,
    dry_run: DryRun = False,
    record: Record = None,
    video: Video = None,
    video_fps: VideoFps = 20.0,
    policy: Policy = None,
    goal: Goal = None,
    observation: Annotated[str, typer.Option("--observation", help="What a policy sees: state, pixels.")] = "state",
    action: Annotated[str, typer.Option("--action", help="What a policy commands: ee, joint.")] = "ee",
    max_steps: Annotated[int, typer.Option("--max-steps", help="Actions that a policy may take.")] = 400,
    json: Json = False,
) -> int:
    """Carry out a prompt and check what came of it."""
    if goal is not None:
        prompt = _goal(goal, prompt)
    _check_said(prompt, world.task)
    if policy is not None and prompt is not None:
        raise InputError("--policy: a policy works on the task and is told nothing; leave the prompt out")
    settings = record_settings(record, video, video_fps)
    with open_here(world) as session:
        if policy is not None:
            from robosandbox.apps.commands.policy import run_policy

            with recording(settings, session) as recorder:
                return run_policy(
                    session,
                    policy,
                    observation=observation,
                    action=action,
                    max_steps=max_steps,
                    recorder=recorder,
                    json=json,
                )
        from robosandbox.apps.commands.dry_run import ask_before, print_preview

        ask_before(session, prompt, always=world.confirm is True)
        said = session.task.prompt if prompt is None else read_prompt(prompt)
        if dry_run:
            return print_preview(session, said, json)
        with recording(settings, session) as recorder:
            return _carry_out(session, said, json, recorder)


@takes_world(without=(*OF_THE_WORLD, "package_path", "no_cache", "what_if"))
def agent(connection: Connection, world: WorkcellOptions, prompt: Prompt = None, json: Json = False) -> int:
    """Carry out a prompt in a sim process."""
    if prompt is not None:
        prompt = read_prompt(prompt)
    from robosandbox.apps.commands.dry_run import ask_before

    with connection.workcell(world) as session:
        ask_before(session, prompt)
        return _carry_out(session, session.task.prompt if prompt is None else prompt, json)


@takes_world(without=("calibration", "grasp", "motion", "max_replans", "what_if", "confirm", "stop_switch"))
def plan(world: WorkcellOptions, prompt: Prompt = None, steps: Steps = None, json: Json = False) -> int:
    """Print the plan for a prompt, or check somebody else's; nothing moves."""
    if steps is not None:
        return _verified(world, prompt, steps, json)
    _check_said(prompt, world.task)
    from robosandbox.agent.usage import metered
    from robosandbox.types import Refusal

    with open_here(world, what_if=False) as session:
        said = session.task.prompt if prompt is None else read_prompt(prompt)
        with metered() as usage, _shown_while_written(session.agent):
            answer = session.agent.plan(said)
    refused = isinstance(answer, Refusal)
    if json:
        dump = answer.model_dump(mode="json")
        print_json(
            {
                "plan": None if refused else dump["steps"],
                "answer": "" if refused else dump["answer"],
                "then": "" if refused else dump["then"],
                "note": "" if refused else dump["note"],
                "refusal": dump if refused else None,
                "model_usage": usage.record(),
            }
        )
    else:
        print(planned(answer))
    return EXIT_FAILED if refused else EXIT_DONE


@contextmanager
def _shown_while_written(agent: Agent[Any]) -> Iterator[None]:
    """Show on a terminal what a model writes; nothing is loaded for it elsewhere."""
    if not sys.stderr.isatty():
        yield
        return
    from robosandbox.apps.commands.live import LiveView

    live = LiveView()
    live.watch(agent)
    live.show("planning")
    try:
        yield
    finally:
        live.close()


def _verified(world: WorkcellOptions, prompt: str | None, steps: str, json: bool) -> int:
    """Check a given plan against the world; 0 where nothing stands against it."""
    from robosandbox.apps.commands.verifying import read_steps, verify_steps

    if prompt is not None:
        raise InputError("--steps: the plan is given; leave the prompt out")
    given = read_steps(steps)
    with open_here(world, what_if=False) as session:
        return verify_steps(session, given, json=json)


def _goal(goal: str, prompt: str | None) -> str:
    """Return a goal as the prompt of a planner for goals, checked before a world is built."""
    from robosandbox.agent.goal_planner import read_goals

    if prompt is not None:
        raise InputError("--goal: says what is to hold in the end; leave the prompt out")
    read_goals(goal)
    return goal


def planned(answer: Plan | Refusal) -> str:
    """Return a planner's answer for reading: a line per step, or the refusal."""
    from robosandbox.types import Refusal

    if isinstance(answer, Refusal):
        return f"refused ({answer.code}): {answer.message}"
    lines = [f"{number}. {call}" for number, call in enumerate(answer.steps, start=1)]
    lines += [f"then look: “{answer.then}”, and go on"] if answer.then else []
    lines += [f"note: {answer.note}"] if answer.note else []
    return "\n".join(lines) or str(answer)


def _check_said(prompt: str | None, task: object) -> None:
    """Refuse what cannot be carried out before a world is built."""
    if prompt is None and task is None:
        raise InputError('prompt: is missing; say what to do, as in "pick up the red cube", or give --task')
    if prompt is not None and prompt != "-":
        read_prompt(prompt)


def _carry_out(session: Workcell, prompt: str, json: bool, recorder: Recorder | None = None) -> int:
    from robosandbox.apps.commands.live import LiveView, ask_here, cancel_on_interrupt

    # What a model writes goes into a record as it comes.
    session.agent.streams = recorder is not None
    live = LiveView()
    live.watch(session.agent)
    ask_here(session.agent, live)
    with cancel_on_interrupt(session.ctx, session.agent):
        episode = session.run(prompt)
    # Before the verdict, for which time may have to pass.
    document = _document(session, episode)
    verdict = _verdict(session, episode)
    document["judged"] = asdict(verdict) if verdict else None
    whole = recorder is None or tell_recorded(recorder, recorder.finish(judged=verdict), document)
    if json:
        print_json(document)
    else:
        print(sentence(episode, document["judged"]))
    if episode.final_reason == "planner_unavailable":
        return EXIT_UNAVAILABLE
    return EXIT_DONE if whole and episode.success and (verdict is None or verdict.success) else EXIT_FAILED


def _verdict(session: Workcell, episode: Episode) -> Verdict | None:
    """Judge an episode whose prompt was the task's own; None for others, and where nobody can judge."""
    if episode.prompt != session.task.prompt:
        return None
    # What nobody tells of a real robot's table is not judged; the agent's own checks stand.
    return session.judge() if session.judgeable else None


def _document(session: Workcell, episode: Episode) -> dict[str, Any]:
    """Return the episode as JSON data."""
    from robosandbox.versions import versions

    sim_secs, physics_steps = session.elapsed()
    return {
        **episode.record(),
        "task": session.task.name,
        "seed": session.seed,
        "robot": session.robot_name,
        "sim_secs": round(sim_secs, 6),
        "physics_steps": physics_steps,
        "versions": versions(),
        "judged": None,
    }


def sentence(episode: Episode, judged: dict[str, Any] | None = None) -> str:
    """Return what was done, or why not, in a line."""
    if not episode.success:
        return f"{episode.final_reason}: {printable(episode.final_detail)}"
    if episode.answer:
        return episode.answer
    if judged is None:
        return f"done: {printable(episode.final_detail)}"
    numbers = ", ".join(f"{key}={value:.3f}" for key, value in judged["detail"].items())
    return f"{'done' if judged['success'] else 'not done'}: {printable(episode.final_detail)} ({numbers})"
