"""Putting one object somewhere: on, in, beside, between, at a point, in a region, anywhere free."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence

from robosandbox.agent.language import match
from robosandbox.agent.language.discourse import AlreadySoError, RefusedError, listed
from robosandbox.agent.language.hands import Hands
from robosandbox.agent.language.intent import (
    At,
    ByRobot,
    Offset,
    Original,
    Place,
    Ref,
    Region,
    Relation,
    Spot,
    replace,
)
from robosandbox.agent.language.orders import Meaning
from robosandbox.agent.language.world import Parent
from robosandbox.types import DIRECTION_AXES, SIDE_AXES, RefusalCode, Side
from robosandbox.world.parts import is_part

NUDGE = 0.10  # Metres of a move whose distance is not said. Chosen equal to `PUSH_DISTANCE`.
# Half of the edge of the seeds' table, metres, on which these places are given.
_EDGE = 0.5
BOUNDS = {"edge": (0.28, 0.0, 0.28), "side": (0.18, 0.1, 0.1)}
"""Where the far, the near and the left or right edge or side of what an arm reaches of the table begins, metres."""
_OPPOSITE = {"left": "right", "right": "left", "front": "back", "back": "front"}
SIDES: tuple[Side, ...] = ("right", "left", "front", "back")

_CLOSE_BY = 0.3  # Metres from its base that an arm calls close. Chosen: the bundled arm's reach begins at 0.15.
_AS_NEAR = 0.02  # Metres by which one place must be nearer than another to be the nearest. Chosen.


class Placing(Hands):
    """Places for one object."""

    def _targets(self, place: Relation, names: Sequence[str]) -> tuple[str, ...]:
        world = self.world
        if place.kind == "in":

            def fits(name: str) -> bool:
                return match.holds_things(world.objects[name])
        elif place.kind == "to" and place.refs and _told_by_colour(place.refs[0]):
            # "the cans to yellow": to the container that has that colour, and to no yellow ball.
            def fits(name: str) -> bool:
                return match.holds_things(world.objects[name]) and name not in names
        else:

            def fits(name: str) -> bool:
                return name not in names

        if place.kind == "between":
            found: list[str] = []
            for ref in place.refs:
                found += self.ground.many(ref, fits, (*names, *found) if ref.determiner != "the" else ()).ids
            if len(found) != 2:
                raise RefusedError(RefusalCode.AMBIGUOUS, f"Between which two? {listed(found)} fit.", found)
            targets = tuple(found)
        else:
            ref = place.refs[0]
            told = {place.kind, _OPPOSITE.get(place.kind)} if self.side_told else {place.kind} & {"opposite"}
            if ref.determiner == "it" and self.last_side and {"opposite", self.last_side[0]} & told:
                # "the plum left of the can and the pear right of it", "... on the other side of it": of the can.
                return (self.last_side[1],)
            if ref.determiner == "it" and ref.plural and place.kind == "on":
                # "stack the can on the block and the cup on top of both": on the upper one.
                pile = self.ground.many(ref, lambda name: True, names).ids
                upper = [name for name in pile if not world.on_top_of(name)]
                if len(upper) == 1 and all(world.parent.get(name, ("", ""))[0] == "on" for name in upper):
                    return (upper[0],)
            if ref.determiner == "it" and ref.plural and place.kind in ("beside", *_OPPOSITE):
                # "stack the can on the block and set the cup to the right of them": of the lower one.
                pile = self.ground.many(ref, lambda name: True, names).ids
                lower = [name for name in pile if world.parent.get(name) not in [("on", other) for other in pile]]
                if len(lower) == 1 < len(pile):
                    return (lower[0],)
            # "the red cube on itself" is to be refused; "it on the block" must not find the thing in hand.
            barred = names if ref.determiner in ("it", "a") or ref.other or ref.one else ()
            if ref.determiner == "it" and world.held in self.poured and world.held not in names:
                # "pour the beads into the bowl and put the ball in it": not in the cup that they were in.
                barred = (*barred, str(world.held))
            try:
                meaning = self.ground.one(ref, fits, barred)
            except RefusedError as refused:
                owners = {match.owner_of(name, world.objects) for name in refused.refusal.candidates}
                if place.kind != "on" or len(owners) != 1 or owners == {""}:
                    raise
                # "on top of the drawer", of which the cabinet has three: on the cabinet.
                meaning = Meaning(tuple(owners))
            if place.kind == "on" and is_part(world.objects[meaning.ids[0]]):
                meaning = Meaning((match.owner_of(meaning.ids[0], world.objects) or meaning.ids[0],))
            if meaning.others:
                self.substitutes[meaning.ids[0]] = meaning.others
            targets = meaning.ids
        clash = [name for name in names if name in targets]
        if clash and len(names) == 1:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{clash[0]} cannot be put relative to itself.", clash)
        return targets

    def _put_one(self, name: str, place: Place | None, targets: tuple[str, ...], *, stack: bool = False) -> None:
        world = self.world
        radius = world.radius(name)
        if world.objects[name].shape.is_granular:
            if not (isinstance(place, Relation) and place.kind in ("in", "to")):
                raise RefusedError(
                    RefusalCode.UNSUPPORTED, f"{name} are beads; I can pour them into something.", (name,)
                )
            self._pour_out(self._vessel(name), targets[0])
            return
        if isinstance(place, Relation) and place.kind == "opposite":
            known = self.last_side[0] if self.last_side and targets == self.last_side[1:] else ""
            # From where it stands now, where that is plain; else behind it.
            here = (side for side in SIDES if self.ground.plainly_on(name, side, targets[0]))
            across = known or next(here, "front")
            place = replace(place, kind=_OPPOSITE[across])
        match place:
            case Relation(kind="between"):
                (ax, ay), (bx, by) = world.at[targets[0]], world.at[targets[1]]
                self._put_at(name, ((ax + bx) / 2, (ay + by) / 2), f"between {targets[0]} and {targets[1]}")
            case Relation():
                self._put_related(name, place, targets[0], stack=stack)
            case At(x=x, y=y):
                self._put_at(name, (x, y), f"({x:g}, {y:g})")
            case Offset(direction=direction, distance=distance):
                dx, dy = DIRECTION_AXES[direction]
                x, y = world.at[name]
                step = distance or NUDGE
                self._put_at(name, (x + dx * step, y + dy * step), f"{step:g} m {direction}")
            case Original(vacated=vacated):
                self._put_back(name, vacated=vacated)
            case Spot(refs=refs):
                other_one = self.ground.one(refs[0], lambda _: True, (name,)).ids[0]
                gone = other_one in self.moved and other_one in self.discourse.origins
                where = self.discourse.origins[other_one][0] if gone else world.at[other_one]
                self._put_at(name, where, f"where {other_one} {'was' if gone else 'is'}")
            case ByRobot():
                self._put_by_robot(name, place)
            case Region():
                self._put_region(name, place, radius)
            case _:
                # What stands on the table already goes to another spot.
                stands = name not in world.parent and name != world.held
                self._put_free(name, world.at[name], ignore=() if stands else (name,))

    def _put_related(self, name: str, place: Relation, target: str, *, stack: bool) -> None:
        """Put a thing into, onto or beside another."""
        world, kind, distance = self.world, place.kind, place.distance
        holder = match.is_receptacle(world.objects[target])
        if world.objects[target].kind == "cupboard":
            # On a shelf is on its board, on a cabinet or on top of a shelf is over it.
            holder = place.order != "top" and any(
                "shelf" in noun for ref in place.refs for noun in (*ref.nouns, *ref.names)
            )
        elif place.order != "top" and match.is_shallow(world.objects[target]):
            # "on the bowl" is in it, as on a plate is; on top of it would be on its rim.
            holder = True
        # "over to the bin" is in it, "over to the mug" may be beside it.
        over_to_a_mug = place.order == "over" and match.is_cup(world.objects[target])
        if kind == "at":
            kind = "in" if match.holds_things(world.objects[target]) else "on"
        if (
            kind == "in"
            or (kind == "to" and match.holds_things(world.objects[target]) and not over_to_a_mug)
            or (kind == "on" and holder)
        ):
            self._put_in(name, target)
        elif kind == "on" or (kind == "to" and self._carries(target, name)):
            self._put_on(name, target, stack=stack)
        elif kind == "to":
            upon = "in" if over_to_a_mug else "on"
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"Should {name} go {upon} {target} or next to it?", (name, target)
            )
        elif kind in SIDES and distance is not None:
            ex, ey = SIDE_AXES[kind]
            x, y = world.at[target]
            # From middle to middle; where they would stand in each other, the gap is meant.
            (tx, ty, _), (ox, oy, _) = world.extents(target), world.extents(name)
            least = abs(ex) * (tx + ox) + abs(ey) * (ty + oy)
            spot = (x + ex * distance, y + ey * distance)
            clear = distance >= least and self._alone(spot, 0.8 * world.radius(name) - 0.02, target)
            apart = distance if clear else distance + least
            self._put_at(name, (x + ex * apart, y + ey * apart), f"{distance:g} m {kind} of {target}")
        elif kind in SIDES:
            self._put_beside(name, target, (kind,))
            self.last_side, self.side_told = (kind, target), True
        elif kind == "beside":
            self._put_beside(name, target, SIDES)
            if not self.sliding:
                call = self.steps[-1].call.arguments
                self.last_side, self.side_told = (str(call["side"]), str(call["target"])), False
        else:
            raise RefusedError(RefusalCode.UNSUPPORTED, f"I cannot put things {kind} others.", (target,))

    def _put_back(self, name: str, *, vacated: bool) -> None:
        """Put a thing where it was before this sentence, or else before the one that moved it."""
        world = self.world
        origins = self.discourse.origins if name in self.moved else self.came_from
        other = list(self.moved)
        if vacated and name not in origins and len(other) == 1 and other[0] in self.discourse.origins:
            # "move the block out of the way and put the sponge where it was"
            origins = {name: self.discourse.origins[other[0]]}
        if name not in origins:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Where is back? I have not moved {name} yet.", (name,))
        xy, parent = origins[name]
        if name in self.left_standing and world.held != name and xy == world.at[name]:
            return
        if parent and parent[0] == "in":
            self._put_in(name, parent[1])
        elif parent:
            self._put_on(name, parent[1])
        else:
            self._put_at(name, xy, "its first place")

    def _carries(self, target: str, name: str) -> bool:
        """Say whether a thing is flat and wide, so that "to the plate" means onto it."""
        x, y, z = self.world.extents(target)
        wide, deep, _ = self.world.extents(name)
        return z < 0.5 * min(x, y) and min(x, y) > max(wide, deep)

    def _vessel(self, name: str) -> str:
        """Return what beads would be poured from, or the thing itself."""
        if not self.world.objects[name].shape.is_granular:
            return name
        holder = self.world.parent.get(name)
        if holder is None or holder[0] != "in" or self.world.objects[holder[1]].kind not in match.VESSELS:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{name} are in nothing that I could pour from.", (name,))
        return holder[1]

    def _pour_out(self, vessel: str, target: str) -> None:
        world = self.world
        if world.objects[vessel].kind not in match.VESSELS or match.is_solid(world.objects[vessel]):
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{vessel} holds nothing that could be poured.", (vessel,))
        kind, holder = world.parent.get(target, ("", ""))
        if world.objects[target].kind not in (*match.CONTAINERS, *match.VESSELS) and kind == "in":
            # What is poured over a thing in a bowl goes into the bowl.
            target = holder
        if world.objects[target].kind not in (*match.CONTAINERS, *match.VESSELS):
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{target} is no container: I do not pour over or into it.", (target,)
            )
        if target == vessel:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{target} cannot be poured into itself.", (target,))
        if world.objects[target].shape.opens:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{target} is a drawer; I do not pour into it.", (target,))
        contents = world.inside(vessel)
        if not contents and any(item.shape.is_granular for item in world.objects.values()):
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"I see nothing in {vessel} to pour.", (vessel,))
        self._take(vessel)
        self._add("pour", target=target)
        self.poured.add(vessel)
        self.emptied = (vessel,)
        self._theme((target,))
        self.discourse.mention((vessel,), ("thing",))
        for name in contents:
            world.at[name], world.parent[name] = world.at[target], ("in", target)

    def _not_there_yet(self, name: str, parent: Parent) -> None:
        """Refuse to carry a thing to where it stands: to lift it and put it back helps nobody."""
        if self.world.parent.get(name) == parent and name not in self.moved:
            raise AlreadySoError(f"{name} is {parent[0]} {parent[1]} already.", (name, parent[1]))

    def _put_in(self, name: str, target: str) -> None:
        world = self.world
        if not match.holds_things(world.objects[target]):
            why = f"{target} is a {world.objects[target].kind}, which is no container: nothing goes in it."
            if world.objects[target].is_fixed:
                why = f"{target} has no inside that is open to above or to one side: nothing goes in it."
            raise RefusedError(RefusalCode.IMPOSSIBLE, why, (target,))
        self._not_there_yet(name, ("in", target))
        item, holder = world.objects[name], world.objects[target]
        if match.has_straight_walls(item):
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} is a container itself; I do not put it in {target}.", (name,)
            )
        if (item.shape.holds_things or match.is_cup(holder)) and not world.fits_in(name, target):
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{name} does not fit into {target}.", (name, target))
        if holder.shape.opens and target not in world.opened and "open_drawer" in self.skills:
            if world.held == name and name in self.poured:
                # What was poured from is set down while the drawer is opened.
                self._put_free(name, world.at[name])
            if world.held:
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE,
                    f"{target} has to be opened first, and the gripper holds {world.held}.",
                    (target,),
                )
            self._add("open_drawer", drawer=target)
            world.opened.add(target)
        for door in world.doors_before(name, target) if holder.is_fixed else ():
            self._need_empty(f"open {door}")
            self._add("open", part=door)
            world.opened.add(door)
        self._take(name)
        self._add("place_in", container=target)
        world.put(name, world.at[target], ("in", target))

    def _put_on(self, name: str, target: str, *, stack: bool = False) -> None:
        world = self.world
        if match.is_ball(world.objects[target]):
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{target} is a ball: nothing stays on it.", (target,))
        if target == world.held:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{target} is in the gripper; nothing can be put on it.", (target,)
            )
        if name in self.moved and name != world.held and world.parent.get(name) == ("on", target):
            # "... green in the middle and blue on top" says once more what the tower says.
            return
        self._not_there_yet(name, ("on", target))
        if match.has_straight_walls(world.objects[name]):
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} is a container; I do not stand it on {target}.", (name, target)
            )
        small, large = min(world.extents(target)[:2]), min(world.extents(name)[:2])
        if match.holds_things(world.objects[name]) and small < 0.5 * large:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{name} is too wide to stand on {target}.", (name, target))
        if ("on", name) == world.parent.get(target):
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{target} stands on {name}; say where to put {target} first.", (target,)
            )
        above = [other for other in world.on_top_of(target) if other != name]
        area = math.prod(world.extents(target)[:2])
        if above and sum(math.prod(world.extents(other)[:2]) for other in (*above, name)) > 0.7 * area:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{listed(above)} already stands on {target}.", above)
        if (stack and world.held != name and "stack" in self.skills) or (
            "place_on" not in self.skills and world.held != name and "stack" in self.skills
        ):
            self._need_empty(f"pick up {name}")
            blockers = world.on_top_of(name)
            if blockers:
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE, f"{listed(blockers)} stands on {name}; say where to put it first.", blockers
                )
            if world.objects[name].shape.opens:
                self._take(name)
            self._note_moved(name)
            self._add("stack", object=name, target=target)
        else:
            self._take(name)
            self._add("place_on", target=target)
        world.put(name, world.at[target], ("on", target))

    def _put_at(self, name: str, xy: tuple[float, float], where: str) -> None:
        x, y = round(xy[0], 4), round(xy[1], 4)
        if not self.world.in_reach((x, y)):
            point = f"({x:g}, {y:g})"
            place = point if where == point else f"{where}, at {point},"
            beyond = not self.world.on_table((x, y))
            why = f"off the table, {self.world.table_ends}" if beyond else "out of the arm's reach"
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{place} is {why}.")
        radius = 0.8 * self.world.radius(name) - 0.02
        if not self.world.is_free((x, y), radius, (name,)):
            taken = [other for other in self.world.objects if other != name and not self._alone((x, y), radius, other)]
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{where} is taken by {listed(taken)}.", taken)
        if self.sliding:
            self._add("push_to", object=name, x=x, y=y)
        else:
            self._take(name)
            self._add("place_at", x=x, y=y)
        self.world.put(name, (x, y))

    def _alone(self, xy: tuple[float, float], radius: float, other: str) -> bool:
        return self.world.is_free(xy, radius, [name for name in self.world.objects if name != other])

    def _sides_free(
        self, name: str, target: str, sides: Sequence[str], room: float
    ) -> list[tuple[float, str, tuple[float, float]]]:
        """Return the sides of `target` with `room` to spare: how far from the robot, which, and where."""
        world = self.world
        free: list[tuple[float, str, tuple[float, float]]] = []
        for side in sides:
            ex, ey = SIDE_AXES[side]
            tx, ty, _ = world.extents(target)
            ox, oy, _ = world.extents(name)
            gap = abs(ex) * (tx + ox) + abs(ey) * (ty + oy) + 0.03
            x, y = world.at[target][0] + ex * gap, world.at[target][1] + ey * gap
            if len(sides) == 1 or (world.in_reach((x, y)) and world.is_free((x, y), room, (name, target))):
                free.append((round(math.dist((x, y), world.base_xy), 3), side, (x, y)))
        return free

    def _put_beside(self, name: str, target: str, sides: Sequence[str]) -> None:
        world = self.world
        free = self._sides_free(name, target, sides, world.radius(name) - 0.01)
        # Something long may fit where a disk around it would not.
        if not free and target not in world.parent:
            free = self._sides_free(name, target, sides, min(world.extents(name)[:2]) - 0.01)
        if target in world.parent and world.parent[target][1] in world.objects:
            # "the butter on the plate and the spoon beside it": beside the plate, then.
            return self._put_beside(name, world.parent[target][1], sides)
        if not free:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"There is no room next to {target}.", (target,))
        if target in world.parent or target == world.held:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{target} does not stand on the table, so nothing fits beside it.", (target,)
            )
        _, side, xy = free[0] if len(sides) == 1 else min(free)
        if self.sliding:
            # Nobody chooses among the places on a side later, as `place_beside` does.
            (ex, ey), room = SIDE_AXES[side], world.radius(name) - 0.01
            shifts = itertools.product((0.0, 0.05, 0.1), (0.0, 0.05, -0.05, 0.1, -0.1))
            spots = ((xy[0] + ex * out - ey * aside, xy[1] + ey * out + ex * aside) for out, aside in shifts)
            free_spots = (spot for spot in spots if world.in_reach(spot) and world.is_free(spot, room, (name,)))
            self._put_at(name, next(free_spots, xy), f"the {side} of {target}")
            return
        self._take(name)
        others = [{"target": target, "side": other} for _, other, _ in sorted(free) if other != side]
        self._add("place_beside", others, target=target, side=side)
        world.put(name, xy)

    def _put_free(self, name: str, near: tuple[float, float], ignore: Iterable[str] = ()) -> None:
        self._put_at_first(name, self.world.free_spots(near, self.world.radius(name), ignore))

    def _put_at_first(self, name: str, spots: Sequence[tuple[float, float]]) -> None:
        if not spots:
            raise RefusedError(RefusalCode.IMPOSSIBLE, "There is no free spot on the table.")
        (x, y), *rest = spots
        if self.sliding:
            self._add("push_to", [{"object": name, "x": ox, "y": oy} for ox, oy in rest], object=name, x=x, y=y)
        else:
            self._take(name)
            self.set_free.add(name)
            self._add("place_at", [{"x": ox, "y": oy} for ox, oy in rest], x=x, y=y)
        self.world.put(name, (x, y))

    def _put_by_robot(self, name: str, place: ByRobot) -> None:
        """As in "50 cm in front of the robot", "close to the base"."""
        x, y = self.world.base_xy
        # What is before the robot is where it looks.
        dx, dy = (1.0, 0.0) if place.side in ("front", "beside") else SIDE_AXES[place.side]
        if place.distance is not None:
            xy = (x + dx * place.distance, y + dy * place.distance)
            self._put_at(name, xy, f"{place.distance:g} m from the robot")
            return
        near, aside = (x + dx * _CLOSE_BY, y + dy * _CLOSE_BY), 0.4 * _CLOSE_BY
        low = (-math.inf, y + aside if place.side == "left" else -math.inf)
        high = (math.inf, y - aside if place.side == "right" else math.inf)
        spots = self.world.free_spots(near, self.world.radius(name), (name,), low=low, high=high)
        if place.side in ("front", "beside"):
            spots = [spot for spot in spots if math.dist(spot, near) < 0.2]
        if not spots:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"There is no free spot there for {name}.", (name,))
        self._put_at_first(name, spots)

    def _corner_by(self, region: Region, corners: Sequence[tuple[float, float]]) -> tuple[float, float]:
        """Return the corner nearest to the anchor of a region, or farthest from it."""
        if region.anchor is None:
            raise ValueError(f"{region} has no anchor")
        anchor = self.ground.one(region.anchor, lambda _: True).ids[0]
        order = sorted(
            corners, key=lambda p: math.dist(self.world.placed(p), self.world.at[anchor]), reverse=region.farthest
        )
        best, second = (math.dist(self.world.placed(p), self.world.at[anchor]) for p in order[:2])
        if abs(best - second) < _AS_NEAR:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Two corners are as near to {anchor}; which one?", (anchor,))
        return order[0]

    def _middle_of(self, region: Region, xy: tuple[float, float]) -> tuple[float, float]:
        """Return where a part of the table is for what is at a place: "in the far left corner", "on the left side", "in the middle"."""
        x, y = self.world.on_seeds_table(xy)
        sides = region.sides
        aside, near_robot = (0.38, -0.06) if region.name == "edge" else (0.32, -0.02)
        across = aside if "left" in sides else -aside if "right" in sides else None
        along = 0.36 if "far" in sides else near_robot if "near" in sides else None
        if region.name == "middle":
            near = (0.1 if not sides else along or 0.1, 0.0 if across is None else across)
            near = (0.0, 0.0) if not sides else near
        elif region.name == "corner":
            choices = [(a, c) for a in (0.0, 0.32) for c in (0.34, -0.34)]
            choices = [
                p
                for p in choices
                if (along is None or (p[0] > 0.2) == (along > 0.2)) and (across is None or p[1] * across > 0)
            ]
            near = min(choices, key=lambda p: (round(math.dist(p, (x, y)), 4), p))
            near = self._corner_by(region, choices) if region.anchor else near
        else:
            near = (along if along is not None else x, across if across is not None else y)
            if not sides:
                near = (x, 0.36 if y >= 0 else -0.36)
        return self.world.placed(near)

    def _put_region(self, name: str, region: Region, radius: float) -> None:
        """Put a thing on a part of the table."""
        near, sides = self._middle_of(region, self.world.at[name]), region.sides
        if region.name in ("edge", "side") and sides:
            # Anywhere along that edge or side is as good, and nowhere else.
            x0, x1, y0 = BOUNDS[region.name]
            low = (x0 if "far" in sides else -_EDGE, y0 if "left" in sides else -_EDGE)
            high = (x1 if "near" in sides else _EDGE, -y0 if "right" in sides else _EDGE)
            spots = self.world.free_spots(
                near, radius, (name,), low=self.world.placed(low), high=self.world.placed(high)
            )
        else:
            spots = [p for p in self.world.free_spots(near, radius, (name,)) if math.dist(p, near) <= 0.16]
        if not spots:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"There is no free spot there for {name}.", (name,))
        self._put_at_first(name, spots)


def _told_by_colour(ref: Ref) -> bool:
    """Say whether a description is a colour alone, as in "to yellow"."""
    return bool(ref.one and ref.colours) and ref.determiner == "bare" and not (ref.ranks or ref.relations or ref.other)
