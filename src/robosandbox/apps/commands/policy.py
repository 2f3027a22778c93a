"""`run --policy`: somebody's own policy on a task, in place of a planner and skills."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED, print_json
from robosandbox.apps.commands.recording import tell_recorded
from robosandbox.errors import InputError
from robosandbox.extras import missing_extra
from robosandbox.progress import doing

if TYPE_CHECKING:
    from robosandbox.workcell.embedded import EmbeddedWorkcell
    from robosandbox.workcell.recording.recorder import Recorder


def run_policy(
    session: EmbeddedWorkcell,
    name: str,
    *,
    observation: str,
    action: str,
    max_steps: int,
    recorder: Recorder | None,
    json: bool,
) -> int:
    """Run a policy on the session's task, from the session's layout, and tell whether it succeeded."""
    try:
        from robosandbox.apps.envs import policy as policies
        from robosandbox.apps.envs.env import ManipulationEnv
    except ModuleNotFoundError as error:
        raise missing_extra(error, "--policy", "gym") from None
    if max_steps < 1:
        raise InputError(f"--max-steps: {max_steps}; give 1 or more")
    if observation not in ("state", "pixels") or action not in ("ee", "joint"):
        raise InputError("--observation is one of state, pixels; --action is one of ee, joint")
    kinds = {"observation": observation, "action": action}
    env = ManipulationEnv(session, **kinds)  # type: ignore[arg-type]
    policy = policies.load_policy(name, env)
    first = env.reset(options={"layout": session.seed})[0]
    if recorder is not None:
        # After the reset, which ends what is being recorded.
        recorder.begin(f"policy {name}: {session.task.prompt}")
    with doing(f"running {name}"):
        ran = policies.run_policy(env, policy, first, max_steps)
    verdict = session.judge()
    reason = "stopped" if ran.stopped else ("success" if ran.success else "steps_used_up")
    said = ran.stopped or f"{ran.steps} steps"
    document = {
        "task": session.task.name,
        "seed": session.seed,
        "policy": name,
        "success": verdict.success,
        "reason": reason,
        "steps": ran.steps,
        "stopped": ran.stopped,
        "judged": asdict(verdict),
    }
    outcome = (ran.success, reason, said)
    whole = recorder is None or tell_recorded(recorder, recorder.finish(judged=verdict, outcome=outcome), document)
    if json:
        print_json(document)
    else:
        numbers = ", ".join(f"{key}={value:.3f}" for key, value in verdict.detail.items())
        print(f"{'done' if verdict.success else 'not done'}: {name} after {said} ({numbers})")
    return EXIT_DONE if whole and verdict.success else EXIT_FAILED
