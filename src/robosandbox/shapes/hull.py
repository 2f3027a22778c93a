"""Convex hulls that shapes and their pieces are made of: extents, support function, volume and inertia.

The support function of a convex body is h(d) = max over its points of d . x (Boyd and Vandenberghe, Convex Optimization,
2.5 and 8.1). Every hull is centred on its own origin; round ones stand along local z.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from robosandbox.shapes.polyhedron import PolyhedronHull
from robosandbox.spatial import Array
from robosandbox.values import frozen


@frozen
class BoxHull:
    """A box.

    Attributes:
        size: Half-extents along its own axes, metres, (3,).
        form: Tells it from other hulls in JSON.
    """

    size: tuple[float, float, float]
    form: Literal["box"] = "box"

    @property
    def half_extents(self) -> Array:
        """Half-extents of the box around it in its own frame, metres, shape (3,)."""
        return np.array(self.size)

    @property
    def radius(self) -> float:
        """Radius of the ball around it, metres."""
        return float(np.linalg.norm(self.size))

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return 8.0 * math.prod(self.size)

    def support(self, local: Array) -> Array:
        """Return how far it reaches along unit vectors of its own frame, shape (n, 3), metres, shape (n,)."""
        reach: Array = np.abs(local) @ self.half_extents
        return reach

    def inertia(self, mass: float) -> Array:
        """Return the principal inertia (3,) of the solid body, kg m^2."""
        xx, yy, zz = np.square(self.size)
        inertia: Array = mass / 3.0 * np.array([yy + zz, xx + zz, xx + yy])
        return inertia


@frozen
class SphereHull:
    """A ball.

    Attributes:
        size: Radius, metres, (1,).
        form: Tells it from other hulls in JSON.
    """

    size: tuple[float]
    form: Literal["sphere"] = "sphere"

    @property
    def half_extents(self) -> Array:
        """Half-extents of the box around it, metres, shape (3,)."""
        return np.full(3, self.size[0])

    @property
    def radius(self) -> float:
        """Its radius, metres."""
        return self.size[0]

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return 4.0 / 3.0 * math.pi * self.size[0] ** 3

    def support(self, local: Array) -> Array:
        """Return how far it reaches along unit vectors, shape (n, 3), metres, shape (n,)."""
        return np.full(len(local), self.size[0])

    def inertia(self, mass: float) -> Array:
        """Return the principal inertia (3,) of the solid body, kg m^2."""
        return np.full(3, 0.4 * mass * self.size[0] ** 2)


@frozen
class CylinderHull:
    """A cylinder along local z.

    Attributes:
        size: Radius and half height, metres, (2,).
        form: Tells it from other hulls in JSON.
    """

    size: tuple[float, float]
    form: Literal["cylinder"] = "cylinder"

    @property
    def half_extents(self) -> Array:
        """Half-extents of the box around it in its own frame, metres, shape (3,)."""
        radius, half = self.size
        return np.array([radius, radius, half])

    @property
    def radius(self) -> float:
        """Radius of the ball around it, metres."""
        return float(np.hypot(*self.size))

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return math.pi * self.size[0] ** 2 * 2.0 * self.size[1]

    def support(self, local: Array) -> Array:
        """Return how far it reaches along unit vectors of its own frame, shape (n, 3), metres, shape (n,)."""
        axial = np.abs(local[:, 2])
        radial = np.sqrt(np.maximum(1.0 - axial**2, 0.0))
        reach: Array = self.size[0] * radial + self.size[1] * axial
        return reach

    def inertia(self, mass: float) -> Array:
        """Return the principal inertia (3,) of the solid body, kg m^2."""
        radius, half = self.size
        side = mass * (3.0 * radius**2 + 4.0 * half**2) / 12.0
        return np.array([side, side, 0.5 * mass * radius**2])


@frozen
class CapsuleHull:
    """A cylinder along local z with half a ball on either end.

    Attributes:
        size: Radius and half height without the caps, metres, (2,).
        form: Tells it from other hulls in JSON.
    """

    size: tuple[float, float]
    form: Literal["capsule"] = "capsule"

    @property
    def half_extents(self) -> Array:
        """Half-extents of the box around it in its own frame, metres, shape (3,)."""
        radius, half = self.size
        return np.array([radius, radius, radius + half])

    @property
    def radius(self) -> float:
        """Radius of the ball around it, metres."""
        return float(sum(self.size))

    @property
    def volume(self) -> float:
        """Cubic metres."""
        radius, half = self.size
        return math.pi * radius**2 * (2.0 * half + 4.0 / 3.0 * radius)

    def support(self, local: Array) -> Array:
        """Return how far it reaches along unit vectors of its own frame, shape (n, 3), metres, shape (n,)."""
        reach: Array = self.size[0] + self.size[1] * np.abs(local[:, 2])
        return reach

    def inertia(self, mass: float) -> Array:
        """Return the principal inertia (3,) of the solid body: a cylinder and two half balls, by volume; kg m^2."""
        radius, half = self.size
        cylinder, ball = 2.0 * half * radius**2, 4.0 / 3.0 * radius**3
        cylinder, ball = mass * cylinder / (cylinder + ball), mass * ball / (cylinder + ball)
        side = cylinder * (3.0 * radius**2 + 4.0 * half**2) / 12.0
        side += ball * (0.4 * radius**2 + half**2 + 0.75 * radius * half)
        return np.array([side, side, 0.5 * cylinder * radius**2 + 0.4 * ball * radius**2])


Hull = Annotated[BoxHull | SphereHull | CylinderHull | CapsuleHull | PolyhedronHull, Field(discriminator="form")]
