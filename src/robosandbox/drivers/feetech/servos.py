"""Families of serial servos as data, what their control tables mean, and readings of a servo."""

from __future__ import annotations

from collections.abc import Mapping

from robosandbox.drivers.feetech.protocol import Codec, DynamixelCodec, FeetechCodec, Reply
from robosandbox.values import frozen


@frozen
class Register:
    """A number in a servo's control table, little endian.

    Attributes:
        address: Of its first byte.
        size: Bytes.
        sign: The bit that makes it negative, for a magnitude with a sign; None for a number without one.
        complement: Whether it is negative as a two's complement.
    """

    address: int
    size: int = 1
    sign: int | None = None
    complement: bool = False

    def decode(self, data: bytes) -> int:
        """Return the number in the first bytes of `data`."""
        value = int.from_bytes(data[: self.size], "little", signed=self.complement)
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
        return value.to_bytes(self.size, "little", signed=self.complement)


@frozen
class Model:
    """A servo that is made.

    Attributes:
        name: As its maker calls it.
        no_load_speed: Turns a minute at its highest voltage, by its data sheet.
        full_load: What it tells as its load when it gives all it can; None where it tells its current, and the most of that.
    """

    name: str
    no_load_speed: float
    full_load: int | None = 1000


@frozen(kw_only=True)
class ServoFamily:
    """Servos with one protocol and one control table.

    Attributes:
        codec: Its frames.
        models: By model number.
        modes: Operating modes in which the goal is a position, by number.
        bauds: Speeds of the bus, bits a second, by the number that stands for each; the first is that of new servos.
        counts: Encoder counts of a turn.
        offset_sign: 1 where the homing offset is added to what the encoder reads, -1 where it is taken off.
        most_offset: The largest homing offset.
        errors: What each bit of its errors says, "the servo ...".
        hardware_error: Where these bits are, for servos whose replies have only one that says that there are some.
        alert: This one.
        lock: 0 while what is kept without power may be written; None where it may while the torque is off.
        torque_limit: Share of its torque that it may give: of `full_torque`.
        load: What `Model.full_load` is of.
        most_current: The most that it may tell as its load, where that is a current.
        state: What is read at every tick: position, load, voltage and temperature lie within it.
    """

    codec: Codec
    models: Mapping[int, Model]
    modes: Mapping[int, str]
    bauds: Mapping[int, int]
    counts: int
    offset_sign: int
    most_offset: int
    errors: Mapping[int, str]
    hardware_error: Register | None = None
    alert: int = 0
    model: Register
    id: Register
    baud: Register
    min_limit: Register
    max_limit: Register
    max_temperature: Register
    offset: Register
    mode: Register
    torque: Register
    goal: Register
    torque_limit: Register
    full_torque: int
    lock: Register | None = None
    position: Register
    load: Register
    most_current: Register | None = None
    voltage: Register
    temperature: Register
    state: Register

    def number(self, register: Register, reply: Reply) -> int:
        """Return a number of a reply with the block `state`."""
        return register.decode(reply.data[register.address - self.state.address :])


STS = ServoFamily(
    codec=FeetechCodec(),
    models={777: Model("STS3215", 58.5)},
    modes={0: "position"},
    bauds={0: 1_000_000, 1: 500_000, 2: 250_000, 3: 128_000, 4: 115_200, 5: 76_800, 6: 57_600, 7: 38_400},
    counts=4096,
    offset_sign=-1,
    most_offset=(1 << 11) - 1,
    errors={
        0: "has too much or too little voltage",
        1: "has a faulty encoder",
        2: "is too hot",
        3: "takes too much current",
        5: "is overloaded",
    },
    model=Register(3, 2),
    id=Register(5),
    baud=Register(6),
    min_limit=Register(9, 2),
    max_limit=Register(11, 2),
    max_temperature=Register(13),
    offset=Register(31, 2, sign=11),
    mode=Register(33),
    torque=Register(40),
    goal=Register(42, 2, sign=15),
    torque_limit=Register(48, 2),
    full_torque=1000,
    lock=Register(55),
    position=Register(56, 2, sign=15),
    load=Register(60, 2, sign=10),
    voltage=Register(62),
    temperature=Register(63),
    state=Register(56, 8),
)
"""Feetech's STS series: registers and error bits by its memory table."""

X_SERIES = ServoFamily(
    codec=DynamixelCodec(),
    models={
        1020: Model("XM430-W350", 57.0, None),
        1030: Model("XM430-W210", 95.0, None),
        1060: Model("XL430-W250", 61.0),
        1120: Model("XM540-W270", 37.0, None),
        1130: Model("XM540-W150", 66.0, None),
        1190: Model("XL330-M077", 456.0, None),
        1200: Model("XL330-M288", 123.0, None),
        1220: Model("XC330-T288", 71.0, None),
        1240: Model("XC330-M288", 97.0, None),
    },
    bauds={1: 57_600, 3: 1_000_000, 2: 115_200, 4: 2_000_000, 5: 3_000_000, 6: 4_000_000, 0: 9_600},
    modes={3: "position", 4: "extended position", 5: "position limited by current"},
    counts=4096,
    offset_sign=1,
    most_offset=1_044_479,
    errors={
        0: "has too much or too little voltage",
        2: "is too hot",
        3: "has a faulty encoder",
        4: "has an electrical fault",
        5: "is overloaded",
    },
    hardware_error=Register(70),
    alert=1 << 7,
    model=Register(0, 2),
    id=Register(7),
    baud=Register(8),
    min_limit=Register(52, 4, complement=True),
    max_limit=Register(48, 4, complement=True),
    max_temperature=Register(31),
    offset=Register(20, 4, complement=True),
    mode=Register(11),
    torque=Register(64),
    goal=Register(116, 4, complement=True),
    # Its goal PWM: what drives the motor at most.
    torque_limit=Register(100, 2, complement=True),
    full_torque=885,
    position=Register(132, 4, complement=True),
    load=Register(126, 2, complement=True),
    most_current=Register(38, 2),
    voltage=Register(144, 2),
    temperature=Register(146),
    state=Register(126, 21),
)
"""Dynamixel's X series by its e-manual: XL, XC and XM, as in Koch, ViperX and WidowX arms."""


@frozen(kw_only=True)
class Reading:
    """State of a servo at one moment, as it tells it.

    Attributes:
        time: Seconds by the driver's clock.
        counts: Position, encoder counts.
        load: Share of the motor's full drive, -1..1.
        volts: Of its supply.
        celsius: Of its case.
    """

    time: float
    counts: int
    load: float
    volts: float
    celsius: int

    @classmethod
    def of(cls, reply: Reply, time: float, family: ServoFamily, full_load: int) -> Reading:
        """Return what a reply with the block `ServoFamily.state` says."""
        return cls(
            time=time,
            counts=family.number(family.position, reply),
            load=family.number(family.load, reply) / full_load,
            volts=family.number(family.voltage, reply) / 10.0,
            celsius=family.number(family.temperature, reply),
        )
