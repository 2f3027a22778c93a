"""Control tables of serial bus servos, as data, and readings of a servo."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from robosandbox.drivers.feetech.protocol import Reply
from robosandbox.values import frozen


@frozen
class Register:
    """A number in a servo's control table, little endian.

    Attributes:
        address: Of its first byte.
        size: Bytes.
        sign: The bit that makes it negative, for a magnitude with a sign; None for a number without one.
    """

    address: int
    size: int = 1
    sign: int | None = None

    def decode(self, data: bytes) -> int:
        """Return the number in the first bytes of `data`."""
        value = int.from_bytes(data[: self.size], "little")
        if self.sign is None or not value >> self.sign & 1:
            return value
        return -(value & ((1 << self.sign) - 1))

    def encode(self, value: int) -> bytes:
        """Return a number's bytes.

        Raises:
            OverflowError: It does not fit.
        """
        if self.sign is not None:
            if abs(value) >= 1 << self.sign:
                raise OverflowError(f"{value} does not fit into {self.sign} bits and a sign")
            value = abs(value) | (value < 0) << self.sign
        return value.to_bytes(self.size, "little")


class STS:
    """Control table of the STS series; a table of another family has the same names.

    Attributes:
        models: Names by model number.
        counts: Encoder counts of a turn.
        no_load_speed: Counts/s of the quickest of the family at its highest voltage.
        errors: What each bit of a reply's error byte says, "the servo ...".
        state: From the position to the temperature: what is read at every tick.
    """

    models: ClassVar[Mapping[int, str]] = {777: "STS3215"}
    counts = 4096
    # 0.171 s for 60 degrees at 12 V (data sheet).
    no_load_speed = 4000.0
    errors: ClassVar[Mapping[int, str]] = {
        0: "has too much or too little voltage",
        1: "has a faulty encoder",
        2: "is too hot",
        3: "takes too much current",
        5: "is overloaded",
    }
    model = Register(3, 2)
    id = Register(5)
    min_limit, max_limit = Register(9, 2), Register(11, 2)
    max_temperature = Register(13)
    offset = Register(31, 2, 11)
    mode = Register(33)
    torque = Register(40)
    goal = Register(42, 2, 15)
    torque_limit = Register(48, 2)
    lock = Register(55)
    position = Register(56, 2, 15)
    load = Register(60, 2, 10)
    voltage = Register(62)
    temperature = Register(63)
    state = Register(56, 8)


@frozen(kw_only=True)
class Reading:
    """State of a servo at one moment, as it tells it.

    Attributes:
        time: Seconds by the driver's clock.
        counts: Position, encoder counts.
        load: Share of the motor's full drive, -1..1.
        volts: Of its supply.
        celsius: Of its case.
        errors: What its error byte says, in words.
    """

    time: float
    counts: int
    load: float
    volts: float
    celsius: int
    errors: tuple[str, ...]

    @classmethod
    def of(cls, reply: Reply, time: float) -> Reading:
        """Return what a reply with the block `STS.state` says."""

        def number(register: Register) -> int:
            return register.decode(reply.data[register.address - STS.state.address :])

        return cls(
            time=time,
            counts=number(STS.position),
            load=number(STS.load) / 1000.0,
            volts=number(STS.voltage) / 10.0,
            celsius=number(STS.temperature),
            errors=tuple(said for bit, said in STS.errors.items() if reply.error >> bit & 1),
        )
