"""A bus of STS3215 servos on a pseudo-terminal with MuJoCo behind it, in a process of its own.

    python tests/support/servo_bus.py FOLDER [--task TASK] [--robot MODEL] [--seed N] [--backlash RAD] [--limp]

FOLDER gets `bus` (the port), `calibration.json` (LeRobot's form), `goals.csv` (each goal that reached a servo: seconds, servo,
counts, and whether its torque was on) and `control` (a socket that tests speak over, see `Plant`). Its servos are those of the
robot's model: position control with a stiffness and a largest torque, friction and damping; they sag under gravity as real ones.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import select
import subprocess
import sys
import time
import tty
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import replace
from multiprocessing.connection import Client, Listener
from pathlib import Path
from typing import Any

import numpy as np

from robosandbox.driver import HAND, BareSenses
from robosandbox.drivers.feetech.calibration import ServoCalibration, write_calibration
from robosandbox.sim.opening import open_mujoco
from robosandbox.tasks.layouts import Layouts
from robosandbox.tasks.loader import find_task, with_robot
from robosandbox.types import PictureWindow, RgbdFrame, Truth

TURN, MIDDLE = 4096, 2047
COUNT = 2.0 * np.pi / TURN
# Seconds of a tick of the servos' control.
_TICK = 0.002
# Ticks that are made up for at once where the process was late.
_MAKE_UP = 4
# Share of the torque above which a servo is overloaded, and for how many seconds (registers 36 and 35 as delivered).
_OVERLOAD, _OVERLOAD_SECONDS = 0.8, 2.0


class Servo:
    """One servo: its control table, and the joint that it turns."""

    def __init__(self, plant: PlantProcess, id: int, actuator: int, qpos: int, middle: float, offset: int) -> None:
        self.plant, self.actuator, self.qpos = plant, actuator, qpos
        model = plant.sim.model
        self.gain, self.bias = model.actuator_gainprm[actuator, 0], model.actuator_biasprm[actuator].copy()
        self.torque = float(model.actuator_forcerange[actuator, 1])
        # Where its horn was put on: what the encoder reads at the joint's 0.
        self.zero = MIDDLE + offset - middle / COUNT
        self.table = bytearray(128)
        self.silent = self.frozen = False
        self.loaded_since = 0.0
        words = ((3, 777), (9, 0), (11, TURN - 1), (16, 1000), (48, 1000), (31, abs(offset) | (offset < 0) << 11))
        for address, value in words:
            self.put(address, value)
        for address, value in ((5, id), (13, 70), (14, 80), (15, 40), (21, 32), (55, 1), (62, 74), (63, 30)):
            self.table[address] = value
        self.sense()

    def put(self, address: int, value: int) -> None:
        self.table[address : address + 2] = value.to_bytes(2, "little")

    def get(self, address: int) -> int:
        return int.from_bytes(self.table[address : address + 2], "little")

    @property
    def id(self) -> int:
        return self.table[5]

    @property
    def error(self) -> int:
        """The error byte of its replies."""
        hot = self.table[63] >= self.table[13]
        loaded = self.loaded_since > 0.0 and self.plant.time - self.loaded_since > _OVERLOAD_SECONDS
        return (not 40 <= self.table[62] <= 80) | hot << 2 | loaded << 5

    @property
    def counts(self) -> int:
        """Its position now."""
        kept = self.get(31)
        offset = -(kept & 0x7FF) if kept >> 11 else kept
        return (round(self.zero + self.plant.sim.q(self.qpos) / COUNT) - offset) % TURN

    def act(self) -> None:
        """Drive the joint for a tick."""
        model, error = self.plant.sim.model, self.error
        on = self.table[40] == 1 and not error & 1 << 2
        limit = self.torque * min(self.get(48), 1000) / 1000.0 * (0.2 if error & 1 << 5 else 1.0)
        model.actuator_forcerange[self.actuator] = -limit, limit
        model.actuator_gainprm[self.actuator, 0] = self.gain if on else 0.0
        model.actuator_biasprm[self.actuator, :3] = self.bias[:3] if on else 0.0
        if on and not self.frozen:
            off = (min(max(self.get(42), self.get(9)), self.get(11)) - self.counts) * COUNT
            # Within its gear's play a servo moves nothing.
            if abs(off) > self.plant.backlash:
                self.plant.controls[self.actuator] = self.plant.sim.q(self.qpos) + off

    def sense(self) -> None:
        """Put what it senses into its table."""
        if self.frozen:
            return
        share = self.plant.sim.force(self.actuator) / self.torque
        self.put(56, self.counts)
        self.put(60, round(1000 * min(abs(share), 1.0)) | (share < 0) << 10)
        if abs(share) < _OVERLOAD or not self.table[40]:
            self.loaded_since = 0.0
        elif not self.loaded_since:
            self.loaded_since = self.plant.time


class PlantProcess:
    """The plant, its bus and the socket of tests, in one loop."""

    def __init__(self, folder: Path, task: str, robot: str | None, seed: int, backlash: float, limp: bool) -> None:
        found = find_task(task)
        if robot is not None:
            found = found.model_copy(update={"scene": with_robot(found.scene, Path(robot))})
        self.folder, self.backlash = folder, backlash
        self.sim = Layouts(found).lay_out(
            seed, lambda scene, q: _Sim.of(open_mujoco(scene, control_timestep=_TICK, felt=found.felt, start_q=q))
        )
        with contextlib.suppress(Exception):
            # The first picture takes a second.
            self.do_capture(next(iter(self.do_cameras())), None)
        self.controls = np.array(self.sim.world.controls)
        self.began, self.ticks = time.monotonic(), 0
        random = np.random.default_rng(seed)
        arm, hand = self.sim.world.robot, self.sim.world.world.grippers[HAND]
        ends = hand.geometry.open_joint, hand.geometry.closed_joint
        joints = [*zip(arm.joints, arm.actuator_ids, arm.qpos_indices, arm.lower, arm.upper, strict=True)]
        joints.append(("gripper", hand.actuator_ids[0], hand.qpos_index, min(ends), max(ends)))
        self.servos: dict[int, Servo] = {}
        calibration = {}
        for id, (name, actuator, qpos, lower, upper) in enumerate(joints, 1):
            offset, reach = int(random.integers(-1500, 1500)), round((upper - lower) / 2 / COUNT)
            self.servos[id] = Servo(self, id, int(actuator), int(qpos), float(lower + upper) / 2, offset)
            calibration[name] = ServoCalibration(
                id=id, homing_offset=offset, range_min=MIDDLE - reach, range_max=MIDDLE + reach
            )
        write_calibration(folder / "calibration.json", calibration)
        for servo in self.servos.values():
            servo.put(42, servo.get(56))
            servo.table[40] = not limp
        self.goals = (folder / "goals.csv").open("w", buffering=1)
        self.speeds: deque[tuple[float, float]] = deque(maxlen=20000)
        self.listener = Listener(str(folder / "control"))
        self.clients: list[Any] = []
        self.received = bytearray()
        self.held: dict[int, float] | None = None
        self.plug()

    @property
    def time(self) -> float:
        return self.ticks * _TICK

    def plug(self) -> None:
        """Put the cable in: the port appears."""
        self.master, slave = os.openpty()
        tty.setraw(slave)
        link = self.folder / "bus"
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(slave))
        self.slave: int | None = slave

    def unplug(self) -> None:
        """Pull the cable: the port is gone."""
        (self.folder / "bus").unlink(missing_ok=True)
        os.close(self.master)
        os.close(self.slave)
        self.slave = None

    def run(self) -> None:
        socket = self.listener._listener._socket
        while True:
            watched = [socket, *self.clients, *([] if self.slave is None else [self.master])]
            ready = select.select(watched, [], [], _TICK)[0]
            self.catch_up()
            for item in ready:
                if item is socket:
                    self.clients.append(self.listener.accept())
                elif item == self.master:
                    with contextlib.suppress(OSError):
                        self.received += os.read(self.master, 4096)
                        self.answer()
                else:
                    try:
                        name, arguments = item.recv()
                        item.send(getattr(self, f"do_{name}")(*arguments))
                    except (EOFError, OSError):
                        self.clients.remove(item)

    def catch_up(self) -> None:
        """Let pass what the wall's clock says has passed; what a busy machine cannot make up for is lost."""
        late = time.monotonic() - self.began - (self.ticks + 1) * _TICK
        self.began += max(0.0, late - _MAKE_UP * _TICK)
        while self.began + (self.ticks + 1) * _TICK <= time.monotonic():
            for servo in self.servos.values():
                servo.act()
            if self.held is not None:
                self.sim.hold(self.held)
            else:
                self.sim.world.replay(self.controls)
            self.ticks += 1
            for servo in self.servos.values():
                servo.sense()
            self.speeds.append((time.monotonic(), self.sim.speed()))

    # The bus.

    def answer(self) -> None:
        """Answer every whole request that was received."""
        while (begin := self.received.find(b"\xff\xff")) >= 0:
            del self.received[:begin]
            if len(self.received) < 4 or len(self.received) < 4 + self.received[3]:
                return
            frame = bytes(self.received[: 4 + self.received[3]])
            if ~sum(frame[2:-1]) & 0xFF == frame[-1]:
                del self.received[: len(frame)]
                self.obey(frame[2], frame[4], frame[5:-1])
            else:
                del self.received[:1]

    def obey(self, id: int, instruction: int, rest: bytes) -> None:
        listening = {one.id: one for one in self.servos.values() if not one.silent}
        if instruction == 0x82:
            asked = [listening[each] for each in rest[2:] if each in listening]
            os.write(self.master, b"".join(_reply(one, one.table[rest[0] : rest[0] + rest[1]]) for one in asked))
        elif instruction == 0x83:
            for at in range(2, len(rest), rest[1] + 1):
                if rest[at] in listening:
                    self.write(listening[rest[at]], rest[0], rest[at + 1 : at + 1 + rest[1]])
        elif id in listening:
            servo, data = listening[id], b""
            if instruction == 2:
                data = bytes(servo.table[rest[0] : rest[0] + rest[1]])
            elif instruction == 3:
                self.write(servo, rest[0], rest[1:])
            os.write(self.master, _reply(servo, data))

    def write(self, servo: Servo, address: int, data: bytes) -> None:
        # Below 40 lies what is kept without power: it can be written while the lock is off.
        if address < 40 and servo.table[55]:
            return
        servo.table[address : address + len(data)] = data
        if address <= 42 < address + len(data):
            self.goals.write(f"{time.monotonic():.4f},{servo.id},{servo.get(42)},{servo.table[40]}\n")

    # Asked by tests.

    def do_truth(self) -> Truth:
        return self.sim.world.truth()

    def do_cameras(self) -> Mapping[str, Any]:
        return self.sim.world.camera_specs()

    def do_capture(self, camera: str, window: PictureWindow | None) -> RgbdFrame | Exception:
        try:
            return self.sim.world.capture(camera, window)
        except Exception as error:
            return error

    def do_joints(self) -> dict[int, tuple[float, float]]:
        """Joint value and speed by servo, true."""
        world = self.sim.world
        dofs = {
            servo.id: world.model.jnt_dofadr[world.model.actuator_trnid[servo.actuator, 0]]
            for servo in self.servos.values()
        }
        return {
            servo.id: (self.sim.q(servo.qpos), float(self.sim.data.qvel[dofs[servo.id]]))
            for servo in self.servos.values()
        }

    def do_speeds(self, since: float) -> list[tuple[float, float]]:
        """(seconds, largest speed of a joint) since a moment of the monotonic clock."""
        late = itertools.takewhile(lambda each: each[0] >= since, reversed(self.speeds))
        return [*late][::-1]

    def do_hold(self, joints: dict[int, float] | None) -> None:
        """Hold joints by hand, servo's addresses to joint values, or let go."""
        self.held = None if joints is None else {self.servos[id].qpos: value for id, value in joints.items()}

    def do_inject(self, fault: str, id: int = 0, value: int = 0) -> float:
        """Spoil something, and return when."""
        servo = self.servos.get(id)
        if fault == "cable":
            self.unplug() if value else self.plug()
        elif fault in ("silent", "frozen"):
            setattr(servo, fault, bool(value))
        elif fault == "slip":
            servo.zero += value
        else:
            servo.table[{"celsius": 63, "volts": 62, "id": 5}[fault]] = value
        return time.monotonic()


def _reply(servo: Servo, data: bytes | bytearray) -> bytes:
    body = bytes((servo.id, len(data) + 2, servo.error)) + data
    return b"\xff\xff" + body + bytes((~sum(body) & 0xFF,))


class _Sim:
    """The simulation with quick ways to its numbers."""

    @classmethod
    def of(cls, world: Any) -> _Sim:
        made = cls()
        made.world, made.model, made.data = world, world.model, world._live
        made.dofs = world.robot.dof_indices
        # Servos do not know how heavy the arm is.
        made.model.body_gravcomp[list(world.robot.bodies)] = 0.0
        return made

    def q(self, qpos: int) -> float:
        return float(self.data.qpos[qpos])

    def force(self, actuator: int) -> float:
        return float(self.data.actuator_force[actuator])

    def hold(self, joints: dict[int, float]) -> None:
        self.data.qpos[[*joints]] = [*joints.values()]
        self.data.qvel[self.dofs] = 0.0

    def speed(self) -> float:
        return float(np.abs(self.data.qvel[self.dofs]).max())


class Plant:
    """The other end of the socket: truth, pictures and faults of an emulated bus."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._client = Client(str(folder / "control"))

    def __getattr__(self, name: str) -> Any:
        def ask(*arguments: Any) -> Any:
            self._client.send((name, arguments))
            answer = self._client.recv()
            if isinstance(answer, Exception):
                raise answer
            return answer

        return ask

    def goals(self) -> np.ndarray:
        """Rows of seconds, servo, counts, torque: every goal that reached a servo."""
        return np.loadtxt(self.folder / "goals.csv", delimiter=",", ndmin=2)


class PlantCameras(BareSenses):
    """Cameras of the plant, for the option `cameras=support.servo_bus:PlantCameras`; joints are those that the driver reads."""

    def __init__(self, driver: Any) -> None:
        super().__init__(driver)
        self._plant = Plant(Path(driver.port).parent)
        self.cameras = self._plant.cameras()

    def capture(self, camera: str, window: PictureWindow | None = None) -> RgbdFrame:
        arms = self.driver.posture()
        return replace(self._plant.capture(camera, window), time=self.driver.time, arms=arms)


@contextlib.contextmanager
def emulated(folder: Path, *arguments: str) -> Iterator[Plant]:
    """Run an emulated bus in a folder."""
    with subprocess.Popen([sys.executable, __file__, str(folder), *arguments]) as process:
        try:
            while not (folder / "ready").exists():
                if process.poll() is not None:
                    raise RuntimeError(f"the emulated bus ended with {process.returncode}")
                time.sleep(0.05)
            yield Plant(folder)
        finally:
            process.kill()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--task", default="pick_cube_franka")
    parser.add_argument("--robot")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--backlash", type=float, default=0.0)
    parser.add_argument("--limp", action="store_true", help="begin without torque; else at home, held")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    plant = PlantProcess(**vars(options))
    (options.folder / "ready").touch()
    plant.run()


if __name__ == "__main__":
    main()
