"""Sims from another process: found by their liveliness, called through the same skills, waited for when they restart.

with connect("tcp/127.0.0.1:7447") as client:
    robot = client.robot()
    robot.send("pick", {"object": "red_cube"}).wait()
"""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Self

import zenoh

from robosandbox.errors import InputError, ServiceUnavailableError
from robosandbox.validation import did_you_mean
from robosandbox.workcell.zenoh.client.goal import RemoteGoal
from robosandbox.workcell.zenoh.client.robot import RemoteRobot
from robosandbox.workcell.zenoh.messages import DEFAULT_ENDPOINT, key, robot_of
from robosandbox.workcell.zenoh.transport import check_process, is_forked, open_connector

__all__ = ["Client", "RemoteGoal", "RemoteRobot", "connect"]

_log = logging.getLogger(__name__)

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
        self.id: str = str(uuid.uuid4())
        self.reconnect = reconnect
        self.listeners: list[OnPresence] = []
        self._session = session
        self._present: set[str] = set()
        self._closed = False
        self._changed = threading.Condition()
        self._meeting = threading.Lock()
        self._robots: dict[str, RemoteRobot] = {}
        self._watch = session.liveliness().declare_subscriber(key("*", "alive"), self._on_alive, history=True)

    @property
    def session(self) -> zenoh.Session:
        """The Zenoh session.

        Raises:
            ServiceUnavailableError: This process was forked from the one that connected.
        """
        check_process()
        return self._session

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
        with self._meeting:
            # Asks the sim what it is, which takes a while: presence goes on being heard.
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
            ServiceUnavailableError: It did not come in time, or this client was closed.
        """
        with self._changed:
            there = self._changed.wait_for(lambda: self._closed or robot_id in self._present, timeout)
            if self._closed:
                raise ServiceUnavailableError(f"this client of {robot_id!r} was closed; connect again")
            if not there:
                raise ServiceUnavailableError(
                    f"the sim of {robot_id!r} went away and did not come back within {round(timeout, 1):g} s"
                )

    def is_present(self, robot_id: str) -> bool:
        """Tell whether a robot is there now."""
        return robot_id in self._present

    def close(self) -> None:
        """Leave; goals of this client that still run are cancelled, and threads that wait for a sim wait no longer.

        In a forked process there is nothing to leave: the connection is that of the process before it.
        """
        if is_forked():
            return
        with self._changed:
            self._closed = True
            self._changed.notify_all()
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
                self._present.add(robot_id)
            else:
                self._present.discard(robot_id)
            self._changed.notify_all()
        robot = self._robots.get(robot_id)
        _log.info("robot %s %s", robot_id, "is there" if came else "is gone")
        if robot is not None:
            robot.on_presence(came)
        for listener in tuple(self.listeners):
            listener(robot_id, came)
