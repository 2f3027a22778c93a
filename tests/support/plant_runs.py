"""Task runs on a hidden plant, which is the judge, and how long its arm takes to stand."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from support.hidden_plant import Plant

from robosandbox.errors import InputError, RoboSandboxError
from robosandbox.sim.opening import open_mujoco
from robosandbox.tasks.evaluate import evaluate
from robosandbox.tasks.layouts import Layouts
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.workcell.session import EmbeddedWorkcell, open_session

# Slower than this the arm stands, rad/s: what an encoder's single count makes of a joint that holds.
STANDS = 0.05
# Seconds for which it has to.
STANDS_FOR = 0.3
# Layouts that are looked through for each in which the arm has room.
_LAYOUTS = 3


def run_tasks(
    cell_of: Callable[[str, int], AbstractContextManager[tuple[Plant, EmbeddedWorkcell]]],
    names: Sequence[str],
    seeds: Sequence[int],
) -> list[dict[str, Any]]:
    """Run tasks in cells that are opened by task and seed; print and return a row an episode."""
    rows = []
    for name in names:
        for seed in seeds:
            row: dict[str, Any] = {"task": name, "seed": seed, "claimed": False, "judged": False}
            began = time.monotonic()
            try:
                with cell_of(name, seed) as (plant, cell):
                    start = plant.truth()
                    result = cell.run()
                    row |= {"claimed": result.success, "said": result.final_detail[:200]}
                    row["judged"] = evaluate(find_task(name).success, start, plant.truth, time.sleep).success
                    row["fault"] = cell.driver.fault
            except RoboSandboxError as error:
                row["said"] = f"{type(error).__name__}: {error}"[:200]
            row["seconds"] = round(time.monotonic() - began, 1)
            rows.append(row)
            print(json.dumps(row), flush=True)
    return rows


def roomy_seeds(task: str, robot: Path, count: int) -> list[int]:
    """Return the first seeds of a task in whose layouts an arm has room; most of the suite is laid out for a larger one."""
    found = find_task(task)
    layouts = Layouts(found.model_copy(update={"scene": with_robot(found.scene, robot)}))
    seeds: list[int] = []
    for seed in range(_LAYOUTS * count):
        if len(seeds) == count:
            break
        try:
            layouts.lay_out(seed, lambda scene, q: open_mujoco(scene, start_q=q)).close()
        except InputError as error:
            print(json.dumps({"task": task, "seed": seed, "unfit": str(error)[:120]}), flush=True)
        else:
            seeds.append(seed)
    return seeds


def done_in_simulation(task: str, robot: Path, seed: int) -> bool:
    """Tell whether an arm does a task's layout in plain simulation, seeing the truth: what it can do at all."""
    found = find_task(task)
    found = found.model_copy(update={"scene": with_robot(found.scene, robot)})
    laid_out = Layouts(found).lay_out(seed, lambda scene, q: found.model_copy(update={"scene": scene}))
    try:
        with open_session(laid_out) as cell:
            start = cell.truth()
            cell.run()
            return evaluate(found.success, start, cell.truth, cell.driver.wait).success
    except InputError:
        # At home the arm stands where something is laid.
        return False


def stood_after(plant: Plant, since: float) -> float | None:
    """Return the seconds from a moment until the arm stood; None where it does not stand."""
    speeds = plant.speeds(since)
    moving = [moment for moment, speed in speeds if speed >= STANDS]
    last = moving[-1] if moving else since
    return round(last - since, 2) if speeds and speeds[-1][0] - last >= STANDS_FOR else None
