"""Set-up of an arm of serial bus servos, without a question on stdin.

    python -m robosandbox.drivers.feetech scan    --port /dev/ttyACM0
    python -m robosandbox.drivers.feetech id      --port /dev/ttyACM0 --to 3
    python -m robosandbox.drivers.feetech release --port /dev/ttyACM0
    python -m robosandbox.drivers.feetech middle  --port /dev/ttyACM0
    python -m robosandbox.drivers.feetech range   --port /dev/ttyACM0 --out my_arm.json --seconds 30

`scan` lists the servos that answer. `id` gives the only servo on the bus another id. `release` takes the torque off: hold the arm,
it falls. `middle` makes where each joint stands now the middle of its encoder. `range` watches while somebody moves every joint to
both of its ends, and writes the calibration. `--servos dynamixel` is for Dynamixel's X servos. Ends with 0, or with 2 and a line
that says what is wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

from robosandbox.drivers.feetech.bus import Bus, BusError
from robosandbox.drivers.feetech.calibration import ServoCalibration, write_calibration
from robosandbox.drivers.feetech.servos import STS, X_SERIES, ServoFamily

_FAMILIES: Mapping[str, ServoFamily] = {"feetech": STS, "dynamixel": X_SERIES}
_SO_JOINTS = "shoulder_pan,shoulder_lift,elbow_flex,wrist_flex,wrist_roll,gripper"
# Ids that are looked at: arms have fewer joints, and each id that does not answer takes 0.1 s.
_MOST_ID = 30
# Seconds after which a servo tells its position by an offset that was written.
_SENSED = 0.05
# A joint that went less far than this while its range was recorded was forgotten, counts: 9 degrees.
_LEAST_RANGE = 100


def main(arguments: list[str] | None = None) -> int:
    """Run a command; return what it ends with."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=("scan", "id", "release", "middle", "range"))
    parser.add_argument("--port", required=True)
    parser.add_argument("--servos", choices=(*_FAMILIES,), default="feetech", help="whose servos they are")
    parser.add_argument("--baud", type=int, default=1_000_000)
    parser.add_argument("--to", type=int, help="of id: the id that the servo is to have, 1..252")
    parser.add_argument("--joints", default=_SO_JOINTS, help="of middle and range: names by id, from 1")
    parser.add_argument("--seconds", type=float, default=30.0, help="of range: how long to watch")
    parser.add_argument("--out", type=Path, help="of range: the file to write")
    given = parser.parse_args(arguments)
    try:
        with closing(Bus(given.port, given.baud, _FAMILIES[given.servos])) as bus:
            _run(bus, given)
    except BusError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _run(bus: Bus, given: argparse.Namespace) -> None:
    """Run a command; raises BusError where it cannot be."""
    names = dict(enumerate(given.joints.split(","), 1))
    looked_at = range(1, _MOST_ID + 1) if given.command in ("scan", "id") else names
    found = [servo for servo in looked_at if bus.ping(servo)]
    if given.command == "scan":
        _scan(bus, found)
        return
    if given.command == "id":
        _set_id(bus, found, given.to)
        return
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


def _scan(bus: Bus, found: list[int]) -> None:
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
    print(f"{len(found)} servos answer")


def _set_id(bus: Bus, found: list[int], wanted: int | None) -> None:
    if wanted is None or not 1 <= wanted <= 252:
        raise BusError("id: give --to, 1 to 252")
    if len(found) != 1:
        raise BusError(
            f"id: {len(found)} servos answer ({found}); connect the one alone that is to have the id {wanted}"
        )
    family = bus.family
    if family.lock is not None:
        bus.write(found[0], family.lock, 0)
    bus.write_all(family.id, {found[0]: wanted})
    if family.lock is not None:
        bus.write(wanted, family.lock, 1)
    print(f"servo {found[0]} has the id {wanted} now")


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


def _range(bus: Bus, names: dict[int, str], seconds: float, out: Path | None) -> None:
    family = bus.family
    if out is None:
        raise BusError("range: give --out, the file to write")
    seen: dict[int, tuple[int, int]] = {}
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for servo, reply in bus.read_all([*names], family.position).items():
            counts = family.position.decode(reply.data)
            low, high = seen.get(servo, (counts, counts))
            seen[servo] = min(low, counts), max(high, counts)
        time.sleep(0.01)
    ways = {servo: high - low for servo, (low, high) in seen.items()}
    short = [name for servo, name in names.items() if ways.get(servo, 0) < _LEAST_RANGE]
    if short:
        raise BusError(
            f"range: {', '.join(short)} hardly moved; nothing is written: move every joint to both of its ends"
        )
    for servo, name in names.items():
        # A servo that counts beyond a turn has no limits there.
        bus.keep(servo, family.min_limit, max(seen[servo][0], 0))
        bus.keep(servo, family.max_limit, min(seen[servo][1], family.counts - 1))
        print(f"{name}: {seen[servo][0]}..{seen[servo][1]}")
    write_calibration(
        out,
        {
            name: ServoCalibration(
                id=servo,
                homing_offset=bus.read(servo, family.offset),
                range_min=seen[servo][0],
                range_max=seen[servo][1],
            )
            for servo, name in names.items()
        },
    )
    print(f"written: {out}")


if __name__ == "__main__":
    sys.exit(main())
