"""Form of a question, and the things that its descriptions mean."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

from robosandbox.agent.language.discourse import Discourse, RefusedError, cannot_see, listed
from robosandbox.agent.language.grammar import Grammar
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Ref, replace, unseen
from robosandbox.agent.language.match import NOUN_CLASS, SHAPE_KINDS, THING_KINDS
from robosandbox.agent.language.question_forms import FORMS_BY_WORD, OPENING, Alternatives, Form
from robosandbox.agent.language.tokens import SceneWords, Token, scene_words
from robosandbox.agent.language.world import World
from robosandbox.types import DetectedObject, ObservedScene, RefusalCode
from robosandbox.world.predicate import View

_THINGS = frozenset({"thing", "object", "item", "piece", "stuff", "thingy"})

Span = tuple[int, int]
Found = tuple[tuple[str, ...], str]


def words_of(scene: ObservedScene) -> SceneWords:
    """Return the words that a scene's ids bring."""
    return scene_words(tuple(item.id for item in scene.objects))


def no_container(item: DetectedObject) -> RefusedError:
    """Return the refusal of a question for what is in a thing that holds nothing."""
    told = f"{item.id} is {item.shape.name}, which is no container; I see it from outside."
    return RefusedError(RefusalCode.UNSUPPORTED, told, (item.id,))


class Asked:
    """One question in one scene: the form that it has, and what its descriptions mean.

    Args:
        tokens: The question, without marks.
        scene: What perception sees.
        discourse: What was spoken of before.
    """

    def __init__(
        self,
        tokens: tuple[Token, ...],
        scene: ObservedScene,
        discourse: Discourse,
    ) -> None:
        self.tokens = tokens
        self.scene = scene
        self.view: View = View.of(scene)
        self.discourse = discourse

    @cached_property
    def _grammar(self) -> Grammar:
        return Grammar(self.tokens, words_of(self.scene))

    def forms(self) -> Iterator[tuple[int, Form]]:
        """Yield the forms that the question may have, each with the number of its first word."""
        starts = [0]
        for part in OPENING:
            starts += [start + len(words) for start in starts for words in part.words if self._follows(start, words)]
        for start in dict.fromkeys(starts):
            if start < len(self.tokens):
                yield from ((start, form) for form in FORMS_BY_WORD.get(self.tokens[start].text, ()))

    def matches(self, parts: Sequence[Alternatives], start: int) -> Iterator[tuple[Span, ...]]:
        """Yield the spans of words that fill a form's slots, where the whole question has that form."""
        if not parts:
            if start == len(self.tokens):
                yield ()
            return
        part, rest = parts[0], parts[1:]
        if part.is_rest and start < len(self.tokens):
            yield ((start, len(self.tokens)),)
        for end in self.ends(start) if part.is_slot else ():
            yield from (((start, end), *more) for more in self.matches(rest, end))
        for words in part.words:
            end = start + len(words)
            if self._follows(start, words):
                yield from self.matches(rest, end)
        if part.may_be_left_out:
            yield from self.matches(rest, start)

    def _follows(self, start: int, words: Sequence[str]) -> bool:
        return [token.text for token in self.tokens[start : start + len(words)]] == [*words]

    def ends(self, start: int) -> list[int]:
        """Return where descriptions that begin here may end, the longest first."""
        if start >= len(self.tokens):
            return []
        return sorted({end for end, _ in self._described(start)}, reverse=True)

    def _described(self, start: int) -> Iterator[tuple[int, tuple[Ref, ...]]]:
        yield from self._grammar.np_list(start)
        for end, ref in self._grammar.adjectives(start):
            # "right" alone may mean correct.
            if ref.shapes or ref.claims or ref.felt or (ref.ranks and end > start + 1):
                yield end, (ref,)

    def _refs(self, span: Span) -> list[Ref]:
        """Return what a description says.

        Raises:
            RefusedError: It has a word that names nothing which can be perceived.
        """
        start, end = span
        found = [refs for stop, refs in self._described(start) if stop == end]
        plainest = min(found, key=lambda refs: len(unseen(refs)))
        # Anything may be called a toy, and nothing is seen to be one.
        nouns = {noun for ref in plainest for noun in ref.nouns if NOUN_CLASS.get(noun) == "thing"}
        words = (*unseen(plainest), *sorted(nouns - _THINGS))
        if words:
            raise cannot_see(words)
        return [*plainest]

    def meant(self, span: Span) -> Found:
        """Return the ids that a description means, and its words.

        Raises:
            RefusedError: Nothing fits, or several things where one is meant.
        """
        grounder = Grounder(World(self.scene), self.discourse)
        ids = [name for ref in self._refs(span) for name in grounder.many(ref, lambda name: True).ids]
        return tuple(dict.fromkeys(ids)), self._grammar.said(*span)

    def fitting(self, span: Span) -> Found:
        """Return all that a description is true of; nothing where it is true of nothing that is seen."""
        grounder = Grounder(World(self.scene), Discourse())
        refs = [one for ref in self._refs(span) for one in ref.options or (ref,)]
        for relation in (relation for ref in refs for relation in ref.relations):
            for name in (name for ref in relation.refs for name in grounder.many(ref, lambda name: True).ids):
                if relation.kind == "in" and not self.view.get(name).shape.holds_things:
                    raise no_container(self.view.get(name))
        ids = [name for ref in refs for name in self._things(ref) or grounder.fitting(ref)]
        return tuple(dict.fromkeys(ids)), self._grammar.said(*span)

    def such(self, span: Span) -> Found:
        """Return all that a description is true of, where it tells a kind of thing that shape or name shows.

        Raises:
            RefusedError: It tells another kind.
        """
        ids, said = self.fitting(span)
        nouns = [noun for ref in self._refs(span) for one in ref.options or (ref,) for noun in one.nouns]
        strange = [noun for noun in nouns if NOUN_CLASS.get(noun, noun) not in {"thing", *SHAPE_KINDS, *THING_KINDS}]
        if strange and not ids:
            raise cannot_see(strange)
        return ids, said

    def _things(self, ref: Ref) -> list[str]:
        """Return all that "things" are, of a colour where one is said: who asks means bins too, who orders does not."""
        plain = replace(ref, text="", determiner="the", nouns=(), colours=(), plural=False, one=False) == Ref(text="")
        if not plain or not {*ref.nouns} <= _THINGS:
            return []
        return [item.id for item in self.scene.objects if not ref.colours or item.colour in ref.colours]

    def one(self, span: Span) -> DetectedObject:
        """Return the one thing that a description means.

        Raises:
            RefusedError: Nothing fits, or several things.
        """
        ids, said = self.meant(span)
        if len(ids) != 1 or any(ref.determiner == "a" or ref.options for ref in self._refs(span)):
            raise RefusedError(RefusalCode.AMBIGUOUS, f"Which one do you mean by “{said}”: {listed(ids)}?", ids)
        return self.view.get(ids[0])
