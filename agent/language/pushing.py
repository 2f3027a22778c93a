"""Pushing: which way, how far, and towards what."""

from __future__ import annotations

from robosandbox.agent.language.arranging import Arranging
from robosandbox.agent.language.discourse import AlreadySoError, RefusedError, listed
from robosandbox.agent.language.intent import Command, Place, Region, Relation
from robosandbox.agent.language.placing import BOUNDS
from robosandbox.types import DIRECTION_AXES, RefusalCode

PUSH_DISTANCE = 0.10  # Metres of a push whose distance is not said. Chosen.
SHORTEST_PUSH = 0.005  # Metres. Chosen: shorter ones are lost in the errors of a push.
# Relations that tell which way to push.
WAYS_OF_RELATION = ("towards", "away", "against")
_WAYS = {"left": "left", "right": "right", "far": "forward", "near": "back"}
_WITHIN = 0.06  # Metres that a thing is pushed into a region. Chosen: a cube's width and room.
_TO_THE_EDGE = 0.12  # Metres from the table's edge where a push to it ends. Chosen.


# Share of the way to a thing by which that may lie aside of it, and of the breadth of both by which a push may run past their middles:
# it strays by some millimetres.
_ASIDE, _MEETING = 0.75, 0.8


class Pushing(Arranging):
    """What is pushed, which way and how far."""

    def _push(self, command: Command) -> None:
        if any(relation.kind == "from" and not relation.refs for ref in command.objects for relation in ref.relations):
            raise RefusedError(RefusalCode.IMPOSSIBLE, "I do not push things off the table.")
        names, _ = self._objects(command)
        if len(names) != 1 and isinstance(command.place, Relation):
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which one first: {listed(names, 'or')}?", names)
        for name in names:
            for _ in range(self._repeats(command)):
                self._push_one(name, command)

    def _repeats(self, command: Command) -> int:
        if not 1 <= command.times <= 10:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"I do a thing 1 to 10 times, not {command.times}.")
        return command.times

    def _push_one(self, name: str, command: Command) -> None:
        lifted = self.world.held == name != self.start_held and command.place is None
        if lifted and command.direction and command.distance:
            # "pick up the can and move it 10 cm to the left": of where it stood.
            (x, y), _ = self.discourse.origins[name]
            dx, dy = DIRECTION_AXES[command.direction]
            where = f"{command.distance:g} m {command.direction}"
            self._put_at(name, (x + dx * command.distance, y + dy * command.distance), where)
            return
        self._need_empty(f"push {name}", None)
        if self.world.objects[name].shape.opens:
            raise RefusedError(RefusalCode.UNSUPPORTED, f"{name} is a drawer; I can open and close it.", (name,))
        if self.world.objects[name].shape.is_granular:
            raise RefusedError(RefusalCode.UNSUPPORTED, f"{name} are beads; I can pour them into something.", (name,))
        if self.world.on_top_of(name) or name in self.world.parent:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} does not stand free on the table; I cannot push it.", (name,)
            )
        direction, distance = command.direction, command.distance
        if command.place is not None and not _is_way(command.place):
            self._slide(name, command)
            return
        if isinstance(command.place, Relation):
            told = direction
            direction, distance = self._towards(name, command.place, distance)
            if told not in (None, direction):
                other = self.ground.one(command.place.refs[0], lambda other: True, (name,)).ids[0]
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE, f"{other} lies {direction} of {name}, and not {told}.", (other,)
                )
        elif isinstance(command.place, Region):
            direction, distance = self._as_far_as(name, command.place)
        if direction is None:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which way should {name} go?", tuple(DIRECTION_AXES))
        metres = PUSH_DISTANCE if distance is None else distance
        if metres < SHORTEST_PUSH:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"{1e3 * metres:g} mm is no distance to push; at least {1e3 * SHORTEST_PUSH:g} mm.",
            )
        dx, dy = DIRECTION_AXES[direction]
        x, y = self.world.at[name]
        end = (x + dx * metres, y + dy * metres)
        if not self.world.on_table(end, 0.02):
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"{name} would go to ({end[0]:.2f}, {end[1]:.2f}), off the table, {self.world.table_ends}.",
                (name,),
            )
        self._note_moved(name)
        self._add("push", object=name, direction=direction, distance=round(metres, 4))
        self.world.shift(name, dx * metres, dy * metres)

    def _slide(self, name: str, command: Command) -> None:
        """As in "push it to the left of the bowl", "slide it to the middle": to where it would be put."""
        self._note_moved(name)
        targets = self._targets(command.place, (name,)) if isinstance(command.place, Relation) else ()
        self.sliding = True
        try:
            self._put_one(name, command.place, targets)
        finally:
            self.sliding = False

    def _towards(self, name: str, place: Relation, distance: float | None) -> tuple[str, float]:
        target = self.ground.one(place.refs[0], lambda other: True, (name,)).ids[0]
        (x, y), (tx, ty) = self.world.at[name], self.world.at[target]
        dx, dy = tx - x, ty - y
        if place.kind == "away":
            dx, dy = -dx, -dy
        direction = max(DIRECTION_AXES, key=lambda d: DIRECTION_AXES[d][0] * dx + DIRECTION_AXES[d][1] * dy)
        ex, ey = DIRECTION_AXES[direction]
        along, across = dx * ex + dy * ey, abs(dx * ey - dy * ex)
        widths = [self.world.extents(each) for each in (name, target)]
        beside = sum(abs(ey) * width[0] + abs(ex) * width[1] for width in widths)
        # What is pushed towards a thing is to come near it, what is pushed against one to meet it.
        if across > (min(_ASIDE * along, _MEETING * beside) if place.kind == "against" else _ASIDE * along):
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"{target} lies neither straight ahead nor straight to a side of {name}; I push forward, back, left or right.",
                (target,),
            )
        if place.kind == "away":
            return direction, distance or PUSH_DISTANCE
        gap = along - sum(abs(ex) * width[0] + abs(ey) * width[1] for width in widths)
        return direction, distance or (gap if place.kind == "against" else min(PUSH_DISTANCE, max(gap - 0.01, 0.0)))

    def _as_far_as(self, name: str, region: Region) -> tuple[str, float]:
        """As in "push it to the left edge", "to the right side": which way, and how far until it is there."""
        if region.name not in BOUNDS or len(region.sides) != 1:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which way should {name} go?", tuple(DIRECTION_AXES))
        far, near, aside = BOUNDS[region.name]
        direction = _WAYS[region.sides[0]]
        if region.directional:
            return direction, PUSH_DISTANCE
        (dx, dy), (x, y) = DIRECTION_AXES[direction], self.world.at[name]
        start = dx * x + dy * y
        least = {"left": aside, "right": aside, "forward": far, "back": -near}[direction]
        most = least + (_TO_THE_EDGE if region.name == "edge" else _WITHIN)
        if start >= least + _WITHIN:
            raise AlreadySoError(f"{name} is there already.", (name,))
        # As far as the arm goes along with it.
        ends = [end for k in range(10) if (end := most - 0.02 * k) >= least]
        reached = [e - start for e in ends if self.world.in_reach((x + dx * (e - start), y + dy * (e - start)))]
        if not reached:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"I cannot reach far enough to push {name} there.", (name,))
        return direction, reached[0]


def _is_way(place: Place) -> bool:
    """Tell whether a place tells which way to push and no point of the table: "towards the can", "to the left edge"."""
    if isinstance(place, Region):
        return len(place.sides) == 1 and place.name in BOUNDS
    return isinstance(place, Relation) and place.kind in WAYS_OF_RELATION
