"""Frames on a bus of serial servos: requests, replies and their checksums, as Feetech's and Dynamixel's have them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from robosandbox.values import frozen

_BROADCAST = 0xFE
# Instructions, the same in both protocols; a reply of the second has one of its own.
_PING, _READ, _WRITE, _SYNC_READ, _SYNC_WRITE, _STATUS = 1, 2, 3, 0x82, 0x83, 0x55
_HEADER = b"\xff\xff"
# Bytes of a frame besides its parameters: header (2), id, length, instruction or error, checksum.
_FRAME = 6
_HEADER_2 = b"\xff\xff\xfd\x00"
# Header (4), id, length (2), instruction, error, checksum (2).
_FRAME_2 = 11
# What within a frame looks like a header gets a byte more on the wire.
_PLAIN, _STUFFED = b"\xff\xff\xfd", b"\xff\xff\xfd\xfd"


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


class Codec(Protocol):
    """Frames of a protocol: a bus speaks to its servos by these alone; addresses and data are those of the control table."""

    def ping(self, servo: int) -> bytes:
        """Return a request that is replied to and does nothing."""
        ...

    def read(self, servo: int, address: int, size: int) -> bytes:
        """Return a request for `size` bytes of the control table."""
        ...

    def write(self, servo: int, address: int, data: bytes) -> bytes:
        """Return a request to write bytes, which is replied to."""
        ...

    def sync_read(self, servos: Sequence[int], address: int, size: int) -> bytes:
        """Return a request to several servos, each of which replies."""
        ...

    def sync_write(self, address: int, rows: Mapping[int, bytes]) -> bytes:
        """Return a request that writes bytes to each of several servos at once, and that none replies to."""
        ...

    def take(self, received: bytearray) -> list[Reply]:
        """Return the whole replies at the front of what was received, and remove them and what is none."""
        ...


class FeetechCodec:
    """Frames of Feetech's servos (SCS, STS, SMS): FF FF, id, length, instruction or error, parameters, inverted sum."""

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
        return _frame(_BROADCAST, _SYNC_WRITE, bytes((address, _size(rows))) + _joined(rows))

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


class DynamixelCodec:
    """Frames of Dynamixel's protocol 2.0: FF FF FD 00, id, length, instruction, (error,) parameters, CRC-16."""

    def ping(self, servo: int) -> bytes:
        """Return a request for a servo's model and firmware."""
        return _frame_2(servo, _PING, b"")

    def read(self, servo: int, address: int, size: int) -> bytes:
        """Return a request for `size` bytes of the control table."""
        return _frame_2(servo, _READ, _words(address, size))

    def write(self, servo: int, address: int, data: bytes) -> bytes:
        """Return a request to write bytes, which is replied to."""
        return _frame_2(servo, _WRITE, _words(address) + data)

    def sync_read(self, servos: Sequence[int], address: int, size: int) -> bytes:
        """Return a request to several servos, each of which replies."""
        return _frame_2(_BROADCAST, _SYNC_READ, _words(address, size) + bytes(servos))

    def sync_write(self, address: int, rows: Mapping[int, bytes]) -> bytes:
        """Return a request that writes bytes to each of several servos at once, and that none replies to."""
        return _frame_2(_BROADCAST, _SYNC_WRITE, _words(address, _size(rows)) + _joined(rows))

    def take(self, received: bytearray) -> list[Reply]:
        """Return the whole replies at the front of what was received, and remove them and what is none."""
        found: list[Reply] = []
        while (begin := received.find(_HEADER_2)) >= 0:
            del received[:begin]
            if len(received) < _FRAME_2:
                break
            end = 7 + int.from_bytes(received[5:7], "little")
            if end < _FRAME_2:
                del received[:1]
                continue
            if len(received) < end:
                break
            frame = bytes(received[:end])
            if frame[-2:] != _words(_crc(frame[:-2])):
                del received[:1]
                continue
            # A request that the adapter echoes is none.
            if frame[7] == _STATUS:
                found.append(Reply(frame[4], frame[8], frame[9:-2].replace(_STUFFED, _PLAIN)))
            del received[:end]
        return found


def _frame(servo: int, instruction: int, parameters: bytes) -> bytes:
    body = bytes((servo, len(parameters) + 2, instruction)) + parameters
    return _HEADER + body + bytes((_checksum(body),))


def _checksum(body: bytes | bytearray) -> int:
    return ~sum(body) & 0xFF


def _frame_2(servo: int, instruction: int, parameters: bytes) -> bytes:
    body = bytes((instruction,)) + parameters.replace(_PLAIN, _STUFFED)
    frame = _HEADER_2 + bytes((servo,)) + _words(len(body) + 2) + body
    return frame + _words(_crc(frame))


def _crc(data: bytes) -> int:
    """Return the CRC-16 of polynomial 8005, from 0, high bit first."""
    crc = 0
    for byte in data:
        crc = crc << 8 & 0xFFFF ^ _CRC_OF_BYTE[crc >> 8 ^ byte]
    return crc


def _crc_of_byte(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1 ^ 0x8005 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


_CRC_OF_BYTE = tuple(_crc_of_byte(byte) for byte in range(256))


def _words(*numbers: int) -> bytes:
    return b"".join(number.to_bytes(2, "little") for number in numbers)


def _size(rows: Mapping[int, bytes]) -> int:
    return len(next(iter(rows.values())))


def _joined(rows: Mapping[int, bytes]) -> bytes:
    return b"".join(bytes((servo,)) + data for servo, data in rows.items())
