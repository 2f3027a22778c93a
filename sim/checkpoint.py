"""A world's whole state as a value: for undoing, and for surviving the end of the process."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from pydantic import Field

from robosandbox.errors import InputError
from robosandbox.types import Finite, Scene, StrictModel
from robosandbox.validation import validate

_VERSION = 1


class Checkpoint(StrictModel):
    """Everything that the future of a simulated world depends on.

    Attributes:
        seed: The layout.
        scene: Robot and objects as last reset.
        start: State vector after that reset, which success is judged against.
        state: MuJoCo's integration state.
        physics_steps: Since the last reset.
    """

    seed: int
    scene: Scene
    start: tuple[Finite, ...]
    state: tuple[Finite, ...]
    physics_steps: int


class SavedWorld(StrictModel):
    """What a state file holds.

    Attributes:
        version: Of the format.
        mujoco: The version that simulated it.
        task: The loaded task, as its YAML would have it.
        checkpoint: The world.
        goals: The ledger.
    """

    version: int = _VERSION
    mujoco: str
    task: dict[str, Any]
    checkpoint: Checkpoint
    goals: list[dict[str, Any]] = Field(default_factory=list)


class StateFile:
    """A file that is always either the old or the new state, whenever the process dies."""

    def __init__(self, path: Path) -> None:
        """Use this file.

        Raises:
            InputError: Its folder is missing or cannot be written to.
        """
        self.path = path.absolute()
        if not self.path.parent.is_dir():
            raise InputError(f"--state-file: the folder of {str(path)!r} does not exist; make it first")
        if not os.access(self.path.parent, os.W_OK):
            raise InputError(f"--state-file: the folder of {str(path)!r} cannot be written to")

    def load(self) -> SavedWorld | None:
        """Return what was saved, None when nothing was.

        Raises:
            InputError: The file holds something else.
        """
        try:
            text = self.path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise InputError(f"--state-file: {self.path.name} cannot be read: {error.strerror}") from None
        try:
            data = json.loads(text)
        except ValueError:
            raise InputError(f"--state-file: {self.path.name} is no state file; name another or remove it") from None
        found = validate(data, SavedWorld, source=self.path.name)
        if found.version != _VERSION:
            raise InputError(
                f"{self.path.name}: is of version {found.version}, this program writes {_VERSION}; remove it"
            )
        return found

    def save(self, world: SavedWorld) -> None:
        """Replace the file's content."""
        new = self.path.with_name(f".{self.path.name}.new")
        with open(new, "wb") as file:
            file.write(world.model_dump_json().encode())
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, self.path)
