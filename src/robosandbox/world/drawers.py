"""Drawers: how far they are open, and what keeps them from closing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from robosandbox.errors import DrawerError, Phase, SkillError
from robosandbox.evidence import DrawerEvidence
from robosandbox.shapes.drawer import DrawerParts
from robosandbox.types import DetectedObject, ObservedScene
from robosandbox.world import parts
from robosandbox.world.effects import slid
from robosandbox.world.facts import TABLE, fact
from robosandbox.world.predicate import Finding, View, predicate, sentence
from robosandbox.world.relations import CLOSED_WITHIN, contents, stands_on, top

# Share of its way from which on a drawer counts as open: what is pulled open stops at three quarters or more.
_OPEN_SHARE = 0.5
# Share of its way by which an opened drawer is thought to be open; chosen below the 0.98 that the skill tries first and
# above the 0.75 that it is content with.
_PULLED_SHARE = 0.9


def _opened(scene: ObservedScene, name: str) -> ObservedScene:
    drawer = scene.find(name)
    if drawer is not None and parts.is_part(drawer):
        return parts.moved_to(scene, name, _PULLED_SHARE)
    return scene if drawer is None else slid(scene, name, _PULLED_SHARE * drawer.shape.max_open(drawer.size))


def _shut(scene: ObservedScene, name: str) -> ObservedScene:
    drawer = scene.find(name)
    if drawer is not None and parts.is_part(drawer):
        return parts.moved_to(scene, name, 0.0)
    return slid(scene, name, 0.0)


def _slid_back(view: View, arguments: Sequence[Any], finding: Finding) -> SkillError:
    drawer = view.get(arguments[0])
    opening = drawer.opening or 0.0
    wanted = opening - (finding.margin or 0.0)
    evidence = DrawerEvidence(drawer=drawer.id, reason="slipped", wanted=max(wanted, 0.0), opening=opening, force=0.0)
    return DrawerError(sentence(finding), phase=Phase.VERIFY, evidence=evidence)


def _part_state(part: DetectedObject, margin: float, remedy: str) -> Finding:
    """Return whether a part is as it should be, by the margin that its share of the way leaves."""
    return Finding(
        holds=margin > 0.0,
        margin=margin,
        is_sure=part.opening is not None,
        cause=f"{part.id} is {parts.open_share(part):.0%} open",
        help=remedy,
    )


@predicate("object", effect=_opened, lasts=True, lost=_slid_back)
def open_(view: View, d: str) -> Finding:
    """A drawer, door or lid is open."""
    drawer = view.get(d)
    if parts.is_part(drawer):
        return _part_state(drawer, parts.open_share(drawer) - parts.OPEN_SHARE, f"open {d} first")
    margin = (drawer.opening or 0.0) - _OPEN_SHARE * drawer.shape.max_open(drawer.size)
    return Finding(
        holds=drawer.shape.opens and margin > 0.0,
        margin=margin,
        is_sure=not drawer.shape.opens or drawer.opening is not None,
        cause=f"{d} is {1e3 * (drawer.opening or 0.0):.0f} mm open",
        help=f"open {d} first",
        remedies=(fact("open", d),),
    )


@predicate("object", effect=_shut, lasts=True, last=True, lost=_slid_back)
def closed(view: View, d: str) -> Finding:
    """A drawer, door or lid is shut."""
    drawer = view.get(d)
    if parts.is_part(drawer):
        return _part_state(drawer, parts.CLOSED_SHARE - parts.open_share(drawer), f"close {d} first")
    margin = CLOSED_WITHIN + view.slack - (drawer.opening or 0.0)
    return Finding(
        holds=drawer.shape.opens and margin >= 0.0,
        margin=margin,
        tolerance=CLOSED_WITHIN,
        is_sure=not drawer.shape.opens or drawer.opening is not None,
        cause=f"{d} is {1e3 * (drawer.opening or 0.0):.0f} mm open",
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
