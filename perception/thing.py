"""Something that was recognized in a look: its shape, size and pose, its colour, and how sure that is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robosandbox.perception.evidence import ShapeEvidence
from robosandbox.perception.fit import Fit
from robosandbox.perception.groups import Group
from robosandbox.shapes import Shape, shape_of
from robosandbox.types import Array, ObjectKind, Pose
from robosandbox.values import frozen


@frozen(eq=False, kw_only=True)
class Thing:
    """Something that was recognized.

    Attributes:
        kind: Its shape.
        size: Metres, as its shape names them.
        pose: In the world.
        rgb: Its colour, channels 0..1, (3,).
        confidence: 0..1.
        sigma: Standard deviations of x, y, z, metres, and of the heading, radians, (4,).
        group: The pieces that it was seen by.
        fit: Its hull as fitted.
        seen: What it was fitted to.
        resting: Height of what it stands on, metres; None in the air.
        opening: For a drawer: how far it is open, metres.
        tag: Number of the tag that was read on it; None where none was.
    """

    kind: ObjectKind
    size: tuple[float, ...]
    pose: Pose
    rgb: Array
    confidence: float
    sigma: Array
    group: Group
    fit: Fit
    seen: ShapeEvidence
    resting: float | None
    opening: float | None = None
    tag: int | None = None

    @property
    def shape(self) -> Shape:
        """Shape of its kind."""
        return shape_of(self.kind)

    @property
    def top(self) -> float:
        """Height of its highest point, metres."""
        return self.fit.top


def size_and_pose(kind: ObjectKind, found: Fit) -> tuple[tuple[float, ...], Pose]:
    """Return size and pose, as its shape names them, of a kind whose outer hull is fitted."""
    sizes = [float(value) for value in found.sizes]
    shape = shape_of(kind)
    # Containers have their origin in their bottom face.
    origin = np.array([*found.centre[:2], found.bottom]) if shape.holds_things else found.centre
    return shape.size_of_hull(sizes), Pose.from_matrix(origin, found.axes)


def aligned(found: Fit, known: Fit) -> Fit:
    """Return the same box with its axes named such that its heading is nearest to a known one's."""
    if found.shape == "lying" and known.shape == "lying":
        return replace(found, yaw=found.yaw + np.pi * round((known.yaw - found.yaw) / np.pi))
    if found.shape != "box" or known.shape != "box":
        return found
    quarters = round((known.yaw - found.yaw) / (np.pi / 2.0))
    sizes = found.sizes[[1, 0, 2]] if quarters % 2 else found.sizes
    return replace(found, yaw=found.yaw + quarters * np.pi / 2.0, sizes=sizes)
