"""`run` and `plan`: a prompt in an embedded world; `agent`: in a sim process."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from robosandbox.commands.connecting import Connect, RobotId, ZenohConfig
from robosandbox.commands.console import EXIT_DONE, EXIT_FAILED, EXIT_UNAVAILABLE, print_json, read_prompt
from robosandbox.errors import InputError

if TYPE_CHECKING:
    from robosandbox.agent.episode import Episode
    from robosandbox.tasks.session import Session
    from robosandbox.tasks.workcell import Workcell
    from robosandbox.types import Plan, Refusal

Prompt = Annotated[str | None, typer.Argument(help="What to do; '-' reads it from stdin; the task's own if left out.")]
TaskName = Annotated[str | None, typer.Option("--task", help="A bundled task or a YAML file; three cubes if left out.")]
RobotName = Annotated[str | None, typer.Option("--robot", help="A URDF or MJCF file or a bundled robot.")]
PlannerName = Annotated[str, typer.Option("--planner", help="What turns the prompt into a plan.")]
BaseUrl = Annotated[str | None, typer.Option("--base-url", help="Where the model is served, up to /v1.")]
Model = Annotated[str | None, typer.Option("--model", help="The model's name there.")]
Cassette = Annotated[
    Path | None, typer.Option("--cassette", help="Record what is said with the model; replay it if the file exists.")
]
Camera = Annotated[str | None, typer.Option("--camera", help="Send this camera's picture to a model that sees.")]
PerceptionName = Annotated[str, typer.Option("--perception", help="What sees the objects.")]
SensorName = Annotated[str, typer.Option("--sensor", help="What its cameras are like: ideal, realsense or rough.")]
Seed = Annotated[int, typer.Option("--seed", help="The layout; 0 is the task as written.")]
MaxReplans = Annotated[int, typer.Option("--max-replans", help="New plans after failures.")]
WhatIf = Annotated[bool, typer.Option("--what-if/--no-what-if", help="Try repairs on copies of the world.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]


Confirm = Annotated[bool, typer.Option("--confirm", help="Show each plan and what it would do, and ask first.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show the plan and what it would do; nothing moves.")]


def run(
    prompt: Prompt = None,
    task: TaskName = None,
    robot: RobotName = None,
    planner: PlannerName = "stub",
    base_url: BaseUrl = None,
    model: Model = None,
    cassette: Cassette = None,
    camera: Camera = None,
    perception: PerceptionName = "ground_truth",
    sensor: SensorName = "ideal",
    seed: Seed = 0,
    max_replans: MaxReplans = 3,
    what_if: WhatIf = True,
    confirm: Confirm = False,
    dry_run: DryRun = False,
    json: Json = False,
) -> int:
    """Carry out a prompt and check what came of it."""
    options = {"base_url": base_url, "model": model, "cassette": cassette}
    with _open(
        prompt, task, robot, planner, options, camera, perception, sensor, seed, max_replans, what_if
    ) as session:
        from robosandbox.commands import trying

        if confirm:
            trying.ask_before(session, prompt)
        said = session.task.prompt if prompt is None else read_prompt(prompt)
        if dry_run:
            return trying.dry_run(session, said, json)
        return _carry_out(session, said, json)


def agent(
    prompt: Prompt = None,
    connect: Connect = None,
    robot_id: RobotId = None,
    zenoh_config: ZenohConfig = None,
    planner: PlannerName = "stub",
    base_url: BaseUrl = None,
    model: Model = None,
    cassette: Cassette = None,
    camera: Camera = None,
    max_replans: MaxReplans = 3,
    json: Json = False,
) -> int:
    """Carry out a prompt in a sim process."""
    from robosandbox.commands.connecting import remote_session

    if prompt is not None:
        prompt = read_prompt(prompt)
    if max_replans < 0:
        raise InputError(f"--max-replans: {max_replans} is negative; give 0 or more")
    options = {"base_url": base_url, "model": model, "cassette": cassette}
    with remote_session(
        connect or [],
        robot_id,
        zenoh_config,
        planner=planner,
        planner_options=options,
        camera=camera,
        max_replans=max_replans,
    ) as session:
        return _carry_out(session, session.task.prompt if prompt is None else prompt, json)


def plan(
    prompt: Prompt = None,
    task: TaskName = None,
    robot: RobotName = None,
    planner: PlannerName = "stub",
    base_url: BaseUrl = None,
    model: Model = None,
    cassette: Cassette = None,
    camera: Camera = None,
    perception: PerceptionName = "ground_truth",
    sensor: SensorName = "ideal",
    seed: Seed = 0,
    json: Json = False,
) -> int:
    """Print the plan for a prompt; nothing moves."""
    from robosandbox.types import Refusal

    options = {"base_url": base_url, "model": model, "cassette": cassette}
    with _open(prompt, task, robot, planner, options, camera, perception, sensor, seed, 0, False) as session:
        said = session.task.prompt if prompt is None else read_prompt(prompt)
        answer = session.agent.plan(said)
    refused = isinstance(answer, Refusal)
    if json:
        dump = answer.model_dump(mode="json")
        print_json({"plan": None if refused else dump["steps"], "refusal": dump if refused else None})
    else:
        print(planned(answer))
    return EXIT_FAILED if refused else EXIT_DONE


def planned(answer: Plan | Refusal) -> str:
    """Return a planner's answer for reading: a line per step, or the refusal."""
    from robosandbox.types import Refusal

    if isinstance(answer, Refusal):
        return f"refused ({answer.code}): {answer.message}"
    return "\n".join(f"{number}. {call}" for number, call in enumerate(answer.steps, start=1)) or "nothing to do"


def _open(
    prompt: str | None,
    task: str | None,
    robot: str | None,
    planner: str,
    options: dict[str, Any],
    camera: str | None,
    perception: str,
    sensor: str,
    seed: int,
    max_replans: int,
    what_if: bool,
) -> Session:
    from robosandbox.tasks.session import open_session

    if prompt is None and task is None:
        raise InputError('prompt: is missing; say what to do, as in "pick up the red cube", or give --task')
    if prompt is not None and prompt != "-":
        read_prompt(prompt)
    if seed < 0:
        raise InputError(f"--seed: {seed} is negative; give 0 or more")
    if max_replans < 0:
        raise InputError(f"--max-replans: {max_replans} is negative; give 0 or more")
    return open_session(
        task,
        robot=robot,
        planner=planner,
        planner_options=options,
        camera=camera,
        perception=perception,
        sensor=sensor,
        seed=seed,
        max_replans=max_replans,
        what_if=what_if,
    )


def _carry_out(session: Workcell, prompt: str, json: bool) -> int:
    from robosandbox.commands.live import LiveView, cancel_on_interrupt

    session.agent.listeners.append(LiveView())
    with cancel_on_interrupt(session.ctx):
        episode = session.run(prompt)
    document = _document(session, episode)
    judged = document["judged"]
    if json:
        print_json(document)
    else:
        print(sentence(episode, judged))
    if episode.final_reason == "planner_unavailable":
        return EXIT_UNAVAILABLE
    return EXIT_DONE if episode.success and (judged is None or judged["success"]) else EXIT_FAILED


def _document(session: Workcell, episode: Episode) -> dict[str, Any]:
    """Return the episode as JSON data; judged against the task only if its own prompt was given."""
    from robosandbox.tasks.bench import versions

    sim_secs, physics_steps = session.elapsed()
    document = {
        **episode.record(),
        "task": session.task.name,
        "seed": session.seed,
        "robot": session.robot_name,
        "sim_secs": round(sim_secs, 6),
        "physics_steps": physics_steps,
        "versions": versions(),
        "judged": None,
    }
    if episode.prompt == session.task.prompt:
        verdict = session.judge()
        document["judged"] = {"success": verdict.success, "detail": verdict.detail} if verdict else None
    return document


def sentence(episode: Episode, judged: dict[str, Any] | None = None) -> str:
    """Return what was done, or why not, in a line."""
    if not episode.success:
        return f"{episode.final_reason}: {episode.final_detail}"
    if judged is None:
        return f"done: {episode.final_detail}"
    numbers = ", ".join(f"{key}={value:.3f}" for key, value in judged["detail"].items())
    return f"{'done' if judged['success'] else 'not done'}: {episode.final_detail} ({numbers})"
