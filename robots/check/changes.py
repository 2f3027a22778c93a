"""Values of a model's file that loading changes: every number of the two compiled models, side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from robosandbox.errors import InputError
from robosandbox.robots.importers.imported import one_line
from robosandbox.values import frozen

Value = float | int | tuple[float | int, ...]

# The body that MuJoCo itself gives every model: the room's where a robot is loaded, and none of the robot's.
_WORLD = "world"

# How many names a line of the table shows: a hand's parts fit on it, chosen for a screen's width.
_SHOWN = 4

# Ratio by which equal values differ at the most. Chosen because text keeps six digits of an inertia that is rotated.
_SAME = 1e-6

# A compiled model's arrays by the start of their names, and whose row each is.
_ARRAYS = {
    "body": "body",
    "jnt": "joint",
    "dof": "joint",
    "geom": "geom",
    "site": "site",
    "actuator": "actuator",
    "tendon": "tendon",
    "eq": "equality",
}

# Endings of arrays that number, place or draw elements and change no motion.
_BOOKKEEPING = ("id", "adr", "num", "user", "plugin", "rgba", "group", "sameframe", "simple", "castshadow", "history")

# Values that the compiler derives from others, which are listed themselves.
_DERIVED = frozenset(
    [
        "body_subtreemass",
        "body_invweight0",
        "body_contype",
        "body_conaffinity",
        "body_margin",
        "dof_M0",
        "dof_invweight0",
        "dof_length",
        "geom_rbound",
        "geom_aabb",
        "actuator_acc0",
        "actuator_length0",
        "actuator_lengthrange",
        "tendon_length0",
        "tendon_invweight0",
    ]
)


@frozen(kw_only=True)
class Change:
    """One value that loading changed.

    Attributes:
        element: "body", "joint", "geom", "site", "actuator", "tendon", "equality", "exclude"
            (two links whose contacts are left out) or "option".
        name: Whose it is; an unnamed geom or site is "<body>[<number on it>]".
        field: The compiled model's array, a field of its `opt`, or "present" for an element that only one model has.
        file: What the file says.
        loaded: What is simulated.
    """

    element: str
    name: str
    field: str
    file: Value
    loaded: Value

    @property
    def is_derived(self) -> bool:
        """True where the compiler works it out of other values."""
        return self.field in _DERIVED


def compile_file(path: Path) -> mujoco.MjModel:
    """Return the model of a file as MuJoCo itself compiles it.

    Raises:
        InputError: MuJoCo cannot, as with a URDF whose meshes are named by package.
    """
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(
            f"{path.name}: MuJoCo itself does not read it, so nothing to compare: {one_line(error)}"
        ) from None


def changes(file: mujoco.MjModel, loaded: mujoco.MjModel, *, prefix: str = "") -> tuple[Change, ...]:
    """Return every value that differs, and every element that only one of two models has.

    Args:
        file: A robot's file, compiled as it is.
        loaded: A world with the robot in it.
        prefix: Of the robot's names there; what does not begin with it is the world's own.
    """
    before, after = _Elements(file), _Elements(loaded, prefix)
    return (*_options(file, loaded), *_values(before, after), *_left_out(before, after))


def _options(file: mujoco.MjModel, loaded: mujoco.MjModel) -> Iterator[Change]:
    for name in sorted(dir(file.opt)):
        old = getattr(file.opt, name)
        if name.startswith("_") or callable(old):
            continue
        first, second = np.atleast_1d(old), np.atleast_1d(getattr(loaded.opt, name))
        if not _same(first, second):
            yield Change(element="option", name="world", field=name, file=_plain(first), loaded=_plain(second))


def _values(before: _Elements, after: _Elements) -> Iterator[Change]:
    for start, element in _ARRAYS.items():
        old, new = before.rows(start), after.rows(start)
        for name in dict.fromkeys((*old, *new)):
            if start != "dof" and (name not in old or name not in new):
                there = (0, 1) if name in new else (1, 0)
                yield Change(element=element, name=name, field="present", file=there[0], loaded=there[1])
        for field in before.fields(start):
            first, second = (getattr(model, field) for model in (before.model, after.model))
            for name in (name for name in old if name in new):
                mine, other = np.atleast_1d(first[old[name]]), np.atleast_1d(second[new[name]])
                if not _same(mine, other):
                    yield Change(element=element, name=name, field=field, file=_plain(mine), loaded=_plain(other))


def _left_out(before: _Elements, after: _Elements) -> Iterator[Change]:
    """Yield the pairs of links whose contacts only one of the models leaves out."""
    old, new = before.pairs(), after.pairs()
    for name in sorted(old ^ new):
        yield Change(element="exclude", name=name, field="present", file=int(name in old), loaded=int(name in new))


def _same(first: NDArray[np.generic], second: NDArray[np.generic]) -> bool:
    return first.shape == second.shape and bool(np.allclose(first, second, rtol=_SAME, atol=_SAME**2, equal_nan=True))


def _plain(value: NDArray[np.generic]) -> Value:
    flat = tuple(value.ravel().tolist())
    return flat[0] if len(flat) == 1 else flat


class _Elements:
    """A model's elements by names that the model before loading and the one after have in common."""

    def __init__(self, model: mujoco.MjModel, prefix: str = "") -> None:
        self.model = model
        self._prefix = prefix

    def fields(self, start: str) -> list[str]:
        """Return the arrays with a row for each element."""
        count = len(self._owners[start])
        found = []
        for field in dir(self.model):
            if field.startswith(f"{start}_") and not field.endswith(_BOOKKEEPING):
                value = getattr(self.model, field)
                if isinstance(value, np.ndarray) and value.ndim and len(value) == count:
                    found.append(field)
        return found

    def rows(self, start: str) -> Mapping[str, int]:
        """Return the row of each element; of a joint with several degrees of freedom "<joint>.<number>"."""
        return {name: row for row, name in enumerate(self._owners[start]) if name not in (None, _WORLD)}

    def pairs(self) -> set[str]:
        """Return the pairs of bodies whose contacts are left out, "<one> and <other>"."""
        bodies = self._owners["body"]
        found = set[str]()
        for signature in self.model.exclude_signature:
            names = [bodies[int(signature) & 0xFFFF], bodies[int(signature) >> 16]]
            found |= {" and ".join(sorted(name for name in names if name is not None))} if None not in names else set()
        return found

    @cached_property
    def _owners(self) -> dict[str, list[str | None]]:
        model = self.model
        bodies = self._bodies()
        joints = self._on_bodies(bodies, model.jnt_bodyid, lambda row: model.joint(row).name)
        return {
            "body": bodies,
            "jnt": joints,
            "dof": [self._degree(joints, row) for row in range(model.nv)],
            "geom": self._on_bodies(bodies, model.geom_bodyid, lambda row: model.geom(row).name),
            "site": self._on_bodies(bodies, model.site_bodyid, lambda row: model.site(row).name),
            "actuator": self._numbered(model.nu, lambda row: model.actuator(row).name),
            "tendon": self._numbered(model.ntendon, lambda row: model.tendon(row).name),
            "eq": self._numbered(model.neq, lambda row: model.equality(row).name),
        }

    def _bodies(self) -> list[str | None]:
        """Return each body's name; an unnamed one is called after its parent, as the importer does. None is not the robot's."""
        model, found = self.model, list[str | None]()
        for body in range(model.nbody):
            name = model.body(body).name
            if body == 0:
                found.append(None if self._prefix else _WORLD)
            elif name:
                found.append(self._own(name))
            else:
                stem, number = f"{found[model.body_parentid[body]]}_body", 2
                name = stem
                while name in found:
                    name, number = f"{stem}_{number}", number + 1
                found.append(name)
        return found

    def _on_bodies(
        self, bodies: list[str | None], of: NDArray[np.int32], name_of: Callable[[int], str]
    ) -> list[str | None]:
        found, counts = list[str | None](), dict[str, int]()
        for row, body in enumerate(of):
            owner = bodies[int(body)]
            if owner is None:
                found.append(None)
            elif name := name_of(row):
                found.append(name.removeprefix(self._prefix))
            else:
                found.append(f"{owner}[{counts.get(owner, 0)}]")
                counts[owner] = counts.get(owner, 0) + 1
        return found

    def _numbered(self, count: int, name_of: Callable[[int], str]) -> list[str | None]:
        return [self._own(name) if (name := name_of(row)) else f"[{row}]" for row in range(count)]

    def _degree(self, joints: list[str | None], dof: int) -> str | None:
        joint = int(self.model.dof_jntid[dof])
        name = joints[joint]
        if name is None:
            return None
        number = dof - int(self.model.jnt_dofadr[joint])
        return f"{name}.{number}" if number else name

    def _own(self, name: str) -> str | None:
        return name.removeprefix(self._prefix) if name.startswith(self._prefix) else None


def table(found: tuple[Change, ...]) -> Iterator[str]:
    """Yield a line for each field and pair of values, with how many elements it is so of; derived values are counted."""
    groups: dict[tuple[str, str, Value, Value], list[str]] = {}
    for change in found:
        if not change.is_derived:
            groups.setdefault((change.element, change.field, change.file, change.loaded), []).append(change.name)
    for (element, field, file, loaded), names in groups.items():
        more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        said = f"{_text(file)} -> {_text(loaded)}" if field != "present" else ("added" if loaded else "left out")
        yield f"{element:<9} {field:<20} {said}: {', '.join(names[:_SHOWN])}{more}"
    if derived := sum(change.is_derived for change in found):
        yield f"{derived} more values follow from these"


def _text(value: Value) -> str:
    return " ".join(f"{number:g}" for number in (value if isinstance(value, tuple) else (value,)))
