"""Frames of Feetech's serial bus servos (SCS, STS, SMS): requests, replies and their checksums."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from robosandbox.values import frozen

_HEADER = b"\xff\xff"
_BROADCAST = 0xFE
_PING, _READ, _WRITE, _SYNC_READ, _SYNC_WRITE = 1, 2, 3, 0x82, 0x83
# Bytes of a frame besides its parameters: header (2), id, length, instruction or error, checksum.
_FRAME = 6


@frozen
class Reply:
    """Reply of a servo.

    Attributes:
        servo: Its id.
        error: Bits of its error byte; 0 where nothing is the matter.
        data: What was asked for.
    """

    servo: int
    error: int
    data: bytes


class FeetechCodec:
    """Frames of Feetech's protocol: FF FF, id, length, instruction or error, parameters, inverted sum.

    A bus speaks to its servos by these methods alone; addresses and data are those of the control table.
    """

    def ping(self, servo: int) -> bytes:
        """Return a request for an empty reply."""
        return _frame(servo, _PING, b"")

    def read(self, servo: int, address: int, size: int) -> bytes:
        """Return a request for `size` bytes of the control table."""
        return _frame(servo, _READ, bytes((address, size)))

    def write(self, servo: int, address: int, data: bytes) -> bytes:
        """Return a request to write bytes, which is replied to."""
        return _frame(servo, _WRITE, bytes((address,)) + data)

    def sync_read(self, servos: Sequence[int], address: int, size: int) -> bytes:
        """Return a request to several servos, each of which replies."""
        return _frame(_BROADCAST, _SYNC_READ, bytes((address, size, *servos)))

    def sync_write(self, address: int, rows: Mapping[int, bytes]) -> bytes:
        """Return a request that writes bytes to each of several servos at once, and that none replies to."""
        size = len(next(iter(rows.values())))
        body = b"".join(bytes((servo,)) + data for servo, data in rows.items())
        return _frame(_BROADCAST, _SYNC_WRITE, bytes((address, size)) + body)

    def take(self, received: bytearray) -> list[Reply]:
        """Return the whole replies at the front of what was received, and remove them and what is none."""
        found: list[Reply] = []
        while (begin := received.find(_HEADER)) >= 0:
            del received[:begin]
            if len(received) < _FRAME:
                break
            servo, length = received[2], received[3]
            # A third FF is the header's second byte; a length below 2 is no frame.
            if servo == 0xFF or length < 2:
                del received[:1]
                continue
            end = 4 + length
            if len(received) < end:
                break
            if received[end - 1] != _checksum(received[2 : end - 1]):
                del received[:1]
                continue
            found.append(Reply(servo, received[4], bytes(received[5 : end - 1])))
            del received[:end]
        return found


def _frame(servo: int, instruction: int, parameters: bytes) -> bytes:
    body = bytes((servo, len(parameters) + 2, instruction)) + parameters
    return _HEADER + body + bytes((_checksum(body),))


def _checksum(body: bytes | bytearray) -> int:
    return ~sum(body) & 0xFF
