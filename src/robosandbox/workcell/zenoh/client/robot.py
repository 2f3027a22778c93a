"""One robot of a sim process: asked, watched, given goals, and waited for when its sim restarts."""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import zenoh
from pydantic import ValidationError

from robosandbox.errors import (
    InputError,
    InvalidArgumentError,
    InvalidMessageError,
    ServiceUnavailableError,
)
from robosandbox.types import IDENTIFIER, ObservedScene, Truth
from robosandbox.validation import explain
from robosandbox.workcell.zenoh.client.asking import ANSWER_SECONDS, Asker
from robosandbox.workcell.zenoh.client.context import RemoteContext, RemoteSkill
from robosandbox.workcell.zenoh.client.goal import RemoteGoal
from robosandbox.workcell.zenoh.messages import (
    Ask,
    Clock,
    Feedback,
    Goal,
    GoalIntent,
    GoalRef,
    GoalStatus,
    Info,
    Load,
    Message,
    MessageT,
    Objects,
    Picture,
    Reset,
    Saved,
    SendGoal,
    State,
    TrueState,
    decode,
    key,
)

if TYPE_CHECKING:
    from robosandbox.workcell.zenoh.client.client import Client

_log = logging.getLogger(__name__)
# How long a load, reset or step is waited for, seconds; chosen above the minute of the longest step that `Clock` takes.
_LOAD_SECONDS = 120.0


_NEWS: dict[str, type[Goal] | type[Feedback] | type[GoalIntent]] = {
    "status": Goal,
    "feedback": Feedback,
    "intent": GoalIntent,
}


class RemoteRobot:
    """One robot of a sim process.

    Attributes:
        id: Its id.
        ctx: What agents use in place of an `AgentContext`.
    """

    def __init__(self, client: Client, robot_id: str) -> None:
        self.id = robot_id
        self.ctx: RemoteContext = RemoteContext(self)
        self._client = client
        self._asker = Asker(client, robot_id)
        self._goals: dict[str, set[RemoteGoal]] = {}
        self._info: Info | None = None
        self._skills: list[RemoteSkill] = []
        self._calls: dict[str, RemoteSkill] = {}
        self._token = client.session.liveliness().declare_token(key(robot_id, "client", client.id))
        self._news = self.watch("goal/*/*", self._on_news)
        self.survey()

    # What it is.

    def info(self) -> Info:
        """Ask what it is: joints, cameras, skills, the loaded task."""
        self._info = self.ask("info", Ask(), Info)
        return self._info

    def survey(self) -> Info:
        """Ask what it is, and take over its skills as they are now."""
        info = self.info()
        self._skills = [RemoteSkill(item) for item in info.skills if not item.by_hand]
        self._calls = {item.name: RemoteSkill(item) for item in info.skills}
        return info

    @property
    def skills(self) -> list[RemoteSkill]:
        """Its skills, for planners and agents."""
        return self._skills

    @property
    def calls(self) -> Mapping[str, RemoteSkill]:
        """Calls of a program by name: its skills, and the moves of its hand alone."""
        return self._calls

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names that `picture` takes."""
        return tuple(camera.name for camera in (self._info or self.info()).cameras)

    # Looking.

    def observe(self) -> ObservedScene:
        """Return what perception sees now."""
        return self.look().scene

    def look(self) -> Objects:
        """Return what perception sees now, and which sim process says so."""
        return self.ask("obs/objects", Ask(), Objects)

    def state(self) -> State:
        """Return joints, TCP, gripper and the running goal."""
        return self.ask("obs/state", Ask(), State)

    def truth(self) -> Truth:
        """Return the simulated state.

        Raises:
            ForbiddenError: The sim was started with --no-ground-truth.
        """
        return self.ask("truth", Ask(), TrueState).truth

    def picture(self, camera: str, *, depth: bool = False, format: str | None = None) -> tuple[bytes, Picture]:
        """Return a picture's bytes and what they are.

        Args:
            camera: Its name.
            depth: Distances in place of colours.
            format: jpeg, png or raw; JPEG for colours and raw for depth when left out.
        """
        parameters = f"?format={_plain('format', format)}" if format else ""
        sample = self._get(
            f"obs/camera/{_plain('camera', camera)}/{'depth' if depth else 'rgb'}{parameters}", None, ANSWER_SECONDS
        )
        attachment = sample.attachment
        return sample.payload.to_bytes(), Picture.read(attachment.to_bytes() if attachment else b"")

    def watch(self, suffix: str, handler: Callable[[zenoh.Sample], None]) -> zenoh.Subscriber[None]:
        """Subscribe to one of the robot's keys, "obs/state" for example; undeclare what is returned to end it.

        What another session than the sim's publishes there is not handed on.
        """

        def hear(sample: zenoh.Sample) -> None:
            origin = sample.source_info
            if self._asker.source.believes(origin.source_id if origin else None, suffix):
                handler(sample)

        return self._client.session.declare_subscriber(key(self.id, suffix), hear)

    # Acting.

    def send(
        self,
        skill: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        timeout: float | None = None,
        queue: bool = False,
        goal_id: str | None = None,
        boot_id: str | None = None,
        intents: bool = False,
        confirmed: bool = False,
    ) -> RemoteGoal:
        """Send a goal and return when the sim has accepted it.

        Args:
            skill: Its name.
            arguments: As its schema says.
            timeout: Simulated seconds after which the skill is stopped.
            queue: Wait behind the running goal in place of a BusyError.
            goal_id: A UUID of one's own; sent again with it a goal runs once.
            boot_id: The sim process that the goal is meant for; another one refuses it.
            intents: Whether to hear what the skill is about to do.
            confirmed: Whether a person has seen what would come of it, and confirmed it.

        Raises:
            SkillError: The sim refuses it.
        """
        message = _message(
            SendGoal,
            goal_id=goal_id or str(uuid.uuid4()),
            arguments=dict(arguments or {}),
            timeout=timeout,
            queue=queue,
            client_id=self._client.id,
            boot_id=boot_id,
            intents=intents,
            confirmed=confirmed,
        )
        pending = Goal(goal_id=message.goal_id, boot_id="", skill=skill, status=GoalStatus.ACCEPTED)
        # News of the goal may come before the answer.
        goal = RemoteGoal(self, pending)
        self._goals.setdefault(message.goal_id, set()).add(goal)
        try:
            goal.hear(self.ask(f"skill/{_plain('skill', skill)}/send_goal", message, Goal))
        except BaseException:
            self.forget(goal)
            raise
        return goal

    def order(
        self, name: str, *, timeout: float | None = None, stop: threading.Event | None = None, **arguments: Any
    ) -> dict[str, Any]:
        """Have the sim carry out an order with its own planner, and return what came of it.

        Args:
            name: `run`, `plan`, `follow`, `achieve`, `check`, `simulate` or `judge`.
            timeout: Simulated seconds after which it is stopped.
            stop: Stops it when it is set.
            arguments: What it takes, as `prompt` or `goals`.

        Raises:
            SkillError: The sim refuses it, or it ended without an answer.
        """
        goal = self.send(name, arguments, timeout=timeout)
        try:
            for _ in goal.follow():
                if stop is not None and stop.is_set():
                    self.cancel(goal)
                    stop = None
        finally:
            self.forget(goal)
        if goal.goal.answer is None:
            goal.goal.outcome()
        return goal.goal.answer or {}

    def cancel(self, goal: RemoteGoal) -> None:
        """Ask the sim to stop a goal."""
        goal.hear(self.ask(f"skill/{_plain('skill', goal.skill)}/cancel_goal", GoalRef(goal_id=goal.id), Goal))

    def result(self, skill: str, goal_id: str) -> Goal:
        """Return a goal as the sim has it, whoever sent it.

        Raises:
            UnknownGoalError: There is none of that id, or it ended too long ago.
        """
        return self.ask(f"skill/{_plain('skill', skill)}/get_result", _message(GoalRef, goal_id=goal_id), Goal)

    def forget(self, goal: RemoteGoal) -> None:
        """Listen no longer to a goal's news."""
        same = self._goals.get(goal.id, set())
        same.discard(goal)
        if not same:
            self._goals.pop(goal.id, None)

    def reset(self, seed: int | None = None, *, checkpoint: str | None = None) -> Truth:
        """Start over with a seed's layout, or go back to a checkpoint.

        Raises:
            BusyError: A goal runs.
            InputError: The seed or checkpoint is wrong.
        """
        fields = {"seed": 0 if seed is None and checkpoint is None else seed, "checkpoint": checkpoint}
        return self._change("reset", Reset, fields)

    def checkpoint(self) -> str:
        """Keep the world as it is, in the sim; return the name for `reset`."""
        return self.ask("checkpoint", Ask(), Saved).checkpoint

    def load(
        self, task: str | None = None, *, document: Mapping[str, Any] | None = None, robot: str | None = None
    ) -> Truth:
        """Load another task.

        Args:
            task: A bundled task's name.
            document: A task as its YAML would have it; in place of a name.
            robot: In place of the task's.

        Raises:
            BusyError: A goal runs.
            InputError: The task is wrong.
        """
        fields = {"task": task, "document": None if document is None else dict(document), "robot": robot}
        truth = self._change("load", Load, fields)
        self.survey()
        return truth

    def step(self, seconds: float) -> Truth:
        """Let simulated time pass, the arm holding."""
        return self._change("clock", Clock, {"step": seconds})

    def give_up(self) -> None:
        """End the load, reset or step that is under way at the sim; whoever asked for it gets a CancelledError."""
        self._change("clock", Clock, {"cancel": True})

    def set_pace(self, pace: str) -> None:
        """Let simulated time pass at `realtime` or `fast` for as long as this client lives."""
        self._change("clock", Clock, {"pace": pace})

    # Presence.

    def wait_until_back(self) -> None:
        """Wait for the sim to be there.

        Raises:
            ServiceUnavailableError: It did not come within the client's reconnect time.
        """
        self._client.wait_for(self.id, self._client.reconnect)

    def on_presence(self, came: bool) -> None:
        """Take note that the sim came or went; from Zenoh's thread."""
        if came:
            # Whoever only listens asks nothing that would tell who is to be believed now.
            threading.Thread(target=self._meet_again, name="meet again", daemon=True).start()
        else:
            self._asker.source.forget()
            for goal in self._followed(*self._goals):
                goal.lose()

    def close(self) -> None:
        """Leave this robot."""
        self._news.undeclare()
        self._token.undeclare()

    # Asking.

    def ask(self, suffix: str, message: Message, answer: type[MessageT], timeout: float = ANSWER_SECONDS) -> MessageT:
        """Send a request that may be sent twice, and return its answer; waits for a sim that is away.

        Raises:
            SkillError: The sim refuses; a ForbiddenError when access control keeps the request from it.
            ServiceUnavailableError: No sim answered.
        """
        return decode(self._get(suffix, message, timeout).payload.to_bytes(), answer)

    def _change(self, suffix: str, model: type[Message], fields: Mapping[str, Any]) -> Truth:
        try:
            message = _message(model, **fields, client_id=self._client.id)
            return self.ask(suffix, message, TrueState, _LOAD_SECONDS).truth
        except (InvalidArgumentError, InvalidMessageError) as error:
            raise InputError(error.message) from None

    def _get(self, suffix: str, message: Message | None, timeout: float) -> zenoh.Sample:
        return self._asker.get(suffix, message.encode() if message is not None else None, timeout)

    def _meet_again(self) -> None:
        try:
            self._asker.source.find(ANSWER_SECONDS)
        except (ServiceUnavailableError, zenoh.ZError) as error:
            _log.warning("news of robot %s is not heard: %s", self.id, error)

    def _on_news(self, sample: zenoh.Sample) -> None:
        *_, goal_id, kind = str(sample.key_expr).split("/")
        followed = self._followed(goal_id)
        model = _NEWS.get(kind)
        if not followed or model is None:
            return
        news = decode(sample.payload.to_bytes(), model)
        for goal in followed:
            goal.hear(news)

    def _followed(self, *goal_ids: str) -> list[RemoteGoal]:
        return [goal for goal_id in goal_ids for goal in tuple(self._goals.get(goal_id, ()))]


def _message(model: type[MessageT], **fields: Any) -> MessageT:
    """Return a message, or raise what the sim would answer to a wrong one."""
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        raise InvalidArgumentError(explain(error, model)) from None


def _plain(field: str, name: str) -> str:
    """Return a key part, or raise where it would name something else."""
    if not IDENTIFIER.fullmatch(name):
        raise InvalidArgumentError(f"{field}: {name[:60]!r} is no name; names are of letters, digits, '_', '-' and '.'")
    return name
