"""From intents to a checked plan: each command is grounded and done on paper before the next one is read."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from typing import Any, get_args

from robosandbox.agent.language import match
from robosandbox.agent.language.apart import (
    dealt_first,
    members_apart,
    members_named,
    other_regions,
    other_than_its_place,
    rest_of_its_kind,
    sorted_as_told,
    without_what_is_denied,
)
from robosandbox.agent.language.binding import with_nouns
from robosandbox.agent.language.deciding import Deciding
from robosandbox.agent.language.discourse import AlreadySoError, Discourse, RefusedError, listed
from robosandbox.agent.language.draft import Draft, Rest, Step
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import (
    Command,
    Ref,
    Region,
    Relation,
    Sentence,
    Spot,
    replace,
)
from robosandbox.agent.language.logic import If, While, commands_of
from robosandbox.agent.language.orders import Fits
from robosandbox.agent.language.readings import check_sides, fused, is_tower, swapped
from robosandbox.agent.language.skill_words import points_of, resolved, ways_of, words_of
from robosandbox.agent.language.terms import ONE_MOTION, UNTOUCHED
from robosandbox.agent.language.unfolding import unfolded
from robosandbox.agent.language.whereto import check_where_told
from robosandbox.skills.words import Words
from robosandbox.types import BEFORE, ObservedScene, RefusalCode, Side, SkillCall
from robosandbox.world.parts import is_part
from robosandbox.world.relations import top


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
    rest: tuple[Command, ...] = ()
    if any(step.control for step in sentence.steps):
        _check_words(sentence)

        def after(steps: tuple[Command, ...]) -> _Builder:
            builder = _Builder(scene, frozenset(skills), deepcopy(context), chosen)
            if steps:
                builder.sentence(Sentence(steps))
            return builder

        plain = unfolded(sentence.steps, after)
        if not plain.steps:
            nothing = plain.not_so or RefusedError(RefusalCode.IMPOSSIBLE, "There is nothing to do.")
            return Draft((), nothing=nothing.refusal)
        sentence, rest = Sentence(plain.steps, sentence.avoid), plain.rest
    # What a correction ("no, the blue one") is about.
    context.last = sentence
    try:
        draft = _Builder(scene, frozenset(skills), context, chosen).sentence(sentence)
        return dataclasses.replace(draft, rest=Rest(rest, sentence.avoid, context, _said(rest))) if rest else draft
    except RefusedError as error:
        # "red on green and green on blue": a tower grows from below; "the can where the cup is": first the cup has to go.
        exchanged = any(isinstance(step.place, Spot) for step in sentence.steps)
        if error.refusal.code is not RefusalCode.IMPOSSIBLE or not (exchanged or is_tower(sentence.steps)):
            raise
        upwards = Sentence(swapped(sentence.steps) or tuple(reversed(sentence.steps)), sentence.avoid)
        try:
            draft = _Builder(scene, frozenset(skills), Discourse(), chosen).sentence(upwards)
        except RefusedError:
            raise error from None
        if exchanged and _leaves_its_neighbour(draft):
            # "the can where the ball is and the ball to the left of the can": of where the can is then.
            raise error
        return draft


def _check_words(sentence: Sentence) -> None:
    """Refuse words that nobody knows, also where they are not decided on yet."""
    commands = [each for step in sentence.steps for each in commands_of(step)]
    strange = [ref.text for command in commands for ref in _parties(command) if ref.unknown]
    if strange:
        raise RefusedError(RefusalCode.UNRECOGNIZED, f"I do not know what is meant by “{strange[0]}”.", strange)


def _said(rest: tuple[Command, ...]) -> str:
    """Return the words of the condition that is decided later."""
    form = rest[0].control
    return form.condition.text if isinstance(form, If | While) else ""


def _leaves_its_neighbour(draft: Draft) -> bool:
    """Say whether something is put beside a thing that is carried away afterwards."""
    beside: set[str] = set()
    for call in draft.calls:
        if call.skill == "pick" and call.arguments["object"] in beside:
            return True
        if call.skill == "place_beside":
            beside.add(str(call.arguments["target"]))
    return False


# Where on the seeds' table the hand is before it goes to a part of one that names no other.
_BEFORE_IT = (0.1, 0.0)
# Metres above all that stands there at which the hand is over a part of the table, as `move_over` has it over a thing.
_ABOVE = 0.1
# What the hand does by itself, after which it goes back to where it was.
_BY_ITSELF = UNTOUCHED | {"open_gripper", "close_gripper", "shake", "turn_hand", "tap", "press_down"}
# The pose in which the arm stands when an order begins.
_START = "start"
_PLACING = frozenset({"place_on", "place_in", "place_beside", "place_at", "stack"})
_ONCE = frozenset({"pick", "put", "release", "stack", "pour", "open", "close", "home"})
_SELVES = frozenset({"itself", "themselves"})
_SKILLS_OF = {
    "pick": frozenset({"pick", "stack"}),
    "put": _PLACING,
    "release": _PLACING,
    "stack": frozenset({"place_on", "stack"}),
    "move": frozenset({"pick", "push", "stack"}),
    "open": frozenset({"open_drawer"}),
    "close": frozenset({"close_drawer"}),
}


class _Builder(Deciding):
    """A plan for one sentence."""

    def sentence(self, sentence: Sentence) -> Draft:
        # "put the left cube in the bin, leave the other one": other than what is then moved.
        others = [ref for ref in sentence.avoid if ref.other and ref.determiner != "all"]
        # "weigh the cube, but don't lift it": it may be what was spoken of before, or what this sentence is about.
        left = [ref for ref in sentence.avoid if ref not in others]
        if any(ref.determiner == "it" and not ref.plural for ref in left):
            left += [ref for command in sentence.steps for ref in command.objects if ref.determiner != "it"][-1:]
        avoid = self._avoided(left)
        self.spared = avoid
        if all(command.verb == "nothing" for command in sentence.steps):
            for command in map(_each_spared, sentence.steps):
                avoid.update(name for ref in command.objects for name in self.ground.many(ref, lambda name: True).ids)
            raise RefusedError(
                RefusalCode.UNSUPPORTED,
                f"I leave {listed(sorted(avoid))} alone; there is nothing else to do.",
                sorted(avoid),
            )
        orders = rest_of_its_kind(other_regions(sorted_as_told(tuple(map(_each_spared, sentence.steps)))))
        ground = Grounder(self.world, Discourse())
        steps = dealt_first(members_apart(members_named(orders, ground), ground))
        check_sides(steps)
        begun, told = 0, tuple[Ref, ...]()
        for command in fused(steps):
            for ref in command.spoken:
                self.ground.many(ref, lambda name: True)
            if not self.discourse.mentioned and self.world.held is None:
                command = other_than_its_place(command)
            spared = without_what_is_denied(command, Grounder(self.world, Discourse()))
            self._check_tower(spared)
            check_where_told(spared, Grounder(self.world, Discourse()))
            if spared.times != 1 and spared.verb in _ONCE:
                raise RefusedError(RefusalCode.IMPOSSIBLE, f"I cannot do that {spared.times} times: it is done once.")
            _check_slots(spared)
            before = self.steps[begun:]
            begun = len(self.steps)
            getattr(self, f"_{command.verb}")(spared)
            named = any(ref.nouns or ref.names or ref.colours or ref.ranks for ref in spared.objects)
            if spared.bare and named and before and self.steps[begun:] == before and told != spared.objects:
                # "push the box 5 cm to the left, together with the blue one", where the box is blue.
                raise RefusedError(RefusalCode.AMBIGUOUS, f"“{spared.objects[0].text}”: that was done just before.")
            told = spared.objects
        avoid |= self._avoided(others, self.world.movable)
        self._check_forbidden()
        touched = [(step, name) for step in self.steps for name in _acted_on(step.call) if name in avoid]
        if touched:
            step, name = touched[0]
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"You asked me to keep away from {name}, and {step.call} would move or use it.",
                (name,),
            )
        if not self.steps:
            raise AlreadySoError("That is already so; there is nothing to do.")
        return Draft(tuple(self.steps), self.substitutes)

    def _check_tower(self, command: Command) -> None:
        """As in "move the tower to the tray": not its topmost block alone; "stack A and B next to the tray": where?"""
        towers = [ref for ref in command.objects if ref.nouns == ("tower",)]
        if command.verb in ("put", "pick", "push") and towers:
            raise RefusedError(
                RefusalCode.UNSUPPORTED,
                f"I cannot move “{towers[0].text}” as a whole; tell me which of its parts goes where.",
            )

        if isinstance(command.place, Relation) and any(ref.text in _SELVES for ref in command.place.refs):
            raise RefusedError(RefusalCode.IMPOSSIBLE, "Nothing goes on, in or beside itself.", firm=True)
        last = command.objects[-1] if command.verb == "stack" and command.objects[1:] and not command.place else None
        if last is None or not last.relations or last.relations[-1].kind not in (*get_args(Side), "beside"):
            return
        try:
            Grounder(self.world, Discourse()).one(replace(last, relations=last.relations[:-1]), lambda name: True)
        except RefusedError:
            # "stack the red cube and the cube left of the can": that one of the cubes.
            return
        raise RefusedError(
            RefusalCode.AMBIGUOUS, f"“{last.text}”: is the tower to stand there, or does it stand there?"
        )

    def _avoided(self, refs: Sequence[Ref], fits: Fits = lambda name: True) -> set[str]:
        avoid: set[str] = set()
        for ref in refs:
            if ref.determiner == "all" and ref.other:
                continue
            for each in ref.options or (ref,):
                # "don't touch the can or the ball" spares both.
                try:
                    avoid.update(self.ground.many(each, fits).ids)
                except RefusedError as error:
                    if error.refusal.code is not RefusalCode.AMBIGUOUS or not error.refusal.candidates:
                        raise
                    # "leave the wool alone", where two things are wool: both stay.
                    avoid.update(error.refusal.candidates)
        return avoid

    def _pick(self, command: Command) -> None:
        names, _ = self._objects(command)
        if len(names) != 1:
            raise RefusedError(
                RefusalCode.IMPOSSIBLE,
                f"The gripper holds one object at a time, and you asked for {listed(names)}; where should they go?",
                names,
            )
        if any(relation.kind == "under" and relation.order for ref in command.objects for relation in ref.relations):
            # "the blue cube from under the red one": that one has to go first.
            for above in self.world.on_top_of(names[0]):
                self._put_free(above, self.world.at[above])
        if self.world.held == names[0] and names[0] in (
            self.steps[-1].call.arguments.get("object") for _ in self.steps[-1:]
        ):
            return
        if self.world.held == names[0]:
            if self.world.is_carried(names[0]):
                raise AlreadySoError(f"The gripper holds {names[0]} already.", names)
            self._add("pick", object=names[0])
            return
        self._take(names[0])

    def _pour(self, command: Command) -> None:
        world = self.world
        seen = any(item.shape.is_granular for item in world.objects.values())

        # "the tall jug" is the taller of all jugs, and may be empty; "the jug" is the one with something in it.
        compared = any(rank.key not in ("", "full") for ref in command.objects for rank in ref.ranks)

        def fits(name: str) -> bool:
            item = world.objects[name]
            poured_from = item.kind in match.VESSELS and (not seen or compared or bool(world.inside(name)))
            return item.shape.is_granular or poured_from

        spoken = [ids[0] for ids in reversed(self.discourse.mentioned) if len(ids) == 1]
        names, _ = self._objects(command, fits=fits)
        self._not_another(command, names, spoken)
        cups_of = {world.parent.get(name) for name in names} if len(names) > 1 and command.objects[0].plural else set()
        if len(cups_of) == 1 and command.objects[0].determiner == "it":
            # "put the pens in the mug and pour them into the tray": out of the mug.
            kind, cup = cups_of.pop() or ("", "")
            names = (cup,) if kind == "in" and match.is_cup(world.objects[cup]) else names
        vessels = tuple(dict.fromkeys(self._vessel(name) for name in names))
        # "the beads", of which there are two kinds in two cups, are asked about.
        cups = all(not world.objects[name].shape.is_granular for name in names)
        several = len(command.objects) > 1 or any(
            (ref.plural and cups) or ref.determiner == "all" or ref.number for ref in command.objects
        )
        if (len(vessels) != 1 and not several) or not isinstance(command.place, Relation):
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"Which one should I pour from: {listed(vessels, 'or')}?", vessels
            )
        target = self._targets(command.place, vessels)[0]
        for vessel in vessels:
            self._pour_out(vessel, target)

    def _not_another(self, command: Command, names: Sequence[str], spoken: Iterable[str]) -> None:
        """Ask where "the cup" was just spoken of and is empty, and another cup is not."""
        ref = command.objects[0] if len(command.objects) == 1 else None
        if ref is None or len(names) != 1 or ref.determiner != "the" or ref.colours or ref.ranks or ref.relations:
            return
        cups = (name for name in spoken if name not in self.poured)
        called = [self.world.objects[name] for name in cups if self.world.objects[name].kind in match.VESSELS]
        called = match.with_names(called, ref.names) if ref.names else called
        called = match.with_noun(called, ref.nouns, several=False) if ref.nouns else called
        if (ref.nouns or ref.names) and called and called[0].id not in names and not ref.other:
            raise RefusedError(
                RefusalCode.AMBIGUOUS,
                f"“{ref.text}”: {called[0].id} was spoken of, and {names[0]} is what I could pour from; which?",
                (called[0].id, names[0]),
                about=ref.text,
            )

    def _drawers(self, command: Command, skill: str) -> tuple[str, ...]:
        names, _ = self._objects(command, fits=self._has_opening)
        for name in names:
            if (part := self._part_of(name)) is not None:
                self._need_empty(f"handle {part}")
                self._add("open" if skill == "open_drawer" else "close", part=part)
                continue
            if not self.world.objects[name].shape.opens:
                raise RefusedError(
                    RefusalCode.IMPOSSIBLE, f"{name} is no drawer; it neither opens nor closes.", (name,)
                )
            handled = [step.call.skill for step in self.steps if step.call.arguments.get("drawer") == name]
            if handled[-1:] == [skill]:
                # "... and close it; after closing it, tap the can"
                continue
            self._need_empty(f"handle {name}")
            self._add(skill, drawer=name)
        return names

    def _has_opening(self, name: str) -> bool:
        """Say whether a thing is a drawer, a door, or a cupboard with one."""
        item = self.world.objects[name]
        return item.shape.opens or is_part(item) or bool(self._parts_on(name))

    def _parts_on(self, name: str) -> list[str]:
        return [other for other, item in self.world.objects.items() if other.startswith(f"{name}.") and is_part(item)]

    def _part_of(self, name: str) -> str | None:
        """Return what of a scene's file is meant by a part or by what it is on; None for a drawer of ours and all else."""
        if is_part(self.world.objects[name]):
            return name
        parts = self._parts_on(name)
        if len(parts) > 1:
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which one of {name}: {listed(parts)}?", parts)
        return parts[0] if parts else None

    def _open(self, command: Command) -> None:
        if self._means_the_fingers(command):
            self._add("open_gripper")
            return
        self.world.opened.update(self._drawers(command, "open_drawer"))

    def _means_the_fingers(self, command: Command) -> bool:
        """As in "close the gripper, then open it"."""
        done = [step.call.skill for step in self.steps if step.call.skill not in ("wait", "set_tempo")]
        last = done[-1] if done else ""
        said = [ref.determiner for ref in command.objects] == ["it"]
        return said and last in ("open_gripper", "close_gripper") and not self.world.held

    def _close(self, command: Command) -> None:
        if self._means_the_fingers(command):
            self._add("close_gripper")
            return
        self.world.opened.difference_update(self._drawers(command, "close_drawer"))

    def _tap(self, command: Command) -> None:
        # "pour the beads into the bowl and tap it": the bowl.
        names, _ = self._objects(
            command, fits=lambda name: name != self.world.held or name not in self.poured, often=True
        )
        for name in names:
            if self.world.held in self.poured and name != self.world.held:
                self._need_empty(f"tap {name}")
            if name == self.world.held:
                raise RefusedError(RefusalCode.IMPOSSIBLE, f"{name} is in the gripper; I cannot tap it.", (name,))
            if self.world.objects[name].shape.is_granular:
                raise RefusedError(RefusalCode.IMPOSSIBLE, f"{name} are beads, which have no top to touch.", (name,))
            for _ in range(self._repeats(command)):
                if "press" in self.skills and is_part(self.world.objects[name]):
                    self._need_empty(f"press {name}")
                    self._add("press", part=name)
                else:
                    self._add("tap", object=name)

    def _nothing(self, command: Command) -> None:
        """What is not to be done is spoken of and left; a plan that does it all the same is refused."""
        # "put the can in the drawer without opening it": the drawer.
        opens = command.negated in ("open", "close")
        drawers = {name for name, item in self.world.objects.items() if not opens or item.shape.opens}
        names = self._objects(command, fits=drawers.__contains__)[0] if command.objects else ()
        if [ref.text for ref in command.objects] == ["anything"]:
            # "don't open anything": no drawer either, although it is none of the things on the table.
            names = ()
        targets: tuple[str, ...] = ()
        if isinstance(command.place, Relation) and command.place.refs:
            targets = self.ground.many(command.place.refs[0], lambda name: True, names).ids
        self.forbidden.append((command, names, targets))

    def _check_forbidden(self) -> None:
        held = self.start_held
        for step in self.steps:
            call, arguments = step.call, step.call.arguments
            thing = str(arguments.get("object", arguments.get("drawer", held)))
            held = thing if call.skill == "pick" else None if call.skill.startswith("place_") else held
            for command, names, targets in self.forbidden:
                skills = _SKILLS_OF.get(command.negated, frozenset({command.negated}))
                target = arguments.get("target", arguments.get("container"))
                elsewhere = bool(targets) and target is not None and target not in targets
                other_way = command.direction is not None and arguments.get("direction") not in (
                    None,
                    command.direction,
                )
                if call.skill in skills and (not names or thing in names) and not elsewhere and not other_way:
                    raise RefusedError(RefusalCode.IMPOSSIBLE, f"You asked me not to, and {call} would do it.", names)

    def _worded(self, command: Command) -> None:
        self._check_skill(command.skill)
        words = command.words or words_of(command.skill, with_object=bool(command.objects))
        things = {slot.argument for slot in words.slots if slot.kind == "object"}
        for argument, value in command.slots:
            if argument in things and isinstance(value, tuple) and not isinstance(value, Ref):
                # "hover over the red, the green and the blue cube"
                kept = tuple(slot for slot in command.slots if slot[0] != argument)
                for ref in with_nouns(value):
                    self._worded(replace(command, slots=((argument, ref), *kept)))
                return
        if len(points := points_of(words, command.slots)) > 1:
            # "go to (a), (b) and (c)"
            for kept in points:
                self._worded(replace(command, slots=kept))
            return
        hand_alone = self.steps and self.steps[-1].call.skill in UNTOUCHED and not self.world.held
        if command.skill == "wait" and hand_alone and [ref.determiner for ref in command.objects] == ["it"]:
            # "tilt your hand and hold it for two seconds"
            self._add("wait", **resolved(words, command.slots, str))
            return
        names: tuple[str, ...] = ()
        if words.object:
            names, _ = (
                self._objects(command, fits=self._has_opening) if words.object == "part" else self._objects(command)
            )
        several = [
            (n, ref) for n, ref in command.slots if isinstance(ref, Ref) and (ref.plural or ref.determiner == "all")
        ]

        def meant(ref: Ref) -> str:
            found = self.ground.many if any(ref is each for _, each in several) else self.ground.one
            return found(ref, lambda other: True, names).ids[0]

        others = resolved(words, command.slots, meant)
        for slot in words.slots:
            if slot.kind == "pose" and slot.argument in others:
                others[slot.argument] = self._pose_called(str(others[slot.argument]))
        if command.skill == "move_to_pose":
            self._go_to_pose(str(others["pose"]))
            return
        if not words.object and several:
            # "hover over each cube"
            (argument, ref), *_ = several
            for each in self.ground.many(ref, lambda other: True, names).ids:
                self._add(command.skill, **{**others, argument: each})
        elif not words.object:
            tool = {"held": self._tool(command.skill)} if words.hand == "holding" else {}
            self._add(command.skill, **{**tool, **others})
        for name in names:
            self._worded_with(command.skill, words, name, others)

    def _worded_with(self, skill: str, words: Words, name: str, others: Mapping[str, Any]) -> None:
        """Add the call of a skill with one thing, or with a part, and what has to be done before and after it."""
        took = words.hand == "holding" and self.world.held != name
        if "held" in others:
            # "Stir the bowl with the spoon": what is done is done with that.
            self._take(others["held"])
        elif words.hand == "holding":
            self._take(name)
            self.taken_for_this.update({name} if took else ())
        elif words.hand == "any" and words.holds:
            # "grab the cube, lift it 12 cm": it is lifted by so much from where it stands.
            self._leave_standing(name)
        elif words.hand == "empty":
            self._leave_standing(name)
            if self.world.held == name and words.in_hand in self.skills and _takes(words.in_hand, others):
                self._add(words.in_hand, **others)
                return
            self._need_empty(f"{skill.replace('_', ' ')} {name}")
        if words.object == "part":
            self._add(skill, **{words.object: self._part_of(name) or name, **others})
            return
        if words.hand == "empty":
            self._note_moved(name)
        self._add(skill, **{words.object: name, **others})
        if words.returns and took and "place_at" in self.skills:
            x, y = self.discourse.origins[name][0]
            self._add("place_at", x=round(x, 4), y=round(y, 4))
            self.world.put(name, (x, y))
        if words.holds and self.world.held is None:
            self._note_moved(name)
            self.world.take(name)

    def _tool(self, skill: str) -> str:
        """Return what is held, as in "wipe the table".

        Raises:
            RefusedError: Nothing is.
        """
        if self.world.held is None:
            raise RefusedError(
                RefusalCode.AMBIGUOUS, f"I hold nothing to {skill.replace('_', ' ')} with: say with what."
            )
        return self.world.held

    def _pose_called(self, name: str) -> str:
        """Return the pose of a name: "dock" may be said as "the dock position".

        Raises:
            RefusedError: Nobody has saved one that is called so, nor will have by then.
        """
        known = sorted({*self.world.poses, *self._poses_saved(), "home"})
        longer = [pose for pose in known if pose.startswith(f"{name}_") and pose[len(name) + 1 :].isalpha()]
        bare, _, kind = name.rpartition("_")
        found = next((pose for pose in (name, *([bare] if kind.isalpha() else []), *longer) if pose in known), None)
        if found is None:
            told = f"I know no pose called “{name.replace('_', ' ')}”; I know {listed(known)}."
            raise RefusedError(RefusalCode.OBJECT_NOT_FOUND, told, known)
        return found

    def _poses_saved(self) -> list[str]:
        return [str(step.call.arguments["pose"]) for step in self.steps if step.call.skill == "save_pose"]

    def _go_to_pose(self, pose: str) -> None:
        if pose == "home":
            self._add("home")
            return
        if pose == _START and pose not in self._poses_saved():
            # Where the arm stood when this order began, or before the last one.
            if self.steps:
                self.steps.insert(0, Step(SkillCall(skill="save_pose", arguments={"pose": pose})))
            else:
                pose = BEFORE
        self._add("move_to_pose", pose=pose)

    def _hand_to(self, command: Command) -> None:
        """As in "move your hand over the far left corner of the table": straight above where things would be put there."""
        if not isinstance(command.place, Region):
            raise ValueError(f"{command.place} is no part of the table")
        x, y = self._middle_of(command.place, self.world.placed(_BEFORE_IT))
        z = max((top(item) for item in self.world.objects.values()), default=self.world.table_height) + _ABOVE
        self._add("move_to", x=round(x, 4), y=round(y, 4), z=round(z, 4))

    def _go_back_along(self, way: str) -> None:
        """As in "go up 5 cm, wait 4 seconds, and come back down": by as much as the hand went the other way."""
        axis, sign = {"up": ("dz", 1), "down": ("dz", -1), "left": ("dy", 1), "right": ("dy", -1)}[way]
        moves = [step.call for step in self.steps if step.call.skill in ONE_MOTION]
        gone = sum(float(call.arguments.get(axis, 0.0)) for call in moves)
        if gone * sign >= 0.0 or any(call.skill != "move_by" for call in moves):
            raise RefusedError(RefusalCode.UNRECOGNIZED, f"Back {way} to where?", ())
        if all({*call.arguments} <= {axis, "until_force"} for call in moves):
            self._go_to_pose(_START)
        elif any("until_force" in call.arguments for call in moves):
            raise RefusedError(RefusalCode.UNRECOGNIZED, f"Back {way} by how much?", ())
        else:
            back: dict[str, Any] = {axis: round(-gone, 4)}
            self._add("move_by", **back)

    def _home(self, command: Command) -> None:
        if command.direction in ("up", "down", "left", "right"):
            self._go_back_along(command.direction)
            return
        if (
            command.direction in ("back", "return")
            and self.steps
            and all(step.call.skill in _BY_ITSELF for step in self.steps)
        ):
            # "move left 10 cm, then come back": to where it was.
            self._go_to_pose(_START)
            return
        if command.direction == "return":
            raise RefusedError(RefusalCode.UNRECOGNIZED, "Back to where?", ())
        if not self.steps or self.steps[-1].call.skill != "home":
            self._add("home")


def _each_spared(command: Command) -> Command:
    """As in "don't pick up the can or the ball": neither."""
    if command.verb != "nothing":
        return command
    objects = tuple(each for ref in command.objects for each in ref.options or (ref,))
    place = command.place
    if isinstance(place, Relation) and any(ref.options for ref in place.refs):
        raise RefusedError(RefusalCode.UNSUPPORTED, "Tell me where it may go, rather than where not.")
    return replace(command, objects=objects)


# What an act takes beside its things; what else is said of it would be dropped from the plan.
_SLOTS: dict[str, frozenset[str]] = {
    "put": frozenset({"place", "tower", "order", "distance"}),
    "stack": frozenset({"place", "tower", "order"}),
    "push": frozenset({"place", "direction", "distance", "times", "order"}),
    "pour": frozenset({"place", "order"}),
    "tap": frozenset({"times", "order"}),
    "sort": frozenset({"place"}),
    "swap": frozenset(),
    "line_up": frozenset(),
    "home": frozenset({"direction"}),
}
_TOLD = {
    "place": "a place",
    "tower": "what stands below",
    "order": "an order",
    "direction": "a way",
    "distance": "a distance",
    "times": "how often",
}


def _takes(skill: str, arguments: Mapping[str, Any]) -> bool:
    """Tell whether a skill's words fill each of some arguments."""
    return {*arguments} <= {slot.argument for words in ways_of(skill) for slot in words.slots}


def _check_slots(command: Command) -> None:
    """Refuse what the plan would take no account of, as in "line up the cubes, the red one first"."""
    takes = _SLOTS.get(command.verb)
    if takes is None:
        return
    told = {name for name in _TOLD if (command.times != 1 if name == "times" else getattr(command, name))}
    if any(rank.nth == 0 for ref in command.objects for rank in ref.ranks) and command.verb != "stack":
        # "from left to right"
        told.add("order")
    over = [_TOLD[name] for name in _TOLD if name in told - takes]
    if over:
        act = command.verb.replace("_", " ")
        raise RefusedError(
            RefusalCode.UNSUPPORTED, f"To {act} takes no account of {listed(over)}; say it without that."
        )


def _acted_on(call: SkillCall) -> tuple[str, ...]:
    return tuple(value for key, value in call.arguments.items() if key in ("object", "target", "container", "drawer"))


def _parties(command: Command) -> tuple[Ref, ...]:
    """Return the noun phrases of a command."""
    return (
        *command.objects,
        *command.tower,
        *(command.place.refs if isinstance(command.place, Relation | Spot) else ()),
    )
