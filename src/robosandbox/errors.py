"""Every error of the project, split by who can act on it.

RoboSandboxError
├── InputError               the user's file or argument is wrong
├── RenderingError           no OpenGL on this machine
├── SensorError              a camera's frame cannot be used
├── ServiceUnavailableError  no sim answers
├── PlannerError             a planner gave neither a plan nor a refusal
│   ├── PlannerUnavailableError  its service does not answer, or will not for now
│   ├── PlannerCancelledError    it was left while it thought
│   └── PlannerAnswerError       it answered, but with nothing usable within its limits
└── SkillError               a skill ended without its post-condition; the planner acts on it
    ├── InvalidArgumentError     an argument is of the wrong type or value
    ├── ObjectNotFoundError      nothing seen has this id
    ├── AmbiguousObjectError     several things seen fit
    ├── UnreachableError         no joint configuration puts the TCP there
    ├── LimitError               the task forbids the arm to go there
    ├── CollisionError           the only ways there touch something
    ├── TrackingError            the arm did not arrive where it was sent
    ├── GraspError               none found, missed, or slipped
    ├── NotHoldingError          the gripper is empty
    ├── AlreadyHoldingError      the gripper is full
    ├── PlacementError           occupied, missed or toppled
    ├── PushError                the object went elsewhere
    ├── DrawerError              a drawer did not slide as far as it should
    ├── PourError                what was poured did not arrive, or spilled
    ├── TapError                 the touch was not felt, or moved the object
    ├── UnsupportedError         this robot cannot do this skill
    ├── GoalTimeoutError         the deadline passed
    ├── CancelledError           somebody cancelled
    ├── InternalError            a fault in the code, with an id in the log
    └── ServiceError             between a client and a sim
        ├── BusyError                another goal runs
        ├── InvalidMessageError      the message is not of the protocol
        ├── UnknownGoalError         no goal of this id, or no longer
        ├── ForbiddenError           switched off at this sim, or not allowed to this client
        └── ConnectionLostError      the sim went away while it worked
"""

from __future__ import annotations

import logging
import uuid
from enum import StrEnum
from typing import Any, ClassVar, Literal, TypeAlias

from pydantic import Field, model_validator

from robosandbox.types import Pose, SkillCall, StrictModel


class RoboSandboxError(Exception):
    """The root of all errors that this package raises on purpose."""


class InputError(RoboSandboxError):
    """The user's file, option or value is wrong; the message names it and the remedy."""


class RenderingError(RoboSandboxError):
    """No picture can be made on this machine; the message says what to install."""


class SensorError(RoboSandboxError):
    """A camera's frame cannot be used; the message says which, why, and what is expected."""


class ServiceUnavailableError(RoboSandboxError):
    """No sim answers where one was looked for."""


class PlannerError(RoboSandboxError):
    """A planner gave neither a plan nor a refusal, and nothing was moved for it."""


class PlannerUnavailableError(PlannerError):
    """The planner's service does not answer, or will not for now: try again later, or use another planner."""


class PlannerCancelledError(PlannerError):
    """The planner was left while it thought."""


class PlannerAnswerError(PlannerError):
    """The planner's answers are no valid plan and no refusal, and its limits are reached."""


class ErrorCode(StrEnum):
    """A skill error's kind, in Python and on the wire."""

    INVALID_ARGUMENT = "invalid_argument"
    OBJECT_NOT_FOUND = "object_not_found"
    AMBIGUOUS_OBJECT = "ambiguous_object"
    UNREACHABLE = "unreachable"
    LIMIT = "limit"
    COLLISION = "collision"
    TRACKING = "tracking"
    GRASP = "grasp"
    NOT_HOLDING = "not_holding"
    ALREADY_HOLDING = "already_holding"
    PLACEMENT = "placement"
    PUSH = "push"
    DRAWER = "drawer"
    POUR = "pour"
    TAP = "tap"
    UNSUPPORTED = "unsupported"
    GOAL_TIMEOUT = "goal_timeout"
    CANCELLED = "cancelled"
    INTERNAL = "internal"
    BUSY = "busy"
    INVALID_MESSAGE = "invalid_message"
    UNKNOWN_GOAL = "unknown_goal"
    FORBIDDEN = "forbidden"
    CONNECTION_LOST = "connection_lost"


class Phase(StrEnum):
    """What a skill was doing."""

    CHECK = "check"
    PERCEIVE = "perceive"
    PLAN = "plan"
    APPROACH = "approach"
    DESCEND = "descend"
    GRASP = "grasp"
    LIFT = "lift"
    TRANSFER = "transfer"
    LOWER = "lower"
    RELEASE = "release"
    PUSH = "push"
    SLIDE = "slide"
    POUR = "pour"
    TOUCH = "touch"
    RETREAT = "retreat"
    HOME = "home"
    SETTLE = "settle"
    VERIFY = "verify"


class Evidence(StrictModel):
    """What was measured when a skill failed; each error has its own kind."""


class UnreachableEvidence(Evidence):
    """How close the best configuration comes to the target.

    Attributes:
        target: The TCP pose asked for.
        position_error: Metres left.
        orientation_error: Radians left.
        joints_at_limits: Arm joints that stop it.
        nearest: The nearest reachable TCP pose found.
    """

    target: Pose
    position_error: float
    orientation_error: float
    joints_at_limits: tuple[str, ...] = ()
    nearest: Pose


class LimitEvidence(Evidence):
    """Which quantity would leave its limits.

    Attributes:
        quantity: What is limited, in words.
        value: What it is or would be, SI units.
        low: The least allowed.
        high: The most allowed.
    """

    quantity: str
    value: float
    low: float
    high: float


class CollisionEvidence(Evidence):
    """Which pair touches, how deep, and where on the path.

    Attributes:
        body: The moving body (of the arm, or the held object).
        other: What it would touch.
        depth: Penetration, metres.
        waypoint: Index of the first colliding configuration.
        waypoints: How many the path has.
    """

    body: str
    other: str
    depth: float
    waypoint: int
    waypoints: int


class GraspEvidence(Evidence):
    """What the fingers found.

    Attributes:
        object: Id.
        reason: No candidate; closed on nothing; lost after closing; held, but fixed where it is or far too heavy
            ("immovable"); moved, but heavier than the grip or the arm can bear ("too_heavy"); fingers that do not go
            where they are sent ("gripper_stuck").
        object_width: Extent between the fingers, metres; None when no candidate was found.
        aperture: The gap after closing, or the most it opens, metres.
        max_aperture: The most it opens, metres.
        commanded: The gap that was commanded, metres; None when it does not matter.
        pull: The largest upward force with which the arm pulled at it, N; None when it was not lifted.
        moved: How far it went while it was lifted, metres; None when it was not lifted.
        tried: How many candidates were examined, and what stopped each kind of them.
    """

    object: str
    reason: Literal["none_found", "missed", "slipped", "immovable", "too_heavy", "gripper_stuck"]
    object_width: float | None = None
    aperture: float
    max_aperture: float
    commanded: float | None = None
    pull: float | None = None
    moved: float | None = None
    tried: dict[str, int] = Field(default_factory=dict)


class ObjectNotFoundEvidence(Evidence):
    """What was asked for and what is there.

    Attributes:
        query: As it was asked.
        seen: Ids of all that is seen.
    """

    query: str
    seen: tuple[str, ...]


class AmbiguousEvidence(Evidence):
    """What was asked for and all that fits.

    Attributes:
        query: As it was asked.
        candidates: Ids that fit.
    """

    query: str
    candidates: tuple[str, ...]


class HoldingEvidence(Evidence):
    """What the gripper holds, if anything.

    Attributes:
        held: Id of the held object.
        aperture: The gap between the fingers, metres.
    """

    held: str | None
    aperture: float


class PlacementEvidence(Evidence):
    """Where the object is instead.

    Attributes:
        object: What was placed.
        target: Where it should be: an object id or "table".
        reason: No free spot, beside the mark, fallen over, not let go, no place for it, or a drawer that is closed.
        expected: The pose aimed at.
        actual: The pose seen afterwards; None when it was not let go.
        blocking: What occupies the place.
    """

    object: str
    target: str
    reason: Literal["occupied", "missed", "toppled", "stuck", "unsuitable", "closed"]
    expected: Pose | None = None
    actual: Pose | None = None
    blocking: tuple[str, ...] = ()


class PushEvidence(Evidence):
    """How far the object went.

    Attributes:
        object: Id.
        wanted: Metres along the direction.
        along: Metres gone along it.
        across: Metres gone beside it.
    """

    object: str
    wanted: float
    along: float
    across: float


class DrawerEvidence(Evidence):
    """How far a drawer slid, and what it took.

    Attributes:
        drawer: Id.
        reason: It did not give way at all, stopped on the way, or the hand lost it.
        wanted: The opening asked for, metres.
        opening: The opening reached, metres.
        force: The most that the hand pulled or pushed with, along the way that the drawer slides, N.
        blocking: What touches the drawer's sliding box, besides the robot.
    """

    drawer: str
    reason: Literal["locked", "blocked", "slipped"]
    wanted: float
    opening: float
    force: float
    blocking: tuple[str, ...] = ()


class PourEvidence(Evidence):
    """Where what was poured is.

    Attributes:
        object: Id of the container that was poured from.
        target: Id of the container that was poured into.
        count: How many things were in it.
        poured: How many are in the target.
        spilled: How many are in neither.
    """

    object: str
    target: str
    count: int
    poured: int
    spilled: int


class TapEvidence(Evidence):
    """What the touch was like.

    Attributes:
        object: Id.
        force: The largest felt, N.
        moved: How far the object went, metres.
    """

    object: str
    force: float
    moved: float


class TrackingEvidence(Evidence):
    """Which joint lags the most.

    Attributes:
        joint: Its name.
        error: Commanded minus actual, radians or metres.
        contacts: What the arm touches.
        servo_force: What the joint's servo gave, N m or N; None where a contact stopped the arm.
        servo_limit: The most that it can give.
        contact_force: With how many newtons the arm pressed on what stopped it; None where nothing did.
    """

    joint: str
    error: float
    contacts: tuple[str, ...] = ()
    servo_force: float | None = None
    servo_limit: float | None = None
    contact_force: float | None = None


class TimeoutEvidence(Evidence):
    """The deadline and the time spent.

    Attributes:
        deadline: Simulated seconds allowed.
        elapsed: Simulated seconds spent.
    """

    deadline: float
    elapsed: float


class BusyEvidence(Evidence):
    """What the robot is doing.

    Attributes:
        doing: A skill's name, or "reset", "load" and the like.
        goal_id: The running goal; None when it is no goal.
        waiting: How many goals wait behind it.
    """

    doing: str
    goal_id: str | None = None
    waiting: int = 0


class MessageEvidence(Evidence):
    """Which field of a message is wrong.

    Attributes:
        field: Its path; empty for the whole message.
        problem: What is wrong with it.
    """

    field: str
    problem: str


class ConnectionEvidence(Evidence):
    """Which robot was lost, and whether its sim has come back.

    Attributes:
        robot_id: The robot.
        restarted: Whether a new sim process serves it now; None when it is not known.
    """

    robot_id: str
    restarted: bool | None = None


AnyEvidence: TypeAlias = (
    UnreachableEvidence
    | LimitEvidence
    | CollisionEvidence
    | GraspEvidence
    | ObjectNotFoundEvidence
    | AmbiguousEvidence
    | HoldingEvidence
    | PlacementEvidence
    | PushEvidence
    | DrawerEvidence
    | PourEvidence
    | TapEvidence
    | TrackingEvidence
    | TimeoutEvidence
    | BusyEvidence
    | MessageEvidence
    | ConnectionEvidence
)


class Repair(StrictModel):
    """Skill calls that reached the post-condition on a copy of the world.

    Attributes:
        calls: What to run in place of the failed call.
        why: One sentence for the person.
        cost: Simulated seconds it took there.
    """

    calls: tuple[SkillCall, ...]
    why: str
    cost: float


class SkillError(RoboSandboxError):
    """A skill ended without its post-condition.

    Attributes:
        code: Its kind.
        phase: What the skill was doing.
        message: What, which value, which limit, what to do.
        evidence: Measurements, typed per code.
        repairs: Calls that were tried on a copy of the world, the one that moves the fewest other things first, then the cheapest.
    """

    code: ClassVar[ErrorCode] = ErrorCode.INTERNAL
    evidence_type: ClassVar[type[Evidence] | None] = None

    def __init__(
        self,
        message: str,
        *,
        phase: Phase = Phase.CHECK,
        evidence: AnyEvidence | None = None,
        repairs: tuple[Repair, ...] = (),
    ) -> None:
        super().__init__(message)
        self.message = message
        self.phase = phase
        self.evidence = evidence
        self.repairs = repairs

    def at(self, phase: Phase) -> SkillError:
        """Set the phase and return the error itself."""
        self.phase = phase
        return self

    def record(self) -> ErrorRecord:
        """Return the error as a value that can leave the process."""
        return ErrorRecord(
            code=self.code,
            phase=self.phase,
            message=self.message,
            evidence=self.evidence,
            repairs=self.repairs,
        )


class ErrorRecord(StrictModel):
    """A SkillError as a value: what results, logs and the wire carry.

    Attributes:
        code: Its kind.
        phase: What the skill was doing.
        message: What, which value, which limit, what to do.
        evidence: Measurements, of the kind that the code has.
        repairs: Skill calls that were tried on a copy of the world, the one that moves the fewest other things first, then the cheapest.
    """

    code: ErrorCode
    phase: Phase
    message: str
    evidence: AnyEvidence | None = None
    repairs: tuple[Repair, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _evidence_is_of_the_code(cls, data: Any) -> Any:
        """Read the evidence as what the code says that it is: fields alone may fit several kinds."""
        if not isinstance(data, dict) or not isinstance(data.get("evidence"), dict):
            return data
        found = next((kind for code, kind in SKILL_ERRORS.items() if code == data.get("code")), None)
        if found is None or found.evidence_type is None:
            return data
        return {**data, "evidence": found.evidence_type.model_validate(data["evidence"])}

    def exception(self) -> SkillError:
        """Return the exception that this is the record of."""
        return SKILL_ERRORS[self.code](self.message, phase=self.phase, evidence=self.evidence, repairs=self.repairs)


class InvalidArgumentError(SkillError):
    """An argument is of the wrong type or value."""

    code = ErrorCode.INVALID_ARGUMENT


class ObjectNotFoundError(SkillError):
    """Nothing seen has this id."""

    code = ErrorCode.OBJECT_NOT_FOUND
    evidence_type = ObjectNotFoundEvidence


class AmbiguousObjectError(SkillError):
    """Several things seen fit."""

    code = ErrorCode.AMBIGUOUS_OBJECT
    evidence_type = AmbiguousEvidence


class UnreachableError(SkillError):
    """No joint configuration puts the TCP there."""

    code = ErrorCode.UNREACHABLE
    evidence_type = UnreachableEvidence


class LimitError(SkillError):
    """The task forbids the arm to go there."""

    code = ErrorCode.LIMIT
    evidence_type = LimitEvidence


class CollisionError(SkillError):
    """The only ways there touch something."""

    code = ErrorCode.COLLISION
    evidence_type = CollisionEvidence


class TrackingError(SkillError):
    """The arm did not arrive where it was sent."""

    code = ErrorCode.TRACKING
    evidence_type = TrackingEvidence


class GraspError(SkillError):
    """No grasp was found, it missed, or the object slipped."""

    code = ErrorCode.GRASP
    evidence_type = GraspEvidence


class NotHoldingError(SkillError):
    """The gripper is empty."""

    code = ErrorCode.NOT_HOLDING
    evidence_type = HoldingEvidence


class AlreadyHoldingError(SkillError):
    """The gripper is full."""

    code = ErrorCode.ALREADY_HOLDING
    evidence_type = HoldingEvidence


class PlacementError(SkillError):
    """The object is not where it was to be placed."""

    code = ErrorCode.PLACEMENT
    evidence_type = PlacementEvidence


class PushError(SkillError):
    """The object did not go where it was pushed."""

    code = ErrorCode.PUSH
    evidence_type = PushEvidence


class DrawerError(SkillError):
    """A drawer did not slide as far as it should."""

    code = ErrorCode.DRAWER
    evidence_type = DrawerEvidence


class PourError(SkillError):
    """What was poured did not arrive, or spilled."""

    code = ErrorCode.POUR
    evidence_type = PourEvidence


class TapError(SkillError):
    """The touch was not felt, or it moved the object."""

    code = ErrorCode.TAP
    evidence_type = TapEvidence


class UnsupportedError(SkillError):
    """This robot cannot do this skill, or not with this object."""

    code = ErrorCode.UNSUPPORTED


class GoalTimeoutError(SkillError):
    """The deadline passed."""

    code = ErrorCode.GOAL_TIMEOUT
    evidence_type = TimeoutEvidence


class CancelledError(SkillError):
    """Somebody cancelled."""

    code = ErrorCode.CANCELLED


class InternalError(SkillError):
    """A fault in the code; the log has the traceback under the id in the message."""

    code = ErrorCode.INTERNAL

    @classmethod
    def log(cls, where: object, fault: Exception, logger: logging.Logger) -> InternalError:
        """Log a fault with its traceback under a new id, and return the error that names the id."""
        fault_id = uuid.uuid4().hex[:8]
        logger.error("fault %s in %s", fault_id, where, exc_info=fault)
        return cls(f"{where} ended in a fault of the code ({type(fault).__name__}); the log has it under id {fault_id}")


class ServiceError(SkillError):
    """Something between a client and a sim is wrong, not the robot's work."""


class BusyError(ServiceError):
    """The robot does something else; cancel it, wait, or ask to be queued."""

    code = ErrorCode.BUSY
    evidence_type = BusyEvidence


class InvalidMessageError(ServiceError):
    """A message is not of the protocol."""

    code = ErrorCode.INVALID_MESSAGE
    evidence_type = MessageEvidence


class UnknownGoalError(ServiceError):
    """No goal has this id, or it ended too long ago."""

    code = ErrorCode.UNKNOWN_GOAL


class ForbiddenError(ServiceError):
    """This sim was started without it, or its access control does not allow it to this client."""

    code = ErrorCode.FORBIDDEN


class ConnectionLostError(ServiceError):
    """The sim went away while it worked, and what it worked on is not known to be done."""

    code = ErrorCode.CONNECTION_LOST
    evidence_type = ConnectionEvidence


SKILL_ERRORS: dict[ErrorCode, type[SkillError]] = {
    cls.code: cls
    for cls in (
        InvalidArgumentError,
        ObjectNotFoundError,
        AmbiguousObjectError,
        UnreachableError,
        LimitError,
        CollisionError,
        TrackingError,
        GraspError,
        NotHoldingError,
        AlreadyHoldingError,
        PlacementError,
        PushError,
        DrawerError,
        PourError,
        TapError,
        UnsupportedError,
        GoalTimeoutError,
        CancelledError,
        InternalError,
        BusyError,
        InvalidMessageError,
        UnknownGoalError,
        ForbiddenError,
        ConnectionLostError,
    )
}
