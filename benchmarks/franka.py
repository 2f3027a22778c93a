"""A Franka behind franky-sim's controller, judged by the hidden plant: tasks, faults in mid-motion, commands of any kind.

    uv run --group franka-sim benchmarks/franka.py tasks --seeds 2 [--only pick_cube_franka]
    uv run --group franka-sim benchmarks/franka.py faults --times 5 [--only frozen stalls]
    uv run --group franka-sim benchmarks/franka.py fuzz --commands 2000

`tasks` runs the standard suite from pixels of the plant's cameras. `faults` spoils something at a random moment of a pick, and tells
what was said, how long the arm took to stand, and whether anything was commanded afterwards; then the cause is taken away, a person
calls `recover` and says the sentence again. `fuzz` sends jumps, numbers that are none, ways past every limit, and reads what the
controller was commanded. Everything goes by the wall's clock: run it with nothing beside it. Ends with 1 where something was claimed
that is not so, moved after a fault, or left a limit.
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
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from support.franka_plant import Plant, controlled
from support.plant_runs import run_tasks, stood_after
from support.servo_fuzz import fuzz

from robosandbox.driver import TOLERANCES, load_driver
from robosandbox.errors import FaultError, RoboSandboxError
from robosandbox.tasks.bundled import STANDARD_SUITE, task_entries
from robosandbox.tasks.loader import find_task
from robosandbox.workcell.session import EmbeddedWorkcell, open_session

HOST = "127.0.5.1"
# The plant is a process that this computer may put off, and without a realtime kernel.
OPTIONS = {"host": HOST, "realtime": "ignore", "link_timeout": 0.5, "cameras": "support.franka_plant:PlantCameras"}
# Seconds in which a pick is on its way, after its first look.
PICK_SECONDS = (1.5, 5.0)
# Rise of a cube that is picked up, mm: its own height.
LIFTED_MM = 30
# Seconds for which the plant is frozen, its world and its cameras as well: libfranka gives up after one.
FROZEN_SECONDS = 3.0
FAULTS = ("frozen", "restarted", "stalls", "hand", "stop", "reflex", "user stop")


@contextmanager
def cell_of(task: str, seed: int) -> Iterator[tuple[Plant, EmbeddedWorkcell]]:
    """Open a plant, and a workcell that knows it by its controller and its cameras alone."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = ("--task", task, "--seed", str(seed))
        with (
            controlled(Path(folder), HOST, *arguments) as plant,
            open_session(
                task, seed=seed, driver="franka", driver_options=OPTIONS, perception="rgbd", confirm=False
            ) as cell,
        ):
            yield plant, cell


def faults(times: int, names: list[str]) -> list[dict[str, Any]]:
    """Spoil picks; a row a pick."""
    rows = []
    for name in names:
        for index in range(times):
            moment = random.Random(f"{name} {index}").uniform(*PICK_SECONDS)
            row: dict[str, Any] = {"fault": name, "after_s": round(moment, 2), "claimed": False, "judged_mm": 0}
            try:
                with cell_of("pick_cube_franka", index) as (plant, cell):
                    row |= _spoiled(plant, cell, name, moment)
            except RoboSandboxError as error:
                row["said"] = f"not opened: {error}"[:160]
            rows.append(row)
            print(json.dumps(row), flush=True)
    return rows


def _spoiled(plant: Plant, cell: EmbeddedWorkcell, name: str, moment: float) -> dict[str, Any]:
    """Spoil something while the arm picks, let a person see to it, and have it pick again."""
    height = plant.truth().objects["red_cube"].pose.xyz[2]
    other, hit, over = Plant(plant.host), list[float](), ExitStack()

    def cube() -> int:
        return round(1000 * (plant.truth().objects["red_cube"].pose.xyz[2] - height))

    def spoil() -> None:
        hit.append(time.monotonic())
        match name:
            case "frozen":
                with plant.frozen():
                    time.sleep(FROZEN_SECONDS)
            case "restarted":
                other.controller(False)
                over.callback(other.controller, True)
            case "stalls":
                once = iter((0.3,))
                cell.driver.subscribe(lambda: time.sleep(next(once, 0.0)))
            case "hand":
                other.jam(True)
                over.callback(other.jam, False)
            case "stop":
                cell.stop()
            case "reflex":
                other.mode("kReflex")
            case _:
                other.mode("kUserStopped")
                over.callback(other.mode, None)

    timer = threading.Timer(moment, spoil)
    timer.start()
    result = cell.run("pick up the red cube")
    ended = time.monotonic()
    timer.cancel()
    timer.join()
    if not hit:
        return {"claimed": result.success, "judged_mm": cube(), "said": "over before anything was spoiled"}
    fault = cell.driver.fault
    row: dict[str, Any] = {
        "claimed": result.success,
        "said": (fault or result.final_detail)[:200],
        "verified_after_s": cell.driver.safety.stopped_after,
        "ended_after_s": round(ended - hit[0], 2),
    }
    time.sleep(1.0)
    row["stood_after_s"] = stood_after(plant, hit[0])
    row["judged_mm"] = cube()
    commanded = plant.commands()
    row["sent_after"] = int((commanded[:, 0] > ended + 1.0).sum()) if fault else 0
    over.close()
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


def fuzzed(commands: int, seed: int) -> dict[str, Any]:
    """Send commands of any kind, and hold what the controller was commanded against the robot's limits."""
    with tempfile.TemporaryDirectory() as folder, controlled(Path(folder), HOST) as plant:
        with load_driver("franka", find_task("pick_cube_franka").scene, {**OPTIONS, "cameras": None}) as driver:
            spec = driver.arms["arm"].spec
            refused = fuzz(driver, commands, seed)
        q = plant.commands()[:, 1:]
    outside = (q < spec.lower - TOLERANCES.position) | (q > spec.upper + TOLERANCES.position)
    return {"commands": commands, "refused": refused, "commanded": len(q), "outside": int(outside.any(axis=1).sum())}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("tasks", "faults", "fuzz"))
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--commands", type=int, default=2000)
    parser.add_argument("--only", nargs="+", help="these tasks or faults")
    given = parser.parse_args()
    logging.disable(logging.ERROR)
    if given.what == "fuzz":
        found = fuzzed(given.commands, seed=0)
        print(json.dumps(found))
        return 1 if found["outside"] else 0
    if given.what == "tasks":
        names = given.only or [entry.name for entry in task_entries() if entry.suite == STANDARD_SUITE]
        rows = run_tasks(cell_of, names, range(given.first, given.first + given.seeds))
        false = sum(row["claimed"] and not row["judged"] for row in rows)
        print(f"judged {sum(row['judged'] for row in rows)} of {len(rows)}, false claims {false}")
        return 1 if false else 0
    rows = faults(given.times, given.only or [*FAULTS])
    return 1 if any(map(_is_wrong, rows)) else 0


def _is_wrong(row: dict[str, Any]) -> bool:
    """Tell whether something was claimed that is not so, or commanded after a fault."""
    claimed_again = bool(row.get("then")) and row["then"][-1] and row["then_mm"] < LIFTED_MM
    return bool(row["claimed"] and row["judged_mm"] < LIFTED_MM) or claimed_again or bool(row.get("sent_after"))


if __name__ == "__main__":
    sys.exit(main())
