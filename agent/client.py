"""Sims from another process: found by their liveliness, called through the same skills, waited for when they restart.

with connect("tcp/127.0.0.1:7447") as client:
    robot = client.robot()
    robot.send("pick", {"object": "red_cube"}).wait()
"""

from __future__ import annotations

import logging
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import zenoh
from pydantic import ValidationError
from pydantic_core import from_json

from robosandbox.agent.remote import RemoteContext, RemoteSkill
from robosandbox.errors import (
    ConnectionEvidence,
    ConnectionLostError,
    ErrorRecord,
    ForbiddenError,
    InputError,
    InvalidArgumentError,
    InvalidMessageError,
    ServiceUnavailableError,
    UnknownGoalError,
)
from robosandbox.transport import open_connector
from robosandbox.types import IDENTIFIER, ObservedScene, SkillResult
from robosandbox.validation import did_you_mean, explain
from robosandbox.wire import (
    DEFAULT_ENDPOINT,
    Ask,
    Clock,
    Feedback,
    Goal,
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
    robot_of,
)

_log = logging.getLogger(__name__)
_ANSWER_SECONDS = 10.0
_LOAD_SECONDS = 120.0
_DISCOVERY_SECONDS = 0.3
_POLL_SECONDS = 0.02
_CHECK_SECONDS = 2.0
_DENIED_SECONDS = 1.5
_SLICE_SECONDS = 0.02

OnPresence = Callable[[str, bool], None]


def connect(
    *endpoints: str,
    zenoh_config: Path | None = None,
    timeout: float = 5.0,
    reconnect: float = 30.0,
) -> Client:
    """Connect to sims.

    Args:
        endpoints: Zenoh endpoints of sims or routers; tcp/127.0.0.1:7447 when left out.
        zenoh_config: A Zenoh configuration file with the client's credentials.
        timeout: Seconds to look for a first sim.
        reconnect: Seconds to wait for a sim that went away.

    Raises:
        InputError: An endpoint or the file is wrong.
        ServiceUnavailableError: No sim is there, or it does not let this client in.
    """
    client = Client(open_connector(endpoints, config_file=zenoh_config), reconnect=reconnect)
    try:
        client.wait_for_robot(timeout, endpoints, zenoh_config)
    except BaseException:
        client.close()
        raise
    return client


class Client:
    """All sims that a Zenoh session sees.

    Args:
        session: Closed with the client.
        reconnect: Seconds to wait for a sim that went away.

    Attributes:
        id: Of the liveliness tokens: sims cancel this client's goals when it is lost.
        listeners: Called with a robot id and whether it is there, in Zenoh's thread.
    """

    def __init__(self, session: zenoh.Session, *, reconnect: float = 30.0) -> None:
        self.id = str(uuid.uuid4())
        self.reconnect = reconnect
        self.listeners: list[OnPresence] = []
        self.session = session
        self._present: dict[str, int] = {}
        self._changed = threading.Condition()
        self._robots: dict[str, RemoteRobot] = {}
        self._watch = session.liveliness().declare_subscriber(key("*", "alive"), self._on_alive, history=True)

    @property
    def robots(self) -> tuple[str, ...]:
        """The ids of the robots that are there, sorted."""
        with self._changed:
            return tuple(sorted(self._present))

    def robot(self, robot_id: str | None = None) -> RemoteRobot:
        """Return a robot; the id may be left out where there is one.

        Raises:
            InputError: There is none of that id, or several and none was named.
        """
        there = self.robots
        if robot_id is None:
            if len(there) != 1:
                raise InputError(f"--robot-id: there are {len(there)} robots, {', '.join(there)}; name one")
            robot_id = there[0]
        if robot_id not in there and robot_id not in self._robots:
            raise InputError(
                f"--robot-id: no robot {robot_id[:70]!r}; there is {', '.join(there) or 'none'}"
                f"{did_you_mean(robot_id, there)}"
            )
        with self._changed:
            if robot_id not in self._robots:
                self._robots[robot_id] = RemoteRobot(self, robot_id)
            return self._robots[robot_id]

    def wait_for_robot(self, timeout: float, endpoints: Sequence[str] = (), zenoh_config: Path | None = None) -> None:
        """Wait until a sim is seen, and a moment more for others.

        Raises:
            ServiceUnavailableError: None came in time.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: bool(self._present), timeout):
                raise ServiceUnavailableError(self._why_none(endpoints, zenoh_config))
            if len(endpoints) > 1:
                self._changed.wait_for(lambda: len(self._present) >= len(endpoints), timeout)

    def _why_none(self, endpoints: Sequence[str], zenoh_config: Path | None) -> str:
        linked = bool(self.session.info.peers_zid() or self.session.info.routers_zid())
        where = ", ".join(endpoints) or (f"the endpoints of {zenoh_config.name}" if zenoh_config else DEFAULT_ENDPOINT)
        if linked:
            return f"{where} answers, but shows this client no sim; start one, or ask who keeps its access control"
        # A listener that asks who comes refuses without a word.
        credentials = f"the credentials in {zenoh_config.name}" if zenoh_config else "a client without credentials"
        return (
            f"no sim at {where}, or it refuses {credentials}; start one with `robo-sandbox sim`, or give its endpoint "
            "with --connect and credentials with --zenoh-config"
        )

    def wait_for(self, robot_id: str, timeout: float) -> None:
        """Wait until a robot is there.

        Raises:
            ServiceUnavailableError: It did not come in time.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: robot_id in self._present, timeout):
                raise ServiceUnavailableError(
                    f"the sim of {robot_id!r} went away and did not come back within {round(timeout, 1):g} s"
                )

    def is_present(self, robot_id: str) -> bool:
        """Tell whether a robot is there now."""
        return robot_id in self._present

    def close(self) -> None:
        """Leave; goals of this client that still run are cancelled."""
        for robot in self._robots.values():
            robot.close()
        self.session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _on_alive(self, sample: zenoh.Sample) -> None:
        robot_id = robot_of(str(sample.key_expr))
        came = sample.kind == zenoh.SampleKind.PUT
        with self._changed:
            if came:
                self._present[robot_id] = self._present.get(robot_id, 0) + 1
            else:
                self._present.pop(robot_id, None)
            robot = self._robots.get(robot_id)
            self._changed.notify_all()
        _log.info("robot %s %s", robot_id, "is there" if came else "is gone")
        if robot is not None:
            robot.on_presence(came)
        for listener in tuple(self.listeners):
            listener(robot_id, came)


class RemoteGoal:
    """A goal on its way."""

    def __init__(self, robot: RemoteRobot, goal: Goal) -> None:
        self._robot = robot
        self._goal = goal
        self._feedback: deque[Feedback] = deque()
        self._changed = threading.Condition()
        self._lost = False

    @property
    def id(self) -> str:
        """Its UUID."""
        return self._goal.goal_id

    @property
    def skill(self) -> str:
        """What it runs."""
        return self._goal.skill

    @property
    def goal(self) -> Goal:
        """How far it is, as last heard."""
        return self._goal

    def cancel(self) -> None:
        """Ask the sim to stop it; `wait` then raises CancelledError."""
        self._robot.cancel(self)

    def wait(self, timeout: float | None = None) -> SkillResult:
        """Return the result when the goal has ended.

        A sim that goes away is waited for; what it knows of the goal when it is back decides.

        Args:
            timeout: Seconds on the wall; no limit when left out.

        Raises:
            SkillError: The skill failed, was cancelled, or the sim was restarted while it ran.
            TimeoutError: The goal runs on.
            ServiceUnavailableError: The sim went away and did not come back.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        for _ in self.follow():
            if deadline is not None and time.monotonic() > deadline:
                raise TimeoutError(f"{self.skill} still runs after {timeout:g} s")
        return self._goal.outcome()

    def follow(self) -> Iterator[Feedback | None]:
        """Yield feedback as it comes until the goal has ended; None when there has been none for a moment.

        Raises:
            ConnectionLostError: The sim was restarted and does not know the goal.
            ServiceUnavailableError: The sim went away and did not come back.
        """
        checked = time.monotonic()
        while True:
            # Waiting in slices keeps Ctrl-C alive.
            with self._changed:
                self._changed.wait_for(self._has_news, _SLICE_SECONDS)
                final, lost = self._goal.status.final, self._lost
            while self._feedback:
                yield self._feedback.popleft()
            if final:
                return
            if lost:
                self._robot.wait_until_back()
                self._lost = False
                self._look_up()
            elif time.monotonic() - checked > _CHECK_SECONDS:
                # News may be dropped on a crowded link; the ledger is not.
                checked = time.monotonic()
                self._look_up()
            yield None

    def _has_news(self) -> bool:
        return self._lost or self._goal.status.final or bool(self._feedback)

    def _look_up(self) -> None:
        try:
            self.hear(self._robot.result(self.skill, self.id))
        except UnknownGoalError:
            raise ConnectionLostError(
                f"the sim was restarted while {self.skill} ran and does not know it any more; look what is done",
                evidence=ConnectionEvidence(robot_id=self._robot.id, restarted=True),
            ) from None

    # What the robot tells it, from Zenoh's threads.

    def hear(self, news: Goal | Feedback) -> None:
        """Take news."""
        with self._changed:
            if isinstance(news, Feedback):
                self._feedback.append(news)
            elif not self._goal.status.final:
                self._goal = news
                if news.status.final:
                    self._robot.forget(self)
            self._changed.notify_all()

    def lose(self) -> None:
        """The sim is gone."""
        with self._changed:
            self._lost = True
            self._changed.notify_all()


class RemoteRobot:
    """One robot of a sim process.

    Attributes:
        id: Its id.
        ctx: What agents use in place of an `AgentContext`.
    """

    def __init__(self, client: Client, robot_id: str) -> None:
        self.id = robot_id
        self.ctx = RemoteContext(self)
        self._client = client
        self._session = client.session
        self._goals: dict[str, set[RemoteGoal]] = {}
        self._info: Info | None = None
        self._token = self._session.liveliness().declare_token(key(robot_id, "client", client.id))
        self._news = self._session.declare_subscriber(key(robot_id, "goal", "*", "*"), self._on_news)
        self._skills = [RemoteSkill(self, item) for item in self.info().skills]

    # What it is.

    def info(self) -> Info:
        """Ask what it is: joints, cameras, skills, the loaded task."""
        self._info = self.ask("info", Ask(), Info)
        return self._info

    @property
    def skills(self) -> list[RemoteSkill]:
        """Its skills, for planners and agents."""
        return self._skills

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

    def truth(self) -> TrueState:
        """Return the simulated state.

        Raises:
            ForbiddenError: The sim was started with --no-ground-truth.
        """
        return self.ask("truth", Ask(), TrueState)

    def picture(self, camera: str, *, depth: bool = False, format: str | None = None) -> tuple[bytes, Picture]:
        """Return a picture's bytes and what they are.

        Args:
            camera: Its name.
            depth: Distances in place of colours.
            format: jpeg, png or raw; JPEG for colours and raw for depth when left out.
        """
        parameters = f"?format={_plain('format', format)}" if format else ""
        sample = self._get(
            f"obs/camera/{_plain('camera', camera)}/{'depth' if depth else 'rgb'}{parameters}", None, _ANSWER_SECONDS
        )
        attachment = sample.attachment
        return sample.payload.to_bytes(), Picture.read(attachment.to_bytes() if attachment else b"")

    def watch(self, suffix: str, handler: Callable[[zenoh.Sample], None]) -> zenoh.Subscriber[None]:
        """Subscribe to one of the robot's keys, "obs/state" for example; undeclare what is returned to end it."""
        return self._session.declare_subscriber(key(self.id, suffix), handler)

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
    ) -> RemoteGoal:
        """Send a goal and return when the sim has accepted it.

        Args:
            skill: Its name.
            arguments: As its schema says.
            timeout: Simulated seconds after which the skill is stopped.
            queue: Wait behind the running goal in place of a BusyError.
            goal_id: A UUID of one's own; sent again with it a goal runs once.
            boot_id: The sim process that the goal is meant for; another one refuses it.

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

    def reset(self, seed: int | None = None, *, checkpoint: str | None = None) -> TrueState:
        """Start over with a seed's layout, or go back to a checkpoint.

        Raises:
            BusyError: A goal runs.
            InputError: The seed or checkpoint is wrong.
        """
        fields = {"seed": 0 if seed is None and checkpoint is None else seed, "checkpoint": checkpoint}
        return self._change("reset", Reset, fields, TrueState)

    def checkpoint(self) -> str:
        """Keep the world as it is, in the sim; return the name for `reset`."""
        return self.ask("checkpoint", Ask(), Saved).checkpoint

    def load(
        self, task: str | None = None, *, document: Mapping[str, Any] | None = None, robot: str | None = None
    ) -> TrueState:
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
        state = self._change("load", Load, fields, TrueState)
        self._skills = [RemoteSkill(self, item) for item in self.info().skills]
        return state

    def step(self, seconds: float) -> TrueState:
        """Let simulated time pass, the arm holding."""
        return self._change("clock", Clock, {"step": seconds, "client_id": self._client.id}, TrueState)

    def set_pace(self, pace: str) -> None:
        """Let simulated time pass at `realtime` or `fast` for as long as this client lives."""
        self._change("clock", Clock, {"pace": pace, "client_id": self._client.id}, TrueState)

    # Presence.

    def wait_until_back(self) -> None:
        """Wait for the sim to be there.

        Raises:
            ServiceUnavailableError: It did not come within the client's reconnect time.
        """
        self._client.wait_for(self.id, self._client.reconnect)

    def on_presence(self, came: bool) -> None:
        """Take note that the sim came or went; from Zenoh's thread."""
        if not came:
            for goal in self._followed(*self._goals):
                goal.lose()

    def close(self) -> None:
        """Leave this robot."""
        self._news.undeclare()
        self._token.undeclare()

    # Asking.

    def ask(self, suffix: str, message: Message, answer: type[MessageT], timeout: float = _ANSWER_SECONDS) -> MessageT:
        """Send a request that may be sent twice, and return its answer; waits for a sim that is away.

        Raises:
            SkillError: The sim refuses; a ForbiddenError when access control keeps the request from it.
            ServiceUnavailableError: No sim answered.
        """
        return decode(self._get(suffix, message, timeout).payload.to_bytes(), answer)

    def _change(self, suffix: str, model: type[Message], fields: Mapping[str, Any], answer: type[MessageT]) -> MessageT:
        try:
            return self.ask(suffix, _message(model, **fields), answer, _LOAD_SECONDS)
        except (InvalidArgumentError, InvalidMessageError) as error:
            raise InputError(error.message) from None

    def _get(self, suffix: str, message: Message | None, timeout: float) -> zenoh.Sample:
        payload = message.encode() if message is not None else None
        give_up = time.monotonic() + self._client.reconnect
        denied_since: float | None = None
        while True:
            for reply in self._session.get(key(self.id, suffix), payload=payload, timeout=timeout):
                if reply.ok is not None:
                    return reply.ok
                raise _error(reply.err.payload.to_bytes() if reply.err else b"", self.id)
            # No answer at all: nobody is there, a connection in the making has not brought the key yet, or access
            # control hides it, which a sim that goes on answering `info` tells.
            now = time.monotonic()
            denied_since = (denied_since or now) if self._answers_info() else None
            if denied_since is not None and now - denied_since > _DENIED_SECONDS:
                raise ForbiddenError(
                    f"{suffix.partition('?')[0]}: the sim of {self.id!r} is there and does not let this client ask it; "
                    "its access control wants other credentials, such as an operator's"
                )
            left = give_up - now
            if left <= 0.0:
                raise ServiceUnavailableError(f"the sim of {self.id!r} does not answer on {suffix}")
            self._client.wait_for(self.id, left)
            time.sleep(_POLL_SECONDS)

    def _answers_info(self) -> bool:
        replies = self._session.get(key(self.id, "info"), timeout=_ANSWER_SECONDS)
        return any(reply.ok is not None for reply in replies)

    def _on_news(self, sample: zenoh.Sample) -> None:
        *_, goal_id, kind = str(sample.key_expr).split("/")
        followed = self._followed(goal_id)
        if not followed or kind not in ("status", "feedback"):
            return
        payload = sample.payload.to_bytes()
        news = decode(payload, Goal) if kind == "status" else decode(payload, Feedback)
        for goal in followed:
            goal.hear(news)

    def _followed(self, *goal_ids: str) -> list[RemoteGoal]:
        return [goal for goal_id in goal_ids for goal in tuple(self._goals.get(goal_id, ()))]


def _error(payload: bytes, robot_id: str) -> Exception:
    """Return the exception that an error reply stands for."""
    if payload == b"Timeout":
        return ServiceUnavailableError(f"the sim of {robot_id!r} did not answer in time")
    try:
        return ErrorRecord.model_validate(from_json(payload)).exception()
    except (ValueError, ValidationError):
        return ServiceUnavailableError(f"the sim of {robot_id!r} answered {payload[:80]!r}, which is no message")


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
