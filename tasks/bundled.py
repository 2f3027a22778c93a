"""The bundled tasks: their files, and what a list says of each without building the task."""

from __future__ import annotations

from pathlib import Path

from robosandbox.errors import InputError
from robosandbox.suggestions import did_you_mean
from robosandbox.values import frozen

STANDARD_SUITE, ALL_SUITES = "standard", "all"
"""The suite of a task that names none, and the word for all suites."""


@frozen(kw_only=True)
class TaskEntry:
    """A task as it stands in a list.

    Attributes:
        name: Its own.
        suite: Which of the bench's suites it belongs to.
        prompt: What the agent is told.
        success: The kind of its criterion.
    """

    name: str
    suite: str
    prompt: str
    success: str


def definitions_folder() -> Path:
    """Return the folder of the bundled tasks; a file dropped there is one more."""
    return Path(__file__).with_name("definitions")


def bundled_tasks() -> dict[str, Path]:
    """Return the YAML files in `tasks/definitions` by task name, sorted."""
    return {path.stem: path for path in sorted(definitions_folder().glob("*.yaml"))}


def bundled_task(name: str) -> Path:
    """Return the file of a bundled task.

    Raises:
        InputError: None has this name.
    """
    bundled = bundled_tasks()
    if name not in bundled:
        raise InputError(f"no task {name[:60]!r}{did_you_mean(name, bundled) or '; there is ' + ', '.join(bundled)}")
    return bundled[name]


def task_entries() -> list[TaskEntry]:
    """Return the bundled tasks' entries, by name.

    A file is read for these fields alone; whether the rest of it is right is told when the task is loaded.

    Raises:
        InputError: A file is no YAML mapping or lacks one of them.
    """
    return [_entry(path) for path in bundled_tasks().values()]


def _entry(path: Path) -> TaskEntry:
    import yaml

    # Every scalar is a text to this loader, as the fields of a list are.
    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
    try:
        data = yaml.load(path.read_bytes(), Loader=loader)
        return TaskEntry(
            name=data["name"],
            suite=data.get("suite", STANDARD_SUITE),
            prompt=data["prompt"],
            success=data["success"]["kind"],
        )
    except (OSError, yaml.YAMLError, KeyError, TypeError, AttributeError):
        # Loading the task says in detail what is wrong.
        from robosandbox.tasks.loader import load_task

        task = load_task(path)
        return TaskEntry(name=task.name, suite=task.suite, prompt=task.prompt, success=task.success.kind)
