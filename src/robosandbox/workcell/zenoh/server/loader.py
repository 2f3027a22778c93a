"""The tasks of a sim process: which ones clients may load, and a world that continues from a state file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from robosandbox.errors import InputError
from robosandbox.sim.objects import count_bodies, count_geoms
from robosandbox.tasks.loader import find_task
from robosandbox.tasks.task import Task
from robosandbox.types import Scene
from robosandbox.validation import validate
from robosandbox.workcell.embedded import EmbeddedWorkcell
from robosandbox.workcell.options import USUAL, WorkcellOptions
from robosandbox.workcell.session import open_workcell
from robosandbox.workcell.zenoh.messages import Load
from robosandbox.workcell.zenoh.server.checkpoint import SavedWorld

# Height and width of camera pictures, pixels; chosen as VGA, which a CPU draws nine times a second (benchmarks/service.py).
_PICTURE_SIZE = (480, 640)
# What a task over the wire may make: 300 loose boxes or 200 beads in two bins take 11 to 15 ms of CPU for a control tick of
# 10 ms and 0.3 to 1 s to load, measured on two cores. The largest bundled task, pour_beads, has a tenth of either.
MOST_BODIES = 300
# Geoms of such a task; chosen with the bodies above.
MOST_GEOMS = 800


class TaskLoader:
    """Opens the tasks that a sim process serves.

    Args:
        options: How; their task, robot and seed are those of the first one.
        allowed: Folders whose files clients may name in tasks; without any, clients load bundled robots and plain
            objects only.
    """

    def __init__(
        self,
        options: WorkcellOptions = USUAL,
        *,
        allowed: Sequence[Path] = (),
    ) -> None:
        self._options = replace(options, render_size=_PICTURE_SIZE)
        self._allowed = tuple(folder.resolve() for folder in allowed)

    def first(self) -> EmbeddedWorkcell:
        """Open the task that the person at this machine named."""
        return open_workcell(self._options)

    def open(self, task: Task | str) -> EmbeddedWorkcell:
        """Open a task as written."""
        unsaid = replace(self._options, scene=None, robot_base=None, robot=None, sidecar=None, arm=None, gripper=None)
        return open_workcell(replace(unsaid, task=task, seed=0))

    def resume(self, world: SavedWorld) -> EmbeddedWorkcell:
        """Open the task of a state file as it was left.

        Raises:
            InputError: The task cannot be loaded any more, or the state does not fit it.
        """
        task = validate(world.task, Task, source="--state-file: task")
        _check_same_robot(task.scene, world.checkpoint.scene)
        session = self.open(task)
        try:
            session.restore(world.checkpoint)
        except InputError as error:
            session.close()
            raise InputError(f"--state-file: {error}; the file is damaged: remove it or bring back a copy") from None
        return session

    def load(self, message: Load) -> tuple[Task, str | None]:
        """Return the task that a client asks for, and a robot in place of its own.

        Raises:
            InputError: There is none, it is wrong, names files that clients may not name, or is larger than a client's.
        """
        if message.document is None:
            task = find_task(str(message.task))
        else:
            task = validate(message.document, Task, source="document")
            self._check_files(task.scene)
            _check_amounts(task.scene)
        if message.robot is not None:
            self._check_file("robot", Path(message.robot))
        return task, message.robot

    def _check_files(self, scene: Scene) -> None:
        named = [("scene.robot_urdf", scene.robot_urdf), ("scene.robot_config", scene.robot_config)]
        named += [("scene.robot_gripper", scene.robot_gripper)]
        for index, arm in enumerate(scene.arms):
            named += [(f"scene.arms[{index}].robot_urdf", arm.robot_urdf)]
            named += [(f"scene.arms[{index}].robot_config", arm.robot_config)]
        named += [(f"scene.objects[{index}].mesh", item.mesh) for index, item in enumerate(scene.objects)]
        for field, path in named:
            if path is not None:
                self._check_file(field, path)

    def _check_file(self, field: str, path: Path) -> None:
        """Refuse a file outside the allowed folders; a bare name is a bundled robot's."""
        if len(path.parts) == 1 and not path.suffix and path.name not in (".", ".."):
            return
        found = path.resolve()
        if not any(found.is_relative_to(folder) for folder in self._allowed):
            raise InputError(
                f"{field}: {str(path)!r} is in no folder that clients may load from; start the sim with "
                "--allow-files FOLDER, or with the task itself"
            )


def _check_same_robot(task: Scene, saved: Scene) -> None:
    """Refuse a world that was saved with another robot or table than its task has."""
    for field in ("robot_urdf", "robot_config", "robot_arm", "robot_gripper", "table_height", "arms"):
        mine, theirs = getattr(task, field), getattr(saved, field)
        if mine != theirs:
            raise InputError(
                f"--state-file: checkpoint.scene.{field}: {str(theirs)[:60]!r} is not the task's, {str(mine)[:60]!r}; "
                "the file is damaged: remove it or bring back a copy"
            )


def _check_amounts(scene: Scene) -> None:
    """Refuse a scene whose physics would take the sim process for itself."""
    # Geoms are counted by making them, which is done for so many bodies only.
    for count, most, what in ((count_bodies, MOST_BODIES, "bodies"), (count_geoms, MOST_GEOMS, "shapes")):
        found = count(scene)
        if found > most:
            raise InputError(
                f"scene.objects: they are made of {found} {what}; a client's task may have 1 to {most}; give fewer "
                "objects or beads, or start the sim with the task itself"
            )
