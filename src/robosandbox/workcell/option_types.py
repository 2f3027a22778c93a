"""Type checks of a workcell's options, for programs that no type checker has seen."""

from __future__ import annotations

import types
from collections.abc import Iterator
from dataclasses import fields
from functools import lru_cache
from numbers import Integral
from typing import Any, Union, get_args, get_origin, get_type_hints

from robosandbox.errors import InputError
from robosandbox.tasks.task import Task
from robosandbox.types import Scene
from robosandbox.workcell.options import WorkcellOptions

_MAX_SHOWN = 60  # Characters of a value that an error shows. Chosen so that it stays one line.


def check_types(options: WorkcellOptions) -> None:
    """Refuse a value of another kind than its field's.

    Raises:
        InputError: The field, the value, and what it may be.
    """
    hints = _hints()
    for field in fields(WorkcellOptions):
        value = getattr(options, field.name)
        kinds = tuple(_kinds(hints[field.name]))
        if not isinstance(value, kinds):
            valid = " or ".join("None" if kind is types.NoneType else _NAMES.get(kind, kind.__name__) for kind in kinds)
            raise InputError(
                f"{field.name}: {repr(value)[:_MAX_SHOWN]} is of type {type(value).__name__}; give {valid}"
            )
    if len(options.render_size) != 2 or not all(isinstance(side, Integral) for side in options.render_size):
        raise InputError(f"render_size: {options.render_size} is not (height, width) in pixels")


_NAMES: dict[type, str] = {Integral: "int"}


@lru_cache(maxsize=1)
def _hints() -> dict[str, Any]:
    return get_type_hints(WorkcellOptions, localns={"Task": Task, "Scene": Scene})


def _kinds(hint: Any) -> Iterator[type]:
    """Yield the classes that a field's annotation takes."""
    if get_origin(hint) in (Union, types.UnionType):
        for part in get_args(hint):
            yield from _kinds(part)
    elif hint is int:
        # NumPy's integers as well.
        yield Integral
    else:
        yield get_origin(hint) or hint
