"""Policies of others, run on a task: `module:factory`, whose factory takes the environment."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from robosandbox.apps.envs.env import ManipulationEnv
from robosandbox.errors import InputError
from robosandbox.types import Array
from robosandbox.values import frozen

# From an observation to an action of the environment's spaces.
Policy = Callable[[dict[str, Any]], Array]


@frozen
class PolicyRun:
    """Result of an episode run by a policy.

    Attributes:
        success: What the simulated state says.
        steps: Actions taken.
        stopped: The limit that ended it; empty where none did.
    """

    success: bool
    steps: int
    stopped: str = ""


def load_policy(name: str, env: ManipulationEnv) -> Policy:
    """Return the policy that `module:factory` makes for an environment; the working directory's modules are found.

    Raises:
        InputError: There is no such module or factory, or it returns nothing that can be called.
    """
    module, _, factory = name.partition(":")
    if not module or not factory:
        raise InputError(f"--policy: {name!r} is not MODULE:FACTORY, such as my_policies:grasp")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        found = getattr(importlib.import_module(module), factory, None)
    except ModuleNotFoundError as error:
        raise InputError(
            f"--policy: {name!r}: there is no module {error.name!r}; run it from the folder it is in"
        ) from None
    if not callable(found):
        raise InputError(f"--policy: {name!r}: {module} has no factory {factory!r} that can be called")
    policy: Any = found(env)
    if not callable(policy):
        raise InputError(f"--policy: {name!r}: made a {type(policy).__name__}; it must map observations to actions")
    return cast(Policy, policy)


def run_policy(env: ManipulationEnv, policy: Policy, observation: dict[str, Any], max_steps: int) -> PolicyRun:
    """Run a policy from the observation that a reset gave until it succeeds, a limit stops it, or its steps are used up."""
    for step in range(1, max_steps + 1):
        observation, _, ended, _, info = env.step(policy(observation))
        if ended:
            return PolicyRun(bool(info["is_success"]), step, str(info.get("stopped", "")))
    return PolicyRun(False, max_steps)
