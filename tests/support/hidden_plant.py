"""A simulated world in a process of its own, behind the wire of a real machine: it tells tests its truth, and nobody else.

Tests speak with it over a socket of its own: what a `PlantServer` has as `do_name(...)` a `Plant` has as `name(...)`.
"""

from __future__ import annotations

import argparse
import atexit
import contextlib
import importlib
import itertools
import json
import os
import select
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from multiprocessing.connection import Client, Listener
from pathlib import Path
from typing import Any, Self

import numpy as np

from robosandbox.driver import BareSenses
from robosandbox.robots.loader import robots_of
from robosandbox.sim.opening import open_mujoco
from robosandbox.sim.populated import populated
from robosandbox.tasks.layouts import Layouts
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.types import Array, PictureWindow, Pose, RgbdFrame, Truth

Address = str | tuple[str, int]
# Seconds between two looks for a process.
_LOOK_SECONDS = 0.02


class PlantSim:
    """The simulation of a task's world, with quick ways to its numbers; its arm's servos do not know how heavy it is."""

    def __init__(self, world: Any) -> None:
        self.world, self.model, self.data = world, world.model, world._live
        self.dofs = world.robot.dof_indices
        self.model.body_gravcomp[list(world.robot.bodies)] = 0.0

    @classmethod
    def of(cls, task: str, robot: str | None, seed: int, tick: float) -> Self:
        """Lay out a task's world, a tick of commands after the other."""
        found = find_task(task)
        if robot is not None:
            found = found.model_copy(update={"scene": with_robot(found.scene, Path(robot))})
        return Layouts(found).lay_out(
            seed, lambda scene, q: cls(open_mujoco(scene, control_timestep=tick, felt=found.felt, start_q=q))
        )

    def q(self, qpos: int) -> float:
        return float(self.data.qpos[qpos])

    def force(self, actuator: int) -> float:
        return float(self.data.actuator_force[actuator])

    def hold(self, joints: dict[int, float]) -> None:
        self.data.qpos[[*joints]] = [*joints.values()]
        self.data.qvel[self.dofs] = 0.0

    def speed(self) -> float:
        return float(np.abs(self.data.qvel[self.dofs]).max())


class PlantServer:
    """The plant's end of the socket.

    Args:
        sim: The world.
        address: Of the socket: a path, or host and port.
    """

    def __init__(self, sim: PlantSim, address: Address) -> None:
        self.sim, self.blind = sim, False
        self.pushed: Array = np.zeros(3)
        with contextlib.suppress(Exception):
            # The first picture takes a second.
            self.do_capture(next(iter(self.do_cameras())), None)
        self.speeds: deque[tuple[float, float]] = deque(maxlen=20000)
        self.listener = Listener(address)
        self.clients: list[Any] = []

    def ready(self, seconds: float, *others: Any) -> list[Any]:
        """Wait until somebody asks, or one of `others` can be read; return who."""
        watched = [self.listener._listener._socket, *self.clients, *others]
        return select.select(watched, [], [], seconds)[0]

    def answer(self, items: Sequence[Any]) -> None:
        """Answer those who ask."""
        for item in items:
            if item is self.listener._listener._socket:
                self.clients.append(self.listener.accept())
            else:
                try:
                    name, arguments = item.recv()
                    item.send(getattr(self, f"do_{name}")(*arguments))
                except (EOFError, OSError):
                    self.clients.remove(item)

    def watch(self) -> None:
        """Note how fast the arm is, after a tick."""
        self.speeds.append((time.monotonic(), self.sim.speed()))

    def do_truth(self) -> Truth:
        return self.sim.world.truth()

    def do_cameras(self) -> Mapping[str, Any]:
        return self.sim.world.camera_specs()

    def do_capture(self, camera: str, window: PictureWindow | None) -> RgbdFrame | Exception:
        if self.blind:
            return OSError(f"the camera {camera} is gone")
        try:
            frame = self.sim.world.capture(camera, window)
        except Exception as error:
            return error
        if self.do_cameras()[camera].arm is not None:
            return frame
        told = frame.pose_camera_in_world
        return replace(frame, pose_camera_in_world=Pose.from_matrix(told.position - self.pushed, told.rotation))

    def do_push(self, metres: Sequence[float]) -> None:
        """Have the cameras that stand still this far, (3,) in the world, from where they were calibrated, and tell their old poses."""
        world, before = self.sim.world, self.pushed
        self.pushed = np.array(metres)
        for name, spec in world.camera_specs().items():
            if spec.arm is None:
                # MuJoCo places what is fixed to the world once, when its data is made.
                self.sim.data.camera(world.camera_in_model(name)).xpos += self.pushed - before

    def do_speeds(self, since: float) -> list[tuple[float, float]]:
        """(seconds, largest speed of a joint) since a moment of the monotonic clock."""
        late = itertools.takewhile(lambda each: each[0] >= since, reversed(self.speeds))
        return [*late][::-1]


class Plant:
    """A test's end of the socket: truth, pictures and faults of a plant."""

    def __init__(self, address: Address) -> None:
        self.address = address
        self._client = Client(address)

    def __getattr__(self, name: str) -> Any:
        def ask(*arguments: Any) -> Any:
            self._client.send((name, arguments))
            answer = self._client.recv()
            if isinstance(answer, Exception):
                raise answer
            return answer

        return ask


class PlantCameras(BareSenses):
    """Cameras of the plant; joints are those that the driver reads.

    Args:
        driver: Whose they are.
        plant: Where they are.
    """

    def __init__(self, driver: Any, plant: Plant) -> None:
        super().__init__(driver)
        self._plant = plant
        self.cameras = plant.cameras()

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        arms = self.driver.posture()
        return replace(self._plant.capture(camera, window), time=self.driver.time, arms=arms)


class Forked:
    """A process that a nursery forked."""

    def __init__(self, pid: int) -> None:
        self._pid = pid

    @property
    def is_alive(self) -> bool:
        try:
            self.send_signal(0)
        except ProcessLookupError:
            return False
        return True

    def send_signal(self, number: int) -> None:
        os.kill(self._pid, number)

    def kill(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            self.send_signal(signal.SIGKILL)
        while self.is_alive:
            time.sleep(_LOOK_SECONDS)


class Nursery:
    """A process that has imported a module, and loads a robot once; each plant is a fork of it, and all end with it.

    Args:
        module: Whose `main()` a plant is.
    """

    def __init__(self, module: str) -> None:
        command = [sys.executable, "-m", __name__, module]
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
        pipe = subprocess.PIPE
        # Where somebody interrupts the tests, these end it, and not the terminal.
        self._process = subprocess.Popen(
            command, env=environment, stdin=pipe, stdout=pipe, text=True, start_new_session=True
        )
        atexit.register(self.close)

    @classmethod
    @cache
    def of(cls, module: str) -> Self:
        """Return the one of a module."""
        return cls(module)

    def fork(self, *arguments: str) -> Forked:
        """Begin a plant with the arguments of its command line."""
        assert self._process.stdin is not None and self._process.stdout is not None
        print(json.dumps(arguments), file=self._process.stdin, flush=True)
        return Forked(int(self._process.stdout.readline()))

    def close(self) -> None:
        """End it, and with it its plants."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()


def _nurse(name: str) -> None:
    """Fork a plant for each line of arguments that comes."""
    module = importlib.import_module(name)
    # What ends leaves nothing behind.
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    known = argparse.ArgumentParser(allow_abbrev=False)
    known.add_argument("--robot", type=Path)
    for line in sys.stdin:
        arguments = json.loads(line)
        robot = known.parse_known_args(arguments)[0].robot
        if robot is not None:
            # What is loaded is kept.
            robots_of(populated(with_robot(find_task("pick_cube_franka").scene, robot)))
        pid = os.fork()
        if pid == 0:
            # Its lines are no answers to who asked for it.
            os.dup2(2, 1)
            sys.argv[1:] = arguments
            module.main()
            return
        print(pid, flush=True)
    os.killpg(0, signal.SIGKILL)


@contextlib.contextmanager
def running(module: str, folder: Path, *arguments: str) -> Iterator[Forked]:
    """Run a plant, which makes the file `ready` in a folder when it is."""
    process = Nursery.of(module).fork(str(folder), *arguments)
    try:
        while not (folder / "ready").exists():
            if not process.is_alive:
                raise RuntimeError("the plant has ended; it says above why")
            time.sleep(_LOOK_SECONDS)
        yield process
    finally:
        process.kill()


if __name__ == "__main__":
    _nurse(sys.argv[1])
