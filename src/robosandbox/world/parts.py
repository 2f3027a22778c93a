"""Parts of a scene's file: how far they are open, and what opening, closing and pressing them needs and brings about."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robosandbox.errors import DrawerError, Phase, SkillError
from robosandbox.evidence import DrawerEvidence
from robosandbox.shapes.compound import PartJoint
from robosandbox.spatial import matrix_about_axis
from robosandbox.types import DetectedObject, ObservedScene, Pose
from robosandbox.world.effects import with_objects
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.nearness import nearer
from robosandbox.world.predicate import Finding, View, is_clearly_seen, predicate, sentence
from robosandbox.world.relations import bottom, top

# Share of its way from which on a part is open, and up to which it is closed.
OPEN_SHARE, CLOSED_SHARE = 0.5, 0.05
# Way of a part that nothing limits, radians or metres.
_UNLIMITED = math.pi / 2.0
# Share of its way that is looked at for what stands there, values of its joint that are looked at, and metres that are to be free.
_WIDE, _STATIONS, _SPARE = 0.9, 19, 0.002


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


def _swept(view: View, part: DetectedObject, goal: float) -> tuple[str, ...]:
    """Return the loose things that a part meets on its way to a value of its joint; what it touches already is no obstacle."""
    here = part_value(part)
    loose = [item for item in view.others(part.id) if not item.is_fixed and not item.shape.is_granular]
    apart = [item for item in loose if item.id != view.scene.held and not _meets(part, item)]
    met: dict[str, None] = {}
    for value in np.linspace(here, goal, _STATIONS)[1:]:
        there = at_value(part, float(value))
        met.update(dict.fromkeys(item.id for item in apart if _meets(there, item)))
    return tuple(met)


def _meets(part: DetectedObject, item: DetectedObject) -> bool:
    beside = nearer(part, item, _SPARE)
    return beside and bottom(item) < top(part) and top(item) > bottom(part)


def _in_the_way(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    part = view.get(arguments[0])
    evidence = DrawerEvidence(
        drawer=part.id,
        reason="blocked",
        wanted=open_value(part),
        opening=part_value(part),
        force=0.0,
        blocking=finding.blocking,
    )
    return DrawerError(sentence(finding), phase=Phase.CHECK, evidence=evidence)


@predicate("object", blame=_in_the_way)
def room_to_swing(view: View, p: str) -> Finding:
    """Nothing loose stands where a part goes when it is opened."""
    part = view.get(p)
    names = _swept(view, part, open_value(part, _WIDE)) if is_part(part) else ()
    return Finding(
        holds=not names,
        is_sure=is_clearly_seen(part),
        cause=f"{', '.join(names)} {'stands' if len(names) == 1 else 'stand'} where {p} goes when it is opened",
        help=f"put {names[0]} aside first" if names else "",
        blocking=names,
        remedies=tuple(fact("on", name, TABLE) for name in names),
    )


@predicate("object")
def pressed(view: View, p: str) -> Finding:
    """The step has pressed a part in; a spring takes it back, so that nobody sees it afterwards."""
    view.get(p)
    return Finding(holds=True, is_sure=False)
