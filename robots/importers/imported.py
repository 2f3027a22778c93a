"""A model as it came from its file: a MuJoCo spec, and what was changed to make it move."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from robosandbox.errors import InputError
from robosandbox.shapes.mujoco_log import route_warnings

# Here, because every model of a robot or world is made with what follows.
route_warnings()

# Arrays of a compiled model that must be finite, by prefix, with what their rows belong to.
_NUMBERS = {
    "body": ("pos", "quat", "mass", "inertia", "ipos", "iquat"),
    "geom": ("pos", "quat", "size", "friction"),
    "site": ("pos", "quat"),
    "jnt": ("pos", "axis", "range", "stiffness"),
    "dof": ("damping", "armature", "frictionloss"),
    "actuator": ("gainprm", "biasprm", "gear", "ctrlrange", "forcerange"),
}
_OWNERS = {"body": "body", "geom": "geom", "site": "site", "jnt": "joint", "dof": "joint", "actuator": "actuator"}
# Metres. Chosen because what lies farther from its body is none of a robot: arithmetic loses its millimetres.
_FARTHEST = 1e4
_HEAVIEST = 1e4  # Mass of one body, kg. Chosen: a link of the largest industrial arms (payload 2.3 t) stays below.


@dataclass(slots=True, kw_only=True)
class ImportedModel:
    """A robot or gripper as a spec of its own, without scene, options or keyframes.

    Attributes:
        name: What the model calls itself; the file's stem when it says nothing.
        path: The file.
        spec: Its bodies, joints, geoms and actuators, all named.
        notes: What was repaired, added or left out, in sentences.
        keyframes: Named joint values that the file or its SRDF gives, best first.
        velocity: Velocity limits from the file, by joint.
        made_actuators: Actuators that the file does not have.
        disabled_pairs: Pairs of links that the SRDF lets touch.
        choices: Names of the trees that were there to choose from, the chosen one first.
        options: What the file says of the solver, as a spec that holds nothing else, where loading is to change no physics;
            None where loading fits the model.
    """

    name: str
    path: Path
    spec: mujoco.MjSpec
    notes: list[str] = field(default_factory=list)
    keyframes: dict[str, dict[str, float]] = field(default_factory=dict)
    velocity: dict[str, float] = field(default_factory=dict)
    made_actuators: set[str] = field(default_factory=set)
    disabled_pairs: list[tuple[str, str]] = field(default_factory=list)
    choices: tuple[str, ...] = ()
    options: mujoco.MjSpec | None = None


def compile_spec(spec: mujoco.MjSpec, source: str) -> mujoco.MjModel:
    """Return the compiled model.

    Raises:
        InputError: It does not compile, in the compiler's own words; or a number in it is not finite.
    """
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"{source}: {one_line(error)}") from None
    _check_finite(model, source)
    return model


def _check_finite(model: mujoco.MjModel, source: str) -> None:
    """Refuse numbers that the compiler lets through and that nothing can be computed with: no numbers, and no lengths."""
    for kind, arrays in _NUMBERS.items():
        for name in arrays:
            values = np.asarray(getattr(model, f"{kind}_{name}"))
            rows = ~np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
            if rows.any():
                index = int(rows.argmax())
                owner = _OWNERS[kind]
                row = int(model.dof_jntid[index]) if kind == "dof" else index
                element = getattr(model, owner)(row).name
                raise InputError(f"{source}: {owner} {element!r}: its {name} is not finite; give plain numbers")
    for kind in ("body", "jnt", "geom"):
        away = np.linalg.norm(getattr(model, f"{kind}_pos"), axis=1)
        if away.max(initial=0.0) > _FARTHEST:
            element = getattr(model, kind)(int(away.argmax())).name
            raise InputError(
                f"{source}: {_OWNERS[kind]} {element!r}: is {away.max():g} m away from its body; give metres"
            )
    _check_most(model, source, "body", "mass", _HEAVIEST, "kg")
    _check_most(model, source, "geom", "size", _FARTHEST, "m")


def _check_most(model: mujoco.MjModel, source: str, kind: str, name: str, most: float, unit: str) -> None:
    each = np.asarray(getattr(model, f"{kind}_{name}"))
    values = each.max(axis=1, initial=0.0) if each.ndim > 1 else each
    if values.max(initial=0.0) > most:
        element = getattr(model, kind)(int(values.argmax())).name
        raise InputError(
            f"{source}: {kind} {element!r}: its {name} {values.max():g} is outside 0 to {most:g} {unit}; give {unit}"
        )


def copy_options(spec: mujoco.MjSpec, source: mujoco.MjSpec) -> None:
    """Give a spec another's physics options and camera depths; MuJoCo warns of differences when it attaches one to the other."""
    copy_physics(spec, source)
    _copy_fields(spec.visual.map, source.visual.map)
    spec.njmax, spec.nconmax = source.njmax, source.nconmax


def copy_physics(spec: mujoco.MjSpec, source: mujoco.MjSpec) -> None:
    """Give a spec another's physics options."""
    _copy_fields(spec.option, source.option)


def has_default_options(spec: mujoco.MjSpec) -> bool:
    """Tell whether a spec's physics options are all MuJoCo's own, as where its file says nothing of them."""
    mine, default = spec.option, mujoco.MjSpec().option
    return all(np.array_equal(getattr(mine, name), getattr(default, name)) for name in _fields(default))


def _copy_fields(mine: object, theirs: object) -> None:
    for name in _fields(theirs):
        setattr(mine, name, getattr(theirs, name))


def _fields(element: object) -> list[str]:
    return [name for name in dir(element) if not name.startswith("_") and not callable(getattr(element, name))]


def put_scalar(element: Any, field: str, value: float) -> None:
    """Set a joint's damping or stiffness, which newer MuJoCo keeps as a polynomial's coefficients."""
    old = np.asarray(getattr(element, field))
    if old.ndim == 0:
        setattr(element, field, value)
    else:
        coefficients = np.zeros(old.shape)
        coefficients.flat[0] = value
        setattr(element, field, coefficients)


def get_scalar(element: Any, field: str) -> float:
    """Return a joint's damping or stiffness: the coefficient of the linear term."""
    return float(np.asarray(getattr(element, field)).flat[0])


def one_line(error: Exception) -> str:
    """Return an exception's text in one line."""
    return " ".join(str(error).split())
