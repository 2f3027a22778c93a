"""The protocol between a sim and its clients: keys, and every message as a strict model.

All keys lie under `robosandbox/<robot_id>/`. Control messages are JSON; errors are `ErrorRecord`s sent as error replies.
Numbers are finite, SI units and radians, poses in the world frame. docs/protocol.md is written from these models.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any, ClassVar, Final, Literal, Self, TypeVar

from pydantic import ConfigDict, Field, ValidationError
from pydantic_core import from_json

from robosandbox.errors import ErrorRecord, InvalidMessageError
from robosandbox.evidence import MessageEvidence
from robosandbox.types import (
    Finite,
    Intent,
    Intrinsics,
    NonNegative,
    Observation,
    ObservedScene,
    Pose,
    Positive,
    SkillResult,
    StrictModel,
    Truth,
)

PROTOCOL: Final = 2
ROOT = "robosandbox"
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
DEFAULT_ROBOT_ID = "robot"
MAX_MESSAGE_BYTES = 1_000_000
MAX_REQUEST_BYTES = 64_000
KEPT_RESULTS = 256
KEPT_CHECKPOINTS = 64
STATE_HZ = 50.0
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
    """What every message carries.

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
    """What a sim is asked: read strictly, so that a number in quotes is no number."""

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


# Requests.


class Ask(FromClient):
    """A question without arguments: `info`, `truth`, `checkpoint`, `obs/objects`, `obs/state`. May be left out."""


class SendGoal(FromClient):
    """Run a skill. Sent again with the same id it runs once, and the answer says how far it is.

    Attributes:
        goal_id: A UUID that the client makes up.
        arguments: As the skill's schema says.
        timeout: Simulated seconds after which the skill is stopped; none if left out.
        queue: Wait behind the running goal in place of being refused as busy.
        client_id: The id of the client's liveliness token: its goals are cancelled when the client is lost.
        boot_id: The sim process that the client planned for; another one refuses with `connection_lost`.
        intents: Whether to publish what the skill is about to do, on `goal/<id>/intent`.
    """

    goal_id: GoalId
    arguments: dict[str, Any] = Field(default_factory=dict, max_length=64)
    timeout: Annotated[float, Field(gt=0.0, le=1e6, allow_inf_nan=False)] | None = None
    queue: bool = False
    client_id: GoalId | None = None
    boot_id: Annotated[str, Field(max_length=64)] | None = None
    intents: bool = False


class GoalRef(FromClient):
    """The goal that `cancel_goal` or `get_result` is about.

    Attributes:
        goal_id: As it was sent.
    """

    goal_id: GoalId


class Reset(FromClient):
    """Start over: with a seed's layout, or from a checkpoint.

    Attributes:
        seed: The layout; 0 is the task as written.
        checkpoint: What `checkpoint` returned; in place of a seed.
        client_id: The client's liveliness token: the reset is given up when the client is lost.
    """

    seed: Count | None = None
    checkpoint: Annotated[str, Field(max_length=64)] | None = None
    client_id: GoalId | None = None


class Load(FromClient):
    """Load another task; all checkpoints are forgotten.

    Attributes:
        task: A bundled task's name.
        document: A task as its YAML would have it; in place of a name.
        robot: A bundled robot's name or an allowed file, in place of the task's.
        client_id: The client's liveliness token: the load is given up when the client is lost.
    """

    max_bytes: ClassVar[int] = MAX_MESSAGE_BYTES

    task: Annotated[str, Field(max_length=64)] | None = None
    document: dict[str, Any] | None = None
    robot: Annotated[str, Field(max_length=1000)] | None = None
    client_id: GoalId | None = None


class Clock(FromClient):
    """Let simulated time pass, or change how it passes.

    Attributes:
        step: Simulated seconds to pass now, the arm holding.
        pace: `realtime`, or `fast`: as fast as it computes, and between goals not at all. What a client set ends with it.
        cancel: Give up the load, reset or step that is under way; its query ends in the error `cancelled`.
        client_id: The client's liveliness token, to which the pace and the step are tied.
    """

    step: Annotated[float, Field(gt=0.0, le=60.0, allow_inf_nan=False)] | None = None
    pace: Literal["realtime", "fast"] | None = None
    cancel: bool = False
    client_id: GoalId | None = None


# Answers.


class Joint(StrictModel):
    """An arm joint.

    Attributes:
        name: In the robot's model.
        lower: The least position, rad or m.
        upper: The greatest position, rad or m.
        velocity: The greatest speed, rad/s or m/s.
    """

    name: str
    lower: Finite
    upper: Finite
    velocity: NonNegative


class GripperInfo(StrictModel):
    """How far the fingers come together and apart.

    Attributes:
        min_aperture: Metres between them when closed.
        max_aperture: Metres between them when open.
    """

    min_aperture: Finite
    max_aperture: Finite


class Camera(StrictModel):
    """A camera.

    Attributes:
        name: In keys.
        width: Pixels.
        height: Pixels.
    """

    name: str
    width: Count
    height: Count


class SkillInfo(StrictModel):
    """A skill of the catalogue.

    Attributes:
        name: In keys.
        description: What it does, in a line.
        arguments: JSON schema of what `send_goal` takes as arguments.
    """

    name: str
    description: str
    arguments: dict[str, Any]


class Info(Message):
    """What a sim is: the answer to `info`.

    Attributes:
        robot_id: In keys.
        boot_id: New with every start of the sim process.
        robot: The robot's model.
        joints: In the order of `q`.
        home_q: Configuration, one value per joint.
        base_xy: Where the robot stands, metres.
        gripper: None for an arm without one.
        cameras: Under `obs/camera/`.
        skills: The catalogue.
        task: The loaded task, as its YAML would have it, defaults filled in.
        seed: The layout.
        pace: How simulated time passes.
        control_timestep: Seconds between commands.
        truth: Whether `truth` answers.
        doing: The running skill, or "reset" and the like; None when it is free.
    """

    robot_id: RobotId
    boot_id: str
    robot: str
    joints: tuple[Joint, ...]
    home_q: Numbers
    base_xy: tuple[Finite, Finite]
    gripper: GripperInfo | None
    cameras: tuple[Camera, ...]
    skills: tuple[SkillInfo, ...]
    task: dict[str, Any]
    seed: Count
    pace: Literal["realtime", "fast"]
    control_timestep: Positive
    truth: bool
    doing: str | None = None


class GoalStatus(StrEnum):
    """How far a goal is; the last three are final."""

    ACCEPTED = "accepted"
    EXECUTING = "executing"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def final(self) -> bool:
        """Whether it will not change any more."""
        return self not in (GoalStatus.ACCEPTED, GoalStatus.EXECUTING)


class Goal(Message):
    """A goal as the sim has it: the answer to `send_goal`, `cancel_goal`, `get_result`; on `goal/<id>/status` at each change.

    Attributes:
        goal_id: The client's.
        boot_id: The sim process that took it.
        skill: Its name.
        status: How far it is.
        began: Simulated seconds at its start.
        ended: Simulated seconds at its end.
        result: After it succeeded.
        error: After it failed or was cancelled.
    """

    goal_id: GoalId
    boot_id: str
    skill: str
    status: GoalStatus
    began: Finite | None = None
    ended: Finite | None = None
    result: SkillResult | None = None
    error: ErrorRecord | None = None

    def outcome(self) -> SkillResult:
        """Return a final goal's result, or raise its error.

        Raises:
            SkillError: It failed or was cancelled.
        """
        if self.error is not None:
            raise self.error.exception()
        if self.result is None:
            raise ValueError(f"goal {self.goal_id} is {self.status}, which is not final")
        return self.result


class Feedback(Message):
    """On `goal/<id>/feedback`: a phase begins.

    Attributes:
        goal_id: The client's.
        skill: Its name.
        phase: What it does now.
        number: Of the phase, from 1.
        time: Simulated seconds.
        elapsed: Simulated seconds since the goal began.
    """

    goal_id: GoalId
    skill: str
    phase: str
    number: Count
    time: Finite
    elapsed: NonNegative


class Intended(Message):
    """On `goal/<id>/intent`, where the goal asked for it: what the skill is about to do.

    Attributes:
        goal_id: The client's.
        intent: A path of at most 64 configurations, or the grasps that were weighed, at most 64.
    """

    goal_id: GoalId
    intent: Intent


class State(Message):
    """On `obs/state`, 50 times a second.

    Attributes:
        boot_id: The sim process.
        seq: Counts messages.
        stamp: Unix seconds when it was read.
        robot: How the robot stands.
        held: Id of the held object.
        goal_id: The running goal.
        skill: Its skill.
        phase: Its phase.
        physics_steps: Since the last reset.
        loads: Tasks that were loaded since the process began: with another number, or boot id, ask `info` again.
    """

    boot_id: str
    seq: Count
    stamp: Finite
    robot: Observation
    held: str | None
    goal_id: GoalId | None = None
    skill: str | None = None
    phase: str | None = None
    physics_steps: Count
    loads: Count = 0


class Objects(Message):
    """What perception sees: on `obs/objects`, and the answer to it.

    Attributes:
        boot_id: The sim process; put it into `send_goal` to be refused when another one has taken its place.
        scene: What planners see.
    """

    boot_id: str
    scene: ObservedScene


class TrueState(Message):
    """The simulated state: the answer to `truth`, `reset`, `load` and `clock`.

    Attributes:
        boot_id: The sim process.
        physics_steps: Since the last reset.
        truth: The state; without objects, and with nothing held, where `truth` is switched off.
    """

    boot_id: str
    physics_steps: Count
    truth: Truth


class Saved(Message):
    """The answer to `checkpoint`.

    Attributes:
        checkpoint: Its name, for `reset`.
        time: Simulated seconds of it.
    """

    checkpoint: str
    time: Finite


class Picture(Message):
    """The attachment of a camera picture.

    Attributes:
        camera: Its name.
        boot_id: The sim process.
        stamp: Unix seconds when the state was taken.
        time: Simulated seconds of it.
        intrinsics: The camera's pinhole.
        format: `jpeg`, `png` or `raw`: rows of RGB bytes; depth as 16-bit millimetres in a PNG, or raw float32 metres.
        pose_camera_in_world: x right, y down, z into the scene.
    """

    camera: str
    boot_id: str
    stamp: Finite
    time: Finite
    intrinsics: Intrinsics
    format: Literal["jpeg", "png", "raw"]
    pose_camera_in_world: Pose

    @classmethod
    def read(cls, attachment: bytes) -> Self:
        """Return the message in an attachment."""
        return decode(attachment, cls)
