"""Messages that a sim answers with or publishes."""

from __future__ import annotations

import operator
from enum import StrEnum
from typing import Any, Literal, Self

from pydantic import Field

from robosandbox.errors import Failure
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
from robosandbox.types.robot import ARM
from robosandbox.workcell.zenoh.messages.message import Count, GoalId, Message, Numbers, RobotId, decode


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
    """Range of the gripper's opening.

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
        by_hand: Whether it only moves the hand, so that no plan is made of it.
    """

    name: str
    description: str
    arguments: dict[str, Any]
    by_hand: bool = False


class ArmInfo(StrictModel):
    """One of several arms.

    Attributes:
        robot: The robot's model.
        joints: In the order of `q`.
        home_q: Configuration, one value per joint.
        base_xy: Where the robot stands, metres.
        gripper: None for an arm without one.
    """

    robot: str
    joints: tuple[Joint, ...]
    home_q: Numbers
    base_xy: tuple[Finite, Finite]
    gripper: GripperInfo | None


class Info(Message):
    """Description of a sim: the answer to `info`.

    Of several arms `robot`, `joints`, `home_q`, `base_xy` and `gripper` are those of the first.

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
        unprotected: What is not kept of this robot, in sentences: a limit that its driver cannot keep, or that nobody gives.
        confirms: Whether a call has to work on the twin, or be confirmed, before anything moves.
        doing: The running skill, or "reset" and the like; None when it is free.
        arms: Each arm by name, where there are several; which one calls are made with, `obs/state` says.
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
    unprotected: tuple[str, ...] = ()
    confirms: bool = False
    doing: str | None = None
    arms: dict[str, ArmInfo] = Field(default={}, exclude_if=operator.not_)


class GoalStatus(StrEnum):
    """Status of a goal; the last three are final."""

    ACCEPTED = "accepted"
    EXECUTING = "executing"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def final(self) -> bool:
        """True where it will not change any more."""
        return self not in (GoalStatus.ACCEPTED, GoalStatus.EXECUTING)


class Goal(Message):
    """A goal as the sim has it: the answer to `send_goal`, `cancel_goal`, `get_result`; on `goal/<id>/status` at each change.

    Attributes:
        goal_id: The client's.
        boot_id: The sim process that took it.
        skill: The skill's name, or the order's: `run`, `plan`, `follow`, `achieve`, `check`, `simulate` or `judge`.
        status: How far it is.
        began: Simulated seconds at its start.
        ended: Simulated seconds at its end.
        result: After a skill succeeded.
        answer: What came of an order that is no skill, whether it succeeded or failed.
        error: After it failed or was cancelled.
    """

    goal_id: GoalId
    boot_id: str
    skill: str
    status: GoalStatus
    began: Finite | None = None
    ended: Finite | None = None
    result: SkillResult | None = None
    answer: dict[str, Any] | None = None
    error: Failure | None = None

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


class GoalIntent(Message):
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
        hands: Ids of the held objects by hand, None in an empty one: as contacts tell, or without them as perception believed at
            its last look.
        goal_id: The running goal.
        skill: Its skill.
        phase: Its phase.
        physics_steps: Since the last reset; None where nothing is simulated.
        loads: Tasks that were loaded since the process began: with another number, or boot id, ask `info` again.
        arm: Name of the arm that calls are made with, where there are several.
    """

    boot_id: str
    seq: Count
    stamp: Finite
    robot: Observation
    hands: dict[str, str | None]
    goal_id: GoalId | None = None
    skill: str | None = None
    phase: str | None = None
    physics_steps: Count | None
    loads: Count = 0
    arm: str = Field(default=ARM, exclude_if=lambda arm: arm == ARM)


class Objects(Message):
    """Objects that perception sees: on `obs/objects`, and the answer to it.

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
        physics_steps: Since the last reset; None where nothing is simulated.
        truth: The state; without objects, and with nothing held, where `truth` is switched off or the driver knows none.
    """

    boot_id: str
    physics_steps: Count | None
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
