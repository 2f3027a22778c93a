"""Bytes and type hashes of this package beside those of the wheels.

    uv run --project examples/drivers/ros2 python -m robosandbox_ros2.wire tests/data/ros2_kilted.json

writes some of the wheels' down, for tests that have no wheels.
"""

from __future__ import annotations

import ctypes
import json
import random
import re
import struct
import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from robosandbox.workcell.ros2.interfaces import Field, Message, definitions, from_bytes, kind, to_bytes, type_hash

# What is written down: the state, pictures, and an action with all that is sent of it.
KEPT = (
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/CameraInfo",
    "tf2_msgs/msg/TFMessage",
    "visualization_msgs/msg/MarkerArray",
    "action_msgs/msg/GoalStatusArray",
    "robosandbox_msgs/msg/Things",
    "robosandbox_msgs/action/Say_SendGoal_Request",
    "robosandbox_msgs/action/Say_SendGoal_Response",
    "robosandbox_msgs/action/Say_GetResult_Response",
    "robosandbox_msgs/action/Say_FeedbackMessage",
)

# What the generators give a message without fields; rclpy does not show it.
NO_FIELD = "structure_needs_at_least_one_member"


def messages() -> Iterator[type[Message]]:
    """Return every message that is spoken, parts of services and actions among them."""
    for name in definitions():
        for made in (kind(name), *vars(kind(name)).values()):
            if isinstance(made, type) and issubclass(made, Message):
                yield from (made.Request, made.Response) if hasattr(made, "Request") else (made,)


def services() -> Iterator[type[Message]]:
    """Return every service that is spoken, those of actions among them."""
    for name in definitions():
        for made in (kind(name), *vars(kind(name)).values()):
            if isinstance(made, type) and hasattr(made, "Request"):
                yield made


def _shown(interface: type[Message]) -> list[Field]:
    return [field for field in interface.ros_fields if field.name != NO_FIELD]


def filled(interface: type[Message], chance: random.Random) -> Message:
    """Return a message with any values that its fields take."""

    def one(field: Field) -> Any:
        if isinstance(field.type, type):
            return filled(field.type, chance)
        if field.type == "string":
            return "".join(chance.choices("abc/ {}\"'_0äß€😀", k=chance.randrange(9)))
        if field.type == "bool":
            return chance.random() < 0.5
        if field.type.startswith("float"):
            # What a float32 holds as well.
            return chance.randrange(-(1 << 20), 1 << 20) / 8.0
        bits = int(re.sub(r"\D", "", field.type) or 8)
        return (
            chance.randrange(-(1 << bits - 1), 1 << bits - 1)
            if field.type.startswith("int")
            else chance.getrandbits(bits)
        )

    values = {}
    for field in _shown(interface):
        count = field.count or chance.randrange(5)
        values[field.name] = [one(field) for _ in range(count)] if field.many else one(field)
    return interface(**values)


def theirs(interface: type[Message]) -> Any:
    """Return the wheels' class of a message."""
    package, group, name = interface.ros_name.split("/")
    base = re.sub(r"(?<!^)(?=[A-Z][a-z])", "_", name.partition("_")[0]).lower()
    if group == "msg":
        return getattr(import_module(f"{package}.msg"), name)
    return getattr(import_module(f"{package}.{group}._{base}"), name)


def as_theirs(message: Message) -> Any:
    """Return a message of the wheels with the same values."""
    made = theirs(type(message))()
    for field in _shown(type(message)):
        value = getattr(message, field.name)
        if isinstance(field.type, type):
            value = [as_theirs(one) for one in value] if field.many else as_theirs(value)
        setattr(made, field.name, value)
    return made


def their_bytes(message: Message) -> bytes:
    """Return a message as the wheels serialise it."""
    return bytes(serialize_message(as_theirs(message)))


def they_read(interface: type[Message], data: bytes) -> Any:
    """Return what the wheels read."""
    return deserialize_message(data, theirs(interface))


def unread(interface: type[Message], data: bytes) -> list[int]:
    """Return the places whose byte means nothing to the wheels: what aligns, and what stands behind the end."""
    meant, places = they_read(interface, data), []
    for place in range(len(data)):
        other = bytearray(data)
        other[place] ^= 0xA5
        try:
            if they_read(interface, bytes(other)) == meant:
                places.append(place)
        except Exception:  # whatever rclpy raises, the byte was read
            continue
    return places


def their_hash(interface: type[Message]) -> str:
    """Return the type hash that the wheels were compiled with."""
    package, group, name = interface.ros_name.split("/")
    library = ctypes.CDLL(str(Path(sys.prefix) / "lib" / f"lib{package}__rosidl_generator_c.so"))
    ask = library[f"{package}__{group}__{name}__get_type_hash"]
    ask.restype = ctypes.POINTER(ctypes.c_uint8 * 33)
    number, digest = struct.unpack("B32s", bytes(ask(None).contents))
    return f"RIHS{number:02d}_{digest.hex()}"


def values(message: Message) -> dict[str, Any]:
    """Return a message's values as JSON has them."""
    found = {}
    for field in message.ros_fields:
        value = getattr(message, field.name)
        if isinstance(field.type, type):
            value = [values(one) for one in value] if field.many else values(value)
        found[field.name] = value
    return found


def compare(times: int) -> str:
    """Compare all that is spoken with the wheels; return how much it was.

    Raises:
        AssertionError: Bytes, what is read of them, or a hash differ.
    """
    chance, count, meaningless = random.Random(1), 0, 0
    spoken = {made.ros_name: made for made in messages()}
    for name, interface in spoken.items():
        for _ in range(times):
            message = filled(interface, chance)
            ours, data = to_bytes(message), their_bytes(message)
            # Bytes that align are what the memory held before, and the wheels' estimate of a size may be more than it is.
            assert len(ours) <= len(data), (name, ours.hex(), data.hex())
            differ = [place for place, (mine, other) in enumerate(zip(ours, data, strict=False)) if mine != other]
            meaningless += len(differ) + len(data) - len(ours)
            assert not any(ours[place] for place in differ), (name, ours.hex(), data.hex())
            assert they_read(interface, ours) == as_theirs(message), (name, ours.hex(), data.hex())
            assert values(from_bytes(interface, data)) == values(message), (name, data.hex())
            count += 1
    made = [*spoken.values(), *services()]
    for interface in made:
        assert type_hash(interface) == their_hash(interface), interface.ros_name
    return f"{count} messages of {len(spoken)} types, {len(made)} hashes; {meaningless} bytes that align or stand behind the end"


def main() -> None:
    """Write bytes and hashes of the wheels into a file."""
    chance = random.Random(0)
    spoken = {made.ros_name: made for made in messages()}
    written = {
        "made_by": {name: version(name) for name in ("ros-rclpy", "ros-rmw-fastrtps-cpp", "ros-sensor-msgs")},
        "hashes": {made.ros_name: their_hash(made) for made in (*spoken.values(), *services())},
        "messages": [
            {
                "type": name,
                "values": values(message),
                "bytes": data.hex(),
                "unread": unread(spoken[name], data),
            }
            for name in KEPT
            for message in [filled(spoken[name], chance)]
            for data in [their_bytes(message)]
        ],
    }
    # A line for each message.
    Path(sys.argv[1]).write_text(json.dumps(written, ensure_ascii=False).replace(', {"type": ', ',\n{"type": ') + "\n")


if __name__ == "__main__":
    main()
