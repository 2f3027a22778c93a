"""Pickers for task and robot."""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path

import viser

from robosandbox.apps.viewer import html
from robosandbox.apps.viewer.control import Control
from robosandbox.apps.viewer.news import Complaint, Loaded, News
from robosandbox.apps.viewer.source import WorldSource
from robosandbox.tasks.loader import bundled_tasks

_OWN = "the task's own"
_FILE = "a file"


class WorldPanel:
    """Loads another task, another robot, or both.

    Args:
        server: Where.
        source: What is shown now.
        control: Loads.
    """

    def __init__(self, server: viser.ViserServer, source: WorldSource, control: Control) -> None:
        self._source = source
        self._control = control
        gui = server.gui
        self._about = gui.add_html("")
        tasks = (*bundled_tasks(), _FILE)
        loaded = source.host.cell.task.name
        self._task = gui.add_dropdown("Task", tasks, initial_value=loaded if loaded in tasks else _FILE)
        self._task_file = gui.add_text("Task file", "", hint="A task's YAML file", visible=self._task.value == _FILE)
        self._robot = gui.add_dropdown("Robot", (_OWN, *known_robots(), _FILE), initial_value=_OWN)
        self._robot_file = gui.add_text(
            "Robot file", "", hint="A URDF or MJCF file, or menagerie:<name>; its sidecar lies beside it", visible=False
        )
        load = gui.add_button("Load", icon=viser.Icon.DOWNLOAD)
        self._task.on_update(lambda _: self._show_files())
        self._robot.on_update(lambda _: self._show_files())
        load.on_click(lambda _: self._load())
        self._describe()

    def hear(self, news: News) -> None:
        """Take news."""
        if isinstance(news, Loaded):
            self._describe()

    def _show_files(self) -> None:
        self._task_file.visible = self._task.value == _FILE
        self._robot_file.visible = self._robot.value == _FILE

    def _load(self) -> None:
        task = self._task_file.value.strip() if self._task.value == _FILE else self._task.value
        robot = {_OWN: None, _FILE: self._robot_file.value.strip()}.get(self._robot.value, self._robot.value)
        if not task or robot == "":
            self._control.tell(Complaint("give the path of the file to load"))
            return
        self._control.load(str(Path(task).expanduser()), None if robot is None else str(Path(robot).expanduser()))

    def _describe(self) -> None:
        work = self._source.host.cell
        blueprint = self._source.blueprint
        there = ", ".join(item.id for item in blueprint.scene.objects) or "none"
        pairs = [
            ("task", work.task.name),
            ("robot", work.robot_name),
            ("objects", there),
            ("world", self._source.title),
        ]
        self._about.content = html.block(html.rows(pairs))


def known_robots() -> tuple[str, ...]:
    """Return the names that `--robot` takes without a file: bundled robots, and those of MuJoCo Menagerie if it is there."""
    folder = Path(str(resources.files("robosandbox.robots")))
    bundled = sorted(path.parent.name for path in folder.glob("*/*.xml"))
    return (*bundled, *(f"menagerie:{name}" for name in _menagerie()))


def _menagerie() -> list[str]:
    root = os.environ.get("MENAGERIE_ROOT")
    if root is not None:
        return sorted(path.parent.name for path in Path(root).glob("*/scene.xml"))
    try:
        import mujoco_menagerie  # pyright: ignore[reportMissingImports]
    except ImportError:
        return []
    return sorted(mujoco_menagerie.names())
