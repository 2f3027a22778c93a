"""Resets, loads and steps of the clock: one at a time, while no goal runs, and each can be given up."""

from __future__ import annotations

import threading
from collections.abc import Callable

from robosandbox.errors import BusyError, CancelledError
from robosandbox.evidence import BusyEvidence
from robosandbox.workcell.zenoh.messages import Message
from robosandbox.workcell.zenoh.server.goals import Ledger
from robosandbox.workcell.zenoh.server.requests import Request


class WorldChanges:
    """Runs what changes the world besides goals.

    Args:
        ledger: Whose goals go first.
        order: Runs a job in the world's thread.
    """

    def __init__(self, ledger: Ledger, order: Callable[[Callable[[], None]], None]) -> None:
        self._ledger = ledger
        self._order = order
        self._lock = threading.Lock()
        self._given_up = threading.Event()
        self._client_id: str | None = None
        self.doing: str | None = None

    def occupation(self) -> str | None:
        """Return what the robot is busy with: a goal's skill or a change; None when it is free."""
        return self._ledger.doing() or self.doing

    def begin(self, name: str, request: Request, job: Callable[[], Message], *, client_id: str | None = None) -> None:
        """Run a job in the world's thread and answer with what it returns or raises.

        Args:
            name: What it is, for people who meet a busy robot.
            request: Answered when the job has ended.
            job: Calls `check` often.
            client_id: The client whose loss ends it.

        Raises:
            BusyError: A goal runs, or another change.
        """
        with self._lock:
            doing = self.occupation()
            if doing is not None:
                live = self._ledger.live()
                stopping = self._ledger.is_stopping() if live else self._given_up.is_set()
                what = "it is being stopped; wait for its end" if stopping else "cancel it or wait for it"
                raise BusyError(
                    f"the robot is busy with {doing}; {what}",
                    evidence=BusyEvidence(
                        doing=doing, goal_id=live[0] if live else None, waiting=max(0, len(live) - 1)
                    ),
                )
            self.doing, self._client_id = name, client_id
            self._given_up.clear()

        def run() -> Message:
            try:
                return job()
            finally:
                # Before the answer is sent: whoever has it may go on.
                with self._lock:
                    self.doing = self._client_id = None
                    self._given_up.clear()

        self._order(lambda: request.run(run))

    def cancel(self) -> None:
        """Give up the change that runs or waits; nothing where there is none."""
        with self._lock:
            if self.doing is not None:
                self._given_up.set()

    def lose(self, client_id: str) -> None:
        """Give up the change that a client wanted which is gone."""
        with self._lock:
            if self.doing is not None and self._client_id == client_id:
                self._given_up.set()

    def check(self) -> None:
        """Go on, or give up.

        Raises:
            CancelledError: Somebody gave up the change, its client is lost, or the process is to end.
        """
        if self._given_up.is_set():
            raise CancelledError(f"{self.doing or 'the change'} was given up; look how the world is now")
