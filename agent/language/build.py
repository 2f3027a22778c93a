"""From intents to a checked plan: each command is grounded and done on paper before the next one is read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from robosandbox.agent.language import match
from robosandbox.agent.language.ground import Discourse, Grounder, RefusedError, listed
from robosandbox.agent.language.intent import (
    At,
    Command,
    Matching,
    Offset,
    Original,
    Place,
    Ref,
    Region,
    Relation,
    Sentence,
    Table,
)
from robosandbox.agent.language.world import ROBOT_XY, TABLE_HALF, World
from robosandbox.types import SIDE_AXES, ObservedScene, RefusalCode, SkillCall

PUSH_DISTANCE = 0.10
SHORTEST_PUSH = 0.005
DIRECTIONS = {"forward": (1.0, 0.0), "back": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0)}
SIDES = ("right", "left", "front", "back")


@dataclass(frozen=True)
class Step:
    """A skill call and what would do in its place.

    Attributes:
        call: The call.
        others: Calls that mean the same to the person: another side, another free spot.
    """

    call: SkillCall
    others: tuple[SkillCall, ...] = ()


@dataclass(frozen=True)
class Draft:
    """A plan with the choices that were free.

    Attributes:
        steps: In order.
        substitutes: For objects chosen among several ("a cube"): what would do as well.
    """

    steps: tuple[Step, ...]
    substitutes: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def calls(self) -> tuple[SkillCall, ...]:
        """The skill calls."""
        return tuple(step.call for step in self.steps)


def build(
    sentence: Sentence,
    scene: ObservedScene,
    skills: Iterable[str],
    discourse: Discourse | None = None,
    chosen: Mapping[str, str] | None = None,
) -> Draft:
    """Return the plan for one reading of a sentence.

    Args:
        sentence: The reading.
        scene: What perception sees.
        skills: Names of the skills at hand.
        discourse: What was spoken of before; noted in place.
        chosen: Answers to questions: unclear words and the ids that they mean.

    Raises:
        RefusedError: It cannot be grounded, or a step's precondition would not hold.
    """
    context = discourse or Discourse()
    try:
        return _Builder(scene, frozenset(skills), context, chosen).sentence(sentence)
    except RefusedError as error:
        # "red on green and green on blue": a tower grows from below.
        if error.refusal.code is not RefusalCode.IMPOSSIBLE or not _is_tower(sentence.steps):
            raise
        upwards = Sentence(tuple(reversed(sentence.steps)), sentence.avoid)
        try:
            return _Builder(scene, frozenset(skills), Discourse(), chosen).sentence(upwards)
        except RefusedError:
            raise error from None


class _Builder:
    def __init__(
        self, scene: ObservedScene, skills: frozenset[str], discourse: Discourse, chosen: Mapping[str, str] | None
    ) -> None:
        self.world = World(scene)
        self.discourse = discourse
        self.ground = Grounder(self.world, discourse, chosen)
        self.skills = skills
        self.steps: list[Step] = []
        self.substitutes: dict[str, tuple[str, ...]] = {}
        self.moved = {self.world.held} if self.world.held else set()
        self.start = {name: (xy, self.world.parent.get(name)) for name, xy in self.world.at.items()}

    def sentence(self, sentence: Sentence) -> Draft:
        avoid = self._avoided(sentence.avoid)
        if not sentence.steps:
            raise RefusedError(
                RefusalCode.UNSUPPORTED,
                f"I leave {listed(sorted(avoid))} alone; there is nothing else to do.",
                sorted(avoid),
            )
        for command in _fused(sentence.steps):
            getattr(self, f"_{command.verb}")(command)
        touched = [(step, name) for step in self.steps for name in _acted_on(step.call) if name in avoid]
        if touched:
            step, name = touched[0]
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"You asked me to keep away from {name}, and {step.call} would move or use it.",
                (name,),
            )
        if not self.steps:
            raise RefusedError(RefusalCode.IMPOSSIBLE, "That is already so; there is nothing to do.")
        return Draft(tuple(self.steps), self.substitutes)

    def _avoided(self, refs: Sequence[Ref]) -> set[str]:
        avoid: set[str] = set()
        for ref in refs:
            if ref.determiner == "all" and ref.other:
                continue
            avoid.update(self.ground.many(ref, lambda name: True).ids)
        return avoid

    # Steps.

    def _add(self, skill: str, others: Sequence[dict[str, Any]] = (), **arguments: Any) -> None:
        if skill not in self.skills:
            raise RefusedError(
                RefusalCode.UNSUPPORTED,
                f"This needs {skill!r}, which this robot has no skill for; it can {listed(sorted(self.skills))}.",
                sorted(self.skills),
            )
        alternatives = tuple(SkillCall(skill=skill, arguments=other) for other in others)
        self.steps.append(Step(SkillCall(skill=skill, arguments=arguments), alternatives))

    def _need_empty(self, what: str, name: str | None = None) -> None:
        held = self.world.held
        if held and held != name:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"The gripper holds {held}, so I cannot {what}; say where to put {held} first.",
                (held,),
            )

    def _take(self, name: str) -> None:
        """Have an object in the gripper."""
        if self.world.held == name:
            return
        self._need_empty(f"pick up {name}")
        if self.world.objects[name].kind == "drawer":
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} is a drawer; I can open and close it, not pick it up.", (name,)
            )
        above = self.world.on_top_of(name)
        if above:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{listed(above)} stands on {name}; say where to put {above[0]} first.", above
            )
        self._add("pick", object=name)
        self.moved.add(name)
        self.world.take(name)

    def _theme(self, names: tuple[str, ...]) -> None:
        self.discourse.themes.append(names)

    def _objects(
        self, command: Command, exclude: Iterable[str] = (), *, fits: Any = None
    ) -> tuple[tuple[str, ...], bool]:
        """Return the ids of a command's objects, each once, and whether a plural was meant."""
        names: list[str] = []
        several = len(command.objects) > 1
        for ref in command.objects:
            meaning = self.ground.many(
                ref, fits or self.world.movable, (*exclude, *names) if ref.determiner != "the" else exclude
            )
            if meaning.others and len(meaning.ids) == 1:
                self.substitutes[meaning.ids[0]] = meaning.others
            names += [name for name in meaning.ids if name not in names]
            several = several or meaning.several
        self._theme(tuple(names))
        return tuple(names), several

    # Verbs.

    def _pick(self, command: Command) -> None:
        names, _ = self._objects(command)
        if len(names) > 1:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"The gripper holds one object at a time, and you asked for {listed(names)}; where should they go?",
                names,
            )
        if self.world.held == names[0] and names[0] in (
            self.steps[-1].call.arguments.get("object") for _ in self.steps[-1:]
        ):
            return
        if self.world.held == names[0]:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"The gripper holds {names[0]} already.", names)
        self._take(names[0])

    def _put(self, command: Command) -> None:
        place = command.place
        if isinstance(place, Matching):
            self._sort(
                Command(
                    "sort",
                    command.objects,
                    Relation("in", (Ref(text="bins", determiner="all", nouns=("bin",), plural=True),)),
                )
            )
            return
        if command.tower and isinstance(place, Relation):
            self._tower([*reversed(command.tower), *place.refs, *reversed(command.objects)], command)
            return
        definite = all(ref.determiner != "a" for ref in command.objects)
        targets: tuple[str, ...] = ()
        if isinstance(place, Relation) and place.refs and not definite:
            targets = self._targets(place, ())
        names, several = self._objects(command, targets)
        if isinstance(place, Relation) and place.refs and definite:
            targets = self._targets(place, names)
        if several:
            names = tuple(name for name in names if name not in targets and not self._is_there(name, place, targets))
            names = tuple(sorted(names, key=self.world.level, reverse=True))
            if not names:
                raise RefusedError(RefusalCode.IMPOSSIBLE, "They are there already; there is nothing to do.", targets)
        if len(names) > 1 and isinstance(place, At):
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{listed(names)} do not fit in one point.", names)
        if len(names) > 1 and command.verb == "stack" and targets:
            self._pile(targets[0], names)
            return
        for name in names:
            self._put_one(name, place, targets, stack=command.verb == "stack" and self.world.held != name)
        self._theme(names)

    def _is_there(self, name: str, place: Place | None, targets: Sequence[str]) -> bool:
        if not isinstance(place, Relation) or not targets:
            return isinstance(place, Table) and name not in self.world.parent and self.world.held != name
        parent = self.world.parent.get(name)
        return place.kind in ("in", "to", "on") and (
            parent in (("on", targets[0]), ("in", targets[0])) or name in self.world.inside(targets[0])
        )

    def _targets(self, place: Relation, names: Sequence[str]) -> tuple[str, ...]:
        world = self.world
        if place.kind == "in":

            def fits(name: str) -> bool:
                return world.objects[name].kind in match.CONTAINERS
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
            # "the red cube on itself" is to be refused; "it on the block" must not find the thing in hand.
            barred = names if ref.determiner in ("it", "a") or ref.other or ref.one else ()
            meaning = self.ground.one(ref, fits, barred)
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
        match place:
            case Relation(kind="between"):
                (ax, ay), (bx, by) = world.at[targets[0]], world.at[targets[1]]
                self._put_at(name, ((ax + bx) / 2, (ay + by) / 2), f"between {targets[0]} and {targets[1]}")
            case Relation(kind=kind, distance=distance):
                target = targets[0]
                holder = world.objects[target].kind in ("bin", "bowl")
                if (
                    kind == "in"
                    or (kind == "to" and world.objects[target].kind in match.CONTAINERS)
                    or (kind == "on" and holder)
                ):
                    self._put_in(name, target)
                elif kind == "on":
                    self._put_on(name, target, stack=stack)
                elif kind == "to":
                    raise RefusedError(
                        RefusalCode.AMBIGUOUS, f"Should {name} go on {target} or next to it?", (name, target)
                    )
                elif kind in SIDES and distance is not None:
                    ex, ey = SIDE_AXES[kind]
                    x, y = world.at[target]
                    self._put_at(name, (x + ex * distance, y + ey * distance), f"{distance:g} m {kind} of {target}")
                elif kind in SIDES:
                    self._put_beside(name, target, (kind,))
                elif kind == "beside":
                    self._put_beside(name, target, SIDES)
                else:
                    raise RefusedError(RefusalCode.UNSUPPORTED, f"I cannot put things {kind} others.", (target,))
            case At(x=x, y=y):
                self._put_at(name, (x, y), f"({x:g}, {y:g})")
            case Offset(direction=direction, distance=distance):
                dx, dy = DIRECTIONS[direction]
                x, y = world.at[name]
                step = distance or PUSH_DISTANCE
                self._put_at(name, (x + dx * step, y + dy * step), f"{step:g} m {direction}")
            case Original():
                if name not in self.moved:
                    raise RefusedError(RefusalCode.AMBIGUOUS, f"Where is back? I have not moved {name} yet.", (name,))
                xy, parent = self.start[name]
                if parent and parent[0] == "in":
                    self._put_in(name, parent[1])
                elif parent:
                    self._put_on(name, parent[1])
                else:
                    self._put_at(name, xy, "its first place")
            case Region():
                self._put_region(name, place, radius)
            case _:
                self._put_free(name, world.at[name], ignore=(name,))

    def _put_in(self, name: str, target: str) -> None:
        world = self.world
        kind = world.objects[target].kind
        if kind not in match.CONTAINERS:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{target} is a {kind}, which is no container: nothing goes in it.", (target,)
            )
        if world.objects[name].kind in match.CONTAINERS:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} is a container itself; I do not put it in {target}.", (name,)
            )
        if kind == "drawer" and target not in world.opened and "open_drawer" in self.skills:
            if world.held:
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE,
                    f"{target} has to be opened first, and the gripper holds {world.held}.",
                    (target,),
                )
            self._add("open_drawer", drawer=target)
            world.opened.add(target)
        self._take(name)
        self._add("place_in", container=target)
        world.put(name, world.at[target], ("in", target))

    def _put_on(self, name: str, target: str, *, stack: bool = False) -> None:
        world = self.world
        if world.objects[target].kind == "sphere":
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{target} is a ball: nothing stays on it.", (target,))
        if target == world.held:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{target} is in the gripper; nothing can be put on it.", (target,)
            )
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
            if world.objects[name].kind == "drawer":
                self._take(name)
            self._add("stack", object=name, target=target)
        else:
            self._take(name)
            self._add("place_on", target=target)
        world.put(name, world.at[target], ("on", target))

    def _put_at(self, name: str, xy: tuple[float, float], where: str) -> None:
        x, y = round(xy[0], 4), round(xy[1], 4)
        if not self.world.in_reach((x, y)):
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"{where} is at ({x:g}, {y:g}), which is off the table (±{TABLE_HALF:g} m) or out of the arm's reach.",
            )
        radius = 0.8 * self.world.radius(name) - 0.02
        if not self.world.is_free((x, y), radius, (name,)):
            taken = [other for other in self.world.objects if other != name and not self._alone((x, y), radius, other)]
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{where} is taken by {listed(taken)}.", taken)
        self._take(name)
        self._add("place_at", x=x, y=y)
        self.world.put(name, (x, y))

    def _alone(self, xy: tuple[float, float], radius: float, other: str) -> bool:
        return self.world.is_free(xy, radius, [name for name in self.world.objects if name != other])

    def _put_beside(self, name: str, target: str, sides: Sequence[str]) -> None:
        world = self.world
        free: list[tuple[float, str, tuple[float, float]]] = []
        for side in sides:
            ex, ey = SIDE_AXES[side]  # type: ignore[index]
            tx, ty, _ = world.extents(target)
            ox, oy, _ = world.extents(name)
            gap = abs(ex) * (tx + ox) + abs(ey) * (ty + oy) + 0.03
            x, y = world.at[target][0] + ex * gap, world.at[target][1] + ey * gap
            if len(sides) == 1 or (
                world.in_reach((x, y)) and world.is_free((x, y), world.radius(name) - 0.01, (name, target))
            ):
                free.append((round(math.dist((x, y), ROBOT_XY), 3), side, (x, y)))
        if not free:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"There is no room next to {target}.", (target,))
        if target in world.parent or target == world.held:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{target} does not stand on the table, so nothing fits beside it.", (target,)
            )
        self._take(name)
        _, side, xy = free[0] if len(sides) == 1 else min(free)
        others = [{"target": target, "side": other} for _, other, _ in sorted(free) if other != side]
        self._add("place_beside", others, target=target, side=side)
        world.put(name, xy)

    def _put_free(self, name: str, near: tuple[float, float], ignore: Iterable[str] = ()) -> None:
        spots = self.world.free_spots(near, self.world.radius(name), ignore)
        if not spots:
            raise RefusedError(RefusalCode.IMPOSSIBLE, "There is no free spot on the table.")
        self._take(name)
        (x, y), *rest = spots
        self._add("place_at", [{"x": ox, "y": oy} for ox, oy in rest], x=x, y=y)
        self.world.put(name, (x, y))

    def _put_region(self, name: str, region: Region, radius: float) -> None:
        """As in "in the far left corner", "on the left side", "at the edge", "in the middle"."""
        x, y = self.world.at[name]
        sides = region.sides
        across = 0.32 if "left" in sides else -0.32 if "right" in sides else None
        along = 0.36 if "far" in sides else -0.02 if "near" in sides else None
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
        else:
            near = (along if along is not None else x, across if across is not None else y)
            if not sides:
                near = (x, 0.36 if y >= 0 else -0.36)
        spots = self.world.free_spots(near, radius, (name,))
        if not spots or math.dist(spots[0], near) > 0.16:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"There is no free spot there for {name}.", (name,))
        self._put_free(name, near, ignore=(name,))

    def _release(self, command: Command) -> None:
        held = self.world.held
        if not held and self.steps and self.steps[-1].call.skill.startswith("place_"):
            # "move it over the bin and let go"
            return
        if not held:
            raise RefusedError(RefusalCode.IMPOSSIBLE, "The gripper holds nothing that I could put down.")
        names, _ = self._objects(command)
        if names != (held,):
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"The gripper holds {held}, not {listed(names)}.", (held,))
        self._put_free(held, self.world.at[held])

    # Towers.

    def _stack(self, command: Command) -> None:
        place = command.place
        if isinstance(place, Relation) and place.refs:
            self._put(command)
            return
        if not command.objects:
            movable = [name for name in self.world.objects if self.world.movable(name)]
            raise RefusedError(RefusalCode.AMBIGUOUS, f"A tower of what? I see {listed(movable)}.", movable)
        names, _ = self._objects(command)
        if len(names) < 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"On what should {listed(names)} go?", tuple(self.world.objects))
        self._order_tower(command, list(names))

    def _order_tower(self, command: Command, names: list[str]) -> None:
        order = command.order
        if isinstance(order, tuple):
            placed = {level: self.ground.one(ref, lambda name: name in names).ids[0] for level, ref in order}
            rest = sorted((name for name in names if name not in placed.values()), key=self._breadth)
            levels = (
                placed.get("bottom"),
                *rest[: len(rest) // 2],
                placed.get("middle"),
                *rest[len(rest) // 2 :],
                placed.get("top"),
            )
            names = [name for name in levels if name]
        elif order == "down":
            names.reverse()
        elif order is None and len(command.objects) == 1:
            # The widest below; what stands in a tower already stays.
            names.sort(key=self._breadth)
        self._pile(names[0], names[1:])

    def _breadth(self, name: str) -> tuple[float, float]:
        x, y, _ = self.world.extents(name)
        return -round(x * y, 6), round(math.dist(self.world.at[name], ROBOT_XY), 6)

    def _tower(self, refs: Sequence[Ref], command: Command) -> None:
        """From the bottom up; what stands right already stays."""
        names: list[str] = []
        for ref in refs:
            names.append(self.ground.one(ref, None, names if ref.determiner != "the" else ()).ids[0])
        if len(set(names)) < len(names):
            raise RefusedError(RefusalCode.IMPOSSIBLE, "The same object cannot be in one tower twice.", names)
        self._theme(tuple(names[1:]))
        self._pile(names[0], names[1:], stack=command.verb == "stack")

    def _pile(self, base: str, names: Sequence[str], *, stack: bool = True) -> None:
        below = base
        for name in names:
            if self.world.parent.get(name) != ("on", below):
                self._put_on(name, below, stack=stack)
            below = name

    def _unstack(self, command: Command) -> None:
        ref = command.objects[0]
        names, _ = self._objects(command)
        group = set(names)
        if ref.nouns == ("tower",) or ref.nouns == ("stack",) or len(names) == 1:
            below = names[0]
            while below in self.world.parent and self.world.parent[below][0] == "on":
                below = self.world.parent[below][1]
                group.add(below)
        high = sorted((name for name in group if self.world.level(name)), key=self.world.level, reverse=True)
        if not high:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{listed(names)}: nothing there is stacked.", names)
        for name in high:
            self._put_free(name, self.world.at[name])

    # Other verbs.

    def _aside(self, command: Command) -> None:
        names, _ = self._objects(command)
        for name in sorted(names, key=self.world.level, reverse=True):
            x, y = self.world.at[name]
            away = 0.2 if y >= 0 else -0.2
            self._put_free(name, (x, max(-0.3, min(0.3, y + away))))

    def _tidy(self, command: Command) -> None:
        """Into the one container there is; a container named itself is emptied."""
        objects = self.world.objects
        names, _ = self._objects(command)
        if len(names) == 1 and (not self.world.movable(names[0]) or self.world.on_top_of(names[0])):
            self._empty(names[0])
            return
        bins = [item.id for item in objects.values() if item.kind == "bin"]
        if len(bins) != 1:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Where should {listed(names)} go? I see {listed(bins)}.", bins)
        left = [name for name in names if name not in self.world.inside(bins[0])]
        for name in sorted(left, key=self.world.level, reverse=True):
            self._put_in(name, bins[0])

    def _empty(self, holder: str) -> None:
        """Take what is in or on something, and put it on the table."""
        world = self.world
        if world.objects[holder].kind == "drawer":
            raise RefusedError(RefusalCode.UNSUPPORTED, f"Name what to take out of {holder}.", (holder,))
        content = [*world.inside(holder), *world.on_top_of(holder)]
        if not content:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"I see nothing in or on {holder}.", (holder,))
        for name in sorted(content, key=world.level, reverse=True):
            self._put_free(name, world.at[name])

    def _push(self, command: Command) -> None:
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
        self._need_empty(f"push {name}", None)
        if self.world.objects[name].kind == "drawer":
            raise RefusedError(RefusalCode.UNSUPPORTED, f"{name} is a drawer; I can open and close it.", (name,))
        if self.world.on_top_of(name) or name in self.world.parent:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} does not stand free on the table; I cannot push it.", (name,)
            )
        direction, distance = command.direction, command.distance
        if isinstance(command.place, Relation):
            direction, distance = self._towards(name, command.place, distance)
        if direction is None:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which way should {name} go?", tuple(DIRECTIONS))
        metres = PUSH_DISTANCE if distance is None else distance
        if metres < SHORTEST_PUSH:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"{1e3 * metres:g} mm is no distance to push; at least {1e3 * SHORTEST_PUSH:g} mm.",
            )
        dx, dy = DIRECTIONS[direction]
        x, y = self.world.at[name]
        end = (x + dx * metres, y + dy * metres)
        if max(abs(end[0]), abs(end[1])) > TABLE_HALF - 0.02:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"{name} would go to ({end[0]:.2f}, {end[1]:.2f}), off the table, which ends at ±{TABLE_HALF:g} m.",
                (name,),
            )
        self._add("push", object=name, direction=direction, distance=round(metres, 4))
        self.world.shift(name, dx * metres, dy * metres)

    def _towards(self, name: str, place: Relation, distance: float | None) -> tuple[str, float]:
        target = self.ground.one(place.refs[0], lambda other: True, (name,)).ids[0]
        (x, y), (tx, ty) = self.world.at[name], self.world.at[target]
        dx, dy = tx - x, ty - y
        if place.kind == "away":
            dx, dy = -dx, -dy
        direction = max(DIRECTIONS, key=lambda d: DIRECTIONS[d][0] * dx + DIRECTIONS[d][1] * dy)
        ex, ey = DIRECTIONS[direction]
        along, across = dx * ex + dy * ey, abs(dx * ey - dy * ex)
        if across > 0.75 * along:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"{target} lies neither straight ahead nor straight to a side of {name}; I push forward, back, left or right.",
                (target,),
            )
        if place.kind == "away":
            return direction, distance or PUSH_DISTANCE
        gap = (
            along
            - abs(ex) * (self.world.extents(name)[0] + self.world.extents(target)[0])
            - abs(ey) * (self.world.extents(name)[1] + self.world.extents(target)[1])
        )
        return direction, distance or (gap if place.kind == "against" else min(PUSH_DISTANCE, max(gap - 0.01, 0.0)))

    def _pour(self, command: Command) -> None:
        names, several = self._objects(
            command, fits=lambda name: self.world.objects[name].kind not in ("bin", "drawer")
        )
        place = command.place
        if several or not isinstance(place, Relation):
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which one should I pour from: {listed(names, 'or')}?", names)
        target = self.ground.one(
            place.refs[0], lambda name: self.world.objects[name].kind in match.CONTAINERS, names
        ).ids[0]
        if target == names[0]:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{target} cannot be poured into itself.", (target,))
        self._take(names[0])
        self._add("pour", target=target)

    def _drawer(self, command: Command, skill: str) -> str:
        meaning = self.ground.one(command.objects[0], lambda name: self.world.objects[name].kind == "drawer")
        name = meaning.ids[0]
        if self.world.objects[name].kind != "drawer":
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{name} is no drawer; it neither opens nor closes.", (name,))
        self._need_empty(f"handle {name}")
        self._theme((name,))
        self._add(skill, drawer=name)
        return name

    def _open(self, command: Command) -> None:
        self.world.opened.add(self._drawer(command, "open_drawer"))

    def _close(self, command: Command) -> None:
        self.world.opened.discard(self._drawer(command, "close_drawer"))

    def _tap(self, command: Command) -> None:
        names, _ = self._objects(command, fits=lambda name: True)
        for name in names:
            if name == self.world.held:
                raise RefusedError(RefusalCode.IMPOSSIBLE, f"{name} is in the gripper; I cannot tap it.", (name,))
            for _ in range(self._repeats(command)):
                self._add("tap", object=name)

    def _home(self, command: Command) -> None:
        self._add("home")

    def _swap(self, command: Command) -> None:
        names, _ = self._objects(command)
        if len(names) != 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Swap which two: {listed(names)}?", names)
        self._need_empty("swap")
        world = self.world
        first, second = names
        for name in names:
            if world.parent.get(name, ("", ""))[1] in names:
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE, f"{first} and {second} stand on each other; I cannot swap them.", names
                )
        places = {name: (world.at[name], world.parent.get(name)) for name in names}
        self._put_free(first, world.at[first], ignore=())
        for name, other in ((second, first), (first, second)):
            xy, parent = places[other]
            if parent and parent[0] == "in":
                self._put_in(name, parent[1])
            elif parent:
                self._put_on(name, parent[1])
            else:
                self._put_at(name, xy, f"the place of {other}")

    def _sort(self, command: Command) -> None:
        names, _ = self._objects(command)
        if self.world.held not in names:
            self._need_empty("sort")
        objects = self.world.objects
        containers = [item for item in objects.values() if item.kind in ("bin", "bowl")]
        if isinstance(command.place, Relation) and command.place.refs:
            ids = self.ground.many(
                command.place.refs[0], lambda name: objects[name].kind in match.CONTAINERS, names
            ).ids
            containers = [objects[name] for name in ids]
        colours = {name: match.colour_of(objects[name]) for name in names}
        homes = {colour: match.with_colour(containers, (colour,)) for colour in dict.fromkeys(colours.values())}
        if not isinstance(command.place, Relation) and len(containers) == 1 and not all(homes.values()):
            homes = {}
        if any(homes.values()) or (isinstance(command.place, Relation) and containers):
            if not any(homes.values()) and len(containers) >= len(homes):
                homes = {colour: [container] for colour, container in zip(homes, containers, strict=False)}
            for colour, bins in homes.items():
                if len(bins) != 1:
                    stray = [name for name in names if colours[name] == colour]
                    raise RefusedError(
                        RefusalCode.IMPOSSIBLE if not bins else RefusalCode.AMBIGUOUS,
                        f"There {'is no container' if not bins else 'are several containers'} for what is {colour}: {listed(stray)}.",
                        [item.id for item in bins] or stray,
                    )
            for name in sorted(names, key=self.world.level, reverse=True):
                target = homes[colours[name]][0].id
                if name not in self.world.inside(target):
                    self._put_in(name, target)
            return
        self._sort_on_table(names, colours)

    def _sort_on_table(self, names: Sequence[str], colours: dict[str, str]) -> None:
        """Without bins: one row per colour, side by side from the left."""
        groups = list(dict.fromkeys(colours[name] for name in sorted(names, key=lambda name: -self.world.at[name][1])))
        if len(groups) < 2:
            raise RefusedError(RefusalCode.IMPOSSIBLE, "They all have the same colour.", names)
        centres = {colour: (0.1, 0.25 - 0.5 * k / (len(groups) - 1)) for k, colour in enumerate(groups)}
        for name in sorted(names, key=lambda name: (groups.index(colours[name]), -self.world.level(name))):
            self._put_free(name, centres[colours[name]])

    def _line_up(self, command: Command) -> None:
        names, _ = self._objects(command)
        if len(names) < 2:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Line {listed(names)} up with what?", names)
        self._need_empty("line things up")
        anchor = min(names, key=lambda name: math.dist(self.world.at[name], (0.1, 0.0)))
        previous = anchor
        for name in (name for name in names if name != anchor):
            self._put_beside(
                name, previous, ("right", "left") if previous != anchor else ("right", "left", "front", "back")
            )
            previous = name


def _acted_on(call: SkillCall) -> tuple[str, ...]:
    return tuple(value for key, value in call.arguments.items() if key in ("object", "target", "container", "drawer"))


def _fused(commands: Sequence[Command]) -> list[Command]:
    """As in "pick up both balls and put them in the bin": two hands would be needed, so each goes before the next is taken."""
    fused: list[Command] = []
    for command in commands:
        before = fused[-1] if fused else None
        several = (
            before
            and before.verb == "pick"
            and (len(before.objects) > 1 or before.objects[0].plural or before.objects[0].determiner == "all")
        )
        if (
            before
            and several
            and command.verb in ("put", "stack")
            and len(command.objects) == 1
            and command.objects[0].determiner == "it"
        ):
            fused[-1] = Command(command.verb, before.objects, command.place, command.tower, command.order)
        else:
            fused.append(command)
    return fused


def _is_tower(commands: Sequence[Command]) -> bool:
    """Say whether all commands put one described thing on another."""
    return len(commands) > 1 and all(
        command.verb in ("put", "stack")
        and isinstance(command.place, Relation)
        and command.place.kind == "on"
        and not any(
            ref.determiner == "it" or (ref.one and not ref.colours) for ref in (*command.objects, *command.place.refs)
        )
        for command in commands
    )


__all__ = ["Draft", "Step", "build"]
