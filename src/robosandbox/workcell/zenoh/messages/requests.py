"""Messages with which a client asks a sim."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from robosandbox.workcell.zenoh.messages.message import MAX_MESSAGE_BYTES, MAX_TIMEOUT, Count, FromClient, GoalId


class Ask(FromClient):
    """A question without arguments: `info`, `truth`, `checkpoint`, `obs/objects`, `obs/state`. May be left out."""


class SendGoal(FromClient):
    """Run a skill, a move of the hand, or an order. Sent again with the same id it runs once, and the answer says how far it is.

    Attributes:
        goal_id: A UUID that the client makes up.
        arguments: As the skill's schema says; `prompt` for `run` and `plan`, `goals` for `achieve`, `steps` for `follow`,
            `check` and `simulate`; nothing for `judge`, `undo` and `recover`.
        timeout: Simulated seconds after which the skill is stopped; none if left out.
        queue: Wait behind the running goal in place of being refused as busy.
        client_id: The id of the client's liveliness token: its goals are cancelled when the client is lost.
        boot_id: The sim process that the client planned for; another one refuses with `connection_lost`.
        intents: Whether to publish what the skill is about to do, on `goal/<id>/intent`.
        confirmed: Whether a person has seen what `simulate` says of this call, and confirmed it.
    """

    goal_id: GoalId
    arguments: dict[str, Any] = Field(default_factory=dict, max_length=64)
    timeout: Annotated[float, Field(gt=0.0, le=MAX_TIMEOUT, allow_inf_nan=False)] | None = None
    queue: bool = False
    client_id: GoalId | None = None
    boot_id: Annotated[str, Field(max_length=64)] | None = None
    intents: bool = False
    confirmed: bool = False


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
