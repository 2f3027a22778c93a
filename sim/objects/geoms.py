"""What all object geoms share: the body's name, contact parameters, colour."""

from __future__ import annotations

import mujoco

from robosandbox.types import SceneObject

PREFIX = "object/"

_FRICTION = [1.0, 0.005, 0.0001]
# A ball or a lying can meets resistance to rolling, as on a real table top: about half a millimetre of lever arm.
_ROLLING_FRICTION = [1.0, 0.005, 0.0005]
_ROLLS = frozenset({"sphere", "cylinder", "capsule"})


def add_geom(body: mujoco.MjsBody, item: SceneObject, mass: float, **shape: object) -> None:
    """Add one of an object's geoms: `shape` is what MuJoCo calls it, `mass` its share, kg."""
    rolls = item.kind in _ROLLS
    body.add_geom(
        mass=mass,
        rgba=shape.pop("rgba", item.rgba),
        condim=6 if rolls else 4,
        friction=_ROLLING_FRICTION if rolls else _FRICTION,
        **shape,
    )
