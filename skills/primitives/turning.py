"""Turning a thing over: onto its side, back on its base, upside down; by grips that are no longer above it once it is turned."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from robosandbox.errors import Phase, UnsupportedError
from robosandbox.skills.pick import take_up
from robosandbox.skills.primitives.carrying import carried_along
from robosandbox.skills.primitives.guarded import follow_until
from robosandbox.skills.primitives.manipulator import Manipulator
from robosandbox.skills.primitives.placing import PlacePlan, occupied, place, plan_put
from robosandbox.skills.primitives.rehearsal import hand_planner, rehearse, with_aperture
from robosandbox.skills.protocols import SkillContext
from robosandbox.types import Array, DetectedObject, Grasp, ObservedScene, Pose, SkillResult
from robosandbox.world.abilities import Obstruction
from robosandbox.world.effects import taken
from robosandbox.world.placement_sampling import (
    Placement,
    about_level,
    about_z,
    free_placements,
    levelled,
    turns,
    with_pose,
)
from robosandbox.world.relations import MeasuredRelation, bottom, centre, support
from robosandbox.world.standing import TIPPED

# Shares of a quarter turn after which it is let go, where what is left it falls by itself, and of the lean at which it would fall back,
# that at most: a level hand has no room over a table.
_SHARES, _FALLS = (1.0, 5.0 / 6.0, 2.0 / 3.0), 0.75
# Places that are looked at, that where it stood first.
_PLACES = 6
# Cosine of the hand's approach to the vertical from which on it comes from below.
_FROM_BELOW = 0.1
# N at which what comes down with an edge first is let go.
_LANDED = 4.0
# An axis counts as vertical whose cosine to the vertical is above this.
_VERTICAL = math.cos(TIPPED)

Attitude = Literal["up", "down", "level"]


def turn_over(ctx: SkillContext, name: str, wanted: Attitude, skill: str) -> SkillResult:
    """Take a thing, turn its own axis, and put it down near where it stood; with as many grips as there are quarter turns.

    Args:
        ctx: What the skill may use.
        name: Id of the thing; the hand is empty.
        wanted: Where its own z shall point.
        skill: Name for the result.

    Raises:
        UnsupportedError: What lies in it would fall out.
        SkillError: As pick and place_at raise them.
    """
    arm = Manipulator(ctx)
    target = arm.find(name)
    if inside := carried_along(target, arm.start):
        raise UnsupportedError(
            f"{name} holds {', '.join(inside)}, which would fall out; take that out or pour it out first",
            phase=Phase.CHECK,
        )
    if wanted == "level" or abs(target.pose.rotation[2, 2]) < _VERTICAL:
        return _quarter(arm, target, wanted, skill)
    _quarter(arm, target, "level", skill)
    arm = Manipulator(ctx)
    return _quarter(arm, arm.find(name), wanted, skill)


def is_turned(item: DetectedObject, wanted: Attitude) -> bool:
    """Tell whether a thing's own z points where it is wanted, within 30 degrees."""
    upward = float(item.pose.rotation[2, 2])
    if wanted == "level":
        return abs(upward) < math.sin(TIPPED)
    return upward > _VERTICAL if wanted == "up" else -upward > _VERTICAL


def _quarter(arm: Manipulator, target: DetectedObject, wanted: Attitude, skill: str) -> SkillResult:
    """Turn a thing by a quarter turn with one grip."""
    met = _no_way(arm.ctx, target, arm.start, wanted)
    take_up(arm, target, met)
    arm = Manipulator(arm.ctx)
    held = arm.find(target.id)
    spots = _not_from_below(_spots(held, target, arm.start, wanted), held, arm.state.tcp_pose)
    if not spots:
        raise occupied(target.id, "the table", ())

    def lower(way: PlacePlan) -> None:
        # Its edge comes down first, whose height is known as well as its attitude in the hand.
        if arm.driver.capabilities.contact is None:
            arm.follow(way.descent, Phase.LOWER, yielding=True)
        else:
            weight = arm.force_on(target.id)[2]
            follow_until(arm, way.descent, Phase.LOWER, lambda: float(weight - arm.force_on(target.id)[2]) > _LANDED)

    def check(placed: DetectedObject, scene: ObservedScene) -> MeasuredRelation:
        upward = float(placed.pose.rotation[2, 2])
        over = 1e3 * (bottom(placed) - scene.table_height)
        detail = {"tilt_deg": math.degrees(math.acos(np.clip(upward, -1.0, 1.0))), "over_table_mm": over}
        return MeasuredRelation(is_turned(placed, wanted), detail)

    return place(arm, held, spots, skill=skill, target="the table", allowed=("table",), check=check, lower=lower)


def _no_way(
    ctx: SkillContext, item: DetectedObject, scene: ObservedScene, wanted: Attitude
) -> Callable[[Grasp, bool], Obstruction | None]:
    """Return what tells of a grasp what the hand meets with it where it puts an object down turned; None for nothing."""
    above = taken(scene, item.id)
    held = above.find(item.id) or item
    spots = _spots(held, item, scene, wanted)

    def met(grasp: Grasp, briefly: bool) -> Obstruction | None:
        if grasp.how == "rim":
            return Obstruction(cause="what is held by its rim turns between the fingers")
        tcp_pose = held.pose @ item.pose.inverse() @ grasp.tcp_pose
        fitting = _not_from_below(spots, held, tcp_pose)
        if not fitting:
            return Obstruction(cause="the hand would come from below")
        state = replace(with_aperture(ctx, grasp.width), tcp_pose=tcp_pose)
        looked_at = fitting[:: max(1, len(fitting) // _PLACES)] if briefly else fitting
        plan = partial(plan_put, held=held, scene=above, spots=looked_at, allowed=("table",))
        return rehearse(ctx, hand_planner(ctx), above, state, plan)

    return met


def _spots(held: DetectedObject, before: DetectedObject, scene: ObservedScene, wanted: Attitude) -> list[Placement]:
    """Return where and how an object may be let go, turned all the way first, then leaning as far as it falls by itself."""
    level = levelled(held)
    turned = [(yaw, heading) for yaw in turns(0.0) for heading in _axes(about_z(yaw) @ level, wanted)]
    if not turned:
        return []
    there = with_pose(held, Pose.from_matrix(held.pose.position, _turned(level, *turned[0])))
    free = (spot.xy for spot in free_placements(scene, there))
    here = centre(before)
    places = [(float(here[0]), float(here[1])), *itertools.islice(free, _PLACES - 1)]
    spots = []
    for share, xy, (yaw, heading) in itertools.product(_SHARES, places, turned):
        left = (1.0 - share) * math.pi / 2.0
        final = with_pose(held, Pose.from_matrix(held.pose.position, _turned(level, yaw, heading)))
        if left <= _FALLS * _falls_back_at(final, heading):
            angle = share * math.pi / 2.0
            spots.append(Placement(xy, scene.table_height, (yaw,), lean=(heading, angle), by_middle=True))
    return spots


def _turned(level: Array, yaw: float, heading: float) -> Array:
    """Return a rotation (3, 3) turned about the vertical, and by a quarter turn about the level axis of a heading."""
    turned: Array = about_level(heading) @ about_z(yaw) @ level
    return turned


def _axes(rotation: Array, wanted: Attitude) -> Iterator[float]:
    """Yield headings of the level axes about which a quarter turn brings a thing's own z to where it is wanted, radians."""
    z = rotation[:, 2]
    if wanted == "level":
        if abs(z[2]) > _VERTICAL:
            first = math.atan2(rotation[1, 0], rotation[0, 0])
            yield from (first + k * math.pi / 2.0 for k in range(4))
    elif abs(z[2]) < math.sin(TIPPED):
        yield math.atan2(z[1], z[0]) + (-math.pi / 2.0 if wanted == "up" else math.pi / 2.0)


def _falls_back_at(final: DetectedObject, heading: float) -> float:
    """Return by how much an object has to lean about a level axis until it does not fall back on its base, radians.

    Args:
        final: As it stands on that base.
        heading: Of the axis, radians.
    """
    middle = centre(final)
    aside = np.array([-math.sin(heading), math.cos(heading), 0.0])
    half = min(float(support(final, (sign * aside)[None])[0] - sign * aside @ middle) for sign in (1.0, -1.0))
    return math.atan2(half, float(middle[2]) - bottom(final))


def _not_from_below(spots: list[Placement], held: DetectedObject, tcp_pose: Pose) -> list[Placement]:
    """Return those at which the hand does not come from below, each in its order."""
    level, approach = levelled(held), tcp_pose.rotation[:, 2]
    in_object = held.pose.rotation.T @ approach
    return [spot for spot in spots if (spot.rotation(level, spot.yaws[0]) @ in_object)[2] < _FROM_BELOW]
