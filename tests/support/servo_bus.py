"""A bus of STS3215 or XL330 servos on a pseudo-terminal with MuJoCo behind it, in a process of its own.

    PYTHONPATH=tests python -m support.servo_bus FOLDER [--servos sts|x] [--task TASK] [--robot MODEL] [--seed N] [--backlash RAD] [--limp]

FOLDER gets `bus` (the port), `calibration.json` (LeRobot's form), `goals.csv` (each goal that reached a servo: seconds, servo,
counts, and whether its torque was on) and `control` (a socket that tests speak over, see `Plant`). Its servos are those of the
robot's model: position control with a stiffness and a largest torque, friction and damping; they sag under gravity as real ones, and go
no faster than they do without a load.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import termios
import time
import tty
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from support import hidden_plant

from robosandbox.driver import HAND
from robosandbox.drivers.feetech.calibration import ServoCalibration, write_calibration

TURN, MIDDLE = 4096, 2047
COUNT = 2.0 * np.pi / TURN
# Seconds of a tick of the servos' control.
_TICK = 0.002
# Ticks that are made up for at once where the process was late.
_MAKE_UP = 4
# Share of the torque above which a servo is overloaded, and for how many seconds (registers 36 and 35 as delivered).
_OVERLOAD, _OVERLOAD_SECONDS = 0.8, 2.0


class Family(ABC):
    """One family of servos: where its numbers lie, and its frames; by the makers' tables, not by the driver's."""

    where: ClassVar[Mapping[str, tuple[int, int]]]
    # Speeds of the bus by what stands for them in the table, some of those that there are.
    speeds: ClassVar[Mapping[int, int]]
    first: ClassVar[Mapping[str, int]]
    counts_of_limit: int
    # No-load speed, counts/s.
    quickest: float
    # Sign of the homing offset in what a servo tells; address below which lies what is kept without power.
    offset_sign: int
    kept: int

    @abstractmethod
    def encode(self, name: str, value: int) -> bytes: ...

    @abstractmethod
    def decode(self, name: str, data: bytes) -> int: ...

    @abstractmethod
    def frames(self, received: bytearray) -> Iterator[tuple[int, int, bytes]]:
        """Take the whole requests off what was received: id, instruction, parameters."""
        ...

    @abstractmethod
    def span(self, parameters: bytes) -> tuple[int, int, bytes]:
        """Return address, the number after it, and the rest."""
        ...

    @abstractmethod
    def target(self, parameters: bytes) -> tuple[int, bytes]:
        """Return the address of a write, and its data."""
        ...

    @abstractmethod
    def reply(self, id: int, error: int, data: bytes) -> bytes: ...

    @abstractmethod
    def is_locked(self, servo: Servo) -> bool:
        """Tell whether what is kept without power cannot be written."""
        ...

    @abstractmethod
    def switched_on(self, servo: Servo) -> None:
        """Do what a servo does by itself when its torque is put on."""


class Sts(Family):
    """Feetech's STS3215."""

    where: ClassVar = {
        "model": (3, 2), "id": (5, 1), "baud": (6, 1), "min": (9, 2), "max": (11, 2), "max_celsius": (13, 1), "offset": (31, 2), "torque": (40, 1),
        "goal": (42, 2), "limit": (48, 2), "lock": (55, 1), "position": (56, 2), "load": (60, 2), "volts": (62, 1),
        "celsius": (63, 1),
    }  # fmt: skip
    signs: ClassVar = {"offset": 11, "load": 10}
    speeds: ClassVar = {0: termios.B1000000, 1: termios.B500000, 4: termios.B115200, 6: termios.B57600}
    first: ClassVar = {"model": 777, "max": TURN - 1, "limit": 1000, "max_celsius": 70, "lock": 1}
    counts_of_limit = 1000
    quickest = 3990.0
    offset_sign = -1
    kept = 40

    def encode(self, name: str, value: int) -> bytes:
        if name in self.signs:
            value = abs(value) | (value < 0) << self.signs[name]
        return value.to_bytes(self.where[name][1], "little")

    def decode(self, name: str, data: bytes) -> int:
        value, sign = int.from_bytes(data, "little"), self.signs.get(name)
        return -(value & (1 << sign) - 1) if sign is not None and value >> sign & 1 else value

    def frames(self, received: bytearray) -> Iterator[tuple[int, int, bytes]]:
        while (begin := received.find(b"\xff\xff")) >= 0:
            del received[:begin]
            if len(received) < 4 or len(received) < 4 + received[3]:
                return
            frame = bytes(received[: 4 + received[3]])
            if ~sum(frame[2:-1]) & 0xFF == frame[-1]:
                del received[: len(frame)]
                yield frame[2], frame[4], frame[5:-1]
            else:
                del received[:1]

    def span(self, parameters: bytes) -> tuple[int, int, bytes]:
        return parameters[0], parameters[1], parameters[2:]

    def target(self, parameters: bytes) -> tuple[int, bytes]:
        return parameters[0], parameters[1:]

    def reply(self, id: int, error: int, data: bytes) -> bytes:
        body = bytes((id, len(data) + 2, error)) + data
        return b"\xff\xff" + body + bytes((~sum(body) & 0xFF,))

    def is_locked(self, servo: Servo) -> bool:
        return servo.get("lock") == 1

    def switched_on(self, servo: Servo) -> None:
        """Hold on to the goal that it has."""


class X(Family):
    """Dynamixel's XL330-M288."""

    where: ClassVar = {
        "model": (0, 2), "id": (7, 1), "baud": (8, 1), "mode": (11, 1), "offset": (20, 4), "max_celsius": (31, 1), "most_current": (38, 2),
        "max": (48, 4), "min": (52, 4), "torque": (64, 1), "hardware_error": (70, 1), "limit": (100, 2), "goal": (116, 4),
        "load": (126, 2), "position": (132, 4), "volts": (144, 2), "celsius": (146, 1),
    }  # fmt: skip
    speeds: ClassVar = {1: termios.B57600, 2: termios.B115200, 3: termios.B1000000}
    first: ClassVar = {
        "model": 1200,
        "baud": 3,
        "mode": 3,
        "max": TURN - 1,
        "limit": 885,
        "max_celsius": 70,
        "most_current": 1000,
    }
    counts_of_limit = 885
    quickest = 8400.0
    offset_sign = 1
    kept = 64
    _ping, _status = 1, 0x55

    def encode(self, name: str, value: int) -> bytes:
        return value.to_bytes(self.where[name][1], "little", signed=True)

    def decode(self, name: str, data: bytes) -> int:
        return int.from_bytes(data, "little", signed=True)

    def frames(self, received: bytearray) -> Iterator[tuple[int, int, bytes]]:
        while (begin := received.find(b"\xff\xff\xfd\x00")) >= 0:
            del received[:begin]
            if len(received) < 7 or len(received) < 7 + int.from_bytes(received[5:7], "little"):
                return
            frame = bytes(received[: 7 + int.from_bytes(received[5:7], "little")])
            if self.crc(frame[:-2]) == int.from_bytes(frame[-2:], "little"):
                del received[: len(frame)]
                yield frame[4], frame[7], frame[8:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
            else:
                del received[:1]

    @staticmethod
    def crc(data: bytes) -> int:
        left = 0
        for byte in data:
            for bit in range(7, -1, -1):
                left = (left << 1 ^ (0x8005 if (left >> 15 ^ byte >> bit) & 1 else 0)) & 0xFFFF
        return left

    def span(self, parameters: bytes) -> tuple[int, int, bytes]:
        return int.from_bytes(parameters[:2], "little"), int.from_bytes(parameters[2:4], "little"), parameters[4:]

    def target(self, parameters: bytes) -> tuple[int, bytes]:
        return int.from_bytes(parameters[:2], "little"), parameters[2:]

    def reply(self, id: int, error: int, data: bytes) -> bytes:
        body = bytes((self._status, 0x80 if error else 0)) + data.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
        frame = b"\xff\xff\xfd\x00" + bytes((id,)) + (len(body) + 2).to_bytes(2, "little") + body
        return frame + self.crc(frame).to_bytes(2, "little")

    def is_locked(self, servo: Servo) -> bool:
        return servo.get("torque") == 1

    def switched_on(self, servo: Servo) -> None:
        servo.put("goal", servo.get("position"))
        servo.put("limit", self.first["limit"])


FAMILIES: Mapping[str, type[Family]] = {"sts": Sts, "x": X}


class Servo:
    """One servo: its control table, and the joint that it turns."""

    def __init__(self, plant: PlantProcess, id: int, actuator: int, qpos: int, middle: float, offset: int) -> None:
        self.plant, self.actuator, self.qpos = plant, actuator, qpos
        self.family = plant.family
        model = plant.sim.model
        self.gain, self.bias = model.actuator_gainprm[actuator, 0], model.actuator_biasprm[actuator].copy()
        self.torque = float(model.actuator_forcerange[actuator, 1])
        dof = model.jnt_dofadr[model.actuator_trnid[actuator, 0]]
        # At its no-load speed a motor's own voltage leaves it no torque, so that what slips from a jaw does not let it snap shut.
        model.dof_damping[dof] = max(model.dof_damping[dof], self.torque / (self.family.quickest * COUNT))
        # Where its horn was put on: what the encoder reads at the joint's 0.
        self.zero = MIDDLE - self.family.offset_sign * offset - middle / COUNT
        self.table = bytearray(256)
        self.silent = self.frozen = self.deaf = False
        # Where its control is on the way to the goal, counts: no servo goes faster than it can.
        self.sent: float | None = None
        self.loaded_since = 0.0
        for name, value in {**self.family.first, "id": id, "offset": offset, "volts": 74, "celsius": 30}.items():
            self.put(name, value)
        self.sense()

    def put(self, name: str, value: int) -> None:
        address, size = self.family.where[name]
        self.table[address : address + size] = self.family.encode(name, value)

    def get(self, name: str) -> int:
        address, size = self.family.where[name]
        return self.family.decode(name, bytes(self.table[address : address + size]))

    @property
    def id(self) -> int:
        return self.get("id")

    @property
    def error(self) -> int:
        """Its errors: of voltage, heat and load."""
        hot = self.get("celsius") >= self.get("max_celsius")
        loaded = self.loaded_since > 0.0 and self.plant.time - self.loaded_since > _OVERLOAD_SECONDS
        return (not 40 <= self.get("volts") <= 80) | hot << 2 | loaded << 5

    @property
    def counts(self) -> int:
        """Its position now."""
        turned = self.zero + self.plant.sim.q(self.qpos) / COUNT
        return (round(turned) + self.family.offset_sign * self.get("offset")) % TURN

    def act(self) -> None:
        """Drive the joint for a tick."""
        model, error = self.plant.sim.model, self.error
        on = self.get("torque") == 1 and not error & 1 << 2
        most = self.family.counts_of_limit
        limit = self.torque * min(self.get("limit"), most) / most * (0.2 if error & 1 << 5 else 1.0)
        model.actuator_forcerange[self.actuator] = -limit, limit
        model.actuator_gainprm[self.actuator, 0] = self.gain if on else 0.0
        model.actuator_biasprm[self.actuator, :3] = self.bias[:3] if on else 0.0
        if not on:
            self.sent = None
        elif not self.frozen:
            counts, step = self.counts, self.family.quickest * _TICK
            goal = min(max(self.get("goal"), self.get("min")), self.get("max"))
            self.sent = counts if self.sent is None else self.sent + min(max(goal - self.sent, -step), step)
            off = (self.sent - counts) * COUNT
            # Within its gear's play a servo moves nothing.
            if abs(off) > self.plant.backlash:
                self.plant.controls[self.actuator] = self.plant.sim.q(self.qpos) + off

    def sense(self) -> None:
        """Put what it senses into its table."""
        if self.frozen:
            return
        share = self.plant.sim.force(self.actuator) / self.torque
        self.put("position", self.counts)
        self.put("load", round(1000 * min(max(share, -1.0), 1.0)))
        if "hardware_error" in self.family.where:
            self.put("hardware_error", self.error)
        if abs(share) < _OVERLOAD or not self.get("torque"):
            self.loaded_since = 0.0
        elif not self.loaded_since:
            self.loaded_since = self.plant.time


class PlantProcess(hidden_plant.PlantServer):
    """The plant, its bus and the socket of tests, in one loop."""

    def __init__(
        self, folder: Path, task: str, robot: str | None, seed: int, backlash: float, limp: bool, servos: str
    ) -> None:
        self.family = FAMILIES[servos]()
        super().__init__(hidden_plant.PlantSim.of(task, robot, seed, _TICK), str(folder / "control"))
        self.folder, self.backlash = folder, backlash
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
            servo.put("goal", servo.get("position"))
            servo.put("torque", not limp)
        self.goals = (folder / "goals.csv").open("w", buffering=1)
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
        while True:
            ready = self.ready(_TICK, *([] if self.slave is None else [self.master]))
            self.catch_up()
            if self.slave is not None and self.master in ready:
                ready.remove(self.master)
                with contextlib.suppress(OSError):
                    self.received += os.read(self.master, 4096)
                    self.obey_all()
            self.answer(ready)

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
            self.watch()

    # The bus.

    def obey_all(self) -> None:
        """Answer every whole request that was received."""
        for id, instruction, parameters in self.family.frames(self.received):
            self.obey(id, instruction, parameters)

    def obey(self, id: int, instruction: int, parameters: bytes) -> None:
        family, speed = self.family, termios.tcgetattr(self.slave)[5]
        listening = {
            one.id: one
            for one in self.servos.values()
            if not one.silent and family.speeds.get(one.get("baud")) == speed
        }
        if instruction == 0x82:
            address, size, ids = family.span(parameters)
            asked = [listening[each] for each in ids if each in listening]
            os.write(self.master, b"".join(self.reply(one, one.table[address : address + size]) for one in asked))
        elif instruction == 0x83:
            address, size, rows = family.span(parameters)
            for at in range(0, len(rows), size + 1):
                if rows[at] in listening:
                    self.write(listening[rows[at]], address, rows[at + 1 : at + 1 + size])
        elif id in listening:
            servo, data = listening[id], bytearray()
            if instruction == 2:
                address, size, _ = family.span(parameters)
                data = servo.table[address : address + size]
            elif instruction == 3:
                self.write(servo, *family.target(parameters))
            elif instruction == 1 and isinstance(family, X):
                data = servo.table[:2] + b"\x2e"
            os.write(self.master, self.reply(servo, data))

    def reply(self, servo: Servo, data: bytearray) -> bytes:
        return self.family.reply(servo.id, servo.error, bytes(data))

    def write(self, servo: Servo, address: int, data: bytes) -> None:
        if address < self.family.kept and (servo.deaf or self.family.is_locked(servo)):
            return
        was_on = servo.get("torque")
        servo.table[address : address + len(data)] = data
        if servo.get("torque") > was_on:
            self.family.switched_on(servo)
        if address <= self.family.where["goal"][0] < address + len(data):
            self.goals.write(f"{time.monotonic():.4f},{servo.id},{servo.get('goal')},{servo.get('torque')}\n")

    # Asked by tests.

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

    def do_hold(self, joints: dict[int, float] | None) -> None:
        """Hold joints by hand, servo's addresses to joint values, or let go."""
        self.held = None if joints is None else {self.servos[id].qpos: value for id, value in joints.items()}

    def do_inject(self, fault: str, id: int = 0, value: int = 0) -> float:
        """Spoil something, and return when."""
        servo = self.servos.get(id)
        if fault == "cable":
            self.unplug() if value else self.plug()
        elif fault == "power":
            for each in self.servos.values():
                each.silent = not value
                each.put("torque", 0)
        elif fault == "held":
            # Somebody holds the arm as it stands.
            self.do_hold({each.id: self.sim.q(each.qpos) for each in self.servos.values()} if value else None)
        elif fault == "blind":
            self.blind = bool(value)
        elif fault == "pushed":
            # Somebody pushes the cameras aside, by so many millimetres along the table's edge.
            self.do_push((0.0, value / 1000.0, 0.0))
        elif fault in ("silent", "frozen", "deaf"):
            setattr(servo, fault, bool(value))
        elif fault == "slip":
            servo.zero += value
        else:
            servo.put(fault, value)
        return time.monotonic()


# What a servo's control does to and fro by one count of its encoder, rad/s.
STANDING = 0.05


class Plant(hidden_plant.Plant):
    """A test's end of the socket, and the log of the bus."""

    def __init__(self, folder: Path) -> None:
        super().__init__(str(folder / "control"))
        self.folder = folder

    def goals(self) -> np.ndarray:
        """Rows of seconds, servo, counts, torque: every goal that reached a servo."""
        return np.loadtxt(self.folder / "goals.csv", delimiter=",", ndmin=2)

    def at_rest(self) -> dict[int, tuple[float, float]]:
        """Wait until the arm has stood for half a second; return its joints."""
        end = time.monotonic() + 10.0
        time.sleep(0.5)
        while time.monotonic() < end:
            time.sleep(0.1)
            if max(speed for _, speed in self.speeds(time.monotonic() - 0.5)) < STANDING:
                return self.joints()
        raise AssertionError("the arm does not come to rest")


class PlantCameras(hidden_plant.PlantCameras):
    """Cameras of the plant, for the option `cameras=support.servo_bus:PlantCameras`."""

    def __init__(self, driver: Any) -> None:
        super().__init__(driver, Plant(Path(driver.port).parent))


@contextlib.contextmanager
def emulated(folder: Path, *arguments: str) -> Iterator[Plant]:
    """Run an emulated bus in a folder."""
    with hidden_plant.running("support.servo_bus", folder, *arguments):
        yield Plant(folder)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--servos", choices=(*FAMILIES,), default="sts")
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
