"""Frozen values: dataclasses whose constructor is compiled when the first one is made.

The standard `dataclass(frozen=True, slots=True)` compiles six functions for each class. A command loads some 250 classes and
makes values of a few, so that this was a quarter of what the house adds to the start of a command. A class of `frozen` is a
standard dataclass otherwise: `fields`, `replace`, `asdict`, `match`, pickling and standard dataclasses that inherit from it work.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, field, fields, is_dataclass
from operator import attrgetter
from typing import Any, TypeVar, dataclass_transform, overload

T = TypeVar("T")


@overload
def frozen(cls: type[T], /) -> type[T]: ...
@overload
def frozen(*, eq: bool = True, kw_only: bool = False) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(field, Field))
def frozen(
    cls: type[T] | None = None, /, *, eq: bool = True, kw_only: bool = False
) -> type[T] | Callable[[type[T]], type[T]]:
    """Make a class a frozen dataclass with slots.

    Args:
        cls: The class, where the decorator stands without arguments.
        eq: Whether two values with equal fields are equal and hash alike; else a value equals itself alone.
        kw_only: Whether the constructor takes its fields by keyword only.
    """

    def made(cls: type[T]) -> type[T]:
        return _made(cls, eq=eq, kw_only=kw_only)

    return made if cls is None else made(cls)


def _made(cls: type[Any], *, eq: bool, kw_only: bool) -> type[Any]:
    inherits = any(is_dataclass(base) for base in cls.__mro__[1:])
    # The standard library compares the bases' flag with the one it is given, and compiles two functions for a frozen class.
    made: type[Any] = dataclass(init=False, repr=False, eq=False, frozen=inherits, slots=True, kw_only=kw_only)(cls)
    made.__dataclass_params__.frozen = True
    own = cls.__dict__
    methods: dict[str, Any] = {
        "__init__": _Constructor(made),
        "__repr__": _repr,
        "__setattr__": _refuse_to_set,
        "__delattr__": _refuse_to_delete,
        "__getstate__": _state,
        "__setstate__": _set_state,
    }
    if eq:
        names = [each.name for each in fields(made) if each.compare]
        made.__compared__ = attrgetter(*names or ["__class__"])
        methods |= {"__eq__": _equal, "__hash__": _hash}
    for name, method in methods.items():
        # Python itself puts None for the hash of a class that compares in its own way.
        if own.get(name) is None:
            setattr(made, name, method)
    return made


class _Constructor:
    """The place of a constructor that nobody has asked for; it gives way to the compiled one."""

    def __init__(self, cls: type[Any]) -> None:
        self._cls = cls

    def __get__(self, value: object, owner: type[Any]) -> Callable[..., None]:
        compiled = _compiled(self._cls)
        self._cls.__init__ = compiled
        return compiled if value is None else compiled.__get__(value, owner)


def _compiled(cls: type[Any]) -> Callable[..., None]:
    """Return the constructor of a value class."""
    given: dict[str, Any] = {"_set": object.__setattr__, "_unset": MISSING}
    anywhere, by_name, body = ["self"], list[str](), list[str]()
    for number, each in enumerate(fields(cls)):
        taken = each.name
        if each.default_factory is not MISSING:
            given[f"_make{number}"] = each.default_factory
            default = "=_unset"
            taken = f"_make{number}() if {each.name} is _unset else {each.name}" if each.init else f"_make{number}()"
        elif each.default is not MISSING:
            given[f"_default{number}"] = each.default
            default = f"=_default{number}"
            taken = each.name if each.init else f"_default{number}"
        elif not each.init:
            continue  # set by __post_init__
        else:
            default = ""
        if each.init:
            (by_name if each.kw_only else anywhere).append(each.name + default)
        body.append(f" _set(self, {each.name!r}, {taken})")
    if hasattr(cls, "__post_init__"):
        body.append(" self.__post_init__()")
    taken = ", ".join([*anywhere, *(["*", *by_name] if by_name else [])])
    exec("\n".join([f"def __init__({taken}):", *(body or [" pass"])]), given)
    compiled: Callable[..., None] = given["__init__"]
    compiled.__qualname__ = f"{cls.__qualname__}.__init__"
    compiled.__annotations__ = {each.name: each.type for each in fields(cls) if each.init} | {"return": None}
    compiled.__module__ = cls.__module__
    return compiled


def _repr(self: Any) -> str:
    told = ", ".join(f"{each.name}={getattr(self, each.name)!r}" for each in fields(self) if each.repr)
    return f"{type(self).__qualname__}({told})"


def _equal(self: Any, other: Any) -> Any:
    if type(other) is not type(self):
        return NotImplemented
    return self.__compared__(self) == other.__compared__(other)


def _hash(self: Any) -> int:
    return hash(self.__compared__(self))


def _refuse_to_set(self: object, name: str, _: object) -> None:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_to_delete(self: object, name: str) -> None:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, each.name) for each in fields(self)]


def _set_state(self: Any, state: list[Any]) -> None:
    for each, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, each.name, value)
