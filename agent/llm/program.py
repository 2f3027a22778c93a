"""A short program of a model over the skills, run by an interpreter that can do nothing else.

The interpreter is Monty (`pydantic-monty`): Python in a process of its own that has no files, network, clock or modules of the
host, and bounds on time, memory and recursion. It pauses at each call that leaves the program; its state is kept as bytes until
the robot has carried the call out, so that no process waits meanwhile and none is left behind. RestrictedPython, the other
candidate, compiles to code of this process and bounds neither time nor memory.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pydantic_monty as monty

from robosandbox.agent.goal import GoalContext
from robosandbox.agent.tools import not_holding, relations
from robosandbox.errors import InputError
from robosandbox.types import Plan, SkillCall
from robosandbox.values import frozen
from robosandbox.world.operators import Operator
from robosandbox.world.scene_json import describe_scene

# Seconds between two calls that leave the program. Chosen: a loop over a table of things takes a thousandth of it.
_SECONDS = 0.5
_GRACE = 2.0  # Seconds after which the process is ended from outside. Chosen: four times what it is told.
_MEMORY = 32_000_000  # Bytes. Chosen: a scene of a hundred things takes a hundredth of it.
_RECURSION = 100  # Depth of calls. Chosen: no plan nests deeper.
_MOST_READS = 200  # Looks at the scene in one program. Chosen: five for each call that a prompt may have.
_MOST_PRINTED = 2_000  # Characters that are kept of what it prints. Chosen: a page.
_LONGEST_VALUE = 2_000  # Characters of a program's value as JSON. Chosen: a page.
_MOST_SAID = 800  # Characters of an error that a model is told. Chosen: its line and message.

_LIMITS: monty.ResourceLimits = {
    "max_feed_duration_secs": _SECONDS,
    "max_turn_duration_secs": _SECONDS,
    "max_memory": _MEMORY,
    "max_recursion_depth": _RECURSION,
}
# The same program comes to the same calls whenever it is run.
_POLICY: monty.OSPolicy = {"sleep": "zero", "random_start": {"seed": 0}, "datetime": "call_host"}
_PLAIN = (str, int, float, bool)


@frozen(kw_only=True)
class ProgramEnd:
    """A program is over.

    Attributes:
        value: Of its last expression, where that is a plain one.
        error: Why it broke off; "" where it ran to its end.
    """

    value: Any = None
    error: str = ""


class Program:
    """A program that goes on call by call.

    Args:
        code: The text, in Python.
        skills: Names of the arguments of each skill, by the skill's name.
        reads: What the program may ask without anything moving, by name; each takes plain values and returns JSON data.

    Attributes:
        printed: The beginning of what it printed.
    """

    def __init__(self, code: str, skills: Mapping[str, Sequence[str]], reads: Mapping[str, Callable[..., Any]]) -> None:
        self.printed: str = ""
        self._code = code
        self._skills = skills
        self._reads = reads
        self._left = _MOST_READS
        self._state = b""

    def begin(self) -> SkillCall | ProgramEnd:
        """Run to the first call of a skill, or to the end."""
        return self._drive(lambda session: session.feed_start(self._code, print_callback=self._print))

    def go_on(self, answer: Any) -> SkillCall | ProgramEnd:
        """Run on from the last call, which comes to `answer`, to the next one or to the end."""

        def start(session: monty.MontySession) -> Any:
            paused = session.load_snapshot(self._state, print_callback=self._print)
            assert isinstance(paused, monty.FunctionSnapshot)
            return paused.resume({"return_value": answer})

        return self._drive(start)

    def _drive(self, start: Callable[[monty.MontySession], Any]) -> SkillCall | ProgramEnd:
        try:
            with (
                monty.Monty(min_processes=0, max_processes=1, request_timeout=_GRACE) as pool,
                pool.checkout(script_name="program.py", limits=_LIMITS, os_policy=_POLICY) as session,
            ):
                at = start(session)
                while not isinstance(at, monty.MontyComplete):
                    if isinstance(at, monty.NameLookupSnapshot):
                        at = at.resume()
                    elif isinstance(at, monty.FunctionSnapshot):
                        call = self._call(at)
                        if isinstance(call, SkillCall):
                            self._state = at.dump()
                            return call
                        at = at.resume(call)
                    else:
                        return ProgramEnd(
                            error="a program cannot wait for several things at once; call one after another"
                        )
                return ProgramEnd(value=at.output if type(at.output) in (*_PLAIN, list, dict) else None)
        except monty.MontyError as error:
            return ProgramEnd(error=_told(error))

    def _call(self, at: monty.FunctionSnapshot) -> SkillCall | monty.ExternalResult:
        """Return the skill's call at which a program has paused, or what else it called comes to."""
        name = at.function_name
        if at.is_os_function or at.object_id is not None or name not in {*self._skills, *self._reads}:
            offered = ", ".join([*self._skills, *self._reads])
            return {"exception": NameError(f"there is no {name[:60]!r} in a program; there is {offered}")}
        try:
            if name in self._skills:
                return _skill_call(name, self._skills[name], at.args, at.kwargs)
            self._left -= 1
            if self._left < 0:
                return {"exception": RuntimeError(f"a program may look at most {_MOST_READS} times")}
            return {"return_value": self._reads[name](*at.args, **at.kwargs)}
        except (TypeError, ValueError) as error:
            return {"exception": type(error)(str(error))}

    def _print(self, stream: str, text: str) -> None:
        del stream
        self.printed = (self.printed + text)[:_MOST_PRINTED]


def _skill_call(name: str, takes: Sequence[str], args: Sequence[Any], kwargs: Mapping[str, Any]) -> SkillCall:
    """Return a call with its arguments by name; raises TypeError where they are none that a skill could take."""
    if len(args) > len(takes) or set(takes[: len(args)]) & kwargs.keys():
        raise TypeError(f"{name} takes {', '.join(takes) or 'nothing'}")
    arguments = dict(zip(takes, args, strict=False)) | dict(kwargs)
    strange = next((key for key, value in arguments.items() if type(value) not in _PLAIN), None)
    if strange is not None:
        raise TypeError(f"{name}: {strange} is a {type(arguments[strange]).__name__}; give a text or a number")
    return SkillCall(skill=name, arguments=arguments)


def _told(error: monty.MontyError) -> str:
    """Return what broke a program off, with the line."""
    shown = error.display() if isinstance(error, monty.MontyRuntimeError | monty.MontySyntaxError) else str(error)
    return shown[-_MOST_SAID:] if shown else type(error).__name__


class RunningProgram:
    """A program that a model runs in a world: its calls one by one, what it may ask, and what it came to.

    Args:
        code: The text.
        ctx: The world that it looks at.
        skills: What it may call, by name.
    """

    def __init__(self, code: str, ctx: GoalContext, skills: Mapping[str, Operator]) -> None:
        self._ctx = ctx
        takes = {name: list(skill.schema.get("properties", {})) for name, skill in skills.items()}
        self._program = Program(code, takes, {"scene": self._scene, "holds": self._holds})
        self._done: list[dict[str, Any]] = []

    def begin(self) -> Plan | dict[str, Any]:
        """Return the first call, or what the program came to without one."""
        return self._next(self._program.begin())

    def go_on(self, told: Mapping[str, Any]) -> Plan | dict[str, Any]:
        """Return the next call now that the last one came to this, or what the program came to: it ends with a failure."""
        self._done += told["done"]
        if not told["ok"]:
            return self._came_to(told)
        return self._next(self._program.go_on(told))

    def broken_off(self, why: Mapping[str, Any]) -> dict[str, Any]:
        """Return what the program came to, now that its next call is turned down."""
        return self._came_to(why)

    def _next(self, answer: SkillCall | ProgramEnd) -> Plan | dict[str, Any]:
        if isinstance(answer, SkillCall):
            return Plan(steps=(answer,))
        if answer.error:
            return self._came_to({"ok": False, "error": answer.error})
        return self._came_to({"ok": True, **_value_told(answer.value)})

    def _came_to(self, end: Mapping[str, Any]) -> dict[str, Any]:
        printed = {"printed": self._program.printed} if self._program.printed else {}
        return {**end, "done": self._done, **printed}

    def _scene(self) -> Any:
        return describe_scene(self._ctx.look())

    def _holds(self, text: str) -> bool:
        try:
            return not not_holding(relations([str(text)]), self._ctx.look())
        except InputError as error:
            raise ValueError(str(error)) from None


def _value_told(value: Any) -> dict[str, Any]:
    """Return a program's value as a model is told it; nothing of one that is too long."""
    if value is None:
        return {}
    try:
        is_short = len(json.dumps(value, allow_nan=False)) <= _LONGEST_VALUE
    except (TypeError, ValueError, RecursionError):
        is_short = False
    return {"value": value} if is_short else {"note": "its value is no short JSON and left out"}
