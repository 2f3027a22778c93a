"""Interfaces of ROS 2 without ROS: classes of messages, their type hashes (REP 2011) and their bytes (CDR, as DDSI-RTPS has it)."""

from __future__ import annotations

import hashlib
import json
import re
import struct
from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, cast

_HERE = Path(__file__).parent
# Of an interface's primitives: the letter in `struct`, and the number in a type description.
_PRIMITIVES = {
    "int8": ("b", 2),
    "uint8": ("B", 3),
    "char": ("B", 3),
    "int16": ("h", 4),
    "uint16": ("H", 5),
    "int32": ("i", 6),
    "uint32": ("I", 7),
    "int64": ("q", 8),
    "uint64": ("Q", 9),
    "float32": ("f", 10),
    "float64": ("d", 11),
    "bool": ("?", 15),
    "byte": ("B", 16),
}
_NESTED, _STRING = 1, 17
# What a type's number grows by where there are several of it.
_ARRAY, _BOUNDED, _UNBOUNDED = 48, 96, 144
# Plain CDR, little endian, no options; and big endian, which is read as well.
_HEADER, _HEADER_BYTES = b"\x00\x01\x00\x00", 4
_FIELD = re.compile(
    r"(?P<type>[\w/]+)(?P<many>\[(?P<bound><=)?(?P<count>\d*)\])?\s+(?P<name>\w+)(\s+(?P<default>\S+))?"
)
_CONSTANT = re.compile(r"\w+\s+(\w+)=(-?\d+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """A field of a message.

    Attributes:
        name: Of the field.
        type: A primitive's name, `string`, or the class of a message.
        many: Which kind of sequence it is, as a type description numbers it; 0 where it is a single value.
        count: How many an array has, or a bounded sequence at most.
        default: Of a number.
    """

    name: str
    type: str | type[Message]
    many: int = 0
    count: int = 0
    default: float = 0.0

    def initial(self) -> Any:
        """Return the value that a new message has here."""
        if not self.many:
            return self._one()
        return [self._one() for _ in range(self.count)] if self.many == _ARRAY else []

    def _one(self) -> Any:
        if isinstance(self.type, type):
            return self.type()
        if self.type == "string":
            return ""
        return {"f": float, "d": float, "?": bool}.get(_PRIMITIVES[self.type][0], int)(self.default)


class Message:
    """A message: it has the attributes of its definition, and no others.

    Args:
        values: Of fields; the others have their defaults.

    Raises:
        AttributeError: There is no such field.
    """

    __slots__ = ()
    ros_name: ClassVar[str]
    ros_fields: ClassVar[tuple[Field, ...]]

    def __init__(self, **values: Any) -> None:
        for field in self.ros_fields:
            setattr(self, field.name, values.pop(field.name) if field.name in values else field.initial())
        if values:
            raise AttributeError(f"{self.ros_name} has no field {', '.join(values)}")


@cache
def kind(name: str) -> Any:
    """Return an interface's class, with its constants.

    Args:
        name: As `sensor_msgs/msg/JointState`. A service has `Request` and `Response`; an action has `Goal`, `Result`,
            `Feedback`, and what is sent: `SendGoal`, `GetResult`, `FeedbackMessage`.

    Raises:
        KeyError: Its definition is not here.
    """
    package, group, short = name.split("/")
    parts = [_parsed(part, package) for part in re.split(r"^---$", definitions()[name], flags=re.MULTILINE)]
    if group == "msg":
        return _message(name, *parts[0])
    if group == "srv":
        return _service(name, parts[0], parts[1])
    named = zip(("Goal", "Result", "Feedback"), parts, strict=True)
    goal, result, feedback = (_message(f"{name}_{part}", *read) for part, read in named)
    goal_id = Field(name="goal_id", type=kind("unique_identifier_msgs/msg/UUID"))
    accepted = Field(name="accepted", type="bool"), Field(name="stamp", type=kind("builtin_interfaces/msg/Time"))
    ended = Field(name="status", type="int8"), Field(name="result", type=result)
    made = {
        "Goal": goal,
        "Result": result,
        "Feedback": feedback,
        "SendGoal": _service(f"{name}_SendGoal", ((goal_id, Field(name="goal", type=goal)), {}), (accepted, {})),
        "GetResult": _service(f"{name}_GetResult", ((goal_id,), {}), (ended, {})),
        "FeedbackMessage": _message(f"{name}_FeedbackMessage", (goal_id, Field(name="feedback", type=feedback)), {}),
    }
    return type(short, (), made)


def type_hash(interface: type[Message]) -> str:
    """Return the type hash of a message or a service: `RIHS01_` and 64 hexadecimal digits."""
    nested: dict[str, type[Message]] = {}
    waiting = [interface]
    while waiting:
        for field in waiting.pop().ros_fields:
            if isinstance(field.type, type) and field.type.ros_name not in nested:
                nested[field.type.ros_name] = field.type
                waiting.append(field.type)
    described = {
        "type_description": _described(interface),
        "referenced_type_descriptions": [_described(nested[name]) for name in sorted(nested)],
    }
    return f"RIHS01_{hashlib.sha256(json.dumps(described).encode()).hexdigest()}"


def to_bytes(message: Message) -> bytes:
    """Return a message as CDR, with the header of four bytes.

    Raises:
        ValueError: A value does not fit into its field.
    """
    out = bytearray(_HEADER)
    try:
        _write(out, message)
    except (struct.error, TypeError, AttributeError) as error:
        raise ValueError(f"{message.ros_name}: {error}") from None
    return bytes(out)


def from_bytes(interface: type[Message], data: bytes) -> Any:
    """Return the message that CDR holds.

    Raises:
        ValueError: The bytes hold no such message.
    """
    if len(data) < _HEADER_BYTES or data[0] or data[1] > 1:
        raise ValueError(f"{interface.ros_name}: this is not CDR")
    try:
        return _Reader(data, "><"[data[1]]).message(interface)
    except (struct.error, UnicodeDecodeError) as error:
        raise ValueError(f"{interface.ros_name}: {error}") from None


# Definitions.

_Parsed = tuple[tuple[Field, ...], dict[str, int]]


@cache
def definitions() -> dict[str, str]:
    """Return the definition of each interface that is here, without comments."""
    found = {}
    for part in _plain((_HERE / "interfaces.txt").read_text()).split("== ")[1:]:
        name, _, found_text = part.partition("\n")
        found[name] = found_text
    for path in _HERE.glob("robosandbox_msgs/*/*.*"):
        found[f"{path.parts[-3]}/{path.parent.name}/{path.stem}"] = _plain(path.read_text())
    return found


def _plain(text: str) -> str:
    return re.sub(r"[ \t]*(#.*)?$", "", text, flags=re.MULTILINE)


def _parsed(text: str, package: str) -> _Parsed:
    """Return the fields and the constants of a definition."""
    fields, constants = [], dict[str, int]()
    for line in filter(None, text.split("\n")):
        if constant := _CONSTANT.fullmatch(line):
            constants[constant[1]] = int(constant[2])
            continue
        found = _FIELD.fullmatch(line)
        assert found is not None, line
        made: str | type[Message] = found["type"]
        if made not in _PRIMITIVES and made != "string":
            home, _, short = found["type"].rpartition("/")
            made = cast(type[Message], kind(f"{home or package}/msg/{short}"))
        several = _BOUNDED if found["bound"] else _ARRAY if found["count"] else _UNBOUNDED
        fields.append(
            Field(
                name=found["name"],
                type=made,
                many=several if found["many"] else 0,
                count=int(found["count"] or 0),
                default=float(found["default"] or 0.0),
            )
        )
    return tuple(fields), constants


def _message(name: str, fields: tuple[Field, ...], constants: dict[str, int]) -> type[Message]:
    # The generators of ROS give a message without fields one.
    fields = fields or (Field(name="structure_needs_at_least_one_member", type="uint8"),)
    body = {"__slots__": tuple(field.name for field in fields), "ros_name": name, "ros_fields": fields, **constants}
    return type(name.rpartition("/")[2], (Message,), body)


def _service(name: str, request: _Parsed, response: _Parsed) -> type[Message]:
    """Return a service: to its type hash, it is a message of its request, its response and its event."""
    asked, given = _message(f"{name}_Request", *request), _message(f"{name}_Response", *response)
    told = (
        Field(name="info", type=kind("service_msgs/msg/ServiceEventInfo")),
        Field(name="request", type=asked, many=_BOUNDED, count=1),
        Field(name="response", type=given, many=_BOUNDED, count=1),
    )
    parts = {"request_message": asked, "response_message": given, "event_message": _message(f"{name}_Event", told, {})}
    fields = tuple(Field(name=part, type=made) for part, made in parts.items())
    service = _message(name, fields, {})
    return cast(
        type[Message], type(service.__name__, (service,), {"__slots__": (), "Request": asked, "Response": given})
    )


def _described(interface: type[Message]) -> dict[str, Any]:
    """Return a type description, its keys in the order that is hashed."""
    fields = []
    for field in interface.ros_fields:
        nested = ""
        if isinstance(field.type, type):
            number, nested = _NESTED, field.type.ros_name
        else:
            number = _STRING if field.type == "string" else _PRIMITIVES[field.type][1]
        described = {
            "type_id": number + field.many,
            "capacity": field.count,
            "string_capacity": 0,
            "nested_type_name": nested,
        }
        fields.append({"name": field.name, "type": described})
    return {"type_name": interface.ros_name, "fields": fields}


# Bytes. A number stands at a multiple of its size after the header.


def _write(out: bytearray, message: Message) -> None:
    for field in message.ros_fields:
        value = getattr(message, field.name)
        if field.many == _ARRAY and len(value) != field.count:
            raise TypeError(f"{field.name} has {len(value)} elements in place of {field.count}")
        if field.many in (_BOUNDED, _UNBOUNDED):
            _write_numbers(out, "I", (len(value),))
        values = value if field.many else (value,)
        if isinstance(field.type, type):
            for one in values:
                _write(out, one)
        elif field.type == "string":
            for text in values:
                data = text.encode() + b"\0"
                _write_numbers(out, "I", (len(data),))
                out += data
        elif field.many and isinstance(values, bytes | array) and _PRIMITIVES[field.type][0] == "B":
            out += memoryview(values).cast("B")
        else:
            _write_numbers(out, _PRIMITIVES[field.type][0], values)


def _write_numbers(out: bytearray, letter: str, values: Iterable[Any]) -> None:
    values = tuple(values)
    if values:
        out += bytes(-(len(out) - _HEADER_BYTES) % struct.calcsize(letter))
        out += struct.pack(f"<{len(values)}{letter}", *values)


class _Reader:
    def __init__(self, data: bytes, order: str) -> None:
        self._data, self._order, self._at = data, order, _HEADER_BYTES

    def message(self, interface: type[Message]) -> Message:
        """Return the message that begins here."""
        return interface(**{field.name: self._field(field) for field in interface.ros_fields})

    def _field(self, field: Field) -> Any:
        count = field.count if field.many == _ARRAY else self._numbers("I", 1)[0] if field.many else 1
        if isinstance(field.type, str) and field.type != "string":
            read = [*self._numbers(_PRIMITIVES[field.type][0], count)]
        else:
            # Each takes a byte at least: a count that nothing stands behind ends with the bytes.
            read = [self._one(field.type) for _ in range(count)]
        return read if field.many else read[0]

    def _one(self, one: str | type[Message]) -> Any:
        if isinstance(one, type):
            return self.message(one)
        size = self._numbers("I", 1)[0]
        (data,) = struct.unpack_from(f"{size}s", self._data, self._at)
        self._at += size
        return data.rstrip(b"\0").decode()

    def _numbers(self, letter: str, count: int) -> tuple[Any, ...]:
        if not count:
            return ()
        size = struct.calcsize(letter)
        self._at += -(self._at - _HEADER_BYTES) % size
        # Looked at before the format is made, which would take a count's memory.
        if self._at + size * count > len(self._data):
            raise struct.error("the bytes end before the message does")
        read = struct.unpack_from(f"{self._order}{count}{letter}", self._data, self._at)
        self._at += size * count
        return read
