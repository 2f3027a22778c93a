"""Questions as conditions and descriptions: "are both bins empty?", "which cube is in the middle?", "what is between them?"."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import deepcopy

from robosandbox.agent.language.asked import words_of
from robosandbox.agent.language.deciding import judged
from robosandbox.agent.language.describing import description, whereabouts
from robosandbox.agent.language.discourse import Discourse, RefusedError, cannot_see, listed
from robosandbox.agent.language.grammar import Grammar
from robosandbox.agent.language.ground import Grounder
from robosandbox.agent.language.intent import Ref, replace, unseen
from robosandbox.agent.language.logic import Condition, Is, More, There, stripped
from robosandbox.agent.language.tokens import Token
from robosandbox.agent.language.world import World
from robosandbox.types import ObservedScene, RefusalCode

Reply = tuple[str, tuple[str, ...]]
_BE = frozenset({"is", "are"})
_BEING = _BE | {"stands", "stand", "lies", "lie", "sits", "sit"}
_WHICH = frozenset({"which", "what"})


def replied(tokens: Sequence[Token], scene: ObservedScene, discourse: Discourse) -> Reply | None:
    """Return the answer to a question whether something is so, or which things are so, and the ids it speaks of.

    Args:
        tokens: The question, without marks.
        scene: What perception sees.
        discourse: What was spoken of before.

    Returns:
        None for any other question, and for what is not there or may be several things.

    Raises:
        RefusedError: It asks for what cannot be seen.
    """
    ground = Grounder(World(scene), deepcopy(discourse))
    for answer in (_whether, _which, _related):
        try:
            reply = answer(tokens, scene, ground)
        except RefusedError as error:
            if error.refusal.code is RefusalCode.UNSUPPORTED:
                raise
            reply = None
        if reply is not None:
            return reply
    return None


def _said(words: Sequence[str]) -> tuple[Token, ...]:
    return tuple(Token(word, word, "word") for word in words)


def _grammar(tokens: Sequence[Token], scene: ObservedScene) -> Grammar:
    return Grammar(tuple(tokens), words_of(scene))


def _statements(tokens: Sequence[Token]) -> Iterator[tuple[Token, ...]]:
    """Yield what a question asks the truth of: "the bin is empty" for "is the bin empty"."""
    if tokens[0].text in _BE:
        be, rest = tokens[0], tokens[1:]
        yield from ((*rest[:k], be, *rest[k:]) for k in range(1, len(rest) + 1))
    elif [token.text for token in tokens[:2]] in (["do", "you"], ["can", "you"]):
        yield (tokens[1], *tokens[2:])
    elif tokens[0].text == "does":
        yield tuple(tokens[1:])


def _whether(tokens: Sequence[Token], scene: ObservedScene, ground: Grounder) -> Reply | None:
    for statement in _statements(tokens):
        for end, condition in _grammar(statement, scene).condition(0):
            if end == len(statement):
                if unseen(condition):
                    raise cannot_see(unseen(condition))
                found = judged(condition, ground)
                told, denied = stripped(condition)
                return f"{'Yes' if found else 'No'}: {_evidence(told, scene, ground, found != denied)}", ()
    return None


def _evidence(condition: Condition, scene: ObservedScene, ground: Grounder, holds: bool) -> str:
    """Return what is seen that a condition is about."""
    if isinstance(condition, Is):
        names = ground.many(condition.subject, lambda name: True).ids
        if [relation.kind for relation in condition.so.relations] == ["empty"]:
            held = {name: ground.world.inside(name) for name in names}
            told = [f"{listed(inside)} {'is' if len(inside) < 2 else 'are'} in {name}" for name, inside in held.items()]
            return f"{'; '.join(told)}."
        about = description if condition.so.ranks or condition.so.nouns or condition.so.colours else whereabouts
        items = [item for name in names if (item := scene.find(name)) is not None]
        return " ".join(about(scene, item) for item in items)
    refs: tuple[Ref, ...] = (condition.what,) if isinstance(condition, There) else ()
    refs = (condition.one, condition.other) if isinstance(condition, More) else refs
    found = [[*_such(ref, ground)] for ref in refs]
    if any(found):
        return f"I see {', and '.join(listed(names) for names in found)}."
    return "I see none." if refs else f"“{condition.text}” is {'' if holds else 'not '}so."


def _such(ref: Ref, ground: Grounder) -> Iterator[str]:
    """Yield what a description is true of, in the relations that it tells."""
    anything = ref.nouns == ("thing",) and not ref.colours
    for name in ground.world.objects if anything else ground.fitting(replace(ref, relations=())):
        if all(ground.stands(name, relation, ref) for relation in ref.relations):
            yield name


def _which(tokens: Sequence[Token], scene: ObservedScene, ground: Grounder) -> Reply | None:
    """As in "which cube is in the middle", "which of the cubes is closest to the bin"."""
    words = [token.text for token in tokens]
    if words[0] not in _WHICH or _BEING.isdisjoint(words[2:]):
        return None
    k = next(k for k in range(2, len(words)) if words[k] in _BEING)
    begin = 2 if words[1] == "of" else 1
    noun = [token for token in tokens[begin:k] if token.text not in ("the", "these", "those")]
    one = [*noun[:-1], Token(noun[-1].text.removesuffix("s"), noun[-1].raw, "word")] if noun else []
    rest = [*tokens[k + 1 + (words[k + 1 : k + 2] == ["the"]) :]]
    several = words[k] in ("are", "stand", "lie", "sit")
    orders = (
        ((*one, *tokens[k + 1 :]), (*one, *rest), (*rest[:1], *one, *rest[1:])) if not several else ((*noun, *rest),)
    )
    for order in orders if one and rest else ():
        described = (*_said(["the"]), *order)
        for end, ref in _grammar(described, scene).np(0):
            if end == len(described) and unseen(ref):
                raise cannot_see(unseen(ref))
            if end == len(described) and not ref.options:
                return _described(ref, scene, ground)
    return None


def _described(ref: Ref, scene: ObservedScene, ground: Grounder) -> Reply:
    names = ground.many(ref, lambda name: True).ids
    items = [item for name in names if (item := scene.find(name)) is not None]
    return " ".join(description(scene, item) for item in items), names


def _related(tokens: Sequence[Token], scene: ObservedScene, ground: Grounder) -> Reply | None:
    """As in "what is between the can and the cube": all that stands in a relation."""
    words = [token.text for token in tokens]
    if len(words) < 3 or words[0] != "what" or words[1] not in _BE:
        return None
    place = tokens[2:]
    for end, relation in _grammar(place, scene).relation(0):
        if end == len(place) and relation.refs:
            if unseen(relation):
                raise cannot_see(unseen(relation))
            said = " ".join(token.text for token in place)
            thing = Ref(text=said, determiner="all", nouns=("thing",), plural=True)
            names = [item.id for item in scene.objects if ground.stands(item.id, relation, thing)]
            be = "is" if len(names) == 1 else "are"
            return (f"{listed(names)} {be} {said}." if names else f"Nothing is {said}."), tuple(names)
    return None
