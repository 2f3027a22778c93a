"""A suction arm on boxes and cans: pick, place_on, place_in, stack, over seeds.

    python benchmarks/suction.py [--seeds 20] [--only NAME ...] [--json]

The arm is the bundled Panda with a cup of 30 mm (examples/08_suction.py), its sidecar inferred. What is to be held lies
within 5 cm of a point and is turned to any angle; success is judged on the simulated state. The last rows are what a cup cannot
hold: they count as done where the refusal speaks of the cup.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import logging
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from robosandbox.apps.bench.interval import beta_interval
from robosandbox.tasks.task import Task
from robosandbox.workcell.session import open_session

_EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "08_suction.py"
_TABLE = 0.04
THINGS: dict[str, dict[str, Any]] = {
    "cube": {"kind": "box", "size": [0.02, 0.02, 0.02], "mass": 0.06},
    "carton": {"kind": "box", "size": [0.045, 0.03, 0.06], "mass": 0.3},
    "board": {"kind": "box", "size": [0.08, 0.05, 0.005], "mass": 0.1},
    "can": {"kind": "cylinder", "size": [0.033, 0.06], "mass": 0.35},
    "tin": {"kind": "cylinder", "size": [0.04, 0.02], "mass": 0.15},
}
REFUSED: dict[str, dict[str, Any]] = {
    "ball": {"kind": "sphere", "size": [0.03], "mass": 0.06},
    "small cube": {"kind": "box", "size": [0.012, 0.012, 0.012], "mass": 0.03},
}
_REFUSAL = "this cup holds flat faces"


def arm(folder: Path) -> Path:
    """Write the suction arm and its inferred sidecar; return the model."""
    spec = importlib.util.spec_from_file_location("suction_example", _EXAMPLE)
    assert spec is not None and spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    model: Path = example.write_arm(folder)
    return model


def _object(name: str, thing: dict[str, Any], at: tuple[float, float], on: float = _TABLE) -> dict[str, Any]:
    half = thing["size"][{"box": 2, "cylinder": 1, "sphere": 0, "bin": 2}[thing["kind"]]]
    half = 0.002 if thing["kind"] == "bin" else half + 0.001
    colour = {"red": [0.85, 0.2, 0.2, 1.0], "blue": [0.2, 0.35, 0.85, 1.0]}.get(
        name.split("_")[0], [0.5, 0.5, 0.5, 1.0]
    )
    return {**thing, "id": name, "rgba": colour, "pose": {"xyz": [*at, on + half]}}


def tasks(model: Path) -> dict[str, Task]:
    """Return each task by name."""
    found = {}
    for name, thing in {**THINGS, **REFUSED}.items():
        found[f"pick, {name}"] = _task(
            model,
            "pick up the red object",
            [_object("red_thing", thing, (0.1, 0.0))],
            {"kind": "lifted", "object": "red_thing", "min_mm": 50.0},
            0.05,
        )
    plinth = {"kind": "box", "size": [0.06, 0.06, 0.02], "mass": 0.5}
    bin_ = {"kind": "bin", "size": [0.08, 0.08, 0.04], "mass": 0.4}
    for name in ("cube", "can"):
        thing = _object("red_thing", THINGS[name], (0.1, -0.12))
        on = {"kind": "on", "object": "red_thing", "target": "blue_block", "hold_s": 0.5}
        inside = {"kind": "inside", "object": "red_thing", "target": "grey_bin"}
        found[f"place_on, {name}"] = _task(
            model, "put the red object on the blue block", [thing, _object("blue_block", plinth, (0.1, 0.14))], on, 0.02
        )
        found[f"place_in, {name}"] = _task(
            model, "put the red object in the bin", [thing, _object("grey_bin", bin_, (0.1, 0.16))], inside, 0.02
        )
    cubes = [_object("red_cube", THINGS["cube"], (0.1, -0.1)), _object("blue_cube", THINGS["cube"], (0.12, 0.1))]
    stacked = {"kind": "on", "object": "red_cube", "target": "blue_cube", "hold_s": 0.5}
    found["stack, cube"] = _task(model, "stack the red cube on the blue cube", cubes, stacked, 0.02)
    return found


def _task(model: Path, prompt: str, objects: list[dict[str, Any]], success: dict[str, Any], jitter: float) -> Task:
    data = {
        "name": "suction",
        "prompt": prompt,
        "scene": {"robot_urdf": str(model), "objects": objects},
        "success": success,
        "randomize": {"xy_jitter": jitter, "yaw_jitter": float(np.pi)},
    }
    return Task.model_validate(data)


def run(name: str, task: Task, seeds: int) -> dict[str, Any]:
    """Run one task over seeds; return its row."""
    done, reasons = 0, Counter[str]()
    refusal = name.removeprefix("pick, ") in REFUSED
    with open_session(task) as session:
        for seed in range(seeds):
            session.reset(seed)
            episode = session.run()
            good = _REFUSAL in episode.final_detail if refusal else session.judge().success
            done += good
            if not good or refusal:
                reasons[episode.final_detail.split(";")[0]] += 1
    return {"task": name, "done": done, "seeds": seeds, "said": [f"{n} x {text}" for text, n in reasons.most_common(2)]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", nargs="*", default=[], help="tasks whose name holds one of these")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    logging.getLogger("robosandbox").setLevel(logging.ERROR)
    with tempfile.TemporaryDirectory() as folder:
        for name, task in tasks(arm(Path(folder))).items():
            if options.only and not any(part in name for part in options.only):
                continue
            row = run(name, task, options.seeds)
            low, high = beta_interval(row["done"], row["seeds"])
            said = f"; {'; '.join(row['said'])}" if row["said"] else ""
            text = f"{name:<18} {row['done']}/{row['seeds']} ({100 * low:.0f}..{100 * high:.0f}%){said}"
            print(json.dumps(row) if options.json else text, flush=True)


if __name__ == "__main__":
    main()
