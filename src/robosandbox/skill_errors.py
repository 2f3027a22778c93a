"""Failures of skills, and the errors that carry them; `robosandbox.errors` draws the tree."""

from __future__ import annotations

import logging
import uuid
from typing import Annotated, Any, ClassVar, Self

from pydantic import SerializeAsAny, ValidationError, ValidationInfo, WithJsonSchema, field_validator

from robosandbox.error_codes import ErrorCode as ErrorCode, Phase as Phase
from robosandbox.errors import RoboSandboxError
from robosandbox.evidence import (
    BusyEvidence,
    CollisionEvidence,
    ConnectionEvidence,
    DrawerEvidence,
    Evidence,
    ForeignEvidence,
    GraspEvidence,
    HoldingEvidence,
    LimitEvidence,
    MessageEvidence,
    ObjectNotFoundEvidence,
    PlacementEvidence,
    PourEvidence,
    TimeoutEvidence,
    TrackingEvidence,
    UnreachableEvidence,
)
from robosandbox.plugins import import_installed
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


class Failure(StrictModel):
    """Failure of a call: one value in Python, in results and recordings, and on the wire.

    Attributes:
        code: Its kind.
        phase: What the skill was doing.
        message: What, which value, which limit, what to do.
        evidence: Measurements, of the kind that the code has.
        repairs: Skill calls that were tried on the twin, the one that moves the fewest other things first, then the cheapest.
    """

    code: str
    phase: str
    message: str
    evidence: Annotated[SerializeAsAny[Evidence], WithJsonSchema({"type": "object"})] | None = None
    repairs: tuple[Repair, ...] = ()

    @field_validator("evidence", mode="before")
    @classmethod
    def _evidence_is_of_the_code(cls, value: Any, info: ValidationInfo) -> Any:
        """Read the evidence as what the code says that it is: fields alone may fit several kinds."""
        if not isinstance(value, dict):
            return value
        declared = error_class(str(info.data.get("code"))).evidence_type
        if declared is not None:
            try:
                return declared.model_validate(value)
            except ValidationError:
                # The package that wrote it is of another version than the one installed here.
                pass
        return ForeignEvidence.model_validate(value)

    def exception(self) -> SkillError:
        """Return the exception that this is the failure of: of its code's class, where that is installed."""
        return error_class(self.code)._carrying(self)


class SkillError(RoboSandboxError):
    """A skill ended without its post-condition.

    A subclass declares the code of its failures and the model of their evidence. It is found by its code wherever a failure is
    read: a skill's module that is an entry point of an installed package need not have been imported before.

    Args:
        failure: The failure, or its message where the rest follows.
        phase: What the skill was doing.
        evidence: Measurements.
        repairs: Calls that were tried on the twin.

    Attributes:
        code: The failure's kind; of the class, the kind that it declares.
        evidence_type: Model of the evidence that comes with the code; None where there is nothing to measure.
    """

    code: str = ErrorCode.INTERNAL
    evidence_type: ClassVar[type[Evidence] | None] = None

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "code" not in vars(cls):
            return
        known = _BY_CODE.setdefault(cls.code, cls)
        if (known.__module__, known.__qualname__) != (cls.__module__, cls.__qualname__):
            raise TypeError(
                f"{cls.__module__}.{cls.__qualname__}: the code {cls.code!r} is {known.__module__}.{known.__qualname__}'s; "
                "take another, or inherit from that class"
            )
        _BY_CODE[cls.code] = cls

    def __init__(
        self,
        failure: str | Failure,
        *,
        phase: str = Phase.CHECK,
        evidence: Evidence | None = None,
        repairs: tuple[Repair, ...] = (),
    ) -> None:
        if isinstance(failure, str):
            failure = Failure(code=self.code, phase=phase, message=failure, evidence=evidence, repairs=repairs)
        super().__init__(failure.message)
        self.code = failure.code
        self._failure = failure

    @property
    def failure(self) -> Failure:
        """The failure as a value."""
        return self._failure

    @property
    def phase(self) -> str:
        """What the skill was doing."""
        return self._failure.phase

    @property
    def message(self) -> str:
        """What, which value, which limit, what to do."""
        return self._failure.message

    @property
    def evidence(self) -> Evidence | None:
        """Measurements."""
        return self._failure.evidence

    @property
    def repairs(self) -> tuple[Repair, ...]:
        """Calls that were tried on the twin."""
        return self._failure.repairs

    def with_(
        self, *, phase: str | None = None, message: str | None = None, repairs: tuple[Repair, ...] | None = None
    ) -> Self:
        """Return the error with another phase, message or repairs."""
        changes = {"phase": phase, "message": message, "repairs": repairs}
        given = {name: value for name, value in changes.items() if value is not None}
        return self._carrying(self._failure.model_copy(update=given), **vars(self))

    @classmethod
    def _carrying(cls, failure: Failure, **attributes: Any) -> Self:
        """Return an error of a failure, whatever a subclass wants to be made of."""
        error = cls.__new__(cls)
        vars(error).update(attributes)
        SkillError.__init__(error, failure)
        return error


_BY_CODE: dict[str, type[SkillError]] = {}


def error_class(code: str) -> type[SkillError]:
    """Return the class of errors that declares a code, in this package or in a skill's that is installed; SkillError without one."""
    if code not in _BY_CODE:
        import_installed("skills")
    return _BY_CODE.get(code, SkillError)


class InvalidArgumentError(SkillError):
    """An argument is of the wrong type or value."""

    code = ErrorCode.INVALID_ARGUMENT


class ObjectNotFoundError(SkillError):
    """Nothing seen has this id."""

    code = ErrorCode.OBJECT_NOT_FOUND
    evidence_type: ClassVar[type[Evidence] | None] = ObjectNotFoundEvidence


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


class TwinError(SkillError):
    """The arm goes otherwise than its twin did: it was stopped, and holds."""

    code = ErrorCode.TWIN
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


class DrawerError(SkillError):
    """A drawer did not slide as far as it should."""

    code = ErrorCode.DRAWER
    evidence_type: ClassVar[type[Evidence] | None] = DrawerEvidence


class PourError(SkillError):
    """Poured things did not arrive, or spilled."""

    code = ErrorCode.POUR
    evidence_type: ClassVar[type[Evidence] | None] = PourEvidence


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
