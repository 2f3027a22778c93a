"""Relations that leave no state to look at later: pushed, turned, tapped, poured, gone home."""

from __future__ import annotations

import math

import numpy as np

from robosandbox.types import DIRECTION_AXES, Array, DetectedObject, Direction, ObservedScene
from robosandbox.world import effects, pouring, relations
from robosandbox.world.placement_sampling import about_z, margin_on_table, yaw_to_align
from robosandbox.world.predicate import Finding, View, is_clearly_seen, predicate
from robosandbox.world.relations import centre, inside

# How near to the heading asked for a turned object has to be, radians; chosen: `turn` takes another grip from half of
# it on, so a smaller one costs grips and a larger one leaves a turn that is seen.
TURN_TOLERANCE = math.radians(10.0)
# How near to home the arm's joints have to be, radians or metres; chosen as five times what a motion ends within.
_HOME_TOLERANCE = 0.02
# Pour: share of what was in the container that has to arrive; as in the seeds' task pour_beads (27 of 30).
LEAST_FRACTION = 0.9
# Pour: share of it that may be spilled; as in the seeds' task pour_beads, none of 30 beads and one of 50.
MOST_SPILLED = 0.02
# Push: what may be missing of the distance asked for at least, metres; chosen as what a stroke of 10 cm leaves to a
# second one.
PUSH_TOLERANCE = 0.012
# Push: what may be missing, as a share of a long way; chosen as 1 cm of the seeds' 10 cm.
PUSH_RELATIVE_TOLERANCE = 0.1
# Push: what may be missing at most of a short way, as a share of it; chosen so that most of what is claimed was done.
PUSH_MOST_MISSING = 0.2


def push_allowance(distance: float) -> float:
    """Return by how much a push may fall short of the distance asked for, metres."""
    return max(PUSH_RELATIVE_TOLERANCE * distance, min(PUSH_TOLERANCE, PUSH_MOST_MISSING * distance))


def _pushed(scene: ObservedScene, a: str, direction: Direction, distance: float) -> ObservedScene:
    return effects.shifted(scene, a, distance * np.array([*DIRECTION_AXES[direction], 0.0]))


def _turned(scene: ObservedScene, a: str, angle: float) -> ObservedScene:
    return effects.turned(scene, a, about_z(angle))


def _aligned(scene: ObservedScene, a: str, b: str) -> ObservedScene:
    item, other = scene.find(a), scene.find(b)
    if item is None or other is None:
        return scene
    return _turned(scene, a, yaw_to_align(item, other))


def turn_between(before: DetectedObject, after: DetectedObject) -> float:
    """Return the angle about the vertical by which an object was turned, radians in -pi..pi."""
    relative = after.pose.rotation @ before.pose.rotation.T
    return math.atan2(relative[1, 0] - relative[0, 1], relative[0, 0] + relative[1, 1])


@predicate("object", "word", "number", effect=_pushed)
def displaced(view: View, a: str, direction: Direction, distance: float) -> Finding:
    """The step has slid an object so far in a direction."""
    item, before = view.get(a), view.before.find(a)
    if before is None:
        return Finding(holds=False, is_sure=False, cause=f"{a} was not seen before")
    allowance = push_allowance(distance)
    found = relations.displacement(before, item, direction, distance - allowance)
    return Finding(
        holds=found.holds,
        margin=found.detail["along_mm"] / 1e3 - distance + allowance,
        tolerance=allowance,
        is_sure=is_clearly_seen(item),
        cause=f"{a} went {found.detail['along_mm']:.0f} mm {direction}",
        help="push the rest",
    )


@predicate("object", "number", effect=_turned)
def turned(view: View, a: str, angle: float) -> Finding:
    """The step has turned an object about the vertical by an angle, radians."""
    item, before = view.get(a), view.before.find(a)
    if before is None:
        return Finding(holds=False, is_sure=False, cause=f"{a} was not seen before")
    off = abs(math.remainder(turn_between(before, item) - angle, math.tau))
    return Finding(
        holds=off < TURN_TOLERANCE,
        margin=TURN_TOLERANCE - off,
        tolerance=TURN_TOLERANCE,
        is_sure=is_clearly_seen(item),
        cause=f"{a} is {math.degrees(off):.0f} degrees off the heading asked for",
        help="turn it anew",
    )


@predicate("object", "object", effect=_aligned, lasts=True)
def aligned(view: View, a: str, b: str) -> Finding:
    """The sides of one object are parallel to those of another."""
    item, other = view.get(a), view.get(b)
    off = abs(yaw_to_align(item, other))
    return Finding(
        holds=off < TURN_TOLERANCE,
        margin=TURN_TOLERANCE - off,
        tolerance=TURN_TOLERANCE,
        is_sure=is_clearly_seen(item, other),
        cause=f"{a} is {math.degrees(off):.0f} degrees off {b}",
        help=f"turn {a}",
    )


@predicate("object", fixed=True)
def has_heading(view: View, a: str) -> Finding:
    """An object is no ball: one can see how it is turned."""
    item = view.get(a)
    half = item.shape.hull(item.size).half_extents
    round_all_over = item.shape.rolls and float(np.ptp(half)) < 1e-6
    return Finding(
        holds=not round_all_over,
        cause=f"{a} is {item.shape.name}, which looks the same however it is turned",
        help="leave it as it is",
    )


@predicate("object")
def tapped(view: View, a: str) -> Finding:
    """The step has touched an object; nobody sees that afterwards."""
    view.get(a)
    return Finding(holds=True, is_sure=False)


@predicate("object", "object", effect=effects.poured_into)
def poured(view: View, a: str, c: str) -> Finding:
    """The step has brought what a container held into another."""
    source, target = view.get(a), view.get(c)
    before = view.before.find(a)
    if before is None or not source.shape.holds_things or not target.shape.holds_things:
        return Finding(holds=False, is_sure=False, cause=f"{a} was not seen before")
    cargo = relations.contents([item for item in view.before.objects if item.id != a], before)
    found = pouring.poured(
        cargo, view.scene.objects, source, target, min_fraction=LEAST_FRACTION, max_spilled=MOST_SPILLED
    )
    return Finding(
        holds=found.holds,
        margin=found.detail["fraction"] - LEAST_FRACTION,
        is_sure=is_clearly_seen(source, target),
        cause=f"{found.detail['fraction']:.0%} of what was in {a} is in {c}",
        help="look again",
    )


@predicate(last=True)
def at_home(view: View) -> Finding:
    """The arm is at its neutral configuration."""
    off = view.robot.off_home()
    return Finding(
        holds=off is None or off < _HOME_TOLERANCE,
        margin=None if off is None else _HOME_TOLERANCE - off,
        tolerance=_HOME_TOLERANCE,
        is_sure=off is not None,
        cause="the arm is not at home",
        help="go home",
    )


@predicate("object", fixed=True)
def touchable(view: View, a: str) -> Finding:
    """An object is one thing, with a top to touch."""
    item = view.get(a)
    return Finding(
        holds=not item.shape.is_granular,
        cause=f"{a} are {item.shape.name} and have no top to touch",
        help="touch what they are in",
    )


@predicate("object", fixed=True)
def slides(view: View, a: str) -> Finding:
    """An object is one thing that can be pushed along, not many and not a piece of furniture."""
    item = view.get(a)
    verb = "are" if item.shape.is_plural else "is"
    return Finding(
        holds=not item.shape.is_granular and not item.shape.opens and not item.is_fixed,
        cause=f"{a} {verb} {item.shape.name} and cannot be pushed along",
        help="choose something that slides",
    )


@predicate("object")
def on_the_open(view: View, a: str) -> Finding:
    """An object is in no container, whose wall a push would meet."""
    item = view.get(a)
    vessels = tuple(v.id for v in view.others(a) if v.shape.holds_things and inside(item, v))
    return Finding(
        holds=not vessels,
        cause=f"{a} lies in {', '.join(vessels)}, where it cannot be pushed along",
        help="take it out first",
        blocking=vessels,
    )


@predicate("object", "word", "number")
def way_on_table(view: View, a: str, direction: Direction, distance: float) -> Finding:
    """An object that is pushed so far is still on the table."""
    end: Array = centre(view.get(a))[:2] + distance * np.array(DIRECTION_AXES[direction])
    margin = margin_on_table(view.scene.table_area, end)
    return Finding(
        holds=margin > 0.0,
        margin=margin,
        cause=f"{distance:.2f} m {direction} {a} would fall off the table",
        help=f"push it by less than {max(distance + margin, 0.0):.2f} m",
    )
