"""Frozen values behave as the standard library's frozen dataclasses with slots do, but for when the constructor is compiled."""

from __future__ import annotations

import copy
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, asdict, dataclass, field, fields, is_dataclass, replace
from typing import Any, ClassVar

import pytest

from robosandbox.values import frozen

standard = dataclass(frozen=True, slots=True)


@frozen
class Point:
    """A point with a name that does not count and a list of its own."""

    kind: ClassVar[str] = "point"
    x: float
    y: float = 0.0
    name: str = field(default="", compare=False)
    seen: list[int] = field(default_factory=list, compare=False, repr=False)
    length: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", (self.x**2 + self.y**2) ** 0.5)


@frozen(kw_only=True)
class Named(Point):
    """A point that is named by keyword."""

    title: str


@frozen(eq=False)
class Identity:
    """A value that equals itself alone."""

    x: int


@frozen
class Folded:
    """A name that compares without its case."""

    name: str

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Folded) and other.name.lower() == self.name.lower()

    def __hash__(self) -> int:
        return hash(self.name.lower())


@dataclass(frozen=True)
class Outsider(Point):
    """A standard dataclass that inherits from a value."""

    unit: str = "m"


@frozen
class Nothing:
    """A value without fields."""


def test_fields_defaults_and_what_is_set_after() -> None:
    point = Point(3.0, y=4.0)
    assert (point.x, point.y, point.name, point.seen, point.length) == (3.0, 4.0, "", [], 5.0)
    assert Point(1.0).seen is not Point(1.0).seen
    assert [each.name for each in fields(Point)] == ["x", "y", "name", "seen", "length"]
    assert repr(point) == "Point(x=3.0, y=4.0, name='', length=5.0)"
    assert not hasattr(point, "__dict__")


@pytest.mark.parametrize(
    "change", [lambda p: setattr(p, "x", 1.0), lambda p: setattr(p, "z", 1), lambda p: delattr(p, "x")]
)
def test_nothing_can_be_set_or_deleted(change: Callable[[Any], None]) -> None:
    with pytest.raises(FrozenInstanceError):
        change(Point(3.0))


def test_equal_by_the_fields_that_count_and_the_class() -> None:
    assert Point(1.0, 2.0, "a") == Point(1.0, 2.0, "b") != Point(1.0, 3.0, "a")
    assert len({Point(1.0), Point(1.0), Point(2.0)}) == 2
    assert Point(1.0) != Named(1.0, title="")
    assert Point(1.0) != (1.0, 0.0)
    assert Identity(1) != Identity(1)
    assert Folded("A") == Folded("a")
    assert len({Folded("A"), Folded("a")}) == 1
    assert Nothing() == Nothing()
    assert len({Nothing(), Nothing()}) == 1


def test_arguments_are_checked_as_by_any_function() -> None:
    with pytest.raises(TypeError, match=r"Point.__init__\(\) missing 1 required positional argument: 'x'"):
        Point()  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="unexpected keyword argument 'length'"):
        Point(1.0, length=2.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="takes from 2 to 5 positional arguments"):
        Named(1.0, 2.0, "", [], "title")  # type: ignore[misc, call-arg]


@pytest.mark.parametrize("value", [Point(3.0, name="a", seen=[1]), Named(1.0, title="b"), Folded("c"), Nothing()])
def test_standard_tools_take_values(value: Any) -> None:
    assert is_dataclass(value)
    for same in (copy.deepcopy(value), pickle.loads(pickle.dumps(value)), replace(value)):
        assert same == value
        assert asdict(same) == asdict(value)
    assert inspect.signature(type(value)) == inspect.signature(type(value).__init__).replace(
        parameters=list(inspect.signature(type(value).__init__).parameters.values())[1:]
    )


def test_values_match_and_are_inherited_from() -> None:
    match Point(1.0, 2.0):
        case Point(x, y):
            assert (x, y) == (1.0, 2.0)
    outsider = Outsider(3.0, 4.0, unit="mm")
    assert (outsider.length, outsider.unit, replace(outsider, x=0.0).length) == (5.0, "mm", 4.0)
    with pytest.raises(FrozenInstanceError):
        outsider.x = 1.0  # type: ignore[misc]


def test_signature_is_that_of_a_standard_dataclass() -> None:
    @standard
    class Other:
        x: float
        y: float = 0.0
        seen: list[int] = field(default_factory=list)

    @frozen
    class Own:
        x: float
        y: float = 0.0
        seen: list[int] = field(default_factory=list)

    ours, theirs = inspect.signature(Own).parameters, inspect.signature(Other).parameters
    assert [(p.name, p.kind, p.annotation) for p in ours.values()] == [
        (p.name, p.kind, p.annotation) for p in theirs.values()
    ]
