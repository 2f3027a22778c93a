"""A group of commands whose modules are imported when a command is called, so that help and mistakes come at once."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from robosandbox.errors import InputError
from robosandbox.values import frozen


@frozen
class LazyCommand:
    """Location of a command that is imported when it is called, and its line in the group's help.

    Attributes:
        target: `module:name` of a function, or of a Typer application with commands of its own.
        help: The first line of that function's docstring, or the application's help.
    """

    target: str
    help: str

    def load(self, name: str) -> Any:
        """Import the command and return it as what the parser calls."""
        module, _, attribute = self.target.partition(":")
        found = getattr(import_module(module), attribute)
        if not isinstance(found, typer.Typer):
            application = plain_app()
            application.command(name, cls=SentenceCommand)(found)
            found = application
        command = typer.main.get_command(found)
        command.name = name
        return command


def plain_app(**options: Any) -> typer.Typer:
    """Return an application whose help is plain text: the library that draws boxes takes longer to load than all else."""
    return typer.Typer(add_completion=False, rich_markup_mode=None, **options)


def plain_group(**options: Any) -> typer.Typer:
    """Return an application of several commands, which by itself prints its help."""
    application = plain_app(**options)

    @application.callback(invoke_without_command=True)
    def help_alone(context: typer.Context) -> None:
        if context.invoked_subcommand is None:
            print(context.get_help())

    return application


class SentenceCommand(TyperCommand):
    """A command that takes a sentence says what is wrong with one that is not in quotes."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take a command line apart.

        Raises:
            InputError: The sentence goes on after its first word.
        """
        said = next((param for param in self.params if param.name == "prompt"), None)
        ctx.allow_extra_args = ctx.allow_extra_args or said is not None
        try:
            rest = super().parse_args(ctx, args)
        except typer.TyperException as error:
            # An option without its value does not say of which command it is.
            if getattr(error, "ctx", ctx) is None:
                error.ctx = ctx  # type: ignore[attr-defined]
            raise
        if rest and said is not None:
            raise InputError(
                f"the prompt ends after {ctx.params['prompt']!r}: put the whole sentence in quotes; "
                f"see {ctx.command_path} --help"
            )
        return rest


def lazy_group(lazy: Mapping[str, LazyCommand]) -> type[TyperGroup]:
    """Return a kind of group that has these commands, in this order."""

    class LazyGroup(TyperGroup):
        @property
        def commands(self) -> dict[str, Any]:
            """All commands, imported."""
            return {name: self._command(name) for name in lazy}

        @commands.setter
        def commands(self, value: object) -> None:
            # The base class starts with none, and this group's are `lazy`.
            self._loaded: dict[str, Any] = {}

        def list_commands(self, ctx: Any) -> list[str]:
            """Return the names."""
            return list(lazy)

        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            """Return a command, imported; None where there is none of this name."""
            return self._command(cmd_name) if cmd_name in lazy else None

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            """Write each command's line of help without importing it."""
            with formatter.section("Commands"):
                formatter.write_dl([(name, command.help) for name, command in lazy.items()])

        def _command(self, name: str) -> Any:
            if name not in self._loaded:
                self._loaded[name] = lazy[name].load(name)
            return self._loaded[name]

    return LazyGroup
