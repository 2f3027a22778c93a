"""Helpers of all verbs: the world as it stands in the plan, taking an object, adding a step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from robosandbox.agent.language.discourse import Discourse, RefusedError, listed
from robosandbox.agent.language.draft import Step
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import (
    Command,
    Rank,
    Ref,
    Relation,
    replace,
)
from robosandbox.agent.language.world import World
from robosandbox.types import ObservedScene, RefusalCode, SkillCall


class Hands:
    """A plan in the making and the world that it would leave."""

    def __init__(
        self, scene: ObservedScene, skills: frozenset[str], discourse: Discourse, chosen: Mapping[str, str] | None
    ) -> None:
        self.world: World = World(scene)
        self.discourse = discourse
        self.ground: Grounder = Grounder(self.world, discourse, chosen)
        self.skills = skills
        self.steps: list[Step] = []
        self.start_held: str | None = scene.held
        self.last_side: tuple[str, str] | None = None
        self.side_told = False
        """Whether the sentence said that side, and not just "next to"."""
        self.put_down: set[str] = set()
        self.dealt: set[str] = set()
        self.poured: set[str] = set()
        self.emptied: tuple[str, ...] = ()
        self.set_free: set[str] = set()
        # Whether what goes to a place is slid there in place of carried.
        self.sliding = False
        self.spared: set[str] = set()
        self.taken: dict[Ref, set[str]] = {}
        self.called: tuple[str, ...] = ()
        self.forbidden: list[tuple[Command, tuple[str, ...], tuple[str, ...]]] = []
        self.substitutes: dict[str, tuple[str, ...]] = {}
        self.moved: set[str] = set()
        # What a skill has picked up and put down itself, though it was to be picked up before.
        self.left_standing: set[str] = set()
        # What was picked up for a skill alone, without being told so.
        self.taken_for_this: set[str] = set()
        self.came_from = dict(discourse.origins)

    def _add(self, skill: str, others: Sequence[dict[str, Any]] = (), **arguments: Any) -> None:
        self._check_skill(skill)
        alternatives = tuple(SkillCall(skill=skill, arguments=other) for other in others)
        self.steps.append(Step(SkillCall(skill=skill, arguments=arguments), alternatives))

    def _check_skill(self, skill: str) -> None:
        if skill not in self.skills:
            raise RefusedError(
                RefusalCode.UNSUPPORTED,
                f"This needs {skill!r}, which this robot has no skill for; it can {listed(sorted(self.skills))}.",
                sorted(self.skills),
            )

    def _need_empty(self, what: str, name: str | None = None) -> None:
        held = self.world.held
        if held and held != name:
            done_with = held in self.poured or held in self.taken_for_this
            if done_with and held in self.discourse.origins and self.discourse.origins[held][1] is None:
                # "pour the rice in the pan, then the beans", "weigh both cubes": what is done with goes back where it stood.
                x, y = self.discourse.origins[held][0]
                self._add("place_at", x=round(x, 4), y=round(y, 4))
                self.world.put(held, (x, y))
                return
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
        if self.world.objects[name].shape.opens:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} is a drawer; I can open and close it, not pick it up.", (name,)
            )
        if self.world.objects[name].is_fixed:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} is a fixture, which stays where it is; I cannot pick it up.", (name,)
            )
        if self.world.objects[name].shape.is_granular:
            raise RefusedError(RefusalCode.IMPOSSIBLE, f"{name} are beads; I can pour them into something.", (name,))
        kind, holder = self.world.parent.get(name, ("", ""))
        if kind == "in" and self.world.objects[holder].shape.opens and holder not in self.world.opened:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{name} is in {holder}, which is closed by then.", (name, holder)
            )
        above = self.world.on_top_of(name)
        if above:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE, f"{listed(above)} stands on {name}; say where to put {above[0]} first.", above
            )
        self._add("pick", object=name)
        self._note_moved(name)
        self.world.take(name)

    def _leave_standing(self, name: str) -> None:
        """Take back that a thing was just picked up, for a skill that picks it up and puts it down itself."""
        last = self.steps[-1].call if self.steps else None
        if self.world.held == name and last is not None and last.skill == "pick":
            self.steps.pop()
            self.world.put(name, self.world.at[name], self.discourse.origins[name][1])
            self.left_standing.add(name)

    def _note_moved(self, name: str) -> None:
        """Remember where a thing comes from, before it is moved."""
        if name not in self.moved:
            self.moved.add(name)
            self.discourse.origins[name] = (self.world.at[name], self.world.parent.get(name))

    def _theme(self, names: tuple[str, ...]) -> None:
        self.discourse.themes.append(names)

    def _objects(
        self, command: Command, exclude: Iterable[str] = (), *, fits: Any = None, often: bool = False
    ) -> tuple[tuple[str, ...], bool]:
        """Return the ids of a command's objects and whether a plural was meant; each once, or as `often` as it is named."""
        told: list[Ref] = []
        names: list[str] = []
        found: dict[int, list[str]] = {}
        several = len(command.objects) > 1
        # "the big can, the other can and the small can": the other one than those two.
        for k, ref in sorted(
            enumerate(command.objects), key=lambda each: each[1].other and each[1].determiner == "the"
        ):
            if ref.one and ref.other and not ref.nouns and self.called:
                # "a cup on the block and another on the tray": another cup.
                ref = replace(ref, nouns=self.called)
            elif ref.one and [rank.nth for rank in ref.ranks] == [1] and not (ref.nouns or ref.names) and self.called:
                # "the two smallest balls in the cup and the biggest one in the box": the biggest ball.
                alike = replace(ref, nouns=self.called)
                ref = alike if self.ground.has(alike, fits=self.world.movable) else ref
            self.called = ref.nouns or tuple(name for name in ref.names[-1:] if name.isalpha()) or self.called
            if self.emptied and ref.determiner == "the" and not ref.plural and Relation("empty") in ref.relations:
                # "pour the tea into the bowl, then put the empty cup on the tray": the one that was poured from.
                own = replace(ref, names=self.emptied)
                ref = own if self.ground.has(own) else ref
            barred = (*exclude, *names) if ref.determiner != "the" or (ref.other and names) else (*exclude,)
            if ref.determiner == "a" or (ref.determiner == "bare" and ref.number):
                # "two bricks in the box, the yellow one stays": any two of the others.
                barred = (*barred, *self.spared)
            likes = self.taken.setdefault(replace(ref, text="", plural=False, number=None), set())
            if ref.determiner == "a" and command.verb in ("put", "stack", "tap", "push"):
                # "a cube to the left of the mug and a cube to the right of it": two cubes.
                barred = (*barred, *likes)
            meaning = self.ground.many(ref, fits or self.world.movable, barred)
            likes.update(meaning.ids if command.verb != "pick" else ())
            if ref.determiner == "it" and not (ref.plural or self.world.held or command.verb == "nothing"):
                self._check_alone(command, meaning.ids)
            if meaning.others and len(meaning.ids) == 1:
                self.substitutes[meaning.ids[0]] = meaning.others
            # "tap the bell, then the cup, then the bell again"
            same = replace(ref, text="", nouns=(), names=(*ref.nouns, *ref.names))
            again = often and same in told[:-1] and same != told[-1] and len(meaning.ids) == 1
            told.append(same)
            found[k] = [name for name in meaning.ids if name not in names or again]
            names += found[k]
            several = several or meaning.several
        names = self._in_turns(command, [name for k in sorted(found) for name in found[k]])
        self._theme(tuple(names))
        return tuple(names), several

    def _check_alone(self, command: Command, names: tuple[str, ...]) -> None:
        """As in "put the apple and the lemon on the plate, then move it into the bowl": which of them?"""
        together = self.discourse.themes[-1] if self.discourse.themes else ()
        if isinstance(command.place, Relation) and command.place.refs == command.objects:
            # "the flat block, then the tall one standing on it" says once more how they stand.
            return
        if len(together) > 1 and {*names} < {*together}:
            raise RefusedError(
                RefusalCode.AMBIGUOUS,
                f"What does “it” refer to: {listed(together, 'or')}?",
                together,
                about="it",
                firm=True,
            )

    def _in_turns(self, command: Command, names: list[str]) -> list[str]:
        """As in "all the cubes in the bin, the blue one first": those told to come first or last of all that are meant."""
        told: dict[str, list[str]] = {"first": [], "last": []}
        kinds = {(ref.nouns, ref.names) for ref in command.objects if ref.plural}
        across = [
            ref for _, ref in _turns_of(command) if ref.determiner == "bare" and (ref.nouns, ref.names) not in kinds
        ]
        if len(kinds) > 1 and across:
            # "the cups, then the markers, red before blue"
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"In which order do you mean {listed(names)}? Say it step by step.", firm=True
            )
        for which, ref in _turns_of(command):
            ground, meant = Grounder(self.world, Discourse()), frozenset(names)
            only = Ref(text=ref.text, determiner=ref.determiner, one=True, ranks=ref.ranks)
            if len(names) > 2 and ref.ranks and ref == only:
                # "smallest first": and the biggest last.
                ranked = Ref(text=ref.text, determiner="all", nouns=("thing",), plural=True)
                ranked = replace(ranked, ranks=(Rank(ref.ranks[0].key, 0),))
                ordered = list(ground.many(ranked, meant.__contains__).ids)
                if sorted(ordered) == sorted(names):
                    names = ordered if which == "first" else ordered[::-1]
            own = ref if ref.nouns or ref.names else replace(ref, nouns=("thing",), one=False)
            found = ground.many(own, meant.__contains__).ids
            if not {*found} <= {*names} or {*found} & {*told["first"], *told["last"]}:
                raise RefusedError(
                    RefusalCode.OBJECT_NOT_FOUND, f"“{ref.text}” {which}: I would move {listed(names)}.", names
                )
            told[which] += found
        others = [name for name in names if name not in told["first"] and name not in told["last"]]
        return [*told["first"], *others, *told["last"]]


def _turns_of(command: Command) -> tuple[tuple[str, Ref], ...]:
    """Return who comes first and last of the things of a command; nothing for the levels of a tower."""
    order = command.order if isinstance(command.order, tuple) else ()
    return order if order and order[0][0] in ("first", "last") else ()
