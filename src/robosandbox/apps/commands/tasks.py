"""`tasks list` and `tasks show`: what is bundled."""

from __future__ import annotations

from typing import Annotated

import typer

from robosandbox.apps.commands.console import print_json
from robosandbox.apps.commands.lazy import plain_group

app: typer.Typer = plain_group(help="The tasks that a bench runs.")

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout.")]


@app.command("list")
def list_tasks(json: Json = False) -> None:
    """List the bundled tasks."""
    from robosandbox.tasks.bundled import task_entries

    tasks = task_entries()
    if json:
        print_json(
            [{"name": task.name, "suite": task.suite, "prompt": task.prompt, "success": task.success} for task in tasks]
        )
        return
    width, wide = (max(len(getattr(task, field)) for task in tasks) for field in ("name", "suite"))
    for task in tasks:
        print(f"{task.name:<{width}}  {task.suite:<{wide}}  {task.prompt}")


@app.command("show")
def show_task(
    name: Annotated[str, typer.Argument(help="A bundled task or a YAML file.")],
    json: Json = False,
) -> None:
    """Print a task, its defaults filled in."""
    import yaml

    from robosandbox.tasks.loader import resolve_task

    document = resolve_task(name).model_dump(mode="json")
    if json:
        print_json(document)
    else:
        print(yaml.safe_dump(document, sort_keys=False, allow_unicode=True), end="")
