"""Write docs/cli.md, the reference of the two programs, from the programs themselves.

uv run docs/make_cli.py
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from robosandbox.apps import cli
from robosandbox.apps.commands import bench

TARGET = Path(__file__).with_name("cli.md")
INTRO = """<!-- Written by docs/make_cli.py; change the commands. -->

# Commands

Exit codes: 0 done, 1 ran but did not succeed, 2 wrong usage or input, 3 no such service, or not let in, 130 ended by Ctrl-C. With `--json` stdout is one JSON document
and everything else goes to stderr.
"""


def main() -> None:
    """Write the page."""
    TARGET.write_text(page(), encoding="utf-8")


def page() -> str:
    """Return the page."""
    programs = [
        *sections("robo-sandbox", typer.main.get_command(cli.app)),
        *sections("robo-sandbox-bench", typer.main.get_command(bench.app)),
    ]
    return "\n".join([INTRO, *programs])


def sections(path: str, command: Any) -> Iterator[str]:
    """Yield a section per command, those of groups one after another."""
    if inner := getattr(command, "commands", None):
        for name, each in inner.items():
            yield from sections(f"{path} {name}", each)
        return
    context = typer.Context(command, info_name=path)
    pieces = " ".join(command.collect_usage_pieces(context))
    yield f"## `{path}`\n\n{(command.help or '').strip()}\n\n```text\n{path} {pieces}\n```\n"
    rows = [row for parameter in command.params if (row := parameter.get_help_record(context)) and row[0] != "--help"]
    if rows:
        yield "| option | meaning |\n|---|---|"
        for names, meaning in rows:
            yield f"| `{names.replace('|', chr(92) + '|')}` | {meaning.replace('|', chr(92) + '|')} |"
        yield ""


if __name__ == "__main__":
    main()
