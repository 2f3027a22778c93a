"""Validation of what people write: YAML files into strict models, each mistake as one line that says how to mend it."""

from __future__ import annotations

import math
import re
import types
import typing
from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from robosandbox.errors import InputError
from robosandbox.suggestions import did_you_mean as did_you_mean, nearest as nearest, no_file

MAX_FILE_BYTES = 1_000_000  # Bytes of a YAML file. Chosen far above any that people write.
_MAX_SHOWN = 60  # Characters of a value that an error shows. Chosen so that it stays one line.
_FIELD = re.compile(r"[a-z]\w*(\[\d+\]|\.[a-z]\w*)*")

ModelT = TypeVar("ModelT", bound=BaseModel)


def load_yaml_model(path: Path, model: type[ModelT], *, context: Any = None) -> ModelT:
    """Read a YAML file into a pydantic model.

    Args:
        path: The file.
        model: What it should hold.
        context: Handed to the model's validators.

    Raises:
        InputError: The file is missing, no YAML, or does not fit; the message names file, field, value and remedy.
    """
    return validate(parse_yaml(read_text(path), path.name), model, source=path.name, context=context)


def read_text(path: Path) -> str:
    """Return a small text file's content.

    Raises:
        InputError: It is missing, too large or no text.
    """
    if not path.is_file():
        raise InputError(no_file(path))
    try:
        size = path.stat().st_size
        if size > MAX_FILE_BYTES:
            raise InputError(
                f"{path.name}: is {size / 1e6:.0f} MB; such a file is at most {MAX_FILE_BYTES / 1e6:.0f} MB"
            )
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path.name}: byte {error.start} is not UTF-8 text; save the file as UTF-8") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None


def parse_yaml(text: str, source: str) -> Any:
    """Return the data of a YAML text; `source` names it in errors.

    Raises:
        InputError: It is no YAML, or a key stands twice in one mapping.
    """
    try:
        return yaml.load(text, Loader=_StrictLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f" line {mark.line + 1}, column {mark.column + 1}:" if mark else ""
        problem = " ".join(str(error.problem or error.context).split())
        raise InputError(f"{source}:{where} {problem}; mend the YAML there") from None
    except yaml.YAMLError as error:
        raise InputError(f"{source}: not YAML: {' '.join(str(error).split())}; mend the YAML there") from None
    except ValueError as error:
        raise InputError(
            f"{source}: a value cannot be read: {error}; write it as a plain number or in quotes"
        ) from None
    except RecursionError:
        raise InputError(f"{source}: nested too deeply; a few levels are enough") from None


def validate(data: Any, model: type[ModelT], *, source: str, context: Any = None) -> ModelT:
    """Return the model that the data describes; `source` names it in errors.

    Raises:
        InputError: The data does not fit.
    """
    if not isinstance(data, Mapping):
        found = "is empty" if data is None else f"holds {_shown(data)}"
        fields = [name for name, field in model.model_fields.items() if field.is_required()]
        raise InputError(f"{source}: {found}; it takes a mapping with {', '.join(fields) or 'fields'}")
    try:
        return model.model_validate(data, context=context)
    except ValidationError as error:
        raise InputError(f"{source}: {explain(error, model)}") from None
    except RecursionError:
        raise InputError(f"{source}: nested too deeply; a few levels are enough") from None


def explain(error: ValidationError, model: type[BaseModel]) -> str:
    """Return the first mistake in a ValidationError in one line: field, value, what is valid."""
    details = error.errors(include_url=False)
    # A misspelt field is reported as unknown and as missing; the first says more.
    first = next((item for item in details if item["type"] == "extra_forbidden"), details[0])
    line = _one_line(first, model)
    others = len({_path(item, model) for item in details} - {_path(first, model)})
    return f"{line} (and {others} more)" if others > 1 else line


def _one_line(detail: ErrorDetails, model: type[BaseModel]) -> str:
    path, context = _path(detail, model), detail.get("ctx", {})
    match detail["type"]:
        case "extra_forbidden":
            names = _fields_at(model, detail["loc"][:-1])
            where, field = path.rpartition(".")[0], str(detail["loc"][-1])
            hint = did_you_mean(field, names) or f"; it takes {', '.join(names)}"
            return f"{where}{': ' * bool(where)}unknown field {_shown(field)}{hint}"
        case "missing":
            return f"{path}: is missing; {_wanted(model, detail['loc'])}"
        case "value_error":
            return _refused(path, " ".join(str(context.get("error", detail["msg"])).split()))
        case "union_tag_not_found":
            tag = str(context["discriminator"]).strip("'")
            return f"{path}.{tag}: is missing; give one of {', '.join(_tags_at(model, detail['loc']))}"
        case "union_tag_invalid" | "literal_error" | "enum" as kind:
            raw = str(context.get("expected_tags") or context["expected"])
            valid = [item.strip().strip("'") for item in raw.replace(" or ", ", ").split(",")]
            shown = context.get("tag", detail["input"])
            tag = f".{str(context['discriminator']).strip(chr(39))}" if kind == "union_tag_invalid" else ""
            return f"{path}{tag}: {_shown(shown)} is not one of {', '.join(valid)}{did_you_mean(str(shown), valid)}"
        case _:
            return f"{path}: {_shown(detail['input'])}: {_plain(detail)}"


def _refused(path: str, message: str) -> str:
    """Return what a check of our own says about a field; a check over several fields names its field first."""
    head, colon, rest = message.partition(": ")
    if colon and _FIELD.fullmatch(head):
        return f"{path}{'.' * bool(path)}{head}: {rest}"
    return f"{path}: {message}" if path else message


def _plain(detail: ErrorDetails) -> str:
    kind, context = detail["type"], detail.get("ctx", {})
    match kind:
        case "finite_number":
            return "is not a finite number; give a plain number"
        case "greater_than":
            return f"must be greater than {context['gt']:g}"
        case "greater_than_equal":
            return f"must be at least {context['ge']:g}"
        case "less_than":
            return f"must be less than {context['lt']:g}"
        case "less_than_equal":
            return f"must be at most {context['le']:g}"
        case "float_parsing" | "float_type" | "int_parsing" | "int_type" | "int_from_float":
            return "is not a number" if kind.startswith("float") else "is not a whole number"
        case "model_type" | "model_attributes_type" | "dict_type":
            return "is not a mapping of fields; indent 'name: value' lines under it"
        case "tuple_type" | "list_type":
            return "is not a list; write [a, b, c]"
        case "too_long" | "too_short" if "actual_length" in context:
            least, most = context.get("min_length"), context.get("max_length")
            return f"has {context['actual_length']} entries; give {f'at most {most}' if most else f'at least {least}'}"
        case _:
            message = detail["msg"]
            return message[0].lower() + message[1:]


def _shown(value: Any) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    text = " ".join(repr(value[:_MAX_SHOWN] if isinstance(value, str) else value).split())
    return text if len(text) <= _MAX_SHOWN else text[: _MAX_SHOWN - 3] + "..."


def _path(detail: ErrorDetails, model: type[BaseModel]) -> str:
    """Return the field's path as it is written in the file: `scene.objects[0].pose.xyz`."""
    path = ""
    for step in _written_steps(model, detail["loc"]):
        path += f"[{step}]" if isinstance(step, int) else f".{_clipped(step)}" if path else _clipped(step)
    return path


def _clipped(step: str) -> str:
    return step if len(step) <= _MAX_SHOWN else step[: _MAX_SHOWN - 3] + "..."


def _wanted(model: type[BaseModel], loc: tuple[int | str, ...]) -> str:
    owner = _resolve(model, loc[:-1])[0]
    field = str(loc[-1])
    if isinstance(loc[-1], int):
        return f"the list takes {len(typing.get_args(owner))} entries"
    if isinstance(owner, type) and issubclass(owner, BaseModel):
        info = owner.model_fields.get(field)
        if info is not None and info.description:
            return f"give {info.description}"
        needed = [item.alias or name for name, item in owner.model_fields.items() if item.is_required()]
        return f"needed here: {', '.join(needed)}"
    return "give it"


def _fields_at(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    owner = _resolve(model, loc)[0]
    if not (isinstance(owner, type) and issubclass(owner, BaseModel)):
        return []
    return [item.alias or name for name, item in owner.model_fields.items()]


def _tags_at(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    return [tag for member in _members(_resolve(model, loc)[0]) for tag in _tags(member)]


def _written_steps(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[int | str]:
    return _resolve(model, loc)[1]


def _resolve(model: type[BaseModel], loc: tuple[int | str, ...]) -> tuple[Any, list[int | str]]:
    """Follow pydantic's location down the annotations.

    Returns:
        The annotation there, and the steps that stand in the file (pydantic adds the tags of unions).
    """
    here: Any = model
    steps: list[int | str] = []
    for step in loc:
        here = _unwrapped(here)
        if _is_union(here):
            members = _members(here)
            tagged = [item for item in members if step in _tags(item)]
            if tagged:
                here = tagged[0]
                continue
            here = next((item for item in members if _child(item, step) is not None), None)
        steps.append(step)
        here = _child(here, step)
    here = _unwrapped(here)
    if _is_union(here):
        members = _members(here)
        here = members[0] if len(members) == 1 else here
    return here, steps


def _members(annotation: Any) -> list[Any]:
    """Return the kinds of a union, those of unions in it as well, without None."""
    annotation = _unwrapped(annotation)
    if not _is_union(annotation):
        return [annotation]
    return [member for item in typing.get_args(annotation) if item is not type(None) for member in _members(item)]


def _child(annotation: Any, step: int | str) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        fields = {item.alias or name: item for name, item in annotation.model_fields.items()}
        return fields[str(step)].annotation if step in fields else None
    arguments = typing.get_args(annotation)
    if isinstance(step, int) and arguments:
        return arguments[step] if step < len(arguments) and arguments[step] is not ... else arguments[0]
    return arguments[1] if len(arguments) == 2 and typing.get_origin(annotation) in (dict, Mapping) else None


def _tags(annotation: Any) -> list[str]:
    annotation = _unwrapped(annotation)
    if (
        not (isinstance(annotation, type) and issubclass(annotation, BaseModel))
        or "kind" not in annotation.model_fields
    ):
        return []
    kind = annotation.model_fields["kind"].annotation
    return list(typing.get_args(kind)) if typing.get_origin(kind) is Literal else []


def _unwrapped(annotation: Any) -> Any:
    while typing.get_origin(annotation) is Annotated:
        annotation = typing.get_args(annotation)[0]
    return annotation


def _is_union(annotation: Any) -> bool:
    return typing.get_origin(annotation) in (Union, types.UnionType)


class _StrictLoader(yaml.SafeLoader):
    """Reads plain data by YAML 1.2's core schema, and refuses a mapping in which a key stands twice.

    YAML 1.1 would read `kind: on` as true, 010 as eight, 1:30 as ninety, and 1e-3 as a text.
    """


# A fresh dictionary: the base class's own is shared by all of PyYAML's safe loaders.
_StrictLoader.yaml_implicit_resolvers = {}
for _tag, _pattern, _first in (
    ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("int", r"[-+]?(?:0|[1-9][0-9]*)", "-+0123456789"),
    ("float", r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?", "-+.0123456789"),
    ("float", r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)", "-+."),
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("merge", r"<<", "<"),
):
    _StrictLoader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"^(?:{_pattern})$"), list(_first))


def _construct_mapping(loader: _StrictLoader, node: yaml.MappingNode) -> dict[Hashable, Any]:
    seen: set[Hashable] = set()
    for key_node, _ in node.value:
        if key_node.tag == "tag:yaml.org,2002:merge":
            continue
        key = loader.construct_object(key_node, deep=True)
        if not isinstance(key, Hashable):
            raise yaml.constructor.ConstructorError(
                None, None, "a list or mapping cannot be a key", key_node.start_mark
            )
        if key in seen:
            raise yaml.constructor.ConstructorError(None, None, f"{_shown(key)} stands twice", key_node.start_mark)
        seen.add(key)
    loader.flatten_mapping(node)
    return loader.construct_mapping(node, deep=True)


_StrictLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _construct_mapping)
