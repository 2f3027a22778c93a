"""Scene objects as Bullet's bodies, built from the pieces that their shapes answer with."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pybullet

from robosandbox.errors import InputError
from robosandbox.shapes.beads import stacked
from robosandbox.shapes.body import Body, Contact, Piece, Slide
from robosandbox.shapes.hull import BoxHull, CapsuleHull, CylinderHull, SphereHull
from robosandbox.types import Pose, Scene, SceneObject

# One of Bullet's functions by name, called in one world.
Call = Callable[..., Any]

# The most shapes that Bullet's function takes for one link (MAX_COMPOUND_COLLISION_SHAPES in its sources); more crash it.
_MOST_PIECES = 16
_UNTURNED = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class _Link:
    """Pieces that do not move against one another, and how they move against the object's first ones."""

    pieces: tuple[Piece, ...]
    contact: Contact
    slide: Slide | None = None

    @property
    def mass(self) -> float:
        return sum(piece.mass for piece in self.pieces)

    @property
    def centre(self) -> list[float]:
        middle = sum(piece.mass * np.array(piece.centre) for piece in self.pieces) / self.mass
        return [float(c) for c in middle]


def add_object(call: Call, scene: Scene, item: SceneObject) -> list[int]:
    """Add an object and return Bullet's numbers of its bodies.

    Args:
        call: Calls one of Bullet's functions by name in the world.
        scene: Holds the container of grains.
        item: The object.

    Raises:
        InputError: It has a tag, is a mesh, or is more grains than its container holds.
    """
    if item.tag is not None:
        raise InputError(f"objects[{item.id}].tag: the driver 'pybullet' prints no tags; leave it out")
    first, *others = item.shape.bodies(item)
    poses = [item.pose] if item.inside is None else _inside(scene, item)
    slides = [link for body in others if isinstance(body.joint, Slide) for link in _links(body)]
    free = [body for body in others if not isinstance(body.joint, Slide)]
    made = [_add(call, item, [*_links(first), *slides], poses[0])]
    return made + [_add(call, item, [*_links(body)], pose) for body, pose in zip(free, poses[1:], strict=True)]


def _links(body: Body) -> Iterator[_Link]:
    """Yield a body's pieces, no more to a link than Bullet takes; those that slide are one link."""
    if isinstance(body.joint, Slide):
        yield _Link(body.pieces, body.contact, body.joint)
        return
    for first in range(0, len(body.pieces), _MOST_PIECES):
        yield _Link(body.pieces[first : first + _MOST_PIECES], body.contact)


def _inside(scene: Scene, item: SceneObject) -> list[Pose]:
    """Return where grains start, in their container."""
    vessel = next(other for other in scene.objects if other.id == item.inside)
    room = vessel.shape.room(vessel.size)
    local = stacked(item.size[0], item.count, room) if room else np.zeros((0, 3))
    if len(local) < item.count:
        raise InputError(f"objects[{item.id}].count: {vessel.id!r} holds {len(local)}; give fewer")
    return [vessel.pose @ Pose(xyz=(float(x), float(y), float(z))) for x, y, z in local]


def _add(call: Call, item: SceneObject, links: Sequence[_Link], pose: Pose) -> int:
    """Add a body that moves freely: the first link, with the others on it."""
    first, *others = links
    still = [_UNTURNED] * len(others)
    forms = [_forms(call, item, link) for link in others]
    made: int = call(
        "createMultiBody",
        first.mass,
        *_forms(call, item, first),
        pose.xyz,
        pose.quat_xyzw,
        first.centre,
        linkMasses=[link.mass for link in others],
        linkCollisionShapeIndices=[solid for solid, _ in forms],
        linkVisualShapeIndices=[drawn for _, drawn in forms],
        linkPositions=[(0.0, 0.0, 0.0)] * len(others),
        linkOrientations=still,
        linkInertialFramePositions=[link.centre for link in others],
        linkInertialFrameOrientations=still,
        linkParentIndices=[0] * len(others),
        linkJointTypes=[pybullet.JOINT_PRISMATIC if link.slide else pybullet.JOINT_FIXED for link in others],
        linkJointAxis=[link.slide.axis if link.slide else (0.0, 0.0, 1.0) for link in others],
    )
    for number, link in enumerate(links, start=-1):
        _set_contact(call, made, number, link.contact)
        if link.slide is not None:
            _set_slide(call, made, number, link.slide, item.open)
    return made


def _set_slide(call: Call, made: int, link: int, slide: Slide, opening: float) -> None:
    call(
        "changeDynamics", made, link, jointLowerLimit=slide.low, jointUpperLimit=slide.high, jointDamping=slide.damping
    )
    call("resetJointState", made, link, opening)
    # A motor that is to stand still is what the friction of a slide does.
    call("setJointMotorControl2", made, link, pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=slide.friction)


def _set_contact(call: Call, made: int, link: int, contact: Contact) -> None:
    call(
        "changeDynamics",
        made,
        link,
        lateralFriction=0.0 if contact.frictionless else contact.sliding,
        spinningFriction=0.0 if contact.frictionless else contact.torsional,
        rollingFriction=contact.rolling,
        linearDamping=0.0,
        angularDamping=0.0,
    )


def _forms(call: Call, item: SceneObject, link: _Link) -> tuple[int, int]:
    """Return Bullet's numbers of what collides and of what is drawn."""
    forms = _arrays(item, link.pieces)
    centres = [list(piece.centre) for piece in link.pieces]
    turns = [list(piece.quat_xyzw) for piece in link.pieces]
    colours = [list(piece.rgba or item.rgba) for piece in link.pieces]
    solid = call(
        "createCollisionShapeArray", **forms, collisionFramePositions=centres, collisionFrameOrientations=turns
    )
    drawn = call(
        "createVisualShapeArray",
        **forms,
        rgbaColors=colours,
        visualFramePositions=centres,
        visualFrameOrientations=turns,
    )
    return solid, drawn


def _arrays(item: SceneObject, pieces: Sequence[Piece]) -> dict[str, list[Any]]:
    """Return pieces as Bullet's arrays of shapes take them."""
    made: dict[str, list[Any]] = {"shapeTypes": [], "halfExtents": [], "radii": [], "lengths": []}
    for piece in pieces:
        half, radius, length = [0.0, 0.0, 0.0], 0.0, 0.0
        match piece.hull:
            case BoxHull():
                kind, half = pybullet.GEOM_BOX, list(piece.hull.size)
            case SphereHull():
                kind, radius = pybullet.GEOM_SPHERE, piece.hull.size[0]
            case CylinderHull():
                kind, (radius, length) = pybullet.GEOM_CYLINDER, piece.hull.size
            case CapsuleHull():
                kind, (radius, length) = pybullet.GEOM_CAPSULE, piece.hull.size
            case _:
                raise InputError(
                    f"objects[{item.id}].mesh: the driver 'pybullet' builds boxes, balls, cylinders and capsules; take one"
                )
        for name, value in zip(made, (kind, half, radius, 2.0 * length), strict=True):
            made[name].append(value)
    return made
