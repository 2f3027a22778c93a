"""Control tables of serial bus servos, as data, and what a servo tells of itself in one reading."""

from __future__ import annotations

from collections.abc import Mapping

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


@frozen(kw_only=True)
class ServoTable:
    """Control table of a family of servos.

    Attributes:
        models: Names by model number.
        counts: Encoder counts of a turn.
        no_load_speed: Counts/s of the quickest of the family at its highest voltage.
        errors: What each bit of a reply's error byte says, "the servo ...".
        state: The first of the registers that are read at every tick, in one block with the others.
    """

    models: Mapping[int, str]
    counts: int
    no_load_speed: float
    errors: Mapping[int, str]
    model: Register
    id: Register
    max_temperature: Register
    offset: Register
    mode: Register
    torque: Register
    goal: Register
    torque_limit: Register
    lock: Register
    position: Register
    load: Register
    voltage: Register
    temperature: Register

    @property
    def state(self) -> Register:
        """The block from the position to the temperature."""
        return Register(self.position.address, self.temperature.address + self.temperature.size - self.position.address)


STS = ServoTable(
    models={777: "STS3215"},
    counts=4096,
    # 0.222 s for 60 degrees at 7.4 V, 0.171 s at 12 V (data sheets): 4000 counts/s.
    no_load_speed=4000.0,
    errors={
        0: "has too much or too little voltage",
        1: "has a faulty encoder",
        2: "is too hot",
        3: "takes too much current",
        5: "is overloaded",
    },
    model=Register(3, 2),
    id=Register(5),
    max_temperature=Register(13),
    offset=Register(31, 2, sign=11),
    mode=Register(33),
    torque=Register(40),
    goal=Register(42, 2, sign=15),
    torque_limit=Register(48, 2),
    lock=Register(55),
    position=Register(56, 2, sign=15),
    load=Register(60, 2, sign=10),
    voltage=Register(62),
    temperature=Register(63),
)


@frozen(kw_only=True)
class Reading:
    """What a servo tells at one moment.

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
    def of(cls, reply: Reply, table: ServoTable, time: float) -> Reading:
        """Return what a reply with the block `table.state` says."""

        def number(register: Register) -> int:
            return register.decode(reply.data[register.address - table.position.address :])

        return cls(
            time=time,
            counts=number(table.position),
            load=number(table.load) / 1000.0,
            volts=number(table.voltage) / 10.0,
            celsius=number(table.temperature),
            errors=tuple(said for bit, said in table.errors.items() if reply.error >> bit & 1),
        )
