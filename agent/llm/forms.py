"""The forms in which models write an answer: tool calls, JSON bare, fenced, named, as a string, in prose, after thoughts.

Only the form is forgiven here. What an answer says is held to the schemas and the plan check by whoever reads it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

from pydantic_ai.messages import ModelResponse, TextPart, ThinkingPart, ToolCallPart
from pydantic_ai.tools import ToolDefinition
from pydantic_core import from_json

from robosandbox.values import frozen

# How many opening brackets of a text are tried; an answer has one value, prose around it a few brackets more.
_MOST_VALUES = 60
# How many wrappers around an answer are taken off. Chosen: {"tool_calls": [{"function": {"arguments": "..."}}]} has four.
_MOST_WRAPPERS = 6

_OPENING = re.compile(r"[{\[]")

_WRAPPERS = (
    "answer",
    "call",
    "calls",
    "response",
    "output",
    "result",
    "function",
    "function_call",
    "tool_call",
    "tool_calls",
)
_THOUGHTS = re.compile(r"<(think|thinking|thought|reasoning)>(.*?)</\1>", re.DOTALL | re.IGNORECASE)
_THOUGHT_ENDS = re.compile(r"\A.*</(?:think|thinking|thought|reasoning)>", re.DOTALL | re.IGNORECASE)
_THOUGHT_BEGINS = re.compile(r"<(?:think|thinking|thought|reasoning)>(.*)\Z", re.DOTALL | re.IGNORECASE)
_MARK_BEGINS = re.compile(r"<[/\w]*\Z")
_NAME_KEYS = ("name", "tool", "tool_name", "function", "skill", "action")
_ARGUMENT_KEYS = ("arguments", "args", "parameters", "params", "input")
# Keys that models write beside a call and that say nothing of what is to be done.
_REMARKS = frozenset({"type", "id", "index", "thought", "thoughts", "thinking", "reasoning", "explanation", "comment"})


class MisuseError(Exception):
    """An answer cannot be used; the message tells the model why."""


class NoAnswerError(MisuseError):
    """An answer holds no JSON at all, so the server has not kept it to any form."""


@frozen
class Call:
    """A name and the arguments given with it, unchecked."""

    name: str
    arguments: Any


def find_answer(response: ModelResponse, tools: Sequence[ToolDefinition]) -> Call:
    """Return the one tool that an answer calls, in whatever form, with its arguments unchecked.

    Its name may be left out where its arguments tell which it is, and a bare list of calls stands for the argument of a tool
    that needs nothing but a list.

    Raises:
        NoAnswerError: There is no JSON in it.
        MisuseError: It was cut off, is no JSON after all, calls something else, or calls twice.
    """
    calls = _calls_in(response, tools, bare=True)
    if len(calls) > 1:
        told = ", ".join(call.name[:40] for call in calls)
        raise MisuseError(f"There were {len(calls)} calls ({told}); make exactly one, with all that is to be done.")
    return calls[0]


def find_calls(response: ModelResponse, tools: Sequence[ToolDefinition]) -> list[Call]:
    """Return the tools that a turn of a conversation calls, in order and in whatever form, with their arguments unchecked.

    A call has to name its tool: arguments alone, which are an answer to `find_answer`, fit several.

    Raises:
        NoAnswerError: There is no JSON in it.
        MisuseError: It was cut off, is no JSON after all, or calls something else.
    """
    return _calls_in(response, tools, bare=False)


def _calls_in(response: ModelResponse, tools: Sequence[ToolDefinition], *, bare: bool) -> list[Call]:
    """Return the calls in a response, at least one; `bare` where arguments and lists may stand alone."""
    if response.finish_reason == "length":
        raise MisuseError("The answer was cut off; give a shorter one.")
    names = ", ".join(f"`{tool.name}`" for tool in tools)
    native = [part for part in response.parts if isinstance(part, ToolCallPart)]
    if native:
        calls = [Call(part.tool_name.removeprefix("functions."), _unpacked(part.args or {})) for part in native]
        return _known_calls(calls, tools, names, bare=bare)
    text = without_thoughts("".join(part.content for part in response.parts if isinstance(part, TextPart)))
    values = json_values(text)
    found: list[list[Call]] = []
    for value in values:
        calls = _written_calls(value, tools, bare=bare)
        if calls and calls not in found:
            found.append(calls)
    if len(found) > 1:
        raise MisuseError(f"There were {len(found)} different answers; give exactly one, with its calls in one list.")
    if found:
        return found[0]
    if not values:
        raise NoAnswerError(f"{_quoted(text)} is no answer: there is no JSON in it; call one of {names}.")
    raise MisuseError(f"{_quoted(json.dumps(values[0]))} calls nothing; call one of {names}.")


def _known_calls(calls: list[Call], tools: Sequence[ToolDefinition], names: str, *, bare: bool) -> list[Call]:
    """Return native calls with their lists where these belong; several of which none is a tool are the list of one."""
    known = {tool.name for tool in tools}
    listing = next((tool for tool in tools if bare and _listed(tool)), None)
    if listing is not None and len(calls) > 1 and not known & {call.name for call in calls}:
        calls = [Call(listing.name, [{"name": call.name, "arguments": call.arguments} for call in calls])]
    strange = next((call.name for call in calls if call.name not in known), None)
    if strange is not None:
        raise MisuseError(f"There is no tool {strange[:60]!r}; there is {names}.")
    return [_with_list(call, tools) for call in calls] if bare else calls


def _written_calls(value: Any, tools: Sequence[ToolDefinition], *, bare: bool, wrappers: int = 0) -> list[Call]:
    """Return the calls that a JSON value writes down; none where one of a list is no call."""
    if wrappers > _MOST_WRAPPERS:
        return []
    if isinstance(value, list):
        each = [_written_calls(item, tools, bare=bare, wrappers=wrappers + 1) for item in value]
        if all(each):
            return [call for calls in each for call in calls]
        listing = next((tool for tool in tools if bare and _listed(tool)), None)
        if listing is None or any(as_call(item) is None for item in value):
            return []
        return [_with_list(Call(listing.name, value), tools)]
    if not isinstance(value, dict):
        return []
    said = {key: item for key, item in value.items() if key not in _REMARKS}
    if bare and not {"name", "tool", "function"} & said.keys():
        fitting = next((tool for tool in tools if _required(tool) and _required(tool) <= said.keys()), None)
        if fitting is not None:
            return [_with_list(Call(fitting.name, said), tools)]
    known = {tool.name for tool in tools}
    match list(said.items()):
        case [(name, arguments)] if name in known:
            call: Call | None = Call(name, _unpacked(arguments))
        case [(key, wrapped)] if key in _WRAPPERS and not isinstance(wrapped, str):
            return _written_calls(wrapped, tools, bare=bare, wrappers=wrappers + 1)
        case _:
            call = as_call(value)
    if call is None or call.name not in known:
        return []
    return [_with_list(call, tools) if bare else call]


def as_call(value: Any) -> Call | None:
    """Return the call that a JSON object writes down, None where it writes none.

    Understood are `{"name": N, "arguments": A}` with the usual other words for both, arguments as a JSON string,
    `{"function": {...}}`, and arguments beside the name.

    Raises:
        MisuseError: There is more beside name and arguments than remarks.
    """
    if not isinstance(value, dict):
        return None
    if isinstance(value.get("function"), dict):
        return as_call(value["function"])
    name_key = next((key for key in _NAME_KEYS if isinstance(value.get(key), str)), None)
    if name_key is None:
        return None
    rest = {key: item for key, item in value.items() if key != name_key and key not in _REMARKS}
    key = next((key for key in _ARGUMENT_KEYS if key in rest), None)
    arguments = rest if key is None else _unpacked(rest.pop(key))
    if key is not None and rest:
        raise MisuseError(
            f"{sorted(rest)[0]}: {_quoted(json.dumps(rest))} stands beside `{key}` of {value[name_key][:60]!r}; "
            f"a call has a name and `{key}` and nothing else."
        )
    return Call(value[name_key].removeprefix("functions."), {} if arguments is None else arguments)


def json_values(text: str) -> list[Any]:
    """Return the JSON objects and arrays of a text, those within others left out.

    Raises:
        MisuseError: One is not closed, or all are malformed.
    """
    values: list[Any] = []
    fault = ""
    position = 0
    for _ in range(_MOST_VALUES):
        opening = _OPENING.search(text, position)
        if opening is None:
            break
        try:
            value, position = _DECODER.raw_decode(text, opening.start())
            values.append(value)
        except RecursionError:
            raise MisuseError("The answer is not valid JSON (it is nested too deeply); answer again.") from None
        except ValueError as error:
            end = _closing(text, opening.start())
            if end is None:
                # Nothing inside is taken for the answer: the first steps of a plan that breaks off are not the plan.
                raise MisuseError(f"The answer is not valid JSON ({error}); answer again.") from None
            fault = fault or str(error)
            position = end
    if fault and not values:
        raise MisuseError(f"The answer is not valid JSON ({fault}); answer again.")
    return values


def _with_list(call: Call, tools: Sequence[ToolDefinition]) -> Call:
    """Return a call whose arguments are a bare list with the list where it belongs."""
    listed = _listed(next(tool for tool in tools if tool.name == call.name))
    arguments = call.arguments
    if listed and isinstance(arguments, list):
        arguments = {listed: arguments}
    if listed and isinstance(arguments, dict) and isinstance(arguments.get(listed), str):
        arguments = {**arguments, listed: _unpacked(arguments[listed])}
    return Call(call.name, arguments)


def _required(tool: ToolDefinition) -> frozenset[str]:
    """Return the arguments that a tool cannot do without, by which bare JSON is recognized."""
    return frozenset(tool.parameters_json_schema.get("required", ()))


def _listed(tool: ToolDefinition) -> str | None:
    """Return the argument that a bare list stands for: the only one that a tool needs, where it is a list."""
    only = next(iter(_required(tool))) if len(_required(tool)) == 1 else None
    return only if only and tool.parameters_json_schema["properties"][only].get("type") == "array" else None


def _unpacked(value: Any) -> Any:
    """Return the JSON that a string holds; any other value as it is.

    Raises:
        MisuseError: The string is no JSON.
    """
    if not isinstance(value, str):
        return value
    try:
        return _DECODER.decode(value.strip())
    except (ValueError, RecursionError) as error:
        raise MisuseError(f"The arguments are not valid JSON ({error}); answer again.") from None


def _closing(text: str, start: int) -> int | None:
    """Return where the bracket at `start` is closed, strings skipped; None where it is not."""
    depth, position, quoted = 0, start, False
    while position < len(text):
        sign = text[position]
        if quoted:
            position += sign == "\\"
            quoted = sign != '"'
        elif sign == '"':
            quoted = True
        elif sign in "{[":
            depth += 1
        elif sign in "}]":
            depth -= 1
            if depth == 0:
                return position + 1
        position += 1
    return None


def _each_key_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    for key, _ in pairs:
        if sum(other == key for other, _ in pairs) > 1:
            raise ValueError(f"the key {key[:40]!r} stands there twice")
    return dict(pairs)


def _quoted(text: str) -> str:
    line = " ".join(text.split())
    return repr(line if len(line) <= 120 else f"{line[:117]}...")


def without_thoughts(text: str) -> str:
    """Return a text without what a model thought aloud, also where one of the marks is missing."""
    return _THOUGHT_BEGINS.sub("", _THOUGHT_ENDS.sub("", _THOUGHTS.sub("", text)))


def thought_of(response: ModelResponse) -> str:
    """Return what a model says of why it calls what it calls: in its thoughts, or as `thought` beside a call; "" if nothing.

    Of an answer that is still being written it is the beginning.
    """
    thinking = "".join(part.content for part in response.parts if isinstance(part, ThinkingPart))
    text = "".join(part.content for part in response.parts if isinstance(part, TextPart))
    marked = _THOUGHTS.search(text)
    begun = _THOUGHT_BEGINS.search(text)
    if thinking or marked is not None or begun is not None:
        return (thinking or (marked[2] if marked else _MARK_BEGINS.sub("", begun[1]) if begun else "")).strip()
    answer = json_so_far(text)
    said = answer.get("thought") if isinstance(answer, dict) else None
    return said.strip() if isinstance(said, str) else ""


def json_so_far(text: str) -> Any:
    """Return the JSON value that a text writes or begins to write, from its first bracket on; None where it cannot be read."""
    begin = _OPENING.search(text)
    if begin is None:
        return None
    try:
        return from_json(text[begin.start() :].rstrip("` \n"), allow_partial="trailing-strings")
    except ValueError:
        return None


_DECODER = json.JSONDecoder(object_pairs_hook=_each_key_once)
