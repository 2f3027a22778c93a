"""Parts of a scene's file: how far they are open, and what opening, closing and pressing them needs and brings about."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from robosandbox.shapes.compound import PartJoint
from robosandbox.spatial import matrix_about_axis
from robosandbox.types import DetectedObject, ObservedScene, Pose
from robosandbox.world.effects import with_objects
from robosandbox.world.predicate import Finding, View, predicate

# Share of its way from which on a part is open, and up to which it is closed.
OPEN_SHARE, CLOSED_SHARE = 0.5, 0.05
# Way of a part that nothing limits, radians or metres.
_UNLIMITED = math.pi / 2.0


def joint_of(part: DetectedObject) -> PartJoint:
    """Return the joint of a part.

    Raises:
        ValueError: It is none.
    """
    joint = None if part.geometry is None else part.geometry.joint
    if joint is None:
        raise ValueError(f"{part.id} is {part.shape.name} and turns or slides on nothing")
    return joint


def is_part(item: DetectedObject) -> bool:
    """Tell whether an object turns or slides on a fixture."""
    return item.geometry is not None and item.geometry.joint is not None


def part_value(part: DetectedObject) -> float:
    """Return the value of a part's joint, metres or radians; its shut end where it is not seen."""
    return shut_value(part) if part.opening is None else part.opening


def shut_value(part: DetectedObject) -> float:
    """Return the value at which a part is shut: the end of its range that is nearest to 0, where it was drawn."""
    joint = joint_of(part)
    low, high = (end if math.isfinite(end) else 0.0 for end in (joint.low, joint.high))
    return low if abs(low) <= abs(high) else high


def open_value(part: DetectedObject, share: float = 1.0) -> float:
    """Return the value at which a part is open by a share of its way."""
    joint, shut = joint_of(part), shut_value(part)
    far = joint.high if shut == joint.low else joint.low
    if not math.isfinite(far):
        far = shut + _UNLIMITED
    return shut + share * (far - shut)


def open_share(part: DetectedObject) -> float:
    """Return by what share of its way a part is open."""
    shut = shut_value(part)
    span = open_value(part) - shut
    return 0.0 if span == 0.0 else (part_value(part) - shut) / span


def at_value(part: DetectedObject, value: float) -> DetectedObject:
    """Return a part as it is when its joint has a value."""
    joint, way = joint_of(part), value - part_value(part)
    axis, anchor = np.array(joint.axis), np.array(joint.anchor)
    if joint.kind == "slide":
        pose = Pose.from_matrix(part.pose.position + way * axis, part.pose.rotation)
    else:
        turn = matrix_about_axis(axis, way)
        pose = Pose.from_matrix(anchor + turn @ (part.pose.position - anchor), turn @ part.pose.rotation)
    return replace(part, pose=pose, opening=value)


def moved_to(scene: ObservedScene, name: str, share: float) -> ObservedScene:
    """Return the scene with a part open by a share of its way."""
    part = scene.find(name)
    return (
        scene if part is None or not is_part(part) else with_objects(scene, [at_value(part, open_value(part, share))])
    )


@predicate("object", fixed=True)
def movable_part(view: View, p: str) -> Finding:
    """An object is a part that turns or slides."""
    item = view.get(p)
    parts = [other.id for other in view.scene.objects if is_part(other)]
    return Finding(
        holds=is_part(item),
        cause=f"{p} is {item.shape.name} and neither turns nor slides",
        help=f"there is {', '.join(parts) or 'no part that does'}",
    )


@predicate("object")
def pressed(view: View, p: str) -> Finding:
    """The step has pressed a part in; a spring takes it back, so that nobody sees it afterwards."""
    view.get(p)
    return Finding(holds=True, is_sure=False)
