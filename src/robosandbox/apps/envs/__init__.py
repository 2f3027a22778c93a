"""Tasks as Gymnasium environments: importing this package registers `robosandbox/<Task>-v0` for each bundled one.

`gymnasium.make("robosandbox/PickCubeFranka-v0")` after `import robosandbox.apps.envs`; the task's own name,
`robosandbox/pick_cube_franka-v0`, is the same.
"""

from __future__ import annotations

import gymnasium

from robosandbox.apps.envs.env import ManipulationEnv
from robosandbox.tasks.loader import bundled_tasks

__all__ = ["ManipulationEnv", "env_id", "register_tasks"]
# Steps of an episode; chosen as 20 s at the usual 20 Hz: the skills' longest standard task takes 15 s (docs/bench.md).
MAX_EPISODE_STEPS = 400


def env_id(task: str) -> str:
    """Return the id of a bundled task's environment: `pick_cube_franka` is `robosandbox/PickCubeFranka-v0`."""
    return f"robosandbox/{''.join(part.capitalize() for part in task.split('_'))}-v0"


def register_tasks() -> None:
    """Register each bundled task under both names; once is enough."""
    for task in bundled_tasks():
        for name in (env_id(task), f"robosandbox/{task}-v0"):
            if name not in gymnasium.registry:
                gymnasium.register(
                    id=name,
                    entry_point="robosandbox.apps.envs.env:ManipulationEnv",
                    kwargs={"task": task},
                    max_episode_steps=MAX_EPISODE_STEPS,
                )


register_tasks()
