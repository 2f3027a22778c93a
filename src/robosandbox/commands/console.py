"""What all commands share: exit codes, one-line errors, one JSON document on stdout."""

from __future__ import annotations

import json
import logging
import os
import sys
from collections.abc import Sequence
from typing import Any

import typer

from robosandbox.commands.waiting import stop_telling, tell_slow_work
from robosandbox.errors import (
    InputError,
    PlannerError,
    PlannerUnavailableError,
    RenderingError,
    RoboSandboxError,
    SensorError,
    ServiceUnavailableError,
)

EXIT_DONE = 0
EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_UNAVAILABLE = 3  # Exit code number, as in the first lines of docs/cli.md.
_EXIT_INTERRUPTED = 130  # Exit code number: 128 and the number of SIGINT, as of shells.
_GL_REMEDY = (
    "unset it, or `apt-get install libegl1` for MUJOCO_GL=egl, `apt-get install libosmesa6` for MUJOCO_GL=osmesa"
)

# Typer carries its own copy of click in some versions and click itself in others; this finds UsageError in either.
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]


def run_app(app: typer.Typer, program: str, arguments: Sequence[str]) -> int:
    """Run a command line and return its exit code; what is wrong with the input becomes one line on stderr."""
    logging.basicConfig(stream=sys.stderr, level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    command = typer.main.get_command(app)
    waiting = tell_slow_work(program)
    try:
        code = command.main(args=list(arguments), prog_name=program, standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else EXIT_DONE
    except _UsageError as error:
        return _misused(program, error)
    except RoboSandboxError as error:
        exit_code = _exit_code(error)
        if exit_code is None:
            raise
        _complain(program, str(error))
        return exit_code
    except (ImportError, AttributeError, RuntimeError) as error:
        backend = os.environ.get("MUJOCO_GL")
        if not backend or "mujoco" in sys.modules:
            raise
        # MuJoCo picks its renderer while it is imported, and fails there in any of these ways.
        _complain(program, f"MUJOCO_GL={backend}: MuJoCo does not load with it ({error}); {_GL_REMEDY}")
        return EXIT_UNAVAILABLE
    except (KeyboardInterrupt, typer.Abort):
        _complain(program, "interrupted")
        return _EXIT_INTERRUPTED
    except BrokenPipeError:
        # The reader has gone, as in `... | head`; closing stdout here keeps the interpreter from complaining at exit.
        sys.stdout = None
        return EXIT_FAILED
    finally:
        stop_telling(waiting)


def _misused(program: str, error: Exception) -> int:
    """Say what is wrong with a command line, and where its help is; a group by itself prints it."""
    context = getattr(error, "ctx", None)
    message = getattr(error, "format_message", error.__str__)().rstrip(".")
    if "Missing command" in message:
        print(context.get_help() if context else message)
        return EXIT_DONE
    path = context.command_path if context else program
    said = context.params.get("prompt") if context else None
    if said and "extra argument" in message:
        message = f"the prompt ends after {said!r}: put the whole sentence in quotes"
    elif isinstance(error.__context__, ValueError) and (wrong := _given(error.__context__)):
        message = f"{message}, got {wrong!r}"
    _complain(program, f"{message}; see {path} --help")
    return EXIT_USAGE


def _given(error: ValueError) -> str:
    """Return the value that a validation refused; empty where it does not tell."""
    details: list[dict[str, Any]] = getattr(error, "errors", list)()
    return str(details[0].get("input", ""))[:40] if details else ""


def _exit_code(error: RoboSandboxError) -> int | None:
    """Return what a command ends with after an error; None where no command should let it out."""
    if isinstance(error, InputError):
        return EXIT_USAGE
    if isinstance(error, RenderingError | SensorError | ServiceUnavailableError | PlannerUnavailableError):
        return EXIT_UNAVAILABLE
    if isinstance(error, PlannerError):
        return EXIT_FAILED
    from robosandbox.errors import ServiceError, UnsupportedError

    if isinstance(error, UnsupportedError):
        return EXIT_USAGE
    return EXIT_UNAVAILABLE if isinstance(error, ServiceError) else None


def print_json(document: Any) -> None:
    """Print one document on stdout."""
    print(json.dumps(document, indent=2))


def read_prompt(prompt: str) -> str:
    """Return the prompt; `-` reads it from stdin.

    Raises:
        InputError: It is empty or longer than any sentence.
    """
    from robosandbox.agent.agent import check_prompt
    from robosandbox.types import MAX_PROMPT_LENGTH

    if prompt == "-":
        prompt = sys.stdin.read(MAX_PROMPT_LENGTH + 1).strip()
        if len(prompt) > MAX_PROMPT_LENGTH:
            raise InputError(
                f"prompt: stdin has more than {MAX_PROMPT_LENGTH:,} characters; say it in a sentence or two"
            )
    if not prompt.strip():
        raise InputError('prompt: is empty; say what to do, as in "pick up the red cube"')
    check_prompt(prompt)
    return prompt


def _complain(program: str, message: str) -> None:
    print(f"{program}: {' '.join(message.split())}", file=sys.stderr)
