"""The errors that skills end in, each with its code, its phase and its evidence; `robosandbox.errors` draws the tree."""

from __future__ import annotations

import logging
import uuid
from typing import Any, ClassVar

from pydantic import model_validator

from robosandbox.error_codes import ErrorCode as ErrorCode, Phase as Phase
from robosandbox.errors import RoboSandboxError
from robosandbox.evidence import (
    AmbiguousEvidence,
    AnyEvidence,
    BusyEvidence,
    CollisionEvidence,
    ConnectionEvidence,
    DrawerEvidence,
    Evidence,
    GraspEvidence,
    HoldingEvidence,
    LimitEvidence,
    MessageEvidence,
    ObjectNotFoundEvidence,
    PlacementEvidence,
    PourEvidence,
    PushEvidence,
    TapEvidence,
    TimeoutEvidence,
    TrackingEvidence,
    UnreachableEvidence,
)
from robosandbox.types import SkillCall, StrictModel


class Repair(StrictModel):
    """Skill calls that reached the post-condition on the twin: a simulation of what perception believed.

    Attributes:
        calls: What to run in place of the failed call.
        why: One sentence for the person.
        cost: Simulated seconds it took there.
        believed: Whether that twin was made of what cameras show; of the simulated state where not.
    """

    calls: tuple[SkillCall, ...]
    why: str
    cost: float
    believed: bool = True


class SkillError(RoboSandboxError):
    """A skill ended without its post-condition.

    Attributes:
        code: Its kind.
        phase: What the skill was doing.
        message: What, which value, which limit, what to do.
        evidence: Measurements, typed per code.
        repairs: Calls that were tried on the twin, the one that moves the fewest other things first, then the cheapest.
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
        self.message: str = message
        self.phase: Phase = phase
        self.evidence = evidence
        self.repairs = repairs

    def at(self, phase: Phase) -> SkillError:
        """Set the phase and return the error itself."""
        self.phase = phase
        return self

    def append(self, advice: str) -> None:
        """Put advice behind the message; advice that is there already is not repeated."""
        if advice and not self.message.endswith(advice):
            self.message += advice
            self.args: tuple[Any, ...] = (self.message,)

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
        repairs: Skill calls that were tried on the twin, the one that moves the fewest other things first, then the cheapest.
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
    evidence_type: ClassVar[type[Evidence] | None] = ObjectNotFoundEvidence


class AmbiguousObjectError(SkillError):
    """Several things seen fit."""

    code = ErrorCode.AMBIGUOUS_OBJECT
    evidence_type: ClassVar[type[Evidence] | None] = AmbiguousEvidence


class UnreachableError(SkillError):
    """No joint configuration puts the TCP there."""

    code = ErrorCode.UNREACHABLE
    evidence_type: ClassVar[type[Evidence] | None] = UnreachableEvidence


class LimitError(SkillError):
    """The task forbids the arm to go there."""

    code = ErrorCode.LIMIT
    evidence_type: ClassVar[type[Evidence] | None] = LimitEvidence


class FaultError(SkillError):
    """The driver has stopped and moves nothing before somebody has looked after it and called `recover`."""

    code = ErrorCode.FAULT
    evidence_type: ClassVar[type[Evidence] | None] = LimitEvidence


class CollisionError(SkillError):
    """The only ways there touch something."""

    code = ErrorCode.COLLISION
    evidence_type: ClassVar[type[Evidence] | None] = CollisionEvidence


class TrackingError(SkillError):
    """The arm did not arrive where it was sent."""

    code = ErrorCode.TRACKING
    evidence_type: ClassVar[type[Evidence] | None] = TrackingEvidence


class GraspError(SkillError):
    """No grasp was found, it missed, or the object slipped."""

    code = ErrorCode.GRASP
    evidence_type: ClassVar[type[Evidence] | None] = GraspEvidence


class NotHoldingError(SkillError):
    """The gripper is empty."""

    code = ErrorCode.NOT_HOLDING
    evidence_type: ClassVar[type[Evidence] | None] = HoldingEvidence


class AlreadyHoldingError(SkillError):
    """The gripper is full."""

    code = ErrorCode.ALREADY_HOLDING
    evidence_type: ClassVar[type[Evidence] | None] = HoldingEvidence


class PlacementError(SkillError):
    """The object is not where it was to be placed."""

    code = ErrorCode.PLACEMENT
    evidence_type: ClassVar[type[Evidence] | None] = PlacementEvidence


class PushError(SkillError):
    """The object did not go where it was pushed."""

    code = ErrorCode.PUSH
    evidence_type: ClassVar[type[Evidence] | None] = PushEvidence


class DrawerError(SkillError):
    """A drawer did not slide as far as it should."""

    code = ErrorCode.DRAWER
    evidence_type: ClassVar[type[Evidence] | None] = DrawerEvidence


class PourError(SkillError):
    """Poured things did not arrive, or spilled."""

    code = ErrorCode.POUR
    evidence_type: ClassVar[type[Evidence] | None] = PourEvidence


class TapError(SkillError):
    """The touch was not felt, or it moved the object."""

    code = ErrorCode.TAP
    evidence_type: ClassVar[type[Evidence] | None] = TapEvidence


class UnsupportedError(SkillError):
    """This robot cannot do this skill, or not with this object."""

    code = ErrorCode.UNSUPPORTED


class RefusedPromptError(SkillError):
    """The planner refuses the sentence or the goals; the message says why, or asks which is meant."""

    code = ErrorCode.REFUSED


class GoalTimeoutError(SkillError):
    """The deadline passed."""

    code = ErrorCode.GOAL_TIMEOUT
    evidence_type: ClassVar[type[Evidence] | None] = TimeoutEvidence


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
    evidence_type: ClassVar[type[Evidence] | None] = BusyEvidence


class InvalidMessageError(ServiceError):
    """A message is not of the protocol."""

    code = ErrorCode.INVALID_MESSAGE
    evidence_type: ClassVar[type[Evidence] | None] = MessageEvidence


class UnknownGoalError(ServiceError):
    """No goal has this id, or it ended too long ago."""

    code = ErrorCode.UNKNOWN_GOAL


class ForbiddenError(ServiceError):
    """This sim was started without it, or its access control does not allow it to this client."""

    code = ErrorCode.FORBIDDEN


class ConnectionLostError(ServiceError):
    """The sim went away while it worked, and what it worked on is not known to be done."""

    code = ErrorCode.CONNECTION_LOST
    evidence_type: ClassVar[type[Evidence] | None] = ConnectionEvidence


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
        FaultError,
        GraspError,
        NotHoldingError,
        AlreadyHoldingError,
        PlacementError,
        PushError,
        DrawerError,
        PourError,
        TapError,
        UnsupportedError,
        RefusedPromptError,
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
