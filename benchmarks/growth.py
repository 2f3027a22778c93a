"""How what things cost grows with how many there are: one table, with the exponent of each row.

    uv run benchmarks/growth.py [--only objects meshes beads cameras prompt plan recording rows clients] [--json]

The exponent is the slope of log(cost) over log(size) from the middle size to the largest, so that what is paid once does not
hide what grows: 0 costs the same for any size, 1 costs twice as much for twice the size. Costs are CPU of this process, the
least of several runs, but for the round trip of `clients`, which is a median by the clock and says nothing on a busy machine.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import mujoco
import trimesh
from rows import measured
from support.processes import SimProcess

from robosandbox import open_session
from robosandbox.driver import Driver
from robosandbox.sim.opening import require_mujoco
from robosandbox.sim.saved_state import continue_from
from robosandbox.types import Plan, Pose, Scene, SceneObject, SkillCall
from robosandbox.workcell.recording.settings import RecordSettings, open_recorder
from robosandbox.workcell.zenoh.client import connect
from robosandbox.world.verifier import verify

# Things stand in rows of ten, metres apart: 60 fit on the table.
_ROW, _SPACING = 10, 0.08
_RUNS = 3
_STEPS = 300
_ROUND_TRIPS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Growth:
    """What one thing costs at several sizes, smallest first."""

    what: str
    unit: str
    sizes: tuple[int, ...]
    costs: tuple[float, ...]

    @property
    def exponent(self) -> float:
        """The slope of log(cost) over log(size) from the middle size to the largest."""
        middle = len(self.sizes) // 2
        steps = math.log(self.sizes[-1] / self.sizes[middle])
        return math.log(max(self.costs[-1], 1e-12) / max(self.costs[middle], 1e-12)) / steps


def cpu_ms(work: Callable[[], object], runs: int = _RUNS) -> float:
    """Return the least CPU of several runs, ms."""
    took = []
    for _ in range(runs):
        begin = time.process_time()
        work()
        took.append(1e3 * (time.process_time() - begin))
    return min(took)


def boxes(count: int, **changes: object) -> Scene:
    """Return a table with this many cubes of 4 cm, the first of them in front of the arm."""
    things = []
    for k in range(count):
        # The rows nearest to the middle of the table first, so that the first cube can be reached.
        x = 0.12 + _SPACING * ((k // _ROW + 1) // 2) * (-1) ** (k // _ROW)
        y = _SPACING * ((k % _ROW + 1) // 2) * (-1) ** (k % _ROW)
        things.append(
            SceneObject(id=f"cube_{k}", kind="box", size=(0.02, 0.02, 0.02), mass=0.05, pose=Pose(xyz=(x, y, 0.06)))
        )
    return Scene(objects=tuple(thing.model_copy(update=changes) for thing in things))


def objects(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure physics at rest, plans and a pick among more and more cubes."""
    found: dict[str, list[float]] = {
        "opening": [],
        "physics step at rest": [],
        "plan": [],
        "pick, episode": [],
    }
    # What is made for the first world is there for the others.
    open_session(boxes(1)).close()
    for count in sizes:
        begin = time.process_time()
        with open_session(boxes(count)) as session:
            found["opening"].append(1e3 * (time.process_time() - begin))
            sim, agent = session.driver, session.agent
            found["physics step at rest"].append(_step_ms(sim, _STEPS))
            found["plan"].append(cpu_ms(partial(agent.plan, "pick up cube_0")))
            begin = time.process_time()
            if not agent.run("pick up cube_0").success:
                raise SystemExit(f"the pick among {count} failed")
            found["pick, episode"].append(1e3 * (time.process_time() - begin))
    for what, costs in found.items():
        yield Growth(what=f"objects: {what}", unit="ms", sizes=tuple(sizes), costs=tuple(costs))


def meshes(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure opening a world of different meshes, taken apart for the first time, and again."""
    first, again = [], []
    with tempfile.TemporaryDirectory() as folder:
        for count in sizes:
            things = []
            for k, box in enumerate(boxes(count).objects):
                path = Path(folder, f"{count}_{k}.obj")
                # No two alike: what was taken apart is remembered by content.
                trimesh.creation.annulus(0.008 + 1e-5 * k + 1e-6 * count, 0.02, 0.04).export(path)
                things.append(SceneObject(id=box.id, kind="mesh", mesh=path, mass=0.05, pose=box.pose))
            scene = Scene(objects=tuple(things))
            for costs in (first, again):
                begin = time.process_time()
                open_session(scene).close()
                costs.append(1e3 * (time.process_time() - begin))
    yield Growth(what="meshes: opening, first time", unit="ms", sizes=tuple(sizes), costs=tuple(first))
    yield Growth(what="meshes: opening, again", unit="ms", sizes=tuple(sizes), costs=tuple(again))


def beads(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure physics with more and more beads at rest in a bowl."""
    costs = []
    for count in sizes:
        bowl = SceneObject(id="bowl", kind="bowl", size=(0.075, 0.06), mass=0.3, pose=Pose(xyz=(0.15, 0.0, 0.04)))
        grains = SceneObject(
            id="beads", kind="beads", size=(0.005,), count=count, inside="bowl", mass=0.001 * count, pose=bowl.pose
        )
        with open_session(Scene(objects=(bowl, grains))) as session:
            costs.append(_step_ms(session.driver, _STEPS // 10))
    yield Growth(what="beads: physics step at rest", unit="ms", sizes=tuple(sizes), costs=tuple(costs))


def cameras(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure taking pictures of one to all of the world's cameras, by their CPU."""
    with open_session("pick_from_three") as session:
        names = sorted(session.driver.capabilities.cameras)
        sizes = tuple(size for size in sizes if size <= len(names))
        costs = [cpu_ms(partial(_pictures, session.driver, names[:size])) for size in sizes]
    yield Growth(what="cameras: a picture of each", unit="ms", sizes=sizes, costs=tuple(costs))


def prompts(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure understanding a prompt of more and more clauses."""
    with open_session("pick_from_three") as session:
        clauses = ("pick up the red cube", "put it on the table")
        said = {size: ", then ".join(clauses[k % 2] for k in range(size)) for size in sizes}
        costs = [cpu_ms(partial(session.agent.plan, text)) for text in said.values()]
    yield Growth(what="prompt: understanding, by clauses", unit="ms", sizes=tuple(said), costs=tuple(costs))


def plans(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure verifying a plan of more and more calls."""
    with open_session("pick_from_three") as session:
        scene, skills = session.observe(), tuple(session.agent.skills.values())
        calls = (
            SkillCall(skill="pick", arguments={"object": "red_cube"}),
            SkillCall(skill="place_beside", arguments={"target": "green_cube", "side": "left"}),
        )
        made = {size: Plan(steps=tuple(calls[k % 2] for k in range(size))) for size in sizes}
        costs = [cpu_ms(partial(verify, plan, scene, skills)) for plan in made.values()]
    yield Growth(what="plan: verifying, by calls", unit="ms", sizes=tuple(made), costs=tuple(costs))


def recordings(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure what is on the disk after more and more seconds of waiting."""
    costs = []
    with tempfile.TemporaryDirectory() as folder, open_session("pick_from_three") as session:
        for size in sizes:
            target = Path(folder, str(size))
            recorder = open_recorder(RecordSettings(folder=target), session)
            recorder.follow()
            session.reset(0)
            session.run()
            session.driver.wait(float(size))
            recorder.finish(judged=session.judge())
            recorder.close()
            costs.append(sum(path.stat().st_size for path in target.rglob("*") if path.is_file()) / 1e3)
    yield Growth(what="recording: size, by seconds after a pick", unit="kB", sizes=tuple(sizes), costs=tuple(costs))


def rows(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure by how much a bench's memory grows with its rows, the last first and each kept in a file."""
    costs = [float(measured(size, "last first", resume=True)["growth_mb"]) for size in sizes]
    yield Growth(what="rows: memory beyond the first 1,000", unit="MB", sizes=tuple(sizes), costs=tuple(costs))


def clients(sizes: Iterable[int]) -> Iterator[Growth]:
    """Measure a round trip and the sim's CPU in an idle second with more and more clients that follow its state."""
    trips, idle = [], []
    with SimProcess("--task", "home") as sim, connect(sim.endpoint) as asking, ExitStack() as others:
        robot, there = asking.robot(), 0
        for size in sizes:
            for _ in range(there, size):
                client = others.enter_context(connect(sim.endpoint))
                client.robot().watch("obs/state", lambda _: None)
            there = size
            took = []
            for _ in range(_ROUND_TRIPS):
                begin = time.perf_counter()
                robot.info()
                took.append(1e3 * (time.perf_counter() - begin))
            trips.append(statistics.median(took))
            begin = _cpu_of(sim.pid)
            time.sleep(2.0)
            idle.append(1e3 * (_cpu_of(sim.pid) - begin) / 2.0)
    yield Growth(what="clients: a round trip, by the clock", unit="ms", sizes=tuple(sizes), costs=tuple(trips))
    yield Growth(what="clients: the sim's CPU in an idle second", unit="ms", sizes=tuple(sizes), costs=tuple(idle))


def _pictures(sim: Driver, names: Sequence[str]) -> None:
    for name in names:
        sim.senses.capture(name)


def _step_ms(sim: Driver, steps: int) -> float:
    """Return the CPU of a bare physics step from where a world is, ms; the world itself stays."""
    world = require_mujoco(sim, "its bare physics is timed")
    data = mujoco.MjData(world.model)
    continue_from(world.model, data, world.snapshot())
    return cpu_ms(partial(mujoco.mj_step, world.model, data, steps)) / steps


def _cpu_of(pid: int) -> float:
    """Return the CPU seconds that a process has taken (read in /proc: Linux only)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


# What is measured, at which sizes.
_MEASURED: Mapping[str, tuple[Callable[[Iterable[int]], Iterator[Growth]], tuple[int, ...]]] = {
    "objects": (objects, (1, 5, 20, 60)),
    "meshes": (meshes, (1, 4, 16)),
    "beads": (beads, (10, 30, 100)),
    "cameras": (cameras, (1, 2, 3)),
    "prompt": (prompts, (1, 2, 4, 8, 16)),
    "plan": (plans, (2, 10, 40)),
    "recording": (recordings, (1, 10, 100)),
    "rows": (rows, (2_000, 10_000, 100_000)),
    "clients": (clients, (1, 10, 50, 200)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(_MEASURED), default=list(_MEASURED))
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    found = []
    if not options.json:
        print("| what | sizes | cost | exponent |\n|---|---|---|---|")
    for name in options.only:
        measure, sizes = _MEASURED[name]
        for growth in measure(sizes):
            found.append(growth)
            if not options.json:
                costs = ", ".join(f"{cost:.3g}" for cost in growth.costs)
                at = ", ".join(map(str, growth.sizes))
                print(f"| {growth.what} | {at} | {costs} {growth.unit} | {growth.exponent:.2f} |", flush=True)
    if options.json:
        print(json.dumps([{**asdict(growth), "exponent": growth.exponent} for growth in found], indent=1))


if __name__ == "__main__":
    main()
