# /// script
# requires-python = ">=3.10,<3.14"
# dependencies = ["metaworld==3.1.1", "mujoco==3.3.0", "packaging"]
# ///
"""MetaWorld's environment in a process of its own: actions as lines of JSON on stdin, states as such lines on stdout.

    uv run --script metaworld_process.py drawer-open-v3

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


def begin(env: Any, start: Any) -> None:
    """Put an environment at a start."""
    env.set_task(start)
    env.reset()
    # Its limit of 500 steps is counted by who drives it.
    env.max_path_length = sys.maxsize


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
    """Answer lines on stdin until it ends: the number of a start, an action, or null for the start once more."""
    answers, sys.stdout = sys.stdout, sys.stderr
    suite = metaworld.MT1(sys.argv[1], seed=_SEED)
    env = suite.train_classes[sys.argv[1]]()
    for line in sys.stdin:
        asked, success, about = json.loads(line), 0.0, {}
        if isinstance(asked, int):
            # Each start has an environment of its own: a reset leaves some of what was before.
            env = suite.train_classes[sys.argv[1]]()
            begin(env, suite.train_tasks[asked])
            about = described(env)
        elif asked is None:
            env.reset()
        else:
            success = float(env.step(np.array(asked, dtype=np.float64))[4]["success"])
        answers.write(json.dumps(about | told(env, success)) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
