"""Saving the served world: at each goal's end, after each change, every few seconds; goals as they are accepted."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from robosandbox.errors import InputError
from robosandbox.values import frozen
from robosandbox.workcell.loop import Loop
from robosandbox.workcell.studio import Read
from robosandbox.workcell.zenoh.messages import Goal
from robosandbox.workcell.zenoh.server.checkpoint import SavedWorld, StateFile
from robosandbox.workcell.zenoh.server.journal import Acceptance, Journal

_log = logging.getLogger(__name__)
_PERIOD_SECONDS = 2.0

# Returns the world as a value, a goal that is about to end in it as ended; in the world's thread.
Freeze = Callable[[Goal | None], SavedWorld]


@frozen
class _Frozen:
    number: int
    world: SavedWorld


class Autosave:
    """Keeps a state file at the newest state.

    Args:
        file: Where; None to save nothing.
        read: Runs a job in the world's thread, between control ticks.
        freeze: Returns what is to be saved.
    """

    def __init__(self, file: StateFile | None, read: Read, freeze: Freeze) -> None:
        self._file = file
        self._journal = Journal(file.journal) if file is not None else None
        self._read = read
        self._freeze = freeze
        self._writing = threading.Lock()
        self._frozen = 0
        self._saved = 0
        self._loop = Loop("autosave", self._save_again)

    def start(self) -> None:
        """Save now, before the world's thread starts, and every few seconds from now on.

        Raises:
            InputError: The state cannot be saved.
        """
        if self._file is None or self._journal is None:
            return
        try:
            # The goals of the process before are in the state from here on, and the journal can begin anew.
            self._file.save(self._take().world)
            self._journal.start()
        except OSError as error:
            raise InputError(f"--state-file: {self._file.path} cannot be written: {error.strerror}") from None
        self._loop.start()

    def stop(self) -> None:
        """End the periodic saving; wait for one that is under way."""
        self._loop.stop()
        if self._journal is not None:
            self._journal.stop()

    def keep(self, acceptance: Acceptance) -> None:
        """Write an accepted goal down, so that the death of the process does not lose it.

        Raises:
            OSError: It could not be written.
        """
        if self._journal is not None:
            self._journal.keep(acceptance)

    def when_flushed(self, act: Callable[[], None]) -> None:
        """Call something, in order, when all goals kept until now would outlive a power cut; at once without a file."""
        if self._journal is None:
            act()
        else:
            self._journal.when_flushed(act)

    def save(self, ended: Goal | None = None) -> None:
        """Save the world as it is; in the world's thread, or when it has ended.

        Args:
            ended: A goal as it ends, before anybody hears of it: a step that somebody knows to be done is never undone
                by a restart.
        """
        if self._file is not None:
            self._write(self._take(ended), self._file)

    def _take(self, ended: Goal | None = None) -> _Frozen:
        self._frozen += 1
        return _Frozen(self._frozen, self._freeze(ended))

    def _write(self, frozen: _Frozen, file: StateFile) -> None:
        with self._writing:
            # The autosave's thread may come late with a state from before a goal's end.
            if frozen.number <= self._saved:
                return
            try:
                file.save(frozen.world)
                self._saved = frozen.number
                if self._journal is not None:
                    self._journal.forget(frozen.world.accepted)
            except OSError as error:
                _log.error("the state was not saved in %s: %s", file.path, error.strerror)

    def _save_again(self) -> float:
        """Save the world as it is between two control ticks; return in how many seconds to do so again."""
        taken: list[_Frozen] = []
        ready = threading.Event()

        def take() -> None:
            taken.append(self._take())
            ready.set()

        self._read(take)
        while not ready.wait(0.1):
            if self._loop.stopping:
                return _PERIOD_SECONDS
        if self._file is not None:
            self._write(taken.pop(), self._file)
        return _PERIOD_SECONDS
