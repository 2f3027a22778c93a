"""Set-up of an arm of serial bus servos, without a question on stdin.

    python -m robosandbox.drivers.feetech scan    --port /dev/ttyACM0
    python -m robosandbox.drivers.feetech id      --port /dev/ttyACM0 --to 3
    python -m robosandbox.drivers.feetech baud    --port /dev/ttyACM0 --servos dynamixel --baud 57600 --to 1000000
    python -m robosandbox.drivers.feetech release --port /dev/ttyACM0
    python -m robosandbox.drivers.feetech middle  --port /dev/ttyACM0
    python -m robosandbox.drivers.feetech range   --port /dev/ttyACM0 --out my_arm.json --seconds 30

`scan` lists the servos that answer; where none does it looks for the other family's and at other speeds of the bus. `id` gives the
only servo on the bus another id, and `baud` all of them another speed. `release` takes the torque off: hold the arm, it falls.
`middle` makes where each joint stands now the middle of its encoder. `range` watches while somebody moves every joint to both of
its ends, and writes the calibration. `--servos dynamixel` is for Dynamixel's X servos, which are delivered with 57600 baud. Ends
with 0, or with 2 and a line that says what is wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from robosandbox.drivers.feetech.bus import Bus, BusError
from robosandbox.drivers.feetech.calibration import ServoCalibration, write_calibration
from robosandbox.drivers.feetech.servos import STS, X_SERIES, ServoFamily

_FAMILIES: Mapping[str, ServoFamily] = {"feetech": STS, "dynamixel": X_SERIES}
_SO_JOINTS = "shoulder_pan,shoulder_lift,elbow_flex,wrist_flex,wrist_roll,gripper"
# Speed at which this package's drivers open a bus where they are told nothing else, bits a second.
_BAUD = 1_000_000
# The largest number that is an id of a servo: 253 and up mean all of them, or nothing.
_LARGEST_ID = 252
# Seconds after which a servo tells its position by an offset that was written, and answers by an id or a speed.
_SENSED = 0.05
# A joint that went less far than this while its range was recorded was forgotten, counts: 9 degrees.
_LEAST_RANGE = 100
# Seconds without a reading in which a joint that is led may have gone by half a turn unseen: a hand turns one within a second.
_UNSEEN_SECONDS = 0.5


def main(arguments: list[str] | None = None) -> int:
    """Run a command; return what it ends with."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=("scan", "id", "baud", "release", "middle", "range"))
    parser.add_argument("--port", required=True)
    parser.add_argument("--servos", choices=(*_FAMILIES,), default="feetech", help="whose servos they are")
    parser.add_argument("--baud", type=int, default=_BAUD, help="speed of the bus now, bits a second")
    parser.add_argument("--to", type=int, help="of id and baud: the id, or the speed, that is to be")
    # Arms have fewer joints, and each id that does not answer takes 0.1 s.
    parser.add_argument("--last", type=int, default=30, help="of scan, id and baud: the largest id that there is")
    parser.add_argument("--joints", default=_SO_JOINTS, help="of middle and range: names by id, from 1")
    parser.add_argument("--seconds", type=float, default=30.0, help="of range: how long to watch")
    parser.add_argument("--out", type=Path, help="of range: the file to write")
    given = parser.parse_args(arguments)
    try:
        if not 1 <= given.last <= _LARGEST_ID:
            raise BusError(f"--last is {given.last}; ids are 1 to {_LARGEST_ID}")
        with closing(Bus(given.port, given.baud, _FAMILIES[given.servos])) as bus:
            _run(bus, given)
    except BusError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _run(bus: Bus, given: argparse.Namespace) -> None:
    """Run a command; raises BusError where it cannot be."""
    names = dict(enumerate(given.joints.split(","), 1))
    looks = given.command in ("scan", "id", "baud")
    found = [servo for servo in (range(1, given.last + 1) if looks else names) if bus.ping(servo)]
    if looks and not found:
        _look_elsewhere(bus, given)
    elif given.command == "scan":
        _tell(bus, found)
        print(f"{len(found)} servos answer")
    elif given.command == "id":
        _set_id(bus, found, given.to, given.last)
    elif given.command == "baud":
        _set_baud(bus, found, given.to)
    else:
        missing = [f"{name} (servo {servo})" for servo, name in names.items() if servo not in found]
        if missing:
            raise BusError(f"{given.port}: {', '.join(missing)}: no answer; look after power, cables and ids")
        if given.command == "release":
            bus.write_all(bus.family.torque, dict.fromkeys(names, 0))
            print("released: the arm is limp")
        elif any(bus.read(servo, bus.family.torque) for servo in names):
            raise BusError("the torque is on: hold the arm and call release first")
        elif given.command == "middle":
            _middle(bus, names)
        else:
            _range(bus, names, given.seconds, given.out)


def _tell(bus: Bus, found: Iterable[int]) -> None:
    family = bus.family
    for servo in found:
        number = bus.read(servo, family.model)
        model = family.models.get(number)
        print(
            f"servo {servo}: {f'model {number}' if model is None else model.name}, "
            f"at {bus.read(servo, family.position)} of {family.counts}, "
            f"{bus.read(servo, family.voltage) / 10:.1f} V, {bus.read(servo, family.temperature)} C, "
            f"torque {'on' if bus.read(servo, family.torque) else 'off'}"
        )


def _look_elsewhere(bus: Bus, given: argparse.Namespace) -> None:
    """Look for servos of either family at every speed; `scan` tells what it finds, and any other command ends in a BusError."""
    bus.close()
    ids, tried = range(1, given.last + 1), f"{given.servos} servo at {given.baud} baud"
    # What new servos have comes first.
    ways = [(index, name, baud) for name, each in _FAMILIES.items() for index, baud in enumerate(each.bauds.values())]
    for _, name, baud in sorted(ways):
        if (name, baud) == (given.servos, given.baud):
            continue
        try:
            other = Bus(given.port, baud, _FAMILIES[name])
        except BusError:
            # A port that cannot be as fast.
            continue
        with closing(other):
            found = other.find(ids)
            if not found:
                continue
            options = f"--port {given.port} --servos {name} --baud {baud}"
            said = f"{len(found)} servos answer as {name} at {baud} baud, and no {tried}: give --servos {name} --baud {baud}"
            if baud != _BAUD:
                said += f", or set them: `python -m robosandbox.drivers.feetech baud {options} --to {_BAUD}`"
            if given.command != "scan":
                raise BusError(f"{given.command}: {said}")
            _tell(other, found)
            print(said)
            return
    speeds = "; ".join(f"{name} at {', '.join(map(str, sorted(f.bauds.values())))}" for name, f in _FAMILIES.items())
    raise BusError(
        f"{given.port}: no servo answers with an id of 1 to {given.last}, of none of these: {speeds} baud. Look whether the servos "
        "have power (the supply's, USB gives none), whether the first one is plugged into the board, and whether this is the "
        "board's port; larger ids are looked at with --last"
    )


def _set_id(bus: Bus, found: list[int], wanted: int | None, last: int) -> None:
    if wanted is None or not 1 <= wanted <= last:
        raise BusError(f"id: give --to, 1 to {last}")
    if len(found) != 1:
        raise BusError(
            f"id: {len(found)} servos answer ({found}); connect the one alone that is to have the id {wanted}"
        )
    family, (servo,) = bus.family, found
    _unlock(bus, found)
    bus.write_all(family.id, {servo: wanted})
    time.sleep(_SENSED)
    if not bus.ping(wanted, expected=True):
        raise BusError(
            f"id: no servo answers as {wanted}; servo {servo} did not take it: switch its power off and on, and try again"
        )
    if servo != wanted and bus.ping(servo):
        raise BusError(
            f"id: a servo answers as {wanted}, and one still as {servo}: connect one alone, and look with scan which it is"
        )
    _lock(bus, [wanted])
    print(f"servo {servo} has the id {wanted} now")


def _set_baud(bus: Bus, found: list[int], wanted: int | None) -> None:
    family, before = bus.family, bus.baud
    numbers = {baud: number for number, baud in family.bauds.items()}
    if wanted not in numbers:
        raise BusError(f"baud: give --to, one of {', '.join(map(str, sorted(numbers)))}")
    _unlock(bus, found)
    bus.write_all(family.baud, dict.fromkeys(found, numbers[wanted]))
    time.sleep(_SENSED)
    bus.set_baud(wanted)
    silent = [servo for servo in found if not bus.ping(servo, expected=True)]
    _lock(bus, [servo for servo in found if servo not in silent])
    if silent:
        raise BusError(
            f"baud: servo {', '.join(map(str, silent))} gives no answer at {wanted} baud; look with scan at {before} and {wanted}"
        )
    print(f"{len(found)} servos answer at {wanted} baud now")


def _unlock(bus: Bus, servos: Sequence[int]) -> None:
    """Have servos take what they keep without power."""
    for servo in servos:
        if bus.family.lock is not None:
            bus.write(servo, bus.family.lock, 0)
        elif bus.read(servo, bus.family.torque):
            raise BusError(f"the torque of servo {servo} is on, and it takes nothing so: switch its power off and on")


def _lock(bus: Bus, servos: Sequence[int]) -> None:
    for servo in servos:
        if bus.family.lock is not None:
            bus.write(servo, bus.family.lock, 1)


def _middle(bus: Bus, names: dict[int, str]) -> None:
    family = bus.family
    for servo, name in names.items():
        bus.keep(servo, family.offset, 0)
        bus.keep(servo, family.min_limit, 0)
        bus.keep(servo, family.max_limit, family.counts - 1)
        time.sleep(_SENSED)
        away = family.counts // 2 - 1 - bus.read(servo, family.position)
        offset = min(max(family.offset_sign * away, -family.most_offset), family.most_offset)
        bus.keep(servo, family.offset, offset)
        time.sleep(_SENSED)
        print(f"{name}: reads {bus.read(servo, family.position)} here, with the offset {offset}")


@dataclass(slots=True)
class _Led:
    """Way of a joint that is led by hand, in counts that go on where the encoder begins anew."""

    at: int
    time: float
    low: int
    high: int
    crossed: bool = False

    def go_on(self, counts: int, turn: int, time: float) -> None:
        """Take a reading of an encoder of `turn` counts."""
        self.at += (counts - self.at + turn // 2) % turn - turn // 2
        self.crossed |= self.at != counts
        self.low, self.high, self.time = min(self.low, self.at), max(self.high, self.at), time


def _range(bus: Bus, names: dict[int, str], seconds: float, out: Path | None) -> None:
    if out is None:
        raise BusError("range: give --out, the file to write")
    family = bus.family
    ranges = _ranges(names, _watch(bus, names, seconds), family.counts)
    for servo, name in names.items():
        low, high = ranges[servo]
        # A servo that counts beyond a turn has no limits there.
        bus.keep(servo, family.min_limit, max(low, 0))
        bus.keep(servo, family.max_limit, min(high, family.counts - 1))
        print(f"{name}: {low}..{high}, {(high - low) * 360.0 / family.counts:.0f} degrees")
    write_calibration(
        out,
        {
            name: ServoCalibration(
                id=servo,
                homing_offset=bus.read(servo, family.offset),
                range_min=ranges[servo][0],
                range_max=ranges[servo][1],
            )
            for servo, name in names.items()
        },
    )
    print(f"written: {out}")


def _watch(bus: Bus, names: Mapping[int, str], seconds: float) -> Mapping[int, _Led]:
    """Return how far joints went within some seconds; raises BusError where one could not be followed."""
    family, led = bus.family, dict[int, _Led]()
    end = time.monotonic() + seconds
    while (now := time.monotonic()) < end:
        for servo, reply in bus.read_all([*names], family.position).items():
            counts = family.position.decode(reply.data)
            if servo not in led:
                led[servo] = _Led(counts, now, counts, counts)
            elif now - led[servo].time > _UNSEEN_SECONDS:
                raise BusError(
                    f"range: {names[servo]} did not answer for {now - led[servo].time:.1f} s, and may have been led on meanwhile; "
                    "nothing is written: look after its cable, and begin again"
                )
            else:
                led[servo].go_on(counts, family.counts, now)
        time.sleep(0.01)
    return led


def _ranges(names: Mapping[int, str], led: Mapping[int, _Led], turn: int) -> Mapping[int, tuple[int, int]]:
    """Return the range of each servo, counts; a joint that went all around has a whole turn."""
    short = [
        name for servo, name in names.items() if servo not in led or led[servo].high - led[servo].low < _LEAST_RANGE
    ]
    if short:
        raise BusError(
            f"range: {', '.join(short)} hardly moved; nothing is written: move every joint to both of its ends"
        )
    turns = {servo for servo, way in led.items() if way.high - way.low >= turn}
    over = [name for servo, name in names.items() if led[servo].crossed and servo not in turns]
    if over:
        raise BusError(
            f"range: {', '.join(over)} went over the end of the encoder, where its count begins anew; nothing is written: put every "
            "joint into the middle of its range, call middle, and then range again"
        )
    return {servo: (0, turn - 1) if servo in turns else (led[servo].low, led[servo].high) for servo in names}


if __name__ == "__main__":
    sys.exit(main())
