"""Bounds of a sentence, things that it forbids to touch or allows alone, as far as the grammar is sure of them.

The sentence need not be understood as a whole. Prohibitions are found as nodes of its chart wherever a clause may begin and end, and
resolved on the scene as those of a sentence that is understood. Ways of forbidding that the grammar does not have are templates.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from robosandbox.agent.language.chart import TooComplicatedError
from robosandbox.agent.language.intent import Command, Ref, Sentence
from robosandbox.agent.language.interpret import choose, tokenized
from robosandbox.agent.language.readings import Part
from robosandbox.agent.language.slots import Said
from robosandbox.agent.language.template import Constructions
from robosandbox.agent.language.tokens import MARKS, TooLongError
from robosandbox.agent.language.wordlist import word_set
from robosandbox.types import ObservedScene, Refusal, RefusalCode

_PARTS = {
    "shall": "(is|are|may|can|must|should|shall|will|has to|have to|needs to|need to)",
    "touched": "(touched|moved|disturbed|handled|used|shifted|bumped|hit|knocked over|messed with)",
    "touch": "(touch|move|use|handle|disturb)",
    "nothing": "(nothing!|no! other (thing|object)|no! (thing|object))",
    "but": "(but|except! [for]|other than|besides|apart from|than|save)",
    "ever": "[,|you dare [to]|ever]",
    "opening": "[please|and|but|so|also]",
}
FORBIDDING = Constructions(
    {
        "<edge> <opening> {thing} (is|are) (off limits|taboo|[out of] bounds|not for you)": "do not touch {thing}",
        "<edge> <opening> {thing} <shall> (not|never!) (be|to be|get) <touched>": "do not touch {thing}",
        "<edge> <opening> {thing} (may|must|should|shall) not move": "do not touch {thing}",
        "<edge> <opening> neither! {thing} nor! {thing2} <shall> [to] be <touched>": "do not touch {thing} and {thing2}",
        "<edge> <opening> (nobody!|no! one|none!) [may|should|must|can] (touches|moves|touch|move) {thing}": "do not touch {thing}",
        "<edge> <opening> i (do not|never!|would not) (want|like) {thing} [to be] <touched>": "do not touch {thing}",
        "(do not|i forbid you to|i would rather you did not) <ever> {touch:touch|move|disturb} {thing}": "do not {touch} {thing}",
        "<edge> <opening> under no! circumstances {touch:touch|move|disturb} {thing}": "do not {touch} {thing}",
        "never ever {touch:touch|move|disturb}": "never {touch}",
        "<edge> <opening> let {thing} be <edge>": "do not touch {thing}",
        "<start> (except!|apart from|other than|aside from) [for] {thing} ,": "do not touch {thing} ,",
        "<start> (except!|apart from|other than|aside from) [for] {thing} you": "do not touch {thing} , you",
        "(,|but) (except!|apart from) [for] {thing} <end>": ", do not touch {thing}",
        "leave {thing} alone and {thing2} <edge>": "do not touch {thing} and {thing2}",
        "(touch|move|use|handle) <nothing> <but> {thing}": "do not touch anything but {thing}",
        "(touching|moving|using|with) <nothing> <but> {thing}": ", do not touch anything but {thing}",
        "(using|touching|moving) solely {thing}": ", do not touch anything but {thing}",
        "<edge> <opening> [you (may|can|should|must|are allowed to)] solely <touch> {thing}": "do not touch anything but {thing}",
        "<edge> <opening> [you (may|can|should|must|are allowed to)] <touch> solely {thing}": "do not touch anything but {thing}",
        "<edge> <opening> [you (may|can|should|must|are allowed to)] <touch> {thing} solely <edge>": "do not touch anything but {thing}",
        "<edge> <opening> solely {thing} (may|can|should|must|is allowed to|are allowed to) (move|be <touched>)": "do not touch anything but {thing}",
        "<edge> <opening> <nothing> <but> {thing} (may|can|should|must) (move|be <touched>)": "do not touch anything but {thing}",
    },
    parts=_PARTS,
)
"""Ways of forbidding, each with one that the grammar has."""

_JOINTS = word_set("and but while so because since as when then for or either solely please")
"""Words between marks at which a clause may begin or end."""
_BEGIN = word_set("without avoiding leaving")
"""Words with which a clause may begin where nothing sets it apart."""
_CONDITIONS = word_set("if unless until till once whenever when after before in whether")
"""Words with which a clause begins that tells in what case, or till when, what is said beside it holds."""
_CASES = word_set("if unless whether until till in")
_REFERRING_BACK = word_set("unless until till except solely yet instead")
_DENYING = word_set("not never nothing nobody no neither without")
_TAKEN_BACK = word_set("wait actually sorry joking kidding nonsense anyway nevertheless oops scratch thought")
"""Words by which a prohibition before them may be taken back."""
_ASKING = word_set("can could will would please")
_SENTENCE_ENDS = frozenset(".;:!?")
_NEEDS_TAIL = word_set("keep leave keeping leaving")
_POINTING = word_set("it they them that those these one ones he she him her")
_WEAK = word_set("worry bother forget skip")
"""Words of what the grammar reads as a prohibition where nothing else is asked, and what may say that it does not matter."""
_LISTING = word_set("and or nor both")
_MAY_BIND = word_set(
    "not never no nothing nobody neither without leave leaving keep spare avoid avoiding alone hands stay stays remain remains off"
    " but except apart other stop quit refrain steer"
)
"""Words of which everything that binds has one."""
# "only" asks for nothing by itself where it stands for "but"; the tokens leave it out everywhere.
_ONLY = re.compile(
    r"\b(?:only|(?<=move )just|(?<=touch )just|(?<=use )just|(?<=using )just)\b(?!\s+\w+ly\b)", re.IGNORECASE
)


@dataclass(frozen=True, slots=True, kw_only=True)
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
    try:
        said = FORBIDDING.reworded(tokens_of(prompt, scene))
        return Bounds() if _MAY_BIND.isdisjoint(said.texts) else _Reader(said, scene, tuple(skills)).bounds()
    except (TooLongError, TooComplicatedError):
        return Bounds()


def tokens_of(prompt: str, scene: ObservedScene) -> Said:
    """Return the tokens of a sentence with "only" among them.

    Raises:
        TooLongError: It is longer than anybody would say.
    """
    return tokenized(_ONLY.sub("solely", prompt), scene)


class _Reader:
    """Finds what binds in the chart of a sentence."""

    def __init__(self, said: Said, scene: ObservedScene, skills: Sequence[str]) -> None:
        self._texts = said.texts
        self._grammar = said.grammar
        self._scene = scene
        self._skills = skills
        self._ids = {item.id for item in scene.objects}

    def bounds(self) -> Bounds:
        """Return what binds, prohibition by prohibition."""
        never, only = set[str](), set[str]()
        i = 0
        while i < len(self._texts):
            end, refs, alone = self._node(i)
            if refs and self._is_certain(i, end):
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
        if i == 0 or texts[i - 1] in MARKS or texts[i - 1] in _JOINTS or texts[i] in _BEGIN:
            nodes = [
                (end, refs)
                for end, part in self._grammar.part(i)
                for refs in [_spared(part)]
                if refs and self._ends(i, end, refs)
            ]
            if nodes:
                end, refs = max(nodes, key=lambda node: node[0])
                if _is_anything(refs[0]) and refs[0].without:
                    # "anything but the cube and the ball" allows both.
                    return end, (*refs[0].without, *refs[1:]), True
                return end, refs, False
        excepted = [
            (end, ref.without)
            for end, refs in self._grammar.np_list(i)
            for ref in refs[-1:]
            if ref.determiner == "all" and ref.without
        ]
        if excepted and _DENYING.isdisjoint(texts[self._clause(i)[0] : self._clause(i)[1]]):
            end, refs = max(excepted, key=lambda node: node[0])
            if not self._named_again(refs, i, end):
                return end, refs, False
        return i, (), False

    def _ends(self, start: int, end: int, refs: Sequence[Ref]) -> bool:
        """Say whether a clause may end where a prohibition does."""
        texts = self._texts
        if not _WEAK.isdisjoint(texts[start : start + 3]) or texts[start : start + 2] == ["never", "mind"]:
            return False
        if len(refs) > 1 and _LISTING.isdisjoint(texts[start:end]):
            # "forget the olive, the fig"
            return False
        if texts[start] in _NEEDS_TAIL and any(ref.relations for ref in refs):
            # "leave the box to the right of the brush" may say where it is to be.
            return False
        if end >= len(texts) or texts[end] in MARKS:
            return True
        if texts[end] not in _JOINTS or texts[end] in ("or", "solely", "please"):
            return False
        # "keep the ball and the cup together"
        bare = texts[start] in _NEEDS_TAIL and self._names(start + 1) and not self._grammar.tag(end - 1, "AVOID_TAIL")
        return not (bare and self._names(end + 1))

    def _names(self, i: int) -> bool:
        """Say whether a thing is named at a token."""
        return any(not ref.unknown for _, refs in self._grammar.np_list(i) for ref in refs)

    def _clause(self, i: int) -> tuple[int, int]:
        """Return where the clause around a token begins and ends."""
        texts = self._texts
        start = next((k for k in range(i, 0, -1) if texts[k - 1] in MARKS or texts[k - 1] in ("and", "then")), 0)
        end = next((k for k in range(i, len(texts)) if texts[k] in MARKS or texts[k] in ("and", "then")), len(texts))
        return start, end

    def _is_certain(self, start: int, end: int) -> bool:
        """Say whether nothing beside a prohibition tells that it holds in a case only, or takes it back."""
        texts = self._texts
        first = next((k + 1 for k in range(start - 1, -1, -1) if texts[k] in _SENTENCE_ENDS), 0)
        last = next((k for k in range(end, len(texts)) if texts[k] in _SENTENCE_ENDS), len(texts))
        begins = [k for k in range(first, last) if k == first or texts[k - 1] in MARKS or texts[k - 1] in _JOINTS]
        cases = [texts[k] for k in (*begins, end) if self._is_condition(k)]
        # "after that ..., never touch it"
        if [word for word in cases if texts[start] != "never" or word in _CASES]:
            return False
        if texts[last : last + 1] == ["?"] and texts[first] not in _ASKING:
            return False
        after = texts[end:]
        taken_back = not _TAKEN_BACK.isdisjoint(after) or any(
            after[k] == "no" and (k + 1 == len(after) or after[k + 1] in MARKS) for k in range(len(after))
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
        return frozenset(answer.candidates) if {*answer.candidates} <= self._ids else frozenset()

    def _named(self, start: int, end: int) -> tuple[frozenset[str], bool]:
        """Return the ids of all that is named between two tokens, and whether all that is named there is known."""
        named, all_known, k = set[str](), True, start
        while k < end:
            nodes = [node for node in self._grammar.np_list(k) if not any(ref.unknown for ref in node[1])]
            nodes.sort(key=lambda node: -node[0])
            found = next(((stop, ids) for stop, refs in nodes for ids in [self._resolved(refs, k)] if ids), None)
            all_known = all_known and (found is not None or not nodes)
            named.update(found[1] if found else ())
            k = found[0] if found else k + 1
        return frozenset(named), all_known


def _spared(parts: Sequence[Part]) -> tuple[Ref, ...]:
    """Return what a node of the grammar says is not to be touched, nothing where it says anything else."""
    if len(parts) != 1 or isinstance(parts[0], str):
        return ()
    part = parts[0]
    if not isinstance(part, Command):
        return part
    return part.objects if part.verb == "nothing" and part.negated == "move" and part.place is None else ()


def _points(ref: Ref) -> bool:
    """Say whether a description means what was spoken of before, or stands beside such a thing."""
    return ref.determiner == "it" or any(_points(other) for relation in ref.relations for other in relation.refs)


def _is_anything(ref: Ref) -> bool:
    """Say whether a description leaves nothing out but what it says that it does."""
    narrows = ref.colours or ref.shades or ref.ranks or ref.relations or ref.names or ref.shapes or ref.measures
    return ref.determiner in ("all", "bare", "a") and ref.nouns in ((), ("thing",)) and not narrows
