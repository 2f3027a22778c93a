"""The connection of a REPL to a sim process: says when the sim goes and comes back."""

from __future__ import annotations

import sys
from collections.abc import Callable

from robosandbox.workcell.zenoh.client import Client, RemoteRobot
from robosandbox.workcell.zenoh.messages import Goal, GoalRef


class Link:
    """Watches a sim.

    Args:
        client: Sees sims come and go.
        robot: The one that matters.

    Attributes:
        tell: Called with a line when it goes or comes, in a thread of Zenoh.
    """

    def __init__(self, client: Client, robot: RemoteRobot) -> None:
        self.tell: Callable[[str], None] = _tell_on_stderr
        self._client = client
        self._robot = robot
        self._there = True
        client.listeners.append(self._on_presence)

    @property
    def robot_id(self) -> str:
        """The robot's name in the sim's keys."""
        return self._robot.id

    @property
    def away(self) -> bool:
        """True while the sim is gone."""
        return not self._client.is_present(self._robot.id)

    @property
    def patience(self) -> float:
        """Seconds that a command waits for a sim that is away."""
        return self._client.reconnect

    def cancel_running(self) -> str | None:
        """Stop what the robot does, whoever asked for it; return the skill, None when nothing runs."""
        state = self._robot.state()
        if state.goal_id is None or state.skill is None:
            return None
        self._robot.ask(f"skill/{state.skill}/cancel_goal", GoalRef(goal_id=state.goal_id), Goal)
        return state.skill

    def _on_presence(self, robot_id: str, came: bool) -> None:
        if robot_id != self._robot.id or came is self._there:
            return
        self._there = came
        if came:
            self.tell(f"the sim of {robot_id!r} is back")
        else:
            self.tell(f"the sim of {robot_id!r} went away; commands wait {self.patience:g} s for it to come back")


def _tell_on_stderr(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
