"""Base of all messages, the keys, and the reading of payloads."""

from __future__ import annotations

from typing import Annotated, ClassVar, Final, Literal, TypeVar

from pydantic import ConfigDict, Field, ValidationError
from pydantic_core import from_json

from robosandbox.errors import InvalidMessageError
from robosandbox.evidence import MessageEvidence
from robosandbox.types import (
    Finite,
    StrictModel,
)

PROTOCOL: Final = 2
ROOT = "robosandbox"
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
DEFAULT_ROBOT_ID = "robot"
# Bytes that any message may have; chosen well above a task document with hundreds of objects.
MAX_MESSAGE_BYTES = 1_000_000
# Bytes that a request may have, `load` apart; chosen so that reading one costs the sim little.
MAX_REQUEST_BYTES = 64_000
# Goals that a sim remembers after their end; chosen so that a client that was away for a while finds its own.
KEPT_RESULTS = 256
# Checkpoints that a sim keeps for clients; chosen to bound the sim's memory.
KEPT_CHECKPOINTS = 64
# Messages a second on `obs/state`; chosen so that what follows the arm moves smoothly; benchmarks/service.py measures it.
STATE_HZ = 50.0
# The longest that a goal may be given, simulated seconds.
MAX_TIMEOUT = 1e6
JSON = "application/json"

RobotId = Annotated[str, Field(pattern=r"^[a-z0-9_-]{1,64}$")]
GoalId = Annotated[str, Field(pattern=r"^[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}$")]
Count = Annotated[int, Field(ge=0, lt=2**31)]
Numbers = tuple[Finite, ...]


def key(robot_id: str, *parts: str) -> str:
    """Return a key of a robot: `key("arm", "obs", "state")`; `*` stands for any robot."""
    return "/".join((ROOT, robot_id, *parts))


def robot_of(key_expr: str) -> str:
    """Return the robot id of a key."""
    return key_expr.split("/")[1]


class Message(StrictModel):
    """Base of all messages.

    Attributes:
        protocol: The version that the sender speaks.
    """

    # A NaN among a skill's arguments is to be refused by the sim, not to arrive as null.
    model_config: ClassVar[ConfigDict] = ConfigDict(ser_json_inf_nan="constants")
    max_bytes: ClassVar[int] = MAX_MESSAGE_BYTES

    protocol: Literal[2] = PROTOCOL

    def encode(self) -> bytes:
        """Return the message as JSON."""
        return self.model_dump_json().encode()


class FromClient(Message):
    """Base of a client's messages: read strictly, so that a number in quotes is no number."""

    max_bytes: ClassVar[int] = MAX_REQUEST_BYTES


MessageT = TypeVar("MessageT", bound=Message)


def decode(payload: bytes, model: type[MessageT]) -> MessageT:
    """Return the message in a payload.

    Raises:
        InvalidMessageError: It is too long, no JSON, of another protocol version, or has a wrong field.
    """
    if len(payload) > model.max_bytes:
        raise _invalid("", f"the message has {len(payload):,} bytes; at most {model.max_bytes:,} are read")
    try:
        data = from_json(payload, allow_inf_nan=False)
    except ValueError as error:
        raise _invalid("", f"the message is no JSON of finite numbers: {error}") from None
    if isinstance(data, dict) and data.get("protocol", PROTOCOL) != PROTOCOL:
        raise _invalid("protocol", f"speaks version {str(data['protocol'])[:20]}; here it is {PROTOCOL}")
    try:
        return (
            model.model_validate_json(payload, strict=True)
            if issubclass(model, FromClient)
            else model.model_validate(data)
        )
    except ValidationError as error:
        problem = error.errors(include_url=False, include_context=False, include_input=False)[0]
        where = ".".join(str(part)[:40] for part in problem["loc"][:4])
        takes = ", ".join(model.model_fields)
        raise _invalid(where, f"{problem['msg']}; the message takes {takes}") from None
    except RecursionError:
        raise _invalid("", "the message is nested too deeply") from None


def _invalid(field: str, problem: str) -> InvalidMessageError:
    return InvalidMessageError(
        f"{field}: {problem}" if field else problem, evidence=MessageEvidence(field=field, problem=problem)
    )
