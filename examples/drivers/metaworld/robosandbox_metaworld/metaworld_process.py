# /// script
# requires-python = ">=3.10,<3.14"
# dependencies = ["metaworld==3.1.1", "mujoco==3.3.0", "packaging"]
# ///
"""MetaWorld's environment in a process of its own: actions as lines of JSON on stdin, states as such lines on stdout.

    uv run --script metaworld_process.py drawer-open-v3 0

It knows nothing of RoboSandbox: MetaWorld's versions of MuJoCo and others clash with those there.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

# Nothing is drawn.
os.environ.setdefault("MUJOCO_GL", "disable")

import metaworld
import mujoco
import numpy as np

# Draws of starts and goals: MetaWorld makes 50 of this seed for each of its tasks.
_SEED = 0


def opened(task: str, number: int) -> Any:
    """Return MetaWorld's environment of a task at one of its starts, reset."""
    suite = metaworld.MT1(task, seed=_SEED)
    env = suite.train_classes[task]()
    env.set_task(suite.train_tasks[number])
    env.reset()
    # Its limit of 500 steps is counted by who drives it.
    env.max_path_length = sys.maxsize
    return env


def described(env: Any) -> dict[str, object]:
    """Return the world as MJCF with whole paths, as it stands, and what the interface allows."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.xml"
        # As loaded, with the numbers that the reset has put into the model.
        mujoco.mj_saveLastXML(str(path), env.model)
        tree = ElementTree.parse(path)
    compiler = tree.find("compiler")
    assert compiler is not None
    start = ElementTree.SubElement(ElementTree.SubElement(tree.getroot(), "keyframe"), "key", name="start")
    start.set("qpos", " ".join(map(repr, env.data.qpos.tolist())))
    assets = str(Path(env.model_name).resolve().parent)
    compiler.attrib.update(meshdir=assets, texturedir=assets)
    return {
        "mjcf": ElementTree.tostring(tree.getroot(), encoding="unicode"),
        "low": env.mocap_low.tolist(),
        "high": env.mocap_high.tolist(),
        "scale": float(env.action_scale),
        "timestep": float(env.model.opt.timestep * env.frame_skip),
        "limit": 500,
        "goal": np.asarray(env._target_pos).tolist(),
        "hand_start": np.asarray(env.hand_init_pos).tolist(),
    }


def pressed(model: Any, data: Any) -> list[tuple[int, int, list[float]]]:
    """Return the force of each pair of geoms that touch, on the second, N in the world."""
    sums: dict[tuple[int, int], Any] = {}
    local = np.zeros(6)
    for index, contact in enumerate(data.contact):
        if contact.efc_address < 0:
            continue
        mujoco.mj_contactForce(model, data, index, local)
        pair = int(contact.geom[0]), int(contact.geom[1])
        sums[pair] = sums.get(pair, 0.0) + contact.frame.reshape(3, 3).T @ local[:3]
    return [(first, second, force.tolist()) for (first, second), force in sums.items()]


def told(env: Any, success: float) -> dict[str, object]:
    """Return the state and the verdict."""
    data = env.data
    return {
        "qpos": data.qpos.tolist(),
        "qvel": data.qvel.tolist(),
        "forces": pressed(env.model, data),
        "mocap_pos": data.mocap_pos[0].tolist(),
        "hand": data.body("hand").xpos.tolist(),
        "link_pos": data.body("right_l6").xpos.tolist(),
        "link_quat": data.body("right_l6").xquat.tolist(),
        "success": success > 0.5,
    }


def main() -> None:
    """Answer lines on stdin, an action or null for the start, until it ends."""
    answers, sys.stdout = sys.stdout, sys.stderr
    env = opened(sys.argv[1], int(sys.argv[2]))

    def say(value: dict[str, object]) -> None:
        answers.write(json.dumps(value) + "\n")
        answers.flush()

    say(described(env) | told(env, 0.0))
    for line in sys.stdin:
        action = json.loads(line)
        if action is None:
            env.reset()
            say(told(env, 0.0))
        else:
            info = env.step(np.array(action, dtype=np.float64))[4]
            say(told(env, float(info["success"])))


if __name__ == "__main__":
    main()
