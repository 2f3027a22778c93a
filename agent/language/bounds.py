"""Bounds of a sentence, things that it forbids to touch or allows alone, as far as the grammar is sure of them.

The sentence need not be understood as a whole. What english_bounds.rules reads is found wherever a clause may begin and end, and
resolved on the scene as the prohibitions of a sentence that is understood.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from robosandbox.agent.language.binding import with_nouns
from robosandbox.agent.language.front import ENGLISH
from robosandbox.agent.language.intent import Ref, Sentence, unseen
from robosandbox.agent.language.interpret import choose
from robosandbox.agent.language.parser import Parser, TooComplicatedError
from robosandbox.agent.language.ruleset import ruleset
from robosandbox.agent.language.scene_words import scene_words
from robosandbox.agent.language.text import ENDS, TooLongError, classes_of, said
from robosandbox.agent.language.wordlist import word_set
from robosandbox.types import ObservedScene, Refusal, RefusalCode
from robosandbox.values import frozen

_JOINTS = word_set("and but while so because since as when then for or either only you")
"""Words between marks at which a clause may begin or end."""
_BEGIN = word_set("without avoiding leaving touching moving using with")
"""Words with which a clause may begin where nothing sets it apart."""
_CONDITIONS = word_set("if unless until till once whenever when after before in whether")
"""Words with which a clause begins that tells in what case, or till when, what is said beside it holds."""
_CASES = word_set("if unless whether until till in")
_REFERRING_BACK = word_set("unless until till except only yet instead")
_DENYING = word_set("not never nothing nobody no neither without")
_TAKEN_BACK = word_set("wait actually sorry joking kidding nonsense anyway nevertheless oops scratch thought")
"""Words by which a prohibition before them may be taken back."""
_ASKING = word_set("can could will would please")
_SENTENCE_ENDS = frozenset(".;:!?")
_POINTING = word_set("it they them that those these one ones he she him her")
_LISTING = word_set("and or nor both")
_MAY_BIND = word_set(
    "not never no nothing nobody none neither without leave leaving keep spare avoid avoiding alone hands stay stays remain remains off"
    " but except besides apart aside other stop refrain steer only let forbid forbidden bounds taboo"
)
"""Words of which everything that binds has one."""
# What binds, by the rule that reads it.
_BINDING = ("forbidding", "leaving", "allowing")


@frozen(kw_only=True)
class Bounds:
    """What is certain of a sentence.

    Attributes:
        never: Ids of what must not be touched.
        only: Ids of what alone may be moved; None allows everything.
    """

    never: frozenset[str] = frozenset()
    only: frozenset[str] | None = None


def bounds_of(prompt: str, scene: ObservedScene, skills: Iterable[str]) -> Bounds:
    """Return what a sentence forbids to touch, and what it allows alone.

    Args:
        prompt: What was said.
        scene: What perception sees.
        skills: Names of the skills at hand.
    """
    ids = tuple(item.id for item in scene.objects)
    words, book = scene_words(ids), ruleset(ENGLISH)
    for mend in (False, True):
        try:
            told = said(prompt, words, book, mend=mend)
            texts = [token.text for token in told.tokens]
            if _MAY_BIND.isdisjoint(texts):
                continue
            parser = Parser(told.tokens, book, classes_of(told.tokens, words, book))
            found = _Reader(parser, scene, tuple(skills)).bounds(manners=bool(told.manners))
        except (TooLongError, TooComplicatedError):
            return Bounds()
        if found != Bounds():
            return found
    return Bounds()


def is_corrected(prompt: str, scene: ObservedScene) -> bool:
    """Say whether a sentence may take back a part of itself: "put the red cube in the bowl, I mean the blue one"."""
    words, book = scene_words(tuple(item.id for item in scene.objects)), ruleset(ENGLISH)
    try:
        told = said(prompt, words, book)
        parser = Parser(told.tokens, book, classes_of(told.tokens, words, book))
        return any(parser.rule(name, i) for name in ("corr", "retold") for i in range(len(told.tokens)))
    except (TooLongError, TooComplicatedError):
        return True


class _Reader:
    """Finds what binds in the chart of a sentence."""

    def __init__(self, parser: Parser, scene: ObservedScene, skills: Sequence[str]) -> None:
        self._texts = [token.text for token in parser.tokens]
        self._parser = parser
        self._scene = scene
        self._skills = skills
        self._ids = {item.id for item in scene.objects}

    def bounds(self, *, manners: bool) -> Bounds:
        """Return what binds, prohibition by prohibition; "only gently" tells how, and allows nothing alone."""
        never, only = set[str](), set[str]()
        i = 0
        while i < len(self._texts):
            end, refs, alone = self._node(i)
            if refs and not (alone and manners) and self._is_certain(i, end):
                found = self._resolved(refs, i)
                (only if alone else never).update(found)
                # What is allowed alone is said once.
                i = max(end, i + 1) if found else i + 1
            else:
                i += 1
        return Bounds(never=frozenset(never - only), only=frozenset(only) or None)

    def _node(self, i: int) -> tuple[int, tuple[Ref, ...], bool]:
        """Return where what binds ends that begins at a token, the things, and whether they are what is allowed."""
        texts = self._texts
        if i == 0 or self._parser.tokens[i - 1].kind == "mark" or texts[i - 1] in _JOINTS or texts[i] in _BEGIN:
            nodes = [
                (reading.end, with_nouns(reading.fields[0].value), name)
                for name in _BINDING
                for reading in self._parser.rule(name, i)
                if self._ends(name, i, reading.end, reading.fields[0].value)
            ]
            if nodes:
                end, refs, name = max(nodes, key=lambda node: (node[0], len(self._resolved(node[1], i))))
                if _is_anything(refs[0]) and refs[0].without:
                    # "anything but the cube and the ball" allows both.
                    return end, (*refs[0].without, *refs[1:]), True
                return end, refs, name == "allowing"
        excepted = [
            (end, ref.without)
            for end, refs in self._things(i)
            for ref in refs[-1:]
            if (ref.determiner == "all" or _is_anything(ref)) and ref.without
        ]
        excepted += [(reading.end, reading.fields[0].value) for reading in self._parser.rule("all_but", i)]
        if excepted and _DENYING.isdisjoint(texts[self._clause(i)[0] : self._clause(i)[1]]):
            end, refs = max(excepted, key=lambda node: (bool(self._resolved(node[1], i)), node[0]))
            if not self._named_again(refs, i, end):
                return end, refs, False
        return i, (), False

    def _ends(self, name: str, start: int, end: int, refs: Sequence[Ref]) -> bool:
        """Say whether a clause may end where what binds does."""
        texts = self._texts
        if unseen(refs) or not refs:
            return False
        if len(refs) > 1 and _LISTING.isdisjoint(texts[start:end]):
            # "avoid the olive, the fig"
            return False
        if name == "leaving" and any(ref.relations for ref in refs):
            # "leave the box to the right of the brush" may say where it is to be.
            return False
        if end >= len(texts) or self._parser.tokens[end].kind == "mark":
            return True
        # "keep the ball and the cup together", "leave the ball for last"
        elsewhere = name == "leaving" and (texts[end] == "for" or self._names(end + 1))
        return texts[end] in _JOINTS and texts[end] not in ("or", "only") and not elsewhere

    def _things(self, i: int) -> list[tuple[int, tuple[Ref, ...]]]:
        """Return where descriptions end that begin at a token, and what they are."""
        read = self._parser.rule("things", i) if i < len(self._texts) else ()
        return [(reading.end, reading.fields[0].value) for reading in read]

    def _names(self, i: int) -> bool:
        """Say whether a thing is named at a token."""
        return any(not ref.unknown for _, refs in self._things(i) for ref in refs)

    def _clause(self, i: int) -> tuple[int, int]:
        """Return where the clause around a token begins and ends."""
        texts = self._texts
        start = next((k for k in range(i, 0, -1) if texts[k - 1] in ENDS or texts[k - 1] in ("and", "then")), 0)
        end = next((k for k in range(i, len(texts)) if texts[k] in ENDS or texts[k] in ("and", "then")), len(texts))
        return start, end

    def _is_certain(self, start: int, end: int) -> bool:
        """Say whether nothing beside a prohibition tells that it holds in a case only, or takes it back."""
        texts = self._texts
        first = next((k + 1 for k in range(start - 1, -1, -1) if texts[k] in _SENTENCE_ENDS), 0)
        last = next((k for k in range(end, len(texts)) if texts[k] in _SENTENCE_ENDS), len(texts))
        begins = [k for k in range(first, last) if k == first or texts[k - 1] in ENDS or texts[k - 1] in _JOINTS]
        cases = [texts[k] for k in (*begins, end) if self._is_condition(k)]
        # "after that ..., never touch it"
        if [word for word in cases if texts[start] != "never" or word in _CASES]:
            return False
        if texts[last : last + 1] == ["?"] and texts[first] not in _ASKING:
            return False
        after = texts[end:]
        taken_back = not _TAKEN_BACK.isdisjoint(after) or any(
            after[k] == "no" and (k + 1 == len(after) or after[k + 1] in ENDS) for k in range(len(after))
        )
        return not taken_back and texts[last + 1 : last + 2] not in [[word] for word in _REFERRING_BACK]

    def _is_condition(self, k: int) -> bool:
        """Say whether a clause that begins at a token tells in what case what is beside it holds."""
        texts = self._texts
        if k >= len(texts) or texts[k] not in _CONDITIONS | {"while"}:
            return False
        if texts[k] == "in":
            return texts[k + 1 : k + 2] == ["case"]
        if texts[k] in ("when", "while"):
            # "when you do it": in any case.
            return texts[k + 1 : k + 2] not in (["you"], ["nobody"], ["i"]) and not texts[k + 1 : k + 2][0].endswith(
                "ing"
            )
        return True

    def _named_again(self, refs: Sequence[Ref], start: int, end: int) -> bool:
        """Say whether what is excepted in one place may be spoken of in another."""
        texts = self._texts
        if any(ref.relations or ref.ranks for ref in refs) or not _POINTING.isdisjoint(texts[end:]):
            return True
        others = self._named(0, start)[0] | self._named(end, len(texts))[0]
        return not others.isdisjoint(self._resolved(refs, start))

    def _resolved(self, refs: Sequence[Ref], i: int) -> frozenset[str]:
        """Return the ids of what descriptions mean; nothing where that is not certain."""
        if len(refs) == 1 and refs[0].determiner == "it" and not refs[0].plural:
            # What is named before it, where that is one thing.
            named, _ = self._named(0, i)
            return named if len(named) == 1 else frozenset()
        if any(_points(ref) for ref in refs):
            return frozenset()
        if any(ref.other for ref in refs):
            named, all_known = self._named(0, i)
            kinds = self._resolved([ref._replace(other=False) for ref in refs], i)
            return kinds - named if named and all_known else frozenset()
        answer = choose(((0.0, Sentence((), tuple(refs))),), self._scene, self._skills)
        if not isinstance(answer, Refusal) or answer.code is not RefusalCode.UNSUPPORTED or not answer.sure:
            return frozenset()
        found = frozenset(answer.candidates)
        # "the red one", of several that are red: which is meant nobody can tell.
        single = [ref for ref in refs if not (ref.plural or ref.determiner == "all" or ref.options)]
        clear = len(single) < len(refs) or len(found) <= len(refs)
        return found if found <= self._ids and clear else frozenset()

    def _named(self, start: int, end: int) -> tuple[frozenset[str], bool]:
        """Return the ids of all that is named between two tokens, and whether all that is named there is known."""
        named, all_known, k = set[str](), True, start
        while k < end:
            nodes = [node for node in self._things(k) if not any(ref.unknown for ref in node[1])]
            nodes.sort(key=lambda node: -node[0])
            found = next(((stop, ids) for stop, refs in nodes for ids in [self._resolved(refs, k)] if ids), None)
            all_known = all_known and (found is not None or not nodes)
            named.update(found[1] if found else ())
            k = found[0] if found else k + 1
        return frozenset(named), all_known


def _points(ref: Ref) -> bool:
    """Say whether a description means what was spoken of before, or stands beside such a thing."""
    return ref.determiner == "it" or any(_points(other) for relation in ref.relations for other in relation.refs)


def _is_anything(ref: Ref) -> bool:
    """Say whether a description leaves nothing out but what it says that it does."""
    narrows = ref.colours or ref.shades or ref.ranks or ref.relations or ref.names or ref.shapes or ref.measures
    return ref.determiner in ("all", "bare", "a") and ref.nouns in ((), ("thing",)) and not narrows
