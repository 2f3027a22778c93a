"""The /commands."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from robosandbox.agent.preview import preview_lines
from robosandbox.apps.commands.console import EXIT_DONE, EXIT_FAILED
from robosandbox.apps.commands.run import planned
from robosandbox.apps.repl.outcome import Outcome
from robosandbox.apps.repl.showing import aligned, scene_table, signature
from robosandbox.errors import InputError
from robosandbox.types import Plan
from robosandbox.validation import did_you_mean
from robosandbox.values import frozen

if TYPE_CHECKING:
    from robosandbox.apps.repl.shell import Shell

_FORMATS: dict[str, Literal["png", "jpeg"]] = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg"}
_LOG_LINES = 10  # Number of lines that are shown. Chosen: what fits on a screen.


@frozen
class SlashCommand:
    """Something that the shell does itself.

    Attributes:
        name: With the slash.
        takes: Its arguments.
        help: What it does.
        run: Does it, with the rest of the line.
    """

    name: str
    takes: str
    help: str
    run: Callable[[Shell, str], Outcome]


def find(name: str) -> SlashCommand:
    """Return the command of a name, or of the beginning of one name alone.

    Raises:
        InputError: There is none.
    """
    begun = [command for command in COMMANDS if command.startswith(name)]
    if len(begun) == 1:
        return COMMANDS[begun[0]]
    if name not in COMMANDS:
        raise InputError(f"no command {name[:40]!r}{did_you_mean(name, COMMANDS) or '; /help lists them'}")
    return COMMANDS[name]


def _scene(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/scene", rest)
    return Outcome(scene_table(shell.look()))


def _plan(shell: Shell, rest: str) -> Outcome:
    if not rest:
        return Outcome("no plan yet" if shell.plan is None else planned(shell.plan))
    answer = shell.workcell.agent.plan(rest)
    if isinstance(answer, Plan):
        shell.plan = answer
        return Outcome(planned(answer))
    return Outcome(planned(answer), EXIT_FAILED)


def _planned_for(shell: Shell, name: str, rest: str) -> Plan | Outcome:
    """Return the plan for a sentence, the last plan where there is none, or what came of planning."""
    if not rest:
        return shell.plan or Outcome(f"no plan yet; give {name} a sentence", EXIT_FAILED)
    answer = shell.workcell.plan(rest)
    if not isinstance(answer, Plan):
        return Outcome(planned(answer), EXIT_FAILED)
    shell.plan = answer
    return answer


def _check(shell: Shell, rest: str) -> Outcome:
    plan = _planned_for(shell, "/check", rest)
    if isinstance(plan, Outcome):
        return plan
    problems = shell.workcell.check(plan)
    if problems:
        return Outcome("\n".join(map(str, problems)), EXIT_FAILED)
    return Outcome(f"{plan}: nothing speaks against it")


def _simulate(shell: Shell, rest: str) -> Outcome:
    plan = _planned_for(shell, "/simulate", rest)
    if isinstance(plan, Outcome):
        return plan
    tried = shell.workcell.simulate(plan)
    return Outcome("\n".join(preview_lines(tried)), EXIT_DONE if tried["ok"] else EXIT_FAILED)


def _judge(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/judge", rest)
    verdict = shell.workcell.judge()
    measured = ", ".join(f"{key}={value:.3f}" for key, value in verdict.detail.items())
    said = f"{shell.workcell.task.name}: {'success' if verdict.success else 'no success yet'}"
    return Outcome(f"{said} ({measured})" if measured else said)


def _skills(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/skills", rest)
    skills = shell.workcell.calls.values()
    return Outcome(aligned([(signature(skill.name, skill.schema), skill.description) for skill in skills]))


def _cancel(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/cancel", rest)
    stopped = shell.link.cancel_running() if shell.link else None
    return Outcome(f"cancelled: {stopped}" if stopped else "nothing runs; Ctrl-C stops what does")


def _reset(shell: Shell, rest: str) -> Outcome:
    return shell.reset(_count("/reset", "seed", rest, 0) if rest else None)


def _undo(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/undo", rest)
    return shell.undo()


def _recover(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/recover", rest)
    return shell.recover()


def _load(shell: Shell, rest: str) -> Outcome:
    words = _words("/load", rest)
    if not 1 <= len(words) <= 2:
        raise InputError("/load: takes a task and perhaps a robot, as in /load put_in_bin; names or files")
    return shell.load(words[0], words[1] if len(words) == 2 else None)


def _again(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/again", rest)
    if not shell.said:
        raise InputError("/again: nothing was said yet; say what to do first")
    return shell.say(shell.said)


def _photo(shell: Shell, rest: str) -> Outcome:
    words = _words("/photo", rest)
    if not 1 <= len(words) <= 2:
        raise InputError("/photo: takes a file and perhaps a camera, as in /photo table.png top")
    path = Path(words[0]).expanduser()
    format = _FORMATS.get(path.suffix.lower())
    if format is None:
        raise InputError(f"/photo: {path.name!r} is no picture's name; end it in .png or .jpg")
    cameras = shell.workcell.cameras
    camera = words[1] if len(words) == 2 else cameras[0]
    if camera not in cameras:
        raise InputError(
            f"/photo: no camera {camera[:40]!r}; there is {', '.join(cameras)}{did_you_mean(camera, cameras)}"
        )
    if not path.parent.is_dir():
        raise InputError(f"/photo: there is no folder {str(path.parent)!r}; make it first")
    picture = shell.workcell.picture(camera, format)
    try:
        path.write_bytes(picture)
    except OSError as error:
        raise InputError(f"/photo: {str(path)!r} cannot be written: {error.strerror}") from None
    return Outcome(f"{camera} -> {path}")


def _log(shell: Shell, rest: str) -> Outcome:
    count = _count("/log", "number of lines", rest, 1) if rest else _LOG_LINES
    first = max(0, len(shell.log) - count)
    rows = [
        (f"{number}.", f"{entry.time:%H:%M:%S}", f"{entry.said} -> {' '.join(entry.outcome.split())}")
        for number, entry in enumerate(shell.log[first:], start=first + 1)
    ]
    return Outcome(aligned(rows) if rows else "nothing was said yet")


def _help(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/help", rest)
    rows = [(f"{command.name} {command.takes}".rstrip(), command.help) for command in COMMANDS.values()]
    text = 'Say what the robot should do: "pick up the red cube", "put it on the green one".\n'
    return Outcome(text + aligned(rows))


def _quit(shell: Shell, rest: str) -> Outcome:
    _nothing_after("/quit", rest)
    return Outcome("", leave=True)


COMMANDS = {
    command.name: command
    for command in (
        SlashCommand("/scene", "", "what is seen: objects, sizes, positions, what is held", _scene),
        SlashCommand("/plan", "[SENTENCE]", "the plan for a sentence, nothing moves; the last plan", _plan),
        SlashCommand("/check", "[SENTENCE]", "what speaks against the plan for a sentence, or the last plan", _check),
        SlashCommand("/simulate", "[SENTENCE]", "what would come of it on the twin, nothing moves here", _simulate),
        SlashCommand("/judge", "", "whether the task has succeeded since the last reset", _judge),
        SlashCommand("/skills", "", "what the robot can do", _skills),
        SlashCommand("/cancel", "", "stops what the robot does for others; Ctrl-C stops what it does here", _cancel),
        SlashCommand("/reset", "[SEED]", "starts over", _reset),
        SlashCommand("/undo", "", "back to the state before the last command", _undo),
        SlashCommand(
            "/recover", "", "ends a fault that has stopped the arm, once somebody has looked after it", _recover
        ),
        SlashCommand("/load", "TASK [ROBOT]", "another task in the place of this one, by name or file", _load),
        SlashCommand("/again", "", "the last sentence once more", _again),
        SlashCommand("/photo", "FILE [CAMERA]", "writes a picture, .png or .jpg", _photo),
        SlashCommand("/log", "[N]", "what was said and what came of it", _log),
        SlashCommand("/help", "", "this", _help),
        SlashCommand("/quit", "", "leaves", _quit),
    )
}


def _words(name: str, rest: str) -> list[str]:
    try:
        return shlex.split(rest)
    except ValueError as error:
        raise InputError(f"{name}: {str(error).lower()}") from None


def _nothing_after(name: str, rest: str) -> None:
    if rest:
        raise InputError(f"{name}: takes nothing after it, got {rest[:40]!r}")


def _count(name: str, what: str, text: str, least: int) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10 and int(text) >= least):
        raise InputError(f"{name}: {text[:40]!r} is no {what}; give a whole number from {least}")
    return int(text)
