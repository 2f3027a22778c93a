"""A serial bus of servos: one request at a time, its replies, time-outs, and a port that goes away."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence

import serial

from robosandbox.drivers.feetech.calibration import ServoJoint
from robosandbox.drivers.feetech.protocol import Reply
from robosandbox.drivers.feetech.servos import Register, ServoFamily
from robosandbox.errors import InputError

# Seconds to wait for the replies to one request: an adapter that collects bytes for 16 ms, as FTDI's do, and the bytes of a
# sync read of a dozen servos at 115200 baud (15 ms).
_REPLY_SECONDS = 0.03
# Seconds after which a port that takes no more bytes is gone.
_WRITE_SECONDS = 0.5
# Seconds of a look at the port while replies are waited for.
_LOOK_SECONDS = 0.005
# How often a request to one servo is sent before it counts as silent: a bit that flips on the wire costs one, a computer that is
# busy with something else some more.
_TRIES = 10
# Likewise where most ids have no servo.
_PINGS = 3


class BusError(Exception):
    """The bus cannot be used: the port is gone, or a servo does not answer."""


class Bus:
    """Servos on a serial port.

    Args:
        port: Device, as /dev/ttyACM0.
        baud: Bits a second.
        family: The servos.

    Raises:
        BusError: The port cannot be opened, or another program has it.
    """

    def __init__(self, port: str, baud: int, family: ServoFamily) -> None:
        self.port, self.baud, self.family = port, baud, family
        self._codec = family.codec
        self._received = bytearray()
        try:
            self._serial = serial.Serial(
                port, baud, timeout=_LOOK_SECONDS, write_timeout=_WRITE_SECONDS, exclusive=True
            )
        except (OSError, ValueError) as error:
            raise BusError(f"{port}: cannot be opened: {error}") from None

    def close(self) -> None:
        """Close the port; the servos stay as they are."""
        self._serial.close()

    def set_baud(self, baud: int) -> None:
        """Go on at another speed; raises BusError where the port has no such speed."""
        try:
            self._serial.baudrate = baud
        except (OSError, ValueError) as error:
            raise BusError(f"{self.port}: cannot be set to {baud} baud: {error}") from None
        self.baud = baud

    def find(self, servos: Iterable[int]) -> list[int]:
        """Return which of some ids answer, each asked once; where one does all are asked as `ping` asks."""
        asked = [*servos]
        if not any(self._ask(self._codec.ping(servo), (servo,)) for servo in asked):
            return []
        return [servo for servo in asked if self.ping(servo)]

    def ping(self, servo: int, *, expected: bool = False) -> bool:
        """Return whether a servo answers; one that is expected to is asked as often as in any other request."""
        return any(self._ask(self._codec.ping(servo), (servo,)) for _ in range(_TRIES if expected else _PINGS))

    def read(self, servo: int, register: Register) -> int:
        """Return a number of a servo; raises BusError where it does not answer."""
        for _ in range(_TRIES):
            reply = self._ask(self._codec.read(servo, register.address, register.size), (servo,)).get(servo)
            if reply is not None and len(reply.data) == register.size:
                return register.decode(reply.data)
        raise BusError(f"servo {servo} on {self.port} does not answer")

    def write(self, servo: int, register: Register, value: int) -> None:
        """Write a number to a servo and wait for its reply; raises BusError where it does not answer."""
        for _ in range(_TRIES):
            if self._ask(self._codec.write(servo, register.address, register.encode(value)), (servo,)):
                return
        raise BusError(f"servo {servo} on {self.port} does not answer")

    def read_all(self, servos: Sequence[int], block: Register) -> Mapping[int, Reply]:
        """Return the reply of each servo that answers to a request for the same bytes of all."""
        request = self._codec.sync_read(servos, block.address, block.size)
        return {servo: reply for servo, reply in self._ask(request, servos).items() if len(reply.data) == block.size}

    def errors(self, servo: int, reply: Reply) -> list[str]:
        """Return what a servo says is the matter, "the servo ..."; it is asked where its reply says only that something is.

        Raises:
            BusError: It does not answer.
        """
        family, bits = self.family, reply.error
        if family.hardware_error is not None:
            bits = self.read(servo, family.hardware_error) if bits & family.alert else 0
        return [said for bit, said in family.errors.items() if bits >> bit & 1]

    def keep(self, servo: int, register: Register, value: int) -> None:
        """Write a number that a servo keeps without power; raises BusError where it does not answer."""
        lock = self.family.lock
        if lock is not None:
            self.write(servo, lock, 0)
        self.write(servo, register, value)
        if lock is not None:
            self.write(servo, lock, 1)

    def write_all(self, register: Register, values: Mapping[int, int]) -> None:
        """Write a number to each of several servos at once; none replies."""
        self._send(self._codec.sync_write(register.address, {id: register.encode(v) for id, v in values.items()}))

    def _ask(self, request: bytes, servos: Sequence[int]) -> dict[int, Reply]:
        """Send a request, and return the replies that come in time."""
        self._received.clear()
        replies: dict[int, Reply] = {}
        try:
            # What came too late; not `reset_input_buffer`, whose error of a port that is gone is of termios alone.
            self._serial.read(self._serial.in_waiting)
            self._send(request)
            end, is_late = time.monotonic() + _REPLY_SECONDS, False
            while len(replies) < len(servos) and not is_late:
                # One more look after the time is up: this computer may have been away with the replies long there.
                is_late = time.monotonic() > end
                self._received += self._serial.read(max(1, self._serial.in_waiting))
                replies |= {reply.servo: reply for reply in self._codec.take(self._received) if reply.servo in servos}
        except OSError as error:
            raise BusError(f"{self.port} is gone: {error}") from None
        return replies

    def _send(self, request: bytes) -> None:
        try:
            self._serial.write(request)
        except OSError as error:
            raise BusError(f"{self.port} is gone: {error}") from None


def check_calibrated(bus: Bus, joints: Sequence[ServoJoint]) -> None:
    """See whether all servos answer, and keep the homing offsets that they were calibrated with.

    Raises:
        InputError: One does not; it says which.
        BusError: The port is gone.
    """
    silent = [joint.said for joint in joints if not bus.ping(joint.id, expected=True)]
    if silent:
        raise InputError(
            f"{bus.port}: {', '.join(silent)} of {len(joints)} servos give no answer: look after power, cables and ids"
        )
    for joint in joints:
        offset, wanted = bus.read(joint.id, bus.family.offset), joint.calibration.homing_offset
        if offset != wanted:
            raise InputError(
                f"{bus.port}: {joint.said} has the homing offset {offset}, and the calibration says {wanted}: it is another "
                "arm's, or the servo was calibrated since; calibrate again"
            )
