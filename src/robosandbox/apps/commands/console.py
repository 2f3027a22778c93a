"""Console conventions of all commands: exit codes, one-line errors, one JSON document on stdout."""

from __future__ import annotations

import errno
import json
import logging
import os
import re
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn, TextIO

import typer

from robosandbox.apps.commands.waiting import slow_work_shown
from robosandbox.errors import (
    InputError,
    PlannerError,
    PlannerUnavailableError,
    RenderingError,
    RoboSandboxError,
    SensorError,
    ServiceUnavailableError,
)
from robosandbox.progress import nothing_done

EXIT_DONE = 0
EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_UNAVAILABLE = 3  # Exit code number, as in the first lines of docs/cli.md.
_EXIT_INTERRUPTED = 130  # Exit code number: 128 and the number of SIGINT, as of shells.
_GL_REMEDY = (
    "unset it, or `apt-get install libegl1` for MUJOCO_GL=egl, `apt-get install libosmesa6` for MUJOCO_GL=osmesa"
)

# No room: of the disk, of its owner's share, of what a process may write into one file.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

_HOME = re.compile(r"(--[a-z-]+=|)(~/.*)", re.DOTALL)


class _CurrentStderr(logging.StreamHandler[TextIO]):
    """Writes to what is stderr at the time, so that a line passes over one that moves."""

    def emit(self, record: logging.LogRecord) -> None:
        self.setStream(sys.stderr)
        super().emit(record)


def run_app(app: typer.Typer, program: str, arguments: Sequence[str]) -> int:
    """Run a command line and return its exit code; what is wrong with the input becomes one line on stderr."""
    logging.basicConfig(
        handlers=[_CurrentStderr()], level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s"
    )
    command = typer.main.get_command(app)
    try:
        with slow_work_shown():
            code = command.main(args=_at_home(arguments), prog_name=program, standalone_mode=False)
        sys.stdout.flush()
        if code == _EXIT_INTERRUPTED:
            # What Typer makes of Ctrl-C, without a word.
            raise KeyboardInterrupt
        return code if isinstance(code, int) else EXIT_DONE
    except typer.TyperException as error:
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
    except OSError as error:
        if error.errno not in _FULL:
            raise
        sys.stdout = None
        where = repr(error.filename) if error.filename else "a file or stdout"
        _complain(program, f"{where} cannot be written: {error.strerror}; make room, then run it again")
        return EXIT_UNAVAILABLE


def _at_home(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with `~/` as the user's folder where shells leave it: in quotes, and in `--option=~/file`."""
    parts = (_HOME.fullmatch(argument) for argument in arguments)
    return [
        found[1] + os.path.expanduser(found[2]) if found else argument
        for argument, found in zip(arguments, parts, strict=True)
    ]


def _misused(program: str, error: typer.TyperException) -> int:
    """Say what is wrong with a command line, and where its help is."""
    context: typer.Context | None = getattr(error, "ctx", None)
    message = error.format_message().rstrip(".")
    if isinstance(error.__cause__, ValueError) and (wrong := _given(error.__cause__)):
        message = f"{message}, got {wrong!r}"
    _complain(program, f"{message}; see {context.command_path if context else program} --help")
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


@contextmanager
def ending_with_threads(program: str) -> Iterator[None]:
    """Have the process end when any of its threads dies meanwhile: what the thread did would never be done again.

    Zenoh's own panics are no `Exception`, and pass by all that keeps a thread alive.
    """

    def end(died: threading.ExceptHookArgs) -> None:
        name = died.thread.name if died.thread else "?"
        end_now(program, f"the thread {name!r} died of {died.exc_type.__name__}: {died.exc_value}")

    before, threading.excepthook = threading.excepthook, end
    try:
        yield
    finally:
        threading.excepthook = before


def end_now(program: str, cause: str) -> NoReturn:
    """End the process at once, as a kill would, with a line that says why."""
    _complain(program, f"{cause}; the process ends, start it again")
    sys.stderr.flush()
    os._exit(EXIT_UNAVAILABLE)


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
        nothing_done()
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
