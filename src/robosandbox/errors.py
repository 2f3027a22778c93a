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
    ├── UnreachableError         no joint configuration puts the TCP there
    ├── LimitError               the task forbids the arm to go there
    ├── CollisionError           the only ways there touch something
    ├── TrackingError            the arm did not arrive where it was sent
    ├── FaultError               the driver has stopped and waits to be recovered
    ├── TwinError                the arm goes otherwise than its twin did
    ├── GraspError               none found, missed, or slipped
    ├── NotHoldingError          the gripper is empty
    ├── AlreadyHoldingError      the gripper is full
    ├── PlacementError           occupied, missed or toppled
    ├── skills.push.PushError    the object went elsewhere
    ├── DrawerError              a drawer did not slide as far as it should
    ├── PourError                what was poured did not arrive, or spilled
    ├── skills.tap.TapError      the touch was not felt, or moved the object
    ├── UnsupportedError         this robot cannot do this skill
    ├── RefusedPromptError       the planner refuses what was asked
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

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from robosandbox.skill_errors import (
        AlreadyHoldingError as AlreadyHoldingError,
        BusyError as BusyError,
        CancelledError as CancelledError,
        CollisionError as CollisionError,
        ConnectionLostError as ConnectionLostError,
        DrawerError as DrawerError,
        ErrorCode as ErrorCode,
        Failure as Failure,
        FaultError as FaultError,
        ForbiddenError as ForbiddenError,
        GoalTimeoutError as GoalTimeoutError,
        GraspError as GraspError,
        InternalError as InternalError,
        InvalidArgumentError as InvalidArgumentError,
        InvalidMessageError as InvalidMessageError,
        LimitError as LimitError,
        NotHoldingError as NotHoldingError,
        ObjectNotFoundError as ObjectNotFoundError,
        Phase as Phase,
        PlacementError as PlacementError,
        PourError as PourError,
        RefusedPromptError as RefusedPromptError,
        Repair as Repair,
        ServiceError as ServiceError,
        SkillError as SkillError,
        TrackingError as TrackingError,
        TwinError as TwinError,
        UnknownGoalError as UnknownGoalError,
        UnreachableError as UnreachableError,
        UnsupportedError as UnsupportedError,
    )


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


def __getattr__(name: str) -> Any:
    # The errors of skills carry evidence, whose classes need pydantic and numpy: a command whose arguments are wrong, or
    # that only prints its help, ends before either is loaded.
    if not name.startswith("_"):
        skill_errors = import_module("robosandbox.skill_errors")
        if hasattr(skill_errors, name):
            return getattr(skill_errors, name)
    raise AttributeError(f"module 'robosandbox.errors' has no attribute {name!r}")
