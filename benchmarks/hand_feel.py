"""Forces of the hand, times at which it acts, and contacts of a policy and of a jogging user, by the simulated state.

    uv run benchmarks/hand_feel.py force [--seconds 2]
    uv run benchmarks/hand_feel.py times [--times 20]
    uv run benchmarks/hand_feel.py actions [--episodes 40]
    uv run benchmarks/hand_feel.py jog [--sessions 20]

`force` presses down and squeezes with 5, 10 and 20 N and comes down until something is touched, on `mujoco` and on `hardware` with a
wrist sensor. `times` waits, holds and acts every few seconds, each also stopped in the middle. `actions` sends random actions to an
environment, another every half second; `jog` sends `move_by` at random. Forces are MuJoCo's contacts of the robot at every control
tick. Ends with 1 where something is more than a tenth off or over a limit, or more than a control tick late.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
from odd_judge import raw_state
from support.pegs import plant_of

from robosandbox import open_session
from robosandbox.apps.envs import ManipulationEnv
from robosandbox.errors import CancelledError, RoboSandboxError, UnsupportedError
from robosandbox.sim.mujoco_backend import MuJoCoBackend
from robosandbox.skills.events import SkillStarted
from robosandbox.types import MAX_UNINTENDED_FORCE_N, Array
from robosandbox.workcell.embedded import EmbeddedWorkcell

Row = dict[str, Any]
_TASK, _CUBES, _ASKED = "pick_from_three", ("red_cube", "green_cube", "blue_cube"), (5.0, 10.0, 20.0)
# Share of a force by which what is pressed with may be off it, and a squeeze pass it.
_NEAR = 0.1
# N at which the hand stops that comes down until it touches.
_TOUCH = 2.0


def contacts(plant: MuJoCoBackend, data: mujoco.MjData) -> Iterator[tuple[str, Array, float]]:
    """Yield the robot's contacts from MuJoCo alone: the other body, the force on it (N, world, shape (3,)), and its normal part."""
    model, robot, local = plant.model, plant.robot.bodies, np.zeros(6)
    raw_state(plant, data)
    for k in range(data.ncon):
        first, second = (int(model.geom_bodyid[geom]) for geom in data.contact.geom[k])
        if (first in robot) != (second in robot):
            mujoco.mj_contactForce(model, data, k, local)
            world = data.contact.frame[k].reshape(3, 3).T @ local[:3]
            other = second if first in robot else first
            yield model.body(other).name, world if first in robot else -world, float(local[0])


class Feeling:
    """The forces of the robot at every control tick: time, the downward sum, the largest on one body, half the squeeze of all."""

    def __init__(self, cell: EmbeddedWorkcell) -> None:
        self.plant = plant_of(cell.driver)
        self._data = mujoco.MjData(self.plant.model)
        self.rows: list[tuple[float, float, float, float]] = []
        self.plant.subscribe(self._look)

    def _look(self) -> None:
        forces: dict[str, Array] = {}
        squeezed = 0.0
        for name, force, normal in contacts(self.plant, self._data):
            forces[name] = forces.get(name, np.zeros(3)) + force
            squeezed += 0.5 * normal
        down = -sum(float(force[2]) for force in forces.values())
        most = max((float(np.linalg.norm(force)) for force in forces.values()), default=0.0)
        self.rows.append((self.plant.time, down, most, squeezed))

    @property
    def most(self) -> float:
        """The largest force on one body, N."""
        return max((row[2] for row in self.rows), default=0.0)

    def held_for(self, asked: float, seconds: float) -> Array:
        """Return the downward forces of the last `seconds` in which over half of what was asked was pressed."""
        rows = np.array(self.rows)
        last = rows[rows[:, 1] > 0.5 * asked][-1, 0]
        return rows[(rows[:, 0] > last - seconds) & (rows[:, 0] <= last - 0.02), 1]


@contextlib.contextmanager
def opened(driver: str) -> Iterator[EmbeddedWorkcell]:
    """Open the task on a driver, by the simulated state or, where it hides that, by its cameras."""
    name, _, wrist = driver.partition(":")
    options: dict[str, Any] = {"driver_options": {"wrist_wrench": True}, "perception": "rgbd"} if wrist else {}
    with open_session(_TASK, driver=name, what_if=False, **options) as cell:
        yield cell


def force_rows(seconds: float) -> Iterator[Row]:
    """Press, squeeze and touch on both drivers."""
    for driver in ("mujoco", "hardware:wrist"):
        for on in (*_CUBES[:2], "table"):
            for asked in _ASKED:
                with opened(driver) as cell:
                    row: Row = {"what": "press_down", "driver": driver, "on": on, "asked_n": asked}
                    try:
                        if on == "table":
                            cell.do("move_to", x=0.15, y=0.25, z=0.12)
                        feeling = Feeling(cell)
                        cell.do("press_down", force=asked, seconds=seconds, **({} if on == "table" else {"object": on}))
                        held = feeling.held_for(asked, seconds)
                        row |= {
                            "mean_n": held.mean(),
                            "least_n": held.min(),
                            "most_held_n": held.max(),
                            "most_n": feeling.most,
                        }
                        row["right"] = bool(np.abs(held / asked - 1.0).max() < _NEAR)
                    except RoboSandboxError as error:
                        row |= {"said": str(error), "right": False}
                yield row
        for on in _CUBES:
            for asked in _ASKED:
                with opened(driver) as cell:
                    row = {"what": "squeeze", "driver": driver, "on": on, "asked_n": asked}
                    try:
                        feeling = Feeling(cell)
                        cell.do("squeeze", object=on, force=asked, seconds=seconds)
                        grip = np.array([row[3] for row in feeling.rows])
                        steady = float(np.median(grip[grip > 0.5 * asked]))
                        row |= {
                            "mean_n": steady,
                            "most_n": grip.max(),
                            "right": abs(steady / asked - 1.0) < _NEAR and grip.max() < (1.0 + _NEAR) * asked,
                        }
                    except UnsupportedError as error:
                        row |= {"said": str(error), "right": driver != "mujoco"}
                yield row
        for on in (*_CUBES, "table"):
            with opened(driver) as cell:
                feeling = Feeling(cell)
                if on == "table":
                    cell.do("move_to", x=0.15, y=0.25, z=0.12)
                else:
                    cell.do("move_over", object=on, height=0.08)
                felt = cell.do("move_by", dz=-0.3, until_force=_TOUCH).detail["touched"]
                yield {
                    "what": "touch",
                    "driver": driver,
                    "on": on,
                    "asked_n": _TOUCH,
                    "most_n": feeling.most,
                    "right": bool(felt) and feeling.most < MAX_UNINTENDED_FORCE_N,
                }


def times_rows(times: int) -> Iterator[Row]:
    """Wait, hold and act every few seconds; then each again with a stop in the middle."""
    rng = np.random.default_rng(0)
    with open_session(_TASK) as cell:
        tick = cell.driver.control_timestep
        begins: list[float] = []

        def hear(told: object) -> None:
            if isinstance(told, SkillStarted) and told.call.skill == "move_by":
                begins.append(cell.driver.time)

        cell.ctx.events.subscribe(hear)
        for held in (False, True):
            if held:
                cell.do("pick", object="red_cube")
            for _ in range(times):
                seconds, began = float(rng.uniform(0.2, 8.0)), cell.driver.time
                cell.do("wait", seconds=seconds)
                off = cell.driver.time - began - seconds
                yield {
                    "what": "hold" if held else "wait",
                    "seconds": seconds,
                    "off_ms": 1e3 * off,
                    "right": abs(off) <= tick,
                }
                yield _stopped(cell, "hold" if held else "wait", seconds, lambda: cell.do("wait", seconds=60.0))
        for _ in range(times):
            seconds = float(rng.integers(2, 6))
            begins.clear()
            done = cell.run(f"every {seconds:.0f} seconds go up 5 mm, three times")
            off = float(np.abs(np.diff(begins) - seconds).max())
            right = done.success and len(begins) == 3 and off <= tick
            yield {"what": "every", "seconds": seconds, "off_ms": 1e3 * off, "right": right}
            cell.do("move_by", dz=-0.015)
            yield _stopped(cell, "every", 1.5 * seconds, lambda: cell.run("every 3 seconds go up 5 mm, four times"))
            cell.do("home")


def _stopped(cell: EmbeddedWorkcell, what: str, after: float, act: Callable[[], Any]) -> Row:
    """Stop what acts after some seconds of its time; tell how long it then went on, and whether the arm stands."""
    stopped: list[float] = []
    begin = cell.driver.time

    def stop() -> None:
        if not stopped and cell.driver.time - begin >= after:
            stopped.append(cell.driver.time)
            cell.ctx.cancel()

    leave = cell.driver.subscribe(stop)
    holding = cell.truth().held
    try:
        ended = act()
        cancelled = ended.error is not None and ended.error.code == "cancelled"
    except CancelledError:
        cancelled = True
    leave()
    late = cell.driver.time - stopped[0] if stopped else float("nan")
    speed = float(np.abs(cell.driver.arms["arm"].state().qd).max())
    right = cancelled and late <= 1.01 * cell.driver.control_timestep and cell.truth().held == holding
    return {"what": f"{what} stopped", "after": after, "off_ms": 1e3 * late, "rad_s": speed, "right": right}


def actions_rows(episodes: int) -> Iterator[Row]:
    """Send random actions, another every half second, for 15 s an episode."""
    for kind in ("ee", "joint"):
        with contextlib.closing(ManipulationEnv("pick_cube_franka", action=kind)) as env:
            most = [0.0]
            env.session.driver.subscribe(
                lambda env=env, most=most: most.append(env.session.driver.senses.strongest_contact("arm")[0])
            )
            for seed in range(episodes):
                env.reset(seed=seed)
                rng = np.random.default_rng([7, seed])
                most[:] = [0.0]
                stopped = ""
                for step in range(300):
                    if step % 10 == 0:
                        action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
                    *_, ended, _, info = env.step(action)
                    stopped = stopped or str(info.get("stopped", ""))
                    if ended:
                        break
                right = not stopped and max(most) <= 1.1 * MAX_UNINTENDED_FORCE_N
                yield {"what": kind, "seed": seed, "most_n": max(most), "stopped": stopped, "right": right}


def jog_rows(sessions: int) -> Iterator[Row]:
    """Send sixty random `move_by` of up to 12 cm each way in each session."""
    for seed in range(sessions):
        with open_session(_TASK, seed=seed, what_if=False) as cell:
            feeling, rng, refused = Feeling(cell), np.random.default_rng([8, seed]), 0
            for _ in range(60):
                dx, dy, dz = (float(v) for v in rng.uniform(-0.12, 0.12, 3))
                try:
                    cell.do("move_by", dx=dx, dy=dy, dz=dz)
                except RoboSandboxError:
                    refused += 1
            right = feeling.most <= 1.1 * MAX_UNINTENDED_FORCE_N
            yield {"what": "jog", "seed": seed, "refused": refused, "most_n": feeling.most, "right": right}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=("force", "times", "actions", "jog"))
    parser.add_argument("--seconds", type=float, default=2.0, help="of pressing")
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--episodes", type=int, default=40)
    parser.add_argument("--sessions", type=int, default=20)
    parser.add_argument("--misses", action="store_true", help="print the rows that are not right alone")
    given = parser.parse_args()
    rows = {
        "force": lambda: force_rows(given.seconds),
        "times": lambda: times_rows(given.times),
        "actions": lambda: actions_rows(given.episodes),
        "jog": lambda: jog_rows(given.sessions),
    }[given.part]()
    kept: list[Row] = []
    for row in rows:
        kept.append(row)
        if not (given.misses and row["right"]):
            print(
                json.dumps({key: round(value, 2) if isinstance(value, float) else value for key, value in row.items()}),
                flush=True,
            )
    for what in dict.fromkeys(row["what"] for row in kept):
        its = [row for row in kept if row["what"] == what]
        told = {"what": what, "right": sum(bool(row["right"]) for row in its), "of": len(its)}
        for key in ("most_n", "off_ms"):
            values = [abs(row[key]) for row in its if key in row]
            told |= {f"worst_{key}": round(max(values), 2)} if values else {}
        print(json.dumps(told))
    return 0 if all(row["right"] for row in kept) else 1


if __name__ == "__main__":
    sys.exit(main())
