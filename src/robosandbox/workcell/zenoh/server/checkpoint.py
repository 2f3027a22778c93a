"""The state file: a served world and its goals, for surviving the end of the process."""

from __future__ import annotations

import os
import uuid
from collections import OrderedDict
from pathlib import Path
from typing import Any, Final, Literal

from pydantic_core import from_json

from robosandbox.errors import InputError
from robosandbox.types import Checkpoint, StrictModel
from robosandbox.validation import validate
from robosandbox.workcell.zenoh.messages import KEPT_CHECKPOINTS, Count
from robosandbox.workcell.zenoh.server.journal import KeptGoal, flush_folder, read_file, read_journal

# Of the state file's format; 3 because goals in it are of protocol 2.
_VERSION: Final = 3
# Bytes of a state file; chosen because a crowded scene has some ten thousand numbers, and the ledger's goals have arguments.
_MOST_BYTES = 64_000_000


class SavedWorld(StrictModel):
    """Content of a state file.

    Attributes:
        version: Of the format.
        boot_id: The process that saved it.
        mujoco: The version that simulated it.
        task: The loaded task, as its YAML would have it.
        checkpoint: The world.
        goals: The ledger, and once it is loaded what the journal has beyond that.
        accepted: How many goals the process had accepted; later ones are in its journal.
    """

    version: Literal[3] = _VERSION
    boot_id: str
    mujoco: str
    task: dict[str, Any]
    checkpoint: Checkpoint
    goals: tuple[KeptGoal, ...] = ()
    accepted: Count = 0


class KeptCheckpoints:
    """The last checkpoints that clients asked for, by name."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, Checkpoint] = OrderedDict()

    def keep(self, checkpoint: Checkpoint) -> str:
        """Return the name of a new checkpoint; the oldest one is forgotten where there are too many."""
        name = uuid.uuid4().hex
        self._kept[name] = checkpoint
        while len(self._kept) > KEPT_CHECKPOINTS:
            self._kept.popitem(last=False)
        return name

    def find(self, name: str) -> Checkpoint:
        """Return a checkpoint.

        Raises:
            InputError: There is none of this name, or no longer.
        """
        found = self._kept.get(name)
        if found is None:
            raise InputError(f"checkpoint: {name!r} is none of the last {KEPT_CHECKPOINTS}; ask checkpoint for one")
        return found


class StateFile:
    """A file that is always either the old or the new state, whenever the process dies."""

    def __init__(self, path: Path) -> None:
        """Use this file.

        Raises:
            InputError: Its folder is missing or cannot be written to.
        """
        self.path: Path = path.absolute()
        if not self.path.parent.is_dir():
            raise InputError(f"--state-file: the folder of {str(path)!r} does not exist; make it first")
        if not os.access(self.path.parent, os.W_OK):
            raise InputError(f"--state-file: the folder of {str(path)!r} cannot be written to")

    @property
    def journal(self) -> Path:
        """The file beside it to which goals are written as they are accepted."""
        return self.path.with_name(f"{self.path.name}.goals")

    def load(self) -> SavedWorld | None:
        """Return what was saved, with the goals that were accepted later; None when nothing was.

        Raises:
            InputError: The file holds something else, or is damaged.
        """
        if not os.path.lexists(self.path):
            return None
        text = read_file(self.path, _MOST_BYTES)
        try:
            data = from_json(text)
        except ValueError:
            raise InputError(f"--state-file: {self.path.name} is no state file; name another or remove it") from None
        version = data.get("version", _VERSION) if isinstance(data, dict) else _VERSION
        if version != _VERSION:
            raise InputError(
                f"--state-file: {self.path.name} is of version {str(version)[:20]!r}, this program reads {_VERSION}; "
                "remove it"
            )
        try:
            found = validate(data, SavedWorld, source=self.path.name)
        except InputError as error:
            raise InputError(f"--state-file: {error}; the file is damaged: remove it or bring back a copy") from None
        later = read_journal(self.journal, found.boot_id, found.accepted)
        known = {item.goal.goal_id for item in found.goals}
        goals = (*found.goals, *(item for item in later if item.goal.goal_id not in known))
        return found.model_copy(update={"goals": goals})

    def save(self, world: SavedWorld) -> None:
        """Replace the file's content."""
        new = self.path.with_name(f".{self.path.name}.new")
        with open(new, "wb") as file:
            file.write(world.model_dump_json().encode())
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, self.path)
        flush_folder(self.path.parent)
