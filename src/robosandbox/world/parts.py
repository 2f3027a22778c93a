"""Parts, of a scene's file or a drawer's box: how far they are open, and what opening, closing and pressing them needs and gives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robosandbox.errors import DrawerError, Phase, SkillError
from robosandbox.evidence import DrawerEvidence
from robosandbox.shapes.body import PartJoint
from robosandbox.shapes.drawer import DrawerParts
from robosandbox.spatial import matrix_about_axis
from robosandbox.types import DetectedObject, ObservedScene, Pose
from robosandbox.world.effects import carried, slid, with_objects
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.nearness import nearer
from robosandbox.world.predicate import Finding, View, is_clearly_seen, predicate, sentence
from robosandbox.world.relations import CLOSED_WITHIN, bottom, contents, stands_on, top

# Share of its way from which on a part is open, and up to which it is closed where its whole way is some millimetres.
OPEN_SHARE, _CLOSED_SHARE = 0.5, 0.1
# Share of its way within which a part that is to be open so far is: what a hand lacks to the end of a drawer may be the room it needs.
OPENED_WITHIN = 0.02
# Share of its way by which what was opened is thought to be open; chosen below the 0.98 that skills try first and above the 0.75 that
# they are content with.
_OPENED_SHARE = 0.9
# Share of its way within which a part is turned to where it is asked for.
TURNED_WITHIN = 0.1
# Way of a part that nothing limits, radians or metres.
_UNLIMITED = math.pi / 2.0
# Share of its way that is looked at for what stands there, values of its joint that are looked at, and metres that are to be free.
_WIDE, _STATIONS, _SPARE = 0.9, 19, 0.002


def joint_of(part: DetectedObject) -> PartJoint:
    """Return the joint of a part, or of a drawer's box.

    Raises:
        ValueError: It is neither.
    """
    joint = part.shape.joint(part)
    if joint is None:
        raise ValueError(f"{part.id} is {part.shape.name} and turns or slides on nothing")
    return joint


def is_part(item: DetectedObject) -> bool:
    """Tell whether an object is a part of a scene's file, which turns or slides on a fixture."""
    return item.geometry is not None and item.geometry.joint is not None


def part_value(part: DetectedObject) -> float:
    """Return the value of a part's joint, metres or radians; its shut end where it is not seen."""
    return shut_value(part) if part.opening is None else part.opening


def shut_value(part: DetectedObject) -> float:
    """Return the value at which a part is shut."""
    return joint_of(part).shut


def open_value(part: DetectedObject, share: float = 1.0) -> float:
    """Return the value at which a part is open by a share of its way."""
    joint, shut = joint_of(part), shut_value(part)
    far = joint.far if math.isfinite(joint.far) else shut + math.copysign(_UNLIMITED, joint.far)
    return shut + share * (far - shut)


def lever(part: DetectedObject) -> float:
    """Return how far its outermost point goes for a unit of its joint, metres a metre or a radian."""
    joint = joint_of(part)
    if joint.kind == "slide" or part.geometry is None:
        return 1.0
    points = part.pose.position + part.geometry.outer @ part.pose.rotation.T - np.array(joint.anchor)
    return float(np.linalg.norm(np.cross(points, np.array(joint.axis)), axis=1).max())


def open_share(part: DetectedObject) -> float:
    """Return by what share of its way a part is open."""
    shut = shut_value(part)
    span = open_value(part) - shut
    return 0.0 if span == 0.0 else (part_value(part) - shut) / span


def closed_share(part: DetectedObject) -> float:
    """Return the share of its way up to which a part is closed: no point of it is farther than 3 mm from shut, or a tenth of a short way."""
    way = lever(part) * _way(part)
    return min(CLOSED_WITHIN / way, _CLOSED_SHARE) if way else 0.0


def sprung_handle(part: DetectedObject, objects: Iterable[DetectedObject]) -> DetectedObject | None:
    """Return the lever on a part that a spring turns back, as of a door with a latch; None where there is none."""
    levers = (item for item in objects if is_part(item) and item.id.rpartition(".")[0] == part.id)
    return next((item for item in levers if joint_of(item).kind == "hinge" and joint_of(item).stiffness > 0.0), None)


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
    """Return the scene with a part open by a share of its way, and what lies in a drawer moved along."""
    part = scene.find(name)
    if part is None or part.shape.joint(part) is None:
        return scene
    return brought_to(scene, part, open_value(part, share))


def brought_to(scene: ObservedScene, part: DetectedObject, value: float) -> ObservedScene:
    """Return the scene with a part's joint at a value, metres or radians, and what lies in a drawer moved along."""
    if part.shape.opens:
        return slid(scene, part.id, value)
    there = at_value(part, value)
    return with_objects(carried(scene, part.id, there.pose), [there])


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


@predicate("object", "number", effect=moved_to, lasts=True)
def turned_to(view: View, p: str, share: float) -> Finding:
    """A knob, lever or switch is a share of its way from where it rests: 0 is off, 1 is all on."""
    part = view.get(p)
    if not is_part(part):
        return Finding(holds=False, cause=f"{p} is {part.shape.name} and neither turns nor slides")
    margin = TURNED_WITHIN - abs(open_share(part) - share)
    return Finding(
        holds=margin >= 0.0,
        margin=margin,
        tolerance=TURNED_WITHIN,
        is_sure=part.opening is not None,
        cause=f"{p} is turned by {open_share(part):.0%} of its way",
        help=f"turn {p}",
    )


@predicate("object")
def pressed(view: View, p: str) -> Finding:
    """The step has pressed a part in; a spring takes it back, so that nobody sees it afterwards."""
    view.get(p)
    return Finding(holds=True, is_sure=False)


def _opened(scene: ObservedScene, name: str, share: float | None = None) -> ObservedScene:
    return moved_to(scene, name, _OPENED_SHARE if share is None else share)


def _shut(scene: ObservedScene, name: str) -> ObservedScene:
    return moved_to(scene, name, 0.0)


def _way(part: DetectedObject) -> float:
    """Return how far a part goes from shut to open, metres or radians."""
    return abs(open_value(part) - shut_value(part))


def _said(part: DetectedObject) -> str:
    """Return how far a part is open, in words."""
    gone = open_share(part) * _way(part)
    return f"{math.degrees(gone):.0f} deg" if joint_of(part).kind == "hinge" else f"{1e3 * gone:.0f} mm"


def _slid_back(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    drawer = view.get(arguments[0])
    opening = drawer.opening or 0.0
    wanted = opening - (finding.margin or 0.0)
    evidence = DrawerEvidence(drawer=drawer.id, reason="slipped", wanted=max(wanted, 0.0), opening=opening, force=0.0)
    return DrawerError(sentence(finding), phase=Phase.VERIFY, evidence=evidence)


@predicate("object", "number?", effect=_opened, lasts=True, lost=_slid_back)
def open_(view: View, d: str, share: float | None = None) -> Finding:
    """A drawer, door or lid is open: half its way, or by a share of it."""
    item = view.get(d)
    if item.shape.joint(item) is None:
        return Finding(holds=False, cause=f"{d} is {item.shape.name} and does not open")
    margin = _way(item) * (open_share(item) - (OPEN_SHARE if share is None else share - OPENED_WITHIN))
    return Finding(
        holds=margin > 0.0,
        margin=margin,
        is_sure=item.opening is not None,
        cause=f"{d} is {_said(item)} open",
        help=f"open {d} first",
        remedies=(fact("open", d) if share is None else fact("open", d, share),),
    )


@predicate("object", effect=_shut, lasts=True, last=True, lost=_slid_back)
def closed(view: View, d: str) -> Finding:
    """A drawer, door or lid is shut."""
    item = view.get(d)
    if item.shape.joint(item) is None:
        return Finding(holds=False, cause=f"{d} is {item.shape.name} and does not close")
    # What a camera measures is off by its error.
    within = closed_share(item) * _way(item) + view.slack / lever(item)
    margin = within - _way(item) * open_share(item)
    return Finding(
        holds=margin >= 0.0,
        margin=margin,
        tolerance=within,
        is_sure=item.opening is not None,
        cause=f"{d} is {_said(item)} open",
        help=f"close {d} first",
    )


@predicate("object", fixed=True)
def opens(view: View, d: str) -> Finding:
    """An object is a drawer."""
    item = view.get(d)
    drawers = [other.id for other in view.scene.objects if other.shape.opens]
    return Finding(
        holds=item.shape.opens,
        cause=f"{d} is {item.shape.name} and no drawer",
        help=f"there is {', '.join(drawers) or 'none'}",
    )


@predicate("object", fixed=True)
def grip_fits(view: View, d: str) -> Finding:
    """The gripper takes a drawer's grip between its fingers."""
    least, most = view.robot.apertures
    width = 2.0 * float(DrawerParts.of(view.get(d).size).grip[1])
    if view.robot.cup is not None:
        return Finding(
            holds=False,
            cause=f"this robot has a suction cup, and the grip of {d} takes fingers",
            help="open it by hand",
        )
    return Finding(
        holds=least < width < most,
        margin=min(width - least, most - width),
        cause=f"the fingers open {1e3 * least:.0f}..{1e3 * most:.0f} mm and the grip of {d} is {1e3 * width:.0f} mm wide",
        help="open it by hand",
    )


def _under(view: View, high: Sequence[DetectedObject], within: Iterable[str]) -> list[str]:
    """Return the ids of what things in a drawer stand on there."""
    solid = [other for name in within if not (other := view.get(name)).shape.is_granular]
    return [other.id for other in solid if any(stands_on(item, other) for item in high if item.id != other.id)]


def _blocked(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    drawer = view.get(arguments[0])
    opening = drawer.opening or 0.0
    evidence = DrawerEvidence(
        drawer=drawer.id, reason="blocked", wanted=0.0, opening=opening, force=0.0, blocking=finding.blocking
    )
    return DrawerError(sentence(finding), phase=Phase.CHECK, evidence=evidence)


@predicate("object", blame=_blocked)
def shuts(view: View, d: str) -> Finding:
    """Nothing in a drawer stands out over its rim."""
    drawer = view.get(d)
    rim = drawer.pose.xyz[2] + DrawerParts.of(drawer.size).rim
    within = dict.fromkeys(name for name, _ in contents(view.others(d), drawer))
    high = [item for name in within if not (item := view.get(name)).shape.is_granular and top(item) > rim]
    return Finding(
        holds=not high,
        margin=rim - max((top(item) for item in high), default=rim),
        cause=f"{', '.join(item.id for item in high)} in it is higher than {d}, which does not close over it",
        help=f"clear {', '.join(item.id for item in high)} away first",
        blocking=tuple(item.id for item in high),
        # Or what they stand on leaves the drawer with them.
        remedies=tuple(fact("on", name, TABLE) for name in (*(item.id for item in high), *_under(view, high, within))),
    )
