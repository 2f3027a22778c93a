"""Putting things out of the way: what stands on or beside an object is carried to a free spot."""

from __future__ import annotations

import math

from robosandbox.agent.language.world import World
from robosandbox.types import SkillCall

_CLEAR = 0.10  # Metres by which a thing is put aside. Chosen as long as an unnamed push.


def set_down(world: World, held: str) -> SkillCall | None:
    """Return the call that puts what is held on a free spot near by, or None without one."""
    spots = world.free_spots(world.at[held], world.radius(held), (held,)) if held in world.at else []
    return _place(spots[0]) if spots else None


def carried_aside(world: World, name: str, item: str) -> tuple[SkillCall, SkillCall] | None:
    """Return calls that put something down where it is no longer in the way of `item`.

    None where it carries something itself, or no spot is free.
    """
    if name not in world.at or not world.movable(name) or world.on_top_of(name):
        return None
    (x, y), (item_x, item_y) = world.at[name], world.at[item]
    away_x, away_y = x - item_x, y - item_y
    length = math.hypot(away_x, away_y)
    if length <= 0.01:
        away_x, away_y, length = 0.0, 1.0, 1.0
    near = (x + _CLEAR * away_x / length, y + _CLEAR * away_y / length)
    spots = world.free_spots(near, world.radius(name), (name,))
    return (SkillCall(skill="pick", arguments={"object": name}), _place(spots[0])) if spots else None


def pile_on(world: World, name: str) -> list[str]:
    """Return what stands on an object, one on the other, from below."""
    pile: list[str] = []
    while on := [other for other in world.on_top_of(pile[-1] if pile else name) if other not in (name, *pile)]:
        pile.append(on[0])
    return pile


def _place(spot: tuple[float, float]) -> SkillCall:
    return SkillCall(skill="place_at", arguments={"x": spot[0], "y": spot[1]})
