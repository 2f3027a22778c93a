"""Publishers of a sim: state at 50 Hz, objects and pictures while somebody listens, events of goals."""

from __future__ import annotations

import itertools
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import zenoh
from zenoh import ext

from robosandbox.errors import InvalidMessageError
from robosandbox.evidence import MessageEvidence
from robosandbox.validation import did_you_mean
from robosandbox.workcell.loop import Loop
from robosandbox.workcell.pictures import ENCODINGS, Format, Kind
from robosandbox.workcell.studio import Read, Shot, Studio
from robosandbox.workcell.zenoh.messages import (
    JSON,
    STATE_HZ,
    Camera,
    Feedback,
    Goal,
    GoalIntent,
    Message,
    Picture,
    key,
)
from robosandbox.workcell.zenoh.server.requests import Request

# Looks a second while somebody listens to `obs/objects`; chosen because a look through cameras takes 0.1 s and more.
_OBJECTS_HZ = 5.0


class _Origin:
    """Numbers what an entity of the sim's session publishes: clients believe what comes from that session."""

    def __init__(self, entity: zenoh.EntityGlobalId) -> None:
        self._entity = entity
        self._numbers = itertools.count()

    def next(self) -> zenoh.SourceInfo:
        """Return what goes with the next publication."""
        return zenoh.SourceInfo(self._entity, next(self._numbers))


class _Stream(ABC):
    """Asks the world's thread for a message at a steady rate, and publishes.

    At most one question is open: a planning skill answers none for a while.
    """

    def __init__(self, name: str, hz: float, read: Read, look: Callable[[], Message]) -> None:
        self._read = read
        self._look = look
        self._asked = False
        # A question that is open as the stream ends is answered while its publisher is undeclared, which Zenoh does not allow.
        self._using, self._ended = threading.Lock(), False
        self._loop = Loop(name, self._act, hz=hz)

    def start(self) -> None:
        """Begin."""
        self._loop.start()

    def stop(self) -> None:
        """End."""
        self._loop.stop()
        with self._using:
            self._ended = True
            self._undeclare()

    def _act(self) -> float:
        self._tick()
        return 0.0

    def _ask(self) -> None:
        if not self._asked:
            self._asked = True
            self._read(self._take)

    def _take(self) -> None:
        try:
            message = self._look()
            with self._using:
                if not self._ended:
                    self._hear(message)
        finally:
            self._asked = False

    @abstractmethod
    def _tick(self) -> None: ...

    @abstractmethod
    def _hear(self, message: Message) -> None: ...

    @abstractmethod
    def _undeclare(self) -> None: ...


class StateStream(_Stream):
    """Publishes the robot's state, the last message kept for late joiners; while a skill plans, it repeats what it knows."""

    def __init__(self, session: zenoh.Session, robot_id: str, read: Read, look: Callable[[], Message]) -> None:
        super().__init__("state", STATE_HZ, read, look)
        self._publisher = ext.declare_advanced_publisher(
            session,
            key(robot_id, "obs", "state"),
            encoding=JSON,
            congestion_control=zenoh.CongestionControl.DROP,
            cache=ext.CacheConfig(max_samples=1),
            # Has samples carry where they come from.
            sample_miss_detection=ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
        )
        self._latest: Message | None = None
        self._seq = 0

    def _tick(self) -> None:
        if self._latest is not None:
            self._seq += 1
            self._publisher.put(self._latest.model_copy(update={"seq": self._seq}).encode())
        self._ask()

    def _hear(self, message: Message) -> None:
        self._latest = message

    def _undeclare(self) -> None:
        self._publisher.undeclare()


class ObjectStream(_Stream):
    """Publishes what perception sees, while somebody listens."""

    def __init__(self, session: zenoh.Session, robot_id: str, read: Read, look: Callable[[], Message]) -> None:
        super().__init__("objects", _OBJECTS_HZ, read, look)
        self._publisher = session.declare_publisher(
            key(robot_id, "obs", "objects"), encoding=JSON, congestion_control=zenoh.CongestionControl.DROP
        )
        self._origin = _Origin(self._publisher.id)

    def _tick(self) -> None:
        if self._publisher.matching_status:
            self._ask()

    def _hear(self, message: Message) -> None:
        self._publisher.put(message.encode(), source_info=self._origin.next())

    def _undeclare(self) -> None:
        self._publisher.undeclare()


class GoalNews:
    """Publishes status and feedback of goals.

    Nothing is declared per goal: Zenoh keeps some memory of each key that was ever declared, and goals have no end. Late
    joiners ask `get_result`.
    """

    def __init__(self, session: zenoh.Session, robot_id: str) -> None:
        self._session = session
        self._robot_id = robot_id
        self._origin = _Origin(session.id)

    def status(self, goal: Goal) -> None:
        """Publish how far a goal is."""
        self._put(goal.goal_id, "status", goal)

    def feedback(self, feedback: Feedback) -> None:
        """Publish that a phase begins."""
        self._put(feedback.goal_id, "feedback", feedback)

    def intent(self, intended: GoalIntent) -> None:
        """Publish what a goal is about to do."""
        self._put(intended.goal_id, "intent", intended)

    def _put(self, goal_id: str, name: str, message: Message) -> None:
        self._session.put(
            key(self._robot_id, "goal", goal_id, name),
            message.encode(),
            encoding=JSON,
            congestion_control=zenoh.CongestionControl.DROP,
            source_info=self._origin.next(),
        )


class CameraStreams:
    """Publishes pictures of the cameras that somebody listens to, and answers single requests for one."""

    def __init__(self, session: zenoh.Session, robot_id: str, studio: Studio) -> None:
        self._session = session
        self._robot_id = robot_id
        self._studio = studio
        self._cameras: tuple[str, ...] = ()
        self._publishers: dict[tuple[str, Kind], zenoh.Publisher] = {}

    def follow(self, cameras: Sequence[Camera]) -> None:
        """Offer these cameras from now on."""
        self._cameras = tuple(camera.name for camera in cameras)
        for name, kind in [view for view in self._publishers if view[0] not in self._cameras]:
            self._studio.stream(_streamed(name, kind), None)
            self._publishers.pop((name, kind)).undeclare()
        kinds: tuple[Kind, ...] = ("rgb", "depth")
        for name in self._cameras:
            for kind in kinds:
                if (name, kind) not in self._publishers:
                    self._offer(name, kind)

    def close(self) -> None:
        """Offer nothing any more."""
        self.follow(())

    def on_request(self, request: Request) -> None:
        """Answer with one picture; the parameter `format` is jpeg, png or raw."""
        _, _, _, _, name, kind = request.key.split("/")
        if name not in self._cameras:
            problem = f"no camera {name[:60]!r}; there is {', '.join(self._cameras)}{did_you_mean(name, self._cameras)}"
            raise InvalidMessageError(problem, evidence=MessageEvidence(field="camera", problem=problem))
        shot = Shot(name, "rgb" if kind == "rgb" else "depth", _format(request, kind))
        encoding = ENCODINGS[shot.format]

        def deliver(payload: bytes, attachment: Picture) -> None:
            request.deliver(payload, encoding, attachment)

        self._studio.request(shot, deliver, request.refuse)

    def _offer(self, name: str, kind: Kind) -> None:
        shot = _streamed(name, kind)
        publisher = self._session.declare_publisher(
            key(self._robot_id, "obs", "camera", name, kind),
            encoding=ENCODINGS[shot.format],
            congestion_control=zenoh.CongestionControl.DROP,
        )
        self._publishers[name, kind] = publisher
        origin = _Origin(publisher.id)

        def deliver(payload: bytes, attachment: Picture) -> None:
            publisher.put(payload, attachment=attachment.encode(), source_info=origin.next())

        def match(status: zenoh.MatchingStatus) -> None:
            self._studio.stream(shot, deliver if status.matching else None)

        publisher.declare_matching_listener(match)


def _streamed(name: str, kind: Kind) -> Shot:
    return Shot(name, kind, "jpeg" if kind == "rgb" else "raw")


def _format(request: Request, kind: str) -> Format:
    asked = request.parameters.get("format") or ("jpeg" if kind == "rgb" else "raw")
    allowed: tuple[Format, ...] = ("jpeg", "png", "raw") if kind == "rgb" else ("png", "raw")
    for name in allowed:
        if asked == name:
            return name
    problem = f"{str(asked)[:20]!r} is not one of {', '.join(allowed)}"
    raise InvalidMessageError(f"format: {problem}", evidence=MessageEvidence(field="format", problem=problem))
